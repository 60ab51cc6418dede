//! Shapes: triangle meshes, spheres, disks, cylinders, rectangles, and instances of groups.
//!
//! What a ray does to them is divided between [`crate::accel`], which finds the hit, and
//! [`ShapeTable::interaction`], which says all about the surface there.

mod area;
mod bounds;
mod interaction;
mod quadric;

#[cfg(test)]
mod tests;

use crate::bsdf::BsdfId;
use crate::emitter::EmitterId;
use crate::math::{Transform, Vec2, Vec3};
pub(crate) use bounds::transformed_bounds;
pub(crate) use quadric::intersect_quadric;

macro_rules! id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(transparent)]
        pub struct $name(pub u32);
    };
}
id!(
    /// Index of a [`Shape`] in a [`ShapeTable`].
    ShapeId
);
id!(
    /// Index of a [`Mesh`] in a [`ShapeTable`].
    MeshId
);
id!(
    /// Index of a [`ShapeGroup`] in a [`ShapeTable`].
    GroupId
);
id!(
    /// Index of an [`Instance`] in a [`ShapeTable`].
    InstanceId
);

/// One object of the scene: a surface with a material and perhaps an emitter.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// Its geometry.
    pub kind: ShapeKind,
    /// Its material.
    pub bsdf: BsdfId,
    /// Its emitter, if it shines. Never set for shapes of a group.
    pub emitter: Option<EmitterId>,
    /// Turn both geometric and shading normals around.
    pub flip_normals: bool,
}

/// Geometry of a shape.
#[derive(Debug, Clone, PartialEq)]
pub enum ShapeKind {
    /// A triangle mesh (`obj`, `ply`, `serialized`, `cube`), vertices in world space (or in the
    /// space of its group).
    Mesh(MeshId),
    /// [-1, 1]² in the local z = 0 plane, normal +z, uv = (xy + 1)/2.
    Rectangle(Transform),
    /// Unit circle in the local z = 0 plane, normal +z; u = radius, v = angle/2π.
    Disk(Transform),
    /// Unit sphere around the local origin; an ellipsoid when the transform is not uniform.
    Sphere(Transform),
    /// Local radius 1 around z, z from 0 to 1, open at both ends; normals outward.
    Cylinder(Transform),
}

/// Values stored with a mesh beyond positions, normals and uv.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshAttribute {
    /// Name as in the scene file: `vertex_…` or `face_…`.
    pub name: String,
    /// Per face instead of per vertex.
    pub per_face: bool,
    /// Values per vertex or face: 1 or 3.
    pub channels: usize,
    /// The values.
    pub data: Vec<f32>,
}

/// A triangle mesh in world space (or in the space of its group).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Unit vertex normals, one per position, or empty: then triangles are flat.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, one per position, or empty: then uv are the barycentrics.
    pub uvs: Vec<Vec2>,
    /// Vertex indices per triangle; every index < `positions.len()`.
    pub triangles: Vec<[u32; 3]>,
    /// Further values.
    pub attributes: Vec<MeshAttribute>,
}

/// Shapes that are not in the world themselves but are placed by [`Instance`]s.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ShapeGroup {
    /// The shapes of the group, in the group's space.
    pub shapes: Vec<ShapeId>,
}

/// One placement of a group.
#[derive(Debug, Clone, PartialEq)]
pub struct Instance {
    /// What is placed.
    pub group: GroupId,
    /// Group space → world.
    pub transform: Transform,
}

/// All geometry of a scene.
#[derive(Debug, Clone, Default)]
pub struct ShapeTable {
    /// All shapes, those of groups included.
    pub shapes: Vec<Shape>,
    /// Mesh data.
    pub meshes: Vec<Mesh>,
    /// Groups.
    pub groups: Vec<ShapeGroup>,
    /// Placements of groups.
    pub instances: Vec<Instance>,
}
