//! `dielectric` and `thindielectric`: smooth interfaces that reflect and transmit.
//!
//! | parameter | unit | default | |
//! |---|---|---|---|
//! | `int_ior`, `ext_ior` | 1 | bk7, air | indices inside (away from the normal) and outside |
//! | `specular_reflectance`, `specular_transmittance` | 1 | 1 | factors, for artists |
//!
//! Which of the two happens is chosen by the Fresnel reflectance, so that the weight of a sample
//! is the artists' factor alone. Radiance that crosses an interface changes by the square of the
//! index ratio (Veach 1997, §5.2).

use super::fresnel;
use super::lobe::LobeSample;
use crate::math::Vec3;
use crate::spectrum::Rgb;

#[derive(Debug, Clone, Copy)]
pub(super) struct Dielectric {
    pub(super) eta: f32,
    pub(super) specular_reflectance: Rgb,
    pub(super) specular_transmittance: Rgb,
}

impl Dielectric {
    pub(super) fn sample(&self, wo: Vec3, u_component: f32) -> Option<LobeSample> {
        let f = fresnel::dielectric(wo.z, self.eta);
        Some(if u_component < f.reflectance {
            let wi = fresnel::reflect(wo);
            LobeSample::delta(wi, self.specular_reflectance, f.reflectance, 1.0)
        } else {
            let weight = self.specular_transmittance * (f.eta_ti * f.eta_ti);
            LobeSample::delta(fresnel::refract(wo, &f), weight, 1.0 - f.reflectance, f.eta_it)
        })
    }
}

/// A slab so thin that light leaves where it entered: all orders of internal reflection summed.
#[derive(Debug, Clone, Copy)]
pub(super) struct ThinDielectric {
    pub(super) eta: f32,
    pub(super) specular_reflectance: Rgb,
    pub(super) specular_transmittance: Rgb,
}

impl ThinDielectric {
    pub(super) fn sample(&self, wo: Vec3, u_component: f32) -> Option<LobeSample> {
        let r = fresnel::dielectric(wo.z.abs(), self.eta).reflectance;
        // r + t·r·t + t·r³·t + … = 2r/(1 + r) with t = 1 - r.
        let r = if r < 1.0 { r * 2.0 / (1.0 + r) } else { 1.0 };
        Some(if u_component < r {
            LobeSample::delta(fresnel::reflect(wo), self.specular_reflectance, r, 1.0)
        } else {
            LobeSample::delta(-wo, self.specular_transmittance, 1.0 - r, 1.0)
        })
    }
}
