//! The expected numbers were printed by Mitsuba 3.9.1 (`scalar_rgb`) for the same pictures.

use super::*;
use crate::bsdf::BsdfId;
use crate::interaction::SurfaceInteraction;
use crate::math::{Frame, Vec2, Vec3};
use crate::shape::{Mesh, MeshAttribute, MeshId, Shape, ShapeId, ShapeKind, ShapeTable};

const TO_UV: UvTransform = UvTransform([1.3, 0.4, 0.2, -0.7, 2.1, 0.3]);

fn at(u: f32, v: f32) -> SurfaceInteraction {
    SurfaceInteraction {
        p: Vec3::ZERO,
        offset: 0.0,
        ng: Vec3::Z,
        frame: Frame::from_normal(Vec3::Z),
        uv: Vec2::new(u, v),
        derivatives: None,
        wo: Vec3::Z,
        t: 1.0,
        shape: ShapeId(0),
        primitive: 0,
        barycentric: Vec2::new(u, v),
        instance: None,
    }
}

fn picture(width: usize, height: usize) -> Image {
    let mut image = Image::new(width, height, 3);
    for (i, value) in image.data.iter_mut().enumerate() {
        let (x, y, c) = (i / 3 % width, i / 3 / width, i % 3);
        *value = ((x * 7 + y * 5 + c * 3) % 11) as f32 / 11.0;
    }
    image
}

fn bitmap(filter: TextureFilter, wrap: WrapMode, to_uv: UvTransform, scale: f32) -> TextureTable {
    TextureTable {
        textures: vec![Texture::Bitmap { image: ImageId(0), filter, wrap, to_uv, scale }],
        images: vec![picture(4, 3)],
    }
}

fn assert_close(actual: Rgb, expected: [f32; 3]) {
    for (a, e) in actual.to_array().into_iter().zip(expected) {
        assert!((a - e).abs() < 2e-6, "{actual:?}, expected {expected:?}");
    }
}

/// Wrap mode, filter, u, v, then what Mitsuba says: `eval`, `eval_1`, `eval_1_grad`.
type BitmapCase = (WrapMode, TextureFilter, f32, f32, [f32; 3], f32, [f32; 2]);

#[rustfmt::skip]
const BITMAP_CASES: [BitmapCase; 14] = [
    (WrapMode::Repeat, TextureFilter::Nearest, 0.1, 0.2, [0.0909091, 0.3636364, 0.6363636], 0.3253177, [0.0, 0.0]),
    (WrapMode::Repeat, TextureFilter::Nearest, -0.73, 1.41, [0.8181818, 0.0909091, 0.3636364], 0.2652614, [0.0, 0.0]),
    (WrapMode::Repeat, TextureFilter::Nearest, 2.37, -0.55, [0.4545455, 0.7272727, 0.0], 0.616785, [0.0, 0.0]),
    (WrapMode::Repeat, TextureFilter::Bilinear, 0.1, 0.2, [0.3215455, 0.5172727, 0.403], 0.4674003, [-2.129372, 2.028019]),
    (WrapMode::Repeat, TextureFilter::Bilinear, -0.73, 1.41, [0.6259782, 0.2343855, 0.5071127], 0.3373483, [0.310437, -1.281927]),
    (WrapMode::Repeat, TextureFilter::Bilinear, 2.37, -0.55, [0.4229338, 0.684909, 0.2448856], 0.5974385, [-0.903179, 2.197776]),
    (WrapMode::Mirror, TextureFilter::Nearest, 0.1, 0.2, [0.0909091, 0.3636364, 0.6363636], 0.3253177, [0.0, 0.0]),
    (WrapMode::Mirror, TextureFilter::Nearest, -0.73, 1.41, [0.0, 0.2727273, 0.5454546], 0.2344085, [0.0, 0.0]),
    (WrapMode::Mirror, TextureFilter::Nearest, 2.37, -0.55, [0.3636364, 0.6363636, 0.9090909], 0.5980449, [0.0, 0.0]),
    (WrapMode::Mirror, TextureFilter::Bilinear, -0.73, 1.41, [0.1922036, 0.464931, 0.4019782], 0.4023865, [-1.619465, -1.603314]),
    (WrapMode::Mirror, TextureFilter::Bilinear, 2.37, -0.55, [0.3827272, 0.6134546, 0.886182], 0.5840681, [-0.931794, 2.096536]),
    (WrapMode::Clamp, TextureFilter::Nearest, -0.73, 1.41, [0.9090909, 0.1818182, 0.4545455], 0.3561705, [0.0, 0.0]),
    (WrapMode::Clamp, TextureFilter::Bilinear, 0.1, 0.2, [0.3215455, 0.5172727, 0.403], 0.4674003, [-2.129372, 2.028019]),
    (WrapMode::Clamp, TextureFilter::Bilinear, 2.37, -0.55, [0.9090909, 0.1818182, 0.4545455], 0.3561705, [0.0, 0.0]),
];

#[test]
fn bitmaps_read_as_in_mitsuba() {
    let shapes = ShapeTable::default();
    for (wrap, filter, u, v, rgb, scalar, gradient) in BITMAP_CASES {
        let (table, si) = (bitmap(filter, wrap, TO_UV, 1.0), at(u, v));
        assert_close(table.rgb(&shapes, TextureId(0), &si), rgb);
        let s = table.scalar(&shapes, TextureId(0), &si);
        assert!((s - scalar).abs() < 2e-6, "{s}, expected {scalar}");
        let g = table.gradient(&shapes, TextureId(0), &si);
        assert!((g - Vec2::from(gradient)).abs().max_element() < 1e-5, "{g}, {gradient:?}");
    }
}

#[test]
fn gradient_of_a_square_bitmap_is_the_derivative_of_its_scalar() {
    let shapes = ShapeTable::default();
    let mut table = bitmap(TextureFilter::Bilinear, WrapMode::Repeat, TO_UV, 2.5);
    table.images[0] = picture(4, 4);
    let h = 1.0 / 1024.0;
    for (u, v) in [(0.11, 0.23), (0.62, -1.37), (-2.3, 0.77)] {
        let value = |u, v| table.scalar(&shapes, TextureId(0), &at(u, v));
        let difference =
            Vec2::new(value(u + h, v) - value(u - h, v), value(u, v + h) - value(u, v - h));
        let g = table.gradient(&shapes, TextureId(0), &at(u, v));
        // Quadratic within a pixel: the central difference is right but for rounding, and for
        // points within h of a pixel's edge, which these are not.
        let error = (g - difference / (2.0 * h)).abs().max_element();
        assert!(error < 2e-2 && g.length() > 1.0, "{g} at {u}, {v}: off by {error}");
    }
}

#[test]
fn wild_coordinates_and_empty_pictures_do_no_harm() {
    let shapes = ShapeTable::default();
    for wrap in [WrapMode::Repeat, WrapMode::Mirror, WrapMode::Clamp] {
        for filter in [TextureFilter::Nearest, TextureFilter::Bilinear] {
            let mut table = bitmap(filter, wrap, UvTransform::IDENTITY, 1.0);
            for u in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30, -1e30, f32::MIN_POSITIVE] {
                table.rgb(&shapes, TextureId(0), &at(u, 0.5));
                table.gradient(&shapes, TextureId(0), &at(0.5, u));
            }
            table.images[0] = Image::default();
            assert!(table.rgb(&shapes, TextureId(0), &at(0.3, 0.3)).is_black());
            assert!(table.mean(&shapes, TextureId(0)).is_black());
        }
    }
}

#[test]
fn grey_pictures_and_alpha() {
    let shapes = ShapeTable::default();
    for (channels, expected) in [(1, [0.4; 3]), (2, [0.4; 3]), (4, [0.4, 0.5, 0.6])] {
        let mut table = bitmap(TextureFilter::Bilinear, WrapMode::Repeat, TO_UV, 1.0);
        let data = vec![0.4, 0.5, 0.6, 0.7][..channels].to_vec();
        table.images[0] = Image { width: 1, height: 1, channels, data };
        assert_close(table.rgb(&shapes, TextureId(0), &at(0.2, 0.9)), expected);
        assert_close(table.mean(&shapes, TextureId(0)), expected);
    }
}

#[test]
fn checkerboard_cells_as_in_mitsuba() {
    let shapes = ShapeTable::default();
    let (first, second) = (Rgb::new(0.9, 0.1, 0.1), Rgb::new(0.1, 0.1, 0.8));
    let table = TextureTable {
        textures: vec![
            Texture::Constant(first),
            Texture::Constant(second),
            Texture::Checkerboard {
                color0: TextureId(0),
                color1: TextureId(1),
                to_uv: UvTransform::IDENTITY,
            },
        ],
        images: vec![],
    };
    let cells = [
        (0.1, 0.1, first),
        (0.6, 0.1, second),
        (0.1, 0.6, second),
        (0.6, 0.6, first),
        (-0.1, 0.1, second),
        (0.5, 0.1, first),
        (1.0, 0.1, first),
        (0.5, 0.5, first),
    ];
    for (u, v, expected) in cells {
        assert_eq!(table.rgb(&shapes, TextureId(2), &at(u, v)), expected, "at {u}, {v}");
        // eval_1 exchanges the colours, and of a colour is the mean of its channels.
        let other = if expected == first { second } else { first };
        assert_eq!(table.scalar(&shapes, TextureId(2), &at(u, v)), other.mean());
    }
    assert_close(table.mean(&shapes, TextureId(2)), [0.5, 0.1, 0.45]);
    assert_eq!(table.constant(TextureId(0)), Some(first));
    assert_eq!(table.constant(TextureId(2)), None);
}

#[test]
fn mesh_attributes_as_in_mitsuba() {
    let attribute = |name: &str, per_face, channels, data: &[f32]| MeshAttribute {
        name: name.into(),
        per_face,
        channels,
        data: data.to_vec(),
    };
    let mesh = Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        triangles: vec![[0, 1, 2]],
        attributes: vec![
            attribute("vertex_color", false, 3, &[1., 0., 0., 0., 1., 0., 0., 0., 1.]),
            attribute("face_color", true, 3, &[0.2, 0.3, 0.4]),
            attribute("vertex_x", false, 1, &[1.0, 2.0, 3.0]),
        ],
        ..Mesh::default()
    };
    let shape = Shape {
        kind: ShapeKind::Mesh(MeshId(0)),
        bsdf: BsdfId(0),
        emitter: None,
        flip_normals: false,
    };
    let shapes = ShapeTable { shapes: vec![shape], meshes: vec![mesh], ..ShapeTable::default() };
    let expected = [
        ("vertex_color", [1.0, 0.4, 0.6]),
        ("face_color", [0.4, 0.6, 0.8]),
        ("vertex_x", [3.6; 3]),
        ("vertex_missing", [0.0; 3]),
    ];
    for (name, value) in expected {
        let textures = vec![Texture::MeshAttribute { name: name.into(), scale: 2.0 }];
        let table = TextureTable { textures, images: vec![] };
        assert_close(table.rgb(&shapes, TextureId(0), &at(0.2, 0.3)), value);
    }
}
