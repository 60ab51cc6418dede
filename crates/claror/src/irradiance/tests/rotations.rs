//! Turning normals.

use super::scene::{Quad, Scene};
use crate::irradiance::{
    Cell, Grid, Hemisphere, angular_support, rotational_curvature, rotational_gradient,
};
use crate::math::statistics::TestRng;
use crate::math::{Vec2, Vec3};
use crate::spectrum::Rgb;

/// Light from the half space around `m`, on a grid about z.
fn half_space(m: Vec3, grid: Grid) -> Hemisphere {
    let (columns, _) = grid.size();
    let cells = (0..grid.len() as u32).map(|k| {
        let direction = grid.direction(k % columns, k / columns, Vec2::splat(0.5));
        let l = if direction.dot(m) > 0.0 { 1.0 } else { 0.0 };
        Cell { direction, distance: 1.0, normal: Vec3::ZERO, flags: 0, radiance: Rgb::splat(l) }
    });
    Hemisphere::new(grid, cells.collect()).expect("a cell each")
}

/// An infinite plane tilted by β has form factor (1 + cos β)/2: its derivative by β.
#[test]
fn tilted_plane() {
    for grid in [Grid::Concentric { n: 128 }, Grid::Polar { m: 80, n: 240 }] {
        for (beta, azimuth) in [(0.4_f32, 0.3_f32), (0.9, 2.0), (1.3, -2.5)] {
            let towards = Vec2::from_angle(azimuth);
            let m = (beta.sin() * towards).extend(beta.cos());
            let h = half_space(m, grid);
            let pi = std::f32::consts::PI;
            assert!((h.irradiance().r - pi * 0.5 * (1.0 + beta.cos())).abs() < 0.01);
            let gradient = rotational_gradient(&h)[1];
            // The normal turns towards the lit side by a small angle: β falls.
            let delta = 1e-2;
            let n = (delta * towards).extend(1.0);
            let change = Vec3::Z.cross(n).dot(gradient.extend(0.0)) / delta;
            let exact = 0.5 * pi * beta.sin();
            assert!((change - exact).abs() < 0.03 * exact, "{beta}: {change} {exact}");
            // Across there is none.
            assert!(gradient.dot(towards).abs() < 0.03 * exact);
            let curvature = beta.cos() / (1.0 + beta.cos());
            assert!((rotational_curvature(&h) - curvature).abs() < 0.02, "{beta}");
        }
    }
}

/// Against the irradiance of the same scene, turned, from many samples.
#[test]
fn gradient_is_the_difference_of_turned_receivers() {
    let scene = Scene::room([4.0, 3.0, 2.5], [1.0, 0.2, 0.6, 0.3, 0.8]);
    let grid = Grid::Concentric { n: 256 };
    let mut rng = TestRng::new(5);
    let x = [1.1, 0.9, 0.5];
    let h = scene.hemisphere(x, grid, &mut rng);
    let gradient = rotational_gradient(&h)[0];
    // Weighted samples of the same directions, away from the dark below the horizon: the change
    // is that of the cosine, and what comes up at the horizon adds only to second order.
    for tau in [Vec2::X, Vec2::Y] {
        let change: f64 = h
            .cells
            .iter()
            .map(|c| f64::from(c.radiance.r * c.direction.truncate().dot(tau) / c.direction.z))
            .sum::<f64>()
            * std::f64::consts::PI
            / h.cells.len() as f64;
        let mine = Vec3::Z.cross(tau.extend(1.0)).dot(gradient.extend(0.0));
        assert!((f64::from(mine) - change).abs() < 0.05, "{mine} {change}");
    }
}

#[test]
fn irradiance_rises_towards_the_light() {
    let lamp = Quad::new([0.8, -0.3, 0.6], [0.5, 0.0, 0.0], [0.0, 0.6, 0.0], 1.0);
    let scene = Scene { quads: vec![lamp], ..Scene::default() };
    let h = scene.hemisphere([0.0; 3], Grid::Concentric { n: 32 }, &mut TestRng::new(2));
    let e = super::estimates(&h, 100.0);
    assert!(e.translational[0].x > 0.0);
    let tilted = Vec3::new(0.1, 0.0, 1.0).normalize();
    assert!(Vec3::Z.cross(tilted).dot(e.rotational[0].extend(0.0)) > 0.0);
}

#[test]
fn angular_supports() {
    let bounds = [5_f32.to_radians(), 20_f32.to_radians()];
    assert_eq!(angular_support(0.0, 0.1, bounds), bounds[1]);
    assert_eq!(angular_support(1e6, 0.1, bounds), bounds[0]);
    assert!((angular_support(1.0, 0.015, bounds) - 0.03_f32.sqrt()).abs() < 1e-6);
}
