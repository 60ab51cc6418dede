//! Stands between the renderer and the user: clock, Ctrl-C, progress, checkpoints.

use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use claror::integrator::{CachePhase, CacheProgress, GridCache, IrradianceCache};
use claror::render::{Observer, Progress, RenderSettings, RenderState};

use super::cache_file::CacheWriter;
use crate::config::Checkpoint;
use crate::exit::Failure;
use crate::messages::Report;
use crate::progress::{Phase, Snapshot, Stage};
use crate::signals::Interrupts;

/// See the module.
pub(crate) struct Watch<'a> {
    phase: &'a Phase<'a>,
    interrupts: &'a Interrupts,
    settings: &'a RenderSettings,
    checkpoint: Option<&'a Checkpoint>,
    cache: Option<&'a CacheWriter<'a>>,
    start: Instant,
    last_checkpoint: Mutex<Instant>,
    /// The phase that the irradiance cache is in, and when it began.
    stage: Mutex<Option<(CachePhase, Duration)>>,
    /// When the irradiance cache or the grid was complete.
    prepass: OnceLock<Duration>,
    /// Samples that an earlier run had done.
    first_samples: OnceLock<u64>,
}

impl<'a> Watch<'a> {
    pub(crate) fn new(
        phase: &'a Phase<'a>,
        interrupts: &'a Interrupts,
        settings: &'a RenderSettings,
        checkpoint: Option<&'a Checkpoint>,
        cache: Option<&'a CacheWriter<'a>>,
        resumed_samples: u64,
    ) -> Self {
        let start = Instant::now();
        let first_samples = OnceLock::from(resumed_samples);
        let last_checkpoint = Mutex::new(start);
        Self {
            phase,
            interrupts,
            settings,
            checkpoint,
            cache,
            start,
            last_checkpoint,
            stage: Mutex::new(None),
            prepass: OnceLock::new(),
            first_samples,
        }
    }

    /// Time until the irradiance cache or the grid was complete, if it was.
    pub(crate) fn prepass(&self) -> Option<Duration> {
        self.prepass.get().copied()
    }

    /// When a phase of the cache was heard of first; the first one began at once.
    fn stage_begin(&self, phase: CachePhase) -> Duration {
        let mut stage = self.stage.lock().unwrap_or_else(PoisonError::into_inner);
        let begin = match *stage {
            Some((known, begin)) if known == phase => begin,
            None => Duration::ZERO,
            Some(_) => self.start.elapsed(),
        };
        *stage = Some((phase, begin));
        begin
    }

    /// Share done by each limit; the first one wins, hence the largest counts.
    fn fraction(&self, progress: &Progress, elapsed: f64) -> Option<f64> {
        let samples =
            progress.target_samples.map(|all| progress.samples as f64 / all.max(1) as f64);
        let time = self.settings.max_seconds.map(|limit| elapsed / limit);
        // The error falls about as the square root of the samples.
        let error = self
            .settings
            .target_error
            .zip(progress.error)
            .map(|(target, error)| f64::from(target / error).powi(2));
        [samples, time, error].into_iter().flatten().reduce(f64::max).map(|f| f.clamp(0.0, 1.0))
    }

    /// What fails before the end is tried again at the end.
    fn warn(&self, result: Result<(), Failure>) {
        for report in result.err().into_iter().flat_map(|failure| failure.reports) {
            self.phase.warn(&Report::warning(report.message));
        }
    }

    /// Time left until the first limit is reached.
    fn remaining(&self, progress: &Progress, elapsed: f64) -> Option<Duration> {
        let first = self.first_samples.get().copied().unwrap_or(0);
        let done = progress.samples.saturating_sub(first) as f64;
        let prepass = self.prepass().map_or(0.0, |time| time.as_secs_f64());
        let sampling = (elapsed - prepass).max(0.0);
        let samples = progress
            .target_samples
            .filter(|_| done > 0.0)
            .map(|all| all.saturating_sub(progress.samples) as f64 / done * sampling);
        let time = self.settings.max_seconds.map(|limit| (limit - elapsed).max(0.0));
        let error =
            self.settings.target_error.zip(progress.error).map(|(target, error)| {
                (f64::from(error / target).powi(2) - 1.0).max(0.0) * sampling
            });
        let left = [samples, time, error].into_iter().flatten().reduce(f64::min)?;
        Duration::try_from_secs_f64(left).ok()
    }
}

impl Observer for Watch<'_> {
    fn elapsed(&self) -> Duration {
        self.start.elapsed()
    }

    fn is_cancelled(&self) -> bool {
        self.interrupts.requested()
    }

    fn progress(&self, progress: &Progress) {
        let elapsed = self.start.elapsed().as_secs_f64();
        self.phase.update(Snapshot {
            task: None,
            fraction: self.fraction(progress, elapsed),
            rays: progress.rays,
            error: progress.error.map(f64::from),
            samples: Some((progress.spp, progress.target_spp)),
            remaining: self.remaining(progress, elapsed),
            stage: None,
        });
    }

    fn cache_progress(&self, progress: &CacheProgress) {
        self.phase.update(Snapshot {
            fraction: progress.fraction,
            rays: progress.rays,
            stage: Some(Stage {
                name: progress.phase.name(),
                begin: self.stage_begin(progress.phase),
                records: progress.records as u64,
                stride: progress.stride,
            }),
            ..Snapshot::default()
        });
    }

    fn checkpoint(&self, state: &RenderState) {
        // After an interruption the state is written anyway.
        let Some(checkpoint) = self.checkpoint.filter(|_| self.is_checkpoint_due()) else { return };
        self.warn(super::render::write_checkpoint(checkpoint, state));
        *self.last_checkpoint.lock().unwrap_or_else(PoisonError::into_inner) = Instant::now();
    }

    fn cache_ready(&self, cache: &IrradianceCache) {
        self.prepass.get_or_init(|| self.start.elapsed());
        if let Some(writer) = self.cache {
            self.warn(writer.write(cache));
        }
    }

    fn grid_ready(&self, _: &GridCache) {
        self.prepass.get_or_init(|| self.start.elapsed());
    }

    fn is_checkpoint_due(&self) -> bool {
        self.checkpoint.is_some_and(|checkpoint| {
            let last = self.last_checkpoint.lock().unwrap_or_else(PoisonError::into_inner);
            last.elapsed() >= checkpoint.every && !self.is_cancelled()
        })
    }
}
