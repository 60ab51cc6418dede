//! `plastic`: a diffuse base under a smooth dielectric coat.
//!
//! | parameter | unit | default | |
//! |---|---|---|---|
//! | `int_ior`, `ext_ior` | 1 | polypropylene, air | indices inside and outside the coat |
//! | `diffuse_reflectance` | 1 | 0.5 | colour of the base |
//! | `specular_reflectance` | 1 | 1 | factor on the coat's reflection, for artists |
//! | `nonlinear` | | false | light reflected back to the base is coloured once more each time |
//!
//! Light enters through the coat, is reflected by the base any number of times below it and
//! leaves: with the internal diffuse reflectance R of the coat and the base's reflectance ρ the
//! geometric series gives `ρ/(1 - ρR)` (`nonlinear`) or, where the colour must not shift,
//! `ρ/(1 - R)`.

use std::f32::consts::FRAC_1_PI;

use super::fresnel;
use super::lobe::{LobeEval, LobeSample};
use crate::math::{Vec2, Vec3, warp};
use crate::spectrum::Rgb;

/// What depends on the index of refraction and the mean colours alone.
#[derive(Debug, Clone, Copy)]
pub(super) struct PlasticConstants {
    /// Diffuse Fresnel reflectance from inside.
    pub(super) internal_reflectance: f32,
    /// Cosine-weighted mean transmittance from outside.
    pub(super) mean_transmittance: f32,
    /// How much the specular component is favoured when sampling: its share of the mean colours.
    pub(super) specular_sampling_weight: f32,
}

impl PlasticConstants {
    pub(super) fn new(eta: f32, specular_sampling_weight: f32) -> Self {
        Self {
            internal_reflectance: fresnel::diffuse_reflectance(1.0 / eta),
            mean_transmittance: 1.0 - fresnel::diffuse_reflectance(eta),
            specular_sampling_weight,
        }
    }
}

/// Reflectance of a base under a coat: the series of internal reflections, and the change of
/// radiance where it leaves the coat.
pub(super) fn base_reflectance(diffuse: Rgb, internal: f32, nonlinear: bool, eta: f32) -> Rgb {
    let returned = if nonlinear { diffuse * internal } else { Rgb::splat(internal) };
    diffuse / (Rgb::WHITE - returned) * (1.0 / (eta * eta))
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Plastic {
    pub(super) eta: f32,
    pub(super) constants: PlasticConstants,
    /// As in the scene file.
    pub(super) diffuse_reflectance: Rgb,
    /// See [`base_reflectance`].
    pub(super) base: Rgb,
    pub(super) specular_reflectance: Rgb,
}

impl Plastic {
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> LobeEval {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return LobeEval::ZERO;
        }
        let f_o = fresnel::dielectric(wo.z, self.eta).reflectance;
        let f_i = fresnel::dielectric(wi.z, self.eta).reflectance;
        let cosine_pdf = FRAC_1_PI * wi.z;
        let value = self.base * (cosine_pdf * (1.0 - f_i) * (1.0 - f_o));
        let pdf = cosine_pdf * (1.0 - self.specular_probability(f_o));
        LobeEval { value, diffuse: value, pdf }
    }

    pub(super) fn sample(&self, wo: Vec3, u_component: f32, u: Vec2) -> Option<LobeSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let f_o = fresnel::dielectric(wo.z, self.eta).reflectance;
        let specular = self.specular_probability(f_o);
        if u_component < specular {
            let weight = self.specular_reflectance * (f_o / specular);
            return Some(LobeSample::delta(fresnel::reflect(wo), weight, specular, 1.0));
        }
        let wi = warp::cosine_hemisphere(u);
        LobeSample::smooth(wi, self.eval(wo, wi), 1.0)
    }

    pub(super) fn diffuse_albedo(&self, wo: Vec3) -> Rgb {
        if wo.z <= 0.0 {
            return Rgb::BLACK;
        }
        let f_o = fresnel::dielectric(wo.z, self.eta).reflectance;
        self.base * ((1.0 - f_o) * self.constants.mean_transmittance)
    }

    fn specular_probability(&self, f_o: f32) -> f32 {
        component_probability(f_o, self.constants.specular_sampling_weight)
    }
}

/// Probability of the specular component, for its reflectance `f` at the viewer's angle and its
/// share of the mean colours.
pub(super) fn component_probability(f: f32, specular_weight: f32) -> f32 {
    let specular = f * specular_weight;
    let diffuse = (1.0 - f) * (1.0 - specular_weight);
    if specular + diffuse > 0.0 { specular / (specular + diffuse) } else { 1.0 }
}
