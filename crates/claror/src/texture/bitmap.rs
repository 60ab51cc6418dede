//! Reading a picture between its pixel centres.
//!
//! Pixel `(x, y)` has its centre at `u = (x + ½)/width`, `v = (y + ½)/height`; row 0 is at
//! `v = 0`. Colours come from the first three channels, or from the first where there are only one
//! or two (an alpha channel is not looked at).

use super::{TextureFilter, UvTransform, WrapMode};
use crate::image::Image;
use crate::math::Vec2;
use crate::spectrum::Rgb;

/// A picture with the way it is read.
#[derive(Debug, Clone, Copy)]
pub(super) struct BitmapLookup<'a> {
    pub(super) image: &'a Image,
    pub(super) filter: TextureFilter,
    pub(super) wrap: WrapMode,
}

/// The four pixels around a place, first index x, and the place between them in [0, 1]².
struct Cell<T> {
    corner: [[T; 2]; 2],
    fraction: Vec2,
}

impl BitmapLookup<'_> {
    /// The colour at `uv` (already transformed).
    pub(super) fn rgb(&self, uv: Vec2) -> Rgb {
        if self.is_empty() {
            return Rgb::BLACK;
        }
        match self.filter {
            TextureFilter::Nearest => {
                let at = self.in_pixels(uv);
                texel(self.image, self.column(whole(at.x)), self.row(whole(at.y)))
            }
            TextureFilter::Bilinear => {
                let Cell { corner: c, fraction: f } = self.cell(uv, texel);
                let low = c[0][0].lerp(c[1][0], f.x);
                let high = c[0][1].lerp(c[1][1], f.x);
                low.lerp(high, f.y)
            }
        }
    }

    /// Derivative of the luminance by the surface's uv, where `to_uv` took that to `uv`. Zero for
    /// nearest-pixel look-ups.
    ///
    /// As in Mitsuba 3.9 the picture's size is multiplied in after the rotation of `to_uv`: the
    /// true gradient only where the picture is square or `to_uv` keeps the axes apart.
    pub(super) fn luminance_gradient(&self, uv: Vec2, to_uv: &UvTransform) -> Vec2 {
        if self.is_empty() || self.filter == TextureFilter::Nearest {
            return Vec2::ZERO;
        }
        let Cell { corner: c, fraction: f } = self.cell(uv, texel_luminance);
        let by_x = (c[1][0] - c[0][0]) * (1.0 - f.y) + (c[1][1] - c[0][1]) * f.y;
        let by_y = (c[0][1] - c[0][0]) * (1.0 - f.x) + (c[1][1] - c[1][0]) * f.x;
        let m = &to_uv.0;
        let turned = Vec2::new(m[0] * by_x + m[3] * by_y, m[1] * by_x + m[4] * by_y);
        turned * Vec2::new(self.image.width as f32, self.image.height as f32)
    }

    fn is_empty(&self) -> bool {
        self.image.data.is_empty()
    }

    fn in_pixels(&self, uv: Vec2) -> Vec2 {
        uv * Vec2::new(self.image.width as f32, self.image.height as f32)
    }

    fn cell<T>(&self, uv: Vec2, read: impl Fn(&Image, usize, usize) -> T) -> Cell<T> {
        let at = self.in_pixels(uv) - 0.5;
        let (x, y) = (whole(at.x), whole(at.y));
        let (x0, x1) = (self.column(x), self.column(x + 1));
        let (y0, y1) = (self.row(y), self.row(y + 1));
        let image = self.image;
        Cell {
            corner: [
                [read(image, x0, y0), read(image, x0, y1)],
                [read(image, x1, y0), read(image, x1, y1)],
            ],
            fraction: at - Vec2::new(x as f32, y as f32),
        }
    }

    fn column(&self, x: i32) -> usize {
        wrap(x, self.image.width, self.wrap)
    }

    fn row(&self, y: i32) -> usize {
        wrap(y, self.image.height, self.wrap)
    }
}

/// The pixel's number; wild coordinates (far away, NaN) end at some pixel instead of overflowing.
/// Without `floor`, which is a function call where the processor's baseline has no instruction.
#[inline]
fn whole(x: f32) -> i32 {
    let towards_zero = x.clamp(-1e9, 1e9) as i32;
    towards_zero - i32::from(towards_zero as f32 > x)
}

#[inline]
fn wrap(i: i32, size: usize, mode: WrapMode) -> usize {
    if (i as u32 as usize) < size {
        return i as usize;
    }
    let n = size as i32;
    let wrapped = match mode {
        WrapMode::Clamp => i.clamp(0, n - 1),
        WrapMode::Repeat => i.rem_euclid(n),
        WrapMode::Mirror => {
            let k = i.rem_euclid(2 * n);
            if k < n { k } else { 2 * n - 1 - k }
        }
    };
    wrapped as usize
}

/// The colour of one pixel.
pub(super) fn texel(image: &Image, x: usize, y: usize) -> Rgb {
    match *image.pixel(x, y) {
        [r, g, b, ..] => Rgb::new(r, g, b),
        [grey, ..] => Rgb::splat(grey),
        [] => Rgb::BLACK,
    }
}

/// Luminance of one pixel; of a grey picture the value itself, free of the weights' rounding.
pub(super) fn texel_luminance(image: &Image, x: usize, y: usize) -> f32 {
    if image.channels < 3 { texel(image, x, y).r } else { texel(image, x, y).luminance() }
}
