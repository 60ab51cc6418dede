//! How long the rest will take, as runs before took.

use std::collections::BTreeMap;

/// Seconds of finished runs, by what is the same in all seeds of a setting.
#[derive(Debug, Clone, Default)]
pub(crate) struct Forecast {
    taken: BTreeMap<String, (f64, f64)>,
}

impl Forecast {
    /// A run of this setting took so long.
    pub(crate) fn learn(&mut self, setting: &str, seconds: f64) {
        let (sum, count) = self.taken.entry(setting.to_owned()).or_default();
        *sum += seconds;
        *count += 1.0;
    }

    /// Seconds that runs of these settings will take: the mean of the same setting, of all
    /// settings for those that are new. Nothing if nothing is known.
    pub(crate) fn seconds<'a>(&self, settings: impl Iterator<Item = &'a str>) -> Option<f64> {
        let means: Vec<f64> = self.taken.values().map(|(sum, count)| sum / count).collect();
        let usual = means.iter().sum::<f64>() / means.len() as f64;
        let of = |setting: &str| self.taken.get(setting).map_or(usual, |(sum, count)| sum / count);
        (!means.is_empty()).then(|| settings.map(of).sum())
    }
}

/// How long one process will take that says how far it is. It may have begun in the middle.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Pace {
    /// When something was heard first, seconds, and the share then.
    first: Option<(f64, f64)>,
}

impl Pace {
    /// Seconds that the rest of the process takes and another whole one would take, as it was
    /// since the first share that was heard.
    pub(crate) fn rest_and_whole(&mut self, now: f64, share: f64) -> Option<(f64, f64)> {
        let (start, first) = *self.first.get_or_insert((now, share));
        let whole = (now - start) / (share - first);
        (share > first).then_some(((1.0 - share) * whole, whole))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pace_counts_from_where_it_began() {
        let mut pace = Pace::default();
        assert_eq!(pace.rest_and_whole(1.0, 0.5), None);
        assert_eq!(pace.rest_and_whole(2.0, 0.5), None);
        assert_eq!(pace.rest_and_whole(3.0, 0.75), Some((2.0, 8.0)));
    }

    #[test]
    fn known_settings_take_as_long_as_before() {
        let mut forecast = Forecast::default();
        assert_eq!(forecast.seconds(["a"].into_iter()), None);
        forecast.learn("a", 1.0);
        forecast.learn("a", 3.0);
        forecast.learn("b", 10.0);
        assert_eq!(forecast.seconds(["a", "b", "b"].into_iter()), Some(22.0));
        assert_eq!(forecast.seconds(["c"].into_iter()), Some(6.0));
        assert_eq!(forecast.seconds(std::iter::empty()), Some(0.0));
    }
}
