//! Vectors, rays, frames and transforms; nothing here knows about light.

pub mod directions;
pub mod distribution;
mod frame;
mod ray;
pub mod special;
pub mod statistics;
mod transform;
pub mod warp;

pub use frame::Frame;
pub use glam::{
    Affine3A, DAffine3, DMat3, DMat4, DQuat, DVec2, DVec3, Mat3, Mat3A, Mat4, Vec2, Vec3, Vec3A,
    Vec3Swizzles, Vec4,
};
pub use ray::Ray;
pub use transform::Transform;

/// The signed axis nearest to `n`: 0 to 5 for +x, -x, +y, -y, +z, -z.
pub fn facing(n: Vec3) -> u8 {
    let a = n.abs();
    let axis = if a.x >= a.y && a.x >= a.z {
        0
    } else if a.y >= a.z {
        1
    } else {
        2
    };
    2 * axis + u8::from(n[axis as usize] < 0.0)
}

/// An axis-aligned box, world or local space. Empty when `min > max` on some axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds3 {
    /// Smallest corner.
    pub min: Vec3,
    /// Largest corner.
    pub max: Vec3,
}

impl Bounds3 {
    /// The empty box: the neutral element of [`Bounds3::union`].
    pub const EMPTY: Self =
        Self { min: Vec3::splat(f32::INFINITY), max: Vec3::splat(f32::NEG_INFINITY) };

    /// The smallest box that holds both.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The smallest box that holds this one and the point `p`.
    pub fn including(self, p: Vec3) -> Self {
        Self { min: self.min.min(p), max: self.max.max(p) }
    }

    /// True when the box holds no point.
    pub fn is_empty(self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// The middle of the box.
    pub fn center(self) -> Vec3 {
        0.5 * self.min + 0.5 * self.max
    }

    /// Edge lengths; negative where empty.
    pub fn extent(self) -> Vec3 {
        self.max - self.min
    }

    /// Half of the surface area, the quantity of the surface area heuristic; 0 when empty.
    pub fn half_area(self) -> f32 {
        let e = self.extent().max(Vec3::ZERO);
        e.x * e.y + e.y * e.z + e.z * e.x
    }
}
