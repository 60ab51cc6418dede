//! From a point of a surface to a record: rays over the hemisphere, and what follows from them.
//!
//! A record is not made where too many rays end within a few of the offsets that keep them off
//! their own surface: there geometry is finer than its rounding, as where two surfaces coincide,
//! and what the rays tell is chance. Hits at the backs of surfaces are no sign of a record inside
//! of something solid, though other programs count them: here a scene does not say which shapes
//! are closed, and surfaces that scatter on both sides, single sheets among them, are common.

use std::sync::Arc;

use super::WalkEnd;
use super::hash::lit_normal;
use super::sky::SkyLight;
use crate::integrator::IntegratorSettings;
use crate::integrator::path::record_walk_at;
use crate::interaction::SurfaceInteraction;
use crate::irradiance::{
    Cell, Criterion, Estimates, Grid, Hemisphere, MeshSettings, MeshTopology, Radii, RadiusBounds,
    RadiusSettings, Record, Surroundings, mesh_derivatives, radii, ward_heckbert_gradient,
};
use crate::math::{Frame, Vec3};
use crate::sampler::{SamplerKind, SamplerSettings, SamplerTable};
use crate::scene::Scene;
use crate::spectrum::Rgb;

/// A point of a surface at which a record is wanted.
#[derive(Debug, Clone, Copy)]
pub(in crate::integrator) struct Place {
    pub(in crate::integrator) si: SurfaceInteraction,
    /// Side of a pixel there, scene units: the whole way from the eye, mirrors unfolded.
    pub(in crate::integrator) footprint: f32,
    /// Identifies the record, and its random numbers.
    pub(in crate::integrator) key: u64,
}

/// A record as it was made.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gathered {
    pub(super) record: Record,
    /// Relative standard error of its irradiance, as far as its rays tell.
    pub(super) relative_error: f32,
    /// What it saw, if that is wanted.
    pub(super) surroundings: Option<Surroundings>,
}

/// Makes records: everything that they have in common.
pub(in crate::integrator) struct Gatherer<'a> {
    pub(super) scene: &'a Scene,
    settings: &'a IntegratorSettings,
    ends: Option<WalkEnd<'a>>,
    /// Surfaces that paths have left behind in front of the record.
    depth: u32,
    grid: Grid,
    topology: Option<Arc<MeshTopology>>,
    mesh: MeshSettings,
    pub(super) radius: RadiusSettings,
    samples: SamplerTable,
    /// Largest radius wherever the record is, and size of the scene, scene units.
    largest: f32,
    extent: f32,
}

/// Most batches of rays.
const MAX_BATCHES: u32 = 16;
/// Cells for each of which there is a ray over the hemisphere, for one towards the sky: these find
/// what they look for, so that fewer do.
const CELLS_PER_SKY_RAY: usize = 2;
/// Reference length of the error, pixels.
const REFERENCE_PIXELS: f32 = 10.0;
/// Largest radius as a share of the scene's extent.
const LARGEST_SHARE: f32 = 0.2;
/// Hits that are nearer than so many offsets of the place may be the place's own surface.
const SELF_HIT_OFFSETS: f32 = 4.0;
/// No record where more than one ray of so many has such a hit.
const SELF_HIT_ONE_OF: usize = 4;
/// Largest over least radius where they follow from Radiance's ambient resolution.
const AMBIENT_RANGE: f32 = 64.0;
/// Distance of rays that met nothing, as a multiple of the scene's extent.
const FAR: f32 = 10.0;

impl<'a> Gatherer<'a> {
    pub(in crate::integrator) fn new(
        scene: &'a Scene,
        settings: &'a IntegratorSettings,
        ends: Option<WalkEnd<'a>>,
        seed: u64,
    ) -> Self {
        let cache = &settings.cache;
        let n = f64::from(cache.gather_samples().max(16)).sqrt().round() as u32;
        let uses_mesh = cache.criterion == Criterion::Hessian;
        let grid = if uses_mesh {
            Grid::Concentric { n }
        } else {
            // Cells about as wide as high.
            let m =
                (f64::from(cache.gather_samples().max(16)) / std::f64::consts::PI).sqrt().round();
            Grid::Polar { m: m as u32, n: (m * std::f64::consts::PI).round() as u32 }
        };
        let extent = scene.accel.bounds().extent().max_element().max(1e-20);
        let sampler = SamplerSettings { kind: SamplerKind::Sobol, sample_count: 1, seed };
        Self {
            scene,
            settings,
            ends,
            depth: 0,
            grid,
            topology: uses_mesh.then(|| Arc::new(MeshTopology::new(n))),
            mesh: MeshSettings::new(FAR * extent),
            radius: cache.radius(),
            samples: SamplerTable::new(&sampler, 0, (n * n).next_power_of_two().max(4)),
            largest: LARGEST_SHARE * extent,
            extent,
        }
    }

    /// For records with so many surfaces between them and the eye.
    pub(super) fn behind(self, depth: u32) -> Self {
        Self { depth, ..self }
    }

    /// Within how many radii records even out their noise.
    pub(super) fn smoothing(&self) -> f32 {
        self.settings.cache.smoothing()
    }

    /// The record at a place; `None` where it would not be valid.
    pub(super) fn record(&self, place: &Place, rays: &mut u64) -> Option<Gathered> {
        let frame = Frame::from_normal(lit_normal(&place.si));
        let (hemisphere, relative_error) = self.quiet_hemisphere(place, &frame, rays)?;
        let mut estimates = Estimates::new(&hemisphere);
        if let Some(topology) = &self.topology {
            let derivatives = mesh_derivatives(&hemisphere, topology, &self.mesh)?;
            estimates.translational = derivatives.gradient;
            estimates.hessian = derivatives.hessian;
        } else if self.settings.cache.needs_gradients() {
            estimates.translational = ward_heckbert_gradient(&hemisphere)?;
        }
        let radii = self.radii(&estimates, place.footprint);
        let record = estimates.record(place.key, place.si.p, &frame, &radii);
        let reach = self.bounds(place.footprint).least;
        let is_wanted = self.settings.cache.contact_shadows();
        let surroundings = is_wanted.then(|| Surroundings::new(&hemisphere, reach));
        record.is_valid().then_some(Gathered { record, relative_error, surroundings })
    }

    /// Irradiance at a place by one batch of rays, W·m⁻²; `None` where it would be chance.
    pub(in crate::integrator) fn irradiance(&self, place: &Place, rays: &mut u64) -> Option<Rgb> {
        let frame = Frame::from_normal(lit_normal(&place.si));
        Some(self.hemisphere(place, &frame, 0, rays)?.irradiance())
    }

    fn radii(&self, estimates: &Estimates, footprint: f32) -> Radii {
        radii(estimates, &self.bounds(footprint), &self.radius)
    }

    /// Bounds of radii where a pixel is `footprint` wide: lengths in scene units hold as they are.
    pub(super) fn bounds(&self, footprint: f32) -> RadiusBounds {
        let cache = &self.settings.cache;
        let given = |length: f32, otherwise: f32| if length > 0.0 { length } else { otherwise };
        let [least, largest] = if cache.ambient_resolution > 0.0 {
            let accuracy = self.radius.accuracy;
            let least = self.extent / cache.ambient_resolution;
            [least, (AMBIENT_RANGE * least).min(self.largest)].map(|radius| accuracy * radius)
        } else {
            let pixels =
                [cache.min_pixel_spacing(), cache.max_pixel_spacing].map(|n| n * footprint);
            [pixels[0], pixels[1].min(self.largest)]
        };
        RadiusBounds {
            least: given(cache.min_radius, least),
            largest: given(cache.max_radius, largest),
            reference: REFERENCE_PIXELS * footprint,
        }
    }

    /// Batches of rays until the irradiance is as exact as wanted, and its relative error. Whole
    /// batches are added, never rays where the first ones look uncertain, which would bias.
    fn quiet_hemisphere(
        &self,
        place: &Place,
        frame: &Frame,
        rays: &mut u64,
    ) -> Option<(Hemisphere, f32)> {
        let noise = self.settings.cache.noise();
        let mut all = self.hemisphere(place, frame, 0, rays)?;
        let error = all.relative_error();
        if error <= noise {
            return Some((all, error));
        }
        let mut spread = Spread::new(all.cells.len());
        spread.add(&all);
        for batch in 1..MAX_BATCHES {
            let more = self.hemisphere(place, frame, batch, rays)?;
            spread.add(&more);
            all.add_batch(&more);
            // In complete darkness there is nothing to improve: 0/0.
            let is_noisy = spread.relative_error() > f64::from(noise);
            if (batch + 1).is_power_of_two() && !is_noisy {
                break;
            }
        }
        Some((all, spread.relative_error() as f32))
    }

    fn hemisphere(
        &self,
        place: &Place,
        frame: &Frame,
        batch: u32,
        rays: &mut u64,
    ) -> Option<Hemisphere> {
        let (columns, rows) = self.grid.size();
        let high = (place.key >> 32) as u32 ^ batch.wrapping_mul(0x9e37_79b9);
        let stream = (place.key as u32, high);
        let mut cells = Vec::with_capacity(self.grid.len());
        let (nearest, mut too_near) = (SELF_HIT_OFFSETS * place.si.offset, 0);
        for j in 0..rows {
            for i in 0..columns {
                // Neighbouring cells get neighbouring points of the sequence.
                let mut sampler = self.samples.sampler(stream, morton(i, j));
                let direction = self.grid.direction(i, j, sampler.next_2d());
                let ray = place.si.spawn_ray(frame.to_world(direction));
                let Self { scene, settings, ends, depth, .. } = *self;
                let (radiance, hit) =
                    record_walk_at(scene, settings, ends, depth, &ray, &mut sampler, rays);
                too_near += usize::from(hit.as_ref().is_some_and(|hit| hit.t < nearest));
                let (distance, normal) = hit.map_or((f32::INFINITY, Vec3::ZERO), |hit| {
                    (hit.t.max(nearest), frame.to_local(hit.ng))
                });
                let radiance = if radiance.is_finite() { radiance } else { Rgb::BLACK };
                cells.push(Cell { direction, distance, normal, flags: 0, radiance });
            }
        }
        if too_near * SELF_HIT_ONE_OF > cells.len() {
            return None;
        }
        self.add_sky(place, frame, stream, &mut cells, rays);
        Hemisphere::new(self.grid, cells)
    }

    /// Further rays towards the sky. What a cell holds is then the mean over the part of it that
    /// sees the sky, instead of all or nothing.
    fn add_sky(
        &self,
        place: &Place,
        frame: &Frame,
        stream: (u32, u32),
        cells: &mut [Cell],
        rays: &mut u64,
    ) {
        let Some(sky) =
            SkyLight::at(self.scene, place.si.p, frame.n, 1.0 / CELLS_PER_SKY_RAY as f32)
        else {
            return;
        };
        for cell in cells.iter_mut().filter(|cell| cell.distance == f32::INFINITY) {
            cell.radiance *= sky.share(frame.to_world(cell.direction), cell.direction.z);
        }
        for index in 0..cells.len() / CELLS_PER_SKY_RAY {
            let mut sampler = self.samples.sampler((stream.0, !stream.1), index as u32);
            let found = sky.sample(&place.si, frame, sampler.next_2d(), rays);
            if let Some((local, radiance)) = found
                && let Some(cell) = self.grid.cell_of(local)
            {
                cells[cell].radiance += radiance;
            }
        }
    }
}

/// How far the batches of a record's rays differ, cell by cell: unlike differences between
/// neighbouring cells this is free of what truly differs between directions.
struct Spread {
    /// Per cell: sum of the luminances, and of their squares.
    sums: Vec<[f64; 2]>,
    batches: u32,
}

impl Spread {
    fn new(cells: usize) -> Self {
        Self { sums: vec![[0.0; 2]; cells], batches: 0 }
    }

    fn add(&mut self, hemisphere: &Hemisphere) {
        for (sum, cell) in self.sums.iter_mut().zip(&hemisphere.cells) {
            let value = f64::from(cell.radiance.luminance());
            sum[0] += value;
            sum[1] += value * value;
        }
        self.batches += 1;
    }

    /// Standard error of the mean over all cells and batches, relative to it.
    fn relative_error(&self) -> f64 {
        let n = f64::from(self.batches);
        let (mut total, mut variance) = (0.0, 0.0);
        for [sum, squares] in &self.sums {
            total += sum / n;
            variance += (squares / n - (sum / n).powi(2)).max(0.0) / (n - 1.0);
        }
        variance.sqrt() / total
    }
}

/// Interleaves the bits of two numbers below 2¹⁶.
pub(super) fn morton(x: u32, y: u32) -> u32 {
    let spread = |v: u32| {
        let v = (v | v << 8) & 0x00ff_00ff;
        let v = (v | v << 4) & 0x0f0f_0f0f;
        let v = (v | v << 2) & 0x3333_3333;
        (v | v << 1) & 0x5555_5555
    };
    spread(x & 0xffff) | spread(y & 0xffff) << 1
}
