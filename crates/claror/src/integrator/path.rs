//! Path tracing with next-event estimation and multiple importance sampling.
//!
//! Parameters (Mitsuba's `path`):
//! - `max_depth` (none): longest path; 1 shows emission only, 2 adds direct light, and so on.
//!   Passing an invisible surface counts, as in Mitsuba.
//! - `rr_depth` (5): paths that were scattered so often end with a probability that depends on
//!   how much light they can still carry.
//! - `early_roulette` (true): so do paths that have become weak before. Not in Mitsuba; false gives
//!   its `rr_depth` to the letter. Expectations are the same.
//! - `hide_emitters` (false): camera rays see neither area lights nor the environment.
//!
//! Fails (noise that does not go away) where small lights are seen only through glass or in
//! mirrors: light sampling cannot reach them. Kajiya 1986; Veach 1997.

use super::irrcache::{WalkEnd, direct_light};
use super::light::{Origin, light_reference, past, power_heuristic, sample_light};
use super::{CAMERA_DIMENSIONS, IntegratorSettings, LayeredRadiance};
use crate::bsdf::{BsdfAtHit, BsdfSample};
use crate::emitter::LightReference;
use crate::interaction::SurfaceInteraction;
use crate::math::{Ray, Vec3};
use crate::sampler::Sampler;
use crate::scene::Scene;
use crate::spectrum::Rgb;
use std::f32::consts::FRAC_1_PI;

/// Dimensions per vertex: which light, where on it; which lobe, which direction; roulette.
pub(super) const VERTEX_DIMENSIONS: u32 = 5;

/// Throughput from which on paths are sure to survive roulette, Mitsuba's being 1. Bounces carry
/// half of the variance of a closed room, so letting more of them live pays, and what has become
/// weak early (dark walls) costs time that nobody sees. Error times CPU time against roulette from
/// `rr_depth` on alone: a room with dark and white surfaces 0.69, the Cornell box 0.94; flat
/// between 1/8 and 1/4.
pub(super) const SURE_THROUGHPUT: f32 = 0.25;

/// Scattering events after which paths that carry less than [`SURE_THROUGHPUT`] may end before
/// `rr_depth`.
pub(super) const EARLY_ROULETTE: u32 = 2;

/// Most that roulette lets live of the paths of a picture from `rr_depth` on, as Mitsuba does.
const SURVIVAL: f32 = 0.95;

/// The same for walks whose light many pixels share. Where fewer escape from a crevice of white
/// surfaces with each bounce than roulette ends, those few weigh the more the longer it took them:
/// the variance is infinite.
pub(super) const RECORD_SURVIVAL: f32 = 0.99;

/// Least probability with which the gloss of a surface is followed.
const LEAST_GLOSS: f32 = 0.1;

/// Where light that is found now belongs (see [`super`]).
#[derive(Clone, Copy, PartialEq)]
enum Stage {
    /// Before the first vertex.
    Camera,
    /// After the first vertex, which scattered by a component that light sampling covers.
    FirstSmooth,
    /// After a second vertex, or a first one that scattered by a delta component.
    Later,
}

struct Walk<'a> {
    scene: &'a Scene,
    settings: &'a IntegratorSettings,
    result: LayeredRadiance,
    /// Light of the stage `Later`, not yet split into indirect and rest.
    later: Rgb,
    /// The diffuse component's share of what the first vertex scatters, per channel.
    diffuse_share: Rgb,
    stage: Stage,
    origin: Origin,
    throughput: Rgb,
    /// Product of the relative indices of refraction crossed.
    eta: f32,
    /// Surfaces left behind, invisible ones included.
    depth: u32,
    rays: u64,
    /// Largest probability of survival from `rr_depth` on.
    survival: f32,
    /// Where a record's walk may end early.
    ends: Option<WalkEnd<'a>>,
    /// The first surface met, if a record asked for it.
    first_hit: Option<FirstHit>,
}

/// Irradiance at the end of a walk.
struct Known {
    irradiance: Rgb,
    /// Direct light included.
    is_total: bool,
}

/// What the first ray of a record's walk met.
#[derive(Clone, Copy)]
pub(super) struct FirstHit {
    /// Distance from the ray's origin.
    pub(super) t: f32,
    /// Unit geometric normal.
    pub(super) ng: Vec3,
}

/// Radiance that arrives along a record's ray, without emission at its first hit, and that hit.
pub(super) fn record_walk(
    scene: &Scene,
    settings: &IntegratorSettings,
    ray: &Ray,
    sampler: &mut Sampler,
    rays: &mut u64,
) -> (Rgb, Option<FirstHit>) {
    record_walk_at(scene, settings, None, 0, ray, sampler, rays)
}

/// [`record_walk`] from a surface in front of which the path has left `depth` others behind: they
/// count for `max_depth`, and the walk takes the dimensions of the sampler after theirs. It ends where
/// `ends` serves it.
pub(super) fn record_walk_at(
    scene: &Scene,
    settings: &IntegratorSettings,
    ends: Option<WalkEnd>,
    depth: u32,
    ray: &Ray,
    sampler: &mut Sampler,
    rays: &mut u64,
) -> (Rgb, Option<FirstHit>) {
    let mut walk = Walk::new(scene, settings);
    walk.stage = Stage::Later;
    walk.origin = Origin::Record;
    walk.survival = RECORD_SURVIVAL;
    walk.depth = depth + 1;
    walk.ends = ends;
    walk.run(*ray, sampler);
    *rays += walk.rays;
    (walk.later, walk.first_hit)
}

/// Radiance along the camera ray `ray`.
pub(super) fn path(
    scene: &Scene,
    settings: &IntegratorSettings,
    ray: &Ray,
    sampler: &mut Sampler,
    rays: &mut u64,
) -> LayeredRadiance {
    if settings.max_depth == Some(0) {
        return LayeredRadiance::default();
    }
    let mut walk = Walk::new(scene, settings);
    walk.run(*ray, sampler);
    *rays += walk.rays;
    walk.finish()
}

impl<'a> Walk<'a> {
    fn new(scene: &'a Scene, settings: &'a IntegratorSettings) -> Self {
        Self {
            scene,
            settings,
            result: LayeredRadiance::default(),
            later: Rgb::BLACK,
            diffuse_share: Rgb::BLACK,
            stage: Stage::Camera,
            origin: Origin::Delta,
            throughput: Rgb::WHITE,
            eta: 1.0,
            depth: 0,
            rays: 0,
            survival: SURVIVAL,
            ends: None,
            first_hit: None,
        }
    }
}

impl Walk<'_> {
    fn run(&mut self, mut ray: Ray, sampler: &mut Sampler) {
        let mut bsdf = BsdfAtHit::empty();
        loop {
            self.rays += 1;
            // Bound anew in every turn: an interaction is too large to be moved about.
            let hit = self.scene.intersect(&ray);
            let Some(si) = &hit else {
                self.add_environment(&ray);
                return;
            };
            if matches!(self.origin, Origin::Record) {
                self.first_hit = Some(FirstHit { t: si.t, ng: si.ng });
            }
            let tables = &self.scene.tables;
            let shape = &tables.shapes.shapes[si.shape.0 as usize];
            if shape.emitter.is_some() {
                if self.settings.hide_emitters && self.is_at_camera() {
                    ray = past(si, &ray);
                    continue;
                }
                self.add_emission(si);
            }
            let (textures, shapes) = (&tables.textures, &tables.shapes);
            tables.bsdfs.read_at_hit(textures, shapes, shape.bsdf, si, &mut bsdf);
            if self.settings.max_depth.is_some_and(|limit| self.depth + 1 >= limit) {
                if !bsdf.is_null_only() {
                    self.result.alpha = 1.0;
                }
                return;
            }
            let next = match self.known_irradiance(si, &bsdf, sampler) {
                Some(irradiance) => self.scatter_glossy(si, &bsdf, irradiance, sampler),
                None => self.scatter(si, &bsdf, sampler),
            };
            let Some(next) = next else { return };
            ray = next;
        }
    }

    /// Irradiance where it is known.
    fn known_irradiance(
        &mut self,
        si: &SurfaceInteraction,
        bsdf: &BsdfAtHit,
        sampler: &mut Sampler,
    ) -> Option<Known> {
        let ends = self.ends?;
        if bsdf.diffuse_albedo().is_black() {
            return None;
        }
        match ends {
            WalkEnd::Hash(hash) => {
                sampler.set_dimension(self.vertex_dimension() + 3);
                hash.lookup(si, sampler.next_2d()).map(|found| Known {
                    irradiance: found.direct.map_or(found.indirect, |d| d + found.indirect),
                    is_total: found.direct.is_some(),
                })
            }
            WalkEnd::Cache(cache) => cache
                .irradiance(self.scene, si, self.depth, &mut self.rays)
                .map(|irradiance| Known { irradiance, is_total: false }),
        }
    }

    /// Adds light sampled directly and what the diffuse component makes of an irradiance
    /// that is known, then goes on with what is not diffuse.
    fn scatter_glossy(
        &mut self,
        si: &SurfaceInteraction,
        bsdf: &BsdfAtHit,
        Known { irradiance, is_total }: Known,
        sampler: &mut Sampler,
    ) -> Option<Ray> {
        self.later += self.throughput * bsdf.diffuse_albedo() * irradiance * FRAC_1_PI;
        let dimension = self.vertex_dimension();
        sampler.set_dimension(dimension);
        if bsdf.is_diffuse() {
            if is_total {
                return None;
            }
            self.rays += 1;
            self.later += self.throughput * direct_light(self.scene, si, bsdf, sampler);
            return None;
        }
        let mut glossy = bsdf.clone();
        glossy.remove_diffuse();
        sampler.set_dimension(dimension + 2);
        let u_lobe = sampler.next_1d();
        sampler.set_dimension(dimension + 3);
        let sample = glossy.sample(u_lobe, sampler.next_2d());
        if is_total && !self.continues(sample.as_ref(), sampler) {
            return None;
        }
        let reference = light_reference(si, bsdf);
        if bsdf.has_smooth() {
            sampler.set_dimension(dimension);
            let u_select = if self.scene.lights.needs_choice() { sampler.next_1d() } else { 0.0 };
            sampler.set_dimension(dimension + 1);
            let u = sampler.next_2d();
            self.rays += 1;
            if let Some(light) = sample_light(self.scene, &reference, bsdf, u_select, u)
                && light.is_visible(self.scene, si)
            {
                let contribution = if is_total {
                    light.glossy_contribution(&glossy)
                } else {
                    light.split_contribution(self.scene, &glossy)
                };
                self.later += self.throughput * contribution;
            }
        }
        let sample = sample?;
        self.turn(&sample, reference);
        sampler.set_dimension(dimension + 4);
        (is_total || self.survives(sampler)).then(|| si.spawn_ray(sample.wi))
    }

    /// Russian roulette for the weak gloss of a surface whose diffuse light is known, instead of
    /// that of [`Walk::survives`].
    fn continues(&mut self, sample: Option<&BsdfSample>, sampler: &mut Sampler) -> bool {
        let weight = sample.map_or(Rgb::BLACK, |sample| self.throughput * sample.weight);
        let limit = if self.depth >= self.settings.rr_depth { self.survival } else { 1.0 };
        let q = (weight.max_component() / SURE_THROUGHPUT).clamp(LEAST_GLOSS, limit);
        if q < 1.0 {
            if sampler.next_1d() >= q {
                return false;
            }
            self.throughput *= 1.0 / q;
        }
        true
    }

    /// Whether nothing was met yet, invisible surfaces included.
    fn is_at_camera(&self) -> bool {
        self.depth == 0
    }

    /// The first dimension of the sampler that belongs to this vertex.
    fn vertex_dimension(&self) -> u32 {
        CAMERA_DIMENSIONS + self.depth * VERTEX_DIMENSIONS
    }

    /// Adds light sampled directly, then continues the path; `None` where it ends.
    fn scatter(
        &mut self,
        si: &SurfaceInteraction,
        bsdf: &BsdfAtHit,
        sampler: &mut Sampler,
    ) -> Option<Ray> {
        let dimension = self.vertex_dimension();
        let reference = light_reference(si, bsdf);
        if bsdf.has_smooth() {
            sampler.set_dimension(dimension);
            self.add_light_sample(si, bsdf, &reference, sampler);
        }
        sampler.set_dimension(dimension + 2);
        let u_lobe = if bsdf.needs_choice() { sampler.next_1d() } else { 0.0 };
        sampler.set_dimension(dimension + 3);
        let Some(sample) = bsdf.sample(u_lobe, sampler.next_2d()) else {
            // Nothing is scattered, so nothing is seen through the surface either.
            self.result.alpha = 1.0;
            return None;
        };
        self.turn(&sample, reference);
        self.survives(sampler).then(|| si.spawn_ray(sample.wi))
    }

    /// Next-event estimation.
    fn add_light_sample(
        &mut self,
        si: &SurfaceInteraction,
        bsdf: &BsdfAtHit,
        reference: &LightReference,
        sampler: &mut Sampler,
    ) {
        let u_select = if self.scene.lights.needs_choice() { sampler.next_1d() } else { 0.0 };
        sampler.set_dimension(self.vertex_dimension() + 1);
        let u = sampler.next_2d();
        let Some(light) = sample_light(self.scene, reference, bsdf, u_select, u) else {
            return;
        };
        self.rays += 1;
        if light.is_visible(self.scene, si) {
            let weight = power_heuristic(light.light_pdf(), light.bsdf_pdf());
            let radiance = self.throughput * light.contribution() * weight;
            match self.stage {
                Stage::Camera => self.result.direct += radiance,
                _ => self.later += radiance,
            }
        }
    }

    /// Follows the sampled direction.
    fn turn(&mut self, sample: &BsdfSample, reference: LightReference) {
        self.throughput *= sample.weight;
        self.eta *= sample.eta;
        self.depth += 1;
        self.origin = if sample.is_delta || sample.is_null {
            Origin::Delta
        } else {
            Origin::Smooth(reference, sample.pdf)
        };
        if sample.is_null {
            return;
        }
        self.result.alpha = 1.0;
        self.stage = match self.stage {
            Stage::Camera => {
                self.diffuse_share = diffuse_share(sample);
                if sample.is_delta { Stage::Later } else { Stage::FirstSmooth }
            }
            _ => Stage::Later,
        };
    }

    /// Russian roulette: the squared index undoes the compression of radiance inside glass, and
    /// from `rr_depth` on some paths always end, so that total reflection cannot trap them.
    fn survives(&mut self, sampler: &mut Sampler) -> bool {
        let largest = self.throughput.max_component();
        let from_here_on = self.depth >= self.settings.rr_depth;
        let early = self.settings.early_roulette && self.depth >= EARLY_ROULETTE;
        if from_here_on || early {
            let limit = if from_here_on { self.survival } else { 1.0 };
            let q = (largest * self.eta * self.eta * (1.0 / SURE_THROUGHPUT)).min(limit);
            if q < 1.0 {
                if sampler.next_1d() >= q {
                    return false;
                }
                self.throughput *= 1.0 / q;
            }
        }
        largest != 0.0
    }

    fn add_emission(&mut self, si: &SurfaceInteraction) {
        let scene = self.scene;
        if matches!(self.origin, Origin::Record) {
            return;
        }
        let radiance = scene.lights.emitted_radiance(&scene.tables, si);
        if radiance.is_black() {
            return;
        }
        let weight = self.origin.surface_weight(scene, si);
        if !self.settings.hide_emitters {
            self.result.alpha = 1.0;
        }
        self.add(radiance, weight);
    }

    fn add_environment(&mut self, ray: &Ray) {
        let scene = self.scene;
        let seen_directly = self.stage == Stage::Camera;
        if matches!(self.origin, Origin::Record) {
            // Direct light, but the sky that the cache holds.
            self.later += scene.lights.cached_sky_radiance(&scene.tables, ray.d);
            return;
        }
        if !scene.lights.has_environment() || (seen_directly && self.settings.hide_emitters) {
            return;
        }
        if seen_directly {
            self.result.alpha = 1.0;
        }
        let radiance = scene.lights.environment_radiance(&scene.tables, ray.d);
        let weight = self.origin.environment_weight(scene, ray.d);
        self.add(radiance, weight);
    }

    /// Adds emitted light that the current ray found.
    fn add(&mut self, radiance: Rgb, weight: f32) {
        let radiance = self.throughput * radiance * weight;
        match self.stage {
            Stage::Camera => self.result.emission += radiance,
            Stage::FirstSmooth => self.result.direct += radiance,
            Stage::Later => self.later += radiance,
        }
    }

    /// Splits the light of later vertices by what the first vertex did with it.
    fn finish(mut self) -> LayeredRadiance {
        self.result.indirect = self.later * self.diffuse_share;
        self.result.rest = self.later - self.result.indirect;
        self.result
    }
}

/// Per channel, how much of a sample's weight comes from the diffuse component.
fn diffuse_share(sample: &BsdfSample) -> Rgb {
    let share = |diffuse: f32, all: f32| if all > 0.0 { (diffuse / all).min(1.0) } else { 0.0 };
    Rgb::new(
        share(sample.diffuse_weight.r, sample.weight.r),
        share(sample.diffuse_weight.g, sample.weight.g),
        share(sample.diffuse_weight.b, sample.weight.b),
    )
}
