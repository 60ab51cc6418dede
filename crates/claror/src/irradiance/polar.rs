//! The translational gradient of Ward and Heckbert (1992: Irradiance gradients).

use std::f64::consts::TAU;

use super::hemisphere::{Grid, Hemisphere};
use crate::math::{DVec2, Vec2};

/// Translational gradient per channel, tangential and local, W·m⁻³; `None` unless the grid is
/// polar.
///
/// The border between two cells belongs to the nearer of their surfaces and moves with it, when
/// the receiver does. Borders are known to the accuracy of a cell only, so that the estimate is
/// too large near walls; its direction is right.
pub fn ward_heckbert_gradient(hemisphere: &Hemisphere) -> Option<[Vec2; 3]> {
    let Grid::Polar { m, n } = hemisphere.grid else {
        return None;
    };
    let cell = |k: u32, j: u32| &hemisphere.cells[(j * n + k) as usize];
    let mut sum = [DVec2::ZERO; 3];
    let mut add = |along: DVec2, factor: f64, a: (u32, u32), b: (u32, u32)| {
        let (a, b) = (cell(a.0, a.1), cell(b.0, b.1));
        let motion = factor / f64::from(a.distance.min(b.distance));
        let (la, lb) = (a.radiance.to_array(), b.radiance.to_array());
        for c in 0..3 {
            sum[c] += motion * (f64::from(la[c]) - f64::from(lb[c])) * along;
        }
    };
    let width = TAU / f64::from(n);
    for k in 0..n {
        let centre = DVec2::from_angle(width * (f64::from(k) + 0.5));
        let border = DVec2::from_angle(width * f64::from(k)).perp();
        for j in 0..m {
            let below = f64::from(j) / f64::from(m);
            if j > 0 {
                let factor = width * below.sqrt() * (1.0 - below);
                add(centre, factor, (k, j), (k, j - 1));
            }
            let above = f64::from(j + 1) / f64::from(m);
            add(border, above.sqrt() - below.sqrt(), (k, j), ((k + n - 1) % n, j));
        }
    }
    Some(sum.map(|s| s.as_vec2()))
}
