use super::Vec3;

/// A ray segment `o + t·d` with `t ∈ [0, t_max]`. There is no minimal distance: origins on
/// surfaces are offset beforehand (see [`crate::interaction::SurfaceInteraction::spawn_ray`]).
#[derive(Debug, Clone, Copy)]
pub struct Ray {
    /// Origin, world space.
    pub o: Vec3,
    /// Direction, unit length unless said otherwise.
    pub d: Vec3,
    /// Largest `t` at which something counts as hit; infinite for an open ray.
    pub t_max: f32,
}

impl Ray {
    /// An open ray.
    pub fn new(o: Vec3, d: Vec3) -> Self {
        Self { o, d, t_max: f32::INFINITY }
    }

    /// The point at parameter `t`.
    pub fn at(&self, t: f32) -> Vec3 {
        self.o + t * self.d
    }
}
