//! The cube `[-1, 1]³`.

use claror::math::{Transform, Vec2, Vec3};
use claror::shape::Mesh;

/// Per face of the cube: the outward normal, and the directions in which u and v grow.
/// Order and orientation are Mitsuba's.
const FACES: [[Vec3; 3]; 6] = [
    [Vec3::NEG_Y, Vec3::Z, Vec3::X],
    [Vec3::Y, Vec3::NEG_X, Vec3::NEG_Z],
    [Vec3::X, Vec3::Y, Vec3::NEG_Z],
    [Vec3::Z, Vec3::Y, Vec3::X],
    [Vec3::NEG_X, Vec3::Y, Vec3::Z],
    [Vec3::NEG_Z, Vec3::NEG_Y, Vec3::X],
];

/// Texture coordinates of the four vertices of each face.
const CORNERS: [Vec2; 4] =
    [Vec2::new(0.0, 1.0), Vec2::new(1.0, 1.0), Vec2::new(1.0, 0.0), Vec2::new(0.0, 0.0)];

/// Mitsuba's `cube`: 24 vertices, outward normals, the whole uv square on each face, 12 triangles.
pub fn cube(to_world: &Transform) -> Mesh {
    let mut mesh = Mesh::default();
    for (face, [normal, du, dv]) in (0_u32..).zip(FACES) {
        for uv in CORNERS {
            let local = normal + (2.0 * uv.x - 1.0) * du + (2.0 * uv.y - 1.0) * dv;
            mesh.positions.push(to_world.point(local));
            mesh.normals.push(to_world.normal(normal).normalize());
            mesh.uvs.push(uv);
        }
        let first = 4 * face;
        mesh.triangles.extend([[0, 1, 2], [3, 0, 2]].map(|t| t.map(|i| first + i)));
    }
    mesh
}
