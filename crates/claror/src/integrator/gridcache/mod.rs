//! `gridcache`: light computed on a coarse grid of pixels and interpolated between them, the
//! prototypes from which irradiance caching is taught.
//!
//! Its parameters are those of [`PARAMETERS`].
//!
//! At every `step`-th pixel of the film the first surface is looked for. Where it is diffuse, its
//! indirect irradiance is estimated by rays over the hemisphere, as `irrcache` does it, or with
//! [`Quantity::Color`] all that it reflects, by paths. A sample of the picture that sees a diffuse
//! surface takes the place of that light from the four corners of the cell in which it lies: all
//! four whatever they are ([`Interpolation`] says how), but those that are missing. A sample whose
//! cell has no corner with a weight, or whose first surface is not diffuse, follows a path.
//!
//! Diffuse is what has a Lambertian part, is not turned by bump or normal maps, and hides what is
//! behind it. Other light, other parts of the material included, is that of paths. So with
//! [`Quantity::Irradiance`] and a step of one pixel the picture becomes that of `path`, up to how
//! the irradiance changes within a pixel, as samples and rays grow (and up to what
//! [`crate::bsdf::BsdfAtHit::diffuse_albedo`] says about plastics).

mod lattice;
mod settings;
mod shade;
#[cfg(test)]
mod tests;

pub use settings::{GridCacheSettings, GridParameter, Interpolation, PARAMETERS, Quantity};
pub(super) use shade::gridded;

use rayon::prelude::*;

use super::irrcache::gather::{Gatherer, Place as GatherPlace};
use super::irrcache::{Bounces, IrrCacheSettings, IsCancelled, lit_normal, pixel_key};
use super::light::camera_hit;
use super::path::path;
use super::{IntegratorSettings, LayeredRadiance};
use crate::interaction::SurfaceInteraction;
use crate::irradiance::Criterion;
use crate::math::{Ray, Vec2};
use crate::sampler::{SamplerKind, SamplerSettings, SamplerTable};
use crate::scene::Scene;
use crate::sensor::{Camera, Sensor};
use crate::spectrum::Rgb;
use lattice::{Lattice, Place};

/// Keeps the random numbers of the grid apart from those of the picture.
const STREAM: u64 = 0x6772_6964;

/// Light at the points of a grid in the picture.
#[derive(Debug)]
pub struct GridCache {
    /// Rays traced for it.
    pub rays: u64,
    settings: GridCacheSettings,
    camera: Camera,
    lattice: Lattice,
    points: Vec<Option<GridPoint>>,
}

/// A point of the grid that sees a diffuse surface.
#[derive(Debug, Clone, Copy, PartialEq)]
struct GridPoint {
    place: Place,
    light: GridLight,
}

/// What is interpolated.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct GridLight {
    /// Reflected light of the layers `direct` and `rest`; black with [`Quantity::Irradiance`].
    direct: Rgb,
    rest: Rgb,
    /// The layer `indirect`, or indirect irradiance, W·m⁻².
    indirect: Rgb,
}

impl GridLight {
    fn add(&mut self, other: &Self, weight: f32) {
        self.direct += other.direct * weight;
        self.rest += other.rest * weight;
        self.indirect += other.indirect * weight;
    }
}

impl GridCache {
    /// The grid of what a sensor sees. `None` when cancelled.
    pub fn build(scene: &Scene, sensor: &Sensor, is_cancelled: IsCancelled) -> Option<Self> {
        let settings = &scene.tables.integrator;
        let grid = settings.grid;
        let lattice = Lattice::new(&sensor.film, grid.step);
        let camera = Camera::new(sensor);
        // Plain rays over the hemisphere, nothing else of a record.
        let gathering = IntegratorSettings {
            cache: IrrCacheSettings {
                criterion: Criterion::Hessian,
                gather_samples: Some(grid.gather_samples),
                bounces: Bounces::Path,
                ..Default::default()
            },
            ..*settings
        };
        let seed = sensor.sampler.seed ^ STREAM;
        let samples =
            SamplerSettings { kind: SamplerKind::Sobol, sample_count: grid.gather_samples, seed };
        let maker = Maker {
            scene,
            settings,
            gatherer: Gatherer::new(scene, &gathering, None, seed),
            samples: SamplerTable::new(&samples, 0, grid.gather_samples),
        };
        let made = (0..lattice.len()).into_par_iter().with_max_len(16).map(|index| {
            if is_cancelled() {
                return None;
            }
            let ray = camera.ray(lattice.film(index), Vec2::splat(0.5));
            let mut rays = 0;
            let point = maker.point(&ray, lattice.pixel(index), &mut rays);
            Some((point, rays))
        });
        let made: Vec<(Option<GridPoint>, u64)> = made.collect::<Option<_>>()?;
        let rays = made.iter().map(|(_, rays)| rays).sum();
        let points = made.into_iter().map(|(point, _)| point).collect();
        Some(Self { rays, settings: grid, camera, lattice, points })
    }

    /// How it was made.
    pub fn settings(&self) -> &GridCacheSettings {
        &self.settings
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there are no points.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Film positions of the points that see a diffuse surface, pixels of the whole film.
    pub fn used_points(&self) -> Vec<Vec2> {
        let used = |(index, point): (usize, &Option<GridPoint>)| {
            point.is_some().then(|| self.lattice.film(index))
        };
        self.points.iter().enumerate().filter_map(used).collect()
    }

    /// Light at a point of a surface and the number of corners that it is from; `None` where none
    /// has a weight.
    fn lookup(&self, at: &Place) -> Option<(GridLight, u32)> {
        let cell = self.lattice.cell(self.camera.project(at.p)?);
        let corners = cell.corners.map(|corner| self.points[corner]);
        let places = corners.map(|corner| corner.map(|corner| corner.place));
        let weights = cell.weights(self.settings.interpolation, at, &places);
        let all: f64 = weights.iter().sum();
        let mut light = GridLight::default();
        for (corner, weight) in corners.iter().zip(weights) {
            if let Some(corner) = corner {
                light.add(&corner.light, (weight / all) as f32);
            }
        }
        let count = weights.iter().filter(|weight| **weight > 0.0).count() as u32;
        (count > 0).then_some((light, count))
    }
}

/// Computes light at points.
struct Maker<'a> {
    scene: &'a Scene,
    settings: &'a IntegratorSettings,
    gatherer: Gatherer<'a>,
    samples: SamplerTable,
}

impl Maker<'_> {
    /// What a ray through the pixel `pixel` sees; `None` if that is nothing diffuse.
    fn point(&self, ray: &Ray, pixel: (u32, u32), rays: &mut u64) -> Option<GridPoint> {
        let mut seen = *ray;
        let si = camera_hit(self.scene, &mut seen, self.settings.hide_emitters, rays)?;
        diffuse_part(self.scene, &si)?;
        let light = match self.settings.grid.quantity {
            Quantity::Irradiance => {
                let key = pixel_key(pixel.0, pixel.1);
                let indirect =
                    self.gatherer.irradiance(&GatherPlace { si, footprint: 0.0, key }, rays)?;
                GridLight { indirect, ..Default::default() }
            }
            Quantity::Color => self.color(ray, pixel, rays),
        };
        let is_finite = [light.direct, light.rest, light.indirect].iter().all(|l| l.is_finite());
        is_finite.then(|| GridPoint { place: place(&si), light })
    }

    /// Mean of paths along a camera ray, emission of what it sees left out.
    fn color(&self, ray: &Ray, pixel: (u32, u32), rays: &mut u64) -> GridLight {
        let count = self.settings.grid.gather_samples;
        let mut sum = GridLight::default();
        for index in 0..count {
            let mut sampler = self.samples.sampler(pixel, index);
            let LayeredRadiance { direct, indirect, rest, .. } =
                path(self.scene, self.settings, ray, &mut sampler, rays);
            sum.add(&GridLight { direct, rest, indirect }, 1.0 / count as f32);
        }
        sum
    }
}

/// Where a surface is, and how it is turned to the viewer.
fn place(si: &SurfaceInteraction) -> Place {
    Place { p: si.p, n: lit_normal(si) }
}

/// What is known of a diffuse surface.
#[derive(Debug, Clone, Copy)]
struct DiffusePart {
    albedo: Rgb,
    /// Whether there is no other part.
    is_all: bool,
}

/// The Lambertian part of a surface, if it has one that a grid can serve (see the module).
fn diffuse_part(scene: &Scene, si: &SurfaceInteraction) -> Option<DiffusePart> {
    let tables = &scene.tables;
    let bsdf = tables.shapes.shapes[si.shape.0 as usize].bsdf;
    let bsdf = tables.bsdfs.at_hit(&tables.textures, &tables.shapes, bsdf, si);
    let albedo = bsdf.diffuse_albedo();
    let is_served =
        !albedo.is_black() && bsdf.perturbed_diffuse_normal().is_none() && !bsdf.is_see_through();
    is_served.then(|| DiffusePart { albedo, is_all: bsdf.is_diffuse() })
}
