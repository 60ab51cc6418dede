//! What a sample of a pixel met: samples that met the same differ smoothly, and a few of them tell
//! as much as many.

/// A hash of surfaces and visibility along a chain.
#[derive(Debug, Clone, Copy)]
pub(super) struct Signature(u32);

impl Signature {
    pub(super) fn new() -> Self {
        Self(1)
    }

    pub(super) fn add(&mut self, value: u32) {
        let h = (self.0 ^ value).wrapping_mul(0x9e37_79b1);
        self.0 = h ^ (h >> 15);
    }

    /// Not 0 and not [`crate::film::PixelSums::MIXED`].
    pub(super) fn value(self) -> u32 {
        self.0 | 2
    }
}
