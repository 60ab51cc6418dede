//! Light sources.
//!
//! [`Emitter`]s are what a scene file says. [`LightSampler`] flattens them into lights (a mesh into
//! its triangles), chooses one with a light tree (Conty Estevez and Kulla 2018; lights at infinity
//! stand beside it), and a point on it by area or, near it, by solid angle.

mod area;
mod envmap;
mod flatten;
pub mod guide;
mod infinite;
mod light;
mod sampler;
pub mod sky;
mod spot;
#[cfg(test)]
mod tests;
mod tree;
mod unoccluded;

pub use sampler::{LightError, LightReference, LightSample, LightSampler, Sky};

use crate::math::{Transform, Vec3};
use crate::shape::ShapeId;
use crate::spectrum::Rgb;
use crate::texture::{ImageId, TextureId};

/// Index of an [`Emitter`] in an [`EmitterTable`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(transparent)]
pub struct EmitterId(pub u32);

/// A light source, with the meaning of the Mitsuba 3 plugin of the same name.
#[derive(Debug, Clone, PartialEq)]
pub enum Emitter {
    /// A shining surface: radiance leaves on the side of the shading normal.
    Area {
        /// The surface.
        shape: ShapeId,
        /// Radiance, W·m⁻²·sr⁻¹.
        radiance: TextureId,
    },
    /// A point that shines equally in all directions.
    Point {
        /// World space.
        position: Vec3,
        /// W·sr⁻¹.
        intensity: Rgb,
    },
    /// A point that shines into a cone around its local +z.
    Spot {
        /// Local → world.
        to_world: Transform,
        /// Intensity on the axis, W·sr⁻¹.
        intensity: Rgb,
        /// Half angle beyond which nothing is emitted, radians.
        cutoff_angle: f32,
        /// Half angle up to which the intensity is constant, radians; linear falloff in the
        /// angle from here to the cutoff.
        beam_width: f32,
        /// Optional texture projected along the cone.
        texture: Option<TextureId>,
    },
    /// Parallel light from infinitely far.
    Directional {
        /// Where the light goes, unit, world space.
        direction: Vec3,
        /// Irradiance on a surface square to it, W·m⁻².
        irradiance: Rgb,
    },
    /// The same radiance from every direction.
    Constant {
        /// W·m⁻²·sr⁻¹.
        radiance: Rgb,
    },
    /// A latitude-longitude picture infinitely far away: local +y up, u = atan2(x, −z)/2π,
    /// v = acos(y)/π. Also what `sky` and `sunsky` become.
    Envmap {
        /// The picture, linear.
        image: ImageId,
        /// Factor on the picture.
        scale: f32,
        /// Local → world (rotations only matter).
        to_world: Transform,
    },
    /// A far, bright disc (the sun of `sunsky` and `sun`).
    SunDisc {
        /// Towards the sun, unit, world space.
        direction: Vec3,
        /// Half of its apparent angle, radians.
        half_angle: f32,
        /// Radiance inside the disc, W·m⁻²·sr⁻¹.
        radiance: Rgb,
    },
}

/// All light sources of a scene.
#[derive(Debug, Clone, Default)]
pub struct EmitterTable {
    /// Light sources, by [`EmitterId`].
    pub emitters: Vec<Emitter>,
}
