//! Smooth interfaces against numbers that Mitsuba 3.9 gives for the same plugins.

use approx::assert_relative_eq;

use super::support::Materials;
use crate::bsdf::Bsdf;
use crate::math::{Vec2, Vec3};
use crate::spectrum::Rgb;

const U: Vec2 = Vec2::new(0.3, 0.6);
/// Crown glass over air: the default of `dielectric`.
const BK7: f32 = 1.5046 / 1.000_277;

fn glass(m: &mut Materials) -> Bsdf {
    let white = m.scalar(1.0);
    Bsdf::Dielectric { eta: BK7, specular_reflectance: white, specular_transmittance: white }
}

#[test]
fn glass_from_outside() {
    let mut m = Materials::default();
    let glass = glass(&mut m);
    let id = m.add(glass);
    m.prepare();
    let bsdf = m.at(id, Vec3::new(0.6, 0.0, 0.8));
    let s = bsdf.sample(0.9, U).expect("glass always answers");
    assert!(s.is_delta && s.is_transmission && !s.is_null);
    assert_relative_eq!(s.pdf, 0.955_548, max_relative = 1e-5);
    assert_relative_eq!(s.weight.g, 0.441_976, max_relative = 1e-5);
    assert_relative_eq!(s.eta, 1.504_183_3, max_relative = 1e-6);
    assert!(s.wi.abs_diff_eq(Vec3::new(-0.398_888, 0.0, -0.917), 1e-5), "{}", s.wi);
    let r = bsdf.sample(0.04, U).expect("glass always answers");
    assert!(r.is_delta && !r.is_transmission && r.eta == 1.0 && r.weight == Rgb::WHITE);
    assert_relative_eq!(r.pdf, 1.0 - 0.955_548, max_relative = 1e-4);
    assert_eq!(bsdf.eval(r.wi).pdf, 0.0);
    assert!(!bsdf.has_smooth());
}

#[test]
fn glass_from_inside() {
    let mut m = Materials::default();
    let glass = glass(&mut m);
    let id = m.add(glass);
    m.prepare();
    let bsdf = m.at(id, Vec3::new(0.6, 0.0, -0.8));
    let s = bsdf.sample(0.9, U).expect("glass always answers");
    assert_relative_eq!(s.pdf, 0.882_671_6, max_relative = 1e-5);
    assert_relative_eq!(s.weight.g, 2.262_57, max_relative = 1e-5);
    assert_relative_eq!(s.eta, 0.664_812_6, max_relative = 1e-6);
    assert!(s.wi.abs_diff_eq(Vec3::new(-0.902_51, 0.0, 0.430_669), 1e-5), "{}", s.wi);
    // Beyond the critical angle nothing leaves.
    let bsdf = m.at(id, Vec3::new(0.8, 0.0, -0.6));
    let s = bsdf.sample(0.999_999, U).expect("glass always answers");
    assert!(!s.is_transmission);
    assert_eq!(s.pdf, 1.0);
}

#[test]
fn mirror_reflects_all_from_the_front_only() {
    let mut m = Materials::default();
    let (eta, k, one) = (m.scalar(0.0), m.scalar(1.0), m.scalar(1.0));
    let id = m.add(Bsdf::Conductor { eta, k, specular_reflectance: one });
    m.prepare();
    for cos in [1.0, 0.7, 0.01] {
        let wo = Vec3::new((1.0_f32 - cos * cos).sqrt(), 0.0, cos);
        let s = m.at(id, wo).sample(0.5, U).expect("a mirror reflects");
        assert_relative_eq!(s.weight.r, 1.0, max_relative = 1e-6);
        assert_eq!(s.wi, Vec3::new(-wo.x, 0.0, wo.z));
        assert!(m.at(id, -wo).sample(0.5, U).is_none());
    }
}

#[test]
fn mask_lets_its_transparent_share_through() {
    let mut m = Materials::default();
    let (opacity, grey) = (m.scalar(0.4), m.rgb([0.2, 0.4, 0.6]));
    let nested = m.add(Bsdf::Diffuse { reflectance: grey });
    let id = m.add(Bsdf::Mask { opacity, nested });
    m.prepare();
    let wo = Vec3::new(0.6, 0.0, 0.8);
    let bsdf = m.at(id, wo);
    let through = bsdf.sample(0.9, U).expect("the mask is transparent");
    assert!(through.is_null && through.is_delta && through.is_transmission);
    assert_relative_eq!(through.pdf, 0.6, max_relative = 1e-6);
    assert_eq!((through.wi, through.weight), (-wo, Rgb::WHITE));
    let s = bsdf.sample(0.1, U).expect("the front reflects");
    // Mitsuba: density 0.4·cos/π and weight = reflectance.
    assert_relative_eq!(s.pdf, 0.4 * s.wi.z / std::f32::consts::PI, max_relative = 1e-6);
    assert_relative_eq!(s.weight.b, 0.6, max_relative = 1e-6);
    assert_relative_eq!(bsdf.albedo().r, 0.2, max_relative = 1e-6);
    assert!(m.at(id, -wo).sample(0.1, U).is_none());
    assert!(m.at(id, -wo).sample(0.9, U).is_some());
}
