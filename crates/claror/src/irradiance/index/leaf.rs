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
    /// Of a leaf: numbers and positions of its records.
    records: Vec<(u32, Vec3)>,
    leaf: bool,
}

impl Node {
    fn leaf() -> Self {
        Self { children: [NONE; 8], records: Vec::new(), leaf: true }
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

    /// The leaf of a point: its node, centre, half edge and depth.
    fn find(&self, p: Vec3) -> (usize, Vec3, f32, u32) {
        let (mut node, mut centre, mut half, mut depth) = (0, self.centre, self.half, 0);
        while !self.nodes[node].leaf {
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
        let (node, centre, _, depth) = self.find(position);
        self.nodes[node].records.push((index, position));
        if self.nodes[node].records.len() <= LEAF_RECORDS || depth == MAX_DEPTH {
            return;
        }
        let records = std::mem::take(&mut self.nodes[node].records);
        self.nodes[node].leaf = false;
        for child in 0..8 {
            self.nodes[node].children[child] = self.nodes.len() as u32;
            self.nodes.push(Node::leaf());
        }
        for (index, p) in records {
            let child = self.nodes[node].children[octant(p, centre)] as usize;
            self.nodes[child].records.push((index, p));
        }
    }

    /// Calls `f` with the numbers of the records in the leaf of `p`.
    pub fn for_candidates(&self, p: Vec3, f: impl FnMut(u32)) {
        let (node, ..) = self.find(p);
        self.nodes[node].records.iter().map(|&(index, _)| index).for_each(f);
    }
}
