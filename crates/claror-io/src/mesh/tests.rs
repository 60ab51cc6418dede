//! Tests of the mesh readers against what Mitsuba 3.9 loads.

use std::path::Path;

use claror::math::{DAffine3, DMat3, DVec3, Transform, Vec3};

use super::*;

fn obj(text: &str, options: &MeshOptions) -> Result<LoadedMesh, ReadError> {
    obj_from_bytes(text.as_bytes(), Path::new("t.obj"), options, &Limits::default())
}

fn scale(x: f64, y: f64, z: f64) -> MeshOptions {
    let map = DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(x, y, z)));
    MeshOptions { to_world: Transform::new(map).unwrap(), ..MeshOptions::default() }
}

const VERTICES: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";

#[track_caller]
fn assert_close(got: &[Vec3], wanted: &[[f32; 3]]) {
    assert_eq!(got.len(), wanted.len());
    for (g, w) in got.iter().zip(wanted) {
        assert!(
            (*g - Vec3::from_array(*w)).abs().max_element() < 2e-5,
            "{got:?} is not {wanted:?}"
        );
    }
}

#[test]
fn obj_without_normals_gets_those_of_mitsuba() {
    let loaded = obj(&format!("{VERTICES}f 1 2 3\nf 1 3 4\n"), &MeshOptions::default()).unwrap();
    let mesh = loaded.mesh;
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    let h = std::f32::consts::FRAC_1_SQRT_2;
    assert_close(&mesh.normals, &[[h, 0.0, h], [0.0, 0.0, 1.0], [h, 0.0, h], [1.0, 0.0, 0.0]]);
}

#[test]
fn a_mirror_turns_computed_normals_inside_out_but_not_stored_ones() {
    let text = format!("{VERTICES}f 1 2 3\nf 1 3 4\n");
    let mesh = obj(&text, &scale(-1.0, 1.0, 2.0)).unwrap().mesh;
    let h = std::f32::consts::FRAC_1_SQRT_2;
    let wanted = [[h, 0.0, -h], [0.0, 0.0, -1.0], [0.81562, 0.0, -0.57859], [1.0, 0.0, 0.0]];
    assert_close(&mesh.normals, &wanted);

    let text = format!("{VERTICES}vn 0 0 2\nf 1//1 2//1 3//1\n");
    let mesh = obj(&text, &scale(-1.0, 1.0, -2.0)).unwrap().mesh;
    assert_close(&mesh.normals, &[[0.0, 0.0, -1.0]; 3]);
}
