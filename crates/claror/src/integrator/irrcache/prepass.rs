//! The first pass: records where they are needed, from coarse to fine.
//!
//! Pixels are looked through on lattices of falling stride. Those that no record serves wait in a
//! queue; its first few get records, in parallel, which are then inserted one by one in the
//! queue's order unless a record of the same batch serves the place already. The batch depends on
//! the number of records alone, so the result is the same for any number of threads, and insertion
//! in the queue's order with a test before each makes it that of making one record at a time.

use rayon::prelude::*;

use super::gather::{Gatherer, Place, morton};
use super::hash::{HashStatistics, lit_normal};
use super::{Bounces, CacheContents, IrradianceCache, IrradianceHash};
use crate::bsdf::BsdfAtHit;
use crate::interaction::SurfaceInteraction;
use crate::irradiance::{Index, LookupSettings, Query, Record, lookup};
use crate::math::{Bounds3, Ray, Vec2};
use crate::sampler::{Sampler, SamplerKind, SamplerSettings};
use crate::scene::Scene;
use crate::sensor::{Camera, Sensor};
use crate::spectrum::Rgb;

/// Where in a pixel the prepass looks: not at the centre, which may lie exactly on an edge.
const WITHIN_PIXEL: Vec2 = Vec2::new(0.63, 0.29);
/// Coarsest lattice: about so many points across the picture.
const COARSEST: u32 = 8;
/// Surfaces that a camera ray is followed through to the first diffuse one.
const MAX_CHAIN: u32 = 12;
/// Records of a batch: a share of those that exist, within bounds.
const BATCH_SHARE: usize = 16;
const BATCH: (usize, usize) = (32, 4096);

/// What the first pass did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CacheStatistics {
    /// Records made and stored.
    pub records: usize,
    /// Made, but another of the same batch served their place.
    pub discarded: usize,
    /// Places where no valid record could be made.
    pub invalid: usize,
    /// Records whose radius was raised to the lower bound.
    pub raised: usize,
    /// Records whose radius was lowered to the upper bound.
    pub lowered: usize,
    /// Records whose radius was limited so that the linear model stays positive.
    pub gradient_limited: usize,
    /// Records whose axis ratio was limited.
    pub ratio_limited: usize,
    /// Records in crevices.
    pub crevices: usize,
    /// Walks that filled the hash of irradiance, where there is one.
    pub walks: usize,
    /// Rays traced, those of the walks included.
    pub rays: u64,
    /// Records by the lattice on which they were made: of stride 2ⁱ pixels at index i.
    pub levels: [usize; Self::LEVELS],
}

impl CacheStatistics {
    /// Lattices that a film of 32-bit size may need.
    pub const LEVELS: usize = 30;

    /// Counts a record that is stored.
    fn note(&mut self, record: &Record, level: usize) {
        let counts = [
            (Record::RAISED, &mut self.raised),
            (Record::LOWERED, &mut self.lowered),
            (Record::GRADIENT_LIMITED, &mut self.gradient_limited),
            (Record::RATIO_LIMITED, &mut self.ratio_limited),
            (Record::CREVICE, &mut self.crevices),
        ];
        for (flag, count) in counts {
            // What an old file says is not trusted to leave room.
            *count = count.saturating_add(usize::from(record.flags & flag != 0));
        }
        if let Some(count) = self.levels.get_mut(level) {
            *count = count.saturating_add(1);
        }
    }
}

/// Asked between batches.
pub type IsCancelled<'a> = &'a (dyn Fn() -> bool + Sync);

/// What the first pass looks through the camera with.
struct Eye<'a> {
    scene: &'a Scene,
    camera: Camera,
    samples: SamplerSettings,
}

impl IrradianceCache {
    /// Fills a cache for what a sensor sees. `None` when cancelled.
    pub fn build(scene: &Scene, sensor: &Sensor, is_cancelled: IsCancelled) -> Option<Self> {
        Self::update(scene, sensor, CacheContents::default(), is_cancelled)
    }

    /// Adds to the records of `first`, which stay as they are, what a sensor sees besides; the hash
    /// becomes that of this sensor. The cache must be of this scene and these settings. `None` when
    /// cancelled.
    pub fn update(
        scene: &Scene,
        sensor: &Sensor,
        first: CacheContents,
        is_cancelled: IsCancelled,
    ) -> Option<Self> {
        let settings = &scene.tables.integrator;
        let seed = sensor.sampler.seed;
        let camera = Camera::new(sensor);
        let crop = sensor.film.crop;
        let needs_hash = settings.cache.bounces == Bounces::Hash && settings.max_depth.is_none();
        let (hash, filled) = if needs_hash {
            let filled = IrradianceHash::new(scene, &camera, crop, seed, is_cancelled)?;
            (Some(filled.0), filled.1)
        } else {
            (None, HashStatistics::default())
        };
        let gatherer = Gatherer::new(scene, settings, hash.as_ref(), seed);
        let samples = SamplerSettings { kind: SamplerKind::Sobol, sample_count: 1, seed };
        let eye = Eye { scene, camera, samples };
        let bounds = scene.accel.bounds();
        let old_hash = first.hash.clone();
        let (old_count, old_statistics) = (first.records.len(), first.statistics);
        let mut filling = Filling::new(&gatherer, bounds, first);
        let longest = crop.width.max(crop.height);
        let mut stride = (longest / COARSEST).max(1).next_power_of_two();
        let mut is_first = true;
        while stride > 0 {
            let mut pixels: Vec<(u32, u32)> = (0..crop.height)
                .step_by(stride as usize)
                .flat_map(|y| (0..crop.width).step_by(stride as usize).map(move |x| (x, y)))
                .filter(|(x, y)| is_first || (x / stride) % 2 == 1 || (y / stride) % 2 == 1)
                .collect();
            // Spread out: neighbours in this order are far apart.
            pixels.sort_by_key(|(x, y)| morton(x / stride, y / stride).reverse_bits());
            filling.level = stride.trailing_zeros() as usize;
            filling.level(&eye, crop.x, crop.y, &pixels, is_cancelled)?;
            is_first = false;
            stride /= 2;
        }
        filling.statistics.walks += filled.walks;
        filling.statistics.rays += filled.rays;
        let (records, statistics) = filling.finish();
        if old_count > 0 && records.len() == old_count {
            // Nothing was missing: it stays as it was.
            return Some(Self::new(records, old_statistics, &settings.cache, old_hash));
        }
        Some(Self::new(records, statistics, &settings.cache, hash))
    }
}

/// A cache that is being filled.
struct Filling<'a> {
    gatherer: &'a Gatherer<'a>,
    lookup: LookupSettings,
    records: Vec<Record>,
    index: Index,
    statistics: CacheStatistics,
    /// Logarithm of the lattice's stride.
    level: usize,
}

impl<'a> Filling<'a> {
    fn new(gatherer: &'a Gatherer<'a>, bounds: Bounds3, first: CacheContents) -> Self {
        let lookup = LookupSettings::new(&gatherer.radius);
        // Surface points may round to just outside.
        let slack = 0.01 * bounds.extent() + f32::EPSILON * bounds.max.abs().max(bounds.min.abs());
        let bounds = Bounds3 { min: bounds.min - slack, max: bounds.max + slack };
        let mut index = Index::octree(bounds, lookup.reach());
        for (i, record) in first.records.iter().enumerate() {
            index.insert(i as u32, record);
        }
        let (records, statistics) = (first.records, first.statistics);
        Self { gatherer, lookup, records, index, statistics, level: 0 }
    }

    /// One lattice.
    fn level(
        &mut self,
        eye: &Eye,
        left: u32,
        top: u32,
        pixels: &[(u32, u32)],
        is_cancelled: IsCancelled,
    ) -> Option<()> {
        let mut queue: Vec<Place> = pixels
            .par_iter()
            .map(|&(x, y)| eye.place(left + x, top + y).filter(|p| !self.serves(p)))
            .collect::<Vec<_>>()
            .into_iter()
            .flatten()
            .collect();
        while !queue.is_empty() {
            if is_cancelled() {
                return None;
            }
            let batch = (self.records.len() / BATCH_SHARE).clamp(BATCH.0, BATCH.1).min(queue.len());
            let rest = queue.split_off(batch);
            self.batch(&queue);
            queue = rest
                .into_par_iter()
                .map(|p| Some(p).filter(|p| !self.serves(p)))
                .collect::<Vec<_>>()
                .into_iter()
                .flatten()
                .collect();
        }
        Some(())
    }

    fn batch(&mut self, places: &[Place]) {
        let gatherer = self.gatherer;
        let made: Vec<(Option<Record>, u64)> = places
            .par_iter()
            .with_max_len(1)
            .map(|place| {
                let mut rays = 0;
                (gatherer.record(place, &mut rays), rays)
            })
            .collect();
        for ((record, rays), place) in made.into_iter().zip(places) {
            self.statistics.rays += rays;
            let Some(record) = record else {
                self.statistics.invalid += 1;
                continue;
            };
            if self.serves(place) {
                self.statistics.discarded += 1;
                continue;
            }
            self.statistics.note(&record, self.level);
            self.index.insert(self.records.len() as u32, &record);
            self.records.push(record);
        }
    }

    fn serves(&self, place: &Place) -> bool {
        let n = lit_normal(&place.si);
        let query = Query { p: place.si.p, n_smooth: n, n_shading: n };
        lookup(&self.records, &self.index, &query, &self.lookup).is_some()
    }

    fn finish(mut self) -> (Vec<Record>, CacheStatistics) {
        self.statistics.records = self.records.len();
        (self.records, self.statistics)
    }
}

impl Eye<'_> {
    /// The first diffuse surface that a pixel sees, mirrors and glass followed.
    fn place(&self, x: u32, y: u32) -> Option<Place> {
        let film = Vec2::new(x as f32, y as f32) + WITHIN_PIXEL;
        let ray = self.camera.ray(film, Vec2::splat(0.5));
        let beside = self.camera.ray(film + Vec2::X, Vec2::splat(0.5));
        let key = u64::from(y) << 32 | u64::from(x);
        let mut sampler = Sampler::new(&self.samples, (x, y), u32::MAX);
        let seen = first_diffuse(self.scene, ray, &mut sampler)?;
        // Rays of one pixel start apart with a lens or without perspective. No difference of points
        // on them: far from the origin it would be rounding.
        let footprint = (beside.o - ray.o + (beside.d - ray.d) * seen.way).length();
        Some(Place { si: seen.si, footprint, key })
    }
}

/// A diffuse surface at the end of a chain of others.
pub(super) struct Seen {
    pub(super) si: SurfaceInteraction,
    /// Its diffuse albedo.
    pub(super) albedo: Rgb,
    /// What the chain leaves of its radiance.
    pub(super) throughput: Rgb,
    /// Length of the chain.
    pub(super) way: f32,
    /// Surfaces before it.
    pub(super) depth: u32,
}

/// The first diffuse surface that a ray meets, mirrors and glass followed.
pub(super) fn first_diffuse(scene: &Scene, ray: Ray, sampler: &mut Sampler) -> Option<Seen> {
    first_diffuse_by(scene, ray, |_| (sampler.next_1d(), sampler.next_2d()))
}

/// The same, with the random numbers that say how to go on behind so many surfaces.
pub(super) fn first_diffuse_by(
    scene: &Scene,
    mut ray: Ray,
    mut numbers: impl FnMut(u32) -> (f32, Vec2),
) -> Option<Seen> {
    let (mut way, mut throughput) = (0.0, Rgb::WHITE);
    let mut bsdf = BsdfAtHit::empty();
    for depth in 0..MAX_CHAIN {
        let si = scene.intersect(&ray)?;
        way += si.t;
        let tables = &scene.tables;
        let shape = &tables.shapes.shapes[si.shape.0 as usize];
        tables.bsdfs.read_at_hit(&tables.textures, &tables.shapes, shape.bsdf, &si, &mut bsdf);
        let albedo = bsdf.diffuse_albedo();
        if !albedo.is_black() {
            return Some(Seen { si, albedo, throughput, way, depth });
        }
        if bsdf.is_diffuse() {
            return None;
        }
        let (u_lobe, u) = numbers(depth);
        let sample = bsdf.sample(u_lobe, u)?;
        throughput *= sample.weight;
        ray = si.spawn_ray(sample.wi);
    }
    None
}
