//! A binary tree by binned surface area heuristic (Wald 2007: On fast construction of SAH-based
//! bounding volume hierarchies), one primitive per leaf.
//!
//! Every subtree knows beforehand where in the array of nodes it will stand (a subtree over n
//! primitives has 2n - 1 nodes), so that threads share nothing and the result does not depend on
//! them.

use super::super::node::MAX_DEPTH;
use super::primitives::PrimitiveRef;
use crate::math::{Bounds3, Vec3};

/// A node. Its left child is the next node of the array; its primitives are those from
/// `first` on in the order that [`build`] leaves behind.
#[derive(Debug, Clone, Copy)]
pub(super) struct BinaryNode {
    pub(super) bounds: Bounds3,
    /// Primitives below.
    pub(super) count: u32,
    /// Position of the right child in the array; 0 in a leaf.
    pub(super) right: u32,
}

impl BinaryNode {
    const UNSET: Self = Self { bounds: Bounds3::EMPTY, count: 0, right: 0 };
}

/// Bins per axis.
const BINS: usize = 32;
/// Levels to which the heuristic may be followed before ranges are halved by count: as deep as real
/// scenes ever go, and, should that give too deep a tree, so few that, with at most 2^31
/// primitives, no leaf lies deeper than [`MAX_DEPTH`].
pub(super) const SAH_DEPTHS: [usize; 2] = [64, MAX_DEPTH - 32];
/// Ranges above this are split in parallel.
const PARALLEL: usize = 4096;

/// Reorders the primitives and returns the nodes of the tree over them, the root first; empty for
/// no primitives. The heuristic is followed down to `sah_depth`.
pub(super) fn build(refs: &mut [PrimitiveRef], sah_depth: usize) -> Vec<BinaryNode> {
    if refs.is_empty() {
        return Vec::new();
    }
    let mut nodes = vec![BinaryNode::UNSET; 2 * refs.len() - 1];
    subtree(refs, &mut nodes, 0, sah_depth);
    nodes
}

fn subtree(refs: &mut [PrimitiveRef], nodes: &mut [BinaryNode], position: usize, sah_depth: usize) {
    let extent = Extent::of(refs);
    let count = refs.len();
    if count == 1 {
        nodes[0] = BinaryNode { bounds: extent.bounds, count: 1, right: 0 };
        return;
    }
    let middle = split(refs, &extent, sah_depth > 0);
    let right = position + 2 * middle;
    nodes[0] = BinaryNode { bounds: extent.bounds, count: count as u32, right: right as u32 };
    let below = sah_depth.saturating_sub(1);
    let (left_refs, right_refs) = refs.split_at_mut(middle);
    let (left_nodes, right_nodes) = nodes[1..].split_at_mut(2 * middle - 1);
    let left = |refs: &mut [PrimitiveRef], nodes: &mut [BinaryNode]| {
        subtree(refs, nodes, position + 1, below);
    };
    if count > PARALLEL {
        rayon::join(
            || left(left_refs, left_nodes),
            || subtree(right_refs, right_nodes, right, below),
        );
    } else {
        left(left_refs, left_nodes);
        subtree(right_refs, right_nodes, right, below);
    }
}

/// Box of some primitives, and box of their doubled centres.
struct Extent {
    bounds: Bounds3,
    centers2: Bounds3,
}

impl Extent {
    fn of(refs: &[PrimitiveRef]) -> Self {
        let empty = Self { bounds: Bounds3::EMPTY, centers2: Bounds3::EMPTY };
        refs.iter().fold(empty, |e, r| Self {
            bounds: e.bounds.union(r.bounds()),
            centers2: e.centers2.including(r.center2()),
        })
    }
}

/// Orders the primitives so that the first of the two parts stands first; where the second begins.
fn split(refs: &mut [PrimitiveRef], extent: &Extent, use_heuristic: bool) -> usize {
    let best = if use_heuristic { best_split(refs, extent) } else { None };
    let halves = refs.len() / 2;
    let Some(best) = best else { return halves };
    let middle = partition(refs, |r| best.bins.bin(r)[best.axis] < best.bin);
    // Both sides of a split by bins hold something; this is for what rounding may do.
    if middle == 0 || middle == refs.len() { halves } else { middle }
}

/// Which bin a primitive belongs to.
#[derive(Clone, Copy)]
struct Binning {
    origin: Vec3,
    scale: Vec3,
}

impl Binning {
    fn new(centers2: Bounds3) -> Self {
        let extent = centers2.extent();
        let scale = |e: f32| if e > 0.0 { (BINS as f32 * 0.9999 / e).min(f32::MAX) } else { 0.0 };
        Self {
            origin: centers2.min,
            scale: Vec3::new(scale(extent.x), scale(extent.y), scale(extent.z)),
        }
    }

    fn bin(&self, r: &PrimitiveRef) -> [usize; 3] {
        let b = (r.center2() - self.origin) * self.scale;
        [b.x, b.y, b.z].map(|x| (x as usize).min(BINS - 1))
    }
}

/// A way to cut: primitives in bins below `bin` on `axis` go left.
struct Split {
    bins: Binning,
    axis: usize,
    bin: usize,
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Bounds3,
    count: u32,
}

/// The cheapest split by the surface area heuristic; `None` when all centres coincide (or lie too
/// close together to be told apart).
fn best_split(refs: &[PrimitiveRef], extent: &Extent) -> Option<Split> {
    let bins = Binning::new(extent.centers2);
    let mut filled = [[Bin { bounds: Bounds3::EMPTY, count: 0 }; BINS]; 3];
    for r in refs {
        for (axis, bin) in bins.bin(r).into_iter().enumerate() {
            let bin = &mut filled[axis][bin];
            bin.bounds = bin.bounds.union(r.bounds());
            bin.count += 1;
        }
    }
    let mut best: Option<(f32, Split)> = None;
    for (axis, filled) in filled.iter().enumerate() {
        if bins.scale[axis] == 0.0 {
            continue;
        }
        let Some((cost, bin)) = sweep(filled) else { continue };
        if best.as_ref().is_none_or(|(least, _)| cost < *least) {
            best = Some((cost, Split { bins, axis, bin }));
        }
    }
    best.map(|(_, split)| split)
}

/// The cheapest cut between the bins of one axis and its cost, Σ half area · count.
fn sweep(bins: &[Bin; BINS]) -> Option<(f32, usize)> {
    let mut right_cost = [0.0; BINS];
    let (mut bounds, mut count) = (Bounds3::EMPTY, 0);
    for i in (1..BINS).rev() {
        bounds = bounds.union(bins[i].bounds);
        count += bins[i].count;
        right_cost[i] = if count == 0 { f32::INFINITY } else { bounds.half_area() * count as f32 };
    }
    let mut best = None;
    let mut least = f32::INFINITY;
    (bounds, count) = (Bounds3::EMPTY, 0);
    for i in 1..BINS {
        bounds = bounds.union(bins[i - 1].bounds);
        count += bins[i - 1].count;
        let cost = bounds.half_area() * count as f32 + right_cost[i];
        if count > 0 && cost < least {
            (least, best) = (cost, Some((cost, i)));
        }
    }
    best
}

/// Moves what satisfies the predicate to the front; how many do.
fn partition(refs: &mut [PrimitiveRef], goes_left: impl Fn(&PrimitiveRef) -> bool) -> usize {
    let mut left = 0;
    let mut right = refs.len();
    loop {
        while left < right && goes_left(&refs[left]) {
            left += 1;
        }
        while left < right && !goes_left(&refs[right - 1]) {
            right -= 1;
        }
        if left == right {
            return left;
        }
        refs.swap(left, right - 1);
    }
}
