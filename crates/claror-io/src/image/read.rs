//! Reading a picture of any known format.

use std::io::Cursor;
use std::path::Path;

use claror::image::Image;
use image::codecs::hdr::HdrDecoder;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};

use super::{exr_read, pfm};
use crate::diagnostic::ReadError;
use crate::limits::Limits;
use crate::source::Source;

/// A picture and how its numbers are to be understood.
#[derive(Debug, Clone, PartialEq)]
pub struct DecodedImage {
    /// The samples. Integer formats are normalised to [0, 1] and otherwise untouched.
    pub image: Image,
    /// True for 8- and 16-bit files: unless they are used raw, the colour channels (not alpha)
    /// must go through [`super::srgb_to_linear`].
    pub is_srgb_encoded: bool,
    /// Names of the layers in the file, for OpenEXR; "" is the layer without a name.
    pub layers: Vec<String>,
}

/// Reads a picture; of OpenEXR files the layer without a name, else the first one.
pub fn read(path: &Path, limits: &Limits) -> Result<DecodedImage, ReadError> {
    decode(&Source::new(path).read(limits)?, path, None, limits)
}

/// Reads the layer with this name of an OpenEXR file ("" is the one without a name).
pub fn read_layer(path: &Path, layer: &str, limits: &Limits) -> Result<DecodedImage, ReadError> {
    decode(&Source::new(path).read(limits)?, path, Some(layer), limits)
}

impl DecodedImage {
    /// The picture as linear light, whatever the file's encoding.
    pub fn into_linear(self) -> Image {
        let mut image = self.image;
        if self.is_srgb_encoded {
            let alpha = usize::from(image.channels.is_multiple_of(2));
            let colours = image.channels - alpha.min(image.channels);
            for pixel in image.data.chunks_exact_mut(image.channels.max(1)) {
                pixel[..colours].iter_mut().for_each(|v| *v = super::srgb_to_linear(*v));
            }
        }
        image
    }
}

/// [`read`] or [`read_layer`] of bytes in memory; `path` only names them in messages.
pub fn decode(
    bytes: &[u8],
    path: &Path,
    layer: Option<&str>,
    limits: &Limits,
) -> Result<DecodedImage, ReadError> {
    let source = Source::new(path);
    if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        return exr_read::decode(bytes, source, layer, limits);
    }
    if let Some(name) = layer.filter(|name| !name.is_empty()) {
        return Err(
            source.error(format!("there is no layer \"{name}\": this is not an OpenEXR file"))
        );
    }
    let format = match bytes {
        [] => return Err(source.error("the file is empty")),
        [0x89, b'P', b'N', b'G', ..] => ImageFormat::Png,
        [0xff, 0xd8, 0xff, ..] => ImageFormat::Jpeg,
        [b'#', b'?', ..] => ImageFormat::Hdr,
        [b'P', b'F' | b'f', b'\n' | b'\r' | b' ', ..] => return pfm::decode(bytes, source, limits),
        _ => {
            let mut error = source.error("this is not a picture of a known format");
            error.hint = Some("known are OpenEXR, PNG, JPEG, Radiance HDR and PFM".into());
            return Err(error);
        }
    };
    decode_common(bytes, format, source, limits)
}

/// PNG, JPEG and Radiance HDR. The size is checked before anything is decoded.
fn decode_common(
    bytes: &[u8],
    format: ImageFormat,
    source: Source<'_>,
    limits: &Limits,
) -> Result<DecodedImage, ReadError> {
    let fail = |e| undecodable(source, &e);
    if format == ImageFormat::Hdr {
        // Not strict about the signature, since Mitsuba itself writes "#?RGBE".
        let decoder = HdrDecoder::new_nonstrict(bytes).map_err(fail)?;
        return decode_checked(decoder, bytes.len(), source, limits);
    }
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.limits(image::Limits::no_limits());
    decode_checked(reader.into_decoder().map_err(fail)?, bytes.len(), source, limits)
}

fn decode_checked(
    decoder: impl ImageDecoder,
    file_bytes: usize,
    source: Source<'_>,
    limits: &Limits,
) -> Result<DecodedImage, ReadError> {
    let (width, height) = decoder.dimensions();
    let decoded_bytes = decoder.total_bytes();
    check_size(source, limits, u64::from(width), u64::from(height), file_bytes, decoded_bytes)?;
    let decoded = DynamicImage::from_decoder(decoder).map_err(|e| undecodable(source, &e))?;
    let is_float = matches!(decoded, DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_));
    let (channels, data) = normalised(decoded);
    let image = Image { width: width as usize, height: height as usize, channels, data };
    if image.data.len() != image.width * image.height * channels {
        return Err(source.error("the picture cannot be decoded: its data has another size"));
    }
    Ok(DecodedImage { image, is_srgb_encoded: !is_float, layers: Vec::new() })
}

fn undecodable(source: Source<'_>, error: &image::ImageError) -> ReadError {
    source.error(format!("the picture cannot be decoded: {}", first_line(&error.to_string())))
}

/// Channels and samples in [0, 1], or as they are for float formats.
fn normalised(image: DynamicImage) -> (usize, Vec<f32>) {
    let from_u8 = |data: Vec<u8>| data.into_iter().map(|v| f32::from(v) / 255.0).collect();
    let from_u16 = |data: Vec<u16>| data.into_iter().map(|v| f32::from(v) / 65535.0).collect();
    match image {
        DynamicImage::ImageLuma8(i) => (1, from_u8(i.into_raw())),
        DynamicImage::ImageLumaA8(i) => (2, from_u8(i.into_raw())),
        DynamicImage::ImageRgb8(i) => (3, from_u8(i.into_raw())),
        DynamicImage::ImageRgba8(i) => (4, from_u8(i.into_raw())),
        DynamicImage::ImageLuma16(i) => (1, from_u16(i.into_raw())),
        DynamicImage::ImageLumaA16(i) => (2, from_u16(i.into_raw())),
        DynamicImage::ImageRgb16(i) => (3, from_u16(i.into_raw())),
        DynamicImage::ImageRgba16(i) => (4, from_u16(i.into_raw())),
        DynamicImage::ImageRgb32F(i) => (3, i.into_raw()),
        DynamicImage::ImageRgba32F(i) => (4, i.into_raw()),
        other => (4, other.into_rgba32f().into_raw()),
    }
}

/// No supported compression shrinks more than about 1 : 1032 (that of zlib; JPEG: 8 × 8 pixels in
/// two bits), so a small file that claims more is not worth an allocation.
const MAX_COMPRESSION: u64 = 2048;

/// Refuses empty pictures, pictures above the limit, and decompression bombs.
pub(super) fn check_size(
    source: Source<'_>,
    limits: &Limits,
    width: u64,
    height: u64,
    file_bytes: usize,
    decoded_bytes: u64,
) -> Result<(), ReadError> {
    let pixels = width.saturating_mul(height);
    if pixels == 0 {
        return Err(source.error(format!("the picture is empty: {width} × {height} pixels")));
    }
    source.check_limit("pixels", pixels, limits.max_image_pixels)?;
    if decoded_bytes > (file_bytes as u64 + 64).saturating_mul(MAX_COMPRESSION) {
        return Err(source.error(format!(
            "{file_bytes} bytes cannot hold the {width} × {height} pixels that the file claims"
        )));
    }
    Ok(())
}

/// Errors of libraries may run over several lines; ours are one sentence.
pub(super) fn first_line(message: &str) -> String {
    message.lines().next().unwrap_or_default().trim_end_matches('.').to_owned()
}
