//! How far a finished picture is off, measured by spot checks against paths.
//!
//! A check looks at a random pixel and compares the picture's value with the mean of path-traced
//! samples whose random numbers are independent of the picture's. With an irradiance cache a
//! second kind of check compares look-ups with irradiance by random walks. No assumption about
//! how the picture was made goes in, so the checks find what the picture's own statistics cannot:
//! light that an approximation loses or adds.
//!
//! Checks come in rounds of two per stratum of the picture. Check number `k` is a pure function of
//! `k`, the seed and the number of strata, so for a given number of checks the report has the same
//! bits for any number of threads; a time only decides how many rounds there are.
//!
//! Measured is this picture, its noise included: its mean differs from the truth by bias and by
//! what is left of the noise, and both count.

mod cache;
mod estimate;
mod picture;
mod strata;
#[cfg(test)]
mod tests;

pub use cache::{CacheCheck, CacheReport};
pub use estimate::{
    Estimate, Interval, LEVEL, Noise, Share, Verdict, clopper_pearson, stratified_mean,
    stratified_ratio,
};
pub use picture::{PictureCheck, PictureReport};

use std::time::Duration;

use rayon::prelude::*;

use crate::film::Picture;
use crate::integrator::{IntegratorKind, IrradianceCache};
use crate::render::{Observer, Progress};
use crate::scene::Scene;
use crate::sensor::Sensor;

use cache::CacheChecker;
use picture::PictureChecker;
use strata::Strata;

/// Fewest checks that can be asked for: below, intervals say nothing.
pub const LEAST_CHECKS: u32 = 16;
/// Most checks: all are kept until the end.
pub const MOST_CHECKS: u32 = 10_000_000;
/// Most checks of a round.
const ROUND: u32 = 256;
/// Checks per stratum and round: two tell how they differ.
const PER_STRATUM: usize = 2;
/// Places that are reported as the worst.
const WORST: usize = 5;

/// How many checks to make.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Budget {
    /// So many, rounded up a little to whole rounds.
    Checks(u32),
    /// As many as fit in a time, at least one round.
    Time(Duration),
}

/// What to check, and what is claimed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VerifySettings {
    /// How many checks.
    pub budget: Budget,
    /// Paths per check of the picture; rounded up to a multiple of 16.
    pub paths: u32,
    /// Relative error from which a pixel counts as off.
    pub tolerance: f64,
    /// Claim: the mean of the picture is off by no more than this share of it.
    pub max_bias: f64,
    /// Claim: no larger share of the pixels is off by more than the tolerance.
    pub max_share: f64,
}

impl Default for VerifySettings {
    fn default() -> Self {
        Self {
            budget: Budget::Checks(1024),
            paths: 64,
            tolerance: 0.05,
            max_bias: 0.003,
            max_share: 0.05,
        }
    }
}

/// What the checks found.
#[derive(Debug, Clone, PartialEq)]
pub struct Verification {
    /// The picture.
    pub picture: PictureReport,
    /// The irradiance cache, where there is one.
    pub cache: Option<CacheReport>,
    /// Rays traced.
    pub rays: u64,
    /// What was asked.
    pub settings: VerifySettings,
}

/// Why nothing can be verified.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum VerifyError {
    /// The picture does not show light.
    #[error("the integrator depth computes no light: there is nothing to verify")]
    NoLight,
    /// The picture is of another film.
    #[error("the picture has {picture:?} pixels, the film {film:?}")]
    OtherFilm {
        /// Size of the picture.
        picture: (usize, usize),
        /// Size of the film's crop window.
        film: (usize, usize),
    },
}

impl Verification {
    /// Whether the mean luminance of the picture is as exact as claimed.
    pub fn bias_verdict(&self) -> Verdict {
        let limit = self.settings.max_bias;
        self.picture.bias[3].interval().verdict(&Interval { low: -limit, high: limit })
    }

    /// Whether as many pixels are within the tolerance as claimed.
    pub fn share_verdict(&self) -> Verdict {
        let claim = Interval { low: 0.0, high: self.settings.max_share };
        self.picture.beyond.interval().verdict(&claim)
    }

    /// Refuted if one of the claims is, confirmed if both are.
    pub fn verdict(&self) -> Verdict {
        match [self.bias_verdict(), self.share_verdict()] {
            [Verdict::Refuted, _] | [_, Verdict::Refuted] => Verdict::Refuted,
            [Verdict::Confirmed, Verdict::Confirmed] => Verdict::Confirmed,
            _ => Verdict::Undecided,
        }
    }

    /// About how many checks would decide on the mean, if the error stays what it seems to be:
    /// margins shrink with the root of the number.
    pub fn checks_to_decide(&self) -> f64 {
        let bias = &self.picture.bias[3];
        let room = (self.settings.max_bias - bias.value.abs()).abs();
        self.picture.checks.len() as f64 * (bias.margin() / room).powi(2)
    }
}

/// Sizes of the work.
struct Plan {
    strata: usize,
    rounds: Option<u32>,
}

impl Plan {
    fn new(budget: Budget) -> Self {
        match budget {
            Budget::Checks(checks) => {
                let checks = checks.clamp(LEAST_CHECKS, MOST_CHECKS);
                let rounds = checks.div_ceil(ROUND);
                let strata = checks.div_ceil(rounds).div_ceil(PER_STRATUM as u32);
                Self { strata: strata as usize, rounds: Some(rounds) }
            }
            Budget::Time(_) => Self { strata: ROUND as usize / PER_STRATUM, rounds: None },
        }
    }
}

/// Checks a picture that `sensor` took of the scene, and the cache that it was made with. `None`
/// when cancelled before the first round was complete.
pub fn verify(
    scene: &Scene,
    sensor: &Sensor,
    picture: &Picture,
    cache: Option<&IrradianceCache>,
    settings: &VerifySettings,
    observer: &dyn Observer,
) -> Result<Option<Verification>, VerifyError> {
    if scene.tables.integrator.kind == IntegratorKind::Depth {
        return Err(VerifyError::NoLight);
    }
    let image = &picture.beauty.image;
    let found = (image.width, image.height);
    let film = (sensor.film.crop.width as usize, sensor.film.crop.height as usize);
    if found != film || film.0 == 0 || film.1 == 0 {
        return Err(VerifyError::OtherFilm { picture: found, film });
    }
    let plan = Plan::new(settings.budget);
    let strata = Strata::new(sensor.film.crop, plan.strata);
    let of_picture = PictureChecker::new(scene, sensor, picture, strata, settings.paths);
    let of_cache = cache.map(|cache| CacheChecker::new(scene, sensor, cache, strata));
    let check = |index: u32| {
        let mut rays = 0;
        let picture = of_picture.check(index, &mut rays);
        let cache = of_cache.as_ref().map(|checker| checker.check(index, &mut rays));
        (picture, cache, rays)
    };
    let (checks, rays) = in_rounds(&plan, settings.budget, &check, observer);
    if checks.is_empty() {
        return Ok(None);
    }
    let (of_pixels, of_places): (Vec<_>, Vec<_>) = checks.into_iter().unzip();
    Ok(Some(Verification {
        picture: PictureReport::new(of_pixels, &of_picture, settings),
        cache: of_cache
            .map(|checker| CacheReport::new(of_places.into_iter().flatten().collect(), &checker)),
        rays,
        settings: *settings,
    }))
}

type Checks = Vec<(PictureCheck, Option<CacheCheck>)>;

/// Whole rounds of checks, until there are enough or the time is over.
fn in_rounds(
    plan: &Plan,
    budget: Budget,
    check: &(impl Fn(u32) -> (PictureCheck, Option<CacheCheck>, u64) + Sync),
    observer: &dyn Observer,
) -> (Checks, u64) {
    let begin = observer.elapsed();
    let per_round = (plan.strata * PER_STRATUM) as u32;
    let (mut all, mut rays) = (Checks::new(), 0);
    for round in 0..plan.rounds.unwrap_or(MOST_CHECKS / per_round) {
        let indices = round * per_round..(round + 1) * per_round;
        let found: Vec<Option<_>> = indices
            .into_par_iter()
            .with_max_len(1)
            .map(|index| (!observer.is_cancelled()).then(|| check(index)))
            .collect();
        let Some(found) = found.into_iter().collect::<Option<Vec<_>>>() else { break };
        for (picture, cache, cost) in found {
            all.push((picture, cache));
            rays += cost;
        }
        observer.progress(&Progress {
            spp: round + 1,
            target_spp: plan.rounds,
            samples: all.len() as u64,
            target_samples: plan.rounds.map(|n| u64::from(n) * u64::from(per_round)),
            rays,
            error: None,
        });
        if let Budget::Time(limit) = budget {
            let spent = observer.elapsed().saturating_sub(begin);
            if spent + spent / (round + 1) > limit {
                break;
            }
        }
    }
    (all, rays)
}

/// The numbers of the few largest positive values, the largest first.
fn worst_first(values: impl Iterator<Item = f64>) -> Vec<usize> {
    let mut found: Vec<(usize, f64)> = values.enumerate().filter(|(_, v)| *v > 0.0).collect();
    found.sort_by(|a, b| b.1.total_cmp(&a.1));
    found.into_iter().take(WORST).map(|(i, _)| i).collect()
}
