//! Every parameter does what it says.

use super::*;
use crate::integrator::{IntegratorKind, IntegratorSettings};
use crate::irradiance::{Criterion, IndexKind, clamped_by_neighbour};
use crate::math::Vec3;
use crate::render::{RenderSettings, render};
use crate::scene::Scene;
use crate::scene::test_scene::mixed_room;

/// Few rays, so that tests are quick.
fn coarse() -> IrrCacheSettings {
    IrrCacheSettings {
        error: 0.1,
        noise: Some(1.0),
        gather_samples: Some(64),
        leak_protection: Some(false),
        bounces: Bounces::Path,
        ..Default::default()
    }
}

fn room(cache: IrrCacheSettings) -> Scene {
    let mut t = mixed_room(24);
    t.tables.integrator = IntegratorSettings {
        kind: IntegratorKind::IrradianceCache,
        max_depth: Some(4),
        cache,
        ..Default::default()
    };
    t.build()
}

fn build(scene: &Scene) -> IrradianceCache {
    IrradianceCache::build(scene, &scene.tables.sensors[0], &|| false).expect("not cancelled")
}

fn cache(settings: IrrCacheSettings) -> IrradianceCache {
    build(&room(settings))
}

fn state(settings: IrrCacheSettings) -> Vec<u8> {
    let spp = RenderSettings { spp: Some(2), ..Default::default() };
    let output = render(&room(settings), 0, &spp, None, &Silent).expect("a sound scene");
    output.state.film.tiles.iter().flat_map(|t| &t.pixels).for_each(|p| assert!(p.count == 2));
    let picture = output.picture;
    format!("{picture:?}").into_bytes()
}

/// Points between records, on their surfaces.
fn queries(records: &[Record]) -> Vec<Query> {
    let between = |r: &Record| {
        let across = r.normal.cross(r.axis);
        let p = r.position + 0.6 * r.radii[0] * (r.axis + 0.5 * across);
        Query { p, n_smooth: r.normal, n_shading: r.normal }
    };
    records.iter().map(between).collect()
}

#[test]
fn radii_in_scene_units_override_pixels() {
    let usual = cache(coarse());
    let settings = IrrCacheSettings {
        min_radius: 0.12,
        max_radius: 0.2,
        crevice_spread: Some(0.0),
        ..coarse()
    };
    let bounded = cache(settings);
    assert!(bounded.records.iter().all(|r| r.radii[0] >= 0.12 && r.radii[0] <= 0.2));
    let outside = |r: &Record| r.radii[0] < 0.12 || r.radii[0] > 0.2;
    assert!(usual.records.iter().any(outside), "the test could tell nothing");
    // Radiance's way: the room is 2 wide.
    let radiance = IrrCacheSettings { ambient_resolution: 4.0, accuracy: Some(0.3), ..coarse() };
    let radiance = IrrCacheSettings { crevice_spread: Some(0.0), ..radiance };
    let least = cache(radiance).records.iter().map(|r| r.radii[0]).fold(f32::INFINITY, f32::min);
    assert!((least - 0.15).abs() < 0.01, "{least}");
    // A fifth of the scene is a bound in pixels' place only.
    let huge = IrrCacheSettings { error: 1e6, min_radius: 0.9, max_radius: 1.0, ..settings };
    assert!(cache(huge).records.iter().all(|r| r.radii[0] >= 0.9));
}

#[test]
fn a_smaller_angle_makes_more_records_on_what_is_round() {
    for criterion in [Criterion::Hessian, Criterion::Tabellion04, Criterion::Ward92] {
        let coarse = IrrCacheSettings { criterion, accuracy: Some(1.5), ..coarse() };
        let with = |max_angle| cache(IrrCacheSettings { max_angle, ..coarse }).records;
        let (wide, narrow) = (with(Some(60.0)), with(Some(3.0)));
        let on_sphere = |records: &[Record]| {
            let centre = Vec3::new(0.45, -0.6, 0.2);
            records.iter().filter(|r| (r.position - centre).length() < 0.41).count()
        };
        let (few, many) = (on_sphere(&wide), on_sphere(&narrow));
        assert!(many > few, "{criterion:?}: {few}, then {many}");
        assert!(narrow.iter().all(|r| (r.max_angle.to_degrees() - 3.0).abs() < 1e-4));
    }
}

/// Two caches of other random numbers differ less, and hold as much light.
#[test]
fn smoothing_leaves_less_noise_and_all_light() {
    let both = |smoothing| {
        [1, 2].map(|seed| {
            let settings = IrrCacheSettings { error: 0.05, smoothing: Some(smoothing), ..coarse() };
            let mut t = mixed_room(96);
            t.tables.integrator = cached(settings);
            let mut scene = t.build();
            scene.tables.sensors[0].sampler.seed = seed;
            build(&scene)
        })
    };
    let measure = |[a, b]: &[IrradianceCache; 2]| {
        let (mut sum, mut differences) = (0.0, Vec::new());
        for query in queries(&a.records) {
            if let (Some(a), Some(b)) = (a.lookup(&query), b.lookup(&query)) {
                let [a, b] = [a, b].map(|found| found.irradiance.luminance());
                sum += 0.5 * (a + b);
                differences.push((a - b).abs() / (a + b));
            }
        }
        differences.sort_by(f32::total_cmp);
        [sum / differences.len() as f32, differences[differences.len() / 2]]
    };
    let (rough, smooth) = (both(0.0), both(3.0));
    assert_eq!(rough[0].records.len(), smooth[0].records.len());
    let ([mean, noise], [smooth_mean, smooth_noise]) = (measure(&rough), measure(&smooth));
    assert!(noise > 0.02, "the test could tell nothing: {noise}");
    assert!(smooth_noise < 0.8 * noise, "{noise}, then {smooth_noise}");
    assert!((smooth_mean - mean).abs() < 0.01 * mean, "{mean}, then {smooth_mean}");
}

#[test]
fn gradients_are_made_and_used_where_wanted() {
    let with = |criterion, gradients| {
        cache(IrrCacheSettings { criterion, gradients: Some(gradients), ..coarse() })
    };
    let sum = |c: &IrradianceCache| {
        c.records.iter().map(|r| r.translational[1].length()).fold(0.0, f32::max)
    };
    assert_eq!(sum(&with(Criterion::Ward92, false)), 0.0);
    assert!(sum(&with(Criterion::Ward88, true)) > 0.0);
    // Of the same records, means without them are no larger than the largest record.
    let cache = cache(coarse());
    let contents = || CacheContents::from_bytes(&cache.to_bytes()).expect("what was written");
    let none = IrrCacheSettings { gradients: Some(false), ..coarse() };
    let plain = contents().freeze(&none, Bounds3::EMPTY);
    let largest = cache.records.iter().map(|r| r.irradiance.g).fold(0.0, f32::max);
    let mut differ = 0;
    for query in queries(&cache.records) {
        let (a, b) = (cache.lookup(&query), plain.lookup(&query));
        differ += usize::from(a != b);
        assert!(b.is_none_or(|b| b.irradiance.g <= largest));
    }
    assert!(differ > cache.records.len() / 2);
}

/// No record reaches farther than any neighbour lets it, but for bounds; every pixel is served in
/// the end; and nothing depends on threads.
#[test]
fn neighbours_clamp_each_other() {
    for criterion in [Criterion::Krivanek06, Criterion::Hessian, Criterion::Tabellion04] {
        let settings = IrrCacheSettings { criterion, clamp_neighbor: Some(true), ..coarse() };
        let scene = room(settings);
        let cache = build(&scene);
        let slope = settings.radius().neighbour_slope();
        let mut limited = 0;
        for r in &cache.records {
            let least = cache.records.iter().fold(f32::INFINITY, |least, s| {
                let distance = r.position.distance(s.position);
                clamped_by_neighbour(least, s.natural_radius, distance, slope)
            });
            let is_limited = r.flags & Record::NEIGHBOUR_LIMITED != 0;
            limited += usize::from(is_limited);
            assert_eq!(is_limited, least < r.natural_radius, "{criterion:?}");
            let is_raised = r.flags & Record::RAISED != 0;
            assert!(is_raised || r.radii[0] <= least);
        }
        assert!(limited > 0, "{criterion:?}");
        let contents = CacheContents::from_bytes(&cache.to_bytes()).expect("what was written");
        let watch = CacheWatch::silent(&|| false);
        let again = IrradianceCache::update(&scene, &scene.tables.sensors[0], contents, watch);
        assert_eq!(again.expect("not cancelled").records, cache.records, "{criterion:?}");
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().expect("a pool");
        assert_eq!(pool.install(|| build(&scene)).records, cache.records);
    }
    let defaults = Criterion::ALL.map(|c| IrrCacheSettings { criterion: c, ..coarse() });
    let clamped: Vec<bool> = defaults.iter().map(IrrCacheSettings::clamp_neighbor).collect();
    assert_eq!(clamped, [false, false, false, false, true, false]);
}

/// In one pass a pixel sees what was made before it, itself included, and nothing else.
#[test]
fn without_an_overture_pixels_see_the_past() {
    for index in [IndexKind::Leaves, IndexKind::Cells] {
        let settings = IrrCacheSettings {
            criterion: Criterion::Thesis,
            index: Some(index),
            accuracy: Some(0.05),
            ..coarse()
        };
        let scene = room(settings);
        let cache = build(&scene);
        assert!(cache.records.is_sorted_by(|a, b| a.key < b.key));
        assert!(cache.records.len() > 40, "{}", cache.records.len());
        // Who looked for the record's place before it was made found nothing; who looked after, did.
        for (count, r) in cache.records.iter().enumerate() {
            let pixel = (r.key as u32, (r.key >> 32) as u32);
            let (then, query) = (cache.seen_by(pixel), own_place(r));
            assert_eq!(then.records.len(), count + 1);
            assert!(then.lookup(&query).is_some());
            let before = CacheView { records: &cache.records[..count], ..then };
            assert_eq!(before.lookup(&query), None, "record {count} was not needed");
        }
    }
    let overture = IrrCacheSettings { overture: Some(true), ..coarse() };
    let museum = IrrCacheSettings { overture: Some(false), ..coarse() };
    assert_ne!(state(overture), state(museum));
    assert_eq!(state(museum), state(museum));
}

fn own_place(r: &Record) -> Query {
    Query { p: r.position, n_smooth: r.normal, n_shading: r.normal }
}

/// Whatever lists all records gives the same picture, to the bit.
#[test]
fn exact_indices_give_the_same_picture() {
    let with = |criterion, index| {
        state(IrrCacheSettings { criterion, index: Some(index), overture: Some(true), ..coarse() })
    };
    for criterion in [Criterion::Hessian, Criterion::Ward92] {
        let reference = with(criterion, IndexKind::Vector);
        for index in [IndexKind::Octree, IndexKind::Cells, IndexKind::Bvh] {
            assert!(with(criterion, index) == reference, "{criterion:?} {index:?}");
        }
        assert!(with(criterion, IndexKind::Leaves) != reference, "{criterion:?}");
    }
}

#[test]
fn look_ups_follow_their_parameters() {
    let usual = cache(coarse());
    let count = |settings| cache(settings).records.len();
    let n = usual.records.len();
    let contents = || CacheContents::from_bytes(&usual.to_bytes()).expect("what was written");
    let frozen = |settings: IrrCacheSettings| contents().freeze(&settings, Bounds3::EMPTY);
    let queries = queries(&usual.records);
    let found = |c: &IrradianceCache| -> Vec<Interpolated> {
        queries.iter().filter_map(|q| c.lookup(q)).collect()
    };
    let nearest = found(&frozen(IrrCacheSettings { nearest: Some(2), ..coarse() }));
    assert!(nearest.iter().all(|f| f.records <= 2));
    assert!(found(&usual).iter().any(|f| f.records > 2), "the test could tell nothing");
    let own = found(&frozen(IrrCacheSettings { mix: Some(0.0), ..coarse() }));
    assert!(own != found(&usual));
    let wide = IrrCacheSettings { overlap: Some(2.5), ..coarse() };
    assert!(
        count(wide) < n
            && found(&frozen(wide)).iter().map(|f| f.records).sum::<u32>()
                > found(&usual).iter().map(|f| f.records).sum()
    );
    let dense = count(IrrCacheSettings { min_weight: Some(1.5), ..coarse() });
    let sparse = count(IrrCacheSettings { min_weight: Some(0.0), ..coarse() });
    assert!(sparse < n && n < dense, "{sparse}, {n}, {dense}");
    // Without any tolerance, rounding puts half of a plane's records in front of its points.
    let ward = IrrCacheSettings { criterion: Criterion::Ward88, ..coarse() };
    assert!(count(IrrCacheSettings { in_front: Some(0.0), ..ward }) > count(ward));
}

#[test]
fn radii_follow_their_parameters() {
    let finer = cache(IrrCacheSettings { error: 0.05, ..coarse() }).records;
    assert_eq!(cache(IrrCacheSettings { quality: 2.0, ..coarse() }).records, finer);
    let ward = IrrCacheSettings { criterion: Criterion::Ward92, accuracy: Some(0.2), ..coarse() };
    let twice = IrrCacheSettings { accuracy: Some(0.4), quality: 2.0, ..ward };
    assert_eq!(cache(twice).records, cache(ward).records);
    let round = |records: &[Record]| {
        let unlimited = records.iter().filter(|r| r.flags & Record::GRADIENT_LIMITED == 0);
        unlimited.into_iter().all(|r| r.radii[0] == r.radii[1])
    };

    let small = IrrCacheSettings { min_pixel_spacing: Some(0.3), ..coarse() };
    assert!(round(&cache(small).records));
    assert!(!round(&cache(IrrCacheSettings { ellipse: true, ..small }).records));
    // The radius of the first record, which is the same point: ℓ (2ε/κ)^η.
    let alone = IrrCacheSettings { smoothing: Some(0.0), ..coarse() };
    let [usual, square] =
        [0.25, 0.5].map(|exponent| cache(IrrCacheSettings { exponent, ..alone }).records);
    assert_eq!(square[0].irradiance, usual[0].irradiance);
    assert_ne!(square[0].natural_radius, usual[0].natural_radius);
    let crevices = |records: &[Record]| records.iter().any(|r| r.flags & Record::CREVICE != 0);
    // Larger pixels: least radii above what crevices allow.
    let big = IrrCacheSettings { min_pixel_spacing: Some(12.0), ..coarse() };
    assert!(crevices(&cache(big).records));
    assert!(!crevices(&cache(IrrCacheSettings { crevice_spread: Some(0.0), ..big }).records));
}

/// What the oldest criterion brings with it, unless something else is said.
#[test]
fn the_museum_is_complete() {
    let value = |settings: &IrrCacheSettings, name: &str| {
        CacheParameter::find(name).expect(name).get(settings)
    };
    let thesis = IrrCacheSettings { criterion: Criterion::Thesis, ..Default::default() };
    for (name, expected) in [
        ("index", "leaves"),
        ("overture", "false"),
        ("nearest", "4"),
        ("in_front", "0"),
        ("gradients", "false"),
        ("clamp_neighbor", "false"),
        ("leak_protection", "false"),
        ("overlap", "1"),
    ] {
        assert_eq!(value(&thesis, name), expected, "{name}");
    }
    let mut changed = thesis;
    CacheParameter::find("index").expect("index").set(&mut changed, "cells").expect("a value");
    assert_eq!(
        (value(&changed, "index"), value(&changed, "overture")),
        ("cells".into(), "false".into())
    );
    let tabellion = IrrCacheSettings { criterion: Criterion::Tabellion04, ..Default::default() };
    assert_eq!(
        (value(&tabellion, "accuracy"), value(&tabellion, "max_angle")),
        ("1".into(), "10".into())
    );
}
