//! Choice and sampling of all light sources of a scene.

use super::Emitter;
use super::flatten::FlatLights;
use super::guide::EnvironmentGuide;
use super::infinite::InfiniteLights;
use super::light::{AlignedLight, Light};
use super::tree::{LightTree, Receiver, Shares};
use crate::integrator::IntegratorKind;
use crate::interaction::SurfaceInteraction;
use crate::math::directions::Directions;
use crate::math::{Ray, Vec2, Vec3};
use crate::scene::SceneTables;
use crate::spectrum::Rgb;
use std::sync::Arc;

/// Where light is asked for.
///
/// The same reference must be given to [`LightSampler::sample`] and to the densities that the
/// sample is weighted with.
#[derive(Debug, Clone, Copy)]
pub struct LightReference {
    /// The point, world space.
    pub p: Vec3,
    /// Unit normal of the side from which alone light matters: for a surface that does not
    /// transmit, the shading normal turned to the viewer's side. Lights below its horizon are
    /// then never chosen. `None` where light may come from both sides.
    pub n: Option<Vec3>,
    /// Leaves out the sky that an irradiance cache holds.
    pub without_sky: bool,
}

/// Whether an irradiance cache holds the light that comes directly from the sky to diffuse
/// surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sky {
    /// If it has no small bright parts.
    #[default]
    Auto,
    /// No: it is sampled as all other light sources are.
    Direct,
    /// Yes, whatever it looks like.
    Cached,
}

impl Sky {
    /// All of them, the default first.
    pub const ALL: [Self; 3] = [Self::Auto, Self::Direct, Self::Cached];

    /// As scene files and the command line call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Direct => "direct",
            Self::Cached => "cached",
        }
    }
}

/// A direction towards a light.
#[derive(Debug, Clone, Copy)]
pub struct LightSample {
    /// Unit direction towards the light, world space.
    pub wi: Vec3,
    /// Distance; infinite for the environment and for parallel light.
    pub distance: f32,
    /// Radiance that arrives if nothing is in the way; for delta lights that factor which makes
    /// `f·cos·radiance/pdf` the contribution.
    pub radiance: Rgb,
    /// Density by solid angle, the choice of the light included; for delta lights the probability
    /// of that choice.
    pub pdf: f32,
    /// No other method could have found this direction.
    pub is_delta: bool,
    /// Point on the light, and how far to move it to the reference's side so that a shadow ray
    /// does not meet the light itself; `None` at infinity.
    pub target: Option<(Vec3, Vec3)>,
}

impl LightSample {
    /// The ray that is occluded if something stands between `origin` and the light. The origin is
    /// already moved off its own surface
    /// (see [`SurfaceInteraction::spawn_origin`]).
    pub fn shadow_ray(&self, origin: Vec3) -> Ray {
        let Some((p, offset)) = self.target else {
            return Ray::new(origin, self.wi);
        };
        let segment = (p + offset) - origin;
        let length = segment.length();
        Ray { o: origin, d: segment / length, t_max: length * (1.0 - f32::EPSILON) }
    }
}

/// Why the lights of a scene cannot be sampled.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LightError {
    /// The picture of an environment map has no pixels, or values that are not finite numbers.
    #[error(
        "environment map (emitter {emitter}): the picture is empty or holds values that are not finite"
    )]
    EnvironmentMap {
        /// Index in the table of emitters.
        emitter: usize,
    },
}

/// Bounds of the probability with which the infinitely far lights are chosen, where both they and
/// nearer ones shine: the estimate knows nothing of walls.
const INFINITE_SHARE: (f32, f32) = (0.1, 0.9);

/// Samples the light sources of a scene.
#[derive(Debug, Clone)]
pub struct LightSampler {
    pub(super) flat: FlatLights,
    tree: LightTree,
    infinite: InfiniteLights,
    /// Those of them that an irradiance cache holds, and the others.
    cached_sky: InfiniteLights,
    beside_sky: InfiniteLights,
}

impl LightSampler {
    /// Flattens the emitters into lights and makes the tables.
    pub fn build(tables: &SceneTables) -> Result<Self, LightError> {
        let mut flat = FlatLights::new(tables);
        let leaves: Vec<_> = flat
            .lights
            .iter()
            .map(|AlignedLight(l)| (l.extent(), l.intensity(flat.tables(tables))))
            .collect();
        let mut tree = LightTree::build(&leaves);
        flat.reorder(&tree.renumber());
        let infinite = InfiniteLights::new(tables)?;
        let has_cache = tables.integrator.kind == IntegratorKind::IrradianceCache;
        let sky = if has_cache { tables.integrator.cache.sky } else { Sky::Direct };
        let [cached_sky, beside_sky] = infinite.split(sky);
        Ok(Self { flat, tree, infinite, cached_sky, beside_sky })
    }

    /// Whether some light fills the sky, so that it is worth learning where it is seen from.
    pub fn wants_guide(&self) -> bool {
        self.infinite.fills_sky()
    }

    /// From now on the sky is sampled where it is seen (`None`: everywhere).
    pub fn set_guide(&mut self, guide: Option<EnvironmentGuide>) {
        let guide = guide.map(Arc::new);
        self.beside_sky.set_guide(guide.clone());
        self.infinite.set_guide(guide);
    }

    /// Number of lights that are chosen between; a mesh counts with its triangles.
    pub fn light_count(&self) -> usize {
        self.flat.lights.len() + self.infinite.count()
    }

    /// Whether `u_select` of [`LightSampler::sample`] matters. One light alone needs no choice,
    /// unless there is more than one way to sample it.
    pub fn needs_choice(&self) -> bool {
        self.light_count() > 1 || self.infinite.is_guided()
    }

    /// Power of all lights at finite places (W), about; mean of the channels.
    pub fn power(&self, tables: &SceneTables) -> f32 {
        self.flat.lights.iter().map(|AlignedLight(l)| l.power(self.flat.tables(tables))).sum()
    }

    /// Whether rays that leave the scene may see light.
    pub fn has_environment(&self) -> bool {
        self.infinite.is_visible()
    }

    /// A direction from which light may arrive at the reference; `None` where none was found
    /// (which counts as a sample of value 0). `u_select` chooses the light, `u` the place on it,
    /// all in [0, 1).
    #[inline]
    pub fn sample(
        &self,
        tables: &SceneTables,
        reference: &LightReference,
        u_select: f32,
        u: Vec2,
    ) -> Option<LightSample> {
        let at = Receiver { p: reference.p, n: reference.n };
        let infinite = self.infinite(reference);
        if infinite.irradiance == 0.0 {
            let (light, probability) = match self.tree.only() {
                Some(light) => (light, 1.0),
                None => self.tree.sample(&at, with_more_bits(u_select, u))?,
            };
            return self.flat.lights[light].0.sample(
                self.flat.tables(tables),
                reference.p,
                u,
                probability,
            );
        }
        let root = self.tree.at_root(&at);
        let share = infinite_share(infinite, root.as_ref());
        if u_select < share {
            let sample = infinite.sample(tables, reference, u_select / share, u)?;
            return Some(LightSample { pdf: sample.pdf * share, ..sample });
        }
        let u_tree = with_more_bits((u_select - share) / (1.0 - share), u);
        let (light, probability) = self.tree.sample_from(&root?, &at, u_tree)?;
        self.flat.lights[light].0.sample(
            self.flat.tables(tables),
            reference.p,
            u,
            probability * (1.0 - share),
        )
    }

    /// Density by solid angle with which [`LightSampler::sample`] chooses the direction `wi` by
    /// way of the surface point `hit`; 0 where it is no light.
    #[inline]
    pub fn pdf_surface(
        &self,
        _tables: &SceneTables,
        reference: &LightReference,
        wi: Vec3,
        hit: &SurfaceInteraction,
    ) -> f32 {
        let Some(index) = self.flat.light_of(hit.shape, hit.primitive) else { return 0.0 };
        let Light::Area(light) = &self.flat.lights[index].0 else { return 0.0 };
        let at = Receiver { p: reference.p, n: reference.n };
        let probability = self.tree.probability(&at, index);
        if probability == 0.0 {
            return 0.0;
        }
        let share = self.infinite_share_at(self.infinite(reference), &at);
        light.area.pdf(reference.p, wi, hit.p, hit.ng) * probability * (1.0 - share)
    }

    /// Density by solid angle with which [`LightSampler::sample`] chooses the unit direction `wi`
    /// by way of the environment.
    #[inline]
    pub fn pdf_environment(
        &self,
        _tables: &SceneTables,
        reference: &LightReference,
        wi: Vec3,
    ) -> f32 {
        let at = Receiver { p: reference.p, n: reference.n };
        let infinite = self.infinite(reference);
        let share = self.infinite_share_at(infinite, &at);
        if share == 0.0 { 0.0 } else { share * infinite.pdf(reference, wi) }
    }

    /// Radiance of all infinitely far lights but parallel ones from where the unit vector
    /// `direction` points to.
    pub fn environment_radiance(&self, tables: &SceneTables, direction: Vec3) -> Rgb {
        self.infinite.radiance(tables, direction)
    }

    /// Radiance that a surface emits towards `si.wo`; black from behind.
    pub fn emitted_radiance(&self, tables: &SceneTables, si: &SurfaceInteraction) -> Rgb {
        let Some(emitter) = tables.shapes.shapes[si.shape.0 as usize].emitter else {
            return Rgb::BLACK;
        };
        match &tables.emitters.emitters[emitter.0 as usize] {
            Emitter::Area { radiance, .. } if si.wo.dot(si.frame.n) > 0.0 => {
                tables.textures.rgb(&tables.shapes, *radiance, si)
            }
            _ => Rgb::BLACK,
        }
    }

    /// Probability of choosing an infinitely far light.
    #[inline]
    fn infinite_share_at(&self, infinite: &InfiniteLights, at: &Receiver) -> f32 {
        if infinite.irradiance == 0.0 {
            return 0.0;
        }
        infinite_share(infinite, self.tree.at_root(at).as_ref())
    }

    /// The infinitely far lights that matter to the reference.
    #[inline]
    fn infinite(&self, reference: &LightReference) -> &InfiniteLights {
        if reference.without_sky { &self.beside_sky } else { &self.infinite }
    }

    /// Whether an irradiance cache holds some of the sky.
    pub fn has_cached_sky(&self) -> bool {
        self.cached_sky.is_visible()
    }

    /// Radiance from where the unit vector `direction` points to, of the sky that an irradiance
    /// cache holds.
    pub fn cached_sky_radiance(&self, tables: &SceneTables, direction: Vec3) -> Rgb {
        self.cached_sky.radiance(tables, direction)
    }

    /// What was learned about where the sky is seen from the reference, if anything was.
    pub fn sky_directions(&self, reference: &LightReference) -> Option<Directions<'_>> {
        self.infinite.guide_at(reference)
    }
}

/// The same, where there are such lights: their share of the irradiance to be expected. `near`
/// is what the root of the tree says of all others.
#[inline]
fn infinite_share(infinite: &InfiniteLights, near: Option<&Shares>) -> f32 {
    let far = infinite.irradiance;
    let near = near.map_or(0.0, |shares| shares.sum() as f32);
    if near == 0.0 {
        return 1.0;
    }
    (far / (far + near)).clamp(INFINITE_SHARE.0, INFINITE_SHARE.1)
}

/// A choice among 10⁵ lights uses up 17 of the 24 bits of a number in [0, 1); more bits, taken
/// from numbers that have nothing to do with it, keep rare lights possible.
fn with_more_bits(u: f32, others: Vec2) -> f64 {
    let bits = u64::from(others.x.to_bits()) << 32 | u64::from(others.y.to_bits());
    let mixed = (bits ^ bits >> 29).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40;
    let low = mixed as f64 * (1.0 / 16_777_216.0);
    ((f64::from(u) * 16_777_216.0 + low) * (1.0 / 16_777_216.0)).min(1.0 - f64::EPSILON)
}
