//! `spot`: a point that shines into a cone.
//!
//! Constant up to `beam_width`, from there linear in the angle down to 0 at `cutoff_angle`. A
//! texture is projected along the axis; its unit square spans the cutoff cone.

use super::tree::Extent;
use crate::math::{Bounds3, Transform, Vec2, Vec3};
use crate::spectrum::Rgb;
use crate::texture::TextureId;

/// A spot light with what depends on its angles alone.
#[derive(Debug, Clone)]
pub(super) struct Spot {
    pub(super) position: Vec3,
    pub(super) intensity: Rgb,
    pub(super) texture: Option<TextureId>,
    to_world: Transform,
    axis: Vec3,
    cutoff_angle: f32,
    cos_cutoff: f32,
    cos_beam: f32,
    /// One over the angle from beam to cutoff.
    per_transition: f32,
    /// One over the tangent of the cutoff angle.
    per_tangent: f32,
}

impl Spot {
    pub(super) fn new(
        to_world: &Transform,
        intensity: Rgb,
        cutoff_angle: f32,
        beam_width: f32,
        texture: Option<TextureId>,
    ) -> Self {
        Self {
            position: to_world.point(Vec3::ZERO),
            intensity,
            texture,
            to_world: *to_world,
            axis: to_world.vector(Vec3::Z).normalize_or(Vec3::Z),
            cutoff_angle,
            cos_cutoff: cutoff_angle.cos(),
            cos_beam: beam_width.cos(),
            per_transition: 1.0 / (cutoff_angle - beam_width),
            per_tangent: 1.0 / cutoff_angle.tan(),
        }
    }

    /// Share of the intensity that leaves in the unit direction `d` (world space), and where in
    /// the texture that is; `None` outside of the cone.
    pub(super) fn falloff(&self, d: Vec3) -> Option<(f32, Vec2)> {
        let local = self.to_world.inverse_vector(d).normalize_or_zero();
        let cos = local.z;
        if cos <= self.cos_cutoff {
            return None;
        }
        let share = if cos >= self.cos_beam {
            1.0
        } else {
            (self.cutoff_angle - cos.min(1.0).acos()) * self.per_transition
        };
        let uv = 0.5 + 0.5 * local.truncate() / local.z * self.per_tangent;
        (share > 0.0).then_some((share, uv))
    }

    pub(super) fn extent(&self) -> Extent {
        let bounds = Bounds3 { min: self.position, max: self.position };
        Extent { bounds, axis: self.axis, cos_normals: 1.0, cos_emission: self.cos_cutoff }
    }
}
