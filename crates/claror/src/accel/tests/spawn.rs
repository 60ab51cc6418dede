//! Rays that leave a surface, at any angle, do not meet it again; nor its neighbours, where these
//! go on in the same plane or bend away.

use super::*;
use crate::interaction::Detail;
use crate::math::Vec2;
use crate::shape::{MeshId, ShapeKind};

/// A plane square cut into many triangles of uneven shapes, turned, scaled and moved.
fn uneven_plane(n: &mut Numbers, cuts: usize, placed: &Transform) -> Mesh {
    let mut mesh = Mesh::default();
    for j in 0..=cuts {
        for i in 0..=cuts {
            let inside = i > 0 && i < cuts && j > 0 && j < cuts;
            let shift = if inside { Vec2::new(n.next(), n.next()) - 0.5 } else { Vec2::ZERO };
            let p = (Vec2::new(i as f32, j as f32) + 0.9 * shift) / cuts as f32;
            mesh.positions.push(placed.point((2.0 * p - 1.0).extend(0.0)));
        }
    }
    let vertex = |i: usize, j: usize| (j * (cuts + 1) + i) as u32;
    for j in 0..cuts {
        for i in 0..cuts {
            let [a, b] = [vertex(i, j), vertex(i + 1, j)];
            let [c, d] = [vertex(i, j + 1), vertex(i + 1, j + 1)];
            mesh.triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    mesh
}

fn placement(n: &mut Numbers, scale: f64, distance: f64) -> Transform {
    let rotation = DAffine3::from_axis_angle(n.direction().as_dvec3(), f64::from(n.next()) * 6.0);
    let moved = DAffine3::from_translation(n.direction().as_dvec3() * distance);
    let stretch = DVec3::new(1.0, 0.3 + f64::from(n.next()), 0.5) * scale;
    Transform::new(moved * rotation * DAffine3::from_scale(stretch)).expect("regular")
}

/// A direction on the side of `n`, often close to the surface.
fn leaving(numbers: &mut Numbers, n: Vec3) -> Vec3 {
    let d = numbers.direction();
    let d = if d.dot(n) < 0.0 { -d } else { d };
    let flat = numbers.next() < 0.5;
    let along = d - n * n.dot(d);
    let d = if flat { along + n * (0.001 * (0.02 + n.dot(d))) } else { d };
    d.normalize()
}

/// Points of a shape, as rays from all around (and towards the shape) meet it.
fn hits(
    table: &ShapeTable,
    accel: &Accel,
    n: &mut Numbers,
    count: usize,
) -> Vec<crate::interaction::SurfaceInteraction> {
    let bounds = accel.bounds();
    let (center, radius) = (bounds.center(), 0.5 * bounds.extent().length());
    let mut found = Vec::new();
    for _ in 0..count {
        let from = center + n.direction() * radius * (1.0 + 3.0 * n.next());
        let to = center + n.point() * 0.5 * bounds.extent();
        let ray = Ray::new(from, (to - from).normalize());
        if let Some(hit) = accel.intersect(table, &ray) {
            found.push(table.interaction(&ray, &hit, Detail::Point));
        }
    }
    assert!(found.len() > count / 20, "only {} of {count} rays hit", found.len());
    found
}

/// Scales and distances at which everything is tried.
const PLACES: [(f64, f64); 6] =
    [(1.0, 0.0), (1.0, 3.0), (1.0, 1000.0), (1e-3, 1.0), (300.0, 10.0), (1e4, 1e5)];

/// The table, with every shape wrapped into an instance.
fn instanced(mut table: ShapeTable, n: &mut Numbers, scale: f64, distance: f64) -> ShapeTable {
    let shapes = (0..table.shapes.len() as u32).map(ShapeId).collect();
    table.groups.push(ShapeGroup { shapes });
    let transform = placement(n, scale, distance);
    table.instances.push(Instance { group: GroupId(0), transform });
    table
}

/// Spawned rays per point.
const RAYS: usize = 8;

/// No ray that leaves a flat thing meets it again; nor, if so asked, anything else.
fn assert_flat_is_left(
    table: &ShapeTable,
    n: &mut Numbers,
    points: usize,
    nothing_else: bool,
    what: &str,
) {
    let accel = Accel::build(table).unwrap();
    for si in hits(table, &accel, n, points) {
        for side in [si.ng, -si.ng] {
            for _ in 0..RAYS {
                let ray = si.spawn_ray(leaving(n, side));
                let hit = accel.intersect(table, &ray);
                let wrong = hit.is_some_and(|h| nothing_else || h.primitive == si.primitive);
                assert!(!wrong, "{what}: {hit:?} from {si:?} by {ray:?}");
            }
        }
    }
}

/// Whether a mesh of this size at this distance is still even: in single precision its vertices
/// stand on a grid, and flat rays meet the steps of that.
fn is_even(scale: f64, distance: f64) -> bool {
    distance < 4.0 * scale
}

#[test]
fn plane_meshes_are_left() {
    let mut n = Numbers(11);
    for (scale, distance) in PLACES {
        let placed = placement(&mut n, scale, distance);
        let mut table = ShapeTable::default();
        let mesh = uneven_plane(&mut n, 12, &placed);
        add_mesh(&mut table, mesh);
        assert_flat_is_left(
            &table,
            &mut n,
            3000,
            is_even(scale, distance),
            &format!("plane {scale} {distance}"),
        );
    }
}

#[test]
fn slivers_are_left() {
    let mut n = Numbers(12);
    for (scale, distance) in PLACES {
        let placed = placement(&mut n, scale, distance);
        let mut table = ShapeTable::default();
        let mut mesh = Mesh::default();
        for i in 0..20_u32 {
            let y = i as f32 * 0.1 - 1.0;
            for p in [Vec2::new(-1.0, y), Vec2::new(1.0, y + 0.001), Vec2::new(0.3, y + 0.002)] {
                mesh.positions.push(placed.point(p.extend(0.0)));
            }
            mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
        }
        add_mesh(&mut table, mesh);
        let accel = Accel::build(&table).unwrap();
        for si in slivers_hit(&table, &mut n) {
            for side in [si.ng, -si.ng] {
                for _ in 0..RAYS {
                    let ray = si.spawn_ray(leaving(&mut n, side));
                    let hit = accel.intersect(&table, &ray);
                    let own = hit.is_some_and(|h| h.primitive == si.primitive);
                    assert!(!own, "{scale} {distance}: {hit:?} from {si:?} by {ray:?}");
                }
            }
        }
    }
}

/// Points on slivers, chosen on them: few rays would meet one.
fn slivers_hit(table: &ShapeTable, n: &mut Numbers) -> Vec<crate::interaction::SurfaceInteraction> {
    let triangles = table.meshes[0].triangles.len() as u32;
    let points = (0..4000).map(|i| {
        let (a, b) = (n.next(), n.next());
        let (u, v) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
        let shape = ShapeId(0);
        let hit = Hit { t: 1.0, u, v, shape, primitive: i % triangles, instance: None };
        table.interaction(&Ray::new(Vec3::ZERO, Vec3::Z), &hit, Detail::Point)
    });
    points.collect()
}

#[test]
fn rectangles_and_disks_are_left() {
    let mut n = Numbers(13);
    for (scale, distance) in PLACES {
        for round in 0..8 {
            let t = placement(&mut n, scale, distance);
            let kind = if round % 2 == 0 { ShapeKind::Rectangle(t) } else { ShapeKind::Disk(t) };
            let mut table = ShapeTable::default();
            add_shape(&mut table, kind);
            assert_flat_is_left(&table, &mut n, 500, true, &format!("flat {scale} {distance}"));
            let twice = instanced(table, &mut n, scale.recip(), distance);
            assert_flat_is_left(&twice, &mut n, 500, true, &format!("placed {scale} {distance}"));
        }
    }
}

#[test]
fn plane_meshes_in_instances_are_left() {
    let mut n = Numbers(14);
    for (scale, distance) in PLACES {
        let placed = placement(&mut n, 1.0, 2.0);
        let mut table = ShapeTable::default();
        let mesh = uneven_plane(&mut n, 12, &placed);
        add_mesh(&mut table, mesh);
        let table = instanced(table, &mut n, scale, distance);
        // In its own space the mesh is even, wherever it is placed.
        assert_flat_is_left(&table, &mut n, 2000, true, &format!("placed {scale} {distance}"));
    }
}

/// Rays that leave a convex thing outwards meet nothing; those that enter it meet its other side.
#[test]
fn spheres_and_cylinders_are_left_and_entered() {
    let mut n = Numbers(15);
    for (scale, distance) in PLACES {
        for round in 0..8 {
            let t = placement(&mut n, scale, distance);
            let round_shape = |t| {
                if round % 2 == 0 { ShapeKind::Sphere(t) } else { ShapeKind::Cylinder(t) }
            };
            let mut table = ShapeTable::default();
            add_shape(&mut table, round_shape(t));
            assert_convex_is_left(&table, &mut n, &format!("round {scale} {distance}"));
            let twice = instanced(table, &mut n, scale.recip(), distance);
            assert_convex_is_left(&twice, &mut n, &format!("placed {scale} {distance}"));
        }
    }
}

fn assert_convex_is_left(table: &ShapeTable, n: &mut Numbers, what: &str) {
    let accel = Accel::build(table).unwrap();
    let size = accel.bounds().extent().min_element();
    for si in hits(table, &accel, n, 400) {
        for _ in 0..RAYS {
            let ray = si.spawn_ray(leaving(n, si.ng));
            let hit = accel.intersect(table, &ray);
            assert!(hit.is_none(), "{what}: {hit:?} from {si:?} by {ray:?}");
            let d = leaving(n, -si.ng);
            let inwards = si.spawn_ray(d);
            if let Some(hit) = accel.intersect(table, &inwards) {
                // The chord is much longer than the offset unless the ray grazes the surface, or the
                // shape is so small for its place that the offset is not small for the shape.
                let long = d.dot(si.ng).abs() > 0.01 && si.offset < 1e-4 * size;
                assert!(
                    !long || hit.t > 2.0 * si.offset,
                    "{what}: {hit:?} from {si:?} by {inwards:?}"
                );
            }
        }
    }
}

#[test]
fn meshes_are_shapes_by_number() {
    // What the tests above rely on: the first mesh is shape 0.
    let mut table = ShapeTable::default();
    let id = add_mesh(&mut table, Mesh::default());
    assert_eq!((id, &table.shapes[0].kind), (ShapeId(0), &ShapeKind::Mesh(MeshId(0))));
}
