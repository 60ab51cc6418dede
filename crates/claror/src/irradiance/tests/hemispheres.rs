//! Means, extremes and errors of hemispheres.

use super::scene::{Quad, Scene, form_factor};
use crate::irradiance::{Cell, Grid, Hemisphere};
use crate::math::statistics::{Moments, TestRng};
use crate::math::{DVec3, Vec2, Vec3};
use crate::spectrum::Rgb;

const GRIDS: [Grid; 2] = [Grid::Concentric { n: 64 }, Grid::Polar { m: 40, n: 120 }];

fn centred(scene: &Scene, x: [f64; 3], grid: Grid) -> Hemisphere {
    scene.hemisphere_with(x, grid, |_, _| Vec2::splat(0.5))
}

fn close(value: f32, expected: f64, relative: f64) {
    let error = (f64::from(value) - expected).abs();
    assert!(error <= relative * expected.abs(), "{value} is not {expected}");
}

#[test]
fn directions_are_unit_and_cosine_distributed() {
    let mut rng = TestRng::new(1);
    for grid in GRIDS {
        let (columns, rows) = grid.size();
        let (mut z, mut n) = (0.0, 0.0);
        for k in 0..grid.len() as u32 {
            let d = grid.direction(k % columns, k / columns, rng.next_vec2());
            assert!((d.length() - 1.0).abs() < 1e-6 && d.z >= 0.0);
            z += f64::from(d.z);
            n += 1.0;
        }
        assert_eq!(rows * columns, grid.len() as u32);
        // The mean cosine of that distribution is 2/3.
        assert!((z / n - 2.0 / 3.0).abs() < 1e-3);
    }
}

#[test]
fn harmonic_mean_distance_has_its_closed_forms() {
    let big = 1e5;
    let ceiling = Quad::new([-big, -big, 2.0], [2.0 * big, 0.0, 0.0], [0.0, 2.0 * big, 0.0], 1.0);
    let wall = |x: f64| Quad::new([x, -big, 0.0], [0.0, 2.0 * big, 0.0], [0.0, 0.0, big], 1.0);
    let of = |quads: Vec<Quad>, grid: Grid| {
        centred(&Scene { quads, ..Scene::default() }, [0.0; 3], grid).harmonic_mean_distance()
    };
    for grid in GRIDS {
        close(of(vec![ceiling], grid), 3.0, 0.01);
        let single = 1.5 * std::f64::consts::PI * 0.7;
        close(of(vec![wall(0.7)], grid), single, 0.01);
        // Inverses add.
        close(of(vec![wall(0.7), wall(-0.7)], grid), 0.5 * single, 0.01);
        assert_eq!(of(vec![], grid), f32::INFINITY);
    }
}

/// The regression test against the usual mistake.
#[test]
fn the_arithmetic_mean_fails_at_a_wall() {
    let room = Scene::room([4.0, 4.0, 2.5], [1.0; 5]);
    let h = centred(&room, [0.01, 2.0, 0.0], GRIDS[0]);
    let expected = 1.5 * std::f64::consts::PI * 0.01;
    close(h.harmonic_mean_distance(), expected, 0.1);
    assert!(f64::from(h.arithmetic_mean_distance()) > 20.0 * expected);
    // One miss destroys it.
    let mut h = h;
    h.cells[5].distance = f32::INFINITY;
    assert_eq!(h.arithmetic_mean_distance(), f32::INFINITY);
    close(h.harmonic_mean_distance(), expected, 0.1);
}

#[test]
fn minimum_distances() {
    let room = Scene::room([4.0, 4.0, 2.5], [1.0; 5]);
    let mut h = centred(&room, [0.5, 2.0, 0.0], GRIDS[1]);
    assert!((h.minimum_distance() - 0.51).abs() < 0.01);
    assert!(h.robust_minimum_distance() < 0.7);
    // A speck that one ray hits, and one at the horizon.
    let steep = h.cells.iter().position(|c| c.direction.z > 0.9).unwrap();
    h.cells[steep].distance = 1e-3;
    let last = h.cells.len() - 1;
    h.cells[last].distance = 1e-5;
    assert!(h.cells[last].direction.z < 0.17);
    assert_eq!(h.minimum_distance(), 1e-3);
    assert!(h.robust_minimum_distance() > 0.5);
}

#[test]
fn irradiance_agrees_with_closed_forms() {
    // A rectangle with a corner above the receiver, a sphere, a strip of wall.
    let (a, b): (f64, f64) = (0.8, 1.4);
    let quad = Quad::new([0.0, 0.0, 1.0], [a, 0.0, 0.0], [0.0, b, 0.0], 1.0);
    let f = (a / a.hypot(1.0) * (b / a.hypot(1.0)).atan()
        + b / b.hypot(1.0) * (a / b.hypot(1.0)).atan())
        / std::f64::consts::TAU;
    let scene = Scene { quads: vec![quad], ..Scene::default() };
    assert!((scene.irradiance([0.0; 3], 1) - std::f64::consts::PI * f).abs() < 1e-12);
    let strip = Quad::new([0.7, -1e4, 0.0], [0.0, 2e4, 0.0], [0.0, 0.0, 0.9], 1.0);
    let f = 0.5 * (1.0 - 0.7 / 0.7_f64.hypot(0.9));
    assert!((form_factor(&strip.corners(DVec3::ZERO)) - f).abs() < 1e-8);
    // A disk, as a polygon of many sides.
    let (r, h, l): (f64, f64, f64) = (0.5, 0.8, 0.6);
    let disk: Vec<DVec3> = (0..4096)
        .map(|k| {
            let (sin, cos) = (f64::from(k) / 4096.0 * std::f64::consts::TAU).sin_cos();
            DVec3::new(l + r * cos, r * sin, h)
        })
        .collect();
    let (s, t) = (h * h + l * l + r * r, h * h + l * l - r * r);
    let f = 0.5 * (1.0 - t / (s * s - 4.0 * r * r * l * l).sqrt());
    assert!((form_factor(&disk) - f).abs() < 1e-6);
    for grid in GRIDS {
        let e = centred(&scene, [0.0; 3], grid).irradiance();
        close(e.r, scene.irradiance([0.0; 3], 1), 0.02);
        assert_eq!(e.g, 0.5 * e.r);
    }
}

/// The estimate from neighbours' differences against the spread of many estimates: never much too
/// small, and at most half too large for independent noise in the cells.
#[test]
fn relative_error_is_the_spread() {
    let room = Scene::room([4.0, 3.0, 2.5], [1.0, 0.2, 0.6, 0.3, 0.8]);
    let mut rng = TestRng::new(7);
    for grid in [Grid::Concentric { n: 16 }, Grid::Polar { m: 9, n: 28 }] {
        let (mut spread, mut estimate) = (Moments::default(), Moments::default());
        for _ in 0..400 {
            let mut h = room.hemisphere([1.2, 1.1, 0.0], grid, &mut rng);
            for c in &mut h.cells {
                c.radiance *= 2.0 * rng.next_f32();
            }
            spread.add(f64::from(h.irradiance().luminance()));
            estimate.add(f64::from(h.relative_error()));
        }
        let ratio = estimate.mean / (spread.variance().sqrt() / spread.mean);
        // The spread of 400 is known to 3.5 %.
        assert!(ratio > 0.88 && ratio < 1.5, "{grid:?}: {ratio}");
    }
}

#[test]
fn batches_average_radiance_and_keep_geometry() {
    let room = Scene::room([4.0, 3.0, 2.5], [1.0, 0.2, 0.6, 0.3, 0.8]);
    let mut rng = TestRng::new(9);
    let grid = Grid::Concentric { n: 8 };
    let batches: Vec<Hemisphere> =
        (0..3).map(|_| room.hemisphere([1.0, 1.0, 0.0], grid, &mut rng)).collect();
    let mut sum = batches[0].clone();
    sum.add_batch(&batches[1]);
    sum.add_batch(&batches[2]);
    assert_eq!(sum.batches, 3);
    for (k, cell) in sum.cells.iter().enumerate() {
        assert_eq!(cell.distance, batches[0].cells[k].distance);
        assert_eq!(cell.direction, batches[0].cells[k].direction);
        let mean = batches.iter().map(|b| b.cells[k].radiance.r).sum::<f32>() / 3.0;
        assert!((cell.radiance.r - mean).abs() < 1e-6);
    }
    let before = sum.clone();
    sum.add_batch(&room.hemisphere([1.0, 1.0, 0.0], Grid::Concentric { n: 4 }, &mut rng));
    assert_eq!(before.cells, sum.cells);
}

#[test]
fn odd_hemispheres_are_harmless() {
    let cell = Cell {
        direction: Vec3::Z,
        distance: f32::INFINITY,
        normal: Vec3::ZERO,
        flags: Cell::BACK_FACE,
        radiance: Rgb::BLACK,
    };
    assert!(Hemisphere::new(Grid::Concentric { n: 0 }, vec![]).is_none());
    assert!(Hemisphere::new(Grid::Concentric { n: 2 }, vec![cell]).is_none());
    let h = Hemisphere::new(Grid::Concentric { n: 1 }, vec![cell]).unwrap();
    assert_eq!(h.back_face_share(), 1.0);
    assert_eq!(h.relative_error(), 0.0);
    assert_eq!(h.irradiance(), Rgb::BLACK);
    assert_eq!(h.minimum_distance(), f32::INFINITY);
    let e = super::estimates(&h, 10.0);
    for criterion in super::ALL {
        let radii = super::radii_of(criterion, &e, 1.0);
        assert_eq!(radii.radii, [1.0; 2], "{criterion:?}");
    }
}

#[test]
fn directions_find_the_cell_that_they_lie_in() {
    for grid in [Grid::Concentric { n: 7 }, Grid::Polar { m: 5, n: 11 }] {
        let (columns, rows) = grid.size();
        for index in 0..grid.len() as u32 {
            let (i, j) = (index % columns, index / columns);
            assert!(j < rows);
            for jitter in [Vec2::new(0.01, 0.02), Vec2::new(0.5, 0.5), Vec2::new(0.98, 0.99)] {
                let direction = grid.direction(i, j, jitter);
                assert_eq!(grid.cell_of(direction), Some(index as usize), "{grid:?} {jitter}");
            }
        }
        assert_eq!(grid.cell_of(Vec3::new(0.6, 0.0, -0.8)), None);
        assert!(grid.cell_of(Vec3::Z).is_some());
    }
}
