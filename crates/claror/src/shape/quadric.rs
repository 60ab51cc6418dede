//! Spheres, disks and cylinders: intersected in their own space, in double precision, so that
//! large and far ones are as exact as their description.

use super::ShapeKind;
use crate::math::{DVec3, Ray, Transform};

/// A ray in the space of a shape; `t` as in the world.
struct LocalRay {
    o: DVec3,
    d: DVec3,
}

impl LocalRay {
    fn new(transform: &Transform, ray: &Ray) -> Self {
        let to_local = transform.to_local.as_daffine3();
        Self {
            o: to_local.transform_point3(ray.o.as_dvec3()),
            d: to_local.transform_vector3(ray.d.as_dvec3()),
        }
    }
}

/// The point of a quadric (in its own space) that a hit at ray parameter `t` means.
pub(super) fn local_point(transform: &Transform, ray: &Ray, t: f32) -> DVec3 {
    let local = LocalRay::new(transform, ray);
    local.o + f64::from(t) * local.d
}

/// The closest hit of a ray with a sphere, disk or cylinder in `[0, t_max]`; `None` for the
/// shapes that are made of triangles.
pub(crate) fn intersect_quadric(kind: &ShapeKind, ray: &Ray, t_max: f32) -> Option<f32> {
    let t = match kind {
        ShapeKind::Sphere(transform) => sphere(&LocalRay::new(transform, ray), t_max.into())?,
        ShapeKind::Disk(transform) => disk(&LocalRay::new(transform, ray))?,
        ShapeKind::Cylinder(transform) => cylinder(&LocalRay::new(transform, ray), t_max.into())?,
        ShapeKind::Mesh(_) | ShapeKind::Rectangle(_) => return None,
    };
    (t >= 0.0 && t as f32 <= t_max).then_some(t as f32)
}

/// Both solutions of `a t² + 2 b t + c = 0`, the smaller first, given a quarter of the
/// discriminant; without the cancellation of the school formula.
fn roots(a: f64, b: f64, c: f64, discriminant: f64) -> Option<[f64; 2]> {
    // Written so that NaN fails.
    if !(discriminant >= 0.0 && a > 0.0) {
        return None;
    }
    let q = -(b + discriminant.sqrt().copysign(b));
    let (t0, t1) = (q / a, c / q);
    // q = 0 only where the ray starts on the surface, along it.
    if q == 0.0 {
        return Some([0.0, 0.0]);
    }
    Some(if t0 <= t1 { [t0, t1] } else { [t1, t0] })
}

/// Unit sphere. The discriminant is computed from the ray's point closest to the centre (Haines,
/// Günther and Akenine-Möller 2019: Precision improvements for ray/sphere intersection).
fn sphere(ray: &LocalRay, t_max: f64) -> Option<f64> {
    let a = ray.d.length_squared();
    let b = ray.o.dot(ray.d);
    let c = ray.o.length_squared() - 1.0;
    let closest = ray.o - ray.d * (b / a);
    let roots = roots(a, b, c, a * (1.0 - closest.length_squared()))?;
    roots.into_iter().find(|&t| t >= 0.0 && t <= t_max)
}

/// Unit disk in the plane z = 0.
fn disk(ray: &LocalRay) -> Option<f64> {
    let t = -ray.o.z / ray.d.z;
    let p = ray.o + t * ray.d;
    (p.x * p.x + p.y * p.y <= 1.0).then_some(t)
}

/// Cylinder of radius 1 around z, from 0 to 1.
fn cylinder(ray: &LocalRay, t_max: f64) -> Option<f64> {
    let (o, d) = (ray.o.truncate(), ray.d.truncate());
    let a = d.length_squared();
    let b = o.dot(d);
    let c = o.length_squared() - 1.0;
    let closest = o - d * (b / a);
    let roots = roots(a, b, c, a * (1.0 - closest.length_squared()))?;
    let between = |t: f64| (0.0..=1.0).contains(&(ray.o.z + t * ray.d.z));
    roots.into_iter().find(|&t| t >= 0.0 && t <= t_max && between(t))
}
