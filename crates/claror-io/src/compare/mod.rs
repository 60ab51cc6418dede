//! How far two pictures differ.
//!
//! All measures look at colours only; alpha is ignored, and a grey picture compares with a colour
//! picture as if its channels were equal.

mod color;
mod error_picture;
mod flip;
mod halves;
mod metrics;
mod ssim;
#[cfg(test)]
mod tests;

pub use error_picture::{ErrorMeasure, error_picture, magma};
pub use flip::{FlipOptions, FlipResult, ToneMap, flip};
pub use halves::{mean_of_halves, rel_mse_from_halves, rel_mse_of_halves};
pub use metrics::{Metrics, metrics};
pub use ssim::ssim;

use claror::image::Image;
use claror::spectrum::Rgb;

/// Why two pictures cannot be compared.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CompareError {
    /// Width or height differ.
    #[error("the sizes differ: {} × {} and {} × {} pixels", .0.0, .0.1, .1.0, .1.1)]
    SizesDiffer((usize, usize), (usize, usize)),
    /// There are no pixels.
    #[error("the pictures are empty")]
    Empty,
}

/// An error unless both pictures have the same size and at least one pixel.
fn check_sizes(a: &Image, b: &Image) -> Result<(), CompareError> {
    if (a.width, a.height) != (b.width, b.height) {
        return Err(CompareError::SizesDiffer((a.width, a.height), (b.width, b.height)));
    }
    if a.width == 0 || a.height == 0 { Err(CompareError::Empty) } else { Ok(()) }
}

/// The colours of all pixels, row after row.
fn colors(image: &Image) -> impl Iterator<Item = Rgb> {
    image.data.chunks_exact(image.channels.max(1)).map(|pixel| match *pixel {
        [r, g, b, ..] => Rgb::new(r, g, b),
        [y, ..] => Rgb::splat(y),
        [] => Rgb::splat(0.0),
    })
}
