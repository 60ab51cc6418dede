//! The second pass: radiance along a camera ray with diffuse indirect light from the cache.

use std::f32::consts::{FRAC_1_PI, PI};

use super::CacheView;
use super::WalkEnd;
use super::contact::{Contact, Served};
use super::hash::lit_normal;
use super::signature::Signature;
use super::sky::SkyLight;
use crate::bsdf::BsdfAtHit;
use crate::emitter::LightReference;
use crate::integrator::light::{Origin, light_reference, past, sample_light};
use crate::integrator::path::{EARLY_ROULETTE, SURE_THROUGHPUT, VERTEX_DIMENSIONS, record_walk_at};
use crate::integrator::{CAMERA_DIMENSIONS, DirectControl, IntegratorSettings, LayeredRadiance};
use crate::interaction::SurfaceInteraction;
use crate::irradiance::Query;
use crate::math::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use crate::math::{Frame, Ray, Vec2, Vec3};
use crate::sampler::Sampler;
use crate::scene::Scene;
use crate::spectrum::Rgb;

/// Longest chain of surfaces that are not diffuse.
const MAX_CHAIN: u32 = 64;

struct Chain<'a> {
    scene: &'a Scene,
    settings: &'a IntegratorSettings,
    cache: CacheView<'a>,
    result: LayeredRadiance,
    throughput: Rgb,
    origin: Origin,
    /// Light from all lights of which there is a closed form, at the first vertex.
    closed: Closed,
    signature: Signature,
    /// Surfaces left behind, and those of them that were visible.
    depth: u32,
    vertices: u32,
    rays: u64,
}

/// A point of which diffuse light is wanted.
struct Lit<'a> {
    si: &'a SurfaceInteraction,
    /// For which irradiance is wanted.
    n: Vec3,
    /// The material, where maps turned that normal.
    bumped: Option<&'a BsdfAtHit<'a>>,
    albedo: Rgb,
}

impl Lit<'_> {
    /// Share of light from the direction `wi`, of this cosine to the normal, that maps leave.
    fn share(&self, wi: Vec3, cos: f32) -> f32 {
        self.bumped.map_or(1.0, |bsdf| {
            let flat = self.albedo.luminance() * cosine_hemisphere_pdf(cos);
            if flat > 0.0 { bsdf.eval(wi).diffuse.luminance() / flat } else { 0.0 }
        })
    }
}

/// Direct light of lights of which there is a closed form.
#[derive(Default)]
struct Closed {
    /// As found.
    found: Rgb,
    /// As if nothing stood in its way, exactly and by the sample.
    control: DirectControl,
}

/// Radiance along the camera ray `ray`.
pub(in crate::integrator) fn cached(
    scene: &Scene,
    settings: &IntegratorSettings,
    cache: CacheView,
    ray: &Ray,
    sampler: &mut Sampler,
    rays: &mut u64,
) -> LayeredRadiance {
    if settings.max_depth == Some(0) {
        return LayeredRadiance::default();
    }
    let mut chain = Chain {
        scene,
        settings,
        cache,
        result: LayeredRadiance::default(),
        throughput: Rgb::WHITE,
        origin: Origin::Delta,
        closed: Closed::default(),
        signature: Signature::new(),
        depth: 0,
        vertices: 0,
        rays: 0,
    };
    chain.run(*ray, sampler);
    *rays += chain.rays;
    chain.finish()
}

/// The random numbers that say how a chain goes on behind `depth` surfaces.
pub(super) fn scatter_numbers(sampler: &mut Sampler, depth: u32) -> (f32, Vec2) {
    let dimension = CAMERA_DIMENSIONS + depth * VERTEX_DIMENSIONS;
    sampler.set_dimension(dimension + 2);
    let u_lobe = sampler.next_1d();
    sampler.set_dimension(dimension + 3);
    (u_lobe, sampler.next_2d())
}

impl Chain<'_> {
    fn run(&mut self, mut ray: Ray, sampler: &mut Sampler) {
        let mut bsdf = BsdfAtHit::empty();
        while self.depth < MAX_CHAIN {
            self.rays += 1;
            let hit = self.scene.intersect(&ray);
            let Some(si) = &hit else {
                self.add_environment(&ray);
                return;
            };
            let tables = &self.scene.tables;
            let shape = &tables.shapes.shapes[si.shape.0 as usize];
            if shape.emitter.is_some() {
                if self.settings.hide_emitters && self.depth == 0 {
                    ray = past(si, &ray);
                    continue;
                }
                self.add_emission(si);
            }
            self.signature.add(si.shape.0);
            if self.throughput.is_black() {
                return;
            }
            tables.bsdfs.read_at_hit(&tables.textures, &tables.shapes, shape.bsdf, si, &mut bsdf);
            if !bsdf.is_null_only() {
                self.result.alpha = 1.0;
            }
            if self.settings.max_depth.is_some_and(|limit| self.depth + 1 >= limit) {
                return;
            }
            let Some(next) = self.scatter(si, &bsdf, sampler) else { return };
            ray = next;
        }
    }

    /// Adds direct and cached light, then goes on with what is not diffuse.
    fn scatter(
        &mut self,
        si: &SurfaceInteraction,
        bsdf: &BsdfAtHit,
        sampler: &mut Sampler,
    ) -> Option<Ray> {
        let dimension = CAMERA_DIMENSIONS + self.depth * VERTEX_DIMENSIONS;
        self.add_cached(si, bsdf, dimension, sampler);
        sampler.set_dimension(dimension);
        if bsdf.is_diffuse() {
            // Nothing goes on, so light sampling stands alone.
            self.add_light(si, bsdf, sampler);
            return None;
        }
        let mut glossy = bsdf.clone();
        glossy.remove_diffuse();
        let reference = light_reference(si, bsdf);
        if bsdf.has_smooth() {
            self.add_split_light(si, bsdf, &glossy, &reference, sampler);
        }
        let (u_lobe, u) = scatter_numbers(sampler, self.depth);
        let sample = glossy.sample(u_lobe, u)?;
        self.depth += 1;
        self.vertices += u32::from(!sample.is_null);
        self.throughput *= sample.weight;
        self.origin = if sample.is_delta || sample.is_null {
            Origin::Delta
        } else {
            Origin::Smooth(reference, sample.pdf)
        };
        self.survives(sampler).then(|| si.spawn_ray(sample.wi))
    }

    /// Ends weak chains.
    fn survives(&mut self, sampler: &mut Sampler) -> bool {
        let largest = self.throughput.max_component();
        let from_here_on = self.depth >= self.settings.rr_depth;
        let early = self.settings.early_roulette && self.depth >= EARLY_ROULETTE;
        if from_here_on || early {
            let limit = if from_here_on { 0.95 } else { 1.0 };
            let q = (largest / SURE_THROUGHPUT).min(limit);
            if q < 1.0 {
                if sampler.next_1d() >= q {
                    return false;
                }
                self.throughput *= 1.0 / q;
            }
        }
        largest > 0.0
    }

    /// Where light goes: at the first vertex into the layer `first`, later into the rest.
    fn layer(&mut self, first: fn(&mut LayeredRadiance) -> &mut Rgb) -> &mut Rgb {
        if self.vertices == 0 { first(&mut self.result) } else { &mut self.result.rest }
    }

    fn add_cached(
        &mut self,
        si: &SurfaceInteraction,
        bsdf: &BsdfAtHit,
        dimension: u32,
        sampler: &mut Sampler,
    ) {
        let albedo = bsdf.diffuse_albedo();
        // Bounces that the cache's light has made at least.
        let least = if self.scene.lights.has_cached_sky() { 1 } else { 2 };
        let limit = self.settings.max_depth;
        let is_deep_enough = limit.is_none_or(|limit| self.depth + least < limit);
        if albedo.is_black() || !is_deep_enough {
            return;
        }
        let n = lit_normal(si);
        let bumped = bsdf.perturbed_diffuse_normal();
        let query = Query { p: si.p, n_smooth: n, n_shading: bumped.unwrap_or(n) };
        let at = Lit { si, n: query.n_shading, bumped: bumped.map(|_| bsdf), albedo };
        self.result.lookups.lookups += 1;
        let irradiance = match self.cache.lookup_seen(self.scene, si, &query, &mut self.rays) {
            Some(served) => {
                self.result.lookups.records += u64::from(served.found.records);
                // Walks that correct all of a look-up correct that, too.
                if self.settings.cache.debias > 0.0 {
                    self.debiased(served.found.irradiance, &at, dimension, sampler)
                } else {
                    served.found.irradiance + self.contact(&served, &at, dimension, sampler)
                }
            }
            None => match self.averaged(si, dimension, sampler) {
                Some(irradiance) => irradiance,
                None => {
                    self.result.lookups.uncached += 1;
                    self.uncached(&at, dimension, sampler)
                }
            },
        };
        let indirect = self.throughput * albedo * irradiance * FRAC_1_PI;
        *self.layer(|r| &mut r.indirect) += indirect;
    }

    /// Cached irradiance whose expectation is that of paths: with a small probability the
    /// difference to one walk is added, as many times as it is left out on average. The cache is
    /// then only a control variate.
    fn debiased(&mut self, cached: Rgb, at: &Lit, dimension: u32, sampler: &mut Sampler) -> Rgb {
        let probability = self.settings.cache.debias;
        sampler.set_dimension(dimension + 2);
        if probability <= 0.0 || sampler.next_1d() >= probability {
            return cached;
        }
        let walked = self.uncached(at, dimension, sampler);
        cached + (walked - cached) * (1.0 / probability)
    }

    /// What the records that serve a point do not know of one direction: see [`super::contact`].
    fn contact(&mut self, served: &Served, at: &Lit, dimension: u32, sampler: &mut Sampler) -> Rgb {
        sampler.set_dimension(dimension + 3);
        let local = cosine_hemisphere(sampler.next_2d());
        let wi = Frame::from_normal(at.n).to_world(local);
        let share = at.share(wi, local.z);
        if share <= 0.0 {
            return Rgb::BLACK;
        }
        let Self { scene, cache: view, depth, .. } = *self;
        let contact = Contact { scene, view, served, si: at.si, depth };
        contact.missing(wi, sampler, &mut self.rays) * (PI * share)
    }

    /// What the hash knows of a surface that is seen by way of a rough one, which blurs more than
    /// the hash does.
    fn averaged(
        &self,
        si: &SurfaceInteraction,
        dimension: u32,
        sampler: &mut Sampler,
    ) -> Option<Rgb> {
        if !matches!(self.origin, Origin::Smooth(..)) || self.settings.cache.debias > 0.0 {
            return None;
        }
        sampler.set_dimension(dimension + 3);
        self.cache.hash()?.lookup(si, sampler.next_2d()).map(|found| found.indirect)
    }

    /// Irradiance by one cosine-distributed ray, and one towards the sky; with bump and normal maps
    /// as much of it as they leave.
    fn uncached(&mut self, at: &Lit, dimension: u32, sampler: &mut Sampler) -> Rgb {
        sampler.set_dimension(dimension + 3);
        let local = cosine_hemisphere(sampler.next_2d());
        let frame = Frame::from_normal(at.n);
        let wi = frame.to_world(local);
        let share = at.share(wi, local.z);
        let (scene, rays) = (self.scene, &mut self.rays);
        let sky = SkyLight::at(scene, at.si.p, frame.n, 1.0);
        let mut radiance = Rgb::BLACK;
        if share > 0.0 {
            let ray = at.si.spawn_ray(wi);
            let hash = self.cache.hash().filter(|_| self.settings.cache.debias <= 0.0);
            let (found, hit) = record_walk_at(
                scene,
                self.settings,
                hash.map(WalkEnd::Hash),
                self.depth,
                &ray,
                sampler,
                rays,
            );
            let weight = match &sky {
                Some(sky) if hit.is_none() => sky.share(wi, local.z),
                _ => 1.0,
            };
            radiance += found * (weight * share);
        }
        if let Some(sky) = sky {
            sampler.set_dimension(dimension);
            if let Some((local, found)) = sky.sample(at.si, &frame, sampler.next_2d(), rays) {
                radiance += found * at.share(frame.to_world(local), local.z);
            }
        }
        radiance * PI
    }

    /// Next-event estimation at a surface that is only diffuse.
    fn add_light(&mut self, si: &SurfaceInteraction, bsdf: &BsdfAtHit, sampler: &mut Sampler) {
        let lights = &self.scene.lights;
        let u_select = if lights.needs_choice() { sampler.next_1d() } else { 0.0 };
        let u = sampler.next_2d();
        let reference = LightReference { without_sky: true, ..light_reference(si, bsdf) };
        let light = sample_light(self.scene, &reference, bsdf, u_select, u);
        let is_visible = light.as_ref().is_some_and(|light| {
            self.rays += 1;
            light.is_visible(self.scene, si)
        });
        // Not what the surface turns away from, which the closed form knows.
        self.signature.add((light.is_some() && !is_visible).into());
        let unoccluded = light.as_ref().map_or(Rgb::BLACK, |l| self.throughput * l.contribution());
        let found = if is_visible { unoccluded } else { Rgb::BLACK };
        let cache = &self.settings.cache;
        // The ratio that this makes of many samples is a bias, which `debias` is to take away.
        let is_wanted = cache.analytic_direct && cache.debias <= 0.0 && self.vertices == 0;
        if is_wanted && lights.has_closed_form() {
            let exact = lights.unoccluded_irradiance(&self.scene.tables, si.p, lit_normal(si));
            let scale = self.throughput * bsdf.diffuse_albedo() * FRAC_1_PI;
            self.closed.control.exact += scale * exact;
            if light.is_some_and(|light| light.is_near()) {
                self.closed.found += found;
                self.closed.control.sampled += unoccluded;
            }
        }
        *self.layer(|r| &mut r.direct) += found;
    }

    /// All that was found. What has no closed form stands for itself on both sides of the control.
    fn finish(self) -> LayeredRadiance {
        let other = self.result.direct - self.closed.found;
        let DirectControl { exact, sampled } = self.closed.control;
        LayeredRadiance {
            control: DirectControl { exact: exact + other, sampled: sampled + other },
            signature: self.signature.value(),
            ..self.result
        }
    }

    /// Next-event estimation at a surface that is not only diffuse.
    fn add_split_light(
        &mut self,
        si: &SurfaceInteraction,
        bsdf: &BsdfAtHit,
        glossy: &BsdfAtHit,
        reference: &LightReference,
        sampler: &mut Sampler,
    ) {
        let u_select = if self.scene.lights.needs_choice() { sampler.next_1d() } else { 0.0 };
        let u = sampler.next_2d();
        let Some(light) = sample_light(self.scene, reference, bsdf, u_select, u) else { return };
        self.rays += 1;
        if light.is_visible(self.scene, si) {
            let radiance = self.throughput * light.split_contribution(self.scene, glossy);
            *self.layer(|r| &mut r.direct) += radiance;
        }
    }

    fn add_emission(&mut self, si: &SurfaceInteraction) {
        let scene = self.scene;
        let radiance = scene.lights.emitted_radiance(&scene.tables, si);
        if radiance.is_black() {
            return;
        }
        if !self.settings.hide_emitters {
            self.result.alpha = 1.0;
        }
        let weight = self.origin.surface_weight(scene, si);
        self.add_found(self.throughput * radiance * weight);
    }

    fn add_environment(&mut self, ray: &Ray) {
        let scene = self.scene;
        let seen_directly = self.vertices == 0;
        if !scene.lights.has_environment() || (seen_directly && self.settings.hide_emitters) {
            return;
        }
        if seen_directly {
            self.result.alpha = 1.0;
        }
        let radiance = scene.lights.environment_radiance(&scene.tables, ray.d);
        let weight = self.origin.environment_weight(scene, ray.d);
        self.add_found(self.throughput * radiance * weight);
    }

    /// Adds emitted light that the current ray found.
    fn add_found(&mut self, radiance: Rgb) {
        match (&self.origin, self.vertices) {
            (Origin::Delta, 0) => self.result.emission += radiance,
            (Origin::Smooth(..), 1) => self.result.direct += radiance,
            _ => self.result.rest += radiance,
        }
    }
}
