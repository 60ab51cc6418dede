mod bounces;
mod corner_cases;
mod criteria;
mod invariances;
mod knobs;
mod leaks;
mod seams;
mod shadows;

use super::*;
use crate::bsdf::{Bsdf, MicrofacetKind, PerturbationOptions};
use crate::emitter::{Emitter, Sky};
use crate::integrator::{IntegratorKind, IntegratorSettings, LayeredRadiance, radiance};
use crate::irradiance::Criterion;
use crate::math::{DVec3, Vec2};
use crate::render::{Observer, Progress, RenderSettings, RenderState, render};
use crate::sampler::{Sampler, SamplerKind, SamplerSettings};
use crate::scene::Scene;
use crate::scene::test_scene::{TestScene, mixed_room, place};
use crate::sensor::Camera;
use crate::shape::ShapeKind;
use crate::spectrum::Rgb;
use std::f32::consts::PI;
use std::time::Duration;

fn cached(cache: IrrCacheSettings) -> IntegratorSettings {
    IntegratorSettings { kind: IntegratorKind::IrradianceCache, cache, ..Default::default() }
}

fn build(scene: &Scene) -> IrradianceCache {
    let sensor = &scene.tables.sensors[0];
    IrradianceCache::build(scene, sensor, &|| false).expect("not cancelled")
}

/// A closed room that emits 1 and reflects `albedo`.
pub(in crate::integrator::irrcache) fn furnace(albedo: f32, settings: IrrCacheSettings) -> Scene {
    let mut t = TestScene::default();
    let bsdf = t.diffuse(Rgb::splat(albedo));
    let room = t.room(bsdf);
    t.emit(room, Rgb::WHITE);
    t.camera(DVec3::new(0.3, 0.2, -0.9), DVec3::new(0.0, -0.2, 1.0), 80.0, 24);
    t.tables.integrator = cached(settings);
    t.build()
}

/// Indirect irradiance in a furnace is π ρ/(1 − ρ): the emission at the ends of a record's rays is
/// direct light, and must not be in it. Walks are sums of many terms; five standard errors of the
/// mean of all records, from their own spread.
#[test]
fn furnace_fixes_what_a_record_holds() {
    for bounces in Bounces::ALL {
        // Independent of each other, but for the hash.
        let settings = IrrCacheSettings { bounces, smoothing: Some(0.0), ..Default::default() };
        let cache = build(&furnace(0.5, settings));
        let n = cache.records.len() as f32;
        assert!(n >= 8.0, "{n} records");
        let mean = cache.records.iter().map(|r| r.irradiance.r).sum::<f32>() / n;
        let variance =
            cache.records.iter().map(|r| (r.irradiance.r - mean).powi(2)).sum::<f32>() / (n - 1.0);
        // Records share the hash, whose own error does not average out: a percent for that.
        let shared = if bounces == Bounces::Hash { 0.01 * PI } else { 0.0 };
        let tolerance = 5.0 * (variance / n).sqrt() + shared;
        assert!((mean - PI).abs() < tolerance, "{bounces:?}: {mean}, tolerance {tolerance}");
        assert!(tolerance < 0.05 * PI, "{bounces:?}: the test could tell nothing");
    }
}

/// With `max_depth` 2 there is no indirect light, with 3 one bounce of it: π ρ.
#[test]
fn furnace_counts_bounces() {
    for (max_depth, expected) in [(3, 0.5 * PI), (4, 0.75 * PI)] {
        let mut scene = furnace(0.5, IrrCacheSettings::default());
        scene.tables.integrator.max_depth = Some(max_depth);
        let cache = build(&scene);
        let n = cache.records.len() as f32;
        let mean = cache.records.iter().map(|r| r.irradiance.r).sum::<f32>() / n;
        assert!((mean - expected).abs() < 0.01 * expected, "depth {max_depth}: {mean}");
    }
}

/// Mean indirect radiance over the film, and its standard error from independent samples.
fn film_mean(scene: &Scene, cache: Option<&IrradianceCache>, samples: u32) -> (f64, f64) {
    film_mean_of(scene, cache, samples, |found| found.indirect)
}

fn film_mean_of(
    scene: &Scene,
    cache: Option<&IrradianceCache>,
    samples: u32,
    part: fn(&LayeredRadiance) -> Rgb,
) -> (f64, f64) {
    let sensor = &scene.tables.sensors[0];
    let camera = Camera::new(sensor);
    let size = Vec2::new(sensor.film.width as f32, sensor.film.height as f32);
    let streams =
        SamplerSettings { kind: SamplerKind::Independent, sample_count: samples, seed: 11 };
    let (mut sum, mut squares, mut rays) = (0.0, 0.0, 0);
    for i in 0..samples {
        let mut sampler = Sampler::new(&streams, (0, 0), i);
        let ray = camera.ray(sampler.next_2d() * size, sampler.next_2d());
        let found = radiance(scene, &scene.tables.integrator, cache, &ray, &mut sampler, &mut rays);
        let value = f64::from(part(&found).luminance());
        sum += value;
        squares += value * value;
    }
    let n = f64::from(samples);
    let mean = sum / n;
    (mean, ((squares / n - mean * mean) / n).sqrt())
}

/// Indirect light in a room with a mirror, a lamp and two spheres has the mean that paths give:
/// within 4.5 standard errors and half a per cent of interpolation.
#[test]
fn pictures_have_the_mean_of_path_traced_ones() {
    let mut t = mixed_room(32);
    t.tables.integrator = cached(IrrCacheSettings::default());
    let mut scene = t.build();
    let (path, path_error) = film_mean(&scene, None, 400_000);
    for bounces in [Bounces::Hash, Bounces::Cache] {
        scene.tables.integrator.cache.bounces = bounces;
        let cache = build(&scene);
        let (mean, error) = film_mean(&scene, Some(&cache), 100_000);
        let tolerance = 4.5 * path_error.hypot(error) + 0.005 * path;
        assert!((mean - path).abs() < tolerance, "{mean} cached, {path} traced, {tolerance}");
        assert!(tolerance < 0.02 * path, "the test could tell nothing");
        assert!(error < path_error, "100 000 cached samples: {error}; 400 000 paths: {path_error}");
    }
}

/// A room with a window to a bright sky, a lamp that is not, a varnished floor and a mirror.
fn room_with_a_window() -> TestScene {
    let mut t = TestScene::default();
    let grey = t.diffuse(Rgb::new(0.6, 0.5, 0.4));
    let (base, white) = (t.color(Rgb::new(0.5, 0.4, 0.3)), t.color(Rgb::WHITE));
    let varnish = t.bsdf(Bsdf::RoughPlastic {
        distribution: MicrofacetKind::Ggx,
        sample_visible: true,
        alpha: 0.2,
        eta: 1.5,
        diffuse_reflectance: base,
        specular_reflectance: white,
        nonlinear: false,
    });
    let mirror = t.mirror();
    let mut wall = |center: DVec3, z: DVec3, scale: DVec3, bsdf| {
        t.shape(ShapeKind::Rectangle(place(center, z, scale)), bsdf)
    };
    for axis in [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::Z] {
        wall(axis, -axis, DVec3::ONE, grey);
    }
    wall(-DVec3::Y, DVec3::Y, DVec3::ONE, varnish);
    // The wall at x = -1 is nine squares without the middle one.
    for i in (0..9).filter(|&i| i != 4) {
        let at = |i: i32| f64::from(i - 1) * 2.0 / 3.0;
        wall(DVec3::new(-1.0, at(i % 3), at(i / 3)), DVec3::X, DVec3::splat(1.0 / 3.0), grey);
    }
    let lamp = wall(DVec3::new(0.3, 0.99, 0.3), -DVec3::Y, DVec3::splat(0.1), grey);
    t.emit(lamp, Rgb::splat(4.0));
    let ball = place(DVec3::new(0.4, -0.7, 0.4), DVec3::Z, DVec3::splat(0.3));
    t.shape(ShapeKind::Sphere(ball), mirror);
    t.tables.emitters.emitters.push(Emitter::Constant { radiance: Rgb::splat(3.0) });
    t.camera(DVec3::new(0.9, 0.3, -0.9), DVec3::new(-0.2, -0.3, 0.5), 90.0, 32);
    t
}

/// Whether the sky's light is in the cache or not, and with one bounce only as well, all light
/// together has the mean that paths give: within 4.5 standard errors and one per cent of
/// interpolation and of taking the varnish's base for Lambertian.
#[test]
fn a_cached_sky_gives_the_picture_of_paths() {
    for (sky, max_depth) in [(Sky::Auto, None), (Sky::Direct, None), (Sky::Auto, Some(2))] {
        let mut t = room_with_a_window();
        let settings = cached(IrrCacheSettings { sky, ..Default::default() });
        t.tables.integrator = IntegratorSettings { max_depth, ..settings };
        let scene = t.build();
        assert_eq!(scene.lights.has_cached_sky(), sky == Sky::Auto);
        let cache = build(&scene);
        let all = |found: &LayeredRadiance| {
            let [a, b, c, d] = found.layers();
            a + b + c + d
        };
        let (path, path_error) = film_mean_of(&scene, None, 1_000_000, all);
        let (mean, error) = film_mean_of(&scene, Some(&cache), 200_000, all);
        let tolerance = 4.5 * path_error.hypot(error) + 0.01 * path;
        let what = format!("{sky:?} {max_depth:?}: {mean} cached, {path} traced, {tolerance}");
        assert!((mean - path).abs() < tolerance, "{what}");
        assert!(tolerance < 0.06 * path, "the test could tell nothing: {what}");
    }
}

/// The closed form of unoccluded direct light is what light samples find on average: within 4.5
/// standard errors of the differences, which are independent.
#[test]
fn closed_forms_of_direct_light_are_the_mean_of_its_samples() {
    let mut t = mixed_room(32);
    t.tables.integrator = cached(IrrCacheSettings::default());
    let scene = t.build();
    assert!(scene.lights.has_closed_form());
    let cache = build(&scene);
    let camera = Camera::new(&scene.tables.sensors[0]);
    let count = 100_000;
    let streams = SamplerSettings { kind: SamplerKind::Independent, sample_count: count, seed: 3 };
    let (mut sum, mut squares, mut all, mut rays) = (0.0, 0.0, 0.0, 0);
    for i in 0..count {
        let mut sampler = Sampler::new(&streams, (0, 0), i);
        let ray = camera.ray(sampler.next_2d() * 32.0, sampler.next_2d());
        let settings = &scene.tables.integrator;
        let found = radiance(&scene, settings, Some(&cache), &ray, &mut sampler, &mut rays);
        let [exact, sampled] = [found.control.exact, found.control.sampled].map(Rgb::luminance);
        let difference = f64::from(exact - sampled);
        sum += difference;
        squares += difference * difference;
        all += f64::from(exact);
    }
    let n = f64::from(count);
    let tolerance = 4.5 * (squares / n / n).sqrt();
    assert!((sum / n).abs() < tolerance, "{} of {}", sum / n, all / n);
    assert!(tolerance < 0.01 * all / n, "the test could tell nothing");
}

/// Whatever the cache holds, with `debias` indirect light has the mean that paths give: within 4.5
/// standard errors (one test in 150 000 of a correct program), which without it the same cache
/// misses. A third of the film is a mirror, so corrections behind it count.
#[test]
fn debias_takes_the_bias_of_a_coarse_cache_away() {
    let coarse = |debias| {
        let mut t = mixed_room(32);
        let cache = IrrCacheSettings {
            criterion: Criterion::Ward88,
            accuracy: Some(5.0),
            error: 5.0,
            gather_samples: Some(16),
            noise: Some(1e3),
            min_pixel_spacing: Some(40.0),
            debias,
            ..Default::default()
        };
        t.tables.integrator = IntegratorSettings { max_depth: Some(5), ..cached(cache) };
        t.build()
    };
    let scene = coarse(0.25);
    let cache = build(&scene);
    let (path, path_error) = film_mean(&scene, None, 200_000);
    let (debiased, error) = film_mean(&scene, Some(&cache), 200_000);
    let biased = coarse(0.0);
    let (mean, mean_error) = film_mean(&biased, Some(&cache), 50_000);
    let sigma = (debiased - path).abs() / path_error.hypot(error);
    assert!(sigma < 4.5, "{debiased} debiased, {path} traced: {sigma} standard errors");
    let sigma = (mean - path).abs() / path_error.hypot(mean_error);
    assert!(sigma > 8.0, "{mean} biased, {path} traced: only {sigma} standard errors");
}

/// A floor whose normal map leans towards a lit wall, or away from it: the rotational gradient
/// gives the light that paths find, without it a fifth or more is missing or too much. First order
/// in the angle leaves out 1 - cos 20° = 6 %, and what the maps' shadowing takes.
#[test]
fn normal_maps_turn_what_the_cache_holds() {
    let scene = |lean: f32, cache| {
        let mut t = TestScene::default();
        let white = t.diffuse(Rgb::splat(0.8));
        let black = t.diffuse(Rgb::BLACK);
        let (x, z) = f32::to_radians(lean).sin_cos();
        let normal = t.color(Rgb::new(0.5 + 0.5 * x, 0.5, 0.5 + 0.5 * z));
        let options = PerturbationOptions::default();
        let bumped = t.bsdf(Bsdf::NormalMap { normal, nested: white, options });
        let floor = place(DVec3::ZERO, DVec3::Z, DVec3::splat(2.0));
        let (towards, bsdf) = (floor.to_world.transform_vector3(DVec3::X.as_vec3()), bumped);
        t.shape(ShapeKind::Rectangle(floor), bsdf);
        // The wall stands where local x points, its lamp shines on it alone.
        let away = towards.normalize().as_dvec3();
        let wall = place(3.0 * away + DVec3::Z, -away, DVec3::new(4.0, 4.0, 1.0));
        t.shape(ShapeKind::Rectangle(wall), white);
        let lamp = place(2.2 * away + 2.0 * DVec3::Z, away, DVec3::splat(0.5));
        let lamp = t.shape(ShapeKind::Rectangle(lamp), black);
        t.emit(lamp, Rgb::splat(20.0));
        t.camera(DVec3::new(0.0, 0.0, 2.0), DVec3::new(0.01, 0.0, 0.0), 40.0, 16);
        t.tables.integrator = IntegratorSettings { max_depth: Some(3), ..cached(cache) };
        t.build()
    };
    for lean in [20.0, -20.0] {
        let scene_of = |gradients| {
            let cache = IrrCacheSettings { gradients, error: 0.02, ..Default::default() };
            scene(lean, cache)
        };
        let turned = scene_of(None);
        let (path, path_error) = film_mean(&turned, None, 100_000);
        let (with, error) = film_mean(&turned, Some(&build(&turned)), 20_000);
        let flat = scene_of(Some(false));
        let (without, _) = film_mean(&flat, Some(&build(&flat)), 20_000);
        let noise = 4.5 * path_error.hypot(error);
        assert!((with / path - 1.0).abs() < 0.1 + noise / path, "{lean}: {with}, paths {path}");
        assert!((without / path - 1.0).abs() > 0.2, "{lean}: {without} without, paths {path}");
        // One corrected look-up after the other has the mean of paths.
        let cache = IrrCacheSettings { debias: 1.0, ..Default::default() };
        let walked = scene(lean, cache);
        let (mean, error) = film_mean(&walked, Some(&build(&walked)), 100_000);
        assert!(
            (mean - path).abs() < 4.5 * path_error.hypot(error),
            "{lean}: {mean}, paths {path}"
        );
    }
}

/// A hidden lamp gets no record; the wall behind it does.
#[test]
fn hidden_lamps_are_looked_through() {
    let records_on_the_lamp = |hide_emitters| {
        let mut t = TestScene::default();
        let grey = t.diffuse(Rgb::splat(0.5));
        t.room(grey);
        let lamp = place(DVec3::new(0.0, 0.0, 0.5), -DVec3::Z, DVec3::splat(0.5));
        let lamp = t.shape(ShapeKind::Rectangle(lamp), grey);
        t.emit(lamp, Rgb::WHITE);
        t.camera(DVec3::new(0.0, 0.0, -0.9), DVec3::Z, 60.0, 24);
        let settings = cached(IrrCacheSettings { noise: Some(1.0), ..Default::default() });
        t.tables.integrator = IntegratorSettings { hide_emitters, ..settings };
        let records = build(&t.build()).records;
        let count = |z: f32| records.iter().filter(|r| (r.position.z - z).abs() < 1e-3).count();
        (count(0.5), count(1.0))
    };
    let (on_lamp, behind) = records_on_the_lamp(true);
    assert_eq!(on_lamp, 0);
    let (on_shown_lamp, behind_it) = records_on_the_lamp(false);
    assert!(on_shown_lamp > 0 && behind > behind_it, "{on_shown_lamp}, {behind}, {behind_it}");
}

/// A finer error makes more records, up to a few per cent of chance.
#[test]
fn finer_errors_make_more_records() {
    let count = |error| {
        let mut t = mixed_room(32);
        t.tables.integrator = cached(IrrCacheSettings { error, ..Default::default() });
        build(&t.build()).records.len()
    };
    let counts = [0.8, 0.2, 0.05].map(count);
    assert!(counts.is_sorted(), "{counts:?}");
}

pub(super) struct Silent;

impl Observer for Silent {
    fn elapsed(&self) -> Duration {
        Duration::ZERO
    }
    fn is_cancelled(&self) -> bool {
        false
    }
    fn progress(&self, _: &Progress) {}
    fn checkpoint(&self, _: &RenderState) {}
}

fn in_pool<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool").install(work)
}

/// Records and picture are the same bits for any number of threads, adaptive sampling included.
#[test]
fn threads_change_no_bit() {
    let mut t = mixed_room(32);
    t.tables.integrator = cached(IrrCacheSettings::default());
    let scene = t.build();
    let settings = RenderSettings { spp: Some(64), ..Default::default() };
    let result = |threads| {
        in_pool(threads, || {
            let IrradianceCache { records, statistics, .. } = build(&scene);
            let output = render(&scene, 0, &settings, None, &Silent).expect("a sound scene");
            ((records, statistics, output.lookups), output.state)
        })
    };
    let one = result(1);
    for threads in [2, 3, 7] {
        assert!(result(threads) == one, "{threads} threads");
    }
    let counts: Vec<u32> =
        one.1.film.tiles.iter().flat_map(|t| &t.pixels).map(|p| p.count).collect();
    let (least, most) = (counts.iter().min(), counts.iter().max());
    assert_eq!((least, most), (Some(&4), Some(&64)), "some pixels need more than others");
}

/// Records are counted by lattice and by what limits them, and look-ups by what became of them.
#[test]
fn statistics_count_everything_once() {
    let mut t = mixed_room(32);
    t.tables.integrator = cached(IrrCacheSettings::default());
    let scene = t.build();
    let settings = RenderSettings { spp: Some(16), ..Default::default() };
    let output = render(&scene, 0, &settings, None, &Silent).expect("a sound scene");
    let cache = output.cache.expect("a cache");
    let statistics = cache.statistics;
    assert_eq!(statistics.levels.iter().sum::<usize>(), cache.records.len());
    // 32 pixels across: strides 4, 2 and 1.
    assert!(statistics.levels[..3].iter().all(|&count| count > 0), "{statistics:?}");
    let with = |flag| cache.records.iter().filter(|r| r.flags & flag != 0).count();
    for (flag, count) in [
        (Record::RAISED, statistics.raised),
        (Record::LOWERED, statistics.lowered),
        (Record::GRADIENT_LIMITED, statistics.gradient_limited),
        (Record::RATIO_LIMITED, statistics.ratio_limited),
        (Record::CREVICE, statistics.crevices),
    ] {
        assert_eq!(count, with(flag), "flag {flag}");
    }
    // One look-up for every sample that does not end at the lamp, which is black.
    let (lookups, samples) = (output.lookups, output.state.film.sample_counts().1);
    assert!(lookups.lookups <= samples && lookups.lookups > samples * 9 / 10, "{lookups:?}");
    assert!(lookups.uncached_share().expect("look-ups") < 0.1, "{lookups:?}");
    let mean = lookups.mean_records().expect("look-ups");
    assert!(mean >= 1.0 && mean < cache.records.len() as f64, "{mean}");

    // An empty cache serves nothing.
    let empty =
        CacheContents::default().freeze(&scene.tables.integrator.cache, scene.accel.bounds());
    let streams = SamplerSettings { kind: SamplerKind::Sobol, sample_count: 1, seed: 0 };
    let camera = Camera::new(&scene.tables.sensors[0]);
    let mut sampler = Sampler::new(&streams, (0, 0), 0);
    let ray = camera.ray(Vec2::splat(3.0), Vec2::splat(0.5));
    let settings = &scene.tables.integrator;
    let found = radiance(&scene, settings, Some(&empty), &ray, &mut sampler, &mut 0);
    assert_eq!(found.lookups, LookupCounts { lookups: 1, uncached: 1, records: 0 });
    assert_eq!((found.lookups.uncached_share(), found.lookups.mean_records()), (Some(1.0), None));
}

/// An interrupted adaptive render goes on to the same bits.
#[test]
fn interruptions_change_no_bit() {
    let mut t = mixed_room(32);
    t.tables.integrator = cached(IrrCacheSettings::default());
    let scene = t.build();
    let settings = RenderSettings { spp: Some(64), ..Default::default() };
    let whole = render(&scene, 0, &settings, None, &Silent).expect("a sound scene").state;
    for stop_after in [1, 5, 12, 20] {
        let observer = Stopping { left: stop_after.into() };
        let part = render(&scene, 0, &settings, None, &observer).expect("a sound scene").state;
        let bytes = part.to_bytes();
        let part = RenderState::from_bytes(&bytes).expect("what was written");
        let rest = render(&scene, 0, &settings, Some(part), &Silent).expect("the same scene");
        assert!(rest.state == whole, "interrupted after {stop_after} tiles");
    }
}

/// Cancels after some tiles.
struct Stopping {
    left: std::sync::atomic::AtomicI64,
}

impl Observer for Stopping {
    fn elapsed(&self) -> Duration {
        Duration::ZERO
    }
    fn is_cancelled(&self) -> bool {
        self.left.load(std::sync::atomic::Ordering::Relaxed) <= 0
    }
    fn progress(&self, _: &Progress) {
        self.left.fetch_sub(1, std::sync::atomic::Ordering::Relaxed);
    }
    fn checkpoint(&self, _: &RenderState) {}
}
