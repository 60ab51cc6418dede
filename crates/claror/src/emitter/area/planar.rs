//! Triangles and parallelograms: by area from afar, by solid angle when near.
//!
//! Sampling by area wastes nothing on arithmetic and is as good as anything while the light is
//! small as seen from the reference; near a light the squared distance and the cosine vary so
//! much over it that sampling its solid angle wins (Ureña et al. 2013, Arvo 1995).

use super::spherical_rectangle::SphericalRectangle;
use super::spherical_triangle::SphericalTriangle;
use super::{Extent, SurfaceSample, area_to_solid_angle, by_area};
use crate::math::warp::uniform_triangle;
use crate::math::{Bounds3, Vec2, Vec3};

/// A light is near when its squared radius exceeds this share of the squared distance to its
/// centre. Measured around a square light (irradiance without visibility): beyond, sampling by area
/// has a relative variance of at most 0.5 (solid angle: 0.03), within up to 13 (0.2).
const NEAR: f32 = 0.25;

/// What triangles and parallelograms have in common: a corner and two edges.
#[derive(Debug, Clone, Copy)]
struct Plane {
    corner: Vec3,
    edges: [Vec3; 2],
    /// Unit normal on the emitting side.
    n: Vec3,
    /// One over the area.
    pdf_area: f32,
}

/// Where the centre is, as a share of both edges.
const CENTER_OF_TRIANGLE: f32 = 1.0 / 3.0;
const CENTER_OF_PARALLELOGRAM: f32 = 0.5;

impl Plane {
    /// `share` of the parallelogram over the edges belongs to the light: a half or all.
    fn new(corner: Vec3, edges: [Vec3; 2], flip: bool, share: f64) -> Option<Self> {
        // In double precision: a sliver's normal is all cancellation in single.
        let normal = edges[0].as_dvec3().cross(edges[1].as_dvec3());
        let area = share * normal.length();
        let n = normal.normalize_or_zero().as_vec3();
        let pdf_area = (1.0 / area) as f32;
        let usable = pdf_area > 0.0 && pdf_area.is_finite() && n.is_finite() && n != Vec3::ZERO;
        usable.then_some(Self { corner, edges, n: if flip { -n } else { n }, pdf_area })
    }

    /// Worked out each time: that costs less than to fetch it from memory, which among very many
    /// lights is what takes the time.
    #[inline]
    fn is_near(&self, from: Vec3, center: f32) -> bool {
        let to_center = (self.edges[0] + self.edges[1]) * center;
        // A quarter of the mean square of a parallelogram's diagonals; about right for a triangle.
        let radius2 = 0.25 * (self.edges[0].length_squared() + self.edges[1].length_squared());
        radius2 > NEAR * (from - (self.corner + to_center)).length_squared()
    }

    fn at(&self, uv: Vec2) -> Vec3 {
        self.corner + (self.edges[0] * uv.x + self.edges[1] * uv.y)
    }

    #[inline]
    fn by_area(&self, from: Vec3, uv: Vec2, two_sided: bool) -> Option<SurfaceSample> {
        let sample = by_area(from, self.at(uv), self.n, self.pdf_area, two_sided)?;
        Some(SurfaceSample { uv, error: self.error(sample.p), ..sample })
    }

    /// The point of the light at parameters `uv` in direction `wi`, chosen with density `pdf`.
    fn by_direction(&self, from: Vec3, wi: Vec3, uv: Vec2, pdf: f32) -> SurfaceSample {
        let p = self.at(uv);
        let (distance, error) = ((p - from).length(), self.error(p));
        SurfaceSample { p, n: self.n, wi, distance, pdf, uv, error }
    }

    fn pdf(&self, from: Vec3, wi: Vec3, p: Vec3, two_sided: bool) -> f32 {
        if two_sided || wi.dot(self.n) < 0.0 {
            area_to_solid_angle(self.pdf_area, from, wi, p, self.n)
        } else {
            0.0
        }
    }

    /// Bound of the rounding error of a point: its own, and that of the plane through the corners.
    fn error(&self, p: Vec3) -> f32 {
        let size = self.edges[0].abs() + self.edges[1].abs() + 2.0 * p.abs();
        super::ROUNDING * size.max_element()
    }

    /// `cos_spread`: cosine of the angle around the normal that the shading normals fill.
    fn extent(&self, bounds: Bounds3, axis: Vec3, cos_spread: f32) -> Extent {
        Extent { bounds, axis, cos_normals: cos_spread, cos_emission: 0.0 }
    }
}

/// A triangle that shines to one side.
#[derive(Debug, Clone, Copy)]
pub(in crate::emitter) struct Triangle {
    plane: Plane,
}

/// A triangle with vertex normals: it shines on their side, which may be either of the plane's.
#[derive(Debug, Clone, Copy)]
pub(in crate::emitter) struct SmoothTriangle {
    triangle: Triangle,
    normals: NormalCone,
}

/// A cone that holds all interpolated normals of a triangle.
#[derive(Debug, Clone, Copy)]
struct NormalCone {
    axis: Vec3,
    cos: f32,
}

impl Triangle {
    /// `None` when the triangle has no area.
    pub(in crate::emitter) fn new(corners: [Vec3; 3], flip: bool) -> Option<Self> {
        let edges = [corners[1] - corners[0], corners[2] - corners[0]];
        Some(Self { plane: Plane::new(corners[0], edges, flip, 0.5)? })
    }

    /// `two_sided`: whether both sides may shine.
    #[inline]
    pub(super) fn sample(&self, from: Vec3, u: Vec2, two_sided: bool) -> Option<SurfaceSample> {
        match self.spherical(from, two_sided) {
            Some(spherical) => {
                let (wi, uv) = spherical.sample(u);
                Some(self.plane.by_direction(from, wi, uv, spherical.pdf()))
            }
            None => self.plane.by_area(from, uniform_triangle(u), two_sided),
        }
    }

    pub(super) fn pdf(&self, from: Vec3, wi: Vec3, p: Vec3, two_sided: bool) -> f32 {
        match self.spherical(from, two_sided) {
            Some(spherical) => spherical.pdf(),
            None => self.plane.pdf(from, wi, p, two_sided),
        }
    }

    #[inline]
    fn spherical(&self, from: Vec3, two_sided: bool) -> Option<SphericalTriangle> {
        if !self.plane.is_near(from, CENTER_OF_TRIANGLE) {
            return None;
        }
        // From behind nothing is to be seen; sampling by area finds that out.
        let height = (from - self.plane.corner).dot(self.plane.n);
        if height <= 0.0 && !two_sided {
            return None;
        }
        SphericalTriangle::new(self.plane.corner - from, self.plane.edges)
    }

    /// The corners.
    pub(in crate::emitter) fn outline(&self) -> [Vec3; 3] {
        let Plane { corner, edges: [a, b], .. } = self.plane;
        [corner, corner + a, corner + b]
    }

    /// Unit normal on the emitting side.
    pub(in crate::emitter) fn normal(&self) -> Vec3 {
        self.plane.n
    }

    pub(super) fn area(&self) -> f32 {
        1.0 / self.plane.pdf_area
    }

    fn bounds(&self) -> Bounds3 {
        let p = &self.plane;
        [p.corner + p.edges[0], p.corner + p.edges[1]]
            .into_iter()
            .fold(Bounds3 { min: p.corner, max: p.corner }, Bounds3::including)
    }

    pub(super) fn extent(&self) -> Extent {
        self.plane.extent(self.bounds(), self.plane.n, 1.0)
    }
}

impl SmoothTriangle {
    /// `None` when the triangle has no area. `normals` are those of the vertices, on the
    /// emitting side.
    pub(in crate::emitter) fn new(
        corners: [Vec3; 3],
        flip: bool,
        normals: [Vec3; 3],
    ) -> Option<Self> {
        Some(Self { triangle: Triangle::new(corners, flip)?, normals: normal_cone(normals) })
    }

    pub(super) fn sample(&self, from: Vec3, u: Vec2) -> Option<SurfaceSample> {
        self.triangle.sample(from, u, true)
    }

    pub(super) fn pdf(&self, from: Vec3, wi: Vec3, p: Vec3) -> f32 {
        self.triangle.pdf(from, wi, p, true)
    }

    pub(super) fn area(&self) -> f32 {
        self.triangle.area()
    }

    pub(super) fn extent(&self) -> Extent {
        let NormalCone { axis, cos } = self.normals;
        self.triangle.plane.extent(self.triangle.bounds(), axis, cos)
    }
}

/// A cone around the mean of the vertex normals. Normalised combinations of them with positive
/// weights stay inside when it is no wider than a hemisphere.
fn normal_cone(normals: [Vec3; 3]) -> NormalCone {
    let axis = (normals[0] + normals[1] + normals[2]).normalize_or_zero();
    let cos = normals.iter().map(|n| n.normalize_or_zero().dot(axis)).fold(1.0, f32::min);
    // A little wider than that, for rounding; everything when it is a hemisphere or more.
    if cos > 0.0 { NormalCone { axis, cos: cos - 1e-5 } } else { NormalCone { axis, cos: -1.0 } }
}

/// A parallelogram that shines: the shape `rectangle`, or two triangles that make one.
#[derive(Debug, Clone, Copy)]
pub(in crate::emitter) struct Parallelogram {
    plane: Plane,
    /// The edges are at right angles.
    is_rectangle: bool,
}

impl Parallelogram {
    /// `None` when it has no area.
    pub(in crate::emitter) fn new(corner: Vec3, edges: [Vec3; 2], flip: bool) -> Option<Self> {
        let plane = Plane::new(corner, edges, flip, 1.0)?;
        let skew = edges[0].dot(edges[1]).abs();
        let is_rectangle = skew <= 1e-6 * edges[0].length() * edges[1].length();
        Some(Self { plane, is_rectangle })
    }

    /// The same, shining to the side of `n`.
    pub(in crate::emitter) fn facing(mut self, n: Vec3) -> Self {
        if self.plane.n.dot(n) < 0.0 {
            self.plane.n = -self.plane.n;
        }
        self
    }

    /// The corners, around.
    pub(in crate::emitter) fn outline(&self) -> [Vec3; 4] {
        let Plane { corner, edges: [a, b], .. } = self.plane;
        [corner, corner + a, corner + a + b, corner + b]
    }

    /// Unit normal on the emitting side.
    pub(in crate::emitter) fn normal(&self) -> Vec3 {
        self.plane.n
    }

    #[inline]
    pub(super) fn sample(&self, from: Vec3, u: Vec2) -> Option<SurfaceSample> {
        if self.is_near(from)
            && let Some(sample) = self.sample_near(from, u)
        {
            return Some(sample);
        }
        self.plane.by_area(from, u, false)
    }

    pub(super) fn pdf(&self, from: Vec3, wi: Vec3, p: Vec3) -> f32 {
        let spherical = if self.is_near(from) { self.spherical(from) } else { None };
        match spherical {
            Some(spherical) => spherical.pdf(),
            None => self.plane.pdf(from, wi, p, false),
        }
    }

    #[inline]
    fn is_near(&self, from: Vec3) -> bool {
        self.is_rectangle && self.plane.is_near(from, CENTER_OF_PARALLELOGRAM)
    }

    /// By solid angle; apart from the common case, whose code it would only burden.
    #[inline(never)]
    fn sample_near(&self, from: Vec3, u: Vec2) -> Option<SurfaceSample> {
        let spherical = self.spherical(from)?;
        let (wi, uv) = spherical.sample(u);
        Some(self.plane.by_direction(from, wi, uv, spherical.pdf()))
    }

    fn spherical(&self, from: Vec3) -> Option<SphericalRectangle> {
        let height = (from - self.plane.corner).dot(self.plane.n);
        if height <= 0.0 {
            return None;
        }
        SphericalRectangle::new(self.plane.corner - from, self.plane.edges)
    }

    pub(super) fn area(&self) -> f32 {
        1.0 / self.plane.pdf_area
    }

    pub(super) fn extent(&self) -> Extent {
        let p = &self.plane;
        let (a, b) = (p.corner + p.edges[0], p.corner + p.edges[1]);
        let bounds = [a, b, a + p.edges[1]]
            .into_iter()
            .fold(Bounds3 { min: p.corner, max: p.corner }, Bounds3::including);
        p.extent(bounds, p.n, 1.0)
    }
}
