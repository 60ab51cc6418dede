//! From a hit to all that is known about the surface there, with Mitsuba 3's conventions.

use super::bounds::absolute;
use super::{Mesh, Shape, ShapeKind, ShapeTable, quadric};
use crate::accel::Hit;
use crate::interaction::SurfaceInteraction;
use crate::math::{DVec3, Frame, Ray, Transform, Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// Unit of the error bounds: `f32` rounds to within half of this, and every bound below adds up
/// the magnitudes of what is rounded, so this leaves room for eight roundings of each.
const ROUNDING: f32 = 4.0 * f32::EPSILON;

/// Largest effect of a sliver's uncertain normal that is allowed for, in units of rounding and of
/// the sliver's length.
const LARGEST_TILT: f32 = 2000.0;

/// A point of a surface and what is known about it, in whichever space is being worked in.
struct Local {
    p: Vec3,
    /// Bound of the rounding error of `p`, and of what a ray starting there sees of the surface.
    error: Vec3,
    /// Unit.
    ng: Vec3,
    /// Unit.
    n: Vec3,
    uv: Vec2,
    dp_du: Vec3,
    dp_dv: Vec3,
    dn_du: Vec3,
    dn_dv: Vec3,
}

impl ShapeTable {
    /// All about the surface where `ray` met it.
    pub fn interaction(&self, ray: &Ray, hit: &Hit) -> SurfaceInteraction {
        let shape = &self.shapes[hit.shape.0 as usize];
        let placed = hit.instance.map(|id| &self.instances[id.0 as usize].transform);
        let local_ray = placed.map_or(*ray, |transform| transform.inverse_ray(ray));
        let mut local = match &shape.kind {
            ShapeKind::Mesh(mesh) => triangle(&self.meshes[mesh.0 as usize], hit),
            ShapeKind::Rectangle(transform) => rectangle(transform, hit),
            ShapeKind::Disk(transform) => disk(transform, &local_ray, hit.t),
            ShapeKind::Sphere(transform) => sphere(transform, &local_ray, hit.t),
            ShapeKind::Cylinder(transform) => cylinder(transform, &local_ray, hit.t),
        };
        if shape.flip_normals {
            flip(&mut local, shape);
        }
        if let Some(transform) = placed {
            local = place(transform, local);
        }
        let is_mesh = matches!(shape.kind, ShapeKind::Mesh(_));
        SurfaceInteraction {
            p: local.p,
            offset: offset(&local),
            ng: local.ng,
            frame: Frame::from_normal_tangent(local.n, local.dp_du),
            uv: local.uv,
            dp_du: local.dp_du,
            dp_dv: local.dp_dv,
            dn_du: local.dn_du,
            dn_dv: local.dn_dv,
            wo: -ray.d.normalize_or_zero(),
            t: hit.t,
            shape: hit.shape,
            primitive: hit.primitive,
            barycentric: if is_mesh { Vec2::new(hit.u, hit.v) } else { Vec2::ZERO },
            instance: hit.instance,
        }
    }
}

/// How far along the normal a ray must start to be clear of the surface: the error in the
/// direction of the normal, and the rounding of the start itself.
fn offset(local: &Local) -> f32 {
    let along = local.error.dot(local.ng.abs());
    along + ROUNDING * local.p.abs().max_element() + f32::MIN_POSITIVE
}

/// `flip_normals`. Derivatives of the position keep their sense; so do those of a mesh's normals
/// (as in Mitsuba 3).
fn flip(local: &mut Local, shape: &Shape) {
    local.ng = -local.ng;
    local.n = -local.n;
    if !matches!(shape.kind, ShapeKind::Mesh(_)) {
        local.dn_du = -local.dn_du;
        local.dn_dv = -local.dn_dv;
    }
}

fn triangle(mesh: &Mesh, hit: &Hit) -> Local {
    let vertices = mesh.triangles[hit.primitive as usize].map(|v| v as usize);
    let corners = vertices.map(|v| mesh.positions[v]);
    let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
    let edges = [corners[1] - corners[0], corners[2] - corners[0]];
    let ng = unit_normal(corners);
    let (p, error) = weighted_point(corners, weights);
    let mut local = Local {
        p,
        error,
        ng,
        n: ng,
        uv: Vec2::new(hit.u, hit.v),
        dp_du: edges[0],
        dp_dv: edges[1],
        dn_du: Vec3::ZERO,
        dn_dv: Vec3::ZERO,
    };
    if !mesh.uvs.is_empty() {
        let uvs = vertices.map(|v| mesh.uvs[v]);
        local.uv = uvs[0] * weights[0] + uvs[1] * weights[1] + uvs[2] * weights[2];
        (local.dp_du, local.dp_dv) = derivatives_by_uv(edges, uvs).unwrap_or_else(|| {
            let frame = Frame::from_normal(ng);
            (frame.s, frame.t)
        });
    }
    if !mesh.normals.is_empty() {
        shading_normal(&mut local, vertices.map(|v| mesh.normals[v]), weights);
    }
    local
}

/// In double precision: a sliver's normal is all cancellation in single.
fn unit_normal(corners: [Vec3; 3]) -> Vec3 {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    (b - a).cross(c - a).normalize_or(DVec3::Z).as_vec3()
}

/// The point with the given barycentrics, and the bound of its error: the weighted sum's own, and
/// that of the plane as a ray sees it that starts there: the numbers it computes with are the
/// distances to the corners, and its normal is off by the rounding of products of edges, which in a
/// sliver are much longer than the normal.
fn weighted_point(corners: [Vec3; 3], weights: [f32; 3]) -> (Vec3, Vec3) {
    let terms: [Vec3; 3] = std::array::from_fn(|i| corners[i] * weights[i]);
    let p = terms[0] + terms[1] + terms[2];
    let size = terms[0].abs() + terms[1].abs() + terms[2].abs();
    let reach = corners.map(|c| (c - p).abs());
    let farthest = reach[0].max(reach[1]).max(reach[2]);
    let edges = [corners[1] - corners[0], corners[2] - corners[0]];
    let [a, b] = edges.map(Vec3::abs);
    let products = Vec3::new(a.y * b.z + a.z * b.y, a.z * b.x + a.x * b.z, a.x * b.y + a.y * b.x);
    let tilt = products.dot(reach[0]) / edges[0].cross(edges[1]).length();
    // At worst, let a ray slip through the sliver.
    let tilt = tilt.min(LARGEST_TILT * farthest.max_element());
    (p, ROUNDING * (size + farthest + tilt))
}

/// dp/du and dp/dv of a triangle with texture coordinates, unless these do not span an area.
fn derivatives_by_uv(edges: [Vec3; 2], uvs: [Vec2; 3]) -> Option<(Vec3, Vec3)> {
    let (a, b) = (uvs[1] - uvs[0], uvs[2] - uvs[0]);
    let determinant = a.perp_dot(b);
    let scale = 1.0 / determinant;
    let dp_du = (edges[0] * b.y - edges[1] * a.y) * scale;
    let dp_dv = (edges[1] * a.x - edges[0] * b.x) * scale;
    (determinant != 0.0 && dp_du.is_finite() && dp_dv.is_finite()).then_some((dp_du, dp_dv))
}

/// Interpolated normal. Its derivatives are those by the barycentrics, with or without texture
/// coordinates (as in Mitsuba 3).
fn shading_normal(local: &mut Local, normals: [Vec3; 3], weights: [f32; 3]) {
    let n = normals[0] * weights[0] + normals[1] * weights[1] + normals[2] * weights[2];
    let length = n.length();
    if !(length > 0.0 && length.is_finite()) {
        return;
    }
    local.n = n / length;
    let across = |d: Vec3| (d - local.n * local.n.dot(d)) / length;
    local.dn_du = across(normals[1] - normals[0]);
    local.dn_dv = across(normals[2] - normals[0]);
}

/// The geometric normal is that of the winding, so that a mirroring transform sets it against the
/// shading normal (as in Mitsuba 3).
fn rectangle(transform: &Transform, hit: &Hit) -> Local {
    let corner = |x, y| transform.point(Vec3::new(x, y, 0.0));
    let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0)];
    let (p, error) = weighted_point(corners, [1.0 - hit.u - hit.v, hit.u, hit.v]);
    // The corner opposite to the first one, which the ray saw, is not the sum of the others.
    let error = error + ROUNDING * (corners[1].abs() + corners[2].abs());
    Local {
        p,
        error,
        ng: unit_normal(corners),
        n: transform.normal(Vec3::Z).normalize_or(Vec3::Z),
        uv: Vec2::new(hit.u, hit.v),
        dp_du: transform.vector(Vec3::new(2.0, 0.0, 0.0)),
        dp_dv: transform.vector(Vec3::new(0.0, 2.0, 0.0)),
        dn_du: Vec3::ZERO,
        dn_dv: Vec3::ZERO,
    }
}

/// Angle around z as a fraction of a turn, in [0, 1).
fn turn(x: f32, y: f32) -> f32 {
    let turn = y.atan2(x) / TAU;
    let turn = if turn < 0.0 { turn + 1.0 } else { turn };
    if turn < 1.0 { turn } else { 0.0 }
}

/// `(x, y)` made a unit vector; the x axis where there is no direction.
fn around(x: f32, y: f32) -> Vec2 {
    Vec2::new(x, y).normalize_or(Vec2::X)
}

fn disk(transform: &Transform, ray: &Ray, t: f32) -> Local {
    let p = quadric::local_point(transform, ray, t).truncate().as_vec2();
    let direction = around(p.x, p.y);
    let unplaced = Local {
        p: p.extend(0.0),
        error: Vec3::ZERO,
        ng: Vec3::Z,
        n: Vec3::Z,
        uv: Vec2::new(p.length(), turn(p.x, p.y)),
        dp_du: direction.extend(0.0),
        dp_dv: TAU * Vec3::new(-p.y, p.x, 0.0),
        dn_du: Vec3::ZERO,
        dn_dv: Vec3::ZERO,
    };
    place(transform, unplaced)
}

/// A mirroring transform turns a sphere inside out (as in Mitsuba 3).
fn sphere(transform: &Transform, ray: &Ray, t: f32) -> Local {
    let p = quadric::local_point(transform, ray, t).normalize_or(DVec3::Z).as_vec3();
    let direction = around(p.x, p.y);
    let r = p.truncate().length();
    let dp_du = TAU * Vec3::new(-p.y, p.x, 0.0);
    let dp_dv = PI * (direction * p.z).extend(-r);
    let side = if transform.is_mirroring() { -1.0 } else { 1.0 };
    let unplaced = Local {
        p,
        error: Vec3::ZERO,
        ng: side * p,
        n: side * p,
        uv: Vec2::new(turn(p.x, p.y), r.atan2(p.z) / PI),
        dp_du,
        dp_dv,
        dn_du: side * dp_du,
        dn_dv: side * dp_dv,
    };
    place(transform, unplaced)
}

fn cylinder(transform: &Transform, ray: &Ray, t: f32) -> Local {
    let p = quadric::local_point(transform, ray, t);
    let n = p.truncate().normalize_or(crate::math::DVec2::X).as_vec2();
    let z = (p.z as f32).clamp(0.0, 1.0);
    let dp_du = TAU * Vec3::new(-n.y, n.x, 0.0);
    let unplaced = Local {
        p: n.extend(z),
        error: Vec3::ZERO,
        ng: n.extend(0.0),
        n: n.extend(0.0),
        uv: Vec2::new(turn(n.x, n.y), z),
        dp_du,
        dp_dv: Vec3::Z,
        dn_du: dp_du,
        dn_dv: Vec3::ZERO,
    };
    place(transform, unplaced)
}

/// From local to world space.
fn place(transform: &Transform, local: Local) -> Local {
    let to_world = transform.to_world.as_daffine3();
    let p = to_world.transform_point3(local.p.as_dvec3()).as_vec3();
    // The magnitudes of all that is added up on the way here, and of what a ray that starts here
    // will add up on its way back.
    let way_here = absolute(&to_world);
    let way_back = absolute(&transform.to_local.as_daffine3());
    let there = way_back.transform_point3(p.abs().as_dvec3()) + local.p.abs().as_dvec3();
    let sizes = way_here.transform_point3(there);
    let error = way_here.transform_vector3(local.error.as_dvec3()).as_vec3();
    let (n, dn_du, dn_dv) = place_normal(transform, local.n, local.dn_du, local.dn_dv);
    Local {
        p,
        error: error + ROUNDING * sizes.as_vec3(),
        ng: transform.normal(local.ng).normalize_or(local.ng),
        n,
        uv: local.uv,
        dp_du: transform.vector(local.dp_du),
        dp_dv: transform.vector(local.dp_dv),
        dn_du,
        dn_dv,
    }
}

/// A unit normal and its derivatives: those of `N/|N|`, where `N` is mapped by the inverse
/// transpose.
fn place_normal(transform: &Transform, n: Vec3, dn_du: Vec3, dn_dv: Vec3) -> (Vec3, Vec3, Vec3) {
    let mapped = transform.normal(n);
    let length = mapped.length();
    if !(length > 0.0 && length.is_finite()) {
        return (n, dn_du, dn_dv);
    }
    let unit = mapped / length;
    let derivative = |d: Vec3| {
        let d = transform.normal(d) / length;
        d - unit * unit.dot(d)
    };
    (unit, derivative(dn_du), derivative(dn_dv))
}
