//! What `path` and `direct` share: light sampling at a surface, and the weights that combine it
//! with BSDF sampling.

use crate::bsdf::{BsdfAtHit, BsdfEval};
use crate::emitter::{LightReference, LightSample};
use crate::interaction::SurfaceInteraction;
use crate::math::{Ray, Vec2, Vec3};
use crate::scene::Scene;
use crate::spectrum::Rgb;

/// The power heuristic with exponent 2 (Veach 1997, section 9.2.4) for a sample that was drawn
/// with density `a` and could have been drawn with density `b`.
#[inline]
pub(super) fn power_heuristic(a: f32, b: f32) -> f32 {
    if a > 0.0 {
        let ratio = b / a;
        1.0 / (1.0 + ratio * ratio)
    } else {
        0.0
    }
}

/// How a ray was chosen, which decides what emission at its end counts.
pub(super) enum Origin {
    /// By the camera or by a delta component: light sampling could not have found its light.
    Delta,
    /// By a BSDF with this density, from this point.
    Smooth(LightReference, f32),
    /// By a record: its surface's direct light, emission at the ray's end included, is somebody
    /// else's task.
    Record,
}

impl Origin {
    /// Weight of the emission of the surface that the ray met.
    pub(super) fn surface_weight(&self, scene: &Scene, si: &SurfaceInteraction) -> f32 {
        self.weight(|at| scene.lights.pdf_surface(&scene.tables, at, -si.wo, si))
    }

    /// Weight of the environment's radiance along the ray's direction `d`.
    pub(super) fn environment_weight(&self, scene: &Scene, d: Vec3) -> f32 {
        self.weight(|at| scene.lights.pdf_environment(&scene.tables, at, d))
    }

    /// Given the density with which light sampling would have found it.
    fn weight(&self, light_pdf: impl FnOnce(&LightReference) -> f32) -> f32 {
        match self {
            Self::Delta => 1.0,
            Self::Smooth(reference, pdf) => power_heuristic(*pdf, light_pdf(reference)),
            Self::Record => 0.0,
        }
    }
}

/// The point as light sampling sees it.
#[inline]
pub(super) fn light_reference(si: &SurfaceInteraction, bsdf: &BsdfAtHit) -> LightReference {
    LightReference { p: si.p, n: bsdf.lit_side(), without_sky: false }
}

/// A light sample that a surface can make use of, before its visibility is known.
pub(super) struct LightCandidate {
    sample: LightSample,
    eval: BsdfEval,
}

impl LightCandidate {
    /// Density of the light sample by solid angle.
    pub(super) fn light_pdf(&self) -> f32 {
        self.sample.pdf
    }

    /// Density with which the BSDF would have chosen the direction; 0 where it never could.
    pub(super) fn bsdf_pdf(&self) -> f32 {
        if self.sample.is_delta { 0.0 } else { self.eval.pdf }
    }

    /// BSDF times cosine times radiance over density, as if the light were visible.
    pub(super) fn contribution(&self) -> Rgb {
        self.eval.value * self.sample.radiance * (1.0 / self.sample.pdf)
    }

    /// The contribution where only the part `glossy` of the BSDF, its diffuse component removed,
    /// is sampled besides: the diffuse component has light sampling alone, but for the sky that a
    /// cache holds.
    pub(super) fn split_contribution(&self, scene: &Scene, glossy: &BsdfAtHit) -> Rgb {
        let sample = &self.sample;
        let diffuse = self.eval.diffuse * (sample.radiance - self.cached_sky(scene));
        diffuse * (1.0 / sample.pdf) + self.glossy_contribution(glossy)
    }

    /// Irradiance of a surface with normal `n` on the lit side, without the sky that a cache holds,
    /// W·m⁻².
    pub(super) fn irradiance(&self, scene: &Scene, n: Vec3) -> Rgb {
        let sample = &self.sample;
        let scale = sample.wi.dot(n).max(0.0) / sample.pdf;
        (sample.radiance - self.cached_sky(scene)) * scale
    }

    /// The part of the radiance that a cache holds.
    fn cached_sky(&self, scene: &Scene) -> Rgb {
        let is_sky = !self.is_near() && !self.sample.is_delta && scene.lights.has_cached_sky();
        if is_sky {
            scene.lights.cached_sky_radiance(&scene.tables, self.sample.wi)
        } else {
            Rgb::BLACK
        }
    }

    /// The contribution of the part `glossy` of the BSDF alone, which is sampled besides.
    pub(super) fn glossy_contribution(&self, glossy: &BsdfAtHit) -> Rgb {
        let sample = &self.sample;
        let other = glossy.eval(sample.wi);
        let pdf = if sample.is_delta { 0.0 } else { other.pdf };
        other.value * sample.radiance * (power_heuristic(sample.pdf, pdf) / sample.pdf)
    }

    /// Whether the light is at a finite place.
    pub(super) fn is_near(&self) -> bool {
        self.sample.target.is_some()
    }

    /// Whether nothing stands between the surface and the light.
    pub(super) fn is_visible(&self, scene: &Scene, si: &SurfaceInteraction) -> bool {
        !scene.occluded(&shadow_ray(si, &self.sample))
    }
}

/// Chooses a point on a light; `None` when no light can reach the viewer from there by the BSDF.
#[inline]
pub(super) fn sample_light(
    scene: &Scene,
    reference: &LightReference,
    bsdf: &BsdfAtHit,
    u_select: f32,
    u: Vec2,
) -> Option<LightCandidate> {
    let sample = scene.lights.sample(&scene.tables, reference, u_select, u)?;
    if sample.pdf <= 0.0 || sample.radiance.is_black() {
        return None;
    }
    let eval = bsdf.eval(sample.wi);
    (!eval.value.is_black()).then_some(LightCandidate { sample, eval })
}

/// The segment between surface and light, shortened at both ends by the offsets that keep it
/// from meeting either surface.
fn shadow_ray(si: &SurfaceInteraction, sample: &LightSample) -> Ray {
    let o = si.spawn_origin(sample.wi);
    let Some((target, offset)) = sample.target else {
        return Ray::new(o, sample.wi);
    };
    let segment: Vec3 = target + offset - o;
    let length = segment.length();
    Ray { o, d: segment / length, t_max: length }
}

/// The first surface along a camera ray, past emitters if these are hidden (as Mitsuba 3.9 does:
/// shapes with an area light are not there at all for camera rays).
pub(super) fn camera_hit(
    scene: &Scene,
    ray: &mut Ray,
    hide_emitters: bool,
    rays: &mut u64,
) -> Option<SurfaceInteraction> {
    loop {
        *rays += 1;
        let si = scene.intersect(ray)?;
        if !hide_emitters || scene.tables.shapes.shapes[si.shape.0 as usize].emitter.is_none() {
            return Some(si);
        }
        *ray = past(&si, ray);
    }
}

/// The rest of a ray behind the surface that it met.
pub(super) fn past(si: &SurfaceInteraction, ray: &Ray) -> Ray {
    Ray { o: si.spawn_origin(ray.d), d: ray.d, t_max: ray.t_max - si.t }
}
