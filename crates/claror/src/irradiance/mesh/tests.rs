//! Edge integrals.

use super::edge;
use crate::math::DVec3;
use crate::math::statistics::TestRng;

/// π times the edge's part of the form factor.
fn form_factor(a: DVec3, b: DVec3) -> f64 {
    let c = a.cross(b);
    0.5 * c.z / c.length() * c.length().atan2(a.dot(b))
}

fn random_vertex(rng: &mut TestRng) -> DVec3 {
    let mut uniform = || 2.0 * f64::from(rng.next_f32()) - 1.0;
    DVec3::new(uniform(), uniform(), uniform().abs())
}

/// The edge's part as the receiver moves by (dx, dy).
fn moved(a: DVec3, b: DVec3, dx: f64, dy: f64) -> f64 {
    let d = DVec3::new(dx, dy, 0.0);
    form_factor(a - d, b - d)
}

#[test]
fn derivatives_agree_with_differences() {
    let mut rng = TestRng::new(3);
    for case in 0..2000 {
        let a = random_vertex(&mut rng);
        let b =
            if case % 2 == 0 { random_vertex(&mut rng) } else { a + 0.1 * random_vertex(&mut rng) };
        // Differences are not accurate where the edge passes the receiver closely.
        let nearest =
            (a - (b - a) * (a.dot(b - a) / (b - a).length_squared()).clamp(-1.0, 0.0)).length();
        if nearest < 0.2 {
            continue;
        }
        let d = edge::derivatives(a, b);
        let h = 1e-4;
        let f = |x: f64, y: f64| moved(a, b, x * h, y * h);
        let gradient =
            [(f(1.0, 0.0) - f(-1.0, 0.0)) / (2.0 * h), (f(0.0, 1.0) - f(0.0, -1.0)) / (2.0 * h)];
        let xx = (f(1.0, 0.0) + f(-1.0, 0.0) - 2.0 * f(0.0, 0.0)) / (h * h);
        let yy = (f(0.0, 1.0) + f(0.0, -1.0) - 2.0 * f(0.0, 0.0)) / (h * h);
        let xy = (f(1.0, 1.0) + f(-1.0, -1.0) - f(1.0, -1.0) - f(-1.0, 1.0)) / (4.0 * h * h);
        // The step's error is h² times derivatives that grow with the nearness.
        let tolerance = 1e-6 + 2.0 * h * h / nearest.powi(4);
        for (mine, other) in d.gradient.iter().zip(gradient) {
            assert!((mine - other).abs() < tolerance, "{a} {b}: {d:?} {gradient:?}");
        }
        let tolerance = 1e-5 + 20.0 * h * h / nearest.powi(5);
        for (mine, other) in d.hessian.iter().zip([xx, xy, yy]) {
            assert!((mine - other).abs() < tolerance, "{a} {b}: {d:?} {xx} {xy} {yy}");
        }
    }
}

#[test]
fn a_divided_edge_is_the_sum_of_its_parts() {
    // Also where an edge points at the receiver, or runs to a miss: closed forms fail there.
    let mut rng = TestRng::new(4);
    for case in 0..3000 {
        let a = random_vertex(&mut rng);
        let b = match case % 3 {
            0 => 1e3 * random_vertex(&mut rng),
            1 => a * 30.0 + 1e-9 * random_vertex(&mut rng),
            _ => random_vertex(&mut rng),
        };
        let whole = edge::derivatives(a, b);
        let parts = [0.0, 0.05, 0.3, 1.0].map(|t| a + t * (b - a));
        let mut sum = [0.0; 5];
        let mut size = [0.0; 5];
        for pair in parts.windows(2) {
            let d = edge::derivatives(pair[0], pair[1]);
            for (k, v) in d.gradient.into_iter().chain(d.hessian).enumerate() {
                sum[k] += v;
                size[k] += v.abs();
            }
        }
        for (k, v) in whole.gradient.into_iter().chain(whole.hessian).enumerate() {
            let scale = size.iter().fold(0.0_f64, |m, &s| m.max(s));
            assert!((v - sum[k]).abs() <= 2e-6 * scale, "{case} {k}: {a} {b} {v} {}", sum[k]);
        }
        let back = edge::derivatives(b, a);
        for (v, w) in whole.gradient.into_iter().zip(back.gradient) {
            assert!((v + w).abs() <= 1e-6 * (v.abs() + w.abs()) + 1e-12);
        }
    }
}

#[test]
fn edges_without_length_or_distance_are_harmless() {
    let a = DVec3::new(0.3, -0.2, 0.5);
    assert_eq!(edge::derivatives(a, a), edge::EdgeDerivatives::default());
    let d = edge::derivatives(1e-30 * a, a);
    assert!(d.gradient.into_iter().chain(d.hessian).all(f64::is_finite), "{d:?}");
}
