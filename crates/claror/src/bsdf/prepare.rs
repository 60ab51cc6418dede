//! Checks of a table of materials, and what is computed once before rendering.

use rayon::prelude::*;

use super::at_hit::{MAX_GUARDS, MAX_LOBES};
use super::plastic::PlasticConstants;
use super::rough_plastic::RoughTransmittance;
use super::{Bsdf, BsdfId, BsdfTable};
use crate::interaction::Detail;
use crate::shape::ShapeTable;
use crate::spectrum::Rgb;
use crate::texture::{Texture, TextureId, TextureTable};

/// Why a table of materials cannot be rendered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum BsdfError {
    /// A material refers to one that does not exist, or that does not come before it.
    #[error("material {} holds material {}, which does not come before it", .bsdf.0, .nested.0)]
    NestedOutOfOrder {
        /// The outer material.
        bsdf: BsdfId,
        /// What it refers to.
        nested: BsdfId,
    },
    /// A material refers to a texture that does not exist.
    #[error("material {} uses texture {}, which does not exist", .bsdf.0, .texture.0)]
    MissingTexture {
        /// The material.
        bsdf: BsdfId,
        /// What it refers to.
        texture: TextureId,
    },
    /// Too many models are blended in one material.
    #[error("material {} blends {lobes} models; at most {MAX_LOBES} are supported", .bsdf.0)]
    TooManyLobes {
        /// The material.
        bsdf: BsdfId,
        /// Models in it.
        lobes: usize,
    },
    /// Too many bump and normal maps in one material.
    #[error("material {} holds {maps} bump and normal maps; at most {MAX_GUARDS} are supported", .bsdf.0)]
    TooManyMaps {
        /// The material.
        bsdf: BsdfId,
        /// Maps in it.
        maps: usize,
    },
    /// `roughdielectric` between equal indices of refraction, where no half vector exists.
    #[error("material {} needs different indices of refraction inside and outside", .bsdf.0)]
    EqualIndices {
        /// The material.
        bsdf: BsdfId,
    },
    /// `twosided` around something that lets light through.
    #[error("material {} is twosided, but what it holds lets light through", .bsdf.0)]
    TransmissiveTwoSided {
        /// The material.
        bsdf: BsdfId,
    },
}

/// What is computed ahead for one material.
#[derive(Debug, Clone)]
pub(super) enum Prepared {
    /// Nothing.
    None,
    /// For `plastic`.
    Plastic(PlasticConstants),
    /// For `roughplastic`: the coat, and the weight of the specular component when sampling.
    RoughPlastic(Box<RoughTransmittance>, f32),
}

/// The reflectances of a `diffuse`, or of a `twosided` that holds nothing else.
#[derive(Debug, Clone, Copy)]
pub(super) struct DiffuseSides {
    pub(super) front: TextureId,
    /// `None`: black from behind.
    pub(super) back: Option<TextureId>,
}

/// What a material asks of the surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Traits {
    /// Set for the simplest materials.
    diffuse: Option<DiffuseSides>,
    detail: Detail,
}

/// What is known about a material and all that is nested in it.
#[derive(Clone, Copy)]
struct Extent {
    lobes: usize,
    /// Bump and normal maps.
    maps: usize,
    transmissive: bool,
}

impl Extent {
    const OPAQUE: Self = Self { lobes: 1, maps: 0, transmissive: false };
    const TRANSMISSIVE: Self = Self { transmissive: true, ..Self::OPAQUE };

    /// Both at once.
    fn with(self, other: Self) -> Self {
        Self {
            lobes: self.lobes + other.lobes,
            maps: self.maps + other.maps,
            transmissive: self.transmissive || other.transmissive,
        }
    }

    /// One or the other.
    fn or(self, other: Self) -> Self {
        Self {
            lobes: self.lobes.max(other.lobes),
            maps: self.maps.max(other.maps),
            transmissive: self.transmissive || other.transmissive,
        }
    }
}

impl BsdfTable {
    /// Checks the table, then computes what its models need ahead. To be called once before
    /// [`BsdfTable::at_hit`], and again when a material or its textures change.
    pub fn prepare(
        &mut self,
        textures: &TextureTable,
        shapes: &ShapeTable,
    ) -> Result<(), BsdfError> {
        self.validate(textures)?;
        self.prepared = self.bsdfs.par_iter().map(|b| prepare(b, textures, shapes)).collect();
        self.traits = Vec::with_capacity(self.bsdfs.len());
        for bsdf in &self.bsdfs {
            let detail = detail(bsdf, textures, &self.traits);
            self.traits.push(Traits { diffuse: diffuse_sides(bsdf, &self.bsdfs), detail });
        }
        Ok(())
    }

    /// What the material must be told about the surface; everything before
    /// [`BsdfTable::prepare`].
    pub fn detail(&self, id: BsdfId) -> Detail {
        self.traits.get(id.0 as usize).map_or(Detail::Derivatives, |t| t.detail)
    }

    /// The reflectances, where the material is nothing but Lambertian.
    #[inline]
    pub(super) fn diffuse_sides(&self, id: BsdfId) -> Option<DiffuseSides> {
        self.traits.get(id.0 as usize)?.diffuse
    }

    /// What was prepared for the `plastic` with this id.
    pub(super) fn plastic_constants(&self, id: BsdfId) -> &PlasticConstants {
        match self.prepared.get(id.0 as usize) {
            Some(Prepared::Plastic(constants)) => constants,
            _ => panic!("BsdfTable::prepare must run before a plastic is used"),
        }
    }

    /// What was prepared for the `roughplastic` with this id.
    pub(super) fn rough_transmittance(&self, id: BsdfId) -> (&RoughTransmittance, f32) {
        match self.prepared.get(id.0 as usize) {
            Some(Prepared::RoughPlastic(transmittance, weight)) => (transmittance, *weight),
            _ => panic!("BsdfTable::prepare must run before a rough plastic is used"),
        }
    }

    /// Checks that all references hold, and that every material fits into a [`super::BsdfAtHit`].
    pub fn validate(&self, textures: &TextureTable) -> Result<(), BsdfError> {
        let mut extents: Vec<Extent> = Vec::with_capacity(self.bsdfs.len());
        for (i, bsdf) in self.bsdfs.iter().enumerate() {
            let id = BsdfId(i as u32);
            for texture in bsdf.textures() {
                if texture.0 as usize >= textures.textures.len() {
                    return Err(BsdfError::MissingTexture { bsdf: id, texture });
                }
            }
            let extent = extent(id, bsdf, textures, &extents)?;
            if extent.lobes > MAX_LOBES {
                return Err(BsdfError::TooManyLobes { bsdf: id, lobes: extent.lobes });
            }
            if extent.maps > MAX_GUARDS {
                return Err(BsdfError::TooManyMaps { bsdf: id, maps: extent.maps });
            }
            extents.push(extent);
        }
        Ok(())
    }
}

fn diffuse_sides(bsdf: &Bsdf, all: &[Bsdf]) -> Option<DiffuseSides> {
    let reflectance = |bsdf: &Bsdf| match bsdf {
        Bsdf::Diffuse { reflectance } => Some(*reflectance),
        _ => None,
    };
    match bsdf {
        Bsdf::TwoSided { front, back } => Some(DiffuseSides {
            front: reflectance(&all[front.0 as usize])?,
            back: Some(reflectance(&all[back.0 as usize])?),
        }),
        _ => Some(DiffuseSides { front: reflectance(bsdf)?, back: None }),
    }
}

/// What `bsdf` must be told about the surface, given the traits of all before it.
fn detail(bsdf: &Bsdf, textures: &TextureTable, before: &[Traits]) -> Detail {
    let nested = |id: &BsdfId| before[id.0 as usize].detail;
    let constant = |id: TextureId| textures.constant(id);
    let is_textured = bsdf.textures().into_iter().any(|id| constant(id).is_none());
    let own = if is_textured { Detail::Uv } else { Detail::Point };
    let anisotropic = |is_isotropic: bool| if is_isotropic { own } else { Detail::Derivatives };
    match bsdf {
        Bsdf::TwoSided { front, back } => nested(front).max(nested(back)),
        Bsdf::Mask { nested: inner, .. } => own.max(nested(inner)),
        Bsdf::Blend { first, second, .. } => own.max(nested(first)).max(nested(second)),
        Bsdf::BumpMap { .. } | Bsdf::NormalMap { .. } => Detail::Derivatives,
        Bsdf::RoughConductor { alpha_u, alpha_v, .. }
        | Bsdf::RoughDielectric { alpha_u, alpha_v, .. } => anisotropic(
            alpha_u == alpha_v
                || (constant(*alpha_u).is_some() && constant(*alpha_u) == constant(*alpha_v)),
        ),
        Bsdf::Principled(p) => anisotropic(constant(p.anisotropic).is_some_and(Rgb::is_black)),
        _ => own,
    }
}

fn prepare(bsdf: &Bsdf, textures: &TextureTable, shapes: &ShapeTable) -> Prepared {
    let weight = |diffuse: TextureId, specular: TextureId| {
        let d = textures.mean(shapes, diffuse).mean();
        let s = textures.mean(shapes, specular).mean();
        if d + s > 0.0 { s / (d + s) } else { 0.5 }
    };
    match bsdf {
        Bsdf::Plastic { eta, diffuse_reflectance, specular_reflectance, .. } => {
            let weight = weight(*diffuse_reflectance, *specular_reflectance);
            Prepared::Plastic(PlasticConstants::new(*eta, weight))
        }
        Bsdf::RoughPlastic {
            distribution,
            alpha,
            eta,
            diffuse_reflectance,
            specular_reflectance,
            ..
        } => {
            let transmittance = RoughTransmittance::new(*distribution, *alpha, *eta);
            let weight = weight(*diffuse_reflectance, *specular_reflectance);
            Prepared::RoughPlastic(Box::new(transmittance), weight)
        }
        _ => Prepared::None,
    }
}

/// The extent of `bsdf`, given those of all before it.
fn extent(
    id: BsdfId,
    bsdf: &Bsdf,
    textures: &TextureTable,
    before: &[Extent],
) -> Result<Extent, BsdfError> {
    let nested = |nested: BsdfId| {
        let found = before.get(nested.0 as usize).copied();
        found.ok_or(BsdfError::NestedOutOfOrder { bsdf: id, nested })
    };
    Ok(match bsdf {
        Bsdf::TwoSided { front, back } => {
            let extent = nested(*front)?.or(nested(*back)?);
            if extent.transmissive {
                return Err(BsdfError::TransmissiveTwoSided { bsdf: id });
            }
            extent
        }
        Bsdf::Mask { nested: inner, .. } => nested(*inner)?.with(Extent::TRANSMISSIVE),
        Bsdf::Blend { first, second, .. } => nested(*first)?.with(nested(*second)?),
        Bsdf::BumpMap { nested: inner, .. } | Bsdf::NormalMap { nested: inner, .. } => {
            let inner = nested(*inner)?;
            Extent { maps: inner.maps + 1, ..inner }
        }
        Bsdf::RoughDielectric { eta: 1.0, .. } => {
            return Err(BsdfError::EqualIndices { bsdf: id });
        }
        Bsdf::Dielectric { .. }
        | Bsdf::ThinDielectric { .. }
        | Bsdf::RoughDielectric { .. }
        | Bsdf::Null => Extent::TRANSMISSIVE,
        Bsdf::Principled(p) => match textures.textures[p.spec_trans.0 as usize] {
            Texture::Constant(c) if c.is_black() => Extent::OPAQUE,
            _ => Extent::TRANSMISSIVE,
        },
        Bsdf::Diffuse { .. }
        | Bsdf::Conductor { .. }
        | Bsdf::RoughConductor { .. }
        | Bsdf::Plastic { .. }
        | Bsdf::RoughPlastic { .. } => Extent::OPAQUE,
    })
}

impl Bsdf {
    /// The textures that the material itself reads, those of nested materials left out.
    pub fn textures(&self) -> Vec<TextureId> {
        match self {
            Self::Diffuse { reflectance } => vec![*reflectance],
            Self::Conductor { eta, k, specular_reflectance } => {
                vec![*eta, *k, *specular_reflectance]
            }
            Self::RoughConductor { alpha_u, alpha_v, eta, k, specular_reflectance, .. } => {
                vec![*alpha_u, *alpha_v, *eta, *k, *specular_reflectance]
            }
            Self::Dielectric { specular_reflectance, specular_transmittance, .. }
            | Self::ThinDielectric { specular_reflectance, specular_transmittance, .. } => {
                vec![*specular_reflectance, *specular_transmittance]
            }
            Self::RoughDielectric {
                alpha_u,
                alpha_v,
                specular_reflectance,
                specular_transmittance,
                ..
            } => vec![*alpha_u, *alpha_v, *specular_reflectance, *specular_transmittance],
            Self::Plastic { diffuse_reflectance, specular_reflectance, .. }
            | Self::RoughPlastic { diffuse_reflectance, specular_reflectance, .. } => {
                vec![*diffuse_reflectance, *specular_reflectance]
            }
            Self::Principled(p) => vec![
                p.base_color,
                p.roughness,
                p.anisotropic,
                p.metallic,
                p.spec_trans,
                p.spec_tint,
                p.sheen,
                p.sheen_tint,
                p.flatness,
                p.clearcoat,
                p.clearcoat_gloss,
            ],
            Self::Mask { opacity, .. } => vec![*opacity],
            Self::Blend { weight, .. } => vec![*weight],
            Self::BumpMap { displacement, .. } => vec![*displacement],
            Self::NormalMap { normal, .. } => vec![*normal],
            Self::TwoSided { .. } | Self::Null => Vec::new(),
        }
    }
}
