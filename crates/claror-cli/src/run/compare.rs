//! `claror compare`: how far two pictures differ.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use claror::image::Image;
use claror_io::Limits;
use claror_io::compare::{
    CompareError, ErrorMeasure, FlipOptions, FlipResult, Metrics, error_picture, flip, magma,
    metrics, ssim,
};
use claror_io::image::{self, BitDepth, Format, Layer, WriteError};
use serde_json::json;

use crate::args::{CompareArgs, ErrorKind, Metric};
use crate::exit::{Exit, Failure, describe};
use crate::messages::{Console, Report};
use crate::output::check_writable;
use crate::progress::{OnInterrupt, Phase};
use crate::signals::Interrupts;

/// Measures the difference, writes its picture, and judges it.
pub(crate) fn run(args: &CompareArgs, console: &Console) -> Result<Exit, Failure> {
    let error_format = args.error_image.as_deref().map(error_image_format).transpose()?;
    let interrupts = Interrupts::listen();
    let phase = Phase::start(console, &interrupts, "compare", OnInterrupt::Exit);
    let picture = read(&args.picture, args.layer.as_deref())?;
    let reference = read(&args.reference, args.layer.as_deref())?;
    let result = measure(&picture, &reference, args.exposure)
        .map_err(|error| Failure::new(Exit::CheckFailed, error.to_string()))?;
    if let Some((path, format)) = error_format {
        let image = difference(args, &picture, &reference, &result.1);
        write(path, format, &image)?;
    }
    phase.finish();
    let values = values(&result.0, &result.1, result.2);
    show(args, console, &result.0, result.2, &values);
    judge(args, &result.0, &values)
}

fn error_image_format(path: &Path) -> Result<(&Path, Format), Failure> {
    let format = Format::of_path(path).ok_or_else(|| {
        Failure::usage(format!("the ending of {} names no picture format", path.display()))
            .hint("the endings are .exr, .png, .hdr and .pfm")
    })?;
    check_writable(&[path])?;
    Ok((path, format))
}

/// Reads a picture as linear light.
fn read(path: &Path, layer: Option<&str>) -> Result<Image, Failure> {
    let limits = Limits::default();
    let decoded = match layer {
        Some(layer) => image::read_layer(path, layer, &limits)?,
        None => image::read(path, &limits)?,
    };
    Ok(decoded.into_linear())
}

fn measure(
    picture: &Image,
    reference: &Image,
    exposure: f32,
) -> Result<(Metrics, FlipResult, f64), CompareError> {
    let options = FlipOptions { exposure, ..FlipOptions::default() };
    let metrics = metrics(picture, reference)?;
    Ok((metrics, flip(picture, reference, &options)?, ssim(picture, reference)?))
}

/// The picture of the difference; sizes were compared before.
fn difference(args: &CompareArgs, picture: &Image, reference: &Image, flip: &FlipResult) -> Image {
    let measure = match args.error_kind {
        ErrorKind::Relative => ErrorMeasure::Relative,
        ErrorKind::Absolute => ErrorMeasure::Absolute,
        ErrorKind::Signed => ErrorMeasure::Signed,
        ErrorKind::Flip => {
            let colours = flip.map.data.iter().flat_map(|&v| magma(v).to_array());
            return Image { channels: 3, data: colours.collect(), ..flip.map.clone() };
        }
    };
    error_picture(picture, reference, measure, args.error_scale)
        .expect("pictures that were measured have the same size")
}

/// Writes a picture, whole or not at all.
pub(crate) fn write(path: &Path, format: Format, image: &Image) -> Result<(), Failure> {
    let fill = |w: &mut BufWriter<&File>| match format {
        Format::Exr => image::write_exr(w, &[Layer::new("", image)], &[]),
        Format::Png => image::write_png(w, image, 0.0, BitDepth::Eight),
        Format::Hdr => image::write_hdr(w, image),
        Format::Pfm => image::write_pfm(w, image),
    };
    claror_io::write::atomically(path, fill).map_err(|error| {
        let why = match &error {
            WriteError::Io(error) => describe(error),
            WriteError::Unsupported(message) => message.clone(),
        };
        Failure::new(Exit::File, format!("cannot write {}: {why}", path.display()))
    })
}

/// The measures in the order in which they are shown.
fn values(metrics: &Metrics, flip: &FlipResult, ssim: f64) -> [(Metric, f64); 8] {
    [
        (Metric::Mse, metrics.mse),
        (Metric::Relmse, metrics.rel_mse),
        (Metric::RelmseTrimmed, metrics.rel_mse_trimmed),
        (Metric::Mape, metrics.mape),
        (Metric::Mean, metrics.mean_error),
        (Metric::Max, metrics.max_error),
        (Metric::Flip, flip.mean),
        (Metric::Dssim, (1.0 - ssim) / 2.0),
    ]
}

fn name(metric: Metric) -> &'static str {
    match metric {
        Metric::Mse => "mse",
        Metric::Relmse => "relmse",
        Metric::RelmseTrimmed => "relmse-trimmed",
        Metric::Mape => "mape",
        Metric::Mean => "mean",
        Metric::Max => "max",
        Metric::Flip => "flip",
        Metric::Dssim => "dssim",
    }
}

fn meaning(metric: Metric) -> &'static str {
    match metric {
        Metric::Mse => "mean of (a - b)²",
        Metric::Relmse => "mean of (a - b)² / (b² + 0.01)",
        Metric::RelmseTrimmed => "the same without the worst 0.1 % of the pixels",
        Metric::Mape => "mean of |a - b| / (|b| + 0.01)",
        Metric::Mean => "mean of a - b",
        Metric::Max => "largest |a - b|",
        Metric::Flip => "visible difference, 0 to 1",
        Metric::Dssim => "(1 - SSIM) / 2: difference of structure, 0 to 1",
    }
}

fn show(
    args: &CompareArgs,
    console: &Console,
    metrics: &Metrics,
    ssim: f64,
    values: &[(Metric, f64)],
) {
    let (a, b) = (args.picture.display(), args.reference.display());
    console.result(&format!("a = {a}, b = {b}"));
    for (metric, value) in values {
        console.result(&format!("{:15} {value:<14.6e} {}", name(*metric), meaning(*metric)));
    }
    console.result(&format!("{:15} {ssim:<14.6} structural similarity, 1 is equal", "ssim"));
    let [r, g, b] = metrics.channel_ratio;
    console.result(&format!("{:15} {r:.6} {g:.6} {b:.6}", "a / b per colour"));
    if let Some(path) = &args.error_image {
        console.result(&path.display().to_string());
    }
    let mut object = json!({
        "event": "result",
        "a": args.picture.to_string_lossy(),
        "b": args.reference.to_string_lossy(),
        "pixels": metrics.pixels,
        "channel_ratio": metrics.channel_ratio,
        "ssim": ssim,
        "non_finite_a": metrics.non_finite,
        "non_finite_b": metrics.non_finite_reference,
        "error_image": args.error_image.as_ref().map(|path| path.to_string_lossy()),
    });
    for (metric, value) in values {
        object[name(*metric).replace('-', "_")] = json!(value);
    }
    console.event(&object);
    let non_finite =
        [(&args.picture, metrics.non_finite), (&args.reference, metrics.non_finite_reference)];
    for (path, count) in non_finite.into_iter().filter(|(_, count)| *count > 0) {
        console.warning(&Report::warning(non_finite_message(path, count)));
    }
}

fn non_finite_message(path: &Path, count: usize) -> String {
    let pixels = crate::units::plural(count as u64, "pixel");
    format!("{}: {pixels} NaN or infinite, not compared", path.display())
}

/// Fails if a measure is above what was allowed, or if it leaves out pixels of the picture.
fn judge(args: &CompareArgs, metrics: &Metrics, values: &[(Metric, f64)]) -> Result<Exit, Failure> {
    let mut reports = Vec::new();
    for (metric, limit) in &args.fail_above {
        let value = values.iter().find(|(m, _)| m == metric).map_or(f64::NAN, |(_, v)| v.abs());
        if value.is_nan() || value > *limit {
            let name = name(*metric);
            reports.push(Report::error(format!("{name} {value} is above {limit}")));
        }
    }
    if !args.fail_above.is_empty() && metrics.non_finite > 0 {
        let message = non_finite_message(&args.picture, metrics.non_finite);
        reports.push(Report::error(message));
    }
    if reports.is_empty() {
        return Ok(Exit::Success);
    }
    Err(Failure { exit: Exit::CheckFailed, reports })
}
