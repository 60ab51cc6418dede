//! A look-up beside what it stands for: irradiance by walks that know no cache.

use super::IrradianceCache;
use super::contact::{Contact, Served};
use super::hash::lit_normal;
use super::prepass::first_diffuse;
use crate::integrator::IntegratorSettings;
use crate::integrator::path::record_walk;
use crate::interaction::SurfaceInteraction;
use crate::irradiance::{Grid, Interpolated, Query, Record};
use crate::math::{Frame, Ray, Vec3};
use crate::sampler::{Sampler, SamplerKind, SamplerSettings};
use crate::scene::Scene;
use crate::spectrum::Rgb;
use std::f32::consts::{FRAC_1_PI, PI};

/// A look-up with less weight stands at the edge of what its records reach.
const LITTLE_WEIGHT: f32 = 0.2;

/// How exactly a probe looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ProbeSettings {
    /// Independent batches of walks, at least 2.
    pub batches: u32,
    /// The walks of a batch start in the cells of an n × n grid over the hemisphere.
    pub grid: u32,
    /// Seed of the walks.
    pub seed: u64,
}

impl ProbeSettings {
    /// Walks per probe.
    pub fn walks(&self) -> u32 {
        self.batches * self.grid * self.grid
    }
}

/// What the cache says at a point and what is true there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Probe {
    /// Where, world space.
    pub position: Vec3,
    /// Radiance at the camera per irradiance.
    pub weight: Rgb,
    /// What the picture takes from the cache, contact shadows among it; `None` where no record
    /// serves the point.
    pub cached: Option<Interpolated>,
    /// Irradiance by walks, W·m⁻².
    pub expected: Rgb,
    /// Squared standard error of the luminance of [`Probe::expected`] less what is cached.
    pub variance: f64,
}

/// Why a look-up may be far off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// All records that serve the point hardly reach it.
    LittleWeight,
    /// One record alone serves it.
    OneRecord,
    /// The nearest record lies in a crevice.
    Crevice,
    /// The nearest record would reach less far but for the least radius.
    LeastRadius,
    /// Nothing special: the light changes faster than the records assume.
    Interpolation,
}

impl Cause {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::LittleWeight => "at the edge of the records' reach",
            Self::OneRecord => "one record only",
            Self::Crevice => "near a crevice",
            Self::LeastRadius => "records at the least radius",
            Self::Interpolation => "interpolation",
        }
    }
}

impl IrradianceCache {
    /// Compares the cache with walks at the first diffuse surface that a ray from the camera
    /// meets. `None` where there is none, or where its indirect light is beyond `max_depth`.
    /// `stream` names the walks' random numbers.
    pub fn probe(
        &self,
        scene: &Scene,
        ray: &Ray,
        chain: &mut Sampler,
        settings: &ProbeSettings,
        stream: u32,
        rays: &mut u64,
    ) -> Option<Probe> {
        let integrator = &scene.tables.integrator;
        let seen = first_diffuse(scene, *ray, chain)?;
        let least = if scene.lights.has_cached_sky() { 1 } else { 2 };
        if integrator.max_depth.is_some_and(|limit| seen.depth + least >= limit) {
            return None;
        }
        let n = lit_normal(&seen.si);
        let query = Query { p: seen.si.p, n_smooth: n, n_shading: n };
        let served = self.all().lookup_seen(scene, &seen.si, &query, rays);
        let walks = Walks {
            scene,
            integrator,
            n: settings.grid,
            samples: SamplerSettings {
                kind: SamplerKind::Sobol,
                sample_count: settings.grid * settings.grid,
                seed: settings.seed,
            },
            si: &seen.si,
            frame: Frame::from_normal(n),
        };
        let is_wanted = integrator.cache.debias <= 0.0;
        let contact = served.as_ref().filter(|_| is_wanted).map(|served| Contact {
            scene,
            view: self.all(),
            served,
            si: &seen.si,
            depth: seen.depth,
        });
        let mut means = Means::default();
        for batch in 0..settings.batches {
            let expected = walks.irradiance((stream, batch), rays);
            let added = contact
                .map_or(Rgb::BLACK, |contact| walks.contact(&contact, (stream, !batch), rays));
            means.add(expected, added);
        }
        let Means { expected, added, .. } = means;
        Some(Probe {
            position: seen.si.p,
            weight: seen.throughput * seen.albedo * FRAC_1_PI,
            cached: served.as_ref().map(|Served { found, .. }| Interpolated {
                irradiance: found.irradiance + Rgb::from(added.map(|m| m as f32)),
                ..*found
            }),
            expected: Rgb::from(expected.map(|m| m as f32)),
            variance: means.variance(),
        })
    }

    /// What may be the reason where a probe shows a large error. Looks through all records.
    pub fn cause(&self, probe: &Probe) -> Cause {
        let Some(found) = probe.cached else { return Cause::Interpolation };
        let distance = |record: &&Record| record.position.distance_squared(probe.position);
        let nearest = self.records.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let has = |flag: u32| nearest.is_some_and(|record| record.flags & flag != 0);
        if found.weight < LITTLE_WEIGHT {
            Cause::LittleWeight
        } else if found.records == 1 {
            Cause::OneRecord
        } else if has(Record::CREVICE) {
            Cause::Crevice
        } else if has(Record::RAISED) {
            Cause::LeastRadius
        } else {
            Cause::Interpolation
        }
    }
}

/// Means over batches of walks.
#[derive(Default)]
struct Means {
    batches: f64,
    /// Irradiance by walks.
    expected: [f64; 3],
    /// What the picture adds to the records'.
    added: [f64; 3],
    /// Of the luminance of the former less the latter: mean, and sum of the squared deviations.
    difference: f64,
    squares: f64,
}

impl Means {
    fn add(&mut self, expected: Rgb, added: Rgb) {
        self.batches += 1.0;
        for (mean, new) in [(&mut self.expected, expected), (&mut self.added, added)] {
            for (mean, new) in mean.iter_mut().zip(new.to_array()) {
                *mean += (f64::from(new) - *mean) / self.batches;
            }
        }
        // Welford's update.
        let difference = f64::from(expected.luminance()) - f64::from(added.luminance());
        let step = difference - self.difference;
        self.difference += step / self.batches;
        self.squares += step * (difference - self.difference);
    }

    /// Of the mean difference.
    fn variance(&self) -> f64 {
        self.squares / (self.batches * (self.batches - 1.0))
    }
}

/// Walks from a point, one from each cell of an n × n grid over the hemisphere.
struct Walks<'a> {
    scene: &'a Scene,
    integrator: &'a IntegratorSettings,
    n: u32,
    samples: SamplerSettings,
    si: &'a SurfaceInteraction,
    frame: Frame,
}

impl Walks<'_> {
    /// One batch: irradiance by paths that know no cache.
    fn irradiance(&self, stream: (u32, u32), rays: &mut u64) -> Rgb {
        self.batch(stream, |wi, sampler| {
            let ray = self.si.spawn_ray(wi);
            record_walk(self.scene, self.integrator, &ray, sampler, rays).0
        })
    }

    /// One batch: what the picture adds to a look-up for what records do not know.
    fn contact(&self, contact: &Contact, stream: (u32, u32), rays: &mut u64) -> Rgb {
        self.batch(stream, |wi, sampler| contact.missing(wi, sampler, rays))
    }

    fn batch(
        &self,
        stream: (u32, u32),
        mut radiance: impl FnMut(Vec3, &mut Sampler) -> Rgb,
    ) -> Rgb {
        let grid = Grid::Concentric { n: self.n };
        let mut sum = Rgb::BLACK;
        for index in 0..self.n * self.n {
            let mut sampler = Sampler::new(&self.samples, stream, index);
            let local = grid.direction(index % self.n, index / self.n, sampler.next_2d());
            let radiance = radiance(self.frame.to_world(local), &mut sampler);
            // What is not finite counts as black, as in records.
            if radiance.is_finite() {
                sum += radiance;
            }
        }
        sum * (PI / (self.n * self.n) as f32)
    }
}
