//! An octree whose leaves list all that reaches into them, for caches that do not change any more.

use super::{child_centre, cube, octant};
use crate::irradiance::kernel::Reach;
use crate::irradiance::record::Record;
use crate::math::{Bounds3, Vec3};

/// Bit of a link that names a leaf; other links name nodes.
const LEAF: u32 = 1 << 31;
/// Cells with no more records are not divided.
const FEW: usize = 8;
/// Nor are those whose occupied parts would on average keep more than this share of the records:
/// the records are larger than the cell.
const KEPT: f64 = 0.6;
/// Cells are not divided further.
const MAX_DEPTH: u32 = 20;

/// A query goes down to one leaf, without the records on its way, and reads one list.
#[derive(Debug, Clone)]
pub struct Cells {
    /// Links of each node's children.
    nodes: Vec<[u32; 8]>,
    /// Where a leaf's list begins; the next one's beginning is its end.
    starts: Vec<u32>,
    /// The lists.
    records: Vec<u32>,
    root: u32,
    centre: Vec3,
    half: f32,
}

impl Cells {
    /// Over all records.
    pub fn new(records: &[Record], reach: Reach) -> Self {
        let supports: Vec<Bounds3> =
            records.iter().map(|r| r.support(reach.factor, reach.thickness)).collect();
        let bounds = records.iter().fold(Bounds3::EMPTY, |b, r| b.including(r.position));
        let (centre, half) = cube(bounds);
        let mut cells =
            Self { nodes: Vec::new(), starts: vec![0], records: Vec::new(), root: 0, centre, half };
        let all = (0..records.len() as u32).collect();
        cells.root = cells.build(&supports, all, centre, half, 0);
        cells
    }

    fn build(
        &mut self,
        supports: &[Bounds3],
        inside: Vec<u32>,
        centre: Vec3,
        half: f32,
        depth: u32,
    ) -> u32 {
        let parts = if inside.len() <= FEW || depth == MAX_DEPTH {
            None
        } else {
            divided(supports, &inside, centre)
        };
        let Some(parts) = parts else {
            let leaf = (self.starts.len() - 1) as u32;
            self.records.extend(inside);
            self.starts.push(self.records.len() as u32);
            return LEAF | leaf;
        };
        drop(inside);
        let node = self.nodes.len();
        self.nodes.push([0; 8]);
        let half = 0.5 * half;
        for (child, part) in parts.into_iter().enumerate() {
            let below = child_centre(centre, half, child);
            let link = self.build(supports, part, below, half, depth + 1);
            self.nodes[node][child] = link;
        }
        node as u32
    }

    /// How many entries all lists have together, four bytes each.
    pub fn references(&self) -> usize {
        self.records.len()
    }

    /// Calls `f` with the numbers of all records that may serve `p`.
    #[inline]
    pub fn for_candidates(&self, p: Vec3, f: impl FnMut(u32)) {
        let (mut link, mut centre, mut half) = (self.root, self.centre, self.half);
        while let Some(node) = self.nodes.get(link as usize) {
            let child = octant(p, centre);
            half *= 0.5;
            centre = child_centre(centre, half, child);
            link = node[child];
        }
        let leaf = (link & !LEAF) as usize;
        let range = self.starts[leaf] as usize..self.starts[leaf + 1] as usize;
        self.records[range].iter().copied().for_each(f);
    }
}

/// The records in each eighth of a cell, if it is worth dividing.
fn divided(supports: &[Bounds3], inside: &[u32], centre: Vec3) -> Option<[Vec<u32>; 8]> {
    let mut parts: [Vec<u32>; 8] = Default::default();
    for &record in inside {
        let support = &supports[record as usize];
        // The comparisons of the look-up: high if and only if p > centre.
        let low = support.min.cmple(centre).bitmask() as usize;
        let high = support.max.cmpgt(centre).bitmask() as usize;
        for (child, part) in parts.iter_mut().enumerate() {
            if child & !high == 0 && !child & 7 & !low == 0 {
                part.push(record);
            }
        }
    }
    let occupied = parts.iter().filter(|p| !p.is_empty()).count();
    let kept: usize = parts.iter().map(Vec::len).sum();
    let worth = kept as f64 <= KEPT * (occupied * inside.len()) as f64;
    worth.then_some(parts)
}
