//! Parameters and directions at the edge of what is allowed: numbers stay finite.

use super::materials::plain_principled;
use super::support::Materials;
use crate::bsdf::{Bsdf, BsdfAtHit, BsdfId, MicrofacetKind, PerturbationOptions, metal};
use crate::math::statistics::TestRng;
use crate::math::{Vec2, Vec3, warp};

const ALPHAS: [f32; 4] = [0.0, 1e-3, 1.0, 10.0];

/// Directions on the axes, at the horizon and everywhere.
fn directions(rng: &mut TestRng) -> Vec<Vec3> {
    let mut list = vec![Vec3::X, -Vec3::Y, Vec3::Z, -Vec3::Z];
    for z in [1e-30_f32, 1e-7, 1e-4, -1e-30, -1e-7, -1e-4] {
        list.push(Vec3::new(0.6, -0.8, z));
    }
    list.push(Vec3::new(1e-4, 0.0, 1.0).normalize());
    list.extend((0..12).map(|_| warp::uniform_sphere(rng.next_vec2())));
    list
}

fn check(name: &str, bsdf: &BsdfAtHit, wo: Vec3, rng: &mut TestRng) {
    for wi in directions(rng) {
        let e = bsdf.eval(wi);
        let is_sound = |v: f32| v.is_finite() && v >= 0.0;
        let all = [e.value.to_array(), e.diffuse.to_array(), [e.pdf; 3]];
        assert!(all.as_flattened().iter().all(|&v| is_sound(v)), "{name} {wo} {wi}: {e:?}");
    }
    for corner in [0.0, 0.5, 1.0 - f32::EPSILON / 2.0] {
        for u in [Vec2::ZERO, Vec2::new(1.0 - f32::EPSILON / 2.0, corner), rng.next_vec2()] {
            let Some(s) = bsdf.sample(corner, u) else { continue };
            assert!(s.wi.is_finite() && (s.wi.length() - 1.0).abs() < 1e-3, "{name} {wo}: {s:?}");
            assert!(s.weight.is_finite() && s.pdf > 0.0 && s.pdf.is_finite(), "{name} {wo}: {s:?}");
            assert!(s.weight.to_array().iter().all(|&v| v >= 0.0), "{name} {wo}: {s:?}");
            assert!(s.eta > 0.0 && s.diffuse_weight.is_finite(), "{name} {wo}: {s:?}");
        }
    }
    assert!(bsdf.albedo().is_finite() && bsdf.diffuse_albedo().is_finite(), "{name} {wo}");
}

#[test]
fn numbers_stay_finite() {
    let mut m = Materials::default();
    let mut list: Vec<(String, BsdfId)> = Vec::new();
    for kind in [MicrofacetKind::Beckmann, MicrofacetKind::Ggx] {
        for visible in [true, false] {
            for alpha in ALPHAS {
                let name = format!("{kind:?} visible {visible} alpha {alpha}");
                for (what, bsdf) in rough(&mut m, kind, visible, alpha) {
                    list.push((format!("{what} {name}"), m.add(bsdf)));
                }
            }
        }
    }
    for corner in 0..32_u32 {
        list.push((format!("principled {corner:b}"), extreme_principled(&mut m, corner)));
    }
    list.extend(smooth(&mut m));
    let mirror = list[0].1;
    for color in [[0.5, 0.5, 0.0], [0.5, 0.5, 0.5], [1.0, 0.5, 0.5]] {
        let normal = m.rgb(color);
        let options = PerturbationOptions::default();
        let id = m.add(Bsdf::NormalMap { normal, nested: mirror, options });
        list.push((format!("normal {color:?}"), id));
    }
    m.prepare();
    let mut rng = TestRng::new(41);
    for (name, id) in &list {
        for wo in directions(&mut rng) {
            check(name, &m.at(*id, wo), wo, &mut rng);
        }
    }
}

fn rough(
    m: &mut Materials,
    distribution: MicrofacetKind,
    sample_visible: bool,
    alpha: f32,
) -> Vec<(&'static str, Bsdf)> {
    let (alpha_u, alpha_v, white, black) =
        (m.scalar(alpha), m.scalar(0.1), m.scalar(1.0), m.scalar(0.0));
    let (eta, k) = metal("AlSb").expect("it is known");
    let (eta, k) = (m.rgb(eta.to_array()), m.rgb(k.to_array()));
    let glass = |eta| Bsdf::RoughDielectric {
        distribution,
        sample_visible,
        alpha_u,
        alpha_v,
        eta,
        specular_reflectance: white,
        specular_transmittance: white,
    };
    let specular_reflectance = white;
    vec![
        (
            "metal",
            Bsdf::RoughConductor {
                distribution,
                sample_visible,
                alpha_u,
                alpha_v,
                eta,
                k,
                specular_reflectance,
            },
        ),
        ("glass", glass(1.5)),
        ("bubble", glass(0.7)),
        ("almost nothing", glass(1.000_1)),
        (
            "plastic",
            Bsdf::RoughPlastic {
                distribution,
                sample_visible,
                alpha,
                eta: 1.5,
                diffuse_reflectance: black,
                specular_reflectance: black,
                nonlinear: true,
            },
        ),
    ]
}

/// Each bit puts a parameter at its other end.
fn extreme_principled(m: &mut Materials, corner: u32) -> BsdfId {
    let mut p = plain_principled(m);
    let end = |bit: u32| if corner >> bit & 1 == 1 { 1.0 } else { 0.0 };
    p.roughness = m.scalar(end(0));
    p.anisotropic = m.scalar(end(1));
    p.metallic = m.scalar(end(2));
    p.spec_trans = m.scalar(end(3));
    p.clearcoat = m.scalar(1.0);
    p.clearcoat_gloss = m.scalar(end(4));
    p.sheen = m.scalar(1.0);
    p.flatness = m.scalar(end(4));
    p.base_color = m.scalar(end(1));
    p.eta = if end(4) == 1.0 { 1.0 } else { 1.5 };
    m.add(Bsdf::Principled(Box::new(p)))
}

fn smooth(m: &mut Materials) -> Vec<(String, BsdfId)> {
    let (white, black) = (m.scalar(1.0), m.scalar(0.0));
    let mut list = Vec::new();
    for eta in [0.1, 1.0, 1.5, 10.0] {
        let (specular_reflectance, specular_transmittance) = (white, white);
        for (what, bsdf) in [
            ("glass", Bsdf::Dielectric { eta, specular_reflectance, specular_transmittance }),
            ("pane", Bsdf::ThinDielectric { eta, specular_reflectance, specular_transmittance }),
            (
                "plastic",
                Bsdf::Plastic {
                    eta,
                    diffuse_reflectance: black,
                    specular_reflectance: black,
                    nonlinear: false,
                },
            ),
        ] {
            list.push((format!("{what} {eta}"), m.add(bsdf)));
        }
    }
    list.push((
        "mirror of nothing".into(),
        m.add(Bsdf::Conductor { eta: black, k: black, specular_reflectance: white }),
    ));
    list
}
