//! From a material's description to its lobes at a point: textures are read, adapters
//! (`twosided`, `mask`, `blendbsdf`, `bumpmap`, `normalmap`) are resolved.

use super::at_hit::{BsdfAtHit, DiffuseSide, Lobes, ManyLobes, WeightedLobe};
use super::conductor::Conductor;
use super::dielectric::{Dielectric, ThinDielectric};
use super::diffuse::Diffuse;
use super::lobe::Lobe;
use super::microfacet::Microfacets;
use super::perturb::{self, Guard};
use super::plastic::{Plastic, base_reflectance};
use super::prepare::DiffuseSides;
use super::principled::PrincipledLobe;
use super::rough_conductor::RoughConductor;
use super::rough_dielectric::RoughDielectric;
use super::rough_plastic::RoughPlastic;
use super::{Bsdf, BsdfId, BsdfTable, PerturbationOptions, Principled};
use crate::interaction::SurfaceInteraction;
use crate::math::{Frame, Vec3};
use crate::shape::ShapeTable;
use crate::spectrum::Rgb;
use crate::texture::{TextureId, TextureTable};

/// Where in the tree of nested materials the reader stands.
#[derive(Clone, Copy)]
struct Place {
    /// Share of what is read here.
    weight: f32,
    /// The frame that directions are expressed in here.
    frame: Frame,
    /// The same without the turns of `twosided`: in it normal and bump maps are made.
    shading: Frame,
    /// Towards the viewer, in `frame`.
    wo: Vec3,
    /// The innermost guard so far.
    guard: Option<u8>,
}

/// Reads one material at one point.
struct Reader<'a> {
    textures: &'a TextureTable,
    shapes: &'a ShapeTable,
    si: &'a SurfaceInteraction,
}

impl BsdfTable {
    /// The material `id` at the point `si`, seen from `si.wo`. The table must have been
    /// [prepared](BsdfTable::prepare).
    pub fn at_hit(
        &self,
        textures: &TextureTable,
        shapes: &ShapeTable,
        id: BsdfId,
        si: &SurfaceInteraction,
    ) -> BsdfAtHit<'_> {
        let mut result = BsdfAtHit::empty();
        self.read_at_hit(textures, shapes, id, si, &mut result);
        result
    }

    /// The same into a place of the caller's, which spares the copy of a large result.
    pub fn read_at_hit<'a>(
        &'a self,
        textures: &TextureTable,
        shapes: &ShapeTable,
        id: BsdfId,
        si: &SurfaceInteraction,
        result: &mut BsdfAtHit<'a>,
    ) {
        let reader = Reader { textures, shapes, si };
        if let Some(sides) = self.diffuse_sides(id) {
            // Assigned alone: a choice between variants would be made elsewhere and copied whole.
            if let Some(side) = reader.diffuse(sides) {
                result.0 = Lobes::Diffuse(side);
                return;
            }
        }
        let wo = si.frame.to_local(si.wo);
        let place = Place { weight: 1.0, frame: si.frame, shading: si.frame, wo, guard: None };
        if let Some(lobe) = self.single(&reader, id, place) {
            result.0 = Lobes::One(lobe);
            return;
        }
        result.0 = Lobes::Many(ManyLobes::empty());
        if let Lobes::Many(many) = &mut result.0 {
            self.read(&reader, id, place, many);
        }
    }

    /// The only lobe of the material `id`, where it is nothing but a model, `twosided` or not.
    fn single(&self, reader: &Reader, id: BsdfId, place: Place) -> Option<WeightedLobe<'_>> {
        let (mut id, mut place) = (id, place);
        while let Bsdf::TwoSided { front, back } = &self.bsdfs[id.0 as usize] {
            let (turned, is_behind) = place.turned_to_viewer()?;
            (id, place) = (if is_behind { *back } else { *front }, turned);
        }
        let model = &self.bsdfs[id.0 as usize];
        (!model.is_adapter()).then(|| place.lobe(self.lobe(reader, id, model)))
    }

    /// Adds the lobes of the material `id`.
    fn read<'a>(&'a self, reader: &Reader, id: BsdfId, place: Place, result: &mut ManyLobes<'a>) {
        if place.weight <= 0.0 {
            return;
        }
        match &self.bsdfs[id.0 as usize] {
            Bsdf::TwoSided { front, back } => {
                let Some((place, is_behind)) = place.turned_to_viewer() else { return };
                self.read(reader, if is_behind { *back } else { *front }, place, result);
            }
            Bsdf::Mask { opacity, nested } => {
                let opacity = reader.scalar(*opacity).clamp(0.0, 1.0);
                self.read(reader, *nested, place.share(opacity), result);
                result.push(Lobe::Null, place.share(1.0 - opacity));
            }
            Bsdf::Blend { weight, first, second } => {
                let weight = reader.scalar(*weight).clamp(0.0, 1.0);
                self.read(reader, *first, place.share(1.0 - weight), result);
                self.read(reader, *second, place.share(weight), result);
            }
            Bsdf::BumpMap { displacement, scale, nested, options } => {
                let gradient =
                    reader.textures.gradient(reader.shapes, *displacement, reader.si) * *scale;
                let frame =
                    perturb::bump_map(gradient, reader.si, &place.shading, place.wo, *options);
                self.read(reader, *nested, place.perturbed(&frame, *options, result), result);
            }
            Bsdf::NormalMap { normal, nested, options } => {
                let frame = perturb::normal_map(reader.rgb(*normal), place.wo, *options);
                self.read(reader, *nested, place.perturbed(&frame, *options, result), result);
            }
            model => result.push(self.lobe(reader, id, model), place),
        }
    }

    fn lobe(&self, reader: &Reader, id: BsdfId, model: &Bsdf) -> Lobe<'_> {
        match model {
            Bsdf::Diffuse { reflectance } => {
                Lobe::Diffuse(Diffuse { reflectance: reader.rgb(*reflectance) })
            }
            Bsdf::Conductor { .. } | Bsdf::RoughConductor { .. } => reader.metal(model),
            Bsdf::Dielectric { .. }
            | Bsdf::ThinDielectric { .. }
            | Bsdf::RoughDielectric { .. } => reader.glass(model),
            Bsdf::Plastic { .. } | Bsdf::RoughPlastic { .. } => self.plastic(reader, id, model),
            Bsdf::Principled(p) => Lobe::Principled(reader.principled(p)),
            Bsdf::Null => Lobe::Null,
            Bsdf::TwoSided { .. }
            | Bsdf::Mask { .. }
            | Bsdf::Blend { .. }
            | Bsdf::BumpMap { .. }
            | Bsdf::NormalMap { .. } => unreachable!("adapters are resolved before"),
        }
    }

    fn plastic(&self, reader: &Reader, id: BsdfId, model: &Bsdf) -> Lobe<'_> {
        match model {
            Bsdf::Plastic { eta, diffuse_reflectance, specular_reflectance, nonlinear } => {
                let constants = *self.plastic_constants(id);
                let diffuse = reader.rgb(*diffuse_reflectance);
                let internal = constants.internal_reflectance;
                Lobe::Plastic(Plastic {
                    eta: *eta,
                    constants,
                    diffuse_reflectance: diffuse,
                    base: base_reflectance(diffuse, internal, *nonlinear, *eta),
                    specular_reflectance: reader.rgb(*specular_reflectance),
                })
            }
            Bsdf::RoughPlastic {
                distribution,
                sample_visible,
                alpha,
                eta,
                diffuse_reflectance,
                specular_reflectance,
                nonlinear,
            } => {
                let (transmittance, specular_sampling_weight) = self.rough_transmittance(id);
                let diffuse = reader.rgb(*diffuse_reflectance);
                let internal = transmittance.internal_reflectance;
                Lobe::RoughPlastic(RoughPlastic {
                    facets: Microfacets::new(*distribution, *sample_visible, *alpha, *alpha),
                    eta: *eta,
                    diffuse_reflectance: diffuse,
                    base: base_reflectance(diffuse, internal, *nonlinear, *eta),
                    specular_reflectance: reader.rgb(*specular_reflectance),
                    specular_sampling_weight,
                    transmittance,
                })
            }
            _ => unreachable!("only plastics come here"),
        }
    }
}

impl Bsdf {
    /// Whether the material changes others and scatters nothing itself.
    fn is_adapter(&self) -> bool {
        matches!(
            self,
            Self::TwoSided { .. }
                | Self::Mask { .. }
                | Self::Blend { .. }
                | Self::BumpMap { .. }
                | Self::NormalMap { .. }
        )
    }
}

impl Place {
    fn lobe(self, lobe: Lobe) -> WeightedLobe {
        let Self { weight, frame, wo, guard, .. } = self;
        WeightedLobe { weight, guard, frame, wo, lobe }
    }

    fn share(self, weight: f32) -> Self {
        Self { weight: self.weight * weight, ..self }
    }

    /// The place as `twosided` shows it to what it holds, and whether the viewer is behind.
    /// There the normal alone turns round: directions are mirrored at the tangent plane, as in
    /// Mitsuba. `None` for a viewer in the tangent plane.
    fn turned_to_viewer(self) -> Option<(Self, bool)> {
        if self.wo.z > 0.0 {
            Some((self, false))
        } else if self.wo.z < 0.0 {
            let frame = Frame { n: -self.frame.n, ..self.frame };
            let wo = Vec3::new(self.wo.x, self.wo.y, -self.wo.z);
            Some((Self { frame, wo, ..self }, true))
        } else {
            None
        }
    }

    /// The place inside a bump or normal map whose frame, relative to this place's, is `local`.
    fn perturbed(
        self,
        local: &Frame,
        options: PerturbationOptions,
        result: &mut ManyLobes,
    ) -> Self {
        let guard = result.guards.len() as u8;
        result.guards.push(Guard::new(self.guard, self.frame.n, local.n, options));
        Self {
            frame: turned(&self.frame, local),
            shading: turned(&self.shading, local),
            wo: local.to_local(self.wo),
            guard: Some(guard),
            ..self
        }
    }
}

/// The frame whose axes are those of `local`, expressed in `frame`.
fn turned(frame: &Frame, local: &Frame) -> Frame {
    Frame { s: frame.to_world(local.s), t: frame.to_world(local.t), n: frame.to_world(local.n) }
}

impl<'a> ManyLobes<'a> {
    fn push(&mut self, lobe: Lobe<'a>, place: Place) {
        if place.weight > 0.0 {
            self.lobes.push(place.lobe(lobe));
        }
    }
}

impl Reader<'_> {
    /// The side of a Lambertian surface that the viewer sees; `None` in its tangent plane where it
    /// has two.
    #[inline]
    fn diffuse(&self, sides: DiffuseSides) -> Option<DiffuseSide> {
        let cos = self.si.frame.n.dot(self.si.wo);
        let mut frame = self.si.frame;
        if cos <= 0.0 {
            frame.n = -frame.n;
        }
        let (reflectance, is_lit) = match sides.back {
            Some(back) if cos < 0.0 => (back, true),
            Some(_) if cos == 0.0 => return None,
            _ => (sides.front, cos > 0.0),
        };
        Some(DiffuseSide { frame, reflectance: self.rgb(reflectance), is_lit })
    }

    fn rgb(&self, id: TextureId) -> Rgb {
        self.textures.rgb(self.shapes, id, self.si)
    }

    fn scalar(&self, id: TextureId) -> f32 {
        self.textures.scalar(self.shapes, id, self.si)
    }

    fn metal(&self, model: &Bsdf) -> Lobe<'static> {
        match model {
            Bsdf::Conductor { eta, k, specular_reflectance } => Lobe::Conductor(Conductor {
                eta: self.rgb(*eta),
                k: self.rgb(*k),
                specular_reflectance: self.rgb(*specular_reflectance),
            }),
            Bsdf::RoughConductor {
                distribution,
                sample_visible,
                alpha_u,
                alpha_v,
                eta,
                k,
                specular_reflectance,
            } => Lobe::RoughConductor(RoughConductor {
                facets: Microfacets::new(
                    *distribution,
                    *sample_visible,
                    self.scalar(*alpha_u),
                    self.scalar(*alpha_v),
                ),
                eta: self.rgb(*eta),
                k: self.rgb(*k),
                specular_reflectance: self.rgb(*specular_reflectance),
            }),
            _ => unreachable!("only metals come here"),
        }
    }

    fn glass(&self, model: &Bsdf) -> Lobe<'static> {
        match model {
            Bsdf::Dielectric { eta, specular_reflectance, specular_transmittance } => {
                Lobe::Dielectric(Dielectric {
                    eta: *eta,
                    specular_reflectance: self.rgb(*specular_reflectance),
                    specular_transmittance: self.rgb(*specular_transmittance),
                })
            }
            Bsdf::ThinDielectric { eta, specular_reflectance, specular_transmittance } => {
                Lobe::ThinDielectric(ThinDielectric {
                    eta: *eta,
                    specular_reflectance: self.rgb(*specular_reflectance),
                    specular_transmittance: self.rgb(*specular_transmittance),
                })
            }
            Bsdf::RoughDielectric {
                distribution,
                sample_visible,
                alpha_u,
                alpha_v,
                eta,
                specular_reflectance,
                specular_transmittance,
            } => Lobe::RoughDielectric(RoughDielectric {
                facets: Microfacets::new(
                    *distribution,
                    *sample_visible,
                    self.scalar(*alpha_u),
                    self.scalar(*alpha_v),
                ),
                eta: *eta,
                specular_reflectance: self.rgb(*specular_reflectance),
                specular_transmittance: self.rgb(*specular_transmittance),
            }),
            _ => unreachable!("only dielectrics come here"),
        }
    }

    fn principled(&self, p: &Principled) -> PrincipledLobe {
        let spec_trans = self.scalar(p.spec_trans);
        PrincipledLobe {
            base_color: self.rgb(p.base_color),
            roughness: self.scalar(p.roughness),
            anisotropic: self.scalar(p.anisotropic),
            metallic: self.scalar(p.metallic),
            spec_trans,
            spec_tint: self.scalar(p.spec_tint),
            sheen: self.scalar(p.sheen),
            sheen_tint: self.scalar(p.sheen_tint),
            flatness: self.scalar(p.flatness),
            clearcoat: self.scalar(p.clearcoat),
            clearcoat_gloss: self.scalar(p.clearcoat_gloss),
            // Without a change of index there would be no half vector of refraction.
            eta: if spec_trans > 0.0 && p.eta == 1.0 { 1.001 } else { p.eta },
            diffuse_rate: p.diffuse_reflectance_sampling_rate,
            specular_rate: p.main_specular_sampling_rate,
            clearcoat_rate: p.clearcoat_sampling_rate,
        }
    }
}
