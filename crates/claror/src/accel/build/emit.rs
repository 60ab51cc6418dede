//! Writes the wide nodes and the leaf blocks.

use super::super::node::{BLOCK, Child, LeafBlock, Tree, WIDTH, WideNode};
use super::binary::BinaryNode;
use super::collapse::Choice;
use super::primitives::triangle;
use crate::shape::ShapeTable;
use arrayvec::ArrayVec;

struct Emitter<'a> {
    shapes: &'a ShapeTable,
    nodes: &'a [BinaryNode],
    order: &'a [u32],
    plan: &'a [Choice],
    tree: &'a mut Tree,
}

/// A subtree that has become a child of a wide node.
#[derive(Clone, Copy)]
struct Part {
    /// Root of the subtree.
    node: usize,
    /// Its first primitive in the order.
    first: usize,
}

/// Fills nodes and blocks of `tree`.
pub(super) fn emit(
    shapes: &ShapeTable,
    nodes: &[BinaryNode],
    order: &[u32],
    plan: &[Choice],
    tree: &mut Tree,
) {
    let mut emitter = Emitter { shapes, nodes, order, plan, tree };
    let root = Part { node: 0, first: 0 };
    if nodes.is_empty() {
        emitter.tree.nodes.push(WideNode::EMPTY);
    } else if plan[0].is_leaf() {
        let child = emitter.leaf(root);
        let mut node = WideNode::EMPTY;
        node.set(0, nodes[0].bounds, child);
        emitter.tree.nodes.push(node);
    } else {
        emitter.inner(root);
    }
    emitter.tree.nodes.shrink_to_fit();
    emitter.tree.blocks.shrink_to_fit();
}

impl Emitter<'_> {
    /// Writes a wide node and all below it; its number.
    fn inner(&mut self, part: Part) -> usize {
        let number = self.tree.nodes.len();
        self.tree.nodes.push(WideNode::EMPTY);
        let mut parts = ArrayVec::<Part, WIDTH>::new();
        self.dissolve(part, WIDTH, &mut parts);
        // A ray that looks for any hit finds it sooner where most triangles are.
        parts.sort_by_key(|p| std::cmp::Reverse(self.nodes[p.node].count));
        for (i, &part) in parts.iter().enumerate() {
            let child = if self.plan[part.node].is_leaf() {
                self.leaf(part)
            } else {
                Child::inner(self.inner(part))
            };
            let bounds = self.nodes[part.node].bounds;
            self.tree.nodes[number].set(i, bounds, child);
        }
        number
    }

    /// The children for which a subtree makes way.
    fn dissolve(&self, part: Part, budget: usize, parts: &mut ArrayVec<Part, WIDTH>) {
        match self.plan[part.node].shares(budget) {
            None => parts.push(part),
            Some((left, right)) => {
                let (l, r) = self.halves(part);
                self.dissolve(l, left, parts);
                self.dissolve(r, right, parts);
            }
        }
    }

    fn halves(&self, part: Part) -> (Part, Part) {
        let left = part.node + 1;
        let right = self.nodes[part.node].right as usize;
        let first = part.first + self.nodes[left].count as usize;
        (Part { node: left, ..part }, Part { node: right, first })
    }

    fn leaf(&mut self, part: Part) -> Child {
        let count = self.nodes[part.node].count as usize;
        let ids = &self.order[part.first..part.first + count];
        if let Some(special) = ids[0].checked_sub(self.tree.triangle_count) {
            return Child::special(special as usize);
        }
        let first = self.tree.blocks.len();
        for ids in ids.chunks(BLOCK) {
            let block = self.block(ids);
            self.tree.blocks.push(block);
        }
        Child::blocks(first, self.tree.blocks.len() - first)
    }

    fn block(&self, ids: &[u32]) -> LeafBlock {
        let mut block = LeafBlock::EMPTY;
        for (column, &id) in ids.iter().enumerate() {
            let (shape, i) = self.tree.shape_of(id);
            for (vertex, p) in triangle(self.shapes, shape, i).into_iter().enumerate() {
                for axis in 0..3 {
                    block.vertices[3 * vertex + axis][column] = p[axis];
                }
            }
            block.ids[column] = id;
        }
        block
    }
}
