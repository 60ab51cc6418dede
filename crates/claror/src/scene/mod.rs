//! The scene: flat, index-linked tables, and what is derived from them for rendering.

#[cfg(test)]
pub(crate) mod test_scene;

use crate::accel::{Accel, AccelError};
use crate::bsdf::{BsdfError, BsdfTable};
use crate::emitter::{EmitterTable, LightError, LightSampler};
use crate::integrator::{Aov, IntegratorSettings};
use crate::interaction::SurfaceInteraction;
use crate::math::Ray;
use crate::sensor::Sensor;
use crate::shape::ShapeTable;
use crate::texture::TextureTable;

/// Everything a scene file says, as flat tables; nothing derived from it.
#[derive(Debug, Clone, Default)]
pub struct SceneTables {
    /// Geometry.
    pub shapes: ShapeTable,
    /// Materials.
    pub bsdfs: BsdfTable,
    /// Textures and pictures.
    pub textures: TextureTable,
    /// Light sources.
    pub emitters: EmitterTable,
    /// Cameras; the first is the default.
    pub sensors: Vec<Sensor>,
    /// How light is computed.
    pub integrator: IntegratorSettings,
    /// Further layers of the picture.
    pub aovs: Vec<Aov>,
}

/// A scene ready to be rendered.
#[derive(Debug)]
pub struct Scene {
    /// What the scene file says.
    pub tables: SceneTables,
    /// Bounding volume hierarchy over the shapes.
    pub accel: Accel,
    /// Choice and sampling of the light sources.
    pub lights: LightSampler,
}

/// Why a scene cannot be rendered.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// The geometry is not usable.
    #[error(transparent)]
    Accel(#[from] AccelError),
    /// A material is not usable.
    #[error(transparent)]
    Bsdf(#[from] BsdfError),
    /// A light source is not usable.
    #[error(transparent)]
    Light(#[from] LightError),
}

impl Scene {
    /// Derives what rendering needs, in parallel on the current rayon pool.
    pub fn build(mut tables: SceneTables) -> Result<Self, SceneError> {
        tables.bsdfs.prepare(&tables.textures, &tables.shapes)?;
        let accel = Accel::build(&tables.shapes)?;
        let lights = LightSampler::build(&tables)?;
        Ok(Self { tables, accel, lights })
    }

    /// The first surface along the ray.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<SurfaceInteraction> {
        let hit = self.accel.intersect(&self.tables.shapes, ray)?;
        Some(self.tables.shapes.interaction(ray, &hit))
    }

    /// Whether any surface lies on the ray.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.accel.occluded(&self.tables.shapes, ray)
    }
}
