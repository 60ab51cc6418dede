//! The film: where radiance is gathered into pixels.

mod filter;
mod picture;
mod pixel;
#[cfg(test)]
mod tests;
mod tile;

pub use filter::FilterSampler;
pub use picture::{Layer, Picture};
pub use pixel::PixelSums;
pub use tile::{Choice, Film, NonFinite, TILE_SIZE, Tile};

/// Number of parts into which radiance is split (see [`crate::integrator`]).
pub const LAYERS: usize = 4;

/// Names of the parts; added in this order in `f32` they are the beauty.
pub const LAYER_NAMES: [&str; LAYERS] = ["emission", "direct", "indirect", "rest"];

/// Reconstruction filter; radii in pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FilterKind {
    /// The pixel square (Mitsuba's default radius 0.5).
    Box {
        /// Half width.
        radius: f32,
    },
    /// Linear falloff.
    Tent {
        /// Half width.
        radius: f32,
    },
    /// Truncated Gaussian, radius 4·stddev as in Mitsuba.
    Gaussian {
        /// Standard deviation.
        stddev: f32,
    },
    /// Mitchell and Netravali 1988, radius 2.
    Mitchell {
        /// Their B.
        b: f32,
        /// Their C.
        c: f32,
    },
    /// Catmull-Rom, radius 2.
    CatmullRom,
    /// Windowed sinc.
    Lanczos {
        /// Lobes, also the radius.
        lobes: u32,
    },
}

/// A pixel rectangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CropWindow {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// Size, crop and filter of a film.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilmSettings {
    /// Columns of the whole film.
    pub width: u32,
    /// Rows of the whole film.
    pub height: u32,
    /// The part that is rendered; the picture has its size.
    pub crop: CropWindow,
    /// Reconstruction filter.
    pub filter: FilterKind,
    /// Whether the picture has an alpha channel.
    pub alpha: bool,
}
