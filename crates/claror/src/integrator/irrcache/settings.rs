//! Parameters of `irrcache`, and what follows from them.
//!
//! What a criterion's paper says about the rest of the method is taken where nothing else is
//! said: those parameters are `None` by default.

use crate::emitter::Sky;
use crate::irradiance::{
    CreviceRule, Criterion, IndexKind, LookupSettings, RadiusSettings, ward_angle,
};

/// Where the light comes from that a record's rays find.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Bounces {
    /// Random walks: unbiased.
    Path,
    /// Random walks that end where they have gone far enough, at a coarse average of the
    /// irradiance there: much less noise, a little bias.
    #[default]
    Hash,
    /// Random walks that end at a second, coarser cache, whose own records use [`Bounces::Path`].
    Cache,
}

impl Bounces {
    /// All of them, the default first.
    pub const ALL: [Self; 3] = [Self::Hash, Self::Path, Self::Cache];

    /// As scene files and the command line call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Path => "path",
            Self::Hash => "hash",
            Self::Cache => "cache",
        }
    }
}

/// Parameters of `irrcache`: [`super::PARAMETERS`] explains them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IrrCacheSettings {
    /// How far records can be used.
    pub criterion: Criterion,
    /// Relative interpolation error, for [`Criterion::Hessian`].
    pub error: f32,
    /// Ward's accuracy, for the others.
    pub accuracy: Option<f32>,
    /// Divides both.
    pub quality: f32,
    /// Exponent of the error in [`Criterion::Hessian`]'s radii.
    pub exponent: f32,
    /// Elliptic regions, for the same.
    pub ellipse: bool,
    /// Relative standard error of a record that is worth more rays.
    pub noise: Option<f32>,
    /// Rays of a record.
    pub gather_samples: Option<u32>,
    /// Least radius, pixels.
    pub min_pixel_spacing: Option<f32>,
    /// Largest radius, pixels.
    pub max_pixel_spacing: f32,
    /// Least radius, scene units; 0: in pixels.
    pub min_radius: f32,
    /// Largest radius, scene units; 0: in pixels.
    pub max_radius: f32,
    /// Scene's size over the least radius before it is scaled by the accuracy; 0: in pixels.
    pub ambient_resolution: f32,
    /// Largest angle between the normals of a record and a point that it serves, degrees.
    pub max_angle: Option<f32>,
    /// Largest factor by which the least radius raises others; 0: as large as it must be.
    pub crevice_spread: Option<f32>,
    /// Records shrink where neighbours know of near geometry.
    pub clamp_neighbor: Option<bool>,
    /// Records are made before the picture.
    pub overture: Option<bool>,
    /// Points near which something stands ask whether it hides a record.
    pub leak_protection: Option<bool>,
    /// Structure in which records are found.
    pub index: Option<IndexKind>,
    /// Only so many records, the nearest ones, serve a point; 0: all.
    pub nearest: Option<u32>,
    /// Factor by which records serve farther than their radii.
    pub overlap: Option<f32>,
    /// Within how many radii records even out their noise; 0: not at all.
    pub smoothing: Option<f32>,
    /// Samples of the picture look for what is too near for records.
    pub contact_shadows: Option<bool>,
    /// Sum of weights from which on a point is served in the first pass.
    pub min_weight: Option<f32>,
    /// How far a record may lie in front of a point, radii.
    pub in_front: Option<f32>,
    /// Records are extrapolated by their gradients.
    pub gradients: Option<bool>,
    /// Share of the neighbours' mean gradient in that.
    pub mix: Option<f32>,
    /// Light at the ends of a record's rays.
    pub bounces: Bounces,
    /// Whether records hold direct light from the sky.
    pub sky: Sky,
    /// Take the noise of light sampling out of direct light where lights have closed forms.
    pub analytic_direct: bool,
    /// Share of look-ups that are corrected by a random walk, 0 to 1.
    pub debias: f32,
    /// Whether the records are to be shown in a picture of their own.
    pub show_points: bool,
}

/// With this error and so many rays per record, and so many samples in the pixels that need them,
/// the Cornell box has least squared error times time. What each part adds to the error changes
/// with the rays and samples by about the powers of the error that are used below.
const DEFAULT_ERROR: f32 = 0.05;
const DEFAULT_SAMPLES: f32 = 576.0;
const DEFAULT_PIXEL_SAMPLES: f32 = 512.0;
/// Samples of a pixel lie on a grid, so that its error falls faster than that of independent ones.
const PIXEL_SAMPLES_EXPONENT: f32 = 0.8;
const DEFAULT_NOISE: f32 = 0.2;
const DEFAULT_SPACING: f32 = 3.0;

/// The overlap with `hessian`: with finer settings records reach a little farther, since the error
/// then comes less from their distances than the exponent of their radii says.
const OVERLAP_EXPONENT: f32 = 0.07;

/// Reach of smoothing with `hessian`, radii: with more nothing is gained.
const SMOOTHING: f32 = 3.0;

/// Sum of weights from which on points are served by a complete cache.
const LEAST_WEIGHT: f32 = 0.25;
/// How many records the oldest programs interpolated between.
const THESIS_NEAREST: u32 = 4;
/// Normals that differ by more belong to different sides.
const MAX_ANGLE: f32 = 90.0;

impl IrrCacheSettings {
    /// Sensible numbers of rays of a record.
    pub const GATHER_SAMPLES: std::ops::RangeInclusive<u32> = 16..=65_536;

    /// How far records reach.
    pub(super) fn radius(&self) -> RadiusSettings {
        let usual = RadiusSettings::new(self.criterion);
        let accuracy = self.accuracy() / self.quality;
        let angles = match (self.max_angle, self.criterion) {
            (Some(angle), _) => [angle.to_radians(); 2],
            (None, Criterion::Thesis | Criterion::Ward88 | Criterion::Ward92) => {
                [ward_angle(accuracy); 2]
            }
            (None, _) => usual.angles,
        };
        let crevice = match self.crevice_spread {
            None => usual.crevice,
            Some(spread) if spread >= 1.0 => CreviceRule::Shrink { spread },
            Some(_) => CreviceRule::Off,
        };
        RadiusSettings {
            epsilon: self.error / self.quality,
            accuracy,
            exponent: self.exponent,
            ellipse: self.ellipse,
            angles,
            crevice,
            ..usual
        }
    }

    /// How they are looked up.
    pub(super) fn lookup(&self) -> LookupSettings {
        let usual = LookupSettings::new(&self.radius());
        let museum = if self.criterion == Criterion::Thesis { THESIS_NEAREST } else { 0 };
        LookupSettings {
            gradients: self.gradients.unwrap_or(usual.gradients),
            mix: self.mix.unwrap_or(usual.mix),
            overlap: self.overlap(usual.overlap),
            min_weight: self.min_weight.unwrap_or(usual.min_weight),
            in_front: self.in_front.unwrap_or(usual.in_front),
            nearest: self.nearest.unwrap_or(museum),
            ..usual
        }
    }

    /// How much farther than their radii records serve, at most `usual`.
    fn overlap(&self, usual: f32) -> f32 {
        let derived = match self.criterion {
            Criterion::Hessian => self.refinement().powf(OVERLAP_EXPONENT).clamp(1.0, usual),
            _ => usual,
        };
        self.overlap.unwrap_or(derived)
    }

    /// How a complete cache is looked up. There points are served also by a little weight: a record's
    /// far side is better than one ray.
    pub fn frozen_lookup(&self) -> LookupSettings {
        let lookup = self.lookup();
        LookupSettings { min_weight: lookup.min_weight.min(LEAST_WEIGHT), ..lookup }
    }

    /// Rays of a record: as many as the error is worth if none were set.
    pub fn gather_samples(&self) -> u32 {
        let derived = DEFAULT_SAMPLES * self.refinement().sqrt();
        let (least, most) = (*Self::GATHER_SAMPLES.start(), *Self::GATHER_SAMPLES.end());
        self.gather_samples.unwrap_or((derived as u32).clamp(least, most))
    }

    /// Samples that a pixel may get at most, unless the scene wants more.
    pub fn pixel_samples(&self) -> u32 {
        let derived = DEFAULT_PIXEL_SAMPLES * self.more_samples();
        // Sobol points are evenly spread at powers of two, and much worse between them.
        derived.clamp(16.0, 65_536.0).log2().round().exp2() as u32
    }

    /// How many times as many samples a pixel gets as by default.
    pub(crate) fn more_samples(&self) -> f32 {
        self.refinement().powf(PIXEL_SAMPLES_EXPONENT)
    }

    /// Relative standard error of a record that is worth more rays.
    pub fn noise(&self) -> f32 {
        self.noise.unwrap_or(DEFAULT_NOISE / self.refinement().max(1.0).powf(0.75))
    }

    /// Least radius in pixels. It becomes finer as radii do, or the error would end there; not
    /// coarser, since details are as large as they are.
    pub fn min_pixel_spacing(&self) -> f32 {
        let derived = DEFAULT_SPACING / self.refinement().max(1.0).powf(0.25);
        self.min_pixel_spacing.unwrap_or(derived)
    }

    /// How much finer than by default everything is to be.
    pub(super) fn refinement(&self) -> f32 {
        DEFAULT_ERROR * self.quality / self.error
    }

    /// Ward's accuracy, of the criterion if none was set.
    pub(super) fn accuracy(&self) -> f32 {
        self.accuracy.unwrap_or(RadiusSettings::new(self.criterion).accuracy)
    }

    /// Whether a record's gradients are of any use.
    pub(super) fn needs_gradients(&self) -> bool {
        self.lookup().gradients || self.radius().limit_by_gradient
    }

    pub(super) fn smoothing(&self) -> f32 {
        let is_usual = self.criterion == Criterion::Hessian;
        self.smoothing.unwrap_or(if is_usual { SMOOTHING } else { 0.0 })
    }

    pub(super) fn contact_shadows(&self) -> bool {
        self.contact_shadows.unwrap_or(self.criterion == Criterion::Hessian)
    }

    pub(super) fn clamp_neighbor(&self) -> bool {
        self.clamp_neighbor.unwrap_or(self.criterion == Criterion::Krivanek06)
    }

    /// Whether records are made before the picture, not pixel by pixel with it.
    pub(crate) fn overture(&self) -> bool {
        self.overture.unwrap_or(self.criterion != Criterion::Thesis)
    }

    pub(super) fn leak_protection(&self) -> bool {
        self.leak_protection.unwrap_or(self.criterion != Criterion::Thesis)
    }

    pub(super) fn index(&self) -> IndexKind {
        let museum = self.criterion == Criterion::Thesis;
        self.index.unwrap_or(if museum { IndexKind::Leaves } else { IndexKind::Cells })
    }

    /// As [`IrrCacheSettings::crevice_spread`] would say what is in force.
    pub(super) fn crevice_spread(&self) -> f32 {
        match self.radius().crevice {
            CreviceRule::Off => 0.0,
            CreviceRule::Shrink { spread } | CreviceRule::Fade { spread } => spread,
        }
    }

    /// Degrees.
    pub(super) fn max_angle(&self) -> f32 {
        self.max_angle.unwrap_or_else(|| self.radius().angles[1].to_degrees().min(MAX_ANGLE))
    }
}

impl Default for IrrCacheSettings {
    fn default() -> Self {
        Self {
            criterion: Criterion::Hessian,
            error: DEFAULT_ERROR,
            accuracy: None,
            quality: 1.0,
            exponent: 0.25,
            ellipse: false,
            noise: None,
            gather_samples: None,
            min_pixel_spacing: None,
            max_pixel_spacing: 160.0,
            min_radius: 0.0,
            max_radius: 0.0,
            ambient_resolution: 0.0,
            max_angle: None,
            crevice_spread: None,
            clamp_neighbor: None,
            overture: None,
            leak_protection: None,
            index: None,
            nearest: None,
            overlap: None,
            smoothing: None,
            contact_shadows: None,
            min_weight: None,
            in_front: None,
            gradients: None,
            mix: None,
            bounces: Bounces::Hash,
            sky: Sky::Auto,
            analytic_direct: true,
            debias: 0.0,
            show_points: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sixteenth of the error: radii are half as large (`exponent`), so the least one is, too; a
    /// record has an eighth of the noise, if that takes more than four times the rays.
    #[test]
    fn one_knob_sets_all() {
        let parts = |error: f32, quality: f32| {
            let s = IrrCacheSettings { error, quality, ..Default::default() };
            (s.gather_samples(), s.pixel_samples(), s.noise(), s.min_pixel_spacing())
        };
        assert_eq!(parts(0.05, 1.0), (576, 512, 0.2, 3.0));
        let (rays, samples, noise, spacing) = parts(0.003_125, 1.0);
        // 512 · 16^0.8 = 4705, of which 4096 is the nearest power of two.
        assert_eq!((rays, samples), (2304, 4096));
        assert!((noise - 0.025).abs() < 1e-6 && (spacing - 1.5).abs() < 1e-6);
        assert_eq!(parts(0.05, 16.0), parts(0.003_125, 1.0));
        // Coarser: fewer rays and samples, but details are as large as they are.
        assert_eq!(parts(0.8, 1.0), (144, 64, 0.2, 3.0));
        let own = IrrCacheSettings {
            noise: Some(0.3),
            min_pixel_spacing: Some(7.0),
            ..Default::default()
        };
        assert_eq!((own.noise(), own.min_pixel_spacing()), (0.3, 7.0));
    }
}
