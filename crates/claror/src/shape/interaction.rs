//! From a hit to all that is known about the surface there, with Mitsuba 3's conventions.

use super::bounds::absolute;
use super::{Mesh, Shape, ShapeKind, ShapeTable, quadric};
use crate::accel::Hit;
use crate::interaction::{Detail, SurfaceDerivatives, SurfaceInteraction};
use crate::math::{DVec3, Frame, Ray, Transform, Vec2, Vec3, Vec3A, Vec3Swizzles};
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
    derivatives: Option<SurfaceDerivatives>,
}

impl Local {
    /// A point of a shape in its own space, with nothing beyond [`Detail::Point`].
    fn on_unit_shape(p: Vec3, n: Vec3) -> Self {
        Self { p, error: Vec3::ZERO, ng: n, n, uv: Vec2::ZERO, derivatives: None }
    }
}

impl ShapeTable {
    /// All about the surface where `ray`, whose direction is a unit vector, met it.
    #[inline]
    pub fn interaction(&self, ray: &Ray, hit: &Hit, detail: Detail) -> SurfaceInteraction {
        let shape = &self.shapes[hit.shape.0 as usize];
        match (&shape.kind, hit.instance) {
            (ShapeKind::Mesh(mesh), None) if detail != Detail::Derivatives => {
                let mesh = &self.meshes[mesh.0 as usize];
                triangle_interaction(mesh, shape.flip_normals, ray, hit, detail)
            }
            _ => self.other_interaction(shape, ray, hit, detail),
        }
    }

    /// What is not simply a triangle of the world.
    #[inline(never)]
    fn other_interaction(
        &self,
        shape: &Shape,
        ray: &Ray,
        hit: &Hit,
        detail: Detail,
    ) -> SurfaceInteraction {
        let placed = hit.instance.map(|id| &self.instances[id.0 as usize].transform);
        let local_ray = placed.map_or(*ray, |transform| transform.inverse_ray(ray));
        let mut barycentric = Vec2::ZERO;
        let mut local = match &shape.kind {
            ShapeKind::Mesh(mesh) => {
                barycentric = Vec2::new(hit.u, hit.v);
                triangle(&self.meshes[mesh.0 as usize], hit, detail)
            }
            ShapeKind::Rectangle(transform) => rectangle(transform, hit),
            ShapeKind::Disk(transform) => disk(transform, &local_ray, hit.t, detail),
            ShapeKind::Sphere(transform) => sphere(transform, &local_ray, hit.t, detail),
            ShapeKind::Cylinder(transform) => cylinder(transform, &local_ray, hit.t, detail),
        };
        if shape.flip_normals {
            flip(&mut local, shape);
        }
        if let Some(transform) = placed {
            local = place(transform, local);
        }
        let frame = match &local.derivatives {
            Some(d) => Frame::from_normal_tangent(local.n, d.dp_du),
            None => Frame::from_normal(local.n),
        };
        SurfaceInteraction {
            p: local.p,
            offset: offset(local.p, local.error, local.ng),
            ng: local.ng,
            frame,
            uv: local.uv,
            derivatives: local.derivatives,
            wo: -ray.d,
            t: hit.t,
            shape: hit.shape,
            primitive: hit.primitive,
            barycentric,
            instance: hit.instance,
        }
    }
}

/// The common case: a triangle of the world without derivatives. All in registers.
#[inline(always)]
fn triangle_interaction(
    mesh: &Mesh,
    flip_normals: bool,
    ray: &Ray,
    hit: &Hit,
    detail: Detail,
) -> SurfaceInteraction {
    let vertices = mesh.triangles[hit.primitive as usize].map(|v| v as usize);
    let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
    let facet = Facet::new(vertices.map(|v| mesh.positions[v]));
    let (p, error) = facet.point(weights);
    let side = if flip_normals { -1.0 } else { 1.0 };
    let ng = side * Vec3::from(facet.ng);
    let n = if mesh.normals.is_empty() {
        ng
    } else {
        let n = interpolated_normal(vertices.map(|v| mesh.normals[v]), weights);
        n.map_or(ng, |(n, _)| side * n)
    };
    SurfaceInteraction {
        p,
        offset: offset(p, error, ng),
        ng,
        frame: Frame::from_normal(n),
        uv: if detail >= Detail::Uv { mesh.uv(vertices, weights) } else { Vec2::new(hit.u, hit.v) },
        derivatives: None,
        wo: -ray.d,
        t: hit.t,
        shape: hit.shape,
        primitive: hit.primitive,
        barycentric: Vec2::new(hit.u, hit.v),
        instance: None,
    }
}

impl Mesh {
    /// Texture coordinates; the barycentrics where the mesh has none.
    #[inline]
    fn uv(&self, vertices: [usize; 3], weights: [f32; 3]) -> Vec2 {
        if self.uvs.is_empty() {
            return Vec2::new(weights[1], weights[2]);
        }
        let [a, b, c] = vertices.map(|v| self.uvs[v]);
        a * weights[0] + b * weights[1] + c * weights[2]
    }
}

/// How far along the normal a ray must start to be clear of the surface: the error in the
/// direction of the normal, and the rounding of the start itself.
#[inline]
fn offset(p: Vec3, error: Vec3, ng: Vec3) -> f32 {
    error.dot(ng.abs()) + ROUNDING * p.abs().max_element() + f32::MIN_POSITIVE
}

/// `flip_normals`. Derivatives of the position keep their sense; so do those of a mesh's normals
/// (as in Mitsuba 3).
fn flip(local: &mut Local, shape: &Shape) {
    local.ng = -local.ng;
    local.n = -local.n;
    if let Some(d) = &mut local.derivatives
        && !matches!(shape.kind, ShapeKind::Mesh(_))
    {
        d.dn_du = -d.dn_du;
        d.dn_dv = -d.dn_dv;
    }
}

fn triangle(mesh: &Mesh, hit: &Hit, detail: Detail) -> Local {
    let vertices = mesh.triangles[hit.primitive as usize].map(|v| v as usize);
    let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
    let facet = Facet::new(vertices.map(|v| mesh.positions[v]));
    let (p, error) = facet.point(weights);
    let ng = Vec3::from(facet.ng);
    let n = if mesh.normals.is_empty() {
        ng
    } else {
        let n = interpolated_normal(vertices.map(|v| mesh.normals[v]), weights);
        n.map_or(ng, |(n, _)| n)
    };
    let derivatives = (detail == Detail::Derivatives)
        .then(|| triangle_derivatives(mesh, vertices, weights, &facet));
    Local { p, error, ng, n, uv: mesh.uv(vertices, weights), derivatives }
}

/// A flat triangle: its plane, and what rounding does to it.
struct Facet {
    corners: [Vec3A; 3],
    edges: [Vec3A; 2],
    /// Unit.
    ng: Vec3A,
    /// One over twice the area.
    per_double_area: f32,
}

/// Square of the sine of the angle between two edges below which single precision cancels too
/// much of their cross product: above, the normal is right to 2e-6.
const SLIVER: f32 = 0.01;

impl Facet {
    #[inline]
    fn new(corners: [Vec3; 3]) -> Self {
        let corners = corners.map(Vec3A::from);
        let edges = [corners[1] - corners[0], corners[2] - corners[0]];
        let cross = edges[0].cross(edges[1]);
        let length2 = cross.length_squared();
        let per_double_area = 1.0 / length2.sqrt();
        let products = edges[0].length_squared() * edges[1].length_squared();
        // Written so that what overflows and what underflows goes the careful way, too.
        let is_sound = length2 > SLIVER * products && products > 1e-30 && products < 1e30;
        let ng = if is_sound { cross * per_double_area } else { sliver_normal(corners) };
        Self { corners, edges, ng, per_double_area }
    }

    /// The point with the given barycentrics, and a bound of its error: the weighted sum's own, and
    /// that of the plane as a ray sees it that starts there: the numbers it computes with are the
    /// distances to the corners, at most the edges together, and its normal is off by the rounding
    /// of products of edges, which in a sliver are much longer than the normal.
    #[inline]
    fn point(&self, weights: [f32; 3]) -> (Vec3, Vec3) {
        let [a, b, c] = self.corners;
        let p = a * weights[0] + b * weights[1] + c * weights[2];
        let size = a.abs().max(b.abs()).max(c.abs());
        let [a, b] = self.edges.map(Vec3A::abs);
        let reach = a + b;
        let products = a.yzx() * b.zxy() + a.zxy() * b.yzx();
        // At worst, let a ray slip through the sliver.
        let tilt = products.dot(a.max(b)) * self.per_double_area;
        let tilt = tilt.min(LARGEST_TILT * reach.max_element());
        (p.into(), (ROUNDING * (size + reach + Vec3A::splat(tilt))).into())
    }
}

/// In double precision: a sliver's normal is all cancellation in single.
#[cold]
fn sliver_normal(corners: [Vec3A; 3]) -> Vec3A {
    let [a, b, c] = corners.map(Vec3A::as_dvec3);
    (b - a).cross(c - a).normalize_or(DVec3::Z).as_vec3a()
}

/// The unit normal between those of the vertices, and the length it had before it was made so;
/// `None` where there is no direction.
#[inline]
fn interpolated_normal(normals: [Vec3; 3], weights: [f32; 3]) -> Option<(Vec3, f32)> {
    let [a, b, c] = normals;
    if a == b && b == c {
        // A flat part of a smooth mesh.
        return Some((a, 1.0));
    }
    let n = a * weights[0] + b * weights[1] + c * weights[2];
    let length = n.length();
    (length > 0.0 && length.is_finite()).then(|| (n / length, length))
}

/// Derivatives of the normal are those by the barycentrics, with or without texture coordinates
/// (as in Mitsuba 3).
#[inline(never)]
fn triangle_derivatives(
    mesh: &Mesh,
    vertices: [usize; 3],
    weights: [f32; 3],
    facet: &Facet,
) -> SurfaceDerivatives {
    let edges = facet.edges.map(Vec3::from);
    let [mut dp_du, mut dp_dv] = edges;
    if !mesh.uvs.is_empty() {
        let by_uv = derivatives_by_uv(edges, vertices.map(|v| mesh.uvs[v]));
        (dp_du, dp_dv) = by_uv.unwrap_or_else(|| {
            let frame = Frame::from_normal(facet.ng.into());
            (frame.s, frame.t)
        });
    }
    let (mut dn_du, mut dn_dv) = (Vec3::ZERO, Vec3::ZERO);
    if !mesh.normals.is_empty() {
        let normals = vertices.map(|v| mesh.normals[v]);
        if let Some((n, length)) = interpolated_normal(normals, weights) {
            let across = |d: Vec3| (d - n * n.dot(d)) / length;
            dn_du = across(normals[1] - normals[0]);
            dn_dv = across(normals[2] - normals[0]);
        }
    }
    SurfaceDerivatives { dp_du, dp_dv, dn_du, dn_dv }
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

/// The geometric normal is that of the winding, so that a mirroring transform sets it against the
/// shading normal (as in Mitsuba 3).
fn rectangle(transform: &Transform, hit: &Hit) -> Local {
    let corner = |x, y| transform.point(Vec3::new(x, y, 0.0));
    let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0)];
    let facet = Facet::new(corners);
    let (p, error) = facet.point([1.0 - hit.u - hit.v, hit.u, hit.v]);
    // The corner opposite to the first one, which the ray saw, is not the sum of the others.
    let error = error + ROUNDING * (corners[1].abs() + corners[2].abs());
    Local {
        p,
        error,
        ng: facet.ng.into(),
        n: transform.normal(Vec3::Z).normalize_or(Vec3::Z),
        uv: Vec2::new(hit.u, hit.v),
        derivatives: Some(SurfaceDerivatives {
            dp_du: transform.vector(Vec3::new(2.0, 0.0, 0.0)),
            dp_dv: transform.vector(Vec3::new(0.0, 2.0, 0.0)),
            dn_du: Vec3::ZERO,
            dn_dv: Vec3::ZERO,
        }),
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

fn disk(transform: &Transform, ray: &Ray, t: f32, detail: Detail) -> Local {
    let p = quadric::local_point(transform, ray, t).truncate().as_vec2();
    let mut unplaced = Local::on_unit_shape(p.extend(0.0), Vec3::Z);
    if detail >= Detail::Uv {
        unplaced.uv = Vec2::new(p.length(), turn(p.x, p.y));
    }
    if detail == Detail::Derivatives {
        unplaced.derivatives = Some(SurfaceDerivatives {
            dp_du: around(p.x, p.y).extend(0.0),
            dp_dv: TAU * Vec3::new(-p.y, p.x, 0.0),
            dn_du: Vec3::ZERO,
            dn_dv: Vec3::ZERO,
        });
    }
    place(transform, unplaced)
}

/// A mirroring transform turns a sphere inside out (as in Mitsuba 3).
fn sphere(transform: &Transform, ray: &Ray, t: f32, detail: Detail) -> Local {
    let p = quadric::local_point(transform, ray, t).normalize_or(DVec3::Z).as_vec3();
    let side = if transform.is_mirroring() { -1.0 } else { 1.0 };
    let mut unplaced = Local::on_unit_shape(p, side * p);
    let r = p.truncate().length();
    if detail >= Detail::Uv {
        unplaced.uv = Vec2::new(turn(p.x, p.y), r.atan2(p.z) / PI);
    }
    if detail == Detail::Derivatives {
        let dp_du = TAU * Vec3::new(-p.y, p.x, 0.0);
        let dp_dv = PI * (around(p.x, p.y) * p.z).extend(-r);
        let (dn_du, dn_dv) = (side * dp_du, side * dp_dv);
        unplaced.derivatives = Some(SurfaceDerivatives { dp_du, dp_dv, dn_du, dn_dv });
    }
    place(transform, unplaced)
}

fn cylinder(transform: &Transform, ray: &Ray, t: f32, detail: Detail) -> Local {
    let p = quadric::local_point(transform, ray, t);
    let n = p.truncate().normalize_or(crate::math::DVec2::X).as_vec2();
    let z = (p.z as f32).clamp(0.0, 1.0);
    let mut unplaced = Local::on_unit_shape(n.extend(z), n.extend(0.0));
    if detail >= Detail::Uv {
        unplaced.uv = Vec2::new(turn(n.x, n.y), z);
    }
    if detail == Detail::Derivatives {
        let dp_du = TAU * Vec3::new(-n.y, n.x, 0.0);
        let (dp_dv, dn_du, dn_dv) = (Vec3::Z, dp_du, Vec3::ZERO);
        unplaced.derivatives = Some(SurfaceDerivatives { dp_du, dp_dv, dn_du, dn_dv });
    }
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
    let mapped = transform.normal(local.n);
    let length = mapped.length();
    let is_sound = length > 0.0 && length.is_finite();
    let n = if is_sound { mapped / length } else { local.n };
    let placed_derivatives = |d: SurfaceDerivatives| {
        // Those of `N/|N|`, where `N` is mapped by the inverse transpose.
        let by = |dn: Vec3| {
            if !is_sound {
                return dn;
            }
            let dn = transform.normal(dn) / length;
            dn - n * n.dot(dn)
        };
        SurfaceDerivatives {
            dp_du: transform.vector(d.dp_du),
            dp_dv: transform.vector(d.dp_dv),
            dn_du: by(d.dn_du),
            dn_dv: by(d.dn_dv),
        }
    };
    Local {
        p,
        error: error + ROUNDING * sizes.as_vec3(),
        ng: transform.normal(local.ng).normalize_or(local.ng),
        n,
        uv: local.uv,
        derivatives: local.derivatives.map(placed_derivatives),
    }
}
