//! Files that must be refused, each with its message, and files cut or changed at random.

use std::path::Path;

use proptest::prelude::*;

use super::tests::{binary_ply, serialized_file, serialized_mesh};
use super::*;

fn read_bytes(name: &str, bytes: &[u8]) -> Result<LoadedMesh, ReadError> {
    let (path, options, limits) = (Path::new(name), MeshOptions::default(), Limits::default());
    match name {
        "t.obj" => obj_from_bytes(bytes, path, &options, &limits),
        "t.ply" => ply_from_bytes(bytes, path, &options, &limits),
        _ => serialized_from_bytes(bytes, path, &options, &limits),
    }
}

const V: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

#[test]
fn bad_obj_files() {
    let cases: [(&str, Option<u32>, &str); 20] = [
        ("", None, "the mesh has no faces"),
        ("v 0 0 0\n", None, "the mesh has no faces"),
        ("v 0 0\n", Some(1), "2 of 3 numbers in \"v 0 0\""),
        ("v 0 0 zero\n", Some(1), "\"zero\" is not a number"),
        ("v 0 0 nan\n", Some(1), "\"nan\" is not a finite number"),
        ("\nv 0 1e999 0\n", Some(2), "\"1e999\" is not a finite number"),
        ("v 0 0 -inf\n", Some(1), "\"-inf\" is not a finite number"),
        ("vt\n", Some(1), "0 of 1 numbers in \"vt\""),
        ("vn 0 0 inf\n", Some(1), "\"inf\" is not a finite number"),
        ("{V}f 1 2 4\n", Some(4), "vertex index 4 is out of range: there are 3"),
        ("{V}f 1 2 0\n", Some(4), "vertex index 0 is out of range: there are 3"),
        ("{V}f 1 2 -4\n", Some(4), "vertex index -4 is out of range: there are 3"),
        (
            "{V}f 1 2 99999999999999999999\n",
            Some(4),
            "\"99999999999999999999\" is not a vertex index",
        ),
        ("{V}f 1 2 \\\n 3x\n", Some(4), "\"3x\" is not a vertex index"),
        ("{V}f 1 2 3/1/1/1\n", Some(4), "\"3/1/1/1\" is not a vertex of a face"),
        ("{V}f 1 2 /1\n", Some(4), "\"/1\" is not a vertex of a face"),
        ("{V}f 1/1 2 3\n", Some(4), "texture coordinate index 1 is out of range: there are 0"),
        (
            "{V}f 1 2 3\nf 1//2 2 3\nvn 0 0 1\n",
            Some(5),
            "normal index 2 is out of range: there are 1",
        ),
        ("{V}f 1//-1 2 3\n", Some(4), "normal index -1 is out of range: there are 0"),
        ("{V}\0f 1 2 3\n", Some(4), "a zero byte: this is not a text file"),
    ];
    for (text, line, message) in cases {
        let error = read_bytes("t.obj", text.replace("{V}", V).as_bytes()).unwrap_err();
        assert_eq!((error.line, error.message.as_str()), (line, message), "{text}");
    }
    let utf16: Vec<u8> = "\u{feff}v 0 0 0".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let message = read_bytes("t.obj", &utf16).unwrap_err().message;
    assert_eq!(message, "the file is UTF-16; OBJ files are plain text");
}

#[test]
fn bad_ply_files() {
    let cases: [(&str, &str); 24] = [
        ("", "the PLY header is cut"),
        ("ply", "the PLY header is cut"),
        ("solid\n", "this is not a PLY file: it does not begin with \"ply\""),
        ("ply\nformat ascii 2.0\n", "unknown PLY version \"2.0\""),
        ("ply\nformat text 1.0\n", "unknown PLY format \"text\""),
        ("ply\nend_header\n", "the PLY header has no line \"format\""),
        ("ply\nproperty float x\n", "\"property\" before the first \"element\""),
        ("ply\nelement vertex many\n", "\"many\" is not a number of rows"),
        ("ply\nelement vertex -1\n", "\"-1\" is not a number of rows"),
        ("ply\nelement vertex 1\nproperty complex x\n", "unknown PLY type \"complex\""),
        ("ply\nelement a 1\nproperty x\n", "a PLY property is a type and a name"),
        (
            "ply\nelement a 1\nproperty list float int x\n",
            "the length of a list must have an integer type",
        ),
        ("ply\nwhat is this\n", "unknown PLY header line \"what is this\""),
        ("{H}end_header\n", "the file has no element \"vertex\""),
        ("{H}{V}end_header\n0 0 0\n", "the file has no element \"face\""),
        (
            "{H}element vertex 1\nproperty float x\nend_header\n0\n",
            "element \"vertex\" has no properties x, y and z",
        ),
        (
            "{H}element vertex 18446744073709551615\nproperty float x\nend_header\n0\n",
            "the file is cut: 18446744073709551615 rows of element \"vertex\" need \
             18446744073709551615 bytes, 3 are left",
        ),
        (
            "{H}{V}element face 1\nproperty int n\nend_header\n0 0 0\n3",
            "element \"face\" has no list \"vertex_indices\"",
        ),
        (
            "{H}{V}{F}end_header\n0 0 zero\n3 0 0 0\n",
            "\"zero\" is not a valid number for property \"z\" of vertex 0",
        ),
        (
            "{H}{V}{F}end_header\n0 0 nan\n3 0 0 0\n",
            "the position of vertex 0 is not finite (line 10)",
        ),
        (
            "{H}{V}{F}end_header\n0 0 0\n3 0 0 1\n",
            "vertex index 1 of triangle 0 is out of range: there are 1",
        ),
        (
            "{H}{V}{F}end_header\n0 0 0\n3 0 0 -1\n",
            "vertex index -1 of face 0 is out of range (line 11)",
        ),
        (
            "{H}{V}{F}end_header\n0 0 0\n-3 0 0 0\n",
            "list \"vertex_indices\" of face 0 has the length -3 (line 11)",
        ),
        (
            "{H}{V}{F}end_header\n0 0 0\n2000000000 0 0\n",
            "the file is cut in property \"vertex_indices\" of face 0",
        ),
    ];
    for (text, message) in cases {
        let text = text
            .replace("{H}", "ply\nformat ascii 1.0\n")
            .replace(
                "{V}",
                "element vertex 1\nproperty float x\nproperty float y\nproperty float z\n",
            )
            .replace("{F}", "element face 1\nproperty list int int vertex_indices\n");
        assert_eq!(read_bytes("t.ply", text.as_bytes()).unwrap_err().message, message, "{text}");
    }
}

#[test]
fn bad_serialized_files() {
    let mesh = serialized_mesh(4, 0x1000, 1.0);
    let message = |bytes: &[u8]| read_bytes("t.serialized", bytes).unwrap_err().message;
    assert_eq!(message(b""), "the file is cut: there is no room for a mesh header");
    assert_eq!(message(b"ply\nformat"), "this is not a serialized mesh");
    assert_eq!(message(b"\x1c\x04\x05\0...."), "version 5 of the format is not supported");
    assert_eq!(message(b"\x1c\x04\x04\0...."), "the mesh's flags cannot be decompressed");
    assert_eq!(
        message(&serialized_mesh(4, 0x1000, f64::NAN)),
        "vertex 0 is not finite: [NaN, NaN, NaN]"
    );
    let huge = serialized_mesh(4, 0x1000, 1e300);
    assert!(message(&huge).contains("is not finite"), "{}", message(&huge));
    let at = |index| {
        let options = MeshOptions { shape_index: index, ..MeshOptions::default() };
        let path = Path::new("t");
        serialized_from_bytes(&mesh, path, &options, &Limits::default()).unwrap_err().message
    };
    assert!(at(1).contains("table of meshes"), "{}", at(1));
}

#[test]
fn files_cut_at_every_tenth_are_refused() {
    let files = [
        ("t.ply", binary_ply(false)),
        ("t.ply", binary_ply(true)),
        ("t.serialized", serialized_mesh(4, 0x100b, 1.0)),
    ];
    for (name, bytes) in files {
        read_bytes(name, &bytes).unwrap();
        for tenth in 0..10 {
            let error = read_bytes(name, &bytes[..bytes.len() * tenth / 10]).unwrap_err();
            assert!(!error.message.contains('\n'), "{error}");
        }
    }
}

#[test]
fn limits_are_kept() {
    let limits = Limits { max_mesh_elements: 3, ..Limits::default() };
    let (options, path) = (MeshOptions::default(), Path::new("t"));
    let four = format!("{V}v 0 0 1\nf 1 2 3\n");
    let error = obj_from_bytes(four.as_bytes(), path, &options, &limits).unwrap_err();
    assert_eq!((error.line, error.subject), (Some(4), crate::diagnostic::Subject::Memory));
    let error = ply_from_bytes(&binary_ply(false), path, &options, &limits).unwrap_err();
    assert_eq!(error.message, "4 vertices are more than the limit of 3");
    let mesh = serialized_mesh(4, 0x1000, 1.0);
    let error = serialized_from_bytes(&mesh, path, &options, &limits).unwrap_err();
    assert_eq!(error.message, "4 vertices are more than the limit of 3");
}

#[test]
fn what_is_no_regular_file_is_not_opened() {
    let folder = tempfile::tempdir().unwrap();
    let read = |path: &Path| read_obj(path, &MeshOptions::default(), &Limits::default());
    let error = read(folder.path()).unwrap_err();
    assert_eq!(error.message, "this is not a regular file");
    let error = read(&folder.path().join("none.obj")).unwrap_err();
    assert_eq!(error.message, "there is no such file");
}

/// A file with some bytes replaced and its end cut.
fn mutated(bytes: Vec<u8>) -> impl Strategy<Value = Vec<u8>> {
    let length = bytes.len();
    let changes = proptest::collection::vec((0..length, any::<u8>()), 0..6);
    (changes, length / 2..=length).prop_map(move |(changes, end)| {
        let mut out = bytes.clone();
        changes.into_iter().for_each(|(at, byte)| out[at] = byte);
        out.truncate(end);
        out
    })
}

/// What the rest of the program relies on.
fn assert_valid(result: Result<LoadedMesh, ReadError>) {
    let Ok(LoadedMesh { mesh, .. }) = result else { return };
    let count = mesh.positions.len();
    assert!(mesh.positions.iter().chain(&mesh.normals).all(|v| v.is_finite()));
    assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-3));
    assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < count));
    assert!([0, count].contains(&mesh.uvs.len()) && [0, count].contains(&mesh.normals.len()));
    for a in &mesh.attributes {
        let owners = if a.per_face { mesh.triangles.len() } else { count };
        assert_eq!(a.data.len(), a.channels * owners);
    }
}

const OBJ: &str =
    "v 0 0 0\nv 1 0 1e3\nv 0 -1 0\nvt 0 1\nvn 0 1 0\nf 1/1/1 2/1/1 \\\n 3/1\nf -1//1 -2 1 1\n";

proptest! {
    #[test]
    fn changed_obj_files_are_survived(bytes in mutated(OBJ.into())) {
        assert_valid(read_bytes("t.obj", &bytes));
    }

    #[test]
    fn changed_ply_files_are_survived(bytes in mutated(binary_ply(false))) {
        assert_valid(read_bytes("t.ply", &bytes));
    }

    #[test]
    fn changed_serialized_files_are_survived(
        bytes in mutated(serialized_file(4, &[serialized_mesh(4, 0x100b, 1.0)]))
    ) {
        assert_valid(read_bytes("t.serialized", &bytes));
        let options = MeshOptions { shape_index: 1, ..MeshOptions::default() };
        assert_valid(serialized_from_bytes(&bytes, Path::new("t"), &options, &Limits::default()));
    }
}
