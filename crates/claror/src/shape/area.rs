//! Surface areas.

use super::{Mesh, ShapeId, ShapeKind, ShapeTable};
use crate::math::{DVec3, Transform};
use std::f64::consts::{PI, TAU};

impl Mesh {
    /// Area of triangle `i`.
    pub fn triangle_area(&self, i: u32) -> f32 {
        self.triangle_area_f64(i as usize) as f32
    }

    fn triangle_area_f64(&self, i: usize) -> f64 {
        let [a, b, c] = self.triangles[i].map(|v| self.positions[v as usize].as_dvec3());
        0.5 * (b - a).cross(c - a).length()
    }
}

impl ShapeTable {
    /// The area of a shape, in the world (or in the space of its group).
    pub fn surface_area(&self, id: ShapeId) -> f32 {
        let area = match &self.shapes[id.0 as usize].kind {
            ShapeKind::Mesh(mesh) => {
                let mesh = &self.meshes[mesh.0 as usize];
                (0..mesh.triangles.len()).map(|i| mesh.triangle_area_f64(i)).sum()
            }
            ShapeKind::Rectangle(transform) => {
                let [x, y, _] = columns(transform);
                4.0 * x.cross(y).length()
            }
            ShapeKind::Disk(transform) => {
                let [x, y, _] = columns(transform);
                PI * x.cross(y).length()
            }
            ShapeKind::Sphere(transform) => ellipsoid(transform),
            ShapeKind::Cylinder(transform) => cylinder(transform),
        };
        area as f32
    }
}

fn columns(transform: &Transform) -> [DVec3; 3] {
    let m = transform.to_world.as_daffine3().matrix3;
    [m.x_axis, m.y_axis, m.z_axis]
}

/// ∮ |∂p/∂φ × ∂p/∂z| dφ by the trapezoidal rule, which converges exponentially for a period; exact
/// for a circular cross-section.
fn cylinder(transform: &Transform) -> f64 {
    const STEPS: usize = 256;
    let [x, y, z] = columns(transform);
    let total: f64 = (0..STEPS)
        .map(|i| {
            let (sin, cos) = (TAU * i as f64 / STEPS as f64).sin_cos();
            (y * cos - x * sin).cross(z).length()
        })
        .sum();
    total * TAU / STEPS as f64
}

/// The area of an ellipsoid by quadrature: ∫ |∂p/∂φ × ∂p/∂(cos θ)| over the
/// parameters, the trapezoidal rule in φ, the midpoint rule in cos θ; exact for a sphere.
fn ellipsoid(transform: &Transform) -> f64 {
    const STEPS: usize = 128;
    let [x, y, z] = columns(transform);
    // The cofactor matrix maps an area element of the unit sphere to that of the ellipsoid.
    let cofactors = [y.cross(z), z.cross(x), x.cross(y)];
    let mut total = 0.0;
    for i in 0..STEPS {
        let cos_theta = (2 * i + 1) as f64 / STEPS as f64 - 1.0;
        let sin_theta = (1.0 - cos_theta * cos_theta).sqrt();
        for j in 0..STEPS {
            let (sin, cos) = (TAU * j as f64 / STEPS as f64).sin_cos();
            let n = DVec3::new(sin_theta * cos, sin_theta * sin, cos_theta);
            total += (cofactors[0] * n.x + cofactors[1] * n.y + cofactors[2] * n.z).length();
        }
    }
    total * 4.0 * PI / (STEPS * STEPS) as f64
}
