//! The walks that fill the hash.

use std::ops::Range;

use rayon::prelude::*;

use super::super::progress::{CachePhase, CacheProgress, CacheWatch};
use super::guide::{Lesson, Teacher, WalkGuide};
use super::table::Table;
use super::walk::Walks;
use super::{IrradianceHash, LEVELS, Visit};
use crate::film::CropWindow;
use crate::math::Vec2;
use crate::sampler::{Sampler, SamplerKind, SamplerSettings};
use crate::scene::Scene;
use crate::sensor::Camera;
use crate::spectrum::Rgb;

/// Cells that fewer walks visited are too noisy.
const LEAST_VISITS: u32 = 4;
/// Walks after which it is asked whether they find anything at all.
const FIRST_WALKS: usize = 1 << 15;
/// Least and largest number of walks, and the largest per pixel: small pictures are not worth many.
/// With fewer the noise of the cells shows, however well the mean is known.
const WALKS: (usize, usize) = (1 << 17, 1 << 23);
const WALKS_PER_PIXEL: usize = 128;
/// Walks go on until what they say about the mean of the picture has this relative standard error by
/// default; with finer settings less, as with the noise of records. All records share them, so their
/// errors do not average out.
const WANTED: f64 = 0.002;
/// Walks after which their segments teach where light comes from, and after which no more: the
/// first walks know too little to teach, and most scenes are done before guidance pays.
const LESSONS: Range<usize> = 1 << 17..1 << 20;
/// Walks per unit of parallel work; fixed, so that the work does not depend on the threads.
const WALKS_PER_CHUNK: usize = 1024;
/// Walks between two looks at whether to stop.
const PART: usize = 64 * WALKS_PER_CHUNK;
/// Tables that cells are spread over; fixed, too.
const TABLES: usize = 16;

/// What it took to fill a hash.
#[derive(Debug, Clone, Copy, Default)]
pub(in super::super) struct HashStatistics {
    pub(in super::super) walks: usize,
    pub(in super::super) rays: u64,
}

/// What the walks of a chunk found.
struct Chunk {
    /// By table: cell, indirect and direct irradiance, in the order of the walks.
    found: [Vec<(u64, [Rgb; 2])>; TABLES],
    /// Sums of the luminances of [`super::walk::Seen`].
    all: f64,
    distant: f64,
    lessons: Vec<Lesson>,
    rays: u64,
}

/// All that a walk depends on.
struct Walker<'a> {
    scene: &'a Scene,
    camera: &'a Camera,
    crop: CropWindow,
    samples: SamplerSettings,
    /// Knows the cells' keys.
    hash: IrradianceHash,
    /// What all walks found until now.
    tables: Vec<Table>,
    guide: Option<WalkGuide>,
    teacher: Option<Teacher>,
}

impl IrradianceHash {
    /// From walks that start at the camera: twice as many again and again until the standard error
    /// of their mean is [`WANTED`]. Deterministic for any number of threads.
    /// `None` when cancelled.
    pub(in super::super) fn new(
        scene: &Scene,
        camera: &Camera,
        crop: CropWindow,
        seed: u64,
        watch: CacheWatch,
    ) -> Option<(Self, HashStatistics)> {
        let pixels = crop.width as usize * crop.height as usize;
        let most = (pixels * WALKS_PER_PIXEL).next_power_of_two().clamp(WALKS.0, WALKS.1);
        let mut walker = Walker::new(scene, camera, crop, seed, most);
        let mut statistics = HashStatistics::default();
        let mut sums = Vec::new();
        let mut goal = FIRST_WALKS;
        let wanted = walker.wanted();
        let mut outlook = Outlook { wanted, ..Default::default() };
        loop {
            // A part at a time: what walks found is kept until it is in the tables.
            while statistics.walks < goal {
                if watch.is_cancelled() {
                    return None;
                }
                let end = goal.min(statistics.walks + PART);
                let chunks = walker.walk(statistics.walks / WALKS_PER_CHUNK..end / WALKS_PER_CHUNK);
                sums.extend(chunks.iter().map(|c| [c.all, c.distant]));
                statistics.rays += chunks.iter().map(|c| c.rays).sum::<u64>();
                statistics.walks = end;
                watch.tell(&outlook.progress(statistics));
            }
            // Where nothing is diffuse, walks have nothing to fill.
            let is_empty = walker.tables.iter().all(Table::is_empty);
            let error = relative_error(&sums);
            let is_known = goal >= WALKS.0 && error <= wanted;
            if is_empty || is_known || goal >= most {
                return Some((walker.known(), statistics));
            }
            walker.learn(goal);
            outlook.learn(goal, most, error);
            goal *= 2;
        }
    }
}

/// How many walks it will take, as far as that can be known.
#[derive(Debug, Default)]
struct Outlook {
    walks: Option<usize>,
    /// Their relative standard error in the end.
    wanted: f64,
    /// Share that was told last: it does not fall.
    share: f64,
}

impl Outlook {
    /// From the error of so many walks, which falls with the square root of their number.
    fn learn(&mut self, walks: usize, most: usize, error: f64) {
        let doublings = (error / self.wanted).powi(2).log2().ceil().clamp(1.0, 32.0) as u32;
        self.walks = Some((walks << doublings).clamp(WALKS.0, most));
    }

    fn progress(&mut self, HashStatistics { walks, rays }: HashStatistics) -> CacheProgress {
        let share = self.walks.map(|all| walks as f64 / all as f64);
        self.share = self.share.max(share.unwrap_or(0.0)).min(1.0);
        let fraction = share.map(|_| self.share);
        CacheProgress { phase: CachePhase::Walks, fraction, stride: None, records: 0, rays }
    }
}

impl<'a> Walker<'a> {
    fn new(scene: &'a Scene, camera: &'a Camera, crop: CropWindow, seed: u64, most: usize) -> Self {
        let extent = scene.accel.bounds().extent().max_element().max(1e-20);
        let kind = SamplerKind::Sobol;
        Self {
            scene,
            camera,
            crop,
            samples: SamplerSettings { kind, sample_count: most as u32, seed: !seed },
            hash: IrradianceHash::empty(extent, scene.tables.integrator.cache.refinement()),
            tables: vec![Table::new(); TABLES],
            guide: None,
            teacher: None,
        }
    }

    /// Relative standard error at which walks end.
    fn wanted(&self) -> f64 {
        let refinement = self.scene.tables.integrator.cache.refinement();
        WANTED / f64::from(refinement.max(1.0)).sqrt()
    }

    /// Makes the walks of some chunks.
    fn walk(&mut self, chunks: Range<usize>) -> Vec<Chunk> {
        let chunks: Vec<Chunk> = chunks.into_par_iter().map(|chunk| self.chunk(chunk)).collect();
        add(&mut self.tables, &chunks);
        if let Some(teacher) = &mut self.teacher {
            chunks.iter().for_each(|chunk| teacher.add(&chunk.lessons));
        }
        chunks
    }

    /// What is known of the cells that were visited often enough.
    fn known(&self) -> IrradianceHash {
        let means = self.tables.iter().flat_map(|table| table.means(LEAST_VISITS));
        let mut means: Vec<_> = means.collect();
        // As when it is read from a file.
        means.sort_unstable_by_key(|(key, _)| *key);
        let mut hash = self.hash.clone();
        hash.insert(&means, usize::MAX);
        hash
    }

    /// After so many walks: later ones are guided by what these taught.
    fn learn(&mut self, walks: usize) {
        if !(LESSONS.start..=LESSONS.end).contains(&walks) {
            return;
        }
        self.guide = self.teacher.as_ref().map(Teacher::guide);
        if walks == LESSONS.end {
            self.teacher = None;
            return;
        }
        let known = self.known();
        match &mut self.teacher {
            Some(teacher) => teacher.update(known),
            None => self.teacher = Some(Teacher::new(self.scene.accel.bounds(), known)),
        }
    }

    fn chunk(&self, index: usize) -> Chunk {
        let found = std::array::from_fn(|_| Vec::new());
        let mut chunk = Chunk { found, all: 0.0, distant: 0.0, lessons: Vec::new(), rays: 0 };
        let walks =
            Walks { scene: self.scene, guide: self.guide.as_ref(), teacher: self.teacher.as_ref() };
        let size = Vec2::new(self.crop.width as f32, self.crop.height as f32);
        let corner = Vec2::new(self.crop.x as f32, self.crop.y as f32);
        for i in index * WALKS_PER_CHUNK..(index + 1) * WALKS_PER_CHUNK {
            let mut sampler = Sampler::new(&self.samples, (0, 0), i as u32);
            let film = corner + sampler.next_2d() * size;
            let ray = self.camera.ray(film, Vec2::splat(0.5));
            let (rays, lessons) = (&mut chunk.rays, &mut chunk.lessons);
            let visit = |visit: Visit, indirect, direct| {
                for level in 0..LEVELS {
                    let key = self.hash.key(visit.p, visit.n, visit.shape, level);
                    chunk.found[table_of(key)].push((key, [indirect, direct]));
                }
            };
            let seen = walks.follow(ray, &mut sampler, rays, lessons, visit);
            if seen.all.is_finite() && seen.distant.is_finite() {
                chunk.all += f64::from(seen.all.luminance());
                chunk.distant += f64::from(seen.distant.luminance());
            }
        }
        chunk
    }
}

/// Every table gets its values in the order of the walks, whoever does it.
fn add(tables: &mut [Table], chunks: &[Chunk]) {
    tables.par_iter_mut().enumerate().for_each(|(i, table)| {
        let values = chunks.iter().flat_map(|chunk| &chunk.found[i]);
        values.for_each(|&(key, [indirect, direct])| table.add(key, indirect, direct));
    });
}

/// By bits that a table does not use itself.
fn table_of(key: u64) -> usize {
    (key >> 40) as usize % TABLES
}

/// From sums of all light and of distant light over equal numbers of walks: standard error of the
/// mean of the second, relative to the mean of the first.
fn relative_error(sums: &[[f64; 2]]) -> f64 {
    let n = sums.len() as f64;
    let [all, distant] = [0, 1].map(|i| sums.iter().map(|s| s[i]).sum::<f64>() / n);
    let spread = sums.iter().map(|s| (s[1] - distant).powi(2)).sum::<f64>();
    // In complete darkness 0/0: nothing to improve.
    if spread == 0.0 { 0.0 } else { (spread / (n * (n - 1.0))).sqrt() / all }
}

/// The guide that so many walks lead to, after as many before them that they learn from.
#[cfg(test)]
pub(super) fn guide_after(scene: &Scene, walks: usize) -> WalkGuide {
    let sensor = &scene.tables.sensors[0];
    let camera = Camera::new(sensor);
    let mut walker = Walker::new(scene, &camera, sensor.film.crop, 1, 2 * walks);
    for half in 0..2 {
        walker.walk(half * walks / WALKS_PER_CHUNK..(half + 1) * walks / WALKS_PER_CHUNK);
        walker.learn(LESSONS.start);
    }
    walker.guide.expect("learned")
}
