use super::{CropWindow, PixelSums};

/// Edge of a tile, pixels.
pub const TILE_SIZE: u32 = 16;

/// Samples that were not finite: they count as black.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct NonFinite {
    /// How many.
    pub count: u64,
    /// Row and column of the film and index of the first of them in reading order.
    pub first: Option<(u32, u32, u32)>,
}

impl NonFinite {
    /// Notes one at (row, column, sample index).
    pub fn note(&mut self, place: (u32, u32, u32)) {
        self.count += 1;
        self.first = Some(self.first.map_or(place, |first| first.min(place)));
    }

    /// Both together.
    pub fn merged(self, other: Self) -> Self {
        let first = match (self.first, other.first) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        };
        Self { count: self.count + other.count, first }
    }
}

/// A rectangle of pixels that one thread works on at a time.
#[derive(Debug, Clone, PartialEq)]
pub struct Tile {
    /// Where it lies on the film.
    pub window: CropWindow,
    /// Its pixels, row by row.
    pub pixels: Vec<PixelSums>,
    /// Sums of the further layers, all channels of a pixel together, row by row.
    pub aovs: Vec<f64>,
    /// Samples that were not finite.
    pub non_finite: NonFinite,
}

/// All tiles of a picture, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    /// The part of the sensor's film that is rendered.
    pub crop: CropWindow,
    /// Channels of the further layers.
    pub aov_channels: usize,
    /// The tiles.
    pub tiles: Vec<Tile>,
}

impl Film {
    /// An empty film.
    pub fn new(crop: CropWindow, aov_channels: usize) -> Self {
        let starts = |from: u32, size: u32| (from..from + size).step_by(TILE_SIZE as usize);
        let mut tiles = Vec::new();
        for y in starts(crop.y, crop.height) {
            for x in starts(crop.x, crop.width) {
                let width = TILE_SIZE.min(crop.x + crop.width - x);
                let height = TILE_SIZE.min(crop.y + crop.height - y);
                let pixels = vec![PixelSums::default(); (width * height) as usize];
                tiles.push(Tile {
                    window: CropWindow { x, y, width, height },
                    aovs: vec![0.0; pixels.len() * aov_channels],
                    pixels,
                    non_finite: NonFinite::default(),
                });
            }
        }
        Self { crop, aov_channels, tiles }
    }

    /// Calls `f` with column and row in the picture, the sums, and the sums of the further layers
    /// of every pixel.
    pub fn for_each_pixel(&self, mut f: impl FnMut(usize, usize, &PixelSums, &[f64])) {
        for tile in &self.tiles {
            let w = tile.window;
            for (i, pixel) in tile.pixels.iter().enumerate() {
                let (x, y) = (i as u32 % w.width, i as u32 / w.width);
                let aovs = &tile.aovs[i * self.aov_channels..(i + 1) * self.aov_channels];
                let (x, y) = (w.x - self.crop.x + x, w.y - self.crop.y + y);
                f(x as usize, y as usize, pixel, aovs);
            }
        }
    }

    /// Samples that were not finite.
    pub fn non_finite(&self) -> NonFinite {
        self.tiles.iter().fold(NonFinite::default(), |sum, tile| sum.merged(tile.non_finite))
    }

    /// Samples per pixel: of the pixel with the fewest, and of all pixels together.
    pub fn sample_counts(&self) -> (u32, u64) {
        let counts = || self.tiles.iter().flat_map(|t| &t.pixels).map(|p| p.count);
        (counts().min().unwrap_or(0), counts().map(u64::from).sum())
    }

    /// Estimated error of the picture: the root of the mean over pixels and channels of squared
    /// error over (squared value + 0.01), see [`PixelSums::squared_error`].
    pub fn relative_error(&self) -> f32 {
        let mut sum = 0.0;
        let mut terms = 0_u64;
        for pixel in self.tiles.iter().flat_map(|t| &t.pixels) {
            let beauty = pixel.beauty();
            for (c, error) in pixel.squared_error().into_iter().enumerate() {
                sum += error / (f64::from(beauty[c]).powi(2) + 0.01);
                terms += 1;
            }
        }
        (sum / terms.max(1) as f64).sqrt() as f32
    }
}
