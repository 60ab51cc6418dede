use super::*;
use crate::bsdf::Bsdf;
use crate::emitter::Emitter;
use crate::math::{DVec3, Vec2, Vec3};
use crate::sampler::{SamplerKind, SamplerSettings};
use crate::scene::test_scene::{TestScene, mixed_room, place};
use crate::sensor::Camera;
use crate::shape::ShapeKind;

/// Means and standard errors of the parts (emission, direct, indirect, rest) and of their sum,
/// over independent samples spread over the film of the first camera.
struct Measured {
    parts: [[(f64, f64); 3]; 5],
}

/// Two-sided 7e-6 per comparison for normal means; seeds are fixed.
const SIGMAS: f64 = 4.5;

impl Measured {
    fn new(scene: &Scene, settings: &IntegratorSettings, samples: u32) -> Self {
        let sensor = &scene.tables.sensors[0];
        let camera = Camera::new(sensor);
        let size = Vec2::new(sensor.film.width as f32, sensor.film.height as f32);
        let streams =
            SamplerSettings { kind: SamplerKind::Independent, sample_count: samples, seed: 5 };
        let mut sums = [[[0.0; 2]; 3]; 5];
        let mut rays = 0;
        for i in 0..samples {
            let mut sampler = Sampler::new(&streams, (0, 0), i);
            let ray = camera.ray(sampler.next_2d() * size, sampler.next_2d());
            let radiance = radiance(scene, settings, None, &ray, &mut sampler, &mut rays);
            let [a, b, c, d] = radiance.layers();
            for (sum, part) in sums.iter_mut().zip([a, b, c, d, a + b + c + d]) {
                for (sum, value) in sum.iter_mut().zip(part.to_array()) {
                    sum[0] += f64::from(value);
                    sum[1] += f64::from(value).powi(2);
                }
            }
        }
        let n = f64::from(samples);
        let moments = |[sum, squares]: [f64; 2]| {
            let mean = sum / n;
            (mean, ((squares / n - mean * mean).max(0.0) / n).sqrt())
        };
        Self { parts: sums.map(|part| part.map(moments)) }
    }

    /// Part `part` (4: the sum) has the expected mean, and the test could tell 3 % more.
    fn expect(&self, part: usize, expected: [f64; 3]) {
        for ((mean, error), exact) in self.parts[part].into_iter().zip(expected) {
            assert!(SIGMAS * error <= 0.03 * exact.abs(), "too few samples: {error} for {exact}");
            assert!(
                (mean - exact).abs() <= SIGMAS * error + 1e-5 * exact.abs(),
                "part {part}: {mean} ± {error}, expected {exact}"
            );
        }
    }
}

const RHO: [f64; 3] = [0.2, 0.5, 0.8];

fn rho() -> Rgb {
    Rgb::new(0.2, 0.5, 0.8)
}

fn depth(max_depth: Option<u32>) -> IntegratorSettings {
    IntegratorSettings { max_depth, ..Default::default() }
}

/// A closed surface that emits 1 and reflects `rho`, seen from inside.
fn furnace(sphere: bool) -> Scene {
    let mut t = TestScene::default();
    let bsdf = t.diffuse(rho());
    let shape = if sphere {
        let ball = place(DVec3::new(0.1, 0.0, -0.2), DVec3::Z, DVec3::splat(1.5));
        let shape = t.shape(ShapeKind::Sphere(ball), bsdf);
        t.tables.shapes.shapes[shape.0 as usize].flip_normals = true;
        shape
    } else {
        t.room(bsdf)
    };
    t.emit(shape, Rgb::WHITE);
    t.camera(DVec3::new(0.3, -0.2, 0.1), DVec3::new(-1.0, 0.5, 0.4), 70.0, 1);
    t.build()
}

/// Inside a closed surface that emits Le and reflects ρ, radiance is Le/(1 − ρ) everywhere, and
/// after k bounces Le·Σρ^i; the parts are the terms of the series.
#[test]
fn furnaces_have_their_closed_form() {
    for sphere in [false, true] {
        let scene = furnace(sphere);
        for limit in 1..=4_u32 {
            let measured = Measured::new(&scene, &depth(Some(limit)), 20_000);
            measured.expect(4, RHO.map(|r| (0..limit).map(|k| r.powi(k as i32)).sum()));
        }
        let measured = Measured::new(&scene, &depth(None), 150_000);
        measured.expect(0, [1.0; 3]);
        measured.expect(1, RHO);
        measured.expect(2, RHO.map(|r| r * r / (1.0 - r)));
        measured.expect(3, [0.0; 3]);
        measured.expect(4, RHO.map(|r| 1.0 / (1.0 - r)));
    }
}

/// Early roulette changes the noise, not the mean.
#[test]
fn roulette_is_unbiased() {
    let scene = furnace(false);
    let settings = IntegratorSettings { rr_depth: 1, ..Default::default() };
    let measured = Measured::new(&scene, &settings, 200_000);
    measured.expect(4, RHO.map(|r| 1.0 / (1.0 - r)));
}

#[test]
fn direct_agrees_with_two_bounces() {
    let scene = furnace(true);
    for (emitter_samples, bsdf_samples) in [(1, 1), (3, 1), (1, 4), (2, 0), (0, 2)] {
        let kind = IntegratorKind::Direct { emitter_samples, bsdf_samples };
        let settings = IntegratorSettings { kind, ..Default::default() };
        let measured = Measured::new(&scene, &settings, 20_000);
        measured.expect(0, [1.0; 3]);
        measured.expect(1, RHO);
    }
}

/// A floor at y = 0 under a light of radiance 2 at height `h`, looked at from the side.
fn floor_under(light: ShapeKind) -> Scene {
    let mut t = TestScene::default();
    let (floor, black) = (t.diffuse(rho()), t.diffuse(Rgb::BLACK));
    t.shape(ShapeKind::Rectangle(place(DVec3::ZERO, DVec3::Y, DVec3::splat(3.0))), floor);
    let light = t.shape(light, black);
    t.emit(light, Rgb::splat(2.0));
    // A pencil of rays that meets the floor at the origin.
    t.camera(DVec3::new(2.0, 0.4, 0.3), DVec3::ZERO, 0.02, 1);
    t.build()
}

/// Reflected radiance ρ/π·E with E = π·L·F and the textbook form factors F of an element of
/// area facing a rectangle (four corners, Howell catalogue B-4), a disk (B-12) and a sphere
/// (B-36).
#[test]
fn irradiance_has_its_closed_form() {
    let h = 1.2_f64;
    let down = |center, scale: DVec3| place(center, -DVec3::Y, scale);
    let above = DVec3::Y * h;
    let (a, b) = (0.5 / h, 0.5 / h);
    let arm = |x: f64, y: f64| x / (1.0 + x * x).sqrt() * (y / (1.0 + x * x).sqrt()).atan();
    let corner = (arm(a, b) + arm(b, a)) / std::f64::consts::TAU;
    let cases = [
        (ShapeKind::Rectangle(down(above, DVec3::splat(0.5))), 4.0 * corner),
        (ShapeKind::Disk(down(above, DVec3::splat(0.7))), 0.49 / (h * h + 0.49)),
        (ShapeKind::Sphere(down(above, DVec3::splat(0.5))), 0.25 / (h * h)),
    ];
    for (light, form_factor) in cases {
        let scene = floor_under(light);
        let measured = Measured::new(&scene, &depth(Some(2)), 60_000);
        measured.expect(1, RHO.map(|r| 2.0 * r * form_factor));
    }
}

/// What a mirror shows belongs to the rest, lights included; what lies behind an invisible
/// surface belongs where it would without it.
#[test]
fn mirrors_and_invisible_surfaces_sort_light() {
    let build = |mirror: bool| {
        let mut t = TestScene::default();
        let black = t.diffuse(Rgb::BLACK);
        let front = if mirror { t.mirror() } else { t.bsdf(Bsdf::Null) };
        let screen = place(DVec3::ZERO, -DVec3::Z, DVec3::splat(1.0));
        t.shape(ShapeKind::Rectangle(screen), front);
        let side = if mirror { -1.0 } else { 1.0 };
        let lamp = place(DVec3::Z * 3.0 * side, DVec3::Z * -side, DVec3::splat(9.0));
        let lamp = t.shape(ShapeKind::Rectangle(lamp), black);
        t.emit(lamp, Rgb::splat(4.0));
        t.camera(-DVec3::Z, DVec3::ZERO, 10.0, 1);
        t.build()
    };
    let mirror = Measured::new(&build(true), &depth(None), 10);
    mirror.expect(0, [0.0; 3]);
    mirror.expect(3, [4.0; 3]);
    let window = Measured::new(&build(false), &depth(None), 10);
    window.expect(0, [4.0; 3]);
    window.expect(3, [0.0; 3]);
    // Passing it counts as a bounce, as in Mitsuba.
    let window = Measured::new(&build(false), &depth(Some(1)), 10);
    window.expect(4, [0.0; 3]);
}

/// With hidden emitters camera rays pass through the lamp, which still lights the wall behind.
#[test]
fn hidden_emitters_vanish() {
    let mut t = TestScene::default();
    let (grey, black) = (t.diffuse(Rgb::splat(0.5)), t.diffuse(Rgb::BLACK));
    t.shape(ShapeKind::Rectangle(place(DVec3::Z * 2.0, -DVec3::Z, DVec3::splat(5.0))), grey);
    for z in [0.5, 1.0] {
        let lamp =
            t.shape(ShapeKind::Rectangle(place(DVec3::Z * z, DVec3::Z, DVec3::splat(0.5))), black);
        t.emit(lamp, Rgb::WHITE);
    }
    t.camera(-DVec3::Z, DVec3::ZERO, 1.0, 1);
    let scene = t.build();
    let settings = IntegratorSettings { hide_emitters: true, ..Default::default() };
    let hidden = Measured::new(&scene, &settings, 4000);
    assert!(hidden.parts[0][0].0 == 0.0 && hidden.parts[1][0].0 > 0.0);
    let seen = Measured::new(&scene, &IntegratorSettings::default(), 100);
    assert_eq!(seen.parts[4][0].0, 0.0, "the lamp's back is black");
}

/// The environment is emission where nothing stands before it, and can be hidden.
#[test]
fn environments_are_seen_and_hidden() {
    let mut t = TestScene::default();
    t.tables.emitters.emitters.push(Emitter::Constant { radiance: Rgb::splat(3.0) });
    let grey = t.diffuse(rho());
    let ball = place(DVec3::Z * 9.0, DVec3::Z, DVec3::splat(1.0));
    t.shape(ShapeKind::Sphere(ball), grey);
    t.camera(DVec3::ZERO, DVec3::X, 10.0, 1);
    t.camera(DVec3::ZERO, DVec3::Z, 1.0, 1);
    let mut scene = t.build();
    Measured::new(&scene, &depth(Some(1)), 10).expect(0, [3.0; 3]);
    let hidden = IntegratorSettings { hide_emitters: true, ..Default::default() };
    Measured::new(&scene, &hidden, 10).expect(4, [0.0; 3]);
    // The sphere is convex, so it reflects ρ·3, and no indirect light.
    scene.tables.sensors.remove(0);
    let ball = Measured::new(&scene, &hidden, 20_000);
    ball.expect(1, RHO.map(|r| 3.0 * r));
    ball.expect(4, RHO.map(|r| 3.0 * r));
}

/// A room lit by the sky through a window: where the sky is seen from is learned. That must change
/// nothing but the noise, of which it leaves less than half.
#[test]
fn learning_where_the_sky_is_seen_changes_only_the_noise() {
    let mut t = TestScene::default();
    let grey = t.diffuse(rho());
    let mut wall = |center: DVec3, z: DVec3, scale: DVec3| {
        t.shape(ShapeKind::Rectangle(place(center, z, scale)), grey);
    };
    for axis in [DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z] {
        wall(axis, -axis, DVec3::ONE);
    }
    // The wall at x = -1 is nine squares without the middle one.
    for i in (0..9).filter(|&i| i != 4) {
        let at = |i: i32| f64::from(i - 1) * 2.0 / 3.0;
        wall(DVec3::new(-1.0, at(i % 3), at(i / 3)), DVec3::X, DVec3::splat(1.0 / 3.0));
    }
    t.tables.emitters.emitters.push(Emitter::Constant { radiance: Rgb::splat(3.0) });
    t.camera(DVec3::new(0.9, 0.1, 0.1), DVec3::new(0.2, -1.0, 0.0), 5.0, 64);
    let mut scene = t.build();
    assert!(scene.lights.needs_choice(), "a guide was learned");
    let guided = Measured::new(&scene, &depth(None), 250_000);
    scene.lights.set_guide(None);
    assert!(!scene.lights.needs_choice());
    let unguided = Measured::new(&scene, &depth(None), 1_000_000);
    for part in [1, 2, 4] {
        for ((a, a_error), (b, b_error)) in guided.parts[part].into_iter().zip(unguided.parts[part])
        {
            assert!(SIGMAS * a_error.hypot(b_error) < 0.03 * b, "too few samples");
            assert!((a - b).abs() < SIGMAS * a_error.hypot(b_error), "part {part}: {a}, {b}");
            // A quarter of the samples would double the error.
            assert!(a_error < b_error * 2.0 / 2.0_f64.sqrt(), "part {part}: noise {a_error}");
        }
    }
}

/// Roulette before `rr_depth` changes only noise and time.
#[test]
fn early_roulette_changes_only_the_noise() {
    let mut t = mixed_room(16);
    t.tables.sensors.clear();
    t.camera(DVec3::new(0.0, 0.0, -0.95), DVec3::new(0.0, -1.0, 0.5), 5.0, 16);
    let scene = t.build();
    let with = Measured::new(&scene, &depth(None), 200_000);
    let late = IntegratorSettings { early_roulette: false, ..depth(None) };
    let without = Measured::new(&scene, &late, 200_000);
    for ((a, a_error), (b, b_error)) in with.parts[4].into_iter().zip(without.parts[4]) {
        assert!(SIGMAS * a_error.hypot(b_error) < 0.03 * b, "too few samples");
        assert!((a - b).abs() < SIGMAS * a_error.hypot(b_error), "{a} with, {b} without");
    }
}

#[test]
fn depth_is_the_distance_from_the_near_plane() {
    let mut t = TestScene::default();
    let grey = t.diffuse(rho());
    t.shape(ShapeKind::Rectangle(place(DVec3::Z * 2.0, -DVec3::Z, DVec3::splat(5.0))), grey);
    t.camera(DVec3::ZERO, DVec3::Z, 0.01, 1);
    let scene = t.build();
    let settings = IntegratorSettings { kind: IntegratorKind::Depth, ..Default::default() };
    Measured::new(&scene, &settings, 10).expect(4, [2.0 - 1e-3; 3]);
}

#[test]
fn further_layers_describe_the_first_surface() {
    let mut t = mixed_room(4);
    t.tables.aovs =
        AovKind::ALL.map(|kind| Aov { name: kind.default_layer().to_owned(), kind }).to_vec();
    let scene = t.build();
    let mut values = Vec::new();
    let ray = Ray::new(Vec3::new(0.0, 0.0, -0.5), Vec3::new(0.0, -1.0, 0.0));
    let streams = SamplerSettings { kind: SamplerKind::Sobol, sample_count: 1, seed: 0 };
    let mut sampler = Sampler::new(&streams, (0, 0), 0);
    let mut rays = 0;
    let aovs = &scene.tables.aovs;
    eval_aovs(&scene, None, aovs, &ray, &mut sampler, &mut rays, &mut values);
    assert_eq!((rays, values.len()), (1, 3 + 1 + 3 + 2 + 3 * 4 + 2 + 8));
    assert_eq!(values.split_off(23), [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 5.0], "there is no cache");
    assert_eq!(values[..3], [0.7, 0.6, 0.5]);
    assert!((values[3] - 1.0).abs() < 1e-6);
    assert!((values[5] + 1.0).abs() < 1e-6, "position {:?}", &values[4..7]);
    assert!((values[10] - 1.0).abs() < 1e-6, "geometric normal {:?}", &values[9..12]);
    assert_eq!(values[22], 0.0, "the room is shape 0");
    let miss = Ray { t_max: 0.1, ..ray };
    eval_aovs(&scene, None, aovs, &miss, &mut sampler, &mut rays, &mut values);
    assert!(values[..23].iter().all(|&v| v == 0.0));
}
