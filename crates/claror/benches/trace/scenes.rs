//! Scenes made on the spot: triangles of very different sizes in a closed room, one big bumpy ball
//! in the open, and a box of a few triangles.

use crate::rays::Numbers;
use claror::bsdf::BsdfId;
use claror::math::{Mat3, Vec3};
use claror::shape::{Mesh, MeshId, Shape, ShapeKind, ShapeTable};
use std::f32::consts::{PI, TAU};

/// Makes a scene.
pub(crate) type Maker = fn() -> ShapeTable;

/// Name and maker of every scene.
pub(crate) const ALL: [(&str, Maker); 3] =
    [("furnished room", room), ("bumpy ball in the open", ball), ("box with two boxes", boxes)];

fn add(table: &mut ShapeTable, mesh: Mesh) {
    table.shapes.push(Shape {
        kind: ShapeKind::Mesh(MeshId(table.meshes.len() as u32)),
        bsdf: BsdfId(0),
        emitter: None,
        flip_normals: false,
    });
    table.meshes.push(mesh);
}

/// A grid of quads over [0, 1]², two triangles each.
fn grid(columns: usize, rows: usize, at: impl Fn(f32, f32) -> Vec3) -> Mesh {
    let mut mesh = Mesh::default();
    for j in 0..=rows {
        for i in 0..=columns {
            mesh.positions.push(at(i as f32 / columns as f32, j as f32 / rows as f32));
        }
    }
    let vertex = |i: usize, j: usize| (j * (columns + 1) + i) as u32;
    for j in 0..rows {
        for i in 0..columns {
            let [a, b] = [vertex(i, j), vertex(i + 1, j)];
            let [c, d] = [vertex(i, j + 1), vertex(i + 1, j + 1)];
            mesh.triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    mesh
}

/// A bumpy ball.
fn bumpy(center: Vec3, radius: f32, resolution: usize, bumps: f32) -> Mesh {
    grid(2 * resolution, resolution, |u, v| {
        let (theta, phi) = (v * PI, u * TAU);
        let n = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
        let bump = (n.x * bumps).sin() * (n.y * bumps).sin() * (n.z * bumps).sin();
        center + n * radius * (1.0 + 0.1 * bump)
    })
}

fn torus(center: Vec3, radius: f32, thickness: f32, resolution: usize, turn: Mat3) -> Mesh {
    grid(2 * resolution, resolution, |u, v| {
        let (a, b) = (u * TAU, v * TAU);
        let r = radius + thickness * b.cos();
        center + turn * Vec3::new(r * a.cos(), thickness * b.sin(), r * a.sin())
    })
}

/// A box, every face cut into `cuts`² quads.
fn cuboid(center: Vec3, half: Vec3, turn: Mat3, cuts: usize) -> Mesh {
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let face = grid(cuts, cuts, |u, v| {
                let mut p = [0.0; 3];
                p[axis] = side;
                p[(axis + 1) % 3] = (2.0 * u - 1.0) * side;
                p[(axis + 2) % 3] = 2.0 * v - 1.0;
                center + turn * (Vec3::from(p) * half)
            });
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(face.positions);
            mesh.triangles.extend(face.triangles.iter().map(|t| t.map(|i| i + first)));
        }
    }
    mesh
}

/// A table or chair: a top and four legs.
fn furniture(table: &mut ShapeTable, at: Vec3, size: Vec3, turn: Mat3) {
    let top = at + Vec3::Y * size.y;
    add(table, cuboid(top, Vec3::new(size.x, 0.03, size.z), turn, 4));
    for [x, z] in [[-0.9, -0.9], [-0.9, 0.9], [0.9, -0.9], [0.9, 0.9]] {
        let foot = at + turn * (Vec3::new(x, 0.0, z) * size) + Vec3::Y * (0.5 * size.y);
        add(table, cuboid(foot, Vec3::new(0.03, 0.5 * size.y, 0.03), turn, 1));
    }
}

/// 10 × 4 × 8, about a million triangles.
fn room() -> ShapeTable {
    let mut n = Numbers(3);
    let mut table = ShapeTable::default();
    let size = Vec3::new(5.0, 2.0, 4.0);
    add(&mut table, cuboid(Vec3::new(0.0, 2.0, 0.0), size, Mat3::IDENTITY, 1));
    let place =
        |n: &mut Numbers, y: f32| Vec3::new((n.next() - 0.5) * 9.0, y, (n.next() - 0.5) * 7.0);
    for _ in 0..24 {
        let turn = Mat3::from_rotation_y(n.next() * TAU);
        let size = Vec3::new(0.3 + 0.4 * n.next(), 0.4 + 0.5 * n.next(), 0.3 + 0.3 * n.next());
        let at = place(&mut n, 0.0);
        furniture(&mut table, at, size, turn);
        let standing = at + Vec3::Y * (size.y + 0.2);
        add(&mut table, bumpy(standing, 0.12, 60 + (n.next() * 80.0) as usize, 9.0));
    }
    for _ in 0..14 {
        let turn = Mat3::from_rotation_x(n.next() * TAU) * Mat3::from_rotation_y(n.next() * TAU);
        let (at, r) = (place(&mut n, 0.3), 0.15 + 0.2 * n.next());
        add(&mut table, torus(at, r, 0.3 * r, 40 + (n.next() * 60.0) as usize, turn));
    }
    for side in [-1.0, 1.0] {
        // Curtains.
        let fold = |u: f32| 0.06 * (u * 90.0).sin();
        let curtain =
            |u: f32, v: f32| Vec3::new((u - 0.5) * 6.0, 0.2 + 3.2 * v, side * 3.8 + fold(u));
        add(&mut table, grid(500, 60, curtain));
    }
    blades(&mut table, &mut n);
    table
}

/// A carpet of blades, two slim triangles each.
fn blades(table: &mut ShapeTable, n: &mut Numbers) {
    let mut mesh = Mesh::default();
    for _ in 0..130_000 {
        let at = Vec3::new((n.next() - 0.5) * 4.0, 0.0, (n.next() - 0.5) * 3.0);
        let lean = Vec3::new(n.next() - 0.5, 1.5, n.next() - 0.5) * 0.05;
        let across = Vec3::new(n.next() - 0.5, 0.0, n.next() - 0.5) * 0.008;
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([at - across, at + across, at + lean + across, at + lean - across]);
        mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    add(table, mesh);
}

/// Most rays that leave it meet nothing.
fn ball() -> ShapeTable {
    let mut table = ShapeTable::default();
    add(&mut table, bumpy(Vec3::ZERO, 1.0, 131, 12.0));
    // Two far specks: the camera, placed within the box of everything, stands outside the ball.
    for x in [-3.0, 3.0] {
        add(&mut table, cuboid(Vec3::new(x, 0.0, 0.0), Vec3::splat(1e-3), Mat3::IDENTITY, 1));
    }
    table
}

fn boxes() -> ShapeTable {
    let mut table = ShapeTable::default();
    add(&mut table, cuboid(Vec3::Y, Vec3::ONE, Mat3::IDENTITY, 1));
    let turn = Mat3::from_rotation_y(0.3);
    add(&mut table, cuboid(Vec3::new(-0.3, 0.6, -0.3), Vec3::new(0.3, 0.6, 0.3), turn, 1));
    add(&mut table, cuboid(Vec3::new(0.3, 0.3, 0.3), Vec3::splat(0.3), turn.transpose(), 1));
    table
}
