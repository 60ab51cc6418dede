//! Further pictures of a setting: what its cache holds.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use claror::image::Image;
use claror_io::Limits;
use claror_io::compare::magma;
use claror_io::image::{BitDepth, WriteError, read_layer, write_png};

use crate::error::LabError;
use crate::folder::{read_json, write_json};
use crate::lab::{Job, Lab, Measurement, arguments, text};
use crate::study::Illustration;

/// How a layer becomes a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Look {
    /// As light, over π: what a white surface shows.
    Light,
    /// False colours from 0 to nearly the largest value.
    Magnitude,
}

/// A layer of the program, what it shows, and how.
type Shown = (&'static str, &'static str, Look);

const LAYERS: [Shown; 4] = [
    ("irradiance", "irradiance", Look::Light),
    ("harmonic_mean_distance", "harmonic mean distance", Look::Magnitude),
    ("record_radius", "radii of the records", Look::Magnitude),
    ("record_count", "records per point", Look::Magnitude),
];
const POINTS: &str = "records.png";
const LAYERS_FILE: &str = "layers.exr";
const NOTE: &str = "illustrations.json";
/// Share of the pixels that a scale of false colours covers.
const COVERED: f64 = 0.99;

/// The pictures of a finished run, made in a run of its own. Of integrators without a cache there
/// are none.
///
/// # Errors
/// If the user stops it or the folder cannot be written.
pub(crate) fn obtain(
    lab: &Lab,
    job: &Job,
    run: &Measurement,
) -> Result<Result<Vec<Illustration>, String>, LabError> {
    let folder = lab.folder.path(&job.id).join("pictures");
    if let Some(found) = read_json(&folder.join(NOTE)) {
        return Ok(Ok(found));
    }
    let integrator = run.parameters.get("integrator.type").map(String::as_str);
    let shown = match integrator {
        Some("irrcache") => &LAYERS[..],
        // Its points can be drawn, but they hold no layers.
        Some("gridcache") => &[],
        _ => return Ok(Ok(Vec::new())),
    };
    if lab.options.report_only {
        return Ok(Ok(Vec::new()));
    }
    if lab.watch.cancelled() {
        return Err(LabError::Interrupted);
    }
    std::fs::create_dir_all(&folder).map_err(LabError::file("cannot make folder", &folder))?;
    let layers = folder.join(LAYERS_FILE);
    let points = folder.join(POINTS);
    let scene = &lab.scenes[job.scene];
    let mut command = lab.command(scene, &arguments(lab.options, scene, job));
    if !shown.is_empty() {
        let names: Vec<&str> = shown.iter().map(|layer| layer.0).collect();
        command.extend(["--aov".to_owned(), names.join(",")]);
    }
    let files = ["--show-points", &text(&points), "-o", &text(&layers), "--json"];
    command.extend(files.map(str::to_owned));
    let finished = lab.process(&command, &layers, &|_| {})?;
    if finished.stopped {
        return Err(LabError::Interrupted);
    }
    if finished.code != Some(0) {
        return Ok(Err(format!("further pictures: {}", finished.message())));
    }
    match paint_all(lab.folder.root(), &folder, shown) {
        Ok(found) => {
            // Only what is shown is kept.
            let _ = std::fs::remove_file(&layers);
            write_json(&folder.join(NOTE), &found)?;
            Ok(Ok(found))
        }
        Err(message) => Ok(Err(message)),
    }
}

/// Pictures of the points and of the layers in a folder, with paths relative to `root`.
fn paint_all(root: &Path, folder: &Path, shown: &[Shown]) -> Result<Vec<Illustration>, String> {
    let relative = |path: &Path| path.strip_prefix(root).unwrap_or(path).to_owned();
    let mut found = Vec::new();
    let points = folder.join(POINTS);
    if points.is_file() {
        let title = if shown.is_empty() { "grid points" } else { "records" };
        found.push(Illustration { title: title.to_owned(), picture: relative(&points) });
    }
    for &(layer, title, look) in shown {
        let picture = paint(&folder.join(LAYERS_FILE), layer, look, folder)
            .map_err(|message| format!("picture of the {title}: {message}"))?;
        found.push(Illustration { title: title.to_owned(), picture: relative(&picture) });
    }
    Ok(found)
}

/// Writes a layer of a file as PNG.
fn paint(file: &Path, layer: &str, look: Look, folder: &Path) -> Result<PathBuf, String> {
    let decoded = read_layer(file, layer, &Limits::default()).map_err(|e| e.to_string())?;
    let image = match look {
        Look::Light => decoded.image,
        Look::Magnitude => false_colours(&decoded.image),
    };
    let stops = if look == Look::Light { -std::f32::consts::PI.log2() } else { 0.0 };
    let path = folder.join(format!("{layer}.png"));
    let fill = |w: &mut BufWriter<&File>| -> Result<(), WriteError> {
        write_png(w, &image, stops, BitDepth::Eight)
    };
    claror_io::write::atomically(&path, fill).map_err(|error| format!("{error:?}"))?;
    Ok(path)
}

/// The first channel in false colours, black where there is nothing.
fn false_colours(image: &Image) -> Image {
    let values: Vec<f32> = image.data.chunks_exact(image.channels.max(1)).map(|p| p[0]).collect();
    let mut sorted: Vec<f32> =
        values.iter().copied().filter(|v| *v > 0.0 && v.is_finite()).collect();
    sorted.sort_by(f32::total_cmp);
    let last = sorted.len().saturating_sub(1);
    let largest = sorted.get((last as f64 * COVERED) as usize).copied().unwrap_or(1.0);
    let share = |v: f32| if v.is_finite() { (v / largest).clamp(0.0, 1.0) } else { 0.0 };
    let data = values.iter().flat_map(|&v| magma(share(v)).to_array()).collect();
    Image { width: image.width, height: image.height, channels: 3, data }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn false_colours_rise_and_bear_anything() {
        let data = vec![0.0, 1.0, 2.0, f32::NAN, f32::INFINITY, -1.0];
        let image = Image { width: 6, height: 1, channels: 1, data };
        let painted = false_colours(&image);
        let grey = |x: usize| painted.pixel(x, 0).iter().sum::<f32>();
        assert!(grey(0) < grey(1) && grey(1) <= grey(2));
        assert_eq!([grey(3), grey(5)], [grey(0); 2]);
        assert!(painted.data.iter().all(|v| v.is_finite()));
        let black = false_colours(&Image::new(3, 1, 1));
        assert!(black.data.iter().all(|v| v.is_finite()));
    }
}
