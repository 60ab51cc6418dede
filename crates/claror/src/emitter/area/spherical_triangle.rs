//! Uniform sampling of the solid angle of a triangle.
//!
//! Arvo 1995: Stratified sampling of spherical triangles; the solid angle after van Oosterom and
//! Strackee 1983. In double precision, see [`super::spherical_rectangle`].

use crate::math::{DVec3, Vec2, Vec3};

/// Solid angles below this, and inner angles whose sine is below this, are left to sampling by
/// area.
const MIN_SOLID_ANGLE: f64 = 1e-5;
const MIN_SINE: f64 = 1e-4;

/// A triangle as seen from the origin.
pub(super) struct SphericalTriangle {
    corner: DVec3,
    edges: [DVec3; 2],
    /// The corners as unit directions.
    a: DVec3,
    b: DVec3,
    c: DVec3,
    /// Cosine and sine of the inner angle at `a`.
    cos_alpha: f64,
    sin_alpha: f64,
    /// Cosine of the side from `a` to `b`.
    cos_ab: f64,
    solid_angle: f64,
}

impl SphericalTriangle {
    /// The triangle with this corner (seen from the origin) and these edges from it; `None` when
    /// its solid angle is too small or too thin to be sampled well.
    pub(super) fn new(corner: Vec3, edges: [Vec3; 2]) -> Option<Self> {
        let corner = corner.as_dvec3();
        let edges = edges.map(Vec3::as_dvec3);
        let [a, b, c] = [corner, corner + edges[0], corner + edges[1]].map(DVec3::normalize);
        let volume = a.dot(b.cross(c)).abs();
        let solid_angle = 2.0 * volume.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a));
        let (ab, ac) = (a.cross(b), a.cross(c));
        let scale = (ab.length_squared() * ac.length_squared()).sqrt();
        let cos_alpha = ab.dot(ac) / scale;
        let sin_alpha = ab.cross(ac).length() / scale;
        // Written so that NaN fails.
        if !(solid_angle > MIN_SOLID_ANGLE && sin_alpha > MIN_SINE) {
            return None;
        }
        let cos_ab = a.dot(b);
        Some(Self { corner, edges, a, b, c, cos_alpha, sin_alpha, cos_ab, solid_angle })
    }

    /// Density of [`SphericalTriangle::sample`] by solid angle.
    pub(super) fn pdf(&self) -> f32 {
        (1.0 / self.solid_angle) as f32
    }

    /// A unit direction, and the barycentrics of vertices 1 and 2 there.
    pub(super) fn sample(&self, u: Vec2) -> (Vec3, Vec2) {
        let u = u.as_dvec2();
        // The point c' on the side ac such that the triangle a b c' has the share u.x of the
        // area (Arvo's eqs. for q).
        let area = u.x * self.solid_angle;
        let (sin_area, cos_area) = area.sin_cos();
        // Sine and cosine of area − alpha.
        let s = sin_area * self.cos_alpha - cos_area * self.sin_alpha;
        let t = cos_area * self.cos_alpha + sin_area * self.sin_alpha;
        let k = t - self.cos_alpha;
        let v = s + self.sin_alpha * self.cos_ab;
        let numerator = (v * t - k * s) * self.cos_alpha - v;
        let denominator = (v * s + k * t) * self.sin_alpha;
        let q = if denominator == 0.0 { 1.0 } else { numerator / denominator };
        let q = q.clamp(self.a.dot(self.c).min(1.0), 1.0);
        let along = (self.c - self.a * self.c.dot(self.a)).normalize_or_zero();
        let c = self.a * q + along * (1.0 - q * q).max(0.0).sqrt();
        // Then a point between b and c', uniform in the cosine from b.
        let z = 1.0 - u.y * (1.0 - c.dot(self.b));
        let across = (c - self.b * c.dot(self.b)).normalize_or_zero();
        let d = self.b * z + across * (1.0 - z * z).max(0.0).sqrt();
        (d.as_vec3(), self.barycentrics(d))
    }

    /// Where the direction `d` meets the triangle: Cramer's rule.
    fn barycentrics(&self, d: DVec3) -> Vec2 {
        let [e1, e2] = self.edges;
        let p = d.cross(e2);
        let determinant = e1.dot(p);
        let to_origin = -self.corner;
        let u = to_origin.dot(p) / determinant;
        let v = d.dot(to_origin.cross(e1)) / determinant;
        let u = u.clamp(0.0, 1.0);
        Vec2::new(u as f32, v.clamp(0.0, 1.0 - u) as f32)
    }
}
