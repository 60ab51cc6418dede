//! What the cache does at a point, for layers that show it.

use super::hash::lit_normal;
use super::prepass::first_diffuse_by;
use super::shade::scatter_numbers;
use super::{IrradianceCache, is_in_sight};
use crate::irradiance::{Inspection, Query, Record, inspect};
use crate::math::Ray;
use crate::sampler::Sampler;
use crate::scene::Scene;

impl IrradianceCache {
    /// Looks up as [`IrradianceCache::lookup`] does, and tells more.
    pub fn inspect(&self, query: &Query) -> Inspection {
        inspect(&self.records, &self.index, query, &self.lookup, |_| true)
    }

    /// Looks up where the sample of a camera ray does first: at the same diffuse surface, mirrors
    /// and glass followed by the same random numbers. `None` where there is none, or where its
    /// indirect light is beyond `max_depth`.
    pub(in crate::integrator) fn inspect_seen(
        &self,
        scene: &Scene,
        ray: &Ray,
        sampler: &mut Sampler,
        rays: &mut u64,
    ) -> Option<Inspection> {
        *rays += 1;
        let seen = first_diffuse_by(scene, *ray, |depth| {
            *rays += 1;
            scatter_numbers(sampler, depth)
        })?;
        let limit = scene.tables.integrator.max_depth;
        let least = if scene.lights.has_cached_sky() { 1 } else { 2 };
        if limit.is_some_and(|limit| seen.depth + least >= limit) {
            return None;
        }
        let n = lit_normal(&seen.si);
        let query = Query { p: seen.si.p, n_smooth: n, n_shading: n };
        let is_protected = scene.tables.integrator.cache.leak_protection();
        let is_seen = |record: &Record| !is_protected || is_in_sight(scene, &seen.si, record, rays);
        Some(inspect(&self.records, &self.index, &query, &self.lookup, is_seen))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::Bsdf;
    use crate::film::LAYER_NAMES;
    use crate::integrator::irrcache::prepass::first_diffuse;
    use crate::integrator::irrcache::tests::Silent;
    use crate::integrator::{
        Aov, AovKind, IntegratorKind, IntegratorSettings, IrrCacheSettings, eval_aovs, radiance,
    };
    use crate::math::{DVec3, Vec2, Vec3};
    use crate::render::{RenderSettings, render};
    use crate::sampler::{SamplerKind, SamplerSettings};
    use crate::scene::test_scene::{TestScene, mixed_room, place};
    use crate::sensor::Camera;
    use crate::shape::ShapeKind;
    use crate::spectrum::Rgb;

    const KINDS: [AovKind; 6] = [
        AovKind::Irradiance,
        AovKind::HarmonicMeanDistance,
        AovKind::RecordRadius,
        AovKind::RecordCount,
        AovKind::LookupWeight,
        AovKind::CacheMiss,
    ];

    fn scene(mut t: TestScene) -> Scene {
        let cache = IrrCacheSettings {
            gather_samples: Some(100),
            noise: Some(0.5),
            leak_protection: Some(false),
            // Layers show what records say.
            contact_shadows: Some(false),
            ..Default::default()
        };
        t.tables.integrator = IntegratorSettings {
            kind: IntegratorKind::IrradianceCache,
            cache,
            ..Default::default()
        };
        t.tables.aovs = KINDS.map(|kind| Aov { name: kind.name().to_owned(), kind }).to_vec();
        t.build()
    }

    fn build(scene: &Scene) -> IrradianceCache {
        IrradianceCache::build(scene, &scene.tables.sensors[0], &|| false).unwrap()
    }

    fn streams(count: u32) -> SamplerSettings {
        SamplerSettings { kind: SamplerKind::Independent, sample_count: count, seed: 3 }
    }

    /// Layers hold what a look-up at the place finds, also behind a mirror.
    #[test]
    fn layers_are_look_ups_at_the_first_diffuse_surface() {
        let scene = scene(mixed_room(32));
        let cache = build(&scene);
        let camera = Camera::new(&scene.tables.sensors[0]);
        let (mut values, mut rays, mut mirrored) = (Vec::new(), 0, 0);
        for i in 0..1000 {
            let mut sampler = Sampler::new(&streams(1000), (0, 0), i);
            let ray = camera.ray(sampler.next_2d() * 32.0, Vec2::splat(0.5));
            let before = rays;
            let aovs = &scene.tables.aovs;
            eval_aovs(&scene, Some(&cache), aovs, &ray, &mut sampler, &mut rays, &mut values);
            let Some(seen) = first_diffuse(&scene, ray, &mut sampler) else {
                assert_eq!(values, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 5.0]);
                continue;
            };
            assert_eq!(rays - before, u64::from(seen.depth) + 1);
            mirrored += u32::from(seen.depth > 0);
            let n = lit_normal(&seen.si);
            let query = Query { p: seen.si.p, n_smooth: n, n_shading: n };
            let told = cache.inspect(&query);
            assert_eq!(told.found.ok(), cache.lookup(&query));
            let Ok(found) = told.found else {
                assert_eq!((&values[..3], values[7] > 0.0), (&[0.0; 3][..], true));
                continue;
            };
            assert_eq!(values[..3], found.irradiance.to_array());
            assert_eq!(values[5..], [found.records as f32, found.weight, 0.0]);
            let radii = cache.records.iter().map(|r| r.radii[0]);
            let (least, most) = (radii.clone().fold(1.0, f32::min), radii.fold(0.0, f32::max));
            assert!(values[4] >= 0.999 * least && values[4] <= 1.001 * most, "{values:?}");
            assert!(values[3] > 0.0 && values[3] < 12.0_f32.sqrt(), "{values:?}");
        }
        assert!(mirrored > 50, "{mirrored} of the rays meet the mirror first");
    }

    /// A room that is divided by the surface of a block of glass, with a lamp or in the dark.
    fn divided_room(is_lit: bool) -> Scene {
        let mut t = TestScene::default();
        let (grey, one) = (t.diffuse(Rgb::splat(0.5)), t.color(Rgb::WHITE));
        let (specular_reflectance, specular_transmittance) = (one, one);
        let glass = Bsdf::Dielectric { eta: 1.5, specular_reflectance, specular_transmittance };
        let glass = t.bsdf(glass);
        t.room(grey);
        t.shape(ShapeKind::Rectangle(place(DVec3::ZERO, -DVec3::Z, DVec3::splat(3.0))), glass);
        let lamp = place(DVec3::new(0.0, 0.99, 0.5), -DVec3::Y, DVec3::splat(0.2));
        let black = t.diffuse(Rgb::BLACK);
        let lamp = t.shape(ShapeKind::Rectangle(lamp), black);
        if is_lit {
            t.emit(lamp, Rgb::splat(10.0));
        }
        t.camera(DVec3::new(0.0, 0.0, -0.9), DVec3::new(0.1, 0.1, 1.0), 60.0, 24);
        scene(t)
    }

    /// Glass goes on by chance: layers follow the way that the picture's sample went. In the dark
    /// there is no light but what the cache, which is of the lit room, says at the end of the way.
    #[test]
    fn layers_and_picture_take_the_same_way_through_glass() {
        let cache = build(&divided_room(true));
        let scene = divided_room(false);
        let camera = Camera::new(&scene.tables.sensors[0]);
        let (mut values, mut rays, mut ways) = (Vec::new(), 0, [0; 2]);
        for i in 0..2000 {
            let mut sampler = Sampler::new(&streams(2000), (0, 0), i);
            let ray = camera.ray(sampler.next_2d() * 24.0, Vec2::splat(0.5));
            let settings = &scene.tables.integrator;
            let found = radiance(&scene, settings, Some(&cache), &ray, &mut sampler, &mut rays);
            let aovs = &scene.tables.aovs;
            eval_aovs(&scene, Some(&cache), aovs, &ray, &mut sampler, &mut rays, &mut values);
            if values[7] != 0.0 {
                continue;
            }
            let ratio = found.rest.r / (values[0] * 0.5 * std::f32::consts::FRAC_1_PI);
            // Radiance is less by η² on this side of the surface.
            let way = usize::from((ratio - 1.0).abs() > 0.1);
            assert!((ratio - [1.0, 1.0 / 2.25][way]).abs() < 1e-4, "{ratio}");
            ways[way] += 1;
        }
        assert!(ways[0] > 50 && ways[1] > 1000, "reflected and refracted: {ways:?}");
    }

    /// Pixels of one material show albedo/π times their mean irradiance: averages are right though
    /// pixels have different numbers of samples.
    #[test]
    fn averages_are_those_of_the_picture() {
        let scene = scene(mixed_room(32));
        let settings = RenderSettings { spp: Some(64), ..Default::default() };
        let output = render(&scene, 0, &settings, None, &Silent).unwrap();
        let picture = &output.picture;
        let part = |name: &str| {
            let index = LAYER_NAMES.iter().position(|n| *n == name).unwrap();
            &picture.parts[index].image
        };
        let (mut compared, mut equal, mut few, mut many) = (0, 0, 0, 0);
        for y in 0..32 {
            for x in 0..32 {
                let is_plain = ["emission", "rest"].map(|p| part(p).pixel(x, y)[0]) == [0.0; 2];
                // Not the lamp, which is black: there the cache is not asked.
                let weight = picture.aovs[4].image.pixel(x, y)[0];
                if !is_plain || weight == 0.0 || picture.aovs[5].image.pixel(x, y)[0] != 0.0 {
                    continue;
                }
                compared += 1;
                let samples = picture.samples.image.pixel(x, y)[0];
                few += u32::from(samples == 4.0);
                many += u32::from(samples == 64.0);
                let irradiance = picture.aovs[0].image.pixel(x, y);
                let indirect = part("indirect").pixel(x, y);
                let ratio = |c: usize, albedo: f32| {
                    indirect[c] / (irradiance[c] * albedo * std::f32::consts::FRAC_1_PI)
                };
                let ratios = [ratio(0, 0.7), ratio(1, 0.6), ratio(2, 0.5)];
                // Samples that the cache does not serve are in the picture alone.
                assert!(ratios.iter().all(|r| *r > 1.0 - 1e-5), "{x}, {y}: {ratios:?}");
                equal += u32::from(ratios.iter().all(|r| *r < 1.0 + 1e-5));
            }
        }
        assert!(equal > compared * 9 / 10, "{equal} of {compared}");
        assert!(compared > 400 && few > 10 && many > 10, "{compared}, {few}, {many}");
    }

    /// With `max_depth` 2 there is no indirect light and with it no look-up.
    #[test]
    fn beyond_max_depth_the_cache_is_not_asked() {
        let mut scene = scene(mixed_room(8));
        let cache = build(&scene);
        scene.tables.integrator.max_depth = Some(2);
        let ray = Ray::new(Vec3::ZERO, Vec3::X);
        let mut sampler = Sampler::new(&streams(1), (0, 0), 0);
        assert!(cache.inspect_seen(&scene, &ray, &mut sampler, &mut 0).is_none());
        scene.tables.integrator.max_depth = Some(3);
        assert!(cache.inspect_seen(&scene, &ray, &mut sampler, &mut 0).is_some());
    }
}
