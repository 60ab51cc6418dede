//! SSIM: how similar the structure of two pictures is.
//!
//! Wang, Bovik, Sheikh, Simoncelli 2004: Image quality assessment: from error visibility to
//! structural similarity. Equation and section numbers refer to it.

use claror::image::Image;

use super::{CompareError, check_sizes, colors};
use crate::image::linear_to_srgb;

/// Half the width of the window, and its standard deviation in pixels (section III-C).
const RADIUS: usize = 5;
const DEVIATION: f64 = 1.5;
/// Constants that keep the quotients stable where mean or contrast is 0, for values in [0, 1].
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// Mean structural similarity (equation 17) of what a screen shows: luminance of the linear
/// colours, cut off at 1, in the encoding of sRGB. 1 is equal. Windows reach over the border only
/// in pictures smaller than a window, where the border pixels continue. What is not finite counts
/// as black.
pub fn ssim(picture: &Image, reference: &Image) -> Result<f64, CompareError> {
    check_sizes(picture, reference)?;
    let size = (picture.width, picture.height);
    let [x, y] = [picture, reference].map(shown_luminance);
    let mean = |f: &dyn Fn(f64, f64) -> f64| {
        let plane: Vec<f64> = x.iter().zip(&y).map(|(&x, &y)| f(x, y)).collect();
        blur(&plane, size)
    };
    let means = [mean(&|x, _| x), mean(&|_, y| y)];
    let squares = [mean(&|x, _| x * x), mean(&|_, y| y * y)];
    let products = mean(&|x, y| x * y);
    let similarity = |i: usize| {
        let (mx, my) = (means[0][i], means[1][i]);
        let (vx, vy) = (squares[0][i] - mx * mx, squares[1][i] - my * my);
        let covariance = products[i] - mx * my;
        (2.0 * mx * my + C1) * (2.0 * covariance + C2) / ((mx * mx + my * my + C1) * (vx + vy + C2))
    };
    let [columns, rows] = [size.0, size.1].map(inner);
    let pixels = columns.len() * rows.len();
    let all = rows.flat_map(|y| columns.clone().map(move |x| y * size.0 + x));
    Ok(all.map(similarity).sum::<f64>() / pixels as f64)
}

/// Places along an axis whose window lies inside the picture; all if there are none.
fn inner(size: usize) -> std::ops::Range<usize> {
    if size > 2 * RADIUS { RADIUS..size - RADIUS } else { 0..size }
}

fn shown_luminance(image: &Image) -> Vec<f64> {
    colors(image)
        .map(|c| {
            let [r, g, b] = c.to_array().map(|v| v.clamp(0.0, 1.0));
            let shown = claror::spectrum::Rgb::new(r, g, b).luminance();
            if c.is_finite() { f64::from(linear_to_srgb(shown)) } else { 0.0 }
        })
        .collect()
}

/// Gaussian means around every pixel; edges continue.
fn blur(plane: &[f64], (width, height): (usize, usize)) -> Vec<f64> {
    let gauss = |k: usize| (-((k as f64 - RADIUS as f64) / DEVIATION).powi(2) / 2.0).exp();
    let sum: f64 = (0..=2 * RADIUS).map(gauss).sum();
    let kernel: Vec<f64> = (0..=2 * RADIUS).map(|k| gauss(k) / sum).collect();
    let near = |i: usize, k: usize, size: usize| (i + k).saturating_sub(RADIUS).min(size - 1);
    let mut rows = Vec::with_capacity(plane.len());
    for row in plane.chunks_exact(width) {
        let at = |x, k| row[near(x, k, width)];
        let mean = |x| kernel.iter().enumerate().map(|(k, w)| w * at(x, k)).sum::<f64>();
        rows.extend((0..width).map(mean));
    }
    let mut out = vec![0.0; plane.len()];
    for (y, out) in out.chunks_exact_mut(width).enumerate() {
        for (k, w) in kernel.iter().enumerate() {
            let row = &rows[near(y, k, height) * width..][..width];
            out.iter_mut().zip(row).for_each(|(o, v)| *o += w * v);
        }
    }
    out
}
