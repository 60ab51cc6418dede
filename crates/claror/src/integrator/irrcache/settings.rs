//! Parameters of `irrcache`, and what follows from them.
//!
//! What a criterion's paper says about the rest of the method is taken where nothing else is
//! said: those parameters are `None` by default.

use crate::irradiance::{Criterion, RadiusSettings};

/// Where the light comes from that a record's rays find.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Bounces {
    /// Random walks: unbiased.
    Path,
    /// Random walks that end where they have gone far enough, at a coarse average of the
    /// irradiance there: much less noise, a little bias.
    #[default]
    Hash,
}

impl Bounces {
    /// All of them, the default first.
    pub const ALL: [Self; 2] = [Self::Hash, Self::Path];

    /// As scene files and the command line call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Path => "path",
            Self::Hash => "hash",
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
    /// Relative standard error of a record that is worth more rays.
    pub noise: f32,
    /// Rays of a record.
    pub gather_samples: u32,
    /// Least radius, pixels.
    pub min_pixel_spacing: f32,
    /// Largest radius, pixels.
    pub max_pixel_spacing: f32,
    /// Light at the ends of a record's rays.
    pub bounces: Bounces,
    /// Take the noise of light sampling out of direct light where lights have closed forms.
    pub analytic_direct: bool,
    /// Share of look-ups that are corrected by a random walk, 0 to 1.
    pub debias: f32,
}

impl IrrCacheSettings {
    /// Sensible numbers of rays of a record.
    pub const GATHER_SAMPLES: std::ops::RangeInclusive<u32> = 16..=65_536;

    /// How far records reach.
    pub(super) fn radius(&self) -> RadiusSettings {
        RadiusSettings {
            epsilon: self.error,
            accuracy: self.accuracy(),
            ..RadiusSettings::new(self.criterion)
        }
    }

    pub(super) fn accuracy(&self) -> f32 {
        self.accuracy.unwrap_or(RadiusSettings::new(self.criterion).accuracy)
    }
}

impl Default for IrrCacheSettings {
    fn default() -> Self {
        Self {
            criterion: Criterion::Hessian,
            error: 0.1,
            accuracy: None,
            noise: 0.05,
            gather_samples: 576,
            min_pixel_spacing: 3.0,
            max_pixel_spacing: 160.0,
            bounces: Bounces::Hash,
            analytic_direct: true,
            debias: 0.0,
        }
    }
}
