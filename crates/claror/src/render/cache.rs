//! The irradiance cache of a render: made, taken over, or added to, before the first sample.

use super::{Fingerprint, Observer, RenderError, RenderSettings, RenderState};
use crate::integrator::{CacheContents, IntegratorKind, IrradianceCache};
use crate::scene::Scene;
use crate::sensor::Sensor;

/// What becomes of the cache that a render begins with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CacheMode {
    /// It is used as it is; what it does not serve is estimated by single rays.
    Read,
    /// What the sensor sees besides is added.
    Update,
}

/// A cache to begin with. Only the integrator `irrcache` looks at it.
#[derive(Debug, Clone, PartialEq)]
pub struct StartingCache {
    /// What it was made with, see [`Fingerprint::of_cache`].
    pub fingerprint: Fingerprint,
    /// What it holds.
    pub contents: CacheContents,
    /// What becomes of it.
    pub mode: CacheMode,
}

/// Where a render begins: nowhere, unless something is said.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Start {
    /// The state to continue.
    pub state: Option<RenderState>,
    /// The cache to begin with.
    pub cache: Option<StartingCache>,
}

impl From<Option<RenderState>> for Start {
    fn from(state: Option<RenderState>) -> Self {
        Self { state, cache: None }
    }
}

/// A cache that is ready, and the rays that it took now.
#[derive(Debug, Default)]
pub(super) struct Prepared {
    pub(super) cache: Option<IrradianceCache>,
    pub(super) rays: u64,
}

/// The cache for a render of `scene` through `sensor`; none if none is used or the observer
/// cancelled. Without samples `state` takes note of it, with samples it must be the same.
pub(super) fn prepare(
    scene: &Scene,
    sensor: &Sensor,
    settings: &RenderSettings,
    start: Option<StartingCache>,
    state: &mut RenderState,
    observer: &dyn Observer,
) -> Result<Prepared, RenderError> {
    let integrator = &scene.tables.integrator;
    if integrator.kind != IntegratorKind::IrradianceCache {
        return Ok(Prepared::default());
    }
    if let Some(start) = &start {
        let now = Fingerprint::of_cache(scene, sensor, settings);
        if let Some((what, cache, now)) = start.fingerprint.difference(&now) {
            return Err(RenderError::CacheMismatch { what, cache, now });
        }
    }
    let is_cancelled = || observer.is_cancelled();
    let (mode, contents) =
        start.map_or((CacheMode::Update, CacheContents::default()), |s| (s.mode, s.contents));
    let earlier_rays = contents.statistics.rays;
    let cache = match mode {
        CacheMode::Read => Some(contents.freeze(&integrator.cache)),
        CacheMode::Update => IrradianceCache::update(scene, sensor, contents, &is_cancelled),
    };
    let Some(cache) = cache else { return Ok(Prepared::default()) };
    state.note_cache(&cache)?;
    observer.cache_ready(&cache);
    let rays = cache.statistics.rays.saturating_sub(earlier_rays);
    Ok(Prepared { cache: Some(cache), rays })
}

impl RenderState {
    /// A picture has one cache. It is known only when it is complete, so it is no part of what
    /// [`Fingerprint::new`] says.
    fn note_cache(&mut self, cache: &IrradianceCache) -> Result<(), RenderError> {
        let now = format!("{:016x}", cache.content_hash());
        let entries = &mut self.fingerprint.entries;
        match entries.iter().find(|e| e.0 == Fingerprint::CACHE_CONTENT) {
            Some((_, noted)) if *noted == now => Ok(()),
            None if self.film.sample_counts().1 == 0 => {
                entries.push((Fingerprint::CACHE_CONTENT.to_owned(), now));
                Ok(())
            }
            noted => Err(RenderError::StateMismatch {
                what: Fingerprint::CACHE_CONTENT.to_owned(),
                state: noted.map_or_else(|| "unknown".to_owned(), |e| e.1.clone()),
                now,
            }),
        }
    }
}
