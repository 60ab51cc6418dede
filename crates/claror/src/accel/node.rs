//! What a tree looks like in memory.

use crate::math::Bounds3;
use crate::shape::{InstanceId, ShapeId};

/// Children per inner node.
pub(super) const WIDTH: usize = 8;
/// Triangles per leaf block.
pub(super) const BLOCK: usize = 4;
/// Most blocks of a leaf.
pub(super) const LEAF_BLOCKS: usize = 2;
/// Most triangles of a leaf.
pub(super) const LEAF_TRIANGLES: usize = BLOCK * LEAF_BLOCKS;
/// No path from the root of a tree to a leaf has more inner nodes than this: the builder sees
/// to it, and the traversal's stack relies on it.
pub(super) const MAX_DEPTH: usize = 64;

/// An inner node: the boxes of eight children, each bound in a row of its own so that a ray is
/// tested against all eight at once. 256 bytes: four cache lines.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct WideNode {
    /// Rows 0 to 5: min x, max x, min y, max y, min z, max z. Row 6: [`Child`] bits. Row 7: free.
    /// Eight rows, so that any row number `& 7` is in range.
    pub(super) rows: [[f32; WIDTH]; 8],
}

/// Row of [`WideNode::rows`] that holds the children.
pub(super) const CHILD_ROW: usize = 6;

impl WideNode {
    /// A node without children.
    pub(super) const EMPTY: Self = {
        let mut rows = [[f32::INFINITY; WIDTH]; 8];
        rows[1] = [f32::NEG_INFINITY; WIDTH];
        rows[3] = [f32::NEG_INFINITY; WIDTH];
        rows[5] = [f32::NEG_INFINITY; WIDTH];
        // Should a ray of infinities or NaN find its way into an absent child, it meets nothing
        // there.
        rows[6] = [f32::from_bits(Child::NOTHING.0); WIDTH];
        rows[7] = [0.0; WIDTH];
        Self { rows }
    };

    /// Sets child `i`.
    pub(super) fn set(&mut self, i: usize, bounds: Bounds3, child: Child) {
        for axis in 0..3 {
            self.rows[2 * axis][i] = bounds.min[axis];
            self.rows[2 * axis + 1][i] = bounds.max[axis];
        }
        self.rows[CHILD_ROW][i] = f32::from_bits(child.0);
    }

    /// Child `i`.
    pub(super) fn child(&self, i: usize) -> Child {
        Child(self.rows[CHILD_ROW][i].to_bits())
    }

    /// Box of child `i`.
    pub(super) fn child_bounds(&self, i: usize) -> Bounds3 {
        let row = |r: usize| self.rows[r][i];
        Bounds3 {
            min: crate::math::Vec3::new(row(0), row(2), row(4)),
            max: crate::math::Vec3::new(row(1), row(3), row(5)),
        }
    }
}

/// What stands under a child slot, in 32 bits:
/// bit 31 leaf, bit 30 two blocks instead of one, bit 29 a special primitive instead of triangles,
/// below them the number of the first block or of the special primitive; bit 31 clear: the rest is
/// the number of an inner node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Child(pub(super) u32);

impl Child {
    const LEAF: u32 = 1 << 31;
    const SECOND_BLOCK: u32 = 1 << 30;
    const SPECIAL: u32 = 1 << 29;
    const NUMBER: u32 = Self::SPECIAL - 1;
    /// A leaf with nothing in it.
    pub(super) const NOTHING: Self = Self(u32::MAX);
    /// Most blocks or special primitives in a tree.
    pub(super) const MAX_NUMBER: usize = Self::NUMBER as usize;

    pub(super) fn inner(node: usize) -> Self {
        debug_assert!(node < Self::LEAF as usize);
        Self(node as u32)
    }

    pub(super) fn blocks(first: usize, count: usize) -> Self {
        debug_assert!(first < Self::MAX_NUMBER && (1..=LEAF_BLOCKS).contains(&count));
        let second = if count == 2 { Self::SECOND_BLOCK } else { 0 };
        Self(Self::LEAF | second | first as u32)
    }

    pub(super) fn special(number: usize) -> Self {
        debug_assert!(number < Self::MAX_NUMBER);
        Self(Self::LEAF | Self::SPECIAL | number as u32)
    }

    #[inline(always)]
    pub(super) fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    #[inline(always)]
    pub(super) fn is_special(self) -> bool {
        self.0 & Self::SPECIAL != 0
    }

    /// Number of the node, first block or special primitive.
    #[inline(always)]
    pub(super) fn number(self) -> usize {
        (if self.is_leaf() { self.0 & Self::NUMBER } else { self.0 }) as usize
    }

    /// Blocks of a triangle leaf.
    #[inline(always)]
    pub(super) fn block_count(self) -> usize {
        1 + usize::from(self.0 & Self::SECOND_BLOCK != 0)
    }
}

/// Four triangles, coordinate by coordinate. 160 bytes.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(32))]
pub(super) struct LeafBlock {
    /// Row `3·vertex + axis`, one column per triangle.
    pub(super) vertices: [[f32; BLOCK]; 9],
    /// Number of each triangle in its tree; absent ones repeat a present one's number over
    /// vertices that no ray meets.
    pub(super) ids: [u32; BLOCK],
}

impl LeafBlock {
    /// A block of triangles that no ray meets: all edge functions are NaN.
    pub(super) const EMPTY: Self =
        Self { vertices: [[f32::NAN; BLOCK]; 9], ids: [u32::MAX; BLOCK] };
}

/// What is not a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Special {
    /// A sphere, disk or cylinder.
    Shape(ShapeId),
    /// A placed group.
    Instance(InstanceId),
}

/// The triangles of one shape stand together in the numbering of a tree.
#[derive(Debug, Clone, Copy)]
pub(super) struct ShapeRange {
    /// Number of its first triangle.
    pub(super) first: u32,
    /// The shape.
    pub(super) shape: ShapeId,
}

/// One hierarchy. Triangles are numbered shape by shape; special primitives follow.
#[derive(Debug, Clone)]
pub(super) struct Tree {
    /// Inner nodes; the first is the root. Never empty.
    pub(super) nodes: Vec<WideNode>,
    /// Triangles.
    pub(super) blocks: Vec<LeafBlock>,
    /// Everything else.
    pub(super) specials: Vec<Special>,
    /// Ranges of triangle numbers, ascending.
    pub(super) ranges: Vec<ShapeRange>,
    /// For each run of [`DIRECTORY_STEP`] triangle numbers, the range that holds the first.
    pub(super) directory: Vec<u32>,
    /// Triangles, the left-out ones included.
    pub(super) triangle_count: u32,
    /// Box around everything.
    pub(super) bounds: Bounds3,
}

/// Triangle numbers per entry of [`Tree::directory`].
pub(super) const DIRECTORY_STEP: u32 = 64;

impl Tree {
    /// Shape and triangle within the shape of a primitive number.
    pub(super) fn shape_of(&self, key: u32) -> (ShapeId, u32) {
        if key >= self.triangle_count {
            return match self.specials[(key - self.triangle_count) as usize] {
                Special::Shape(id) => (id, 0),
                Special::Instance(_) => {
                    unreachable!("hits in an instance carry its group's numbers")
                }
            };
        }
        let mut r = self.directory[(key / DIRECTORY_STEP) as usize] as usize;
        while self.ranges.get(r + 1).is_some_and(|next| next.first <= key) {
            r += 1;
        }
        (self.ranges[r].shape, key - self.ranges[r].first)
    }

    /// Bytes on the heap.
    pub(super) fn memory_bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<WideNode>()
            + self.blocks.capacity() * size_of::<LeafBlock>()
            + self.specials.capacity() * size_of::<Special>()
            + self.ranges.capacity() * size_of::<ShapeRange>()
            + self.directory.capacity() * size_of::<u32>()
    }
}
