//! Which records may serve a query, and with which weight.

use super::criterion::{CreviceRule, Criterion, RadiusSettings};
use super::record::Record;
use crate::math::Vec3;

/// Where irradiance is asked for, world space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Query {
    /// The point.
    pub p: Vec3,
    /// Unit interpolated normal on the side of the viewer, without bumps: it decides which records
    /// are valid.
    pub n_smooth: Vec3,
    /// Unit normal with bumps, for which irradiance is asked.
    pub n_shading: Vec3,
}

/// Weight of a record by distance and angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Weight {
    /// The inverse of Ward's error, which jumps from 1/accuracy to 0 at the rim (Ward, Rubinstein
    /// and Clear 1988).
    InverseError {
        /// Largest error.
        accuracy: f32,
    },
    /// Falls linearly with the larger of the relative distance and angle (Tabellion and Lamorlette
    /// 2004).
    Tent,
    /// (1 - t²)²(1 - s²)² of the relative distance t and angle s: without seams at the rim.
    Smooth,
}

/// Least error in [`Weight::InverseError`], so that a record's own position has a finite weight.
const LEAST_ERROR: f32 = 1e-6;
/// Above 1 by more than rounding.
const ONE_AND_A_BIT: f32 = 1.0 + 1e-3;
/// Tolerances are at least this many units in the last place of the coordinates.
const ULPS: f32 = 4.0;

/// Parameters of look-ups.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LookupSettings {
    /// The weight.
    pub weight: Weight,
    /// Extrapolate records by their gradients.
    pub gradients: bool,
    /// Share of the neighbours' mean gradient in the extrapolation, 0 to 1. At one half the second
    /// order terms of neighbours cancel, as in the trapezoidal rule.
    pub mix: f32,
    /// Records serve this factor farther than their radii say, for a smooth transition.
    pub overlap: f32,
    /// A point is served only when the weights sum to this.
    pub min_weight: f32,
    /// How far, in radii of the record, a query may lie behind the mean tangent plane of both.
    pub in_front: f32,
    /// Use only that many records, the nearest ones; 0 for all. A mistake of old caches.
    pub nearest: u32,
    /// Bounds of an extrapolated value, relative to the record's own.
    pub clamp: [f32; 2],
    /// The spread of [`CreviceRule::Fade`]; infinite with other rules.
    pub fade: f32,
}

impl LookupSettings {
    /// What goes with a criterion's radii.
    pub fn new(radius: &RadiusSettings) -> Self {
        let smooth = matches!(radius.criterion, Criterion::Hessian | Criterion::Krivanek06);
        let thesis = radius.criterion == Criterion::Thesis;
        Self {
            weight: match radius.criterion {
                Criterion::Hessian | Criterion::Krivanek06 => Weight::Smooth,
                Criterion::Tabellion04 => Weight::Tent,
                Criterion::Thesis | Criterion::Ward88 | Criterion::Ward92 => {
                    Weight::InverseError { accuracy: radius.accuracy }
                }
            },
            gradients: radius.criterion.uses_gradients(),
            mix: if smooth { 0.5 } else { 0.0 },
            overlap: if smooth { 1.4 } else { 1.0 },
            min_weight: if smooth { 0.5 } else { 0.0 },
            in_front: if thesis { 0.0 } else { 0.01 },
            nearest: 0,
            clamp: [0.05, 20.0],
            fade: match radius.crevice {
                CreviceRule::Fade { spread } => spread,
                CreviceRule::Off | CreviceRule::Shrink { .. } => f32::INFINITY,
            },
        }
    }

    /// How far records reach, for an index.
    pub fn reach(&self) -> Reach {
        let thickness = if self.weight == Weight::Smooth { THICKNESS } else { 1.0 };
        Reach { factor: self.overlap, thickness }
    }
}

/// Extent along the normal, in short radii, of the region of the smooth kernel.
const THICKNESS: f32 = 0.5;

/// How far records reach: see [`Record::support`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// Factor of the radii.
    pub factor: f32,
    /// Extent along the normal in short radii.
    pub thickness: f32,
}

/// Weight of a record for a query, and the square of their distance; `None` when it must not be
/// used. The validity tests are Ward's, made independent of scale: the record must face the same
/// side, be near, and not lie in front of the query, where it may see past what shadows the query.
#[inline]
pub fn weight(record: &Record, query: &Query, settings: &LookupSettings) -> Option<(f32, f32)> {
    let delta = query.p - record.position;
    let distance2 = delta.length_squared();
    let [short, long] = record.radii;
    let far = settings.overlap * long;
    let cosine = query.n_smooth.dot(record.normal);
    if !(distance2 < far * far && cosine > 0.0) {
        return None;
    }
    let in_front = 0.5 * delta.dot(query.n_smooth + record.normal);
    let tolerance = if settings.in_front > 0.0 {
        let rounding = ULPS * f32::EPSILON * query.p.abs().max_element();
        (settings.in_front * short).max(rounding)
    } else {
        0.0
    };
    if in_front < -tolerance {
        return None;
    }
    let turned = (1.0 - cosine).max(0.0);
    let w = match settings.weight {
        Weight::Smooth => smooth(record, delta, turned, settings.overlap),
        Weight::Tent => {
            let t2 = distance2 / (settings.overlap * short).powi(2);
            1.0 - t2.max(turned / one_minus_cos(record.max_angle)).sqrt()
        }
        Weight::InverseError { accuracy } => {
            let error = accuracy * (distance2.sqrt() / short) + turned.sqrt();
            // The angle of this error itself is the largest by default.
            let too_far_turned = turned > ONE_AND_A_BIT * one_minus_cos(record.max_angle);
            if error >= settings.overlap * accuracy
                || too_far_turned
                || distance2 >= (settings.overlap * short).powi(2)
            {
                return None;
            }
            1.0 / error.max(LEAST_ERROR)
        }
    };
    let w = if record.flags & Record::CREVICE != 0 {
        let excess = (settings.fade * record.natural_radius / short).min(1.0);
        w * excess * excess
    } else {
        w
    };
    (w > 0.0).then_some((w, distance2))
}

#[inline]
fn smooth(record: &Record, delta: Vec3, turned: f32, overlap: f32) -> f32 {
    let [short, long] = record.radii;
    let u = delta.dot(record.axis);
    let h = delta.dot(record.normal);
    let across2 = (delta.length_squared() - u * u - h * h).max(0.0);
    let ratio = short / long;
    let distance2 = u * u + across2 * (ratio * ratio) + h * h * (1.0 / (THICKNESS * THICKNESS));
    let reach2 = overlap * overlap * short * short;
    let largest = one_minus_cos(record.max_angle);
    if distance2 < reach2 && turned < largest {
        let product = (1.0 - distance2 / reach2) * (1.0 - turned / largest);
        product * product
    } else {
        0.0
    }
}

/// 1 - cos x, for 0 ≤ x ≤ π/2 to 10⁻⁴, without cancellation. With the square of the relative chord
/// in place of the relative angle, kernels need no inverse cosine.
#[inline]
fn one_minus_cos(x: f32) -> f32 {
    let x2 = x * x;
    x2 * (0.5 - x2 * (1.0 / 24.0 - x2 * (1.0 / 720.0 - x2 * (1.0 / 40_320.0))))
}
