//! Points on shining surfaces, chosen as seen from a reference point.
//!
//! Every shape offers the same three: `sample` a point, the density (`pdf`) by solid angle with
//! which `sample` finds a given point, and what the choice between lights needs (`extent`). How
//! a point is chosen may depend on the reference point, but on nothing else, so that `pdf` makes
//! the same decision as `sample` did.

mod cylinder;
mod disk;
mod ellipsoid;
mod planar;
mod spherical_rectangle;
mod spherical_triangle;

pub(super) use cylinder::Cylinder;
pub(super) use disk::Disk;
pub(super) use ellipsoid::Ellipsoid;
pub(super) use planar::{Parallelogram, SmoothTriangle, Triangle};

use super::tree::Extent;
use crate::math::{Vec2, Vec3};

/// Unit of the distances that keep shadow rays off a light: as in [`crate::shape`], each rounding
/// costs half of `f32::EPSILON`, and there is room for eight.
pub(super) const ROUNDING: f32 = 4.0 * f32::EPSILON;

/// A point chosen on a light's surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct SurfaceSample {
    /// The point, world space.
    pub(super) p: Vec3,
    /// Unit geometric normal on the emitting side.
    pub(super) n: Vec3,
    /// Unit direction from the reference.
    pub(super) wi: Vec3,
    /// Distance from the reference.
    pub(super) distance: f32,
    /// Density by solid angle from the reference.
    pub(super) pdf: f32,
    /// Parameters of the point: barycentrics of vertices 1 and 2 of a triangle, texture
    /// coordinates of the others.
    pub(super) uv: Vec2,
    /// How far along the normal the surface may be from `p`, by rounding.
    pub(super) error: f32,
}

/// The geometry of one area light.
#[derive(Debug, Clone)]
pub(super) enum Area {
    Triangle(Triangle),
    SmoothTriangle(Box<SmoothTriangle>),
    Parallelogram(Parallelogram),
    Ellipsoid(Box<Ellipsoid>),
    Disk(Box<Disk>),
    Cylinder(Box<Cylinder>),
}

impl Area {
    /// A point that `from` may be lit from; `None` where there is none.
    pub(super) fn sample(&self, from: Vec3, u: Vec2) -> Option<SurfaceSample> {
        match self {
            Self::Triangle(s) => s.sample(from, u, false),
            Self::SmoothTriangle(s) => s.sample(from, u),
            Self::Parallelogram(s) => s.sample(from, u),
            Self::Ellipsoid(s) => s.sample(from, u),
            Self::Disk(s) => s.sample(from, u),
            Self::Cylinder(s) => s.sample(from, u),
        }
    }

    /// Density by solid angle with which [`Area::sample`] chooses the point `p` of this surface,
    /// whose geometric normal (either side) is `n`; `wi` is the unit direction to it.
    pub(super) fn pdf(&self, from: Vec3, wi: Vec3, p: Vec3, n: Vec3) -> f32 {
        match self {
            Self::Triangle(s) => s.pdf(from, wi, p, false),
            Self::SmoothTriangle(s) => s.pdf(from, wi, p),
            Self::Parallelogram(s) => s.pdf(from, wi, p),
            Self::Ellipsoid(s) => s.pdf(from, wi, p),
            Self::Disk(s) => s.pdf(from, wi, p),
            Self::Cylinder(s) => s.pdf(from, wi, p, n),
        }
    }

    /// Where it is and where it shines to.
    pub(super) fn extent(&self) -> Extent {
        match self {
            Self::Triangle(s) => s.extent(),
            Self::SmoothTriangle(s) => s.extent(),
            Self::Parallelogram(s) => s.extent(),
            Self::Ellipsoid(s) => s.extent(),
            Self::Disk(s) => s.extent(),
            Self::Cylinder(s) => s.extent(),
        }
    }

    /// Surface area.
    pub(super) fn area(&self) -> f32 {
        match self {
            Self::Triangle(s) => s.area(),
            Self::SmoothTriangle(s) => s.area(),
            Self::Parallelogram(s) => s.area(),
            Self::Ellipsoid(s) => s.area(),
            Self::Disk(s) => s.area(),
            Self::Cylinder(s) => s.area(),
        }
    }
}

/// A point chosen by area, with density `pdf_area` by area; `None` where it does not shine
/// towards `from` (unless it is `two_sided`) or coincides with it.
#[inline]
fn by_area(from: Vec3, p: Vec3, n: Vec3, pdf_area: f32, two_sided: bool) -> Option<SurfaceSample> {
    let to_light = p - from;
    let distance2 = to_light.length_squared();
    let distance = distance2.sqrt();
    let wi = to_light / distance;
    let cos = -wi.dot(n);
    let cos = if two_sided { cos.abs() } else { cos };
    if !(cos > 0.0 && distance2 > 0.0) {
        return None;
    }
    let pdf = pdf_area * distance2 / cos;
    let error = ROUNDING * p.abs().max_element();
    pdf.is_finite().then_some(SurfaceSample { p, n, wi, distance, pdf, uv: Vec2::ZERO, error })
}

/// The density by solid angle that belongs to the density `pdf_area` by area.
fn area_to_solid_angle(pdf_area: f32, from: Vec3, wi: Vec3, p: Vec3, n: Vec3) -> f32 {
    let cos = wi.dot(n).abs();
    let pdf = pdf_area * (p - from).length_squared() / cos;
    if pdf.is_finite() { pdf } else { 0.0 }
}
