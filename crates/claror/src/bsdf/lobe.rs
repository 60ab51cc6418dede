//! One material model at one point, with its textures already read: the closed set of models and
//! the one place where calls are dispatched over it.
//!
//! Directions are local to the lobe's shading frame (`n` = +z), unit length, away from the
//! surface. The formulas follow Mitsuba 3's plugins in meaning; mind that Mitsuba calls the
//! viewer's direction `wi` and the light's `wo`.

use super::conductor::Conductor;
use super::dielectric::{Dielectric, ThinDielectric};
use super::diffuse::Diffuse;
use super::null;
use super::plastic::Plastic;
use super::principled::PrincipledLobe;
use super::rough_conductor::RoughConductor;
use super::rough_dielectric::RoughDielectric;
use super::rough_plastic::RoughPlastic;
use crate::math::{Vec2, Vec3};
use crate::spectrum::Rgb;

/// What a lobe says about one pair of directions.
#[derive(Debug, Clone, Copy)]
pub(super) struct LobeEval {
    /// Scattering function times `|cos θ|` of the light's direction.
    pub(super) value: Rgb,
    /// The part of `value` that is Lambertian reflection.
    pub(super) diffuse: Rgb,
    /// Density of `sample` by solid angle.
    pub(super) pdf: f32,
}

impl LobeEval {
    /// Nothing is scattered this way.
    pub(super) const ZERO: Self = Self { value: Rgb::BLACK, diffuse: Rgb::BLACK, pdf: 0.0 };
}

/// A direction chosen by a lobe.
#[derive(Debug, Clone, Copy)]
pub(super) struct LobeSample {
    /// Towards the light, local.
    pub(super) wi: Vec3,
    /// Value over density.
    pub(super) weight: Rgb,
    /// The Lambertian part of `weight`.
    pub(super) diffuse_weight: Rgb,
    /// Density by solid angle, or the probability of a delta component.
    pub(super) pdf: f32,
    /// Index of refraction behind the crossed interface over that before it; 1 for reflection.
    pub(super) eta: f32,
    /// Whether `wi` was the only direction of its component.
    pub(super) is_delta: bool,
}

impl LobeSample {
    /// A sample of a smooth component, from `wi` and what the lobe says about it; `None` where
    /// the density is not positive.
    pub(super) fn smooth(wi: Vec3, eval: LobeEval, eta: f32) -> Option<Self> {
        (eval.pdf > 0.0).then(|| Self {
            wi,
            weight: eval.value / eval.pdf,
            diffuse_weight: eval.diffuse / eval.pdf,
            pdf: eval.pdf,
            eta,
            is_delta: false,
        })
    }

    /// A sample of a delta component that was chosen with probability `pdf`.
    pub(super) fn delta(wi: Vec3, weight: Rgb, pdf: f32, eta: f32) -> Self {
        Self { wi, weight, diffuse_weight: Rgb::BLACK, pdf, eta, is_delta: true }
    }
}

/// A material model with its parameters at one point.
#[derive(Debug, Clone, Copy)]
pub(super) enum Lobe<'a> {
    Diffuse(Diffuse),
    Conductor(Conductor),
    RoughConductor(RoughConductor),
    Dielectric(Dielectric),
    ThinDielectric(ThinDielectric),
    RoughDielectric(RoughDielectric),
    Plastic(Plastic),
    RoughPlastic(RoughPlastic<'a>),
    Principled(PrincipledLobe),
    Null,
}

impl Lobe<'_> {
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> LobeEval {
        match self {
            Self::Diffuse(lobe) => lobe.eval(wo, wi),
            Self::RoughConductor(lobe) => lobe.eval(wo, wi),
            Self::RoughDielectric(lobe) => lobe.eval(wo, wi),
            Self::Plastic(lobe) => lobe.eval(wo, wi),
            Self::RoughPlastic(lobe) => lobe.eval(wo, wi),
            Self::Principled(lobe) => lobe.eval(wo, wi),
            Self::Conductor(_) | Self::Dielectric(_) | Self::ThinDielectric(_) | Self::Null => {
                LobeEval::ZERO
            }
        }
    }

    /// `u_component` chooses among the lobe's components, `u` the direction.
    pub(super) fn sample(&self, wo: Vec3, u_component: f32, u: Vec2) -> Option<LobeSample> {
        match self {
            Self::Diffuse(lobe) => lobe.sample(wo, u),
            Self::Conductor(lobe) => lobe.sample(wo),
            Self::RoughConductor(lobe) => lobe.sample(wo, u),
            Self::Dielectric(lobe) => lobe.sample(wo, u_component),
            Self::ThinDielectric(lobe) => lobe.sample(wo, u_component),
            Self::RoughDielectric(lobe) => lobe.sample(wo, u_component, u),
            Self::Plastic(lobe) => lobe.sample(wo, u_component, u),
            Self::RoughPlastic(lobe) => lobe.sample(wo, u_component, u),
            Self::Principled(lobe) => lobe.sample(wo, u_component, u),
            Self::Null => Some(null::sample(wo)),
        }
    }

    /// Whether some component is not a delta function.
    pub(super) fn is_smooth(&self) -> bool {
        !matches!(
            self,
            Self::Conductor(_) | Self::Dielectric(_) | Self::ThinDielectric(_) | Self::Null
        )
    }

    /// Whether a smooth component takes light from the side that the viewer is not on.
    pub(super) fn transmits(&self) -> bool {
        match self {
            Self::RoughDielectric(_) => true,
            Self::Principled(p) => p.spec_trans > 0.0,
            _ => false,
        }
    }

    /// Whether a sample of this lobe that goes to the other side goes straight on as if there
    /// were no surface.
    pub(super) fn is_null_sample(&self, is_transmission: bool) -> bool {
        matches!(self, Self::Null | Self::ThinDielectric(_)) && is_transmission
    }

    /// Directional albedo at `wo` of the diffuse part under uniform illumination.
    pub(super) fn diffuse_albedo(&self, wo: Vec3) -> Rgb {
        match self {
            Self::Diffuse(lobe) => lobe.diffuse_albedo(wo),
            Self::Plastic(lobe) => lobe.diffuse_albedo(wo),
            Self::RoughPlastic(lobe) => lobe.diffuse_albedo(wo),
            _ => Rgb::BLACK,
        }
    }

    /// Leaves what [`Lobe::diffuse_albedo`] does not count. A lobe that is nothing but diffuse
    /// becomes black.
    pub(super) fn remove_diffuse(&mut self) {
        match self {
            Self::Diffuse(lobe) => lobe.reflectance = Rgb::BLACK,
            Self::Plastic(lobe) => {
                lobe.base = Rgb::BLACK;
                lobe.constants.specular_sampling_weight = 1.0;
            }
            Self::RoughPlastic(lobe) => {
                lobe.base = Rgb::BLACK;
                lobe.specular_sampling_weight = 1.0;
            }
            _ => {}
        }
    }

    /// Mitsuba's `eval_diffuse_reflectance`, what its `albedo` layer shows.
    pub(super) fn albedo(&self, wo: Vec3) -> Rgb {
        match self {
            Self::Diffuse(lobe) => lobe.reflectance,
            Self::Plastic(lobe) => lobe.diffuse_reflectance,
            Self::RoughPlastic(lobe) => lobe.diffuse_reflectance,
            Self::Principled(lobe) => lobe.base_color,
            _ => self.eval(wo, Vec3::Z).value * std::f32::consts::PI,
        }
    }
}
