use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use crate::film::{FilterKind, Picture};
use crate::integrator::{IntegratorKind, IntegratorSettings, IrrCacheSettings};
use crate::irradiance::Criterion;
use crate::math::Vec2;
use crate::math::statistics::TestRng;
use crate::render::{Observer, Progress, RenderSettings, RenderState, render};
use crate::scene::Scene;
use crate::scene::test_scene::{TestScene, mixed_room};
use crate::sensor::{Sensor, SensorKind};
use crate::verify::{Budget, Verdict, Verification, VerifyError, VerifySettings, verify};

/// A clock that advances by a second with every question, and a request to stop after some.
struct Clock {
    seconds: AtomicU64,
    left: AtomicU64,
}

impl Clock {
    fn new(left: u64) -> Self {
        Self { seconds: AtomicU64::new(0), left: AtomicU64::new(left) }
    }
}

impl Observer for Clock {
    fn elapsed(&self) -> Duration {
        Duration::from_secs(self.seconds.fetch_add(1, Ordering::Relaxed))
    }
    fn is_cancelled(&self) -> bool {
        let step = |left: u64| left.checked_sub(1);
        self.left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, step).is_err()
    }
    fn progress(&self, _: &Progress) {}
    fn checkpoint(&self, _: &RenderState) {}
}

/// With a mirror ball, whose caustics paths find rarely: intervals that hold here do elsewhere.
fn room(integrator: IntegratorSettings) -> Scene {
    build(mixed_room(16), integrator)
}

/// Without the mirror: quiet enough that small errors can be found.
fn matte_room() -> Scene {
    let mut t = mixed_room(16);
    let shapes = &mut t.tables.shapes.shapes;
    shapes[2].bsdf = shapes[0].bsdf;
    build(t, IntegratorSettings::default())
}

fn build(mut t: TestScene, integrator: IntegratorSettings) -> Scene {
    t.tables.integrator = IntegratorSettings { max_depth: Some(6), ..integrator };
    let sensor = &mut t.tables.sensors[0];
    // So narrow that the lamp is not seen, whose edge would be most of the noise.
    sensor.kind = SensorKind::Perspective { fov_x: 1.0, principal_point_offset: Vec2::ZERO };
    // With negative lobes, so that weights are not all alike.
    sensor.film.filter = FilterKind::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 };
    t.build()
}

fn picture(scene: &Scene, spp: u32) -> Picture {
    let settings = RenderSettings { spp: Some(spp), ..Default::default() };
    render(scene, 0, &settings, None, &Clock::new(u64::MAX)).expect("a sound scene").picture
}

/// A picture so exact that its own error does not matter beside that of the checks here.
fn exact(scene: Scene) -> (Scene, Picture) {
    let picture = picture(&scene, 4096);
    (scene, picture)
}

fn checked(scene: &Scene, picture: &Picture, settings: &VerifySettings, seed: u64) -> Verification {
    let sensor = &scene.tables.sensors[0];
    let sampler = crate::sampler::SamplerSettings { seed, ..sensor.sampler };
    let sensor = Sensor { sampler, ..sensor.clone() };
    verify(scene, &sensor, picture, None, settings, &Clock::new(u64::MAX))
        .expect("it shows light")
        .expect("not cancelled")
}

/// The picture with a layer times `factor(pixel)`.
fn changed(picture: &Picture, layer: usize, factor: impl Fn(usize) -> f32) -> Picture {
    let mut changed = picture.clone();
    for (i, value) in changed.parts[layer].image.data.iter_mut().enumerate() {
        *value *= factor(i / 3);
    }
    let channels = changed.beauty.image.channels;
    for (i, pixel) in changed.beauty.image.data.chunks_exact_mut(channels).enumerate() {
        for (c, value) in pixel.iter_mut().enumerate().take(3) {
            *value = changed.parts.iter().map(|part| part.image.data[3 * i + c]).sum();
        }
    }
    changed
}

const FEW: VerifySettings = VerifySettings {
    budget: Budget::Checks(64),
    paths: 32,
    tolerance: 0.05,
    max_bias: 0.003,
    max_share: 0.05,
};

/// Pictures of known error, 200 seeds: the intervals hold the error of the mean, and the mean
/// squared error, about 95 times in a hundred. A correct program is below 178 of 200 once in
/// 4000 tests where intervals cover exactly 95 %.
#[test]
fn intervals_hold_the_truth() {
    let (scene, exact) = exact(room(IntegratorSettings::default()));
    let mut rng = TestRng::new(3);
    let errors: Vec<f32> = (0..256).map(|_| 0.8 * rng.next_f32() - 0.3).collect();
    let wrong = changed(&exact, 1, |pixel| 1.0 + errors[pixel]);
    let of = |picture: &Picture, i: usize, c: usize| {
        f64::from(picture.beauty.image.pixel(i % 16, i / 16)[c])
    };
    let each = || (0..256).flat_map(|i| (0..3).map(move |c| (i, c)));
    let mse =
        each().map(|(i, c)| (of(&wrong, i, c) - of(&exact, i, c)).powi(2)).sum::<f64>() / 768.0;
    let red = |picture: &Picture| (0..256).map(|i| of(picture, i, 0)).sum::<f64>();
    let bias = 1.0 - red(&exact) / red(&wrong);
    assert!(bias > 0.02, "{bias}");
    let (mut means, mut squares) = (0, 0);
    for seed in 0..200 {
        let found = checked(&scene, &wrong, &FEW, 1000 + seed).picture;
        means += i32::from(found.bias[0].interval().contains(bias));
        squares += i32::from(found.mse.interval().contains(mse));
    }
    assert!(means >= 178, "{means} of 200");
    // Squares are skewed, and their interval is not: less is promised.
    assert!(squares >= 165, "{squares} of 200");
}

/// Direct light five per cent too bright is found, and found to be direct light; the right
/// picture is not refuted.
#[test]
fn a_wrong_picture_is_refuted_and_a_right_one_is_not() {
    let (scene, exact) = exact(matte_room());
    let settings = VerifySettings { budget: Budget::Checks(1024), ..FEW };
    let right = checked(&scene, &exact, &settings, 5);
    assert_ne!(right.verdict(), Verdict::Refuted, "{:?}", right.picture.bias);
    let wrong = changed(&exact, 1, |_| 1.05);
    let wrong = checked(&scene, &wrong, &settings, 5);
    assert_eq!(wrong.bias_verdict(), Verdict::Refuted, "{:?}", wrong.picture.bias);
    let apart = wrong.picture.layers.map(|layer| !layer.interval().contains(0.0));
    assert_eq!(apart, [false, true, false, false], "{:?}", wrong.picture.layers);
    // With a factor of two most pixels are surely off.
    let glaring = changed(&exact, 1, |_| 2.0);
    let glaring = checked(&scene, &glaring, &settings, 5);
    assert_eq!(glaring.share_verdict(), Verdict::Refuted, "{:?}", glaring.picture.beyond);
    let check = glaring.picture.checks[glaring.picture.worst[0]];
    assert!(
        glaring.picture.sigmas(&check) > 3.0 && glaring.picture.sure_error(&check) > 0.0,
        "{check:?}"
    );
}

/// A right picture with a lamp in sight, whose edges are looked at with more rays: its mean is
/// right within 4.5 standard errors, which are small, and hardly any pixel counts as surely off.
#[test]
fn a_right_picture_is_right() {
    let mut t = mixed_room(16);
    let shapes = &mut t.tables.shapes.shapes;
    shapes[2].bsdf = shapes[0].bsdf;
    t.tables.integrator.max_depth = Some(6);
    let (scene, exact) = exact(t.build());
    let settings = VerifySettings { budget: Budget::Checks(2048), ..FEW };
    let found = checked(&scene, &exact, &settings, 5).picture;
    let (emission, mean) = (found.layers[0], found.bias[3]);
    for estimate in [emission, mean] {
        let sigmas = estimate.value / estimate.standard_error;
        assert!(sigmas.abs() < 4.5, "{estimate:?}");
    }
    assert!(emission.standard_error < 2e-3, "{emission:?}");
    assert!(found.beyond.surely <= 10, "{:?}", found.beyond);
}

/// A picture may be confirmed, too.
#[test]
fn enough_checks_confirm() {
    let (scene, exact) = exact(matte_room());
    let settings = VerifySettings {
        budget: Budget::Checks(512),
        tolerance: 0.5,
        max_bias: 0.1,
        max_share: 0.2,
        paths: 64,
    };
    let found = checked(&scene, &exact, &settings, 5);
    assert_eq!(found.verdict(), Verdict::Confirmed, "{:?}", found.picture.beyond);
}

/// A deliberately coarse cache is found out by both kinds of checks, with the same sign.
#[test]
fn a_coarse_cache_is_found_out() {
    let cache = IrrCacheSettings {
        criterion: Criterion::Ward88,
        accuracy: Some(5.0),
        gather_samples: Some(16),
        noise: Some(1e3),
        min_pixel_spacing: Some(40.0),
        ..Default::default()
    };
    let kind = IntegratorKind::IrradianceCache;
    let scene = room(IntegratorSettings { kind, cache, ..Default::default() });
    let spp = RenderSettings { spp: Some(256), ..Default::default() };
    let clock = Clock::new(u64::MAX);
    let output = render(&scene, 0, &spp, None, &clock).expect("a sound scene");
    let settings = VerifySettings { budget: Budget::Checks(512), ..FEW };
    let sensor = &scene.tables.sensors[0];
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let cache = output.cache.as_ref();
        pool.install(|| verify(&scene, sensor, &output.picture, cache, &settings, &clock))
            .expect("it shows light")
            .expect("not cancelled")
    };
    let one = run(1);
    let cache = one.cache.as_ref().expect("there is a cache");
    let bias = cache.bias.expect("it was used");
    assert!(!bias.interval().contains(0.0), "{bias:?}");
    let indirect = one.picture.layers[2];
    assert!(indirect.value * bias.value > 0.0, "{indirect:?}, {bias:?}");
    assert!(cache.rmse().is_some_and(|(rmse, low, _)| rmse > low && low > 0.1), "{:?}", cache.mse);
    assert!(cache.beyond.surely > 100 && !cache.worst.is_empty(), "{:?}", cache.beyond);
    // Threads change no bit.
    for threads in [2, 3, 7] {
        assert!(run(threads) == one, "{threads} threads");
    }
}

/// A time only decides on the number of rounds; what was begun when it is cancelled is left out.
#[test]
fn rounds_are_whole() {
    let scene = room(IntegratorSettings::default());
    let exact = picture(&scene, 16);
    let sensor = &scene.tables.sensors[0];
    let run = |budget, left| {
        let settings = VerifySettings { budget, paths: 16, ..FEW };
        verify(&scene, sensor, &exact, None, &settings, &Clock::new(left)).expect("light")
    };
    let checks = |budget, left| run(budget, left).map(|found| found.picture.checks);
    // A round takes one second by this clock: of three seconds one is for the last.
    let timed = checks(Budget::Time(Duration::from_secs(3)), u64::MAX).expect("not cancelled");
    assert_eq!(timed.len(), 768);
    assert_eq!(checks(Budget::Checks(768), u64::MAX), Some(timed.clone()));
    assert_eq!(checks(Budget::Time(Duration::from_secs(9)), 700), Some(timed[..512].to_vec()));
    assert_eq!(checks(Budget::Checks(768), 100), None);
    assert_eq!(checks(Budget::Checks(1000), u64::MAX).map(|c| c.len()), Some(1000));
}

#[test]
fn pictures_of_something_else_are_refused() {
    let scene = room(IntegratorSettings { kind: IntegratorKind::Depth, ..Default::default() });
    let depth = picture(&scene, 1);
    let sensor = &scene.tables.sensors[0];
    let clock = Clock::new(u64::MAX);
    let refused = verify(&scene, sensor, &depth, None, &FEW, &clock);
    assert_eq!(refused, Err(VerifyError::NoLight));
    let scene = room(IntegratorSettings::default());
    let mut narrow = depth;
    narrow.beauty.image.width = 8;
    let refused = verify(&scene, sensor, &narrow, None, &FEW, &clock);
    assert!(matches!(refused, Err(VerifyError::OtherFilm { .. })), "{refused:?}");
}
