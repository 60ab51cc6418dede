//! Light transport: from a camera ray to radiance.
//!
//! Radiance comes in four parts that sum to what is seen, because caching indirect light needs
//! them apart. A *vertex* here is a scattering event other than passing an invisible (`null`)
//! surface; the first vertex is what the camera sees.
//!
//! - *emission*: emitted at what the camera sees, or behind it where it sees nothing;
//! - *direct*: emitted light that arrives at the first vertex without another vertex in between
//!   and was scattered by a component that light sampling covers (all but delta functions);
//! - *indirect*: all other light that the diffuse component of the first vertex scatters: albedo
//!   over π times the irradiance that a cache stores;
//! - *rest*: everything else: light that other components of the first vertex scatter after at
//!   least one more vertex, and all that delta components scatter, lights seen in a mirror
//!   included.

mod aov;
mod direct;
mod gridcache;
mod irrcache;
mod light;
mod parameter;
mod path;
#[cfg(test)]
mod tests;

pub use aov::{Aov, AovKind, eval_aovs};
pub use gridcache::{
    GridCache, GridCacheSettings, GridParameter, Interpolation, PARAMETERS as GRID_PARAMETERS,
    Quantity,
};
pub use irrcache::{
    ALIASES as CACHE_ALIASES, Bounces, CacheAlias, CacheContents, CacheParameter, CachePhase,
    CacheProgress, CacheStatistics, CacheView, CacheWatch, Cause, IrrCacheSettings,
    IrradianceCache, IsCancelled, LookupCounts, PARAMETERS as CACHE_PARAMETERS, Probe,
    ProbeSettings, VisibleRecord, VisibleRecords, is_cache_parameter,
};
pub use parameter::{Change, Parameter, ParameterError};

use crate::math::Ray;
use crate::sampler::Sampler;
use crate::scene::Scene;
use crate::spectrum::Rgb;

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
    /// Paths that have become weak may end before.
    pub early_roulette: bool,
    /// Emitters seen directly are left out.
    pub hide_emitters: bool,
    /// Parameters of [`IntegratorKind::IrradianceCache`].
    pub cache: IrrCacheSettings,
    /// Parameters of [`IntegratorKind::GridCache`].
    pub grid: GridCacheSettings,
}

impl Default for IntegratorSettings {
    /// Mitsuba's defaults of `path`.
    fn default() -> Self {
        Self {
            kind: IntegratorKind::Path,
            max_depth: None,
            rr_depth: 5,
            early_roulette: true,
            hide_emitters: false,
            cache: IrrCacheSettings::default(),
            grid: GridCacheSettings::default(),
        }
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
    /// Diffuse indirect light from a cache, see [`IrradianceCache`].
    IrradianceCache,
    /// Light interpolated from a grid in the picture, see [`GridCache`].
    GridCache,
}

/// What a camera ray may take light from instead of following a path.
#[derive(Debug, Clone, Copy)]
pub enum Stored<'a> {
    /// Records, or those of them that a pixel sees.
    Cache(CacheView<'a>),
    /// A grid of the picture.
    Grid(&'a GridCache),
}

/// Radiance along a camera ray, in parts (see the module), W·m⁻²·sr⁻¹.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LayeredRadiance {
    /// Emission seen directly.
    pub emission: Rgb,
    /// Direct light at the first vertex.
    pub direct: Rgb,
    /// Indirect light scattered by the diffuse component of the first vertex.
    pub indirect: Rgb,
    /// Everything else.
    pub rest: Rgb,
    /// 1 where the ray meets something, 0 where it leaves the scene.
    pub alpha: f32,
    /// What is known of the direct light besides.
    pub control: DirectControl,
    /// Tells apart samples that see different things or other lights: 0 where nobody asks.
    pub signature: u32,
    /// What was asked of the irradiance cache.
    pub lookups: LookupCounts,
}

/// Direct light as if nothing stood between surface and lights. Over many samples both have the
/// same mean, so their ratio takes the noise of light sampling out of `direct`: all of it where
/// lights are wholly visible (Heitz, Hill and McGuire 2018). Black where nothing is known.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DirectControl {
    /// In closed form.
    pub exact: Rgb,
    /// By the samples that `direct` is made of.
    pub sampled: Rgb,
}

impl LayeredRadiance {
    /// The parts, in the order of [`crate::film::LAYER_NAMES`].
    pub fn layers(&self) -> [Rgb; 4] {
        [self.emission, self.direct, self.indirect, self.rest]
    }
}

/// Dimensions of a sample that belong to the camera: place in the pixel, place on the lens.
pub const CAMERA_DIMENSIONS: u32 = 2;

/// An estimate of the radiance that arrives along `ray` (from the camera), with expectation
/// exactly Mitsuba's. Adds the number of rays traced to `rays`. Without its `cache` the integrator
/// `irrcache` follows paths, and `gridcache` always does.
pub fn radiance(
    scene: &Scene,
    settings: &IntegratorSettings,
    cache: Option<&IrradianceCache>,
    ray: &Ray,
    sampler: &mut Sampler,
    rays: &mut u64,
) -> LayeredRadiance {
    let stored = cache.map(|cache| Stored::Cache(cache.all()));
    radiance_from(scene, settings, stored, ray, sampler, rays)
}

/// [`radiance`] with what is stored for a pixel.
pub fn radiance_from(
    scene: &Scene,
    settings: &IntegratorSettings,
    stored: Option<Stored>,
    ray: &Ray,
    sampler: &mut Sampler,
    rays: &mut u64,
) -> LayeredRadiance {
    match settings.kind {
        IntegratorKind::Path => path::path(scene, settings, ray, sampler, rays),
        IntegratorKind::IrradianceCache => match stored {
            Some(Stored::Cache(cache)) => {
                irrcache::cached(scene, settings, cache, ray, sampler, rays)
            }
            _ => path::path(scene, settings, ray, sampler, rays),
        },
        IntegratorKind::GridCache => match stored {
            Some(Stored::Grid(grid)) => {
                gridcache::gridded(scene, settings, grid, ray, sampler, rays)
            }
            _ => path::path(scene, settings, ray, sampler, rays),
        },
        IntegratorKind::Direct { emitter_samples, bsdf_samples } => {
            let counts = direct::SampleCounts { emitter: emitter_samples, bsdf: bsdf_samples };
            direct::direct(scene, settings, counts, ray, sampler, rays)
        }
        IntegratorKind::Depth => {
            *rays += 1;
            let hit = scene.accel.intersect(&scene.tables.shapes, ray);
            LayeredRadiance {
                emission: Rgb::splat(hit.as_ref().map_or(0.0, |h| h.t)),
                alpha: if hit.is_some() { 1.0 } else { 0.0 },
                ..Default::default()
            }
        }
    }
}
