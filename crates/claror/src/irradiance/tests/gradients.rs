//! Translational gradients and Hessians against exact values.
//!
//! Root mean square error (of the vector; of xx, xy and yy) over 64 sets of 24 × 24 cells, without
//! noise / with the radiance of each cell 0 or twice its value. Rooms are 4 × 3 × 2.5 m with walls
//! of radiance 1, 0.2, 0.6, 0.3 and a ceiling of 0.8; the plate is 0.7 × 0.6 m at a height of 1 m.
//! Ward and Heckbert's estimate has 14 × 42 cells.
//!
//! | receiver; exact gradient | farthest | average | surfaces | Ward-Heckbert |
//! |---|---|---|---|---|
//! | middle (-.238, -.041) | .021 / .122 | .015 / .097 | .0003 / .100 | .028 / .107 |
//! | .2 m from a wall (-.429, -.137) | .157 / .75 | .080 / .59 | .0007 / .58 | .235 / .68 |
//! | .05 m (-.369, -.057) | .684 / 3.1 | .304 / 2.4 | .0005 / 2.4 | .845 / 2.8 |
//! | corner (-.462, .385) | .090 / .52 | .058 / .43 | .001 / .44 | .147 / .54 |
//! | below the plate (-.221, -.199) | .031 / .213 | .031 / .127 | .011 / .155 | .024 / .257 |
//! | beside it (-.182, -.199) | .102 / .178 | .082 / .128 | .017 / .107 | .048 / .135 |
//! | sphere overhead (.333, .222) | .071 / .130 | .210 / .317 | .057 / .149 | .058 / .143 |
//! | small sphere (.047, .031) | .034 / .039 | .039 / .125 | .019 / .040 | .013 / .031 |
//! | room of gradual walls (.076, .120) | .027 / .199 | .036 / .154 | .006 / .155 | .047 / .169 |
//!
//! | exact Hessian | farthest | average | surfaces |
//! |---|---|---|---|
//! | middle (.085, -.046, -.198) | .034 / .221 | .026 / .195 | .0003 / .197 |
//! | .2 m (.092, -.224, -.179) | .257 / 7.2 | .112 / 6.0 | .0004 / 6.0 |
//! | corner (1.288, -.281, -1.333) | .33 / 3.9 | .228 / 3.6 | .0006 / 3.6 |
//! | below the plate (.795, -.009, .672) | .343 / .43 | .613 / .63 | .035 / .21 |
//! | beside it (-.257, .180, -.043) | .162 / .33 | .163 / .28 | .052 / .24 |
//! | sphere (-.669, .295, -.914) | .745 / .82 | .312 / .64 | .77 / .88 |
//!
//! What is left to wish for: a curved occluder's edge wanders over its surface when the receiver
//! moves, which a mesh of fixed points does not know, so the Hessian of a sphere is too large.

use super::scene::{Quad, Scene, Sphere, differences};
use crate::irradiance::{
    Derivatives, Grid, Hemisphere, MeshRule, MeshSettings, MeshTopology, luminance_gradient,
    mesh_derivatives, ward_heckbert_gradient,
};
use crate::math::statistics::TestRng;
use crate::math::{DVec3, Vec2};
use crate::spectrum::Rgb;

/// 4 × 3 × 2.5 m; radiance 1, 0.2, 0.6, 0.3 on the walls and 0.8 on the ceiling.
fn room() -> Scene {
    Scene::room([4.0, 3.0, 2.5], [1.0, 0.2, 0.6, 0.3, 0.8])
}

/// The room with a dark plate over its middle.
fn room_with_plate() -> Scene {
    let mut scene = room();
    scene.quads.push(Quad::new([1.65, 1.2, 1.0], [0.7, 0.0, 0.0], [0.0, 0.6, 0.0], 0.05));
    scene
}

fn sphere(radius: f64) -> Scene {
    let centre = DVec3::new(0.3, 0.2, 1.0);
    Scene { spheres: vec![Sphere { centre, radius, radiance: 1.0 }], ..Scene::default() }
}

fn estimate(hemisphere: &Hemisphere, rule: MeshRule) -> Derivatives {
    let (n, _) = hemisphere.grid.size();
    let settings = MeshSettings { rule, ..MeshSettings::new(100.0) };
    mesh_derivatives(hemisphere, &MeshTopology::new(n), &settings).expect("same grid")
}

/// Root mean square errors of gradient and Hessian; the scene's grey is turned to colours in the
/// ratio 1 : 0.5 : 2, see [`Scene::hemisphere`].
fn errors(scene: &Scene, x: [f64; 3], n: u32, rule: MeshRule, noise: f32) -> [f64; 2] {
    let (gradient, hessian) = differences(|x| scene.irradiance(x, 5), x, 1e-3);
    let luminance = f64::from(Rgb::new(1.0, 0.5, 2.0).luminance());
    let mut rng = TestRng::new(1);
    let runs = 64;
    let mut sums = [0.0; 2];
    for _ in 0..runs {
        let mut h = scene.hemisphere(x, Grid::Concentric { n }, &mut rng);
        for c in &mut h.cells {
            c.radiance *= 1.0 + if rng.next_f32() < 0.5 { noise } else { -noise };
        }
        let d = estimate(&h, rule);
        let g = d.gradient[0].to_array();
        sums[0] += g.iter().zip(gradient).map(|(g, e)| (f64::from(*g) - e).powi(2)).sum::<f64>();
        let h = d.hessian.map(|h| f64::from(h) / luminance);
        sums[1] += h.iter().zip(hessian).map(|(h, e)| (h - e).powi(2)).sum::<f64>();
    }
    sums.map(|s| (s / f64::from(runs)).sqrt())
}

/// The numbers of this file's tables (but Ward and Heckbert's), for more cells: `cargo test -p claror --lib -- --ignored
/// --nocapture errors_of_all_rules`.
#[test]
#[ignore = "prints a table"]
fn errors_of_all_rules() {
    let mut gradual = room();
    for quad in &mut gradual.quads {
        quad.slope = 1.0;
    }
    let cases = [
        ("middle", room(), [1.3, 1.1, 0.0]),
        (".2 m", room(), [0.2, 1.9, 0.0]),
        (".05 m", room(), [0.05, 1.4, 0.0]),
        ("corner", room(), [0.3, 0.25, 0.0]),
        ("below plate", room_with_plate(), [2.0, 1.4, 0.0]),
        ("beside plate", room_with_plate(), [2.9, 0.9, 0.0]),
        ("sphere", sphere(0.4), [0.0; 3]),
        ("small sphere", sphere(0.15), [0.0; 3]),
        ("gradual", gradual, [1.3, 1.1, 0.0]),
    ];
    for (name, scene, x) in cases {
        println!("{name}: {:.3?}", differences(|x| scene.irradiance(x, 5), x, 1e-3));
        for rule in [MeshRule::Farthest, MeshRule::Average, MeshRule::Surfaces] {
            for n in [16, 24, 32] {
                let [g, h] = errors(&scene, x, n, rule, 0.0);
                let [gn, hn] = errors(&scene, x, n, rule, 1.0);
                println!("{rule:>9?} {n}: {g:.4} / {gn:.3}, {h:.4} / {hn:.3}");
            }
        }
    }
}

/// In rooms without occluders the rule by surfaces finds the lines exactly: nothing is left but the
/// room's corners, where three of them meet.
#[test]
fn rooms_are_exact() {
    for x in [[1.3, 1.1, 0.0], [0.2, 1.9, 0.0], [0.05, 1.4, 0.0], [0.3, 0.25, 0.0]] {
        for n in [16, 24, 32] {
            let [gradient, hessian] = errors(&room(), x, n, MeshRule::Surfaces, 0.0);
            assert!(gradient < 5e-3 && hessian < 5e-3, "{x:?} {n}: {gradient} {hessian}");
            // The published rule is not, which is what it is compared with.
            let [published, _] = errors(&room(), x, n, MeshRule::Farthest, 0.0);
            assert!(published > 4.0 * gradient, "{x:?} {n}: {published}");
        }
    }
}

#[test]
fn occluders_are_seen() {
    for (x, limits) in [([2.0, 1.4, 0.0], [0.1, 0.2]), ([2.9, 0.9, 0.0], [0.15, 0.25])] {
        let scene = room_with_plate();
        let (gradient, hessian) = differences(|x| scene.irradiance(x, 5), x, 1e-3);
        let size = [gradient[0].hypot(gradient[1]), hessian[0].hypot(hessian[2])];
        let error = errors(&scene, x, 24, MeshRule::Surfaces, 0.0);
        let published = errors(&scene, x, 24, MeshRule::Farthest, 0.0);
        for k in 0..2 {
            assert!(error[k] < limits[k] * size[k], "{x:?}: {error:?} of {size:?}");
            assert!(error[k] < published[k] / 2.0, "{x:?}: {error:?} {published:?}");
        }
        // It converges.
        let fine = errors(&scene, x, 96, MeshRule::Surfaces, 0.0);
        assert!(fine[0] < 0.4 * error[0], "{fine:?} {error:?}");
    }
}

/// With noise all estimates are about as good as each other: the rule by surfaces is not worse than
/// the published one anywhere.
#[test]
fn noise_is_not_amplified() {
    let cases = [
        (room(), [1.3, 1.1, 0.0]),
        (room(), [0.3, 0.25, 0.0]),
        (room_with_plate(), [2.0, 1.4, 0.0]),
        (room_with_plate(), [2.9, 0.9, 0.0]),
        (sphere(0.4), [0.0, 0.0, 0.0]),
    ];
    for (scene, x) in cases {
        let mine = errors(&scene, x, 24, MeshRule::Surfaces, 1.0);
        let published = errors(&scene, x, 24, MeshRule::Farthest, 1.0);
        for k in 0..2 {
            assert!(mine[k] < 1.15 * published[k], "{x:?}: {mine:?} {published:?}");
        }
    }
}

#[test]
fn gradual_radiance_and_spheres() {
    let mut gradual = room();
    for quad in &mut gradual.quads {
        quad.slope = 1.0;
    }
    let x = [1.3, 1.1, 0.0];
    let [gradient, hessian] = errors(&gradual, x, 24, MeshRule::Surfaces, 0.0);
    assert!(gradient < 0.01 && hessian < 0.01, "{gradient} {hessian}");
    // E = π ρ² z/|v|³, of which the gradient is (.333, .222).
    for (radius, limit) in [(0.4, 0.2), (0.15, 0.5)] {
        let [gradient, _] = errors(&sphere(radius), [0.0; 3], 24, MeshRule::Surfaces, 0.0);
        let exact = 0.4 * (radius / 0.4_f64).powi(2);
        assert!(gradient < limit * exact, "{radius}: {gradient} of {exact}");
    }
}

/// Constant radiance has no derivatives, however jagged the mesh is.
#[test]
fn furnace() {
    let mut scene = room_with_plate();
    for quad in &mut scene.quads {
        quad.radiance = 0.7;
    }
    scene.spheres.push(Sphere { centre: DVec3::new(1.0, 1.0, 0.4), radius: 0.2, radiance: 0.7 });
    let mut rng = TestRng::new(2);
    for rule in [MeshRule::Farthest, MeshRule::Average, MeshRule::Surfaces] {
        for x in [[2.0, 1.4, 0.0], [0.05, 1.0, 0.0], [0.8, 0.9, 0.0]] {
            let h = scene.hemisphere(x, Grid::Concentric { n: 24 }, &mut rng);
            let d = estimate(&h, rule);
            assert!(d.gradient.iter().all(|g| g.length() < 1e-12), "{d:?}");
            assert!(d.hessian.iter().all(|h| h.abs() < 1e-12), "{d:?}");
            let e = f64::from(h.irradiance().r);
            assert!((e - 0.7 * std::f64::consts::PI).abs() < 1e-5);
        }
    }
}

/// Of a strip of wall before nothing: F = ½(1 − x/√(x² + h²)).
#[test]
fn strip_of_wall() {
    let (x, h): (f64, f64) = (0.7, 0.9);
    let strip = Quad::new([x, -200.0, 0.0], [0.0, 400.0, 0.0], [0.0, 0.0, h], 1.0);
    let scene = Scene { quads: vec![strip], ..Scene::default() };
    let s = scene.hemisphere([0.0; 3], Grid::Concentric { n: 64 }, &mut TestRng::new(3));
    let d = estimate(&s, MeshRule::Surfaces);
    // The receiver moves towards the wall: x falls.
    let first = 0.5 * std::f64::consts::PI * h * h * (x * x + h * h).powf(-1.5);
    let second = 1.5 * std::f64::consts::PI * h * h * x * (x * x + h * h).powf(-2.5);
    let luminance = f64::from(Rgb::new(1.0, 0.5, 2.0).luminance());
    assert!((f64::from(d.gradient[0].x) - first).abs() < 0.02 * first, "{d:?} {first}");
    assert!((f64::from(d.hessian[0]) / luminance - second).abs() < 0.05 * second, "{second}");
    assert!(d.gradient[0].y.abs() < 0.02 && f64::from(d.hessian[2]).abs() < 0.05);
}

#[test]
fn ward_heckbert_converges() {
    let scene = room_with_plate();
    let x = [2.0, 1.4, 0.0];
    let (exact, _) = differences(|x| scene.irradiance(x, 5), x, 1e-3);
    for (grid, tolerance) in
        [(Grid::Polar { m: 16, n: 48 }, 0.2), (Grid::Polar { m: 64, n: 192 }, 0.05)]
    {
        let h = scene.hemisphere(x, grid, &mut TestRng::new(4));
        let g = ward_heckbert_gradient(&h).expect("polar")[0];
        let error = (f64::from(g.x) - exact[0]).hypot(f64::from(g.y) - exact[1]);
        assert!(error < tolerance * exact[0].hypot(exact[1]), "{grid:?} {g} {exact:?}");
    }
    let h = scene.hemisphere(x, Grid::Concentric { n: 4 }, &mut TestRng::new(4));
    assert!(ward_heckbert_gradient(&h).is_none());
}

#[test]
fn without_normals_depth_decides() {
    let scene = room_with_plate();
    let x = [2.0, 1.4, 0.0];
    let (exact, _) = differences(|x| scene.irradiance(x, 5), x, 1e-3);
    let mut h = scene.hemisphere(x, Grid::Concentric { n: 32 }, &mut TestRng::new(5));
    for c in &mut h.cells {
        c.normal = crate::math::Vec3::ZERO;
    }
    let g = estimate(&h, MeshRule::Surfaces).gradient[0];
    let error = (f64::from(g.x) - exact[0]).hypot(f64::from(g.y) - exact[1]);
    assert!(error < 0.2 * exact[0].hypot(exact[1]), "{g} {exact:?}");
}

/// A black plate in a room without light has no radiance to tell it by.
#[test]
fn geometric_term_sees_dark_occluders() {
    let mut scene = room_with_plate();
    for quad in &mut scene.quads {
        quad.radiance = 0.0;
    }
    let h = scene.hemisphere([2.0, 1.4, 0.0], Grid::Concentric { n: 24 }, &mut TestRng::new(6));
    let topology = MeshTopology::new(24);
    let mut settings = MeshSettings::new(100.0);
    let of = |settings| mesh_derivatives(&h, &topology, &settings).expect("same grid");
    assert_eq!(of(settings), Derivatives::default());
    settings.geometry = 0.01;
    settings.floor = 1.0;
    let d = of(settings);
    assert_eq!(d.gradient, [Vec2::ZERO; 3]);
    assert!(d.hessian[0].abs() > 1e-3 && d.hessian[2].abs() > 1e-3, "{d:?}");
    assert_eq!(luminance_gradient(&[Vec2::X; 3]).y, 0.0);
}
