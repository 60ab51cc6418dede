//! How irradiance changes when the surface turns.

use std::f64::consts::PI;

use super::hemisphere::{Grid, Hemisphere};
use crate::math::{DVec2, Vec2};

/// Rotational gradient per channel, tangential and local, W·m⁻²·rad⁻¹ (Ward and Heckbert 1992).
///
/// Irradiance for the unit normal n near the record's nᵢ is `E + (nᵢ × n) · gradient`: a normal
/// that turns towards the light sees more of it. The weight, the tangent of the polar angle, is
/// averaged over each cell: at the sample itself it is unbounded, and much noisier.
pub fn rotational_gradient(hemisphere: &Hemisphere) -> [Vec2; 3] {
    let mut sum = [DVec2::ZERO; 3];
    for (k, cell) in hemisphere.cells.iter().enumerate() {
        let azimuth = cell.direction.truncate().as_dvec2().normalize_or_zero();
        // A quarter turn ahead of the azimuth.
        let ahead = azimuth.perp() * mean_tangent(hemisphere.grid, k as u32);
        for (sum, l) in sum.iter_mut().zip(cell.radiance.to_array()) {
            *sum += f64::from(l) * ahead;
        }
    }
    let scale = PI / hemisphere.cells.len() as f64;
    sum.map(|sum| (scale * sum).as_vec2())
}

/// Mean of the tangent of the polar angle over the cell of this index.
fn mean_tangent(grid: Grid, index: u32) -> f64 {
    let (columns, _) = grid.size();
    let (i, j) = (index % columns, index / columns);
    match grid {
        Grid::Polar { m, .. } => {
            // s = sin²θ is uniform in the ring.
            let integral = |j: u32| {
                let s = f64::from(j) / f64::from(m);
                s.sqrt().asin() - (s * (1.0 - s)).sqrt()
            };
            f64::from(m) * (integral(j + 1) - integral(j))
        }
        Grid::Concentric { n } => {
            // sin θ is the larger coordinate in the square, and uniform in the cell.
            let steps = |i: u32| (2 * i + 1).abs_diff(n);
            let middle = f64::from(steps(i).max(steps(j)));
            let (from, to) =
                ((middle - 1.0).max(0.0) / f64::from(n), (middle + 1.0) / f64::from(n));
            let cosine = |sine: f64| (1.0 - sine * sine).max(0.0).sqrt();
            (cosine(from) - cosine(to)) / (to - from)
        }
    }
}

/// Largest absolute second derivative of irradiance by the angle of turning, over all axes,
/// divided by the irradiance (luminance; 1/rad²). 0 when it is dark.
///
/// For a turn towards the tangent direction τ the second derivative is
/// `-E + ∮ L cos²(φ - φ_τ) dφ` along the horizon, for which the outermost cells stand.
pub fn rotational_curvature(hemisphere: &Hemisphere) -> f32 {
    let e = f64::from(hemisphere.irradiance().luminance());
    if e <= 0.0 {
        return 0.0;
    }
    // Fourier coefficients 0 and 2 of the horizon's radiance.
    let (mut constant, mut second) = (0.0, DVec2::ZERO);
    let (columns, rows) = hemisphere.grid.size();
    let arc = match hemisphere.grid {
        Grid::Concentric { n } => PI / (2.0 * f64::from(n)),
        Grid::Polar { n, .. } => 2.0 * PI / f64::from(n),
    };
    for (k, cell) in hemisphere.cells.iter().enumerate() {
        let (i, j) = (k as u32 % columns, k as u32 / columns);
        let sides = match hemisphere.grid {
            Grid::Concentric { n } => [i == 0, i + 1 == n, j == 0, j + 1 == n],
            Grid::Polar { .. } => [j + 1 == rows, false, false, false],
        };
        let sides = sides.into_iter().filter(|&side| side).count();
        if sides == 0 {
            continue;
        }
        let l = f64::from(cell.radiance.luminance()) * arc * sides as f64;
        let azimuth = cell.direction.truncate().as_dvec2().normalize_or_zero();
        constant += l;
        second += l * DVec2::new(
            azimuth.x * azimuth.x - azimuth.y * azimuth.y,
            2.0 * azimuth.x * azimuth.y,
        );
    }
    let amplitude = second.length();
    let extreme = |sign: f64| ((0.5 * (constant + sign * amplitude) - e) / e).abs();
    extreme(1.0).max(extreme(-1.0)) as f32
}

/// Angle between normals up to which first order is good for the relative error `epsilon`, radians:
/// √(2ε/κ) for the curvature κ, between the bounds.
pub fn angular_support(curvature: f32, epsilon: f32, bounds: [f32; 2]) -> f32 {
    // A curvature of 0 gives an infinite angle, hence the upper bound.
    (2.0 * epsilon / curvature).sqrt().min(bounds[1]).max(bounds[0])
}
