//! Interpolation between records.

use arrayvec::ArrayVec;

use super::index::Index;
use super::kernel::{LookupSettings, Query, weight};
use super::record::Record;
use crate::math::Vec3;
use crate::spectrum::Rgb;

/// Most records that one look-up uses. Of more, those with the smallest numbers: rare, and the
/// same for every index.
const CAPACITY: usize = 64;

/// What a look-up found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interpolated {
    /// Irradiance, W·m⁻².
    pub irradiance: Rgb,
    /// Sum of the weights.
    pub weight: f32,
    /// How many records went in.
    pub records: u32,
}

/// A record that goes into a look-up.
#[derive(Clone, Copy)]
pub(crate) struct Candidate {
    pub(crate) index: u32,
    pub(crate) weight: f32,
    distance2: f32,
}

pub(crate) type Candidates = ArrayVec<Candidate, CAPACITY>;

/// Irradiance at a point from the records around it; `None` when too few of them can serve it.
///
/// Sums run in the order of the records' numbers, so that every index gives the same bits.
pub fn lookup(
    records: &[Record],
    index: &Index,
    query: &Query,
    settings: &LookupSettings,
) -> Option<Interpolated> {
    lookup_with(records, index, query, settings, |_| true, |_| ())
}

/// [`lookup`] among those valid records for which `is_seen` holds.
#[inline]
pub fn lookup_seen(
    records: &[Record],
    index: &Index,
    query: &Query,
    settings: &LookupSettings,
    is_seen: impl FnMut(&Record) -> bool,
) -> Option<Interpolated> {
    lookup_with(records, index, query, settings, is_seen, |_| ())
}

/// [`lookup_seen`] that shows to `show` what goes in. A function of its own for each of its users,
/// so that nobody's look-ups pay for those of others.
#[inline(always)]
pub(crate) fn lookup_with(
    records: &[Record],
    index: &Index,
    query: &Query,
    settings: &LookupSettings,
    mut is_seen: impl FnMut(&Record) -> bool,
    show: impl FnOnce(&Candidates),
) -> Option<Interpolated> {
    let mut candidates = Candidates::new();
    index.for_candidates_of(records.len() as u32, query.p, |i| {
        if let Some(record) = records.get(i as usize)
            && let Some((weight, distance2)) = weight(record, query, settings)
            && is_seen(record)
        {
            insert(&mut candidates, Candidate { index: i, weight, distance2 });
        }
    });
    if settings.nearest > 0 {
        keep_nearest(&mut candidates, settings.nearest as usize);
    }
    show(&candidates);
    let total: f64 = candidates.iter().map(|c| f64::from(c.weight)).sum();
    if !(total > 0.0 && total >= f64::from(settings.min_weight)) {
        return None;
    }
    let sum = if settings.gradients {
        extrapolated(records, &candidates, query, settings, total)
    } else {
        plain(records, &candidates)
    };
    let irradiance = Rgb::from(sum.map(|s| (s / total) as f32));
    irradiance.is_finite().then_some(Interpolated {
        irradiance,
        weight: total as f32,
        records: candidates.len() as u32,
    })
}

/// Keeps the list sorted by number.
#[inline]
fn insert(candidates: &mut Candidates, new: Candidate) {
    let mut at = candidates.len();
    while at > 0 && candidates[at - 1].index > new.index {
        at -= 1;
    }
    if candidates.is_full() {
        if at == CAPACITY {
            return;
        }
        candidates.pop();
    }
    candidates.insert(at, new);
}

fn keep_nearest(candidates: &mut Candidates, count: usize) {
    if candidates.len() <= count {
        return;
    }
    candidates
        .sort_unstable_by(|a, b| a.distance2.total_cmp(&b.distance2).then(a.index.cmp(&b.index)));
    candidates.truncate(count);
    candidates.sort_unstable_by_key(|c| c.index);
}

fn plain(records: &[Record], candidates: &Candidates) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for c in candidates {
        for (sum, e) in sum.iter_mut().zip(records[c.index as usize].irradiance.to_array()) {
            *sum += f64::from(c.weight) * f64::from(e);
        }
    }
    sum
}

/// Weighted sum of the records' values, each extrapolated by a mixture of its own gradient and
/// the weighted mean of all.
fn extrapolated(
    records: &[Record],
    candidates: &Candidates,
    query: &Query,
    settings: &LookupSettings,
    total: f64,
) -> [f64; 3] {
    let mut translational = [Vec3::ZERO; 3];
    let mut rotational = [Vec3::ZERO; 3];
    let (own, mix) = (1.0 - settings.mix, settings.mix / total as f32);
    if settings.mix > 0.0 {
        for c in candidates {
            let (record, w) = (&records[c.index as usize], mix * c.weight);
            for k in 0..3 {
                translational[k] += w * record.translational[k];
                rotational[k] += w * record.rotational[k];
            }
        }
    }
    let [low, high] = settings.clamp;
    let mut sum = [0.0; 3];
    for c in candidates {
        let record = &records[c.index as usize];
        let delta = query.p - record.position;
        let turn = record.normal.cross(query.n_shading);
        for (k, e) in record.irradiance.to_array().into_iter().enumerate() {
            let moved = delta.dot(own * record.translational[k] + translational[k]);
            let turned = turn.dot(own * record.rotational[k] + rotational[k]);
            let value = (e + moved + turned).min(high * e).max(low * e);
            sum[k] += f64::from(c.weight) * f64::from(value);
        }
    }
    sum
}
