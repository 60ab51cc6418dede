//! A binary tree by binned surface area heuristic (Wald 2007: On fast construction of SAH-based
//! bounding volume hierarchies), one primitive per leaf.
//!
//! Every subtree knows beforehand where in the array of nodes it will stand (a subtree over n
//! primitives has 2n - 1 nodes), so that threads share nothing and the result does not depend on
//! them.

use super::super::node::MAX_DEPTH;
use super::primitives::PrimitiveRef;
use super::split::{Extent, split};
use crate::math::Bounds3;

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
    subtree(refs, &Extent::of(refs), &mut nodes, 0, sah_depth);
    nodes
}

/// Builds the tree over `refs` into `nodes`, the first of which stands at `position` in the array.
fn subtree(
    refs: &mut [PrimitiveRef],
    extent: &Extent,
    nodes: &mut [BinaryNode],
    position: usize,
    sah_depth: usize,
) {
    let (bounds, count) = (extent.bounds(), refs.len());
    if count == 1 {
        nodes[0] = BinaryNode { bounds, count: 1, right: 0 };
        return;
    }
    let [left, right] = split(refs, extent, sah_depth > 0);
    let right_position = position + 2 * left.count;
    nodes[0] = BinaryNode { bounds, count: count as u32, right: right_position as u32 };
    let below = sah_depth.saturating_sub(1);
    let (left_refs, right_refs) = refs.split_at_mut(left.count);
    let (left_nodes, right_nodes) = nodes[1..].split_at_mut(2 * left.count - 1);
    let build_left = || subtree(left_refs, &left.extent, left_nodes, position + 1, below);
    let build_right = || subtree(right_refs, &right.extent, right_nodes, right_position, below);
    if count > PARALLEL {
        rayon::join(build_left, build_right);
    } else {
        let (mut build_left, mut build_right) = (build_left, build_right);
        build_left();
        build_right();
    }
}
