//! `claror cache lookups`: what a look-up costs in the cache of a file.
//!
//! Points are made the same way for every structure and on every run: beside records that chance
//! chooses, as far as these reach along their tangent planes. What is counted is therefore the same
//! on every run; only the times differ. Asking whether something hides a record from a point needs
//! the scene, and is left out.

use std::hint::black_box;
use std::time::{Duration, Instant};

use claror::integrator::{CacheParameter, IrrCacheSettings};
use claror::irradiance::{Index, IndexKind, LookupSettings, Query, Record, lookup};
use claror::math::statistics::TestRng;
use claror::math::{Bounds3, warp};
use claror::render::Fingerprint;
use serde_json::{Value, json};

use super::cache_file;
use crate::args::LookupsArgs;
use crate::exit::{Exit, Failure};
use crate::messages::Console;
use crate::units;

/// Points, more than caches of a processor hold the surroundings of; the least that is timed.
const POINTS: (usize, usize) = (200, 1 << 16);
/// Candidates that are counted by trying all records, about: points are fewer where records are
/// many.
const TRIES: usize = 1 << 27;
/// Passes that are timed, and the least.
const PASSES: (usize, usize) = (3, 9);
/// Longest time of a pass and of all, unless the least number of points takes longer.
const PASS_TIME: Duration = Duration::from_millis(250);
const ALL_TIME: Duration = Duration::from_secs(2);

/// What look-ups by one structure cost.
#[derive(Debug)]
struct Cost {
    index: IndexKind,
    /// Median over the passes of the mean time of a look-up.
    nanoseconds: f64,
    /// Points of a pass.
    timed: usize,
    counts: Counts,
}

/// Means over the same points for every structure.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Counts {
    /// Records that are tested.
    candidates: f64,
    /// Records that have a weight.
    used: f64,
}

/// A cache to ask, and what to ask it.
struct Subject<'a> {
    records: &'a [Record],
    settings: LookupSettings,
    bounds: Bounds3,
    queries: Vec<Query>,
}

/// Measures and tells.
pub(super) fn run(args: &LookupsArgs, console: &Console) -> Result<Exit, Failure> {
    let cache = cache_file::read(&args.file)?;
    let file = args.file.display().to_string();
    let records = &cache.contents.records[..];
    let costs: Vec<Cost> = if records.is_empty() {
        Vec::new()
    } else {
        let subject = Subject::new(records, settings(&cache.fingerprint).frozen_lookup());
        args.index.iter().map(|&kind| subject.cost(kind)).collect()
    };
    if costs.is_empty() {
        console.result(&format!("{file} holds no records: there is nothing to look up"));
    } else {
        console.result(&format!("{file}: {}", units::plural(records.len() as u64, "record")));
        table(&costs).iter().for_each(|line| console.result(line));
    }
    console.event(&json!({
        "event": "result",
        "file": file,
        "records": records.len(),
        "lookups": costs.iter().map(Cost::json).collect::<Vec<_>>(),
    }));
    Ok(Exit::Success)
}

/// The parameters that a cache was made with. What is no parameter is something else that it
/// depends on.
fn settings(fingerprint: &Fingerprint) -> IrrCacheSettings {
    let mut settings = IrrCacheSettings::default();
    for (name, value) in &fingerprint.entries {
        if let Some(parameter) = CacheParameter::find(name) {
            // Of what this version wrote, everything can be read.
            let _ = parameter.set(&mut settings, value);
        }
    }
    settings
}

impl<'a> Subject<'a> {
    /// Of records, of which there is one at least.
    fn new(records: &'a [Record], settings: LookupSettings) -> Self {
        let bounds = records.iter().fold(Bounds3::EMPTY, |b, r| b.including(r.position));
        let queries = (0..POINTS.1 as u64).map(|i| query(records, i)).collect();
        Self { records, settings, bounds, queries }
    }

    fn cost(&self, kind: IndexKind) -> Cost {
        let reach = self.settings.reach();
        let index = Index::finished(kind, self.records, self.bounds, reach);
        let (nanoseconds, timed) = self.time(&index);
        Cost { index: kind, nanoseconds, timed, counts: self.count(&index) }
    }

    /// Nanoseconds of a look-up, and points of a pass. The first pass says how many can be asked,
    /// and is not timed: it fills the processor's caches.
    fn time(&self, index: &Index) -> (f64, usize) {
        let start = Instant::now();
        let mut count = 0;
        while count < self.queries.len() && (count == 0 || start.elapsed() < PASS_TIME) {
            let end = (count + POINTS.0).min(self.queries.len());
            black_box(self.used(index, &self.queries[count..end]));
            count = end;
        }
        let queries = &self.queries[..count];
        let mut passes = Vec::new();
        while passes.len() < PASSES.0 || (passes.len() < PASSES.1 && start.elapsed() < ALL_TIME) {
            let begin = Instant::now();
            black_box(self.used(index, queries));
            passes.push(begin.elapsed().as_secs_f64() * 1e9 / count as f64);
        }
        passes.sort_unstable_by(f64::total_cmp);
        (passes[passes.len() / 2], count)
    }

    /// Sum of the records that go into look-ups.
    fn used(&self, index: &Index, queries: &[Query]) -> u64 {
        let found = queries.iter().filter_map(|q| lookup(self.records, index, q, &self.settings));
        found.map(|found| u64::from(found.records)).sum()
    }

    fn count(&self, index: &Index) -> Counts {
        let count = (TRIES / self.records.len()).clamp(POINTS.0, POINTS.1);
        let queries = &self.queries[..count];
        let mut candidates = 0_u64;
        for query in queries {
            index.for_candidates(query.p, |_| candidates += 1);
        }
        let mean = |sum: u64| sum as f64 / count as f64;
        Counts { candidates: mean(candidates), used: mean(self.used(index, queries)) }
    }
}

/// The point of this number: beside a record, on its tangent plane, where it reaches.
fn query(records: &[Record], number: u64) -> Query {
    let mut rng = TestRng::new(number);
    let record = &records[(rng.next_u64() % records.len() as u64) as usize];
    let offset = warp::concentric_disk(rng.next_vec2());
    let [short, long] = record.radii;
    let across = record.normal.cross(record.axis);
    let p = record.position + record.axis * (offset.x * short) + across * (offset.y * long);
    Query { p, n_smooth: record.normal, n_shading: record.normal }
}

impl Cost {
    fn json(&self) -> Value {
        json!({
            "index": self.index.name(),
            "nanoseconds": self.nanoseconds,
            "candidates": self.counts.candidates,
            "records_used": self.counts.used,
            "timed": self.timed,
        })
    }
}

fn table(costs: &[Cost]) -> Vec<String> {
    let head = format!("{:8} {:>12} {:>12} {:>8}", "index", "ns", "candidates", "used");
    let row = |cost: &Cost| {
        let Cost { index, nanoseconds, counts: Counts { candidates, used }, .. } = cost;
        format!("{:8} {nanoseconds:>12.0} {candidates:>12.1} {used:>8.2}", index.name())
    };
    std::iter::once(head).chain(costs.iter().map(row)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use claror::math::Vec3;
    use claror::spectrum::Rgb;

    /// On the sides of a unit cube, radii between 1 and 4 times the least.
    fn records(count: u64) -> Vec<Record> {
        let record = |key| {
            let mut rng = TestRng::new(key);
            let axis = (rng.next_u64() % 3) as usize;
            let u = rng.next_vec2();
            let mut position = Vec3::ZERO;
            (position[(axis + 1) % 3], position[(axis + 2) % 3]) = (u.x, u.y);
            let normal = Vec3::AXES[axis];
            let radius = 0.05 * (1.0 + 3.0 * rng.next_f32());
            Record {
                key,
                position,
                normal,
                axis: Vec3::AXES[(axis + 1) % 3],
                irradiance: Rgb::WHITE,
                translational: [Vec3::ZERO; 3],
                rotational: [Vec3::ZERO; 3],
                radii: [radius, 2.0 * radius],
                max_angle: 0.35,
                harmonic_mean_distance: 1.0,
                natural_radius: radius,
                flags: 0,
                corral: 0,
                corral_distance: f32::INFINITY,
            }
        };
        (0..count).map(record).collect()
    }

    /// Whatever the structure, the same records are used, and no fewer are tested; `leaves` alone
    /// misses some.
    #[test]
    fn structures_find_the_same_records() {
        let records = records(300);
        let subject = Subject::new(&records, IrrCacheSettings::default().frozen_lookup());
        let reach = subject.settings.reach();
        let count = |kind| subject.count(&Index::finished(kind, &records, subject.bounds, reach));
        let all = count(IndexKind::Vector);
        assert_eq!(all.candidates, 300.0);
        assert!(all.used >= 1.0, "points are where records reach: {all:?}");
        for kind in [IndexKind::Cells, IndexKind::Bvh, IndexKind::Octree] {
            let found = count(kind);
            assert_eq!(found.used, all.used, "{kind:?}");
            assert!(
                found.candidates >= found.used && found.candidates < all.candidates,
                "{found:?}"
            );
        }
        assert!(count(IndexKind::Leaves).used < all.used);
    }

    #[test]
    fn points_are_where_their_records_reach() {
        let records = records(20);
        for number in 0..500 {
            let query = query(&records, number);
            let is_near = |r: &Record| {
                let delta = query.p - r.position;
                let (u, v) = (delta.dot(r.axis), delta.dot(r.normal.cross(r.axis)));
                let [short, long] = r.radii;
                query.n_smooth == r.normal
                    && delta.dot(r.normal).abs() < 1e-6
                    && (u / short).powi(2) + (v / long).powi(2) < 1.0 + 1e-5
            };
            assert!(records.iter().any(is_near), "{query:?}");
        }
    }

    #[test]
    fn what_a_cache_was_made_with_is_used() {
        let entries = [("seed", "1"), ("overlap", "2.5"), ("scene", "0a"), ("criterion", "ward88")];
        let entries = entries.map(|(name, value)| (name.to_owned(), value.to_owned())).to_vec();
        let found = settings(&Fingerprint { entries }).frozen_lookup();
        assert_eq!(found.overlap, 2.5);
        assert!(!found.gradients);
    }
}
