//! Meshes and pictures that a scene names.

use claror_io::diagnostic::Subject;

use crate::{Case, scene};

fn mesh(name: &'static str, file: &str, bytes: impl Into<Vec<u8>>, expected: &'static str) -> Case {
    let kind = file.rsplit('.').next().unwrap_or_default();
    let body =
        format!("<shape type=\"{kind}\"><string name=\"filename\" value=\"{file}\"/></shape>");
    scene(name, &body, expected).file(file, bytes).about(Subject::File)
}

fn bitmap(name: &'static str, bytes: impl Into<Vec<u8>>, expected: &'static str) -> Case {
    let body = "<texture type=\"bitmap\"><string name=\"filename\" value=\"a.png\"/></texture>";
    scene(name, body, expected).file("a.png", bytes).about(Subject::File)
}

fn environment(name: &'static str, pixel: f32, expected: &'static str) -> Case {
    let body = "<emitter type=\"envmap\"><string name=\"filename\" value=\"sky.pfm\"/></emitter>";
    let mut bytes = b"PF\n4 2\n-1.0\n".to_vec();
    for _ in 0..24 {
        bytes.extend(pixel.to_le_bytes());
    }
    scene(name, body, expected).file("sky.pfm", bytes).about(Subject::File)
}

/// A PNG that says to be of that size, with the beginning of a data chunk.
fn png(width: u32, height: u32) -> Vec<u8> {
    let mut header = b"IHDR".to_vec();
    header.extend(width.to_be_bytes());
    header.extend(height.to_be_bytes());
    header.extend([8, 2, 0, 0, 0]);
    let mut bytes = b"\x89PNG\r\n\x1a\n\0\0\0\r".to_vec();
    bytes.extend(&header);
    bytes.extend(crc32(&header).to_be_bytes());
    bytes.extend(b"\0\0\x40\0IDAT\x78\x9c");
    bytes
}

/// The checksum of PNG chunks (ISO 3309).
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |c, _| {
            if c & 1 == 1 { (c >> 1) ^ 0xedb8_8320 } else { c >> 1 }
        })
    })
}

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                   property float z\nelement face 1\nproperty list uchar int vertex_indices\n\
                   end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

pub(crate) fn cases() -> Vec<Case> {
    let obj = "<shape type=\"obj\"><string name=\"filename\" value=\"hause.obj\"/></shape>";
    vec![
        scene(
            "missing mesh",
            obj,
            "2:19: file \"hause.obj\" is not found (did you mean \"house.obj\"?)",
        )
        .file("house.obj", "v 0 0 0")
        .about(Subject::File),
        scene(
            "mesh without name",
            "<shape type=\"ply\"/>",
            "\"ply\" needs the parameter \"filename\"",
        ),
        scene(
            "folder as a mesh",
            "<shape type=\"obj\"><string name=\"filename\" value=\".\"/></shape>",
            "file \".\" is not found",
        )
        .about(Subject::File),
        mesh("index out of range", "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "a.obj:4: "),
        mesh("NaN vertex", "a.obj", "v 0 nan 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "a.obj:1: "),
        mesh("empty mesh", "a.ply", "", "a.ply"),
        mesh("cut mesh", "a.ply", &PLY[..PLY.len() - 12], "a.ply"),
        mesh("mesh index out of range", "a.ply", PLY.replace("3 0 1 2", "3 0 1 9"), "a.ply"),
        mesh("infinite vertex", "a.ply", PLY.replace("1 0 0", "inf 0 0"), "a.ply"),
        bitmap("picture of text", "hello", "a.png: "),
        bitmap("empty picture", "", "a.png: "),
        bitmap("cut picture", png(16, 16), "a.png: "),
        bitmap("picture bomb", png(1_000_000, 1_000_000), "a.png: ").about(Subject::Memory),
        environment(
            "NaN environment",
            f32::NAN,
            "the environment map is not finite at pixel (0, 0)",
        ),
        environment("infinite environment", f32::INFINITY, "is not finite"),
        environment("negative environment", -1.0, "is negative at pixel (0, 0)"),
        scene(
            "checkerboard around the scene",
            "<emitter type=\"envmap\"><texture type=\"checkerboard\"/></emitter>",
            "only a \"bitmap\" can be wrapped around the scene",
        ),
    ]
}

/// Scenes that are odd but usable: name, scene and other file, and the warning.
pub(crate) fn odd() -> Vec<Case> {
    let flat = "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\n";
    let many = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{}", "f 1 2 3\n".repeat(100_000));
    vec![
        mesh("zero area", "a.obj", flat, "a.obj: 1 of 2 triangles have no area"),
        Case { expected: vec![], ..mesh("10^5 identical faces", "a.obj", many, "") },
        environment("black environment", 0.0, "the environment map is black"),
        scene("text", "hello", "2:1: text between elements is ignored"),
    ]
}
