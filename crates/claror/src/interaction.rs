//! What is known about a point where a ray met a surface.

use crate::math::{Frame, Ray, Vec2, Vec3};
use crate::shape::{InstanceId, ShapeId};

/// A point on a surface, world space.
#[derive(Debug, Clone, Copy)]
pub struct SurfaceInteraction {
    /// The point, computed on the surface itself (barycentrics, not `o + t·d`).
    pub p: Vec3,
    /// How far along the geometric normal a ray must start so that it cannot meet this very
    /// surface again: a bound of the rounding error of `p` with a margin, world units.
    pub offset: f32,
    /// Unit geometric normal as the shape defines it (not turned towards the viewer).
    pub ng: Vec3,
    /// Shading frame: `n` interpolated, `s` along dp/du; arbitrary tangents where there are no
    /// derivatives.
    pub frame: Frame,
    /// Texture coordinates; barycentrics or zero where they were not asked for.
    pub uv: Vec2,
    /// Derivatives by the texture coordinates, where they were asked for (see [`Detail`]).
    pub derivatives: Option<SurfaceDerivatives>,
    /// Unit direction towards where the ray came from, world space.
    pub wo: Vec3,
    /// Distance along the ray.
    pub t: f32,
    /// The shape.
    pub shape: ShapeId,
    /// Triangle of a mesh; 0 otherwise.
    pub primitive: u32,
    /// Barycentrics (of vertices 1 and 2) on the triangle of a mesh; 0 otherwise.
    pub barycentric: Vec2,
    /// The instance, if the shape belongs to a group.
    pub instance: Option<InstanceId>,
}

/// How a surface changes with its texture coordinates, world space.
#[derive(Debug, Clone, Copy)]
pub struct SurfaceDerivatives {
    /// dp/du.
    pub dp_du: Vec3,
    /// dp/dv.
    pub dp_dv: Vec3,
    /// Derivative of the shading normal by u.
    pub dn_du: Vec3,
    /// Derivative of the shading normal by v.
    pub dn_dv: Vec3,
}

/// How much to find out about a point: each level includes those before it. Most materials need
/// little.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Detail {
    /// Place and normals.
    Point,
    /// Texture coordinates.
    Uv,
    /// Everything.
    Derivatives,
}

impl SurfaceInteraction {
    /// The origin of a ray that leaves in direction `d` (world space): `p` moved by `offset` to
    /// that side of the geometric surface where `d` goes.
    pub fn spawn_origin(&self, d: Vec3) -> Vec3 {
        self.p + self.ng * self.offset.copysign(d.dot(self.ng))
    }

    /// An open ray that leaves in the unit direction `d`, world space.
    pub fn spawn_ray(&self, d: Vec3) -> Ray {
        Ray::new(self.spawn_origin(d), d)
    }
}
