//! Radii.

use super::scene::{Quad, Scene};
use super::{ALL, estimates, radii_of};
use crate::irradiance::{
    CreviceRule, Criterion, Estimates, Grid, Hemisphere, RadiusBounds, RadiusSettings, Record,
    clamped_by_neighbour, eigenvalues, radii, ward_angle,
};
use crate::math::statistics::TestRng;
use crate::math::{Frame, Vec2, Vec3};
use crate::spectrum::Rgb;

fn hemisphere(seed: u64, x: [f64; 3]) -> Hemisphere {
    let mut scene = Scene::room([4.0, 3.0, 2.5], [1.0, 0.2, 0.6, 0.3, 0.8]);
    scene.quads.push(Quad::new([1.65, 1.2, 1.0], [0.7, 0.0, 0.0], [0.0, 0.6, 0.0], 0.05));
    let mut h = scene.hemisphere(x, Grid::Concentric { n: 16 }, &mut TestRng::new(seed));
    let mut rng = TestRng::new(seed + 100);
    for c in &mut h.cells {
        c.radiance = Rgb::from([0, 1, 2].map(|k| c.radiance[k] * (0.5 + rng.next_f32())));
    }
    h
}

const PLACES: [[f64; 3]; 4] = [[2.0, 1.4, 0.0], [0.01, 1.0, 0.0], [3.9, 2.9, 0.0], [1.0, 1.6, 0.0]];

#[test]
fn eigenvalues_and_axes() {
    let mut rng = TestRng::new(1);
    for _ in 0..1000 {
        let [xx, xy, yy] = [(); 3].map(|()| 2.0 * rng.next_f32() - 1.0);
        let ([first, second], axis) = eigenvalues([xx, xy, yy]);
        assert!(first.abs() >= second.abs());
        assert!((first + second - xx - yy).abs() < 1e-5);
        let image = Vec2::new(xx * axis.x + xy * axis.y, xy * axis.x + yy * axis.y);
        assert!((image - first * axis).length() < 1e-5 && (axis.length() - 1.0).abs() < 1e-6);
    }
    assert_eq!(eigenvalues([0.0; 3]).0, [0.0; 2]);
}

/// Lengths times a power of two: the same bits, with another exponent.
#[test]
fn radii_scale_with_the_scene() {
    for place in PLACES {
        let h = hemisphere(3, place);
        let one = estimates(&h, 100.0);
        for k in [-10, 9] {
            let scale = 2_f32.powi(k);
            let mut scaled = h.clone();
            for c in &mut scaled.cells {
                c.distance *= scale;
            }
            let many = estimates(&scaled, 100.0 * scale);
            assert_eq!(one.translational.map(|g| g / scale), many.translational);
            assert_eq!(one.hessian.map(|h| h / scale / scale), many.hessian);
            for criterion in ALL {
                let (a, b) = (radii_of(criterion, &one, 1.0), radii_of(criterion, &many, scale));
                assert_eq!(a.radii.map(|r| r * scale), b.radii, "{criterion:?}");
                assert_eq!((a.natural * scale, a.axis), (b.natural, b.axis));
                assert_eq!((a.flags, a.gradient_scale), (b.flags, b.gradient_scale));
            }
        }
    }
}

/// Emission times a power of two: the same records.
#[test]
fn radii_do_not_depend_on_the_unit_of_light() {
    for place in PLACES {
        let h = hemisphere(4, place);
        let one = estimates(&h, 100.0);
        for k in [-20, 15] {
            let scale = 2_f32.powi(k);
            let mut brighter = h.clone();
            for c in &mut brighter.cells {
                c.radiance *= scale;
            }
            let many = estimates(&brighter, 100.0);
            assert_eq!(one.irradiance * scale, many.irradiance);
            for criterion in ALL {
                assert_eq!(radii_of(criterion, &one, 1.0), radii_of(criterion, &many, 1.0));
            }
        }
    }
}

#[test]
fn channels_are_independent() {
    let h = hemisphere(5, PLACES[0]);
    let one = estimates(&h, 100.0);
    let mut turned = h;
    for c in &mut turned.cells {
        c.radiance = Rgb::new(c.radiance.b, c.radiance.r, c.radiance.g);
    }
    let other = estimates(&turned, 100.0);
    let permuted = |g: [Vec2; 3]| [g[2], g[0], g[1]];
    assert_eq!(permuted(one.translational), other.translational);
    assert_eq!(permuted(one.rotational), other.rotational);
    assert_eq!(Rgb::new(one.irradiance.b, one.irradiance.r, one.irradiance.g), other.irradiance);
}

#[test]
fn only_the_thesis_overlooks_the_wall() {
    let e = estimates(&hemisphere(6, PLACES[1]), 100.0);
    let thesis = radii_of(Criterion::Thesis, &e, 1.0).natural;
    for criterion in [Criterion::Ward88, Criterion::Ward92, Criterion::Krivanek06] {
        assert!(thesis > 20.0 * radii_of(criterion, &e, 1.0).natural, "{criterion:?}");
    }
}

fn plain(hessian: [f32; 3], gradient: f32) -> Estimates {
    Estimates {
        irradiance: Rgb::splat(2.0),
        translational: [Vec2::new(gradient, 0.0); 3],
        rotational: [Vec2::ZERO; 3],
        hessian,
        harmonic_mean_distance: 3.0,
        arithmetic_mean_distance: 5.0,
        minimum_distance: 1.0,
        rotational_curvature: 0.5,
        rim: [f32::INFINITY; 32],
    }
}

#[test]
fn hessian_radii_follow_their_formula() {
    let bounds = RadiusBounds { least: 1e-3, largest: 10.0, reference: 0.5 };
    let mut settings = RadiusSettings::new(Criterion::Hessian);
    settings.ellipse = true;
    let e = plain([-8.0, 0.0, 2.0], 0.0);
    for exponent in [0.25, 1.0 / 3.0, 0.5] {
        settings.exponent = exponent;
        let r = radii(&e, &bounds, &settings);
        // λ̂ = 4 and 1 per square length: Λ = 1 and 1/4.
        let short = 0.5 * (2.0 * settings.epsilon).powf(exponent);
        let long = (0.5 * (8.0 * settings.epsilon).powf(exponent)).min(2.0 * short);
        assert!((r.radii[0] - short).abs() < 1e-6 && (r.radii[1] - long).abs() < 1e-6);
        assert!((r.axis.x.abs() - 1.0).abs() < 1e-6);
        assert_eq!(r.gradient_scale, 1.0);
    }
    // At η = 1/2 the error at the rim is ε whatever ℓ is.
    let rim = 0.5 * 4.0 * radii(&e, &bounds, &settings).radii[0].powi(2);
    assert!((rim - settings.epsilon).abs() < 1e-6);
    settings.ellipse = false;
    let circle = radii(&e, &bounds, &settings);
    assert_eq!(circle.radii[0], circle.radii[1]);
    // Nothing changes: what is near limits, and the light's slope.
    settings.exponent = 0.25;
    assert_eq!(radii(&plain([0.0; 3], 0.0), &bounds, &settings).radii, [3.0; 2]);
    let steep = radii(&plain([0.0; 3], 4.0), &bounds, &settings);
    assert!((steep.radii[0] - 0.5).abs() < 1e-6);
    assert_ne!(steep.flags & Record::GRADIENT_LIMITED, 0);
    // In the dark.
    let dark = Estimates { irradiance: Rgb::BLACK, ..plain([0.0; 3], 0.0) };
    assert_eq!(radii(&dark, &bounds, &settings).radii, [3.0; 2]);
    settings.dark = 1.0;
    let dark = Estimates { irradiance: Rgb::BLACK, ..plain([1.0, 0.0, 0.0], 0.0) };
    assert!(radii(&dark, &bounds, &settings).radii[0] > 0.1);
}

#[test]
fn a_better_accuracy_never_makes_larger_radii() {
    let e = estimates(&hemisphere(8, PLACES[3]), 100.0);
    let bounds = RadiusBounds { least: 1e-4, largest: 10.0, reference: 0.1 };
    for criterion in ALL {
        let mut last = 0.0;
        for k in 1..20 {
            let mut settings = RadiusSettings::new(criterion);
            settings.accuracy = 0.05 * k as f32;
            settings.epsilon = 0.05 * k as f32;
            let r = radii(&e, &bounds, &settings).radii[0];
            assert!(r >= last, "{criterion:?}");
            last = r;
        }
    }
}

#[test]
fn the_lower_bound_and_crevices() {
    let bounds = RadiusBounds { least: 0.1, largest: 10.0, reference: 0.5 };
    let mut settings = RadiusSettings::new(Criterion::Hessian);
    settings.limit_by_gradient = false;
    let of = |natural: f32, rule: CreviceRule| {
        let e = Estimates { harmonic_mean_distance: natural, ..plain([0.0; 3], 1.0) };
        radii(&e, &bounds, &RadiusSettings { crevice: rule, ..settings })
    };
    let off = of(0.01, CreviceRule::Off);
    assert_eq!((off.radii, off.flags), ([0.1; 2], Record::RAISED));
    assert!((off.gradient_scale - 0.1).abs() < 1e-6);
    let shrink = of(0.01, CreviceRule::Shrink { spread: 4.0 });
    assert_eq!((shrink.radii, shrink.flags), ([0.04; 2], Record::RAISED | Record::CREVICE));
    assert!((shrink.gradient_scale - 0.25).abs() < 1e-6);
    let fade = of(0.01, CreviceRule::Fade { spread: 4.0 });
    assert_eq!((fade.radii, fade.flags), ([0.1; 2], Record::RAISED | Record::CREVICE));
    // Continuous where the rule begins.
    let edge = of(0.025, CreviceRule::Shrink { spread: 4.0 });
    assert_eq!((edge.radii, edge.flags), ([0.1; 2], Record::RAISED));
    let above = of(20.0, CreviceRule::Off);
    assert_eq!((above.radii, above.flags), ([10.0; 2], Record::LOWERED));
    // Without any region a record is not valid.
    let none = of(0.0, CreviceRule::Shrink { spread: 4.0 });
    let record = plain([0.0; 3], 1.0).record(1, Vec3::ZERO, &Frame::from_normal(Vec3::Z), &none);
    assert!(!record.is_valid());
}

#[test]
fn records_are_in_the_world() {
    let e = estimates(&hemisphere(9, PLACES[3]), 100.0);
    let n = Vec3::new(0.3, -0.5, 0.4).normalize();
    let frame = Frame::from_normal(n);
    for criterion in ALL {
        let r = radii_of(criterion, &e, 1.0);
        let record = e.record(7, Vec3::ONE, &frame, &r);
        assert!(record.is_valid());
        assert!(record.axis.dot(n).abs() < 1e-6);
        for k in 0..3 {
            assert!(record.translational[k].dot(n).abs() < 1e-5);
            let local = frame.to_local(record.translational[k]).truncate();
            let expected = e.translational[k] * r.gradient_scale;
            assert!((local - expected).length() < 1e-5);
        }
    }
    assert!((ward_angle(0.2).to_degrees() - 16.26).abs() < 0.01);
    assert_eq!(clamped_by_neighbour(5.0, 1.0, 2.0, 1.0), 3.0);
    assert_eq!(clamped_by_neighbour(2.0, 1.0, 2.0, 1.0), 2.0);
}
