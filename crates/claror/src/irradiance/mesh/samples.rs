//! What the mesh takes from the samples.

use super::MeshSettings;
use super::surface::Hit;
use crate::irradiance::hemisphere::{Cell, Hemisphere};

/// Radiance per channel, and the scalar of the Hessian; all less their means, which change
/// nothing but rounding.
pub(super) type Radiance = [f64; 4];

/// The hit point of a cell.
pub(super) fn hit(cell: &Cell, far: f32) -> Hit {
    let miss = !cell.distance.is_finite();
    let distance = f64::from(if miss { far } else { cell.distance.max(f32::MIN_POSITIVE) });
    let direction = cell.direction.as_dvec3();
    let normal = cell.normal.as_dvec3();
    Hit { position: distance * direction, normal, distance, miss }
}

/// Of all cells.
pub(super) fn radiance(hemisphere: &Hemisphere, settings: &MeshSettings) -> Vec<Radiance> {
    let mean = hemisphere.irradiance() * std::f32::consts::FRAC_1_PI;
    let floor = settings.floor * std::f32::consts::FRAC_1_PI;
    let harmonic = hemisphere.harmonic_mean_distance();
    let geometric = f64::from(settings.geometry * (mean.luminance() + floor) * harmonic);
    let of = |cell: &Cell, subtract: Radiance| {
        let [r, g, b] = cell.radiance.to_array().map(f64::from);
        let mut scalar = f64::from(cell.radiance.luminance());
        if geometric > 0.0 && geometric.is_finite() {
            scalar += geometric / f64::from(cell.distance);
        }
        combine([r, g, b, scalar], subtract, |l, mean| l - mean)
    };
    let mut sum = [0.0; 4];
    for cell in &hemisphere.cells {
        sum = combine(sum, of(cell, [0.0; 4]), |s, l| s + l);
    }
    let mean = sum.map(|s| s / hemisphere.cells.len() as f64);
    hemisphere.cells.iter().map(|cell| of(cell, mean)).collect()
}

/// Channel by channel.
pub(super) fn combine(a: Radiance, b: Radiance, f: impl Fn(f64, f64) -> f64) -> Radiance {
    std::array::from_fn(|c| f(a[c], b[c]))
}

/// Linear interpolation: all of `b` at share 1.
pub(super) fn mean(a: Radiance, b: Radiance, share: f64) -> Radiance {
    combine(a, b, |a, b| a + share * (b - a))
}
