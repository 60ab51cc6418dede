//! Mesh files: obj, ply, serialized.
