//! PNG out.

use std::io::Write;

use claror::image::Image;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};

use super::WriteError;
use super::srgb::linear_to_srgb;

/// Bits per sample of a PNG.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum BitDepth {
    /// 8 bits.
    #[default]
    Eight,
    /// 16 bits.
    Sixteen,
}

/// Writes a linear picture as sRGB: colours times 2^`exposure`, clamped to [0, 1], encoded,
/// rounded; alpha clamped and rounded. NaN becomes 0.
pub fn write_png(
    w: &mut impl Write,
    image: &Image,
    exposure: f32,
    depth: BitDepth,
) -> Result<(), WriteError> {
    let size = (u32::try_from(image.width).ok()).zip(u32::try_from(image.height).ok());
    let Some((width, height)) = size.filter(|&(w, h)| w > 0 && h > 0) else {
        let (w, h) = (image.width, image.height);
        return Err(WriteError::Unsupported(format!("PNG cannot hold {w} × {h} pixels")));
    };
    let factor = exposure.exp2();
    let has_alpha = matches!(image.channels, 2 | 4);
    let encode = |(i, &v): (usize, &f32)| {
        let is_alpha = has_alpha && i % image.channels == image.channels - 1;
        let v = if is_alpha { v } else { linear_to_srgb((v * factor).clamp(0.0, 1.0)) };
        // Comparisons, because `clamp` keeps NaN.
        if v > 0.0 { v.min(1.0) } else { 0.0 }
    };
    let values = image.data.iter().enumerate().map(encode);
    use ExtendedColorType as Color;
    let (bytes, colour): (Vec<u8>, Color) = match (depth, image.channels) {
        (BitDepth::Eight, channels) => {
            let colours = [Color::L8, Color::La8, Color::Rgb8, Color::Rgba8];
            (values.map(|v| (v * 255.0).round() as u8).collect(), colours[channels - 1])
        }
        (BitDepth::Sixteen, channels) => {
            let colours = [Color::L16, Color::La16, Color::Rgb16, Color::Rgba16];
            let words = values.map(|v| (v * 65535.0).round() as u16);
            (words.flat_map(u16::to_ne_bytes).collect(), colours[channels - 1])
        }
    };
    PngEncoder::new(w).write_image(&bytes, width, height, colour).map_err(|e| match e {
        image::ImageError::IoError(e) => WriteError::Io(e),
        e => WriteError::Unsupported(e.to_string()),
    })
}
