//! Ticks of axes and their labels, the same for interactive and static charts.

use super::chart::Axis;
use super::number;

/// About so many ticks within the axis; lesser ones have no label.
pub(super) fn ticks(axis: &Axis, about: usize) -> Vec<(f64, Option<String>)> {
    let [low, high] = axis.domain;
    if !axis.log {
        return linear_ticks(low, high, about, axis.percent);
    }
    let (first, last) = (low.log10().floor() as i32, high.log10().ceil() as i32);
    let decades = (high / low).log10();
    let step = (decades / about as f64).ceil().max(1.0) as i32;
    let labelled: &[u32] = if decades < 1.3 {
        &[1, 2, 3, 5, 7]
    } else if decades < 2.5 {
        &[1, 2, 5]
    } else {
        &[1]
    };
    // One way of writing along an axis.
    let plain = low >= 1e-3 && high < 1e5;
    let mut out = Vec::new();
    for exponent in first..=last {
        for digit in 1..=9u32 {
            let v = f64::from(digit) * 10f64.powi(exponent);
            if v < low || v > high || (decades > 5.0 && digit > 1) {
                continue;
            }
            let has_label = labelled.contains(&digit) && exponent.rem_euclid(step) == 0;
            out.push((
                v,
                has_label.then(|| if plain { decimal(v) } else { number::round_number(v) }),
            ));
        }
    }
    out
}

fn decimal(v: f64) -> String {
    format!("{}", (v * 1000.0).round() / 1000.0)
}

fn linear_ticks(low: f64, high: f64, about: usize, percent: bool) -> Vec<(f64, Option<String>)> {
    let rough = (high - low) / about as f64;
    let unit = 10f64.powf(rough.log10().floor());
    let step =
        [1.0, 2.0, 5.0, 10.0].map(|m| m * unit).into_iter().find(|&s| s >= rough).unwrap_or(rough);
    let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
    let scale = if percent { 100.0 } else { 1.0 };
    let digits = (-(step * scale).log10().floor()).clamp(0.0, 9.0) as usize;
    let tick = |i: i64| {
        let v = i as f64 * step;
        let sign = if percent && i > 0 { "+" } else { "" };
        let unit = if percent { "\u{202f}%" } else { "" };
        (v, Some(format!("{sign}{:.digits$}{unit}", v * scale).replace('-', "−")))
    };
    (first..=last).map(tick).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(domain: [f64; 2], log: bool) -> Vec<String> {
        let axis = Axis { domain, ..Axis::new("", log) };
        ticks(&axis, 6).into_iter().filter_map(|t| t.1).collect()
    }

    #[test]
    fn ticks_are_round_and_within_the_axis() {
        assert_eq!(labels([0.9e-5, 1.1e-1], true), ["10⁻⁵", "10⁻⁴", "10⁻³", "10⁻²", "10⁻¹"]);
        assert_eq!(labels([0.05, 150.0], true), ["0.1", "1", "10", "100"]);
        assert_eq!(labels([0.9, 8.0], true), ["1", "2", "3", "5", "7"]);
        assert_eq!(labels([-0.011, 0.021], false), ["−0.01", "0.00", "0.01", "0.02"]);
    }
}
