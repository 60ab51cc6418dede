//! The primitives of a tree and their boxes.

use super::super::AccelError;
use super::super::node::{ShapeRange, Special};
use crate::math::{Bounds3, Vec3, Vec3A, Vec4};
use crate::shape::{InstanceId, ShapeId, ShapeKind, ShapeTable};
use rayon::prelude::*;

/// Box and number of a primitive. 32 bytes.
#[derive(Debug, Clone, Copy)]
pub(super) struct PrimitiveRef {
    /// Smallest corner, and the bits of the number.
    min: Vec4,
    /// Largest corner.
    max: Vec4,
}

impl PrimitiveRef {
    pub(super) fn new(bounds: Bounds3, id: u32) -> Option<Self> {
        // The builder adds corners and multiplies extents: leave room for that.
        const LARGEST: Vec3 = Vec3::splat(f32::MAX / 4.0);
        let usable = bounds.min.abs().cmplt(LARGEST).all()
            && bounds.max.abs().cmplt(LARGEST).all()
            && !bounds.is_empty();
        let (min, max) = (bounds.min.extend(f32::from_bits(id)), bounds.max.extend(0.0));
        usable.then_some(Self { min, max })
    }

    /// Number in the tree: triangles first, then special primitives.
    pub(super) fn id(&self) -> u32 {
        self.min.w.to_bits()
    }

    pub(super) fn min(&self) -> Vec3A {
        Vec3A::from_vec4(self.min)
    }

    pub(super) fn max(&self) -> Vec3A {
        Vec3A::from_vec4(self.max)
    }

    /// Twice the centre of the box.
    pub(super) fn center2(&self) -> Vec3A {
        self.min() + self.max()
    }
}

/// The primitives of a tree.
pub(super) struct Collected {
    pub(super) refs: Vec<PrimitiveRef>,
    pub(super) ranges: Vec<ShapeRange>,
    pub(super) specials: Vec<Special>,
    pub(super) triangle_count: u32,
}

pub(super) fn collect(
    shapes: &ShapeTable,
    ids: &[ShapeId],
    instances: &[(InstanceId, Bounds3)],
) -> Result<Collected, AccelError> {
    let (ranges, triangle_count) = number_triangles(shapes, ids)?;
    let mut refs: Vec<PrimitiveRef> = Vec::with_capacity(triangle_count as usize);
    for range in &ranges {
        let count = triangles_in(shapes, range.shape) as u32;
        refs.par_extend((0..count).into_par_iter().filter_map(|i| {
            let [a, b, c] = triangle(shapes, range.shape, i);
            let bounds = Bounds3 { min: a.min(b).min(c), max: a.max(b).max(c) };
            // `min` and `max` pass over NaN, so look at the vertices themselves.
            let finite = a.is_finite() && b.is_finite() && c.is_finite();
            finite.then(|| PrimitiveRef::new(bounds, range.first + i)).flatten()
        }));
    }
    let mut specials = Vec::new();
    let quadrics = ids.iter().filter(|&&id| triangles_in(shapes, id) == 0).filter_map(|&id| {
        let is_mesh = matches!(shapes.shapes[id.0 as usize].kind, ShapeKind::Mesh(_));
        (!is_mesh).then(|| (Special::Shape(id), shapes.shape_bounds(id)))
    });
    let placed = instances.iter().map(|&(id, bounds)| (Special::Instance(id), bounds));
    for (special, bounds) in quadrics.chain(placed) {
        let number = u32::try_from(specials.len()).unwrap_or(u32::MAX);
        let id = triangle_count
            .checked_add(number)
            .ok_or(AccelError::TooManyPrimitives(u64::from(triangle_count)))?;
        refs.extend(PrimitiveRef::new(bounds, id));
        specials.push(special);
    }
    Ok(Collected { refs, ranges, specials, triangle_count })
}

fn number_triangles(
    shapes: &ShapeTable,
    ids: &[ShapeId],
) -> Result<(Vec<ShapeRange>, u32), AccelError> {
    let mut ranges = Vec::new();
    let mut first = 0_u64;
    for &shape in ids {
        let count = triangles_in(shapes, shape) as u64;
        if count > 0 {
            ranges.push(ShapeRange { first: first as u32, shape });
            first += count;
        }
        if first > u64::from(u32::MAX / 2) {
            return Err(AccelError::TooManyPrimitives(first));
        }
    }
    Ok((ranges, first as u32))
}

/// Triangles that a shape contributes.
pub(in super::super) fn triangles_in(shapes: &ShapeTable, id: ShapeId) -> usize {
    match shapes.shapes[id.0 as usize].kind {
        ShapeKind::Mesh(mesh) => shapes.meshes[mesh.0 as usize].triangles.len(),
        ShapeKind::Rectangle(_) => 2,
        ShapeKind::Disk(_) | ShapeKind::Sphere(_) | ShapeKind::Cylinder(_) => 0,
    }
}

/// Vertices of triangle `i` of a mesh or rectangle.
pub(in super::super) fn triangle(shapes: &ShapeTable, id: ShapeId, i: u32) -> [Vec3; 3] {
    match &shapes.shapes[id.0 as usize].kind {
        ShapeKind::Mesh(mesh) => {
            let mesh = &shapes.meshes[mesh.0 as usize];
            mesh.triangles[i as usize].map(|v| mesh.positions[v as usize])
        }
        ShapeKind::Rectangle(transform) => {
            let corner = |x, y| transform.point(Vec3::new(x, y, 0.0));
            let (c00, c11) = (corner(-1.0, -1.0), corner(1.0, 1.0));
            match i {
                0 => [c00, corner(1.0, -1.0), c11],
                _ => [c00, c11, corner(-1.0, 1.0)],
            }
        }
        _ => unreachable!("only meshes and rectangles are made of triangles"),
    }
}
