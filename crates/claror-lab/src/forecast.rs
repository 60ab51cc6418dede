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

#[cfg(test)]
mod tests {
    use super::*;

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
