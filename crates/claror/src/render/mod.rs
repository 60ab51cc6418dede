//! Tile schedule, progress, cancellation, checkpoint state, statistics.
//!
//! A render proceeds in rounds; a round brings every pixel to the same number of samples. Within
//! a round the tiles are spread over the threads of the current rayon pool. Every pixel adds its
//! samples in the order of their indices, so neither threads nor rounds nor interruptions change
//! a bit of the result.

mod cache;
mod fingerprint;
mod schedule;
mod state;
#[cfg(test)]
mod tests;
mod tile;

pub use cache::{CacheMode, Start, StartingCache};
pub use fingerprint::Fingerprint;
pub use state::RenderState;

use std::time::Duration;

use crate::film::{NonFinite, Picture};
use crate::integrator::{CacheProgress, GridCache, IntegratorKind, IrradianceCache, LookupCounts};
use crate::scene::Scene;

/// When to stop; the first of the limits that is reached counts. Without any, the sample count
/// of the sensor's sampler is the limit.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RenderSettings {
    /// Samples per pixel; with an irradiance cache the most that any pixel gets.
    pub spp: Option<u32>,
    /// Time since the observer's clock began, seconds.
    pub max_seconds: Option<f64>,
    /// Relative error of the picture, see [`crate::film::Film::relative_error`].
    pub target_error: Option<f32>,
    /// What identifies the scene's files (a hash of them), so that the state of another scene is
    /// not continued by mistake.
    pub scene_hash: Option<String>,
}

/// How far a render is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Samples per pixel at the end of the rounds that are complete.
    pub spp: u32,
    /// Samples per pixel that were asked for, if any number was.
    pub target_spp: Option<u32>,
    /// Samples of all pixels so far.
    pub samples: u64,
    /// Samples of all pixels at the end, if a number was asked for.
    pub target_samples: Option<u64>,
    /// Rays traced so far, since this process began.
    pub rays: u64,
    /// Estimated relative error of the picture at the end of the last round.
    pub error: Option<f32>,
}

/// What a render asks of and tells to whoever started it. Called from many threads.
pub trait Observer: Sync {
    /// Time since the work began.
    fn elapsed(&self) -> Duration;
    /// Whether to stop as soon as possible. Asked once per pixel and round: must be quick.
    fn is_cancelled(&self) -> bool;
    /// Called after every tile and every round.
    fn progress(&self, progress: &Progress);
    /// Called after every round, after an interrupted one, and when it is due, from one thread:
    /// the moment to write a checkpoint.
    fn checkpoint(&self, state: &RenderState);
    /// Called now and then while the irradiance cache is made, before [`Observer::cache_ready`].
    fn cache_progress(&self, _progress: &CacheProgress) {}
    /// Called before the first sample, when the irradiance cache is complete.
    fn cache_ready(&self, _cache: &IrradianceCache) {}
    /// Called before the first sample, when the grid of `gridcache` is complete.
    fn grid_ready(&self, _grid: &GridCache) {}
    /// Whether the round should pause for a checkpoint. Asked after every tile.
    fn is_checkpoint_due(&self) -> bool {
        false
    }
}

/// Why a render ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The number of samples is reached.
    Samples,
    /// The time is over.
    Time,
    /// The error is small enough.
    Error,
    /// The observer said so.
    Cancelled,
}

/// A rendered picture.
#[derive(Debug)]
pub struct RenderOutput {
    /// The picture with all its layers.
    pub picture: Picture,
    /// From here the render can be continued.
    pub state: RenderState,
    /// Why it ended.
    pub stop: StopReason,
    /// Samples of the pixel that has the fewest.
    pub spp: u32,
    /// Rays traced in this process.
    pub rays: u64,
    /// Estimated relative error; infinite below two samples per pixel.
    pub error: f32,
    /// Samples that were NaN or infinite and count as black.
    pub non_finite: NonFinite,
    /// What was asked of the irradiance cache or grid for all samples, those of earlier runs included.
    pub lookups: LookupCounts,
    /// The irradiance cache, where one was used.
    pub cache: Option<IrradianceCache>,
    /// The grid of `gridcache`, where one was used.
    pub grid: Option<GridCache>,
}

/// Why a render could not begin.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RenderError {
    /// There is no such sensor.
    #[error("the scene has {count} sensor(s), number {wanted} does not exist (the first is 0)")]
    NoSensor {
        /// Asked for.
        wanted: usize,
        /// Present.
        count: usize,
    },
    /// The film has no pixels, or the crop window leaves it.
    #[error("the crop window {crop} does not lie inside the film of {film} pixels")]
    BadCrop {
        /// The window.
        crop: String,
        /// The film.
        film: String,
    },
    /// A layer tells of the irradiance cache, and there is none.
    #[error("the layer {name} tells of an irradiance cache, which the integrator does not use")]
    NoCache {
        /// The layer.
        name: String,
    },
    /// The state to continue is of another render.
    #[error("the state to continue has {what} {state}, this render has {now}")]
    StateMismatch {
        /// What differs.
        what: String,
        /// Its value in the state.
        state: String,
        /// Its value in this render.
        now: String,
    },
    /// The cache to begin with is of another scene or was made with other settings.
    #[error("the irradiance cache has {what} {cache}, this render has {now}")]
    CacheMismatch {
        /// What differs.
        what: String,
        /// Its value in the cache.
        cache: String,
        /// Its value in this render.
        now: String,
    },
}

/// Renders what a sensor of the scene sees, beginning at `start`; `None` is the beginning.
pub fn render(
    scene: &Scene,
    sensor: usize,
    settings: &RenderSettings,
    start: impl Into<Start>,
    observer: &dyn Observer,
) -> Result<RenderOutput, RenderError> {
    let count = scene.tables.sensors.len();
    let chosen =
        scene.tables.sensors.get(sensor).ok_or(RenderError::NoSensor { wanted: sensor, count })?;
    let (film, crop) = (&chosen.film, &chosen.film.crop);
    let inside = |from: u32, size: u32, all: u32| {
        size > 0 && from.checked_add(size).is_some_and(|end| end <= all)
    };
    if !inside(crop.x, crop.width, film.width) || !inside(crop.y, crop.height, film.height) {
        return Err(RenderError::BadCrop {
            crop: format!("{} x {} at ({}, {})", crop.width, crop.height, crop.x, crop.y),
            film: format!("{} x {}", film.width, film.height),
        });
    }
    let uses_cache = scene.tables.integrator.kind == IntegratorKind::IrradianceCache;
    if let Some(aov) = scene.tables.aovs.iter().find(|aov| aov.kind.needs_cache() && !uses_cache) {
        return Err(RenderError::NoCache { name: aov.name.clone() });
    }
    let fingerprint = Fingerprint::new(scene, chosen, settings);
    let start = start.into();
    let mut state = match start.state {
        Some(state) => {
            if let Some((what, state, now)) = state.fingerprint.difference(&fingerprint) {
                return Err(RenderError::StateMismatch { what, state, now });
            }
            state
        }
        None => RenderState::new(fingerprint, *crop, &scene.tables.aovs),
    };
    let cache = cache::prepare(scene, chosen, settings, start.cache, &mut state, observer)?;
    Ok(schedule::run(scene, chosen, settings, state, cache, observer))
}
