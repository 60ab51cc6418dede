//! The ray-triangle test.
//!
//! Edge functions after Woop, Benthin and Wald 2013 (Watertight ray/triangle intersection): the
//! triangle is moved so that the ray starts at the origin and sheared so that it runs along one
//! axis; the ray then meets the triangle when the origin of the plane lies on the same side of its
//! three edges. The function of an edge, `ax·by - ay·bx`, changes nothing but its sign when the
//! edge is walked the other way, as long as both products are rounded alike: hence no fused
//! multiply-add. Zero counts as inside, so an edge or a vertex belongs to all of its triangles
//! and no ray passes between them.
//!
//! The distance comes from the triangle's plane, computed from its vertices alone, which puts it
//! much closer to where a ray that starts on the plane sees it than interpolating the sheared
//! vertices does; it is clamped to the range of the vertices' own distances, which bounds it where
//! the plane is seen edge-on.

use super::node::{BLOCK, LeafBlock};
use super::simd::{Lanes, Simd};
use crate::math::{Ray, Vec3};

/// What the test needs of a ray: axes permuted so that the last is the one along which the ray
/// moves fastest, and the shear that makes the ray run along it.
#[derive(Clone, Copy)]
pub(super) struct Shear<S: Simd> {
    /// Permutation of the axes.
    axes: [usize; 3],
    /// Origin, permuted.
    origin: [S::F4; 3],
    /// `d.x/d.z`, `d.y/d.z`, `1/d.z`, permuted.
    shear: [S::F4; 3],
    /// Direction, permuted.
    direction: [S::F4; 3],
}

impl<S: Simd> Shear<S> {
    #[inline(always)]
    pub(super) fn new(ray: &Ray) -> Self {
        let axes = axes_by_speed(ray.d);
        let pick = |v: Vec3| {
            let v = [v.x, v.y, v.z, 0.0];
            axes.map(|axis| v[axis & 3])
        };
        let d = pick(ray.d);
        let reciprocal = 1.0 / d[2];
        let shear = [d[0] * reciprocal, d[1] * reciprocal, reciprocal];
        Self {
            axes,
            origin: pick(ray.o).map(S::F4::splat),
            shear: shear.map(S::F4::splat),
            direction: d.map(S::F4::splat),
        }
    }

    /// One vertex of four triangles: offset from the ray's origin, permuted.
    #[inline(always)]
    fn vertex(&self, block: LeafBlock<'_>, vertex: usize) -> [S::F4; 3] {
        let coordinate =
            |i: usize| S::F4::load(block.coordinates(vertex, self.axes[i])).sub(self.origin[i]);
        [coordinate(0), coordinate(1), coordinate(2)]
    }
}

/// The axes, the one with the largest component of `d` last, in cyclic order. Without branches:
/// rays of all directions come in turn.
#[inline(always)]
fn axes_by_speed(d: Vec3) -> [usize; 3] {
    let a = d.abs();
    let x = usize::from(a.x > a.y) & usize::from(a.x > a.z);
    let y = usize::from(a.y > a.z) & (1 - x);
    // 0 for x, 1 for y, 2 for z.
    let last = 2 - 2 * x - y;
    const NEXT: [usize; 4] = [1, 2, 0, 0];
    let first = NEXT[last & 3];
    [first, NEXT[first & 3], last]
}

/// Up to four hits of one ray.
pub(super) struct BlockHits {
    /// One bit per triangle hit; the other members count only where it is set.
    pub(super) mask: u32,
    /// Ray parameter.
    pub(super) t: [f32; BLOCK],
    /// Weight of vertex 1.
    pub(super) u: [f32; BLOCK],
    /// Weight of vertex 2.
    pub(super) v: [f32; BLOCK],
}

/// Edge functions and determinant of four triangles, and the distances of their vertices.
struct Edges<F> {
    e: [F; 3],
    det: F,
    vertices: [[F; 3]; 3],
    mask: u32,
}

#[inline(always)]
fn edges<S: Simd>(ray: &Shear<S>, block: LeafBlock<'_>) -> Edges<S::F4> {
    let vertices = [ray.vertex(block, 0), ray.vertex(block, 1), ray.vertex(block, 2)];
    let sheared =
        vertices.map(|v| [v[0].sub(ray.shear[0].mul(v[2])), v[1].sub(ray.shear[1].mul(v[2]))]);
    let edge = |a: [S::F4; 2], b: [S::F4; 2]| a[0].mul(b[1]).sub(a[1].mul(b[0]));
    let e =
        [edge(sheared[1], sheared[2]), edge(sheared[2], sheared[0]), edge(sheared[0], sheared[1])];
    let det = e[0].add(e[1]).add(e[2]);
    let zero = S::F4::splat(0.0);
    let smallest = e[0].min(e[1]).min(e[2]);
    let largest = e[0].max(e[1]).max(e[2]);
    let inside = zero.le(smallest) | largest.le(zero);
    Edges { e, det, vertices, mask: inside & det.non_zero() }
}

/// Ray parameters at which the ray meets the triangles' planes.
#[inline(always)]
fn plane_t<S: Simd>(ray: &Shear<S>, vertices: &[[S::F4; 3]; 3]) -> S::F4 {
    let minus = |a: [S::F4; 3], b: [S::F4; 3]| [a[0].sub(b[0]), a[1].sub(b[1]), a[2].sub(b[2])];
    let dot = |a: [S::F4; 3], b: [S::F4; 3]| a[0].mul(b[0]).add(a[1].mul(b[1])).add(a[2].mul(b[2]));
    let [v0, v1, v2] = *vertices;
    let (a, b) = (minus(v1, v0), minus(v2, v0));
    let normal = [
        a[1].mul(b[2]).sub(a[2].mul(b[1])),
        a[2].mul(b[0]).sub(a[0].mul(b[2])),
        a[0].mul(b[1]).sub(a[1].mul(b[0])),
    ];
    let t = dot(normal, v0).div(dot(normal, ray.direction));
    let [z0, z1, z2] = [v0, v1, v2].map(|v| v[2].mul(ray.shear[2]));
    // In this order a NaN t (plane parallel to the ray) becomes the smallest.
    t.max(z0.min(z1).min(z2)).min(z0.max(z1).max(z2))
}

/// Tests a ray against the triangles of a block: hits in `[0, t_max]`.
#[inline(always)]
pub(super) fn intersect<S: Simd>(ray: &Shear<S>, block: LeafBlock<'_>, t_max: f32) -> BlockHits {
    let mut hits = BlockHits { mask: 0, t: [0.0; 4], u: [0.0; 4], v: [0.0; 4] };
    let edges = edges(ray, block);
    if edges.mask == 0 {
        return hits;
    }
    let t = plane_t::<S>(ray, &edges.vertices);
    hits.mask = edges.mask & S::F4::splat(0.0).le(t) & t.le(S::F4::splat(t_max));
    if hits.mask != 0 {
        t.store(&mut hits.t);
        edges.e[1].div(edges.det).store(&mut hits.u);
        edges.e[2].div(edges.det).store(&mut hits.v);
    }
    hits
}

/// True when the ray meets any triangle of a block in `[0, t_max]`.
#[inline(always)]
pub(super) fn occluded<S: Simd>(ray: &Shear<S>, block: LeafBlock<'_>, t_max: f32) -> bool {
    let edges = edges(ray, block);
    if edges.mask == 0 {
        return false;
    }
    let t = plane_t::<S>(ray, &edges.vertices);
    edges.mask & S::F4::splat(0.0).le(t) & t.le(S::F4::splat(t_max)) != 0
}
