//! Measures on linear pictures.

use claror::image::Image;

use super::{CompareError, check_sizes, colors};

/// Added to squares, and to magnitudes, of the reference before one divides by them, so that
/// black pixels do not decide everything.
pub(super) const EPSILON: f64 = 0.01;

/// The share of pixels with the largest errors that the trimmed measure leaves out.
const TRIMMED: f64 = 0.001;

/// How a picture `x` differs from a reference `r`. Means are over all channels of the pixels that
/// are finite in both.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Metrics {
    /// All pixels.
    pub pixels: usize,
    /// Pixels with NaN or infinity in the picture.
    pub non_finite: usize,
    /// Pixels with NaN or infinity in the reference.
    pub non_finite_reference: usize,
    /// Mean of (x - r)².
    pub mse: f64,
    /// Mean of (x - r)² / (r² + 0.01).
    pub rel_mse: f64,
    /// The same without the worst 0.1 % of the pixels.
    pub rel_mse_trimmed: f64,
    /// Mean of |x - r| / (|r| + 0.01).
    pub mape: f64,
    /// Mean of x - r: the bias.
    pub mean_error: f64,
    /// Largest |x - r|.
    pub max_error: f64,
    /// Per channel the mean of x over the mean of r; 1 where both are 0.
    pub channel_ratio: [f64; 3],
}

/// Compares `picture` with `reference`.
pub fn metrics(picture: &Image, reference: &Image) -> Result<Metrics, CompareError> {
    check_sizes(picture, reference)?;
    let mut m = Metrics { pixels: picture.width * picture.height, ..Metrics::default() };
    let mut sums = [[0.0_f64; 3]; 2];
    let mut pixel_errors = Vec::with_capacity(m.pixels);
    for (x, r) in colors(picture).zip(colors(reference)) {
        m.non_finite += usize::from(!x.is_finite());
        m.non_finite_reference += usize::from(!r.is_finite());
        if !x.is_finite() || !r.is_finite() {
            continue;
        }
        let mut rel_mse = 0.0;
        for (channel, (x, r)) in x.to_array().into_iter().zip(r.to_array()).enumerate() {
            let (x, r) = (f64::from(x), f64::from(r));
            let error = x - r;
            m.mse += error * error;
            rel_mse += error * error / (r * r + EPSILON);
            m.mape += error.abs() / (r.abs() + EPSILON);
            m.mean_error += error;
            m.max_error = m.max_error.max(error.abs());
            sums[0][channel] += x;
            sums[1][channel] += r;
        }
        pixel_errors.push(rel_mse / 3.0);
    }
    let values = 3.0 * pixel_errors.len().max(1) as f64;
    for sum in [&mut m.mse, &mut m.mape, &mut m.mean_error] {
        *sum /= values;
    }
    m.channel_ratio = std::array::from_fn(|c| ratio(sums[0][c], sums[1][c]));
    m.rel_mse = mean(&pixel_errors);
    pixel_errors.sort_by(f64::total_cmp);
    let kept = (pixel_errors.len() as f64 * (1.0 - TRIMMED)).max(1.0) as usize;
    m.rel_mse_trimmed = mean(&pixel_errors[..kept.min(pixel_errors.len())]);
    Ok(m)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

fn ratio(a: f64, b: f64) -> f64 {
    if a == 0.0 && b == 0.0 { 1.0 } else { a / b }
}
