//! Cameras: from a place on the film to a ray.

mod camera;

pub use camera::Camera;

use crate::film::FilmSettings;
use crate::math::{Transform, Vec2};

/// What kind of camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SensorKind {
    /// A pinhole.
    Perspective {
        /// Horizontal field of view, radians, of the whole (uncropped) film.
        fov_x: f32,
        /// Offset of the principal point, in fractions of the film.
        principal_point_offset: Vec2,
    },
    /// A pinhole widened to a lens, sharp at one distance.
    ThinLens {
        /// Horizontal field of view, radians, of the whole (uncropped) film.
        fov_x: f32,
        /// Offset of the principal point, in fractions of the film.
        principal_point_offset: Vec2,
        /// Radius of the lens, scene units.
        aperture_radius: f32,
        /// Distance of the plane in focus, scene units.
        focus_distance: f32,
    },
    /// Parallel rays; the film is [-1, 1] wide in local x.
    Orthographic,
}

/// A camera. Local space: looking along +z, +y up, +x to the left of the picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensor {
    /// `id` of the scene file, if any.
    pub name: String,
    /// What kind of camera.
    pub kind: SensorKind,
    /// Camera space → world.
    pub to_world: Transform,
    /// Nothing nearer (along the axis) is seen, scene units.
    pub near_clip: f32,
    /// Nothing farther (along the axis) is seen, scene units.
    pub far_clip: f32,
    /// The film behind it.
    pub film: FilmSettings,
    /// Samples and their pattern.
    pub sampler: crate::sampler::SamplerSettings,
}
