//! Which records may reach a point.

mod bvh;
mod cells;
mod leaf;
mod octree;

pub use bvh::Bvh;
pub use cells::Cells;
pub use leaf::LeafOctree;
pub use octree::Octree;

use super::kernel::Reach;
use super::record::Record;
use crate::math::{Bounds3, Vec3};

/// The structures by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum IndexKind {
    /// [`Index::All`].
    Vector,
    /// [`Index::Octree`].
    Octree,
    /// [`Index::Leaves`].
    Leaves,
    /// [`Index::Cells`].
    #[default]
    Cells,
    /// [`Index::Bvh`].
    Bvh,
}

impl IndexKind {
    /// All of them, the default first.
    pub const ALL: [Self; 5] = [Self::Cells, Self::Bvh, Self::Octree, Self::Vector, Self::Leaves];

    /// As scene files and the command line call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Vector => "vector",
            Self::Octree => "octree",
            Self::Leaves => "leaves",
            Self::Cells => "cells",
            Self::Bvh => "bvh",
        }
    }
}

/// The structures, all of which list every record that may be valid at a point, once, and some
/// that are not; except [`Index::Leaves`], which misses some.
#[derive(Debug, Clone)]
pub enum Index {
    /// All records: the reference.
    All(u32),
    /// Grows with the cache.
    Octree(Octree),
    /// Forgets records across the faces of its cells: the mistake of simple caches.
    Leaves(LeafOctree),
    /// For a finished cache: fastest.
    Cells(Cells),
    /// For a finished cache: smallest.
    Bvh(Bvh),
}

impl Index {
    /// Brute force.
    pub fn all() -> Self {
        Self::All(0)
    }

    /// An empty octree around the points that will ask.
    pub fn octree(bounds: Bounds3, reach: Reach) -> Self {
        Self::Octree(Octree::new(bounds, reach))
    }

    /// An empty octree that looks into one leaf only.
    pub fn leaves(bounds: Bounds3) -> Self {
        Self::Leaves(LeafOctree::new(bounds))
    }

    /// The fastest one for all these records.
    pub fn frozen(records: &[Record], reach: Reach) -> Self {
        Self::Cells(Cells::new(records, reach))
    }

    /// An empty structure that can grow, around the points that will ask: the wanted one if it can,
    /// or one that lists the same.
    pub fn growing(kind: IndexKind, bounds: Bounds3, reach: Reach) -> Self {
        match kind {
            IndexKind::Vector => Self::all(),
            IndexKind::Leaves => Self::leaves(bounds),
            IndexKind::Octree | IndexKind::Cells | IndexKind::Bvh => Self::octree(bounds, reach),
        }
    }

    /// The structure for all these records, around the points that will ask.
    pub fn finished(kind: IndexKind, records: &[Record], bounds: Bounds3, reach: Reach) -> Self {
        match kind {
            IndexKind::Cells => Self::frozen(records, reach),
            IndexKind::Bvh => Self::Bvh(Bvh::new(records, reach)),
            IndexKind::Vector | IndexKind::Leaves | IndexKind::Octree => {
                let mut index = Self::growing(kind, bounds, reach);
                for (record, number) in records.iter().zip(0..) {
                    index.insert(number, record);
                }
                index
            }
        }
    }

    /// Adds a record, whose number is `index`. False when that is not possible any more.
    pub fn insert(&mut self, index: u32, record: &Record) -> bool {
        match self {
            Self::All(count) => *count = (*count).max(index + 1),
            Self::Octree(octree) => octree.insert(index, record),
            Self::Leaves(octree) => octree.insert(index, record.position),
            Self::Cells(_) | Self::Bvh(_) => return false,
        }
        true
    }

    /// Calls `f` with the numbers of all records that may serve `p`, each once, in any order.
    #[inline]
    pub fn for_candidates(&self, p: Vec3, f: impl FnMut(u32)) {
        match self {
            Self::All(count) => (0..*count).for_each(f),
            Self::Octree(octree) => octree.for_candidates(p, f),
            Self::Leaves(octree) => octree.for_candidates(u32::MAX, p, f),
            Self::Cells(cells) => cells.for_candidates(p, f),
            Self::Bvh(bvh) => bvh.for_candidates(p, f),
        }
    }

    /// The same when only the first `count` records were there: others may be listed, too, but
    /// what depends on the records that came later is as it was then.
    #[inline]
    pub fn for_candidates_of(&self, count: u32, p: Vec3, f: impl FnMut(u32)) {
        match self {
            Self::Leaves(octree) => octree.for_candidates(count, p, f),
            _ => self.for_candidates(p, f),
        }
    }
}

/// A cube, centre and half edge, around a box, somewhat larger.
fn cube(bounds: Bounds3) -> (Vec3, f32) {
    if bounds.is_empty() {
        return (Vec3::ZERO, 1.0);
    }
    let half = 0.505 * bounds.extent().max_element();
    (bounds.center(), if half > 0.0 { half } else { 1.0 })
}

/// The octant of a point about a centre: bits x, y, z.
#[inline]
fn octant(p: Vec3, centre: Vec3) -> usize {
    p.cmpgt(centre).bitmask() as usize
}

/// Centre of a child cell, a quarter of the cell's edge away.
#[inline]
fn child_centre(centre: Vec3, quarter: f32, octant: usize) -> Vec3 {
    let side = |bit: usize| if octant & bit != 0 { quarter } else { -quarter };
    centre + Vec3::new(side(1), side(2), side(4))
}
