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

use super::node::LeafBlock;
use super::simd::Lanes;
use crate::math::{Ray, Vec3};

/// What the test needs of a ray: axes permuted so that the last is the one along which the ray
/// moves fastest, and the shear that makes the ray run along it.
#[derive(Clone, Copy)]
pub(super) struct Shear {
    /// Permutation of the axes.
    axes: [usize; 3],
    /// Origin, permuted.
    origin: [f32; 3],
    /// `d.x/d.z`, `d.y/d.z`, `1/d.z`, permuted.
    shear: [f32; 3],
    /// Direction, permuted.
    direction: [f32; 3],
}

impl Shear {
    #[inline(always)]
    pub(super) fn new(ray: &Ray) -> Self {
        let axes = axes_by_speed(ray.d);
        let pick = |v: Vec3| {
            let v = [v.x, v.y, v.z, 0.0];
            axes.map(|axis| v[axis & 3])
        };
        let direction = pick(ray.d);
        let reciprocal = 1.0 / direction[2];
        let shear = [direction[0] * reciprocal, direction[1] * reciprocal, reciprocal];
        Self { axes, origin: pick(ray.o), shear, direction }
    }

    /// One vertex of all triangles: offset from the ray's origin, permuted.
    #[inline(always)]
    fn vertex<const N: usize, V: Lanes<N>>(
        &self,
        block: LeafBlock<'_, N>,
        vertex: usize,
    ) -> [V; 3] {
        let x = V::load(block.coordinates(vertex, self.axes[0])).sub(V::splat(self.origin[0]));
        let y = V::load(block.coordinates(vertex, self.axes[1])).sub(V::splat(self.origin[1]));
        let z = V::load(block.coordinates(vertex, self.axes[2])).sub(V::splat(self.origin[2]));
        [x, y, z]
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

/// Hits of one ray with the triangles of a block.
pub(super) struct BlockHits<const N: usize> {
    /// One bit per triangle hit; the other members count only where it is set.
    pub(super) mask: u32,
    /// Ray parameter.
    pub(super) t: [f32; N],
    /// Weight of vertex 1.
    pub(super) u: [f32; N],
    /// Weight of vertex 2.
    pub(super) v: [f32; N],
}

// Functions, not closures, which would not be compiled for the instruction set of their caller.

/// A vertex, sheared so that the ray runs along the last axis.
#[inline(always)]
fn sheared<const N: usize, V: Lanes<N>>(ray: &Shear, v: [V; 3]) -> [V; 2] {
    [v[0].sub(V::splat(ray.shear[0]).mul(v[2])), v[1].sub(V::splat(ray.shear[1]).mul(v[2]))]
}

/// `ax·by - ay·bx`
#[inline(always)]
fn edge<const N: usize, V: Lanes<N>>(a: [V; 2], b: [V; 2]) -> V {
    a[0].mul(b[1]).sub(a[1].mul(b[0]))
}

#[inline(always)]
fn minus<const N: usize, V: Lanes<N>>(a: [V; 3], b: [V; 3]) -> [V; 3] {
    [a[0].sub(b[0]), a[1].sub(b[1]), a[2].sub(b[2])]
}

#[inline(always)]
fn dot<const N: usize, V: Lanes<N>>(a: [V; 3], b: [V; 3]) -> V {
    a[0].mul(b[0]).add(a[1].mul(b[1])).add(a[2].mul(b[2]))
}

/// Edge functions and determinant of the triangles of a block, their vertices, and one bit for each
/// on all of whose inner sides the ray passes.
struct Edges<V> {
    e: [V; 3],
    det: V,
    vertices: [[V; 3]; 3],
    mask: u32,
}

#[inline(always)]
fn edges<const N: usize, V: Lanes<N>>(ray: &Shear, block: LeafBlock<'_, N>) -> Edges<V> {
    let vertices = [ray.vertex(block, 0), ray.vertex(block, 1), ray.vertex(block, 2)];
    let a = sheared::<N, V>(ray, vertices[0]);
    let b = sheared::<N, V>(ray, vertices[1]);
    let c = sheared::<N, V>(ray, vertices[2]);
    let e = [edge(b, c), edge(c, a), edge(a, b)];
    let det = e[0].add(e[1]).add(e[2]);
    let zero = V::splat(0.0);
    let smallest = e[0].min(e[1]).min(e[2]);
    let largest = e[0].max(e[1]).max(e[2]);
    let inside = zero.le(smallest) | largest.le(zero);
    Edges { e, det, vertices, mask: inside & det.non_zero() }
}

/// Ray parameters at which the ray meets the triangles' planes.
#[inline(always)]
fn plane_t<const N: usize, V: Lanes<N>>(ray: &Shear, vertices: &[[V; 3]; 3]) -> V {
    let [v0, v1, v2] = *vertices;
    let (a, b) = (minus(v1, v0), minus(v2, v0));
    let x = edge([a[1], a[2]], [b[1], b[2]]);
    let y = edge([a[2], a[0]], [b[2], b[0]]);
    let z = edge([a[0], a[1]], [b[0], b[1]]);
    let d = ray.direction;
    let direction = [V::splat(d[0]), V::splat(d[1]), V::splat(d[2])];
    let t = dot([x, y, z], v0).div(dot([x, y, z], direction));
    let scale = V::splat(ray.shear[2]);
    let (z0, z1, z2) = (v0[2].mul(scale), v1[2].mul(scale), v2[2].mul(scale));
    // In this order a NaN t (plane parallel to the ray) becomes the smallest.
    t.max(z0.min(z1).min(z2)).min(z0.max(z1).max(z2))
}

/// Tests a ray against the triangles of a block: hits in `[0, t_max]`.
#[inline(always)]
pub(super) fn intersect<const N: usize, V: Lanes<N>>(
    ray: &Shear,
    block: LeafBlock<'_, N>,
    t_max: f32,
) -> BlockHits<N> {
    let mut hits = BlockHits { mask: 0, t: [0.0; N], u: [0.0; N], v: [0.0; N] };
    let edges = edges::<N, V>(ray, block);
    if edges.mask == 0 {
        return hits;
    }
    let t = plane_t(ray, &edges.vertices);
    hits.mask = edges.mask & V::splat(0.0).le(t) & t.le(V::splat(t_max));
    if hits.mask != 0 {
        t.store(&mut hits.t);
        edges.e[1].div(edges.det).store(&mut hits.u);
        edges.e[2].div(edges.det).store(&mut hits.v);
    }
    hits
}

/// True when the ray meets any triangle of a block in `[0, t_max]`.
#[inline(always)]
pub(super) fn occluded<const N: usize, V: Lanes<N>>(
    ray: &Shear,
    block: LeafBlock<'_, N>,
    t_max: f32,
) -> bool {
    let edges = edges::<N, V>(ray, block);
    if edges.mask == 0 {
        return false;
    }
    let t = plane_t(ray, &edges.vertices);
    edges.mask & V::splat(0.0).le(t) & t.le(V::splat(t_max)) != 0
}
