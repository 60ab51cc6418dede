//! The value of a texture at a point of a surface.

use super::bitmap::{BitmapLookup, texel};
use super::{Texture, TextureId, TextureTable, UvTransform};
use crate::interaction::SurfaceInteraction;
use crate::math::Vec2;
use crate::shape::{Mesh, MeshAttribute, ShapeKind, ShapeTable};
use crate::spectrum::Rgb;

impl UvTransform {
    /// `uv` mapped.
    pub fn apply(&self, uv: Vec2) -> Vec2 {
        let [a, b, c, d, e, f] = self.0;
        Vec2::new(a * uv.x + b * uv.y + c, d * uv.x + e * uv.y + f)
    }
}

impl TextureTable {
    /// The colour at a point of a surface (Mitsuba's `eval`).
    pub fn rgb(&self, shapes: &ShapeTable, id: TextureId, si: &SurfaceInteraction) -> Rgb {
        match self.get(id) {
            Texture::Constant(value) => *value,
            Texture::Bitmap { to_uv, scale, .. } => match self.bitmap(id) {
                Some(bitmap) => bitmap.rgb(to_uv.apply(si.uv)) * *scale,
                None => Rgb::BLACK,
            },
            Texture::Checkerboard { color0, color1, to_uv } => {
                let first = is_first_cell(to_uv.apply(si.uv));
                self.rgb(shapes, if first { *color0 } else { *color1 }, si)
            }
            Texture::MeshAttribute { name, scale } => attribute(shapes, name, si) * *scale,
        }
    }

    /// The value of a texture where one number is asked for (Mitsuba's `eval_1`): of a bitmap or
    /// a mesh attribute the luminance, of a constant the mean of the channels.
    pub fn scalar(&self, shapes: &ShapeTable, id: TextureId, si: &SurfaceInteraction) -> f32 {
        match self.get(id) {
            Texture::Constant(value) => constant_scalar(*value),
            Texture::Bitmap { .. } | Texture::MeshAttribute { .. } => {
                grey_or_luminance(self.rgb(shapes, id, si))
            }
            Texture::Checkerboard { color0, color1, to_uv } => {
                // Mitsuba 3.9 exchanges the two when it asks for a scalar (opacity, weight,
                // roughness), and scenes are made to look right there.
                let first = is_first_cell(to_uv.apply(si.uv));
                self.scalar(shapes, if first { *color1 } else { *color0 }, si)
            }
        }
    }

    /// Derivative of [`TextureTable::scalar`] by the surface's u and v (Mitsuba's
    /// `eval_1_grad`); zero for everything but bilinear bitmaps.
    pub fn gradient(&self, _shapes: &ShapeTable, id: TextureId, si: &SurfaceInteraction) -> Vec2 {
        let Texture::Bitmap { to_uv, scale, .. } = self.get(id) else { return Vec2::ZERO };
        match self.bitmap(id) {
            Some(bitmap) => bitmap.luminance_gradient(to_uv.apply(si.uv), to_uv) * *scale,
            None => Vec2::ZERO,
        }
    }

    /// The mean over the whole texture: over the pixels of a bitmap, both colours of a
    /// checkerboard, all values of every attribute of that name. Walks through the picture: keep
    /// the result.
    pub fn mean(&self, shapes: &ShapeTable, id: TextureId) -> Rgb {
        match self.get(id) {
            Texture::Constant(value) => *value,
            Texture::Bitmap { scale, .. } => match self.bitmap(id) {
                Some(bitmap) => image_mean(bitmap) * *scale,
                None => Rgb::BLACK,
            },
            Texture::Checkerboard { color0, color1, .. } => {
                (self.mean(shapes, *color0) + self.mean(shapes, *color1)) * 0.5
            }
            Texture::MeshAttribute { name, scale } => attribute_mean(shapes, name) * *scale,
        }
    }

    /// The value, if it is the same everywhere by construction.
    pub fn constant(&self, id: TextureId) -> Option<Rgb> {
        match self.get(id) {
            Texture::Constant(value) => Some(*value),
            _ => None,
        }
    }

    fn get(&self, id: TextureId) -> &Texture {
        &self.textures[id.0 as usize]
    }

    fn bitmap(&self, id: TextureId) -> Option<BitmapLookup<'_>> {
        let Texture::Bitmap { image, filter, wrap, .. } = self.get(id) else { return None };
        let image = &self.images[image.0 as usize];
        Some(BitmapLookup { image, filter: *filter, wrap: *wrap })
    }
}

/// `eval_1` of a constant colour: Mitsuba takes the mean of the channels there, not the luminance.
fn constant_scalar(value: Rgb) -> f32 {
    if value.r == value.g && value.g == value.b { value.r } else { value.mean() }
}

/// Luminance, exact for grey (the luminance weights add up to 1 only up to rounding).
fn grey_or_luminance(value: Rgb) -> f32 {
    if value.r == value.g && value.g == value.b { value.r } else { value.luminance() }
}

/// Whether `uv` lies in a cell of `color0`: both coordinates in the same half of their unit.
fn is_first_cell(uv: Vec2) -> bool {
    let upper = uv - uv.floor();
    (upper.x > 0.5) == (upper.y > 0.5)
}

/// An attribute at a point of a mesh, interpolated between the vertices or constant on the face;
/// black where the shape is no mesh or has no such attribute.
fn attribute(shapes: &ShapeTable, name: &str, si: &SurfaceInteraction) -> Rgb {
    let ShapeKind::Mesh(id) = shapes.shapes[si.shape.0 as usize].kind else { return Rgb::BLACK };
    let mesh = &shapes.meshes[id.0 as usize];
    let Some(attribute) = mesh.attributes.iter().find(|a| a.name == name) else {
        return Rgb::BLACK;
    };
    if attribute.per_face {
        return attribute_value(attribute, si.primitive as usize);
    }
    let [a, b, c] = mesh.triangles[si.primitive as usize];
    let value = |vertex: u32| attribute_value(attribute, vertex as usize);
    let Vec2 { x: u, y: v } = si.barycentric;
    value(a) * (1.0 - u - v) + value(b) * u + value(c) * v
}

fn attribute_value(attribute: &MeshAttribute, i: usize) -> Rgb {
    let n = attribute.channels;
    match attribute.data.get(i * n..(i + 1) * n) {
        Some(&[r, g, b, ..]) => Rgb::new(r, g, b),
        Some(&[grey, ..]) => Rgb::splat(grey),
        _ => Rgb::BLACK,
    }
}

fn attribute_mean(shapes: &ShapeTable, name: &str) -> Rgb {
    let mut sum = [0.0_f64; 3];
    let mut count = 0_usize;
    let named = |mesh: &Mesh| mesh.attributes.iter().find(|a| a.name == name).cloned();
    for attribute in shapes.meshes.iter().filter_map(named) {
        for i in 0..attribute.data.len() / attribute.channels.max(1) {
            accumulate(&mut sum, attribute_value(&attribute, i));
            count += 1;
        }
    }
    mean_of(sum, count)
}

fn image_mean(bitmap: BitmapLookup<'_>) -> Rgb {
    let image = bitmap.image;
    let mut sum = [0.0_f64; 3];
    for y in 0..image.height {
        for x in 0..image.width {
            accumulate(&mut sum, texel(image, x, y));
        }
    }
    mean_of(sum, image.width * image.height)
}

fn accumulate(sum: &mut [f64; 3], value: Rgb) {
    for (s, v) in sum.iter_mut().zip(value.to_array()) {
        *s += f64::from(v);
    }
}

fn mean_of(sum: [f64; 3], count: usize) -> Rgb {
    Rgb::from(sum.map(|s| (s / count.max(1) as f64) as f32))
}
