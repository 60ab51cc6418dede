//! Tests of the ray kernel as a whole.

mod hostile;
mod spawn;
mod watertight;

use super::simd::Isa;
use super::*;
use crate::bsdf::BsdfId;
use crate::math::{DAffine3, DVec3, Transform, Vec3};
use crate::shape::{Instance, Mesh, MeshId, Shape, ShapeGroup};

/// A small generator of reproducible numbers in [0, 1).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (((z ^ (z >> 31)) >> 40) as f32) / 16_777_216.0
    }
    fn point(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next()) * 2.0 - 1.0
    }
    fn direction(&mut self) -> Vec3 {
        loop {
            let p = self.point();
            if (0.01..1.0).contains(&p.length_squared()) {
                return p.normalize();
            }
        }
    }
}

fn add_shape(table: &mut ShapeTable, kind: ShapeKind) -> ShapeId {
    table.shapes.push(Shape { kind, bsdf: BsdfId(0), emitter: None, flip_normals: false });
    ShapeId(table.shapes.len() as u32 - 1)
}

fn add_mesh(table: &mut ShapeTable, mesh: Mesh) -> ShapeId {
    table.meshes.push(mesh);
    let id = MeshId(table.meshes.len() as u32 - 1);
    add_shape(table, ShapeKind::Mesh(id))
}

fn transform(n: &mut Numbers) -> Transform {
    let rotation = DAffine3::from_axis_angle(n.direction().as_dvec3(), f64::from(n.next()) * 6.0);
    let scale = DVec3::new(0.2 + f64::from(n.next()), 0.2 + f64::from(n.next()), 0.3);
    let mirror = if n.next() < 0.5 { -1.0 } else { 1.0 };
    let moved = DAffine3::from_translation(n.point().as_dvec3() * 2.0);
    Transform::new(moved * rotation * DAffine3::from_scale(scale * DVec3::new(1.0, mirror, 1.0)))
        .expect("regular")
}

/// Triangles strewn about.
fn soup(n: &mut Numbers, count: usize, size: f32) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..count as u32 {
        let p = n.point() * 3.0;
        for _ in 0..3 {
            mesh.positions.push(p + n.point() * size);
        }
        mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    mesh
}

/// A bit of everything.
fn mixed_scene() -> ShapeTable {
    let mut n = Numbers(1);
    let mut table = ShapeTable::default();
    let mesh = soup(&mut n, 500, 0.3);
    add_mesh(&mut table, mesh);
    for i in 0..40 {
        let t = transform(&mut n);
        let kind = match i % 4 {
            0 => ShapeKind::Rectangle(t),
            1 => ShapeKind::Disk(t),
            2 => ShapeKind::Sphere(t),
            _ => ShapeKind::Cylinder(t),
        };
        add_shape(&mut table, kind);
    }
    let mesh = soup(&mut n, 300, 0.2);
    let a = add_mesh(&mut table, mesh);
    let t = transform(&mut n);
    let b = add_shape(&mut table, ShapeKind::Sphere(t));
    table.groups.push(ShapeGroup { shapes: vec![a, b] });
    for _ in 0..5 {
        let transform = transform(&mut n);
        table.instances.push(Instance { group: GroupId(0), transform });
    }
    table
}

fn rays(count: usize) -> Vec<Ray> {
    let mut n = Numbers(2);
    (0..count).map(|_| Ray::new(n.point() * 4.0, n.direction())).collect()
}

fn with_isa(accel: &Accel, isa: Isa) -> Accel {
    Accel { isa, ..accel.clone() }
}

/// Every primitive, one after the other, in double precision.
fn brute_force(table: &ShapeTable, ray: &Ray) -> Option<(f32, ShapeId, Option<InstanceId>)> {
    let mut best: Option<(f32, ShapeId, Option<InstanceId>)> = None;
    let mut consider = |t: Option<f32>, shape: ShapeId, instance: Option<InstanceId>| {
        if let Some(t) = t
            && best.is_none_or(|b| t < b.0)
        {
            best = Some((t, shape, instance));
        }
    };
    let in_group = |id: ShapeId| table.groups.iter().any(|g| g.shapes.contains(&id));
    for id in (0..table.shapes.len() as u32).map(ShapeId).filter(|&id| !in_group(id)) {
        consider(shape_brute_force(table, id, ray), id, None);
    }
    for (i, instance) in table.instances.iter().enumerate() {
        let local = instance.transform.inverse_ray(ray);
        for &id in &table.groups[instance.group.0 as usize].shapes {
            consider(shape_brute_force(table, id, &local), id, Some(InstanceId(i as u32)));
        }
    }
    best
}

fn shape_brute_force(table: &ShapeTable, id: ShapeId, ray: &Ray) -> Option<f32> {
    let count = build::triangles_in(table, id) as u32;
    if count == 0 {
        return crate::shape::intersect_quadric(&table.shapes[id.0 as usize].kind, ray, ray.t_max);
    }
    let hits = (0..count).filter_map(|i| {
        let [a, b, c] = build::triangle(table, id, i).map(Vec3::as_dvec3);
        let (o, d) = (ray.o.as_dvec3(), ray.d.as_dvec3());
        let (e1, e2) = (b - a, c - a);
        let p = d.cross(e2);
        let det = e1.dot(p);
        let u = (o - a).dot(p) / det;
        let q = (o - a).cross(e1);
        let v = d.dot(q) / det;
        let t = e2.dot(q) / det;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0).then_some(t as f32)
    });
    hits.min_by(f32::total_cmp)
}

#[test]
fn finds_what_brute_force_finds() {
    let table = mixed_scene();
    let accel = Accel::build(&table).unwrap();
    accel.validate(&table).unwrap();
    let mut hits = 0;
    for ray in rays(4000) {
        let want = brute_force(&table, &ray);
        let got = accel.intersect(&table, &ray);
        assert_eq!(accel.occluded(&table, &ray), got.is_some());
        match (want, got) {
            (None, None) => {}
            (Some((t, shape, instance)), Some(hit)) => {
                hits += 1;
                assert!((hit.t - t).abs() <= 1e-4 * t.max(1.0), "{ray:?}: {hit:?}, not {t}");
                assert_eq!((hit.shape, hit.instance), (shape, instance), "{ray:?} {hit:?} {t}");
            }
            (want, got) => panic!("{ray:?}: {got:?}, not {want:?}"),
        }
    }
    assert!(hits > 800, "{hits}");
}

#[test]
fn every_instruction_set_gives_the_same_bits() {
    let table = mixed_scene();
    let accel = Accel::build(&table).unwrap();
    let reference = with_isa(&accel, Isa::Portable);
    for isa in Isa::available() {
        let other = with_isa(&accel, isa);
        for ray in rays(20_000) {
            let bits = |hit: Option<Hit>| {
                hit.map(|h| (h.t.to_bits(), h.u.to_bits(), h.v.to_bits(), h.shape, h.primitive))
            };
            let (a, b) = (reference.intersect(&table, &ray), other.intersect(&table, &ray));
            assert_eq!(bits(a), bits(b), "{isa:?} {ray:?}");
            assert_eq!(other.occluded(&table, &ray), b.is_some(), "{isa:?} {ray:?}");
        }
    }
}
