//! Disks (and ellipses): by area from afar; near a circular one by the solid angle of the square
//! around it, where a fifth of the samples miss.

use super::spherical_rectangle::SphericalRectangle;
use super::{Extent, ROUNDING, SurfaceSample, area_to_solid_angle, by_area};
use crate::math::warp::concentric_disk;
use crate::math::{Bounds3, Transform, Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// A disk is near when its squared radius exceeds this share of the squared distance to its
/// centre: more than for rectangles, since samples are lost.
const NEAR: f32 = 1.0;

/// A disk that shines.
#[derive(Debug, Clone)]
pub(in crate::emitter) struct Disk {
    center: Vec3,
    /// From the centre to the rim along the local x and y.
    axes: [Vec3; 2],
    /// Unit normal on the emitting side.
    n: Vec3,
    area: f32,
    bounds: Bounds3,
    /// The axes are at right angles.
    is_straight: bool,
    radius2: f32,
}

impl Disk {
    /// The shape `disk` under `transform`, `None` when it has no area.
    pub(in crate::emitter) fn new(
        transform: &Transform,
        bounds: Bounds3,
        flip: bool,
    ) -> Option<Self> {
        let axes = [transform.vector(Vec3::X), transform.vector(Vec3::Y)];
        let n = transform.normal(Vec3::Z).normalize_or_zero();
        let area = PI * axes[0].cross(axes[1]).length();
        let lengths = axes.map(Vec3::length);
        let usable = area > 0.0 && area.is_finite() && n != Vec3::ZERO;
        usable.then_some(Self {
            center: transform.point(Vec3::ZERO),
            axes,
            n: if flip { -n } else { n },
            area,
            bounds,
            is_straight: axes[0].dot(axes[1]).abs() <= 1e-6 * lengths[0] * lengths[1],
            radius2: lengths[0].max(lengths[1]).powi(2),
        })
    }

    pub(super) fn sample(&self, from: Vec3, u: Vec2) -> Option<SurfaceSample> {
        let Some(square) = self.square(from) else {
            let local = concentric_disk(u);
            let sample = by_area(from, self.at(local), self.n, 1.0 / self.area, false)?;
            return Some(SurfaceSample { uv: polar_uv(local), ..sample });
        };
        let (wi, place) = square.sample(u);
        let local = place * 2.0 - 1.0;
        let p = self.at(local);
        (local.length_squared() <= 1.0).then_some(SurfaceSample {
            p,
            n: self.n,
            wi,
            distance: (p - from).length(),
            pdf: square.pdf(),
            uv: polar_uv(local),
            error: ROUNDING * p.abs().max_element(),
        })
    }

    pub(super) fn pdf(&self, from: Vec3, wi: Vec3, p: Vec3) -> f32 {
        match self.square(from) {
            Some(square) => square.pdf(),
            None if wi.dot(self.n) >= 0.0 => 0.0,
            None => area_to_solid_angle(1.0 / self.area, from, wi, p, self.n),
        }
    }

    /// The square around the disk, where sampling its solid angle is worth it.
    fn square(&self, from: Vec3) -> Option<SphericalRectangle> {
        let to_center = self.center - from;
        let near = self.radius2 > NEAR * to_center.length_squared();
        if !(near && self.is_straight && to_center.dot(self.n) < 0.0) {
            return None;
        }
        let corner = to_center - self.axes[0] - self.axes[1];
        SphericalRectangle::new(corner, self.axes.map(|a| 2.0 * a))
    }

    fn at(&self, local: Vec2) -> Vec3 {
        self.center + (self.axes[0] * local.x + self.axes[1] * local.y)
    }

    pub(super) fn area(&self) -> f32 {
        self.area
    }

    pub(super) fn extent(&self) -> Extent {
        Extent { bounds: self.bounds, axis: self.n, cos_normals: 1.0, cos_emission: 0.0 }
    }
}

/// Texture coordinates: radius and turn.
fn polar_uv(local: Vec2) -> Vec2 {
    let turn = local.y.atan2(local.x) / TAU;
    Vec2::new(local.length(), if turn < 0.0 { turn + 1.0 } else { turn })
}
