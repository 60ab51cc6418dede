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
//! Places are voxels of a grid; a coarser grid steps in where a voxel saw too little. Facing is
//! the dominant axis of the normal. Directions are the cells of a grid on the faces of a cube, which
//! needs no trigonometry: within a cell the density is uniform on the face. All counts are integers, so the guide is the same for any number of threads.

use rayon::prelude::*;

use crate::interaction::SurfaceInteraction;
use crate::math::warp::cosine_hemisphere;
use crate::math::{Bounds3, Frame, Ray, Vec2, Vec3, facing};
use crate::sampler::{Sampler, SamplerKind, SamplerSettings};

/// Facings: the six signed axes.
const FACINGS: usize = 6;
/// Cells along an edge of a face of the cube of directions.
const EDGE: usize = 10;
/// Direction cells of a face.
const FACE: usize = EDGE * EDGE;
/// Direction cells.
const CELLS: usize = FACINGS * FACE;
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

/// One walk segment that left the scene: where from, facing where, in which direction cell.
#[derive(Debug, Clone, Copy)]
struct Escape {
    p: Vec3,
    facing: u8,
    cell: u16,
}

/// A learned density of directions in which the environment is visible.
#[derive(Debug, Clone)]
pub struct EnvironmentGuide {
    grid: Grid,
    /// Per voxel of the finest grid and facing: index of its density, or `NONE`.
    density_of: Vec<u32>,
    /// Cumulative shares of the direction cells, `CELLS` per density; the last is 1.
    cumulative: Vec<f32>,
}

/// Marks a voxel without density.
const NONE: u32 = u32::MAX;

/// A regular grid over the places where rays escaped.
#[derive(Debug, Clone, Copy)]
struct Grid {
    min: Vec3,
    /// Voxels per scene unit; cubes.
    per_unit: f32,
    size: [u32; 3],
}

impl Grid {
    fn new(bounds: Bounds3, resolution: u32) -> Self {
        let extent = bounds.extent().max(Vec3::splat(1e-20));
        let edge = extent.max_element() * (1.0 + 1e-4) / resolution as f32;
        let count = |e: f32| ((e / edge).floor() as u32 + 1).min(resolution + 1);
        Self {
            min: bounds.min,
            per_unit: 1.0 / edge,
            size: [count(extent.x), count(extent.y), count(extent.z)],
        }
    }

    /// Voxel that holds `p`; points outside belong to the nearest voxel.
    fn voxel(&self, p: Vec3) -> [u32; 3] {
        let q = (p - self.min) * self.per_unit;
        // A negative float narrows to 0.
        [0, 1, 2].map(|i| (q[i] as u32).min(self.size[i] - 1))
    }

    fn index(&self, v: [u32; 3], level: u32) -> usize {
        let n = self.size.map(|s| ((s - 1) >> level) as usize + 1);
        let v = v.map(|c| (c >> level) as usize);
        (v[2] * n[1] + v[1]) * n[0] + v[0]
    }

    fn voxel_count(&self, level: u32) -> usize {
        self.size.iter().map(|s| ((s - 1) >> level) as usize + 1).product()
    }
}

/// The axes along and across the face of the cube of directions around a signed axis.
const ACROSS: [[usize; 2]; 3] = [[1, 2], [2, 0], [0, 1]];

/// Direction cell of the unit vector `d`, and density by solid angle, there, of what is uniform in
/// that cell of the face: with r the vector to the face, dω = du dv / |r|³.
fn cell_of(d: Vec3) -> (usize, f32) {
    let face = facing(d) as usize;
    let axis = face / 2;
    let scale = 1.0 / d[axis].abs();
    let [i, j] = ACROSS[axis].map(|a| {
        // A negative float narrows to 0.
        let x = (0.5 * EDGE as f32) * (d[a] * scale + 1.0);
        (x as usize).min(EDGE - 1)
    });
    (face * FACE + j * EDGE + i, DENSITY_ON_FACE * scale * scale * scale)
}

/// Direction inside cell `cell`, uniform on the face for `u` uniform in the unit square, and its
/// density by solid angle.
fn direction_in(cell: usize, u: Vec2) -> (Vec3, f32) {
    let (face, within) = (cell / FACE, cell % FACE);
    let axis = face / 2;
    let mut r = Vec3::ZERO;
    r[axis] = if face % 2 == 0 { 1.0 } else { -1.0 };
    r[ACROSS[axis][0]] = ((within % EDGE) as f32 + u.x) * (2.0 / EDGE as f32) - 1.0;
    r[ACROSS[axis][1]] = ((within / EDGE) as f32 + u.y) * (2.0 / EDGE as f32) - 1.0;
    let length2 = r.length_squared();
    let length = length2.sqrt();
    (r / length, DENSITY_ON_FACE * length2 * length)
}

/// One over the area of a cell of a face.
const DENSITY_ON_FACE: f32 = FACE as f32 / 4.0;

/// What the guide knows about a place: cumulative shares of the direction cells.
#[derive(Debug, Clone, Copy)]
pub struct GuidedDirections<'a>(&'a [f32]);

impl GuidedDirections<'_> {
    /// A direction and its density by solid angle; `None` where rounding leaves none.
    pub fn sample(&self, u: Vec2) -> Option<(Vec3, f32)> {
        let shares = self.0;
        let cell = shares.partition_point(|&c| c <= u.x).min(CELLS - 1);
        let before = if cell == 0 { 0.0 } else { shares[cell - 1] };
        let share = shares[cell] - before;
        if share <= 0.0 {
            return None;
        }
        let within = ((u.x - before) / share).clamp(0.0, 1.0 - f32::EPSILON);
        let (direction, density) = direction_in(cell, Vec2::new(within, u.y));
        Some((direction, share * density))
    }

    /// Density by solid angle with which [`GuidedDirections::sample`] chooses the unit vector `d`.
    pub fn pdf(&self, d: Vec3) -> f32 {
        let (cell, density) = cell_of(d);
        let before = if cell == 0 { 0.0 } else { self.0[cell - 1] };
        (self.0[cell] - before) * density
    }
}

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
        let grid = Grid::new(bounds, resolution);
        let mean_radiance = mean_radiance_per_cell(radiance);
        let mut guide = Self {
            grid,
            density_of: vec![NONE; grid.voxel_count(0) * FACINGS],
            cumulative: Vec::new(),
        };
        for level in 0..LEVELS {
            guide.add_level(escapes, level, &mean_radiance);
        }
        guide
    }

    /// Makes the densities of the voxels of grid `level` that saw enough, and hands them to the
    /// finest voxels inside that have none yet.
    fn add_level(&mut self, escapes: &[Escape], level: u32, mean_radiance: &[f32; CELLS]) {
        let grid = self.grid;
        let slots = grid.voxel_count(level) * FACINGS;
        let slot = |e: &Escape| grid.index(grid.voxel(e.p), level) * FACINGS + e.facing as usize;
        let mut total = vec![0_u32; slots];
        for e in escapes {
            total[slot(e)] += 1;
        }
        let mut density = vec![NONE; slots];
        let mut counts: Vec<[u32; CELLS]> = Vec::new();
        for (s, &n) in total.iter().enumerate() {
            if n >= MIN_ESCAPES {
                density[s] = counts.len() as u32;
                counts.push([0; CELLS]);
            }
        }
        for e in escapes {
            let d = density[slot(e)];
            if d != NONE {
                counts[d as usize][e.cell as usize] += 1;
            }
        }
        let first = (self.cumulative.len() / CELLS) as u32;
        for c in &counts {
            self.cumulative.extend(cumulative_shares(c, mean_radiance));
        }
        for z in 0..grid.size[2] {
            for y in 0..grid.size[1] {
                for x in 0..grid.size[0] {
                    let fine = grid.index([x, y, z], 0) * FACINGS;
                    let coarse = grid.index([x, y, z], level) * FACINGS;
                    for f in 0..FACINGS {
                        if self.density_of[fine + f] == NONE && density[coarse + f] != NONE {
                            self.density_of[fine + f] = first + density[coarse + f];
                        }
                    }
                }
            }
        }
    }

    /// What was learned for the place `p` with unit normal `n` (on the lit side), if anything was.
    #[inline]
    pub fn at(&self, p: Vec3, n: Vec3) -> Option<GuidedDirections<'_>> {
        let slot = self.grid.index(self.grid.voxel(p), 0) * FACINGS + facing(n) as usize;
        let d = self.density_of[slot];
        (d != NONE).then(|| {
            GuidedDirections(&self.cumulative[d as usize * CELLS..(d as usize + 1) * CELLS])
        })
    }

    /// Memory of the tables, bytes.
    pub fn memory_bytes(&self) -> usize {
        4 * (self.density_of.len() + self.cumulative.len())
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
                escapes.push(Escape { p, facing: facing(n), cell: cell_of(ray.d).0 as u16 });
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

/// Cumulative shares of the direction cells: escapes times radiance. A fifth of each cell's
/// count is spread over its four neighbours on the face, since the counts are few and the voxels
/// not points.
fn cumulative_shares(counts: &[u32; CELLS], mean_radiance: &[f32; CELLS]) -> [f32; CELLS] {
    let mut weight = [0.0_f32; CELLS];
    for (cell, &n) in counts.iter().enumerate() {
        if n == 0 {
            continue;
        }
        let face = cell - cell % FACE;
        let (j, i) = (cell % FACE / EDGE, cell % EDGE);
        let neighbours = [
            (j.saturating_sub(1), i),
            ((j + 1).min(EDGE - 1), i),
            (j, i.saturating_sub(1)),
            (j, (i + 1).min(EDGE - 1)),
        ];
        weight[cell] += 0.8 * n as f32;
        for (j, i) in neighbours {
            weight[face + j * EDGE + i] += 0.05 * n as f32;
        }
    }
    let mut total = 0.0_f64;
    let mut sums = [0.0_f64; CELLS];
    for cell in 0..CELLS {
        total += f64::from(weight[cell]) * f64::from(mean_radiance[cell].max(0.0));
        sums[cell] = total;
    }
    if total <= 0.0 {
        // Only black parts of the environment are visible here: any density will do.
        return std::array::from_fn(|cell| (cell + 1) as f32 / CELLS as f32);
    }
    let mut shares = sums.map(|s| (s / total) as f32);
    shares[CELLS - 1] = 1.0;
    shares
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
                    facing: facing(Vec3::Z),
                    cell: cell_of((towards + 0.4 * spread).normalize()).0 as u16,
                }
            })
            .collect();
        EnvironmentGuide::from_escapes(&escapes, |d| 1.0 + 0.5 * d.x)
    }

    #[test]
    fn direction_cells_are_inverse_to_their_sampling() {
        for cell in 0..CELLS {
            for u in [Vec2::new(0.01, 0.02), Vec2::new(0.5, 0.5), Vec2::new(0.99, 0.97)] {
                let (d, density) = direction_in(cell, u);
                assert!((d.length() - 1.0).abs() < 1e-5);
                let (found, same_density) = cell_of(d);
                assert_eq!(found, cell);
                assert!((density - same_density).abs() < 1e-5 * density);
            }
        }
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
