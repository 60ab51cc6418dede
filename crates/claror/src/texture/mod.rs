//! Textures: values over a surface.
//!
//! The conventions are Mitsuba 3.9's, checked against its plugins value by value: pixel centres
//! at half integers, row 0 at `v = 0`, checkerboard cells of half a unit with `color0` at the
//! origin, `eval_1` of a coloured bitmap its luminance.

mod bitmap;
mod eval;
#[cfg(test)]
mod tests;

use crate::image::Image;
use crate::spectrum::Rgb;

/// Index of a [`Texture`] in a [`TextureTable`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(transparent)]
pub struct TextureId(pub u32);

/// Index of an [`Image`] in a [`TextureTable`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(transparent)]
pub struct ImageId(pub u32);

/// What lies beyond the picture's edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WrapMode {
    /// The picture repeats.
    #[default]
    Repeat,
    /// The picture repeats mirrored.
    Mirror,
    /// The edge continues.
    Clamp,
}

/// How a picture is read between its pixel centres.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TextureFilter {
    /// The nearest pixel.
    Nearest,
    /// Bilinear between the four nearest.
    #[default]
    Bilinear,
}

/// A 2×3 affine map of texture coordinates, row-major: `u' = a·u + b·v + c`, `v' = d·u + e·v + f`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UvTransform(pub [f32; 6]);

impl UvTransform {
    /// The identity.
    pub const IDENTITY: Self = Self([1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
}

/// A texture. Colours are linear sRGB.
#[derive(Debug, Clone, PartialEq)]
pub enum Texture {
    /// The same value everywhere.
    Constant(Rgb),
    /// A picture over the uv square. Row 0 of the picture is at v = 0. Already linear: sRGB
    /// decoding happens when the picture is read.
    Bitmap {
        /// The picture.
        image: ImageId,
        /// Interpolation.
        filter: TextureFilter,
        /// Beyond the edges.
        wrap: WrapMode,
        /// Applied to the surface's uv before the look-up.
        to_uv: UvTransform,
        /// Factor on the value.
        scale: f32,
    },
    /// Mitsuba's `checkerboard`: two textures in alternating half-unit cells of uv.
    Checkerboard {
        /// First colour.
        color0: TextureId,
        /// Second colour.
        color1: TextureId,
        /// Applied to the surface's uv before the look-up.
        to_uv: UvTransform,
    },
    /// Values stored with a mesh, such as `vertex_color` or `face_color`.
    MeshAttribute {
        /// Name as in the scene file, for instance `vertex_color`.
        name: String,
        /// Factor on the value.
        scale: f32,
    },
}

/// All textures of a scene and the pictures that they read.
#[derive(Debug, Clone, Default)]
pub struct TextureTable {
    /// Textures, by [`TextureId`].
    pub textures: Vec<Texture>,
    /// Pictures, by [`ImageId`].
    pub images: Vec<Image>,
}
