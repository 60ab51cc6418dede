//! Statistical tests for samplers and estimators.
//!
//! All of them work at a stated level of significance: the probability with which a correct
//! program fails the test. Tests in this repository use fixed seeds, so that a correct program
//! that passes once passes always; the level says how easily a wrong one slips through, and must
//! be divided by the number of tests (Bonferroni) where many are made.

use super::special::{beta_i, erf_inv, gamma_q};
use super::{Vec2, Vec3};

/// Quantile of the standard normal distribution: the `z` with P(Z ≤ z) = `p`.
pub fn normal_quantile(p: f64) -> f64 {
    if !(0.0..=1.0).contains(&p) || p == 0.0 || p == 1.0 {
        return if p <= 0.0 { f64::NEG_INFINITY } else { f64::INFINITY };
    }
    // A single-precision guess, then Newton steps on the exact distribution.
    let guess =
        std::f32::consts::SQRT_2 * erf_inv((2.0 * p - 1.0).clamp(-0.999_999, 0.999_999) as f32);
    let mut z = f64::from(guess);
    for _ in 0..60 {
        let density = (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
        // Tails on the side where nothing cancels.
        let miss = if z > 0.0 { (1.0 - p) - normal_tail(z) } else { normal_tail(-z) - p };
        let step = (miss / density).clamp(-0.5, 0.5);
        z -= step;
        if step.abs() < 1e-14 * (1.0 + z.abs()) {
            break;
        }
    }
    z
}

/// P(Z > z) of the standard normal distribution.
pub fn normal_tail(z: f64) -> f64 {
    let half = 0.5 * gamma_q(0.5, 0.5 * z * z);
    if z >= 0.0 { half } else { 1.0 - half }
}

/// P(|T| > |t|) of Student's distribution with `dof` degrees of freedom.
pub fn student_two_sided(t: f64, dof: f64) -> f64 {
    beta_i(0.5 * dof, 0.5, dof / (dof + t * t))
}

/// The `t` with P(|T| > t) = `level` of Student's distribution: half the width of a confidence
/// interval in standard errors.
pub fn student_quantile_two_sided(level: f64, dof: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while student_two_sided(high, dof) > level {
        high *= 2.0;
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if student_two_sided(middle, dof) > level { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// P(X > x) of the chi-square distribution with `dof` degrees of freedom.
pub fn chi_square_tail(x: f64, dof: f64) -> f64 {
    gamma_q(0.5 * dof, 0.5 * x)
}

/// Mean and variance of a stream of numbers (Welford 1962), one after the other.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Moments {
    /// How many numbers.
    pub count: u64,
    /// Their mean.
    pub mean: f64,
    /// Sum of the squared distances to the mean.
    pub sum_squares: f64,
}

impl Moments {
    /// Takes in one more number.
    pub fn add(&mut self, x: f64) {
        self.count += 1;
        let distance = x - self.mean;
        self.mean += distance / self.count as f64;
        self.sum_squares += distance * (x - self.mean);
    }

    /// Unbiased variance of the numbers; 0 for fewer than two.
    pub fn variance(&self) -> f64 {
        if self.count < 2 { 0.0 } else { self.sum_squares / (self.count - 1) as f64 }
    }

    /// Standard error of the mean.
    pub fn standard_error(&self) -> f64 {
        (self.variance() / self.count.max(1) as f64).sqrt()
    }

    /// Two-sided probability of a mean at least as far from `expected`, by Student's test.
    pub fn p_value(&self, expected: f64) -> f64 {
        let distance = self.mean - expected;
        if distance == 0.0 || self.count < 2 {
            return 1.0;
        }
        student_two_sided(distance / self.standard_error(), (self.count - 1) as f64)
    }
}

/// Level of a single test so that `tests` of them together fail a correct program with
/// probability `level` (Šidák 1967).
pub fn sidak(level: f64, tests: u32) -> f64 {
    -(f64::ln_1p(-level) / f64::from(tests)).exp_m1()
}

/// Result of a chi-square test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChiSquare {
    /// The statistic.
    pub statistic: f64,
    /// Degrees of freedom, after cells with few expected samples were pooled.
    pub dof: f64,
    /// Probability that a correct sampler gives a statistic at least this large.
    pub p_value: f64,
}

/// Pearson's chi-square test of observed counts against expected ones. Cells are pooled, in
/// order of expectation, until each pool expects at least 5. One degree of freedom is lost
/// because the number of samples is given.
///
/// Samples in cells where nothing is expected are not counted up to a share of 5e-4 of all
/// (expectations come from quadrature, which may miss the sliver of a cell that an edge of the
/// density cuts off); more of them give a p-value of 0.
pub fn chi_square(observed: &[f64], expected: &[f64]) -> ChiSquare {
    let mut cells: Vec<(f64, f64)> =
        expected.iter().copied().zip(observed.iter().copied()).collect();
    cells.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut statistic, mut dof) = (0.0, 0.0);
    let mut pool = (0.0, 0.0);
    let mut impossible = 0.0;
    for (e, o) in cells {
        if e <= 0.0 {
            impossible += o;
            continue;
        }
        pool = (pool.0 + e, pool.1 + o);
        if pool.0 >= 5.0 {
            statistic += (pool.1 - pool.0) * (pool.1 - pool.0) / pool.0;
            dof += 1.0;
            pool = (0.0, 0.0);
        }
    }
    let excused = 5e-4 * observed.iter().sum::<f64>();
    let p_value =
        if impossible > excused || dof < 2.0 { 0.0 } else { chi_square_tail(statistic, dof - 1.0) };
    ChiSquare { statistic, dof: dof - 1.0, p_value }
}

/// A density that integrates to more than 1 by this share is wrong without further test; the
/// quadrature's error must stay below.
const MAX_EXCESS: f64 = 0.005;

/// A chi-square test of a sampler of directions against its density by solid angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SphereTest {
    /// Cells in the cosine with the axis, from -1 to 1. Even.
    pub rows: usize,
    /// Cells in azimuth. Even.
    pub columns: usize,
    /// Points per cell and axis at which the density is read (Gauss-Legendre, composite in
    /// panels of 4): more for narrow peaks. At least 4.
    pub subdivisions: usize,
    /// How many samples are drawn.
    pub samples: usize,
    /// Around which axis the cells lie. Edges of the density should fall on edges of cells, and
    /// peaks not on the poles: `X` for scattering at a surface with the normal z.
    pub axis: PolarAxis,
}

/// The axis of the cells of a [`SphereTest`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PolarAxis {
    /// Poles at ±x; the plane z = 0 falls on edges of columns.
    X,
    /// Poles at ±z; the plane z = 0 falls on an edge of rows.
    Z,
}

impl Default for SphereTest {
    fn default() -> Self {
        Self { rows: 20, columns: 40, subdivisions: 8, samples: 200_000, axis: PolarAxis::Z }
    }
}

impl SphereTest {
    /// Draws the samples and compares. `sample` gets the sample's index and returns a unit
    /// direction or `None` for a failed sample: the expected number of failures is what the
    /// density leaves of 1. `pdf` is the density by solid angle.
    pub fn run(
        &self,
        mut sample: impl FnMut(usize) -> Option<Vec3>,
        pdf: impl Fn(Vec3) -> f64,
    ) -> ChiSquare {
        let cells = self.rows * self.columns;
        let mut observed = vec![0.0; cells + 1];
        for i in 0..self.samples {
            observed[sample(i).map_or(cells, |d| self.cell(d))] += 1.0;
        }
        let mut expected: Vec<f64> =
            (0..cells).map(|c| self.samples as f64 * self.integral(c, &pdf)).collect();
        let failures = self.samples as f64 - expected.iter().sum::<f64>();
        expected.push(failures.max(0.0));
        if failures < -MAX_EXCESS * self.samples as f64 {
            return ChiSquare { statistic: f64::INFINITY, dof: cells as f64, p_value: 0.0 };
        }
        // The quadrature's error must not make a few failures impossible, nor excuse many.
        if observed[cells] < 5.0 && expected[cells] < 5.0 {
            observed.pop();
            expected.pop();
        }
        chi_square(&observed, &expected)
    }

    /// The cell of a direction.
    fn cell(&self, d: Vec3) -> usize {
        let d = match self.axis {
            PolarAxis::X => Vec3::new(d.y, d.z, d.x),
            PolarAxis::Z => d,
        };
        let row = ((0.5 * (f64::from(d.z) + 1.0)) * self.rows as f64) as usize;
        let turn = f64::from(d.y).atan2(f64::from(d.x)) / (2.0 * std::f64::consts::PI);
        let column = ((turn - turn.floor()) * self.columns as f64) as usize;
        row.min(self.rows - 1) * self.columns + column.min(self.columns - 1)
    }

    /// The density integrated over a cell.
    fn integral(&self, cell: usize, pdf: impl Fn(Vec3) -> f64) -> f64 {
        let (row, column) = (cell / self.columns, cell % self.columns);
        let (dz, dphi) = (2.0 / self.rows as f64, 2.0 * std::f64::consts::PI / self.columns as f64);
        let points = composite_gauss(self.subdivisions.div_ceil(4));
        let mut sum = 0.0;
        for &(x, weight_z) in &points {
            let z = -1.0 + (row as f64 + x) * dz;
            let r = (1.0 - z * z).max(0.0).sqrt();
            for &(y, weight_phi) in &points {
                let (sin, cos) = ((column as f64 + y) * dphi).sin_cos();
                let (x, y, z) = ((r * cos) as f32, (r * sin) as f32, z as f32);
                let d = match self.axis {
                    PolarAxis::X => Vec3::new(z, x, y),
                    PolarAxis::Z => Vec3::new(x, y, z),
                };
                sum += weight_z * weight_phi * pdf(d);
            }
        }
        sum * dz * dphi
    }
}

/// Nodes and weights of 4-point Gauss-Legendre quadrature in `panels` equal parts of [0, 1].
fn composite_gauss(panels: usize) -> Vec<(f64, f64)> {
    let nodes = gauss_legendre(4);
    let h = 1.0 / panels as f64;
    (0..panels)
        .flat_map(|p| {
            nodes.iter().map(move |&(x, w)| ((p as f64 + 0.5 + 0.5 * x) * h, 0.5 * w * h))
        })
        .collect()
}

/// Nodes and weights of Gauss-Legendre quadrature on [-1, 1] with `n` points: the roots of the
/// Legendre polynomial by Newton's method.
pub fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    (0..n)
        .map(|i| {
            // Tricomi's approximation of the root.
            let mut x = -(std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..100 {
                let (value, derivative) = legendre(n, x);
                slope = derivative;
                let step = value / derivative;
                x -= step;
                if step.abs() < 1e-15 {
                    break;
                }
            }
            (x, 2.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// Legendre polynomial of degree `n ≥ 1` and its derivative.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut before, mut now) = (1.0, x);
    for k in 2..=n {
        let k = k as f64;
        (before, now) = (now, ((2.0 * k - 1.0) * x * now - (k - 1.0) * before) / k);
    }
    (now, n as f64 * (x * now - before) / (x * x - 1.0))
}

/// A small generator for statistical tests (SplitMix64: Steele, Lea, Flood 2014), the same on
/// every machine.
#[derive(Debug, Clone)]
pub struct TestRng(u64);

impl TestRng {
    /// A stream for this seed.
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0xD134_2543_DE82_EF95))
    }

    /// 64 random bits.
    pub fn next_u64(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub fn next_f32(&mut self) -> f32 {
        (self.next_u64() >> 40) as f32 * (1.0 / 16_777_216.0)
    }

    /// Uniform in [0, 1)².
    pub fn next_vec2(&mut self) -> Vec2 {
        Vec2::new(self.next_f32(), self.next_f32())
    }
}

#[cfg(test)]
mod tests;
