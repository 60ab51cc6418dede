//! Random walks from the camera that tell what irradiance the surfaces they meet receive.

use super::Visit;
use super::guide::{Lesson, Teacher, WalkGuide};
use crate::bsdf::{BsdfAtHit, BsdfSample};
use crate::emitter::LightReference;
use crate::integrator::CAMERA_DIMENSIONS;
use crate::integrator::light::{Origin, light_reference, power_heuristic, sample_light};
use crate::integrator::path::{RECORD_SURVIVAL, SURE_THROUGHPUT, VERTEX_DIMENSIONS};
use crate::interaction::SurfaceInteraction;
use crate::math::directions::Directions;
use crate::math::{Ray, Vec2, Vec3};
use crate::sampler::Sampler;
use crate::scene::Scene;
use crate::spectrum::Rgb;

/// Longest walk: hardly ever reached, or what late vertices receive would be cut short.
const MAX_VERTICES: usize = 512;
/// Diffuse albedo of a surface from which on its irradiance is of interest.
const LEAST_ALBEDO: f32 = 0.02;
/// Vertices after which weak walks may end.
const ROULETTE: usize = 4;
/// Share of the directions that a guide chooses, where there is one. With more of them the others
/// weigh too much.
const GUIDED: f32 = 0.35;

/// Vertices from the first on at which there is a guide. Where it is not followed a weight grows by up to
/// 1/(1 - [`GUIDED`]), and over twenty vertices by thousands: single walks would decide about a picture's
/// mean.
const GUIDED_VERTICES: usize = 6;

/// What a walk says about the picture.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Seen {
    /// Radiance that arrives at the camera.
    pub(super) all: Rgb,
    /// The part of it that was scattered more than twice: what ends of walks at the hash stand for.
    pub(super) distant: Rgb,
}

/// A vertex of a walk.
struct Vertex {
    /// Where it was, if it was diffuse, and the cosine over the density of the next segment's
    /// direction: what makes its radiance an estimate of irradiance.
    visit: Option<(Visit, f32)>,
    /// Irradiance there by light sources directly.
    lit: Rgb,
    /// Light that reached it from light sources directly and goes on towards the walk's begin.
    direct: Rgb,
    /// What the next segment's radiance is multiplied with.
    weight: Rgb,
    /// How the next segment was chosen, which decides what emission at its end counts. A purely
    /// diffuse vertex leaves all of that to light sampling.
    origin: Option<Origin>,
}

impl Vertex {
    /// The end of a walk: what arrives there was not looked for.
    fn last(direct: Rgb) -> Self {
        Self { visit: None, lit: Rgb::BLACK, direct, weight: Rgb::BLACK, origin: None }
    }
}

/// Makes walks.
#[derive(Clone, Copy)]
pub(super) struct Walks<'a> {
    pub(super) scene: &'a Scene,
    /// Where light is to be looked for, if that is known.
    pub(super) guide: Option<&'a WalkGuide>,
    /// Says what is to be learned from them, if anything.
    pub(super) teacher: Option<&'a Teacher>,
}

/// How a walk goes on from a vertex.
struct Continuation {
    sample: BsdfSample,
    /// What the sample's weight would be if the material alone had chosen it.
    unguided: Rgb,
}

/// What is left of a walk.
struct Throughput {
    actual: Rgb,
    /// Without a guide, whose weights are small where there is much to be found: they do not say
    /// which walks may end.
    unguided: Rgb,
}

impl Throughput {
    /// The probability with which a walk of so many vertices goes on.
    fn survival(&self, vertices: usize) -> f32 {
        if vertices < ROULETTE {
            return 1.0;
        }
        let most = self.actual.max_component().max(self.unguided.max_component());
        (most / SURE_THROUGHPUT).min(RECORD_SURVIVAL)
    }
}

impl Walks<'_> {
    /// Follows a walk and calls `visit` with where its diffuse vertices were and what irradiance they
    /// received, indirectly and directly (W·m⁻², one random estimate). Counts `rays`.
    pub(super) fn follow(
        &self,
        mut ray: Ray,
        sampler: &mut Sampler,
        rays: &mut u64,
        lessons: &mut Vec<Lesson>,
        visit: impl FnMut(Visit, Rgb, Rgb),
    ) -> Seen {
        let scene = self.scene;
        let mut vertices: Vec<Vertex> = Vec::with_capacity(16);
        let mut throughput = Throughput { actual: Rgb::WHITE, unguided: Rgb::WHITE };
        let mut bsdf = BsdfAtHit::empty();
        // Radiance that arrives at the last vertex from beyond.
        let mut beyond = Beyond::default();
        while vertices.len() < MAX_VERTICES {
            *rays += 2;
            let Some(si) = scene.intersect(&ray) else {
                if let Some(last) = vertices.last() {
                    beyond = Beyond::new(scene, last, ray.d);
                    self.learn(last, ray.d, beyond.cached_sky, lessons);
                }
                break;
            };
            let tables = &scene.tables;
            let shape = &tables.shapes.shapes[si.shape.0 as usize];
            if shape.emitter.is_some()
                && let Some(last) = vertices.last_mut()
                && let Some(origin) = &last.origin
            {
                let emission = scene.lights.emitted_radiance(tables, &si);
                last.direct += last.weight * emission * origin.surface_weight(scene, &si);
            }
            tables.bsdfs.read_at_hit(&tables.textures, &tables.shapes, shape.bsdf, &si, &mut bsdf);
            if let (Some(last), Some(teacher)) = (vertices.last(), self.teacher) {
                self.learn(last, ray.d, teacher.radiance(&si, bsdf.diffuse_albedo()), lessons);
            }
            let (vertex, wi) = self.scatter(&si, &bsdf, vertices.len(), &mut throughput, sampler);
            vertices.push(vertex);
            let Some(wi) = wi else { break };
            ray = si.spawn_ray(wi);
        }
        note(&vertices, &beyond, visit)
    }

    /// The vertex of this number, and where the walk goes on from there.
    fn scatter(
        &self,
        si: &SurfaceInteraction,
        bsdf: &BsdfAtHit,
        number: usize,
        throughput: &mut Throughput,
        sampler: &mut Sampler,
    ) -> (Vertex, Option<Vec3>) {
        sampler.set_dimension(CAMERA_DIMENSIONS + number as u32 * VERTEX_DIMENSIONS);
        let reference = light_reference(si, bsdf);
        let (direct, lit) = light_at(self.scene, si, bsdf, sampler);
        let n = lit_normal(si);
        let (u_lobe, u) = (sampler.next_1d(), sampler.next_2d());
        // Before the direction counts: what is told of this vertex must not depend on whether it is
        // a lucky one.
        let q = throughput.survival(number);
        if number + 1 == MAX_VERTICES || (q < 1.0 && sampler.next_1d() >= q) {
            return (Vertex::last(direct), None);
        }
        let is_told = bsdf.diffuse_albedo().max_component() >= LEAST_ALBEDO;
        let visit = |scale| is_told.then_some((Visit { p: si.p, n, shape: si.shape }, scale));
        let guide = self.guide.filter(|_| bsdf.is_diffuse() && number < GUIDED_VERTICES);
        let guide = guide.and_then(|guide| guide.at(si.p, n));
        let Some(Continuation { sample, unguided }) = next(guide, bsdf, u_lobe, u) else {
            // Directions that cannot occur are part of the mean.
            return (Vertex { visit: visit(0.0), lit, ..Vertex::last(direct) }, None);
        };
        let weight = sample.weight * (1.0 / q);
        throughput.actual *= weight;
        throughput.unguided *= unguided * (1.0 / q);
        let is_singular = sample.is_delta || sample.is_null;
        let cos = sample.wi.dot(n);
        let scale = if is_singular || cos <= 0.0 { 0.0 } else { cos / sample.pdf };
        let origin = if bsdf.is_diffuse() {
            None
        } else if is_singular {
            Some(Origin::Delta)
        } else {
            Some(Origin::Smooth(reference, sample.pdf))
        };
        let leads_on = !weight.is_black() || (is_told && scale > 0.0);
        let vertex = Vertex { visit: visit(scale), lit, direct, weight, origin };
        (vertex, leads_on.then_some(sample.wi))
    }

    /// Notes that `radiance` arrives at a vertex from the direction `d`.
    fn learn(&self, at: &Vertex, d: Vec3, radiance: Rgb, lessons: &mut Vec<Lesson>) {
        if let (Some(teacher), Some((visit, scale))) = (self.teacher, &at.visit) {
            let weight = radiance.luminance() * scale;
            if weight.is_finite() {
                lessons.push(teacher.lesson(visit, d, weight));
            }
        }
    }
}

/// A direction to go on in: the material's or, at purely diffuse surfaces, a guide's.
fn next(guide: Option<Directions>, bsdf: &BsdfAtHit, u_lobe: f32, u: Vec2) -> Option<Continuation> {
    let mut sample = bsdf.sample(u_lobe, u)?;
    // Of a diffuse surface it is the same in all directions.
    let unguided = sample.weight;
    let Some(guide) = guide else {
        return Some(Continuation { sample, unguided });
    };
    if u_lobe < GUIDED {
        sample.wi = guide.sample(u)?.0;
    }
    let value = bsdf.eval(sample.wi);
    sample.pdf = GUIDED * guide.pdf(sample.wi) + (1.0 - GUIDED) * value.pdf;
    // Below the horizon both can be 0.
    sample.weight = if value.pdf > 0.0 { value.value * (1.0 / sample.pdf) } else { Rgb::BLACK };
    Some(Continuation { sample, unguided })
}

/// Radiance of the environment at the end of a walk.
#[derive(Default)]
struct Beyond {
    /// What light sampling at the last vertex leaves to it.
    radiance: Rgb,
    /// What belongs to the irradiance there: the sky that the cache holds.
    cached_sky: Rgb,
}

impl Beyond {
    /// In direction `d` from the last vertex.
    fn new(scene: &Scene, last: &Vertex, d: Vec3) -> Self {
        let (lights, tables) = (&scene.lights, &scene.tables);
        let cached_sky = lights.cached_sky_radiance(tables, d);
        let radiance = match &last.origin {
            Some(origin) if lights.has_environment() => {
                lights.environment_radiance(tables, d) * origin.environment_weight(scene, d)
            }
            Some(_) => Rgb::BLACK,
            None => cached_sky,
        };
        Self { radiance, cached_sky }
    }
}

/// From the last vertex to the first: what arrives at one is what the next sends.
fn note(vertices: &[Vertex], beyond: &Beyond, mut visit: impl FnMut(Visit, Rgb, Rgb)) -> Seen {
    let mut arriving = beyond.radiance;
    let mut incident = beyond.cached_sky;
    let mut seen = Seen::default();
    for (depth, vertex) in vertices.iter().enumerate().rev() {
        if let Some((place, scale)) = vertex.visit {
            let indirect = incident * scale;
            if indirect.is_finite() && vertex.lit.is_finite() {
                visit(place, indirect, vertex.lit);
            }
        }
        let continued = vertex.weight * arriving;
        arriving = vertex.direct + continued;
        incident = arriving;
        match depth {
            1 => seen.distant = continued,
            0 => seen.distant *= vertex.weight,
            _ => {}
        }
    }
    seen.all = arriving;
    seen
}

/// Light that one light sample sends towards the viewer: all of it from a purely diffuse surface,
/// else the part that sampling the BSDF does not find.
pub(in crate::integrator) fn direct_light(
    scene: &Scene,
    si: &SurfaceInteraction,
    bsdf: &BsdfAtHit,
    sampler: &mut Sampler,
) -> Rgb {
    light_at(scene, si, bsdf, sampler).0
}

/// [`direct_light`], and the irradiance that the surface receives by the same sample.
fn light_at(
    scene: &Scene,
    si: &SurfaceInteraction,
    bsdf: &BsdfAtHit,
    sampler: &mut Sampler,
) -> (Rgb, Rgb) {
    let u_select = if scene.lights.needs_choice() { sampler.next_1d() } else { 0.0 };
    let u = sampler.next_2d();
    if !bsdf.has_smooth() {
        return (Rgb::BLACK, Rgb::BLACK);
    }
    let reference = LightReference { without_sky: bsdf.is_diffuse(), ..light_reference(si, bsdf) };
    match sample_light(scene, &reference, bsdf, u_select, u) {
        Some(light) if light.is_visible(scene, si) => {
            let stands_alone = bsdf.is_diffuse();
            let weight = power_heuristic(light.light_pdf(), light.bsdf_pdf());
            let radiance = light.contribution() * if stands_alone { 1.0 } else { weight };
            (radiance, light.irradiance(scene, lit_normal(si)))
        }
        _ => (Rgb::BLACK, Rgb::BLACK),
    }
}

/// The shading normal on the viewer's side.
pub(in crate::integrator) fn lit_normal(si: &SurfaceInteraction) -> Vec3 {
    if si.frame.n.dot(si.wo) < 0.0 { -si.frame.n } else { si.frame.n }
}
