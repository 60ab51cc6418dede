//! `irrcache`: indirect irradiance at diffuse surfaces from a cache (Ward, Rubinstein and Clear
//! 1988), all other light traced.
//!
//! Its parameters are those of [`PARAMETERS`].
//!
//! Rendering has two passes. The first ([`prepass`]) looks through the pixels from coarse to fine
//! and makes a record wherever those that exist do not serve; then the cache is frozen, and every
//! camera sample interpolates from it ([`shade`]), and looks for what is too near for records to know of
//! ([`contact`]). Diffuse light that nothing serves is estimated
//! by one ray, noisily. With `debias` p a look-up Ẽ becomes Ẽ + (X − Ẽ)/p with probability p, where
//! X is one walk: any p above 0 takes the bias away for noise (p = 1 is X alone), and the picture
//! gets all of its samples, since leaving pixels alone early is a bias too. Records lie on smooth
//! normals; what bump and normal maps make of them is for look-ups, by the rotational gradient.
//!
//! Paths are not followed beyond a diffuse surface, so `max_depth` counts at the first one seen;
//! behind mirrors and glass the cache may hold bounces that `max_depth` would leave out.

mod contact;
mod deep;
mod file;
pub(super) mod gather;
mod hash;
mod inspect;
mod parameters;
mod prepass;
mod probe;
mod progress;
mod settings;
mod shade;
mod signature;
mod sky;
mod smooth;
#[cfg(test)]
mod tests;
mod visible;

pub use file::CacheContents;
pub use parameters::{ALIASES, CacheAlias, CacheParameter, PARAMETERS, is_cache_parameter};
pub use prepass::CacheStatistics;
pub use probe::{Cause, Probe, ProbeSettings};
pub use progress::{CachePhase, CacheProgress, CacheWatch, IsCancelled};
pub use settings::{Bounces, IrrCacheSettings};
pub(super) use shade::cached;
pub use visible::{VisibleRecord, VisibleRecords};

use crate::interaction::SurfaceInteraction;
use crate::irradiance::{
    Candidates, Index, Interpolated, LookupSettings, Query, Record, Surroundings, lookup,
    lookup_with,
};
use crate::math::{Bounds3, Ray, Vec3};
use crate::scene::Scene;
use contact::Served;
use deep::DeepCache;
pub(super) use hash::{IrradianceHash, direct_light, lit_normal};

/// What a render asked of its cache.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LookupCounts {
    /// Points for which it was asked.
    pub lookups: u64,
    /// Those of them that no record served: single rays took the cache's place.
    pub uncached: u64,
    /// Records that went into the others, one for each time.
    pub records: u64,
}

impl LookupCounts {
    /// Both together.
    pub fn merged(self, other: Self) -> Self {
        Self {
            lookups: self.lookups + other.lookups,
            uncached: self.uncached + other.uncached,
            records: self.records + other.records,
        }
    }

    /// Share of the look-ups that no record served; `None` without look-ups.
    pub fn uncached_share(&self) -> Option<f64> {
        (self.lookups > 0).then(|| self.uncached as f64 / self.lookups as f64)
    }

    /// Mean number of records of a look-up that was served; `None` without such look-ups.
    pub fn mean_records(&self) -> Option<f64> {
        let served = self.lookups - self.uncached.min(self.lookups);
        (served > 0).then(|| self.records as f64 / served as f64)
    }
}

/// Where the walk of a record's ray may end before its time: at an irradiance that is known there.
#[derive(Debug, Clone, Copy)]
pub(super) enum WalkEnd<'a> {
    Hash(&'a IrradianceHash),
    Cache(&'a DeepCache),
}

/// Records of irradiance with all that is needed to look them up.
#[derive(Debug)]
pub struct IrradianceCache {
    /// The records, in the order in which they were inserted.
    pub records: Vec<Record>,
    /// What these saw, one by one; empty where nobody asks for it.
    surroundings: Vec<Surroundings>,
    /// How it was made.
    pub statistics: CacheStatistics,
    index: Index,
    lookup: LookupSettings,
    hash: Option<IrradianceHash>,
    /// Whether pixels see only what was made up to them.
    is_history: bool,
}

impl IrradianceCache {
    fn new(contents: CacheContents, settings: &IrrCacheSettings, bounds: Bounds3) -> Self {
        let CacheContents { records, surroundings, statistics, hash } = contents;
        let lookup = settings.frozen_lookup();
        let bounds = with_slack(bounds);
        let index = Index::finished(settings.index(), &records, bounds, lookup.reach());
        // Records that several views made are all there from the beginning.
        let is_history = !settings.overture() && records.is_sorted_by_key(|record| record.key);
        Self { records, surroundings, statistics, index, lookup, hash, is_history }
    }

    /// Irradiance at a point, W·m⁻²; `None` where no record serves it.
    pub fn lookup(&self, query: &Query) -> Option<Interpolated> {
        self.all().lookup(query)
    }

    /// All records.
    pub fn all(&self) -> CacheView<'_> {
        CacheView { cache: self, records: &self.records }
    }

    /// The records that a pixel sees: all of them, or with a single pass those that were made for
    /// the pixels up to this one.
    pub fn seen_by(&self, (x, y): (u32, u32)) -> CacheView<'_> {
        if !self.is_history {
            return self.all();
        }
        let key = pixel_key(x, y);
        let count = self.records.partition_point(|record| record.key <= key);
        CacheView { cache: self, records: &self.records[..count] }
    }
}

/// Whether nothing stands between a point and a record, as far as the record knows.
fn is_in_sight(scene: &Scene, si: &SurfaceInteraction, record: &Record, rays: &mut u64) -> bool {
    let Some(end) = record.sight_of(si.p) else { return true };
    *rays += 1;
    is_free(scene, si, end)
}

/// Whether nothing stands between a point of a surface and another.
fn is_free(scene: &Scene, si: &SurfaceInteraction, end: Vec3) -> bool {
    let start = si.spawn_origin(end - si.p);
    let way = end - start;
    let length = way.length();
    length <= 0.0 || !scene.occluded(&Ray { t_max: length, ..Ray::new(start, way / length) })
}

/// Bounds that surface points do not round to the outside of.
fn with_slack(bounds: Bounds3) -> Bounds3 {
    let slack = 0.01 * bounds.extent() + f32::EPSILON * bounds.max.abs().max(bounds.min.abs());
    Bounds3 { min: bounds.min - slack, max: bounds.max + slack }
}

/// Names the record of a pixel. Ascends in raster order.
pub(super) fn pixel_key(x: u32, y: u32) -> u64 {
    u64::from(y) << 32 | u64::from(x)
}

/// The first records of a cache.
#[derive(Debug, Clone, Copy)]
pub struct CacheView<'a> {
    cache: &'a IrradianceCache,
    records: &'a [Record],
}

impl<'a> CacheView<'a> {
    /// Irradiance at a point, W·m⁻²; `None` where no record serves it.
    pub fn lookup(&self, query: &Query) -> Option<Interpolated> {
        lookup(self.records, &self.cache.index, query, &self.cache.lookup)
    }

    /// The same without the records that something hides, if that is wanted.
    fn lookup_seen(
        &self,
        scene: &Scene,
        si: &SurfaceInteraction,
        query: &Query,
        rays: &mut u64,
    ) -> Option<Served> {
        let IrradianceCache { index, lookup: settings, .. } = self.cache;
        let mut candidates = Candidates::new();
        let is_protected = scene.tables.integrator.cache.leak_protection();
        let is_seen = |record: &Record| !is_protected || is_in_sight(scene, si, record, rays);
        let keep = |all: &Candidates| candidates.clone_from(all);
        let found = lookup_with(self.records, index, query, settings, is_seen, keep)?;
        Some(Served { found, candidates })
    }

    /// Where walks of pixels may end.
    fn hash(&self) -> Option<&'a IrradianceHash> {
        self.cache.hash.as_ref()
    }
}
