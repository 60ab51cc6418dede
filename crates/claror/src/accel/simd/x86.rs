//! SSE2 and AVX2.
#![expect(
    unsafe_code,
    reason = "processor intrinsics. SSE2 is part of every x86-64; the methods over 256-bit vectors \
              are reached only through code entered with the AVX2 feature enabled, which \
              `traverse` does only for `Isa::Avx2`, made only where the processor has it"
)]
#![allow(
    unused_unsafe,
    reason = "which intrinsics count as safe depends on the features enabled at compile time"
)]

use super::super::arena::Row;
use super::{Lanes, Simd};
use std::arch::x86_64::{
    __m128, __m256, _CMP_LE_OQ, _CMP_NEQ_OQ, _MM_HINT_T0, _mm_add_ps, _mm_cmple_ps, _mm_cmplt_ps,
    _mm_div_ps, _mm_loadu_ps, _mm_max_ps, _mm_min_ps, _mm_movemask_ps, _mm_mul_ps, _mm_or_ps,
    _mm_prefetch, _mm_set1_ps, _mm_setzero_ps, _mm_storeu_ps, _mm_sub_ps, _mm256_add_ps,
    _mm256_cmp_ps, _mm256_div_ps, _mm256_loadu_ps, _mm256_max_ps, _mm256_min_ps,
    _mm256_movemask_ps, _mm256_mul_ps, _mm256_set1_ps, _mm256_setzero_ps, _mm256_storeu_ps,
    _mm256_sub_ps,
};

/// The baseline: eight lanes are two times four.
#[derive(Clone, Copy)]
pub(in crate::accel) struct Sse2;

impl Simd for Sse2 {
    type F4 = __m128;
    type F8 = Pair;
    #[inline(always)]
    fn prefetch(rows: &[Row], first: usize) {
        prefetch(rows, first);
    }
}

/// Eight lanes at once.
#[derive(Clone, Copy)]
pub(in crate::accel) struct Avx2;

impl Simd for Avx2 {
    type F4 = __m128;
    type F8 = __m256;
    #[inline(always)]
    fn prefetch(rows: &[Row], first: usize) {
        prefetch(rows, first);
    }
}

/// The first three of the (at most) four lines of a node or block; the machine guesses the next.
#[inline(always)]
fn prefetch(rows: &[Row], first: usize) {
    let start = rows.as_ptr().wrapping_add(first);
    for line in 0..3 {
        // SAFETY: a hint, which may name any address.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(2 * line).cast()) };
    }
}

/// Eight lanes as two SSE registers.
#[derive(Clone, Copy)]
pub(in crate::accel) struct Pair(__m128, __m128);

/// `fn name(self, other) -> Self` as one intrinsic.
macro_rules! binary {
    ($($name:ident = $intrinsic:ident),*) => {$(
        #[inline(always)]
        fn $name(self, other: Self) -> Self {
            // SAFETY: arithmetic on registers; see the head of this module for the features.
            unsafe { $intrinsic(self, other) }
        }
    )*};
}

impl Lanes<4> for __m128 {
    binary!(add = _mm_add_ps, sub = _mm_sub_ps, mul = _mm_mul_ps, div = _mm_div_ps);
    binary!(min = _mm_min_ps, max = _mm_max_ps);

    #[inline(always)]
    fn splat(x: f32) -> Self {
        // SAFETY: SSE2 is always there.
        unsafe { _mm_set1_ps(x) }
    }
    #[inline(always)]
    fn load(from: &[f32; 4]) -> Self {
        // SAFETY: reads the 16 bytes of the array; unaligned reads are allowed.
        unsafe { _mm_loadu_ps(from.as_ptr()) }
    }
    #[inline(always)]
    fn store(self, to: &mut [f32; 4]) {
        // SAFETY: writes the 16 bytes of the array; unaligned writes are allowed.
        unsafe { _mm_storeu_ps(to.as_mut_ptr(), self) }
    }
    #[inline(always)]
    fn le(self, other: Self) -> u32 {
        // SAFETY: SSE2 is always there.
        unsafe { _mm_movemask_ps(_mm_cmple_ps(self, other)) as u32 }
    }
    #[inline(always)]
    fn non_zero(self) -> u32 {
        // SAFETY: SSE2 is always there.
        unsafe {
            let zero = _mm_setzero_ps();
            _mm_movemask_ps(_mm_or_ps(_mm_cmplt_ps(self, zero), _mm_cmplt_ps(zero, self))) as u32
        }
    }
}

impl Lanes<8> for __m256 {
    binary!(add = _mm256_add_ps, sub = _mm256_sub_ps, mul = _mm256_mul_ps, div = _mm256_div_ps);
    binary!(min = _mm256_min_ps, max = _mm256_max_ps);

    #[inline(always)]
    fn splat(x: f32) -> Self {
        // SAFETY: see the head of this module for the features.
        unsafe { _mm256_set1_ps(x) }
    }
    #[inline(always)]
    fn load(from: &[f32; 8]) -> Self {
        // SAFETY: reads the 32 bytes of the array; unaligned reads are allowed.
        unsafe { _mm256_loadu_ps(from.as_ptr()) }
    }
    #[inline(always)]
    fn store(self, to: &mut [f32; 8]) {
        // SAFETY: writes the 32 bytes of the array; unaligned writes are allowed.
        unsafe { _mm256_storeu_ps(to.as_mut_ptr(), self) }
    }
    #[inline(always)]
    fn le(self, other: Self) -> u32 {
        // SAFETY: see the head of this module for the features.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(self, other)) as u32 }
    }
    #[inline(always)]
    fn non_zero(self) -> u32 {
        // SAFETY: see the head of this module for the features.
        unsafe {
            _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_NEQ_OQ>(self, _mm256_setzero_ps())) as u32
        }
    }
}

/// `fn name(self, other) -> Self` half by half.
macro_rules! halves {
    ($($name:ident),*) => {$(
        #[inline(always)]
        fn $name(self, other: Self) -> Self {
            Self(self.0.$name(other.0), self.1.$name(other.1))
        }
    )*};
}

impl Lanes<8> for Pair {
    halves!(add, sub, mul, div, min, max);

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self(<__m128 as Lanes<4>>::splat(x), <__m128 as Lanes<4>>::splat(x))
    }
    #[inline(always)]
    fn load(from: &[f32; 8]) -> Self {
        let (halves, _) = from.as_chunks::<4>();
        Self(Lanes::load(&halves[0]), Lanes::load(&halves[1]))
    }
    #[inline(always)]
    fn store(self, to: &mut [f32; 8]) {
        let (halves, _) = to.as_chunks_mut::<4>();
        self.0.store(&mut halves[0]);
        self.1.store(&mut halves[1]);
    }
    #[inline(always)]
    fn le(self, other: Self) -> u32 {
        self.0.le(other.0) | self.1.le(other.1) << 4
    }
    #[inline(always)]
    fn non_zero(self) -> u32 {
        self.0.non_zero() | self.1.non_zero() << 4
    }
}
