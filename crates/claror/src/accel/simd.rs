//! The vector operations that the traversal needs, and the instruction sets that have them.
//!
//! Every implementation executes the same IEEE 754 single precision operations lane by lane
//! (no fused multiply-add, no approximate reciprocal), so all give the same bits.

#[cfg(target_arch = "x86_64")]
mod x86;
#[cfg(target_arch = "x86_64")]
pub(super) use x86::{Avx2, Sse2};

use super::arena::Row;

/// Instruction set to trace with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Isa {
    /// Arrays of `f32`; what the compiler makes of them on any machine.
    Portable,
    /// The baseline of every 64-bit x86.
    #[cfg(target_arch = "x86_64")]
    Sse2,
    /// Eight lanes at once. Only ever made by [`Isa::detect`] and [`Isa::available`], after the
    /// processor has been asked.
    #[cfg(target_arch = "x86_64")]
    Avx2,
}

impl Isa {
    /// The best that this machine has.
    pub(super) fn detect() -> Self {
        Self::available().last().copied().unwrap_or(Self::Portable)
    }

    /// All that this machine has, the best last.
    pub(super) fn available() -> Vec<Self> {
        let mut all = vec![Self::Portable];
        #[cfg(target_arch = "x86_64")]
        {
            all.push(Self::Sse2);
            if std::arch::is_x86_feature_detected!("avx2") {
                all.push(Self::Avx2);
            }
        }
        all
    }
}

/// `N` lanes of `f32`.
pub(super) trait Lanes<const N: usize>: Copy {
    /// The same value in every lane.
    fn splat(x: f32) -> Self;
    /// From an array.
    fn load(from: &[f32; N]) -> Self;
    /// To an array.
    fn store(self, to: &mut [f32; N]);
    /// `self + other`
    fn add(self, other: Self) -> Self;
    /// `self - other`
    fn sub(self, other: Self) -> Self;
    /// `self * other`
    fn mul(self, other: Self) -> Self;
    /// `self / other`
    fn div(self, other: Self) -> Self;
    /// `if self < other { self } else { other }`: the other when either is NaN.
    fn min(self, other: Self) -> Self;
    /// `if self > other { self } else { other }`: the other when either is NaN.
    fn max(self, other: Self) -> Self;
    /// One bit per lane: `self <= other`, false when either is NaN.
    fn le(self, other: Self) -> u32;
    /// One bit per lane: `self != 0` and not NaN.
    fn non_zero(self) -> u32;
}

/// An instruction set: vectors of four for triangles, of eight for boxes.
pub(super) trait Simd: Copy {
    /// Four lanes.
    type F4: Lanes<4>;
    /// Eight lanes.
    type F8: Lanes<8>;
    /// Begins to bring the cache lines from a row on closer; changes nothing else, also where there
    /// is no such row.
    fn prefetch(rows: &[Row], first: usize);
}

/// [`Isa::Portable`].
#[derive(Clone, Copy)]
pub(super) struct Portable;

impl Simd for Portable {
    type F4 = [f32; 4];
    type F8 = [f32; 8];
    #[inline(always)]
    fn prefetch(_: &[Row], _: usize) {}
}

#[inline(always)]
fn map2<const N: usize>(a: [f32; N], b: [f32; N], f: impl Fn(f32, f32) -> f32) -> [f32; N] {
    std::array::from_fn(|i| f(a[i], b[i]))
}

#[inline(always)]
fn bits<const N: usize>(f: impl Fn(usize) -> bool) -> u32 {
    (0..N).fold(0, |mask, i| mask | u32::from(f(i)) << i)
}

impl<const N: usize> Lanes<N> for [f32; N] {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        [x; N]
    }
    #[inline(always)]
    fn load(from: &[f32; N]) -> Self {
        *from
    }
    #[inline(always)]
    fn store(self, to: &mut [f32; N]) {
        *to = self;
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        map2(self, other, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        map2(self, other, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        map2(self, other, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        map2(self, other, |a, b| a / b)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        map2(self, other, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        map2(self, other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn le(self, other: Self) -> u32 {
        bits::<N>(|i| self[i] <= other[i])
    }
    #[inline(always)]
    fn non_zero(self) -> u32 {
        bits::<N>(|i| self[i].abs() > 0.0)
    }
}
