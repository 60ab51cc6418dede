//! Where to cut a range of primitives in two: between bins of their centres, or, for a few, between
//! any two of them, at the least expected cost of a ray by the surface area heuristic.

use super::primitives::PrimitiveRef;
use crate::math::{Bounds3, Vec3A};
use arrayvec::ArrayVec;
use rayon::prelude::*;

/// Most bins per axis.
const BINS: usize = 32;
/// Ranges up to this are cut at the best of all places.
const FEW: usize = 12;
/// Ranges above this are binned in parallel, in pieces of this size.
const PIECE: usize = 1 << 16;

/// A box; both corners in vector registers.
#[derive(Clone, Copy)]
pub(super) struct Box3 {
    pub(super) min: Vec3A,
    pub(super) max: Vec3A,
}

impl Box3 {
    const EMPTY: Self =
        Self { min: Vec3A::splat(f32::INFINITY), max: Vec3A::splat(f32::NEG_INFINITY) };

    pub(super) fn grow(&mut self, min: Vec3A, max: Vec3A) {
        self.min = self.min.min(min);
        self.max = self.max.max(max);
    }

    pub(super) fn half_area(&self) -> f32 {
        let e = (self.max - self.min).max(Vec3A::ZERO);
        e.x * e.y + e.y * e.z + e.z * e.x
    }
}

impl From<Bounds3> for Box3 {
    fn from(bounds: Bounds3) -> Self {
        Self { min: bounds.min.into(), max: bounds.max.into() }
    }
}

impl From<Box3> for Bounds3 {
    fn from(b: Box3) -> Self {
        Self { min: b.min.into(), max: b.max.into() }
    }
}

/// Box of some primitives, and box of their doubled centres.
#[derive(Clone, Copy)]
pub(super) struct Extent {
    bounds: Box3,
    centers2: Box3,
}

impl Extent {
    const EMPTY: Self = Self { bounds: Box3::EMPTY, centers2: Box3::EMPTY };

    pub(super) fn of(refs: &[PrimitiveRef]) -> Self {
        let mut extent = Self::EMPTY;
        for r in refs {
            extent.include(r);
        }
        extent
    }

    pub(super) fn bounds(&self) -> Bounds3 {
        self.bounds.into()
    }

    fn include(&mut self, r: &PrimitiveRef) {
        self.bounds.grow(r.min(), r.max());
        let center2 = r.center2();
        self.centers2.grow(center2, center2);
    }
}

/// One of the two parts of a range.
pub(super) struct Side {
    pub(super) count: usize,
    pub(super) extent: Extent,
}

/// Orders the primitives so that the left part stands first. Without the heuristic, or where it
/// sees nothing to cut by, in halves.
pub(super) fn split(refs: &mut [PrimitiveRef], extent: &Extent, use_heuristic: bool) -> [Side; 2] {
    if use_heuristic && refs.len() <= FEW {
        let middle = split_few(refs);
        return sides(refs, middle);
    }
    let best = if use_heuristic { best_cut(refs, extent) } else { None };
    let parted = best.map(|cut| partition(refs, |r| cut.bins.bin(r)[cut.axis] < cut.bin));
    match parted {
        // Both sides of a cut between bins hold something; this is for what rounding may do.
        Some([left, right]) if left.count > 0 && right.count > 0 => [left, right],
        _ => sides(refs, refs.len() / 2),
    }
}

fn sides(refs: &[PrimitiveRef], middle: usize) -> [Side; 2] {
    let (left, right) = refs.split_at(middle);
    [left, right].map(|refs| Side { count: refs.len(), extent: Extent::of(refs) })
}

/// A candidate's cost; of two equal ones the more balanced is better, lest coincident primitives be
/// split off one by one.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
struct Cost {
    area: f32,
    imbalance: usize,
}

impl Cost {
    const WORST: Self = Self { area: f32::INFINITY, imbalance: usize::MAX };
}

/// Tries every cut of every axis' order; leaves the primitives in the best order, and returns where
/// to cut.
fn split_few(refs: &mut [PrimitiveRef]) -> usize {
    let count = refs.len();
    if count == 2 {
        return 1;
    }
    let mut best = (Cost::WORST, 0, count / 2);
    let mut orders = [[0_u8; FEW]; 3];
    for (axis, order) in orders.iter_mut().enumerate() {
        let order = &mut order[..count];
        sort_by_center(refs, axis, order);
        let mut right_area = [0.0; FEW];
        let mut bounds = Box3::EMPTY;
        for i in (1..count).rev() {
            let r = &refs[order[i] as usize];
            bounds.grow(r.min(), r.max());
            right_area[i] = bounds.half_area();
        }
        bounds = Box3::EMPTY;
        for i in 1..count {
            let r = &refs[order[i - 1] as usize];
            bounds.grow(r.min(), r.max());
            let area = bounds.half_area() * i as f32 + right_area[i] * (count - i) as f32;
            let cost = Cost { area, imbalance: i.abs_diff(count - i) };
            if cost < best.0 {
                best = (cost, axis, i);
            }
        }
    }
    let (_, axis, middle) = best;
    let copy: ArrayVec<PrimitiveRef, FEW> = refs.iter().copied().collect();
    for (r, &from) in refs.iter_mut().zip(&orders[axis]) {
        *r = copy[from as usize];
    }
    middle
}

/// The order of the primitives along an axis; equal ones as they stand.
fn sort_by_center(refs: &[PrimitiveRef], axis: usize, order: &mut [u8]) {
    let mut keys = [0.0; FEW];
    for (i, r) in refs.iter().enumerate() {
        let key = r.center2()[axis];
        let mut at = i;
        while at > 0 && keys[at - 1] > key {
            keys[at] = keys[at - 1];
            order[at] = order[at - 1];
            at -= 1;
        }
        keys[at] = key;
        order[at] = i as u8;
    }
}

/// Which bin a primitive belongs to.
#[derive(Clone, Copy)]
struct Binning {
    origin: Vec3A,
    scale: Vec3A,
    last: Vec3A,
}

impl Binning {
    fn new(centers2: &Box3, bins: usize) -> Self {
        let extent = centers2.max - centers2.min;
        let scale = |e: f32| if e > 0.0 { (bins as f32 / e).min(f32::MAX) } else { 0.0 };
        Self {
            origin: centers2.min,
            scale: Vec3A::new(scale(extent.x), scale(extent.y), scale(extent.z)),
            last: Vec3A::splat((bins - 1) as f32),
        }
    }

    fn bin(&self, r: &PrimitiveRef) -> [usize; 3] {
        let b = ((r.center2() - self.origin) * self.scale).min(self.last);
        [b.x as usize % BINS, b.y as usize % BINS, b.z as usize % BINS]
    }
}

/// A way to cut: primitives in bins below `bin` on `axis` go left.
#[derive(Clone, Copy)]
struct Cut {
    bins: Binning,
    axis: usize,
    bin: usize,
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Box3,
    count: usize,
}

type Bins = [[Bin; BINS]; 3];

fn fill(refs: &[PrimitiveRef], bins: &Binning) -> Bins {
    let mut filled = [[Bin { bounds: Box3::EMPTY, count: 0 }; BINS]; 3];
    for r in refs {
        let (min, max) = (r.min(), r.max());
        for (axis, bin) in bins.bin(r).into_iter().enumerate() {
            let bin = &mut filled[axis][bin];
            bin.bounds.grow(min, max);
            bin.count += 1;
        }
    }
    filled
}

/// [`fill`] in parallel. Boxes and counts come out the same in whichever pieces they are made.
fn fill_pieces(refs: &[PrimitiveRef], bins: &Binning) -> Bins {
    let pieces: Vec<Bins> = refs.par_chunks(PIECE).map(|refs| fill(refs, bins)).collect();
    let mut all = pieces[0];
    for piece in &pieces[1..] {
        for (bin, more) in all.iter_mut().flatten().zip(piece.iter().flatten()) {
            bin.bounds.grow(more.bounds.min, more.bounds.max);
            bin.count += more.count;
        }
    }
    all
}

/// The cheapest cut; `None` when all centres coincide (or lie too close together to be told apart).
fn best_cut(refs: &[PrimitiveRef], extent: &Extent) -> Option<Cut> {
    let count = if refs.len() < 4 * BINS { BINS / 2 } else { BINS };
    let bins = Binning::new(&extent.centers2, count);
    let filled = if refs.len() > PIECE { fill_pieces(refs, &bins) } else { fill(refs, &bins) };
    let mut best = (Cost::WORST, None);
    for (axis, filled) in filled.iter().enumerate() {
        if bins.scale[axis] > 0.0 {
            let (cost, bin) = sweep(&filled[..count]);
            if cost < best.0 {
                best = (cost, Some(Cut { bins, axis, bin }));
            }
        }
    }
    best.1
}

/// The cheapest cut between the bins of one axis, and its cost: Σ half area · count.
fn sweep(bins: &[Bin]) -> (Cost, usize) {
    let mut right = [(0.0, 0); BINS];
    let (mut bounds, mut count) = (Box3::EMPTY, 0);
    for i in (1..bins.len()).rev() {
        bounds.grow(bins[i].bounds.min, bins[i].bounds.max);
        count += bins[i].count;
        right[i] = (bounds.half_area() * count as f32, count);
    }
    let mut best = (Cost::WORST, 0);
    (bounds, count) = (Box3::EMPTY, 0);
    for i in 1..bins.len() {
        bounds.grow(bins[i - 1].bounds.min, bins[i - 1].bounds.max);
        count += bins[i - 1].count;
        let (right_cost, right_count) = right[i];
        let area = bounds.half_area() * count as f32 + right_cost;
        let cost = Cost { area, imbalance: count.abs_diff(right_count) };
        if count > 0 && right_count > 0 && cost < best.0 {
            best = (cost, i);
        }
    }
    best
}

/// Moves what goes left to the front.
fn partition(refs: &mut [PrimitiveRef], goes_left: impl Fn(&PrimitiveRef) -> bool) -> [Side; 2] {
    let mut extents = [Extent::EMPTY; 2];
    let (mut left, mut right) = (0, refs.len());
    loop {
        while left < right && goes_left(&refs[left]) {
            extents[0].include(&refs[left]);
            left += 1;
        }
        while left < right && !goes_left(&refs[right - 1]) {
            extents[1].include(&refs[right - 1]);
            right -= 1;
        }
        if left == right {
            break;
        }
        refs.swap(left, right - 1);
        extents[0].include(&refs[left]);
        extents[1].include(&refs[right - 1]);
        (left, right) = (left + 1, right - 1);
    }
    let [left_extent, right_extent] = extents;
    let right_count = refs.len() - left;
    [Side { count: left, extent: left_extent }, Side { count: right_count, extent: right_extent }]
}
