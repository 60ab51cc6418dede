//! What a look-up does, for people who want to see it: slower than [`super::lookup()`], and apart
//! from it.

use super::index::Index;
use super::kernel::{LookupSettings, Query, Rejection, rejection};
use super::lookup::{Interpolated, lookup_with};
use super::record::Record;

/// Why no record serves a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Miss {
    /// None reaches it.
    NoneNear,
    /// Those that reach it face elsewhere.
    Turned,
    /// Of those that face it, all that reach it lie in front of it.
    InFront,
    /// The weights of those that pass the tests do not suffice.
    LittleWeight,
}

/// A look-up with what went into it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inspection {
    /// What [`super::lookup()`] finds, or why it finds nothing.
    pub found: Result<Interpolated, Miss>,
    /// Sum of the weights, also where it does not suffice.
    pub weight: f32,
    /// Records that have a weight.
    pub records: u32,
    /// Weighted harmonic mean of their [`Record::harmonic_mean_distance`]: the inverse of the
    /// weighted mean of 1/R, to which a record that sees nothing adds nothing. Infinite without
    /// records, and where none sees anything.
    pub harmonic_mean_distance: f32,
    /// Weighted mean of their first radii, scene units; 0 without records.
    pub radius: f32,
}

/// Looks up as [`super::lookup_seen()`] does, and tells more.
pub fn inspect(
    records: &[Record],
    index: &Index,
    query: &Query,
    settings: &LookupSettings,
    is_seen: impl FnMut(&Record) -> bool,
) -> Inspection {
    let (mut used, mut weight, mut inverse_distance, mut radius) = (0, 0.0, 0.0, 0.0);
    let found = lookup_with(records, index, query, settings, is_seen, |candidates| {
        used = candidates.len() as u32;
        for candidate in candidates {
            let record = &records[candidate.index as usize];
            let w = f64::from(candidate.weight);
            weight += w;
            inverse_distance += w / f64::from(record.harmonic_mean_distance);
            radius += w * f64::from(record.radii[0]);
        }
    });
    let means = (used > 0).then(|| (weight / inverse_distance, radius / weight));
    let (harmonic_mean_distance, radius) = means.unwrap_or((f64::INFINITY, 0.0));
    Inspection {
        found: found.ok_or_else(|| miss(records, index, query, settings)),
        weight: weight as f32,
        records: used,
        harmonic_mean_distance: harmonic_mean_distance as f32,
        radius: radius as f32,
    }
}

/// The reason of the record that comes closest to serving.
fn miss(records: &[Record], index: &Index, query: &Query, settings: &LookupSettings) -> Miss {
    let mut last = Some(Rejection::Far);
    index.for_candidates(query.p, |i| {
        if let (Some(record), Some(reached)) = (records.get(i as usize), last) {
            // Without a rejection it has a weight, which then did not suffice.
            last = rejection(record, query, settings).map(|rejection| rejection.max(reached));
        }
    });
    match last {
        Some(Rejection::Far) => Miss::NoneNear,
        Some(Rejection::Turned) => Miss::Turned,
        Some(Rejection::InFront) => Miss::InFront,
        Some(Rejection::Weightless) | None => Miss::LittleWeight,
    }
}
