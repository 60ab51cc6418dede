//! Turning normals.

use super::scene::{Quad, Scene};
use crate::irradiance::{
    Cell, Grid, Hemisphere, angular_support, rotational_curvature, rotational_gradient,
};
use crate::math::statistics::TestRng;
use crate::math::{DMat3, DVec2, DVec3, Vec2, Vec3};
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

/// The exact irradiance where the normal at `x` is turned by `angle` towards a tangent: the scene
/// turns the other way.
fn turned_irradiance(scene: &Scene, x: [f64; 3], tau: DVec3, angle: f64) -> f64 {
    let turn = DMat3::from_axis_angle(DVec3::Z.cross(tau), -angle);
    let mut turned = scene.clone();
    for quad in &mut turned.quads {
        quad.corner = turn * (quad.corner - DVec3::from(x));
        quad.u = turn * quad.u;
        quad.v = turn * quad.v;
    }
    turned.irradiance([0.0; 3], turned.quads.len())
}

/// Above the floor, so that walls come up at the horizon.
#[test]
fn derivatives_agree_with_differences() {
    let scene = Scene::room([4.0, 3.0, 2.5], [1.0, 0.2, 0.6, 0.3, 0.8]);
    let x = [1.1, 0.9, 0.5];
    let h = scene.hemisphere(x, Grid::Concentric { n: 256 }, &mut TestRng::new(5));
    let gradient = rotational_gradient(&h)[0];
    let mut largest = 0.0_f64;
    for k in 0..16 {
        let azimuth = std::f64::consts::PI * f64::from(k) / 16.0;
        let tau = DVec2::from_angle(azimuth).extend(0.0);
        let at = |angle: f64| turned_irradiance(&scene, x, tau, angle);
        let step = 1e-3;
        let first = (at(step) - at(-step)) / (2.0 * step);
        let second = (at(step) + at(-step) - 2.0 * at(0.0)) / (step * step);
        largest = largest.max((second / at(0.0)).abs());
        let mine = Vec3::Z.cross(tau.as_vec3()).dot(gradient.extend(0.0));
        // Cells of 1/256 at the edges between walls and at the horizon.
        assert!((f64::from(mine) - first).abs() < 0.02, "{azimuth}: {mine} {first}");
    }
    let mine = f64::from(rotational_curvature(&h));
    assert!((mine - largest).abs() < 0.02, "{mine} {largest}");
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
