//! Light behind thin walls, and places without any room.

use super::super::gather::{Gatherer, Place};
use super::*;
use crate::integrator::{IntegratorKind, IntegratorSettings};
use crate::irradiance::Criterion;
use crate::math::{DVec3, Vec2, Vec3};
use crate::sampler::{Sampler, SamplerKind, SamplerSettings};
use crate::scene::test_scene::{TestScene, place};
use crate::sensor::Camera;
use crate::shape::ShapeKind;
use crate::spectrum::Rgb;

fn settings(cache: IrrCacheSettings) -> IntegratorSettings {
    IntegratorSettings {
        kind: IntegratorKind::IrradianceCache,
        max_depth: Some(6),
        cache,
        ..Default::default()
    }
}

/// A room that a wall of a thousandth of its width divides, but for a passage before the camera;
/// floor and ceiling go through, and the lamp is on one side.
fn divided_room(cache: IrrCacheSettings) -> Scene {
    let mut t = TestScene::default();
    let grey = t.diffuse(Rgb::splat(0.6));
    let black = t.diffuse(Rgb::BLACK);
    t.room(grey);
    for side in [-1.0, 1.0] {
        let face = place(DVec3::new(0.0005 * side, 0.0, 0.5), DVec3::X * side, DVec3::ONE);
        t.shape(ShapeKind::Rectangle(face), grey);
    }
    let lamp = place(DVec3::new(0.5, 0.99, 0.5), -DVec3::Y, DVec3::splat(0.3));
    let lamp = t.shape(ShapeKind::Rectangle(lamp), black);
    t.emit(lamp, Rgb::splat(10.0));
    t.camera(DVec3::new(0.0, 0.6, -0.95), DVec3::new(0.0, -0.5, 0.5), 100.0, 48);
    t.tables.integrator = settings(cache);
    t.build()
}

/// What the cache says over what walks say, at points of the floor by the dark side of the wall.
fn ratios(scene: &Scene) -> (Vec<f32>, usize) {
    let sensor = &scene.tables.sensors[0];
    let cache = IrradianceCache::build(scene, sensor, &|| false).expect("not cancelled");
    let camera = Camera::new(sensor);
    let eye = camera.ray(Vec2::splat(24.0), Vec2::splat(0.5)).o;
    let probes = ProbeSettings { batches: 4, grid: 12, seed: 5 };
    let streams = SamplerSettings { kind: SamplerKind::Independent, sample_count: 1, seed: 3 };
    let mut ratios = Vec::new();
    for i in 0..8 {
        for (j, x) in [-0.02, -0.05, -0.1, -0.2].into_iter().enumerate() {
            let p = Vec3::new(x, -1.0, -0.2 + 0.1 * i as f32);
            let ray = Ray::new(eye, (p - eye).normalize());
            let stream = 8 * j as u32 + i;
            let mut sampler = Sampler::new(&streams, (stream, 0), 0);
            let probe = cache.probe(scene, &ray, &mut sampler, &probes, stream, &mut 0);
            let Some(probe) = probe.filter(|probe| probe.position.distance(p) < 0.01) else {
                continue;
            };
            if let Some(found) = probe.cached {
                ratios.push(found.irradiance.luminance() / probe.expected.luminance());
            }
        }
    }
    (ratios, cache.records.len())
}

/// Without protection the dark floor beside the wall is twenty times too bright. With it, what is
/// left is interpolation on one side, and the walks' noise of some tenths.
#[test]
fn thin_walls_keep_light_out() {
    for criterion in [Criterion::Hessian, Criterion::Ward92] {
        let cache = IrrCacheSettings { criterion, bounces: Bounces::Path, ..Default::default() };
        let worst = |ratios: &[f32]| ratios.iter().copied().fold(0.0, f32::max);
        let with =
            |on| ratios(&divided_room(IrrCacheSettings { leak_protection: Some(on), ..cache }));
        let ((leaky, few), (tight, many)) = (with(false), with(true));
        assert!(worst(&leaky) > 10.0, "{criterion:?}: {leaky:?}");
        assert!(worst(&tight) < 2.0, "{criterion:?}: {tight:?}");
        assert!(tight.len() * 10 > leaky.len() * 9 && many < 2 * few);
    }
}

/// A table on thin legs needs no protection, since records under it know the table top, and does
/// not suffer from it.
#[test]
fn tables_are_left_alone() {
    let errors = |on| {
        let mut t = TestScene::default();
        let grey = t.diffuse(Rgb::splat(0.6));
        let black = t.diffuse(Rgb::BLACK);
        t.room(grey);
        for (y, facing) in [(-0.7, DVec3::Y), (-0.72, -DVec3::Y)] {
            let top = place(DVec3::new(0.0, y, 0.2), facing, DVec3::splat(0.4));
            t.shape(ShapeKind::Rectangle(top), grey);
        }
        for (x, z) in [(-0.38, -0.18), (0.38, -0.18), (-0.38, 0.58), (0.38, 0.58)] {
            for (dx, facing) in [(-0.01, -DVec3::X), (0.01, DVec3::X)] {
                let centre = DVec3::new(x + dx, -0.86, z);
                let leg = place(centre, facing, DVec3::new(0.14, 0.01, 1.0));
                t.shape(ShapeKind::Rectangle(leg), grey);
            }
        }
        let lamp = place(DVec3::new(0.0, 0.99, 0.2), -DVec3::Y, DVec3::splat(0.3));
        let lamp = t.shape(ShapeKind::Rectangle(lamp), black);
        t.emit(lamp, Rgb::splat(10.0));
        t.camera(DVec3::new(0.0, -0.6, -0.95), DVec3::new(0.0, -0.9, 0.2), 90.0, 48);
        let cache = IrrCacheSettings { leak_protection: Some(on), ..Default::default() };
        t.tables.integrator = IntegratorSettings { max_depth: None, ..settings(cache) };
        let scene = t.build();
        let sensor = &scene.tables.sensors[0];
        let cache = IrradianceCache::build(&scene, sensor, &|| false).expect("not cancelled");
        let camera = Camera::new(sensor);
        let probes = ProbeSettings { batches: 4, grid: 12, seed: 5 };
        let streams = SamplerSettings { kind: SamplerKind::Sobol, sample_count: 1, seed: 3 };
        let mut errors: Vec<f32> = Vec::new();
        for i in 0..200_u16 {
            // The lower half of the picture: floor and legs.
            let film =
                Vec2::new(f32::from(i % 20) + 0.2, f32::from(i / 20) + 0.1) * Vec2::new(2.4, 2.0);
            let ray = camera.ray(film, Vec2::splat(0.5));
            let mut sampler = Sampler::new(&streams, (u32::from(i), 0), 0);
            let probe = cache.probe(&scene, &ray, &mut sampler, &probes, i.into(), &mut 0);
            let Some((probe, found)) = probe.and_then(|p| Some((p, p.cached?))) else { continue };
            errors.push((found.irradiance.luminance() / probe.expected.luminance()).ln().abs());
        }
        assert!(errors.len() > 120, "{}", errors.len());
        (errors.iter().sum::<f32>() / errors.len() as f32, cache.records.len())
    };
    let ((without, few), (with, many)) = (errors(false), errors(true));
    assert!(with < 1.1 * without, "mean error {without}, then {with}");
    assert!(many < few + few / 5, "{few} records, then {many}");
}

/// Where two surfaces are within each other's rounding there is no record; a little farther apart
/// there is one.
#[test]
fn coinciding_surfaces_have_no_records() {
    let down = Ray::new(Vec3::new(0.1, 0.2, 1.0), -Vec3::Z);
    let covered_at = |height: f32| {
        let mut t = TestScene::default();
        let grey = t.diffuse(Rgb::splat(0.6));
        let floor = place(DVec3::ZERO, DVec3::Z, DVec3::ONE);
        t.shape(ShapeKind::Rectangle(floor), grey);
        let cover = place(DVec3::new(0.0, 0.0, height.into()), -DVec3::Z, DVec3::ONE);
        t.shape(ShapeKind::Rectangle(cover), grey);
        let lamp = place(DVec3::new(0.0, 0.0, 2.0), -DVec3::Z, DVec3::ONE);
        let lamp = t.shape(ShapeKind::Rectangle(lamp), grey);
        t.emit(lamp, Rgb::WHITE);
        let noise =
            IrrCacheSettings { noise: Some(1e3), bounces: Bounces::Path, ..Default::default() };
        t.tables.integrator = settings(noise);
        t.build()
    };
    let offset = covered_at(3.0).intersect(&down).expect("the lamp is above the eye").offset;
    let has_record = |offsets: f32| {
        let scene = covered_at(offsets * offset);
        let under = Ray::new(Vec3::new(0.1, 0.2, -1.0), Vec3::Z);
        let mut si = scene.intersect(&under).expect("the floor");
        // As seen from within the gap.
        si.wo = Vec3::Z;
        let gatherer = Gatherer::new(&scene, &scene.tables.integrator, None, 1);
        let place = Place { si, footprint: 0.01, key: 7 };
        gatherer.record(&place, &mut 0).is_some()
    };
    assert!(!has_record(2.0));
    assert!(has_record(50.0));
}
