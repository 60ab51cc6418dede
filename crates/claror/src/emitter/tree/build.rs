//! Building the tree: top down, split where the surface area orientation heuristic (Conty Estevez
//! and Kulla 2018, eq. 1) is least.

use super::collapse::Collapse;
use super::node::{Link, Node, Place, WIDTH};
use super::{Extent, LightTree};
use crate::math::{Bounds3, Frame, Vec3};
use arrayvec::ArrayVec;
use std::collections::VecDeque;
use std::f32::consts::{FRAC_PI_2, PI};

/// Candidate planes per axis, plus one.
const BINS: usize = 12;

/// A light while the tree is built.
#[derive(Debug, Clone, Copy)]
struct Item {
    light: u32,
    cluster: Cluster,
}

/// A node of the binary tree that the wide one is made of.
#[derive(Debug, Clone, Copy)]
pub(super) struct Binary {
    pub(super) cluster: Cluster,
    pub(super) link: BinaryLink,
}

#[derive(Debug, Clone, Copy)]
pub(super) enum BinaryLink {
    Light(u32),
    /// The first child; the second one follows it.
    First(u32),
}

/// Summary of some lights.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cluster {
    pub(super) bounds: Bounds3,
    pub(super) cone: Cone,
    pub(super) cos_emission: f32,
    pub(super) intensity: f64,
}

/// Directions within `angle` of `axis`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cone {
    pub(super) axis: Vec3,
    angle: f32,
}

impl Cone {
    /// Sine and cosine of its angle.
    pub(super) fn sin_cos(self) -> (f32, f32) {
        if self.angle >= PI { (0.0, -1.0) } else { self.angle.sin_cos() }
    }

    /// A cone that holds both (their algorithm 1).
    fn union(self, other: Self) -> Self {
        let (a, b) = if self.angle >= other.angle { (self, other) } else { (other, self) };
        let between = a.axis.dot(b.axis).clamp(-1.0, 1.0).acos();
        if (between + b.angle).min(PI) <= a.angle {
            return a;
        }
        // Rounding must not lose a direction.
        let angle = 0.5 * (a.angle + between + b.angle) + 1e-5;
        if angle >= PI {
            return Self { axis: a.axis, angle: PI };
        }
        // Turn a's axis towards b's.
        let turn = angle - a.angle;
        let towards = Frame::from_normal_tangent(a.axis, b.axis).s;
        let axis = (a.axis * turn.cos() + towards * turn.sin()).normalize();
        Self { axis, angle }
    }

    /// Solid angle of the emission, weighted by the cosine beyond the normals (their M_Ω).
    fn measure(self, cos_emission: f32) -> f32 {
        let emission = cos_emission.clamp(-1.0, 1.0).acos();
        let widest = (self.angle + emission).min(PI);
        let (sin, cos) = self.angle.sin_cos();
        let beyond =
            2.0 * widest * sin - (self.angle - 2.0 * widest).cos() - 2.0 * self.angle * sin + cos;
        2.0 * PI * (1.0 - cos) + FRAC_PI_2 * beyond
    }
}

impl Cluster {
    const EMPTY: Self = Self {
        bounds: Bounds3::EMPTY,
        cone: Cone { axis: Vec3::Z, angle: 0.0 },
        cos_emission: 1.0,
        intensity: 0.0,
    };

    fn union(self, other: Self) -> Self {
        if self.bounds.is_empty() {
            return other;
        }
        if other.bounds.is_empty() {
            return self;
        }
        Self {
            bounds: self.bounds.union(other.bounds),
            cone: self.cone.union(other.cone),
            cos_emission: self.cos_emission.min(other.cos_emission),
            intensity: self.intensity + other.intensity,
        }
    }

    fn cost(&self) -> f64 {
        if self.bounds.is_empty() {
            return 0.0;
        }
        // Points have no area; their extent still tells good splits from bad ones.
        let extent = self.bounds.extent();
        let size = self.bounds.half_area() + 1e-3 * extent.length_squared();
        self.intensity * f64::from(size) * f64::from(self.cone.measure(self.cos_emission))
    }
}

impl LightTree {
    /// A tree over lights with these extents and intensities (along their normals; those of 0 are
    /// left out).
    pub(in crate::emitter) fn build(lights: &[(Extent, f32)]) -> Self {
        let mut items: Vec<Item> = lights
            .iter()
            .enumerate()
            .filter(|(_, (extent, intensity))| *intensity > 0.0 && !extent.bounds.is_empty())
            .map(|(i, (extent, intensity))| Item {
                light: i as u32,
                cluster: Cluster {
                    bounds: extent.bounds,
                    cone: Cone {
                        axis: extent.axis,
                        angle: extent.cos_normals.clamp(-1.0, 1.0).acos(),
                    },
                    cos_emission: extent.cos_emission,
                    intensity: f64::from(*intensity),
                },
            })
            .collect();
        let places = vec![None; lights.len()];
        let only = if let [item] = items[..] { Some(item.light) } else { None };
        let mut tree = Self { places, only, ..Self::default() };
        if !items.is_empty() {
            tree.collapse(&grow(&mut items));
        }
        tree
    }

    /// Makes a wide tree of a binary one, level by level.
    fn collapse(&mut self, binary: &[Binary]) {
        let plan = Collapse::new(binary);
        // The wide nodes to be: the binary one whose lights they hold, and their place.
        let mut open = VecDeque::from([(0, None)]);
        let mut known = 1;
        while let Some((index, parent)) = open.pop_front() {
            let node = self.nodes.len() as u32;
            let mut children = ArrayVec::<_, WIDTH>::new();
            for (child, below) in plan.children(index).into_iter().enumerate() {
                let place = Place { node, child: child as u32 };
                let Binary { cluster, link } = binary[below as usize];
                let link = match link {
                    BinaryLink::Light(light) => {
                        self.places[light as usize] = Some(place);
                        Link::to_light(light)
                    }
                    BinaryLink::First(_) => {
                        open.push_back((below, Some(place)));
                        known += 1;
                        Link::to_node(known - 1)
                    }
                };
                children.push((cluster, link));
            }
            self.nodes.push(Node::new(&children));
            self.parents.push(parent);
        }
    }
}

/// The binary tree over these lights. Depth first with a stack of its own: lights in geometric
/// series make deep trees.
fn grow(items: &mut [Item]) -> Vec<Binary> {
    let unknown = Binary { cluster: Cluster::EMPTY, link: BinaryLink::Light(0) };
    let mut nodes = Vec::with_capacity(2 * items.len());
    nodes.push(unknown);
    // Ranges of items, and the node that each of them is to become.
    let mut open = vec![(0, items.len(), 0)];
    while let Some((begin, end, index)) = open.pop() {
        let range = &mut items[begin..end];
        if let [item] = range {
            nodes[index] = Binary { cluster: item.cluster, link: BinaryLink::Light(item.light) };
            continue;
        }
        let all = range.iter().fold(Cluster::EMPTY, |c, i| c.union(i.cluster));
        let middle = begin + split(range, &all.bounds);
        let first = nodes.len();
        nodes[index] = Binary { cluster: all, link: BinaryLink::First(first as u32) };
        nodes.extend([unknown; 2]);
        open.push((middle, end, first + 1));
        open.push((begin, middle, first));
    }
    nodes
}

/// Puts the items in an order such that those before the returned place make the first child.
///
/// That is where the heuristic wants it, or next to it: the first child of more lights than a
/// node has room for gets a multiple of that many, so that the last nodes are full. Half empty
/// ones would be twice as many, and memory is what choosing among very many lights waits for.
fn split(items: &mut [Item], bounds: &Bounds3) -> usize {
    let centers = items.iter().fold(Bounds3::EMPTY, |b, i| b.including(i.cluster.bounds.center()));
    // All in one place: halves.
    let Some((axis, plane)) = best_plane(items, &centers, bounds) else {
        return full_nodes(items.len() / 2, items.len());
    };
    let below = items.iter().filter(|i| bin_of(i, &centers, axis) < plane).count();
    let middle = full_nodes(below, items.len());
    // The order is total, so that the children depend on nothing but the lights.
    items.select_nth_unstable_by(middle, |a, b| {
        let place = |i: &Item| i.cluster.bounds.center()[axis];
        place(a).total_cmp(&place(b)).then(a.light.cmp(&b.light))
    });
    middle
}

/// The number of lights, out of `all`, next to `wanted` that fills nodes, and leaves some.
fn full_nodes(wanted: usize, all: usize) -> usize {
    if all <= WIDTH {
        return wanted.clamp(1, all - 1);
    }
    ((wanted + WIDTH / 2) / WIDTH * WIDTH).clamp(WIDTH, (all - 1) / WIDTH * WIDTH)
}

/// The axis and the first bin of the second child for the least cost; `None` when all centres
/// coincide.
fn best_plane(items: &[Item], centers: &Bounds3, bounds: &Bounds3) -> Option<(usize, usize)> {
    let longest = bounds.extent().max_element();
    let mut best: Option<(f64, usize, usize)> = None;
    for axis in 0..3 {
        let extent = centers.extent()[axis];
        if extent.is_nan() || extent <= 0.0 {
            continue;
        }
        let mut bins = [Cluster::EMPTY; BINS];
        for item in items {
            let bin = bin_of(item, centers, axis);
            bins[bin] = bins[bin].union(item.cluster);
        }
        // Thin boxes are avoided (their K_r).
        let stretch = f64::from(longest / bounds.extent()[axis].max(1e-30));
        let high = from_the_end(&bins);
        let mut low = Cluster::EMPTY;
        for plane in 1..BINS {
            low = low.union(bins[plane - 1]);
            if low.bounds.is_empty() || high[plane].bounds.is_empty() {
                continue;
            }
            let cost = stretch * (low.cost() + high[plane].cost());
            if best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, plane));
            }
        }
    }
    best.map(|(_, axis, plane)| (axis, plane))
}

/// For each bin the union of it and all after it.
fn from_the_end(bins: &[Cluster; BINS]) -> [Cluster; BINS] {
    let mut unions = *bins;
    for i in (0..BINS - 1).rev() {
        unions[i] = unions[i].union(unions[i + 1]);
    }
    unions
}

fn bin_of(item: &Item, centers: &Bounds3, axis: usize) -> usize {
    let place = item.cluster.bounds.center()[axis] - centers.min[axis];
    let bin = place / centers.extent()[axis] * BINS as f32;
    (bin as usize).min(BINS - 1)
}
