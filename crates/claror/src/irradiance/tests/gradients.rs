//! Translational gradients and Hessians against exact values.

use super::scene::{Quad, Scene, differences};
use crate::irradiance::{
    Grid, MeshRule, MeshSettings, MeshTopology, luminance_gradient, mesh_derivatives,
    ward_heckbert_gradient,
};
use crate::math::statistics::TestRng;
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

#[test]
fn print_table() {
    let mut textured = room();
    for quad in &mut textured.quads {
        quad.slope = 1.0;
    }
    let sphere = Scene {
        spheres: vec![super::scene::Sphere {
            centre: crate::math::DVec3::new(0.3, 0.2, 1.0),
            radius: 0.4,
            radiance: 1.0,
        }],
        ..Scene::default()
    };
    let mut small = sphere.clone();
    small.spheres[0].radius = 0.15;
    let cases = [
        ("textured", textured.clone(), [1.3, 1.1, 0.0]),
        ("textured .3", textured, [0.3, 1.1, 0.0]),
        ("sphere", sphere, [0.0, 0.0, 0.0]),
        ("small sphere", small, [0.0, 0.0, 0.0]),
        ("plate", room_with_plate(), [2.0, 1.4, 0.0]),
        ("beside plate", room_with_plate(), [2.9, 0.9, 0.0]),
        ("middle", room(), [1.3, 1.1, 0.0]),
        (".2 m", room(), [0.2, 1.9, 0.0]),
        ("corner", room(), [0.3, 0.25, 0.0]),
        (".05 m", room(), [0.05, 1.4, 0.0]),
    ];
    for (name, scene, x, noise) in
        cases.into_iter().flat_map(|(n, s, x)| [(n, s.clone(), x, 0.0_f32), (n, s, x, 1.0)])
    {
        println!("noise {noise}");
        let (g, h) = differences(|x| scene.irradiance(x, 5), x, 1e-3);
        println!("{name}: E {:.4} g {g:.3?} h {h:.3?}", scene.irradiance(x, 5));
        for rule in [MeshRule::Farthest, MeshRule::Average, MeshRule::Surfaces] {
            for n in [16, 24, 32, 64, 128] {
                let topology = MeshTopology::new(n);
                let mut rng = TestRng::new(1);
                let (mut mg, mut mh) = ([0.0; 2], [0.0; 3]);
                let (mut eg, mut eh) = (0.0, 0.0);
                let runs = 64;
                let y = f64::from(Rgb::new(1.0, 0.5, 2.0).luminance());
                for _ in 0..runs {
                    let mut s = scene.hemisphere(x, Grid::Concentric { n }, &mut rng);
                    for c in &mut s.cells {
                        c.radiance *= if rng.next_f32() < 0.5 { 1.0 - noise } else { 1.0 + noise };
                    }
                    let settings = MeshSettings { rule, ..MeshSettings::new(100.0) };
                    let d = mesh_derivatives(&s, &topology, &settings).expect("same grid");
                    for k in 0..2 {
                        let v = f64::from(d.gradient[0][k]);
                        mg[k] += v / runs as f64;
                        eg += (v - g[k]).powi(2) / runs as f64;
                    }
                    for k in 0..3 {
                        let v = f64::from(d.hessian[k]) / y;
                        mh[k] += v / runs as f64;
                        eh += (v - h[k]).powi(2) / runs as f64;
                    }
                }
                println!(
                    "  {rule:?} {n}: mean g {mg:.3?} rms {:.3}; mean h {mh:.3?} rms {:.3}",
                    f64::sqrt(eg),
                    f64::sqrt(eh)
                );
            }
        }
        let mut rng = TestRng::new(1);
        let (mut mg, mut eg) = ([0.0; 2], 0.0);
        for _ in 0..64 {
            let mut s = scene.hemisphere(x, Grid::Polar { m: 14, n: 42 }, &mut rng);
            for c in &mut s.cells {
                c.radiance *= if rng.next_f32() < 0.5 { 1.0 - noise } else { 1.0 + noise };
            }
            let d = ward_heckbert_gradient(&s).expect("polar")[0];
            for k in 0..2 {
                mg[k] += f64::from(d[k]) / 64.0;
                eg += (f64::from(d[k]) - g[k]).powi(2) / 64.0;
            }
        }
        println!("  WH 14x42: mean g {mg:.3?} rms {:.3}", f64::sqrt(eg));
    }
    let _ = luminance_gradient;
}
