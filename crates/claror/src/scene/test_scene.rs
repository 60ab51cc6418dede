//! Small scenes for tests.

use super::{Scene, SceneTables};
use crate::bsdf::{Bsdf, BsdfId};
use crate::emitter::{Emitter, EmitterId};
use crate::film::{CropWindow, FilmSettings, FilterKind};
use crate::math::{DAffine3, DVec3, Transform, Vec2, Vec3};
use crate::sampler::{SamplerKind, SamplerSettings};
use crate::sensor::{Sensor, SensorKind};
use crate::shape::{Mesh, MeshId, Shape, ShapeId, ShapeKind};
use crate::spectrum::Rgb;
use crate::texture::{Texture, TextureId};

/// Puts a scene together.
#[derive(Default)]
pub(crate) struct TestScene {
    pub(crate) tables: SceneTables,
}

impl TestScene {
    pub(crate) fn color(&mut self, color: Rgb) -> TextureId {
        self.tables.textures.textures.push(Texture::Constant(color));
        TextureId(self.tables.textures.textures.len() as u32 - 1)
    }

    pub(crate) fn bsdf(&mut self, bsdf: Bsdf) -> BsdfId {
        self.tables.bsdfs.bsdfs.push(bsdf);
        BsdfId(self.tables.bsdfs.bsdfs.len() as u32 - 1)
    }

    pub(crate) fn diffuse(&mut self, reflectance: Rgb) -> BsdfId {
        let reflectance = self.color(reflectance);
        self.bsdf(Bsdf::Diffuse { reflectance })
    }

    /// A smooth conductor that reflects everything.
    pub(crate) fn mirror(&mut self) -> BsdfId {
        let (eta, k) = (self.color(Rgb::BLACK), self.color(Rgb::WHITE));
        self.bsdf(Bsdf::Conductor { eta, k, specular_reflectance: k })
    }

    pub(crate) fn shape(&mut self, kind: ShapeKind, bsdf: BsdfId) -> ShapeId {
        let shape = Shape { kind, bsdf, emitter: None, flip_normals: false };
        self.tables.shapes.shapes.push(shape);
        ShapeId(self.tables.shapes.shapes.len() as u32 - 1)
    }

    pub(crate) fn emit(&mut self, shape: ShapeId, radiance: Rgb) {
        let radiance = self.color(radiance);
        self.tables.emitters.emitters.push(Emitter::Area { shape, radiance });
        let id = EmitterId(self.tables.emitters.emitters.len() as u32 - 1);
        self.tables.shapes.shapes[shape.0 as usize].emitter = Some(id);
    }

    /// The cube [-1, 1]³ with its normals inwards.
    pub(crate) fn room(&mut self, bsdf: BsdfId) -> ShapeId {
        let corner = |i: u32| {
            let side = |bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
            Vec3::new(side(0), side(1), side(2))
        };
        let mut mesh = Mesh { positions: (0..8).map(corner).collect(), ..Default::default() };
        // Each face as seen from outside counter-clockwise, then turned around.
        for [a, b, c, d] in
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
        {
            mesh.triangles.extend([[a, c, b], [a, d, c]]);
        }
        self.tables.shapes.meshes.push(mesh);
        let id = MeshId(self.tables.shapes.meshes.len() as u32 - 1);
        self.shape(ShapeKind::Mesh(id), bsdf)
    }

    /// A square camera of `pixels`² pixels at `from`, looking along `to − from`.
    pub(crate) fn camera(&mut self, from: DVec3, to: DVec3, fov_degrees: f32, pixels: u32) {
        let z = (to - from).normalize();
        let x = z.any_orthonormal_vector();
        let axes = crate::math::DMat3::from_cols(x, z.cross(x), z);
        let place = DAffine3::from_mat3_translation(axes, from);
        self.tables.sensors.push(Sensor {
            name: String::new(),
            kind: SensorKind::Perspective {
                fov_x: fov_degrees.to_radians(),
                principal_point_offset: Vec2::ZERO,
            },
            to_world: Transform::new(place).unwrap(),
            near_clip: 1e-3,
            far_clip: 1e4,
            film: FilmSettings {
                width: pixels,
                height: pixels,
                crop: CropWindow { x: 0, y: 0, width: pixels, height: pixels },
                filter: FilterKind::Box { radius: 0.5 },
                alpha: true,
            },
            sampler: SamplerSettings { kind: SamplerKind::Sobol, sample_count: 16, seed: 1 },
        });
    }

    pub(crate) fn build(self) -> Scene {
        Scene::build(self.tables).unwrap()
    }
}

/// Local → world: scaled, then turned so that +z becomes `z`, then moved to `center`.
pub(crate) fn place(center: DVec3, z: DVec3, scale: DVec3) -> Transform {
    let z = z.normalize();
    let x = z.any_orthonormal_vector();
    let axes = crate::math::DMat3::from_cols(x * scale.x, z.cross(x) * scale.y, z * scale.z);
    Transform::new(DAffine3::from_mat3_translation(axes, center)).unwrap()
}

/// A room of grey walls, a coloured one, a lamp, a mirror sphere and a diffuse one.
pub(crate) fn mixed_room(pixels: u32) -> TestScene {
    let mut t = TestScene::default();
    let grey = t.diffuse(Rgb::new(0.7, 0.6, 0.5));
    let black = t.diffuse(Rgb::BLACK);
    let mirror = t.mirror();
    t.room(grey);
    let lamp = place(DVec3::new(0.0, 0.99, 0.0), -DVec3::Y, DVec3::splat(0.3));
    let lamp = t.shape(ShapeKind::Rectangle(lamp), black);
    t.emit(lamp, Rgb::new(9.0, 8.0, 7.0));
    let ball = |x: f64| place(DVec3::new(x, -0.6, 0.2), DVec3::Z, DVec3::splat(0.4));
    t.shape(ShapeKind::Sphere(ball(-0.45)), mirror);
    t.shape(ShapeKind::Sphere(ball(0.45)), grey);
    t.camera(DVec3::new(0.0, 0.0, -0.95), DVec3::new(0.0, 0.1, 1.0), 110.0, pixels);
    t
}
