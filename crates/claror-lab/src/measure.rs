//! How far pictures are from their reference.

use std::path::Path;

use claror::image::Image;
use claror_io::Limits;
use claror_io::compare::{
    CompareError, FlipOptions, flip, mean_of_halves, metrics, rel_mse_from_halves,
    rel_mse_of_halves, ssim,
};

use crate::study::Errors;

/// A picture as linear light.
pub(crate) fn read(path: &Path) -> Result<Image, String> {
    let decoded = claror_io::image::read(path, &Limits::default());
    decoded.map(claror_io::image::DecodedImage::into_linear).map_err(|error| error.to_string())
}

/// A reference in memory.
#[derive(Debug, Clone)]
pub(crate) struct ReferencePicture {
    halves: [Image; 2],
    mean: Image,
    /// Of the mean of the halves, from their difference.
    pub(crate) rel_mse: f64,
}

impl ReferencePicture {
    /// Two independent halves of the same size.
    pub(crate) fn new(halves: [Image; 2]) -> Result<Self, CompareError> {
        let [a, b] = &halves;
        let (mean, rel_mse) = (mean_of_halves([a, b])?, rel_mse_of_halves([a, b])?);
        Ok(Self { halves, mean, rel_mse })
    }

    /// How far a picture is from it.
    pub(crate) fn errors(&self, picture: &Image) -> Result<Errors, CompareError> {
        let [a, b] = &self.halves;
        let plain = metrics(picture, &self.mean)?;
        Ok(Errors {
            mse: plain.mse,
            rel_mse: rel_mse_from_halves(picture, [a, b])?,
            mape: plain.mape,
            bias: bias(picture, &self.mean),
            ssim: ssim(picture, &self.mean)?,
            flip: flip(picture, &self.mean, &FlipOptions::default())?.mean,
        })
    }
}

/// Mean of the picture over mean of the reference, minus 1, over the colours of pixels that are
/// finite in both; 0 if both are black.
fn bias(picture: &Image, reference: &Image) -> f64 {
    let pixels = |image: &Image| image.width * image.height;
    let mut sums = [0.0_f64; 2];
    for i in 0..pixels(picture).min(pixels(reference)) {
        let pair = [colour(picture, i), colour(reference, i)];
        if pair.iter().flatten().all(|v| v.is_finite()) {
            for (sum, colour) in sums.iter_mut().zip(pair) {
                *sum += colour.iter().map(|&v| f64::from(v)).sum::<f64>();
            }
        }
    }
    if sums[0] == sums[1] { 0.0 } else { sums[0] / sums[1] - 1.0 }
}

/// Red, green and blue of a pixel; grey is the same in all.
fn colour(image: &Image, pixel: usize) -> [f32; 3] {
    let samples = &image.data[pixel * image.channels..][..image.channels];
    match *samples {
        [r, g, b, ..] => [r, g, b],
        [y, ..] => [y; 3],
        [] => [0.0; 3],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(v: f32) -> Image {
        Image { width: 16, height: 12, channels: 3, data: vec![v; 16 * 12 * 3] }
    }

    #[test]
    fn errors_of_flat_pictures_by_hand() {
        let reference = ReferencePicture::new([flat(0.5), flat(1.5)]).expect("of one size");
        assert!((reference.rel_mse - 0.25 / 1.01).abs() < 1e-12);
        let errors = reference.errors(&flat(2.0)).expect("of one size");
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a} is not {b}");
        near(errors.mse, 1.0);
        near(errors.rel_mse, 1.5 * 0.5 / 1.01);
        near(errors.mape, 1.0 / 1.01);
        near(errors.bias, 1.0);
        // Both are white on a screen.
        near(errors.ssim, 1.0);
        near(errors.flip, 0.0);
        // As dark as one half: better than the reference can tell is below 0.
        assert!(reference.errors(&flat(1.0)).expect("of one size").rel_mse < 0.0);
        assert!(ReferencePicture::new([flat(1.0), Image::new(2, 2, 3)]).is_err());
    }

    #[test]
    fn bias_leaves_out_what_is_not_finite() {
        let mut broken = flat(1.1);
        broken.data[4] = f32::NAN;
        assert!((bias(&broken, &flat(1.0)) - 0.1).abs() < 1e-6);
        assert_eq!(bias(&flat(0.0), &flat(0.0)), 0.0);
    }
}
