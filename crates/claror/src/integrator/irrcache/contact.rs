//! Contact shadows: what is so near that records do not know of it.
//!
//! Records are a few pixels apart at least, and hardly any of their rays meet a thin thing that
//! stands on a surface, such as the frame of a picture: next to it they promise the light of the
//! open wall. And the few that lie in its shadow take that with them as far as they reach. So each
//! sample of the picture looks in one cosine-distributed direction ω. Where it meets something nearer
//! than records can resolve, or where one of them has and it does not, every record that serves the
//! point is asked whether it knows what is there: with the distance d from it to the point q that
//! was met, and the mean m of the inverse distances of its rays around that direction,
//! u = 1 - min(md, 1/md) is 0 where it does, and 1 where its rays went on much farther, or ended
//! much earlier. What it saw in the direction ω is then replaced by what is there, so that for
//! weights w and extrapolated records E_i with radiance L_i
//!
//! `E(p) = (Σ w E_i + π Σ w u (L(p, ω) - L_i(ω))) / Σ w`.
//!
//! Where all records know everything nothing is changed, and corners between walls stay free of
//! noise. Most directions cost a ray that is a few pixels long.

use super::{CacheView, WalkEnd};
use crate::integrator::path::record_walk_at;
use crate::interaction::SurfaceInteraction;
use crate::irradiance::{Candidate, Candidates, Interpolated, Record, Surroundings};
use crate::math::{Ray, Vec3};
use crate::sampler::Sampler;
use crate::scene::Scene;
use crate::spectrum::Rgb;

/// A look-up, and the records that went into it.
pub(super) struct Served {
    pub(super) found: Interpolated,
    pub(super) candidates: Candidates,
}

/// A point that records serve.
#[derive(Clone, Copy)]
pub(super) struct Contact<'a> {
    pub(super) scene: &'a Scene,
    pub(super) view: CacheView<'a>,
    pub(super) served: &'a Served,
    pub(super) si: &'a SurfaceInteraction,
    /// Surfaces that the path has left behind.
    pub(super) depth: u32,
}

/// What the records do not know of a direction.
#[derive(Debug, Clone, Copy)]
struct Unknown {
    /// Mean of u by weight, not 0.
    share: f32,
    /// What they saw instead, times u.
    seen: Rgb,
}

/// How far away a hit is taken to be where there is none, as a multiple of the reach.
const FAR: f32 = 1e6;

impl Contact<'_> {
    /// Radiance that the records' irradiance lacks from the unit direction `wi` in the world, or has
    /// too much, W·m⁻²·sr⁻¹; black where they know what is there, or nobody asks.
    pub(super) fn missing(&self, wi: Vec3, sampler: &mut Sampler, rays: &mut u64) -> Rgb {
        let ray = self.si.spawn_ray(wi);
        let Some(unknown) = self.unknown(&ray, rays) else { return Rgb::BLACK };
        let ends = self.view.hash().map(WalkEnd::Hash);
        let settings = &self.scene.tables.integrator;
        let (radiance, _) =
            record_walk_at(self.scene, settings, ends, self.depth, &ray, sampler, rays);
        radiance * unknown.share - unknown.seen
    }

    /// What the records do not know along a ray from the point; `None` where that is nothing.
    fn unknown(&self, ray: &Ray, rays: &mut u64) -> Option<Unknown> {
        let cache = self.view.cache;
        if cache.surroundings.len() != cache.records.len() {
            return None;
        }
        let candidates = &self.served.candidates;
        let reach = self.reach();
        *rays += 1;
        let near = self.scene.intersect(&Ray { t_max: reach.min(ray.t_max), ..*ray });
        let is_near = near.is_some();
        let met = match near {
            Some(hit) => hit.p,
            None if candidates.iter().any(|c| self.has_near(c, ray.d)) => {
                *rays += 1;
                self.scene.intersect(ray).map_or(ray.at(FAR * reach), |hit| hit.p)
            }
            None => return None,
        };
        let (mut share, mut seen, mut total) = (0.0, Rgb::BLACK, 0.0);
        for c in candidates {
            total += c.weight;
            if is_near || self.has_near(c, ray.d) {
                let (record, surroundings) = self.known(c);
                let weight = c.weight * unknown(record, surroundings, met);
                share += weight;
                seen += surroundings.radiance(record.normal, ray.d) * weight;
            }
        }
        (share > 0.0).then(|| Unknown { share: share / total, seen: seen * (1.0 / total) })
    }

    fn known(&self, candidate: &Candidate) -> (&Record, &Surroundings) {
        let index = candidate.index as usize;
        (&self.view.records[index], &self.view.cache.surroundings[index])
    }

    /// Whether a record's rays in a direction met something within reach.
    fn has_near(&self, candidate: &Candidate, wi: Vec3) -> bool {
        let (record, surroundings) = self.known(candidate);
        surroundings.has_near(record.normal, wi)
    }

    /// How near things may be that the records do not resolve: their mean by weight.
    fn reach(&self) -> f32 {
        let (mut sum, mut total) = (0.0, 0.0);
        for c in &self.served.candidates {
            sum += c.weight * self.known(c).1.reach;
            total += c.weight;
        }
        sum / total
    }
}

/// How little a record knows of a point that was met, 0 to 1.
fn unknown(record: &Record, surroundings: &Surroundings, met: Vec3) -> f32 {
    let way = met - record.position;
    let distance = way.length();
    let ratio = surroundings.closeness(record.normal, way / distance, distance);
    let unknown = 1.0 - ratio.min(1.0 / ratio);
    // At the record's own place, or where both are 0 or infinite.
    if unknown.is_nan() { 0.0 } else { unknown }
}
