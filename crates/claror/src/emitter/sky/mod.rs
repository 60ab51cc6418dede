//! `sunsky`, `sky`, `sun`: daylight, turned into an environment map and a disc.
//!
//! Parameters (Mitsuba 3.9's `sunsky`): `turbidity` (3; 1 to 10), `albedo` of the ground (0.3),
//! `sun_direction` (world space) or place and time (see [`position`]), `sun_scale`, `sky_scale` (1),
//! `sun_aperture` (0.5358°, the whole angle), `to_world`; local +z is up.
//!
//! The sky is the RGB model of Hosek and Wilkie 2012 (An analytic model for full spectral sky-dome
//! radiance) in Mitsuba's scale, tabulated in 0.35° steps: within 10⁻⁵ of Mitsuba at the pixel
//! centres, and within 1 % between them but for the row below the horizon, where the map goes
//! over into the black below. The sun is a uniform disc, as in Mitsuba unless `complex_sun` is set,
//! whose radiance is a fit of ours to Mitsuba's, see `sun.rs`: within 0.4 % where it exceeds a
//! twentieth of its value at the zenith. Where Mitsuba's blue channel turns negative (sun lower than
//! 2.2°) ours stays positive. With the sun below the horizon all is black, as there.

pub mod position;
mod sun;
#[cfg(test)]
mod tests;

use super::Emitter;
use crate::image::Image;
use crate::math::{DAffine3, DMat3, DVec3, Transform, Vec3};
use crate::spectrum::Rgb;
use crate::texture::ImageId;
use hw_skymodel::rgb::{Channel, SkyParams, SkyState};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// Columns and rows of the map. The middle row is the horizon.
const WIDTH: usize = 1024;
const HEIGHT: usize = 513;

/// Radiance in Mitsuba's unit over that of the RGB data set: one over the integral of the CIE 1931
/// luminosity function (nm) but for the step of that integration; measured.
const SKY_UNIT: f32 = 0.009_367_66;

/// The apparent diameter of the sun for which its radiance is known, radians.
const SUN_APERTURE: f32 = 0.5358 * PI / 180.0;

/// Daylight.
#[derive(Debug, Clone, PartialEq)]
pub struct SunSky {
    /// How hazy the air is: 1 (clear) to 10.
    pub turbidity: f32,
    /// Of the ground, 0 to 1.
    pub albedo: Rgb,
    /// Towards the sun, world space.
    pub sun_direction: Vec3,
    /// Factor on the sun.
    pub sun_scale: f32,
    /// Factor on the sky.
    pub sky_scale: f32,
    /// Apparent diameter of the sun, radians. Its power does not depend on it.
    pub sun_aperture: f32,
    /// Sky (+z up) → world.
    pub to_world: Transform,
}

/// Why there can be no such sky.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SkyError {
    /// Out of the model's range.
    #[error("turbidity {0} is not between 1 and 10")]
    Turbidity(f32),
    /// Out of the model's range.
    #[error("the ground's albedo is not between 0 and 1")]
    Albedo,
    /// Out of range.
    #[error("the sun's aperture of {0} degrees is not between 0 and 90")]
    Aperture(f32),
    /// Zero or not finite.
    #[error("the sun's direction is no direction")]
    Direction,
}

impl SunSky {
    /// The map of the sky, to be used with [`SunSky::sky_emitter`].
    pub fn sky_image(&self) -> Result<Image, SkyError> {
        let sun = self.local_sun()?;
        let mut image = Image::new(WIDTH, HEIGHT, 3);
        let Some(model) = self.model(sun)? else { return Ok(image) };
        for y in 0..=HEIGHT / 2 {
            let theta = PI * y as f32 / (HEIGHT - 1) as f32;
            for x in 0..WIDTH {
                let phi = TAU * (x as f32 + 0.5) / WIDTH as f32;
                let radiance = self.radiance(&model, sun, map_direction(theta, phi));
                let at = (y * WIDTH + x) * 3;
                image.data[at..at + 3].copy_from_slice(&radiance.to_array());
            }
        }
        Ok(image)
    }

    /// The emitter that shows the map `image` of [`SunSky::sky_image`].
    pub fn sky_emitter(&self, image: ImageId) -> Emitter {
        // The map's +y is the sky's +z, its −z the sky's +y.
        let turn = DMat3::from_cols(DVec3::X, DVec3::Z, -DVec3::Y);
        let to_world = self.to_world.to_world.as_daffine3() * DAffine3::from_mat3(turn);
        // A product of two invertible maps fails by overflow only.
        let to_world = Transform::new(to_world).unwrap_or(Transform::IDENTITY);
        Emitter::Envmap { image, scale: 1.0, to_world }
    }

    /// The sun's disc, unless it is below the horizon.
    pub fn sun_emitter(&self) -> Result<Option<Emitter>, SkyError> {
        let sun = self.local_sun()?;
        self.check()?;
        if sun.z <= 0.0 {
            return Ok(None);
        }
        let one_minus_cos = |aperture: f32| 2.0 * (0.25 * aperture).sin().powi(2);
        let spread = one_minus_cos(SUN_APERTURE) / one_minus_cos(self.sun_aperture);
        let radiance = sun::radiance(self.turbidity, sun.z.asin()) * (self.sun_scale * spread);
        Ok(Some(Emitter::SunDisc {
            direction: self.sun_direction.normalize(),
            half_angle: 0.5 * self.sun_aperture,
            radiance,
        }))
    }

    /// Towards the sun in the sky's space, unit.
    fn local_sun(&self) -> Result<Vec3, SkyError> {
        let sun = self.to_world.inverse_vector(self.sun_direction).normalize_or_zero();
        if sun == Vec3::ZERO { Err(SkyError::Direction) } else { Ok(sun) }
    }

    fn check(&self) -> Result<(), SkyError> {
        if !(1.0..=10.0).contains(&self.turbidity) {
            return Err(SkyError::Turbidity(self.turbidity));
        }
        if self.albedo.to_array().iter().any(|a| !(0.0..=1.0).contains(a)) {
            return Err(SkyError::Albedo);
        }
        if !(self.sun_aperture > 0.0 && self.sun_aperture < FRAC_PI_2) {
            return Err(SkyError::Aperture(self.sun_aperture.to_degrees()));
        }
        Ok(())
    }

    /// `None` at night.
    fn model(&self, sun: Vec3) -> Result<Option<SkyState>, SkyError> {
        self.check()?;
        if sun.z <= 0.0 {
            return Ok(None);
        }
        let params = SkyParams {
            elevation: sun.z.min(1.0).asin().min(FRAC_PI_2),
            turbidity: self.turbidity,
            albedo: self.albedo.to_array(),
        };
        SkyState::new(&params).map(Some).map_err(|_| SkyError::Turbidity(self.turbidity))
    }

    /// Radiance of the sky from the direction `d` (sky space).
    fn radiance(&self, model: &SkyState, sun: Vec3, d: Vec3) -> Rgb {
        // Angles from lengths, which are precise also where they are small.
        let gamma = 2.0 * (0.5 * (d - sun).length()).min(1.0).asin();
        let theta = d.truncate().length().atan2(d.z.max(0.0));
        let channel = |c| (model.radiance(theta, gamma, c) * SKY_UNIT * self.sky_scale).max(0.0);
        Rgb::new(channel(Channel::R), channel(Channel::G), channel(Channel::B))
    }
}

/// The direction (sky space) of a place on the map, given as polar angle and turn.
fn map_direction(theta: f32, phi: f32) -> Vec3 {
    let ((sin_theta, cos_theta), (sin_phi, cos_phi)) = (theta.sin_cos(), phi.sin_cos());
    // The map's local (x, y, z) is the sky's (x, −z, y).
    Vec3::new(sin_theta * sin_phi, sin_theta * cos_phi, cos_theta)
}
