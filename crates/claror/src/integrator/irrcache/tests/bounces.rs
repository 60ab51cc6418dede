//! Walks that end at a second, coarser cache.

use super::deep::DeepCache;
use super::prepass::Eye;
use super::*;
use crate::irradiance::IndexKind;
use crate::math::statistics::{Moments, student_quantile_two_sided};
use crate::math::{Ray, Vec3, warp};

fn deep() -> IrrCacheSettings {
    IrrCacheSettings { bounces: Bounces::Cache, ..Default::default() }
}

fn mean(cache: &IrradianceCache) -> f64 {
    let sum: f64 = cache.records.iter().map(|r| f64::from(r.irradiance.r)).sum();
    sum / cache.records.len() as f64
}

fn deep_cache(scene: &Scene) -> DeepCache {
    let sensor = &scene.tables.sensors[0];
    let watch = CacheWatch::silent(&|| false);
    DeepCache::new(&Eye::new(scene, sensor), sensor.film.crop, watch).expect("not cancelled")
}

/// π ρ/(1 − ρ), also where eight of ten photons go on: the mean over independent seeds, whose spread
/// has the errors in it that all records of a cache share. Confidence 0.9999, and half a per cent for
/// batches that end when the noise seems small enough.
#[test]
fn furnaces_have_all_their_bounces() {
    for albedo in [0.5, 0.8] {
        let expected = std::f64::consts::PI * f64::from(albedo) / f64::from(1.0 - albedo);
        let mut means = Moments::default();
        let mut scene = furnace(albedo, deep());
        for seed in 0..12 {
            scene.tables.sensors[0].sampler.seed = seed;
            means.add(mean(&build(&scene)));
        }
        let quantile = student_quantile_two_sided(1e-4, 11.0).abs();
        let tolerance = quantile * means.standard_error() + 0.005 * expected;
        assert!((means.mean - expected).abs() < tolerance, "{means:?}, expected {expected}");
        assert!(tolerance < 0.02 * expected, "the test could tell nothing: {means:?}");
    }
}

/// A record takes fewer rays than with walks to the end, those of the deep cache aside, which are
/// there once for all.
#[test]
fn walks_end_at_the_deep_cache() {
    let rays = |bounces| {
        let scene =
            furnace(0.8, IrrCacheSettings { bounces, noise: Some(1e9), ..Default::default() });
        let IrradianceCache { records, statistics, .. } = build(&scene);
        let shared = if bounces == Bounces::Cache { deep_cache(&scene).cost().1 } else { 0 };
        (statistics.rays - shared) as f64 / records.len() as f64
    };
    let (deep, path) = (rays(Bounces::Cache), rays(Bounces::Path));
    assert!(deep < 0.7 * path, "{deep} rays per record, {path} with walks to the end");
}

/// π (ρ + ρ² + …) with as many terms as `max_depth` allows.
#[test]
fn no_bounce_is_added_or_lost() {
    for (max_depth, expected) in [(2, 0.0), (3, 0.5), (4, 0.75), (5, 0.875)] {
        let mut scene = furnace(0.5, deep());
        scene.tables.integrator.max_depth = Some(max_depth);
        let found = mean(&build(&scene));
        let expected = std::f64::consts::PI * expected;
        assert!((found - expected).abs() <= 0.01 * expected, "depth {max_depth}: {found}");
    }
}

/// Deep records serve rays that are longer than they reach, at the depth whose bounces they hold.
#[test]
fn near_ends_and_other_depths_are_not_served() {
    let mut scene = furnace(0.5, deep());
    // What is found in a hundred directions.
    let found = |scene: &Scene, depth, length: Option<f32>| {
        let cache = deep_cache(scene);
        let ends = (0..100).filter_map(|i| {
            let u = Vec2::new(i as f32 * 0.01, (i * 37 % 100) as f32 * 0.01);
            let ray = Ray::new(Vec3::new(0.1, 0.05, -0.3), warp::uniform_sphere(u));
            let mut si = scene.intersect(&ray).expect("the room is closed");
            si.t = length.unwrap_or(si.t);
            cache.irradiance(scene, &si, depth, &mut 0)
        });
        ends.map(|e| e.r).collect::<Vec<f32>>()
    };
    for depth in [1, 2] {
        let served = found(&scene, depth, None);
        let mean = served.iter().sum::<f32>() / served.len() as f32;
        assert!(served.len() > 60, "{} of 100 rays", served.len());
        assert!((mean - PI).abs() < 0.05 * PI, "{mean}");
        assert_eq!(found(&scene, depth, Some(1e-4)), []);
    }
    scene.tables.integrator.max_depth = Some(5);
    assert!(found(&scene, 1, None).len() > 60);
    assert_eq!(found(&scene, 2, None), []);
}

/// Neither threads nor the index of records change a bit.
#[test]
fn deep_caches_are_deterministic() {
    let records = |threads, index| {
        let mut t = mixed_room(24);
        let settings = IrrCacheSettings { index, gather_samples: Some(256), ..deep() };
        t.tables.integrator = cached(settings);
        let scene = t.build();
        in_pool(threads, || {
            let IrradianceCache { records, statistics, .. } = build(&scene);
            (records, statistics)
        })
    };
    let one = records(1, None);
    assert!(one.0.len() > 50, "{} records", one.0.len());
    for (threads, index) in [
        (2, None),
        (7, Some(IndexKind::Octree)),
        (3, Some(IndexKind::Bvh)),
        (3, Some(IndexKind::Vector)),
    ] {
        assert!(records(threads, index) == one, "{threads} threads, {index:?}");
    }
}

/// Where nothing is diffuse, or there is nothing at all, there is nothing to keep.
#[test]
fn empty_scenes_need_no_deep_cache() {
    for has_room in [false, true] {
        let mut t = TestScene::default();
        if has_room {
            let mirror = t.mirror();
            t.room(mirror);
        }
        t.camera(DVec3::ZERO, DVec3::Z, 60.0, 8);
        t.tables.integrator = cached(deep());
        assert!(build(&t.build()).records.is_empty());
    }
}
