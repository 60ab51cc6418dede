//! Rays towards where the sky was seen from the places around.
//!
//! They share the sky's light with cosine-distributed rays, each weighted by the balance heuristic
//! (Veach 1997, section 9.2.2).

use std::f32::consts::FRAC_1_PI;

use crate::emitter::LightReference;
use crate::interaction::SurfaceInteraction;
use crate::math::directions::Directions;
use crate::math::{Frame, Vec2, Vec3};
use crate::scene::Scene;
use crate::spectrum::Rgb;

/// The sky that the cache holds, from one point of a surface.
pub(super) struct SkyLight<'a> {
    scene: &'a Scene,
    guide: Directions<'a>,
    ratio: f32,
}

impl<'a> SkyLight<'a> {
    /// `None` where cosine-distributed rays do as well: there is no such sky, or nothing was
    /// learned about it. `n` is the unit normal on the lit side, `ratio` how many rays there are
    /// towards the sky per cosine-distributed ray.
    pub(super) fn at(scene: &'a Scene, p: Vec3, n: Vec3, ratio: f32) -> Option<Self> {
        if !scene.lights.has_cached_sky() {
            return None;
        }
        let reference = LightReference { p, n: Some(n), without_sky: false };
        scene.lights.sky_directions(&reference).map(|guide| Self { scene, guide, ratio })
    }

    /// Weight of the sky's radiance from the world-space direction, whose cosine to the normal is
    /// `cos`, whichever kind of ray found it. The sum over rays of both kinds, divided by the number
    /// of cosine-distributed ones, makes irradiance with the factor π.
    pub(super) fn share(&self, direction: Vec3, cos: f32) -> f32 {
        let own = cos * FRAC_1_PI;
        own / (own + self.ratio * self.guide.pdf(direction))
    }

    /// A local direction towards the sky with the weighted radiance from there, black where
    /// something is in the way; `None` below the horizon.
    pub(super) fn sample(
        &self,
        si: &SurfaceInteraction,
        frame: &Frame,
        u: Vec2,
        rays: &mut u64,
    ) -> Option<(Vec3, Rgb)> {
        let (direction, _) = self.guide.sample(u)?;
        let local = frame.to_local(direction);
        if local.z <= 0.0 {
            return None;
        }
        *rays += 1;
        let scene = self.scene;
        if scene.occluded(&si.spawn_ray(direction)) {
            return Some((local, Rgb::BLACK));
        }
        let radiance = scene.lights.cached_sky_radiance(&scene.tables, direction);
        Some((local, radiance * self.share(direction, local.z)))
    }
}
