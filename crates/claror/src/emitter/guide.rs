//! Where the sky is seen from: a learned density of directions for sampling the environment.
//!
//! Indoors the sky is visible through windows only, a few per cent of all directions; sampling
//! its radiance alone then sends nearly every shadow ray into a wall. [`EnvironmentGuide`] is
//! made once before rendering: random walks from the camera count, per place and facing, in
//! which directions they leave the scene. Sampling draws from those counts, mixed by the caller
//! with a density that covers every direction, so that the estimate stays unbiased whatever was
//! learned. The idea is that of Vorba et al. 2014 and Müller et al. 2017 (path guiding), reduced
//! to the one term that matters for light through windows.
//!
//! Places are voxels of a grid, see [`DirectionSums`]. All counts are integers, so the guide is the
//! same for any number of threads.

use rayon::prelude::*;

use crate::interaction::SurfaceInteraction;
use crate::math::directions::{
    CELLS, DirectionField, DirectionSums, Directions, cell_of, direction_in,
};
use crate::math::warp::cosine_hemisphere;
use crate::math::{Bounds3, Frame, Ray, Vec2, Vec3};
use crate::sampler::{Sampler, SamplerKind, SamplerSettings};

/// Grids from fine to coarse, each with half the resolution of the one before.
const LEVELS: u32 = 4;
/// Escapes that a voxel must have seen to be trusted.
const MIN_ESCAPES: u32 = 48;
/// Segments of a walk.
const MAX_SEGMENTS: u32 = 6;
/// A scene that more than this share of the segments leaves is open: guiding gains nothing.
const OPEN_SHARE: f32 = 0.35;
/// Walks per unit of parallel work; fixed, so that the work does not depend on the threads.
const WALKS_PER_CHUNK: usize = 4096;

/// One walk segment that left the scene: where from, with which normal, in which direction cell.
#[derive(Debug, Clone, Copy)]
struct Escape {
    p: Vec3,
    n: Vec3,
    cell: u16,
}

/// A learned density of directions in which the environment is visible.
#[derive(Debug, Clone)]
pub struct EnvironmentGuide(DirectionField);

impl EnvironmentGuide {
    /// Learns from `walks` random walks that start with `camera_ray(i)`; `intersect` is the ray
    /// kernel, `radiance` the luminance of the environment by direction.
    ///
    /// `None` when the scene is open, or nothing or next to nothing of the sky is ever seen.
    pub fn learn(
        walks: usize,
        camera_ray: impl Fn(usize) -> Option<Ray> + Sync,
        intersect: impl Fn(&Ray) -> Option<SurfaceInteraction> + Sync,
        radiance: impl Fn(Vec3) -> f32,
    ) -> Option<Self> {
        let chunks = walks.div_ceil(WALKS_PER_CHUNK);
        let chunks: Vec<(Vec<Escape>, u64)> = (0..chunks)
            .into_par_iter()
            .map(|c| {
                let end = ((c + 1) * WALKS_PER_CHUNK).min(walks);
                let mut escapes = Vec::new();
                let mut segments = 0;
                for i in c * WALKS_PER_CHUNK..end {
                    if let Some(ray) = camera_ray(i) {
                        segments += walk(i, ray, &intersect, &mut escapes);
                    }
                }
                (escapes, segments)
            })
            .collect();
        let segments: u64 = chunks.iter().map(|c| c.1).sum();
        let escapes: Vec<Escape> = chunks.into_iter().flat_map(|c| c.0).collect();
        if escapes.len() < MIN_ESCAPES as usize
            || escapes.len() as f32 > OPEN_SHARE * segments as f32
        {
            return None;
        }
        Some(Self::from_escapes(&escapes, radiance))
    }

    fn from_escapes(escapes: &[Escape], radiance: impl Fn(Vec3) -> f32) -> Self {
        let bounds = escapes.iter().fold(Bounds3::EMPTY, |b, e| b.including(e.p));
        // Surfaces fill about 6 n² voxels of an n³ grid.
        let wanted = escapes.len() as f32 / (4 * MIN_ESCAPES) as f32;
        let resolution = ((wanted / 6.0).sqrt() as u32).clamp(2, 24);
        let mut sums = DirectionSums::new(bounds, resolution);
        for e in escapes {
            sums.add(sums.slot(e.p, e.n), e.cell.into(), 1.0);
        }
        Self(sums.field(LEVELS, MIN_ESCAPES, &mean_radiance_per_cell(radiance)))
    }

    /// What was learned for the place `p` with unit normal `n` (on the lit side), if anything was.
    #[inline]
    pub fn at(&self, p: Vec3, n: Vec3) -> Option<Directions<'_>> {
        self.0.at(p, n)
    }

    /// Memory of the tables, bytes.
    pub fn memory_bytes(&self) -> usize {
        self.0.memory_bytes()
    }
}

/// Walks from `ray` with cosine-distributed bounces; notes the segment that leaves, unless it is
/// the camera's own. Returns the number of segments after the camera's.
fn walk(
    index: usize,
    mut ray: Ray,
    intersect: &impl Fn(&Ray) -> Option<SurfaceInteraction>,
    escapes: &mut Vec<Escape>,
) -> u64 {
    let settings = SamplerSettings { kind: SamplerKind::Independent, sample_count: 1, seed: 0 };
    let mut sampler = Sampler::new(&settings, (index as u32, 0), 0x6775_6964);
    let mut from: Option<(Vec3, Vec3)> = None;
    for segment in 0..=MAX_SEGMENTS {
        let Some(si) = intersect(&ray) else {
            if let Some((p, n)) = from {
                escapes.push(Escape { p, n, cell: cell_of(ray.d).0 as u16 });
            }
            return u64::from(segment);
        };
        // Look to the side that the walk came from.
        let n = if si.ng.dot(si.wo) < 0.0 { -si.ng } else { si.ng };
        let d = Frame::from_normal(n).to_world(cosine_hemisphere(sampler.next_2d()));
        ray = si.spawn_ray(d);
        from = Some((si.p, n));
    }
    u64::from(MAX_SEGMENTS)
}

/// Mean luminance of the environment over each direction cell, from 4 × 4 directions.
fn mean_radiance_per_cell(radiance: impl Fn(Vec3) -> f32) -> [f32; CELLS] {
    const N: usize = 4;
    std::array::from_fn(|cell| {
        let at = |i: usize| {
            let u = Vec2::new(((i % N) as f32 + 0.5) / N as f32, ((i / N) as f32 + 0.5) / N as f32);
            radiance(direction_in(cell, u).0)
        };
        (0..N * N).map(at).sum::<f32>() / (N * N) as f32
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Escapes from a slab of places towards a window in direction `towards`.
    fn guide_towards(towards: Vec3) -> EnvironmentGuide {
        let settings = SamplerSettings { kind: SamplerKind::Sobol, sample_count: 1, seed: 3 };
        let escapes: Vec<Escape> = (0..20_000)
            .map(|i| {
                let mut s = Sampler::new(&settings, (0, 0), i);
                let (a, b) = (s.next_2d(), s.next_2d());
                let spread = Vec3::new(b.x - 0.5, b.y - 0.5, s.next_1d() - 0.5);
                Escape {
                    p: Vec3::new(4.0 * a.x, 4.0 * a.y, 0.0),
                    n: Vec3::Z,
                    cell: cell_of((towards + 0.4 * spread).normalize()).0 as u16,
                }
            })
            .collect();
        EnvironmentGuide::from_escapes(&escapes, |d| 1.0 + 0.5 * d.x)
    }

    #[test]
    fn density_is_that_of_the_samples_and_integrates_to_one() {
        let guide = guide_towards(Vec3::new(0.8, 0.1, 0.6));
        let (p, n) = (Vec3::new(1.3, 2.2, 0.0), Vec3::new(0.1, 0.2, 0.97).normalize());
        let known = guide.at(p, n).expect("the guide knows this place");
        let settings = SamplerSettings { kind: SamplerKind::Sobol, sample_count: 1, seed: 1 };
        let count = 1 << 16;
        let mut histogram = vec![0_u32; CELLS];
        for i in 0..count {
            let u = Sampler::new(&settings, (0, 0), i).next_2d();
            let (d, pdf) = known.sample(u).expect("a direction");
            assert!((pdf - known.pdf(d)).abs() <= 1e-4 * pdf);
            histogram[cell_of(d).0] += 1;
        }
        let mut integral = 0.0;
        for (cell, &n_cell) in histogram.iter().enumerate() {
            let (middle, density) = direction_in(cell, Vec2::splat(0.5));
            let share = known.pdf(middle) / density;
            // Scrambled Sobol points fill intervals to within a few points.
            assert!((share - n_cell as f32 / count as f32).abs() < 4.0 / count as f32 + 1e-6);
            integral += share;
        }
        assert!((integral - 1.0).abs() < 1e-4);
    }

    #[test]
    fn most_samples_go_where_the_window_is() {
        let window = Vec3::new(0.8, 0.1, 0.6).normalize();
        let guide = guide_towards(window);
        let settings = SamplerSettings { kind: SamplerKind::Sobol, sample_count: 1, seed: 5 };
        let near = (0..1024)
            .filter_map(|i| {
                let u = Sampler::new(&settings, (1, 0), i).next_2d();
                guide.at(Vec3::new(3.0, 1.0, 0.0), Vec3::Z)?.sample(u)
            })
            .filter(|(d, _)| d.dot(window) > 0.8)
            .count();
        assert!(near > 900, "{near} of 1024");
    }

    #[test]
    fn unknown_facings_are_left_to_the_caller() {
        let guide = guide_towards(Vec3::Z);
        assert!(guide.at(Vec3::ZERO, -Vec3::Z).is_none());
        assert!(guide.at(Vec3::ZERO, Vec3::Z).is_some());
    }
}
