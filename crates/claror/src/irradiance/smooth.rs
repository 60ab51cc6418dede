//! Smoothing: what its neighbours know about a record's irradiance.
//!
//! Rays leave noise in every record, which shows as soft blotches of the size of its region. The
//! records around it are independent estimates of nearly the same, since radii are chosen so that
//! irradiance can be extrapolated over them: where noise is larger than what extrapolation may be
//! wrong by, their mean is better than each of them. The weight of a neighbour is
//! `k / (1 + (b/σ)²)` with the kernel k of look-ups, the relative error b of extrapolation and the
//! relative noise σ, so that nothing changes where records are exact, and nothing is averaged over
//! edges that they know of. After Kontkanen, Räsänen and Keller 2004 (Irradiance filtering for
//! Monte Carlo ray tracing), who filter pixels in this way and have no gradients.
//!
//! Both b and k are the same for both records of a pair, and σ is the mean of the neighbourhood's:
//! records of which chance has made too much also look noisier than others, and weights by their own
//! noise would make pictures darker.

use super::index::{Index, IndexKind};
use super::kernel::{LookupSettings, Query, weight};
use super::record::Record;
use crate::math::Bounds3;
use crate::spectrum::Rgb;

/// What an extrapolation by the mean of two records' gradients is wrong by, as a share of what one
/// by a single gradient is: terms of second order cancel where curvature is constant.
const LEFT: f32 = 0.5;

/// How sure a record is of its irradiance, and how far that of others can differ from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Uncertainty {
    /// Relative standard error of its irradiance.
    pub relative_error: f32,
    /// Second derivative of the irradiance around it, relative to it, in scene units⁻².
    pub curvature: f32,
}

/// Smooths records.
#[derive(Debug)]
pub struct Smoother<'a> {
    records: &'a [Record],
    uncertainties: &'a [Uncertainty],
    index: Index,
    lookup: LookupSettings,
}

/// A record near another.
struct Neighbour {
    index: usize,
    /// Weight by distance and angle.
    kernel: f32,
    distance2: f32,
}

impl<'a> Smoother<'a> {
    /// For records within `bounds` with an uncertainty each, by others that would be looked up with
    /// these settings if they reached `reach` times as far as their radii say.
    pub fn new(
        records: &'a [Record],
        uncertainties: &'a [Uncertainty],
        bounds: Bounds3,
        lookup: &LookupSettings,
        reach: f32,
    ) -> Self {
        let lookup = LookupSettings { overlap: reach, ..*lookup };
        let index = Index::finished(IndexKind::Cells, records, bounds, lookup.reach());
        Self { records, uncertainties, index, lookup }
    }

    /// Irradiance of record `i`, W·m⁻², evened out with that of those of its neighbours for which
    /// `is_seen` holds.
    pub fn irradiance(&self, i: usize, is_seen: impl FnMut(usize) -> bool) -> Rgb {
        let record = &self.records[i];
        let neighbours = self.neighbours(i, is_seen);
        let noise2 = self.squared_noise(i, &neighbours);
        if noise2 <= 0.0 {
            return record.irradiance;
        }
        let (mut sum, mut total) = (record.irradiance, 1.0);
        for Neighbour { index, kernel, distance2 } in neighbours {
            let [a, b] = [i, index].map(|i| self.uncertainties[i].curvature);
            let error = LEFT * 0.5 * a.max(b) * distance2;
            let weight = kernel * noise2 / (noise2 + error * error);
            // Curvature may be infinite, and two records in the same place.
            if weight > 0.0 {
                sum += self.extrapolated(&self.records[index], record) * weight;
                total += weight;
            }
        }
        let mean = sum * (1.0 / total);
        if mean.is_finite() { mean } else { record.irradiance }
    }

    /// By ascending number, whatever the index.
    fn neighbours(&self, i: usize, mut is_seen: impl FnMut(usize) -> bool) -> Vec<Neighbour> {
        let records = self.records;
        let record = &records[i];
        let mut neighbours = Vec::new();
        self.index.for_candidates_of(records.len() as u32, record.position, |index| {
            let index = index as usize;
            let other = &records[index];
            if index != i
                && let Some((there, distance2)) = weight(other, &at(record), &self.lookup)
                && let Some((back, _)) = weight(record, &at(other), &self.lookup)
                && is_seen(index)
            {
                neighbours.push(Neighbour { index, kernel: there.min(back), distance2 });
            }
        });
        neighbours.sort_unstable_by_key(|neighbour| neighbour.index);
        neighbours
    }

    /// Square of the relative noise of record `i` and its neighbours.
    fn squared_noise(&self, i: usize, neighbours: &[Neighbour]) -> f32 {
        let itself = Neighbour { index: i, kernel: 1.0, distance2: 0.0 };
        let (mut sum, mut total) = (0.0, 0.0);
        for Neighbour { index, kernel, .. } in neighbours.iter().chain([&itself]) {
            let noise = self.uncertainties[*index].relative_error;
            // Not so in complete darkness.
            if noise.is_finite() {
                sum += kernel * noise * noise;
                total += kernel;
            }
        }
        if total > 0.0 { sum / total } else { 0.0 }
    }

    /// What one record says about the irradiance of another, with the mean gradient of both.
    fn extrapolated(&self, from: &Record, to: &Record) -> Rgb {
        let delta = to.position - from.position;
        let turn = from.normal.cross(to.normal);
        let [low, high] = self.lookup.clamp;
        let e = from.irradiance.to_array();
        Rgb::from([0, 1, 2].map(|k| {
            let moved = 0.5 * delta.dot(from.translational[k] + to.translational[k]);
            let turned = 0.5 * turn.dot(from.rotational[k] + to.rotational[k]);
            (e[k] + moved + turned).min(high * e[k]).max(low * e[k])
        }))
    }
}

/// At the record itself.
fn at(record: &Record) -> Query {
    Query { p: record.position, n_smooth: record.normal, n_shading: record.normal }
}
