//! A second, coarser cache for the ends of records' rays.
//!
//! Its records lie where rays end that leave what the camera sees at random, and their own rays are
//! followed as paths to the end: all further bounces are in them, none is cut off. A
//! record of the picture's cache then needs of a ray's end no more than light sampled there and what
//! the deep records around it make of their irradiance. Where none of these serves, or all reach
//! farther than the ray is long (their coarseness would show), the walk goes on.
//!
//! Ward, Rubinstein and Clear 1988 cache every bounce, each coarser than the one before: here the
//! first two, the second one by a coarseness that its small part in a pixel can bear. It serves the
//! making of records only, and is gone when they are complete.

use rayon::prelude::*;

use super::gather::{Gatherer, Place};
use super::hash::lit_normal;
use super::prepass::{Eye, Filling, first_diffuse};
use super::progress::{CachePhase, CacheWatch};
use super::{CacheContents, IrrCacheSettings, IrradianceCache, is_in_sight};
use crate::film::CropWindow;
use crate::integrator::IntegratorSettings;
use crate::interaction::SurfaceInteraction;
use crate::irradiance::{Query, Record, lookup_seen};
use crate::math::{Frame, Vec2, warp};
use crate::sampler::{Sampler, SamplerKind, SamplerSettings};
use crate::scene::Scene;
use crate::spectrum::Rgb;

/// Coarser than the picture's cache by so much: error, accuracy and least radius of a record, relative
/// error of its irradiance, and its rays. The rays of all of them together decide how far the mean of
/// a picture is off: a few hundred records with a quarter of the rays leave 0.2 % in the Cornell box.
const ERROR: f32 = 16.0;
const ACCURACY: f32 = 2.0;
const SPACING: f32 = 4.0;
const NOISE: f32 = 4.0;
const FEWER_RAYS: u32 = 2;
/// Walks of the first round and of all rounds at most; each round has as many as all before.
const WALKS: (u32, u32) = (1 << 11, 1 << 17);
/// Rounds end when at most this share of their points was not served: in rooms full of small things
/// the last few per cent take most of the records, and following their rays costs less.
const UNSERVED: f64 = 0.1;

/// Side of a pixel at most, as a share of the scene's extent: in small pictures the least radius of a
/// deep record would be longer than the rays that it could serve.
const LARGEST_PIXEL: f32 = 1.0 / 256.0;
/// Keys of deep records are not those of pixels.
const FIRST_KEY: u64 = 1 << 63;

/// See the module.
#[derive(Debug)]
pub(in crate::integrator) struct DeepCache {
    cache: IrradianceCache,
    /// With a longest path, the only depth at which it holds as many bounces as are wanted.
    depth: Option<u32>,
}

/// Surfaces between the eye and a deep record where paths have a longest length: that of the
/// record whose ray ends there.
const DEPTH: u32 = 1;

impl DeepCache {
    /// For the records that an eye will want. `None` when cancelled.
    pub(super) fn new(eye: &Eye, crop: CropWindow, watch: CacheWatch) -> Option<Self> {
        let scene = eye.scene;
        let settings = &scene.tables.integrator;
        let coarse = IntegratorSettings { cache: coarser(&settings.cache), ..*settings };
        let depth = settings.max_depth.map(|_| DEPTH);
        // Other random numbers than those of the picture's records.
        let seed = eye.samples.seed ^ 0x6465_6570;
        let gatherer = Gatherer::new(scene, &coarse, None, seed).behind(depth.unwrap_or(0));
        let bounds = scene.accel.bounds();
        let first = CacheContents::default();
        let filling = Filling::new(&gatherer, &coarse.cache, bounds, first, watch);
        let mut filling = filling.during(CachePhase::Deep);
        let walks =
            SamplerSettings { kind: SamplerKind::Sobol, sample_count: WALKS.1, seed: !seed };
        let (mut done, mut goal) = (0, WALKS.0);
        while goal <= WALKS.1 {
            let found = (done..goal).into_par_iter().map(|walk| place(eye, crop, &walks, walk));
            let places: Vec<Place> = found.collect::<Vec<_>>().into_iter().flatten().collect();
            let all = places.len();
            let left = filling.queue(places)?;
            (done, goal) = (goal, 2 * goal);
            if left as f64 <= UNSERVED * all as f64 {
                break;
            }
        }
        let mut contents = filling.finish();
        contents.statistics.walks = done as usize;
        let cache = contents.freeze(&coarse.cache, bounds);
        Some(Self { cache, depth })
    }

    /// Walks that placed its records, and rays of all.
    pub(super) fn cost(&self) -> (usize, u64) {
        (self.cache.statistics.walks, self.cache.statistics.rays)
    }

    /// Irradiance at the end of a ray with so many surfaces behind it, W·m⁻²; `None` where the ray
    /// must be followed.
    pub(in crate::integrator) fn irradiance(
        &self,
        scene: &Scene,
        si: &SurfaceInteraction,
        depth: u32,
        rays: &mut u64,
    ) -> Option<Rgb> {
        if self.depth.is_some_and(|only| only != depth) {
            return None;
        }
        let n = lit_normal(si);
        let query = Query { p: si.p, n_smooth: n, n_shading: n };
        let IrradianceCache { records, index, lookup, .. } = &self.cache;
        let is_protected = scene.tables.integrator.cache.leak_protection();
        let serves = |record: &Record| {
            record.radii[0] <= si.t && (!is_protected || is_in_sight(scene, si, record, rays))
        };
        lookup_seen(records, index, &query, lookup, serves).map(|found| found.irradiance)
    }
}

fn coarser(cache: &IrrCacheSettings) -> IrrCacheSettings {
    let least = *IrrCacheSettings::GATHER_SAMPLES.start();
    IrrCacheSettings {
        error: ERROR * cache.error,
        accuracy: Some(ACCURACY * cache.accuracy()),
        noise: Some(NOISE * cache.noise()),
        gather_samples: Some((cache.gather_samples() / FEWER_RAYS).max(least)),
        min_pixel_spacing: Some(SPACING * cache.min_pixel_spacing()),
        max_pixel_spacing: SPACING * cache.max_pixel_spacing,
        min_radius: SPACING * cache.min_radius,
        max_radius: SPACING * cache.max_radius,
        contact_shadows: Some(false),
        ..*cache
    }
}

/// Where a ray ends that leaves the first diffuse surface of a camera ray at random.
fn place(eye: &Eye, crop: CropWindow, samples: &SamplerSettings, walk: u32) -> Option<Place> {
    let mut sampler = Sampler::new(samples, (0, 0), walk);
    let size = Vec2::new(crop.width as f32, crop.height as f32);
    let film = Vec2::new(crop.x as f32, crop.y as f32) + sampler.next_2d() * size;
    let rays = eye.rays(film);
    let first = first_diffuse(eye.scene, rays[0], &mut sampler)?;
    let frame = Frame::from_normal(lit_normal(&first.si));
    let direction = frame.to_world(warp::cosine_hemisphere(sampler.next_2d()));
    let end = first_diffuse(eye.scene, first.si.spawn_ray(direction), &mut sampler)?;
    let largest = LARGEST_PIXEL * eye.scene.accel.bounds().extent().max_element();
    let footprint = Eye::footprint(&rays, first.way + end.way).min(largest);
    Some(Place { si: end.si, footprint, key: FIRST_KEY | u64::from(walk) })
}
