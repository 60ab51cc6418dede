//! Guided walks against unguided ones, and what look-ups do with their numbers.

use super::fill::guide_after;
use super::guide::WalkGuide;
use super::walk::Walks;
use super::{CellIrradiance, IrradianceHash, LEVELS};
use crate::integrator::irrcache::IrrCacheSettings;
use crate::integrator::irrcache::tests::furnace;
use crate::math::statistics::{Moments, normal_quantile};
use crate::math::{DVec3, Ray, Vec2, Vec3};
use crate::sampler::{Sampler, SamplerKind, SamplerSettings};
use crate::scene::Scene;
use crate::scene::test_scene::{TestScene, place};
use crate::sensor::Camera;
use crate::shape::ShapeKind;
use crate::spectrum::Rgb;

/// Two halves of a room with a wall between them that leaves a slit; the lamp is in one, the camera
/// in the other.
fn room_with_a_slit() -> Scene {
    let mut t = TestScene::default();
    let grey = t.diffuse(Rgb::splat(0.7));
    let black = t.diffuse(Rgb::BLACK);
    t.room(grey);
    for side in [-1.0, 1.0] {
        let sheet =
            place(DVec3::new(0.01 * side, 0.0, -0.05), DVec3::X * side, DVec3::new(1.0, 0.95, 1.0));
        t.shape(ShapeKind::Rectangle(sheet), grey);
    }
    let lamp = place(DVec3::new(-0.6, 0.99, 0.0), -DVec3::Y, DVec3::splat(0.2));
    let lamp = t.shape(ShapeKind::Rectangle(lamp), black);
    t.emit(lamp, Rgb::splat(20.0));
    t.camera(DVec3::new(0.9, 0.0, -0.9), DVec3::new(0.3, -0.2, 1.0), 90.0, 64);
    t.build()
}

/// What batches of walks tell.
#[derive(Default)]
struct Told {
    /// Radiance at the camera.
    radiance: Moments,
    /// Indirect irradiance of what the camera sees.
    irradiance: Moments,
    /// The same of all that walks met.
    all: Moments,
}

fn measure(scene: &Scene, guide: Option<&WalkGuide>, seed: u64) -> Told {
    const BATCHES: u32 = 96;
    const BATCH: u32 = 1024;
    let walks = Walks { scene, guide, teacher: None };
    let camera = Camera::new(&scene.tables.sensors[0]);
    let size = scene.tables.sensors[0].film.width as f32;
    let samples =
        SamplerSettings { kind: SamplerKind::Independent, sample_count: BATCHES * BATCH, seed };
    let mut told = Told::default();
    for batch in 0..BATCHES {
        let [mut radiance, mut irradiance] = [0.0, 0.0];
        let mut all = Moments::default();
        for i in 0..BATCH {
            let mut sampler = Sampler::new(&samples, (0, 0), batch * BATCH + i);
            let ray = camera.ray(size * sampler.next_2d(), Vec2::splat(0.5));
            // The first vertex is told of last.
            let mut first = 0.0;
            let visit = |_, indirect: Rgb, _| {
                first = f64::from(indirect.r);
                all.add(first);
            };
            let seen = walks.follow(ray, &mut sampler, &mut 0, &mut Vec::new(), visit);
            radiance += f64::from(seen.all.r);
            irradiance += first;
        }
        told.radiance.add(radiance / f64::from(BATCH));
        told.irradiance.add(irradiance / f64::from(BATCH));
        told.all.add(all.mean);
    }
    told
}

/// Whatever a guide says, walks tell the same on average, at a confidence of 0.9999 each; and of the
/// light that comes through a slit they tell it better.
#[test]
fn guided_walks_have_the_same_mean_and_less_noise() {
    let scene = room_with_a_slit();
    let guide = guide_after(&scene, 1 << 16);
    let (plain, guided) = (measure(&scene, None, 1), measure(&scene, Some(&guide), 2));
    let quantile = normal_quantile(1.0 - 0.5e-4);
    for (what, a, b) in [
        ("radiance", plain.radiance, guided.radiance),
        ("irradiance", plain.irradiance, guided.irradiance),
    ] {
        let error = a.standard_error().hypot(b.standard_error());
        assert!((a.mean - b.mean).abs() < quantile * error, "{what}: {a:?}, guided {b:?}");
        assert!(error < 0.03 * a.mean, "{what}: the test could tell nothing: {a:?}, {b:?}");
        let less = b.standard_error() / a.standard_error();
        assert!(less < 0.8, "{what}: {less} of the noise");
    }
}

/// In a furnace all places receive the same, π ρ/(1 − ρ), so that it does not matter which ones walks
/// meet, and which of these they tell of: what would show is that the guide decides that. At a
/// confidence of 0.9999.
#[test]
fn guided_walks_tell_of_all_directions() {
    let scene = furnace(0.5, IrrCacheSettings::default());
    for guide in [None, Some(WalkGuide::towards(scene.accel.bounds(), Vec3::Y))] {
        let told = measure(&scene, guide.as_ref(), 3).all;
        let expected = std::f64::consts::PI;
        let tolerance = normal_quantile(1.0 - 0.5e-4) * told.standard_error();
        assert!((told.mean - expected).abs() < tolerance, "{told:?}, not {expected}");
        assert!(tolerance < 0.02 * expected, "the test could tell nothing: {told:?}");
    }
}

/// Places that no walk saw have no guide, and are walked from as the material says.
#[test]
fn places_without_lessons_have_no_guide() {
    let scene = room_with_a_slit();
    let guide = guide_after(&scene, 1 << 12);
    let behind = DVec3::new(-0.99, -0.99, -0.99).as_vec3();
    assert!(guide.at(behind, Vec3::Z).is_none());
}

/// Where cells are known on one side of a point only, whether one is found says nothing about the
/// direction that the same numbers choose.
#[test]
fn numbers_that_find_no_cell_are_like_all_others() {
    let scene = room_with_a_slit();
    let ray = Ray::new(DVec3::new(0.5, 0.0, 0.0).as_vec3(), -Vec3::Y);
    let si = scene.intersect(&ray).expect("the floor");
    let mut hash = IrradianceHash::empty(1.0, 1.0);
    let offsets = || (-32..32).map(|i| (i as f32 + 0.5) * hash.edge(0) / 32.0);
    let mut keys: Vec<u64> = (0..LEVELS)
        .flat_map(|level| {
            let known = offsets().filter(|x| *x < 0.0);
            let points = known.flat_map(|x| offsets().map(move |y| (x, y)));
            points.map(move |(x, y)| (level, si.p + si.frame.s * x + si.frame.t * y))
        })
        .map(|(level, p)| hash.key(p, si.frame.n, si.shape, level))
        .collect();
    keys.sort_unstable();
    keys.dedup();
    let means: Vec<_> = keys.iter().map(|&key| (key, CellIrradiance::BLACK)).collect();
    hash.insert(&means, usize::MAX);
    let mut missed = [Moments::default(), Moments::default()];
    const N: u32 = 512;
    for i in 0..N * N {
        let u = (Vec2::new((i % N) as f32, (i / N) as f32) + 0.5) / N as f32;
        if hash.lookup(&si, u).is_none() {
            missed[0].add(u.x.into());
            missed[1].add(u.y.into());
        }
    }
    let share = missed[0].count as f64 / f64::from(N * N);
    assert!((0.1..0.9).contains(&share), "the test could tell nothing: {share}");
    assert!(missed.iter().all(|m| (m.mean - 0.5).abs() < 0.01), "{missed:?}");
}
