//! Data files that a scene names: meshes and pictures.

use std::path::{Path, PathBuf};

use claror::image::Image;
use claror::texture::ImageId;

use super::Builder;
use crate::diagnostic::{ReadError, Subject};
use crate::image;
use crate::scene::nearest::nearest;
use crate::scene::properties::Properties;
use crate::scene::source::Span;
use crate::scene::values::short;

impl<'a> Builder<'a> {
    /// The file that the parameter `filename` names; `None` after an error.
    pub(super) fn data_file(&mut self, properties: &Properties<'a>) -> Option<PathBuf> {
        let Some(name) = properties.string("filename") else {
            self.missing(properties, "filename");
            return None;
        };
        let span = properties.span_of("filename");
        let from = self.log.path(span);
        let found = self.search.find(self.files, name, &from);
        if found.is_none() {
            let message = format!("file \"{}\" is not found", short(name));
            let hint = self.nearest_file(&from.with_file_name(name));
            self.log.error_about(Subject::File, span, message, hint);
        }
        self.files_read.extend(found.clone());
        found
    }

    /// The file in the same folder whose name is nearest.
    fn nearest_file(&self, path: &Path) -> Option<String> {
        let wanted = path.file_name()?.to_string_lossy().into_owned();
        let names = self.files.list(path.parent()?);
        let near = nearest(&wanted, names.iter().map(String::as_str))?;
        Some(format!("did you mean \"{near}\"?"))
    }

    /// A data file could not be read.
    pub(super) fn read_error(&self, span: Span, error: ReadError) {
        let line = error.line.map_or_else(String::new, |line| format!(":{line}"));
        let message = format!("{}{line}: {}", error.file.display(), error.message);
        self.log.error_about(error.subject, span, message, error.hint);
    }

    /// The picture that the parameter `filename` names, decoded to linear unless `raw`.
    pub(super) fn image(&mut self, properties: &Properties<'a>, raw: bool) -> Option<ImageId> {
        let path = self.data_file(properties)?;
        if let Some(image) = self.images.get(&(path.clone(), raw)) {
            return Some(*image);
        }
        let span = properties.span_of("filename");
        let decoded = match image::read(&path, &self.options.limits) {
            Ok(decoded) => decoded,
            Err(error) => {
                self.read_error(span, error);
                return None;
            }
        };
        let picture = color_channels(decoded.image);
        let is_encoded = decoded.is_srgb_encoded && !raw;
        let images = &mut self.tables.textures.images;
        images.push(if is_encoded { to_linear(picture) } else { picture });
        let id = ImageId(u32::try_from(images.len() - 1).unwrap_or(u32::MAX));
        self.images.insert((path, raw), id);
        Some(id)
    }
}

/// The picture without its alpha channel: textures have none.
fn color_channels(picture: Image) -> Image {
    let kept = match picture.channels {
        2 => 1,
        4 => 3,
        _ => return picture,
    };
    let data = picture.data.chunks_exact(picture.channels).flat_map(|p| &p[..kept]).copied();
    Image { channels: kept, data: data.collect(), ..picture }
}

/// sRGB-encoded values → linear. Nearly all come from 8-bit files: their curve is tabulated.
fn to_linear(mut picture: Image) -> Image {
    let table: Vec<f32> = (0..=255).map(|i| image::srgb_to_linear(i as f32 / 255.0)).collect();
    for value in &mut picture.data {
        let byte = (*value * 255.0).round().clamp(0.0, 255.0);
        *value = match table.get(byte as usize) {
            Some(&linear) if byte / 255.0 == *value => linear,
            _ => image::srgb_to_linear(*value),
        };
    }
    picture
}
