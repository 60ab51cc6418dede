//! What all mesh formats have in common once their numbers are read.

use claror::math::{Transform, Vec2, Vec3};
use claror::shape::{Mesh, MeshAttribute};

use super::normals::{count_zero_area, smooth_normals};
use super::{LoadedMesh, MeshOptions};
use crate::diagnostic::ReadError;
use crate::source::Source;

/// A mesh as its file says: in file space, indices already checked.
#[derive(Debug, Default)]
pub(super) struct RawMesh {
    pub(super) positions: Vec<Vec3>,
    /// One per position, or empty. Zero where the file has none for this vertex.
    pub(super) normals: Vec<Vec3>,
    /// One per position, or empty.
    pub(super) uvs: Vec<Vec2>,
    /// Every index < `positions.len()`.
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) attributes: Vec<MeshAttribute>,
    pub(super) warnings: Vec<String>,
}

/// Brings the mesh to world space and gives it the normals that it lacks.
pub(super) fn finish(
    raw: RawMesh,
    source: Source<'_>,
    options: &MeshOptions,
) -> Result<LoadedMesh, ReadError> {
    let RawMesh { mut positions, mut normals, mut uvs, triangles, attributes, mut warnings } = raw;
    if triangles.is_empty() {
        return Err(source.error("the mesh has no faces"));
    }
    transform_positions(&mut positions, &options.to_world, source)?;
    check_uvs(&mut uvs, options.flip_tex_coords, source)?;
    if options.face_normals {
        normals.clear();
    } else if normals.is_empty() {
        normals = smooth_normals(&positions, &triangles);
    } else {
        let missing = transform_normals(&mut normals, &options.to_world, source)?;
        if missing > 0 {
            fill_missing(&mut normals, &positions, &triangles);
            warnings.push(format!(
                "{missing} vertices have no normal or one of length zero; theirs were computed"
            ));
        }
    }
    let zero_area_triangles = count_zero_area(&positions, &triangles);
    if zero_area_triangles > 0 {
        warnings
            .push(format!("{zero_area_triangles} of {} triangles have no area", triangles.len()));
    }
    let mesh = Mesh { positions, normals, uvs, triangles, attributes };
    Ok(LoadedMesh { mesh, zero_area_triangles, warnings })
}

fn transform_positions(
    positions: &mut [Vec3],
    to_world: &Transform,
    source: Source<'_>,
) -> Result<(), ReadError> {
    for (i, p) in positions.iter_mut().enumerate() {
        let world = to_world.point(*p);
        if !world.is_finite() {
            let what = if p.is_finite() {
                "leaves the range of numbers in world space"
            } else {
                "is not finite"
            };
            return Err(source.error(format!("vertex {i} {what}: {p}")));
        }
        *p = world;
    }
    Ok(())
}

fn check_uvs(uvs: &mut [Vec2], flip: bool, source: Source<'_>) -> Result<(), ReadError> {
    for (i, uv) in uvs.iter_mut().enumerate() {
        if !uv.is_finite() {
            return Err(
                source.error(format!("the texture coordinates of vertex {i} are not finite: {uv}"))
            );
        }
        if flip {
            uv.y = 1.0 - uv.y;
        }
    }
    Ok(())
}

/// To unit normals in world space; zero normals stay zero and are counted.
fn transform_normals(
    normals: &mut [Vec3],
    to_world: &Transform,
    source: Source<'_>,
) -> Result<usize, ReadError> {
    let mut missing = 0;
    for (i, n) in normals.iter_mut().enumerate() {
        if !n.is_finite() {
            return Err(source.error(format!("the normal of vertex {i} is not finite: {n}")));
        }
        // Twice, because a very long or short vector must not lose its direction on the way.
        *n = unit_or_zero(to_world.normal(unit_or_zero(*n)));
        missing += usize::from(*n == Vec3::ZERO);
    }
    Ok(missing)
}

fn fill_missing(normals: &mut [Vec3], positions: &[Vec3], triangles: &[[u32; 3]]) {
    let smooth = smooth_normals(positions, triangles);
    for (n, smooth) in normals.iter_mut().zip(smooth) {
        if *n == Vec3::ZERO {
            *n = smooth;
        }
    }
}

fn unit_or_zero(v: Vec3) -> Vec3 {
    let scale = v.abs().max_element();
    if scale > 0.0 && scale.is_finite() { (v / scale).normalize() } else { Vec3::ZERO }
}
