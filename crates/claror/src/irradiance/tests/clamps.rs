//! Clamping by neighbours against all pairs.

use crate::irradiance::{NeighbourClamp, RadiusBounds, Record, clamped_by_neighbour, limited};
use crate::math::Vec3;
use crate::math::statistics::TestRng;

fn spheres(count: usize, seed: u64) -> Vec<(Vec3, f32)> {
    let mut rng = TestRng::new(seed);
    let mut point = || Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
    // Mostly large spheres, a few that are small or alike.
    (0..count).map(|i| (point(), if i % 9 == 0 { 0.01 } else { 2.0 * point().x.powi(4) })).collect()
}

/// Radii after clamping, by number.
fn clamped(spheres: &[(Vec3, f32)], order: &[usize], slope: f32) -> Vec<f32> {
    let mut clamp = NeighbourClamp::new(slope);
    let mut radii = vec![0.0; spheres.len()];
    for &i in order {
        let (p, r) = spheres[i];
        let own = clamp.insert(p, r, |k, limit| {
            assert!(limit < radii[order[k]], "only what shrinks is told");
            radii[order[k]] = limit;
        });
        radii[i] = own;
    }
    radii
}

/// The octree finds every pair that matters, to the bit, whatever the order.
#[test]
fn clamping_is_that_of_all_pairs_in_any_order() {
    for (slope, seed) in [(1.0, 5), (0.2, 6), (2.0, 7)] {
        let spheres = spheres(900, seed);
        let pairs: Vec<f32> = spheres
            .iter()
            .map(|(p, r)| {
                spheres.iter().fold(*r, |least, (q, s)| {
                    clamped_by_neighbour(least, *s, p.distance(*q), slope)
                })
            })
            .collect();
        let shrunk = pairs.iter().zip(&spheres).filter(|(r, s)| **r < s.1).count();
        assert!(shrunk > 300, "{shrunk} of 900");
        let forwards: Vec<usize> = (0..spheres.len()).collect();
        let backwards: Vec<usize> = (0..spheres.len()).rev().collect();
        let shuffled: Vec<usize> = (0..spheres.len()).map(|i| i * 389 % 900).collect();
        for order in [forwards, backwards, shuffled] {
            assert_eq!(clamped(&spheres, &order, slope), pairs);
        }
    }
}

#[test]
fn many_points_at_one_place_are_one() {
    let mut clamp = NeighbourClamp::new(1.0);
    let radii: Vec<f32> =
        (1..200).rev().map(|r| clamp.insert(Vec3::ONE, r as f32, |_, _| ())).collect();
    assert!(radii.is_sorted_by(|a, b| a > b));
    assert_eq!(clamp.insert(Vec3::ONE, f32::INFINITY, |_, _| ()), 1.0);
}

/// Bounds come last, gradients are scaled where the lower bound is in force, and what came before
/// leaves no trace.
#[test]
fn limits_respect_bounds() {
    let mut record: Record = super::lookups::record(Vec3::ZERO, Vec3::Z, 0.5);
    record.natural_radius = 0.5;
    record.radii = [0.5, 0.8];
    record.translational = [Vec3::X; 3];
    let bounds = RadiusBounds { least: 0.1, largest: 1.0, reference: 0.3 };
    assert_eq!(limited(&record, 0.7, &bounds), record);
    let some = limited(&record, 0.3, &bounds);
    assert_eq!((some.radii, some.translational[0]), ([0.3; 2], Vec3::X));
    assert_eq!(some.flags, Record::NEIGHBOUR_LIMITED);
    let much = limited(&record, 0.025, &bounds);
    assert_eq!((much.radii, much.translational[0]), ([0.1; 2], 0.25 * Vec3::X));
    assert_eq!(much.flags, Record::NEIGHBOUR_LIMITED | Record::RAISED);
    assert_eq!(much.natural_radius, 0.5, "that of the record itself");
}
