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
            overlap: match radius.criterion {
                Criterion::Hessian => 1.2,
                Criterion::Krivanek06 => 1.4,
                _ => 1.0,
            },
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

/// Height of a step, in short radii, over which nothing of the smooth kernel reaches. Between points
/// of one plane or one sphere the distance to the mean tangent plane is 0; where it is not, there
/// are two surfaces, of which one may be in the light of a window and the other in its shade.
const STEP: f32 = 0.1;

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
#[inline(always)]
pub fn weight(record: &Record, query: &Query, settings: &LookupSettings) -> Option<(f32, f32)> {
    let delta = query.p - record.position;
    let distance2 = delta.length_squared();
    let [short, long] = record.radii;
    let far = settings.overlap * long;
    let cosine = query.n_smooth.dot(record.normal);
    if !(distance2 < far * far && cosine > 0.0) {
        return None;
    }
    let height = height(record, query, delta);
    if is_in_front(record, query, height, settings) {
        return None;
    }
    let turned = (1.0 - cosine).max(0.0);
    let w = kernel(record, delta, height, turned, settings);
    let w = if record.flags & Record::CREVICE != 0 {
        let excess = (settings.fade * record.natural_radius / short).min(1.0);
        w * excess * excess
    } else {
        w
    };
    (w > 0.0).then_some((w, distance2))
}

/// The weight by offset and by one minus the cosine between the normals; 0 outside of the region.
#[inline(always)]
fn kernel(
    record: &Record,
    delta: Vec3,
    height: f32,
    turned: f32,
    settings: &LookupSettings,
) -> f32 {
    let short = record.radii[0];
    match settings.weight {
        Weight::Smooth => smooth(record, delta, height, turned, settings.overlap),
        Weight::Tent => {
            let t2 = delta.length_squared() / (settings.overlap * short).powi(2);
            1.0 - t2.max(turned / one_minus_cos(record.max_angle)).sqrt()
        }
        Weight::InverseError { accuracy } => {
            let distance2 = delta.length_squared();
            let error = accuracy * (distance2.sqrt() / short) + turned.sqrt();
            // The angle of this error itself is the largest by default.
            let too_far_turned = turned > ONE_AND_A_BIT * one_minus_cos(record.max_angle);
            if error >= settings.overlap * accuracy
                || too_far_turned
                || distance2 >= (settings.overlap * short).powi(2)
            {
                return 0.0;
            }
            1.0 / error.max(LEAST_ERROR)
        }
    }
}

/// Why a record does not serve a query, in the order of the tests.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Rejection {
    /// It is too far away, whatever its normal.
    Far,
    /// It faces elsewhere, and would not serve even at its own position.
    Turned,
    /// It lies in front of the query.
    InFront,
    /// Distance and angle together leave it no weight.
    Weightless,
}

/// Why [`weight`] gives no weight; `None` where it does.
pub fn rejection(record: &Record, query: &Query, settings: &LookupSettings) -> Option<Rejection> {
    if weight(record, query, settings).is_some() {
        return None;
    }
    let delta = query.p - record.position;
    let far = settings.overlap * record.radii[1];
    let cosine = query.n_smooth.dot(record.normal);
    let is_weightless = |delta: Vec3, turned: f32| {
        let weight = kernel(record, delta, 0.0, turned, settings);
        weight.is_nan() || weight <= 0.0
    };
    Some(if delta.length_squared() >= far * far || is_weightless(delta, 0.0) {
        Rejection::Far
    } else if cosine <= 0.0 || is_weightless(Vec3::ZERO, (1.0 - cosine).max(0.0)) {
        Rejection::Turned
    } else if is_in_front(record, query, height(record, query, delta), settings) {
        Rejection::InFront
    } else {
        Rejection::Weightless
    })
}

/// Of the query over the mean tangent plane of both.
#[inline(always)]
fn height(record: &Record, query: &Query, delta: Vec3) -> f32 {
    0.5 * delta.dot(query.n_smooth + record.normal)
}

/// Whether the record may see past what shadows the query.
#[inline(always)]
fn is_in_front(record: &Record, query: &Query, height: f32, settings: &LookupSettings) -> bool {
    let tolerance = if settings.in_front > 0.0 {
        let rounding = ULPS * f32::EPSILON * query.p.abs().max_element();
        (settings.in_front * record.radii[0]).max(rounding)
    } else {
        0.0
    };
    height < -tolerance
}

#[inline(always)]
fn smooth(record: &Record, delta: Vec3, height: f32, turned: f32, overlap: f32) -> f32 {
    let [short, long] = record.radii;
    let u = delta.dot(record.axis);
    let h = delta.dot(record.normal);
    let across2 = (delta.length_squared() - u * u - h * h).max(0.0);
    let ratio = short / long;
    let distance2 = u * u
        + across2 * (ratio * ratio)
        + h * h * (1.0 / (THICKNESS * THICKNESS))
        + height * height * (1.0 / (STEP * STEP));
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
