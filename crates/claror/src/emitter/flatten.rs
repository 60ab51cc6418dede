//! From emitters to lights: each triangle of a shining mesh is a light of its own, but two
//! coplanar ones that make a parallelogram are one.

use super::area::{Area, Cylinder, Disk, Ellipsoid, Parallelogram, SmoothTriangle, Triangle};
use super::light::{AlignedLight, AreaLight, AreaSource, Light, LightTables};
use super::spot::Spot;
use super::{Emitter, EmitterTable};
use crate::math::Vec3;
use crate::scene::SceneTables;
use crate::shape::{Mesh, Shape, ShapeId, ShapeKind};
use crate::texture::TextureId;

/// Marks a primitive without light.
pub(super) const NO_LIGHT: u32 = u32::MAX;

/// All lights at finite places, and which of them a primitive belongs to.
#[derive(Debug, Clone, Default)]
pub(super) struct FlatLights {
    pub(super) lights: Vec<AlignedLight>,
    /// What the shining shapes are.
    sources: Vec<AreaSource>,
    /// Per shape, where its primitives begin in `light_of`; `NO_LIGHT` for dark shapes.
    first_of_shape: Vec<u32>,
    light_of: Vec<u32>,
}

impl FlatLights {
    pub(super) fn new(tables: &SceneTables) -> Self {
        let mut flat =
            Self { first_of_shape: vec![NO_LIGHT; tables.shapes.shapes.len()], ..Self::default() };
        let EmitterTable { emitters } = &tables.emitters;
        for emitter in emitters {
            match *emitter {
                Emitter::Area { shape, radiance } => flat.add_shape(tables, shape, radiance),
                Emitter::Point { position, intensity } => {
                    flat.add_light(Light::Point { position, intensity });
                }
                Emitter::Spot { ref to_world, intensity, cutoff_angle, beam_width, texture } => {
                    let spot = Spot::new(to_world, intensity, cutoff_angle, beam_width, texture);
                    flat.add_light(Light::Spot(Box::new(spot)));
                }
                Emitter::Directional { .. }
                | Emitter::Constant { .. }
                | Emitter::Envmap { .. }
                | Emitter::SunDisc { .. } => {}
            }
        }
        flat
    }

    /// What the lights refer to, in a scene with these tables.
    pub(super) fn tables<'a>(&'a self, scene: &'a SceneTables) -> LightTables<'a> {
        LightTables { scene, sources: &self.sources }
    }

    /// Whether the radiance of this source is the same everywhere.
    pub(super) fn is_uniform(&self, source: u32) -> bool {
        self.sources[source as usize].texture.is_none()
    }

    /// The light that this primitive of a shape belongs to.
    pub(super) fn light_of(&self, shape: ShapeId, primitive: u32) -> Option<usize> {
        let first = self.first_of_shape[shape.0 as usize];
        if first == NO_LIGHT {
            return None;
        }
        let light = self.light_of[(first + primitive) as usize];
        (light != NO_LIGHT).then_some(light as usize)
    }

    /// Puts the lights into the order of these numbers of theirs.
    pub(super) fn reorder(&mut self, order: &[u32]) {
        let mut new = vec![NO_LIGHT; order.len()];
        for (i, &old) in order.iter().enumerate() {
            new[old as usize] = i as u32;
        }
        for light in self.light_of.iter_mut().filter(|light| **light != NO_LIGHT) {
            *light = new[*light as usize];
        }
        self.lights = order.iter().map(|&old| self.lights[old as usize].clone()).collect();
    }

    fn add_shape(&mut self, tables: &SceneTables, id: ShapeId, radiance: TextureId) {
        let shape = &tables.shapes.shapes[id.0 as usize];
        let constant = tables.textures.constant(radiance);
        self.sources.push(AreaSource {
            shape: id,
            radiance: constant.unwrap_or_else(|| tables.textures.mean(&tables.shapes, radiance)),
            texture: constant.is_none().then_some(radiance),
        });
        self.first_of_shape[id.0 as usize] = self.light_of.len() as u32;
        match shape.kind {
            ShapeKind::Mesh(mesh) => {
                self.add_mesh(&tables.shapes.meshes[mesh.0 as usize], shape, constant.is_none());
            }
            _ => self.add(analytic_area(tables, id), 0),
        }
    }

    /// Adds a light for the next primitive of the last source; none when its surface is not usable.
    fn add(&mut self, area: Option<Area>, primitive: u32) {
        let index = self.lights.len() as u32;
        self.light_of.push(if area.is_some() { index } else { NO_LIGHT });
        let source = self.sources.len() as u32 - 1;
        if let Some(area) = area {
            self.add_light(Light::Area(AreaLight { area, source, primitive }));
        }
    }

    fn add_light(&mut self, light: Light) {
        self.lights.push(AlignedLight(light));
    }

    fn add_mesh(&mut self, mesh: &Mesh, shape: &Shape, is_textured: bool) {
        let count = mesh.triangles.len() as u32;
        let mut primitive = 0;
        while primitive < count {
            // A texture would need the parameters of either triangle.
            if !is_textured
                && primitive + 1 < count
                && let Some(area) = merged(mesh, shape, primitive)
            {
                self.add(Some(Area::Parallelogram(area)), primitive);
                self.light_of.push(self.lights.len() as u32 - 1);
                primitive += 2;
            } else {
                let area = triangle(mesh, shape, primitive);
                self.add(area, primitive);
                primitive += 1;
            }
        }
    }
}

/// The surface of a shape that is not a mesh.
fn analytic_area(tables: &SceneTables, id: ShapeId) -> Option<Area> {
    let shape = &tables.shapes.shapes[id.0 as usize];
    let flip = shape.flip_normals;
    let (bounds, area) = (tables.shapes.shape_bounds(id), tables.shapes.surface_area(id));
    if !(area > 0.0 && area.is_finite()) {
        return None;
    }
    Some(match &shape.kind {
        ShapeKind::Mesh(_) => return None,
        ShapeKind::Rectangle(transform) => {
            let corner = |x, y| transform.point(Vec3::new(x, y, 0.0));
            let p = corner(-1.0, -1.0);
            let n = transform.normal(Vec3::Z);
            let quad =
                Parallelogram::new(p, [corner(1.0, -1.0) - p, corner(-1.0, 1.0) - p], false)?;
            Area::Parallelogram(quad.facing(if flip { -n } else { n }))
        }
        ShapeKind::Disk(transform) => Area::Disk(Box::new(Disk::new(transform, bounds, flip)?)),
        ShapeKind::Sphere(transform) => {
            // A mirroring transform turns a sphere inside out.
            let inwards = flip != transform.is_mirroring();
            Area::Ellipsoid(Box::new(Ellipsoid::new(transform, bounds, area, inwards)))
        }
        ShapeKind::Cylinder(transform) => {
            Area::Cylinder(Box::new(Cylinder::new(transform, bounds, area, flip)))
        }
    })
}

fn corners(mesh: &Mesh, i: u32) -> [Vec3; 3] {
    mesh.triangles[i as usize].map(|v| mesh.positions[v as usize])
}

fn triangle(mesh: &Mesh, shape: &Shape, i: u32) -> Option<Area> {
    let corners = corners(mesh, i);
    if let Some(against) = flat_side(mesh, i) {
        return Triangle::new(corners, shape.flip_normals != against).map(Area::Triangle);
    }
    let sign = if shape.flip_normals { -1.0 } else { 1.0 };
    let normals = mesh.triangles[i as usize].map(|v| sign * mesh.normals[v as usize]);
    let triangle = SmoothTriangle::new(corners, shape.flip_normals, normals)?;
    Some(Area::SmoothTriangle(Box::new(triangle)))
}

/// Whether the shading normal is set against the winding, where it is the geometric normal but
/// for the sign; `None` where it is interpolated.
fn flat_side(mesh: &Mesh, i: u32) -> Option<bool> {
    if mesh.normals.is_empty() {
        return Some(false);
    }
    let [a, b, c] = corners(mesh, i).map(Vec3::as_dvec3);
    let n = (b - a).cross(c - a).normalize_or_zero().as_vec3();
    let cosines = mesh.triangles[i as usize].map(|v| mesh.normals[v as usize].dot(n));
    if cosines.iter().all(|&c| c > 1.0 - 1e-6) {
        Some(false)
    } else {
        cosines.iter().all(|&c| c < -1.0 + 1e-6).then_some(true)
    }
}

/// The parallelogram that the triangles `i` and `i + 1` make, if they do: sampling it once has
/// less variance than choosing one of the two first.
fn merged(mesh: &Mesh, shape: &Shape, i: u32) -> Option<Parallelogram> {
    let against = flat_side(mesh, i)?;
    if flat_side(mesh, i + 1)? != against {
        return None;
    }
    let (first, second) = (corners(mesh, i), corners(mesh, i + 1));
    let apart = |a: &[Vec3; 3], b: &[Vec3; 3]| {
        let mut alone = (0..3).filter(|&k| !b.contains(&a[k]));
        let k = alone.next()?;
        alone.next().is_none().then_some(k)
    };
    let (p, q) = (apart(&first, &second)?, apart(&second, &first)?);
    let (corner, opposite) = (first[p], second[q]);
    let (left, right) = (first[(p + 1) % 3], first[(p + 2) % 3]);
    // The common edge runs the other way in the second triangle if both face the same side.
    if second[(q + 1) % 3] != right || second[(q + 2) % 3] != left {
        return None;
    }
    let edges = [left - corner, right - corner];
    let gap = (opposite - left - edges[1]).abs().max_element();
    // Equal but for the rounding of the coordinates themselves.
    let size = corner.abs().max(opposite.abs()).max(left.abs()).max(right.abs()).max_element();
    if gap > 4.0 * f32::EPSILON * size {
        return None;
    }
    Parallelogram::new(corner, edges, shape.flip_normals != against)
}
