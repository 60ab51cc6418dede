//! How many samples and rays per second one core computes in whole pictures.
//!
//! `cargo bench --bench render [-- SCENE…]` renders scenes of the folder `scenes/`. Times are CPU
//! times of the thread where the system tells them, medians of several renders with different
//! seeds; reading the scene and building what rendering needs are not counted. A sample is a whole
//! path, with a shadow ray at each of its vertices.

#[path = "../../../claror/benches/trace/clock.rs"]
mod clock;

use std::path::Path;
use std::time::Duration;

use claror::film::CropWindow;
use claror::render::{Observer, Progress, RenderSettings, RenderState, render};
use claror::scene::Scene;
use claror_io::scene::{LoadOptions, load};
use clock::Clock;

const SCENES: [&str; 3] = ["cornell-box", "interior", "lamp-hall"];
/// Columns of the pictures.
const WIDTH: u32 = 128;
const SPP: u32 = 64;
/// Renders per scene.
const ROUNDS: u64 = 5;

/// Never interrupts, says nothing.
struct Silent;

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

fn main() {
    // `cargo bench` passes `--bench`; anything else names scenes.
    let wanted: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    println!("{:<12} {:>10} {:>8} {:>11}", "scene", "samples/s", "rays/s", "rays/sample");
    for name in SCENES {
        if wanted.is_empty() || wanted.iter().any(|w| name.contains(w.as_str())) {
            one_thread.install(|| bench(name));
        }
    }
}

fn bench(name: &str) {
    let mut scene = scene(name);
    let film = &scene.tables.sensors[0].film;
    let samples = f64::from(film.width * film.height * SPP);
    let settings = RenderSettings { spp: Some(SPP), ..RenderSettings::default() };
    let clock = Clock::new();
    let mut rates: Vec<[f64; 2]> = (0..ROUNDS)
        .map(|seed| {
            scene.tables.sensors[0].sampler.seed = seed;
            let (seconds, output) = clock.time(|| render(&scene, 0, &settings, None, &Silent));
            [samples, output.expect("a sensor").rays as f64].map(|count| count / seconds)
        })
        .collect();
    rates.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let [samples, rays] = rates[rates.len() / 2];
    let (thousands, millions, each) = (samples / 1e3, rays / 1e6, rays / samples);
    println!("{name:<12} {thousands:>9.0}k {millions:>7.2}M {each:>11.2}");
}

/// A scene as it stands in its file, but for the size of the picture.
fn scene(name: &str) -> Scene {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../scenes/{name}.xml"));
    let loaded = load(&file, &LoadOptions::default());
    let mut tables = loaded.unwrap_or_else(|errors| panic!("{name}: {errors:?}")).tables;
    let film = &mut tables.sensors[0].film;
    film.height = WIDTH * film.height / film.width;
    film.width = WIDTH;
    film.crop = CropWindow { x: 0, y: 0, width: film.width, height: film.height };
    Scene::build(tables).expect("the scenes are sound")
}
