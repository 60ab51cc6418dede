//! What a render has before the first sample: an irradiance cache made, taken over or added to, or a
//! grid.

use super::{Fingerprint, Observer, RenderError, RenderSettings, RenderState};
use crate::integrator::{
    CacheContents, CacheProgress, CacheWatch, GridCache, IntegratorKind, IrradianceCache,
};
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

/// A cache or grid that is ready, and the rays that it took now.
#[derive(Debug, Default)]
pub(super) struct Prepared {
    pub(super) cache: Option<IrradianceCache>,
    pub(super) grid: Option<GridCache>,
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
    match integrator.kind {
        IntegratorKind::IrradianceCache => {}
        IntegratorKind::GridCache => return Ok(prepare_grid(scene, sensor, observer)),
        _ => return Ok(Prepared::default()),
    }
    if let Some(start) = &start {
        let now = Fingerprint::of_cache(scene, sensor, settings);
        if let Some((what, cache, now)) = start.fingerprint.difference(&now) {
            return Err(RenderError::CacheMismatch { what, cache, now });
        }
    }
    let is_cancelled = || observer.is_cancelled();
    let progress = |progress: &CacheProgress| observer.cache_progress(progress);
    let watch = CacheWatch { is_cancelled: &is_cancelled, progress: &progress };
    let (mode, contents) =
        start.map_or((CacheMode::Update, CacheContents::default()), |s| (s.mode, s.contents));
    let earlier_rays = contents.statistics.rays;
    let cache = match mode {
        CacheMode::Read => Some(contents.freeze(&integrator.cache, scene.accel.bounds())),
        CacheMode::Update => IrradianceCache::update(scene, sensor, contents, watch),
    };
    let Some(cache) = cache else { return Ok(Prepared::default()) };
    state.note_cache(&cache)?;
    observer.cache_ready(&cache);
    let rays = cache.statistics.rays.saturating_sub(earlier_rays);
    Ok(Prepared { cache: Some(cache), rays, ..Default::default() })
}

/// The grid follows from what [`Fingerprint::new`] says: a continued render makes the same again.
fn prepare_grid(scene: &Scene, sensor: &Sensor, observer: &dyn Observer) -> Prepared {
    let Some(grid) = GridCache::build(scene, sensor, &|| observer.is_cancelled()) else {
        return Prepared::default();
    };
    observer.grid_ready(&grid);
    Prepared { rays: grid.rays, grid: Some(grid), cache: None }
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

#[cfg(test)]
mod tests {
    use std::sync::Mutex;
    use std::sync::atomic::{AtomicU64, Ordering};
    use std::time::Duration;

    use super::*;
    use crate::integrator::{Bounces, CachePhase, IntegratorSettings, IrrCacheSettings};
    use crate::irradiance::Criterion;
    use crate::math::DVec3;
    use crate::render::{Progress, RenderOutput, StopReason, render};
    use crate::scene::test_scene::mixed_room;

    /// Keeps the bytes of the cache, and cancels after a number of questions.
    struct Keeper {
        questions: AtomicU64,
        cancel_after: u64,
        cache: Mutex<Option<Vec<u8>>>,
        told: Mutex<Vec<CacheProgress>>,
    }

    impl Keeper {
        fn new(cancel_after: u64) -> Self {
            let (questions, cache) = (AtomicU64::new(0), Mutex::new(None));
            Self { questions, cancel_after, cache, told: Mutex::new(Vec::new()) }
        }
    }

    impl Observer for Keeper {
        fn elapsed(&self) -> Duration {
            Duration::ZERO
        }
        fn is_cancelled(&self) -> bool {
            self.questions.fetch_add(1, Ordering::Relaxed) >= self.cancel_after
        }
        fn progress(&self, _: &Progress) {}
        fn checkpoint(&self, _: &RenderState) {}
        fn cache_progress(&self, progress: &CacheProgress) {
            self.told.lock().unwrap().push(*progress);
        }
        fn cache_ready(&self, cache: &IrradianceCache) {
            *self.cache.lock().unwrap() = Some(cache.to_bytes());
        }
    }

    /// Two views of a room.
    fn scene(cache: IrrCacheSettings) -> Scene {
        let mut t = mixed_room(24);
        t.camera(DVec3::new(0.4, 0.1, 0.8), DVec3::new(-0.2, -0.3, -1.0), 60.0, 20);
        t.tables.integrator = IntegratorSettings {
            kind: IntegratorKind::IrradianceCache,
            cache,
            ..Default::default()
        };
        t.build()
    }

    fn coarse() -> IrrCacheSettings {
        IrrCacheSettings { gather_samples: Some(100), noise: Some(0.5), ..Default::default() }
    }

    fn run(scene: &Scene, sensor: usize, start: Start) -> Result<RenderOutput, RenderError> {
        let settings = RenderSettings { spp: Some(3), ..Default::default() };
        render(scene, sensor, &settings, start, &Keeper::new(u64::MAX))
    }

    fn starting(scene: &Scene, cache: &IrradianceCache, mode: CacheMode) -> Option<StartingCache> {
        let sensor = &scene.tables.sensors[0];
        let fingerprint = Fingerprint::of_cache(scene, sensor, &RenderSettings::default());
        let contents = CacheContents::from_bytes(&cache.to_bytes()).unwrap();
        Some(StartingCache { fingerprint, contents, mode })
    }

    fn from_cache(scene: &Scene, cache: &IrradianceCache, mode: CacheMode) -> Start {
        Start { state: None, cache: starting(scene, cache, mode) }
    }

    /// By way of bytes a cache gives the picture that it gave, without the rays of its making; and
    /// the view that it was made for needs nothing more.
    #[test]
    fn a_cache_that_was_kept_gives_the_same_bits() {
        for criterion in Criterion::ALL {
            let scene = scene(IrrCacheSettings { criterion, ..coarse() });
            let made = run(&scene, 0, Start::default()).unwrap();
            let cache = made.cache.as_ref().unwrap();
            let read = run(&scene, 0, from_cache(&scene, cache, CacheMode::Read)).unwrap();
            assert_eq!(read.state.to_bytes(), made.state.to_bytes(), "{criterion:?}");
            assert_eq!(read.picture, made.picture);
            assert_eq!(read.rays + cache.statistics.rays, made.rays);
            let same = run(&scene, 0, from_cache(&scene, cache, CacheMode::Update)).unwrap();
            assert_eq!(same.cache.unwrap().records, cache.records, "{criterion:?}");
            assert_eq!(same.state.to_bytes(), made.state.to_bytes(), "{criterion:?}");
        }
    }

    #[test]
    fn another_view_adds_records() {
        let scene = scene(coarse());
        let first = run(&scene, 0, Start::default()).unwrap().cache.unwrap();
        let read = run(&scene, 1, from_cache(&scene, &first, CacheMode::Read)).unwrap();
        assert_eq!(read.cache.unwrap().records, first.records);
        let both = run(&scene, 1, from_cache(&scene, &first, CacheMode::Update)).unwrap();
        let both = both.cache.unwrap();
        let (old, n) = (first.records.len(), both.records.len());
        assert!(n > old, "{old} records, then {n}");
        assert_eq!(both.records[..old], first.records);
        assert_eq!(both.statistics.records, n);
        assert!(both.statistics.rays > first.statistics.rays);
        let alone = run(&scene, 1, Start::default()).unwrap().cache.unwrap();
        assert!(n - old < alone.records.len(), "what is there already serves");
    }

    #[test]
    fn a_picture_has_one_cache() {
        let scene = scene(coarse());
        let made = run(&scene, 0, Start::default()).unwrap();
        let other = run(&scene, 1, Start::default()).unwrap().cache.unwrap();
        let state = || Some(RenderState::from_bytes(&made.state.to_bytes()).unwrap());
        // Read or made again, the cache is the same.
        let cache = starting(&scene, made.cache.as_ref().unwrap(), CacheMode::Read);
        for cache in [None, cache] {
            let output = run(&scene, 0, Start { state: state(), cache }).unwrap();
            assert_eq!(output.state, made.state);
        }
        for mode in [CacheMode::Read, CacheMode::Update] {
            let cache = starting(&scene, &other, mode);
            let error = run(&scene, 0, Start { state: state(), cache }).unwrap_err();
            let what = "content of the irradiance cache";
            assert!(matches!(error, RenderError::StateMismatch { what: w, .. } if w == what));
        }
    }

    #[test]
    fn caches_of_other_settings_are_refused() {
        let one = scene(coarse());
        let cache = run(&one, 0, Start::default()).unwrap().cache.unwrap();
        let start = || from_cache(&one, &cache, CacheMode::Read);
        let mut other = scene(IrrCacheSettings { error: 0.2, ..coarse() });
        let error = run(&other, 0, start()).unwrap_err().to_string();
        assert_eq!(error, "the irradiance cache has error 0.05, this render has 0.2");
        other.tables.integrator.cache = coarse();
        other.tables.integrator.max_depth = Some(4);
        let error = run(&other, 0, start()).unwrap_err().to_string();
        assert_eq!(error, "the irradiance cache has max_depth none, this render has 4");
        other.tables.integrator.max_depth = None;
        other.tables.sensors[0].film.width = 30;
        other.tables.integrator.hide_emitters = true;
        run(&other, 0, start()).expect("neither size nor what the camera sees of lamps matters");
    }

    /// Phases in their order; in each neither shares nor counts fall; the last share is all.
    #[test]
    fn the_progress_of_a_prepass_never_falls() {
        let thesis = IrrCacheSettings { criterion: Criterion::Thesis, ..coarse() };
        let clamped = IrrCacheSettings { clamp_neighbor: Some(true), ..coarse() };
        let deep = IrrCacheSettings { bounces: Bounces::Cache, ..coarse() };
        for (settings, first) in [
            (coarse(), CachePhase::Walks),
            (clamped, CachePhase::Walks),
            (thesis, CachePhase::Walks),
            (deep, CachePhase::Deep),
        ] {
            let scene = scene(settings);
            let keeper = Keeper::new(u64::MAX);
            let few = RenderSettings { spp: Some(1), ..Default::default() };
            let output = render(&scene, 0, &few, None, &keeper).unwrap();
            let told = keeper.told.into_inner().unwrap();
            assert_eq!(told.first().map(|p| p.phase), Some(first), "{settings:?}");
            for pair in told.windows(2) {
                let key = |p: &CacheProgress| (p.phase, p.fraction, p.records, p.rays);
                let falls = key(&pair[0]) > key(&pair[1])
                    || (pair[0].phase == pair[1].phase && pair[0].records > pair[1].records);
                assert!(!falls, "{pair:?}");
            }
            let last = told.last().unwrap();
            assert_eq!((last.phase, last.fraction), (CachePhase::Records, Some(1.0)));
            assert_eq!(last.records, output.cache.unwrap().records.len());
        }
    }

    /// The hook is called with the complete cache or not at all, and a state without samples goes
    /// on whatever the cache.
    #[test]
    fn an_interrupted_prepass_leaves_nothing() {
        let scene = scene(coarse());
        let settings = RenderSettings { spp: Some(3), ..Default::default() };
        let whole = run(&scene, 0, Start::default()).unwrap();
        for cancel_after in [0, 3] {
            let keeper = Keeper::new(cancel_after);
            let output = render(&scene, 0, &settings, None, &keeper).unwrap();
            assert_eq!(output.stop, StopReason::Cancelled);
            assert!(output.cache.is_none() && keeper.cache.into_inner().unwrap().is_none());
            let rest = run(&scene, 0, Some(output.state).into()).unwrap();
            assert_eq!(rest.state, whole.state);
        }
        let keeper = Keeper::new(u64::MAX);
        render(&scene, 0, &settings, None, &keeper).unwrap();
        let kept = keeper.cache.into_inner().unwrap();
        assert_eq!(kept, Some(whole.cache.unwrap().to_bytes()));
    }
}
