//! Where the sun stands.
//!
//! Blanco-Muriel et al. 2001: Computing the solar vector; good to 0.5′ between 1999 and 2015, and to
//! a few minutes of arc for decades around.

use crate::math::Vec3;

/// A place on the earth and a time there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaceAndTime {
    /// Degrees north.
    pub latitude: f64,
    /// Degrees east.
    pub longitude: f64,
    /// Hours ahead of UTC.
    pub timezone: f64,
    /// Calendar year.
    pub year: i32,
    /// 1 to 12.
    pub month: i32,
    /// 1 to 31.
    pub day: i32,
    /// Local time.
    pub hour: f64,
    /// Local time.
    pub minute: f64,
    /// Local time.
    pub second: f64,
}

impl Default for PlaceAndTime {
    /// Mitsuba's: Tokyo, 10 July 2010, 15:00.
    fn default() -> Self {
        Self {
            latitude: 35.6894,
            longitude: 139.6917,
            timezone: 9.0,
            year: 2010,
            month: 7,
            day: 10,
            hour: 15.0,
            minute: 0.0,
            second: 0.0,
        }
    }
}

impl PlaceAndTime {
    /// Unit direction towards the sun; +z up, +x south, +y east, as in Mitsuba.
    pub fn sun_direction(&self) -> Vec3 {
        let hours = self.hour - self.timezone + (self.minute + self.second / 60.0) / 60.0;
        let days = self.days_since_2000(hours);
        let (right_ascension, declination) = equatorial(days);
        let sidereal_hours = 6.697_424_324_2 + 0.065_709_828_3 * days + hours;
        let sidereal = (sidereal_hours * 15.0 + self.longitude).to_radians();
        let hour_angle = sidereal - right_ascension;
        let (sin_h, cos_h) = hour_angle.sin_cos();
        let (sin_latitude, cos_latitude) = self.latitude.to_radians().sin_cos();
        let cos_zenith =
            cos_latitude * cos_h * declination.cos() + declination.sin() * sin_latitude;
        let zenith = cos_zenith.clamp(-1.0, 1.0).acos();
        // The observer stands on the surface, not in the middle of the earth.
        let zenith = zenith + 6371.01 / 149_597_890.0 * zenith.sin();
        // From north over east.
        let azimuth = (-sin_h).atan2(declination.tan() * cos_latitude - sin_latitude * cos_h);
        let (sin_zenith, cos_zenith) = zenith.sin_cos();
        let (x, y) = (-azimuth.cos() * sin_zenith, -azimuth.sin() * sin_zenith);
        Vec3::new(x as f32, y as f32, cos_zenith as f32)
    }

    /// Days since noon of 1 January 2000, UTC (Julian date by integer arithmetic).
    fn days_since_2000(&self, hours: f64) -> f64 {
        let (year, month, day) = (i64::from(self.year), i64::from(self.month), i64::from(self.day));
        let leap = (month - 14) / 12;
        let julian_day = (1461 * (year + 4800 + leap)) / 4 + (367 * (month - 2 - 12 * leap)) / 12
            - (3 * ((year + 4900 + leap) / 100)) / 4
            + day
            - 32075;
        julian_day as f64 - 0.5 + hours / 24.0 - 2_451_545.0
    }
}

/// Right ascension and declination of the sun, radians.
fn equatorial(days: f64) -> (f64, f64) {
    let omega = 2.1429 - 0.001_039_459_4 * days;
    let mean_longitude = 4.895_063 + 0.017_202_791_698 * days;
    let mean_anomaly = 6.24006 + 0.017_201_969_9 * days;
    let ecliptic_longitude = mean_longitude
        + 0.033_416_07 * mean_anomaly.sin()
        + 0.000_348_94 * (2.0 * mean_anomaly).sin()
        - 0.000_113_4
        - 0.000_020_3 * omega.sin();
    let obliquity = 0.409_092_8 - 6.2140e-9 * days + 0.000_039_6 * omega.cos();
    let (sin_longitude, cos_longitude) = ecliptic_longitude.sin_cos();
    let right_ascension = (obliquity.cos() * sin_longitude).atan2(cos_longitude);
    (right_ascension, (obliquity.sin() * sin_longitude).asin())
}
