//! Mesh files: obj, ply, serialized; and the cube.
//!
//! The semantics are Mitsuba 3's. Positions and normals are brought to world space while a mesh is
//! read, normals by the inverse transpose. A mesh without stored normals gets smooth ones, computed
//! in world space from the winding of its triangles, so that a mirrored transform turns such a mesh
//! inside out. With `face_normals` there are no vertex normals at all.

mod cube;
mod finish;
#[cfg(test)]
mod hostile_tests;
mod normals;
mod obj;
mod ply;
mod serialized;
#[cfg(test)]
mod tests;

pub use cube::cube;

use std::path::Path;

use claror::math::Transform;
use claror::shape::Mesh;

use crate::diagnostic::ReadError;
use crate::limits::Limits;
use crate::source::Source;

/// How a mesh file is to be understood.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshOptions {
    /// File space → world (or group) space.
    pub to_world: Transform,
    /// Drop stored normals and compute none: the triangles are flat.
    pub face_normals: bool,
    /// `v := 1 - v`. Mitsuba's default is true for obj and false for ply and serialized.
    pub flip_tex_coords: bool,
    /// Which mesh of a `serialized` file.
    pub shape_index: usize,
}

impl Default for MeshOptions {
    fn default() -> Self {
        Self {
            to_world: Transform::IDENTITY,
            face_normals: false,
            flip_tex_coords: false,
            shape_index: 0,
        }
    }
}

/// A mesh and what its user should know about it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LoadedMesh {
    /// The mesh.
    pub mesh: Mesh,
    /// Triangles without area. They are kept: nothing can hit them, and face attributes stay
    /// aligned.
    pub zero_area_triangles: usize,
    /// What was odd but usable, one sentence each without a full stop.
    pub warnings: Vec<String>,
}

/// Reads a Wavefront OBJ file; see [`MeshOptions`].
pub fn read_obj(
    path: &Path,
    options: &MeshOptions,
    limits: &Limits,
) -> Result<LoadedMesh, ReadError> {
    obj_from_bytes(&Source::new(path).read(limits)?, path, options, limits)
}

/// Reads a PLY file (ascii or binary of either byte order); see [`MeshOptions`].
pub fn read_ply(
    path: &Path,
    options: &MeshOptions,
    limits: &Limits,
) -> Result<LoadedMesh, ReadError> {
    ply_from_bytes(&Source::new(path).read(limits)?, path, options, limits)
}

/// Reads one mesh of a Mitsuba `serialized` file; see [`MeshOptions`].
pub fn read_serialized(
    path: &Path,
    options: &MeshOptions,
    limits: &Limits,
) -> Result<LoadedMesh, ReadError> {
    serialized_from_bytes(&Source::new(path).read(limits)?, path, options, limits)
}

/// [`read_obj`] of bytes in memory; `path` only names them in messages.
pub fn obj_from_bytes(
    bytes: &[u8],
    path: &Path,
    options: &MeshOptions,
    limits: &Limits,
) -> Result<LoadedMesh, ReadError> {
    let source = Source::new(path);
    finish::finish(obj::parse(bytes, source, limits)?, source, options)
}

/// [`read_ply`] of bytes in memory; `path` only names them in messages.
pub fn ply_from_bytes(
    bytes: &[u8],
    path: &Path,
    options: &MeshOptions,
    limits: &Limits,
) -> Result<LoadedMesh, ReadError> {
    let source = Source::new(path);
    finish::finish(ply::parse(bytes, source, limits)?, source, options)
}

/// [`read_serialized`] of bytes in memory; `path` only names them in messages.
pub fn serialized_from_bytes(
    bytes: &[u8],
    path: &Path,
    options: &MeshOptions,
    limits: &Limits,
) -> Result<LoadedMesh, ReadError> {
    let source = Source::new(path);
    let raw = serialized::parse(bytes, options.shape_index, source, limits)?;
    finish::finish(raw, source, options)
}
