//! Sample streams indexed by (pixel, sample, dimension).
//!
//! Every number is a pure function of the seed, the pixel, the sample's index and the dimension,
//! so pictures do not depend on threads, tiles or the order of the work, and a render can be
//! continued at any sample.
//!
//! The Sobol kind is the first two dimensions of Sobol's sequence for every block of two
//! dimensions, in an order of its own per block and with Owen scrambles of its own per block and
//! pixel.

mod owen;
#[cfg(test)]
mod tests;

use crate::math::Vec2;
use owen::{mix, reverse_both, scramble_reversed, sobol_second_reversed, unit_float};

/// Which points are used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SamplerKind {
    /// Owen-scrambled Sobol points, padded two dimensions at a time.
    #[default]
    Sobol,
    /// Independent pseudorandom numbers.
    Independent,
}

/// Pattern and number of samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SamplerSettings {
    /// Which points.
    pub kind: SamplerKind,
    /// Samples per pixel.
    pub sample_count: u32,
    /// Seed of all streams.
    pub seed: u64,
}

/// The stream of one sample of one pixel: a cursor over dimensions.
///
/// A dimension must mean the same thing in all samples of a pixel, or stratification is lost
/// (not correctness): code that draws a varying number of values calls
/// [`Sampler::set_dimension`] at the places where it comes together again.
#[derive(Debug, Clone, Copy)]
pub struct Sampler<'a> {
    kind: SamplerKind,
    /// Hash of seed and pixel (Sobol), or of seed, pixel and sample (independent).
    stream: u64,
    /// The sample's index, and the hash that shuffles indices.
    index: u32,
    shuffle: u64,
    /// Points of the first dimensions that were computed ahead.
    ahead: &'a [RawPoint],
    /// The next dimension; one `next_1d` or `next_2d` takes one.
    dimension: u32,
}

/// A point of the (0, 2)-sequence before it is scrambled: the digits of both coordinates, bit 0
/// worth 1/2.
type RawPoint = [u32; 2];

/// 2^64 / golden ratio, odd: multiples of it are far apart.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// The 64 bits that belong to a dimension of a stream.
#[inline]
fn bits_of_dimension(stream: u64, dimension: u32) -> u64 {
    mix(stream.wrapping_add(GOLDEN.wrapping_mul(u64::from(dimension) + 1)))
}

/// Point `index` of the block `dimension`: the sequence in an order of the block's own, the same
/// for all pixels.
#[inline]
fn raw_point(shuffle: u64, index: u32, dimension: u32) -> RawPoint {
    let seed = bits_of_dimension(shuffle, dimension) as u32;
    let index = scramble_reversed(index.reverse_bits(), seed).reverse_bits();
    [index, sobol_second_reversed(index)]
}

/// The hash that shuffles indices.
fn shuffle_hash(settings: &SamplerSettings) -> u64 {
    mix(settings.seed ^ 0x5851_f42d_4c95_7f2d)
}

impl Sampler<'static> {
    /// The stream of sample `index` of the pixel in column and row `pixel` of the film.
    pub fn new(settings: &SamplerSettings, pixel: (u32, u32), index: u32) -> Self {
        Self::with_points(settings, shuffle_hash(settings), pixel, index, &[])
    }
}

impl<'a> Sampler<'a> {
    #[inline]
    fn with_points(
        settings: &SamplerSettings,
        shuffle: u64,
        pixel: (u32, u32),
        index: u32,
        ahead: &'a [RawPoint],
    ) -> Self {
        let place = (u64::from(pixel.1) << 32) | u64::from(pixel.0);
        let mut stream = mix(place.wrapping_add(mix(settings.seed.wrapping_add(GOLDEN))));
        if settings.kind == SamplerKind::Independent {
            stream = mix(stream ^ (u64::from(index) << 32));
        }
        Self { kind: settings.kind, stream, index, shuffle, ahead, dimension: 0 }
    }

    /// Continues at `dimension`.
    #[inline]
    pub fn set_dimension(&mut self, dimension: u32) {
        self.dimension = dimension;
    }

    #[inline]
    fn raw(&self) -> RawPoint {
        match self.ahead.get(self.dimension as usize) {
            Some(point) => *point,
            None => raw_point(self.shuffle, self.index, self.dimension),
        }
    }

    /// The next number in [0, 1).
    #[inline]
    pub fn next_1d(&mut self) -> f32 {
        let high = (bits_of_dimension(self.stream, self.dimension) >> 32) as u32;
        let result = match self.kind {
            SamplerKind::Independent => high,
            SamplerKind::Sobol => scramble_reversed(self.raw()[0], high).reverse_bits(),
        };
        self.dimension += 1;
        unit_float(result)
    }

    /// The next point in [0, 1)².
    #[inline]
    pub fn next_2d(&mut self) -> Vec2 {
        let bits = bits_of_dimension(self.stream, self.dimension);
        let (low, high) = (bits as u32, (bits >> 32) as u32);
        let result = match self.kind {
            SamplerKind::Independent => [low, high],
            SamplerKind::Sobol => {
                let [x, y] = self.raw();
                reverse_both([scramble_reversed(x, low), scramble_reversed(y, high)])
            }
        };
        self.dimension += 1;
        Vec2::new(unit_float(result[0]), unit_float(result[1]))
    }
}

/// Dimensions that are computed ahead: enough for the first seven vertices of a path.
const DIMENSIONS_AHEAD: u32 = 32;

/// What the streams of all pixels share for a range of sample indices, computed ahead. Streams
/// made from it give the same numbers as others, sooner.
#[derive(Debug, Clone)]
pub struct SamplerTable {
    settings: SamplerSettings,
    shuffle: u64,
    first: u32,
    /// `DIMENSIONS_AHEAD` points per sample.
    points: Vec<RawPoint>,
}

impl SamplerTable {
    /// For the samples `first..end`.
    pub fn new(settings: &SamplerSettings, first: u32, end: u32) -> Self {
        let shuffle = shuffle_hash(settings);
        let dimensions = match settings.kind {
            SamplerKind::Sobol => DIMENSIONS_AHEAD,
            SamplerKind::Independent => 0,
        };
        let row = |index| (0..dimensions).map(move |d| raw_point(shuffle, index, d));
        Self { settings: *settings, shuffle, first, points: (first..end).flat_map(row).collect() }
    }

    /// The stream of sample `index` of the pixel in column and row `pixel` of the film.
    #[inline]
    pub fn sampler(&self, pixel: (u32, u32), index: u32) -> Sampler<'_> {
        let start = index.wrapping_sub(self.first) as usize * DIMENSIONS_AHEAD as usize;
        let ahead = self.points.get(start..start + DIMENSIONS_AHEAD as usize).unwrap_or(&[]);
        Sampler::with_points(&self.settings, self.shuffle, pixel, index, ahead)
    }
}
