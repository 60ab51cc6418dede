use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use rayon::prelude::*;

use super::cache::Prepared;
use super::tile::{TileRenderer, TileWork};
use super::{Observer, Progress, RenderOutput, RenderSettings, RenderState, StopReason};
use crate::film::{Choice, Picture};
use crate::integrator::IntegratorKind;
use crate::sampler::SamplerTable;
use crate::scene::Scene;
use crate::sensor::Sensor;

/// Samples per pixel of the longest round: short enough that checkpoints, error estimates and
/// limits come often, long enough that threads wait for each other rarely.
const LONGEST_ROUND: u32 = 32;

/// Samples after which an adaptive render leaves pixels alone that seem to be done.
const ADAPTIVE_FROM: u32 = 4;
/// Samples of a path tracer, for which the scene's number is meant, that one adaptive sample is
/// worth.
const PATH_SAMPLES: u32 = 4;
/// How far off, relative to its value, a pixel may be when it is left alone: of itself, and as a
/// share of the error asked for, of which the rest is the cache's.
const TOLERANCE: f32 = 0.006;
const TARGET_SHARE: f32 = 0.7;
/// Samples from which on a pixel's tolerance rises in proportion to them. With a constant one all
/// effort would go to the noisiest pixels; squared error is the least for the effort where each
/// further sample takes as much of it from one pixel as from another, which is so with the root
/// of the samples. That errors are known from few samples only calls for more.
const RISING_FROM: f32 = 16.0;

/// The number of samples per pixel at which the round ends that begins at `done`: the next of 1,
/// 2, 4 … [`LONGEST_ROUND`], and its multiples from there on, so that something can be seen soon.
/// Also where a render goes on that had another limit.
fn round_end(done: u32, limit: Option<u32>) -> u32 {
    let end = if done < LONGEST_ROUND {
        (done + 1).next_power_of_two()
    } else {
        done.saturating_add(LONGEST_ROUND - done % LONGEST_ROUND)
    };
    end.min(limit.unwrap_or(u32::MAX))
}

/// Whether a round ends there without a limit.
fn is_round_end(spp: u32) -> bool {
    if spp < LONGEST_ROUND { spp.is_power_of_two() } else { spp.is_multiple_of(LONGEST_ROUND) }
}

/// How many samples pixels get.
struct Plan {
    /// Whether pixels that seem to be done are left alone.
    adaptive: bool,
    /// How far off these may be, and the samples from which on it may be more.
    tolerance: f32,
    rising_from: f32,
    /// Samples of a pixel at the most, if that is not left to time or error.
    limit: Option<u32>,
}

impl Plan {
    fn new(scene: &Scene, sensor: &Sensor, settings: &RenderSettings) -> Self {
        let integrator = &scene.tables.integrator;
        // Leaving pixels alone that look done by chance is a bias, which `debias` is to take away.
        let adaptive =
            integrator.kind == IntegratorKind::IrradianceCache && integrator.cache.debias <= 0.0;
        let mut count = sensor.sampler.sample_count;
        if adaptive {
            count = integrator.cache.pixel_samples().max(count / PATH_SAMPLES);
        }
        let unlimited = settings.max_seconds.is_some() || settings.target_error.is_some();
        // All pixels get more samples by this factor, and err less by its root.
        let more = integrator.cache.more_samples();
        let usual = (TOLERANCE / more.sqrt(), RISING_FROM * more);
        // What is to be as good as it can be, or as wanted, does not stop anywhere else.
        let (tolerance, rising_from) = match settings.target_error {
            Some(target) => (target * TARGET_SHARE, f32::INFINITY),
            None if unlimited => (usual.0, f32::INFINITY),
            None => usual,
        };
        Self {
            adaptive,
            tolerance,
            rising_from,
            limit: settings.spp.or((!unlimited).then_some(count)),
        }
    }

    /// How far off pixels of so many samples may be.
    fn tolerance(&self, spp: u32) -> f32 {
        self.tolerance * (spp as f32 / self.rising_from).max(1.0)
    }

    /// Which pixels take part in the round that begins at `spp` samples.
    fn choice(&self, spp: u32) -> Choice {
        match (self.adaptive && spp >= ADAPTIVE_FROM, is_round_end(spp)) {
            (false, _) => Choice::All,
            // A limit cut the round short: it is finished as it was begun.
            (true, false) => Choice::Active,
            (true, true) => Choice::Needing(self.tolerance(spp)),
        }
    }
}

struct Round<'a> {
    settings: &'a RenderSettings,
    observer: &'a dyn Observer,
    limit: Option<u32>,
    /// Samples of all pixels at the end, where that is known.
    target_samples: Option<u64>,
    /// Samples and rays so far.
    samples: AtomicU64,
    rays: AtomicU64,
    /// Set when the threads should come together: the time is over, or a checkpoint is due.
    pause: AtomicBool,
}

impl Round<'_> {
    fn is_out_of_time(&self) -> bool {
        self.settings.max_seconds.is_some_and(|s| self.observer.elapsed().as_secs_f64() >= s)
    }

    /// Counts the work on a tile of a round that began at `spp`, and asks for a pause where one is
    /// needed.
    fn finish_tile(&self, work: TileWork, spp: u32) {
        self.samples.fetch_add(work.samples, Ordering::Relaxed);
        self.rays.fetch_add(work.rays, Ordering::Relaxed);
        // The first round is always finished, however short the time: every pixel has a sample.
        // Tiles that were finished before the last pause ask for no other: work must go on.
        let is_over = spp > 0 && self.is_out_of_time();
        if is_over || (work.samples > 0 && self.observer.is_checkpoint_due()) {
            self.pause.store(true, Ordering::Relaxed);
        }
    }

    fn report(&self, spp: u32, error: Option<f32>) {
        self.observer.progress(&Progress {
            spp,
            target_spp: self.limit,
            samples: self.samples.load(Ordering::Relaxed),
            target_samples: self.target_samples,
            rays: self.rays.load(Ordering::Relaxed),
            error,
        });
    }
}

/// Renders until a limit is reached. All limits were checked to make sense.
pub(super) fn run(
    scene: &Scene,
    sensor: &Sensor,
    settings: &RenderSettings,
    mut state: RenderState,
    prepared: Prepared,
    observer: &dyn Observer,
) -> RenderOutput {
    let renderer = TileRenderer::new(scene, sensor, &prepared);
    let plan = Plan::new(scene, sensor, settings);
    let samples = state.film.sample_counts().1;
    let pixels = u64::from(state.film.crop.width) * u64::from(state.film.crop.height);
    let round = Round {
        settings,
        observer,
        limit: plan.limit,
        target_samples: plan.limit.filter(|_| !plan.adaptive).map(|n| u64::from(n) * pixels),
        samples: AtomicU64::new(samples),
        rays: AtomicU64::new(0),
        pause: AtomicBool::new(false),
    };
    // In the middle of a round nothing is decided by the error, here as in the loop below:
    // a continued render stops where it would have stopped.
    let (mut spp, mut is_between_rounds) = state.film.round();
    let mut error = if is_between_rounds { state.film.relative_error() } else { f32::INFINITY };
    let stop = loop {
        if let Some(reason) = stop_reason(&round, spp, error) {
            break reason;
        }
        let end = round_end(spp, round.limit);
        if is_between_rounds && !state.film.begin_round(spp, end, plan.choice(spp)) {
            break StopReason::Error;
        }
        let samples = SamplerTable::new(&sensor.sampler, spp, end);
        loop {
            state.film.tiles.par_iter_mut().with_max_len(1).for_each(|tile| {
                let work = renderer.render(tile, &samples, observer, &round.pause);
                round.finish_tile(work, spp);
                round.report(spp, finite(error));
            });
            // The pause ends the round only with the time: when to stop for other reasons must
            // not depend on when somebody wanted a checkpoint.
            let paused = round.pause.swap(false, Ordering::Relaxed);
            if !paused || observer.is_cancelled() || round.is_out_of_time() {
                break;
            }
            observer.checkpoint(&state);
        }
        (spp, is_between_rounds) = state.film.round();
        error = state.film.relative_error();
        round.report(spp, finite(error));
        observer.checkpoint(&state);
    };
    RenderOutput {
        picture: Picture::new(&state.film, sensor.film.alpha, &scene.tables.aovs),
        stop,
        spp: state.film.sample_counts().0,
        rays: round.rays.into_inner() + prepared.rays,
        error,
        non_finite: state.film.non_finite(),
        lookups: state.film.lookups(),
        cache: prepared.cache,
        grid: prepared.grid,
        state,
    }
}

fn finite(error: f32) -> Option<f32> {
    error.is_finite().then_some(error)
}

fn stop_reason(round: &Round, spp: u32, error: f32) -> Option<StopReason> {
    if round.observer.is_cancelled() {
        Some(StopReason::Cancelled)
    } else if round.limit.is_some_and(|limit| spp >= limit) {
        Some(StopReason::Samples)
    } else if round.settings.target_error.is_some_and(|target| error <= target) {
        Some(StopReason::Error)
    } else if spp > 0 && round.is_out_of_time() {
        Some(StopReason::Time)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_double_then_stay() {
        let mut ends = vec![0];
        while ends.last().is_some_and(|&e| e < 150) {
            ends.push(round_end(*ends.last().unwrap(), Some(150)));
        }
        assert_eq!(ends, [0, 1, 2, 4, 8, 16, 32, 64, 96, 128, 150]);
        assert_eq!(round_end(40, None), 64);
        assert_eq!(round_end(u32::MAX - 3, None), u32::MAX);
        assert_eq!([round_end(5, None), round_end(97, Some(100))], [8, 100]);
        assert!([1, 8, 32, 96].into_iter().all(is_round_end));
        assert!(![0, 5, 48, 100].into_iter().any(is_round_end));
    }
}
