use super::{Affine3A, DAffine3, Ray, Vec3};

/// An invertible affine map with its inverse. Composed in `f64` while a scene is read and
/// narrowed once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transform {
    /// Local → world.
    pub to_world: Affine3A,
    /// World → local.
    pub to_local: Affine3A,
}

impl Transform {
    /// The identity.
    pub const IDENTITY: Self = Self { to_world: Affine3A::IDENTITY, to_local: Affine3A::IDENTITY };

    /// From a local → world map; `None` when it is singular or not finite.
    pub fn new(to_world: DAffine3) -> Option<Self> {
        if !to_world.is_finite() || to_world.matrix3.determinant() == 0.0 {
            return None;
        }
        let inverse = to_world.inverse();
        let narrow = Self { to_world: to_world.as_affine3a(), to_local: inverse.as_affine3a() };
        (narrow.to_world.is_finite() && narrow.to_local.is_finite()).then_some(narrow)
    }

    /// Point, local → world.
    pub fn point(&self, p: Vec3) -> Vec3 {
        self.to_world.transform_point3(p)
    }

    /// Vector, local → world.
    pub fn vector(&self, v: Vec3) -> Vec3 {
        self.to_world.transform_vector3(v)
    }

    /// Normal, local → world by the inverse transpose; not normalised.
    pub fn normal(&self, n: Vec3) -> Vec3 {
        (self.to_local.matrix3.transpose() * glam::Vec3A::from(n)).into()
    }

    /// Point, world → local.
    pub fn inverse_point(&self, p: Vec3) -> Vec3 {
        self.to_local.transform_point3(p)
    }

    /// Vector, world → local.
    pub fn inverse_vector(&self, v: Vec3) -> Vec3 {
        self.to_local.transform_vector3(v)
    }

    /// Ray, world → local. The direction is not normalised, so that `t` means the same in both
    /// spaces.
    pub fn inverse_ray(&self, r: &Ray) -> Ray {
        Ray { o: self.inverse_point(r.o), d: self.inverse_vector(r.d), t_max: r.t_max }
    }

    /// True when the map mirrors (negative determinant).
    pub fn is_mirroring(&self) -> bool {
        self.to_world.matrix3.determinant() < 0.0
    }
}
