//! Owen-scrambled Sobol points by hashing.
//!
//! Burley 2020, *Practical hash-based Owen scrambling*: a hash whose output bits depend only on
//! the input bits at and below them (Laine and Karras 2011), applied to bit-reversed digits, is
//! an Owen scramble; applied to a reversed index it shuffles the points of a sequence so that
//! every aligned block of 2^k indices stays a block. Blocks of two dimensions, each with its own
//! shuffle and scrambles, are then independent of each other ("padding").

/// A seeded permutation of 32 bits in which each bit depends only on itself and on lower bits,
/// every lower bit flipping every higher one with probability 1/2. The form is Laine and
/// Karras's with the extra seeded multiplication of Vegdahl; the constants are our own, the best
/// of a random search by that criterion.
#[inline]
pub(super) fn scramble_reversed(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0xc889_eb56);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0c14_a62a);
    x ^ x.wrapping_mul(0xa4d1_bb56)
}

/// The digits of the second Sobol dimension for point `index`, least significant digit of the
/// index first (that is, bit 0 is worth 1/2). Its generator matrix is Pascal's triangle modulo 2,
/// whose entry (j, k) is 1 exactly when the binary digits of j are a subset of those of k
/// (Lucas); the product is therefore a sum over supersets, done one address bit at a time.
#[inline]
pub(super) fn sobol_second_reversed(index: u32) -> u32 {
    let mut v = index;
    v ^= (v >> 1) & 0x5555_5555;
    v ^= (v >> 2) & 0x3333_3333;
    v ^= (v >> 4) & 0x0f0f_0f0f;
    v ^= (v >> 8) & 0x00ff_00ff;
    v ^ (v >> 16)
}

/// Both numbers with their bits reversed, for little more than the price of one.
#[inline]
pub(super) fn reverse_both(v: [u32; 2]) -> [u32; 2] {
    let both = (u64::from(v[0]) << 32 | u64::from(v[1])).reverse_bits();
    [both as u32, (both >> 32) as u32]
}

/// 64 well mixed bits from 64 (Stafford's thirteenth variant of MurmurHash3's finaliser, as in
/// SplitMix64: Steele, Lea, Flood 2014).
#[inline]
pub(super) fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// The upper 24 bits as a number in [0, 1).
#[inline]
pub(super) fn unit_float(x: u32) -> f32 {
    (x >> 8) as f32 * (1.0 / 16_777_216.0)
}
