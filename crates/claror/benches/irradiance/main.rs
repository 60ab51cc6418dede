//! What look-ups and records cost, apart from rays.
//!
//! `cargo bench --bench irradiance`. Printed are the CPU time of a look-up in caches of different
//! size by the structure that lists the candidates, with how many candidates there are and how
//! many are used; and the CPU time of a record's gradient and Hessian by the number of cells.

#[path = "../trace/clock.rs"]
mod clock;

use claror::irradiance::{
    Bvh, Cell, Criterion, Grid, Hemisphere, Index, LookupSettings, MeshRule, MeshSettings,
    MeshTopology, Query, RadiusSettings, Record, lookup, mesh_derivatives, rotational_curvature,
    rotational_gradient, ward_heckbert_gradient,
};
use claror::math::statistics::TestRng;
use claror::math::{Bounds3, Vec3};
use claror::spectrum::Rgb;
use clock::Clock;

const QUERIES: usize = 1 << 16;
/// Queries that are answered by trying all records.
const FEW: usize = 1 << 10;

fn main() {
    println!(
        "{:>8}  {:>8}  {:>9}  {:>13}  {:>10}  {:>10}  {:>7}",
        "records", "index", "build s", "ns candidates", "ns look-up", "candidates", "records"
    );
    for count in [1000, 2000, 10_000, 100_000, 1_000_000] {
        look_ups(count);
    }
    println!("\n{:>8}  {:>10}  {:>12}", "cells", "estimator", "ms / record");
    for n in [16, 24, 32] {
        records(n);
    }
}

/// A random point on the walls of a unit cube, as a query.
fn wall_point(rng: &mut TestRng) -> Query {
    let axis = (rng.next_u64() % 3) as usize;
    let u = rng.next_vec2();
    let mut p = Vec3::ZERO;
    p[(axis + 1) % 3] = u.x;
    p[(axis + 2) % 3] = u.y;
    let mut n = Vec3::ZERO;
    n[axis] = 1.0;
    if rng.next_f32() < 0.5 {
        p[axis] = 1.0;
        n[axis] = -1.0;
    }
    Query { p, n_smooth: n, n_shading: n }
}

/// Records on the walls of a unit cube; radii between one and eight times the least, small ones
/// near the edges, such that a point has the same number of them whatever their number is.
fn cache(count: usize) -> Vec<Record> {
    let mut rng = TestRng::new(1);
    let scale = 1.0 / (count as f32).sqrt();
    let mut record = || {
        let Query { p, n_smooth: normal, .. } = wall_point(&mut rng);
        let radius = scale * (1.0 + 7.0 * rng.next_f32().powi(4));
        let axis = normal.any_orthonormal_vector();
        Record {
            key: 0,
            position: p,
            normal,
            axis,
            irradiance: Rgb::splat(1.0 + p.x),
            translational: [Vec3::X; 3],
            rotational: [axis; 3],
            radii: [radius; 2],
            max_angle: 0.35,
            harmonic_mean_distance: 1.0,
            natural_radius: radius,
            corral: 0,
            corral_distance: f32::INFINITY,
            flags: 0,
        }
    };
    (0..count).map(|_| record()).collect()
}

fn look_ups(count: usize) {
    let records = cache(count);
    let settings = LookupSettings::new(&RadiusSettings::new(Criterion::Hessian));
    let bounds = Bounds3 { min: Vec3::ZERO, max: Vec3::ONE };
    let mut rng = TestRng::new(2);
    let queries: Vec<Query> = (0..QUERIES).map(|_| wall_point(&mut rng)).collect();
    let indices = [
        ("all", Index::all()),
        ("octree", Index::octree(bounds, settings.reach())),
        ("bvh", Index::all()),
        ("frozen", Index::all()),
    ];
    for (name, mut index) in indices {
        let queries = if name == "all" { &queries[..FEW] } else { &queries[..] };
        if name == "all" && count > 10_000 {
            continue;
        }
        let (build, ()) = Clock::new().time(|| match name {
            "frozen" => index = Index::frozen(&records, settings.reach()),
            "bvh" => index = Index::Bvh(Bvh::new(&records, settings.reach())),
            _ => {
                for (record, k) in records.iter().zip(0..) {
                    index.insert(k, record);
                }
            }
        });
        let per_query = 1e9 / queries.len() as f64;
        let (listing, candidates) = Clock::new().time(|| {
            let mut candidates = 0;
            for query in queries {
                index.for_candidates(query.p, |i| candidates += 1 + (i >> 31) as usize);
            }
            candidates
        });
        let (looking, used) = Clock::new().time(|| {
            let found = queries.iter().filter_map(|q| lookup(&records, &index, q, &settings));
            found.map(|f| f.records as usize).sum::<usize>()
        });
        if let Index::Cells(cells) = &index {
            let references = cells.references() as f64 / count as f64;
            println!("{:>8}  {references:.1} references per record", "");
        }
        println!(
            "{count:>8}  {name:>8}  {build:>9.3}  {:>13.0}  {:>10.0}  {:>10.1}  {:>7.1}",
            listing * per_query,
            looking * per_query,
            candidates as f64 / queries.len() as f64,
            used as f64 / queries.len() as f64,
        );
    }
}

/// Noisy samples inside of a unit cube, from the middle of its floor; walls by normal.
fn hemisphere(grid: Grid, rng: &mut TestRng) -> Hemisphere {
    let (columns, rows) = grid.size();
    let cell = |k: u32| {
        let direction = grid.direction(k % columns, k / columns, rng.next_vec2());
        let room = Vec3::new(0.7, 0.6, 1.0);
        let along = (room / direction.abs()).min(Vec3::splat(1e9));
        let distance = along.min_element();
        let normal = Vec3::select(along.cmple(Vec3::splat(distance)), Vec3::ONE, Vec3::ZERO);
        let radiance = Rgb::splat(2.0 * rng.next_f32());
        Cell { direction, distance, normal, flags: 0, radiance }
    };
    let cells = (0..columns * rows).map(cell).collect();
    Hemisphere::new(grid, cells).expect("a cell each")
}

fn records(n: u32) {
    let mut rng = TestRng::new(3);
    let runs = 500;
    let topology = MeshTopology::new(n);
    let mut row = |name: &str, grid: Grid, f: &dyn Fn(&Hemisphere) -> f32| {
        let many: Vec<Hemisphere> = (0..runs).map(|_| hemisphere(grid, &mut rng)).collect();
        let (seconds, _) = Clock::new().time(|| many.iter().map(f).sum::<f32>());
        println!("{:>8}  {name:>10}  {:>12.4}", grid.len(), seconds * 1e3 / runs as f64);
    };
    let concentric = Grid::Concentric { n };
    for rule in [MeshRule::Farthest, MeshRule::Average, MeshRule::Surfaces] {
        let settings = MeshSettings { rule, ..MeshSettings::new(10.0) };
        row(&format!("{rule:?}"), concentric, &|h| {
            mesh_derivatives(h, &topology, &settings).map_or(0.0, |d| d.hessian[0])
        });
    }
    row("rotational", concentric, &|h| rotational_gradient(h)[0].x + rotational_curvature(h));
    let polar = Grid::Polar { m: n * 9 / 16, n: n * 16 / 9 };
    row("polar", polar, &|h| ward_heckbert_gradient(h).map_or(0.0, |g| g[0].x));
}
