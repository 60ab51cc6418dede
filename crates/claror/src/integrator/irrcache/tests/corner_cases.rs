//! Scenes at the edge of sense: every pixel is a number, and every render ends.

use super::*;
use crate::integrator::path::record_walk;
use crate::math::{Ray, Vec3, warp};
use crate::shape::{Mesh, MeshId};

/// Renders and looks at everything that was made.
fn check(what: &str, mut t: TestScene) -> IrradianceCache {
    t.tables.integrator = cached(IrrCacheSettings::default());
    let scene = t.build();
    let settings = RenderSettings { spp: Some(16), ..Default::default() };
    let output = render(&scene, 0, &settings, None, &Silent).expect("a sound scene");
    assert_eq!(output.non_finite.count, 0, "{what}: {:?}", output.non_finite.first);
    for layer in std::iter::once(&output.picture.beauty).chain(&output.picture.parts) {
        let is_sound = layer.image.data.iter().all(|x| x.is_finite() && *x >= 0.0);
        assert!(is_sound, "{what}: layer {:?}", layer.name);
    }
    let cache = output.cache.expect("a cache");
    let statistics = cache.statistics;
    assert_eq!(statistics.records, cache.records.len(), "{what}");
    assert_eq!(statistics.levels.iter().sum::<usize>(), cache.records.len(), "{what}");
    assert!(cache.records.iter().all(Record::is_valid), "{what}");
    let pixels = scene.tables.sensors[0].film.width.pow(2) as usize;
    let places = statistics.records + statistics.discarded + statistics.invalid;
    assert!(places <= pixels, "{what}: {places} places in {pixels} pixels");
    assert!(statistics.invalid == 0, "{what}: {} invalid records", statistics.invalid);
    assert!(output.lookups.uncached <= output.lookups.lookups, "{what}");
    cache
}

/// A grey room with a camera in its middle.
fn grey_room() -> TestScene {
    let mut t = TestScene::default();
    let grey = t.diffuse(Rgb::splat(0.5));
    t.room(grey);
    t.camera(DVec3::new(0.1, 0.0, -0.9), DVec3::new(0.0, -0.1, 1.0), 90.0, 24);
    t
}

fn add_lamp(t: &mut TestScene, radiance: f32) {
    let black = t.diffuse(Rgb::BLACK);
    let lamp = place(DVec3::new(0.0, 0.9, 0.0), -DVec3::Y, DVec3::splat(0.3));
    let lamp = t.shape(ShapeKind::Rectangle(lamp), black);
    t.emit(lamp, Rgb::splat(radiance));
}

#[test]
fn cameras_on_edges_and_in_corners() {
    for (what, from) in [
        ("edge", DVec3::new(1.0, 0.0, -1.0)),
        ("corner", DVec3::new(1.0, -1.0, -1.0)),
        ("wall", DVec3::new(0.0, 0.0, -1.0)),
        ("corner of walls seen at pixel corners", DVec3::new(0.0, 0.0, -0.5)),
    ] {
        let mut t = grey_room();
        add_lamp(&mut t, 5.0);
        t.tables.sensors.clear();
        t.camera(from, DVec3::ZERO + DVec3::Z * 1e-9, 90.0, 24);
        check(what, t);
    }
}

#[test]
fn surfaces_in_one_place() {
    let mut t = grey_room();
    add_lamp(&mut t, 5.0);
    let dark = t.diffuse(Rgb::splat(0.1));
    for height in [-1.0, -1.0, -1.0 + 1e-7] {
        let sheet = place(DVec3::new(0.0, height, 0.0), DVec3::Y, DVec3::ONE);
        t.shape(ShapeKind::Rectangle(sheet), dark);
    }
    check("sheets on the floor", t);
}

/// Without light there is nothing to compute and nothing to refine.
#[test]
fn rooms_without_light() {
    let cache = check("dark", grey_room());
    assert!(cache.records.iter().all(|r| r.irradiance.is_black()));
    // As large as they may be, they are a fifth of the room wide.
    assert!(cache.records.len() < 150, "{} records of nothing", cache.records.len());
    let mut t = TestScene::default();
    let black = t.diffuse(Rgb::BLACK);
    t.room(black);
    add_lamp(&mut t, 5.0);
    t.camera(DVec3::new(0.1, 0.0, -0.9), DVec3::new(0.0, -0.1, 1.0), 90.0, 24);
    assert!(check("black walls", t).records.is_empty());
}

#[test]
fn scenes_without_diffuse_surfaces() {
    let mut t = TestScene::default();
    let mirror = t.mirror();
    t.room(mirror);
    add_lamp(&mut t, 5.0);
    t.camera(DVec3::new(0.1, 0.0, -0.9), DVec3::new(0.0, -0.1, 1.0), 90.0, 24);
    let cache = check("mirrors", t);
    assert!(cache.records.is_empty());
    // Nor are there many walks to fill a hash that stays empty.
    assert!(cache.statistics.walks < 100_000, "{:?}", cache.statistics);
}

#[test]
fn nothing_but_sky() {
    let mut t = TestScene::default();
    t.tables.emitters.emitters.push(Emitter::Constant { radiance: Rgb::splat(3.0) });
    t.camera(DVec3::ZERO, DVec3::Z, 90.0, 24);
    assert!(check("sky", t).records.is_empty());
    let mut t = TestScene::default();
    let grey = t.diffuse(Rgb::splat(0.5));
    t.shape(ShapeKind::Rectangle(place(-DVec3::Y, DVec3::Y, DVec3::splat(1e4))), grey);
    t.tables.emitters.emitters.push(Emitter::Constant { radiance: Rgb::splat(3.0) });
    t.camera(DVec3::ZERO, DVec3::Z, 90.0, 24);
    // The sky over a plane: π L exactly, everywhere.
    for record in check("a plane under the sky", t).records {
        let ratio = record.irradiance.r / (3.0 * PI);
        assert!((ratio - 1.0).abs() < 1e-3, "{ratio}");
    }
}

/// Triangles without area that shine, beside a lamp that has one.
#[test]
fn lights_without_area() {
    for is_alone in [false, true] {
        let mut t = grey_room();
        if !is_alone {
            add_lamp(&mut t, 5.0);
        }
        let point = |x: f32| Vec3::new(x, 0.5, 0.0);
        let mesh = Mesh {
            positions: vec![point(0.0), point(0.1), point(0.2), point(0.0)],
            triangles: vec![[0, 1, 2], [0, 0, 0], [0, 3, 1]],
            ..Default::default()
        };
        t.tables.shapes.meshes.push(mesh);
        let id = MeshId(t.tables.shapes.meshes.len() as u32 - 1);
        let black = t.diffuse(Rgb::BLACK);
        let lamp = t.shape(ShapeKind::Mesh(id), black);
        t.emit(lamp, Rgb::splat(1e3));
        let cache = check("no area", t);
        assert!(is_alone == cache.records.iter().all(|r| r.irradiance.is_black()));
    }
}

/// Far from 1 in both directions, as far as squares of the light are numbers, the same records as with 1 up to rounding of the light.
#[test]
fn lights_of_extreme_brightness() {
    let mut counts = Vec::new();
    for radiance in [5e-17, 5.0, 5e17] {
        let mut t = grey_room();
        add_lamp(&mut t, radiance);
        counts.push(check(&format!("radiance {radiance:e}"), t).records.len());
    }
    let (least, most) = (counts.iter().min(), counts.iter().max());
    assert!(most.zip(least).is_some_and(|(a, b)| a * 50 <= b * 51), "{counts:?}");
}

/// White walls and a small lamp, which is black: three of a hundred paths end there with each bounce.
/// If roulette ended more of them, the few that live would weigh the more the longer they do, and one
/// of them would decide about a record and all pixels around it.
#[test]
fn no_walk_between_white_walls_weighs_more_than_it_is_long() {
    let mut t = TestScene::default();
    let white = t.diffuse(Rgb::WHITE);
    t.room(white);
    add_lamp(&mut t, 5.0);
    t.camera(DVec3::new(0.1, 0.0, -0.9), DVec3::new(0.0, -0.1, 1.0), 90.0, 24);
    t.tables.integrator = cached(IrrCacheSettings::default());
    let scene = t.build();
    let streams = SamplerSettings { kind: SamplerKind::Independent, sample_count: 20_000, seed: 5 };
    let walks = (0..20_000).map(|i| {
        let mut sampler = Sampler::new(&streams, (0, 0), i);
        let ray = Ray::new(Vec3::ZERO, warp::uniform_sphere(sampler.next_2d()));
        let mut rays = 0;
        let settings = &scene.tables.integrator;
        let (found, _) = record_walk(&scene, settings, &ray, &mut sampler, &mut rays);
        (found.r, rays)
    });
    let walks: Vec<(f32, u64)> = walks.collect();
    let mean = walks.iter().map(|walk| walk.0).sum::<f32>() / walks.len() as f32;
    let longest = walks.iter().map(|walk| walk.1).max().expect("walks");
    assert!(longest > 200, "the test could tell nothing: {longest} rays at most");
    let most = walks.iter().map(|walk| walk.0).fold(0.0, f32::max);
    assert!(most < 60.0 * mean, "{most}, where the mean is {mean}");
}
