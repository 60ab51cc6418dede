//! The scene: flat, index-linked tables, and what is derived from them for rendering.

#[cfg(test)]
pub(crate) mod test_scene;

use crate::accel::{Accel, AccelError};
use crate::bsdf::{BsdfError, BsdfTable};
use crate::emitter::guide::EnvironmentGuide;
use crate::emitter::{Emitter, EmitterTable, LightError, LightSampler};
use crate::film::CropWindow;
use crate::integrator::{Aov, IntegratorSettings};
use crate::interaction::{Detail, SurfaceInteraction};
use crate::math::{Ray, Vec2};
use crate::sampler::{Sampler, SamplerKind, SamplerSettings};
use crate::sensor::{Camera, Sensor};
use crate::shape::{Shape, ShapeTable};
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
    /// What material and emitter of each shape must be told about its surface.
    details: Vec<Detail>,
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

/// What the material and the emitter of a shape must be told about its surface.
fn detail(tables: &SceneTables, shape: &Shape) -> Detail {
    let material = tables.bsdfs.detail(shape.bsdf);
    let emitter = shape.emitter.map(|id| &tables.emitters.emitters[id.0 as usize]);
    match emitter {
        Some(Emitter::Area { radiance, .. }) if tables.textures.constant(*radiance).is_none() => {
            material.max(Detail::Uv)
        }
        _ => material,
    }
}

/// Walks per pixel that learn where the sky is seen from. Four instead of one take a fifth off the
/// variance of a room with windows.
const GUIDE_WALKS_PER_PIXEL: usize = 4;
/// Least and largest number of these walks: half a second at most.
const GUIDE_WALKS: (usize, usize) = (1 << 16, 1 << 18);

impl Scene {
    /// Derives what rendering needs, in parallel on the current rayon pool.
    pub fn build(mut tables: SceneTables) -> Result<Self, SceneError> {
        tables.bsdfs.prepare(&tables.textures, &tables.shapes)?;
        let accel = Accel::build(&tables.shapes)?;
        let lights = LightSampler::build(&tables)?;
        let details = tables.shapes.shapes.iter().map(|shape| detail(&tables, shape)).collect();
        let mut scene = Self { tables, accel, lights, details };
        if scene.lights.wants_guide() {
            let guide = scene.learn_sky();
            scene.lights.set_guide(guide);
        }
        Ok(scene)
    }

    /// Learns from walks that start at all cameras where the sky is seen from.
    fn learn_sky(&self) -> Option<EnvironmentGuide> {
        let cameras: Vec<(Camera, CropWindow)> =
            self.tables.sensors.iter().map(|s| (Camera::new(s), s.film.crop)).collect();
        let pixels: usize = cameras.iter().map(|(_, c)| c.width as usize * c.height as usize).sum();
        let settings = SamplerSettings { kind: SamplerKind::Sobol, sample_count: 1, seed: 0 };
        if cameras.is_empty() {
            return None;
        }
        let camera_ray = |i: usize| {
            let (camera, crop) = &cameras[i % cameras.len()];
            let mut sampler = Sampler::new(&settings, (0, 0), (i / cameras.len()) as u32);
            let size = Vec2::new(crop.width as f32, crop.height as f32);
            let corner = Vec2::new(crop.x as f32, crop.y as f32);
            let film = corner + sampler.next_2d() * size;
            Some(camera.ray(film, sampler.next_2d()))
        };
        EnvironmentGuide::learn(
            (pixels * GUIDE_WALKS_PER_PIXEL).clamp(GUIDE_WALKS.0, GUIDE_WALKS.1),
            camera_ray,
            |ray| self.intersect(ray),
            |d| self.lights.environment_radiance(&self.tables, d).luminance(),
        )
    }

    /// The first surface along the ray, whose direction is a unit vector: all that its material
    /// and its emitter need to know.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<SurfaceInteraction> {
        let hit = self.accel.intersect(&self.tables.shapes, ray)?;
        let detail = self.details[hit.shape.0 as usize];
        Some(self.tables.shapes.interaction(ray, &hit, detail))
    }

    /// The same with a chosen amount of detail.
    pub fn intersect_with(&self, ray: &Ray, detail: Detail) -> Option<SurfaceInteraction> {
        let hit = self.accel.intersect(&self.tables.shapes, ray)?;
        Some(self.tables.shapes.interaction(ray, &hit, detail))
    }

    /// Whether any surface lies on the ray.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.accel.occluded(&self.tables.shapes, ray)
    }
}
