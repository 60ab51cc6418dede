use super::Fingerprint;
use crate::bytes::{BytesError, Reader, put_f64, put_text, put_u32, put_u64};
use crate::film::{CropWindow, Film, LAYERS, NonFinite, PixelSums};
use crate::integrator::{Aov, LookupCounts};

/// Everything that is needed to continue a render.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderState {
    /// What was rendered how.
    pub fingerprint: Fingerprint,
    /// The sums so far.
    pub film: Film,
}

impl RenderState {
    /// Nothing rendered yet.
    pub fn new(fingerprint: Fingerprint, crop: CropWindow, aovs: &[Aov]) -> Self {
        let channels = aovs.iter().map(|a| a.kind.channels().len()).sum();
        Self { fingerprint, film: Film::new(crop, channels) }
    }

    /// As bytes, little-endian; the layout belongs to this version of the crate.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut out = Vec::new();
        let entries = &self.fingerprint.entries;
        put_u32(&mut out, entries.len() as u32);
        for text in entries.iter().flat_map(|(name, value)| [name, value]) {
            put_text(&mut out, text);
        }
        let crop = self.film.crop;
        for value in [crop.x, crop.y, crop.width, crop.height, self.film.aov_channels as u32] {
            put_u32(&mut out, value);
        }
        for tile in &self.film.tiles {
            put_non_finite(&mut out, &tile.non_finite);
            let LookupCounts { lookups, uncached, records } = tile.lookups;
            [lookups, uncached, records].into_iter().for_each(|n| put_u64(&mut out, n));
            tile.pixels.iter().for_each(|pixel| put_pixel(&mut out, pixel));
            tile.aovs.iter().for_each(|sum| put_f64(&mut out, *sum));
        }
        out
    }

    /// From what [`RenderState::to_bytes`] made. Takes no more memory than a small multiple of
    /// the bytes' number, whatever they say.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, BytesError> {
        let mut reader = Reader::new(bytes);
        let count = reader.u32()?;
        let mut entries = Vec::new();
        for _ in 0..count {
            entries.push((reader.text()?, reader.text()?));
        }
        let [x, y, width, height] = [reader.u32()?, reader.u32()?, reader.u32()?, reader.u32()?];
        let aov_channels = reader.u32()? as usize;
        let pixels = u64::from(width) * u64::from(height);
        let per_pixel = (PIXEL_BYTES + 8 * aov_channels) as u64;
        let fits = pixels.checked_mul(per_pixel).is_some_and(|n| n <= reader.left());
        if !fits || pixels == 0 || x.checked_add(width).is_none() || y.checked_add(height).is_none()
        {
            return Err(BytesError::BadLength);
        }
        let mut film = Film::new(CropWindow { x, y, width, height }, aov_channels);
        for tile in &mut film.tiles {
            tile.non_finite = read_non_finite(&mut reader)?;
            let [lookups, uncached, records] = [reader.u64()?, reader.u64()?, reader.u64()?];
            tile.lookups = LookupCounts { lookups, uncached, records };
            for pixel in &mut tile.pixels {
                *pixel = read_pixel(&mut reader)?;
            }
            for sum in &mut tile.aovs {
                *sum = reader.f64()?;
            }
        }
        reader.finish()?;
        Ok(Self { fingerprint: Fingerprint { entries }, film })
    }
}

/// Bytes of one [`PixelSums`].
const PIXEL_BYTES: usize = 8 * (3 * LAYERS + 3 + 2) + 4 * (3 + 6 + 3);

fn put_non_finite(out: &mut Vec<u8>, n: &NonFinite) {
    put_u64(out, n.count);
    let (row, column, sample) = n.first.unwrap_or_default();
    for value in [u32::from(n.first.is_some()), row, column, sample] {
        put_u32(out, value);
    }
}

fn put_pixel(out: &mut Vec<u8>, pixel: &PixelSums) {
    for value in pixel.layers.iter().chain([&pixel.squares]).flatten() {
        put_f64(out, *value);
    }
    put_f64(out, pixel.alpha);
    put_f64(out, pixel.weight);
    let floats = pixel.earlier.iter().chain(pixel.control.iter().flatten());
    floats.for_each(|value| put_u32(out, value.to_bits()));
    put_u32(out, pixel.signature);
    put_u32(out, pixel.count);
    put_u32(out, pixel.goal);
}

fn read_non_finite(reader: &mut Reader) -> Result<NonFinite, BytesError> {
    let count = reader.u64()?;
    let [some, row, column, sample] = [reader.u32()?, reader.u32()?, reader.u32()?, reader.u32()?];
    Ok(NonFinite { count, first: (some != 0).then_some((row, column, sample)) })
}

fn read_pixel(reader: &mut Reader) -> Result<PixelSums, BytesError> {
    let mut pixel = PixelSums::default();
    for value in pixel.layers.iter_mut().chain([&mut pixel.squares]).flatten() {
        *value = reader.f64()?;
    }
    pixel.alpha = reader.f64()?;
    pixel.weight = reader.f64()?;
    for value in pixel.earlier.iter_mut().chain(pixel.control.iter_mut().flatten()) {
        *value = f32::from_bits(reader.u32()?);
    }
    pixel.signature = reader.u32()?;
    pixel.count = reader.u32()?;
    pixel.goal = reader.u32()?;
    Ok(pixel)
}
