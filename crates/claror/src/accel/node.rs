//! What a tree looks like in memory: inner nodes and blocks of triangles, all in one [`Arena`], named
//! by the number of their first row.

use super::arena::{self, Arena, Row};
use super::simd::Simd;
use crate::math::{Bounds3, Vec3};
use crate::shape::{InstanceId, ShapeId};

/// Children per inner node.
pub(super) const WIDTH: usize = 8;
/// Most triangles of a leaf that is a narrow block.
pub(super) const NARROW: usize = 4;
/// Most triangles of a leaf that is a wide block.
pub(super) const WIDE: usize = 8;
/// No path from the root of a tree to a leaf has more inner nodes than this: the builder sees
/// to it, and the traversal's stack relies on it.
pub(super) const MAX_DEPTH: usize = 40;
/// Rows of an inner node: 256 bytes, four cache lines.
pub(super) const NODE_ROWS: usize = 8;
/// Rows of a narrow block: 160 bytes.
pub(super) const NARROW_ROWS: usize = 5;
/// Rows of a wide block: 320 bytes.
pub(super) const WIDE_ROWS: usize = 10;

/// An inner node: the boxes of eight children, each bound in a row of its own so that a ray is
/// tested against all eight at once. Rows 0 to 5: min x, max x, min y, max y, min z, max z. Row 6:
/// the bits of each [`Child`]. Row 7 is free; with it, any row number `& 7` is in range.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct WideNode<'a>(pub(super) &'a [Row; NODE_ROWS]);

/// Row of a node that holds the children.
const CHILD_ROW: usize = 6;

impl WideNode<'_> {
    /// Child `i`.
    #[inline(always)]
    pub(super) fn child(self, i: usize) -> Child {
        Child(self.0[CHILD_ROW].0[i].to_bits())
    }

    /// Box of child `i`.
    pub(super) fn child_bounds(self, i: usize) -> Bounds3 {
        let row = |r: usize| self.0[r].0[i];
        Bounds3 { min: Vec3::new(row(0), row(2), row(4)), max: Vec3::new(row(1), row(3), row(5)) }
    }
}

/// Makes the rows of a node without children. Should a ray of infinities or NaN find its way into
/// an absent child, it meets nothing there.
pub(super) fn clear_node(rows: &mut [Row]) {
    for axis in 0..3 {
        rows[2 * axis] = Row([f32::INFINITY; WIDTH]);
        rows[2 * axis + 1] = Row([f32::NEG_INFINITY; WIDTH]);
    }
    rows[CHILD_ROW] = Row([f32::from_bits(Child::NOTHING.0); WIDTH]);
}

/// Sets child `i` in the rows of a node.
pub(super) fn set_child(rows: &mut [Row], i: usize, bounds: Bounds3, child: Child) {
    for axis in 0..3 {
        rows[2 * axis].0[i] = bounds.min[axis];
        rows[2 * axis + 1].0[i] = bounds.max[axis];
    }
    rows[CHILD_ROW].0[i] = f32::from_bits(child.0);
}

/// What stands under a child slot, in 32 bits:
/// bit 31 leaf, bit 30 a wide block instead of a narrow one, bit 29 a special primitive instead of triangles;
/// below them the first row of the node or block, or the number of the special primitive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Child(pub(super) u32);

impl Child {
    const LEAF: u32 = 1 << 31;
    const WIDE_BLOCK: u32 = 1 << 30;
    const SPECIAL: u32 = 1 << 29;
    const NUMBER: u32 = Self::SPECIAL - 1;
    /// A leaf with nothing in it.
    pub(super) const NOTHING: Self = Self(u32::MAX);
    /// Most rows or special primitives in a tree.
    pub(super) const MAX_NUMBER: usize = Self::NUMBER as usize;

    pub(super) fn inner(row: usize) -> Self {
        debug_assert!(row < Self::MAX_NUMBER);
        Self(row as u32)
    }

    pub(super) fn block(row: usize, is_wide: bool) -> Self {
        debug_assert!(row < Self::MAX_NUMBER);
        Self(Self::LEAF | if is_wide { Self::WIDE_BLOCK } else { 0 } | row as u32)
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

    /// First row of the node or block, or number of the special primitive.
    #[inline(always)]
    pub(super) fn number(self) -> usize {
        (self.0 & Self::NUMBER) as usize
    }

    /// Of a triangle leaf.
    #[inline(always)]
    pub(super) fn is_wide(self) -> bool {
        self.0 & Self::WIDE_BLOCK != 0
    }
}

/// Number of an absent triangle.
pub(super) const ABSENT: u32 = u32::MAX;
/// Pieces of a block.
const PIECES: usize = 10;
/// The piece with the triangles' numbers.
const IDS: usize = 9;

/// Up to `N` triangles, coordinate by coordinate: nine pieces, `3·vertex + axis`, with one number
/// per triangle, and a tenth with the bits of each triangle's number in its tree. Absent triangles
/// have the number [`ABSENT`] and vertices of NaN, which no ray meets.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct LeafBlock<'a, const N: usize>(&'a [[f32; N]; PIECES]);

impl<'a, const N: usize> LeafBlock<'a, N> {
    /// One coordinate of one vertex of all triangles.
    #[inline(always)]
    pub(super) fn coordinates(self, vertex: usize, axis: usize) -> &'a [f32; N] {
        &self.0[3 * vertex + (axis & 3)]
    }

    /// Number of the triangle in a column.
    #[inline(always)]
    pub(super) fn id(self, column: usize) -> u32 {
        self.0[IDS][column].to_bits()
    }
}

/// Rows of a block of so many triangles.
pub(super) fn block_rows(triangles: usize) -> usize {
    if triangles > NARROW { WIDE_ROWS } else { NARROW_ROWS }
}

/// Makes the rows of a block.
pub(super) fn write_block(rows: &mut [Row], triangles: &[(u32, [Vec3; 3])]) {
    let width = if triangles.len() > NARROW { WIDE } else { NARROW };
    rows[..block_rows(triangles.len())].fill(Row([f32::NAN; 8]));
    let mut set = |piece: usize, column: usize, x: f32| {
        let at = piece * width + column;
        rows[at / 8].0[at % 8] = x;
    };
    for column in 0..width {
        let Some(&(id, vertices)) = triangles.get(column) else {
            set(IDS, column, f32::from_bits(ABSENT));
            continue;
        };
        for (vertex, p) in vertices.into_iter().enumerate() {
            for axis in 0..3 {
                set(3 * vertex + axis, column, p[axis]);
            }
        }
        set(IDS, column, f32::from_bits(id));
    }
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
    /// Nodes and blocks; first the root, which is always there.
    pub(super) rows: Arena,
    /// What is not a triangle.
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
pub(super) const DIRECTORY_STEP: u32 = 8;

impl Tree {
    /// The inner node that begins at a row.
    #[inline(always)]
    pub(super) fn node(&self, row: usize) -> WideNode<'_> {
        WideNode(self.rows[row..].first_chunk().expect("children name whole nodes"))
    }

    /// The narrow block that begins at a row.
    #[inline(always)]
    pub(super) fn narrow_block(&self, row: usize) -> LeafBlock<'_, NARROW> {
        let rows = self.rows[row..].first_chunk::<NARROW_ROWS>();
        LeafBlock(arena::cut(rows.expect("children name whole blocks")))
    }

    /// The wide block that begins at a row.
    #[inline(always)]
    pub(super) fn wide_block(&self, row: usize) -> LeafBlock<'_, WIDE> {
        let rows = self.rows[row..].first_chunk::<WIDE_ROWS>();
        LeafBlock(arena::cut(rows.expect("children name whole blocks")))
    }

    /// Begins to bring what stands under a child closer.
    #[inline(always)]
    pub(super) fn prefetch<S: Simd>(&self, child: Child) {
        S::prefetch(&self.rows, child.number());
    }

    /// Shape and triangle within the shape of a primitive number.
    #[inline]
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
        self.rows.len() * size_of::<Row>()
            + self.specials.capacity() * size_of::<Special>()
            + self.ranges.capacity() * size_of::<ShapeRange>()
            + self.directory.capacity() * size_of::<u32>()
    }
}
