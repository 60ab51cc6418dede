//! Pictures in memory: what textures and environment maps read and what films become.

/// A picture of `f32` samples, row 0 at the top, interleaved channels.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Image {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Samples per pixel: 1 (grey), 2 (grey, alpha), 3 (R, G, B) or 4 (R, G, B, alpha).
    pub channels: usize,
    /// `width · height · channels` values, linear unless its user says otherwise.
    pub data: Vec<f32>,
}

impl Image {
    /// A black picture.
    pub fn new(width: usize, height: usize, channels: usize) -> Self {
        Self { width, height, channels, data: vec![0.0; width * height * channels] }
    }

    /// The samples of the pixel in column `x`, row `y`.
    pub fn pixel(&self, x: usize, y: usize) -> &[f32] {
        let i = (y * self.width + x) * self.channels;
        &self.data[i..i + self.channels]
    }
}
