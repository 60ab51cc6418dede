//! What the irradiance cache or the grid of a render did, in words and as JSON.

use std::time::Duration;

use claror::integrator::{CacheStatistics, GridCache, LookupCounts};
use serde_json::{Value, json};

use crate::progress::seconds;
use crate::units;

/// Time spent on making records and on samples.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Times {
    /// Until the cache or grid was complete; none without one, and if it never was.
    pub(crate) prepass: Option<Duration>,
    /// Together.
    pub(crate) all: Duration,
}

impl Times {
    fn samples(&self) -> Duration {
        self.all.saturating_sub(self.prepass.unwrap_or_default())
    }

    pub(crate) fn json(&self) -> Value {
        json!({ "prepass": self.prepass.map(seconds), "render": seconds(self.samples()) })
    }
}

/// `1234 records (1000 read) from 65 kwalks and 710 krays; 0.05 % of 262144 look-ups uncached`.
pub(crate) fn summary(cache: &CacheStatistics, lookups: &LookupCounts, read: usize) -> String {
    let read =
        if read > 0 { format!(" ({} read)", units::grouped(read as u64)) } else { "".into() };
    let mut text = format!(
        "{}{read} from {}walks and {}rays",
        units::plural(cache.records as u64, "record"),
        units::decimal(cache.walks as f64),
        units::decimal(cache.rays as f64),
    );
    if let Some(share) = lookups.uncached_share() {
        let count = units::grouped(lookups.lookups);
        text.push_str(&format!("; {:.2} % of {count} look-ups uncached", 100.0 * share));
    }
    text
}

/// `441 grid points every 20 pixels, 395 of them on diffuse surfaces, from 3.2 Mrays; 1.50 % of
/// 262144 look-ups by paths`.
pub(crate) fn grid_summary(grid: &GridCache, lookups: &LookupCounts) -> String {
    let mut text = format!(
        "{} every {}, {} of them on diffuse surfaces, from {}rays",
        units::plural(grid.len() as u64, "grid point"),
        units::plural(grid.settings().step.into(), "pixel"),
        units::grouped(grid.used_points().len() as u64),
        units::decimal(grid.rays as f64),
    );
    if let Some(share) = lookups.uncached_share() {
        let count = units::grouped(lookups.lookups);
        text.push_str(&format!("; {:.2} % of {count} look-ups by paths", 100.0 * share));
    }
    text
}

/// The grid and what was asked of it.
pub(crate) fn grid_json(grid: &GridCache, lookups: &LookupCounts) -> Value {
    json!({
        "points": grid.len(),
        "used": grid.used_points().len(),
        "rays": grid.rays,
        "lookups": lookups_json(lookups),
    })
}

/// Everything else, for those who want to know.
pub(crate) fn details(
    cache: &CacheStatistics,
    lookups: &LookupCounts,
    times: &Times,
) -> Vec<String> {
    let mut lines = records(cache).to_vec();
    if let Some(levels) = levels(cache) {
        lines.push(format!("records by lattice: {levels}"));
    }
    if let Some(mean) = lookups.mean_records() {
        lines.push(format!(
            "look-ups: {}, {} uncached, the others of {mean:.2} records",
            units::grouped(lookups.lookups),
            units::grouped(lookups.uncached),
        ));
    }
    if let Some(prepass) = times.prepass {
        let [prepass, samples] = [prepass, times.samples()].map(units::duration);
        lines.push(format!("time: {prepass} for records, {samples} for samples"));
    }
    lines
}

/// What limits the records, and what was not stored.
pub(crate) fn records(cache: &CacheStatistics) -> [String; 2] {
    [
        format!(
            "radii: {} raised to the least, {} lowered to the largest, {} limited by the gradient, \
             {} in their axis ratio, {} in crevices",
            cache.raised,
            cache.lowered,
            cache.gradient_limited,
            cache.ratio_limited,
            cache.crevices
        ),
        format!("not stored: {} discarded, {} not valid", cache.discarded, cache.invalid),
    ]
}

/// `12 every 64 pixels, 40 every 32, 210 every 16`, from coarse to fine.
pub(crate) fn levels(cache: &CacheStatistics) -> Option<String> {
    let made = strides(cache);
    let texts = made.iter().map(|(stride, count)| format!("{count} every {stride}"));
    let text = texts.collect::<Vec<_>>().join(", ");
    (!text.is_empty()).then(|| format!("{text} pixels"))
}

/// Strides of the lattices that made records, with how many, from coarse to fine.
fn strides(cache: &CacheStatistics) -> Vec<(u64, usize)> {
    let levels = cache.levels.iter().enumerate().rev();
    levels.filter(|(_, count)| **count > 0).map(|(i, count)| (1 << i, *count)).collect()
}

/// The statistics of the records.
pub(crate) fn cache_json(cache: &CacheStatistics) -> Value {
    let levels = strides(cache);
    json!({
        "records": cache.records,
        "discarded": cache.discarded,
        "invalid": cache.invalid,
        "at_least_radius": cache.raised,
        "at_largest_radius": cache.lowered,
        "gradient_limited": cache.gradient_limited,
        "ratio_limited": cache.ratio_limited,
        "crevices": cache.crevices,
        "walks": cache.walks,
        "rays": cache.rays,
        "levels": levels
            .iter()
            .map(|(stride, count)| json!({ "stride": stride, "records": count }))
            .collect::<Vec<_>>(),
    })
}

/// The look-ups of a render.
pub(crate) fn lookups_json(lookups: &LookupCounts) -> Value {
    json!({
        "count": lookups.lookups,
        "uncached": lookups.uncached,
        "uncached_share": lookups.uncached_share(),
        "mean_records": lookups.mean_records(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cache() -> CacheStatistics {
        let mut cache = CacheStatistics { records: 1300, rays: 710_000, ..Default::default() };
        cache.levels[0] = 1000;
        cache.levels[5] = 300;
        cache
    }

    #[test]
    fn the_summary_is_one_line() {
        let lookups = LookupCounts { lookups: 20_000, uncached: 10, records: 60_000 };
        let line = summary(&cache(), &lookups, 1000);
        assert_eq!(
            line,
            "1 300 records (1 000 read) from 0.00 walks and 710 krays; 0.05 % of 20 000 look-ups \
             uncached"
        );
        let line = summary(&cache(), &LookupCounts::default(), 0);
        assert!(line.ends_with("rays"), "{line}");
    }

    #[test]
    fn lattices_are_told_from_coarse_to_fine() {
        assert_eq!(levels(&cache()).as_deref(), Some("300 every 32, 1000 every 1 pixels"));
        assert_eq!(levels(&CacheStatistics::default()), None);
    }

    #[test]
    fn times_add_up() {
        let all = Duration::from_secs(3);
        let times = Times { prepass: Some(Duration::from_secs(1)), all };
        assert_eq!(times.json(), json!({ "prepass": 1.0, "render": 2.0 }));
        let times = Times { prepass: None, all };
        assert_eq!(times.json(), json!({ "prepass": null, "render": 3.0 }));
    }
}
