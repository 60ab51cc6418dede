use std::sync::atomic::{AtomicU64, Ordering};

use super::*;
use crate::bytes::BytesError;
use crate::film::{FilterKind, LAYER_NAMES};
use crate::integrator::{Aov, AovKind, IntegratorKind};
use crate::math::DVec3;
use crate::scene::test_scene::{TestScene, mixed_room};
use crate::spectrum::Rgb;

/// Cancels after a number of questions, and tells a time that advances with each question.
struct Quiet {
    questions: AtomicU64,
    cancel_after: u64,
    nanoseconds_per_question: u64,
}

impl Quiet {
    fn new() -> Self {
        Self { questions: AtomicU64::new(0), cancel_after: u64::MAX, nanoseconds_per_question: 0 }
    }
}

impl Observer for Quiet {
    fn elapsed(&self) -> Duration {
        let questions = self.questions.fetch_add(1, Ordering::Relaxed);
        Duration::from_nanos(questions * self.nanoseconds_per_question)
    }
    fn is_cancelled(&self) -> bool {
        self.questions.fetch_add(1, Ordering::Relaxed) >= self.cancel_after
    }
    fn progress(&self, progress: &Progress) {
        assert!(progress.target_samples.is_none_or(|n| progress.samples <= n));
    }
    fn checkpoint(&self, _: &RenderState) {}
}

fn scene() -> Scene {
    let mut t = mixed_room(40);
    t.tables.aovs = [AovKind::Albedo, AovKind::ShapeIndex]
        .map(|kind| Aov { name: kind.default_layer().to_owned(), kind })
        .to_vec();
    let film = &mut t.tables.sensors[0].film;
    film.filter = FilterKind::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 };
    film.crop.x = 3;
    film.crop.width = 30;
    t.build()
}

fn spp(n: u32) -> RenderSettings {
    RenderSettings { spp: Some(n), ..Default::default() }
}

fn on_threads<T: Send>(threads: usize, f: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(f)
}

#[test]
fn thread_counts_do_not_matter() {
    let scene = scene();
    let render_on =
        |threads| on_threads(threads, || render(&scene, 0, &spp(6), None, &Quiet::new()).unwrap());
    let one = render_on(1);
    assert_eq!(one.stop, StopReason::Samples);
    for threads in [2, 3, 7] {
        let other = render_on(threads);
        assert_eq!(other.state.to_bytes(), one.state.to_bytes(), "{threads} threads");
        assert_eq!(other.picture, one.picture);
        assert_eq!(other.rays, one.rays);
    }
}

/// Interrupted anywhere and continued, by way of bytes and on another number of threads, a render
/// has the bits of an uninterrupted one.
#[test]
fn interruptions_do_not_matter() {
    let scene = scene();
    let whole = render(&scene, 0, &spp(9), None, &Quiet::new()).unwrap();
    for cancel_after in [0, 1, 500, 3000, 5777] {
        let observer = Quiet { cancel_after, ..Quiet::new() };
        let part = on_threads(2, || render(&scene, 0, &spp(9), None, &observer).unwrap());
        assert_eq!(part.stop, StopReason::Cancelled);
        assert!(part.spp < 9);
        let state = RenderState::from_bytes(&part.state.to_bytes()).unwrap();
        assert_eq!(state, part.state);
        let rest =
            on_threads(3, || render(&scene, 0, &spp(9), Some(state), &Quiet::new()).unwrap());
        assert_eq!(rest.state.to_bytes(), whole.state.to_bytes(), "after {cancel_after}");
    }
    let first = render(&scene, 0, &spp(5), None, &Quiet::new()).unwrap();
    let more = render(&scene, 0, &spp(9), Some(first.state), &Quiet::new()).unwrap();
    assert_eq!(more.state.to_bytes(), whole.state.to_bytes());
}

/// Wants a checkpoint after every third tile, and keeps them all.
#[derive(Default)]
struct Restless {
    tiles: AtomicU64,
    states: std::sync::Mutex<Vec<Vec<u8>>>,
}

impl Observer for Restless {
    fn elapsed(&self) -> Duration {
        Duration::ZERO
    }
    fn is_cancelled(&self) -> bool {
        false
    }
    fn progress(&self, _: &Progress) {}
    fn checkpoint(&self, state: &RenderState) {
        self.states.lock().unwrap().push(state.to_bytes());
    }
    fn is_checkpoint_due(&self) -> bool {
        self.tiles.fetch_add(1, Ordering::Relaxed) % 3 == 2
    }
}

/// A checkpoint may be taken at any moment; neither the picture nor when it is done changes.
#[test]
fn pauses_do_not_matter() {
    let scene = scene();
    let settings = RenderSettings { target_error: Some(0.2), ..spp(64) };
    let whole = render(&scene, 0, &settings, None, &Quiet::new()).unwrap();
    let observer = Restless::default();
    let paused = on_threads(2, || render(&scene, 0, &settings, None, &observer).unwrap());
    assert_eq!(paused.state.to_bytes(), whole.state.to_bytes());
    assert_eq!((paused.stop, paused.rays), (whole.stop, whole.rays));
    let states = observer.states.into_inner().unwrap();
    assert!(states.len() > 8, "{} states", states.len());
    for bytes in states.iter().step_by(3) {
        let state = RenderState::from_bytes(bytes).unwrap();
        let rest = render(&scene, 0, &settings, Some(state), &Quiet::new()).unwrap();
        assert_eq!(rest.state.to_bytes(), whole.state.to_bytes());
    }
}

#[test]
fn layers_sum_to_the_beauty() {
    let mut scene = scene();
    scene.tables.sensors[0].film.filter = FilterKind::Gaussian { stddev: 0.5 };
    let output = render(&scene, 0, &spp(5), None, &Quiet::new()).unwrap();
    let p = &output.picture;
    let names: Vec<&str> = p.parts.iter().map(|l| l.name.as_str()).collect();
    assert_eq!(names, LAYER_NAMES);
    let mut lit = [false; 4];
    for y in 0..40 {
        for x in 0..30 {
            for c in 0..3 {
                let part = |i: usize| p.parts[i].image.pixel(x, y)[c];
                let sum = ((part(0) + part(1)) + part(2)) + part(3);
                assert_eq!(sum.to_bits(), p.beauty.image.pixel(x, y)[c].to_bits());
                for (i, lit) in lit.iter_mut().enumerate() {
                    *lit |= part(i) > 0.0;
                }
            }
        }
    }
    assert_eq!(lit, [true; 4], "every part has light in this scene");
    assert!(p.beauty.image.data.iter().skip(3).step_by(4).all(|&a| (a - 1.0).abs() < 1e-6));
    assert!(p.samples.image.data.iter().all(|&n| n == 5.0));
    let ids = &p.aovs[1].image.data;
    assert!(ids.iter().all(|&id| [0.0, 1.0, 2.0, 3.0].contains(&id)) && ids.contains(&2.0));
}

#[test]
fn other_renders_are_not_continued() {
    let state = render(&scene(), 0, &spp(1), None, &Quiet::new()).unwrap().state;
    let mut other = scene();
    other.tables.integrator.max_depth = Some(3);
    let error = render(&other, 0, &spp(1), Some(state.clone()), &Quiet::new()).unwrap_err();
    assert_eq!(error.to_string(), "the state to continue has max_depth none, this render has 3");
    let hashed = RenderSettings { scene_hash: Some("abc".to_owned()), ..spp(1) };
    let error = render(&scene(), 0, &hashed, Some(state), &Quiet::new()).unwrap_err();
    assert!(matches!(error, RenderError::StateMismatch { what, .. } if what == "scene"));
}

#[test]
fn impossible_requests_are_refused() {
    let mut scene = scene();
    let error = render(&scene, 1, &spp(1), None, &Quiet::new()).unwrap_err();
    assert_eq!(error, RenderError::NoSensor { wanted: 1, count: 1 });
    scene.tables.sensors[0].film.crop.x = 11;
    let error = render(&scene, 0, &spp(1), None, &Quiet::new()).unwrap_err();
    assert!(matches!(error, RenderError::BadCrop { .. }));
    scene.tables.sensors[0].film.crop.x = 3;
    scene.tables.aovs.push(Aov { name: "E".to_owned(), kind: AovKind::Irradiance });
    let error = render(&scene, 0, &spp(1), None, &Quiet::new()).unwrap_err();
    assert_eq!(error, RenderError::NoCache { name: "E".to_owned() });
}

#[test]
fn limits_stop_a_render() {
    let scene = scene();
    // Without limits the sampler's count holds: 16.
    let output = render(&scene, 0, &RenderSettings::default(), None, &Quiet::new()).unwrap();
    assert_eq!((output.stop, output.spp), (StopReason::Samples, 16));
    let loose = RenderSettings { target_error: Some(2.0 * output.error), ..Default::default() };
    let early = render(&scene, 0, &loose, None, &Quiet::new()).unwrap();
    assert!(early.stop == StopReason::Error && early.spp < 16 && early.spp >= 2);
    // One microsecond per question, over a thousand questions per round.
    let timed = RenderSettings { max_seconds: Some(5e-3), ..Default::default() };
    let observer = Quiet { nanoseconds_per_question: 1000, ..Quiet::new() };
    let output = render(&scene, 0, &timed, None, &observer).unwrap();
    assert_eq!(output.stop, StopReason::Time);
    assert!((1..=8).contains(&output.spp));
    // However short the time, every pixel gets a sample.
    let timed = RenderSettings { max_seconds: Some(0.0), ..Default::default() };
    let output = render(&scene, 0, &timed, None, &Quiet::new()).unwrap();
    assert_eq!((output.stop, output.spp), (StopReason::Time, 1));
}

/// Light that overflows is counted, with its first place, and does not spread.
#[test]
fn infinite_samples_are_counted() {
    let mut t = TestScene::default();
    let white = t.diffuse(Rgb::splat(0.9));
    let room = t.room(white);
    t.emit(room, Rgb::splat(2e38));
    t.camera(DVec3::ZERO, DVec3::Z, 90.0, 20);
    let scene = t.build();
    let render_on =
        |threads| on_threads(threads, || render(&scene, 0, &spp(4), None, &Quiet::new()).unwrap());
    let output = render_on(1);
    assert!(output.non_finite.count > 100, "{:?}", output.non_finite);
    let (row, _, _) = output.non_finite.first.unwrap();
    assert_eq!(row, 0);
    assert!(output.picture.beauty.image.data.iter().all(|v| v.is_finite()));
    assert_eq!(render_on(3).non_finite, output.non_finite);
}

#[test]
fn broken_states_are_refused() {
    let scene = scene();
    let bytes = render(&scene, 0, &spp(1), None, &Quiet::new()).unwrap().state.to_bytes();
    for cut in (0..bytes.len()).step_by(bytes.len() / 50) {
        assert!(RenderState::from_bytes(&bytes[..cut]).is_err(), "cut to {cut}");
    }
    let mut long = bytes.clone();
    long.push(0);
    assert_eq!(RenderState::from_bytes(&long), Err(BytesError::TrailingBytes));
    let huge = [&0_u32.to_le_bytes()[..], &[0xff; 20]].concat();
    assert_eq!(RenderState::from_bytes(&huge), Err(BytesError::BadLength));
}

/// The four integrators fill a film, and depth is what it says.
#[test]
fn other_integrators_render() {
    let mut scene = scene();
    scene.tables.integrator.kind = IntegratorKind::Depth;
    let output = render(&scene, 0, &spp(2), None, &Quiet::new()).unwrap();
    assert!(output.picture.beauty.image.pixel(15, 20)[0] > 0.5);
    scene.tables.integrator.kind = IntegratorKind::Direct { emitter_samples: 1, bsdf_samples: 1 };
    let output = render(&scene, 0, &spp(2), None, &Quiet::new()).unwrap();
    assert!(output.picture.parts[2].image.data.iter().all(|&v| v == 0.0));
    assert!(output.picture.parts[1].image.data.iter().any(|&v| v > 0.0));
}
