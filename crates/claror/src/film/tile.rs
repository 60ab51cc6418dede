use rayon::prelude::*;

use super::{CropWindow, PixelSums};
use crate::integrator::LookupCounts;

/// Edge of a tile, pixels.
pub const TILE_SIZE: u32 = 16;

/// Samples of a pixel from which on their error alone tells whether it needs more.
const FEW_SAMPLES: u32 = 16;

/// What decides whether a pixel and its neighbours need more samples.
#[derive(Clone, Copy, Default)]
struct State {
    /// It is off, or has few samples yet and they met different things.
    is_needy: bool,
    /// What its samples met.
    signature: u32,
    is_young: bool,
}

/// Squared error over squared value, summed over the channels.
fn relative_squared_error(pixel: &PixelSums) -> f64 {
    let beauty = pixel.beauty();
    let errors = pixel.squared_error().into_iter().enumerate();
    errors.map(|(c, error)| error / (f64::from(beauty[c]).powi(2) + 0.01)).sum()
}

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
    /// What was asked of the irradiance cache.
    pub lookups: LookupCounts,
}

/// Which pixels take part in a round.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Choice {
    /// All.
    All,
    /// Those that took part so far.
    Active,
    /// Of those the ones that seem to be off by more than this, relative to their value, or whose
    /// neighbours are.
    Needing(f32),
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
                    lookups: LookupCounts::default(),
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

    /// What was asked of the irradiance cache.
    pub fn lookups(&self) -> LookupCounts {
        self.tiles.iter().fold(LookupCounts::default(), |sum, tile| sum.merged(tile.lookups))
    }

    /// Samples per pixel: of the pixel with the fewest, and of all pixels together.
    pub fn sample_counts(&self) -> (u32, u64) {
        let of_tile = |tile: &Tile| {
            let counts = || tile.pixels.iter().map(|p| p.count);
            (counts().min().unwrap_or(u32::MAX), counts().map(u64::from).sum::<u64>())
        };
        let tiles: Vec<_> = self.tiles.par_iter().map(of_tile).collect();
        (tiles.iter().map(|t| t.0).min().unwrap_or(0), tiles.iter().map(|t| t.1).sum())
    }

    /// Samples per pixel at the end of the last complete round, where it took part, and whether a
    /// round is complete; else the fewest samples of a pixel that still needs some.
    pub fn round(&self) -> (u32, bool) {
        let of_tile = |tile: &Tile| {
            let unfinished = tile.pixels.iter().filter(|p| p.count < p.goal).map(|p| p.count);
            (unfinished.min(), tile.pixels.iter().map(|p| p.goal).max())
        };
        let tiles: Vec<_> = self.tiles.par_iter().map(of_tile).collect();
        match tiles.iter().filter_map(|t| t.0).min() {
            Some(fewest) => (fewest, false),
            None => (tiles.iter().filter_map(|t| t.1).max().unwrap_or(0), true),
        }
    }

    /// Begins a round from `from` to `goal` samples. Whether any pixel takes part.
    pub fn begin_round(&mut self, from: u32, goal: u32, choice: Choice) -> bool {
        let needs = match choice {
            Choice::Needing(tolerance) => Some(self.needs_more(tolerance)),
            Choice::All | Choice::Active => None,
        };
        let (crop, mut any) = (self.crop, false);
        for tile in &mut self.tiles {
            let w = tile.window;
            for (i, pixel) in tile.pixels.iter_mut().enumerate() {
                let x = (w.x - crop.x + i as u32 % w.width) as usize;
                let y = (w.y - crop.y + i as u32 / w.width) as usize;
                let is_active = choice == Choice::All || pixel.goal == from;
                let is_needed = || needs.as_ref().is_none_or(|n| n[y * crop.width as usize + x]);
                if is_active && is_needed() {
                    pixel.goal = goal;
                    any = true;
                }
            }
        }
        any
    }

    /// Per pixel, row by row, whether it needs more samples: it or one of its eight neighbours is
    /// off by more than `tolerance`, or there are few samples yet and they or a neighbour's met
    /// different things. One difference between earlier and later samples may be small by chance;
    /// nine rarely are.
    fn needs_more(&self, tolerance: f32) -> Vec<bool> {
        let (width, height) = (self.crop.width as usize, self.crop.height as usize);
        let limit = 3.0 * f64::from(tolerance).powi(2);
        let mut states = vec![State::default(); width * height];
        self.for_each_pixel(|x, y, pixel, _| {
            let is_off = relative_squared_error(pixel) > limit;
            let is_mixed = pixel.signature == PixelSums::MIXED && pixel.count < FEW_SAMPLES;
            states[y * width + x] = State {
                is_needy: is_off || is_mixed,
                signature: pixel.signature,
                is_young: pixel.count < FEW_SAMPLES,
            };
        });
        let near = |at: usize, size: usize| at.saturating_sub(1)..(at + 2).min(size);
        let mut needs = vec![false; width * height];
        for (i, needs) in needs.iter_mut().enumerate() {
            let (x, y) = (i % width, i / width);
            let mine = states[i];
            let differs = |other: State| {
                other.is_needy
                    || (mine.is_young && other.is_young && other.signature != mine.signature)
            };
            *needs =
                near(y, height).any(|y| near(x, width).any(|x| differs(states[y * width + x])));
        }
        needs
    }

    /// Estimated error of the picture: the root of the mean over pixels and channels of squared
    /// error over (squared value + 0.01), see [`PixelSums::squared_error`].
    pub fn relative_error(&self) -> f32 {
        let of_tile = |tile: &Tile| tile.pixels.iter().map(relative_squared_error).sum::<f64>();
        // Added up in the order of the tiles, whoever computed them.
        let tiles: Vec<f64> = self.tiles.par_iter().map(of_tile).collect();
        let terms = 3 * u64::from(self.crop.width) * u64::from(self.crop.height);
        (tiles.iter().sum::<f64>() / terms.max(1) as f64).sqrt() as f32
    }
}
