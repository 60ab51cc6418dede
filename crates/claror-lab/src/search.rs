//! The value of a parameter with which a picture takes a given time.

/// Where a parameter is searched. `fast` and `slow` are above 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Range {
    /// The value where pictures take the least time.
    pub(crate) fast: f64,
    /// The value where they take the most.
    pub(crate) slow: f64,
}

/// Runs of a search at most.
pub(crate) const PROBES: usize = 5;
/// Times within these shares of the wanted one are good enough.
const GOOD: std::ops::RangeInclusive<f64> = 0.93..=MOST;
/// Share of the wanted time that a picture may take at most.
const MOST: f64 = 1.1;
/// Where a search begins that knows nothing: the fast end costs little.
const FIRST: f64 = 0.25;

impl Range {
    /// The value at a place from 0, fast, to 1, slow; even in the logarithm. It has four digits,
    /// so that it can be read and typed, and is a whole number if both ends are, above 1.
    fn value(&self, place: f64) -> f64 {
        let value = self.fast * (self.slow / self.fast).powf(place);
        let is_count = |v: f64| v > 1.0 && v.fract() == 0.0;
        if is_count(self.fast) && is_count(self.slow) {
            return value.round();
        }
        format!("{value:.3e}").parse().unwrap_or(value)
    }

    fn place(&self, value: f64) -> f64 {
        (value / self.fast).ln() / (self.slow / self.fast).ln()
    }

    /// The value to try next for pictures of `seconds`, by the secant in the logarithms of time
    /// and value; nothing if a value is good enough, or if nothing new is left to try. `known`
    /// holds values and their seconds.
    pub(crate) fn next(&self, known: &[(f64, f64)], seconds: f64) -> Option<f64> {
        if known.iter().any(|(_, time)| GOOD.contains(&(time / seconds))) {
            return None;
        }
        let mut points: Vec<(f64, f64)> = known
            .iter()
            .filter(|(_, time)| *time > 0.0)
            .map(|&(value, time)| (self.place(value), (time / seconds).ln()))
            .collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let place = match &points[..] {
            [] => FIRST,
            [only] => only.0 - only.1 / self.usual_slope(),
            points => secant(points),
        };
        let value = self.value(place.clamp(0.0, 1.0));
        (!known.iter().any(|&(other, _)| other == value)).then_some(value)
    }

    /// Change of the logarithm of time from end to end if time goes as one over the value.
    fn usual_slope(&self) -> f64 {
        (self.slow / self.fast).ln().abs().max(1e-6)
    }

    /// The value whose time is closest to `seconds` among those not above 110 % of it.
    pub(crate) fn best(known: &[(f64, f64)], seconds: f64) -> Option<f64> {
        let distance = |time: f64| (time / seconds).ln().abs();
        known
            .iter()
            .filter(|(_, time)| *time > 0.0 && *time <= MOST * seconds)
            .min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)))
            .map(|&(value, _)| value)
    }
}

/// Where the line through two neighbours meets 0: the two that bracket it, else the nearest two.
fn secant(points: &[(f64, f64)]) -> f64 {
    let bracket = points.windows(2).find(|pair| pair[0].1 <= 0.0 && pair[1].1 >= 0.0);
    let outside = || if points[0].1 > 0.0 { &points[..2] } else { &points[points.len() - 2..] };
    let pair = bracket.unwrap_or_else(outside);
    let [(x0, y0), (x1, y1)] = [pair[0], pair[1]];
    if bracket.is_some() && y0 == y1 {
        return 0.5 * (x0 + x1);
    }
    if y1 <= y0 {
        // Noise: time must rise; half a step in the right direction.
        return if y0 > 0.0 { 0.5 * x0 } else { 0.5 * (x1 + 1.0) };
    }
    x0 - y0 * (x1 - x0) / (y1 - y0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ERROR: Range = Range { fast: 0.2, slow: 0.0005 };

    fn search(range: Range, seconds: f64, time: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
        let mut known = Vec::new();
        while known.len() < PROBES {
            let Some(value) = range.next(&known, seconds) else { break };
            known.push((value, time(value)));
        }
        known
    }

    #[test]
    fn power_laws_are_found_in_a_few_steps() {
        for power in [0.5, 1.0, 2.0] {
            let time = |error: f64| (0.01 / error).powf(power);
            for seconds in [0.3, 1.0, 3.0] {
                let known = search(ERROR, seconds, time);
                let best = Range::best(&known, seconds).expect("it can be reached");
                let share = time(best) / seconds;
                assert!((0.93..=1.1).contains(&share), "{power} {seconds}: {known:?}");
                // One to start, one by the guess, one by the secant: the line is exact.
                assert!(known.len() <= 3, "{known:?}");
            }
        }
    }

    #[test]
    fn a_constant_cost_is_no_obstacle() {
        let time = |error: f64| 0.5 + 0.004 / error;
        let known = search(ERROR, 2.0, time);
        let share = time(Range::best(&known, 2.0).expect("reached")) / 2.0;
        assert!((0.9..=1.1).contains(&share), "{known:?}");
    }

    #[test]
    fn what_cannot_be_reached_ends_at_an_end() {
        let known = search(ERROR, 1.0, |_| 50.0);
        assert_eq!(known.last().map(|k| k.0), Some(0.2));
        assert_eq!(Range::best(&known, 1.0), None);
        let known = search(ERROR, 1000.0, |error| 0.01 / error);
        assert_eq!(Range::best(&known, 1000.0), Some(0.0005));
    }

    #[test]
    fn counts_stay_whole_and_values_short() {
        let rays = Range { fast: 16.0, slow: 65536.0 };
        for (value, _) in search(rays, 1.0, |rays| rays / 1000.0) {
            assert_eq!(value.fract(), 0.0);
        }
        for (value, _) in search(ERROR, 1.0, |error| 0.01 / error) {
            assert!(value.to_string().len() <= 9, "{value}");
        }
    }

    #[test]
    fn a_slightly_slow_picture_wins_over_a_much_too_fast_one() {
        assert_eq!(Range::best(&[(1.0, 0.5), (2.0, 1.09), (3.0, 1.2)], 1.0), Some(2.0));
    }
}
