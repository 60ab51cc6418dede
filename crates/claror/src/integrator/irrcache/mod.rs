//! `irrcache`: indirect irradiance at diffuse surfaces from a cache (Ward, Rubinstein and Clear
//! 1988), all other light traced.
//!
//! Its parameters are those of [`PARAMETERS`].
//!
//! Rendering has two passes. The first ([`prepass`]) looks through the pixels from coarse to fine
//! and makes a record wherever those that exist do not serve; then the cache is frozen, and every
//! camera sample interpolates from it ([`shade`]). Diffuse light that nothing serves is estimated
//! by one ray, noisily. With `debias` p a look-up Ẽ becomes Ẽ + (X − Ẽ)/p with probability p, where
//! X is one walk: any p above 0 takes the bias away for noise (p = 1 is X alone), and the picture
//! gets all of its samples, since leaving pixels alone early is a bias too. Bump and normal maps are not seen by the cache: it takes the smooth normal.
//!
//! Paths are not followed beyond a diffuse surface, so `max_depth` counts at the first one seen;
//! behind mirrors and glass the cache may hold bounces that `max_depth` would leave out.

mod file;
mod gather;
mod hash;
mod parameters;
mod prepass;
mod probe;
mod settings;
mod shade;
mod signature;
#[cfg(test)]
mod tests;

pub use file::CacheContents;
pub use parameters::{CacheParameter, PARAMETERS, ParameterError};
pub use prepass::{CacheStatistics, IsCancelled};
pub use probe::{Cause, Probe, ProbeSettings};
pub use settings::{Bounces, IrrCacheSettings};
pub(super) use shade::cached;

use crate::irradiance::{Index, Interpolated, LookupSettings, Query, Record, lookup};
pub(super) use hash::{IrradianceHash, direct_light};

/// Records of irradiance with all that is needed to look them up.
#[derive(Debug)]
pub struct IrradianceCache {
    /// The records, in the order in which they were inserted.
    pub records: Vec<Record>,
    /// How it was made.
    pub statistics: CacheStatistics,
    index: Index,
    lookup: LookupSettings,
    hash: Option<IrradianceHash>,
}

/// In the second pass points are served also by a little weight: a record's far side is better
/// than one ray.
const LEAST_WEIGHT: f32 = 0.02;

impl IrradianceCache {
    fn new(
        records: Vec<Record>,
        statistics: CacheStatistics,
        settings: &IrrCacheSettings,
        hash: Option<IrradianceHash>,
    ) -> Self {
        let lookup = LookupSettings::new(&settings.radius());
        let lookup = LookupSettings { min_weight: lookup.min_weight.min(LEAST_WEIGHT), ..lookup };
        let index = Index::frozen(&records, lookup.reach());
        Self { records, statistics, index, lookup, hash }
    }

    /// Irradiance at a point, W·m⁻²; `None` where no record serves it.
    pub fn lookup(&self, query: &Query) -> Option<Interpolated> {
        lookup(&self.records, &self.index, query, &self.lookup)
    }
}
