//! `envmap`: a latitude-longitude picture infinitely far away.
//!
//! As in Mitsuba 3.9, the centre of pixel `(x, y)` lies at `u = (x + ½)/width` (the picture goes
//! around), but at `v = y/(height − 1)`: the first row is the pole itself. Between the pixels the
//! radiance is bilinear. Directions are sampled by luminance times the sine of the polar angle,
//! bilinear between the same points.

use crate::image::Image;
use crate::math::distribution::BilinearGrid;
use crate::math::{Transform, Vec2, Vec3};
use crate::spectrum::Rgb;
use crate::texture::ImageId;
use std::f32::consts::{PI, TAU};

/// An environment map with its sampling tables.
#[derive(Debug, Clone)]
pub(super) struct Envmap {
    pub(super) image: ImageId,
    scale: f32,
    to_world: Transform,
    /// `None` for a black map, which needs no sampling.
    density: Option<BilinearGrid>,
    width: usize,
    rows: usize,
    /// Mean radiance over the sphere.
    pub(super) mean: Rgb,
    /// Share of its light that comes from where it is more than [`BRIGHT`] times as bright as on
    /// average.
    pub(super) bright_share: f32,
}

/// What counts as bright: a sun is a thousand times as bright as the sky, a cloud ten times.
const BRIGHT: f32 = 20.0;

impl Envmap {
    /// `None` when the picture is empty or not finite.
    pub(super) fn new(
        image_id: ImageId,
        image: &Image,
        scale: f32,
        to_world: &Transform,
    ) -> Option<Self> {
        let (width, height) = (image.width, image.height);
        let finite = scale.is_finite() && image.data.iter().all(|v| v.is_finite());
        if width == 0 || height == 0 || !finite {
            return None;
        }
        let rows = (height - 1).max(1);
        let values = densities(image, rows);
        Some(Self {
            image: image_id,
            scale,
            to_world: *to_world,
            density: BilinearGrid::new(values, width, rows),
            width,
            rows,
            mean: mean(image, rows) * scale,
            bright_share: bright_share(image, rows),
        })
    }

    /// Radiance from where the unit vector `direction` (world space) points to.
    pub(super) fn radiance(&self, image: &Image, direction: Vec3) -> Rgb {
        self.radiance_at(image, self.place(direction).0)
    }

    fn radiance_at(&self, image: &Image, uv: Vec2) -> Rgb {
        let x = uv.x * self.width as f32 - 0.5;
        let y = uv.y * self.rows as f32;
        let column = |i: f32| (i as i32).rem_euclid(self.width as i32) as usize;
        let row = |i: f32| (i.max(0.0) as usize).min(image.height - 1);
        let (x0, y0) = (x.floor(), y.floor());
        let at = |dx: f32, dy: f32| pixel(image, column(x0 + dx), row(y0 + dy));
        let low = at(0.0, 0.0).lerp(at(1.0, 0.0), x - x0);
        let high = at(0.0, 1.0).lerp(at(1.0, 1.0), x - x0);
        low.lerp(high, y - y0) * self.scale
    }

    /// A unit direction towards the environment, the radiance from there and the density by
    /// solid angle; `None` for a black map.
    pub(super) fn sample(&self, image: &Image, u: Vec2) -> Option<(Vec3, Rgb, f32)> {
        let (p, pdf) = self.density.as_ref()?.sample(u);
        // The density's vertices are the pixel centres; its first column is half a pixel in.
        let x = p.x + 0.5 / self.width as f32;
        let uv = Vec2::new(if x >= 1.0 { x - 1.0 } else { x }, p.y);
        let (sin_theta, cos_theta) = (PI * uv.y).sin_cos();
        let (sin_phi, cos_phi) = (TAU * uv.x).sin_cos();
        let local = Vec3::new(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi);
        let direction = self.to_world.vector(local).normalize_or_zero();
        let pdf = pdf * solid_angle_density(sin_theta);
        (pdf.is_finite() && pdf > 0.0).then(|| (direction, self.radiance_at(image, uv), pdf))
    }

    /// Density by solid angle of [`Envmap::sample`].
    pub(super) fn pdf(&self, direction: Vec3) -> f32 {
        let Some(density) = &self.density else { return 0.0 };
        let (uv, sin_theta) = self.place(direction);
        let x = uv.x - 0.5 / self.width as f32;
        let pdf = density.pdf(Vec2::new(if x < 0.0 { x + 1.0 } else { x }, uv.y))
            * solid_angle_density(sin_theta);
        if pdf.is_finite() { pdf } else { 0.0 }
    }

    /// Texture coordinates of a direction, and the sine of its angle to the pole.
    fn place(&self, direction: Vec3) -> (Vec2, f32) {
        let d = self.to_world.inverse_vector(direction).normalize_or(Vec3::Y);
        let u = d.x.atan2(-d.z) / TAU;
        let sin_theta = d.x.hypot(d.z);
        // atan2 instead of acos keeps the precision near the poles.
        let v = sin_theta.atan2(d.y) / PI;
        (Vec2::new(if u < 0.0 { (u + 1.0).min(1.0) } else { u }, v), sin_theta)
    }
}

/// Unit squares per steradian: du dv = dω / (2π² sin θ).
fn solid_angle_density(sin_theta: f32) -> f32 {
    1.0 / (2.0 * PI * PI * sin_theta)
}

/// Luminance times sine of the polar angle per pixel, the first column once more at the end.
fn densities(image: &Image, rows: usize) -> Vec<f32> {
    let mut values = Vec::with_capacity((image.width + 1) * (rows + 1));
    for row in 0..=rows {
        let theta = PI * row as f32 / rows as f32;
        // Not 0 at the poles, whose pixels shine on the cells around them too.
        let sin = theta.sin().max((0.25 * PI / rows as f32).sin());
        let y = row.min(image.height - 1);
        for column in 0..=image.width {
            values.push(sin * pixel(image, column % image.width, y).luminance().max(0.0));
        }
    }
    values
}

/// Mean over the sphere, by rows.
fn mean(image: &Image, rows: usize) -> Rgb {
    let (mut sum, mut weight) = ([0.0_f64; 3], 0.0_f64);
    for row in 0..=rows {
        let sin = f64::from((PI * row as f32 / rows as f32).sin().max(1e-6));
        for x in 0..image.width {
            let c = pixel(image, x, row.min(image.height - 1)).to_array();
            (0..3).for_each(|k| sum[k] += sin * f64::from(c[k]));
        }
        weight += sin * image.width as f64;
    }
    Rgb::from(sum.map(|s| (s / weight) as f32))
}

/// Share of the light that comes from where it is brighter than [`BRIGHT`] times the mean.
fn bright_share(image: &Image, rows: usize) -> f32 {
    let limit = BRIGHT * mean(image, rows).luminance();
    let (mut all, mut bright) = (0.0_f64, 0.0_f64);
    for row in 0..=rows {
        let sin = f64::from((PI * row as f32 / rows as f32).sin().max(1e-6));
        for x in 0..image.width {
            let luminance = pixel(image, x, row.min(image.height - 1)).luminance();
            all += sin * f64::from(luminance);
            if luminance > limit {
                bright += sin * f64::from(luminance);
            }
        }
    }
    if all > 0.0 { (bright / all) as f32 } else { 0.0 }
}

fn pixel(image: &Image, x: usize, y: usize) -> Rgb {
    match *image.pixel(x, y) {
        [r, g, b, ..] => Rgb::new(r, g, b),
        [grey, ..] => Rgb::splat(grey),
        [] => Rgb::BLACK,
    }
}
