//! Emission and direct light only, with several light and BSDF samples per camera sample.
//!
//! Parameters (Mitsuba's `direct`): `emitter_samples` and `bsdf_samples` (1 each), combined by
//! multiple importance sampling; `hide_emitters`.

use super::light::{camera_hit, light_reference, power_heuristic, sample_light};
use super::{CAMERA_DIMENSIONS, IntegratorSettings, LayeredRadiance};
use crate::bsdf::BsdfAtHit;
use crate::interaction::SurfaceInteraction;
use crate::math::Ray;
use crate::sampler::Sampler;
use crate::scene::Scene;
use crate::spectrum::Rgb;

/// How many samples of each kind.
#[derive(Clone, Copy)]
pub(super) struct SampleCounts {
    pub(super) emitter: u32,
    pub(super) bsdf: u32,
}

impl SampleCounts {
    /// Share of light samples and of BSDF samples.
    fn shares(self) -> (f32, f32) {
        let all = (self.emitter + self.bsdf).max(1) as f32;
        (self.emitter as f32 / all, self.bsdf as f32 / all)
    }
}

/// Emission and direct light along the camera ray `ray`.
pub(super) fn direct(
    scene: &Scene,
    settings: &IntegratorSettings,
    counts: SampleCounts,
    ray: &Ray,
    sampler: &mut Sampler,
    rays: &mut u64,
) -> LayeredRadiance {
    let mut result = LayeredRadiance::default();
    let mut ray = *ray;
    let Some(si) = camera_hit(scene, &mut ray, settings.hide_emitters, rays) else {
        if !settings.hide_emitters && scene.lights.has_environment() {
            result.emission = scene.lights.environment_radiance(&scene.tables, ray.d);
            result.alpha = 1.0;
        }
        return result;
    };
    result.alpha = 1.0;
    result.emission = scene.lights.emitted_radiance(&scene.tables, &si);
    let tables = &scene.tables;
    let shape = &tables.shapes.shapes[si.shape.0 as usize];
    let bsdf = tables.bsdfs.at_hit(&tables.textures, &tables.shapes, shape.bsdf, &si);
    sampler.set_dimension(CAMERA_DIMENSIONS);
    add_light_samples(scene, &si, &bsdf, counts, sampler, rays, &mut result);
    add_bsdf_samples(scene, &si, &bsdf, counts, sampler, rays, &mut result);
    result
}

fn add_light_samples(
    scene: &Scene,
    si: &SurfaceInteraction,
    bsdf: &BsdfAtHit,
    counts: SampleCounts,
    sampler: &mut Sampler,
    rays: &mut u64,
    result: &mut LayeredRadiance,
) {
    let (light_share, bsdf_share) = counts.shares();
    let reference = light_reference(si, bsdf);
    for _ in 0..counts.emitter {
        let (u_select, u) = (sampler.next_1d(), sampler.next_2d());
        if !bsdf.has_smooth() {
            continue;
        }
        let Some(light) = sample_light(scene, &reference, bsdf, u_select, u) else {
            continue;
        };
        *rays += 1;
        if light.is_visible(scene, si) {
            let (a, b) = (light.light_pdf() * light_share, light.bsdf_pdf() * bsdf_share);
            let weight = power_heuristic(a, b) / counts.emitter as f32;
            result.direct += light.contribution() * weight;
        }
    }
}

fn add_bsdf_samples(
    scene: &Scene,
    si: &SurfaceInteraction,
    bsdf: &BsdfAtHit,
    counts: SampleCounts,
    sampler: &mut Sampler,
    rays: &mut u64,
    result: &mut LayeredRadiance,
) {
    let (light_share, bsdf_share) = counts.shares();
    let reference = light_reference(si, bsdf);
    for _ in 0..counts.bsdf {
        let (u_lobe, u) = (sampler.next_1d(), sampler.next_2d());
        let Some(sample) = bsdf.sample(u_lobe, u) else {
            continue;
        };
        let ray = si.spawn_ray(sample.wi);
        *rays += 1;
        let smooth = !(sample.is_delta || sample.is_null);
        let (radiance, pdf) = match scene.intersect(&ray) {
            Some(light) => (
                scene.lights.emitted_radiance(&scene.tables, &light),
                scene.lights.pdf_surface(&scene.tables, &reference, sample.wi, &light),
            ),
            None if scene.lights.has_environment() => (
                scene.lights.environment_radiance(&scene.tables, ray.d),
                scene.lights.pdf_environment(&scene.tables, &reference, ray.d),
            ),
            None => (Rgb::BLACK, 0.0),
        };
        let light_pdf = if smooth { pdf * light_share } else { 0.0 };
        let weight = power_heuristic(sample.pdf * bsdf_share, light_pdf) / counts.bsdf as f32;
        let radiance = sample.weight * radiance * weight;
        match (smooth, sample.is_null) {
            (true, _) => result.direct += radiance,
            (false, true) => result.emission += radiance,
            (false, false) => result.rest += radiance,
        }
    }
}
