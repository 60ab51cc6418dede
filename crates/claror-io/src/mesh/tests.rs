//! Tests of the mesh readers against what Mitsuba 3.9 loads.

use std::io::Write;
use std::path::Path;

use claror::math::{DAffine3, DMat3, DVec3, Transform, Vec2, Vec3};
use flate2::Compression;
use flate2::write::ZlibEncoder;

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

#[test]
fn obj_with_every_kind_of_corner() {
    let text = "\u{feff}# comment\r\nmtllib a.mtl\r\no thing\r\nv 0 0 0 1\r\nv 1 0 0 0.5 0.5 0.5\n\
                v\t0  1 0\nv 0 0 1\nvt 0.25 0.75\nvt 0.5\nvn 0 0 3\ns off\nusemtl m\ng a b\n\
                f 1/1/1 2/2/1 \\\n  3/1/1 # not a corner\nf -4/-2/-1 -3/-1/-1 -1/-2/-1\nl 1 2\np 1\n";
    let flip = MeshOptions { flip_tex_coords: true, ..MeshOptions::default() };
    let loaded = obj(text, &flip).unwrap();
    assert_eq!(loaded.warnings, Vec::<String>::new());
    let mesh = loaded.mesh;
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 1, 3]]);
    assert_close(&mesh.positions, &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    assert_close(&mesh.normals, &[[0.0, 0.0, 1.0]; 4]);
    let uvs = [(0.25, 0.25), (0.5, 1.0), (0.25, 0.25), (0.25, 0.25)].map(|(u, v)| Vec2::new(u, v));
    assert_eq!(mesh.uvs, uvs);
}

#[test]
fn obj_polygons_are_fans_and_face_normals_drop_normals() {
    let text = format!("{VERTICES}vn 0 0 1\nf 1//1 2//1 3//1 4//1 1//1\nf 1 2\n");
    let options = MeshOptions { face_normals: true, ..MeshOptions::default() };
    let loaded = obj(&text, &options).unwrap();
    assert_eq!(loaded.mesh.triangles[..3], [[0, 1, 2], [0, 2, 3], [0, 3, 0]]);
    assert!(loaded.mesh.normals.is_empty());
    assert_eq!(loaded.zero_area_triangles, 1);
    assert_eq!(loaded.warnings[0], "1 faces with fewer than 3 vertices were skipped");
}

#[test]
fn obj_normals_may_follow_the_faces_and_missing_ones_are_computed() {
    let text = format!("{VERTICES}f 1//1 2//1 3//1\nf 1 3 4\nvn 0 0 1\n");
    let loaded = obj(&text, &MeshOptions::default()).unwrap();
    let (z, x) = ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    assert_close(&loaded.mesh.normals, &[z, z, z, x, x, x]);
    assert_eq!(loaded.warnings.len(), 1);
}

#[test]
fn many_corners_at_one_position_stay_fast_and_distinct() {
    const COUNT: usize = 100_000;
    let mut text = VERTICES.to_owned();
    for i in 0..COUNT {
        text.push_str(&format!("vt {i} 0\n"));
    }
    for _ in 0..2 {
        for i in 1..=COUNT {
            text.push_str(&format!("f 1/{i} 2 3\n"));
        }
    }
    let mesh = obj(&text, &MeshOptions::default()).unwrap().mesh;
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (COUNT + 2, 2 * COUNT));
    assert_eq!(mesh.triangles[..COUNT], mesh.triangles[COUNT..]);
    let last = mesh.triangles[COUNT - 1][0] as usize;
    assert_eq!(mesh.uvs[last], Vec2::new((COUNT - 1) as f32, 0.0));
}

#[test]
fn cube_is_that_of_mitsuba() {
    let cube = cube(&Transform::IDENTITY);
    assert_eq!((cube.positions.len(), cube.triangles.len()), (24, 12));
    let p = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let at = |i: usize| (cube.positions[i], cube.normals[i], cube.uvs[i]);
    let uv = Vec2::new;
    assert_eq!(at(0), (p(1.0, -1.0, -1.0), Vec3::NEG_Y, uv(0.0, 1.0)));
    assert_eq!(at(5), (p(-1.0, 1.0, -1.0), Vec3::Y, uv(1.0, 1.0)));
    assert_eq!(at(10), (p(1.0, 1.0, 1.0), Vec3::X, uv(1.0, 0.0)));
    assert_eq!(at(15), (p(-1.0, -1.0, 1.0), Vec3::Z, uv(0.0, 0.0)));
    assert_eq!(at(16), (p(-1.0, -1.0, 1.0), Vec3::NEG_X, uv(0.0, 1.0)));
    assert_eq!(at(23), (p(-1.0, 1.0, -1.0), Vec3::NEG_Z, uv(0.0, 0.0)));
    assert_eq!(cube.triangles[2..4], [[4, 5, 6], [7, 4, 6]]);
    for triangle in &cube.triangles {
        let [a, b, c] = triangle.map(|i| cube.positions[i as usize]);
        let normal = cube.normals[triangle[0] as usize];
        assert_eq!((b - a).cross(c - a), 4.0 * normal);
    }
}

const PLY_VERTICES: &str = "property float x\nproperty float y\nproperty float z\n";
const PLY_FACES: &str = "property list uchar int vertex_indices\n";

fn ply(bytes: &[u8]) -> Result<LoadedMesh, ReadError> {
    ply_from_bytes(bytes, Path::new("t.ply"), &MeshOptions::default(), &Limits::default())
}

/// An ascii file of one triangle with further vertex properties, all with the same values.
fn ply_with(properties: &str, values: &str) -> LoadedMesh {
    let rows: String =
        ["0 0 0", "1 0 0", "0 1 0"].iter().map(|p| format!("{p} {values}\n")).collect();
    let text = format!(
        "ply\nformat ascii 1.0\ncomment é\nelement vertex 3\n{PLY_VERTICES}{properties}\
         element face 1\n{PLY_FACES}end_header\n{rows}3 0 1 2\n"
    );
    ply(text.as_bytes()).unwrap()
}

#[test]
fn ply_texture_coordinates_by_any_name() {
    for [u, v] in [["u", "v"], ["s", "t"], ["texture_u", "texture_v"], ["texture_s", "texture_t"]] {
        let mesh = ply_with(&format!("property float {v}\nproperty double {u}\n"), "0.5 0.25").mesh;
        assert_eq!(mesh.uvs, [Vec2::new(0.25, 0.5); 3], "{u}");
        assert!(mesh.attributes.is_empty());
    }
}

/// Names and values as Mitsuba 3.9 gives them.
#[test]
fn ply_attributes_are_named_as_mitsuba_does() {
    let three = [0.25, 0.5, 1.0];
    let cases: [(&[&str], &str, &[f32]); 12] = [
        (&["r", "g", "b"], "vertex_color", &three),
        (&["red", "green", "blue"], "vertex_color", &three),
        (&["foo_0", "foo_1", "foo_2"], "vertex_foo", &three),
        (&["foo_x", "foo_y", "foo_z"], "vertex_foo", &three),
        (&["foo_r", "foo_g", "foo_b"], "vertex_foo_color", &three),
        (&["a_b_c_0"], "vertex_a_b_c", &[0.25]),
        (&["foo_1"], "vertex_foo", &[0.25]),
        (&["foo_x"], "vertex_foo", &[0.25]),
        (&["foo"], "", &[]),
        (&["foo_bar"], "", &[]),
        (&["foo_0", "foo_1"], "", &[]),
        (&["foo_R", "foo_G", "foo_B"], "", &[]),
    ];
    for (properties, name, values) in cases {
        let header: String = properties.iter().map(|p| format!("property float {p}\n")).collect();
        let given = ["0.25", "0.5", "1"][..properties.len()].join(" ");
        let attributes = ply_with(&header, &given).mesh.attributes;
        let got: Vec<_> = attributes.iter().map(|a| (a.name.as_str(), a.channels)).collect();
        let wanted = if name.is_empty() { vec![] } else { vec![(name, values.len())] };
        assert_eq!(got, wanted, "{properties:?}");
        if let Some(attribute) = attributes.first() {
            assert_eq!(attribute.data, values.repeat(3));
        }
    }
    let loaded =
        ply_with("property uchar red\nproperty uchar green\nproperty uchar blue\n", "64 128 255");
    assert_eq!(loaded.mesh.attributes[0].data[..3], [64.0, 128.0, 255.0]);
    assert_eq!(loaded.warnings.len(), 1);
}

/// A binary file with properties of all types, an element to skip, polygons and face colours.
pub(super) fn binary_ply(big_endian: bool) -> Vec<u8> {
    let order = if big_endian { "big" } else { "little" };
    let mut out = format!(
        "ply\nformat binary_{order}_endian 1.0\nelement material 2\nproperty list ushort short k\n\
         property char c\nelement face 2\nproperty float r\nproperty list int uint vertex_index\n\
         property float g\nproperty float b\nelement vertex 4\nproperty double z\nproperty short y\n\
         property ulong x\nproperty float nx\nproperty float ny\nproperty float nz\nend_header\n"
    )
    .into_bytes();
    let mut put = |bytes: &[u8]| {
        let mut bytes = bytes.to_vec();
        if big_endian {
            bytes.reverse();
        }
        out.extend(bytes);
    };
    for length in [0_u16, 2] {
        put(&length.to_le_bytes());
        (0..length).for_each(|_| put(&7_i16.to_le_bytes()));
        put(&[1]);
    }
    for polygon in [[0_u32, 1, 2, 3].as_slice(), &[0, 2, 1]] {
        put(&0.5_f32.to_le_bytes());
        put(&(polygon.len() as i32).to_le_bytes());
        polygon.iter().for_each(|i| put(&i.to_le_bytes()));
        put(&0.25_f32.to_le_bytes());
        put(&(polygon.len() as f32).to_le_bytes());
    }
    for (x, y, z) in [(0_u64, 0_i16, 0.0_f64), (1, 0, 0.5), (1, -1, 0.0), (0, -1, 0.0)] {
        put(&z.to_le_bytes());
        put(&y.to_le_bytes());
        put(&x.to_le_bytes());
        [0.0_f32, 0.0, 2.0].iter().for_each(|n| put(&n.to_le_bytes()));
    }
    out
}

#[test]
pub(super) fn binary_ply_of_either_byte_order() {
    for big_endian in [false, true] {
        let mesh = ply(&binary_ply(big_endian)).unwrap().mesh;
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 2, 1]]);
        let wanted = [[0.0; 3], [1.0, 0.0, 0.5], [1.0, -1.0, 0.0], [0.0, -1.0, 0.0]];
        assert_close(&mesh.positions, &wanted);
        assert_close(&mesh.normals, &[[0.0, 0.0, 1.0]; 4]);
        let color = &mesh.attributes[0];
        assert_eq!((color.name.as_str(), color.per_face), ("face_color", true));
        assert_eq!(color.data, [0.5, 0.25, 4.0, 0.5, 0.25, 4.0, 0.5, 0.25, 3.0]);
    }
}

/// One mesh of a serialized file; `flags` as in the format.
pub(super) fn serialized_mesh(version: u16, flags: u32, scale: f64) -> Vec<u8> {
    let mut body = flags.to_le_bytes().to_vec();
    if version == 4 {
        body.extend(b"name\0");
    }
    body.extend([4_u64.to_le_bytes(), 2_u64.to_le_bytes()].concat());
    let mut put = |values: &[f64]| {
        for v in values {
            if flags & 0x2000 != 0 {
                body.extend((v * scale).to_le_bytes());
            } else {
                body.extend(((v * scale) as f32).to_le_bytes());
            }
        }
    };
    put(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    if flags & 1 != 0 {
        put(&[0.0, 0.0, 1.0].repeat(4));
    }
    if flags & 2 != 0 {
        put(&[0.25, 0.5].repeat(4));
    }
    if flags & 8 != 0 {
        put(&[0.1, 0.2, 0.3].repeat(4));
    }
    body.extend([0_u32, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(&body).unwrap();
    let mut out = [0x041c_u16.to_le_bytes(), version.to_le_bytes()].concat();
    out.extend(encoder.finish().unwrap());
    out
}

pub(super) fn serialized_file(version: u16, meshes: &[Vec<u8>]) -> Vec<u8> {
    let mut out = meshes.concat();
    let mut offset = 0_u64;
    for mesh in meshes {
        out.extend(&offset.to_le_bytes()[..if version == 4 { 8 } else { 4 }]);
        offset += mesh.len() as u64;
    }
    out.extend((meshes.len() as u32).to_le_bytes());
    out
}

fn serialized(bytes: &[u8], shape_index: usize) -> Result<LoadedMesh, ReadError> {
    let options = MeshOptions { shape_index, ..MeshOptions::default() };
    serialized_from_bytes(bytes, Path::new("t.serialized"), &options, &Limits::default())
}

#[test]
fn serialized_of_both_versions_and_precisions() {
    for version in [3, 4] {
        let meshes = [
            serialized_mesh(version, 0x1000, 1.0),
            serialized_mesh(version, 0x200b, 1.0),
            serialized_mesh(version, 0x1012, 2.0),
        ];
        let file = serialized_file(version, &meshes);
        let loaded: Vec<_> = (0..3).map(|i| serialized(&file, i).unwrap().mesh).collect();
        let h = std::f32::consts::FRAC_1_SQRT_2;
        let smooth = [[h, 0.0, h], [0.0, 0.0, 1.0], [h, 0.0, h], [1.0, 0.0, 0.0]];
        assert_close(&loaded[0].normals, &smooth);
        assert_close(&loaded[1].normals, &[[0.0, 0.0, 1.0]; 4]);
        // The flag for face normals changes nothing, as in Mitsuba 3.9.
        assert_close(&loaded[2].normals, &smooth);
        assert_eq!(loaded[1].attributes[0].name, "vertex_color");
        assert_eq!(loaded[1].attributes[0].data[..3], [0.1, 0.2, 0.3]);
        assert_eq!(loaded[2].uvs, [Vec2::new(0.5, 1.0); 4]);
        assert_close(&loaded[2].positions[3..], &[[0.0, 0.0, 2.0]]);
        let message = serialized(&file, 3).unwrap_err().message;
        assert_eq!(message, "there is no mesh 3: the file holds 3");
    }
}
