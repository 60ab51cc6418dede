//! A coarse average of indirect irradiance over the cells of a world-space grid, filled by random
//! walks from the camera.
//!
//! Far from a record it does not matter exactly where on a surface a ray ends: the average over a
//! cell has the same mean and none of the noise of a single walk. Near it, the coarse cells would
//! show, so it must only be asked beyond a least length of the ray, and cells shrink with that
//! length. After Keller, Dahm and Binder 2014 (Path space filtering) and Binder, Fricke and Keller
//! 2018 (jittered spatial hashing).

mod table;
mod walk;

pub(in crate::integrator) use walk::{direct_light, lit_normal};

use rayon::prelude::*;
use table::Table;

use crate::film::CropWindow;
use crate::interaction::SurfaceInteraction;
use crate::math::{Vec2, Vec3, facing};
use crate::sampler::{Sampler, SamplerKind, SamplerSettings};
use crate::scene::Scene;
use crate::sensor::Camera;
use crate::shape::ShapeId;
use crate::spectrum::Rgb;

use super::prepass::IsCancelled;

/// Edge of the largest cells as a share of the scene's extent; those of each further level are
/// half as large.
const CELL: f32 = 0.05;
const LEVELS: u32 = 3;
/// Least length of a ray that may use a cell, as a share of the scene's extent.
const MIN_SEGMENT: f32 = 0.1;
/// Largest cell that a ray may use, as a share of its length: about what a record cannot resolve,
/// whose rays are so far apart. The smallest cells serve the shortest rays.
const RESOLUTION: f32 = 0.15;
/// Cells that fewer walks visited are too noisy.
const LEAST_VISITS: u32 = 4;
/// Least and largest number of walks.
const WALKS: (usize, usize) = (1 << 15, 1 << 23);
/// Walks go on until the standard error of what they say about the mean of the picture is this
/// share of the noise that a record may have: they are shared by all records, so their errors do
/// not average out.
const NOISE_SHARE: f64 = 0.04;
/// Walks per unit of parallel work; fixed, so that the work does not depend on the threads.
const WALKS_PER_CHUNK: usize = 1024;
/// Tables that cells are spread over; fixed, too.
const TABLES: usize = 16;

/// Where a walk met a diffuse surface.
#[derive(Debug, Clone, Copy)]
struct Visit {
    p: Vec3,
    n: Vec3,
    shape: ShapeId,
}

/// Mean indirect irradiance by cell, W·m⁻².
#[derive(Debug, Clone, PartialEq)]
pub(in crate::integrator) struct IrradianceHash {
    /// Edge of the largest cells, scene units.
    cell: f32,
    min_segment: f32,
    tables: Vec<Table>,
    /// Walks that filled it, and their rays.
    pub(super) walks: usize,
    pub(super) rays: u64,
}

/// What the walks of a chunk found.
struct Chunk {
    /// By table: cell and irradiance, in the order of the walks.
    found: [Vec<(u64, Rgb)>; TABLES],
    /// Sums of the luminances of [`walk::Seen`].
    all: f64,
    distant: f64,
    rays: u64,
}

impl IrradianceHash {
    /// From walks that start at the camera: twice as many again and again until their mean has a
    /// standard error of `noise` times [`NOISE_SHARE`]. Deterministic for any number of threads.
    /// `None` when cancelled.
    pub(super) fn new(
        scene: &Scene,
        camera: &Camera,
        crop: CropWindow,
        seed: u64,
        noise: f32,
        is_cancelled: IsCancelled,
    ) -> Option<Self> {
        let extent = scene.accel.bounds().extent().max_element().max(1e-20);
        let mut hash = Self {
            cell: CELL * extent,
            min_segment: MIN_SEGMENT * extent,
            tables: vec![Table::new(); TABLES],
            walks: 0,
            rays: 0,
        };
        let samples =
            SamplerSettings { kind: SamplerKind::Sobol, sample_count: WALKS.1 as u32, seed: !seed };
        let wanted = f64::from(noise) * NOISE_SHARE;
        let mut sums = Vec::new();
        let mut goal = WALKS.0;
        loop {
            // A part at a time: what walks found is kept until it is in the tables.
            while hash.walks < goal {
                if is_cancelled() {
                    return None;
                }
                let end = goal.min(hash.walks + 64 * WALKS_PER_CHUNK);
                let chunks: Vec<Chunk> = (hash.walks / WALKS_PER_CHUNK..end / WALKS_PER_CHUNK)
                    .into_par_iter()
                    .map(|chunk| hash.chunk(scene, camera, crop, &samples, chunk))
                    .collect();
                hash.add(&chunks);
                sums.extend(chunks.iter().map(|c| [c.all, c.distant]));
                hash.walks = end;
            }
            if relative_error(&sums) <= wanted || goal >= WALKS.1 {
                return Some(hash);
            }
            goal *= 2;
        }
    }

    fn chunk(
        &self,
        scene: &Scene,
        camera: &Camera,
        crop: CropWindow,
        samples: &SamplerSettings,
        index: usize,
    ) -> Chunk {
        let found = std::array::from_fn(|_| Vec::new());
        let mut chunk = Chunk { found, all: 0.0, distant: 0.0, rays: 0 };
        let size = Vec2::new(crop.width as f32, crop.height as f32);
        let corner = Vec2::new(crop.x as f32, crop.y as f32);
        for i in index * WALKS_PER_CHUNK..(index + 1) * WALKS_PER_CHUNK {
            let mut sampler = Sampler::new(samples, (0, 0), i as u32);
            let film = corner + sampler.next_2d() * size;
            let ray = camera.ray(film, Vec2::splat(0.5));
            let rays = &mut chunk.rays;
            let seen = walk::walk(scene, ray, &mut sampler, rays, |visit, irradiance| {
                for level in 0..LEVELS {
                    let key = self.key(visit.p, visit.n, visit.shape, level);
                    chunk.found[table_of(key)].push((key, irradiance));
                }
            });
            if seen.all.is_finite() && seen.distant.is_finite() {
                chunk.all += f64::from(seen.all.luminance());
                chunk.distant += f64::from(seen.distant.luminance());
            }
        }
        chunk
    }

    /// Every table gets its values in the order of the walks, whoever does it.
    fn add(&mut self, chunks: &[Chunk]) {
        self.tables.par_iter_mut().enumerate().for_each(|(i, table)| {
            let values = chunks.iter().flat_map(|chunk| &chunk.found[i]);
            values.for_each(|&(key, irradiance)| table.add(key, irradiance));
        });
        self.rays += chunks.iter().map(|c| c.rays).sum::<u64>();
    }

    /// Mean irradiance around the surface point at the end of a ray, if its cell was reached; `u`
    /// moves the look-up within a cell's width, which turns the cells' edges into noise.
    pub(in crate::integrator) fn lookup(&self, si: &SurfaceInteraction, u: Vec2) -> Option<Rgb> {
        if si.t < self.min_segment {
            return None;
        }
        let level = (self.cell / (RESOLUTION * si.t)).log2().ceil().max(0.0) as u32;
        let level = level.min(LEVELS - 1);
        let shift = (u - 0.5) * self.edge(level);
        let p = si.p + si.frame.s * shift.x + si.frame.t * shift.y;
        let key = self.key(p, lit_normal(si), si.shape, level);
        self.tables[table_of(key)].mean(key, LEAST_VISITS)
    }

    /// Edge of the cells of a level, scene units.
    fn edge(&self, level: u32) -> f32 {
        self.cell / (1_u32 << level) as f32
    }

    /// Never 0.
    fn key(&self, p: Vec3, n: Vec3, shape: ShapeId, level: u32) -> u64 {
        let per_unit = 1.0 / self.edge(level);
        let whole = |x: f32| (x * per_unit).floor() as i32 as u32;
        let side = u32::from(facing(n)) | level << 8;
        [whole(p.x), whole(p.y), whole(p.z), side, shape.0].into_iter().fold(1, |h: u64, word| {
            let h = (h ^ u64::from(word)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            h ^ (h >> 32)
        }) | 1 << 63
    }
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
