//! Distributions of microfacet normals: Beckmann and GGX, isotropic or anisotropic, sampled
//! whole or by what is visible.
//!
//! Walter, Marschner, Li, Torrance 2007: Microfacet models for refraction through rough surfaces
//! (distribution `d`, shadowing `g1`, sampling of all normals). Heitz and d'Eon 2014: Importance
//! sampling microfacet-based BSDFs using the distribution of visible normals. Jakob 2014: An
//! improved visible normal sampling routine for the Beckmann distribution. Heitz 2018: Sampling
//! the GGX distribution of visible normals.

use std::f32::consts::{PI, TAU};

use super::MicrofacetKind;
use crate::math::special::{erf, erf_inv};
use crate::math::{Vec2, Vec3, warp};

/// Roughness below this would make the distribution overflow.
const MIN_ALPHA: f32 = 1e-4;
/// 1/√π.
const FRAC_1_SQRT_PI: f32 = 0.564_189_6;

#[derive(Debug, Clone, Copy)]
pub(super) struct Microfacets {
    pub(super) kind: MicrofacetKind,
    pub(super) sample_visible: bool,
    alpha_u: f32,
    alpha_v: f32,
}

impl Microfacets {
    pub(super) fn new(
        kind: MicrofacetKind,
        sample_visible: bool,
        alpha_u: f32,
        alpha_v: f32,
    ) -> Self {
        let (alpha_u, alpha_v) = (alpha_u.max(MIN_ALPHA), alpha_v.max(MIN_ALPHA));
        Self { kind, sample_visible, alpha_u, alpha_v }
    }

    /// The same kind of distribution, rougher by a factor.
    pub(super) fn scaled(self, factor: f32) -> Self {
        Self { alpha_u: self.alpha_u * factor, alpha_v: self.alpha_v * factor, ..self }
    }

    /// Microfacet area with the normal `m` per macroscopic area and solid angle.
    pub(super) fn d(&self, m: Vec3) -> f32 {
        let (x, y) = (m.x / self.alpha_u, m.y / self.alpha_v);
        let slopes = x * x + y * y;
        let cos2 = m.z * m.z;
        let area = PI * self.alpha_u * self.alpha_v;
        let d = match self.kind {
            MicrofacetKind::Beckmann => (-slopes / cos2).exp() / (area * cos2 * cos2),
            MicrofacetKind::Ggx => 1.0 / (area * (slopes + cos2) * (slopes + cos2)),
        };
        // As in Mitsuba: what underflows later is nothing. Also catches NaN at the horizon.
        if d * m.z > 1e-20 { d } else { 0.0 }
    }

    /// Share of the facets with normal `m` that is visible from `w` (Smith's shadowing and
    /// masking). 0 where `w` sees the front of the surface but the back of the facet.
    pub(super) fn g1(&self, w: Vec3, m: Vec3) -> f32 {
        if w.dot(m) * w.z <= 0.0 {
            return 0.0;
        }
        let (x, y) = (self.alpha_u * w.x, self.alpha_v * w.y);
        let xy2 = x * x + y * y;
        if xy2 == 0.0 {
            return 1.0;
        }
        let tan2 = xy2 / (w.z * w.z);
        match self.kind {
            // Walter's rational fit, error below 0.35 %, which Mitsuba uses.
            MicrofacetKind::Beckmann => {
                let a2 = 1.0 / tan2;
                let a = a2.sqrt();
                if a >= 1.6 {
                    1.0
                } else {
                    (3.535 * a + 2.181 * a2) / (1.0 + 2.276 * a + 2.577 * a2)
                }
            }
            MicrofacetKind::Ggx => 2.0 / (1.0 + (1.0 + tan2).sqrt()),
        }
    }

    /// Density of [`Microfacets::sample`] by solid angle of `m`, given `d(m)`; `w.z > 0`.
    pub(super) fn pdf(&self, w: Vec3, m: Vec3, d: f32) -> f32 {
        if self.sample_visible { d * self.g1(w, m) * w.dot(m).abs() / w.z } else { d * m.z }
    }

    /// A normal, among those visible from `w` (`w.z > 0`) or among all.
    pub(super) fn sample(&self, w: Vec3, u: Vec2) -> Vec3 {
        if !self.sample_visible {
            return self.sample_all(u);
        }
        let (cos, sin, turn) = self.stretched(w);
        let slope = match self.kind {
            MicrofacetKind::Beckmann => {
                Vec2::new(beckmann_slope_towards(cos, sin, u.x), beckmann_slope_across(u.y))
            }
            MicrofacetKind::Ggx => ggx_visible_slope(cos, sin, u),
        };
        self.normal_of_slope(slope, turn)
    }

    /// Integrates `f(m)` over the normals visible from `w`, by their density, through the map of
    /// [`Microfacets::sample`] and a product of the quadrature `nodes` (position and weight in
    /// [0, 1]). `f` must be symmetric about the plane of `w` and the surface normal, and the nodes
    /// about 1/2, so that half of them suffice.
    pub(super) fn integrate_visible(
        &self,
        w: Vec3,
        nodes: &[(f32, f32)],
        f: impl Fn(Vec3) -> f32,
    ) -> f32 {
        let (cos, sin, turn) = self.stretched(w);
        let half = &nodes[..nodes.len() / 2];
        let mut sum = 0.0;
        match self.kind {
            MicrofacetKind::Beckmann => {
                for &(u, weight_u) in nodes {
                    let towards = beckmann_slope_towards(cos, sin, u);
                    for &(v, weight_v) in half {
                        let slope = Vec2::new(towards, beckmann_slope_across(v));
                        sum += weight_u * weight_v * f(self.normal_of_slope(slope, turn));
                    }
                }
            }
            MicrofacetKind::Ggx => {
                for &(u, weight_u) in half {
                    for &(v, weight_v) in nodes {
                        let slope = ggx_visible_slope(cos, sin, Vec2::new(u, v));
                        sum += weight_u * weight_v * f(self.normal_of_slope(slope, turn));
                    }
                }
            }
        }
        2.0 * sum
    }

    /// `w` in the space where the roughness is 1: cosine, sine and azimuth (as a unit vector).
    fn stretched(&self, w: Vec3) -> (f32, f32, Vec2) {
        let w = Vec3::new(self.alpha_u * w.x, self.alpha_v * w.y, w.z).normalize();
        let sin = w.truncate().length();
        (w.z, sin, if sin > 0.0 { w.truncate() / sin } else { Vec2::X })
    }

    /// The normal with a slope of the space where the roughness is 1, relative to the azimuth
    /// `turn`.
    fn normal_of_slope(&self, slope: Vec2, turn: Vec2) -> Vec3 {
        let slope = turn.rotate(slope) * Vec2::new(self.alpha_u, self.alpha_v);
        Vec3::new(-slope.x, -slope.y, 1.0).normalize()
    }

    /// A normal among all: slopes are distributed alike in all directions when divided by the
    /// roughness.
    fn sample_all(&self, u: Vec2) -> Vec3 {
        let tan2 = match self.kind {
            MicrofacetKind::Beckmann => -(-u.x).ln_1p(),
            MicrofacetKind::Ggx => u.x / (1.0 - u.x),
        };
        let (sin, cos) = (TAU * u.y).sin_cos();
        let r = tan2.sqrt();
        Vec3::new(self.alpha_u * r * cos, self.alpha_v * r * sin, 1.0).normalize()
    }
}

/// Slope, towards the viewer in the direction (sin, 0, cos), of a visible normal of the Beckmann
/// distribution with roughness 1. Found by Newton's method on the distribution function, in the
/// variable erf(slope) (Jakob 2014).
fn beckmann_slope_towards(cos: f32, sin: f32, u: f32) -> f32 {
    let u = u.clamp(1e-6, 1.0 - 1e-6);
    let tan = sin / cos;
    let cot = cos / sin;
    let limit = erf(cot);
    // The start is exact at grazing angles, where the function is most curved.
    let mut x = limit - (limit + 1.0) * erf((-u.ln()).sqrt());
    let tail = if sin > 0.0 { FRAC_1_SQRT_PI * tan * (-cot * cot).exp() } else { 0.0 };
    let target = u * (1.0 + limit + tail);
    for _ in 0..3 {
        let slope = erf_inv(x);
        let value = 1.0 + x + FRAC_1_SQRT_PI * tan * (-slope * slope).exp() - target;
        x = (x - value / (1.0 - slope * tan)).clamp(-0.999_999, 0.999_999);
    }
    erf_inv(x)
}

/// The slope across: visibility does not change it.
fn beckmann_slope_across(u: f32) -> f32 {
    erf_inv(2.0 * u.clamp(1e-6, 1.0 - 1e-6) - 1.0)
}

/// Slope of a visible normal of the GGX distribution with roughness 1, seen from the direction
/// (sin, 0, cos): uniform on the projection of the hemisphere of normals (Heitz 2018).
fn ggx_visible_slope(cos: f32, sin: f32, u: Vec2) -> Vec2 {
    let p = warp::concentric_disk(u);
    // Half of the disk is foreshortened.
    let s = 0.5 * (1.0 + cos);
    let y = (1.0 - s) * (1.0 - p.x * p.x).max(0.0).sqrt() + s * p.y;
    let z = (1.0 - p.x * p.x - y * y).max(0.0).sqrt();
    Vec2::new(cos * y - sin * z, p.x) / (sin * y + cos * z)
}
