//! Writes the wide nodes and the leaf blocks: every node is followed by the blocks of its own
//! leaves, then by its inner children and all below them, so that what is visited together lies
//! together.

use super::super::arena::Arena;
use super::super::node::{
    Child, NARROW, NODE_ROWS, Tree, WIDE, WIDTH, block_rows, clear_node, set_child, write_block,
};
use super::binary::BinaryNode;
use super::collapse::Choice;
use super::primitives::triangle;
use crate::shape::ShapeTable;
use arrayvec::ArrayVec;

/// A subtree that has become a child of a wide node.
#[derive(Clone, Copy)]
struct Part {
    /// Root of the subtree.
    node: usize,
    /// Its first primitive in the order.
    first: usize,
}

type Parts = ArrayVec<Part, WIDTH>;

/// A binary tree and what is to become of it.
pub(super) struct Plan<'a> {
    pub(super) shapes: &'a ShapeTable,
    pub(super) nodes: &'a [BinaryNode],
    pub(super) order: &'a [u32],
    pub(super) choices: &'a [Choice],
}

/// What a tree will take.
#[derive(Default)]
pub(super) struct Size {
    pub(super) rows: usize,
    /// Most inner nodes between the root and a leaf, both ends included.
    pub(super) depth: usize,
}

impl Plan<'_> {
    pub(super) fn size(&self, tree: &Tree) -> Size {
        let mut size = Size::default();
        self.measure(tree, &self.root(), 1, &mut size);
        size
    }

    /// Fills the rows of `tree`, whose other members are complete.
    pub(super) fn emit(&self, tree: &mut Tree, size: &Size) {
        tree.rows = Arena::zeroed(size.rows);
        let end = self.inner(tree, &self.root(), 0);
        debug_assert_eq!(end, size.rows);
    }

    /// The children of the root node: all there is, when that is one leaf or nothing.
    fn root(&self) -> Parts {
        let root = Part { node: 0, first: 0 };
        match self.choices.first() {
            None => Parts::new(),
            Some(choice) if choice.is_leaf() => Parts::from_iter([root]),
            Some(_) => self.parts(root),
        }
    }

    /// The children of an inner node.
    fn parts(&self, part: Part) -> Parts {
        let mut parts = Parts::new();
        self.dissolve(part, WIDTH, &mut parts);
        // A ray that looks for any hit finds it sooner where most triangles are.
        parts.sort_by_key(|p| std::cmp::Reverse(self.nodes[p.node].count));
        parts
    }

    /// The children for which a subtree makes way.
    fn dissolve(&self, part: Part, budget: usize, parts: &mut Parts) {
        match self.choices[part.node].shares(budget) {
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

    fn is_leaf(&self, part: Part) -> bool {
        self.choices[part.node].is_leaf()
    }

    fn ids(&self, part: Part) -> &[u32] {
        &self.order[part.first..part.first + self.nodes[part.node].count as usize]
    }

    /// Rows of a leaf; none for a special primitive.
    fn leaf_rows(&self, tree: &Tree, part: Part) -> usize {
        let ids = self.ids(part);
        if ids[0] < tree.triangle_count { block_rows(ids.len()) } else { 0 }
    }

    /// Rows of a node and its leaves, the next node on a new cache line.
    fn own_rows(&self, tree: &Tree, parts: &Parts) -> usize {
        let leaves = parts.iter().filter(|&&p| self.is_leaf(p));
        let rows: usize = leaves.map(|&p| self.leaf_rows(tree, p)).sum();
        (NODE_ROWS + rows).next_multiple_of(2)
    }

    fn measure(&self, tree: &Tree, parts: &Parts, depth: usize, size: &mut Size) {
        size.rows += self.own_rows(tree, parts);
        size.depth = size.depth.max(depth);
        for &part in parts.iter().filter(|&&p| !self.is_leaf(p)) {
            self.measure(tree, &self.parts(part), depth + 1, size);
        }
    }

    /// Writes a node and all below it from row `start` on; where the next one begins.
    fn inner(&self, tree: &mut Tree, parts: &Parts, start: usize) -> usize {
        clear_node(&mut tree.rows[start..]);
        let mut block = start + NODE_ROWS;
        let mut next = start + self.own_rows(tree, parts);
        for (i, &part) in parts.iter().enumerate() {
            let child = if self.is_leaf(part) {
                let child = self.leaf(tree, part, block);
                block += self.leaf_rows(tree, part);
                child
            } else {
                let row = next;
                next = self.inner(tree, &self.parts(part), row);
                Child::inner(row)
            };
            set_child(&mut tree.rows[start..], i, self.nodes[part.node].bounds, child);
        }
        next
    }

    fn leaf(&self, tree: &mut Tree, part: Part, start: usize) -> Child {
        let ids = self.ids(part);
        if let Some(special) = ids[0].checked_sub(tree.triangle_count) {
            return Child::special(special as usize);
        }
        let vertices = |&id: &u32| {
            let (shape, i) = tree.shape_of(id);
            (id, triangle(self.shapes, shape, i))
        };
        let triangles: ArrayVec<_, WIDE> = ids.iter().map(vertices).collect();
        write_block(&mut tree.rows[start..], &triangles);
        Child::block(start, ids.len() > NARROW)
    }
}
