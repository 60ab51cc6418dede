//! The sun and the sky: `sunsky`, and its parts `sky` and `sun`.

use claror::emitter::sky::position::PlaceAndTime;
use claror::emitter::sky::{SkyError, SunSky};
use claror::math::{DAffine3, Vec3};
use claror::texture::ImageId;

use super::Builder;
use super::spectrum::Role;
use crate::scene::properties::Properties;

/// Parameters of [`PlaceAndTime`].
const PLACE_AND_TIME: [&str; 9] =
    ["latitude", "longitude", "timezone", "year", "month", "day", "hour", "minute", "second"];

impl<'a> Builder<'a> {
    /// Adds the emitters of `sunsky`, `sky` or `sun`.
    pub(super) fn sky(&mut self, properties: &Properties<'a>) {
        let not_negative = |name| properties.float_that(name, 1.0, "at least 0", |v| v >= 0.0);
        let to_world = properties.transform("to_world", DAffine3::IDENTITY);
        let daylight = SunSky {
            turbidity: properties.float("turbidity", 3.0),
            albedo: self.color(properties, "albedo", Role::Reflectance, 0.3),
            sun_direction: sun_direction(properties)
                .unwrap_or_else(|place| to_world.vector(place.sun_direction())),
            sun_scale: not_negative("sun_scale"),
            sky_scale: not_negative("sky_scale"),
            sun_aperture: properties.float("sun_aperture", 0.5358).to_radians(),
            to_world,
        };
        if properties.boolean("complex_sun", false) {
            let message = "\"complex_sun\" is not supported: the sun is a uniform disc";
            self.log.warning(properties.span_of("complex_sun"), message, None);
        }
        if to_world.inverse_vector(daylight.sun_direction).z <= 0.0 {
            self.log.warning(properties.span(), "the sun is below the horizon", None);
        }
        let plugin = properties.plugin();
        let made = if plugin == "sun" { Ok(()) } else { self.add_sky(&daylight) };
        let made =
            made.and_then(|()| if plugin == "sky" { Ok(()) } else { self.add_sun(&daylight) });
        if let Err(error) = made {
            let name = match error {
                SkyError::Turbidity(_) => "turbidity",
                SkyError::Albedo => "albedo",
                SkyError::Aperture(_) => "sun_aperture",
                SkyError::Direction => "sun_direction",
            };
            properties.error(name, error.to_string(), None);
        }
    }

    fn add_sky(&mut self, daylight: &SunSky) -> Result<(), SkyError> {
        let images = &mut self.tables.textures.images;
        images.push(daylight.sky_image()?);
        let image = ImageId(u32::try_from(images.len() - 1).unwrap_or(u32::MAX));
        self.push_emitter(daylight.sky_emitter(image));
        Ok(())
    }

    fn add_sun(&mut self, daylight: &SunSky) -> Result<(), SkyError> {
        if let Some(sun) = daylight.sun_emitter()? {
            self.push_emitter(sun);
        }
        Ok(())
    }
}

/// Towards the sun, if the scene says so, or the place and time from which it follows.
fn sun_direction(properties: &Properties) -> Result<Vec3, PlaceAndTime> {
    let direction = properties.vec3("sun_direction");
    if direction.is_some() {
        if let Some(name) = PLACE_AND_TIME.into_iter().find(|name| properties.is_given(name)) {
            let message = format!("\"{name}\" stands beside \"sun_direction\": give one of them");
            properties.error(name, message, None);
        }
        properties.ignore(&PLACE_AND_TIME);
    }
    direction.ok_or_else(|| place_and_time(properties))
}

fn place_and_time(properties: &Properties) -> PlaceAndTime {
    let default = PlaceAndTime::default();
    let number = |name, default: f64| properties.double(name).unwrap_or(default);
    let whole = |name, default: i32, range| {
        i32::try_from(properties.integer(name, i64::from(default), range)).unwrap_or(default)
    };
    PlaceAndTime {
        latitude: number("latitude", default.latitude),
        longitude: number("longitude", default.longitude),
        timezone: number("timezone", default.timezone),
        year: whole("year", default.year, 1..=9999),
        month: whole("month", default.month, 1..=12),
        day: whole("day", default.day, 1..=31),
        hour: number("hour", default.hour),
        minute: number("minute", default.minute),
        second: number("second", default.second),
    }
}
