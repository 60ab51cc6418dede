//! Sample streams indexed by (pixel, sample, dimension).

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
