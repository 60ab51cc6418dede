//! Energy, reciprocity, and the diffuse part.

use std::f32::consts::PI;

use approx::assert_relative_eq;

use super::materials;
use super::sampling::viewers;
use super::support::Materials;
use crate::bsdf::{Bsdf, BsdfAtHit, BsdfError, BsdfId, MAX_LOBES, PerturbationOptions};
use crate::math::statistics::{Moments, TestRng, student_quantile_two_sided};
use crate::math::{Vec3, warp};
use crate::spectrum::Rgb;

/// Brightest channel of the directional albedo, in power: what was refracted is scaled back by
/// the squared index ratio.
fn power(bsdf: &BsdfAtHit, seed: u64) -> Moments {
    let mut rng = TestRng::new(seed);
    let mut moments = Moments::default();
    for _ in 0..20_000 {
        let s = bsdf.sample(rng.next_f32(), rng.next_vec2());
        moments.add(s.map_or(0.0, |s| f64::from(s.weight.max_component() * s.eta * s.eta)));
    }
    moments
}

#[test]
fn no_material_reflects_more_than_it_gets() {
    let mut m = Materials::default();
    let list = materials::all(&mut m);
    m.prepare();
    // Sheen is added to the rest and gains energy at grazing angles, in Mitsuba, too.
    for (i, (name, id)) in list.iter().filter(|(n, _)| *n != "principled-cloth").enumerate() {
        for wo in viewers() {
            let power = power(&m.at(*id, wo), i as u64);
            // 0.1 % of correct programs would fail here by chance.
            let width = student_quantile_two_sided(0.001 / 135.0, 20_000.0);
            let limit = 1.0 + width * power.standard_error() + 1e-5;
            assert!(power.mean <= limit, "{name} seen from {wo}: {power:?}");
        }
    }
}

/// Smooth glass loses nothing, from both sides; rough glass only what its facets shadow.
#[test]
fn glass_loses_little() {
    let mut m = Materials::default();
    let white = m.scalar(1.0);
    let smooth = m.add(Bsdf::Dielectric {
        eta: 1.5,
        specular_reflectance: white,
        specular_transmittance: white,
    });
    let alpha = m.scalar(0.05);
    let rough = m.add(Bsdf::RoughDielectric {
        distribution: crate::bsdf::MicrofacetKind::Ggx,
        sample_visible: true,
        alpha_u: alpha,
        alpha_v: alpha,
        eta: 1.5,
        specular_reflectance: white,
        specular_transmittance: white,
    });
    m.prepare();
    for wo in [viewers()[0], viewers()[1], viewers()[3]] {
        assert_relative_eq!(power(&m.at(smooth, wo), 1).mean, 1.0, max_relative = 1e-5);
        let rough = power(&m.at(rough, wo), 1);
        assert!((0.985..=1.0).contains(&rough.mean), "{wo}: {rough:?}");
    }
}

/// Value over the cosine.
fn scattering(m: &Materials, id: BsdfId, wo: Vec3, wi: Vec3) -> Rgb {
    m.at(id, wo).eval(wi).value / wi.z.abs()
}

/// f(a→b)/n_b² = f(b→a)/n_a²: plain symmetry for reflection (Veach 1997, §5.2). Bump and normal
/// maps shade by one of the directions and are left out.
#[test]
fn scattering_is_reciprocal() {
    let mut m = Materials::default();
    let list = materials::all(&mut m);
    m.prepare();
    let mut rng = TestRng::new(17);
    for (name, id) in list.iter().filter(|(n, _)| !n.contains("map")) {
        let eta = if *name == "principled-glass" { 1.4_f32 } else { 1.5 };
        let mut compared = 0;
        for _ in 0..2000 {
            let (a, b) =
                (warp::uniform_sphere(rng.next_vec2()), warp::uniform_sphere(rng.next_vec2()));
            // `principled` transmits with its own index; its opaque kinds have no second side.
            let is_transmission = a.z * b.z < 0.0;
            if is_transmission && *name == "principled-rates" {
                continue;
            }
            let index = |w: Vec3| if is_transmission && w.z < 0.0 { eta } else { 1.0 };
            let forth = scattering(&m, *id, a, b) / (index(a) * index(a));
            let back = scattering(&m, *id, b, a) / (index(b) * index(b));
            for c in 0..3 {
                let scale = forth[c].max(back[c]).max(0.01);
                assert!(
                    (forth[c] - back[c]).abs() < 2e-3 * scale,
                    "{name} {a} {b}: {forth:?} {back:?}"
                );
            }
            compared += usize::from(!forth.is_black());
        }
        assert!(compared > 300, "{name}: {compared} pairs");
    }
}

/// The diffuse part under uniform illumination is the diffuse albedo: exactly for Lambert, up to
/// the quadrature of the coats.
#[test]
fn diffuse_albedo_is_the_integral_of_the_diffuse_part() {
    let mut m = Materials::default();
    let list = materials::all(&mut m);
    m.prepare();
    let names = [
        "diffuse",
        "plastic",
        "plastic-nonlinear",
        "roughplastic-ggx",
        "roughplastic-all",
        "mask",
        "blend",
    ];
    for (name, id) in list.iter().filter(|(n, _)| names.contains(n)) {
        for wo in &viewers()[..3] {
            let bsdf = m.at(*id, *wo);
            let mut rng = TestRng::new(23);
            let mut sum = Moments::default();
            for _ in 0..40_000 {
                let wi = warp::cosine_hemisphere(rng.next_vec2());
                sum.add(f64::from(bsdf.eval(wi).diffuse.g * PI / wi.z));
            }
            let albedo = f64::from(bsdf.diffuse_albedo().g);
            // The fitted diffuse Fresnel reflectance is off by 0.1 %, the table by 0.5 %.
            let tolerance = 5e-3 * albedo + 4.0 * sum.standard_error();
            assert!(
                (sum.mean - albedo).abs() < tolerance,
                "{name} seen from {wo}: {albedo} {sum:?}"
            );
            assert!(bsdf.diffuse_albedo().max_component() <= 1.0);
        }
    }
    let principled = list.iter().find(|(n, _)| *n == "principled").expect("it is there").1;
    let bsdf = m.at(principled, Vec3::Z);
    assert_eq!(bsdf.diffuse_albedo(), Rgb::BLACK);
    assert!(bsdf.eval(Vec3::Z).diffuse.is_black() && !bsdf.eval(Vec3::Z).value.is_black());
}

/// Numbers of Mitsuba's `eval_diffuse_reflectance`.
#[test]
fn albedo_is_mitsubas() {
    let mut m = Materials::default();
    let list = materials::all(&mut m);
    m.prepare();
    let find = |name: &str| list.iter().find(|(n, _)| *n == name).expect("a material").1;
    let wo = Vec3::new(0.6, 0.0, 0.8);
    for name in ["diffuse", "plastic", "roughplastic-ggx", "principled", "mask"] {
        for side in [wo, -wo] {
            assert_relative_eq!(m.at(find(name), side).albedo().g, 0.5, max_relative = 1e-6);
        }
    }
    let gold = m.at(find("gold-ggx"), wo);
    assert_relative_eq!(gold.albedo().r, gold.eval(Vec3::Z).value.r * PI, max_relative = 1e-6);
}

#[test]
fn what_does_not_fit_is_refused() {
    let mut m = Materials::default();
    let grey = m.scalar(0.5);
    let base = m.add(Bsdf::Diffuse { reflectance: grey });
    let mut top = base;
    for _ in 1..MAX_LOBES {
        top = m.add(Bsdf::Blend { weight: grey, first: top, second: base });
    }
    assert_eq!(m.table.validate(&m.textures), Ok(()));
    let wo = Vec3::Z;
    m.prepare();
    assert_relative_eq!(m.at(top, wo).eval(wo).value.g, 0.5 / PI, max_relative = 1e-6);
    let full = m.add(Bsdf::Blend { weight: grey, first: top, second: base });
    let error = BsdfError::TooManyLobes { bsdf: full, lobes: MAX_LOBES + 1 };
    assert_eq!(m.table.validate(&m.textures), Err(error));

    let mut m = Materials::default();
    let null = m.add(Bsdf::Null);
    let outer = m.add(Bsdf::TwoSided { front: null, back: null });
    let error = BsdfError::TransmissiveTwoSided { bsdf: outer };
    assert_eq!(m.table.validate(&m.textures), Err(error));

    let mut m = Materials::default();
    let missing = crate::texture::TextureId(7);
    let id = m.add(Bsdf::Diffuse { reflectance: missing });
    let error = BsdfError::MissingTexture { bsdf: id, texture: missing };
    assert_eq!(m.table.validate(&m.textures), Err(error));

    let mut m = Materials::default();
    let loose = BsdfId(3);
    let id = m.add(Bsdf::TwoSided { front: loose, back: loose });
    let error = BsdfError::NestedOutOfOrder { bsdf: id, nested: loose };
    assert_eq!(m.table.validate(&m.textures), Err(error));
}

/// Guards of several branches of bump and normal maps keep apart.
#[test]
fn nested_maps_in_both_branches_of_a_blend() {
    let mut m = Materials::default();
    let list = materials::all(&mut m);
    let find = |name: &str| list.iter().find(|(n, _)| *n == name).expect("a material").1;
    let weight = m.scalar(0.25);
    let (first, second) = (find("bumpmap-normalmap"), find("normalmap"));
    let blend = m.add(Bsdf::Blend { weight, first, second });
    let options = PerturbationOptions::default();
    let normal = m.rgb([0.6, 0.55, 0.9]);
    let outer = m.add(Bsdf::NormalMap { normal, nested: blend, options });
    let outer_first = m.add(Bsdf::NormalMap { normal, nested: first, options });
    let outer_second = m.add(Bsdf::NormalMap { normal, nested: second, options });
    m.prepare();
    let mut rng = TestRng::new(29);
    for _ in 0..200 {
        let (wo, wi) =
            (warp::uniform_sphere(rng.next_vec2()), warp::uniform_sphere(rng.next_vec2()));
        let both = m.at(outer, wo).eval(wi).value.g;
        let parts = 0.75 * m.at(outer_first, wo).eval(wi).value.g
            + 0.25 * m.at(outer_second, wo).eval(wi).value.g;
        assert_relative_eq!(both, parts, max_relative = 1e-5);
    }
}
