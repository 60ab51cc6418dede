//! How irradiance changes when the surface turns.

use std::f64::consts::PI;

use super::hemisphere::{Grid, Hemisphere};
use crate::math::{DVec2, Vec2};

/// Tangents of polar angles are clamped here: the horizon has little light, but much variance.
const MAX_TANGENT: f64 = 11.430_052_302_761_343; // tan 85°

/// Rotational gradient per channel, tangential and local, W·m⁻²·rad⁻¹ (Ward and Heckbert 1992).
///
/// Irradiance for the unit normal n near the record's nᵢ is `E + (nᵢ × n) · gradient`: a normal
/// that turns towards the light sees more of it.
pub fn rotational_gradient(hemisphere: &Hemisphere) -> [Vec2; 3] {
    let mut sum = [DVec2::ZERO; 3];
    for cell in &hemisphere.cells {
        let d = cell.direction.as_dvec3();
        let sine = d.x.hypot(d.y);
        if sine == 0.0 {
            continue;
        }
        let tangent = if d.z > 0.0 { (sine / d.z).min(MAX_TANGENT) } else { MAX_TANGENT };
        // The unit vector a quarter turn ahead of the azimuth.
        let ahead = DVec2::new(-d.y, d.x) / sine * tangent;
        for (sum, l) in sum.iter_mut().zip(cell.radiance.to_array()) {
            *sum += f64::from(l) * ahead;
        }
    }
    let scale = PI / hemisphere.cells.len() as f64;
    sum.map(|sum| (scale * sum).as_vec2())
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
