//! A material at one point of a surface, ready to be evaluated and sampled.

use arrayvec::ArrayVec;

use super::lobe::{Lobe, LobeEval, LobeSample};
use super::perturb::Guard;
use crate::math::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use crate::math::{Frame, Vec2, Vec3};
use crate::spectrum::Rgb;

/// Most lobes that one material may resolve to; [`super::BsdfTable::validate`] refuses more.
pub const MAX_LOBES: usize = 8;
/// Most bump and normal maps in one material.
pub(super) const MAX_GUARDS: usize = 8;

/// What a material says about one pair of directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BsdfEval {
    /// Scattering function times `|cos θ|` between the light's direction and the shading normal.
    /// Delta components are left out. Radiance that was refracted is scaled by the squared ratio
    /// of the indices, as Mitsuba does when it carries radiance.
    pub value: Rgb,
    /// The diffuse part of `value`: see [`BsdfAtHit::diffuse_albedo`] for what counts.
    pub diffuse: Rgb,
    /// Density by solid angle with which [`BsdfAtHit::sample`] chooses the light's direction.
    pub pdf: f32,
}

/// A direction chosen by a material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BsdfSample {
    /// Towards the light, world space, unit length.
    pub wi: Vec3,
    /// Scattering function times `|cos θ|` over density.
    pub weight: Rgb,
    /// The diffuse part of `weight`.
    pub diffuse_weight: Rgb,
    /// Density by solid angle, selection of the lobe included; for a delta component the
    /// probability with which it was chosen.
    pub pdf: f32,
    /// Index of refraction behind the crossed interface over that before it; 1 for reflection.
    pub eta: f32,
    /// The direction is the only one of its component: light sampling cannot find it.
    pub is_delta: bool,
    /// Nothing happened: the path goes straight on through an invisible surface.
    pub is_null: bool,
    /// `wi` leaves on the other side of the surface.
    pub is_transmission: bool,
}

/// One lobe of a material: a share, a frame and a model.
#[derive(Debug, Clone, Copy)]
pub(super) struct WeightedLobe<'a> {
    /// Share of this lobe, also the probability of choosing it.
    pub(super) weight: f32,
    /// Index of the innermost guard, if bump or normal maps surround the lobe.
    pub(super) guard: Option<u8>,
    /// The frame in which the lobe works. Left-handed where `twosided` turned the normal round.
    pub(super) frame: Frame,
    /// Towards the viewer, in that frame.
    pub(super) wo: Vec3,
    /// The model.
    pub(super) lobe: Lobe<'a>,
}

/// A material at one point of a surface: a few weighted lobes, without textures and nesting.
/// Made by [`super::BsdfTable::at_hit`]; remembers the direction towards the viewer.
#[derive(Debug, Clone)]
pub struct BsdfAtHit<'a>(pub(super) Lobes<'a>);

/// Most materials are one lobe: then nothing but that lobe is written and read.
#[derive(Debug, Clone)]
#[expect(clippy::large_enum_variant, reason = "only the used part is touched; no heap per hit")]
pub(super) enum Lobes<'a> {
    /// `diffuse`, `twosided` or not: most surfaces of most scenes.
    Diffuse(DiffuseSide),
    /// One lobe of weight 1 in an unperturbed frame.
    One(WeightedLobe<'a>),
    /// Any other material.
    Many(ManyLobes<'a>),
}

#[derive(Debug, Clone)]
pub(super) struct ManyLobes<'a> {
    /// Weights sum to at most 1.
    pub(super) lobes: ArrayVec<WeightedLobe<'a>, MAX_LOBES>,
    /// What bump and normal maps leave of the frames that they replaced.
    pub(super) guards: ArrayVec<Guard, MAX_GUARDS>,
}

/// A Lambertian surface as its viewer sees it.
#[derive(Debug, Clone, Copy)]
pub(super) struct DiffuseSide {
    /// Its normal is on the viewer's side. Left-handed where it was turned.
    pub(super) frame: Frame,
    /// Share of the light that is reflected, on whichever side.
    pub(super) reflectance: Rgb,
    /// False behind a one-sided surface.
    pub(super) is_lit: bool,
}

impl DiffuseSide {
    #[inline]
    fn eval(&self, wi: Vec3) -> BsdfEval {
        let cos = self.frame.n.dot(wi);
        if !self.is_lit || cos <= 0.0 {
            return BsdfEval { value: Rgb::BLACK, diffuse: Rgb::BLACK, pdf: 0.0 };
        }
        let pdf = cosine_hemisphere_pdf(cos);
        let value = self.reflectance * pdf;
        BsdfEval { value, diffuse: value, pdf }
    }

    #[inline]
    fn sample(&self, u: Vec2) -> Option<BsdfSample> {
        let local = cosine_hemisphere(u);
        let pdf = cosine_hemisphere_pdf(local.z);
        (self.is_lit && pdf > 0.0).then(|| BsdfSample {
            wi: self.frame.to_world(local),
            weight: self.reflectance,
            diffuse_weight: self.reflectance,
            pdf,
            eta: 1.0,
            is_delta: false,
            is_null: false,
            is_transmission: false,
        })
    }
}

impl<'a> BsdfAtHit<'a> {
    /// A material that scatters nothing.
    pub fn empty() -> Self {
        Self(Lobes::Many(ManyLobes::empty()))
    }

    /// Value and density for light from the world-space unit direction `wi`.
    pub fn eval(&self, wi: Vec3) -> BsdfEval {
        let many = match &self.0 {
            Lobes::Diffuse(side) => return side.eval(wi),
            Lobes::One(only) => {
                let e = only.lobe.eval(only.wo, only.frame.to_local(wi));
                return BsdfEval { value: e.value, diffuse: e.diffuse, pdf: e.pdf };
            }
            Lobes::Many(many) => many,
        };
        let mut sum = BsdfEval { value: Rgb::BLACK, diffuse: Rgb::BLACK, pdf: 0.0 };
        for lobe in &many.lobes {
            let e = many.eval_lobe(lobe, wi);
            sum.value += e.value * lobe.weight;
            sum.diffuse += e.diffuse * lobe.weight;
            sum.pdf += e.pdf * lobe.weight;
        }
        sum
    }

    /// Chooses a direction towards the light. `u_lobe` chooses the lobe and its component, `u`
    /// the direction. `None` when the path ends here: nothing is scattered, or the chosen
    /// direction cannot occur.
    pub fn sample(&self, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        let many = match &self.0 {
            Lobes::Diffuse(side) => return side.sample(u),
            Lobes::One(only) => {
                let sample = only.lobe.sample(only.wo, u_lobe, u)?;
                return Some(only.world_sample(&sample));
            }
            Lobes::Many(many) => many,
        };
        let (lobe, u_component) = many.choose(u_lobe)?;
        let sample = lobe.lobe.sample(lobe.wo, u_component, u)?;
        let mut result = lobe.world_sample(&sample);
        let shadowing = many.shadowing(lobe, result.wi, sample.wi.z);
        if shadowing <= 0.0 {
            return None;
        }
        result.weight *= shadowing;
        result.diffuse_weight *= shadowing;
        if !sample.is_delta && many.lobes.len() > 1 {
            // The direction might have come from any of the lobes: one-sample mixture density.
            let e = self.eval(result.wi);
            if e.pdf <= 0.0 {
                return None;
            }
            result.weight = e.value / e.pdf;
            result.diffuse_weight = e.diffuse / e.pdf;
            result.pdf = e.pdf;
        }
        Some(result)
    }

    /// Whether some component is not a delta function, so that light sampling makes sense.
    pub fn has_smooth(&self) -> bool {
        self.is_diffuse() || self.lobes().iter().any(|l| l.lobe.is_smooth())
    }

    /// Unit normal, world space, of the side from which alone the smooth components take light:
    /// the viewer's. `None` where light may come from both sides, or where bump and normal maps
    /// replace the frame.
    pub fn lit_side(&self) -> Option<Vec3> {
        if let Lobes::Diffuse(side) = &self.0 {
            return Some(side.frame.n);
        }
        if self.lobes().iter().any(|l| l.guard.is_some()) {
            return None;
        }
        let mut side = None;
        for l in self.lobes().iter().filter(|l| l.lobe.is_smooth()) {
            if l.lobe.transmits() {
                return None;
            }
            side = Some(if l.wo.z < 0.0 { -l.frame.n } else { l.frame.n });
        }
        side
    }

    /// Whether [`BsdfAtHit::sample`] looks at its `u_lobe`.
    pub fn needs_choice(&self) -> bool {
        !self.is_diffuse()
    }

    /// Whether the surface is invisible here.
    pub fn is_null_only(&self) -> bool {
        !self.lobes().is_empty() && self.lobes().iter().all(|l| matches!(l.lobe, Lobe::Null))
    }

    /// Whether some light passes as if there were no surface.
    pub fn is_see_through(&self) -> bool {
        self.lobes().iter().any(|l| matches!(l.lobe, Lobe::Null))
    }

    /// Directional albedo, for light from everywhere equally, of the diffuse part (the `diffuse`
    /// of [`BsdfEval`]): reflected radiance is this over π times the irradiance.
    ///
    /// Exact for any illumination where the diffuse part is truly Lambertian (`diffuse`). The
    /// base of `plastic` and `roughplastic` counts as diffuse, too: its transmission factor
    /// towards the viewer is that of this viewer, its factor from the light, which depends on the
    /// light's direction, is replaced by its cosine-weighted mean. The base of `principled` does
    /// not count: its retro-reflection and sheen depend on both directions.
    pub fn diffuse_albedo(&self) -> Rgb {
        if let Lobes::Diffuse(side) = &self.0 {
            return if side.is_lit { side.reflectance } else { Rgb::BLACK };
        }
        self.lobes().iter().fold(Rgb::BLACK, |sum, l| sum + l.lobe.diffuse_albedo(l.wo) * l.weight)
    }

    /// Unit normal, world space, on the viewer's side, for which the diffuse part takes irradiance,
    /// where bump or normal maps turn it; of several diffuse lobes their mean. `None` without.
    pub fn perturbed_diffuse_normal(&self) -> Option<Vec3> {
        if !self.lobes().iter().any(|l| l.guard.is_some()) {
            return None;
        }
        let sum = self.lobes().iter().fold(Vec3::ZERO, |sum, l| {
            let share = l.lobe.diffuse_albedo(l.wo).luminance() * l.weight;
            sum + l.frame.n * share.copysign(l.wo.z)
        });
        sum.try_normalize()
    }

    /// Mitsuba's `albedo` layer: the base colour of the material where it has one, π times the
    /// value for light from the normal otherwise, whatever the side; transparency left out.
    pub fn albedo(&self) -> Rgb {
        if let Lobes::Diffuse(side) = &self.0 {
            return side.reflectance;
        }
        let mut sum = Rgb::BLACK;
        let mut opaque = 0.0;
        for l in self.lobes().iter().filter(|l| !matches!(l.lobe, Lobe::Null)) {
            sum += l.lobe.albedo(l.wo) * l.weight;
            opaque += l.weight;
        }
        if opaque > 0.0 { sum / opaque } else { Rgb::BLACK }
    }

    /// Whether the material is purely Lambertian.
    pub fn is_diffuse(&self) -> bool {
        matches!(self.0, Lobes::Diffuse(_))
    }

    /// Leaves only what does not count as diffuse (see [`BsdfAtHit::diffuse_albedo`]): the values
    /// are then what they were without their diffuse part, and directions are chosen for these
    /// alone.
    pub fn remove_diffuse(&mut self) {
        match &mut self.0 {
            Lobes::Diffuse(side) => side.is_lit = false,
            Lobes::One(only) => only.lobe.remove_diffuse(),
            Lobes::Many(many) => many.lobes.iter_mut().for_each(|l| l.lobe.remove_diffuse()),
        }
    }

    /// The lobes of anything but a [`DiffuseSide`].
    fn lobes(&self) -> &[WeightedLobe<'a>] {
        match &self.0 {
            Lobes::Diffuse(_) => &[],
            Lobes::One(only) => std::slice::from_ref(only),
            Lobes::Many(many) => &many.lobes,
        }
    }
}

impl<'a> ManyLobes<'a> {
    /// A material that scatters nothing.
    pub(super) fn empty() -> Self {
        Self { lobes: ArrayVec::new(), guards: ArrayVec::new() }
    }

    fn eval_lobe(&self, lobe: &WeightedLobe, wi: Vec3) -> LobeEval {
        let local = lobe.frame.to_local(wi);
        let shadowing = self.shadowing(lobe, wi, local.z);
        if shadowing <= 0.0 {
            return LobeEval::ZERO;
        }
        let mut e = lobe.lobe.eval(lobe.wo, local);
        if shadowing < 1.0 {
            e.value *= shadowing;
            e.diffuse *= shadowing;
        }
        e
    }

    /// Chooses a lobe by its weight and stretches the random number for reuse.
    fn choose(&self, u: f32) -> Option<(&WeightedLobe<'a>, f32)> {
        let mut u = u;
        for lobe in &self.lobes {
            if u < lobe.weight {
                return Some((lobe, (u / lobe.weight).min(1.0 - f32::EPSILON / 2.0)));
            }
            u -= lobe.weight;
        }
        // Weights sum to 1 but for rounding: what is left belongs to the last lobe.
        self.lobes.last().map(|lobe| (lobe, 1.0 - f32::EPSILON / 2.0))
    }

    /// What the replaced shading frames leave of light from `wi`: nothing where `wi` is not on
    /// the same side of all normals.
    fn shadowing(&self, lobe: &WeightedLobe, wi: Vec3, cos_local: f32) -> f32 {
        let mut factor = 1.0;
        let mut next = lobe.guard;
        while let Some(i) = next {
            let guard = &self.guards[usize::from(i)];
            factor *= guard.shadowing(wi, cos_local);
            next = guard.outer;
        }
        factor
    }
}

impl WeightedLobe<'_> {
    fn world_sample(&self, s: &LobeSample) -> BsdfSample {
        let is_transmission = s.wi.z * self.wo.z < 0.0;
        BsdfSample {
            wi: self.frame.to_world(s.wi),
            weight: s.weight,
            diffuse_weight: s.diffuse_weight,
            pdf: if s.is_delta { s.pdf * self.weight } else { s.pdf },
            eta: s.eta,
            is_delta: s.is_delta,
            is_null: self.lobe.is_null_sample(is_transmission),
            is_transmission,
        }
    }
}
