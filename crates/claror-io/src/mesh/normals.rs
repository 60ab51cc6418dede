//! Smooth vertex normals.

use claror::math::{DVec3, Vec3};

/// The normal of a vertex that belongs to no triangle of positive area; Mitsuba's choice.
pub(super) const NO_NORMAL: Vec3 = Vec3::X;

/// Smooth unit normals: the mean of the adjacent triangles' normals, weighted by the angle that
/// each triangle has at the vertex (Thürmer and Wüthrich 1998: Computing vertex normals from
/// polygonal facets). Sums in `f64` and in the order of the triangles, so that small triangles do
/// not underflow and the result does not depend on anything else.
pub(super) fn smooth_normals(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut sums = vec![DVec3::ZERO; positions.len()];
    for triangle in triangles {
        let p = triangle.map(|i| positions[i as usize].as_dvec3());
        let Some(normal) = unit((p[1] - p[0]).cross(p[2] - p[0])) else { continue };
        for corner in 0..3 {
            let a = p[(corner + 1) % 3] - p[corner];
            let b = p[(corner + 2) % 3] - p[corner];
            // Accurate for all angles, unlike the arc cosine of the dot product.
            let angle = f64::atan2(a.cross(b).length(), a.dot(b));
            sums[triangle[corner] as usize] += angle * normal;
        }
    }
    sums.iter().map(|&sum| unit(sum).map_or(NO_NORMAL, DVec3::as_vec3)).collect()
}

/// How many triangles have no area.
pub(super) fn count_zero_area(positions: &[Vec3], triangles: &[[u32; 3]]) -> usize {
    let has_area = |triangle: &[u32; 3]| {
        let p = triangle.map(|i| positions[i as usize].as_dvec3());
        unit((p[1] - p[0]).cross(p[2] - p[0])).is_some()
    };
    triangles.iter().filter(|t| !has_area(t)).count()
}

/// `v` at unit length; `None` when it is zero. Scaled first, because the squares of `f32`
/// differences multiplied twice leave the range of `f64` in extreme meshes.
fn unit(v: DVec3) -> Option<DVec3> {
    let scale = v.abs().max_element();
    if scale > 0.0 && scale.is_finite() { Some((v / scale).normalize()) } else { None }
}
