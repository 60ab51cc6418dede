//! Maps from the unit square to the domains that a renderer samples, with their densities.
//!
//! All of them are continuous where the domain allows it, so that well distributed points in the
//! square stay well distributed. Input lies in `[0, 1)²`.

use std::f32::consts::{FRAC_1_PI, FRAC_PI_4, PI};

use super::{Frame, Vec2, Vec3};

/// Uniform on the unit disk, area preserving and continuous
/// (Shirley and Chiu 1997: A low distortion map between disk and square).
pub fn concentric_disk(u: Vec2) -> Vec2 {
    let p = 2.0 * u - Vec2::ONE;
    if p == Vec2::ZERO {
        return Vec2::ZERO;
    }
    // The angle from the nearer axis, at most π/4.
    if p.x.abs() > p.y.abs() {
        let (sin, cos) = sin_cos_octant(FRAC_PI_4 * (p.y / p.x));
        Vec2::new(p.x * cos, p.x * sin)
    } else {
        let (sin, cos) = sin_cos_octant(FRAC_PI_4 * (p.x / p.y));
        Vec2::new(p.y * sin, p.y * cos)
    }
}

/// The inverse of [`concentric_disk`].
pub fn concentric_square(p: Vec2) -> Vec2 {
    let r = p.length();
    // The angle from the nearer axis in units of π/4, on whichever side of the origin.
    let square = if p.x.abs() > p.y.abs() {
        Vec2::new(r.copysign(p.x), r.copysign(p.x) * (p.y / p.x).atan() / FRAC_PI_4)
    } else if p.y != 0.0 {
        Vec2::new(r.copysign(p.y) * (p.x / p.y).atan() / FRAC_PI_4, r.copysign(p.y))
    } else {
        Vec2::ZERO
    };
    0.5 * square + 0.5
}

/// Sine and cosine of `|x| ≤ π/4` by their Taylor polynomials, exact to the last bit or so: much
/// faster than the general functions, and the same on all machines.
fn sin_cos_octant(x: f32) -> (f32, f32) {
    let x2 = x * x;
    let sin = 1.0 / 362_880.0;
    let sin = ((sin * x2 - 1.0 / 5040.0) * x2 + 1.0 / 120.0) * x2 - 1.0 / 6.0;
    let cos = 1.0 / 40_320.0;
    let cos = ((cos * x2 - 1.0 / 720.0) * x2 + 1.0 / 24.0) * x2 - 0.5;
    (x + x * x2 * sin, 1.0 + x2 * cos)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn octant_sine_and_cosine() {
        for i in -1000..=1000 {
            let x = FRAC_PI_4 * i as f32 / 1000.0;
            let (sin, cos) = sin_cos_octant(x);
            let (exact_sin, exact_cos) = f64::from(x).sin_cos();
            assert!((f64::from(sin) - exact_sin).abs() < 8e-8, "{x}");
            assert!((f64::from(cos) - exact_cos).abs() < 8e-8, "{x}");
        }
    }

    #[test]
    fn concentric_map_keeps_axes_and_corners() {
        assert_eq!(concentric_disk(Vec2::splat(0.5)), Vec2::ZERO);
        assert_eq!(concentric_disk(Vec2::new(1.0, 0.5)), Vec2::X);
        assert_eq!(concentric_disk(Vec2::new(0.5, 0.0)), -Vec2::Y);
        let corner = concentric_disk(Vec2::ONE);
        assert!((corner - Vec2::splat(0.5_f32.sqrt())).length() < 1e-6);
        assert!((corner.length() - 1.0).abs() < 2e-7);
    }
}
