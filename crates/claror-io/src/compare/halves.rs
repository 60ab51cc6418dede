//! Comparing with a reference that is itself noisy: the mean of two independent halves.

use claror::image::Image;
use claror::spectrum::Rgb;

use super::metrics::EPSILON;
use super::{CompareError, check_sizes, colors};

/// Relative mean squared error of a picture x, free of the reference's own noise: mean of
/// (x - a)(x - b) / (r² + 0.01) over all channels, where a and b are the halves and r is their
/// mean. The noise of a and of b is independent, so its product vanishes in the mean: without it
/// this is the relative mean squared error. It can be below 0 by chance. Pixels with NaN or
/// infinity are left out.
pub fn rel_mse_from_halves(picture: &Image, halves: [&Image; 2]) -> Result<f64, CompareError> {
    check_sizes(picture, halves[0])?;
    check_sizes(picture, halves[1])?;
    let [a, b] = halves.map(colors);
    let pixels = colors(picture).zip(a.zip(b)).map(|(x, (a, b))| (x, a, b));
    Ok(mean_over_channels(pixels, |x, a, b| {
        let r = 0.5 * (a + b);
        (x - a) * (x - b) / (r * r + EPSILON)
    }))
}

/// Relative mean squared error of the mean of two independent halves, from their difference:
/// mean of (a - b)² / 4 / (r² + 0.01).
pub fn rel_mse_of_halves(halves: [&Image; 2]) -> Result<f64, CompareError> {
    check_sizes(halves[0], halves[1])?;
    let [a, b] = halves.map(colors);
    Ok(mean_over_channels(a.zip(b).map(|(a, b)| (a, a, b)), |_, a, b| {
        let r = 0.5 * (a + b);
        (a - b) * (a - b) / 4.0 / (r * r + EPSILON)
    }))
}

/// Mean of the halves.
pub fn mean_of_halves(halves: [&Image; 2]) -> Result<Image, CompareError> {
    check_sizes(halves[0], halves[1])?;
    let [a, b] = halves.map(colors);
    let data = a.zip(b).flat_map(|(a, b)| ((a + b) * 0.5).to_array()).collect();
    Ok(Image { width: halves[0].width, height: halves[0].height, channels: 3, data })
}

fn mean_over_channels(
    pixels: impl Iterator<Item = (Rgb, Rgb, Rgb)>,
    f: impl Fn(f64, f64, f64) -> f64,
) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for (x, a, b) in pixels.filter(|(x, a, b)| x.is_finite() && a.is_finite() && b.is_finite()) {
        let [x, a, b] = [x, a, b].map(|c| c.to_array().map(f64::from));
        sum += (0..3).map(|c| f(x[c], a[c], b[c])).sum::<f64>();
        count += 3;
    }
    sum / count.max(1) as f64
}
