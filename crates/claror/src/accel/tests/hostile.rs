//! The builder meets whatever a file may hold.

use super::*;
use std::time::{Duration, Instant};

fn built(mesh: Mesh) -> (ShapeTable, Accel) {
    let mut table = ShapeTable::default();
    add_mesh(&mut table, mesh);
    let accel = Accel::build(&table).unwrap();
    accel.validate(&table).unwrap();
    (table, accel)
}

fn triangles(corners: impl Iterator<Item = [Vec3; 3]>) -> Mesh {
    let mut mesh = Mesh::default();
    for corners in corners {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners);
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    mesh
}

const UNIT: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];

fn from_above() -> Ray {
    Ray::new(Vec3::new(0.2, 0.3, 2.0), Vec3::NEG_Z)
}

#[test]
fn nothing_is_met_in_an_empty_scene() {
    let table = ShapeTable::default();
    let accel = Accel::build(&table).unwrap();
    accel.validate(&table).unwrap();
    assert!(accel.bounds().is_empty());
    assert!(accel.intersect(&table, &from_above()).is_none());
    assert!(!accel.occluded(&table, &from_above()));
    let (table, accel) = built(Mesh::default());
    assert!(accel.intersect(&table, &from_above()).is_none());
}

#[test]
fn few_triangles_make_small_trees() {
    for count in 1..40 {
        let shifted = |i: i32| UNIT.map(|p| p + Vec3::Z * -(i as f32));
        let (table, accel) = built(triangles((0..count).map(shifted)));
        let hit = accel.intersect(&table, &from_above()).unwrap();
        assert_eq!((hit.t, hit.primitive), (2.0, 0));
        let short = Ray { t_max: 1.9, ..from_above() };
        assert!(accel.intersect(&table, &short).is_none() && !accel.occluded(&table, &short));
        let exact = Ray { t_max: 2.0, ..from_above() };
        assert!(accel.intersect(&table, &exact).is_some() && accel.occluded(&table, &exact));
    }
}

/// Of equally close triangles the first is hit, whatever the order of the traversal.
#[test]
fn coincident_triangles_are_built_quickly_and_the_first_is_hit() {
    let start = Instant::now();
    let (table, accel) = built(triangles(std::iter::repeat_n(UNIT, 100_000)));
    let elapsed = start.elapsed();
    assert!(elapsed < Duration::from_secs(5), "{elapsed:?}");
    assert_eq!(accel.intersect(&table, &from_above()).unwrap().primitive, 0);
    assert!(accel.occluded(&table, &from_above()));
    assert!(accel.memory_bytes() < 100_000 * 100);
}

#[test]
fn what_is_not_finite_is_left_out() {
    let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX];
    let broken = bad.iter().flat_map(|&x| {
        (0..9).map(move |i| {
            let mut corners = UNIT;
            corners[i / 3][i % 3] = x;
            corners
        })
    });
    let (table, accel) = built(triangles(broken.chain([UNIT])));
    let hit = accel.intersect(&table, &from_above()).unwrap();
    assert_eq!(hit.primitive, 36);
    assert!(accel.bounds().max.is_finite());
    let (table, accel) = built(triangles(std::iter::once([Vec3::NAN; 3])));
    assert!(accel.bounds().is_empty() && accel.intersect(&table, &from_above()).is_none());
}

#[test]
fn rays_that_are_not_finite_end() {
    let table = mixed_scene();
    let accel = Accel::build(&table).unwrap();
    let values = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0, -0.0, f32::MAX, 1e-40, 1.0];
    let mut n = Numbers(31);
    let mut pick = || values[(n.next() * values.len() as f32) as usize];
    for _ in 0..20_000 {
        let mut vector = || Vec3::new(pick(), pick(), pick());
        let (o, d) = (vector(), vector());
        let ray = Ray { o, d, t_max: pick() };
        std::hint::black_box((accel.intersect(&table, &ray), accel.occluded(&table, &ray)));
    }
}

/// Sizes that halve again and again tempt the heuristic to split off one at a time.
#[test]
fn trees_are_not_too_deep() {
    let scaled = |i: i32| UNIT.map(|p| (p + Vec3::Z) * 0.5_f32.powi(i));
    let (table, accel) = built(triangles((0..120).map(scaled)));
    assert!(accel.intersect(&table, &from_above()).is_some());
    let grown = |i: i32| UNIT.map(|p| (p + 0.1) * 1.5_f32.powi(i - 60));
    built(triangles((0..150).map(grown)));
    // Degenerate ones: points and lines.
    let points = (0..1000).map(|i| [Vec3::splat(i as f32); 3]);
    let lines = (0..1000).map(|i| [Vec3::ZERO, Vec3::X * i as f32, Vec3::X]);
    built(triangles(points.chain(lines)));
}

#[test]
fn the_tree_does_not_depend_on_the_threads() {
    let mut n = Numbers(32);
    let mut table = ShapeTable::default();
    let mesh = soup(&mut n, 30_000, 0.1);
    add_mesh(&mut table, mesh);
    let build = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Accel::build(&table).unwrap())
    };
    let bits = |accel: &Accel| -> Vec<u32> {
        accel.top.rows.iter().flat_map(|row| row.0.map(f32::to_bits)).collect()
    };
    let one = bits(&build(1));
    assert!(one == bits(&build(2)) && one == bits(&build(7)));
}

#[test]
fn an_instance_of_nothing_is_an_error() {
    let mut table = ShapeTable::default();
    table.instances.push(Instance { group: GroupId(3), transform: Transform::IDENTITY });
    let error = Accel::build(&table).unwrap_err();
    assert_eq!(error, AccelError::NoSuchGroup { instance: 0, group: 3 });
}

#[test]
fn empty_groups_are_met_nowhere() {
    let mut table = ShapeTable::default();
    table.groups.push(ShapeGroup::default());
    table.instances.push(Instance { group: GroupId(0), transform: Transform::IDENTITY });
    let accel = Accel::build(&table).unwrap();
    accel.validate(&table).unwrap();
    assert!(accel.intersect(&table, &from_above()).is_none());
}

/// Ten million triangles; a minute and 2 GB, so only when asked for.
#[test]
#[ignore = "takes 2 GB and a minute"]
fn ten_million_triangles_fit_into_200_bytes_each() {
    let side = 2237;
    let mut mesh = Mesh::default();
    for j in 0..=side {
        for i in 0..=side {
            let (x, y) = (i as f32 / side as f32, j as f32 / side as f32);
            mesh.positions.push(Vec3::new(x, y, 0.02 * (50.0 * x).sin() * (40.0 * y).cos()));
        }
    }
    for j in 0..side {
        for i in 0..side {
            let a = (j * (side + 1) + i) as u32;
            let c = a + side as u32 + 1;
            mesh.triangles.extend([[a, a + 1, c + 1], [a, c + 1, c]]);
        }
    }
    let triangles = mesh.triangles.len();
    let own = mesh.positions.len() * size_of::<Vec3>() + triangles * size_of::<[u32; 3]>();
    let start = Instant::now();
    let mut table = ShapeTable::default();
    add_mesh(&mut table, mesh);
    let accel = Accel::build(&table).unwrap();
    let each = (accel.memory_bytes() + own) as f64 / triangles as f64;
    println!("{triangles} triangles, {each:.1} bytes each, {:?}", start.elapsed());
    assert!(triangles >= 10_000_000 && each < 200.0);
}
