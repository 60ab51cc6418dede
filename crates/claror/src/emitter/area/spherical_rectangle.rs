//! Uniform sampling of the solid angle of a rectangle.
//!
//! Ureña, Fajardo and King 2013: An area-preserving parametrization for spherical rectangles.
//! In double precision: it is used near a light only, where its cost is small against that of
//! the variance, and the angles cancel.

use crate::math::{DVec3, Vec2, Vec3};
use std::f64::consts::TAU;

/// Solid angles below this are too small for their computation by an angular excess.
const MIN_SOLID_ANGLE: f64 = 1e-5;

/// A rectangle as seen from the origin.
pub(super) struct SphericalRectangle {
    /// Unit vectors along the edges, and the lengths of these.
    axes: [DVec3; 2],
    lengths: [f64; 2],
    /// Unit normal on the far side.
    n: DVec3,
    /// The rectangle is [x0, x1] × [y0, y1] in the plane at `depth`.
    x: [f64; 2],
    y: [f64; 2],
    depth: f64,
    /// z of the normals of the lower and the upper great circle.
    b: [f64; 2],
    /// TAU less the inner angles at the right side.
    k: f64,
    solid_angle: f64,
}

impl SphericalRectangle {
    /// The rectangle with this corner (seen from the origin) and these perpendicular edges;
    /// `None` when its solid angle is too small to be computed well.
    pub(super) fn new(corner: Vec3, edges: [Vec3; 2]) -> Option<Self> {
        let corner = corner.as_dvec3();
        let edges = edges.map(Vec3::as_dvec3);
        let lengths = edges.map(DVec3::length);
        let axes = [edges[0] / lengths[0], edges[1] / lengths[1]];
        let n = axes[0].cross(axes[1]);
        let z = corner.dot(n);
        let (n, depth) = if z < 0.0 { (-n, -z) } else { (n, z) };
        let x0 = corner.dot(axes[0]);
        let y0 = corner.dot(axes[1]);
        let (x, y) = ([x0, x0 + lengths[0]], [y0, y0 + lengths[1]]);
        // z components of the unit normals of the four great circles: the paper's with all signs
        // turned, since its rectangle is at negative z.
        let normal_z = |c: f64| c / (c * c + depth * depth).sqrt();
        let (n0, n2) = (normal_z(y[0]), -normal_z(y[1]));
        let (n1, n3) = (-normal_z(x[1]), normal_z(x[0]));
        let angle = |a: f64, b: f64| (-a * b).clamp(-1.0, 1.0).acos();
        let (g0, g1, g2, g3) = (angle(n0, n1), angle(n1, n2), angle(n2, n3), angle(n3, n0));
        let solid_angle = g0 + g1 + g2 + g3 - TAU;
        // Written so that NaN fails.
        if !(solid_angle > MIN_SOLID_ANGLE && depth > 0.0) {
            return None;
        }
        let k = TAU - g2 - g3;
        Some(Self { axes, lengths, n, x, y, depth, b: [n0, n2], k, solid_angle })
    }

    /// Density of [`SphericalRectangle::sample`] by solid angle.
    pub(super) fn pdf(&self) -> f32 {
        (1.0 / self.solid_angle) as f32
    }

    /// A unit direction, and the place on the rectangle in [0, 1]² along the edges.
    pub(super) fn sample(&self, u: Vec2) -> (Vec3, Vec2) {
        let u = u.as_dvec2();
        // x, by the share of the solid angle left of it (the paper's section 4.2).
        let (sin, cos) = (u.x * self.solid_angle + self.k).sin_cos();
        let f = (cos * self.b[0] - self.b[1]) / sin;
        let c = (1.0 / (f * f + self.b[0] * self.b[0]).sqrt()).copysign(f).clamp(-1.0, 1.0);
        let x = -(c * self.depth) / (1.0 - c * c).max(1e-300).sqrt();
        // `max` first: it also turns NaN (0 / 0 at the very end of the range) into the bound.
        let x = x.max(self.x[0]).min(self.x[1]);
        // y, by equal parts of the height that the slice at x has on the sphere.
        let d2 = x * x + self.depth * self.depth;
        let height = |y: f64| y / (d2 + y * y).sqrt();
        let (h0, h1) = (height(self.y[0]), height(self.y[1]));
        let h = h0 + u.y * (h1 - h0);
        let y = if h * h < 1.0 - 1e-12 { h * d2.sqrt() / (1.0 - h * h).sqrt() } else { self.y[1] };
        let y = y.clamp(self.y[0], self.y[1]);
        let d = self.axes[0] * x + self.axes[1] * y + self.n * self.depth;
        let place = Vec2::new(
            ((x - self.x[0]) / self.lengths[0]) as f32,
            ((y - self.y[0]) / self.lengths[1]) as f32,
        );
        (d.normalize().as_vec3(), place)
    }
}
