//! Portable float maps: `PF` or `Pf`, size, scale (negative: little-endian), rows from the bottom.

use std::io::Write;

use claror::image::Image;

use super::WriteError;
use super::read::{DecodedImage, check_size};
use crate::diagnostic::ReadError;
use crate::limits::Limits;
use crate::source::{Source, printable};

/// Longest word of a header.
const MAX_WORD: usize = 64;

pub(super) fn decode(
    bytes: &[u8],
    source: Source<'_>,
    limits: &Limits,
) -> Result<DecodedImage, ReadError> {
    let mut at = 0;
    let channels = if word(bytes, &mut at, source)? == "PF" { 3 } else { 1 };
    let width: u32 = number(bytes, &mut at, "width", source)?;
    let height: u32 = number(bytes, &mut at, "height", source)?;
    let scale: f32 = number(bytes, &mut at, "scale", source)?;
    if scale == 0.0 || !scale.is_finite() {
        return Err(source.error(format!("the scale of a PFM picture cannot be {scale}")));
    }
    let body = &bytes[at..];
    let row_values = width as usize * channels;
    let needed = (row_values as u64).saturating_mul(4).saturating_mul(u64::from(height));
    check_size(source, limits, u64::from(width), u64::from(height), bytes.len(), needed)?;
    if (body.len() as u64) < needed {
        let have = body.len();
        return Err(source.error(format!("the file is cut: {have} of {needed} bytes of pixels")));
    }
    let value = |b: &[u8; 4]| {
        let v = if scale < 0.0 { f32::from_le_bytes(*b) } else { f32::from_be_bytes(*b) };
        v * scale.abs()
    };
    let mut data: Vec<f32> = source.reserve(needed / 4, "the picture")?;
    let (values, _) = body[..needed as usize].as_chunks::<4>();
    for row in values.chunks_exact(row_values).rev() {
        data.extend(row.iter().map(value));
    }
    let image = Image { width: width as usize, height: height as usize, channels, data };
    Ok(DecodedImage { image, is_srgb_encoded: false, layers: Vec::new() })
}

/// The next word; exactly one blank after it is consumed, since pixels may look like blanks.
fn word<'a>(bytes: &'a [u8], at: &mut usize, source: Source<'_>) -> Result<&'a str, ReadError> {
    let rest = &bytes[*at..];
    let start = rest.iter().take_while(|b| b.is_ascii_whitespace()).count();
    let rest = &rest[start..];
    let length = rest.iter().take(MAX_WORD).position(u8::is_ascii_whitespace);
    let Some(length) = length.filter(|&n| n > 0) else {
        return Err(source.error("the header of the PFM picture is cut"));
    };
    *at += start + length + 1;
    str::from_utf8(&rest[..length]).map_err(|_| source.error("the PFM header is not text"))
}

fn number<T: std::str::FromStr>(
    bytes: &[u8],
    at: &mut usize,
    what: &str,
    source: Source<'_>,
) -> Result<T, ReadError> {
    let word = word(bytes, at, source)?;
    word.parse().map_err(|_| {
        let word = printable(word.as_bytes(), 40);
        source.error(format!("\"{word}\" is not a valid {what} of a PFM picture"))
    })
}

/// Writes a picture of 1 or 3 channels; alpha is dropped.
pub fn write_pfm(w: &mut impl Write, image: &Image) -> Result<(), WriteError> {
    let (magic, colours) = if image.channels >= 3 { ("PF", 3) } else { ("Pf", 1) };
    write!(w, "{magic}\n{} {}\n-1.0\n", image.width, image.height)?;
    for y in (0..image.height).rev() {
        let mut row = Vec::with_capacity(image.width * colours * 4);
        for x in 0..image.width {
            row.extend(image.pixel(x, y)[..colours].iter().flat_map(|v| v.to_le_bytes()));
        }
        w.write_all(&row)?;
    }
    Ok(())
}
