//! The first pass: records where they are needed, from coarse to fine.
//!
//! Pixels are looked through on lattices of falling stride. Those that no record serves wait in a
//! queue; its first few get records, in parallel, which are then inserted one by one in the
//! queue's order unless a record of the same batch serves the place already. The batch depends on
//! the number of records alone, so the result is the same for any number of threads, and insertion
//! in the queue's order with a test before each makes it that of making one record at a time.
//!
//! Without an *overture* the records are made as the oldest programs did it: pixel after pixel in
//! raster order, and a pixel sees no record that was made after it.

use rayon::prelude::*;

use super::deep::DeepCache;
use super::gather::{Gathered, Gatherer, Place, morton};
use super::hash::{HashStatistics, lit_normal};
use super::progress::{CachePhase, CacheProgress, CacheWatch, IsCancelled, Share};
use super::smooth::{Origin, smooth};
use super::{
    Bounces, CacheContents, IrrCacheSettings, IrradianceCache, IrradianceHash, WalkEnd,
    is_in_sight, pixel_key, with_slack,
};
use crate::bsdf::BsdfAtHit;
use crate::film::CropWindow;
use crate::integrator::light::past;
use crate::interaction::SurfaceInteraction;
use crate::irradiance::{
    Index, LookupSettings, NeighbourClamp, Query, RadiusBounds, Record, Surroundings, limited,
    lookup, lookup_seen,
};
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
/// Most further looks at all pixels after neighbours have shrunk records.
const MAX_ROUNDS: u32 = 8;

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

/// What the first pass looks through the camera with.
pub(super) struct Eye<'a> {
    pub(super) scene: &'a Scene,
    camera: Camera,
    pub(super) samples: SamplerSettings,
}

impl IrradianceCache {
    /// Fills a cache for what a sensor sees. `None` when cancelled.
    pub fn build(scene: &Scene, sensor: &Sensor, is_cancelled: IsCancelled) -> Option<Self> {
        Self::update(scene, sensor, CacheContents::default(), CacheWatch::silent(is_cancelled))
    }

    /// Adds to the records of `first`, which stay as they are, what a sensor sees besides; the hash
    /// becomes that of this sensor. The cache must be of this scene and these settings. `None` when
    /// cancelled. Without an overture a cache belongs to one view, and stays as it is.
    pub fn update(
        scene: &Scene,
        sensor: &Sensor,
        first: CacheContents,
        watch: CacheWatch,
    ) -> Option<Self> {
        let settings = &scene.tables.integrator;
        let bounds = scene.accel.bounds();
        if !settings.cache.overture() && !first.records.is_empty() {
            return Some(first.freeze(&settings.cache, bounds));
        }
        let eye = Eye::new(scene, sensor);
        let (seed, crop) = (eye.samples.seed, sensor.film.crop);
        let needs_hash = settings.cache.bounces == Bounces::Hash && settings.max_depth.is_none();
        let (hash, filled) = if needs_hash {
            let filled = IrradianceHash::new(scene, &eye.camera, crop, seed, watch)?;
            (Some(filled.0), filled.1)
        } else {
            (None, HashStatistics::default())
        };
        let deep = match settings.cache.bounces {
            Bounces::Cache => Some(DeepCache::new(&eye, crop, watch)?),
            Bounces::Hash | Bounces::Path => None,
        };
        let ends = hash.as_ref().map(WalkEnd::Hash).or(deep.as_ref().map(WalkEnd::Cache));
        let gatherer = Gatherer::new(scene, settings, ends, seed);
        let old_hash = first.hash.clone();
        let (old_count, old_statistics) = (first.records.len(), first.statistics);
        let mut filling = Filling::new(&gatherer, &settings.cache, bounds, first, watch);
        if settings.cache.overture() {
            filling.overture(&eye, crop)?;
        } else {
            filling.raster(&eye, crop)?;
        }
        filling.smooth()?;
        let (deep_walks, deep_rays) = deep.as_ref().map_or((0, 0), DeepCache::cost);
        filling.statistics.walks += filled.walks + deep_walks;
        filling.statistics.rays += filled.rays + deep_rays;
        let contents = filling.finish();
        let contents = if old_count > 0 && contents.records.len() == old_count {
            // Nothing was missing: it stays as it was.
            CacheContents { statistics: old_statistics, hash: old_hash, ..contents }
        } else {
            CacheContents { hash, ..contents }
        };
        Some(contents.freeze(&settings.cache, bounds))
    }
}

/// A cache that is being filled.
pub(super) struct Filling<'a> {
    gatherer: &'a Gatherer<'a>,
    lookup: LookupSettings,
    records: Vec<Record>,
    /// What they saw, one by one, or nothing.
    surroundings: Vec<Surroundings>,
    index: Index,
    /// Where its last records come from, all that were made here.
    origins: Vec<Origin>,
    statistics: CacheStatistics,
    /// Logarithm of the lattice's stride.
    level: usize,
    neighbours: Option<Neighbours>,
    /// Where leaks are to be avoided.
    protected_scene: Option<&'a Scene>,
    watch: CacheWatch<'a>,
    phase: CachePhase,
    share: Share,
    /// Records and rays that there were before.
    before: (usize, u64),
}

/// What is needed to clamp records by their neighbours.
struct Neighbours {
    clamp: NeighbourClamp,
    /// Before clamping; the first ones are from elsewhere and stay as they are.
    originals: Vec<(Record, RadiusBounds)>,
    /// How many those are.
    fixed: usize,
}

impl Neighbours {
    fn new(slope: f32, first: &[Record]) -> Self {
        let mut clamp = NeighbourClamp::new(slope);
        for record in first {
            clamp.insert(record.position, record.natural_radius, |_, _| ());
        }
        Self { clamp, originals: Vec::new(), fixed: first.len() }
    }

    /// The record as its neighbours leave it, after which the neighbours are left as it does.
    fn meet(&mut self, record: Record, bounds: RadiusBounds, records: &mut [Record]) -> Record {
        let Self { clamp, originals, fixed } = self;
        let limit = clamp.insert(record.position, record.natural_radius, |i, limit| {
            if let Some(at) = i.checked_sub(*fixed) {
                let (original, bounds) = &originals[at];
                records[i] = limited(original, limit, bounds);
            }
        });
        originals.push((record, bounds));
        limited(&record, limit, &bounds)
    }
}

impl<'a> Filling<'a> {
    pub(super) fn new(
        gatherer: &'a Gatherer<'a>,
        cache: &IrrCacheSettings,
        bounds: Bounds3,
        first: CacheContents,
        watch: CacheWatch<'a>,
    ) -> Self {
        let lookup = cache.lookup();
        let mut index = Index::growing(cache.index(), with_slack(bounds), lookup.reach());
        for (i, record) in first.records.iter().enumerate() {
            index.insert(i as u32, record);
        }
        let neighbours = cache
            .clamp_neighbor()
            .then(|| Neighbours::new(gatherer.radius.neighbour_slope(), &first.records));
        let CacheContents { records, surroundings, statistics, .. } = first;
        let protected_scene = cache.leak_protection().then_some(gatherer.scene);
        Self {
            gatherer,
            lookup,
            before: (records.len(), statistics.rays),
            records,
            surroundings,
            index,
            origins: Vec::new(),
            statistics,
            level: 0,
            neighbours,
            protected_scene,
            watch,
            phase: CachePhase::Records,
            share: Share::default(),
        }
    }

    /// Of another phase, whose share is not known.
    pub(super) fn during(self, phase: CachePhase) -> Self {
        Self { phase, ..self }
    }

    /// Tells how far it is, with so much of the present step done.
    fn tell(&mut self, part: f64) {
        let stride = (self.phase == CachePhase::Records).then(|| 1 << self.level);
        self.watch.tell(&CacheProgress {
            phase: self.phase,
            fraction: self.share.at(part),
            stride,
            records: self.records.len() - self.before.0,
            rays: self.statistics.rays.saturating_sub(self.before.1),
        });
    }

    /// From coarse to fine.
    fn overture(&mut self, eye: &Eye, crop: CropWindow) -> Option<()> {
        let longest = crop.width.max(crop.height);
        let mut stride = (longest / COARSEST).max(1).next_power_of_two();
        let mut is_first = true;
        // Rounds for clamped records count as one lattice more.
        let rounds = u32::from(self.neighbours.is_some());
        self.share = Share::of(stride.trailing_zeros() + 1 + rounds);
        while stride > 0 {
            let pixels = lattice(crop, stride, is_first);
            self.level = stride.trailing_zeros() as usize;
            self.level(eye, crop.x, crop.y, &pixels)?;
            is_first = false;
            stride /= 2;
        }
        if self.neighbours.is_some() {
            let pixels = lattice(crop, 1, true);
            for _ in 0..MAX_ROUNDS {
                let before = self.records.len();
                self.level(eye, crop.x, crop.y, &pixels)?;
                if self.records.len() == before {
                    break;
                }
            }
        }
        Some(())
    }

    /// Pixel after pixel, row by row.
    fn raster(&mut self, eye: &Eye, crop: CropWindow) -> Option<()> {
        self.share = Share::of(crop.height);
        for y in crop.y..crop.y + crop.height {
            let columns = (crop.x..crop.x + crop.width).into_par_iter();
            let row: Vec<Option<Place>> = columns.map(|x| eye.place(x, y)).collect();
            for place in row.into_iter().flatten() {
                if !self.serves(&place) {
                    self.batch(&[place])?;
                }
            }
            self.share.step();
            self.tell(0.0);
        }
        Some(())
    }

    /// One lattice.
    fn level(&mut self, eye: &Eye, left: u32, top: u32, pixels: &[(u32, u32)]) -> Option<()> {
        let places = pixels.par_iter().map(|&(x, y)| eye.place(left + x, top + y));
        let places = places.collect::<Vec<_>>().into_iter().flatten().collect();
        self.queue(places)?;
        self.share.step();
        self.tell(0.0);
        Some(())
    }

    /// Makes records until all places are served. Returns how many were not at the beginning; `None`
    /// when cancelled.
    pub(super) fn queue(&mut self, places: Vec<Place>) -> Option<usize> {
        let mut queue = self.unserved(places);
        let count = queue.len();
        while !queue.is_empty() {
            self.tell(1.0 - queue.len() as f64 / count as f64);
            let batch = (self.records.len() / BATCH_SHARE).clamp(BATCH.0, BATCH.1).min(queue.len());
            let rest = queue.split_off(batch);
            self.batch(&queue)?;
            queue = self.unserved(rest);
        }
        Some(count)
    }

    /// The others, in the same order.
    fn unserved(&self, places: Vec<Place>) -> Vec<Place> {
        let left = places.into_par_iter().map(|p| Some(p).filter(|p| !self.serves(p)));
        left.collect::<Vec<_>>().into_iter().flatten().collect()
    }

    /// Records at places, unless others of them serve; `None` when cancelled.
    fn batch(&mut self, places: &[Place]) -> Option<()> {
        let (gatherer, watch) = (self.gatherer, self.watch);
        let made: Option<Vec<(Option<Gathered>, u64)>> = places
            .par_iter()
            .with_max_len(1)
            .map(|place| {
                // A record may take long, and a batch has many.
                let mut rays = 0;
                (!watch.is_cancelled()).then(|| (gatherer.record(place, &mut rays), rays))
            })
            .collect();
        let made = made?;
        for ((gathered, rays), place) in made.into_iter().zip(places) {
            self.statistics.rays += rays;
            let Some(Gathered { record, relative_error, surroundings }) = gathered else {
                self.statistics.invalid += 1;
                continue;
            };
            if self.serves(place) {
                self.statistics.discarded += 1;
                continue;
            }
            self.statistics.note(&record, self.level);
            let record = match &mut self.neighbours {
                Some(neighbours) => {
                    let bounds = gatherer.bounds(place.footprint);
                    neighbours.meet(record, bounds, &mut self.records)
                }
                None => record,
            };
            self.index.insert(self.records.len() as u32, &record);
            self.records.push(record);
            self.surroundings.extend(surroundings);
            self.origins.push(Origin { place: *place, relative_error });
        }
        Some(())
    }

    fn serves(&self, place: &Place) -> bool {
        let n = lit_normal(&place.si);
        let query = Query { p: place.si.p, n_smooth: n, n_shading: n };
        let (records, settings) = (&self.records, &self.lookup);
        let Some(scene) = self.protected_scene else {
            return lookup(records, &self.index, &query, settings).is_some();
        };
        // Far fewer than those of the records: they are not counted.
        let is_seen = |record: &Record| is_in_sight(scene, &place.si, record, &mut 0);
        lookup_seen(records, &self.index, &query, settings, is_seen).is_some()
    }

    /// Evens out the noise of the records that were made; those of before stay as they are. `None`
    /// when cancelled.
    fn smooth(&mut self) -> Option<()> {
        let made = self.records.len() - self.origins.len();
        let (records, rays) = (&mut self.records[made..], &mut self.statistics.rays);
        smooth(self.gatherer, &self.lookup, records, &self.origins, rays, self.watch)
    }

    /// All but a hash.
    pub(super) fn finish(self) -> CacheContents {
        let Self { records, surroundings, mut statistics, .. } = self;
        statistics.records = records.len();
        CacheContents { records, surroundings, statistics, hash: None }
    }
}

impl<'a> Eye<'a> {
    pub(super) fn new(scene: &'a Scene, sensor: &Sensor) -> Self {
        let seed = sensor.sampler.seed;
        let samples = SamplerSettings { kind: SamplerKind::Sobol, sample_count: 1, seed };
        Self { scene, camera: Camera::new(sensor), samples }
    }

    /// The first diffuse surface that a pixel sees, mirrors and glass followed.
    fn place(&self, x: u32, y: u32) -> Option<Place> {
        let film = Vec2::new(x as f32, y as f32) + WITHIN_PIXEL;
        let rays = self.rays(film);
        let key = pixel_key(x, y);
        let mut sampler = Sampler::new(&self.samples, (x, y), u32::MAX);
        let seen = first_diffuse(self.scene, rays[0], &mut sampler)?;
        Some(Place { si: seen.si, footprint: Self::footprint(&rays, seen.way), key })
    }

    /// Through a point of the film, and through one a pixel beside it.
    pub(super) fn rays(&self, film: Vec2) -> [Ray; 2] {
        [film, film + Vec2::X].map(|film| self.camera.ray(film, Vec2::splat(0.5)))
    }

    /// Side of a pixel at the end of a way along such rays, scene units. They start apart with a lens
    /// or without perspective. No difference of points on them: far from the origin it would be
    /// rounding.
    pub(super) fn footprint([ray, beside]: &[Ray; 2], way: f32) -> f32 {
        (beside.o - ray.o + (beside.d - ray.d) * way).length()
    }
}

/// The pixels of a lattice, those of coarser ones left out unless it is the first; neighbours are
/// far apart in their order.
fn lattice(crop: CropWindow, stride: u32, is_first: bool) -> Vec<(u32, u32)> {
    let mut pixels: Vec<(u32, u32)> = (0..crop.height)
        .step_by(stride as usize)
        .flat_map(|y| (0..crop.width).step_by(stride as usize).map(move |x| (x, y)))
        .filter(|(x, y)| is_first || (x / stride) % 2 == 1 || (y / stride) % 2 == 1)
        .collect();
    pixels.sort_by_key(|(x, y)| morton(x / stride, y / stride).reverse_bits());
    pixels
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
    let hides_emitters = scene.tables.integrator.hide_emitters;
    let mut depth = 0;
    while depth < MAX_CHAIN {
        let si = scene.intersect(&ray)?;
        way += si.t;
        let tables = &scene.tables;
        let shape = &tables.shapes.shapes[si.shape.0 as usize];
        if hides_emitters && depth == 0 && shape.emitter.is_some() {
            ray = past(&si, &ray);
            continue;
        }
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
        depth += 1;
    }
    None
}
