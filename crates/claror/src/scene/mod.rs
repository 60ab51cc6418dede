//! The scene: flat, index-linked tables.

use crate::bsdf::BsdfTable;
use crate::emitter::EmitterTable;
use crate::integrator::{Aov, IntegratorSettings};
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
