//! From a ray to the triangles that it meets.

use super::node::{Child, LeafBlock, Special, Tree, WIDTH, WideNode};
use super::simd::{Isa, Lanes, Portable, Simd};
use super::stack::{Entry, Height, Stack};
use super::triangle::{self, Shear};
use crate::math::{Ray, Vec3};

/// A hit in the numbers of its tree.
#[derive(Debug, Clone, Copy)]
pub(super) struct RawHit {
    /// Ray parameter; before any hit the largest allowed.
    pub(super) t: f32,
    /// Weight of vertex 1.
    pub(super) u: f32,
    /// Weight of vertex 2.
    pub(super) v: f32,
    /// Number of the primitive in the tree that holds it.
    pub(super) key: u32,
    /// Number of the primitive in the tree where the search began (the instance, for a hit in
    /// one): decides between hits at the same t.
    pub(super) rank: u32,
    /// The instance, or [`RawHit::NO_INSTANCE`].
    pub(super) instance: u32,
}

impl RawHit {
    /// Stands for no instance.
    pub(super) const NO_INSTANCE: u32 = u32::MAX;
    const NO_KEY: u32 = u32::MAX;

    pub(super) fn none(t_max: f32) -> Self {
        let (key, rank) = (Self::NO_KEY, Self::NO_KEY);
        Self { t: t_max, u: 0.0, v: 0.0, key, rank, instance: Self::NO_INSTANCE }
    }

    pub(super) fn is_hit(&self) -> bool {
        self.key != Self::NO_KEY
    }

    #[inline(always)]
    fn is_better_than(&self, other: &Self) -> bool {
        self.t < other.t || (self.t == other.t && self.rank < other.rank)
    }
}

/// Components of a direction below this count as this when they are divided by.
const SMALLEST_COMPONENT: f32 = 1e-18;
/// Relative widening of the boxes: `(bound - origin) · (1/d)` is off by at most 3/2 ulp, and the
/// vertices that the triangle test sees, sheared, by as much again; with a margin.
const WIDENING: f32 = 8.0 * f32::EPSILON;

/// What the box test needs of a ray.
#[derive(Clone, Copy)]
struct BoxRay<S: Simd> {
    origin: [S::F8; 3],
    /// 1/d, a little too small: never beyond the near side of a box.
    near_scale: [S::F8; 3],
    /// 1/d, a little too large: never before the far side.
    far_scale: [S::F8; 3],
    /// Rows of the bounds where the ray enters.
    near_row: [usize; 3],
}

impl<S: Simd> BoxRay<S> {
    #[inline(always)]
    fn new(ray: &Ray) -> Self {
        let reciprocal = |d: f32| 1.0 / d.abs().max(SMALLEST_COMPONENT).copysign(d);
        let r = Vec3::new(reciprocal(ray.d.x), reciprocal(ray.d.y), reciprocal(ray.d.z));
        let row = |axis: usize| 2 * axis + usize::from(r[axis].is_sign_negative());
        let splat = |v: Vec3| [S::F8::splat(v.x), S::F8::splat(v.y), S::F8::splat(v.z)];
        Self {
            origin: splat(ray.o),
            near_scale: splat(r * (1.0 - WIDENING)),
            far_scale: splat(r * (1.0 + WIDENING)),
            near_row: [row(0), row(1), row(2)],
        }
    }

    /// Where the ray meets the planes of one side of the boxes.
    #[inline(always)]
    fn slab(&self, node: WideNode<'_>, row: usize, axis: usize, scale: S::F8) -> S::F8 {
        S::F8::load(&node.0[row & 7].0).sub(self.origin[axis]).mul(scale)
    }

    /// Where the ray enters the eight boxes, and one bit for each that it meets in `[0, t_max]`.
    #[inline(always)]
    fn enter(&self, node: WideNode<'_>, t_max: S::F8) -> (S::F8, u32) {
        let row = self.near_row;
        let x = self.slab(node, row[0], 0, self.near_scale[0]);
        let y = self.slab(node, row[1], 1, self.near_scale[1]);
        let z = self.slab(node, row[2], 2, self.near_scale[2]);
        let enter = x.max(y).max(z.max(S::F8::splat(0.0)));
        let x = self.slab(node, row[0] ^ 1, 0, self.far_scale[0]);
        let y = self.slab(node, row[1] ^ 1, 1, self.far_scale[1]);
        let z = self.slab(node, row[2] ^ 1, 2, self.far_scale[2]);
        let leave = x.min(y).min(z.min(t_max));
        (enter, enter.le(leave))
    }
}

/// The search for the closest hit not beyond `best`, which receives it. `special` intersects
/// what is not a triangle: a hit not beyond the best so far.
#[inline(always)]
fn closest_generic<S: Simd>(
    tree: &Tree,
    ray: &Ray,
    best: &mut RawHit,
    special: impl Fn(Special, &RawHit) -> Option<RawHit>,
) {
    let boxes = BoxRay::<S>::new(ray);
    let shear = Shear::new(ray);
    let mut stack = Stack::new();
    let mut height = Height::EMPTY;
    let mut current = Child::inner(0);
    loop {
        if current.is_leaf() {
            if current.is_special() {
                closest_special(tree, current, best, &special);
            } else if current.is_wide() {
                closest_in_block::<_, S::F8>(&shear, tree.wide_block(current.number()), best);
            } else {
                closest_in_block::<_, S::F4>(&shear, tree.narrow_block(current.number()), best);
            }
        } else {
            let node = tree.node(current.number());
            let (enter, mask) = boxes.enter(node, S::F8::splat(best.t));
            if mask != 0 {
                let visit = Visit::<S> { tree, node, enter, mask };
                current = visit.children(&mut stack, &mut height);
                continue;
            }
        }
        current = loop {
            let Some(entry) = stack.pop(&mut height) else { return };
            if entry.t() <= best.t {
                break entry.child();
            }
        };
    }
}

/// A node and the children of it that the ray meets.
struct Visit<'a, S: Simd> {
    tree: &'a Tree,
    node: WideNode<'a>,
    /// Where the ray enters each child.
    enter: S::F8,
    /// One bit per child met.
    mask: u32,
}

impl<S: Simd> Visit<'_, S> {
    /// The nearest of the children met; the others are left on the stack, the nearer above.
    #[inline(always)]
    fn children(self, stack: &mut Stack, height: &mut Height) -> Child {
        let first = self.mask.trailing_zeros() as usize & (WIDTH - 1);
        let mut rest = self.mask & (self.mask - 1);
        if rest == 0 {
            return self.node.child(first);
        }
        let mut t = [0.0; WIDTH];
        self.enter.store(&mut t);
        let mut nearest = self.entry(&t, first);
        let base = *height;
        while rest != 0 {
            let i = rest.trailing_zeros() as usize & (WIDTH - 1);
            rest &= rest - 1;
            let entry = self.entry(&t, i);
            let farther = entry.max(nearest);
            nearest = entry.min(nearest);
            stack.insert(base, height, farther);
        }
        nearest.child()
    }

    #[inline(always)]
    fn entry(&self, t: &[f32; WIDTH], i: usize) -> Entry {
        let child = self.node.child(i);
        self.tree.prefetch::<S>(child);
        Entry::new(t[i], child)
    }
}

#[inline(always)]
fn closest_in_block<const N: usize, V: Lanes<N>>(
    ray: &Shear,
    block: LeafBlock<'_, N>,
    best: &mut RawHit,
) {
    let hits = triangle::intersect::<N, V>(ray, block, best.t);
    let mut mask = hits.mask;
    while mask != 0 {
        let i = mask.trailing_zeros() as usize & (N - 1);
        mask &= mask - 1;
        let key = block.id(i);
        let (t, u, v) = (hits.t[i], hits.u[i], hits.v[i]);
        let hit = RawHit { t, u, v, key, rank: key, instance: RawHit::NO_INSTANCE };
        if hit.is_better_than(best) {
            *best = hit;
        }
    }
}

/// Apart from the loop over triangles, whose registers it would otherwise compete for.
#[inline(never)]
fn closest_special(
    tree: &Tree,
    child: Child,
    best: &mut RawHit,
    special: &impl Fn(Special, &RawHit) -> Option<RawHit>,
) {
    let Some(&primitive) = tree.specials.get(child.number()) else { return };
    let rank = tree.triangle_count + child.number() as u32;
    if let Some(hit) = special(primitive, best) {
        let key = if matches!(primitive, Special::Shape(_)) { rank } else { hit.key };
        let hit = RawHit { key, rank, ..hit };
        if hit.is_better_than(best) {
            *best = hit;
        }
    }
}

/// Whether anything is hit in `[0, ray.t_max]`.
#[inline(always)]
fn any_generic<S: Simd>(tree: &Tree, ray: &Ray, special: impl Fn(Special) -> bool) -> bool {
    let boxes = BoxRay::<S>::new(ray);
    let shear = Shear::new(ray);
    let t_max = S::F8::splat(ray.t_max);
    let mut stack = Stack::new();
    let mut height = Height::EMPTY;
    let mut inner = Child::inner(0);
    let mut node = tree.node(inner.number());
    let mut mask = boxes.enter(node, t_max).1;
    loop {
        while mask == 0 {
            let Some(entry) = stack.pop(&mut height) else { return false };
            inner = entry.child();
            node = tree.node(inner.number());
            mask = entry.mask();
        }
        // The first child holds the most triangles: look there first.
        let child = node.child(mask.trailing_zeros() as usize & (WIDTH - 1));
        mask &= mask - 1;
        if child.is_leaf() {
            if any_in_leaf::<S>(tree, child, ray, &shear, &special) {
                return true;
            }
            continue;
        }
        if mask != 0 {
            stack.push(&mut height, Entry::rest(mask, inner));
        }
        inner = child;
        node = tree.node(child.number());
        mask = boxes.enter(node, t_max).1;
    }
}

#[inline(always)]
fn any_in_leaf<S: Simd>(
    tree: &Tree,
    leaf: Child,
    ray: &Ray,
    shear: &Shear,
    special: &impl Fn(Special) -> bool,
) -> bool {
    if leaf.is_special() {
        any_special(tree, leaf, special)
    } else if leaf.is_wide() {
        triangle::occluded::<_, S::F8>(shear, tree.wide_block(leaf.number()), ray.t_max)
    } else {
        triangle::occluded::<_, S::F4>(shear, tree.narrow_block(leaf.number()), ray.t_max)
    }
}

#[inline(never)]
fn any_special(tree: &Tree, child: Child, special: &impl Fn(Special) -> bool) -> bool {
    tree.specials.get(child.number()).is_some_and(|&primitive| special(primitive))
}

/// [`closest_generic`] on the given instruction set.
#[inline]
pub(super) fn closest(
    isa: Isa,
    tree: &Tree,
    ray: &Ray,
    best: &mut RawHit,
    special: impl Fn(Special, &RawHit) -> Option<RawHit>,
) {
    match isa {
        Isa::Portable => closest_generic::<Portable>(tree, ray, best, special),
        #[cfg(target_arch = "x86_64")]
        Isa::Sse2 => closest_generic::<super::simd::Sse2>(tree, ray, best, special),
        #[cfg(target_arch = "x86_64")]
        Isa::Avx2 => x86::closest_avx2(tree, ray, best, special),
    }
}

/// [`any_generic`] on the given instruction set.
#[inline]
pub(super) fn any(isa: Isa, tree: &Tree, ray: &Ray, special: impl Fn(Special) -> bool) -> bool {
    match isa {
        Isa::Portable => any_generic::<Portable>(tree, ray, special),
        #[cfg(target_arch = "x86_64")]
        Isa::Sse2 => any_generic::<super::simd::Sse2>(tree, ray, special),
        #[cfg(target_arch = "x86_64")]
        Isa::Avx2 => x86::any_avx2(tree, ray, special),
    }
}

/// The doors into code compiled for AVX2.
#[cfg(target_arch = "x86_64")]
#[expect(unsafe_code, reason = "functions compiled for AVX2, called only where `Isa` has it")]
mod x86 {
    use super::super::simd::Avx2;
    use super::{RawHit, Ray, Special, Tree, any_generic, closest_generic};

    pub(super) fn closest_avx2(
        tree: &Tree,
        ray: &Ray,
        best: &mut RawHit,
        special: impl Fn(Special, &RawHit) -> Option<RawHit>,
    ) {
        #[target_feature(enable = "avx2")]
        fn compiled(
            tree: &Tree,
            ray: &Ray,
            best: &mut RawHit,
            special: impl Fn(Special, &RawHit) -> Option<RawHit>,
        ) {
            closest_generic::<Avx2>(tree, ray, best, special);
        }
        // SAFETY: an `Isa::Avx2`, the only way here, exists only where the processor has AVX2.
        unsafe { compiled(tree, ray, best, special) }
    }

    pub(super) fn any_avx2(tree: &Tree, ray: &Ray, special: impl Fn(Special) -> bool) -> bool {
        #[target_feature(enable = "avx2")]
        fn compiled(tree: &Tree, ray: &Ray, special: impl Fn(Special) -> bool) -> bool {
            any_generic::<Avx2>(tree, ray, special)
        }
        // SAFETY: an `Isa::Avx2`, the only way here, exists only where the processor has AVX2.
        unsafe { compiled(tree, ray, special) }
    }
}
