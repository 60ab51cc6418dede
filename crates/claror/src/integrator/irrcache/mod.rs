//! `irrcache`: indirect irradiance at diffuse surfaces from a cache (Ward, Rubinstein and Clear
//! 1988), all other light traced.
//!
//! | parameter | unit | default | |
//! |---|---|---|---|
//! | `error` | 1 | 0.1 | interpolation error that records are spread for; a dial, not a bound |
//! | `accuracy` | 1 | 0.2 | Ward's `a`, for the other criteria than `hessian` |
//! | `criterion` | | `hessian` | `thesis`, `ward88`, `ward92`, `tabellion04`, `krivanek06`, `hessian` |
//! | `noise` | 1 | 0.2 | relative standard error of a record: up to sixteen times the rays until it is met |
//! | `gather_samples` | 1 | 576 | rays of a record; rounded to a square number |
//! | `min_pixel_spacing` | pixels | 3 | least radius of a record |
//! | `max_pixel_spacing` | pixels | 160 | largest radius of a record |
//! | `bounces` | | `hash` | where the light at the ends of a record's rays comes from: `path`, `hash` |
//! | `sky` | | `auto` | whether records hold direct light from the sky: `auto` if it has no small bright parts, `direct` no, `cached` yes |
//! | `analytic_direct` | | true | direct light of few lights by closed forms times sampled visibility: consistent, a little biased at few samples |
//! | `debias` | 1 | 0 | share of look-ups that are corrected by a walk: above 0 the picture has the mean of path tracing |
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
mod inspect;
mod prepass;
mod probe;
mod shade;
mod signature;
mod sky;
#[cfg(test)]
mod tests;
mod visible;

pub use file::CacheContents;
pub use prepass::{CacheStatistics, IsCancelled};
pub use probe::{Cause, Probe, ProbeSettings};
pub(super) use shade::cached;
pub use visible::{VisibleRecord, VisibleRecords};

use crate::emitter::Sky;
use crate::irradiance::{
    Criterion, Index, Interpolated, LookupSettings, Query, RadiusSettings, Record, lookup,
};
pub(super) use hash::{IrradianceHash, direct_light};

/// Where the light comes from that a record's rays find.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Bounces {
    /// Random walks: unbiased.
    Path,
    /// Random walks that end where they have gone far enough, at a coarse average of the
    /// irradiance there: much less noise, a little bias.
    #[default]
    Hash,
}

impl Bounces {
    /// All of them, the default first.
    pub const ALL: [Self; 2] = [Self::Hash, Self::Path];

    /// As scene files and the command line call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Path => "path",
            Self::Hash => "hash",
        }
    }
}

/// Parameters of `irrcache`, see the module.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IrrCacheSettings {
    /// How far records can be used.
    pub criterion: Criterion,
    /// Relative interpolation error, for [`Criterion::Hessian`].
    pub error: f32,
    /// Ward's accuracy, for the others.
    pub accuracy: f32,
    /// Relative standard error of a record that is worth more rays.
    pub noise: f32,
    /// Rays of a record.
    pub gather_samples: u32,
    /// Least radius, pixels.
    pub min_pixel_spacing: f32,
    /// Largest radius, pixels.
    pub max_pixel_spacing: f32,
    /// Light at the ends of a record's rays.
    pub bounces: Bounces,
    /// Whether records hold direct light from the sky.
    pub sky: Sky,
    /// Take the noise of light sampling out of direct light where lights have closed forms.
    pub analytic_direct: bool,
    /// Share of look-ups that are corrected by a random walk, 0 to 1.
    pub debias: f32,
}

impl IrrCacheSettings {
    /// Sensible numbers of rays of a record.
    pub const GATHER_SAMPLES: std::ops::RangeInclusive<u32> = 16..=65_536;

    fn radius(&self) -> RadiusSettings {
        RadiusSettings {
            epsilon: self.error,
            accuracy: self.accuracy,
            ..RadiusSettings::new(self.criterion)
        }
    }
}

impl Default for IrrCacheSettings {
    fn default() -> Self {
        Self {
            criterion: Criterion::Hessian,
            error: 0.1,
            accuracy: 0.2,
            noise: 0.2,
            gather_samples: 576,
            min_pixel_spacing: 3.0,
            max_pixel_spacing: 160.0,
            bounces: Bounces::Hash,
            sky: Sky::Auto,
            analytic_direct: true,
            debias: 0.0,
        }
    }
}

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
