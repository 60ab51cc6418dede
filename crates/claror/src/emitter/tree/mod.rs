//! Choice of one light among many: a binary tree over the lights, walked down by how much each
//! side may contribute at the reference point.
//!
//! Conty Estevez and Kulla 2018: Importance sampling of many lights with adaptive tree splitting.
//! A node knows the box of its lights, a cone that holds the directions they face, how far to the
//! side they shine, and their intensity. From these follows a bound on the cosines and an estimate
//! of the irradiance; a node gets probability 0 only where the bounds say that nothing can arrive.

mod build;
#[cfg(test)]
mod tests;

use crate::math::{Bounds3, Vec3};

/// Where a light is and where it shines to.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    /// Box around it.
    pub(super) bounds: Bounds3,
    /// Middle of the directions that its surface faces, unit.
    pub(super) axis: Vec3,
    /// Cosine of the largest angle between `axis` and a normal; −1 when it faces everywhere.
    pub(super) cos_normals: f32,
    /// Cosine of the largest angle between a normal and the light that leaves there.
    pub(super) cos_emission: f32,
}

/// Cosines are bounds; they may be wrong by this much through rounding.
const COSINE_SLACK: f32 = 1e-4;
/// Least share of the cosine in an estimate that is not zero.
const MIN_COSINE: f32 = 1e-2;

/// Lights at the reference point itself are not infinitely important: sums must stay finite.
const MAX_IMPORTANCE: f32 = f32::MAX / 8.0;

/// Where to and how much the lights of a node shine, as seen from a reference point.
#[derive(Debug, Clone)]
struct Node {
    center: Vec3,
    /// Of the sphere around the box.
    radius: f32,
    axis: Vec3,
    cos_normals: f32,
    cos_emission: f32,
    /// Sum of the lights' intensities along their normals, mean of the channels.
    intensity: f32,
    /// Node of the first child (the second one follows it), or the light of a leaf.
    link: u32,
    /// `ROOT` for the root.
    parent: u32,
    is_leaf: bool,
}

/// The tree.
#[derive(Debug, Clone, Default)]
pub(super) struct LightTree {
    nodes: Vec<Node>,
    /// Leaf of each light; `NO_LEAF` for lights that do not shine.
    leaf_of: Vec<u32>,
}

const ROOT: u32 = u32::MAX;
const NO_LEAF: u32 = u32::MAX;

/// Where light arrives: a point and perhaps the only side from which it matters.
#[derive(Debug, Clone, Copy)]
pub(super) struct Receiver {
    pub(super) p: Vec3,
    pub(super) n: Option<Vec3>,
}

impl Node {
    /// Estimate of the irradiance that the node's lights make at `at`; 0 only where they cannot
    /// make any.
    fn importance(&self, at: &Receiver) -> f32 {
        let to_center = self.center - at.p;
        let distance2 = to_center.length_squared();
        let radius2 = self.radius * self.radius;
        // Inside the sphere around the lights no direction can be excluded.
        if distance2 <= radius2 {
            return (self.intensity / radius2.max(f32::MIN_POSITIVE)).min(MAX_IMPORTANCE);
        }
        let wi = to_center / distance2.sqrt();
        let sin_b = self.radius / distance2.sqrt();
        let cos_b = (1.0 - sin_b * sin_b).max(0.0).sqrt();
        let cos_normals = self.cos_normals;
        let sin_normals = (1.0 - cos_normals * cos_normals).max(0.0).sqrt();
        // Least angle between a normal and the way to the reference point.
        let cos = cos_of_difference(-wi.dot(self.axis), (sin_normals, cos_normals));
        let cos = cos_of_difference(cos, (sin_b, cos_b));
        if cos < self.cos_emission - COSINE_SLACK {
            return 0.0;
        }
        let mut importance = self.intensity * cos.max(MIN_COSINE) / distance2;
        if let Some(n) = at.n {
            let cos = cos_of_difference(wi.dot(n), (sin_b, cos_b));
            if cos < -COSINE_SLACK {
                return 0.0;
            }
            importance *= cos.max(MIN_COSINE);
        }
        importance.min(MAX_IMPORTANCE)
    }
}

/// Cosine of max(0, a − b), given the cosine of a and sine and cosine of b, both in [0, π].
fn cos_of_difference(cos_a: f32, (sin_b, cos_b): (f32, f32)) -> f32 {
    if cos_a >= cos_b {
        return 1.0;
    }
    let sin_a = (1.0 - cos_a * cos_a).max(0.0).sqrt();
    cos_a * cos_b + sin_a * sin_b
}

impl LightTree {
    /// Estimate of the irradiance of all lights; 0 where none of them can contribute.
    pub(super) fn irradiance(&self, at: &Receiver) -> f32 {
        self.nodes.first().map_or(0.0, |root| root.importance(at))
    }

    /// A light and its probability, given `u` in [0, 1); `None` where no light can contribute.
    pub(super) fn sample(&self, at: &Receiver, mut u: f64) -> Option<(usize, f32)> {
        let mut probability = 1.0;
        let mut index = 0;
        loop {
            let node = self.nodes.get(index)?;
            if node.is_leaf {
                return Some((node.link as usize, probability));
            }
            let first = node.link as usize;
            let shares = self.shares(node, at)?;
            if u < shares[0] {
                u /= shares[0];
                probability *= shares[0] as f32;
                index = first;
            } else {
                // Rounding may lead here though only the first child is possible.
                if shares[1] == 0.0 {
                    return None;
                }
                u = ((u - shares[0]) / shares[1]).min(1.0 - f64::EPSILON);
                probability *= shares[1] as f32;
                index = first + 1;
            }
        }
    }

    /// The probability with which [`LightTree::sample`] chooses this light.
    pub(super) fn probability(&self, at: &Receiver, light: usize) -> f32 {
        let mut index = self.leaf_of[light];
        if index == NO_LEAF {
            return 0.0;
        }
        let mut probability = 1.0;
        loop {
            let parent = self.nodes[index as usize].parent;
            if parent == ROOT {
                return probability;
            }
            let node = &self.nodes[parent as usize];
            let Some(shares) = self.shares(node, at) else { return 0.0 };
            let is_second = index != node.link;
            probability *= shares[usize::from(is_second)] as f32;
            if probability == 0.0 {
                return 0.0;
            }
            index = parent;
        }
    }

    /// Probabilities of the children of a node; `None` where neither can contribute. In double
    /// precision, so that the one does not vanish beside the other.
    fn shares(&self, node: &Node, at: &Receiver) -> Option<[f64; 2]> {
        let link = node.link as usize;
        let first = f64::from(self.nodes[link].importance(at));
        let second = f64::from(self.nodes[link + 1].importance(at));
        let sum = first + second;
        (sum > 0.0).then(|| [first / sum, second / sum])
    }
}
