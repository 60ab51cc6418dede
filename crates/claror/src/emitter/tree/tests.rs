use super::*;

use crate::math::statistics::{TestRng, chi_square};
use crate::math::warp::{around, uniform_cone, uniform_sphere};

fn random_in(rng: &mut TestRng, size: f32) -> Vec3 {
    (Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) - 0.5) * size
}

/// A box with a cone of normals.
fn random_light(rng: &mut TestRng) -> (Extent, f32) {
    let corner = random_in(rng, 10.0);
    let bounds = Bounds3 { min: corner, max: corner }.including(corner + random_in(rng, 0.5));
    let cos_normals = [1.0, 0.9, -0.3, -1.0][rng.next_u64() as usize % 4];
    let cos_emission = [0.0, 0.0, 0.8][rng.next_u64() as usize % 3];
    let axis = uniform_sphere(rng.next_vec2());
    (Extent { bounds, axis, cos_normals, cos_emission }, 0.01 + rng.next_f32().powi(4))
}

fn random_receiver(rng: &mut TestRng) -> Receiver {
    let n = uniform_sphere(rng.next_vec2());
    Receiver { p: random_in(rng, 14.0), n: (rng.next_f32() < 0.6).then_some(n) }
}

fn random_tree(rng: &mut TestRng, count: usize) -> (LightTree, Vec<(Extent, f32)>) {
    let lights: Vec<_> = (0..count).map(|_| random_light(rng)).collect();
    (LightTree::build(&lights), lights)
}

#[test]
fn probabilities_add_up_to_one() {
    let mut rng = TestRng::new(1);
    for count in [1, 2, 3, 17, 400] {
        let (tree, _) = random_tree(&mut rng, count);
        for _ in 0..20 {
            let at = random_receiver(&mut rng);
            let sum: f64 = (0..count).map(|l| f64::from(tree.probability(&at, l))).sum();
            // Where a node's bounds cannot exclude what those of both its children do, its share
            // is lost.
            let lost = (0..10_000)
                .filter(|i| tree.sample(&at, (f64::from(*i) + 0.5) / 10_000.0).is_none())
                .count();
            let expected = 1.0 - lost as f64 / 10_000.0;
            assert!((sum - expected).abs() < 2e-4 * (1.0 + lost as f64), "{sum}, {lost}");
            assert!(lost > 0 || (sum - 1.0).abs() < 1e-4, "{sum}");
        }
    }
}

/// Chi-square at level 10⁻⁴ for each of ten receivers.
#[test]
fn lights_are_chosen_with_their_probabilities() {
    let mut rng = TestRng::new(2);
    let (tree, lights) = random_tree(&mut rng, 60);
    let is_lit = |at: &Receiver| tree.sample(at, 0.5).is_some();
    let mut receivers = TestRng::new(4);
    let receivers = std::iter::repeat_with(|| random_receiver(&mut receivers)).filter(is_lit);
    for at in receivers.take(10) {
        let draws = 40_000;
        let mut observed = vec![0.0; lights.len() + 1];
        for _ in 0..draws {
            match tree.sample(&at, f64::from(rng.next_f32())) {
                Some((light, probability)) => {
                    let walked = tree.probability(&at, light);
                    assert!((probability - walked).abs() <= 1e-5 * walked);
                    observed[light] += 1.0;
                }
                None => observed[lights.len()] += 1.0,
            }
        }
        let mut expected: Vec<f64> =
            (0..lights.len()).map(|l| f64::from(tree.probability(&at, l) * draws as f32)).collect();
        expected.push((f64::from(draws) - expected.iter().sum::<f64>()).max(0.0));
        if observed[lights.len()] == 0.0 {
            observed.pop();
            expected.pop();
        }
        let test = chi_square(&observed, &expected);
        assert!(test.p_value > 1e-4, "{test:?}");
    }
}

/// A point of a light's box with a normal of its cone that sees a receiver must be possible.
#[test]
fn lights_that_can_contribute_are_never_excluded() {
    let mut rng = TestRng::new(3);
    let (tree, lights) = random_tree(&mut rng, 50);
    let mut contributing = 0;
    for _ in 0..100_000 {
        let light = rng.next_u64() as usize % lights.len();
        let extent = &lights[light].0;
        let place = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
        let p = extent.bounds.min + place * extent.bounds.extent();
        let n = around(extent.axis, uniform_cone(rng.next_vec2(), 1.0 - extent.cos_normals));
        let at = random_receiver(&mut rng);
        let wi = (p - at.p).normalize();
        let seen = -wi.dot(n) > extent.cos_emission && at.n.is_none_or(|n| wi.dot(n) > 0.0);
        if seen {
            contributing += 1;
            assert!(tree.probability(&at, light) > 0.0, "{extent:?} at {at:?}");
        }
    }
    assert!(contributing > 10_000, "{contributing}");
}

#[test]
fn nearer_and_brighter_lights_are_preferred() {
    let point = |x: f32, intensity| {
        let bounds = Bounds3 { min: Vec3::X * x, max: Vec3::X * x };
        (Extent { bounds, axis: Vec3::Z, cos_normals: -1.0, cos_emission: 0.0 }, intensity)
    };
    let tree = LightTree::build(&[point(-1.0, 1.0), point(3.0, 1.0), point(3.5, 9.0)]);
    let p = |x: f32| {
        let at = Receiver { p: Vec3::X * x, n: None };
        [0, 1, 2].map(|l| tree.probability(&at, l))
    };
    let [near, _, _] = p(-1.1);
    assert!(near > 0.95, "{near}");
    let [a, b, c] = p(100.0);
    assert!(c > 0.7 && a < 0.15 && b < 0.15, "{a}, {b}, {c}");
}

#[test]
fn hard_cases_are_survived() {
    let at = Receiver { p: Vec3::ZERO, n: Some(Vec3::Z) };
    assert!(LightTree::build(&[]).sample(&at, 0.5).is_none());
    let point = |p: Vec3, intensity| {
        let bounds = Bounds3 { min: p, max: p };
        (Extent { bounds, axis: Vec3::Z, cos_normals: -1.0, cos_emission: 0.0 }, intensity)
    };
    // All in one place, and the receiver there too.
    let tree = LightTree::build(&vec![point(Vec3::ZERO, 1.0); 10_000]);
    let sum: f32 = (0..10_000).map(|l| tree.probability(&at, l)).sum();
    assert!((sum - 1.0).abs() < 1e-3, "{sum}");
    // Distances in geometric series make a deep tree.
    let lights: Vec<_> = (0..120).map(|i| point(Vec3::Z * 1.4_f32.powi(i), 1.0)).collect();
    let tree = LightTree::build(&lights);
    let sum: f32 = (0..120).map(|l| tree.probability(&at, l)).sum();
    assert!((sum - 1.0).abs() < 1e-3, "{sum}");
    // Dark lights are never chosen.
    let tree = LightTree::build(&[point(Vec3::X, 0.0), point(Vec3::Y, 2.0)]);
    assert_eq!([0, 1].map(|l| tree.probability(&at, l)), [0.0, 1.0]);
    assert_eq!(tree.sample(&at, 0.999), Some((1, 1.0)));
}

#[test]
fn rare_lights_stay_possible() {
    // The faint light's share is far below the step of a random number of 24 bits.
    let point = |p: Vec3, intensity| {
        let bounds = Bounds3 { min: p, max: p };
        (Extent { bounds, axis: Vec3::Z, cos_normals: -1.0, cos_emission: 0.0 }, intensity)
    };
    let tree = LightTree::build(&[point(Vec3::X, 1e-9), point(-Vec3::X, 1.0)]);
    let at = Receiver { p: Vec3::ZERO, n: None };
    let p = tree.probability(&at, 0);
    assert!(p > 0.5e-9 && p < 2e-9, "{p}");
    let chosen = [0.0, 1e-7, 0.5, 1.0 - 1e-7, 1.0 - 1e-10].map(|u| tree.sample(&at, u).unwrap().0);
    assert!(chosen == [0, 1, 1, 1, 1] || chosen == [1, 1, 1, 1, 0], "{chosen:?}");
}
