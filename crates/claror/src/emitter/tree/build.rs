//! Building the tree: top down, split where the surface area orientation heuristic (Conty Estevez
//! and Kulla 2018, eq. 1) is least.

use super::{Extent, LightTree, NO_LEAF, Node, ROOT};
use crate::math::{Bounds3, Frame, Vec3};
use std::f32::consts::{FRAC_PI_2, PI};

/// Candidate planes per axis, plus one.
const BINS: usize = 12;

/// A light while the tree is built.
#[derive(Debug, Clone, Copy)]
struct Item {
    light: u32,
    cluster: Cluster,
}

/// Summary of some lights.
#[derive(Debug, Clone, Copy)]
struct Cluster {
    bounds: Bounds3,
    cone: Cone,
    cos_emission: f32,
    intensity: f64,
}

/// Directions within `angle` of `axis`.
#[derive(Debug, Clone, Copy)]
struct Cone {
    axis: Vec3,
    angle: f32,
}

impl Cone {
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

    fn node(&self, link: u32, parent: u32, is_leaf: bool) -> Node {
        Node {
            center: self.bounds.center(),
            // Rounded up: bounds must hold.
            radius: 0.5 * self.bounds.extent().length() * (1.0 + 1e-5),
            axis: self.cone.axis,
            cos_normals: if self.cone.angle >= PI { -1.0 } else { self.cone.angle.cos() },
            cos_emission: self.cos_emission,
            intensity: self.intensity as f32,
            link,
            parent,
            is_leaf,
        }
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
        let mut tree = Self { nodes: Vec::new(), leaf_of: vec![NO_LEAF; lights.len()] };
        if !items.is_empty() {
            tree.grow(&mut items);
        }
        tree
    }

    /// Depth first with a stack of its own: lights in geometric series make deep trees.
    fn grow(&mut self, items: &mut [Item]) {
        self.nodes.reserve(2 * items.len());
        self.nodes.push(Cluster::EMPTY.node(0, ROOT, true));
        // Ranges of items, and the node and parent that each of them is to become.
        let mut open = vec![(0, items.len(), 0, ROOT)];
        while let Some((begin, end, index, parent)) = open.pop() {
            let range = &mut items[begin..end];
            if let [item] = range {
                self.leaf_of[item.light as usize] = index;
                self.nodes[index as usize] = item.cluster.node(item.light, parent, true);
                continue;
            }
            let all = range.iter().fold(Cluster::EMPTY, |c, i| c.union(i.cluster));
            let middle = begin + split(range, &all.bounds);
            let first = self.nodes.len() as u32;
            self.nodes[index as usize] = all.node(first, parent, false);
            // Side by side, since both are always looked at together.
            self.nodes.push(Cluster::EMPTY.node(0, index, true));
            self.nodes.push(Cluster::EMPTY.node(0, index, true));
            open.push((middle, end, first + 1, index));
            open.push((begin, middle, first, index));
        }
    }
}

/// Puts the items in an order such that those before the returned place make the first child.
fn split(items: &mut [Item], bounds: &Bounds3) -> usize {
    let centers = items.iter().fold(Bounds3::EMPTY, |b, i| b.including(i.cluster.bounds.center()));
    if let Some((axis, plane)) = best_plane(items, &centers, bounds) {
        let bin = |i: &Item| bin_of(i, &centers, axis);
        // Stable, so that the result depends on nothing but the lights and their order.
        items.sort_by_key(|i| bin(i) >= plane);
        let middle = items.partition_point(|i| bin(i) < plane);
        if middle > 0 && middle < items.len() {
            return middle;
        }
    }
    // All in one place: halves.
    items.len() / 2
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
