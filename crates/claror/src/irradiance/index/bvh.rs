//! A hierarchy of boxes, eight to a node, for caches that do not change any more.

use arrayvec::ArrayVec;

use crate::irradiance::kernel::Reach;
use crate::irradiance::record::Record;
use crate::math::{Bounds3, Vec3};

const WIDTH: usize = 8;
/// Bit of a link that names a record; other links name nodes.
const RECORD: u32 = 1 << 31;
/// Bins along an axis where a split is looked for.
const BINS: usize = 16;
/// Below this depth groups are halved by number, so that the depth stays bounded.
const MEDIAN_DEPTH: u32 = 20;
/// Nodes that wait in a look-up: seven on each of at most 20 + 32 levels, and one more.
const STACK: usize = 7 * 52 + 1;

/// Eight boxes and what is inside of them. Unused lanes have empty boxes.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(32))]
struct Node {
    min: [[f32; WIDTH]; 3],
    max: [[f32; WIDTH]; 3],
    links: [u32; WIDTH],
}

impl Node {
    const EMPTY: Self = Self {
        min: [[f32::INFINITY; WIDTH]; 3],
        max: [[f32::NEG_INFINITY; WIDTH]; 3],
        links: [0; WIDTH],
    };

    /// Bit k: lane k's box holds the point.
    #[inline(always)]
    fn lanes_around(&self, p: Vec3) -> u32 {
        let mut outside = [0.0_f32; WIDTH];
        for (k, lane) in outside.iter_mut().enumerate() {
            let x = (self.min[0][k] - p.x).max(p.x - self.max[0][k]);
            let y = (self.min[1][k] - p.y).max(p.y - self.max[1][k]);
            let z = (self.min[2][k] - p.z).max(p.z - self.max[2][k]);
            *lane = x.max(y).max(z);
        }
        let mut mask = 0;
        for (k, &distance) in outside.iter().enumerate() {
            mask |= u32::from(distance <= 0.0) << k;
        }
        mask
    }
}

/// The hierarchy over the records' supports, built by the surface area heuristic.
#[derive(Debug, Clone, Default)]
pub struct Bvh {
    nodes: Vec<Node>,
}

#[derive(Clone, Copy)]
struct Item {
    bounds: Bounds3,
    centre: Vec3,
    record: u32,
}

/// A range of items that share a lane.
struct Group {
    from: usize,
    to: usize,
    bounds: Bounds3,
}

impl Group {
    fn new(items: &[Item], from: usize, to: usize) -> Self {
        let bounds = items[from..to].iter().fold(Bounds3::EMPTY, |b, i| b.union(i.bounds));
        Self { from, to, bounds }
    }
}

impl Bvh {
    /// Over all records.
    pub fn new(records: &[Record], reach: Reach) -> Self {
        let items = records.iter().zip(0_u32..).map(|(record, index)| {
            let bounds = record.support(reach.factor, reach.thickness);
            Item { bounds, centre: record.position, record: index }
        });
        let mut items: Vec<Item> = items.collect();
        let mut bvh = Self::default();
        if !items.is_empty() {
            bvh.build(&mut items, 0);
        }
        bvh
    }

    fn build(&mut self, items: &mut [Item], depth: u32) -> u32 {
        let number = self.nodes.len() as u32;
        self.nodes.push(Node::EMPTY);
        let mut groups = vec![Group::new(items, 0, items.len())];
        while groups.len() < WIDTH {
            // The largest one that can be divided; the first of equal ones.
            let mut largest: Option<usize> = None;
            for (k, group) in groups.iter().enumerate() {
                let larger =
                    largest.is_none_or(|l| group.bounds.half_area() > groups[l].bounds.half_area());
                if group.to - group.from > 1 && larger {
                    largest = Some(k);
                }
            }
            let Some(k) = largest else { break };
            let Group { from, to, .. } = groups[k];
            let middle = from + split(&mut items[from..to], depth >= MEDIAN_DEPTH);
            groups[k] = Group::new(items, from, middle);
            groups.insert(k + 1, Group::new(items, middle, to));
        }
        for (lane, group) in groups.iter().enumerate() {
            let link = if group.to - group.from == 1 {
                RECORD | items[group.from].record
            } else {
                self.build(&mut items[group.from..group.to], depth + 1)
            };
            let node = &mut self.nodes[number as usize];
            for axis in 0..3 {
                node.min[axis][lane] = group.bounds.min[axis];
                node.max[axis][lane] = group.bounds.max[axis];
            }
            node.links[lane] = link;
        }
        number
    }

    /// Calls `f` with the numbers of all records whose support holds `p`.
    #[inline]
    pub fn for_candidates(&self, p: Vec3, mut f: impl FnMut(u32)) {
        let mut stack = ArrayVec::<u32, STACK>::new();
        let mut next = Some(0);
        while let Some(node) = next.and_then(|n| self.nodes.get(n as usize)) {
            let mut lanes = node.lanes_around(p);
            while lanes != 0 {
                let link = node.links[lanes.trailing_zeros() as usize & (WIDTH - 1)];
                lanes &= lanes - 1;
                if link & RECORD != 0 {
                    f(link & !RECORD);
                } else {
                    // There is room: the depth is bounded.
                    stack.push(link);
                }
            }
            next = stack.pop();
        }
    }
}

/// Orders at least two items so that a first and a second part belong together; how many are in
/// the first, neither all nor none.
fn split(items: &mut [Item], halve: bool) -> usize {
    let centres = items.iter().fold(Bounds3::EMPTY, |b, i| b.including(i.centre));
    let best = if halve { None } else { best_split(items, centres) };
    let Some((axis, bin)) = best else {
        // All at one place, or too deep: by number along the longest axis.
        let extent = centres.extent();
        let axis = (0..3).fold(0, |best, a| if extent[a] > extent[best] { a } else { best });
        items.sort_by(|a, b| a.centre[axis].total_cmp(&b.centre[axis]));
        return items.len() / 2;
    };
    let first = |item: &Item| bin_of(item.centre, centres, axis) <= bin;
    items.sort_by_key(|item| !first(item));
    items.iter().filter(|item| first(item)).count()
}

fn bin_of(centre: Vec3, centres: Bounds3, axis: usize) -> usize {
    let extent = centres.max[axis] - centres.min[axis];
    let bin = (centre[axis] - centres.min[axis]) / extent * BINS as f32;
    (bin as usize).min(BINS - 1)
}

/// Axis, and last bin of the first part, with the least sum of area times number.
fn best_split(items: &[Item], centres: Bounds3) -> Option<(usize, usize)> {
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in 0..3 {
        if centres.max[axis] <= centres.min[axis] {
            continue;
        }
        let mut bins = [(0_u32, Bounds3::EMPTY); BINS];
        for item in items {
            let bin = &mut bins[bin_of(item.centre, centres, axis)];
            *bin = (bin.0 + 1, bin.1.union(item.bounds));
        }
        let add = |a: (u32, Bounds3), b: (u32, Bounds3)| (a.0 + b.0, a.1.union(b.1));
        let cost = |part: (u32, Bounds3)| part.1.half_area() * part.0 as f32;
        let mut after = [(0, Bounds3::EMPTY); BINS + 1];
        for k in (0..BINS).rev() {
            after[k] = add(bins[k], after[k + 1]);
        }
        let mut before = (0, Bounds3::EMPTY);
        for k in 0..BINS - 1 {
            before = add(before, bins[k]);
            if before.0 == 0 || after[k + 1].0 == 0 {
                continue;
            }
            let sum = cost(before) + cost(after[k + 1]);
            if best.is_none_or(|(least, ..)| sum < least) {
                best = Some((sum, axis, k));
            }
        }
    }
    best.map(|(_, axis, bin)| (axis, bin))
}
