//! Clamping by neighbours: what one record knows of the geometry around it, others learn.

use super::criterion::{Criterion, RadiusBounds, RadiusSettings, clamped_by_neighbour};
use super::record::Record;
use crate::math::{Bounds3, Vec3};

const NONE: u32 = u32::MAX;
/// A leaf with more points is divided.
const LEAF_POINTS: usize = 8;
/// Leaves are not divided further.
const MAX_DEPTH: u32 = 24;
/// Lower bounds of distances are made smaller by this, so that rounding hides no pair.
const ROUNDING: f32 = 1.0 - 1e-5;

/// The least radii that follow from all pairs: Rᵢ* = minⱼ(Rⱼ + β |Pᵢ − Pⱼ|), Rᵢ itself included,
/// of the radii R before clamping (Křivánek et al. 2006). By the triangle inequality a second
/// round would change nothing, so the order in which points come does not matter.
///
/// Pairs are found in an octree whose nodes know their points' box, least radius and largest
/// clamped radius: a node is skipped when none of its spheres reaches the point, nor the point's
/// sphere any of them.
#[derive(Debug, Clone)]
pub struct NeighbourClamp {
    slope: f32,
    nodes: Vec<Node>,
    points: Vec<Point>,
}

#[derive(Debug, Clone)]
struct Node {
    bounds: Bounds3,
    least: f32,
    largest: f32,
    children: [u32; 8],
    /// Of a leaf.
    points: Vec<u32>,
    is_leaf: bool,
}

impl Node {
    fn leaf() -> Self {
        Self {
            bounds: Bounds3::EMPTY,
            least: f32::INFINITY,
            largest: 0.0,
            children: [NONE; 8],
            points: Vec::new(),
            is_leaf: true,
        }
    }

    fn add(&mut self, point: &Point) {
        self.bounds = self.bounds.including(point.position);
        self.least = self.least.min(point.natural);
        self.largest = self.largest.max(point.clamped);
    }

    /// Not more than the distance of any of its points.
    fn distance(&self, p: Vec3) -> f32 {
        let outside = (self.bounds.min - p).max(p - self.bounds.max).max(Vec3::ZERO);
        ROUNDING * outside.length()
    }
}

#[derive(Debug, Clone, Copy)]
struct Point {
    position: Vec3,
    natural: f32,
    clamped: f32,
}

impl NeighbourClamp {
    /// No points yet; `slope` is β.
    pub fn new(slope: f32) -> Self {
        Self { slope, nodes: vec![Node::leaf()], points: Vec::new() }
    }

    /// Adds a point with its radius, and returns the clamped one. Calls `shrunk` with the number
    /// and the new radius of each earlier point that it clamps.
    pub fn insert(
        &mut self,
        position: Vec3,
        natural: f32,
        mut shrunk: impl FnMut(usize, f32),
    ) -> f32 {
        let mut clamped = natural;
        self.clamped(0, position, &mut clamped);
        self.clamp_others(0, position, natural, &mut shrunk);
        let index = self.points.len() as u32;
        self.points.push(Point { position, natural, clamped });
        self.add(index);
        clamped
    }

    fn clamped(&self, node: usize, p: Vec3, least: &mut f32) {
        let node = &self.nodes[node];
        if node.least + self.slope * node.distance(p) >= *least {
            return;
        }
        for &i in &node.points {
            let other = &self.points[i as usize];
            let distance = other.position.distance(p);
            *least = clamped_by_neighbour(*least, other.natural, distance, self.slope);
        }
        for &child in node.children.iter().filter(|&&child| child != NONE) {
            self.clamped(child as usize, p, least);
        }
    }

    fn clamp_others(
        &mut self,
        node: usize,
        p: Vec3,
        natural: f32,
        shrunk: &mut impl FnMut(usize, f32),
    ) {
        if self.nodes[node].largest <= natural + self.slope * self.nodes[node].distance(p) {
            return;
        }
        let mut largest = 0.0_f32;
        for &i in &self.nodes[node].points {
            let other = &mut self.points[i as usize];
            let distance = other.position.distance(p);
            let limit = clamped_by_neighbour(other.clamped, natural, distance, self.slope);
            if limit < other.clamped {
                other.clamped = limit;
                shrunk(i as usize, limit);
            }
            largest = largest.max(other.clamped);
        }
        for child in self.nodes[node].children {
            if child != NONE {
                self.clamp_others(child as usize, p, natural, shrunk);
                largest = largest.max(self.nodes[child as usize].largest);
            }
        }
        self.nodes[node].largest = largest;
    }

    fn add(&mut self, index: u32) {
        let point = self.points[index as usize];
        let (mut node, mut depth) = (0, 0);
        loop {
            self.nodes[node].add(&point);
            if self.nodes[node].is_leaf {
                break;
            }
            node = self.child(node, point.position);
            depth += 1;
        }
        self.nodes[node].points.push(index);
        if self.nodes[node].points.len() > LEAF_POINTS && depth < MAX_DEPTH {
            self.nodes[node].is_leaf = false;
            for index in std::mem::take(&mut self.nodes[node].points) {
                let point = self.points[index as usize];
                let child = self.child(node, point.position);
                self.nodes[child].add(&point);
                self.nodes[child].points.push(index);
            }
        }
    }

    /// Where a point goes below a node: by the middle of its box so far. Nothing but speed depends
    /// on it, since nodes keep the boxes of what they got.
    fn child(&mut self, node: usize, p: Vec3) -> usize {
        let parent = &self.nodes[node];
        let octant = p.cmpgt(parent.bounds.center()).bitmask() as usize;
        if parent.children[octant] != NONE {
            return parent.children[octant] as usize;
        }
        let child = self.nodes.len();
        self.nodes[node].children[octant] = child as u32;
        self.nodes.push(Node::leaf());
        child
    }
}

impl RadiusSettings {
    /// The slope β of [`NeighbourClamp`] for radii of this criterion. 1 for distances to what is
    /// seen, scaled as they are; curvatures are not bound by it, so twice as much for theirs.
    pub fn neighbour_slope(&self) -> f32 {
        match self.criterion {
            Criterion::Tabellion04 => 0.5 * self.accuracy,
            Criterion::Hessian => 2.0,
            _ => self.accuracy,
        }
    }
}

/// A record with its natural radius limited to `limit` by a neighbour: bounds are applied last,
/// and gradients are scaled as wherever the lower bound raises a radius. The record is the one
/// before any limits, so that one limit after the other leads to the bits of the least alone.
pub fn limited(record: &Record, limit: f32, bounds: &RadiusBounds) -> Record {
    if limit >= record.natural_radius {
        return *record;
    }
    let [short, long] = record.radii;
    let least = bounds.least.min(short);
    let new = [limit.clamp(least, short), limit.clamp(least, long)];
    let scale = |natural: f32, radius: f32| (natural / radius).min(1.0);
    let factor = scale(limit, new[0]) / scale(record.natural_radius, short);
    let raised = if limit < bounds.least { Record::RAISED } else { 0 };
    Record {
        radii: new,
        translational: record.translational.map(|g| g * factor),
        flags: record.flags | Record::NEIGHBOUR_LIMITED | raised,
        ..*record
    }
}
