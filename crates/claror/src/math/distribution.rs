//! Tabulated distributions: sampled by inverting cumulative sums, so that well distributed
//! numbers stay well distributed.

use super::Vec2;

/// Position in [0, 1] with a density that goes linearly from `a` at 0 to `b` at 1 (not both 0).
pub fn sample_linear(a: f32, b: f32, u: f32) -> f32 {
    let root = (a * a * (1.0 - u) + b * b * u).sqrt();
    let sum = a + root;
    if sum > 0.0 { (u * (a + b) / sum).min(1.0) } else { u }
}

/// Cumulative shares of some weights; an index is found by bisection.
#[derive(Debug, Clone, Default)]
pub struct Cumulative {
    /// Sum of the shares up to and with each weight; the last is 1.
    shares: Vec<f32>,
}

impl Cumulative {
    /// From non-negative weights; `None` when they are all zero, or not finite.
    pub fn new(weights: &[f32]) -> Option<Self> {
        let mut shares = vec![0.0; weights.len()];
        let total = accumulate(weights, &mut shares);
        (total > 0.0 && total.is_finite()).then_some(Self { shares })
    }

    /// Probability of index `i`.
    pub fn probability(&self, i: usize) -> f32 {
        probability(&self.shares, i)
    }

    /// An index, its probability, and `u` stretched to [0, 1) within it, to be used again.
    pub fn sample(&self, u: f32) -> (usize, f32, f32) {
        sample(&self.shares, u)
    }
}

/// Fills `shares` with cumulative shares of `weights`; returns the sum of the weights. Where
/// that is zero the shares are those of equal weights.
fn accumulate(weights: &[f32], shares: &mut [f32]) -> f64 {
    let mut total = 0.0_f64;
    for &weight in weights {
        total += f64::from(weight);
    }
    let mut sum = 0.0_f64;
    let count = weights.len() as f64;
    for (share, &weight) in shares.iter_mut().zip(weights) {
        sum += if total > 0.0 { f64::from(weight) / total } else { 1.0 / count };
        *share = sum as f32;
    }
    // Rounding must not leave a gap at the end, nor give a share to weights of 0 there.
    if let Some(&last) = shares.last() {
        for share in shares.iter_mut().rev().take_while(|s| **s == last) {
            *share = 1.0;
        }
    }
    total
}

fn probability(shares: &[f32], i: usize) -> f32 {
    shares[i] - if i == 0 { 0.0 } else { shares[i - 1] }
}

fn sample(shares: &[f32], u: f32) -> (usize, f32, f32) {
    let i = shares.partition_point(|&s| s <= u).min(shares.len() - 1);
    let before = if i == 0 { 0.0 } else { shares[i - 1] };
    let share = shares[i] - before;
    let rest = if share > 0.0 { (u - before) / share } else { 0.0 };
    (i, share, rest.clamp(0.0, 1.0 - f32::EPSILON))
}

/// A density on the unit square that is bilinear between the values at the vertices of a
/// regular grid.
#[derive(Debug, Clone)]
pub struct BilinearGrid {
    /// Cells in each direction.
    columns: usize,
    rows: usize,
    /// `(columns + 1)·(rows + 1)` values, scaled so that the density integrates to 1.
    values: Vec<f32>,
    /// Cumulative shares of the rows of cells.
    row_shares: Vec<f32>,
    /// Per row, cumulative shares of its cells.
    column_shares: Vec<f32>,
}

impl BilinearGrid {
    /// From non-negative values at `(columns + 1)·(rows + 1)` vertices, row by row; `None` when
    /// they are all zero, not finite, or not of that number.
    pub fn new(mut values: Vec<f32>, columns: usize, rows: usize) -> Option<Self> {
        let stride = columns + 1;
        if columns == 0 || rows == 0 || values.len() != stride * (rows + 1) {
            return None;
        }
        let mut column_shares = vec![0.0; columns * rows];
        let mut row_weights = vec![0.0; rows];
        let mut cells = vec![0.0; columns];
        let mut total = 0.0_f64;
        for row in 0..rows {
            let low = &values[row * stride..][..stride];
            let high = &values[(row + 1) * stride..][..stride];
            for (i, cell) in cells.iter_mut().enumerate() {
                *cell = 0.25 * ((low[i] + low[i + 1]) + (high[i] + high[i + 1]));
            }
            let sum = accumulate(&cells, &mut column_shares[row * columns..][..columns]);
            row_weights[row] = sum as f32;
            total += sum;
        }
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let mut row_shares = vec![0.0; rows];
        accumulate(&row_weights, &mut row_shares);
        let scale = ((columns * rows) as f64 / total) as f32;
        values.iter_mut().for_each(|v| *v *= scale);
        Some(Self { columns, rows, values, row_shares, column_shares })
    }

    /// A point of the unit square and its density.
    pub fn sample(&self, u: Vec2) -> (Vec2, f32) {
        let (row, _, v) = sample(&self.row_shares, u.y);
        let shares = &self.column_shares[row * self.columns..][..self.columns];
        let (column, _, u) = sample(shares, u.x);
        let [a, b, c, d] = self.corners(column, row);
        let y = sample_linear(a + b, c + d, v);
        let x = sample_linear(a + (c - a) * y, b + (d - b) * y, u);
        let p = Vec2::new(column as f32 + x, row as f32 + y);
        let density = bilinear([a, b, c, d], x, y);
        (p / Vec2::new(self.columns as f32, self.rows as f32), density)
    }

    /// The density at a point of the unit square.
    pub fn pdf(&self, p: Vec2) -> f32 {
        let at = p * Vec2::new(self.columns as f32, self.rows as f32);
        let column = (at.x.max(0.0) as usize).min(self.columns - 1);
        let row = (at.y.max(0.0) as usize).min(self.rows - 1);
        let (x, y) = (at.x - column as f32, at.y - row as f32);
        bilinear(self.corners(column, row), x.clamp(0.0, 1.0), y.clamp(0.0, 1.0))
    }

    /// The values around a cell: low row left, right, high row left, right.
    fn corners(&self, column: usize, row: usize) -> [f32; 4] {
        let i = row * (self.columns + 1) + column;
        let j = i + self.columns + 1;
        [self.values[i], self.values[i + 1], self.values[j], self.values[j + 1]]
    }
}

fn bilinear([a, b, c, d]: [f32; 4], x: f32, y: f32) -> f32 {
    let low = a + (b - a) * x;
    let high = c + (d - c) * x;
    low + (high - low) * y
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::statistics::{TestRng, chi_square};

    #[test]
    fn cumulative_finds_what_its_probabilities_say() {
        let weights = [0.0, 1.0, 0.0, 3.0, 0.5, 0.0];
        let table = Cumulative::new(&weights).unwrap();
        let total: f32 = weights.iter().sum();
        for k in 0..4096 {
            let u = (k as f32 + 0.5) / 4096.0;
            let (i, p, rest) = table.sample(u);
            assert!(weights[i] > 0.0 && (0.0..1.0).contains(&rest));
            assert!((p - weights[i] / total).abs() < 1e-6 && p == table.probability(i));
            let before: f32 = weights[..i].iter().sum::<f32>() / total;
            assert!((before + rest * p - u).abs() < 1e-6);
        }
        assert_eq!(table.sample(1.0 - f32::EPSILON / 2.0).0, 4);
        assert_eq!(table.sample(0.0).0, 1);
        assert!(Cumulative::new(&[0.0, 0.0]).is_none() && Cumulative::new(&[]).is_none());
        assert!(Cumulative::new(&[1.0, f32::NAN]).is_none());
    }

    /// Chi-square on 24 × 10 bins at level 10⁻³, the expected counts by fine quadrature.
    #[test]
    fn bilinear_grid_samples_its_density() {
        let values = vec![0.0, 1.0, 4.0, 0.0, 2.0, 0.0, 0.0, 2.0, 0.3, 0.0, 5.0, 0.3];
        let grid = BilinearGrid::new(values, 3, 2).unwrap();
        let (bins_x, bins_y, fine) = (24, 10, 16);
        let mut expected = vec![0.0; bins_x * bins_y];
        for y in 0..bins_y * fine {
            for x in 0..bins_x * fine {
                let (w, h) = ((bins_x * fine) as f32, (bins_y * fine) as f32);
                let p = Vec2::new((x as f32 + 0.5) / w, (y as f32 + 0.5) / h);
                expected[y / fine * bins_x + x / fine] += f64::from(grid.pdf(p) / (w * h));
            }
        }
        let integral: f64 = expected.iter().sum();
        assert!((integral - 1.0).abs() < 1e-5, "{integral}");
        let count = 200_000;
        let mut observed = vec![0.0; expected.len()];
        let mut rng = TestRng::new(1);
        for _ in 0..count {
            let (p, pdf) = grid.sample(rng.next_vec2());
            assert!((pdf - grid.pdf(p)).abs() < 1e-3 * (1.0 + pdf), "{pdf}, {}", grid.pdf(p));
            let bin = |v: f32, n: usize| ((v * n as f32) as usize).min(n - 1);
            observed[bin(p.y, bins_y) * bins_x + bin(p.x, bins_x)] += 1.0;
        }
        expected.iter_mut().for_each(|e| *e *= f64::from(count));
        let test = chi_square(&observed, &expected);
        assert!(test.p_value > 1e-3, "{test:?}");
    }

    #[test]
    fn bilinear_grid_refuses_what_is_no_density() {
        assert!(BilinearGrid::new(vec![0.0; 4], 1, 1).is_none());
        assert!(BilinearGrid::new(vec![1.0; 5], 1, 1).is_none());
        assert!(BilinearGrid::new(vec![f32::INFINITY; 4], 1, 1).is_none());
        assert!(BilinearGrid::new(vec![], 0, 0).is_none());
    }
}
