//! Sample streams indexed by (pixel, sample, dimension).
//!
//! Every number is a pure function of the seed, the pixel, the sample's index and the dimension,
//! so pictures do not depend on threads, tiles or the order of the work, and a render can be
//! continued at any sample.

mod owen;
#[cfg(test)]
mod tests;

use crate::math::Vec2;
use owen::{mix, scramble_reversed, sobol_second_reversed, unit_float};

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
pub struct Sampler {
    kind: SamplerKind,
    /// Hash of seed and pixel (Sobol), or of seed, pixel and sample (independent).
    stream: u64,
    /// The sample's index with its bits reversed.
    reversed_index: u32,
    /// The next dimension; one `next_1d` or `next_2d` takes one.
    dimension: u32,
}

/// 2^64 / golden ratio, odd: multiples of it are far apart.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

impl Sampler {
    /// The stream of sample `sample_index` of the pixel in column and row `pixel` of the film.
    #[inline]
    pub fn new(settings: &SamplerSettings, pixel: (u32, u32), sample_index: u32) -> Self {
        let place = (u64::from(pixel.1) << 32) | u64::from(pixel.0);
        let mut stream = mix(place.wrapping_add(mix(settings.seed.wrapping_add(GOLDEN))));
        if settings.kind == SamplerKind::Independent {
            stream = mix(stream ^ (u64::from(sample_index) << 32));
        }
        Self {
            kind: settings.kind,
            stream,
            reversed_index: sample_index.reverse_bits(),
            dimension: 0,
        }
    }

    /// Continues at `dimension`.
    #[inline]
    pub fn set_dimension(&mut self, dimension: u32) {
        self.dimension = dimension;
    }

    /// The 64 bits that belong to the next dimension.
    #[inline]
    fn advance(&mut self) -> u64 {
        self.dimension += 1;
        mix(self.stream.wrapping_add(GOLDEN.wrapping_mul(u64::from(self.dimension))))
    }

    /// The next number in [0, 1).
    #[inline]
    pub fn next_1d(&mut self) -> f32 {
        let h = self.advance();
        let high = (h >> 32) as u32;
        if self.kind == SamplerKind::Independent {
            return unit_float(high);
        }
        let index = scramble_reversed(self.reversed_index, h as u32).reverse_bits();
        unit_float(scramble_reversed(index, high).reverse_bits())
    }

    /// The next point in [0, 1)².
    #[inline]
    pub fn next_2d(&mut self) -> Vec2 {
        let h = self.advance();
        let (low, high) = (h as u32, (h >> 32) as u32);
        if self.kind == SamplerKind::Independent {
            return Vec2::new(unit_float(high), unit_float(low));
        }
        // The shuffled index, least significant bit first, is the digits of the first dimension.
        let index = scramble_reversed(self.reversed_index, low).reverse_bits();
        let third = (h.wrapping_mul(0xd134_2543_de82_ef95) >> 32) as u32;
        let x = scramble_reversed(index, high);
        let y = scramble_reversed(sobol_second_reversed(index), third);
        Vec2::new(unit_float(x.reverse_bits()), unit_float(y.reverse_bits()))
    }
}
