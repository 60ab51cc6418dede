//! What the cache stores.

use crate::math::{Bounds3, Vec2, Vec3};
use crate::spectrum::Rgb;

/// Irradiance at a point, how it changes nearby, and how far that can be relied on. World space.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Record {
    /// Identifies the record independently of when and by whom it was computed.
    pub key: u64,
    /// Where.
    pub position: Vec3,
    /// Unit surface normal there, smooth, on the side of the viewer.
    pub normal: Vec3,
    /// Unit tangent along which the record reaches least far.
    pub axis: Vec3,
    /// Irradiance, W·m⁻².
    pub irradiance: Rgb,
    /// Translational gradient per channel, tangential, W·m⁻³.
    pub translational: [Vec3; 3],
    /// Rotational gradient per channel, tangential, W·m⁻²·rad⁻¹: for a normal n irradiance is
    /// `E + (normal × n) · rotational`.
    pub rotational: [Vec3; 3],
    /// How far the record can be used along `axis` and across it, scene units, bounds applied; the
    /// first is the smaller one.
    pub radii: [f32; 2],
    /// Largest angle between its normal and one that it may serve, radians.
    pub max_angle: f32,
    /// Harmonic mean of the distances to what it sees, scene units; infinite if nothing.
    pub harmonic_mean_distance: f32,
    /// The first radius before bounds, scene units.
    pub natural_radius: f32,
    /// Sum of [`Record::RAISED`] and so on.
    pub flags: u32,
    /// Sectors of azimuth about `axis` in which something near stands close to the surface, one bit
    /// each: see [`Record::sight_of`].
    pub corral: u32,
    /// Nearer points see the record all the same, scene units.
    pub corral_distance: f32,
}

impl Record {
    /// Flag: the radius was raised to the lower bound.
    pub const RAISED: u32 = 1;
    /// Flag: the radius was lowered to the upper bound.
    pub const LOWERED: u32 = 2;
    /// Flag: the radius was limited so that the linear model stays positive.
    pub const GRADIENT_LIMITED: u32 = 4;
    /// Flag: the axis ratio was limited.
    pub const RATIO_LIMITED: u32 = 8;
    /// Flag: a crevice record, kept from spreading over the lower bound of the radius.
    pub const CREVICE: u32 = 16;
    /// Flag: the radius was limited by a neighbour's.
    pub const NEIGHBOUR_LIMITED: u32 = 32;

    /// The box of all points that the record may serve with its radii times `factor`, when it
    /// reaches `thickness` times its first radius along its normal. Widened by more than rounding.
    pub fn support(&self, factor: f32, thickness: f32) -> Bounds3 {
        let across = self.normal.cross(self.axis);
        let [short, long] = self.radii;
        let part = |v: Vec3, r: f32| (v * r) * (v * r);
        let squares =
            part(self.axis, short) + part(across, long) + part(self.normal, thickness * short);
        let root = squares.map(f32::sqrt) * factor;
        let slack = 8.0 * f32::EPSILON * (self.position.abs() + root);
        let half = root * (1.0 + 1.0 / 1024.0) + slack;
        Bounds3 { min: self.position - half, max: self.position + half }
    }

    /// True when no number of it is NaN and its radii are positive: what can be stored.
    pub fn is_valid(&self) -> bool {
        let vectors = [self.position, self.normal, self.axis];
        let vectors = vectors.iter().chain(&self.translational).chain(&self.rotational);
        let [short, long] = self.radii;
        vectors.into_iter().all(|v| v.is_finite())
            && self.irradiance.is_finite()
            && short > 0.0
            && long >= short
            && long.is_finite()
            && self.max_angle >= 0.0
            && !self.harmonic_mean_distance.is_nan()
            && !self.natural_radius.is_nan()
            && !self.corral_distance.is_nan()
    }
}

/// Local, tangential vectors in the world, for the tangents `s` and `t` of the record's frame.
pub(super) fn to_world(local: &[Vec2; 3], s: Vec3, t: Vec3) -> [Vec3; 3] {
    local.map(|v| s * v.x + t * v.y)
}
