//! From inside a closed mesh, no ray gets out: not at a vertex, not along an edge.

use super::*;

/// A ball of `20·4^levels` triangles; `bump` moves its vertices in and out.
fn ball(levels: usize, bump: f32, center: Vec3) -> Mesh {
    let g = 0.5 + 1.25_f32.sqrt();
    let mut positions: Vec<Vec3> = [[-1.0, g], [1.0, g], [-1.0, -g], [1.0, -g]]
        .into_iter()
        .flat_map(|[a, b]| [Vec3::new(a, b, 0.0), Vec3::new(0.0, a, b), Vec3::new(b, 0.0, a)])
        .map(Vec3::normalize)
        .collect();
    // The faces are the triples of vertices at edge length from each other.
    let edge = positions[0].distance(positions[3]);
    let near = |a: Vec3, b: Vec3| (a.distance(b) - edge).abs() < 0.1;
    let mut faces = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                let [a, b, c] = [positions[i], positions[j], positions[k]];
                if near(a, b) && near(b, c) && near(a, c) {
                    faces.push([i, j, k].map(|v| v as u32));
                }
            }
        }
    }
    assert_eq!(faces.len(), 20);
    for _ in 0..levels {
        faces = refined(&mut positions, &faces);
    }
    let mut n = Numbers(21);
    let moved = positions.iter().map(|p| *p * (1.0 + bump * (n.next() - 0.5)) + center);
    Mesh { positions: moved.collect(), triangles: faces, ..Mesh::default() }
}

/// Every triangle cut into four.
fn refined(positions: &mut Vec<Vec3>, faces: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut middles = std::collections::BTreeMap::new();
    let mut middle = |a: u32, b: u32| {
        *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
            positions.push((positions[a as usize] + positions[b as usize]).normalize());
            positions.len() as u32 - 1
        })
    };
    let quarter = |&[a, b, c]: &[u32; 3]| {
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    };
    faces.iter().flat_map(quarter).collect()
}

/// The surface of a cube, `cuts`² quads per face.
fn cube(cuts: i32) -> Mesh {
    let mut mesh = Mesh::default();
    let mut numbers = std::collections::BTreeMap::new();
    for axis in 0..3 {
        for side in [0, cuts] {
            for i in 0..cuts {
                for j in 0..cuts {
                    let mut vertex = |u: i32, v: i32| {
                        let mut p = [0; 3];
                        (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, u, v);
                        *numbers.entry(p).or_insert_with(|| {
                            let at = Vec3::from(p.map(|x| x as f32)) / cuts as f32;
                            mesh.positions.push(2.0 * at - 1.0);
                            mesh.positions.len() as u32 - 1
                        })
                    };
                    let [a, b] = [vertex(i, j), vertex(i + 1, j)];
                    let [c, d] = [vertex(i, j + 1), vertex(i + 1, j + 1)];
                    mesh.triangles.extend([[a, b, d], [a, d, c]]);
                }
            }
        }
    }
    mesh
}

/// Aims from random points near the centre at vertices, edges and faces.
fn assert_closed(mesh: Mesh, center: Vec3, rays: usize, what: &str) {
    let mut table = ShapeTable::default();
    add_mesh(&mut table, mesh);
    let accel = Accel::build(&table).unwrap();
    accel.validate(&table).unwrap();
    let mesh = &table.meshes[0];
    let mut n = Numbers(22);
    for i in 0..rays {
        let face = mesh.triangles[(n.next() * mesh.triangles.len() as f32) as usize];
        let [a, b, c] = face.map(|v| mesh.positions[v as usize]);
        let (u, v) = (n.next(), n.next());
        let target = match i % 3 {
            0 => a,
            1 => a + (b - a) * u,
            _ => a + (b - a) * (u * (1.0 - v)) + (c - a) * (u * v),
        };
        let from = center + n.point() * 0.4;
        let along_axis = n.next() < 0.1;
        let d = if along_axis { Vec3::AXES[i % 3] } else { target - from };
        // From time to time right below or above the target, along an axis through it.
        let from = if along_axis { target.with_x(from.x) } else { from };
        if (from - center).length() > 0.7 {
            continue;
        }
        for d in [d.normalize(), -d.normalize()] {
            let ray = Ray::new(from, d);
            assert!(accel.intersect(&table, &ray).is_some(), "{what}: {ray:?} gets out");
            assert!(accel.occluded(&table, &ray), "{what}: {ray:?} gets out unseen");
        }
    }
}

#[test]
fn closed_meshes_are_closed() {
    let far = Vec3::splat(100.0);
    assert_closed(ball(4, 0.0, Vec3::ZERO), Vec3::ZERO, 60_000, "ball");
    assert_closed(ball(5, 0.1, Vec3::ZERO), Vec3::ZERO, 60_000, "rough ball");
    assert_closed(ball(4, 0.0, far), far, 60_000, "far ball");
    assert_closed(cube(45), Vec3::ZERO, 60_000, "fine cube");
    assert_closed(cube(1), Vec3::ZERO, 60_000, "cube");
}
