//! From a material's description to its lobes at a point: textures are read, adapters
//! (`twosided`, `mask`, `blendbsdf`, `bumpmap`, `normalmap`) are resolved.

use super::at_hit::{BsdfAtHit, WeightedLobe};
use super::conductor::Conductor;
use super::dielectric::{Dielectric, ThinDielectric};
use super::diffuse::Diffuse;
use super::lobe::Lobe;
use super::{Bsdf, BsdfId, BsdfTable};
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
    /// Shading frame here.
    frame: Frame,
    /// Towards the viewer, in that frame.
    wo: Vec3,
    /// The guards so far: first and count.
    guards: (u8, u8),
}

/// Reads one material at one point.
struct Reader<'a> {
    bsdfs: &'a BsdfTable,
    textures: &'a TextureTable,
    shapes: &'a ShapeTable,
    si: &'a SurfaceInteraction,
    result: BsdfAtHit,
}

impl BsdfTable {
    /// The material `id` at the point `si`, seen from `si.wo`.
    pub fn at_hit(
        &self,
        textures: &TextureTable,
        shapes: &ShapeTable,
        id: BsdfId,
        si: &SurfaceInteraction,
    ) -> BsdfAtHit {
        let place =
            Place { weight: 1.0, frame: si.frame, wo: si.frame.to_local(si.wo), guards: (0, 0) };
        let mut reader = Reader { bsdfs: self, textures, shapes, si, result: BsdfAtHit::empty() };
        reader.read(id, place);
        reader.result
    }
}

impl Reader<'_> {
    fn rgb(&self, id: TextureId) -> Rgb {
        self.textures.rgb(self.shapes, id, self.si)
    }

    fn scalar(&self, id: TextureId) -> f32 {
        self.textures.scalar(self.shapes, id, self.si)
    }

    fn read(&mut self, id: BsdfId, place: Place) {
        match &self.bsdfs.bsdfs[id.0 as usize] {
            Bsdf::TwoSided { front, back } => self.read_two_sided(*front, *back, place),
            Bsdf::Mask { opacity, nested } => {
                let opacity = self.scalar(*opacity).clamp(0.0, 1.0);
                self.read(*nested, Place { weight: place.weight * opacity, ..place });
                self.push(Lobe::Null, Place { weight: place.weight * (1.0 - opacity), ..place });
            }
            Bsdf::Blend { weight, first, second } => {
                let share = self.scalar(*weight).clamp(0.0, 1.0);
                self.read(*first, Place { weight: place.weight * (1.0 - share), ..place });
                self.read(*second, Place { weight: place.weight * share, ..place });
            }
            Bsdf::BumpMap { nested, .. } | Bsdf::NormalMap { nested, .. } => {
                self.read(*nested, place);
            }
            model => {
                let lobe = self.lobe(model);
                self.push(lobe, place);
            }
        }
    }

    /// Behind the surface the normal alone turns round: directions are mirrored at the tangent
    /// plane, as in Mitsuba.
    fn read_two_sided(&mut self, front: BsdfId, back: BsdfId, place: Place) {
        if place.wo.z > 0.0 {
            self.read(front, place);
        } else if place.wo.z < 0.0 {
            let frame = Frame { n: -place.frame.n, ..place.frame };
            let wo = Vec3::new(place.wo.x, place.wo.y, -place.wo.z);
            self.read(back, Place { frame, wo, ..place });
        }
    }

    fn push(&mut self, lobe: Lobe, place: Place) {
        if place.weight > 0.0 {
            let Place { weight, frame, wo, guards } = place;
            self.result.lobes.push(WeightedLobe { weight, guards, frame, wo, lobe });
        }
    }

    fn lobe(&self, model: &Bsdf) -> Lobe {
        match model {
            Bsdf::Diffuse { reflectance } => {
                Lobe::Diffuse(Diffuse { reflectance: self.rgb(*reflectance) })
            }
            Bsdf::Conductor { eta, k, specular_reflectance } => Lobe::Conductor(Conductor {
                eta: self.rgb(*eta),
                k: self.rgb(*k),
                specular_reflectance: self.rgb(*specular_reflectance),
            }),
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
            Bsdf::Null => Lobe::Null,
            // Models that are still to come look grey.
            _ => Lobe::Diffuse(Diffuse { reflectance: Rgb::splat(0.5) }),
        }
    }
}
