//! Light sources that are not on a shape.

use claror::emitter::{Emitter, EmitterId};
use claror::math::{DAffine3, Transform, Vec3};

use super::Builder;
use super::spectrum::Role;
use crate::scene::description::{ObjectIndex, Tag};
use crate::scene::properties::Properties;

/// All emitter plugins.
pub(super) const PLUGINS: [&str; 9] =
    ["area", "point", "spot", "directional", "constant", "envmap", "sunsky", "sky", "sun"];

impl<'a> Builder<'a> {
    /// Adds a light source.
    pub(super) fn push_emitter(&mut self, emitter: Emitter) -> EmitterId {
        let emitters = &mut self.tables.emitters.emitters;
        emitters.push(emitter);
        EmitterId(u32::try_from(emitters.len() - 1).unwrap_or(u32::MAX))
    }

    /// A light source of the world.
    pub(super) fn world_emitter(&mut self, index: ObjectIndex) {
        let properties = self.properties(index);
        properties.ignore(&["sampling_weight"]);
        let plugin = properties.plugin();
        if matches!(plugin, "constant" | "envmap" | "sunsky" | "sky") {
            self.one_environment(&properties);
        }
        let made = match plugin {
            "point" => Some(self.point(&properties)),
            "spot" => Some(self.spot(&properties)),
            "directional" => self.directional(&properties),
            "constant" => {
                let radiance = self.color(&properties, "radiance", Role::Emission, 1.0);
                Some(Emitter::Constant { radiance })
            }
            "envmap" => self.envmap(&properties),
            "sunsky" | "sky" | "sun" => {
                self.sky(&properties);
                None
            }
            "area" => {
                properties.ignore_all();
                let message = "emitter \"area\" must stand inside a <shape>";
                self.log.error(properties.span(), message, None);
                None
            }
            _ => {
                self.unsupported(&properties, &PLUGINS, "it is left out");
                None
            }
        };
        self.finish(properties);
        if let Some(emitter) = made {
            self.push_emitter(emitter);
        }
    }

    /// As in Mitsuba there is one infinite light source at most.
    fn one_environment(&mut self, properties: &Properties<'a>) {
        if let Some(first) = self.environment {
            let message = "only one emitter may surround the scene";
            let hint = format!("the first is at {}", self.log.describe(first));
            self.log.error(properties.span(), message, Some(hint));
        }
        self.environment = Some(properties.span());
    }

    fn point(&mut self, properties: &Properties<'a>) -> Emitter {
        let intensity = self.color(properties, "intensity", Role::Emission, 1.0);
        let position = match properties.vec3("position") {
            Some(position) => {
                if properties.has("to_world") {
                    let message = "\"to_world\" stands beside \"position\": give one of them";
                    properties.error("to_world", message, None);
                }
                position
            }
            None => properties.transform("to_world", DAffine3::IDENTITY).point(Vec3::ZERO),
        };
        Emitter::Point { position, intensity }
    }

    fn spot(&mut self, properties: &Properties<'a>) -> Emitter {
        let to_world = properties.transform("to_world", DAffine3::IDENTITY);
        let intensity = self.color(properties, "intensity", Role::Emission, 1.0);
        let cutoff = properties
            .float_that("cutoff_angle", 20.0, "between 0 and 90", |v| v > 0.0 && v < 90.0);
        let beam = properties.float("beam_width", 0.75 * cutoff);
        if !(0.0..=cutoff).contains(&beam) {
            let message = format!("\"beam_width\" = {beam} must be between 0 and {cutoff}");
            properties.error("beam_width", message, None);
        }
        let texture = self.opt_texture(properties, "texture", Role::Emission);
        Emitter::Spot {
            to_world,
            intensity,
            cutoff_angle: cutoff.to_radians(),
            beam_width: beam.to_radians(),
            texture,
        }
    }

    fn directional(&mut self, properties: &Properties<'a>) -> Option<Emitter> {
        let irradiance = self.color(properties, "irradiance", Role::Emission, 1.0);
        let direction = match properties.vector("direction") {
            Some(direction) => {
                if properties.has("to_world") {
                    let message = "\"to_world\" stands beside \"direction\": give one of them";
                    properties.error("to_world", message, None);
                }
                direction
            }
            None => {
                let to_world = properties.affine("to_world");
                to_world.transform_vector3(claror::math::DVec3::Z)
            }
        };
        let Some(direction) = direction.try_normalize() else {
            properties.error("direction", "\"direction\" of \"directional\" is zero", None);
            return None;
        };
        Some(Emitter::Directional { direction: direction.as_vec3(), irradiance })
    }

    fn envmap(&mut self, properties: &Properties<'a>) -> Option<Emitter> {
        let to_world: Transform = properties.transform("to_world", DAffine3::IDENTITY);
        let scale = properties.float_that("scale", 1.0, "at least 0", |v| v >= 0.0);
        properties.ignore(&["mis_compensation"]);
        let image = match self.only_nested(properties, Tag::Texture) {
            Some(bitmap) => self.bitmap_image(bitmap),
            None => self.image(properties, false),
        }?;
        let pixels = &self.tables.textures.images[image.0 as usize];
        let span = properties.span_of("filename");
        if let Some(i) = pixels.data.iter().position(|v| !v.is_finite() || *v < 0.0) {
            let pixel = i / pixels.channels.max(1);
            let (x, y) = (pixel % pixels.width.max(1), pixel / pixels.width.max(1));
            let what = if pixels.data[i] < 0.0 { "negative" } else { "not finite" };
            let message = format!("the environment map is {what} at pixel ({x}, {y})");
            self.log.error_about(crate::diagnostic::Subject::File, span, message, None);
            return None;
        }
        if pixels.width < 2 || pixels.height < 2 {
            let message = "an environment map needs at least 2 x 2 pixels";
            self.log.error_about(crate::diagnostic::Subject::File, span, message, None);
            return None;
        }
        if pixels.data.iter().all(|v| *v == 0.0) {
            self.log.warning(span, "the environment map is black", None);
        }
        Some(Emitter::Envmap { image, scale, to_world })
    }
}
