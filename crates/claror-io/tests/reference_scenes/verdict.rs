//! Statistics of the difference between a picture and a reference, both with known noise.

use std::fmt;

/// Side of the blocks, pixels.
const BLOCK: usize = 8;
/// Bound of |z| of a channel's mean: level 0.27 % per channel for Gaussian noise.
const MEAN_SIGMAS: f64 = 3.0;
/// Bound of the root mean square of the block means' z, each cut at [`CUT`]. It would be 1 for
/// known variances; ours are estimated from few seeds and have heavy tails where there are
/// caustics, which widens the distribution (a t-distribution with 7 degrees of freedom has
/// 1.18). With more than 100 blocks a value above 1.3 has a chance below 10⁻⁵.
const MAX_BLOCK_RMS: f64 = 1.3;
/// Share of block means beyond 3 standard errors when their z has the standard deviation
/// [`MAX_BLOCK_RMS`]: 2·Φ(−3/1.3).
const EXPECTED_OUTLIERS: f64 = 0.021;
/// One outlier must not decide alone.
const CUT: f64 = 4.0;

/// A picture as mean and variance of the mean per pixel and channel, row by row, R, G, B.
pub(crate) struct Estimate {
    pub width: usize,
    pub height: usize,
    pub mean: Vec<[f64; 3]>,
    pub variance: Vec<[f64; 3]>,
}

/// What a comparison found.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Verdict {
    /// Difference of the channel means over its standard error.
    pub mean_z: [f64; 3],
    /// Our channel means over the reference's.
    pub ratio: [f64; 3],
    /// Root mean square of the block means' z.
    pub block_rms: f64,
    /// Share of the block means beyond 3 standard errors.
    pub outlier_share: f64,
    /// Blocks compared.
    pub blocks: usize,
}

impl Verdict {
    /// Compares ours with the reference. Where neither has any noise (a black or constant
    /// background), values must agree to `f32` rounding of the arithmetic, 2·10⁻⁵ relative.
    pub(crate) fn new(ours: &Estimate, reference: &Estimate) -> Self {
        assert_eq!((ours.width, ours.height), (reference.width, reference.height), "sizes");
        let whole = z_of(ours, reference, 0, 0, ours.width, ours.height);
        let (mut squares, mut beyond, mut count) = (0.0, 0_u32, 0_u32);
        for y in (0..ours.height).step_by(BLOCK) {
            for x in (0..ours.width).step_by(BLOCK) {
                for z in z_of(ours, reference, x, y, BLOCK, BLOCK) {
                    squares += z.abs().min(CUT).powi(2);
                    beyond += u32::from(z.abs() > 3.0);
                    count += 1;
                }
            }
        }
        let total = |e: &Estimate, c: usize| e.mean.iter().map(|m| m[c]).sum::<f64>();
        Self {
            mean_z: whole,
            ratio: [0, 1, 2].map(|c| total(ours, c) / total(reference, c)),
            block_rms: (squares / f64::from(count)).sqrt(),
            outlier_share: f64::from(beyond) / f64::from(count),
            blocks: count as usize / 3,
        }
    }

    /// The expected share and 3 standard errors of a count; the three channels of a block have
    /// nearly the same noise and count once.
    fn max_outlier_share(&self) -> f64 {
        let p = EXPECTED_OUTLIERS;
        p + 3.0 * (p * (1.0 - p) / self.blocks as f64).sqrt()
    }

    pub(crate) fn passes(&self) -> bool {
        self.mean_z.iter().all(|z| z.abs() <= MEAN_SIGMAS)
            && self.block_rms <= MAX_BLOCK_RMS
            && self.outlier_share <= self.max_outlier_share()
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [r, g, b] = self.mean_z;
        let [qr, qg, qb] = self.ratio;
        write!(
            f,
            "z {r:6.2} {g:6.2} {b:6.2}  ratio {qr:.4} {qg:.4} {qb:.4}  blocks rms {:.2}, {:4.1} % beyond 3",
            self.block_rms,
            100.0 * self.outlier_share
        )
    }
}

/// z of the mean over a rectangle, per channel.
fn z_of(a: &Estimate, b: &Estimate, x: usize, y: usize, w: usize, h: usize) -> [f64; 3] {
    let (mut difference, mut variance, mut size) = ([0.0; 3], [0.0; 3], [0.0; 3]);
    let mut pixels = 0.0;
    for row in y..(y + h).min(a.height) {
        for column in x..(x + w).min(a.width) {
            let i = row * a.width + column;
            pixels += 1.0;
            for c in 0..3 {
                difference[c] += a.mean[i][c] - b.mean[i][c];
                variance[c] += a.variance[i][c] + b.variance[i][c];
                size[c] += b.mean[i][c].abs();
            }
        }
    }
    [0, 1, 2]
        .map(|c| {
            let rounding = 2e-5 * size[c] / pixels;
            let error = (variance[c].sqrt() / pixels).hypot(rounding);
            if error > 0.0 { difference[c] / pixels / error } else { difference[c] * f64::INFINITY }
        })
        .map(|z| if z.is_nan() { 0.0 } else { z })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of `mean` with the given relative error in every pixel, from a fixed stream.
    fn noisy(mean: f64, sigma: f64, seed: u64) -> Estimate {
        let mut state = seed;
        let mut uniform = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        // The sum of twelve uniform numbers is nearly Gaussian with variance 1.
        let mut gauss = || (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
        let pixels = 64 * 64;
        Estimate {
            width: 64,
            height: 64,
            mean: (0..pixels).map(|_| [0; 3].map(|_| mean * (1.0 + sigma * gauss()))).collect(),
            variance: vec![[(mean * sigma).powi(2); 3]; pixels],
        }
    }

    #[test]
    fn equal_pictures_pass_and_a_difference_of_half_a_per_cent_does_not() {
        let reference = noisy(0.5, 0.1, 1);
        assert!(Verdict::new(&noisy(0.5, 0.1, 2), &reference).passes());
        assert!(!Verdict::new(&noisy(0.5 * 1.012, 0.1, 3), &reference).passes());
    }

    #[test]
    fn a_wrong_part_of_the_picture_does_not_pass_even_when_the_mean_is_right() {
        let reference = noisy(0.5, 0.1, 1);
        let mut shaded = noisy(0.5, 0.1, 2);
        for (i, m) in shaded.mean.iter_mut().enumerate() {
            let sign = if (i % 64) < 32 { 1.0 } else { -1.0 };
            *m = m.map(|v| v * (1.0 + 0.03 * sign));
        }
        assert!(!Verdict::new(&shaded, &reference).passes());
    }
}
