//! Fresnel's equations for unpolarised light, and the directions that go with them.

use crate::math::Vec3;
use crate::spectrum::Rgb;

/// What happens at a smooth interface between two dielectrics.
#[derive(Debug, Clone, Copy)]
pub(super) struct DielectricFresnel {
    /// Share of the light that is reflected.
    pub(super) reflectance: f32,
    /// Signed cosine of the refracted direction (opposite in sign to that of the incident one); 0
    /// at total internal reflection.
    pub(super) cos_theta_t: f32,
    /// Index of refraction on the far side over that on the near side.
    pub(super) eta_it: f32,
    /// Its inverse.
    pub(super) eta_ti: f32,
}

/// Fresnel reflectance at an interface of interior over exterior index `eta`, for a direction of
/// signed cosine `cos_theta` (negative from the interior).
pub(super) fn dielectric(cos_theta: f32, eta: f32) -> DielectricFresnel {
    let outside = cos_theta >= 0.0;
    let (eta_it, eta_ti) = if outside { (eta, 1.0 / eta) } else { (1.0 / eta, eta) };
    // Snell's law.
    let cos2_t = 1.0 - (1.0 - cos_theta * cos_theta) * eta_ti * eta_ti;
    let (cos_i, cos_t) = (cos_theta.abs(), cos2_t.max(0.0).sqrt());
    let reflectance = if eta == 1.0 {
        0.0
    } else if cos_i == 0.0 || cos2_t <= 0.0 {
        1.0
    } else {
        let s = (cos_i - eta_it * cos_t) / (cos_i + eta_it * cos_t);
        let p = (cos_t - eta_it * cos_i) / (cos_t + eta_it * cos_i);
        0.5 * (s * s + p * p)
    };
    let cos_theta_t = if outside { -cos_t } else { cos_t };
    DielectricFresnel { reflectance, cos_theta_t, eta_it, eta_ti }
}

/// Fresnel reflectance of a metal with the complex index `eta + i·k` at the cosine `cos_i ≥ 0`
/// (Born and Wolf, Principles of Optics, §14.2), one channel.
fn conductor_channel(cos_i: f32, eta: f32, k: f32) -> f32 {
    let cos2 = cos_i * cos_i;
    let sin2 = 1.0 - cos2;
    let sin4 = sin2 * sin2;
    let t = eta * eta - k * k - sin2;
    let a2_b2 = (t * t + 4.0 * k * k * eta * eta).max(0.0).sqrt();
    let a = (0.5 * (a2_b2 + t)).max(0.0).sqrt();
    let (s1, s2) = (a2_b2 + cos2, 2.0 * cos_i * a);
    let s = (s1 - s2) / (s1 + s2);
    let (p1, p2) = (a2_b2 * cos2 + sin4, s2 * sin2);
    // Everything is 0 for eta = k = 0 (a table's out-of-gamut channel) at normal incidence.
    let p = if p1 + p2 > 0.0 { s * (p1 - p2) / (p1 + p2) } else { s };
    0.5 * (s + p)
}

/// Fresnel reflectance of a metal with the complex index `eta + i·k` at the cosine `cos_i ≥ 0`.
pub(super) fn conductor(cos_i: f32, eta: Rgb, k: Rgb) -> Rgb {
    Rgb::new(
        conductor_channel(cos_i, eta.r, k.r),
        conductor_channel(cos_i, eta.g, k.g),
        conductor_channel(cos_i, eta.b, k.b),
    )
}

/// `w` mirrored at the local normal +z.
pub(super) fn reflect(w: Vec3) -> Vec3 {
    Vec3::new(-w.x, -w.y, w.z)
}

/// `w` mirrored at the microfacet normal `m`.
pub(super) fn reflect_at(w: Vec3, m: Vec3) -> Vec3 {
    2.0 * w.dot(m) * m - w
}

/// `w` refracted at the local normal +z.
pub(super) fn refract(w: Vec3, f: &DielectricFresnel) -> Vec3 {
    Vec3::new(-f.eta_ti * w.x, -f.eta_ti * w.y, f.cos_theta_t)
}

/// `w` refracted at the microfacet normal `m`; `f` is for the cosine `w·m`.
pub(super) fn refract_at(w: Vec3, m: Vec3, f: &DielectricFresnel) -> Vec3 {
    (w.dot(m) * f.eta_ti + f.cos_theta_t) * m - w * f.eta_ti
}

/// Reflectance of a smooth dielectric interface under uniform diffuse illumination, by the fits
/// that Mitsuba uses: Egan and Hilgeman 1973 from inside (`eta < 1`; 0.6 % off at most for
/// ordinary indices), d'Eon and Irving 2011 from outside (0.2 %).
pub(super) fn diffuse_reflectance(eta: f32) -> f32 {
    let inv = 1.0 / eta;
    if eta < 1.0 {
        -1.4399 * eta * eta + 0.7099 * eta + 0.6681 + 0.0636 * inv
    } else {
        const FIT: [f32; 6] = [-1.368_81, 4.985_54, -7.809_89, 6.753_35, -3.4793, 0.919_317];
        FIT.iter().fold(0.0, |sum, c| sum * inv + c)
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn normal_incidence_and_brewster() {
        let f = dielectric(1.0, 1.5);
        assert_relative_eq!(f.reflectance, 0.04, max_relative = 1e-5);
        assert_eq!((f.cos_theta_t, f.eta_it), (-1.0, 1.5));
        // At Brewster's angle half of the s-polarised reflectance is left.
        let brewster = 1.5_f32.atan().cos();
        let s = (1.0 - 1.5 * 1.5) / (1.0 + 1.5 * 1.5);
        assert_relative_eq!(
            dielectric(brewster, 1.5).reflectance,
            0.5 * s * s,
            max_relative = 1e-4
        );
        assert_eq!(dielectric(0.0, 1.5).reflectance, 1.0);
        assert_eq!(dielectric(0.7, 1.0).reflectance, 0.0);
    }

    #[test]
    fn both_sides_agree_and_total_reflection_begins_where_it_must() {
        for cos in [0.1_f32, 0.4, 0.8, 1.0] {
            let outside = dielectric(cos, 1.5);
            let inside = dielectric(outside.cos_theta_t, 1.5);
            assert_relative_eq!(outside.reflectance, inside.reflectance, max_relative = 1e-4);
            assert_relative_eq!(inside.cos_theta_t, cos, max_relative = 1e-5);
        }
        let critical = (1.0 - 1.0 / (1.5_f32 * 1.5)).sqrt();
        assert_eq!(dielectric(-critical + 1e-4, 1.5).reflectance, 1.0);
        assert!(dielectric(-critical - 1e-4, 1.5).reflectance < 0.99);
    }

    #[test]
    fn conductor_without_absorption_is_a_dielectric() {
        for cos in [0.05_f32, 0.5, 1.0] {
            let f = conductor(cos, Rgb::splat(1.5), Rgb::BLACK);
            assert_relative_eq!(f.g, dielectric(cos, 1.5).reflectance, max_relative = 1e-4);
        }
    }

    #[test]
    fn diffuse_reflectance_is_near_the_integral() {
        for (eta, tolerance) in [(1.0 / 1.5_f32, 0.006), (1.5, 0.002), (2.4, 0.003)] {
            let n = 2000;
            let integral: f32 = (0..n)
                .map(|i| (i as f32 + 0.5) / n as f32)
                .map(|cos| 2.0 * cos * dielectric(cos, eta).reflectance / n as f32)
                .sum();
            assert_relative_eq!(diffuse_reflectance(eta), integral, max_relative = tolerance);
        }
        // Mitsuba's numbers.
        assert_relative_eq!(diffuse_reflectance(1.0 / 1.49), 0.590_732_5, max_relative = 1e-6);
        assert_relative_eq!(diffuse_reflectance(1.49), 0.090_299_96, max_relative = 1e-5);
    }
}
