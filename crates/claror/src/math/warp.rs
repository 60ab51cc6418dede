//! Maps from the unit square to the domains that a renderer samples, with their densities.
//!
//! All of them are continuous where the domain allows it, so that well distributed points in the
//! square stay well distributed. Input lies in `[0, 1)²`.

use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4, PI};

use super::{Frame, Vec2, Vec3};

/// Uniform on the unit disk, area preserving and continuous
/// (Shirley and Chiu 1997: A low distortion map between disk and square).
pub fn concentric_disk(u: Vec2) -> Vec2 {
    let p = 2.0 * u - Vec2::ONE;
    if p == Vec2::ZERO {
        return Vec2::ZERO;
    }
    let (radius, phi) = if p.x.abs() > p.y.abs() {
        (p.x, FRAC_PI_4 * (p.y / p.x))
    } else {
        (p.y, FRAC_PI_2 - FRAC_PI_4 * (p.x / p.y))
    };
    let (sin, cos) = phi.sin_cos();
    Vec2::new(radius * cos, radius * sin)
}

/// Density of [`concentric_disk`] by area.
pub const CONCENTRIC_DISK_PDF: f32 = FRAC_1_PI;

/// Cosine-distributed direction around +z (Malley's method). `z` may be 0 for points on the rim.
pub fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let p = concentric_disk(u);
    p.extend((1.0 - p.length_squared()).max(0.0).sqrt())
}

/// Density of [`cosine_hemisphere`] by solid angle, for `cos_theta ≥ 0`.
pub fn cosine_hemisphere_pdf(cos_theta: f32) -> f32 {
    FRAC_1_PI * cos_theta
}

/// Uniform direction around +z.
pub fn uniform_hemisphere(u: Vec2) -> Vec3 {
    // Lambert's equal-area map of the disk; 1 - r² = z keeps the area (Shirley and Chiu 1997).
    let p = concentric_disk(u);
    let r2 = p.length_squared();
    (p * (2.0 - r2).max(0.0).sqrt()).extend(1.0 - r2)
}

/// Density of [`uniform_hemisphere`] by solid angle.
pub const UNIFORM_HEMISPHERE_PDF: f32 = 0.5 * FRAC_1_PI;

/// Uniform direction on the whole sphere; `z` falls linearly with `u.y`.
pub fn uniform_sphere(u: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * u.y;
    // (1 - z)(1 + z) without cancellation near the poles.
    let r = 2.0 * (u.y * (1.0 - u.y)).max(0.0).sqrt();
    let (sin, cos) = (2.0 * PI * u.x).sin_cos();
    Vec3::new(r * cos, r * sin, z)
}

/// Density of [`uniform_sphere`] by solid angle.
pub const UNIFORM_SPHERE_PDF: f32 = 0.25 * FRAC_1_PI;

/// Uniform direction in the cone of half angle `acos(1 - one_minus_cos)` around +z. The argument
/// is one minus the cosine so that narrow cones keep their precision.
pub fn uniform_cone(u: Vec2, one_minus_cos: f32) -> Vec3 {
    // The map of `uniform_hemisphere` with the disk scaled to z ∈ [cos, 1].
    let p = concentric_disk(u) * one_minus_cos.max(0.0).sqrt();
    let r2 = p.length_squared();
    (p * (2.0 - r2).max(0.0).sqrt()).extend(1.0 - r2)
}

/// Density of [`uniform_cone`] by solid angle.
pub fn uniform_cone_pdf(one_minus_cos: f32) -> f32 {
    0.5 * FRAC_1_PI / one_minus_cos
}

/// Uniform on a triangle: barycentrics of the vertices 1 and 2 (vertex 0 has the rest).
/// Heitz 2019: A low-distortion map between triangle and square.
pub fn uniform_triangle(u: Vec2) -> Vec2 {
    if u.y > u.x {
        let x = 0.5 * u.x;
        Vec2::new(x, u.y - x)
    } else {
        let y = 0.5 * u.y;
        Vec2::new(u.x - y, y)
    }
}

/// The direction `local` (around +z) turned into the frame around the unit vector `axis`.
pub fn around(axis: Vec3, local: Vec3) -> Vec3 {
    Frame::from_normal(axis).to_world(local)
}
