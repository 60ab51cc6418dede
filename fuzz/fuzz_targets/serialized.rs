//! Serialized meshes, in memory: `cargo +nightly fuzz run serialized fuzz/seeds/serialized`. No input may panic, hang or take
//! much memory, and what is read must be what the renderer relies on.

#![no_main]

use std::path::Path;

use claror_io::Limits;
use claror_io::mesh::{MeshOptions, serialized_from_bytes};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let options = MeshOptions { flip_tex_coords: data.len() % 2 == 1, ..MeshOptions::default() };
    let options = MeshOptions { shape_index: usize::from(data.len() % 3 == 2), ..options };
    let Ok(loaded) = serialized_from_bytes(data, Path::new("t"), &options, &Limits::default()) else {
        return;
    };
    let mesh = loaded.mesh;
    let count = mesh.positions.len();
    assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < count));
    assert!(mesh.positions.iter().chain(&mesh.normals).all(|v| v.is_finite()));
    assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-3));
    assert!([0, count].contains(&mesh.uvs.len()) && [0, count].contains(&mesh.normals.len()));
    for a in &mesh.attributes {
        let owners = if a.per_face { mesh.triangles.len() } else { count };
        assert_eq!(a.data.len(), a.channels * owners);
    }
});
