//! Radiance along a camera ray with light from the grid.

use std::f32::consts::FRAC_1_PI;

use super::{DiffusePart, GridCache, GridLight, Quantity, diffuse_part, place};
use crate::integrator::light::camera_hit;
use crate::integrator::path::path;
use crate::integrator::{IntegratorSettings, LayeredRadiance, LookupCounts};
use crate::interaction::SurfaceInteraction;
use crate::math::Ray;
use crate::sampler::Sampler;
use crate::scene::Scene;

/// Longest path without indirect light.
const DIRECT_DEPTH: u32 = 2;

/// Radiance along the camera ray `ray`.
pub(in crate::integrator) fn gridded(
    scene: &Scene,
    settings: &IntegratorSettings,
    grid: &GridCache,
    ray: &Ray,
    sampler: &mut Sampler,
    rays: &mut u64,
) -> LayeredRadiance {
    if settings.max_depth == Some(0) {
        return LayeredRadiance::default();
    }
    let mut seen = *ray;
    let Some(si) = camera_hit(scene, &mut seen, settings.hide_emitters, rays) else {
        return path(scene, settings, ray, sampler, rays);
    };
    let Some(part) = diffuse_part(scene, &si) else {
        return path(scene, settings, ray, sampler, rays);
    };
    let Some((light, corners)) = grid.lookup(&place(&si)) else {
        let found = path(scene, settings, ray, sampler, rays);
        return LayeredRadiance {
            lookups: LookupCounts { lookups: 1, uncached: 1, records: 0 },
            ..found
        };
    };
    let found = match grid.settings.quantity {
        Quantity::Color => colored(scene, &si, &light),
        Quantity::Irradiance => lit(scene, settings, ray, &part, &light, sampler, rays),
    };
    let lookups = LookupCounts { lookups: 1, uncached: 0, records: corners.into() };
    LayeredRadiance { lookups, ..found }
}

/// Reflected light from the grid; emission is that of the surface itself.
fn colored(scene: &Scene, si: &SurfaceInteraction, light: &GridLight) -> LayeredRadiance {
    LayeredRadiance {
        emission: scene.lights.emitted_radiance(&scene.tables, si),
        direct: light.direct,
        indirect: light.indirect,
        rest: light.rest,
        alpha: 1.0,
        ..Default::default()
    }
}

/// Irradiance from the grid in place of a path's indirect light.
fn lit(
    scene: &Scene,
    settings: &IntegratorSettings,
    ray: &Ray,
    part: &DiffusePart,
    light: &GridLight,
    sampler: &mut Sampler,
    rays: &mut u64,
) -> LayeredRadiance {
    // Where everything else is direct light, paths need not go on.
    let max_depth = if part.is_all {
        Some(settings.max_depth.map_or(DIRECT_DEPTH, |limit| limit.min(DIRECT_DEPTH)))
    } else {
        settings.max_depth
    };
    let settings = IntegratorSettings { max_depth, ..*settings };
    let found = path(scene, &settings, ray, sampler, rays);
    LayeredRadiance { indirect: part.albedo * light.indirect * FRAC_1_PI, ..found }
}
