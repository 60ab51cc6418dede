//! Every criterion, index and kind of bounce against what is known.

use super::*;
use crate::irradiance::{Index, IndexKind};
use crate::math::{Bounds3, Ray};
use rayon::prelude::*;

/// Points that the camera sees, as look-ups.
fn queries(scene: &Scene, pixels: u32) -> Vec<Query> {
    let camera = Camera::new(&scene.tables.sensors[0]);
    let at = |i: u32| Vec2::new((i % pixels) as f32 + 0.41, (i / pixels) as f32 + 0.73);
    let seen = (0..pixels * pixels).filter_map(|i| {
        let si = scene.intersect(&camera.ray(at(i), Vec2::splat(0.5)))?;
        let n = lit_normal(&si);
        Some(Query { p: si.p, n_smooth: n, n_shading: n })
    });
    seen.collect()
}

/// In a furnace interpolation finds π ρ/(1 - ρ) = π whatever the criterion, the index and the
/// bounces are: the mean over a picture within five standard errors of the records' mean and a per
/// cent that they share by the hash, and what is not extrapolated lies between the records.
#[test]
fn furnaces_are_even_for_every_criterion_index_and_bounce() {
    for criterion in Criterion::ALL {
        for bounces in Bounces::ALL {
            let what = format!("{criterion:?} {bounces:?}");
            // Not the leaf octree of `thesis`, which forgets records.
            let index = Some(IndexKind::Cells);
            let settings = IrrCacheSettings { criterion, bounces, index, ..Default::default() };
            let scene = furnace(0.5, settings);
            let cache = build(&scene);
            let records = &cache.records;
            let reach = cache.lookup.reach();
            let bounds = scene.accel.bounds();
            let bounds = Bounds3 { min: bounds.min * 1.01, max: bounds.max * 1.01 };
            let mut grown = [Index::all(), Index::octree(bounds, reach)];
            for index in &mut grown {
                for (i, record) in records.iter().enumerate() {
                    index.insert(i as u32, record);
                }
            }
            let [all, octree] = grown;
            let bvh = Index::Bvh(crate::irradiance::Bvh::new(records, reach));
            let (mut sum, mut count) = (0.0, 0.0);
            let values = records.iter().map(|r| r.irradiance.r);
            let (least, most) = values.fold((f32::MAX, f32::MIN), |(a, b), e| (a.min(e), b.max(e)));
            for query in queries(&scene, 24) {
                let found = cache.lookup(&query);
                for index in [&all, &octree, &bvh] {
                    assert_eq!(found, lookup(records, index, &query, &cache.lookup), "{what}");
                }
                let Some(found) = found else { continue };
                let e = found.irradiance.r;
                if !criterion.uses_gradients() {
                    assert!(e > least * 0.999_99 && e < most * 1.000_01, "{what}: {e}");
                }
                sum += e;
                count += 1.0;
            }
            assert!(count > 0.9 * 576.0, "{what}: {count} points served");
            let n = records.len() as f32;
            let own = records.iter().map(|r| r.irradiance.r).sum::<f32>() / n;
            let variance =
                records.iter().map(|r| (r.irradiance.r - own).powi(2)).sum::<f32>() / (n - 1.0);
            let tolerance = 5.0 * (variance / n).sqrt() + 0.01 * PI;
            let mean = sum / count;
            assert!((mean - PI).abs() < tolerance, "{what}: {mean}, tolerance {tolerance}");
            assert!(tolerance < 0.08 * PI, "{what}: the test could tell nothing");
        }
    }
}

/// Towards a finer error and more rays, look-ups approach what thousands of walks say at the same
/// points, of which the walks' own variance is subtracted, and records become more.
#[test]
fn finer_caches_converge_to_paths() {
    let scene = |error: f32, gather_samples: u32, min_pixel_spacing: f32| {
        let mut t = mixed_room(48);
        t.tables.integrator = cached(IrrCacheSettings {
            error,
            gather_samples: Some(gather_samples),
            min_pixel_spacing: Some(min_pixel_spacing),
            bounces: Bounces::Path,
            // The number of rays is what was asked for.
            noise: Some(1e9),
            ..Default::default()
        });
        t.build()
    };
    let steps = [(0.4, 64, 3.0), (0.1, 256, 1.5), (0.025, 1024, 0.75)];
    let scenes = steps.map(|(error, samples, spacing)| scene(error, samples, spacing));
    let caches = scenes.each_ref().map(build);
    let reference = &scenes[0];
    let camera = Camera::new(&reference.tables.sensors[0]);
    let settings = ProbeSettings { batches: 4, grid: 32, seed: 77 };
    let streams = SamplerSettings { kind: SamplerKind::Sobol, sample_count: 1, seed: 0 };
    let points: Vec<(Ray, Probe)> = (0..12 * 12)
        .into_par_iter()
        .filter_map(|i| {
            let film = Vec2::new((i % 12) as f32, (i / 12) as f32) * 4.0 + 2.0;
            let ray = camera.ray(film, Vec2::splat(0.5));
            let mut chain = Sampler::new(&streams, (0, 0), 0);
            let probe = caches[0].probe(reference, &ray, &mut chain, &settings, i, &mut 0)?;
            Some((ray, probe))
        })
        .collect();
    let errors = [0, 1, 2].map(|i| {
        let (mut squares, mut level, mut served) = (0.0, 0.0, 0);
        for (ray, probe) in &points {
            let mut chain = Sampler::new(&streams, (0, 0), 0);
            let query = prepass::first_diffuse(reference, *ray, &mut chain).map(|seen| {
                let n = lit_normal(&seen.si);
                Query { p: seen.si.p, n_smooth: n, n_shading: n }
            });
            let Some(found) = caches[i].lookup(&query.expect("as before")) else { continue };
            let difference = f64::from((found.irradiance - probe.expected).luminance());
            squares += difference * difference - probe.variance;
            level += f64::from(probe.expected.luminance());
            served += 1;
        }
        assert!(served * 10 > points.len() * 9, "{served} of {} served", points.len());
        let n = f64::from(served as u32);
        (squares / n).max(0.0).sqrt() / (level / n)
    });
    let counts = caches.each_ref().map(|cache| cache.records.len());
    assert!(counts[0] < counts[1] && counts[1] < counts[2], "records {counts:?}");
    assert!(errors[1] < 0.8 * errors[0] && errors[2] < 0.8 * errors[1], "RMSE {errors:?}");
}
