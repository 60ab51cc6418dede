//! What lies between two neighbouring hit points: one surface, the edge between two that meet, or
//! the edge of one in front of the other.

use crate::math::{DVec2, DVec3};

/// Hit points are on one plane when they are off each other's by less than this times their
/// distance, and their normals' cosine is above the next number.
const FLAT: f64 = 0.02;
const PARALLEL: f64 = 0.95;
/// Without normals: on one surface when the distances differ less than this.
const NEAR_RATIO: f64 = 1.5;
/// A plane continued to between the samples may come this much nearer or go that much farther.
const CONTINUED: f64 = 2.0;

/// A hit point as the mesh sees it, relative to the receiver, local.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hit {
    pub(super) position: DVec3,
    /// Unit, or zero if unknown.
    pub(super) normal: DVec3,
    pub(super) distance: f64,
    /// Nothing was hit: the position is very far away.
    pub(super) miss: bool,
}

/// Where the surface of one sample ends and that of its neighbour begins.
#[derive(Debug, Clone, Copy)]
pub(super) struct Split {
    /// The place on the surface of the edge's start.
    pub(super) on_a: DVec3,
    /// The place, in the same direction, on the surface of its end; the same where they meet.
    pub(super) on_b: DVec3,
}

impl Split {
    /// The nearer of the two, which is the one that is seen and moves as seen.
    pub(super) fn near(&self) -> DVec3 {
        if self.on_a.length_squared() <= self.on_b.length_squared() { self.on_a } else { self.on_b }
    }
}

/// `None` when both hit points lie on one surface, as far as can be told.
pub(super) fn split(a: &Hit, b: &Hit) -> Option<Split> {
    if a.miss || b.miss {
        return if a.miss && b.miss { None } else { Some(half_way(a, b)) };
    }
    let e = b.position - a.position;
    if a.normal == DVec3::ZERO || b.normal == DVec3::ZERO {
        let (near, far) = (a.distance.min(b.distance), a.distance.max(b.distance));
        return if far < NEAR_RATIO * near { None } else { Some(half_way(a, b)) };
    }
    let (off_a, off_b) = (a.normal.dot(e), b.normal.dot(e));
    let tolerance2 = FLAT * FLAT * e.length_squared();
    let flat = off_a * off_a <= tolerance2 && off_b * off_b <= tolerance2;
    if flat && a.normal.dot(b.normal).abs() > PARALLEL {
        return None;
    }
    Some(crease(a, b).unwrap_or_else(|| half_way(a, b)))
}

/// The point where the two tangent planes and the plane through the receiver and both hits meet,
/// if that is seen between the two.
fn crease(a: &Hit, b: &Hit) -> Option<Split> {
    // α a + β b on both planes.
    let (aa, ab) = (a.normal.dot(a.position), a.normal.dot(b.position));
    let (ba, bb) = (b.normal.dot(a.position), b.normal.dot(b.position));
    let determinant = aa * bb - ab * ba;
    let (alpha, beta) = ((aa - ab) * bb / determinant, (bb - ba) * aa / determinant);
    if !(alpha >= 0.0 && beta >= 0.0 && alpha.is_finite() && beta.is_finite()) {
        return None;
    }
    let point = alpha * a.position + beta * b.position;
    let distance = point.length();
    let (near, far) = (a.distance.min(b.distance), a.distance.max(b.distance));
    let plausible = distance * CONTINUED >= near && distance <= CONTINUED * far;
    plausible.then_some(Split { on_a: point, on_b: point })
}

/// An occluder's edge: somewhere between the two; on average half way, as irradiance counts.
fn half_way(a: &Hit, b: &Hit) -> Split {
    let disk = |hit: &Hit| DVec2::new(hit.position.x, hit.position.y) / hit.distance;
    let middle = 0.5 * (disk(a) + disk(b));
    let direction = middle.extend((1.0 - middle.length_squared()).max(0.0).sqrt());
    Split { on_a: continued(a, direction), on_b: continued(b, direction) }
}

/// The point in this unit direction on the plane of the hit, or at its distance.
fn continued(hit: &Hit, direction: DVec3) -> DVec3 {
    let ratio = hit.normal.dot(hit.position) / (hit.normal.dot(direction) * hit.distance);
    let ratio = if ratio * CONTINUED >= 1.0 && ratio <= CONTINUED { ratio } else { 1.0 };
    ratio * hit.distance * direction
}
