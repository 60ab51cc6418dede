//! `roughconductor`: a metal of microscopic mirrors (Cook and Torrance 1982, Walter et al. 2007).
//!
//! | parameter | unit | default | |
//! |---|---|---|---|
//! | `distribution` | | beckmann | `beckmann` or `ggx` |
//! | `alpha`, or `alpha_u` and `alpha_v` | 1 | 0.1 | root mean square slope of the facets |
//! | `eta`, `k` | 1 | 0, 1 | complex index of refraction; 0, 1 is a perfect mirror |
//! | `sample_visible` | | true | sample only normals that the viewer sees |
//! | `specular_reflectance` | 1 | 1 | factor, for artists |
//!
//! Light that the facets reflect to other facets is lost: rough metals are too dark
//! (15 % for α = 0.6), as in Mitsuba.

use super::fresnel;
use super::lobe::{LobeEval, LobeSample};
use super::microfacet::Microfacets;
use crate::math::{Vec2, Vec3};
use crate::spectrum::Rgb;

#[derive(Debug, Clone, Copy)]
pub(super) struct RoughConductor {
    pub(super) facets: Microfacets,
    pub(super) eta: Rgb,
    pub(super) k: Rgb,
    pub(super) specular_reflectance: Rgb,
}

impl RoughConductor {
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> LobeEval {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return LobeEval::ZERO;
        }
        let m = (wo + wi).normalize();
        let (shape, pdf) = reflection(&self.facets, wo, wi, m);
        let f = fresnel::conductor(wo.dot(m), self.eta, self.k);
        LobeEval { value: f * self.specular_reflectance * shape, diffuse: Rgb::BLACK, pdf }
    }

    pub(super) fn sample(&self, wo: Vec3, u: Vec2) -> Option<LobeSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let wi = fresnel::reflect_at(wo, self.facets.sample(wo, u));
        LobeSample::smooth(wi, self.eval(wo, wi), 1.0)
    }
}

/// Reflection by facets with the normal `m` half way between `wo` and `wi`, all above the
/// surface, without the Fresnel factor: `D·G/(4 cos θo)` (the cosine of `wi` is included, Walter
/// et al. 2007, eq. 20), and the density of sampling `wi` through `m` (their eq. 14).
pub(super) fn reflection(facets: &Microfacets, wo: Vec3, wi: Vec3, m: Vec3) -> (f32, f32) {
    let d = facets.d(m);
    let g1_o = facets.g1(wo, m);
    let visible = d * g1_o / (4.0 * wo.z);
    let pdf = if facets.sample_visible { visible } else { d * m.z / (4.0 * wi.dot(m)) };
    (visible * facets.g1(wi, m), pdf)
}
