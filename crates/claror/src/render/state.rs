use super::Fingerprint;
use crate::film::{CropWindow, Film, LAYERS, NonFinite, PixelSums};
use crate::integrator::Aov;

/// Everything that is needed to continue a render.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderState {
    /// What was rendered how.
    pub fingerprint: Fingerprint,
    /// The sums so far.
    pub film: Film,
}

/// Why bytes are not a render state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum StateError {
    /// There are too few bytes.
    #[error("it ends too early")]
    Truncated,
    /// There are too many bytes.
    #[error("something follows its end")]
    TrailingBytes,
    /// A length or size cannot be.
    #[error("a length in it is impossible")]
    BadLength,
    /// A name or value is not text.
    #[error("a text in it is not UTF-8")]
    BadText,
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
            put_u32(&mut out, text.len() as u32);
            out.extend_from_slice(text.as_bytes());
        }
        let crop = self.film.crop;
        for value in [crop.x, crop.y, crop.width, crop.height, self.film.aov_channels as u32] {
            put_u32(&mut out, value);
        }
        for tile in &self.film.tiles {
            put_non_finite(&mut out, &tile.non_finite);
            tile.pixels.iter().for_each(|pixel| put_pixel(&mut out, pixel));
            tile.aovs.iter().for_each(|sum| put_f64(&mut out, *sum));
        }
        out
    }

    /// From what [`RenderState::to_bytes`] made. Takes no more memory than a small multiple of
    /// the bytes' number, whatever they say.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, StateError> {
        let mut reader = Reader { bytes };
        let count = reader.u32()?;
        let mut entries = Vec::new();
        for _ in 0..count {
            entries.push((reader.text()?, reader.text()?));
        }
        let [x, y, width, height] = [reader.u32()?, reader.u32()?, reader.u32()?, reader.u32()?];
        let aov_channels = reader.u32()? as usize;
        let pixels = u64::from(width) * u64::from(height);
        let per_pixel = (PIXEL_BYTES + 8 * aov_channels) as u64;
        let fits = pixels.checked_mul(per_pixel).is_some_and(|n| n <= reader.bytes.len() as u64);
        if !fits || pixels == 0 || x.checked_add(width).is_none() || y.checked_add(height).is_none()
        {
            return Err(StateError::BadLength);
        }
        let mut film = Film::new(CropWindow { x, y, width, height }, aov_channels);
        for tile in &mut film.tiles {
            tile.non_finite = reader.non_finite()?;
            for pixel in &mut tile.pixels {
                *pixel = reader.pixel()?;
            }
            for sum in &mut tile.aovs {
                *sum = reader.f64()?;
            }
        }
        if !reader.bytes.is_empty() {
            return Err(StateError::TrailingBytes);
        }
        Ok(Self { fingerprint: Fingerprint { entries }, film })
    }
}

/// Bytes of one [`PixelSums`].
const PIXEL_BYTES: usize = 8 * (3 * LAYERS + 3 + 2) + 4 * (3 + 6 + 3);

fn put_u32(out: &mut Vec<u8>, value: u32) {
    out.extend_from_slice(&value.to_le_bytes());
}

fn put_f64(out: &mut Vec<u8>, value: f64) {
    out.extend_from_slice(&value.to_le_bytes());
}

fn put_non_finite(out: &mut Vec<u8>, n: &NonFinite) {
    out.extend_from_slice(&n.count.to_le_bytes());
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

struct Reader<'a> {
    bytes: &'a [u8],
}

impl Reader<'_> {
    fn take(&mut self, n: usize) -> Result<&[u8], StateError> {
        let (head, tail) = self.bytes.split_at_checked(n).ok_or(StateError::Truncated)?;
        self.bytes = tail;
        Ok(head)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], StateError> {
        self.take(N)?.try_into().map_err(|_| StateError::Truncated)
    }

    fn u32(&mut self) -> Result<u32, StateError> {
        self.array().map(u32::from_le_bytes)
    }

    fn f64(&mut self) -> Result<f64, StateError> {
        self.array().map(f64::from_le_bytes)
    }

    fn text(&mut self) -> Result<String, StateError> {
        let length = self.u32()? as usize;
        let text = std::str::from_utf8(self.take(length)?).map_err(|_| StateError::BadText)?;
        Ok(text.to_owned())
    }

    fn non_finite(&mut self) -> Result<NonFinite, StateError> {
        let count = self.array().map(u64::from_le_bytes)?;
        let [some, row, column, sample] = [self.u32()?, self.u32()?, self.u32()?, self.u32()?];
        Ok(NonFinite { count, first: (some != 0).then_some((row, column, sample)) })
    }

    fn pixel(&mut self) -> Result<PixelSums, StateError> {
        let mut pixel = PixelSums::default();
        for value in pixel.layers.iter_mut().chain([&mut pixel.squares]).flatten() {
            *value = self.f64()?;
        }
        pixel.alpha = self.f64()?;
        pixel.weight = self.f64()?;
        for value in pixel.earlier.iter_mut().chain(pixel.control.iter_mut().flatten()) {
            *value = f32::from_bits(self.u32()?);
        }
        pixel.signature = self.u32()?;
        pixel.count = self.u32()?;
        pixel.goal = self.u32()?;
        Ok(pixel)
    }
}
