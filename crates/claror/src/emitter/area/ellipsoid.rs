//! Spheres and ellipsoids: from outside by the cone of directions that meets them, from inside
//! by area.
//!
//! Everything happens in the local space, where the ellipsoid is the unit sphere. Directions there
//! and in the world are related by the map `ω ↦ Mω / |Mω|`, whose Jacobian is `|det M| / |Mω|³`
//! for a unit vector ω; for a sphere that is 1, and the sampling is uniform in solid angle.

use super::{Extent, ROUNDING, SurfaceSample};
use crate::math::warp::{around, uniform_cone, uniform_cone_pdf, uniform_sphere};
use crate::math::{Bounds3, Transform, Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, TAU};

/// Reference points whose squared local distance from the centre is below this are inside or on
/// the surface.
const OUTSIDE2: f32 = 1.0 + 1e-4;

/// Density of a uniform point on the unit sphere by area.
const UNIFORM_PDF: f32 = 0.25 * FRAC_1_PI;

/// An ellipsoid that shines outwards or inwards.
#[derive(Debug, Clone)]
pub(in crate::emitter) struct Ellipsoid {
    transform: Transform,
    bounds: Bounds3,
    area: f32,
    inwards: bool,
    determinant: f32,
}

impl Ellipsoid {
    /// The shape `sphere` under `transform` with its bounds and area.
    pub(in crate::emitter) fn new(
        transform: &Transform,
        bounds: Bounds3,
        area: f32,
        inwards: bool,
    ) -> Self {
        let determinant = transform.to_world.matrix3.determinant().abs();
        Self { transform: *transform, bounds, area, inwards, determinant }
    }

    /// Centre and radius where it is a sphere that shines outwards.
    pub(in crate::emitter) fn outer_sphere(&self) -> Option<(Vec3, f32)> {
        let m = self.transform.to_world.matrix3;
        let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(|axis| Vec3::from(axis).length());
        let skew = Vec3::from(m.x_axis).dot(m.y_axis.into()).abs()
            + Vec3::from(m.y_axis).dot(m.z_axis.into()).abs()
            + Vec3::from(m.z_axis).dot(m.x_axis.into()).abs();
        let is_sphere = (x - y).abs() + (y - z).abs() < 1e-5 * x && skew < 1e-5 * x * x;
        (is_sphere && !self.inwards).then(|| (self.transform.point(Vec3::ZERO), x))
    }

    pub(super) fn sample(&self, from: Vec3, u: Vec2) -> Option<SurfaceSample> {
        let q = self.transform.inverse_point(from);
        let distance2 = q.length_squared();
        let (local, direction, pdf) = if distance2 > OUTSIDE2 {
            if self.inwards {
                return None;
            }
            from_outside(q, distance2, u)
        } else if self.inwards {
            from_inside(q, u)?
        } else {
            return None;
        };
        let p = self.transform.point(local);
        let towards = self.transform.vector(direction);
        let length = towards.length();
        let n = self.transform.normal(local).normalize_or_zero();
        Some(SurfaceSample {
            p,
            n: if self.inwards { -n } else { n },
            wi: towards / length,
            distance: (p - from).length(),
            pdf: pdf * self.jacobian(length),
            uv: spherical_uv(local),
            // The sum of what makes up the point; the local point itself is not exact either.
            error: 2.0 * ROUNDING * (p.abs() + (self.bounds.max - self.bounds.min)).max_element(),
        })
    }

    pub(super) fn pdf(&self, from: Vec3, wi: Vec3, p: Vec3) -> f32 {
        let q = self.transform.inverse_point(from);
        let distance2 = q.length_squared();
        let local_wi = self.transform.inverse_vector(wi);
        // |Mω| for the unit vector ω along it.
        let length = 1.0 / local_wi.length();
        let pdf = if distance2 > OUTSIDE2 {
            if self.inwards { 0.0 } else { uniform_cone_pdf(one_minus_cos(distance2)) }
        } else if self.inwards {
            inside_pdf(q, self.transform.inverse_point(p), local_wi * length)
        } else {
            0.0
        };
        pdf * self.jacobian(length)
    }

    /// Density by solid angle in the world over that in the local space.
    fn jacobian(&self, length: f32) -> f32 {
        length * length * length / self.determinant
    }

    pub(super) fn area(&self) -> f32 {
        self.area
    }

    pub(super) fn extent(&self) -> Extent {
        Extent { bounds: self.bounds, axis: Vec3::Z, cos_normals: -1.0, cos_emission: 0.0 }
    }
}

/// 1 − cos of the half angle under which the unit sphere is seen from outside.
fn one_minus_cos(distance2: f32) -> f32 {
    let sin2 = 1.0 / distance2;
    sin2 / (1.0 + (1.0 - sin2).max(0.0).sqrt())
}

/// A point of the unit sphere as seen from `q`, the direction to it and its density.
fn from_outside(q: Vec3, distance2: f32, u: Vec2) -> (Vec3, Vec3, f32) {
    let distance = distance2.sqrt();
    let h = one_minus_cos(distance2);
    let cone = uniform_cone(u, h);
    let direction = around(-q / distance, cone);
    // The nearer of the two points where the direction meets the sphere.
    let sin2 = cone.x * cone.x + cone.y * cone.y;
    let t = distance * cone.z - (1.0 - distance2 * sin2).max(0.0).sqrt();
    ((q + direction * t).normalize_or(q / distance), direction, uniform_cone_pdf(h))
}

fn from_inside(q: Vec3, u: Vec2) -> Option<(Vec3, Vec3, f32)> {
    let local = uniform_sphere(u);
    let direction = (local - q).normalize_or_zero();
    let pdf = inside_pdf(q, local, direction);
    (pdf > 0.0).then_some((local, direction, pdf))
}

fn inside_pdf(q: Vec3, local: Vec3, direction: Vec3) -> f32 {
    let cos = local.dot(direction);
    if cos > 0.0 { UNIFORM_PDF * (local - q).length_squared() / cos } else { 0.0 }
}

/// Texture coordinates of a point of the unit sphere.
fn spherical_uv(p: Vec3) -> Vec2 {
    let turn = p.y.atan2(p.x) / TAU;
    let r = p.truncate().length();
    Vec2::new(if turn < 0.0 { turn + 1.0 } else { turn }, r.atan2(p.z) * FRAC_1_PI)
}
