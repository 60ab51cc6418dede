//! Radiance HDR out.

use std::io::Write;

use claror::image::Image;
use image::Rgb;
use image::codecs::hdr::HdrEncoder;

use super::WriteError;

/// Writes the colours with a shared exponent; alpha is dropped, negative values and NaN become 0.
pub fn write_hdr(w: &mut impl Write, image: &Image) -> Result<(), WriteError> {
    if image.width == 0 || image.height == 0 {
        return Err(WriteError::Unsupported("an empty picture cannot be written".into()));
    }
    let clean = |v: f32| if v > 0.0 { v.min(f32::MAX) } else { 0.0 };
    let pixels: Vec<Rgb<f32>> = image
        .data
        .chunks_exact(image.channels)
        .map(|p| match *p {
            [r, g, b, ..] => Rgb([clean(r), clean(g), clean(b)]),
            [y, ..] => Rgb([clean(y); 3]),
            [] => Rgb([0.0; 3]),
        })
        .collect();
    HdrEncoder::new(w).encode(&pixels, image.width, image.height).map_err(|e| match e {
        image::ImageError::IoError(e) => WriteError::Io(e),
        e => WriteError::Unsupported(e.to_string()),
    })
}
