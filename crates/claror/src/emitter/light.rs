//! One light at a finite place: sampled and evaluated.

use super::LightSample;
use super::area::Area;
use super::spot::Spot;
use super::tree::Extent;
use crate::interaction::SurfaceInteraction;
use crate::math::{Bounds3, Frame, Vec2, Vec3};
use crate::scene::SceneTables;
use crate::shape::{ShapeId, ShapeKind};
use crate::spectrum::Rgb;
use crate::texture::TextureId;
use std::f32::consts::PI;

/// A light that is chosen as one.
#[derive(Debug, Clone)]
pub(super) enum Light {
    Area(AreaLight),
    Point { position: Vec3, intensity: Rgb },
    Spot(Box<Spot>),
}

/// A light in a line of the cache of its own: among very many, to fetch it from memory is what
/// takes the time.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub(super) struct AlignedLight(pub(super) Light);

const _: () = assert!(size_of::<AlignedLight>() == 64);

/// A shining surface: a shape, or a triangle of a mesh, or two of them.
#[derive(Debug, Clone)]
pub(super) struct AreaLight {
    pub(super) area: Area,
    /// Index of its [`AreaSource`].
    pub(super) source: u32,
    /// Triangle of a mesh.
    pub(super) primitive: u32,
}

/// What all lights of a shape have in common.
#[derive(Debug, Clone)]
pub(super) struct AreaSource {
    pub(super) shape: ShapeId,
    /// Radiance; the mean of the texture where it varies.
    pub(super) radiance: Rgb,
    /// Where the radiance varies.
    pub(super) texture: Option<TextureId>,
}

/// What lights refer to.
#[derive(Debug, Clone, Copy)]
pub(super) struct LightTables<'a> {
    pub(super) scene: &'a SceneTables,
    pub(super) sources: &'a [AreaSource],
}

impl Light {
    /// A direction towards the light. `probability` is that of the light's choice.
    pub(super) fn sample(
        &self,
        tables: LightTables,
        from: Vec3,
        u: Vec2,
        probability: f32,
    ) -> Option<LightSample> {
        match self {
            Self::Area(light) => light.sample(tables, from, u, probability),
            Self::Point { position, intensity } => {
                from_point(*position, from, |_| Some(*intensity), probability)
            }
            Self::Spot(spot) => {
                let intensity = |d: Vec3| {
                    let (share, uv) = spot.falloff(d)?;
                    let color = spot.texture.map_or(Rgb::WHITE, |id| {
                        tables.scene.textures.rgb(&tables.scene.shapes, id, &bare_interaction(uv))
                    });
                    Some(spot.intensity * color * share)
                };
                from_point(spot.position, from, intensity, probability)
            }
        }
    }

    /// Where it is and where it shines to.
    pub(super) fn extent(&self) -> Extent {
        match self {
            Self::Area(light) => light.area.extent(),
            Self::Point { position, .. } => Extent {
                bounds: Bounds3 { min: *position, max: *position },
                axis: Vec3::Z,
                cos_normals: -1.0,
                cos_emission: 0.0,
            },
            Self::Spot(spot) => spot.extent(),
        }
    }

    /// Intensity (W·sr⁻¹) in the direction in which most is emitted, about; mean of the channels.
    pub(super) fn intensity(&self, tables: LightTables) -> f32 {
        let intensity = match self {
            Self::Area(light) => {
                let area = light.area.area();
                let turned_to_one_side = match light.area {
                    Area::Triangle(_)
                    | Area::SmoothTriangle(_)
                    | Area::Parallelogram(_)
                    | Area::Disk(_) => area,
                    // A convex body's mean projection is a quarter of its surface (Cauchy).
                    Area::Ellipsoid(_) | Area::Cylinder(_) => 0.25 * area,
                };
                tables.sources[light.source as usize].radiance.mean() * turned_to_one_side
            }
            Self::Point { intensity, .. } => intensity.mean(),
            Self::Spot(spot) => {
                let mean = |id| tables.scene.textures.mean(&tables.scene.shapes, id);
                (spot.intensity * spot.texture.map_or(Rgb::WHITE, mean)).mean()
            }
        };
        if intensity.is_finite() { intensity.max(0.0) } else { 0.0 }
    }

    /// Power (W), about; mean of the channels.
    pub(super) fn power(&self, tables: LightTables) -> f32 {
        let solid_angle = match self {
            Self::Area(light) => match light.area {
                Area::Ellipsoid(_) | Area::Cylinder(_) => 4.0 * PI,
                _ => PI,
            },
            Self::Point { .. } => 4.0 * PI,
            Self::Spot(spot) => 2.0 * PI * (1.0 - spot.extent().cos_emission),
        };
        self.intensity(tables) * solid_angle
    }
}

/// Light from a point that shines with an intensity by direction.
fn from_point(
    position: Vec3,
    from: Vec3,
    intensity: impl FnOnce(Vec3) -> Option<Rgb>,
    probability: f32,
) -> Option<LightSample> {
    let to_light = position - from;
    let distance2 = to_light.length_squared();
    let distance = distance2.sqrt();
    let wi = to_light / distance;
    if !wi.is_finite() {
        return None;
    }
    Some(LightSample {
        wi,
        distance,
        radiance: intensity(-wi)? / distance2,
        pdf: probability,
        is_delta: true,
        target: Some((position, Vec3::ZERO)),
    })
}

impl AreaLight {
    fn sample(
        &self,
        tables: LightTables,
        from: Vec3,
        u: Vec2,
        probability: f32,
    ) -> Option<LightSample> {
        let sample = self.area.sample(from, u)?;
        let (tables, source) = (tables.scene, &tables.sources[self.source as usize]);
        if self.is_smooth()
            && self.shading_normal(tables, source.shape, sample.uv).dot(sample.wi) >= 0.0
        {
            return None;
        }
        let radiance = match source.texture {
            None => source.radiance,
            Some(id) => {
                let si = self.interaction(tables, source.shape, sample.uv);
                tables.textures.rgb(&tables.shapes, id, &si)
            }
        };
        // Off the surface, to the side of the reference; the farther that is, the less exact is
        // the light's place as a ray from there sees it.
        let away = sample.error + super::area::ROUNDING * sample.distance;
        let offset = sample.n * away.copysign(-sample.n.dot(sample.wi));
        Some(LightSample {
            wi: sample.wi,
            distance: sample.distance,
            radiance,
            pdf: sample.pdf * probability,
            is_delta: false,
            target: Some((sample.p, offset)),
        })
    }

    /// Whether the shading normal decides where it shines to.
    fn is_smooth(&self) -> bool {
        matches!(self.area, Area::SmoothTriangle(_))
    }

    /// The normal, not normalised, that the mesh interpolates at these barycentrics.
    fn shading_normal(&self, tables: &SceneTables, id: ShapeId, barycentric: Vec2) -> Vec3 {
        let shape = &tables.shapes.shapes[id.0 as usize];
        let ShapeKind::Mesh(mesh) = shape.kind else { return Vec3::ZERO };
        let mesh = &tables.shapes.meshes[mesh.0 as usize];
        let [a, b, c] =
            mesh.triangles[self.primitive as usize].map(|vertex| mesh.normals[vertex as usize]);
        let Vec2 { x: u, y: v } = barycentric;
        let n = a * (1.0 - u - v) + b * u + c * v;
        if shape.flip_normals { -n } else { n }
    }

    /// What a texture needs to know about the point with these parameters.
    fn interaction(
        &self,
        tables: &SceneTables,
        id: ShapeId,
        parameters: Vec2,
    ) -> SurfaceInteraction {
        let mut uv = parameters;
        let shape = &tables.shapes.shapes[id.0 as usize];
        if let ShapeKind::Mesh(mesh) = shape.kind {
            let mesh = &tables.shapes.meshes[mesh.0 as usize];
            if !mesh.uvs.is_empty() {
                let [a, b, c] =
                    mesh.triangles[self.primitive as usize].map(|v| mesh.uvs[v as usize]);
                uv = a * (1.0 - uv.x - uv.y) + b * uv.x + c * uv.y;
            }
        }
        SurfaceInteraction {
            shape: id,
            primitive: self.primitive,
            barycentric: parameters,
            ..bare_interaction(uv)
        }
    }
}

/// A surface point of which nothing is known but its texture coordinates.
fn bare_interaction(uv: Vec2) -> SurfaceInteraction {
    SurfaceInteraction {
        p: Vec3::ZERO,
        offset: 0.0,
        ng: Vec3::Z,
        frame: Frame { s: Vec3::X, t: Vec3::Y, n: Vec3::Z },
        uv,
        derivatives: None,
        wo: Vec3::Z,
        t: 0.0,
        shape: ShapeId(0),
        primitive: 0,
        barycentric: uv,
        instance: None,
    }
}
