//! Textures, and colours and numbers where a texture may stand.

use claror::math::DMat4;
use claror::spectrum::Rgb;
use claror::texture::{
    ImageId, Texture, TextureFilter, TextureId, TextureTable, UvTransform, WrapMode,
};

use super::Builder;
use super::spectrum::{Role, blackbody, to_rgb};
use crate::scene::description::{ObjectIndex, Property, SpectrumValue, Tag, Value};
use crate::scene::properties::Properties;
use crate::scene::values::{floats, short};

/// All texture plugins.
const PLUGINS: [&str; 9] = [
    "bitmap",
    "checkerboard",
    "mesh_attribute",
    "uniform",
    "srgb",
    "d65",
    "blackbody",
    "regular",
    "irregular",
];

impl<'a> Builder<'a> {
    /// The constant texture of a colour.
    pub(super) fn constant(&mut self, color: Rgb) -> TextureId {
        let textures = &mut self.tables.textures;
        let key = color.to_array().map(f32::to_bits);
        *self.constants.entry(key).or_insert_with(|| push(textures, Texture::Constant(color)))
    }

    /// The texture, colour or number `name`, or the same number everywhere.
    pub(super) fn texture(
        &mut self,
        properties: &Properties<'a>,
        name: &'static str,
        role: Role,
        default: f32,
    ) -> TextureId {
        match self.opt_texture(properties, name, role) {
            Some(texture) => texture,
            None => self.constant(Rgb::splat(default)),
        }
    }

    /// The texture, colour or number `name`.
    pub(super) fn opt_texture(
        &mut self,
        properties: &Properties<'a>,
        name: &'static str,
        role: Role,
    ) -> Option<TextureId> {
        let property = properties.get(name)?;
        if let Value::Object(index) = property.value
            && self.tag(index) == Tag::Texture
        {
            return self.texture_object(index, role);
        }
        let color = self.color_value(properties, property, role)?;
        Some(self.constant(color))
    }

    /// The colour `name`, which must be the same everywhere.
    pub(super) fn color(
        &mut self,
        properties: &Properties<'a>,
        name: &'static str,
        role: Role,
        default: f32,
    ) -> Rgb {
        let Some(id) = self.opt_texture(properties, name, role) else { return Rgb::splat(default) };
        match self.tables.textures.textures[id.0 as usize] {
            Texture::Constant(color) => color,
            _ => {
                let plugin = short(properties.plugin());
                let message = format!("\"{name}\" of \"{plugin}\" cannot vary over a surface");
                properties.error(name, message, None);
                Rgb::splat(default)
            }
        }
    }

    /// A colour or number that is no object.
    fn color_value(
        &self,
        properties: &Properties<'a>,
        property: &Property,
        role: Role,
    ) -> Option<Rgb> {
        let color = match &property.value {
            #[expect(clippy::cast_precision_loss, reason = "integers are far below 2^53")]
            Value::Integer(v) => [*v as f64; 3],
            Value::Float(v) => [*v; 3],
            Value::Rgb(v) => *v,
            Value::Spectrum(spectrum) => {
                let (rgb, clipped) = to_rgb(spectrum, role);
                if clipped {
                    let message =
                        format!("\"{}\" is out of the sRGB gamut: clipped", property.name);
                    self.log.warning(property.span, message, None);
                }
                rgb.to_array().map(f64::from)
            }
            other => {
                let message = format!(
                    "\"{}\" of \"{}\" is {}, expected a colour, a number or a texture",
                    property.name,
                    short(properties.plugin()),
                    other.type_name()
                );
                self.log.error(property.span, message, None);
                return None;
            }
        };
        self.check_color(color, property, role)
    }

    fn check_color(&self, color: [f64; 3], property: &Property, role: Role) -> Option<Rgb> {
        #[expect(clippy::cast_possible_truncation, reason = "colours are f32")]
        let narrow = color.map(|v| v as f32);
        let (good, what) = match role {
            Role::Reflectance => (color.iter().all(|v| (0.0..=1.0).contains(v)), "between 0 and 1"),
            Role::Emission => (color.iter().all(|v| *v >= 0.0), "at least 0"),
            Role::Unbounded => (true, ""),
        };
        let message = if !narrow.iter().all(|v| v.is_finite()) {
            format!("\"{}\" is too large for single precision", property.name)
        } else if !good {
            let [r, g, b] = narrow;
            format!("\"{}\" = {r} {g} {b} must be {what}", property.name)
        } else {
            return Some(Rgb::from(narrow));
        };
        self.log.error(property.span, message, None);
        None
    }

    /// The texture that an object is; `None` after an error.
    pub(super) fn texture_object(&mut self, index: ObjectIndex, role: Role) -> Option<TextureId> {
        if let Some(texture) = self.textures.get(&index) {
            return Some(*texture);
        }
        let properties = self.properties(index);
        let texture = match properties.plugin() {
            "bitmap" => self.bitmap(&properties),
            "checkerboard" => {
                let color0 = self.texture(&properties, "color0", role, 0.4);
                let color1 = self.texture(&properties, "color1", role, 0.2);
                Some(Texture::Checkerboard { color0, color1, to_uv: to_uv(&properties) })
            }
            "mesh_attribute" => self.mesh_attribute(&properties),
            "uniform" => Some(Texture::Constant(self.color(&properties, "value", role, 1.0))),
            "srgb" => Some(Texture::Constant(self.color(&properties, "color", role, 1.0))),
            "d65" => {
                let color = self.color(&properties, "color", role, 1.0);
                Some(Texture::Constant(color * properties.float("scale", 1.0)))
            }
            "blackbody" => self.blackbody(&properties),
            "regular" | "irregular" => self.tabulated(&properties, role),
            _ => {
                self.unsupported(&properties, &PLUGINS, "grey is used instead");
                return Some(self.constant(Rgb::splat(0.5)));
            }
        };
        self.finish(properties);
        let id = push(&mut self.tables.textures, texture?);
        self.textures.insert(index, id);
        Some(id)
    }

    fn bitmap(&mut self, properties: &Properties<'a>) -> Option<Texture> {
        let raw = properties.boolean("raw", false);
        let image = self.image(properties, raw);
        let wrap = properties.choice(
            "wrap_mode",
            &[
                ("repeat", WrapMode::Repeat),
                ("mirror", WrapMode::Mirror),
                ("clamp", WrapMode::Clamp),
            ],
        );
        let filter = properties.choice(
            "filter_type",
            &[("bilinear", TextureFilter::Bilinear), ("nearest", TextureFilter::Nearest)],
        );
        // Storage of Mitsuba's GPU textures.
        properties.ignore(&["format", "accel"]);
        let to_uv = to_uv(properties);
        Some(Texture::Bitmap { image: image?, filter, wrap, to_uv, scale: 1.0 })
    }

    /// The picture of a `bitmap` object, for emitters that read it themselves.
    pub(super) fn bitmap_image(&mut self, index: ObjectIndex) -> Option<ImageId> {
        match self.texture_object(index, Role::Emission).map(|t| t.0 as usize) {
            Some(t) => match self.tables.textures.textures[t] {
                Texture::Bitmap { image, .. } => Some(image),
                _ => {
                    let message = "only a \"bitmap\" can be wrapped around the scene";
                    self.log.error(self.object(index).span, message, None);
                    None
                }
            },
            None => None,
        }
    }

    fn mesh_attribute(&mut self, properties: &Properties<'a>) -> Option<Texture> {
        let scale = properties.float("scale", 1.0);
        let Some(name) = properties.string("name") else {
            self.missing(properties, "name");
            return None;
        };
        if !name.starts_with("vertex_") && !name.starts_with("face_") {
            let message = format!("\"{}\" begins neither with vertex_ nor with face_", short(name));
            properties.error("name", message, None);
            return None;
        }
        Some(Texture::MeshAttribute { name: name.to_owned(), scale })
    }

    fn blackbody(&mut self, properties: &Properties<'a>) -> Option<Texture> {
        let scale = properties.float("scale", 1.0);
        properties.ignore(&["wavelength_min", "wavelength_max"]);
        let Some(kelvin) = properties.double("temperature") else {
            self.missing(properties, "temperature");
            return None;
        };
        if kelvin <= 0.0 {
            properties.error("temperature", format!("{kelvin} K is no temperature"), None);
            return None;
        }
        Some(Texture::Constant(blackbody(kelvin) * scale))
    }

    fn tabulated(&mut self, properties: &Properties<'a>, role: Role) -> Option<Texture> {
        let list = |name: &'static str| {
            let Some(text) = properties.string(name) else {
                self.missing(properties, name);
                return None;
            };
            floats(text).map_err(|reason| properties.error(name, reason, None)).ok()
        };
        let values = list("values")?;
        let wavelengths = if properties.plugin() == "irregular" {
            list("wavelengths")?
        } else {
            let low = properties.double("wavelength_min").unwrap_or(360.0);
            let high = properties.double("wavelength_max").unwrap_or(830.0);
            let last = values.len().saturating_sub(1).max(1) as f64;
            (0..values.len()).map(|i| low + (high - low) * i as f64 / last).collect()
        };
        let ascend = wavelengths.windows(2).all(|w| w[0] < w[1]);
        if wavelengths.len() != values.len() || values.len() < 2 || !ascend {
            let message = "a spectrum needs two or more values at ascending wavelengths";
            properties.error("values", message, None);
            return None;
        }
        let samples = wavelengths.into_iter().zip(values).collect();
        Some(Texture::Constant(to_rgb(&SpectrumValue::Sampled(samples), role).0))
    }

    /// A required parameter is not there, or could not be read (which has been told).
    pub(super) fn missing(&self, properties: &Properties<'a>, name: &'static str) {
        if !properties.is_given(name) {
            let plugin = short(properties.plugin());
            let message = format!("\"{plugin}\" needs the parameter \"{name}\"");
            self.log.error(properties.span(), message, None);
        }
    }
}

fn push(textures: &mut TextureTable, texture: Texture) -> TextureId {
    textures.textures.push(texture);
    TextureId(u32::try_from(textures.textures.len() - 1).unwrap_or(u32::MAX))
}

/// The part of `to_uv` that acts on u and v.
fn to_uv(properties: &Properties) -> UvTransform {
    let m = properties.matrix("to_uv").unwrap_or(DMat4::IDENTITY);
    let (u, v) = (m.row(0), m.row(1));
    let narrow = [u.x, u.y, u.w, v.x, v.y, v.w].map(|v| {
        #[expect(clippy::cast_possible_truncation, reason = "texture coordinates are f32")]
        let narrow = v as f32;
        narrow
    });
    if !narrow.iter().all(|v| v.is_finite()) {
        properties.error("to_uv", "\"to_uv\" is too large for single precision", None);
        return UvTransform::IDENTITY;
    }
    UvTransform(narrow)
}
