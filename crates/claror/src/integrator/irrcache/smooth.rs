//! Records even out their noise when all are made: [`Smoother`] in a scene.

use rayon::prelude::*;

use super::gather::{Gatherer, Place};
use super::progress::CacheWatch;
use super::{is_free, with_slack};
use crate::irradiance::{LookupSettings, Record, Smoother, Uncertainty};
use crate::spectrum::Rgb;

/// Where a record comes from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Origin {
    pub(super) place: Place,
    /// Relative standard error of its irradiance.
    pub(super) relative_error: f32,
}

/// Replaces the irradiance of records by what they and their neighbours say about it together,
/// each of them by what all were before. `origins` are those of the records, one by one. Counts
/// `rays`; `None` when cancelled.
pub(super) fn smooth(
    gatherer: &Gatherer,
    lookup: &LookupSettings,
    records: &mut [Record],
    origins: &[Origin],
    rays: &mut u64,
    watch: CacheWatch,
) -> Option<()> {
    let reach = gatherer.smoothing();
    if reach <= 0.0 {
        return Some(());
    }
    let scene = gatherer.scene;
    let pairs = records.iter().zip(origins);
    let uncertainties: Vec<Uncertainty> = pairs
        .map(|(record, origin)| {
            let reference = gatherer.bounds(origin.place.footprint).reference;
            let curvature = gatherer.radius.curvature(record.natural_radius, reference);
            Uncertainty { relative_error: origin.relative_error, curvature }
        })
        .collect();
    let bounds = with_slack(scene.accel.bounds());
    let smoother = Smoother::new(records, &uncertainties, bounds, lookup, reach);
    let smoothed: Option<Vec<(Rgb, u64)>> = origins
        .par_iter()
        .enumerate()
        .map(|(i, origin)| {
            if watch.is_cancelled() {
                return None;
            }
            let mut rays = 0;
            let irradiance = smoother.irradiance(i, |other| {
                rays += 1;
                // As for look-ups, but farther away than a record knows of.
                let (si, other) = (&origin.place.si, &records[other]);
                is_free(scene, si, other.sight_from((other.position - si.p).length()))
            });
            Some((irradiance, rays))
        })
        .collect();
    for (record, (irradiance, count)) in records.iter_mut().zip(smoothed?) {
        record.irradiance = irradiance;
        *rays += count;
    }
    Some(())
}
