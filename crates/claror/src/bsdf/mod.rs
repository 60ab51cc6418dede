//! Materials: bidirectional scattering distribution functions.
//!
//! [`Bsdf`] holds a material's parameters as textures. At a hit it is read once into a
//! [`BsdfAtHit`], a short list of weighted lobes without textures, which then is evaluated and
//! sampled. One file per model; `lobe` dispatches over them, `read` makes the lobes.

mod at_hit;
mod conductor;
mod dielectric;
mod diffuse;
mod fresnel;
mod ior;
mod lobe;
mod metals;
mod microfacet;
mod null;
mod perturb;
mod plastic;
mod prepare;
mod principled;
mod read;
mod rough_conductor;
mod rough_dielectric;
mod rough_plastic;
#[cfg(test)]
mod tests;

pub use at_hit::{BsdfAtHit, BsdfEval, BsdfSample, MAX_LOBES};
pub use ior::{ior_names, named_ior};
pub use metals::{metal, metal_names};
pub use prepare::BsdfError;

use crate::texture::TextureId;

/// Index of a [`Bsdf`] in a [`BsdfTable`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(transparent)]
pub struct BsdfId(pub u32);

/// Microfacet normal distribution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MicrofacetKind {
    /// Beckmann and Spizzichino 1963 (Mitsuba's default).
    #[default]
    Beckmann,
    /// Trowbridge and Reitz 1975; Walter et al. 2007.
    Ggx,
}

/// A material's parameters, with the meaning of the Mitsuba 3 plugin of the same name. `eta` is
/// the interior over the exterior index of refraction; roughness `alpha` is the root mean square
/// slope of the microfacets (Beckmann) or its GGX counterpart.
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "the fields are the parameters of the plugin of the same name")]
pub enum Bsdf {
    Diffuse {
        reflectance: TextureId,
    },
    /// Smooth metal; `eta` and `k` are the real and imaginary index per channel. Mitsuba's
    /// material `none` (a perfect mirror) is `eta = 0`, `k = 1`.
    Conductor {
        eta: TextureId,
        k: TextureId,
        specular_reflectance: TextureId,
    },
    RoughConductor {
        distribution: MicrofacetKind,
        sample_visible: bool,
        alpha_u: TextureId,
        alpha_v: TextureId,
        eta: TextureId,
        k: TextureId,
        specular_reflectance: TextureId,
    },
    Dielectric {
        eta: f32,
        specular_reflectance: TextureId,
        specular_transmittance: TextureId,
    },
    ThinDielectric {
        eta: f32,
        specular_reflectance: TextureId,
        specular_transmittance: TextureId,
    },
    RoughDielectric {
        distribution: MicrofacetKind,
        sample_visible: bool,
        alpha_u: TextureId,
        alpha_v: TextureId,
        eta: f32,
        specular_reflectance: TextureId,
        specular_transmittance: TextureId,
    },
    Plastic {
        eta: f32,
        diffuse_reflectance: TextureId,
        specular_reflectance: TextureId,
        nonlinear: bool,
    },
    RoughPlastic {
        distribution: MicrofacetKind,
        sample_visible: bool,
        alpha: f32,
        eta: f32,
        diffuse_reflectance: TextureId,
        specular_reflectance: TextureId,
        nonlinear: bool,
    },
    Principled(Box<Principled>),
    /// `front` seen from the side of the shading normal, `back` from the other.
    TwoSided {
        front: BsdfId,
        back: BsdfId,
    },
    /// `nested` with probability `opacity`, nothing otherwise.
    Mask {
        opacity: TextureId,
        nested: BsdfId,
    },
    /// `weight` is the share of the second.
    Blend {
        weight: TextureId,
        first: BsdfId,
        second: BsdfId,
    },
    BumpMap {
        displacement: TextureId,
        scale: f32,
        nested: BsdfId,
        options: PerturbationOptions,
    },
    NormalMap {
        normal: TextureId,
        nested: BsdfId,
        options: PerturbationOptions,
    },
    /// Lets light through unchanged.
    Null,
}

/// What bump and normal maps do about directions that are above one of the two normals and below
/// the other. Mitsuba's defaults: both on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PerturbationOptions {
    /// A normal that turns away from the viewer is mirrored around the unperturbed one.
    pub flip_invalid_normals: bool,
    /// Light fades out towards the horizon of the unperturbed surface.
    pub use_shadowing_function: bool,
}

impl Default for PerturbationOptions {
    fn default() -> Self {
        Self { flip_invalid_normals: true, use_shadowing_function: true }
    }
}

/// Parameters of Mitsuba 3's `principled` (after Burley 2012 and 2015).
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "the fields are the parameters of the plugin of the same name")]
pub struct Principled {
    pub base_color: TextureId,
    pub roughness: TextureId,
    pub anisotropic: TextureId,
    pub metallic: TextureId,
    pub spec_trans: TextureId,
    pub spec_tint: TextureId,
    pub sheen: TextureId,
    pub sheen_tint: TextureId,
    pub flatness: TextureId,
    pub clearcoat: TextureId,
    pub clearcoat_gloss: TextureId,
    /// Interior over exterior index of refraction (Mitsuba's `eta`, or derived from `specular`).
    pub eta: f32,
    pub diffuse_reflectance_sampling_rate: f32,
    pub main_specular_sampling_rate: f32,
    pub clearcoat_sampling_rate: f32,
}

/// All materials of a scene.
#[derive(Debug, Clone, Default)]
pub struct BsdfTable {
    /// Materials, by [`BsdfId`]. Nested materials have smaller ids than what holds them.
    pub bsdfs: Vec<Bsdf>,
    /// What [`BsdfTable::prepare`] computes ahead, by [`BsdfId`].
    prepared: Vec<prepare::Prepared>,
    /// Likewise.
    traits: Vec<prepare::Traits>,
}

impl BsdfTable {
    /// A table of these materials, still to be [prepared](BsdfTable::prepare).
    pub fn new(bsdfs: Vec<Bsdf>) -> Self {
        Self { bsdfs, ..Self::default() }
    }
}
