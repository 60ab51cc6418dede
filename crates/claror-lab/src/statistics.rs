//! Statistics of settings and series.

use claror::math::statistics::student_quantile_two_sided;

use crate::study::{Errors, Run, Series, SeriesKind, Setting, Slope, Spread, Summary, TimeToError};

/// Median and extremes; nothing of nothing.
pub(crate) fn spread(values: impl IntoIterator<Item = f64>) -> Option<Spread> {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    let (&low, &high) = (sorted.first()?, sorted.last()?);
    let n = sorted.len();
    let median = 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]);
    Some(Spread { median, low, high })
}

/// Medians and extremes of the runs of a setting; nothing without runs.
pub(crate) fn summary(runs: &[Run]) -> Option<Summary> {
    let of = |f: &dyn Fn(&Run) -> f64| spread(runs.iter().map(f));
    let error = |f: fn(&Errors) -> f64| spread(runs.iter().map(|run| f(&run.errors)));
    Some(Summary {
        seconds: of(&|run| run.seconds)?,
        cpu_seconds: of(&|run| run.cpu_seconds)?,
        peak_memory_bytes: of(&|run| run.peak_memory_bytes as f64)?,
        records: spread(runs.iter().filter_map(|run| run.records).map(|n| n as f64)),
        mse: error(|e| e.mse)?,
        rel_mse: error(|e| e.rel_mse)?,
        mape: error(|e| e.mape)?,
        bias: error(|e| e.bias)?,
        ssim: error(|e| e.ssim)?,
        flip: error(|e| e.flip)?,
    })
}

/// Median processor seconds and error of each setting that has both above 0.
pub(crate) fn time_and_error(settings: &[Setting]) -> Vec<(f64, f64)> {
    let medians = settings.iter().filter_map(|setting| {
        let summary = setting.summary.as_ref()?;
        Some((summary.cpu_seconds.median, summary.rel_mse.median))
    });
    medians.filter(|&(time, error)| time > 0.0 && error > 0.0).collect()
}

/// Exponent of error against time: least squares in the logarithms of at least three points, with
/// a 95 % interval by Student's distribution.
pub(crate) fn slope(points: &[(f64, f64)]) -> Option<Slope> {
    let n = points.len();
    if n < 3 {
        return None;
    }
    let logs: Vec<(f64, f64)> = points.iter().map(|&(x, y)| (x.ln(), y.ln())).collect();
    let mean = |f: &dyn Fn(&(f64, f64)) -> f64| logs.iter().map(f).sum::<f64>() / n as f64;
    let (mx, my) = (mean(&|p| p.0), mean(&|p| p.1));
    let sxx: f64 = logs.iter().map(|p| (p.0 - mx).powi(2)).sum();
    let sxy: f64 = logs.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
    // Times that do not differ tell nothing.
    if sxx < 1e-12 {
        return None;
    }
    let exponent = sxy / sxx;
    let residual = |p: &(f64, f64)| (p.1 - my - exponent * (p.0 - mx)).powi(2);
    let freedom = (n - 2) as f64;
    let variance = logs.iter().map(residual).sum::<f64>() / freedom;
    let half = student_quantile_two_sided(0.05, freedom) * (variance / sxx).sqrt();
    Some(Slope { exponent, low: exponent - half, high: exponent + half })
}

/// The slope of a series, where its settings form one curve.
pub(crate) fn series_slope(series: &Series) -> Option<Slope> {
    match series.kind {
        SeriesKind::Sweep { .. } => slope(&time_and_error(&series.settings)),
        SeriesKind::Steps | SeriesKind::EqualTime => None,
    }
}

/// When the error is reached: between the first two neighbours in time that bracket it,
/// interpolated in the logarithms of both, else what the points say of it. Never extrapolated.
pub(crate) fn time_to_error(points: &[(f64, f64)], error: f64) -> TimeToError {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (Some(&(first, least)), Some(&(last, _))) = (sorted.first(), sorted.last()) else {
        return TimeToError::Unknown;
    };
    match between(&sorted, error) {
        Some(time) => TimeToError::Reached(time),
        None if least <= error => TimeToError::AtMost(first),
        None => TimeToError::NotIn(last),
    }
}

fn between(sorted: &[(f64, f64)], error: f64) -> Option<f64> {
    let brackets = |pair: &&[(f64, f64)]| pair[0].1 >= error && pair[1].1 <= error;
    let pair = sorted.windows(2).find(brackets)?;
    let [(t0, e0), (t1, e1)] = [pair[0], pair[1]];
    if e0 == e1 {
        return Some(t0);
    }
    let share = (e0 / error).ln() / (e0 / e1).ln();
    Some((t0.ln() + share * (t1 / t0).ln()).exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: f64, b: f64) {
        assert!((a - b).abs() <= 1e-9 * b.abs().max(1.0), "{a} is not {b}");
    }

    #[test]
    fn medians_of_odd_and_even_numbers() {
        let spread_of = |values: &[f64]| spread(values.iter().copied());
        assert_eq!(spread_of(&[3.0, 1.0, 2.0]), Some(Spread { median: 2.0, low: 1.0, high: 3.0 }));
        assert_eq!(spread_of(&[4.0, 1.0]), Some(Spread { median: 2.5, low: 1.0, high: 4.0 }));
        assert_eq!(spread_of(&[]), None);
    }

    #[test]
    fn a_power_law_has_its_exponent_without_doubt() {
        let points: Vec<(f64, f64)> =
            [0.5, 1.0, 7.0, 20.0].iter().map(|&t: &f64| (t, 3.0 * t.powf(-1.25))).collect();
        let found = slope(&points).expect("four points");
        near(found.exponent, -1.25);
        assert!(found.high - found.low < 1e-6);
        assert_eq!(slope(&points[..2]), None);
        assert_eq!(slope(&[(1.0, 1.0); 3]), None);
    }

    /// By hand: x = 0, 1, 2, y = 0, 1, 0 has slope 0, residuals -1/3, 2/3, -1/3, hence variance
    /// 2/3 and standard error √(1/3); t(0.975) with one degree of freedom is tan(0.475 π).
    #[test]
    fn the_interval_of_a_slope_by_hand() {
        let e = std::f64::consts::E;
        let found = slope(&[(1.0, 1.0), (e, e), (e * e, 1.0)]).expect("three points");
        let half = (0.475 * std::f64::consts::PI).tan() * (1.0_f64 / 3.0).sqrt();
        near(found.exponent, 0.0);
        near(found.high, half);
        near(found.low, -half);
    }

    #[test]
    fn times_are_interpolated_in_the_logarithms() {
        // error = 1 / t, exactly a line in the logarithms; given out of order.
        let points = [(100.0, 0.01), (1.0, 1.0), (10.0, 0.1)];
        let reached = |points: &[(f64, f64)], error| match time_to_error(points, error) {
            TimeToError::Reached(time) => time,
            other => panic!("{other:?}"),
        };
        near(reached(&points, 0.05), 20.0);
        near(reached(&points, 1.0), 1.0);
        near(reached(&points, 0.01), 100.0);
        assert_eq!(time_to_error(&points, 2.0), TimeToError::AtMost(1.0));
        assert_eq!(time_to_error(&points, 0.001), TimeToError::NotIn(100.0));
        near(reached(&[(1.0, 0.5), (2.0, 0.5)], 0.5), 1.0);
        assert_eq!(time_to_error(&[(1.0, 0.5)], 0.5), TimeToError::AtMost(1.0));
        assert_eq!(time_to_error(&[(1.0, 0.5)], 0.4), TimeToError::NotIn(1.0));
        assert_eq!(time_to_error(&[], 0.5), TimeToError::Unknown);
    }
}
