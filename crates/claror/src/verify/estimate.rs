//! From numbers measured at stratified places to estimates with intervals, and from those to
//! verdicts.

use crate::math::special::beta_i;
use crate::math::statistics::student_quantile_two_sided;

/// One minus the confidence of all intervals.
pub const LEVEL: f64 = 0.05;

/// A range of values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// What checks say about a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The whole interval lies within what is claimed.
    Confirmed,
    /// The whole interval lies outside.
    Refuted,
    /// The interval holds both.
    Undecided,
}

impl Interval {
    /// Whether a value lies in it, its ends included.
    pub fn contains(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }

    /// Whether a value somewhere in this interval lies within `claim`.
    pub fn verdict(&self, claim: &Self) -> Verdict {
        if self.low >= claim.low && self.high <= claim.high {
            Verdict::Confirmed
        } else if self.low > claim.high || self.high < claim.low {
            Verdict::Refuted
        } else {
            Verdict::Undecided
        }
    }
}

/// A mean or a ratio of means, with its error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Its standard error.
    pub standard_error: f64,
    /// Degrees of freedom of the standard error.
    pub dof: f64,
}

impl Estimate {
    /// Half the width of the confidence interval (Student).
    pub fn margin(&self) -> f64 {
        if self.standard_error == 0.0 {
            return 0.0;
        }
        self.standard_error * student_quantile_two_sided(LEVEL, self.dof)
    }

    /// The confidence interval.
    pub fn interval(&self) -> Interval {
        let margin = self.margin();
        Interval { low: self.value - margin, high: self.value + margin }
    }

    /// The estimate of a multiple.
    pub fn scaled(self, factor: f64) -> Self {
        Self {
            value: self.value * factor,
            standard_error: self.standard_error * factor.abs(),
            ..self
        }
    }
}

/// Mean of values measured in strata of equal size, number `k` in stratum `k % strata`, equally
/// many and at least two in each.
///
/// The variance is the sum of those within the strata: unbiased, whatever differs between them.
/// Its degrees of freedom follow from how evenly it is spread over the strata (Satterthwaite
/// 1946; corrected for the spread of the variances themselves, Lipsitz, Parzen and Zhao 2002): a
/// few wild values make the interval wider.
pub fn stratified_mean(values: &[f64], strata: usize) -> Estimate {
    let (n, strata) = (values.len() as f64, strata.max(1));
    let mean = values.iter().sum::<f64>() / n;
    let per_stratum = n / strata as f64;
    let (mut total, mut squares) = (0.0, 0.0);
    for s in 0..strata {
        let own = || values.iter().skip(s).step_by(strata);
        let center = own().sum::<f64>() / per_stratum;
        let variance = own().map(|v| (v - center).powi(2)).sum::<f64>() / (per_stratum - 1.0);
        total += variance;
        squares += variance * variance;
    }
    let dof = if squares > 0.0 { total * total * (per_stratum + 1.0) / squares - 2.0 } else { 1.0 };
    Estimate {
        value: mean,
        standard_error: (total / per_stratum).sqrt() / strata as f64,
        dof: dof.clamp(1.0, (n - strata as f64).max(1.0)),
    }
}

/// Ratio of the means of `y` and `x` (of positive mean), both measured at the same stratified
/// places; the error to first order.
pub fn stratified_ratio(y: &[f64], x: &[f64], strata: usize) -> Option<Estimate> {
    let (sum_y, sum_x) = (y.iter().sum::<f64>(), x.iter().sum::<f64>());
    if sum_x <= 0.0 {
        return None;
    }
    let ratio = sum_y / sum_x;
    let scale = x.len() as f64 / sum_x;
    let residuals: Vec<f64> = y.iter().zip(x).map(|(y, x)| (y - ratio * x) * scale).collect();
    Some(Estimate { value: ratio, ..stratified_mean(&residuals, strata) })
}

/// Interval of a probability by `hits` of `trials` (Clopper and Pearson 1934): covers it with
/// at least the confidence 1 − `level`.
pub fn clopper_pearson(hits: usize, trials: usize, level: f64) -> Interval {
    let (k, n) = (hits as f64, trials as f64);
    // P(X ≥ k) = I_p(k, n − k + 1) and P(X ≤ k) = 1 − I_p(k + 1, n − k) grow and fall with p.
    let low = if hits == 0 { 0.0 } else { beta_quantile(0.5 * level, k, n - k + 1.0) };
    let high = if hits >= trials { 1.0 } else { beta_quantile(1.0 - 0.5 * level, k + 1.0, n - k) };
    Interval { low, high }
}

/// The `x` with `I_x(a, b) = p`.
fn beta_quantile(p: f64, a: f64, b: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if beta_i(a, b, middle) < p { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// How exact single checks are.
///
/// Paths bring light in rare, bright pieces, and a check that met few of them, or none, is too dark
/// and says that it is exact. The variance of a sum of such pieces is proportional to its mean
/// (compound Poisson), so no check counts as more exact than the usual one would be at a place
/// of that value: the median of all.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Usual variance per value.
    pub per_value: f64,
}

impl Noise {
    /// From values of the picture (or cache) and squared standard errors of the checks.
    pub fn new(checks: impl Iterator<Item = (f64, f64)>) -> Self {
        let mut ratios: Vec<f64> = checks
            .filter(|(v, variance)| *v > 0.0 && *variance > 0.0)
            .map(|(v, s)| s / v)
            .collect();
        ratios.sort_by(f64::total_cmp);
        Self { per_value: ratios.get(ratios.len() / 2).copied().unwrap_or(0.0) }
    }

    /// Standard error of a check, if the value that it is compared with is right.
    pub fn error(&self, value: f64, variance: f64) -> f64 {
        variance.max(self.per_value * value).sqrt()
    }
}

/// The share of places where something is off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// Places where it surely is: the difference exceeds the tolerance by three standard errors.
    pub surely: usize,
    /// Places where it may be: the difference may be above the tolerance by that much.
    pub possibly: usize,
    /// Places looked at.
    pub of: usize,
}

impl Share {
    /// How many standard errors make a difference sure.
    pub const SIGMAS: f64 = 3.0;

    /// From differences, their standard errors and the tolerances.
    pub fn new(places: impl Iterator<Item = (f64, f64, f64)>) -> Self {
        let mut share = Self { surely: 0, possibly: 0, of: 0 };
        for (difference, error, tolerance) in places {
            let (size, slack) = (difference.abs(), Self::SIGMAS * error);
            share.surely += usize::from(size > tolerance + slack);
            share.possibly += usize::from(size + slack > tolerance);
            share.of += 1;
        }
        share
    }

    /// From the lower end of the interval of what is sure to the upper end of that of what is
    /// possible: covers the share whatever the places in doubt are.
    pub fn interval(&self) -> Interval {
        Interval {
            low: clopper_pearson(self.surely, self.of, LEVEL).low,
            high: clopper_pearson(self.possibly, self.of, LEVEL).high,
        }
    }

    /// The interval of the share of places that surely are off.
    pub fn sure_interval(&self) -> Interval {
        clopper_pearson(self.surely, self.of, LEVEL)
    }
}
