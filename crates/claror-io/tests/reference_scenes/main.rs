//! Renders every scene of a folder that holds reference pictures of an independent renderer, and
//! compares by z-tests (see `verdict.rs`).
//!
//! The folder is `../shared/scenes` beside the checkout, or what `CLAROR_REFERENCE_SCENES` names;
//! `CLAROR_REFERENCE_FILTER` renders only the scenes whose path contains it. A scene is a folder
//! with `scene.xml`, `ref.exr` and `ref.json`; `exact.exr` takes the place of `ref.exr` where
//! there is one, and `ref_d2.exr` is the picture with `max_depth` 2. Where the folder does not
//! exist, the test says so and passes.
//!
//! Our noise is measured from renders with different seeds. The reference's noise is known as one
//! number, the relMSE of the picture; it is spread over the pixels as the variance of our own
//! samples is.

mod verdict;

use std::path::{Path, PathBuf};
use std::time::Duration;

use claror::image::Image;
use claror::render::{Observer, Progress, RenderSettings, RenderState, render};
use claror::scene::Scene;
use claror_io::Limits;
use claror_io::scene::{LoadOptions, load};
use verdict::{Estimate, Verdict};

/// Renders with different seeds per scene.
const SEEDS: u64 = 8;
/// Samples of all pixels and seeds together, about.
const SAMPLES: usize = 3 << 20;

/// One picture to compare.
struct Case {
    folder: PathBuf,
    /// `ref`, `ref_d2`, …
    name: String,
    max_depth: Option<u32>,
}

/// No clock, never cancelled, silent.
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

fn root() -> PathBuf {
    std::env::var_os("CLAROR_REFERENCE_SCENES").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/scenes"),
        PathBuf::from,
    )
}

/// All pictures below `folder`, sorted by path.
fn cases(folder: &Path, found: &mut Vec<Case>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    let mut paths: Vec<PathBuf> = entries.flatten().map(|e| e.path()).collect();
    paths.sort();
    if folder.join("scene.xml").is_file() {
        for (name, max_depth) in
            [("ref", None), ("ref_d2", Some(2)), ("ref_d3", Some(3)), ("ref_d4", Some(4))]
        {
            if folder.join(format!("{name}.exr")).is_file() {
                found.push(Case { folder: folder.to_owned(), name: name.to_owned(), max_depth });
            }
        }
    }
    for path in paths.into_iter().filter(|p| p.is_dir()) {
        cases(&path, found);
    }
}

fn rgb(image: &Image) -> Vec<[f64; 3]> {
    let n = image.channels;
    let channel = |c: usize| if n < 3 { 0 } else { c };
    image.data.chunks_exact(n).map(|p| [0, 1, 2].map(|c| f64::from(p[channel(c)]))).collect()
}

/// The reference picture; its variance has the shape of `shape` and the stated size.
fn reference(case: &Case, shape: &[[f64; 3]]) -> Result<Estimate, String> {
    let exact = case.folder.join("exact.exr");
    let is_exact = case.name == "ref" && exact.is_file();
    let path = if is_exact { exact } else { case.folder.join(format!("{}.exr", case.name)) };
    let image = claror_io::image::read(&path, &Limits::default()).map_err(|e| e.to_string())?.image;
    let mean = rgb(&image);
    let (width, height) = (image.width, image.height);
    if shape.len() != mean.len() {
        return Err(format!("the reference has {} pixels, ours {}", mean.len(), shape.len()));
    }
    let stated = if is_exact { 0.0 } else { stated_noise(case)? };
    let relative: f64 = mean
        .iter()
        .zip(shape)
        .map(|(m, v)| (0..3).map(|c| v[c] / (m[c] * m[c] + 0.01)).sum::<f64>() / 3.0)
        .sum::<f64>()
        / mean.len() as f64;
    let scale = if relative > 0.0 { stated / relative } else { 0.0 };
    // Where most pixels have no noise at all with us (a diffuse sphere in a uniform sky), our
    // variance says nothing about the reference's: then every pixel has at least the stated
    // relative noise.
    let is_silent = |(v, m): &(&[f64; 3], &[f64; 3])| (0..3).all(|c| v[c] <= 1e-9 * m[c] * m[c]);
    let is_uninformative = 2 * shape.iter().zip(&mean).filter(is_silent).count() > mean.len();
    let floor = if is_uninformative { stated } else { 0.0 };
    let spread = |(v, m): (&[f64; 3], &[f64; 3])| {
        [0, 1, 2].map(|c| (v[c] * scale).max(floor * (m[c] * m[c] + 0.01)))
    };
    let variance = shape.iter().zip(&mean).map(spread).collect();
    Ok(Estimate { width, height, mean, variance })
}

/// relMSE of the reference picture, from the file beside it.
fn stated_noise(case: &Case) -> Result<f64, String> {
    let path = case.folder.join("ref.json");
    let text = std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let json: serde_json::Value = serde_json::from_str(&text).map_err(|e| e.to_string())?;
    json[&case.name]["relmse_of_mean_estimate"]
        .as_f64()
        .ok_or_else(|| format!("{}: no relmse_of_mean_estimate of {}", path.display(), case.name))
}

/// Mean and variance of the mean over the seeds, and the mean variance of single samples.
fn ours(case: &Case) -> Result<(Estimate, Vec<[f64; 3]>), String> {
    let mut options = LoadOptions::default();
    if let Some(depth) = case.max_depth {
        options.defines.push(("max_depth".to_owned(), depth.to_string()));
    }
    let loaded = load(&case.folder.join("scene.xml"), &options)
        .map_err(|all| all.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))?;
    let mut scene = Scene::build(loaded.tables).map_err(|e| e.to_string())?;
    let crop = scene.tables.sensors[0].film.crop;
    let pixels = crop.width as usize * crop.height as usize;
    let spp = (SAMPLES / pixels / SEEDS as usize).clamp(2, 256) as u32;
    let mut sum = vec![[0.0; 3]; pixels];
    let mut squares = vec![[0.0; 3]; pixels];
    let mut shape = vec![[0.0; 3]; pixels];
    for seed in 0..SEEDS {
        scene.tables.sensors[0].sampler.seed = seed;
        let settings = RenderSettings { spp: Some(spp), ..RenderSettings::default() };
        let output = render(&scene, 0, &settings, None, &Silent).map_err(|e| e.to_string())?;
        if output.non_finite.count > 0 {
            return Err(format!("{} samples are not finite", output.non_finite.count));
        }
        let variance = rgb(&output.picture.variance.image);
        for (i, value) in rgb(&output.picture.beauty.image).iter().enumerate() {
            for c in 0..3 {
                sum[i][c] += value[c];
                squares[i][c] += value[c] * value[c];
                shape[i][c] += variance[i][c];
            }
        }
    }
    let n = SEEDS as f64;
    let mean: Vec<[f64; 3]> = sum.iter().map(|s| s.map(|v| v / n)).collect();
    let variance = squares
        .iter()
        .zip(&mean)
        .map(|(s, m)| [0, 1, 2].map(|c| (s[c] / n - m[c] * m[c]).max(0.0) / (n - 1.0)))
        .collect();
    let (width, height) = (crop.width as usize, crop.height as usize);
    Ok((Estimate { width, height, mean, variance }, shape))
}

fn judge(case: &Case) -> Result<Verdict, String> {
    let (ours, shape) = ours(case)?;
    Ok(Verdict::new(&ours, &reference(case, &shape)?))
}

#[test]
fn pictures_equal_those_of_an_independent_renderer() {
    let root = root();
    let mut all = Vec::new();
    cases(&root, &mut all);
    if all.is_empty() {
        println!("skipped: no reference scenes in {}", root.display());
        return;
    }
    let filter = std::env::var("CLAROR_REFERENCE_FILTER").unwrap_or_default();
    let mut failed = Vec::new();
    for case in &all {
        let name = format!(
            "{}/{}",
            case.folder.strip_prefix(&root).unwrap_or(&case.folder).display(),
            case.name
        );
        if !name.contains(&filter) {
            continue;
        }
        let line = match judge(case) {
            Ok(v) if v.passes() => format!("ok      {name:42} {v}"),
            Ok(v) => {
                failed.push(name.clone());
                format!("FAILED  {name:42} {v}")
            }
            Err(e) => {
                failed.push(name.clone());
                format!("FAILED  {name:42} {e}")
            }
        };
        println!("{line}");
    }
    assert!(failed.is_empty(), "{} of {}: {}", failed.len(), all.len(), failed.join(", "));
}
