//! Shapes: geometry with its material and emitter.

use claror::emitter::{Emitter, EmitterId};
use claror::math::{DAffine3, DMat3, DVec3, Frame, Transform};
use claror::shape::{GroupId, Instance, Mesh, MeshId, Shape, ShapeGroup, ShapeId, ShapeKind};

use super::Builder;
use super::spectrum::Role;
use crate::mesh::{self, MeshOptions};
use crate::scene::description::{ObjectIndex, Tag};
use crate::scene::properties::Properties;
use crate::scene::values::short;

/// All shape plugins.
const PLUGINS: [&str; 10] = [
    "obj",
    "ply",
    "serialized",
    "sphere",
    "rectangle",
    "disk",
    "cube",
    "cylinder",
    "shapegroup",
    "instance",
];

/// Where a shape stands.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    World,
    Group,
}

impl<'a> Builder<'a> {
    /// A shape of the world.
    pub(super) fn world_shape(&mut self, index: ObjectIndex) {
        match self.object(index).plugin.as_str() {
            // In the world a group is nothing but a name.
            "shapegroup" => {
                self.group(index);
            }
            "instance" => self.instance(index),
            _ => {
                self.shape(index, Place::World);
            }
        }
    }

    fn shape(&mut self, index: ObjectIndex, place: Place) -> Option<ShapeId> {
        let properties = self.properties(index);
        if !PLUGINS.contains(&properties.plugin()) {
            self.unsupported(&properties, &PLUGINS, "the shape is left out");
            return None;
        }
        let kind = self.shape_kind(&properties);
        let flip_normals = properties.boolean("flip_normals", false);
        properties.ignore(&["silhouette_sampling_weight"]);
        let emitter = self.shape_emitter(&properties);
        if let (Place::Group, Some(emitter)) = (place, emitter) {
            let message = "a shape of a shapegroup cannot shine";
            self.log.error(self.object(emitter).span, message, None);
        }
        let bsdf = match self.only_nested(&properties, Tag::Bsdf) {
            Some(bsdf) => self.bsdf(bsdf),
            // As in Mitsuba: what shines and says nothing else does not reflect.
            None => {
                let reflectance = if emitter.is_some() { 0.0 } else { 0.5 };
                self.default_bsdf(reflectance, properties.span())
            }
        };
        let id = ShapeId(u32::try_from(self.tables.shapes.shapes.len()).unwrap_or(u32::MAX));
        let emitter = emitter.and_then(|emitter| self.area_emitter(emitter, id));
        self.finish(properties);
        self.tables.shapes.shapes.push(Shape { kind: kind?, bsdf, emitter, flip_normals });
        self.shape_names.push(self.shape_name(index));
        Some(id)
    }

    /// Its id, or its plugin and line.
    fn shape_name(&self, index: ObjectIndex) -> String {
        let object = self.object(index);
        let place = || format!("{} (line {})", short(&object.plugin), self.log.line(object.span));
        object.id.clone().unwrap_or_else(place)
    }

    fn shape_kind(&mut self, properties: &Properties<'a>) -> Option<ShapeKind> {
        let whole = |local| properties.transform("to_world", local);
        match properties.plugin() {
            "sphere" => {
                let center = properties.vector("center").unwrap_or(DVec3::ZERO);
                let radius = f64::from(properties.positive("radius", 1.0));
                let local = DAffine3::from_scale_rotation_translation(
                    DVec3::splat(radius),
                    claror::math::DQuat::IDENTITY,
                    center,
                );
                Some(ShapeKind::Sphere(whole(local)))
            }
            "rectangle" => Some(ShapeKind::Rectangle(whole(DAffine3::IDENTITY))),
            "disk" => Some(ShapeKind::Disk(whole(DAffine3::IDENTITY))),
            "cylinder" => cylinder(properties).map(|local| ShapeKind::Cylinder(whole(local))),
            "cube" => {
                let mut mesh = mesh::cube(&whole(DAffine3::IDENTITY));
                if properties.boolean("face_normals", false) {
                    mesh.normals.clear();
                }
                Some(self.push_mesh(mesh))
            }
            _ => self.mesh_file(properties),
        }
    }

    fn push_mesh(&mut self, mesh: Mesh) -> ShapeKind {
        let meshes = &mut self.tables.shapes.meshes;
        meshes.push(mesh);
        ShapeKind::Mesh(MeshId(u32::try_from(meshes.len() - 1).unwrap_or(u32::MAX)))
    }

    fn mesh_file(&mut self, properties: &Properties<'a>) -> Option<ShapeKind> {
        let plugin = properties.plugin();
        let options = MeshOptions {
            to_world: properties.transform("to_world", DAffine3::IDENTITY),
            face_normals: properties.boolean("face_normals", false),
            flip_tex_coords: properties.boolean("flip_tex_coords", plugin == "obj"),
            shape_index: match plugin {
                "serialized" => properties.count("shape_index", 0, 0) as usize,
                _ => 0,
            },
        };
        let path = self.data_file(properties)?;
        let limits = &self.options.limits;
        let span = properties.span_of("filename");
        let read = match plugin {
            "obj" => mesh::read_obj(&path, &options, limits),
            "ply" => mesh::read_ply(&path, &options, limits),
            _ => mesh::read_serialized(&path, &options, limits),
        };
        match read {
            Ok(loaded) => {
                for warning in loaded.warnings {
                    self.log.warning(span, format!("{}: {warning}", path.display()), None);
                }
                Some(self.push_mesh(loaded.mesh))
            }
            Err(error) => {
                self.read_error(span, error);
                None
            }
        }
    }

    /// The emitter of a shape, if any.
    fn shape_emitter(&mut self, properties: &Properties<'a>) -> Option<ObjectIndex> {
        let index = self.only_nested(properties, Tag::Emitter)?;
        if self.object(index).plugin == "area" {
            return Some(index);
        }
        let emitter = self.properties(index);
        if super::emitters::PLUGINS.contains(&emitter.plugin()) {
            let plugin = short(emitter.plugin());
            let message = format!("emitter \"{plugin}\" cannot be put on a shape");
            self.log.error(emitter.span(), message, Some("only \"area\" can".into()));
        } else {
            self.unsupported(&emitter, &["area"], "it is left out");
        }
        None
    }

    fn area_emitter(&mut self, index: ObjectIndex, shape: ShapeId) -> Option<EmitterId> {
        let properties = self.properties(index);
        properties.ignore(&["sampling_weight"]);
        let radiance = self.texture(&properties, "radiance", Role::Emission, 1.0);
        self.finish(properties);
        Some(self.push_emitter(Emitter::Area { shape, radiance }))
    }

    /// The group that an object is; `None` after an error.
    fn group(&mut self, index: ObjectIndex) -> Option<GroupId> {
        if let Some(group) = self.groups.get(&index) {
            return *group;
        }
        let properties = self.properties(index);
        let mut shapes = Vec::new();
        for (property, child) in self.nested(&properties, Tag::Shape) {
            let plugin = self.object(child).plugin.as_str();
            if matches!(plugin, "shapegroup" | "instance") {
                let message = format!("\"{plugin}\" cannot stand inside \"shapegroup\"");
                self.log.error(property.span, message, None);
            } else {
                shapes.extend(self.shape(child, Place::Group));
            }
        }
        self.finish(properties);
        let groups = &mut self.tables.shapes.groups;
        groups.push(ShapeGroup { shapes });
        let id = GroupId(u32::try_from(groups.len() - 1).unwrap_or(u32::MAX));
        self.groups.insert(index, Some(id));
        Some(id)
    }

    fn instance(&mut self, index: ObjectIndex) {
        let properties = self.properties(index);
        let transform: Transform = properties.transform("to_world", DAffine3::IDENTITY);
        let group = match self.only_nested(&properties, Tag::Shape) {
            Some(child) if self.object(child).plugin == "shapegroup" => self.group(child),
            Some(child) => {
                let plugin = short(&self.object(child).plugin);
                let message = format!("\"instance\" places a \"shapegroup\", not a \"{plugin}\"");
                self.log.error(properties.span(), message, None);
                None
            }
            None => {
                if !properties.has_broken() {
                    let message = "\"instance\" needs a \"shapegroup\"";
                    self.log.error(properties.span(), message, None);
                }
                None
            }
        };
        self.finish(properties);
        if let Some(group) = group {
            self.tables.shapes.instances.push(Instance { group, transform });
        }
    }
}

/// The unit cylinder to the one of `p0`, `p1` and `radius`; `None` after an error.
fn cylinder(properties: &Properties) -> Option<DAffine3> {
    let p0 = properties.vector("p0").unwrap_or(DVec3::ZERO);
    let p1 = properties.vector("p1").unwrap_or(DVec3::Z);
    let radius = f64::from(properties.positive("radius", 1.0));
    let axis = p1 - p0;
    let length = axis.length();
    if !(length > 0.0 && length.is_finite()) {
        properties.error("p1", "\"p0\" and \"p1\" of \"cylinder\" are the same point", None);
        return None;
    }
    // The tangents fix where u = 0 lies; they are those of Mitsuba's coordinate system.
    let frame = Frame::from_normal((axis / length).as_vec3());
    let (s, t) = (frame.s.as_dvec3(), frame.t.as_dvec3());
    let columns = DMat3::from_cols(s * radius, t * radius, axis);
    Some(DAffine3 { matrix3: columns, translation: p0 })
}
