//! Light where it belongs: not through walls, and not under what stands in its way.

use super::*;
use crate::film::CropWindow;
use crate::math::statistics::Moments;
use crate::math::{Ray, Vec3};

/// Half of the thickness of the wall between the rooms.
const HALF_WALL: f64 = 0.0005;
/// How much brighter the lamp of the bright room is.
const BRIGHT: f32 = 16.0;

/// Two closed rooms, [-2, 0] and [0, 2] × [-1, 1]², whose floor, ceiling and outer walls are one
/// shape that goes on under the wall of one millimetre between them. Each has a lamp; that of the
/// first shines only if it `is_lit`.
fn two_rooms(is_lit: bool, seed: u64) -> TestScene {
    let mut t = TestScene::default();
    let grey = t.diffuse(Rgb::splat(0.6));
    let black = t.diffuse(Rgb::BLACK);
    t.room(grey);
    for p in &mut t.tables.shapes.meshes[0].positions {
        p.x *= 2.0;
    }
    for side in [-1.0, 1.0] {
        let at = DVec3::new(side * HALF_WALL, 0.0, 0.0);
        t.shape(ShapeKind::Rectangle(place(at, DVec3::X * side, DVec3::splat(1.01))), grey);
    }
    for (side, radiance) in [(-1.0, BRIGHT), (1.0, 1.0)] {
        let at = DVec3::new(side, 0.99, 0.0);
        let lamp = place(at, -DVec3::Y, DVec3::splat(0.3));
        let lamp = t.shape(ShapeKind::Rectangle(lamp), black);
        if side > 0.0 || is_lit {
            t.emit(lamp, Rgb::splat(radiance));
        }
    }
    t.tables.integrator = cached(IrrCacheSettings::default());
    t.camera(DVec3::new(0.15, -0.7, -0.95), DVec3::new(0.1, -0.9, 0.6), 70.0, 32);
    t.tables.sensors[0].sampler.seed = seed;
    t
}

/// Seeds over which look-ups are averaged. Beside the light, which takes half of the light samples, one
/// seed's differ by more than one per cent.
const SEEDS: u64 = 8;

/// A dark room stays as dark as it is whatever burns next door. Its picture: within half a per cent
/// and 4.5 standard errors. Its look-ups, means over seeds: the mean of all within half a per cent,
/// each within five per cent.
#[test]
fn walls_of_a_millimetre_are_tight() {
    let rooms = |is_lit| -> Vec<(Scene, IrradianceCache)> {
        let scenes = (1..=SEEDS).map(|seed| two_rooms(is_lit, seed).build());
        scenes
            .map(|scene| {
                let cache = build(&scene);
                (scene, cache)
            })
            .collect()
    };
    let (lit, unlit) = (rooms(true), rooms(false));
    let all = |found: &LayeredRadiance| {
        let [a, b, c, d] = found.layers();
        a + b + c + d
    };
    let film_mean = |(scene, cache): &(Scene, IrradianceCache), samples| {
        film_mean_of(scene, Some(cache), samples, all)
    };
    let (mean, error) = film_mean(&lit[0], 600_000);
    let (dark, dark_error) = film_mean(&unlit[0], 200_000);
    let tolerance = 4.5 * error.hypot(dark_error) + 0.005 * dark;
    assert!(mean - dark < tolerance, "{mean} beside light, {dark} beside none, {tolerance}");
    assert!(tolerance < 0.02 * dark, "the test could tell nothing");

    let scene = &lit[0].0;
    let camera = Camera::new(&scene.tables.sensors[0]);
    let [mut variance, mut excess, mut count] = [0.0_f64; 3];
    let mut worst = f64::MIN;
    for pixel in 0..32 * 32 {
        let film = Vec2::new((pixel % 32) as f32 + 0.5, (pixel / 32) as f32 + 0.5);
        let Some(si) = scene.intersect(&camera.ray(film, Vec2::splat(0.5))) else { continue };
        let n = lit_normal(&si);
        let query = Query { p: si.p, n_smooth: n, n_shading: n };
        let moments = |rooms: &[(Scene, IrradianceCache)]| {
            let mut moments = Moments::default();
            for (_, cache) in rooms {
                moments.add(cache.lookup(&query)?.irradiance.luminance().into());
            }
            Some(moments)
        };
        let (Some(lit), Some(unlit)) = (moments(&lit), moments(&unlit)) else { continue };
        let errors = [&lit, &unlit].map(|m| m.standard_error() / m.mean);
        variance += errors[0].powi(2) + errors[1].powi(2);
        excess += lit.mean / unlit.mean - 1.0;
        worst = worst.max(lit.mean / unlit.mean - 1.0);
        count += 1.0;
    }
    assert!(count > 900.0, "{count} points were served");
    assert!(excess / count < 0.005, "{} on average", excess / count);
    assert!(worst < 0.05, "{worst} somewhere");
    assert!((variance / count).sqrt() < 0.01, "the test could tell nothing");
}

/// A view of both floors from above the ceiling, which the near plane cuts away: now there are walks
/// and records on either side. On the floor of the dark one, farther from the wall than the least
/// radius reaches, look-ups agree with walks within ten per cent and three standard errors of these.
#[test]
fn walls_seen_from_both_sides_are_tight() {
    for bounces in [Bounces::Hash, Bounces::Path] {
        let mut t = two_rooms(true, 1);
        t.tables.integrator = cached(IrrCacheSettings { bounces, ..Default::default() });
        t.tables.sensors.clear();
        t.camera(DVec3::new(0.05, 3.0, 0.03), DVec3::new(0.0, -1.0, 0.0), 60.0, 480);
        let sensor = &mut t.tables.sensors[0];
        sensor.near_clip = 2.5;
        sensor.film.crop = CropWindow { x: 192, y: 192, width: 96, height: 96 };
        let scene = t.build();
        let cache = build(&scene);
        let excess = PIXELS.map(|pixels| excess(&scene, &cache, pixels));
        for ((excess, error), pixels) in excess.into_iter().zip(PIXELS) {
            let is_far = pixels > 5.0;
            assert!(!is_far || excess < 0.1 + 3.0 * error, "{bounces:?}, {pixels} px: {excess}");
        }
    }
}

/// Distances from the wall's foot.
const PIXELS: [f32; 8] = [0.5, 1.5, 3.0, 5.0, 8.0, 15.0, 25.0, 40.0];
/// Side of a pixel on the floor in the view from above.
const PIXEL: f32 = 0.0096;

/// How much brighter than by walks the cache shows the floor of the dark room so far from the wall,
/// and the standard error of that: means over places along the wall, relative.
fn excess(scene: &Scene, cache: &IrradianceCache, pixels: f32) -> (f64, f64) {
    let settings = ProbeSettings { batches: 8, grid: 16, seed: 5 };
    let streams = SamplerSettings { kind: SamplerKind::Sobol, sample_count: 1, seed: 0 };
    let from = Vec3::new(0.8, -0.5, 0.0);
    let [mut found, mut expected, mut variance] = [0.0, 0.0, 0.0];
    for i in 0..6_u32 {
        let to = Vec3::new(PIXEL * pixels + HALF_WALL as f32, -1.0, -0.3 + 0.12 * i as f32);
        let ray = Ray::new(from, (to - from).normalize());
        let mut chain = Sampler::new(&streams, (0, 0), 0);
        let probe = cache.probe(scene, &ray, &mut chain, &settings, i, &mut 0).expect("a floor");
        assert!(probe.position.distance(to) < 1e-3, "{probe:?}");
        found += f64::from(probe.cached.expect("in view").irradiance.luminance());
        expected += f64::from(probe.expected.luminance());
        variance += probe.variance;
    }
    (found / expected - 1.0, variance.sqrt() / expected)
}

/// A black plate a little above the floor takes the indirect light from under it. Look-ups against
/// walks: within ten per cent and three standard errors of the walks. A point between records may
/// find none, and is walked from; it is not asked for here.
#[test]
fn a_plate_casts_its_shadow_into_the_cache() {
    let mut t = TestScene::default();
    let grey = t.diffuse(Rgb::splat(0.6));
    let black = t.diffuse(Rgb::BLACK);
    t.room(grey);
    let lamp = place(DVec3::new(0.0, 0.99, 0.0), -DVec3::Y, DVec3::splat(0.2));
    let lamp = t.shape(ShapeKind::Rectangle(lamp), black);
    t.emit(lamp, Rgb::splat(0.1));
    let plate = place(DVec3::new(0.0, -0.85, 0.0), DVec3::Y, DVec3::splat(0.35));
    t.shape(ShapeKind::Rectangle(plate), black);
    let eye = DVec3::new(0.0, -0.87, -0.98);
    t.camera(eye, DVec3::new(0.0, -1.0, 0.0), 80.0, 48);
    t.tables.integrator = cached(IrrCacheSettings::default());
    let scene = t.build();
    let cache = build(&scene);
    let settings = ProbeSettings { batches: 48, grid: 24, seed: 5 };
    let streams = SamplerSettings { kind: SamplerKind::Sobol, sample_count: 1, seed: 0 };
    let (mut seen, mut served) = (Vec::new(), 0);
    for (stream, x) in [-0.8, -0.6, -0.45, -0.3, -0.15, 0.0, 0.2, 0.4, 0.7].into_iter().enumerate()
    {
        let target = Vec3::new(x, -1.0, -0.05);
        let from = eye.as_vec3();
        let ray = Ray::new(from, (target - from).normalize());
        let mut chain = Sampler::new(&streams, (0, 0), 0);
        let probe = cache
            .probe(&scene, &ray, &mut chain, &settings, stream as u32, &mut 0)
            .expect("the floor is there");
        assert!(probe.position.distance(target) < 1e-3, "{probe:?}");
        let expected = f64::from(probe.expected.luminance());
        seen.push(expected);
        let Some(cached) = probe.cached else { continue };
        let found = f64::from(cached.irradiance.luminance());
        let tolerance = 0.1 * expected + 3.0 * probe.variance.sqrt();
        assert!((found - expected).abs() < tolerance, "at {x}: {found}, by walks {expected}");
        served += 1;
    }
    assert!(served > 4, "{served} of 9 points are served");
    let beside = seen[0].min(seen[8]);
    assert!(seen[5] < 0.5 * beside, "no shadow to be found: {seen:?}");
}

/// Distances of probes from what stands on the floor, in pixels of the view of [`ledge`], and the
/// side of these.
const BESIDE: [f32; 5] = [0.3, 0.6, 1.0, 1.5, 2.5];
const LEDGE_PIXEL: f32 = 2.0 * 1.9 / 512.0;

/// A black ledge on the floor of a room, a pixel high and nearly without thickness. The view is
/// from above, of the surroundings of the point `x` on the floor.
fn ledge(contact_shadows: bool, seed: u64, x: f32) -> Scene {
    let mut t = TestScene::default();
    let grey = t.diffuse(Rgb::splat(0.6));
    let black = t.diffuse(Rgb::BLACK);
    t.room(grey);
    let half = 0.5 * f64::from(LEDGE_PIXEL);
    for side in [-1.0, 1.0] {
        let at = DVec3::new(1e-4 * side, -1.0 + half, 0.0);
        let face = place(at, DVec3::X * side, DVec3::new(half, 0.5, 1.0));
        t.shape(ShapeKind::Rectangle(face), black);
    }
    let lamp = place(DVec3::new(0.0, 0.99, 0.0), -DVec3::Y, DVec3::splat(0.2));
    let lamp = t.shape(ShapeKind::Rectangle(lamp), black);
    t.emit(lamp, Rgb::splat(10.0));
    t.camera(DVec3::new(0.0, 0.9, 1e-3), DVec3::new(0.0, -1.0, 0.0), 90.0, 512);
    let sensor = &mut t.tables.sensors[0];
    sensor.sampler.seed = seed;
    let film = Camera::new(sensor).project(Vec3::new(x, -1.0, 0.0)).expect("in view");
    let [left, top] = [film.x, film.y].map(|middle| (middle - 64.0) as u32);
    sensor.film.crop = CropWindow { x: left, y: top, width: 128, height: 128 };
    let cache = IrrCacheSettings { contact_shadows: Some(contact_shadows), ..Default::default() };
    t.tables.integrator = cached(cache);
    t.build()
}

/// Relative errors of what the picture takes from the cache beside `x`, by distance: the means over
/// places along the ledge and seeds, whose standard error as far as walks make it is below 0.002.
fn errors_beside(x: f32, contact_shadows: bool) -> [f64; BESIDE.len()] {
    let settings = ProbeSettings { batches: 4, grid: 24, seed: 5 };
    let streams = SamplerSettings { kind: SamplerKind::Sobol, sample_count: 1, seed: 0 };
    let mut sums = [[0.0; 4]; BESIDE.len()];
    for seed in 1..=4 {
        let scene = ledge(contact_shadows, seed, x);
        let cache = build(&scene);
        for ([found, expected, variance, served], pixels) in sums.iter_mut().zip(BESIDE) {
            for i in 0..12_u32 {
                let side = if i % 2 == 0 && x == 0.0 { 1.0 } else { -1.0 };
                let to = Vec3::new(x + side * pixels * LEDGE_PIXEL, -1.0, -0.33 + 0.06 * i as f32);
                let from = to + Vec3::new(0.3 * side, 0.5, 0.0);
                let ray = Ray::new(from, (to - from).normalize());
                let mut chain = Sampler::new(&streams, (0, 0), 0);
                let probe = cache.probe(&scene, &ray, &mut chain, &settings, i, &mut 0);
                let probe = probe.expect("a floor");
                assert!(probe.position.distance(to) < 1e-3, "{probe:?}");
                let Some(cached) = probe.cached else { continue };
                *found += f64::from(cached.irradiance.luminance());
                *expected += f64::from(probe.expected.luminance());
                *variance += probe.variance;
                *served += 1.0;
            }
        }
    }
    sums.map(|[found, expected, variance, served]| {
        assert!(served > 40.0, "{served} of 48 points were served");
        assert!(variance.sqrt() < 0.002 * expected);
        found / expected - 1.0
    })
}

/// What is too small for records casts a shadow all the same: beside the ledge half of the light is
/// too much without, and nowhere more than four per cent with.
#[test]
fn a_ledge_of_a_pixel_casts_a_contact_shadow() {
    let [without, with] = [false, true].map(|on| errors_beside(0.0, on));
    assert!(without[0] > 0.4 && without[1] > 0.2, "{without:?}");
    assert!(with.iter().all(|error| error.abs() < 0.04), "{with:?}");
}

/// Records by the foot of a wall know of it: corners become no darker.
#[test]
fn contact_shadows_leave_corners_as_they_are() {
    let [without, with] = [false, true].map(|on| errors_beside(1.0, on));
    for (without, with) in without.into_iter().zip(with) {
        assert!(without.abs() < 0.01 && with.abs() < 0.01, "{without}, {with}");
        assert!((with - without).abs() < 0.005, "{without}, {with}");
    }
}
