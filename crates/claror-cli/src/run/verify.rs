//! Checking a finished picture by paths: `claror verify` and `claror render --verify`.

use std::time::{Duration, Instant};

use claror::integrator::{IntegratorKind, IrradianceCache};
use claror::render::{Observer, Progress, RenderOutput, RenderState};
use claror::scene::{Scene, SceneTables};
use claror::verify::{
    Budget, CacheCheck, CacheReport, PictureCheck, PictureReport, Verdict, Verification, verify,
};
use rayon::ThreadPool;
use serde_json::Value;

use super::{verify_picture, verify_report};
use crate::config::VerifyConfig;
use crate::exit::{Exit, Failure};
use crate::messages::{Console, Report};
use crate::progress::{OnInterrupt, Phase, Snapshot};
use crate::signals::Interrupts;

/// What a check needs beside the scene and the picture.
pub(crate) struct Checking<'a> {
    pub(crate) config: &'a VerifyConfig,
    pub(crate) console: &'a Console,
    pub(crate) interrupts: &'a Interrupts,
    pub(crate) pool: &'a ThreadPool,
    pub(crate) sensor: usize,
}

/// What the checks found, and how long they took.
pub(crate) struct Verified {
    verification: Verification,
    elapsed: Duration,
}

/// Fails if a picture by the scene's integrator cannot be checked.
pub(crate) fn check_possible(tables: &SceneTables) -> Result<(), Failure> {
    if tables.integrator.kind == IntegratorKind::Depth {
        return Err(Failure::usage(
            "the integrator depth computes no light that could be verified",
        )
        .hint("leave --verify out, or choose another integrator with -i"));
    }
    Ok(())
}

/// Checks a picture that took `rendered` to render. `None` when interrupted before there was
/// anything to tell.
pub(crate) fn run(
    checking: &Checking,
    scene: &Scene,
    output: &RenderOutput,
    rendered: Duration,
) -> Result<Option<Verified>, Failure> {
    let config = checking.config;
    let settings = config.settings(rendered);
    let phase = Phase::start(checking.console, checking.interrupts, "verify", OnInterrupt::Worker);
    let watch = Watch {
        phase: &phase,
        interrupts: checking.interrupts,
        start: Instant::now(),
        limit: match settings.budget {
            Budget::Time(limit) => Some(limit),
            Budget::Checks(_) => None,
        },
    };
    let sensor = &scene.tables.sensors[checking.sensor];
    let (picture, cache) = (&output.picture, output.cache.as_ref());
    let work = || verify(scene, sensor, picture, cache, &settings, &watch);
    let found = checking.pool.install(work).map_err(|error| Failure::usage(error.to_string()))?;
    let elapsed = phase.finish();
    let Some(verification) = found else { return Ok(None) };
    if let Some((path, format)) = &config.picture {
        let image = verify_picture::draw(picture, &verification.picture);
        super::compare::write(path, *format, &image)?;
        checking.console.result(&path.display().to_string());
    }
    Ok(Some(Verified { verification, elapsed }))
}

impl Verified {
    /// Tells what was found.
    pub(crate) fn show(&self, console: &Console, cache: Option<&IrradianceCache>) {
        for line in verify_report::lines(&self.verification, cache, self.elapsed) {
            console.result(&line);
        }
    }

    /// All numbers.
    pub(crate) fn json(&self, cache: Option<&IrradianceCache>) -> Value {
        verify_report::json(&self.verification, cache, self.elapsed)
    }

    /// Fails if a claim is refuted, and if strict, also if one is not confirmed.
    pub(crate) fn judge(&self, strict: bool) -> Result<(), Failure> {
        let found = &self.verification;
        let claims = [
            (
                found.bias_verdict(),
                format!("the mean of the picture is {}", verify_report::bias_claim(found)),
            ),
            (found.share_verdict(), verify_report::share_claim(found)),
        ];
        let reports: Vec<Report> = claims
            .into_iter()
            .filter(|(verdict, _)| {
                *verdict == Verdict::Refuted || (strict && *verdict == Verdict::Undecided)
            })
            .map(|(_, claim)| Report::error(claim))
            .collect();
        if reports.is_empty() {
            return Ok(());
        }
        Err(Failure { exit: Exit::CheckFailed, reports })
    }
}

/// The pixels that are told as the worst.
pub(crate) fn worst_pixels(report: &PictureReport) -> Vec<&PictureCheck> {
    report.worst.iter().map(|index| &report.checks[*index]).collect()
}

/// The look-ups that are told as the worst.
pub(crate) fn worst_lookups(report: &CacheReport) -> Vec<&CacheCheck> {
    report.worst.iter().map(|index| &report.checks[*index]).collect()
}

/// Clock, Ctrl-C and progress of the checks.
struct Watch<'a> {
    phase: &'a Phase<'a>,
    interrupts: &'a Interrupts,
    start: Instant,
    limit: Option<Duration>,
}

impl Observer for Watch<'_> {
    fn elapsed(&self) -> Duration {
        self.start.elapsed()
    }

    fn is_cancelled(&self) -> bool {
        self.interrupts.requested()
    }

    fn progress(&self, progress: &Progress) {
        let by_time =
            self.limit.map(|limit| self.elapsed().as_secs_f64() / limit.as_secs_f64().max(1e-9));
        let by_count = progress.target_samples.map(|all| progress.samples as f64 / all as f64);
        self.phase.update(Snapshot {
            fraction: by_time.or(by_count).map(|fraction| fraction.clamp(0.0, 1.0)),
            rays: progress.rays,
            ..Snapshot::default()
        });
    }

    fn checkpoint(&self, _: &RenderState) {}
}
