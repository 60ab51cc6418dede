//! Small scenes of one material for the tests.

use crate::bsdf::{Bsdf, BsdfAtHit, BsdfId, BsdfTable};
use crate::interaction::SurfaceInteraction;
use crate::math::{Frame, Vec2, Vec3};
use crate::shape::{ShapeId, ShapeTable};
use crate::spectrum::Rgb;
use crate::texture::{Texture, TextureId, TextureTable};

/// A table of materials under construction, with constant textures.
#[derive(Default)]
pub(crate) struct Materials {
    pub(crate) textures: TextureTable,
    pub(crate) table: BsdfTable,
}

impl Materials {
    /// A constant colour.
    pub(crate) fn rgb(&mut self, c: [f32; 3]) -> TextureId {
        self.textures.textures.push(Texture::Constant(Rgb::from(c)));
        TextureId(self.textures.textures.len() as u32 - 1)
    }

    /// A constant number.
    pub(crate) fn scalar(&mut self, v: f32) -> TextureId {
        self.rgb([v; 3])
    }

    /// Adds a material.
    pub(crate) fn add(&mut self, bsdf: Bsdf) -> BsdfId {
        self.table.bsdfs.push(bsdf);
        BsdfId(self.table.bsdfs.len() as u32 - 1)
    }

    /// To be called after the last material was added.
    pub(crate) fn prepare(&mut self) {
        self.table.prepare(&self.textures, &ShapeTable::default()).expect("a valid table");
    }

    /// The material at a point, seen from `wo`; the shading frame is the coordinate axes.
    pub(crate) fn at(&self, id: BsdfId, wo: Vec3) -> BsdfAtHit<'_> {
        self.table.at_hit(&self.textures, &ShapeTable::default(), id, &interaction(wo))
    }
}

/// A point of the plane z = 0, seen from `wo`.
pub(crate) fn interaction(wo: Vec3) -> SurfaceInteraction {
    SurfaceInteraction {
        p: Vec3::ZERO,
        offset: 0.0,
        ng: Vec3::Z,
        frame: Frame { s: Vec3::X, t: Vec3::Y, n: Vec3::Z },
        uv: Vec2::new(0.3, 0.4),
        derivatives: None,
        wo,
        t: 1.0,
        shape: ShapeId(0),
        primitive: 0,
        barycentric: Vec2::ZERO,
        instance: None,
    }
}
