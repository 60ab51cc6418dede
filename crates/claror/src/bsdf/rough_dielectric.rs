//! `roughdielectric`: a rough interface between two dielectrics, such as ground glass
//! (Walter et al. 2007).
//!
//! | parameter | unit | default | |
//! |---|---|---|---|
//! | `int_ior`, `ext_ior` | 1 | bk7, air | indices inside (away from the normal) and outside |
//! | `distribution` | | beckmann | `beckmann` or `ggx` |
//! | `alpha`, or `alpha_u` and `alpha_v` | 1 | 0.1 | root mean square slope of the facets |
//! | `sample_visible` | | true | sample only normals that the viewer sees |
//! | `specular_reflectance`, `specular_transmittance` | 1 | 1 | factors, for artists |

use super::fresnel;
use super::lobe::{LobeEval, LobeSample};
use super::microfacet::Microfacets;
use crate::math::{Vec2, Vec3};
use crate::spectrum::Rgb;

#[derive(Debug, Clone, Copy)]
pub(super) struct RoughDielectric {
    pub(super) facets: Microfacets,
    pub(super) eta: f32,
    pub(super) specular_reflectance: Rgb,
    pub(super) specular_transmittance: Rgb,
}

impl RoughDielectric {
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> LobeEval {
        let side = wo.z * wi.z;
        if side == 0.0 {
            return LobeEval::ZERO;
        }
        let is_reflection = side > 0.0;
        // Index of the far side over that of the viewer's side.
        let eta = if wo.z > 0.0 { self.eta } else { 1.0 / self.eta };
        // Half vector, turned outwards (Walter et al. 2007, eq. 13 and 16).
        let m = wo + wi * if is_reflection { 1.0 } else { eta };
        let m = m.normalize_or_zero() * 1.0_f32.copysign(m.z);
        let (cos_o, cos_i) = (wo.dot(m), wi.dot(m));
        if cos_o * wo.z <= 0.0 || cos_i * wi.z <= 0.0 {
            return LobeEval::ZERO;
        }
        let f = fresnel::dielectric(cos_o, self.eta).reflectance;
        let shape = self.facets.d(m) * self.facets.g1(wo, m) * self.facets.g1(wi, m);
        let facets = self.sampled_facets(wo);
        let outer = if wo.z > 0.0 { wo } else { -wo };
        let normal_pdf = facets.pdf(outer, m, facets.d(m));
        let (value, pdf) = if is_reflection {
            let value = self.specular_reflectance * (f * shape / (4.0 * wo.z.abs()));
            (value, f * normal_pdf / (4.0 * cos_i.abs()))
        } else {
            let jacobian = refraction_jacobian(cos_o, cos_i, eta);
            // Radiance is squeezed into a smaller cone in the denser medium.
            let scale = (1.0 - f) * shape * (cos_o / wo.z).abs() * jacobian / (eta * eta);
            (self.specular_transmittance * scale, (1.0 - f) * normal_pdf * jacobian)
        };
        LobeEval { value, diffuse: Rgb::BLACK, pdf }
    }

    pub(super) fn sample(&self, wo: Vec3, u_component: f32, u: Vec2) -> Option<LobeSample> {
        if wo.z == 0.0 {
            return None;
        }
        let outer = if wo.z > 0.0 { wo } else { -wo };
        let m = self.sampled_facets(wo).sample(outer, u);
        if wo.dot(m) * wo.z <= 0.0 {
            // The back of a facet, which only the sampling of all normals finds.
            return None;
        }
        let f = fresnel::dielectric(wo.dot(m), self.eta);
        let (wi, eta, is_reflection) = if u_component < f.reflectance {
            (fresnel::reflect_at(wo, m), 1.0, true)
        } else {
            (fresnel::refract_at(wo, m, &f), f.eta_it, false)
        };
        // A reflection must not end below, a refraction not above.
        if (wi.z * wo.z > 0.0) != is_reflection {
            return None;
        }
        LobeSample::smooth(wi, self.eval(wo, wi), eta)
    }

    /// The distribution that normals are drawn from. When all normals are, it is widened so that
    /// weights stay bounded (Walter et al. 2007, §5.3).
    fn sampled_facets(&self, wo: Vec3) -> Microfacets {
        if self.facets.sample_visible {
            self.facets
        } else {
            self.facets.scaled(1.2 - 0.2 * wo.z.abs().sqrt())
        }
    }
}

/// Solid angle of normals per solid angle of refracted directions (Walter et al. 2007, eq. 17),
/// for the signed cosines at the facet and the index ratio `eta`.
pub(super) fn refraction_jacobian(cos_o: f32, cos_i: f32, eta: f32) -> f32 {
    let denominator = cos_o + eta * cos_i;
    (eta * eta * cos_i / (denominator * denominator)).abs()
}
