//! Lights that are infinitely far away: `constant`, `envmap`, the sun's disc, `directional`.
//!
//! One of them is chosen by the irradiance it can make. Those that fill a part of the sphere may
//! overlap; a direction is then worth what all of them send from there, and its density is that
//! of the mixture.

use super::envmap::Envmap;
use super::guide::EnvironmentGuide;
use super::{Emitter, LightError, LightReference, LightSample, Sky};
use crate::math::directions::Directions;
use crate::math::distribution::Cumulative;
use crate::math::warp::{
    UNIFORM_SPHERE_PDF, around, cosine_hemisphere, cosine_hemisphere_pdf, uniform_cone,
    uniform_cone_pdf, uniform_sphere,
};
use crate::math::{Vec2, Vec3};
use crate::scene::SceneTables;
use crate::spectrum::Rgb;
use std::f32::consts::PI;
use std::sync::Arc;

#[derive(Debug, Clone)]
enum Infinite {
    Constant {
        radiance: Rgb,
    },
    Envmap(Arc<Envmap>),
    Sun {
        towards: Vec3,
        /// One minus the cosine of the half angle, which would round to 1.
        one_minus_cos: f32,
        radiance: Rgb,
    },
    Directional {
        towards: Vec3,
        irradiance: Rgb,
    },
}

/// All infinite lights of a scene.
#[derive(Debug, Clone, Default)]
pub(super) struct InfiniteLights {
    lights: Vec<Infinite>,
    choice: Cumulative,
    /// Estimate of the irradiance that all of them can make, mean of the channels.
    pub(super) irradiance: f32,
    /// Where the sky is seen from, if that was learned.
    guide: Option<Arc<EnvironmentGuide>>,
}

/// Largest share of an environment map's light that may come from its bright parts for it to count
/// as smooth.
const MAX_BRIGHT_SHARE: f32 = 0.1;

/// Share of the guide, where there is one, in sampling a light that fills the sky. The rest keeps
/// the small bright parts of environment maps, which the guide's coarse cells blur.
const GUIDE_SHARE: f32 = 0.9;

impl Infinite {
    fn new(
        emitter: &Emitter,
        index: usize,
        tables: &SceneTables,
    ) -> Result<Option<Self>, LightError> {
        Ok(Some(match *emitter {
            Emitter::Constant { radiance } => Self::Constant { radiance },
            Emitter::Envmap { image, scale, ref to_world } => {
                let picture = &tables.textures.images[image.0 as usize];
                let envmap = Envmap::new(image, picture, scale, to_world)
                    .ok_or(LightError::EnvironmentMap { emitter: index })?;
                Self::Envmap(Arc::new(envmap))
            }
            Emitter::SunDisc { direction, half_angle, radiance } => {
                let half = (0.5 * half_angle).sin();
                let towards = direction.normalize_or(Vec3::Z);
                Self::Sun { towards, one_minus_cos: 2.0 * half * half, radiance }
            }
            Emitter::Directional { direction, irradiance } => {
                Self::Directional { towards: -direction.normalize_or(-Vec3::Z), irradiance }
            }
            Emitter::Area { .. } | Emitter::Point { .. } | Emitter::Spot { .. } => return Ok(None),
        }))
    }

    /// Whether light comes from all around, rather than from a point or a small disc.
    fn fills_sky(&self) -> bool {
        matches!(self, Self::Constant { .. } | Self::Envmap(_))
    }

    /// Whether it fills the sky without small bright parts, whose shadows would be too sharp for an
    /// irradiance cache.
    fn is_smooth_sky(&self) -> bool {
        match self {
            Self::Constant { .. } => true,
            Self::Envmap(map) => map.bright_share < MAX_BRIGHT_SHARE,
            Self::Sun { .. } | Self::Directional { .. } => false,
        }
    }

    /// Estimate of the irradiance on a surface that looks towards it, mean of the channels.
    fn irradiance(&self) -> f32 {
        let estimate = match self {
            Self::Constant { radiance } => PI * radiance.mean(),
            Self::Envmap(map) => PI * map.mean.mean(),
            Self::Sun { one_minus_cos, radiance, .. } => 2.0 * PI * one_minus_cos * radiance.mean(),
            Self::Directional { irradiance, .. } => irradiance.mean(),
        };
        if estimate.is_finite() { estimate.max(0.0) } else { 0.0 }
    }

    /// Radiance from where the unit vector `d` points to; none from parallel light.
    fn radiance(&self, tables: &SceneTables, d: Vec3) -> Rgb {
        match self {
            Self::Constant { radiance } => *radiance,
            Self::Envmap(map) => map.radiance(&tables.textures.images[map.image.0 as usize], d),
            Self::Sun { towards, one_minus_cos, radiance } => {
                if in_disc(d, *towards, *one_minus_cos) { *radiance } else { Rgb::BLACK }
            }
            Self::Directional { .. } => Rgb::BLACK,
        }
    }

    /// A direction, the radiance from there and its density by solid angle.
    fn sample(&self, tables: &SceneTables, n: Option<Vec3>, u: Vec2) -> Option<(Vec3, Rgb, f32)> {
        match self {
            Self::Constant { radiance } => Some(match n {
                // All that matters is the cosine at the surface.
                Some(n) => {
                    let local = cosine_hemisphere(u);
                    let pdf = cosine_hemisphere_pdf(local.z);
                    (around(n, local).normalize(), *radiance, pdf)
                }
                None => (uniform_sphere(u), *radiance, UNIFORM_SPHERE_PDF),
            }),
            Self::Envmap(map) => map.sample(&tables.textures.images[map.image.0 as usize], u),
            Self::Sun { towards, one_minus_cos, radiance } => {
                let d = around(*towards, uniform_cone(u, *one_minus_cos)).normalize();
                Some((d, *radiance, uniform_cone_pdf(*one_minus_cos)))
            }
            Self::Directional { towards, irradiance } => Some((*towards, *irradiance, 1.0)),
        }
    }

    /// Density by solid angle of [`Infinite::sample`]; 0 for parallel light.
    fn pdf(&self, n: Option<Vec3>, d: Vec3) -> f32 {
        match self {
            Self::Constant { .. } => match n {
                Some(n) => cosine_hemisphere_pdf(d.dot(n).max(0.0)),
                None => UNIFORM_SPHERE_PDF,
            },
            Self::Envmap(map) => map.pdf(d),
            Self::Sun { towards, one_minus_cos, .. } => {
                if in_disc(d, *towards, *one_minus_cos) {
                    uniform_cone_pdf(*one_minus_cos)
                } else {
                    0.0
                }
            }
            Self::Directional { .. } => 0.0,
        }
    }
}

/// The square of the chord is 2 (1 − cos): precise for small angles, unlike the cosine.
fn in_disc(d: Vec3, towards: Vec3, one_minus_cos: f32) -> bool {
    (d - towards).length_squared() <= 2.0 * one_minus_cos
}

impl InfiniteLights {
    pub(super) fn new(tables: &SceneTables) -> Result<Self, LightError> {
        let mut lights = Vec::new();
        for (i, emitter) in tables.emitters.emitters.iter().enumerate() {
            lights.extend(Infinite::new(emitter, i, tables)?);
        }
        Ok(Self::from_lights(lights))
    }

    fn from_lights(lights: Vec<Infinite>) -> Self {
        let weights: Vec<f32> = lights.iter().map(Infinite::irradiance).collect();
        // Black ones are never chosen.
        let choice = Cumulative::new(&weights).unwrap_or_default();
        Self { irradiance: weights.iter().sum(), choice, lights, guide: None }
    }

    /// Those that an irradiance cache holds, and the others.
    pub(super) fn split(&self, sky: Sky) -> [Self; 2] {
        let is_cached = |light: &&Infinite| match sky {
            Sky::Direct => false,
            Sky::Auto => light.is_smooth_sky(),
            Sky::Cached => light.fills_sky(),
        };
        let cached: Vec<Infinite> = self.lights.iter().filter(is_cached).cloned().collect();
        let others = self.lights.iter().filter(|light| !is_cached(light)).cloned().collect();
        [cached, others].map(Self::from_lights)
    }

    /// Whether rays that leave the scene may see something.
    pub(super) fn is_visible(&self) -> bool {
        self.lights.iter().any(|l| !matches!(l, Infinite::Directional { .. }))
    }

    /// Whether some light fills the sky and shines.
    pub(super) fn fills_sky(&self) -> bool {
        self.lights.iter().any(|l| l.fills_sky() && l.irradiance() > 0.0)
    }

    pub(super) fn count(&self) -> usize {
        self.lights.len()
    }

    /// Samples the lights that fill the sky by what was learned about their visibility.
    pub(super) fn set_guide(&mut self, guide: Option<Arc<EnvironmentGuide>>) {
        self.guide = guide;
    }

    /// Whether a guide was learned.
    pub(super) fn is_guided(&self) -> bool {
        self.guide.is_some()
    }

    /// What the guide knows about the reference.
    pub(super) fn guide_at(&self, at: &LightReference) -> Option<Directions<'_>> {
        self.guide.as_deref()?.at(at.p, at.n?)
    }

    /// The density of the result is without that of the choice of infinite lights at all.
    pub(super) fn sample(
        &self,
        tables: &SceneTables,
        at: &LightReference,
        u_select: f32,
        u: Vec2,
    ) -> Option<LightSample> {
        if self.irradiance <= 0.0 {
            return None;
        }
        let (i, probability, u_method) = self.choice.sample(u_select);
        let light = &self.lights[i];
        let guide = self.guide_at(at);
        let guided = match &guide {
            Some(guide) if light.fills_sky() && u_method < GUIDE_SHARE => Some(guide.sample(u)?.0),
            _ => None,
        };
        let is_delta = matches!(light, Infinite::Directional { .. });
        let (wi, radiance, pdf) = match guided {
            Some(wi) => (wi, self.radiance(tables, wi), self.mixture_pdf(guide, at.n, wi)),
            None => {
                let (wi, radiance, pdf) = light.sample(tables, at.n, u)?;
                if is_delta || (self.lights.len() == 1 && self.guide.is_none()) {
                    (wi, radiance, pdf * probability)
                } else {
                    (wi, self.radiance(tables, wi), self.mixture_pdf(guide, at.n, wi))
                }
            }
        };
        let distance = f32::INFINITY;
        let sample = LightSample { wi, distance, radiance, pdf, is_delta, target: None };
        (pdf > 0.0).then_some(sample)
    }

    /// Sum over all lights.
    pub(super) fn radiance(&self, tables: &SceneTables, d: Vec3) -> Rgb {
        self.lights.iter().fold(Rgb::BLACK, |sum, l| sum + l.radiance(tables, d))
    }

    /// Density by solid angle of [`InfiniteLights::sample`].
    pub(super) fn pdf(&self, at: &LightReference, d: Vec3) -> f32 {
        if self.irradiance <= 0.0 {
            return 0.0;
        }
        self.mixture_pdf(self.guide_at(at), at.n, d)
    }

    fn mixture_pdf(&self, guide: Option<Directions<'_>>, n: Option<Vec3>, d: Vec3) -> f32 {
        let guided = guide.map(|guide| guide.pdf(d));
        let share = |(i, l): (usize, &Infinite)| {
            let own = l.pdf(n, d);
            let pdf = match guided {
                Some(guided) if l.fills_sky() => own + GUIDE_SHARE * (guided - own),
                _ => own,
            };
            self.choice.probability(i) * pdf
        };
        self.lights.iter().enumerate().map(share).sum()
    }
}
