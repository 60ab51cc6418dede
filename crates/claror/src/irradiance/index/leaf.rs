//! The octree of simple caches, which shows its cells.

use super::{child_centre, cube, octant};
use crate::math::{Bounds3, Vec3};

const NONE: u32 = u32::MAX;
/// A leaf with more records is divided.
const LEAF_RECORDS: usize = 8;
/// Cells are not divided further.
const MAX_DEPTH: u32 = 24;

#[derive(Debug, Clone)]
struct Node {
    children: [u32; 8],
    /// Numbers and positions of a leaf's records; of a divided leaf those that it had.
    records: Vec<(u32, Vec3)>,
    /// The record for which it was divided.
    divided_for: u32,
}

impl Node {
    fn leaf() -> Self {
        Self { children: [NONE; 8], records: Vec::new(), divided_for: NONE }
    }
}

/// A record is in the leaf that its position lies in, and a query looks into its own leaf only, so
/// that records across a face are missed and the interpolation jumps there. Kept to show that.
#[derive(Debug, Clone)]
pub struct LeafOctree {
    nodes: Vec<Node>,
    centre: Vec3,
    half: f32,
}

impl LeafOctree {
    /// Empty, around the points that will ask.
    pub fn new(bounds: Bounds3) -> Self {
        let (centre, half) = cube(bounds);
        Self { nodes: vec![Node::leaf()], centre, half }
    }

    /// The leaf of a point when there were `count` records: its node, centre, half edge and depth.
    fn find(&self, count: u32, p: Vec3) -> (usize, Vec3, f32, u32) {
        let (mut node, mut centre, mut half, mut depth) = (0, self.centre, self.half, 0);
        while self.nodes[node].divided_for < count {
            let child = octant(p, centre);
            half *= 0.5;
            centre = child_centre(centre, half, child);
            node = self.nodes[node].children[child] as usize;
            depth += 1;
        }
        (node, centre, half, depth)
    }

    /// Adds a record.
    pub fn insert(&mut self, index: u32, position: Vec3) {
        let (node, centre, _, depth) = self.find(u32::MAX, position);
        self.nodes[node].records.push((index, position));
        if self.nodes[node].records.len() <= LEAF_RECORDS || depth == MAX_DEPTH {
            return;
        }
        let records = self.nodes[node].records.clone();
        self.nodes[node].divided_for = index;
        for child in 0..8 {
            self.nodes[node].children[child] = self.nodes.len() as u32;
            self.nodes.push(Node::leaf());
        }
        for (index, p) in records {
            let child = self.nodes[node].children[octant(p, centre)] as usize;
            self.nodes[child].records.push((index, p));
        }
    }

    /// Calls `f` with the numbers of the records in the leaf of `p`, as it was when there were
    /// `count` records.
    pub fn for_candidates(&self, count: u32, p: Vec3, f: impl FnMut(u32)) {
        let (node, ..) = self.find(count, p);
        let numbers = self.nodes[node].records.iter().map(|&(index, _)| index);
        numbers.filter(|&index| index < count).for_each(f);
    }
}
