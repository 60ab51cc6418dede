//! What `interaction` says must hold together: two rays side by side meet the surface at points
//! and normals that differ as the derivatives say. Which way normals and uv run is fixed by
//! examples.

use super::*;
use crate::accel::Accel;
use crate::bsdf::BsdfId;
use crate::interaction::{Detail, SurfaceDerivatives, SurfaceInteraction};
use crate::math::{DAffine3, DVec3, Ray};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

fn shape(kind: ShapeKind, flip_normals: bool) -> ShapeTable {
    let shapes = vec![Shape { kind, bsdf: BsdfId(0), emitter: None, flip_normals }];
    ShapeTable { shapes, ..ShapeTable::default() }
}

fn placed(table: &ShapeTable, transform: Transform) -> ShapeTable {
    let mut table = table.clone();
    table.groups.push(ShapeGroup { shapes: vec![ShapeId(0)] });
    table.instances.push(Instance { group: GroupId(0), transform });
    table
}

fn meet(table: &ShapeTable, o: Vec3, d: Vec3) -> Option<SurfaceInteraction> {
    let accel = Accel::build(table).unwrap();
    let ray = Ray::new(o, d.normalize());
    accel.intersect(table, &ray).map(|hit| table.interaction(&ray, &hit, Detail::Derivatives))
}

fn derivatives(si: &SurfaceInteraction) -> SurfaceDerivatives {
    si.derivatives.expect("they were asked for")
}

/// Turned by 40° and moved, after the given scaling.
fn transform(scale: DVec3) -> Transform {
    let axis = DVec3::new(1.0, 2.0, 3.0).normalize();
    let turned = DAffine3::from_axis_angle(axis, 40_f64.to_radians());
    let moved = DAffine3::from_translation(DVec3::new(0.1, 0.2, 0.3));
    Transform::new(moved * turned * DAffine3::from_scale(scale)).unwrap()
}

const SCALES: [DVec3; 4] =
    [DVec3::ONE, DVec3::new(1.5, 1.5, 1.5), DVec3::new(-1.0, 1.0, 1.0), DVec3::new(1.5, 0.7, 2.0)];

type Kind = fn(Transform) -> ShapeKind;
const KINDS: [Kind; 4] =
    [ShapeKind::Rectangle, ShapeKind::Disk, ShapeKind::Sphere, ShapeKind::Cylinder];

fn triangle(normals: bool, uvs: bool) -> ShapeTable {
    let mut mesh = Mesh {
        positions: vec![Vec3::ZERO, Vec3::new(2.0, 0.0, 0.5), Vec3::new(0.3, 1.5, 0.0)],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    if normals {
        let normals =
            [Vec3::new(0.1, 0.0, 1.0), Vec3::new(0.0, 0.3, 1.0), Vec3::new(-0.2, 0.2, 1.0)];
        mesh.normals = normals.map(Vec3::normalize).to_vec();
    }
    if uvs {
        mesh.uvs = vec![Vec2::ZERO, Vec2::new(0.7, 0.1), Vec2::new(0.2, 0.9)];
    }
    let mut table = shape(ShapeKind::Mesh(MeshId(0)), false);
    table.meshes.push(mesh);
    table
}

/// Compares differences between neighbouring rays with derivatives; for smooth normals also those.
fn assert_derivatives(table: &ShapeTable, o: Vec3, toward: Vec3, with_normals: bool, what: &str) {
    let step = 2e-3;
    let a = meet(table, o, toward - o).unwrap_or_else(|| panic!("{what}: not met"));
    for across in [Vec3::X, Vec3::Y, Vec3::Z] {
        let d = toward - o;
        let along = across - d * (across.dot(d) / d.length_squared());
        let b = meet(table, o, d + along * step).unwrap();
        let c = meet(table, o, d - along * step).unwrap();
        let (duv, dp) = (b.uv - c.uv, b.p - c.p);
        let want = derivatives(&a).dp_du * duv.x + derivatives(&a).dp_dv * duv.y;
        assert!(dp.distance(want) < 1e-2 * dp.length() + 1e-6, "{what}: {dp} is not {want}");
        if with_normals {
            let dn = b.frame.n - c.frame.n;
            let want = derivatives(&a).dn_du * duv.x + derivatives(&a).dn_dv * duv.y;
            assert!(dn.distance(want) < 1e-2 * dn.length() + 2e-5, "{what}: {dn} is not {want}");
        }
    }
    let si = a;
    assert!((si.frame.n.length() - 1.0).abs() < 1e-5 && (si.ng.length() - 1.0).abs() < 1e-5);
    assert!(
        si.frame.s.dot(derivatives(&si).dp_du) > 0.0 && si.frame.s.dot(si.frame.n).abs() < 1e-5
    );
    assert!(si.p.distance(o + si.t * (toward - o).normalize()) < 1e-5 * (1.0 + si.t), "{what}");
    assert!(si.offset > 0.0 && si.offset < 1e-4);
}

#[test]
fn neighbouring_rays_agree_with_the_derivatives() {
    let outer = transform(DVec3::new(0.5, 1.0, -0.8));
    for scale in SCALES {
        for (i, kind) in KINDS.into_iter().enumerate() {
            for flip in [false, true] {
                let inner = transform(scale);
                let table = shape(kind(inner), flip);
                let from = inner.point(Vec3::new(1.0, 2.5, 0.9));
                let to = inner.point(Vec3::new(0.4, 0.3, if i == 3 { 0.5 } else { 0.0 }));
                let what = format!("{scale} kind {i}");
                assert_derivatives(&table, from, to, true, &what);
                let (from, to) = (outer.point(from), outer.point(to));
                assert_derivatives(&placed(&table, outer), from, to, true, &what);
            }
        }
    }
    let o = Vec3::new(0.3, 3.0, 4.0);
    for normals in [false, true] {
        for uvs in [false, true] {
            // Derivatives of a mesh's normals are by the barycentrics, whatever its uv.
            let table = triangle(normals, uvs);
            let toward = Vec3::new(0.5, 0.4, 0.105);
            assert_derivatives(&table, o, toward, !uvs, "triangle");
            let (from, to) = (outer.point(o), outer.point(toward));
            assert_derivatives(&placed(&table, outer), from, to, !uvs, "placed triangle");
        }
    }
}

fn assert_near(a: Vec3, b: Vec3) {
    assert!(a.distance(b) < 1e-5, "{a} is not {b}");
}

fn assert_uv(si: &SurfaceInteraction, u: f32, v: f32) {
    assert!(si.uv.distance(Vec2::new(u, v)) < 1e-5, "{} is not ({u}, {v})", si.uv);
}

const UP: Vec3 = Vec3::new(0.3, 0.2, 5.0);

#[test]
fn rectangles_lie_in_the_unit_square() {
    let si =
        meet(&shape(ShapeKind::Rectangle(Transform::IDENTITY), false), UP, Vec3::NEG_Z).unwrap();
    assert_uv(&si, 0.65, 0.6);
    assert_near(si.p, Vec3::new(0.3, 0.2, 0.0));
    assert_near(si.ng, Vec3::Z);
    assert_near(derivatives(&si).dp_du, 2.0 * Vec3::X);
    assert_near(derivatives(&si).dp_dv, 2.0 * Vec3::Y);
    assert_near(si.wo, Vec3::Z);
    assert_eq!((si.primitive, si.barycentric, si.shape), (0, Vec2::ZERO, ShapeId(0)));
    // Both triangles, and the corner that they share with the first vertex.
    for (x, y) in [(-0.9, 0.8), (0.8, -0.9), (0.99, 0.99), (-0.99, -0.99)] {
        let table = shape(ShapeKind::Rectangle(Transform::IDENTITY), false);
        let si = meet(&table, Vec3::new(x, y, 1.0), Vec3::NEG_Z).unwrap();
        assert_uv(&si, 0.5 * (x + 1.0), 0.5 * (y + 1.0));
        assert_near(si.p, Vec3::new(x, y, 0.0));
    }
}

#[test]
fn disks_have_polar_coordinates() {
    let table = shape(ShapeKind::Disk(Transform::IDENTITY), false);
    let si = meet(&table, Vec3::new(0.0, 0.5, 2.0), Vec3::NEG_Z).unwrap();
    assert_uv(&si, 0.5, 0.25);
    assert_near(derivatives(&si).dp_du, Vec3::Y);
    assert_near(derivatives(&si).dp_dv, TAU * Vec3::new(-0.5, 0.0, 0.0));
    assert_near(si.ng, Vec3::Z);
    assert!(meet(&table, Vec3::new(0.8, 0.7, 2.0), Vec3::NEG_Z).is_none());
    // The middle, where the angle means nothing.
    let si = meet(&table, Vec3::Z, Vec3::NEG_Z).unwrap();
    assert!(derivatives(&si).dp_du.is_finite() && si.frame.s.is_finite() && si.uv.is_finite());
}

#[test]
fn spheres_have_longitude_and_polar_angle() {
    let table = shape(ShapeKind::Sphere(Transform::IDENTITY), false);
    let si = meet(&table, Vec3::new(0.0, -3.0, 0.0), Vec3::Y).unwrap();
    assert_uv(&si, 0.75, 0.5);
    assert_near(si.ng, Vec3::NEG_Y);
    assert_near(derivatives(&si).dp_du, TAU * Vec3::X);
    assert_near(derivatives(&si).dp_dv, PI * Vec3::NEG_Z);
    assert_near(derivatives(&si).dn_du, derivatives(&si).dp_du);
    let inside = meet(&table, Vec3::new(0.1, 0.2, 0.3), Vec3::X).unwrap();
    assert_near(inside.ng, inside.p);
    // The pole.
    let si = meet(&table, 3.0 * Vec3::Z, Vec3::NEG_Z).unwrap();
    assert_uv(&si, si.uv.x, 0.0);
    assert!(si.frame.s.is_finite() && derivatives(&si).dp_dv.is_finite());
}

#[test]
fn cylinders_are_open_and_face_outwards() {
    let table = shape(ShapeKind::Cylinder(Transform::IDENTITY), false);
    let si = meet(&table, Vec3::new(0.0, 3.0, 0.25), Vec3::NEG_Y).unwrap();
    assert_uv(&si, 0.25, 0.25);
    assert_near(si.ng, Vec3::Y);
    assert_near(derivatives(&si).dp_du, TAU * Vec3::NEG_X);
    assert_near(derivatives(&si).dp_dv, Vec3::Z);
    assert!(meet(&table, Vec3::new(0.1, 0.2, 3.0), Vec3::NEG_Z).is_none());
    let inside = meet(&table, Vec3::new(0.0, 0.0, 0.5), Vec3::X).unwrap();
    assert_near(inside.ng, Vec3::X);
}

#[test]
fn mirrors_and_flips_turn_normals_as_in_mitsuba() {
    let mirror = Transform::new(DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0))).unwrap();
    let side = Vec3::new(0.3, 3.0, 0.5);
    // Geometric and shading normal seen along the ray: -1 faces it.
    let cases: [(Kind, Vec3, Vec3, [f32; 2]); 4] = [
        (ShapeKind::Rectangle, UP, Vec3::NEG_Z, [1.0, -1.0]),
        (ShapeKind::Disk, UP, Vec3::NEG_Z, [-1.0, -1.0]),
        (ShapeKind::Sphere, UP, Vec3::NEG_Z, [1.0, 1.0]),
        (ShapeKind::Cylinder, side, Vec3::NEG_Y, [-1.0, -1.0]),
    ];
    for (kind, o, d, mirrored) in cases {
        let signs = |t: Transform, flip: bool| {
            let si = meet(&shape(kind(t), flip), o, d).unwrap();
            [si.ng.dot(d).signum(), si.frame.n.dot(d).signum()]
        };
        assert_eq!(signs(Transform::IDENTITY, false), [-1.0, -1.0]);
        assert_eq!(signs(Transform::IDENTITY, true), [1.0, 1.0]);
        assert_eq!(signs(mirror, false), mirrored);
        assert_eq!(signs(mirror, true), mirrored.map(|s| -s));
        let twice = placed(&shape(kind(Transform::IDENTITY), false), mirror);
        let si = meet(&twice, o, d).unwrap();
        assert_eq!([si.ng.dot(d).signum(), si.frame.n.dot(d).signum()], [-1.0, -1.0]);
    }
}

#[test]
fn flipping_keeps_positions_and_derivatives() {
    for kind in [ShapeKind::Rectangle, ShapeKind::Disk, ShapeKind::Sphere] {
        let [a, b] = [false, true].map(|flip| {
            let table = shape(kind(transform(DVec3::ONE)), flip);
            meet(&table, Vec3::new(0.3, 0.2, 5.0), Vec3::new(0.02, 0.01, -1.0)).unwrap()
        });
        assert_eq!(
            (a.p, a.uv, derivatives(&a).dp_du, derivatives(&a).dp_dv),
            (b.p, b.uv, derivatives(&b).dp_du, derivatives(&b).dp_dv)
        );
        assert_eq!((a.ng, a.frame.n, a.frame.s), (-b.ng, -b.frame.n, b.frame.s));
    }
}

#[test]
fn meshes_interpolate() {
    let si = meet(&triangle(true, true), Vec3::new(0.5, 0.4, 3.0), Vec3::NEG_Z).unwrap();
    let (u, v) = (si.barycentric.x, si.barycentric.y);
    assert!((2.0 * u + 0.3 * v - 0.5).abs() < 1e-6 && (1.5 * v - 0.4).abs() < 1e-6);
    assert_uv(&si, 0.7 * u + 0.2 * v, 0.1 * u + 0.9 * v);
    let mesh = &triangle(true, true).meshes[0];
    let n = mesh.normals[0] * (1.0 - u - v) + mesh.normals[1] * u + mesh.normals[2] * v;
    assert_near(si.frame.n, n.normalize());
    assert_near(si.ng, Vec3::new(2.0, 0.0, 0.5).cross(Vec3::new(0.3, 1.5, 0.0)).normalize());
    let flat = meet(&triangle(false, false), Vec3::new(0.5, 0.4, 3.0), Vec3::NEG_Z).unwrap();
    assert_eq!((flat.frame.n, flat.uv), (flat.ng, flat.barycentric));
}

#[test]
fn degenerate_texture_coordinates_leave_a_frame() {
    let mut table = triangle(false, true);
    table.meshes[0].uvs = vec![Vec2::ONE; 3];
    let si = meet(&table, Vec3::new(0.5, 0.4, 3.0), Vec3::NEG_Z).unwrap();
    assert!(derivatives(&si).dp_du.is_finite() && derivatives(&si).dp_du.dot(si.ng).abs() < 1e-5);
    assert_uv(&si, 1.0, 1.0);
}

#[test]
fn areas_and_boxes() {
    let area = |kind| shape(kind, false).surface_area(ShapeId(0));
    let close = |a: f32, b: f32| assert!((a - b).abs() < 1e-5 * b, "{a} is not {b}");
    let t = transform(DVec3::splat(-1.5));
    close(area(ShapeKind::Rectangle(t)), 4.0 * 2.25);
    close(area(ShapeKind::Disk(t)), PI * 2.25);
    close(area(ShapeKind::Sphere(t)), 4.0 * PI * 2.25);
    close(area(ShapeKind::Cylinder(t)), TAU * 2.25);
    // A prolate spheroid with axes 1, 1, 2: 2π (1 + 2/e · asin e), e² = 3/4.
    let e = 0.75_f32.sqrt();
    let spheroid = area(ShapeKind::Sphere(transform(DVec3::new(1.0, 1.0, 2.0))));
    let exact = TAU * (1.0 + 2.0 / e * e.asin());
    assert!((spheroid - exact).abs() < 1e-3 * exact, "{spheroid} is not {exact}");
    close(triangle(false, false).surface_area(ShapeId(0)), 0.5 * 9.585_f32.sqrt());

    let bounds = |kind| shape(kind, false).shape_bounds(ShapeId(0));
    for kind in KINDS {
        for scale in SCALES {
            let t = transform(scale);
            let b = bounds(kind(t));
            let mut touched = crate::math::Bounds3::EMPTY;
            for i in 0..40_000 {
                let phi = TAU * (i % 200) as f32 / 200.0;
                let h = (i / 200) as f32 / 199.0;
                let p = match kind(t) {
                    ShapeKind::Rectangle(_) => Vec3::new(phi / PI - 1.0, 2.0 * h - 1.0, 0.0),
                    ShapeKind::Disk(_) => Vec3::new(phi.cos(), phi.sin(), 0.0) * h,
                    ShapeKind::Sphere(_) => {
                        let theta = FRAC_PI_2 * (2.0 * h - 1.0);
                        Vec3::new(phi.cos() * theta.cos(), phi.sin() * theta.cos(), theta.sin())
                    }
                    _ => Vec3::new(phi.cos(), phi.sin(), h),
                };
                touched = touched.including(t.point(p));
            }
            assert!(b.min.cmple(touched.min).all() && b.max.cmpge(touched.max).all());
            let slack = (touched.min - b.min).max(b.max - touched.max).max_element();
            assert!(slack < 0.02, "{b:?} is larger than {touched:?}");
        }
    }
}

#[test]
fn far_and_large_spheres_are_precise() {
    // Earth-sized, the ray from a metre above the ground.
    let radius = 6.4e6_f64;
    let below = DAffine3::from_translation(DVec3::new(0.0, 0.0, -radius));
    let t = Transform::new(below * DAffine3::from_scale(DVec3::splat(radius))).unwrap();
    let si =
        meet(&shape(ShapeKind::Sphere(t), false), Vec3::new(3.0, 0.0, 1.0), Vec3::NEG_Z).unwrap();
    assert!((si.t - 1.0).abs() < 1e-3, "{}", si.t);
    // A metre-sized one, ten thousand away, seen at its very edge.
    let table = shape(ShapeKind::Sphere(Transform::IDENTITY), false);
    let grazing = |y: f32| meet(&table, Vec3::new(-1e4, y, 0.0), Vec3::X);
    assert!(grazing(0.999_999).is_some() && grazing(1.000_001).is_none());
}
