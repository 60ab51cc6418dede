//! A node of the tree: what is known of the lights below each of its children, and what that says
//! about the irradiance at a reference point.
//!
//! All children are looked at together, four in a vector, without a branch: what can be excluded
//! is masked out.

use super::Receiver;
use super::build::Cluster;
use crate::math::Vec4;

/// Children of a node.
pub(super) const WIDTH: usize = 8;

/// Cosines are bounds; they may be wrong by this much through rounding.
const COSINE_SLACK: f32 = 1e-4;
/// Least share of the cosine in an estimate that is not zero.
const MIN_COSINE: f32 = 1e-2;

/// Lights at the reference point itself are not infinitely important: sums must stay finite.
const MAX_IMPORTANCE: f32 = f32::MAX / 8.0;

/// Where to and how much the lights below four children shine.
#[derive(Debug, Clone, Copy)]
struct Four {
    center: [Vec4; 3],
    /// Of the sphere around the box.
    radius: Vec4,
    axis: [Vec4; 3],
    cos_normals: Vec4,
    sin_normals: Vec4,
    /// Cosines below this one are those of directions into which nothing shines.
    min_cos: Vec4,
    /// Sum of the lights' intensities along their normals, mean of the channels; 0 for a child
    /// that is not there.
    intensity: Vec4,
}

/// The children of one node.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub(super) struct Node {
    fours: [Four; WIDTH / 4],
    pub(super) links: [Link; WIDTH],
}

/// A child: another node, or a light.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Link(u32);

/// The child of a node that something is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) node: u32,
    pub(super) child: u32,
}

/// What is chosen between at a node.
#[derive(Debug, Clone, Copy)]
pub(in crate::emitter) struct Shares {
    /// Estimates of the irradiance that each child's lights make.
    importance: [f64; WIDTH],
    /// Sums of the estimates before each child, and of all.
    sums: [f64; WIDTH + 1],
}

impl Link {
    const LIGHT: u32 = 1 << 31;

    pub(super) fn to_node(index: u32) -> Self {
        Self(index)
    }

    pub(super) fn to_light(index: u32) -> Self {
        Self(index | Self::LIGHT)
    }

    /// The node that it leads to, or else the light.
    #[inline]
    pub(super) fn follow(self) -> Result<usize, usize> {
        let index = (self.0 & !Self::LIGHT) as usize;
        if self.0 & Self::LIGHT == 0 { Ok(index) } else { Err(index) }
    }
}

impl Four {
    const EMPTY: Self = Self {
        center: [Vec4::ZERO; 3],
        radius: Vec4::ZERO,
        axis: [Vec4::ZERO; 3],
        cos_normals: Vec4::ZERO,
        sin_normals: Vec4::ZERO,
        min_cos: Vec4::ZERO,
        intensity: Vec4::ZERO,
    };

    fn set(&mut self, lane: usize, cluster: &Cluster) {
        let (center, axis) = (cluster.bounds.center(), cluster.cone.axis);
        for i in 0..3 {
            self.center[i][lane] = center[i];
            self.axis[i][lane] = axis[i];
        }
        // Rounded up: bounds must hold.
        self.radius[lane] = 0.5 * cluster.bounds.extent().length() * (1.0 + 1e-5);
        let (sin, cos) = cluster.cone.sin_cos();
        self.cos_normals[lane] = cos;
        self.sin_normals[lane] = sin;
        self.min_cos[lane] = cluster.cos_emission - COSINE_SLACK;
        self.intensity[lane] = cluster.intensity.min(f64::from(f32::MAX)) as f32;
    }

    /// Estimates of the irradiance that the lights make at `at`; 0 only where they cannot make
    /// any.
    ///
    /// Sines and cosines are left multiplied by lengths that they have in common, so that all
    /// roots are roots of squared lengths and none waits for another.
    #[inline(always)]
    fn importance(&self, at: &Receiver) -> Vec4 {
        let [x, y, z] = self.center;
        let to = [x - Vec4::splat(at.p.x), y - Vec4::splat(at.p.y), z - Vec4::splat(at.p.z)];
        let distance2 = dot(to, to);
        let radius2 = self.radius * self.radius;
        let inverse2 = distance2.max(radius2).max(Vec4::splat(f32::MIN_POSITIVE)).recip();
        let distance = distance2.sqrt();
        // Of the angle between the axis and the way to the reference point, times the distance.
        let cos = -dot(to, self.axis);
        let sin = (distance2 - cos * cos).max(Vec4::ZERO).sqrt();
        // Of the half angle that the sphere fills: `radius` is the sine times the distance.
        let tangent = (distance2 - radius2).max(Vec4::ZERO).sqrt();
        // Least angle between a normal and the way to the reference point.
        let is_beside = cos.cmplt(self.cos_normals * distance);
        let sin_beside = sin * self.cos_normals - cos * self.sin_normals;
        let cos_beside = cos * self.cos_normals + sin * self.sin_normals;
        let cos = Vec4::select(is_beside, cos_beside, distance);
        let sin = Vec4::select(is_beside, sin_beside, Vec4::ZERO);
        let beside = cos * tangent + sin * self.radius;
        let cos = Vec4::select(cos.cmplt(tangent), beside, distance2) * inverse2;
        let mut possible = cos.cmpge(self.min_cos);
        let mut factor = cos.max(Vec4::splat(MIN_COSINE));
        if let Some(n) = at.n {
            let cos = dot(to, [n.x, n.y, n.z].map(Vec4::splat));
            let sin = (distance2 - cos * cos).max(Vec4::ZERO).sqrt();
            let beside = cos * tangent + sin * self.radius;
            let cos = Vec4::select(cos.cmplt(tangent), beside, distance2) * inverse2;
            possible &= cos.cmpge(Vec4::splat(-COSINE_SLACK));
            factor *= cos.max(Vec4::splat(MIN_COSINE));
        }
        let factor = Vec4::select(possible, factor, Vec4::ZERO);
        // Inside the sphere around the lights no direction can be excluded.
        let factor = Vec4::select(distance2.cmple(radius2), Vec4::ONE, factor);
        // In this order, so that nothing impossible overflows.
        (self.intensity * factor * inverse2).min(Vec4::splat(MAX_IMPORTANCE))
    }
}

#[inline(always)]
fn dot(a: [Vec4; 3], b: [Vec4; 3]) -> Vec4 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The sums of the first one, two, three and four values; they never decrease.
#[inline(always)]
fn running_sums([x, y, z, w]: [f64; 4]) -> [f64; 4] {
    [x, x + y, x + y + z, (x + y) + (z + w)]
}

impl Node {
    /// A node over these children.
    pub(super) fn new(children: &[(Cluster, Link)]) -> Self {
        let mut node = Self { fours: [Four::EMPTY; WIDTH / 4], links: [Link::to_node(0); WIDTH] };
        for (i, (cluster, link)) in children.iter().enumerate() {
            node.fours[i / 4].set(i % 4, cluster);
            node.links[i] = *link;
        }
        node
    }

    /// How the children share the irradiance at `at`. In double precision, so that the one does
    /// not vanish beside the other.
    #[inline(always)]
    pub(super) fn shares(&self, at: &Receiver) -> Shares {
        let [a, b] = &self.fours;
        let (a, b) = (a.importance(at), b.importance(at));
        let (a, b) = (a.as_dvec4().to_array(), b.as_dvec4().to_array());
        let ([a0, a1, a2, a3], [b0, b1, b2, b3]) = (running_sums(a), running_sums(b));
        Shares {
            importance: [a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]],
            sums: [0.0, a0, a1, a2, a3, a3 + b0, a3 + b1, a3 + b2, a3 + b3],
        }
    }
}

impl Shares {
    /// Estimate of the irradiance of all children.
    #[inline]
    pub(in crate::emitter) fn sum(&self) -> f64 {
        self.sums[WIDTH]
    }

    /// Estimate of the irradiance of one child.
    #[inline]
    pub(super) fn importance(&self, child: usize) -> f64 {
        self.importance[child]
    }

    /// Probability of a child, given that the sum is not 0.
    #[inline]
    pub(super) fn probability(&self, child: usize) -> f64 {
        self.importance[child] / self.sum()
    }

    /// The child that `u` in [0, 1) chooses, and what is left of `u`, again in [0, 1); `None` where
    /// no child can contribute.
    #[inline(always)]
    pub(super) fn choose(&self, u: f64) -> Option<(usize, f64)> {
        let target = u * self.sum();
        // How many sums are no greater: floats that are not negative are ordered as their bits.
        let above = target.to_bits() + 1;
        let is_no_greater = |sum: &f64| sum.to_bits().wrapping_sub(above) >> 63;
        let child = self.sums[1..].iter().map(is_no_greater).sum::<u64>() as usize;
        // Beyond the last one where all are 0.
        let importance = *self.importance.get(child)?;
        Some((child, ((target - self.sums[child]) / importance).min(1.0 - f64::EPSILON)))
    }
}
