//! A coarse average of indirect irradiance over the cells of a world-space grid, filled by random
//! walks from the camera.
//!
//! Far from a record it does not matter exactly where on a surface a ray ends: the average over a
//! cell has the same mean and none of the noise of a single walk. Near it, the coarse cells would
//! show, so it must only be asked beyond [`IrradianceHash::min_segment`]. After Keller, Dahm and
//! Binder 2014 (Path space filtering) and Binder, Fricke and Keller 2018 (jittered spatial
//! hashing).

use rayon::prelude::*;

use crate::bsdf::BsdfAtHit;
use crate::bytes::{BytesError, Reader, put_f32, put_u64};
use crate::emitter::LightReference;
use crate::film::CropWindow;
use crate::integrator::CAMERA_DIMENSIONS;
use crate::integrator::light::{light_reference, sample_light};
use crate::integrator::path::{SURE_THROUGHPUT, VERTEX_DIMENSIONS};
use crate::interaction::SurfaceInteraction;
use crate::math::{Ray, Vec2, Vec3, facing};
use crate::sampler::{Sampler, SamplerKind, SamplerSettings};
use crate::scene::Scene;
use crate::sensor::Camera;
use crate::shape::ShapeId;
use crate::spectrum::Rgb;
use std::f32::consts::PI;

/// Edge of a cell, and least length of a ray that may use one, as shares of the scene's extent.
const CELL: f32 = 0.05;
const MIN_SEGMENT: f32 = 0.1;
/// Least and largest number of walks.
const WALKS: (usize, usize) = (1 << 15, 1 << 18);
/// Walks per unit of parallel work; fixed, so that the work does not depend on the threads.
const WALKS_PER_CHUNK: usize = 1024;
/// Vertices of a walk.
const MAX_VERTICES: usize = 24;
/// Vertices after which weak walks may end.
const ROULETTE: usize = 4;

/// Mean indirect irradiance by cell, W·m⁻².
#[derive(Debug, Clone, PartialEq)]
pub(in crate::integrator) struct IrradianceHash {
    /// A ray must be so long to end in a cell, scene units.
    pub(in crate::integrator) min_segment: f32,
    per_unit: f32,
    cell: f32,
    /// Open addressing; a power of two of slots. Key 0 is an empty slot.
    slots: Vec<(u64, Rgb)>,
}

/// A vertex of a walk.
struct Vertex {
    key: Option<u64>,
    /// Light that reached it from light sources directly and goes on towards the walk's begin.
    direct: Rgb,
    /// What the next segment's radiance is multiplied with.
    weight: Rgb,
    /// Emission at the end of the next segment counts: light sampling could not have found it.
    sees_emission: bool,
}

impl IrradianceHash {
    /// From walks that start at the camera. Deterministic for any number of threads.
    pub(super) fn new(scene: &Scene, camera: &Camera, crop: CropWindow, seed: u64) -> Self {
        let extent = scene.accel.bounds().extent().max_element().max(1e-20);
        let mut hash = Self {
            min_segment: MIN_SEGMENT * extent,
            per_unit: 1.0 / (CELL * extent),
            cell: CELL * extent,
            slots: Vec::new(),
        };
        let pixels = crop.width as usize * crop.height as usize;
        let walks = pixels.clamp(WALKS.0, WALKS.1);
        let samples =
            SamplerSettings { kind: SamplerKind::Sobol, sample_count: walks as u32, seed: !seed };
        let chunks: Vec<Vec<(u64, Rgb)>> = (0..walks.div_ceil(WALKS_PER_CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let mut found = Vec::new();
                for i in chunk * WALKS_PER_CHUNK..((chunk + 1) * WALKS_PER_CHUNK).min(walks) {
                    let mut sampler = Sampler::new(&samples, (0, 0), i as u32);
                    let size = Vec2::new(crop.width as f32, crop.height as f32);
                    let corner = Vec2::new(crop.x as f32, crop.y as f32);
                    let film = corner + sampler.next_2d() * size;
                    let ray = camera.ray(film, Vec2::splat(0.5));
                    hash.walk(scene, ray, &mut sampler, &mut found);
                }
                found
            })
            .collect();
        let mut found: Vec<(u64, Rgb)> = chunks.into_iter().flatten().collect();
        // Stable: within a cell the order stays that of the walks.
        found.sort_by_key(|(key, _)| *key);
        hash.fill(&found);
        hash
    }

    fn fill(&mut self, sorted: &[(u64, Rgb)]) {
        let means: Vec<(u64, Rgb)> = sorted
            .chunk_by(|a, b| a.0 == b.0)
            .map(|cell| {
                let mut sum = [0.0_f64; 3];
                for (_, value) in cell {
                    for (sum, v) in sum.iter_mut().zip(value.to_array()) {
                        *sum += f64::from(v);
                    }
                }
                (cell[0].0, Rgb::from(sum.map(|s| (s / cell.len() as f64) as f32)))
            })
            .collect();
        self.insert(&means, usize::MAX);
    }

    /// Puts means by distinct keys into the slots; false if that takes more steps than allowed.
    fn insert(&mut self, means: &[(u64, Rgb)], mut steps: usize) -> bool {
        let size = (2 * means.len() + 1).next_power_of_two();
        self.slots = vec![(0, Rgb::BLACK); size];
        for mean in means {
            let mut slot = mean.0 as usize & (size - 1);
            while self.slots[slot].0 != 0 {
                slot = (slot + 1) & (size - 1);
                if steps == 0 {
                    return false;
                }
                steps -= 1;
            }
            self.slots[slot] = *mean;
        }
        true
    }

    /// Mean irradiance around the surface point, if its cell was reached; `u` moves the look-up
    /// within a cell's width, which turns the cells' edges into noise.
    pub(in crate::integrator) fn lookup(&self, si: &SurfaceInteraction, u: Vec2) -> Option<Rgb> {
        let shift = (u - 0.5) * self.cell;
        let p = si.p + si.frame.s * shift.x + si.frame.t * shift.y;
        let key = self.key(p, lit_normal(si), si.shape);
        let mask = self.slots.len() - 1;
        let mut slot = key as usize & mask;
        loop {
            match self.slots[slot] {
                (0, _) => return None,
                (found, value) if found == key => return Some(value),
                _ => slot = (slot + 1) & mask,
            }
        }
    }

    /// Never 0.
    fn key(&self, p: Vec3, n: Vec3, shape: ShapeId) -> u64 {
        let whole = |x: f32| (x * self.per_unit).floor() as i32 as u32;
        let facing = u32::from(facing(n));
        [whole(p.x), whole(p.y), whole(p.z), facing, shape.0].into_iter().fold(1, |h: u64, word| {
            let h = (h ^ u64::from(word)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            h ^ (h >> 32)
        }) | 1 << 63
    }

    /// Follows a walk and notes the irradiance that its diffuse vertices received.
    fn walk(
        &self,
        scene: &Scene,
        mut ray: Ray,
        sampler: &mut Sampler,
        found: &mut Vec<(u64, Rgb)>,
    ) {
        let mut vertices: Vec<Vertex> = Vec::with_capacity(MAX_VERTICES);
        let mut throughput = Rgb::WHITE;
        let mut bsdf = BsdfAtHit::empty();
        // Radiance that arrives at the last vertex from beyond.
        let mut beyond = Rgb::BLACK;
        while vertices.len() < MAX_VERTICES {
            let Some(si) = scene.intersect(&ray) else {
                if vertices.last().is_some_and(|v| v.sees_emission) {
                    beyond = scene.lights.environment_radiance(&scene.tables, ray.d);
                }
                break;
            };
            let tables = &scene.tables;
            let shape = &tables.shapes.shapes[si.shape.0 as usize];
            if shape.emitter.is_some()
                && let Some(last) = vertices.last_mut()
                && last.sees_emission
            {
                let emission = scene.lights.emitted_radiance(tables, &si);
                last.direct += last.weight * emission;
            }
            tables.bsdfs.read_at_hit(&tables.textures, &tables.shapes, shape.bsdf, &si, &mut bsdf);
            let vertex = vertices.len() as u32;
            sampler.set_dimension(CAMERA_DIMENSIONS + vertex * VERTEX_DIMENSIONS);
            let direct = direct_light(scene, &si, &bsdf, sampler);
            let Some(sample) = bsdf.sample(sampler.next_1d(), sampler.next_2d()) else {
                vertices.push(Vertex {
                    key: None,
                    direct,
                    weight: Rgb::BLACK,
                    sees_emission: false,
                });
                break;
            };
            throughput *= sample.weight;
            let mut weight = sample.weight;
            let mut ends = throughput.is_black();
            if vertices.len() >= ROULETTE {
                let q = (throughput.max_component() / SURE_THROUGHPUT).min(0.95);
                ends |= sampler.next_1d() >= q;
                weight *= 1.0 / q.max(1e-6);
                throughput *= 1.0 / q.max(1e-6);
            }
            let key = bsdf.is_diffuse().then(|| self.key(si.p, lit_normal(&si), si.shape));
            let sees_emission = sample.is_delta || sample.is_null;
            if ends || vertices.len() + 1 == MAX_VERTICES {
                // What arrives here was not looked for.
                vertices.push(Vertex {
                    key: None,
                    direct,
                    weight: Rgb::BLACK,
                    sees_emission: false,
                });
                break;
            }
            vertices.push(Vertex { key, direct, weight, sees_emission });
            ray = si.spawn_ray(sample.wi);
        }
        note(&vertices, beyond, found);
    }
}

/// Bytes of a cell in a file.
const CELL_BYTES: usize = 8 + 4 * 3;
/// Steps beyond a key's own slot, mean of all: less than one where keys are as random as they
/// should be; in a file that was made to be slow, as many as there are cells.
const MAX_STEPS: usize = 32;

impl IrradianceHash {
    /// Appends it as bytes: cells by ascending key.
    pub(super) fn put(&self, out: &mut Vec<u8>) {
        [self.min_segment, self.per_unit, self.cell].into_iter().for_each(|x| put_f32(out, x));
        let cells = self.by_key();
        put_u64(out, cells.len() as u64);
        for (key, value) in cells {
            put_u64(out, key);
            value.to_array().into_iter().for_each(|x| put_f32(out, x));
        }
    }

    /// What [`IrradianceHash::put`] appended.
    pub(super) fn read(reader: &mut Reader) -> Result<Self, BytesError> {
        let [min_segment, per_unit, cell] = [reader.f32()?, reader.f32()?, reader.f32()?];
        if ![min_segment, per_unit, cell].iter().all(|x| x.is_finite() && *x > 0.0) {
            return Err(BytesError::BadLength);
        }
        let count = reader.length(CELL_BYTES)?;
        let mut cells: Vec<(u64, Rgb)> = Vec::with_capacity(count);
        for index in 0..count {
            let key = reader.u64()?;
            let value = Rgb::from([reader.f32()?, reader.f32()?, reader.f32()?]);
            if cells.last().map_or(0, |c| c.0) >= key || !value.is_finite() {
                return Err(BytesError::BadEntry { what: "hash", index });
            }
            cells.push((key, value));
        }
        let mut hash = Self { min_segment, per_unit, cell, slots: Vec::new() };
        let is_quick = hash.insert(&cells, MAX_STEPS * cells.len());
        if is_quick { Ok(hash) } else { Err(BytesError::BadLength) }
    }

    fn by_key(&self) -> Vec<(u64, Rgb)> {
        let mut cells: Vec<(u64, Rgb)> = self.slots.iter().filter(|s| s.0 != 0).copied().collect();
        cells.sort_unstable_by_key(|(key, _)| *key);
        cells
    }

    pub(super) fn cells(&self) -> usize {
        self.slots.iter().filter(|s| s.0 != 0).count()
    }

    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(&self.slots[..])
    }

    /// Forgets all but some cells.
    #[cfg(test)]
    pub(super) fn keep(&mut self, count: usize) {
        let cells = self.by_key();
        self.insert(&cells[..count], usize::MAX);
    }
}

/// From the last vertex to the first: what arrives at one is what the next sends.
fn note(vertices: &[Vertex], beyond: Rgb, found: &mut Vec<(u64, Rgb)>) {
    let mut arriving = beyond;
    for vertex in vertices.iter().rev() {
        if let Some(key) = vertex.key {
            // Cosine distributed: radiance over density is π times the radiance.
            let scale = if vertex.weight.is_black() { 0.0 } else { PI };
            let irradiance = arriving * scale;
            if irradiance.is_finite() {
                found.push((key, irradiance));
            }
        }
        arriving = vertex.direct + vertex.weight * arriving;
    }
}

/// Light that one light sample sends towards the viewer.
pub(in crate::integrator) fn direct_light(
    scene: &Scene,
    si: &SurfaceInteraction,
    bsdf: &BsdfAtHit,
    sampler: &mut Sampler,
) -> Rgb {
    let u_select = if scene.lights.needs_choice() { sampler.next_1d() } else { 0.0 };
    let u = sampler.next_2d();
    if !bsdf.has_smooth() {
        return Rgb::BLACK;
    }
    let reference: LightReference = light_reference(si, bsdf);
    match sample_light(scene, &reference, bsdf, u_select, u) {
        Some(light) if light.is_visible(scene, si) => light.contribution(),
        _ => Rgb::BLACK,
    }
}

/// The shading normal on the viewer's side.
pub(super) fn lit_normal(si: &SurfaceInteraction) -> Vec3 {
    if si.frame.n.dot(si.wo) < 0.0 { -si.frame.n } else { si.frame.n }
}
