//! Boxes around shapes.

use super::{ShapeId, ShapeKind, ShapeTable};
use crate::math::{Bounds3, DAffine3, DVec3, Transform, Vec3};

/// Boxes of analytic shapes and instances are widened by this times the numbers that went into
/// them, more than a transform's entries, rounded to `f32`, can be wrong.
const ROUNDING: f64 = 8.0 * f32::EPSILON as f64;

impl ShapeTable {
    /// The box of a shape, in the world (or in the space of its group); empty for a mesh without
    /// triangles.
    pub fn shape_bounds(&self, id: ShapeId) -> Bounds3 {
        match &self.shapes[id.0 as usize].kind {
            ShapeKind::Mesh(mesh) => {
                let mesh = &self.meshes[mesh.0 as usize];
                let vertices = mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize]);
                vertices.fold(Bounds3::EMPTY, Bounds3::including)
            }
            ShapeKind::Rectangle(transform) => {
                let corner = |x, y| transform.point(Vec3::new(x, y, 0.0));
                [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]
                    .into_iter()
                    .fold(Bounds3::EMPTY, Bounds3::including)
            }
            ShapeKind::Disk(transform) => disk(transform, 0.0),
            ShapeKind::Cylinder(transform) => disk(transform, 0.0).union(disk(transform, 1.0)),
            ShapeKind::Sphere(transform) => {
                let m = transform.to_world.as_daffine3();
                // The extent along a world axis is the length of that row of the matrix.
                let [x, y, z] = [m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis];
                let half = (x * x + y * y + z * z).map(f64::sqrt);
                widened(transform, m.translation, half)
            }
        }
    }
}

/// Box of the circle of radius 1 at local height z.
fn disk(transform: &Transform, z: f64) -> Bounds3 {
    let m = transform.to_world.as_daffine3();
    let (x, y) = (m.matrix3.x_axis, m.matrix3.y_axis);
    let half = (x * x + y * y).map(f64::sqrt);
    widened(transform, m.transform_point3(DVec3::new(0.0, 0.0, z)), half)
}

/// The box of a mapped box; empty for an empty one.
pub(crate) fn transformed_bounds(transform: &Transform, local: Bounds3) -> Bounds3 {
    if local.is_empty() {
        return Bounds3::EMPTY;
    }
    let m = transform.to_world.as_daffine3();
    let (min, max) = (local.min.as_dvec3(), local.max.as_dvec3());
    let half = absolute(&m).transform_vector3(0.5 * (max - min));
    let size = absolute(&m).transform_vector3(min.abs().max(max.abs()));
    let bounds = widened(transform, m.transform_point3(0.5 * (min + max)), half);
    let more = (ROUNDING * size).as_vec3();
    Bounds3 { min: bounds.min - more, max: bounds.max + more }
}

/// All entries positive: the size of the numbers that a transformation adds up.
pub(super) fn absolute(m: &DAffine3) -> DAffine3 {
    DAffine3 {
        matrix3: crate::math::DMat3::from_cols(
            m.matrix3.x_axis.abs(),
            m.matrix3.y_axis.abs(),
            m.matrix3.z_axis.abs(),
        ),
        translation: m.translation.abs(),
    }
}

/// The box around `center`, larger by what rounding does between world and local space.
fn widened(transform: &Transform, center: DVec3, half: DVec3) -> Bounds3 {
    let to_local = absolute(&transform.to_local.as_daffine3());
    let to_world = absolute(&transform.to_world.as_daffine3());
    let size = center.abs() + half;
    let there_and_back = to_world.transform_vector3(to_local.transform_point3(size));
    let half = half + ROUNDING * (size + there_and_back);
    Bounds3 { min: (center - half).as_vec3(), max: (center + half).as_vec3() }
}
