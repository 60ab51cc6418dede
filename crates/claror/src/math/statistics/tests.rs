use approx::assert_relative_eq;

use super::*;
use glam::Vec3Swizzles;

use crate::math::warp;

#[test]
fn quantiles_and_tails() {
    assert_relative_eq!(normal_quantile(0.975), 1.959_963_984_540_054, max_relative = 1e-12);
    assert_relative_eq!(normal_quantile(0.5), 0.0, epsilon = 1e-12);
    assert_relative_eq!(normal_quantile(1e-9), -5.997_807_015_007_686, max_relative = 1e-9);
    assert_relative_eq!(normal_tail(1.0), 0.158_655_253_931_457, max_relative = 1e-12);
    assert_relative_eq!(normal_tail(-1.0), 1.0 - 0.158_655_253_931_457, max_relative = 1e-12);
    assert_relative_eq!(student_quantile_two_sided(0.05, 10.0), 2.228_138_85, max_relative = 1e-8);
    assert_relative_eq!(student_two_sided(2.0, 1.0), 0.295_167_235, max_relative = 1e-8);
    assert_relative_eq!(chi_square_tail(3.841_458_820_694_124, 1.0), 0.05, max_relative = 1e-9);
    assert_relative_eq!(sidak(0.05, 1), 0.05, max_relative = 1e-12);
    assert_relative_eq!(1.0 - (1.0 - sidak(0.01, 50)).powi(50), 0.01, max_relative = 1e-9);
}

#[test]
fn moments_of_known_numbers() {
    let mut m = Moments::default();
    for x in [2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0] {
        m.add(x);
    }
    assert_relative_eq!(m.mean, 5.0);
    assert_relative_eq!(m.variance(), 32.0 / 7.0);
    assert_relative_eq!(m.p_value(5.0), 1.0);
    assert!(m.p_value(50.0) < 1e-6);
}

#[test]
fn quadrature_is_exact_for_polynomials() {
    for n in [1, 4, 32, 128] {
        let nodes = gauss_legendre(n);
        assert_relative_eq!(nodes.iter().map(|p| p.1).sum::<f64>(), 2.0, max_relative = 1e-13);
        // Degree 2n - 2, even: 2/(2n - 1).
        let degree = 2 * n as i32 - 2;
        let integral: f64 = nodes.iter().map(|(x, w)| w * x.powi(degree)).sum();
        assert_relative_eq!(integral, 2.0 / f64::from(degree + 1), max_relative = 1e-11);
    }
}

/// Level of each test below: a correct sampler fails one of them in ten thousand programs.
const LEVEL: f64 = 1e-4;

fn cosine(d: Vec3) -> f64 {
    f64::from(d.z.max(0.0)) / std::f64::consts::PI
}

fn run(map: impl Fn(Vec2) -> Vec3, pdf: impl Fn(Vec3) -> f64) -> ChiSquare {
    let mut rng = TestRng::new(1);
    SphereTest::default().run(|_| Some(map(rng.next_vec2())), pdf)
}

#[test]
fn warps_have_their_densities() {
    let sphere = run(warp::uniform_sphere, |_| f64::from(warp::UNIFORM_SPHERE_PDF));
    assert!(sphere.p_value > LEVEL, "{sphere:?}");
    let hemisphere = run(warp::uniform_hemisphere, |d| {
        if d.z > 0.0 { f64::from(warp::UNIFORM_HEMISPHERE_PDF) } else { 0.0 }
    });
    assert!(hemisphere.p_value > LEVEL, "{hemisphere:?}");
    let cosine = run(warp::cosine_hemisphere, cosine);
    assert!(cosine.p_value > LEVEL, "{cosine:?}");
    // Cells are a tenth high: a cone down to cos θ = 0.4 ends at a cell's edge.
    let cone = run(
        |u| warp::uniform_cone(u, 0.6),
        |d| if d.z > 0.4 { f64::from(warp::uniform_cone_pdf(0.6)) } else { 0.0 },
    );
    assert!(cone.p_value > LEVEL, "{cone:?}");
}

#[test]
fn disk_and_triangle_are_uniform() {
    let mut rng = TestRng::new(2);
    let samples = 100_000;
    let mut disk = vec![0.0; 64];
    let mut triangle = vec![0.0; 64];
    for _ in 0..samples {
        // Equal areas: eight rings in r² times eight sectors.
        let p = warp::concentric_disk(rng.next_vec2());
        let turn = (p.y.atan2(p.x) / std::f32::consts::TAU).rem_euclid(1.0);
        disk[(p.length_squared() * 7.999_99) as usize * 8 + (turn * 7.999_99) as usize] += 1.0;
        // The triangle unfolded to a square: 1 - (1 - b1)² and b2/(1 - b1) are uniform.
        let b = warp::uniform_triangle(rng.next_vec2());
        assert!(b.x >= 0.0 && b.y >= 0.0 && b.x + b.y <= 1.0);
        let x = 1.0 - (1.0 - b.x) * (1.0 - b.x);
        let y = b.y / (1.0 - b.x);
        triangle[(x * 7.999_99) as usize * 8 + (y * 7.999_99) as usize] += 1.0;
    }
    let expected = vec![samples as f64 / 64.0; 64];
    for observed in [disk, triangle] {
        let test = chi_square(&observed, &expected);
        assert!(test.p_value > LEVEL && test.dof == 63.0, "{test:?}");
    }
}

/// The test itself must be able to fail: each of these mutants is wrong by little.
#[test]
fn mutants_are_rejected() {
    let scaled = run(warp::cosine_hemisphere, |d| 1.02 * cosine(d));
    assert!(scaled.p_value < 1e-6, "density 2 % too large: {scaled:?}");
    let scaled = run(warp::cosine_hemisphere, |d| 0.98 * cosine(d));
    assert!(scaled.p_value < 1e-6, "density 2 % too small: {scaled:?}");
    let dropped = run(warp::cosine_hemisphere, |d| {
        if d.z > 0.0 { f64::from(warp::UNIFORM_HEMISPHERE_PDF) } else { 0.0 }
    });
    assert!(dropped.p_value < 1e-6, "dropped cosine: {dropped:?}");
    let swapped = run(|u| warp::cosine_hemisphere(u).zyx(), cosine);
    assert!(swapped.p_value < 1e-6, "swapped axes: {swapped:?}");
    let mut rng = TestRng::new(3);
    let lossy = SphereTest::default()
        .run(|i| (i % 50 != 0).then(|| warp::cosine_hemisphere(rng.next_vec2())), cosine);
    assert!(lossy.p_value < 1e-6, "samples lost: {lossy:?}");
}
