//! How far a record can be used.

use super::corral::{SECTORS, corral, rim_distances};
use super::hemisphere::Hemisphere;
use super::mesh::luminance_gradient;
use super::record::{Record, to_world};
use super::rotational::{angular_support, rotational_curvature};
use crate::math::{Frame, Vec2, Vec3};
use crate::spectrum::Rgb;

/// The published ways to decide.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Criterion {
    /// Arithmetic mean distance, 1/e weight, no gradients, in-front test without tolerance. Wrong
    /// on purpose: the mistake that is most often made, kept to show what it does.
    Thesis,
    /// Harmonic mean distance, 1/e weight (Ward, Rubinstein and Clear 1988).
    Ward88,
    /// The same with gradients (Ward and Heckbert 1992).
    Ward92,
    /// Half of the minimum distance (Tabellion and Lamorlette 2004).
    Tabellion04,
    /// Harmonic mean distance limited by the gradient, smooth kernel; made for clamping by
    /// neighbours (Křivánek et al. 2006).
    Krivanek06,
    /// From the second derivatives (Schwarzhaupt, Jensen and Jarosz 2012).
    Hessian,
}

impl Criterion {
    /// All of them, from the oldest to the newest.
    pub const ALL: [Self; 6] = [
        Self::Thesis,
        Self::Ward88,
        Self::Ward92,
        Self::Tabellion04,
        Self::Krivanek06,
        Self::Hessian,
    ];

    /// As scene files and the command line call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Thesis => "thesis",
            Self::Ward88 => "ward88",
            Self::Ward92 => "ward92",
            Self::Tabellion04 => "tabellion04",
            Self::Krivanek06 => "krivanek06",
            Self::Hessian => "hessian",
        }
    }

    /// Whether records are extrapolated by their gradients.
    pub fn uses_gradients(self) -> bool {
        !matches!(self, Self::Thesis | Self::Ward88)
    }
}

/// What becomes of records in crevices, whose natural radius is far below the lower bound. They
/// see the inside of a crevice, their neighbours do not: spread over the lower bound they darken
/// what they know nothing about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CreviceRule {
    /// They are treated as all others.
    Off,
    /// No record's radius is raised above `spread` times its natural one. Points between such
    /// records find none and get an estimate of their own. The number of records stays finite:
    /// there is at most one for every point that asks.
    Shrink {
        /// Largest factor by which the lower bound may raise a radius; at least 1.
        spread: f32,
    },
    /// Where the lower bound raised the radius by more than `spread`, the record's weight falls
    /// with the square of the excess, so that any ordinary neighbour outvotes it.
    Fade {
        /// Factor by which the lower bound may raise a radius without loss of weight; at least 1.
        spread: f32,
    },
}

/// Largest factor by which the lower bound may raise a radius by default: a record a quarter of
/// the lower bound wide in truth is still allowed to fill it.
const DEFAULT_SPREAD: f32 = 4.0;

/// Parameters of [`radii`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RadiusSettings {
    /// The rule.
    pub criterion: Criterion,
    /// Ward's accuracy, dimensionless: all rules but `Hessian`. Radii are this times the distance;
    /// with `Tabellion04` it is the inverse of their quality.
    pub accuracy: f32,
    /// Relative interpolation error ε of `Hessian`, dimensionless.
    pub epsilon: f32,
    /// Exponent η of `Hessian`: 1/4 minimises the mean error, 1/2 bounds the largest one.
    pub exponent: f32,
    /// Elliptic regions with `Hessian`; circles of the short radius otherwise.
    pub ellipse: bool,
    /// Largest ratio of the radii of an ellipse.
    pub max_ratio: f32,
    /// Limit radii with `Hessian` by the harmonic mean distance.
    pub limit_by_distance: bool,
    /// Limit radii by irradiance over gradient, so that the linear model stays positive.
    pub limit_by_gradient: bool,
    /// Angular support, radians: least and largest. All criteria but `Hessian` use the largest.
    pub angles: [f32; 2],
    /// Irradiance E₀ (W·m⁻²) added to the record's own in relative errors, against endless
    /// refinement in the dark; fixed before the first record, and proportional to the light.
    pub dark: f32,
    /// What to do with records in crevices.
    pub crevice: CreviceRule,
}

impl RadiusSettings {
    /// What is recommended with a criterion.
    pub fn new(criterion: Criterion) -> Self {
        let degrees = f32::to_radians;
        let accuracy = if criterion == Criterion::Tabellion04 { 1.0 } else { 0.2 };
        let angle = match criterion {
            Criterion::Hessian | Criterion::Krivanek06 => degrees(20.0),
            // The other weights imply their own.
            Criterion::Tabellion04 => degrees(10.0),
            Criterion::Thesis | Criterion::Ward88 | Criterion::Ward92 => ward_angle(accuracy),
        };
        let modern = matches!(criterion, Criterion::Hessian | Criterion::Krivanek06);
        Self {
            criterion,
            accuracy,
            epsilon: 0.1,
            exponent: 0.25,
            ellipse: false,
            max_ratio: 2.0,
            limit_by_distance: true,
            limit_by_gradient: modern,
            angles: [angle; 2],
            dark: 0.0,
            crevice: if modern {
                CreviceRule::Shrink { spread: DEFAULT_SPREAD }
            } else {
                CreviceRule::Off
            },
        }
    }
}

impl RadiusSettings {
    /// The second derivative of irradiance relative to it, in scene units⁻², that makes records of
    /// this natural radius: the inverse of how that is chosen. `reference` as in [`RadiusBounds`].
    pub fn curvature(&self, natural: f32, reference: f32) -> f32 {
        if self.criterion == Criterion::Hessian {
            let ratio = (reference / natural).powf(1.0 / self.exponent);
            2.0 * self.epsilon * ratio / (reference * reference)
        } else {
            2.0 * self.accuracy / (natural * natural)
        }
    }
}

/// Angle at which the rotational part of Ward's error reaches `accuracy`.
pub fn ward_angle(accuracy: f32) -> f32 {
    (1.0 - accuracy * accuracy).max(-1.0).acos()
}

/// Lengths that depend on where the record is, scene units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RadiusBounds {
    /// Least radius, a few pixels; positive, or there is no end of records in corners.
    pub least: f32,
    /// Largest radius.
    pub largest: f32,
    /// Reference length ℓ of `Hessian`, some ten pixels: at this radius the error at the rim is ε.
    pub reference: f32,
}

/// A record's region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Radii {
    /// Short and long, scene units.
    pub radii: [f32; 2],
    /// The short one before bounds.
    pub natural: f32,
    /// Unit local tangent of the short one.
    pub axis: Vec2,
    /// Angular support, radians.
    pub max_angle: f32,
    /// Factor for the translational gradient: below 1 where the lower bound raised the radius,
    /// because extrapolation would overshoot there.
    pub gradient_scale: f32,
    /// Flags of [`Record`].
    pub flags: u32,
}

/// What is known of a record's surroundings, in its local frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimates {
    /// Irradiance, W·m⁻².
    pub irradiance: Rgb,
    /// Translational gradient per channel, W·m⁻³.
    pub translational: [Vec2; 3],
    /// Rotational gradient per channel, W·m⁻²·rad⁻¹.
    pub rotational: [Vec2; 3],
    /// Second derivatives xx, xy, yy of the luminance, W·m⁻⁴.
    pub hessian: [f32; 3],
    /// Harmonic mean distance, scene units.
    pub harmonic_mean_distance: f32,
    /// Arithmetic mean distance, scene units.
    pub arithmetic_mean_distance: f32,
    /// Minimum distance, scene units, robust or not.
    pub minimum_distance: f32,
    /// Largest second derivative by turning, divided by the irradiance, 1/rad².
    pub rotational_curvature: f32,
    /// See [`super::rim_distances`].
    pub rim: [f32; SECTORS as usize],
}

impl Estimates {
    /// All that follows from the samples alone; the caller adds the derivatives by position.
    pub fn new(hemisphere: &Hemisphere) -> Self {
        Self {
            irradiance: hemisphere.irradiance(),
            translational: [Vec2::ZERO; 3],
            rotational: super::rotational_gradient(hemisphere),
            hessian: [0.0; 3],
            harmonic_mean_distance: hemisphere.harmonic_mean_distance(),
            arithmetic_mean_distance: hemisphere.arithmetic_mean_distance(),
            minimum_distance: hemisphere.robust_minimum_distance(),
            rotational_curvature: rotational_curvature(hemisphere),
            rim: rim_distances(hemisphere),
        }
    }

    /// The record at a point with a frame (world space) around its normal.
    pub fn record(&self, key: u64, position: Vec3, frame: &Frame, radii: &Radii) -> Record {
        let Frame { s, t, n } = *frame;
        let translational = self.translational.map(|g| g * radii.gradient_scale);
        let (corral, corral_distance) = corral(&self.rim, radii.axis, radii.radii[1]);
        Record {
            key,
            position,
            normal: n,
            axis: s * radii.axis.x + t * radii.axis.y,
            irradiance: self.irradiance,
            translational: to_world(&translational, s, t),
            rotational: to_world(&self.rotational, s, t),
            radii: radii.radii,
            max_angle: radii.max_angle,
            harmonic_mean_distance: self.harmonic_mean_distance,
            natural_radius: radii.natural,
            flags: radii.flags,
            corral,
            corral_distance,
        }
    }
}

/// Eigenvalues of a symmetric 2 × 2 matrix (xx, xy, yy), the one of larger absolute value first,
/// and the unit eigenvector of that one.
pub fn eigenvalues(matrix: [f32; 3]) -> ([f32; 2], Vec2) {
    let [xx, xy, yy] = matrix.map(f64::from);
    let (mean, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
    let q = half.hypot(xy);
    let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
    let (sin, cos) = angle.sin_cos();
    let (first, second) = (mean + q, mean - q);
    if mean >= 0.0 {
        ([first as f32, second as f32], Vec2::new(cos as f32, sin as f32))
    } else {
        ([second as f32, first as f32], Vec2::new(-sin as f32, cos as f32))
    }
}

/// The region in which a record can be used.
pub fn radii(estimates: &Estimates, bounds: &RadiusBounds, settings: &RadiusSettings) -> Radii {
    let mut flags = 0;
    let (mut natural, axis) = natural_radii(estimates, bounds, settings);
    if settings.limit_by_gradient {
        let level = estimates.irradiance.luminance() + settings.dark;
        let limit = level / luminance_gradient(&estimates.translational).length();
        if limit < natural[0] {
            natural[0] = limit;
            if !settings.ellipse {
                natural[1] = limit;
            }
            flags |= Record::GRADIENT_LIMITED;
        }
    }
    if natural[1] > settings.max_ratio * natural[0] {
        flags |= Record::RATIO_LIMITED;
    }
    natural[1] = natural[1].min(settings.max_ratio * natural[0]).max(natural[0]);
    let least = match settings.crevice {
        CreviceRule::Off => bounds.least,
        CreviceRule::Shrink { spread } | CreviceRule::Fade { spread } => {
            let fills = natural[0] * spread;
            if fills < bounds.least {
                flags |= Record::CREVICE;
            }
            let shrinks = matches!(settings.crevice, CreviceRule::Shrink { .. });
            if shrinks { bounds.least.min(fills) } else { bounds.least }
        }
    };
    let clamp = |r: f32| r.min(bounds.largest).max(least);
    if natural[0] < bounds.least {
        flags |= Record::RAISED;
    }
    if natural[0] > bounds.largest {
        flags |= Record::LOWERED;
    }
    let radii = [clamp(natural[0]), clamp(natural[1])];
    // A radius of 0 makes a record without a region, which is not stored.
    let gradient_scale = if natural[0] < radii[0] { natural[0] / radii[0] } else { 1.0 };
    Radii {
        radii,
        natural: natural[0],
        axis,
        max_angle: max_angle(estimates, settings),
        gradient_scale,
        flags,
    }
}

fn max_angle(estimates: &Estimates, settings: &RadiusSettings) -> f32 {
    if settings.criterion == Criterion::Hessian {
        angular_support(estimates.rotational_curvature, settings.epsilon, settings.angles)
    } else {
        settings.angles[1]
    }
}

/// Radii, the smaller first, and the axis of that one.
fn natural_radii(
    estimates: &Estimates,
    bounds: &RadiusBounds,
    settings: &RadiusSettings,
) -> ([f32; 2], Vec2) {
    let a = settings.accuracy;
    let radius = match settings.criterion {
        Criterion::Thesis => a * estimates.arithmetic_mean_distance,
        Criterion::Ward88 | Criterion::Ward92 | Criterion::Krivanek06 => {
            a * estimates.harmonic_mean_distance
        }
        Criterion::Tabellion04 => 0.5 * a * estimates.minimum_distance,
        Criterion::Hessian => return hessian_radii(estimates, bounds.reference, settings),
    };
    ([radius; 2], Vec2::X)
}

fn hessian_radii(
    estimates: &Estimates,
    reference: f32,
    settings: &RadiusSettings,
) -> ([f32; 2], Vec2) {
    let (eigenvalues, axis) = eigenvalues(estimates.hessian);
    let level = estimates.irradiance.luminance() + settings.dark;
    let radius = |eigenvalue: f32| {
        let curvature = eigenvalue.abs() / level * reference * reference;
        // In complete darkness nothing changes: 0/0.
        let curvature = if curvature.is_nan() { 0.0 } else { curvature };
        let r = reference * (2.0 * settings.epsilon / curvature).powf(settings.exponent);
        if settings.limit_by_distance { r.min(estimates.harmonic_mean_distance) } else { r }
    };
    let short = radius(eigenvalues[0]);
    let long = if settings.ellipse { radius(eigenvalues[1]) } else { short };
    ([short, long], axis)
}

/// A radius limited by a neighbour's: distances to geometry differ by no more than the points'
/// distance (Křivánek et al. 2006). All in scene units; both radii are the ones before clamping,
/// so that the order of the pairs does not matter. `slope` 1 holds for minimum distances; 2 is
/// better for other radii, which are not bound by it.
pub fn clamped_by_neighbour(radius: f32, neighbour: f32, distance: f32, slope: f32) -> f32 {
    radius.min(neighbour + slope * distance)
}
