//! Cylinders: by area, uniform in angle and height, over those angles only that can be seen.
//!
//! Which part of the mantle turns towards a reference point depends on its position around the
//! axis only, also under a transform that is not uniform: tangent planes stay tangent planes.

use super::{Extent, SurfaceSample, area_to_solid_angle, by_area};
use crate::math::{Bounds3, Transform, Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// A cylinder, open at both ends, that shines outwards or inwards.
#[derive(Debug, Clone)]
pub(in crate::emitter) struct Cylinder {
    transform: Transform,
    bounds: Bounds3,
    area: f32,
    inwards: bool,
}

/// A range of angles around the local axis.
struct Sector {
    start: f32,
    angle: f32,
}

impl Cylinder {
    /// The shape `cylinder` under `transform` with its bounds and area.
    pub(in crate::emitter) fn new(
        transform: &Transform,
        bounds: Bounds3,
        area: f32,
        inwards: bool,
    ) -> Self {
        Self { transform: *transform, bounds, area, inwards }
    }

    pub(super) fn sample(&self, from: Vec3, u: Vec2) -> Option<SurfaceSample> {
        let sector = self.visible(from)?;
        let phi = sector.start + u.x * sector.angle;
        let (sin, cos) = phi.sin_cos();
        let p = self.transform.point(Vec3::new(cos, sin, u.y));
        let n = self.transform.normal(Vec3::new(cos, sin, 0.0)).normalize_or_zero();
        let n = if self.inwards { -n } else { n };
        let sample = by_area(from, p, n, self.pdf_area(&sector, sin, cos), false)?;
        let turn = phi / TAU;
        let error = sample.error + super::ROUNDING * self.bounds.extent().max_element();
        Some(SurfaceSample { uv: Vec2::new(turn - turn.floor(), u.y), error, ..sample })
    }

    pub(super) fn pdf(&self, from: Vec3, wi: Vec3, p: Vec3, n: Vec3) -> f32 {
        let Some(sector) = self.visible(from) else { return 0.0 };
        let local = self.transform.inverse_point(p).truncate().normalize_or_zero();
        let past_start = (local.y.atan2(local.x) - sector.start).rem_euclid(TAU);
        // Points beyond the visible part do not shine here; rounding may put a few there.
        if past_start > sector.angle {
            return 0.0;
        }
        area_to_solid_angle(self.pdf_area(&sector, local.y, local.x), from, wi, p, n)
    }

    /// Density by area at the angle with this sine and cosine: uniform in the parameters.
    fn pdf_area(&self, sector: &Sector, sin: f32, cos: f32) -> f32 {
        let by_phi = self.transform.vector(Vec3::new(-sin, cos, 0.0));
        let by_z = self.transform.vector(Vec3::Z);
        1.0 / (sector.angle * by_phi.cross(by_z).length())
    }

    /// The angles at which the shining side turns towards `from`.
    fn visible(&self, from: Vec3) -> Option<Sector> {
        let q = self.transform.inverse_point(from).truncate();
        let r = q.length();
        if r <= 1.0 {
            return self.inwards.then_some(Sector { start: 0.0, angle: TAU });
        }
        // Outside, the two tangents divide the mantle.
        let half = (1.0 / r).acos();
        let towards = q.y.atan2(q.x);
        let sector = if self.inwards {
            Sector { start: towards + half, angle: TAU - 2.0 * half }
        } else {
            Sector { start: towards - half, angle: 2.0 * half }
        };
        (half > 0.0 && half < PI).then_some(sector)
    }

    pub(super) fn area(&self) -> f32 {
        self.area
    }

    pub(super) fn extent(&self) -> Extent {
        Extent { bounds: self.bounds, axis: Vec3::Z, cos_normals: -1.0, cos_emission: 0.0 }
    }
}
