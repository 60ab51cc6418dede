//! Every model against numbers that Mitsuba 3.9 gives for the same plugin: see `reference.py`.

use super::materials;
use super::support::{Materials, interaction};
use crate::interaction::{SurfaceDerivatives, SurfaceInteraction};
use crate::math::{Frame, Vec2, Vec3};
use crate::shape::ShapeTable;

/// The point of `reference.py`.
fn turned_interaction(wo: Vec3) -> SurfaceInteraction {
    let s = Vec3::new(0.8, 0.0, -0.6);
    let t = Vec3::new(0.36, 0.8, 0.48);
    let n = Vec3::new(0.48, -0.6, 0.64);
    SurfaceInteraction {
        ng: n,
        frame: Frame { s, t, n },
        uv: Vec2::new(0.4, 0.45),
        derivatives: Some(SurfaceDerivatives {
            dp_du: 1.25 * s,
            dp_dv: 0.25 * s + 0.75 * t,
            dn_du: Vec3::ZERO,
            dn_dv: Vec3::ZERO,
        }),
        ..interaction(wo)
    }
}

/// Relative difference, where numbers below 1e-3 count as 1e-3.
fn difference(a: f32, b: f32) -> f32 {
    (a - b).abs() / a.abs().max(b.abs()).max(1e-3)
}

#[test]
fn values_and_densities_equal_mitsubas() {
    // Rounding in single precision; 16 000 pairs differed by 3e-5 at most.
    const TOLERANCE: f32 = 1e-4;
    let mut m = Materials::default();
    let list = materials::all(&mut m);
    m.prepare();
    let shapes = ShapeTable::default();
    let mut compared = vec![0; list.len()];
    for line in include_str!("reference.txt").lines() {
        let mut words = line.split(' ');
        let name = words.next().expect("a name");
        let x: Vec<f32> = words.map(|w| w.parse().expect("a number")).collect();
        let i = list.iter().position(|(n, _)| *n == name).expect("a known material");
        let si = turned_interaction(Vec3::new(x[0], x[1], x[2]));
        let bsdf = m.table.at_hit(&m.textures, &shapes, list[i].1, &si);
        let e = bsdf.eval(Vec3::new(x[3], x[4], x[5]));
        for (c, ours) in e.value.to_array().into_iter().enumerate() {
            let mitsuba = x[6 + c];
            assert!(difference(ours, mitsuba) < TOLERANCE, "{line}: {ours} in channel {c}");
        }
        // Behind an opaque `principled` Mitsuba states a density though it samples nothing there.
        if e.value.is_black() && name.starts_with("principled") && si.frame.to_local(si.wo).z < 0.0
        {
            assert_eq!(e.pdf, 0.0, "{line}");
        } else {
            assert!(difference(e.pdf, x[9]) < TOLERANCE, "{line}: density {}", e.pdf);
        }
        compared[i] += 1;
    }
    assert!(compared.iter().all(|&n| n >= 12), "{compared:?}");
}
