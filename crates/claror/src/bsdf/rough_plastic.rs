//! `roughplastic`: a diffuse base under a rough dielectric coat.
//!
//! | parameter | unit | default | |
//! |---|---|---|---|
//! | `distribution` | | beckmann | `beckmann` or `ggx` |
//! | `alpha` | 1 | 0.1 | root mean square slope of the facets |
//! | `int_ior`, `ext_ior` | 1 | polypropylene, air | indices inside and outside the coat |
//! | `diffuse_reflectance` | 1 | 0.5 | colour of the base |
//! | `specular_reflectance` | 1 | 1 | factor on the coat's reflection, for artists |
//! | `nonlinear` | | false | light reflected back to the base is coloured once more each time |
//! | `sample_visible` | | true | sample only normals that the viewer sees |
//!
//! As `plastic`, with the transmittance of the rough coat from a table by angle.

use std::f32::consts::FRAC_1_PI;

use super::MicrofacetKind;
use super::fresnel;
use super::lobe::{LobeEval, LobeSample};
use super::microfacet::Microfacets;
use super::plastic::component_probability;
use super::rough_conductor::reflection;
use crate::math::statistics::gauss_legendre;
use crate::math::{Vec2, Vec3, warp};
use crate::spectrum::Rgb;

/// Angles at which the transmittance is tabulated, equidistant in the cosine. Mitsuba's number:
/// its picture includes the error of the interpolation.
const RESOLUTION: usize = 64;

/// Transmittance of a rough dielectric coat.
#[derive(Debug, Clone)]
pub(super) struct RoughTransmittance {
    /// From outside, at the cosines `i/(RESOLUTION - 1)`.
    external: [f32; RESOLUTION],
    /// Diffuse reflectance from inside.
    pub(super) internal_reflectance: f32,
    /// Cosine-weighted mean of `external`.
    pub(super) mean: f32,
}

impl RoughTransmittance {
    pub(super) fn new(kind: MicrofacetKind, alpha: f32, eta: f32) -> Self {
        let facets = Microfacets::new(kind, true, alpha, alpha);
        let cosine = |i: usize| (i as f32 / (RESOLUTION - 1) as f32).max(1e-6);
        let outside = quadrature(32);
        let inside = quadrature(128);
        let mut external = [0.0; RESOLUTION];
        let (mut internal, mut mean) = (0.0, 0.0);
        for (i, value) in external.iter_mut().enumerate() {
            let cos = cosine(i);
            let w = Vec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
            *value = transmittance(&facets, w, eta, &outside);
            internal += reflectance(&facets, w, 1.0 / eta, &inside) * cos;
            mean += *value * cos;
        }
        // The mean over equidistant cosines of 2·cos·R is Mitsuba's quadrature.
        let scale = 2.0 / RESOLUTION as f32;
        Self { external, internal_reflectance: internal * scale, mean: mean * scale }
    }

    /// Transmittance from outside at the cosine `cos ∈ [0, 1]`, linearly interpolated.
    pub(super) fn external(&self, cos: f32) -> f32 {
        let x = cos * (RESOLUTION - 1) as f32;
        let i = (x as usize).min(RESOLUTION - 2);
        let t = x - i as f32;
        (1.0 - t) * self.external[i] + t * self.external[i + 1]
    }
}

/// Nodes and weights of Gauss-Legendre quadrature on [0, 1].
fn quadrature(n: usize) -> Vec<(f32, f32)> {
    let on_unit = |&(x, w): &(f64, f64)| ((0.5 * x + 0.5) as f32, (0.5 * w) as f32);
    gauss_legendre(n).iter().map(on_unit).collect()
}

/// Share of the light from `w` that a rough interface reflects and does not shadow.
fn reflectance(facets: &Microfacets, w: Vec3, eta: f32, nodes: &[(f32, f32)]) -> f32 {
    facets.integrate_visible(w, nodes, |m| {
        let wi = fresnel::reflect_at(w, m);
        let f = fresnel::dielectric(w.dot(m), eta).reflectance;
        if wi.z > 0.0 { facets.g1(wi, m) * f } else { 0.0 }
    })
}

/// Share of the light from `w` that a rough interface refracts and does not shadow.
fn transmittance(facets: &Microfacets, w: Vec3, eta: f32, nodes: &[(f32, f32)]) -> f32 {
    facets.integrate_visible(w, nodes, |m| {
        let f = fresnel::dielectric(w.dot(m), eta);
        let wi = fresnel::refract_at(w, m, &f);
        if wi.z < 0.0 { facets.g1(wi, m) * (1.0 - f.reflectance) } else { 0.0 }
    })
}

#[derive(Debug, Clone, Copy)]
pub(super) struct RoughPlastic<'a> {
    pub(super) facets: Microfacets,
    pub(super) eta: f32,
    /// As in the scene file.
    pub(super) diffuse_reflectance: Rgb,
    /// See [`super::plastic::base_reflectance`].
    pub(super) base: Rgb,
    pub(super) specular_reflectance: Rgb,
    pub(super) specular_sampling_weight: f32,
    pub(super) transmittance: &'a RoughTransmittance,
}

impl RoughPlastic<'_> {
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> LobeEval {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return LobeEval::ZERO;
        }
        let m = (wo + wi).normalize();
        let (shape, facet_pdf) = reflection(&self.facets, wo, wi, m);
        let f = fresnel::dielectric(wo.dot(m), self.eta).reflectance;
        let t_o = self.transmittance.external(wo.z);
        let t_i = self.transmittance.external(wi.z);
        let cosine_pdf = FRAC_1_PI * wi.z;
        let diffuse = self.base * (cosine_pdf * t_o * t_i);
        let specular = self.specular_probability(t_o);
        LobeEval {
            value: self.specular_reflectance * (f * shape) + diffuse,
            diffuse,
            pdf: specular * facet_pdf + (1.0 - specular) * cosine_pdf,
        }
    }

    pub(super) fn sample(&self, wo: Vec3, u_component: f32, u: Vec2) -> Option<LobeSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let t_o = self.transmittance.external(wo.z);
        let wi = if u_component < self.specular_probability(t_o) {
            fresnel::reflect_at(wo, self.facets.sample(wo, u))
        } else {
            warp::cosine_hemisphere(u)
        };
        LobeSample::smooth(wi, self.eval(wo, wi), 1.0)
    }

    pub(super) fn diffuse_albedo(&self, wo: Vec3) -> Rgb {
        if wo.z <= 0.0 {
            return Rgb::BLACK;
        }
        self.base * (self.transmittance.external(wo.z) * self.transmittance.mean)
    }

    fn specular_probability(&self, t_o: f32) -> f32 {
        component_probability(1.0 - t_o, self.specular_sampling_weight)
    }
}
