//! Every sampler against its own density and value.

use std::f64::consts::PI;

use super::materials;
use super::support::Materials;
use crate::bsdf::{BsdfAtHit, BsdfId};
use crate::math::statistics::{
    ChiSquare, Moments, PolarAxis, SphereTest, TestRng, sidak, student_two_sided,
};
use crate::math::{Vec3, warp};

/// Probability that a correct program fails one of the tests of a test function.
const LEVEL: f64 = 0.001;

/// Viewers: near the normal, oblique, grazing, and two from behind.
pub(super) fn viewers() -> [Vec3; 5] {
    [
        Vec3::new(0.1, 0.05, 1.0).normalize(),
        Vec3::new(-0.5, 0.6, 0.6).normalize(),
        Vec3::new(0.9, -0.4, 0.12).normalize(),
        Vec3::new(0.3, 0.5, -0.8).normalize(),
        Vec3::new(-0.9, 0.1, -0.3).normalize(),
    ]
}

fn chi_square(bsdf: &BsdfAtHit, pdf: impl Fn(Vec3) -> f64, seed: u64) -> ChiSquare {
    let test = SphereTest {
        subdivisions: 12,
        samples: 50_000,
        axis: PolarAxis::X,
        ..SphereTest::default()
    };
    let mut rng = TestRng::new(seed);
    let sample = |_| {
        let s = bsdf.sample(rng.next_f32(), rng.next_vec2())?;
        // Delta components are outside of the density, like failed samples.
        (!s.is_delta).then_some(s.wi)
    };
    test.run(sample, pdf)
}

#[test]
fn samples_follow_the_density() {
    let mut m = Materials::default();
    let list = materials::all(&mut m);
    m.prepare();
    let level = sidak(LEVEL, (list.len() * viewers().len()) as u32);
    for (i, (name, id)) in list.iter().enumerate() {
        for (j, wo) in viewers().into_iter().enumerate() {
            let bsdf = m.at(*id, wo);
            if is_dark(&bsdf) {
                continue;
            }
            let seed = (i * 8 + j) as u64;
            let result = chi_square(&bsdf, |wi| f64::from(bsdf.eval(wi).pdf), seed);
            assert!(result.p_value > level, "{name} seen from {wo}: {result:?}");
        }
    }
}

/// Whether no smooth component scatters: seen from behind. The value must agree.
fn is_dark(bsdf: &BsdfAtHit) -> bool {
    let mut rng = TestRng::new(5);
    (0..200).all(|_| {
        let s = bsdf.sample(rng.next_f32(), rng.next_vec2());
        let e = bsdf.eval(warp::uniform_sphere(rng.next_vec2()));
        s.is_none_or(|s| s.is_delta) && e.pdf == 0.0 && e.value.is_black()
    })
}

/// Without its diffuse part a material is what it was less that part, and its directions follow
/// the density that is left.
#[test]
fn what_is_left_without_the_diffuse_part() {
    let mut m = Materials::default();
    let list = materials::all(&mut m);
    m.prepare();
    let level = sidak(LEVEL, (list.len() * viewers().len()) as u32);
    let mut rng = TestRng::new(21);
    for (i, (name, id)) in list.iter().enumerate() {
        for (j, wo) in viewers().into_iter().enumerate() {
            let whole = m.at(*id, wo);
            let mut glossy = whole.clone();
            glossy.remove_diffuse();
            assert!(glossy.diffuse_albedo().is_black(), "{name}");
            for _ in 0..200 {
                let wi = warp::uniform_sphere(rng.next_vec2());
                let (all, left) = (whole.eval(wi), glossy.eval(wi));
                assert!(left.diffuse.is_black(), "{name}");
                for c in 0..3 {
                    let difference = all.value[c] - all.diffuse[c] - left.value[c];
                    assert!(difference.abs() <= 1e-5 * all.value[c].max(1.0), "{name} {wi}");
                }
            }
            if !is_dark(&glossy) {
                let seed = (i * 8 + j) as u64;
                let result = chi_square(&glossy, |wi| f64::from(glossy.eval(wi).pdf), seed);
                assert!(result.p_value > level, "{name} seen from {wo}: {result:?}");
            }
        }
    }
}

/// The test above must be able to fail.
#[test]
fn mutants_are_rejected() {
    let mut m = Materials::default();
    let list = materials::all(&mut m);
    m.prepare();
    let find = |name: &str| list.iter().find(|(n, _)| *n == name).expect("a material").1;
    let wo = viewers()[1];
    for name in ["diffuse", "gold-beckmann", "glass-ggx", "principled-varnish"] {
        let bsdf = m.at(find(name), wo);
        let scaled = chi_square(&bsdf, |wi| 1.02 * f64::from(bsdf.eval(wi).pdf), 1);
        assert!(scaled.p_value < LEVEL, "{name}, density 2 % too large: {scaled:?}");
        let scaled = chi_square(&bsdf, |wi| 0.98 * f64::from(bsdf.eval(wi).pdf), 1);
        assert!(scaled.p_value < LEVEL, "{name}, density 2 % too small: {scaled:?}");
        let swapped =
            chi_square(&bsdf, |wi| f64::from(bsdf.eval(Vec3::new(wi.y, wi.x, wi.z)).pdf), 1);
        assert!(swapped.p_value < LEVEL || name == "diffuse", "{name}, swapped axes: {swapped:?}");
    }
    let bsdf = m.at(find("diffuse"), wo);
    let dropped = chi_square(&bsdf, |wi| if wi.z > 0.0 { 0.5 / PI } else { 0.0 }, 1);
    assert!(dropped.p_value < LEVEL, "dropped cosine: {dropped:?}");
}

#[test]
fn weights_are_values_over_densities() {
    let mut m = Materials::default();
    let list = materials::all(&mut m);
    m.prepare();
    let mut rng = TestRng::new(11);
    for (name, id) in &list {
        for wo in viewers() {
            let bsdf = m.at(*id, wo);
            for _ in 0..500 {
                let Some(s) = bsdf.sample(rng.next_f32(), rng.next_vec2()) else { continue };
                assert!((s.wi.length() - 1.0).abs() < 1e-5, "{name}: {s:?}");
                assert!(s.weight.is_finite() && s.pdf > 0.0, "{name}: {s:?}");
                assert!(!s.is_null || s.is_transmission, "{name}: {s:?}");
                if s.is_delta {
                    continue;
                }
                let e = bsdf.eval(s.wi);
                // Directions are rounded on their way to world space and back: where the density
                // is steep that shows.
                let tolerance = 2e-3 * e.pdf.max(1.0);
                assert!((s.pdf - e.pdf).abs() < tolerance * e.pdf, "{name}: {s:?} {e:?}");
                for c in 0..3 {
                    let (weight, expected) = (s.weight[c], e.value[c] / e.pdf);
                    assert!(
                        (weight - expected).abs() < 2e-3 * expected.max(1e-3),
                        "{name}: {s:?} {e:?}"
                    );
                    let (diffuse, expected) = (s.diffuse_weight[c], e.diffuse[c] / e.pdf);
                    assert!(
                        (diffuse - expected).abs() < 2e-3 * expected.max(1e-3),
                        "{name}: {s:?} {e:?}"
                    );
                }
            }
        }
    }
}

/// Means of the green channel: by the material's own sampler, delta components left out, and by
/// directions that know nothing of it.
fn two_albedos(bsdf: &BsdfAtHit, seed: u64) -> (Moments, Moments) {
    let mut rng = TestRng::new(seed);
    let (mut own, mut uniform) = (Moments::default(), Moments::default());
    for _ in 0..20_000 {
        let s = bsdf.sample(rng.next_f32(), rng.next_vec2());
        own.add(s.filter(|s| !s.is_delta).map_or(0.0, |s| f64::from(s.weight.g)));
        let wi = warp::uniform_sphere(rng.next_vec2());
        uniform.add(4.0 * PI * f64::from(bsdf.eval(wi).value.g));
    }
    (own, uniform)
}

/// A sampler that misses a part of the value would pass the tests above.
#[test]
fn samples_cover_the_value() {
    let mut m = Materials::default();
    let list = materials::all(&mut m);
    m.prepare();
    let level = sidak(LEVEL, (list.len() * viewers().len()) as u32);
    for (i, (name, id)) in list.iter().enumerate() {
        for (j, wo) in viewers().into_iter().enumerate() {
            let (own, uniform) = two_albedos(&m.at(*id, wo), (i * 8 + j) as u64);
            let error = own.standard_error().hypot(uniform.standard_error());
            if error == 0.0 {
                assert_eq!(own.mean, uniform.mean, "{name} seen from {wo}");
                continue;
            }
            let p = student_two_sided((own.mean - uniform.mean) / error, 20_000.0);
            assert!(p > level, "{name} seen from {wo}: {own:?} {uniform:?}");
        }
    }
}

/// Materials with delta components choose them as often as they say.
#[test]
fn delta_components_are_chosen_with_their_probability() {
    let mut m = Materials::default();
    let list = materials::all(&mut m);
    m.prepare();
    let find =
        |name: &str| -> BsdfId { list.iter().find(|(n, _)| *n == name).expect("a material").1 };
    for name in ["plastic", "plastic-nonlinear", "mask"] {
        let bsdf = m.at(find(name), viewers()[1]);
        let mut rng = TestRng::new(3);
        let mut share = Moments::default();
        let mut stated = None;
        for _ in 0..50_000 {
            let s = bsdf.sample(rng.next_f32(), rng.next_vec2()).filter(|s| s.is_delta);
            share.add(if s.is_some() { 1.0 } else { 0.0 });
            stated = stated.or(s.map(|s| f64::from(s.pdf)));
        }
        let stated = stated.expect("the component is chosen at times");
        assert!(share.p_value(stated) > LEVEL / 3.0, "{name}: {stated} {share:?}");
    }
}
