//! Records that even out each other's noise.

use super::lookups::{record, settings};
use crate::irradiance::{Criterion, Record, Smoother, Uncertainty};
use crate::math::statistics::{Moments, TestRng};
use crate::math::{Bounds3, Vec3};
use crate::spectrum::Rgb;

/// Records along an edge of the square of side 1 that they fill, and their radius.
const EDGE: usize = 24;
const RADIUS: f32 = 1.5 / EDGE as f32;

/// Records at random places of a square, in cells that each have one.
fn square(irradiance: impl Fn(Vec3) -> f32) -> Vec<Record> {
    let mut rng = TestRng::new(7);
    (0..EDGE * EDGE)
        .map(|i| {
            let (x, y) = ((i % EDGE) as f32, (i / EDGE) as f32);
            let p = Vec3::new(x + rng.next_f32(), y + rng.next_f32(), 0.0) / EDGE as f32;
            let irradiance = Rgb::splat(irradiance(p));
            Record { irradiance, radii: [RADIUS; 2], ..record(p, Vec3::Z, RADIUS) }
        })
        .collect()
}

fn smoothed(records: &[Record], uncertainties: &[Uncertainty], reach: f32) -> Vec<f32> {
    let bounds = Bounds3 { min: Vec3::splat(-1.0), max: Vec3::splat(2.0) };
    let lookup = settings(Criterion::Hessian);
    let smoother = Smoother::new(records, uncertainties, bounds, &lookup, reach);
    (0..records.len()).map(|i| smoother.irradiance(i, |_| true).r).collect()
}

fn uncertain(count: usize, relative_error: f32, curvature: f32) -> Vec<Uncertainty> {
    vec![Uncertainty { relative_error, curvature }; count]
}

#[test]
fn what_gradients_know_is_kept() {
    let g = Vec3::new(0.8, -0.5, 0.0);
    let mut records = square(|p| 2.0 + g.dot(p));
    records.iter_mut().for_each(|r| r.translational = [g; 3]);
    let found = smoothed(&records, &uncertain(records.len(), 0.1, 0.0), 3.0);
    for (record, found) in records.iter().zip(found) {
        assert!((found - record.irradiance.r).abs() < 1e-5, "{record:?}: {found}");
    }
}

/// Noise of 5 % about the same irradiance: what is left is a third of it or less, of the same mean.
#[test]
fn noise_is_averaged() {
    let mut rng = TestRng::new(3);
    let mut records = square(|_| 1.0);
    let noise = 0.05 * 12.0_f32.sqrt();
    records.iter_mut().for_each(|r| r.irradiance.r += noise * (rng.next_f32() - 0.5));
    let moments = |values: &[f32]| {
        let mut moments = Moments::default();
        values.iter().for_each(|&v| moments.add(v.into()));
        moments
    };
    let before = moments(&records.iter().map(|r| r.irradiance.r).collect::<Vec<_>>());
    let after = moments(&smoothed(&records, &uncertain(records.len(), 0.05, 0.0), 3.0));
    assert!(before.variance().sqrt() > 0.04, "the test could tell nothing");
    assert!(after.variance().sqrt() < before.variance().sqrt() / 3.0, "{before:?}, then {after:?}");
    assert!((after.mean - before.mean).abs() < 3.0 * before.standard_error());
}

/// Where records are exact, where irradiance changes more than they are noisy, and where nobody sees
/// anybody, nothing happens.
#[test]
fn what_is_sure_or_differs_is_left_alone() {
    let records = square(|p| 1.0 + (40.0 * p.x).sin());
    let own: Vec<f32> = records.iter().map(|r| r.irradiance.r).collect();
    let n = records.len();
    assert_eq!(smoothed(&records, &uncertain(n, 0.0, 0.0), 3.0), own);
    assert_eq!(smoothed(&records, &uncertain(n, f32::NAN, 0.0), 3.0), own);
    assert_eq!(smoothed(&records, &uncertain(n, 0.05, f32::INFINITY), 3.0), own);
    let curved = smoothed(&records, &uncertain(n, 0.01, 1e6), 3.0);
    assert!(curved.iter().zip(&own).all(|(a, b)| (a - b).abs() < 1e-3));
    let bounds = Bounds3 { min: Vec3::splat(-1.0), max: Vec3::splat(2.0) };
    let uncertainties = uncertain(n, 0.1, 0.0);
    let lookup = settings(Criterion::Hessian);
    let smoother = Smoother::new(&records, &uncertainties, bounds, &lookup, 3.0);
    assert!((0..n).all(|i| smoother.irradiance(i, |_| false).r == own[i]));
    let together = smoothed(&records, &uncertainties, 3.0);
    assert!(
        together.iter().zip(&own).any(|(a, b)| (a - b).abs() > 0.1),
        "the test could tell nothing"
    );
}

/// Normals apart, or a step between surfaces: these are not neighbours.
#[test]
fn other_surfaces_do_not_count() {
    let lit = record(Vec3::ZERO, Vec3::Z, 0.1);
    let dark = |p: Vec3, n: Vec3| Record { irradiance: Rgb::BLACK, ..record(p, n, 0.1) };
    let mix = |other: Record| smoothed(&[lit, other], &uncertain(2, 0.5, 0.0), 3.0)[0];
    let beside = Vec3::new(0.05, 0.0, 0.0);
    assert!(mix(dark(beside, Vec3::Z)) < 0.9);
    assert_eq!(mix(dark(beside, Vec3::X)), 1.0);
    assert_eq!(mix(dark(beside, -Vec3::Z)), 1.0);
    assert_eq!(mix(dark(beside + 0.05 * Vec3::Z, Vec3::Z)), 1.0);
    assert_eq!(mix(dark(beside - 0.05 * Vec3::Z, Vec3::Z)), 1.0);
}

/// One record of fifty, by chance, is ten times as bright as the others, and knows that it is
/// uncertain. The mean of all keeps its share of a sixth.
#[test]
fn uncertain_records_keep_their_share_of_the_mean() {
    let mut records = square(|_| 1.0);
    let mut uncertainties = uncertain(records.len(), 0.05, 1.0);
    for (i, (record, uncertainty)) in records.iter_mut().zip(&mut uncertainties).enumerate() {
        // Not at the rim, where there are fewer neighbours.
        let is_inside = [i % EDGE, i / EDGE].iter().all(|x| (5..EDGE - 5).contains(x));
        if is_inside && i % 23 == 0 {
            record.irradiance = Rgb::splat(10.0);
            uncertainty.relative_error = 0.9;
        }
    }
    let mean = |values: &mut dyn Iterator<Item = f32>| values.sum::<f32>() / records.len() as f32;
    let before = mean(&mut records.iter().map(|r| r.irradiance.r));
    let after = mean(&mut smoothed(&records, &uncertainties, 3.0).into_iter());
    assert!(before > 1.1, "the test could tell nothing: {before}");
    assert!((after - before).abs() < 0.01 * before, "{before}, then {after}");
}
