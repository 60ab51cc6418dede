//! Densities of directions by place and facing.

use super::{CELLS, Directions, FACINGS, cumulative_shares};
use crate::math::{Bounds3, Vec3, facing};

/// A regular grid over places.
#[derive(Debug, Clone, Copy)]
struct Voxels {
    min: Vec3,
    /// Voxels per scene unit; cubes.
    per_unit: f32,
    size: [u32; 3],
}

impl Voxels {
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

    /// The slot of grid `level` that holds a slot of the finest one.
    fn coarser(&self, slot: usize, level: u32) -> usize {
        let (voxel, facing) = (slot / FACINGS, slot % FACINGS);
        let n = self.size.map(|s| s as usize);
        let v = [voxel % n[0], voxel / n[0] % n[1], voxel / n[0] / n[1]];
        self.index(v.map(|c| c as u32), level) * FACINGS + facing
    }

    fn voxel_count(&self, level: u32) -> usize {
        self.size.iter().map(|s| ((s - 1) >> level) as usize + 1).product()
    }
}

/// Marks a voxel without density.
const NONE: u32 = u32::MAX;

/// What was seen from a voxel of a grid, facing one way.
#[derive(Debug, Clone)]
struct Seen {
    /// Number of the voxel and facing.
    slot: u32,
    count: u32,
    weights: [f32; CELLS],
}

impl Seen {
    fn nothing(slot: usize) -> Self {
        Self { slot: slot as u32, count: 0, weights: [0.0; CELLS] }
    }
}

/// Weights of directions, gathered by voxel of a grid and dominant axis of the normal. Sums depend
/// on the order in which they are added.
#[derive(Debug, Clone)]
pub struct DirectionSums {
    voxels: Voxels,
    /// Per voxel and facing: index into `seen`, or `NONE`.
    seen_of: Vec<u32>,
    seen: Vec<Seen>,
}

impl DirectionSums {
    /// Of nothing yet; so many voxels along the longest side of the box of all places.
    pub fn new(places: Bounds3, resolution: u32) -> Self {
        let voxels = Voxels::new(places, resolution);
        Self { voxels, seen_of: vec![NONE; voxels.voxel_count(0) * FACINGS], seen: Vec::new() }
    }

    /// Number of the voxel of `p` and the facing of the unit normal `n`.
    pub fn slot(&self, p: Vec3, n: Vec3) -> usize {
        self.voxels.index(self.voxels.voxel(p), 0) * FACINGS + facing(n) as usize
    }

    /// Adds a weight to a direction cell as seen from a slot.
    pub fn add(&mut self, slot: usize, cell: usize, weight: f32) {
        if self.seen_of[slot] == NONE {
            self.seen_of[slot] = self.seen.len() as u32;
            self.seen.push(Seen::nothing(slot));
        }
        let seen = &mut self.seen[self.seen_of[slot] as usize];
        seen.count += 1;
        seen.weights[cell] += weight;
    }

    /// Densities in proportion to the weights times `scale` by direction cell. A voxel must have seen
    /// `least` directions to be trusted; where it has not, up to `levels - 1` coarser grids step
    /// in, each with half the resolution of the one before.
    pub fn field(&self, levels: u32, least: u32, scale: &[f32; CELLS]) -> DirectionField {
        let mut field = DirectionField {
            voxels: self.voxels,
            density_of: vec![NONE; self.seen_of.len()],
            cumulative: Vec::new(),
        };
        for level in 0..levels {
            field.add_level(&self.coarser(level), level, least, scale);
        }
        field
    }

    /// The same by voxels of a coarser grid, in the order in which these first saw something.
    fn coarser(&self, level: u32) -> Vec<Seen> {
        let mut seen_of = vec![NONE; self.voxels.voxel_count(level) * FACINGS];
        let mut all: Vec<Seen> = Vec::new();
        for seen in &self.seen {
            let slot = self.voxels.coarser(seen.slot as usize, level);
            if seen_of[slot] == NONE {
                seen_of[slot] = all.len() as u32;
                all.push(Seen::nothing(slot));
            }
            let sum = &mut all[seen_of[slot] as usize];
            sum.count += seen.count;
            sum.weights.iter_mut().zip(seen.weights).for_each(|(sum, w)| *sum += w);
        }
        all
    }
}

/// Densities of directions by place and facing.
#[derive(Debug, Clone)]
pub struct DirectionField {
    voxels: Voxels,
    /// Per voxel of the finest grid and facing: index of its density, or `NONE`.
    density_of: Vec<u32>,
    /// Cumulative shares of the direction cells, `CELLS` per density; the last is 1.
    cumulative: Vec<f32>,
}

impl DirectionField {
    /// Makes the densities of the voxels of grid `level` that saw enough, and hands them to the
    /// finest voxels inside that have none yet.
    fn add_level(&mut self, seen: &[Seen], level: u32, least: u32, scale: &[f32; CELLS]) {
        let mut density = vec![NONE; self.voxels.voxel_count(level) * FACINGS];
        for seen in seen.iter().filter(|seen| seen.count >= least) {
            density[seen.slot as usize] = (self.cumulative.len() / CELLS) as u32;
            self.cumulative.extend(cumulative_shares(&seen.weights, scale));
        }
        for slot in 0..self.density_of.len() {
            if self.density_of[slot] == NONE {
                self.density_of[slot] = density[self.voxels.coarser(slot, level)];
            }
        }
    }

    /// What is known for the place `p` with unit normal `n`, if anything is.
    #[inline]
    pub fn at(&self, p: Vec3, n: Vec3) -> Option<Directions<'_>> {
        let slot = self.voxels.index(self.voxels.voxel(p), 0) * FACINGS + facing(n) as usize;
        let d = self.density_of[slot];
        (d != NONE)
            .then(|| Directions(&self.cumulative[d as usize * CELLS..(d as usize + 1) * CELLS]))
    }

    /// Memory of the tables, bytes.
    pub fn memory_bytes(&self) -> usize {
        4 * (self.density_of.len() + self.cumulative.len())
    }
}
