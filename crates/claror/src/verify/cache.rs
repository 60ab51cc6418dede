//! The irradiance cache against walks.

use super::estimate::{Estimate, Noise, Share, stratified_ratio};
use super::picture::relative_scale;
use super::strata::Strata;
use super::worst_first;
use crate::integrator::{IrradianceCache, Probe, ProbeSettings};
use crate::math::Vec2;
use crate::sampler::{Sampler, SamplerKind, SamplerSettings};
use crate::scene::Scene;
use crate::sensor::{Camera, Sensor};

/// Keeps the random numbers apart from those of picture and records.
const STREAM: u64 = 0x2f8e_61c4_95a7_0b3d;
const PROBE: ProbeSettings = ProbeSettings { batches: 16, grid: 3, seed: 0 };

/// One point of the film at which the cache was looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CacheCheck {
    /// Column and row in the picture.
    pub pixel: (u32, u32),
    /// What was found there; `None` where nothing is seen that the cache could serve.
    pub probe: Option<Probe>,
}

/// Luminances at a point that the cache serves.
#[derive(Clone, Copy)]
struct Served {
    cached: f64,
    difference: f64,
    variance: f64,
}

impl CacheCheck {
    fn served(&self) -> Option<Served> {
        let probe = self.probe.as_ref()?;
        let cached = f64::from(probe.cached?.irradiance.luminance());
        let difference = cached - f64::from(probe.expected.luminance());
        Some(Served { cached, difference, variance: probe.variance })
    }

    /// Luminance of the irradiance that the cache says, and of that by walks.
    pub fn irradiance(&self) -> Option<(f64, f64)> {
        self.served().map(|served| (served.cached, served.cached - served.difference))
    }

    /// Radiance at the camera by the cache, and how much of it is too much.
    fn seen(&self) -> (f64, f64) {
        let Some(probe) = &self.probe else { return (0.0, 0.0) };
        let Some(cached) = &probe.cached else { return (0.0, 0.0) };
        let by_cache = probe.weight * cached.irradiance;
        let excess = probe.weight * (cached.irradiance - probe.expected);
        (by_cache.luminance().into(), excess.luminance().into())
    }
}

/// Makes checks.
pub(super) struct CacheChecker<'a> {
    scene: &'a Scene,
    cache: &'a IrradianceCache,
    camera: Camera,
    strata: Strata,
    probe: ProbeSettings,
}

impl<'a> CacheChecker<'a> {
    pub(super) fn new(
        scene: &'a Scene,
        sensor: &Sensor,
        cache: &'a IrradianceCache,
        strata: Strata,
    ) -> Self {
        let probe = ProbeSettings { seed: sensor.sampler.seed ^ STREAM, ..PROBE };
        Self { scene, cache, camera: Camera::new(sensor), strata, probe }
    }

    /// Check `index`; a pure function of it.
    pub(super) fn check(&self, index: u32, rays: &mut u64) -> CacheCheck {
        let independent = SamplerSettings {
            kind: SamplerKind::Independent,
            sample_count: 1,
            seed: self.probe.seed,
        };
        let mut sampler = Sampler::new(&independent, (index, u32::MAX), 0);
        let place = sampler.next_2d();
        let point = self.strata.point(index as usize % self.strata.count, place);
        let lens = if self.camera.has_lens() { sampler.next_2d() } else { Vec2::splat(0.5) };
        let ray = self.camera.ray(Vec2::new(point.0 as f32, point.1 as f32), lens);
        let probe = self.cache.probe(self.scene, &ray, &mut sampler, &self.probe, index, rays);
        CacheCheck { pixel: self.strata.pixel(point), probe }
    }
}

/// How far the cache is off, by its checks.
#[derive(Debug, Clone, PartialEq)]
pub struct CacheReport {
    /// All checks, in order.
    pub checks: Vec<CacheCheck>,
    /// Walks per check.
    pub walks: u32,
    /// Points that the cache serves, and points where it should.
    pub served: (usize, usize),
    /// Mean irradiance where it serves, W·m⁻², luminance.
    pub mean: f64,
    /// Excess of the light that the picture gets from the cache, relative to it; `None` where
    /// there is no such light.
    pub bias: Option<Estimate>,
    /// Mean squared error of look-ups, the checks' own noise taken off, relative to the square of
    /// the mean irradiance: may come out slightly negative. `None` without any.
    pub mse: Option<Estimate>,
    /// Look-ups that are off by more than the tolerance.
    pub beyond: Share,
    /// The cache's parameter `error`, relative to the square root of squared irradiance plus a
    /// hundredth of its squared mean.
    pub tolerance: f64,
    /// How exact the checks are.
    pub noise: Noise,
    /// Checks that are surely off, the worst first.
    pub worst: Vec<usize>,
}

impl CacheReport {
    pub(super) fn new(checks: Vec<CacheCheck>, checker: &CacheChecker) -> Self {
        let strata = checker.strata.count;
        let tolerance = f64::from(checker.scene.tables.integrator.cache.error);
        let all: Vec<Option<Served>> = checks.iter().map(CacheCheck::served).collect();
        let served: Vec<Served> = all.iter().copied().flatten().collect();
        let sum = served.iter().map(|s| s.cached).sum::<f64>();
        let mean = if served.is_empty() { 0.0 } else { sum / served.len() as f64 };
        let seen: Vec<(f64, f64)> = checks.iter().map(CacheCheck::seen).collect();
        let (light, excess): (Vec<f64>, Vec<f64>) = seen.into_iter().unzip();
        let squares = |s: &Served| s.difference.powi(2) - s.variance;
        let squares: Vec<f64> = all.iter().map(|s| s.as_ref().map_or(0.0, squares)).collect();
        let ones: Vec<f64> = all.iter().map(|s| f64::from(u8::from(s.is_some()))).collect();
        let noise = Noise::new(served.iter().map(|s| (s.cached, s.variance)));
        let error = |s: &Served| noise.error(s.cached, s.variance);
        let scale = |s: &Served| relative_scale(s.cached, mean);
        let badness = |s: &Served| (s.difference.abs() - Share::SIGMAS * error(s)) / scale(s);
        Self {
            walks: checker.probe.walks(),
            served: (served.len(), checks.iter().filter(|c| c.probe.is_some()).count()),
            mean,
            bias: stratified_ratio(&excess, &light, strata),
            mse: stratified_ratio(&squares, &ones, strata)
                .filter(|_| mean > 0.0)
                .map(|mse| mse.scaled(1.0 / (mean * mean))),
            beyond: Share::new(
                served.iter().map(|s| (s.difference, error(s), tolerance * scale(s))),
            ),
            tolerance,
            noise,
            worst: worst_first(all.iter().map(|s| s.as_ref().map_or(0.0, badness))),
            checks,
        }
    }

    /// Difference of a check's irradiance over the standard error of the walks.
    pub fn sigmas(&self, check: &CacheCheck) -> f64 {
        match check.served() {
            Some(s) if s.difference != 0.0 => s.difference / self.noise.error(s.cached, s.variance),
            _ => 0.0,
        }
    }

    /// Relative error of the irradiance as a standard deviation, with its lower and upper bound.
    pub fn rmse(&self) -> Option<(f64, f64, f64)> {
        let mse = self.mse?;
        let root = |v: f64| v.max(0.0).sqrt();
        Some((root(mse.value), root(mse.interval().low), root(mse.interval().high)))
    }

    /// The share of points that no record serves, of those that could be.
    pub fn unserved(&self) -> Share {
        let (served, all) = self.served;
        Share { surely: all - served, possibly: all - served, of: all }
    }
}
