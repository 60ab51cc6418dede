//! The octree that refers to a record from every cell that it reaches.

use super::{child_centre, cube, octant};
use crate::irradiance::kernel::Reach;
use crate::irradiance::record::Record;
use crate::math::{Bounds3, Vec3};

const NONE: u32 = u32::MAX;
/// Cells are not divided further.
const MAX_DEPTH: u32 = 24;

#[derive(Debug, Clone, Copy)]
#[repr(C)]
struct Node {
    children: [u32; 8],
    /// First entry of a list.
    entries: u32,
}

impl Node {
    const EMPTY: Self = Self { children: [NONE; 8], entries: NONE };
}

#[derive(Debug, Clone, Copy)]
#[repr(C)]
struct Entry {
    record: u32,
    next: u32,
}

/// A record is in all cells, of the level whose cells are as large as its support, that the
/// support overlaps: at most eight. A query meets each record at most once on its way from the
/// root to a leaf. Cells at the border reach to infinity, so that nothing lies outside.
#[derive(Debug, Clone)]
pub struct Octree {
    nodes: Vec<Node>,
    entries: Vec<Entry>,
    centre: Vec3,
    half: f32,
    reach: Reach,
}

/// A cell on the way down.
#[derive(Clone, Copy)]
struct Place {
    node: usize,
    centre: Vec3,
    half: f32,
    depth: u32,
}

impl Octree {
    /// Empty, around the points that will ask.
    pub fn new(bounds: Bounds3, reach: Reach) -> Self {
        let (centre, half) = cube(bounds);
        Self { nodes: vec![Node::EMPTY], entries: Vec::new(), centre, half, reach }
    }

    /// Adds a record.
    pub fn insert(&mut self, index: u32, record: &Record) {
        let support = record.support(self.reach.factor, self.reach.thickness);
        let root = Place { node: 0, centre: self.centre, half: self.half, depth: 0 };
        self.insert_at(index, &support, support.extent().max_element(), root);
    }

    fn insert_at(&mut self, index: u32, support: &Bounds3, edge: f32, place: Place) {
        // The child's edge is `half`; a box that is not finite stays at the root.
        if place.depth == MAX_DEPTH || place.half < edge || edge.is_nan() {
            let next = self.nodes[place.node].entries;
            self.nodes[place.node].entries = self.entries.len() as u32;
            self.entries.push(Entry { record: index, next });
            return;
        }
        // The comparisons of the look-up: high if and only if p > centre.
        let low = support.min.cmple(place.centre).bitmask() as usize;
        let high = support.max.cmpgt(place.centre).bitmask() as usize;
        for child in 0..8 {
            if child & !high != 0 || !child & 7 & !low != 0 {
                continue;
            }
            let mut node = self.nodes[place.node].children[child];
            if node == NONE {
                node = self.nodes.len() as u32;
                self.nodes[place.node].children[child] = node;
                self.nodes.push(Node::EMPTY);
            }
            let half = 0.5 * place.half;
            let centre = child_centre(place.centre, half, child);
            let below = Place { node: node as usize, centre, half, depth: place.depth + 1 };
            self.insert_at(index, support, edge, below);
        }
    }

    /// Calls `f` with the numbers of all records that may serve `p`.
    #[inline]
    pub fn for_candidates(&self, p: Vec3, mut f: impl FnMut(u32)) {
        let (mut centre, mut half) = (self.centre, self.half);
        let mut node = &self.nodes[0];
        loop {
            let mut entry = node.entries;
            while let Some(&Entry { record, next }) = self.entries.get(entry as usize) {
                f(record);
                entry = next;
            }
            let child = octant(p, centre);
            let Some(below) = self.nodes.get(node.children[child] as usize) else {
                return;
            };
            half *= 0.5;
            centre = child_centre(centre, half, child);
            node = below;
        }
    }
}
