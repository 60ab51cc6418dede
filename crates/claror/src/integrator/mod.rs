//! Light transport: from a camera ray to radiance.

mod aov;

pub use aov::{Aov, AovKind};

/// Which algorithm, with its parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IntegratorSettings {
    /// Which algorithm.
    pub kind: IntegratorKind,
    /// Longest path, Mitsuba's counting: 1 = emission seen directly, 2 = + direct light, …;
    /// `None` for no limit.
    pub max_depth: Option<u32>,
    /// From this depth on paths end by Russian roulette.
    pub rr_depth: u32,
    /// Emitters seen directly are left out.
    pub hide_emitters: bool,
}

impl Default for IntegratorSettings {
    /// Mitsuba's defaults of `path`.
    fn default() -> Self {
        Self { kind: IntegratorKind::Path, max_depth: None, rr_depth: 5, hide_emitters: false }
    }
}

/// The algorithms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum IntegratorKind {
    /// Path tracing with next-event estimation and multiple importance sampling.
    #[default]
    Path,
    /// Emission and direct light only, with the given numbers of light and BSDF samples.
    Direct {
        /// Light samples per camera sample.
        emitter_samples: u32,
        /// BSDF samples per camera sample.
        bsdf_samples: u32,
    },
    /// Distance along the camera ray.
    Depth,
}
