//! What building a tree costs: time, and memory in the end and while it is built.
//!
//! `cargo bench --bench build`, after `--` perhaps the numbers of triangles. They are those of a
//! wavy surface, triangles strewn about, or one triangle again and again. Times are CPU times of
//! one thread where the system tells them. The peak is what the process held at most (on Linux)
//! beyond what it held with the mesh alone; so that nothing freed before is used again unseen,
//! every tree has a process of its own.

#[path = "../trace/clock.rs"]
mod clock;

use claror::accel::Accel;
use claror::bsdf::BsdfId;
use claror::math::Vec3;
use claror::math::statistics::TestRng;
use claror::shape::{Mesh, MeshId, Shape, ShapeKind, ShapeTable};
use clock::Clock;
use std::process::Command;

/// Makes a mesh of about so many triangles.
type Maker = fn(usize) -> Mesh;

/// The third is the most that reinsertion takes on.
const COUNTS: [usize; 4] = [100_000, 1_000_000, 1 << 22, 10_000_000];
const KINDS: [(&str, Maker); 3] =
    [("surface", surface), ("strewn", strewn), ("coincident", coincident)];

fn main() {
    let args: Vec<String> = std::env::args().collect();
    if let [_, kind, count] = &args[..]
        && let Some((name, make)) = KINDS.into_iter().find(|(name, _)| name == kind)
    {
        let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
        let mesh = make(count.parse().expect("a number"));
        one_thread.install(|| bench(name, mesh));
        return;
    }
    let given: Vec<usize> = args.iter().filter_map(|arg| arg.parse().ok()).collect();
    let counts = if given.is_empty() { &COUNTS[..] } else { &given };
    println!("{:>31}   {:>23}", "", "bytes per triangle");
    println!(
        "{:<10} {:>10} {:>9}   {:>7} {:>7} {:>7}",
        "", "triangles", "s", "mesh", "tree", "peak"
    );
    for (name, _) in KINDS {
        for count in counts {
            let this = std::env::current_exe().expect("this program has a place");
            let ended = Command::new(this).args([name, &count.to_string()]).status();
            assert!(ended.is_ok_and(|status| status.success()));
        }
    }
}

fn bench(name: &str, mesh: Mesh) {
    let triangles = mesh.triangles.len();
    let each = |bytes: usize| bytes as f64 / triangles as f64;
    let own = each(size_of_val(&mesh.positions[..]) + size_of_val(&mesh.triangles[..]));
    let shape = Shape {
        kind: ShapeKind::Mesh(MeshId(0)),
        bsdf: BsdfId(0),
        emitter: None,
        flip_normals: false,
    };
    let shapes = ShapeTable { meshes: vec![mesh], shapes: vec![shape], ..ShapeTable::default() };
    let before = resident("VmRSS:");
    let (seconds, accel) = Clock::new().time(|| Accel::build(&shapes).expect("few enough"));
    let peak = resident("VmHWM:").zip(before).map(|(peak, before)| each(peak - before));
    let peak = peak.map_or("-".to_owned(), |bytes| format!("{bytes:.1}"));
    let tree = each(accel.memory_bytes());
    println!("{name:<10} {triangles:>10} {seconds:>9.3}   {own:>7.1} {tree:>7.1} {peak:>7}");
}

/// Bytes of this process in memory, now (`VmRSS:`) or at most (`VmHWM:`).
fn resident(key: &str) -> Option<usize> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(key))?;
    Some(line.trim().strip_suffix(" kB")?.parse::<usize>().ok()? * 1024)
}

/// Almost so many triangles of a wavy surface.
fn surface(triangles: usize) -> Mesh {
    let side = (triangles as f64 / 2.0).sqrt() as usize;
    let mut mesh = Mesh::default();
    mesh.positions.reserve_exact((side + 1) * (side + 1));
    mesh.triangles.reserve_exact(2 * side * side);
    for j in 0..=side {
        for i in 0..=side {
            let (x, y) = (i as f32 / side as f32, j as f32 / side as f32);
            mesh.positions.push(Vec3::new(x, y, 0.02 * (50.0 * x).sin() * (40.0 * y).cos()));
        }
    }
    let vertex = |i: usize, j: usize| (j * (side + 1) + i) as u32;
    for j in 0..side {
        for i in 0..side {
            let [a, b] = [vertex(i, j), vertex(i + 1, j)];
            let [c, d] = [vertex(i, j + 1), vertex(i + 1, j + 1)];
            mesh.triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    mesh
}

/// Small triangles in a cube, with no vertices in common.
fn strewn(triangles: usize) -> Mesh {
    let mut rng = TestRng::new(5);
    let mut point = || rng.next_vec2().extend(rng.next_f32());
    separate(triangles, || {
        let corner = point();
        [corner, corner + 0.01 * point(), corner + 0.01 * point()]
    })
}

fn coincident(triangles: usize) -> Mesh {
    separate(triangles, || [Vec3::ZERO, Vec3::X, Vec3::Y])
}

fn separate(triangles: usize, mut make: impl FnMut() -> [Vec3; 3]) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.positions.reserve_exact(3 * triangles);
    mesh.positions.extend((0..triangles).flat_map(|_| make()));
    mesh.triangles = (0..triangles as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    mesh
}
