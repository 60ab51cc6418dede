//! Weights and interpolation.

use super::ALL;
use crate::irradiance::{
    CreviceRule, Criterion, Index, Interpolated, LookupSettings, Query, RadiusSettings, Record,
    Weight, lookup, weight,
};
use crate::math::statistics::TestRng;
use crate::math::{Frame, Vec3};
use crate::spectrum::Rgb;

pub(super) fn record(p: Vec3, n: Vec3, radius: f32) -> Record {
    Record {
        key: 0,
        position: p,
        normal: n,
        axis: Frame::from_normal(n).s,
        irradiance: Rgb::new(1.0, 2.0, 0.5),
        translational: [Vec3::ZERO; 3],
        rotational: [Vec3::ZERO; 3],
        radii: [radius, 1.5 * radius],
        max_angle: 0.35,
        harmonic_mean_distance: 1.0,
        natural_radius: radius,
        corral: 0,
        corral_distance: f32::INFINITY,
        flags: 0,
    }
}

pub(super) fn at(p: Vec3, n: Vec3) -> Query {
    Query { p, n_smooth: n, n_shading: n }
}

pub(super) fn settings(criterion: Criterion) -> LookupSettings {
    LookupSettings::new(&RadiusSettings::new(criterion))
}

fn all(records: &[Record], query: &Query, settings: &LookupSettings) -> Option<Interpolated> {
    lookup(records, &Index::All(records.len() as u32), query, settings)
}

pub(super) fn unit(rng: &mut TestRng) -> Vec3 {
    crate::math::warp::uniform_sphere(rng.next_vec2())
}

#[test]
fn a_record_serves_its_own_position() {
    let mut rng = TestRng::new(1);
    for criterion in ALL {
        for _ in 0..1000 {
            // Not quite unit: 1 - n·n may be negative.
            let n = unit(&mut rng) * (1.0 + 1e-6 * (rng.next_f32() - 0.5));
            let mut r = record(100.0 * unit(&mut rng), n, 0.1);
            r.translational = [3.0 * r.axis; 3];
            r.rotational = [2.0 * r.axis; 3];
            let query = at(r.position, n);
            let found = all(&[r], &query, &settings(criterion)).expect("its own");
            assert!(found.weight.is_finite() && found.records == 1);
            for k in 0..3 {
                assert!((found.irradiance[k] - r.irradiance[k]).abs() < 1e-5);
            }
        }
    }
    assert!(all(&[], &at(Vec3::ZERO, Vec3::Z), &settings(Criterion::Ward88)).is_none());
}

#[test]
fn linear_fields_are_exact_and_quadratic_ones_cancel() {
    let mut rng = TestRng::new(2);
    let slope = Vec3::new(0.7, -0.4, 0.0);
    let linear = |p: Vec3| 5.0 + slope.dot(p);
    let records: Vec<Record> = (0..40)
        .map(|_| {
            let p = (2.0 * rng.next_vec2() - 1.0).extend(0.0);
            let mut r = record(p, Vec3::Z, 1.0);
            r.irradiance = Rgb::splat(linear(p));
            r.translational = [slope; 3];
            r
        })
        .collect();
    for criterion in [Criterion::Ward92, Criterion::Krivanek06, Criterion::Hessian] {
        for mix in [0.0, 0.5, 1.0] {
            let settings = LookupSettings { mix, ..settings(criterion) };
            for _ in 0..200 {
                let p = (rng.next_vec2() - 0.5).extend(0.0);
                let e = all(&records, &at(p, Vec3::Z), &settings).expect("covered").irradiance;
                assert!((e.r - linear(p)).abs() < 1e-5);
            }
        }
    }
    // x² + 10 between two records: with half of the mean gradient there is no error in the middle.
    let pair = [-0.5_f32, 0.5].map(|x| {
        let mut r = record(Vec3::new(x, 0.0, 0.0), Vec3::Z, 1.0);
        r.irradiance = Rgb::splat(x * x + 10.0);
        r.translational = [Vec3::new(2.0 * x, 0.0, 0.0); 3];
        r
    });
    let middle = at(Vec3::ZERO, Vec3::Z);
    let of = |mix: f32| {
        let settings = LookupSettings { mix, ..settings(Criterion::Hessian) };
        all(&pair, &middle, &settings).expect("covered").irradiance.r
    };
    assert!((of(0.0) - 9.75).abs() < 1e-5);
    assert!((of(0.5) - 10.0).abs() < 1e-5);
    assert!((of(1.0) - 10.25).abs() < 1e-5);
}

#[test]
fn rotation_is_extrapolated_by_the_shading_normal() {
    let mut r = record(Vec3::ZERO, Vec3::Z, 1.0);
    // Light from +x: see the rotational gradient's convention.
    r.rotational = [Vec3::Y; 3];
    let tilted = Vec3::new(0.1, 0.0, 1.0).normalize();
    let query = Query { p: Vec3::ZERO, n_smooth: Vec3::Z, n_shading: tilted };
    for mix in [0.0, 0.5] {
        let settings = LookupSettings { mix, ..settings(Criterion::Hessian) };
        let e = all(&[r], &query, &settings).expect("its own").irradiance;
        assert!((e.r - 1.0 - tilted.x).abs() < 1e-6);
    }
}

#[test]
fn extrapolation_is_clamped() {
    let mut r = record(Vec3::ZERO, Vec3::Z, 1.0);
    r.translational = [Vec3::new(1e3, 0.0, 0.0); 3];
    let settings = LookupSettings { min_weight: 0.0, ..settings(Criterion::Hessian) };
    let e = |x: f32| all(&[r], &at(Vec3::new(x, 0.0, 0.0), Vec3::Z), &settings).unwrap().irradiance;
    assert_eq!(e(0.5), 20.0 * r.irradiance);
    assert_eq!(e(-0.5), 0.05 * r.irradiance);
}

#[test]
fn records_in_front_and_behind_are_rejected() {
    let floor = at(Vec3::ZERO, Vec3::Z);
    for criterion in ALL {
        let valid =
            |p: Vec3, n: Vec3| weight(&record(p, n, 1.0), &floor, &settings(criterion)).is_some();
        assert!(valid(Vec3::new(0.1, 0.1, 0.0), Vec3::Z), "{criterion:?}");
        // On top of a box beside the query, and in a pit.
        assert!(!valid(Vec3::new(0.05, 0.0, 0.1), Vec3::Z));
        assert!(valid(Vec3::new(0.05, 0.0, -0.1), Vec3::Z));
        // The other side, and a wall.
        assert!(!valid(Vec3::new(0.05, 0.0, 0.0), -Vec3::Z));
        assert!(!valid(Vec3::new(0.05, 0.0, 0.0), Vec3::X));
        // Too far.
        assert!(!valid(Vec3::new(2.2, 0.0, 0.0), Vec3::Z));
    }
}

/// Points of one tilted plane are all on it up to rounding: with a tolerance none is rejected, on
/// any scale; without, about half of them.
#[test]
fn coplanar_records_need_a_tolerance() {
    let mut rng = TestRng::new(4);
    for scale in [1e-3_f32, 1.0, 1e3] {
        let (mut rejected, mut rejected_without, count) = (0, 0, 2000);
        for _ in 0..count {
            let frame = Frame::from_normal(unit(&mut rng));
            let far = scale * Vec3::new(30.0, -20.0, 10.0);
            let mut point = || far + scale * frame.to_world((0.1 * rng.next_vec2()).extend(0.0));
            let (r, query) = (record(point(), frame.n, scale), at(point(), frame.n));
            for (criterion, count) in
                [(Criterion::Ward88, &mut rejected), (Criterion::Thesis, &mut rejected_without)]
            {
                *count += u32::from(weight(&r, &query, &settings(criterion)).is_none());
            }
        }
        assert_eq!(rejected, 0);
        assert!(rejected_without > count / 4, "{rejected_without} at {scale}");
    }
}

#[test]
fn smooth_kernel_ends_without_a_step() {
    let s = settings(Criterion::Hessian);
    let r = record(Vec3::ZERO, Vec3::Z, 1.0);
    let w = |p: Vec3, n: Vec3| weight(&r, &at(p, n), &s).map_or(0.0, |(w, _)| w);
    assert_eq!(w(Vec3::ZERO, Vec3::Z), 1.0);
    // Along the short axis, along the long one, below, and by angle.
    let across = Vec3::Z.cross(r.axis);
    assert!((w(0.6 * r.axis, Vec3::Z) - 0.75 * 0.75).abs() < 1e-5);
    assert!((w(0.6 * 1.5 * across, Vec3::Z) - 0.75 * 0.75).abs() < 1e-5);
    assert!((w(-0.3 * Vec3::Z, Vec3::Z) - 0.0).abs() < 1e-5, "behind the record's plane");
    let tilted = |angle: f32| Vec3::new(angle.sin(), 0.0, angle.cos());
    assert!((w(Vec3::ZERO, tilted(0.175)) - 0.75 * 0.75).abs() < 4e-3);
    for (edge, step) in [(1.2 * r.axis, r.axis), (1.8 * across, across)] {
        assert!(w(edge - 1e-3 * step, Vec3::Z) < 1e-4);
        assert_eq!(w(edge + 1e-3 * step, Vec3::Z), 0.0);
    }
    assert!(w(Vec3::ZERO, tilted(0.349)) < 1e-3);
    assert_eq!(w(Vec3::ZERO, tilted(0.351)), 0.0);
}

#[test]
fn published_weights() {
    let n = Vec3::new(0.1, 0.0, 1.0).normalize();
    let r = record(Vec3::ZERO, Vec3::Z, 0.2);
    let query = at(Vec3::new(0.0, 0.05, 0.0), n);
    let s = settings(Criterion::Ward88);
    assert_eq!(s.weight, Weight::InverseError { accuracy: 0.2 });
    // The radius is that of the region: the distance over accuracy times the mean distance.
    let error = 0.05 / (0.2 / 0.2) + (1.0 - n.z).sqrt();
    assert!((weight(&r, &query, &s).unwrap().0 - 1.0 / error).abs() < 1e-3);
    assert!(weight(&r, &at(Vec3::new(0.0, 0.17, 0.0), n), &s).is_none());
    let tent = weight(&r, &query, &settings(Criterion::Tabellion04)).unwrap().0;
    assert!(
        (tent - (1.0 - 0.25_f32.max((1.0 - n.z).sqrt() / (1.0 - 0.35_f32.cos()).sqrt()))).abs()
            < 1e-4
    );
}

#[test]
fn only_the_nearest() {
    let records: Vec<Record> =
        (0..8).map(|k| record(Vec3::new(0.1 * (8 - k) as f32, 0.0, 0.0), Vec3::Z, 1.0)).collect();
    let s = LookupSettings { nearest: 3, ..settings(Criterion::Hessian) };
    let query = at(Vec3::ZERO, Vec3::Z);
    let found = all(&records, &query, &s).unwrap();
    assert_eq!(found.records, 3);
    let nearest = all(&records[5..], &query, &settings(Criterion::Hessian)).unwrap();
    assert_eq!((found.irradiance, found.weight), (nearest.irradiance, nearest.weight));
}

#[test]
fn rims_are_not_enough() {
    let r = record(Vec3::ZERO, Vec3::Z, 1.0);
    let s = settings(Criterion::Hessian);
    let far = at(1.05 * r.axis, Vec3::Z);
    assert!(weight(&r, &far, &s).is_some() && all(&[r], &far, &s).is_none());
    // Two of them are still less than one half.
    assert!(all(&[r, r], &far, &s).is_none());
}

#[test]
fn faded_crevices_are_outvoted() {
    let mut radius = RadiusSettings::new(Criterion::Hessian);
    radius.crevice = CreviceRule::Fade { spread: 4.0 };
    let s = LookupSettings::new(&radius);
    let mut crevice = record(Vec3::ZERO, Vec3::Z, 1.0);
    crevice.flags = Record::CREVICE;
    crevice.natural_radius = 0.025;
    crevice.irradiance = Rgb::BLACK;
    let query = at(Vec3::ZERO, Vec3::Z);
    let (w, _) = weight(&crevice, &query, &s).unwrap();
    assert!((w - 0.01).abs() < 1e-6);
    assert!(all(&[crevice], &query, &s).is_none());
    let ordinary = record(Vec3::new(0.1, 0.0, 0.0), Vec3::Z, 1.0);
    let e = all(&[crevice, ordinary], &query, &s).unwrap().irradiance;
    assert!(e.r > 0.98 * ordinary.irradiance.r);
}

#[test]
fn more_records_than_fit_do_not_depend_on_the_order() {
    let mut rng = TestRng::new(6);
    let records: Vec<Record> = (0..200)
        .map(|_| {
            let mut r = record((0.1 * rng.next_vec2()).extend(0.0), Vec3::Z, 1.0);
            r.irradiance = Rgb::splat(rng.next_f32());
            r
        })
        .collect();
    let s = settings(Criterion::Hessian);
    let query = at(Vec3::ZERO, Vec3::Z);
    let one = all(&records, &query, &s).unwrap();
    let frozen = lookup(&records, &Index::frozen(&records, s.reach()), &query, &s).unwrap();
    assert_eq!(one, frozen);
    assert_eq!(one.records, 64);
}
