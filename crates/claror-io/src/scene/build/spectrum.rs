//! Measured spectra → linear sRGB, the way Mitsuba's RGB variants do.
//!
//! A spectrum is integrated against the CIE 1931 colour matching functions. Reflectances (and
//! indices of refraction) are first multiplied by the standard illuminant D65, so that a uniform
//! reflectance is grey; emission is not, so that a uniform emission has the reddish tint of the
//! equal-energy illuminant. Channels out of the sRGB gamut are clipped.

use claror::spectrum::Rgb;

use super::cie::{D65, X, Y, Z};
use crate::scene::description::SpectrumValue;

/// What a spectrum stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// A share of light: within 0..1.
    Reflectance,
    /// Light: not negative.
    Emission,
    /// A number, such as an index of refraction or a roughness.
    Unbounded,
}

/// First and last wavelength of the tables, nanometres.
const RANGE: (f64, f64) = (360.0, 830.0);
/// Spacing of the tables, nanometres.
const STEP: f64 = 5.0;
/// Points of the integration.
const POINTS: u32 = 1000;
/// ∫ ȳ dλ over the tables: luminance 1 is that of the uniform spectrum 1.
const Y_INTEGRAL: f64 = 106.750_259_399_414;
/// ∫ ȳ·D65 dλ / 100, so that the reflectance 1 under D65 has luminance 1.
const D65_INTEGRAL: f64 = 105.680_2;

/// A table at a wavelength, linearly interpolated.
fn at(table: &[f64; 95], wavelength: f64) -> f64 {
    let position = (wavelength - RANGE.0) / STEP;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the wavelength lies within the table"
    )]
    let index = (position as usize).min(table.len() - 2);
    let t = position - index as f64;
    table[index] * (1.0 - t) + table[index + 1] * t
}

/// CIE XYZ (D65 white) → linear sRGB, unclipped.
fn xyz_to_rgb([x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        3.240_479 * x - 1.537_150 * y - 0.498_535 * z,
        -0.969_256 * x + 1.875_991 * y + 0.041_556 * z,
        0.055_648 * x - 0.204_043 * y + 1.057_311 * z,
    ]
}

/// The integral of a spectrum against the colour matching functions as linear sRGB, unclipped.
fn integrate(value: impl Fn(f64) -> Option<f64>, under_d65: bool) -> [f64; 3] {
    let mut xyz = [0.0; 3];
    for i in 0..POINTS {
        let wavelength = RANGE.0 + f64::from(i) / f64::from(POINTS - 1) * (RANGE.1 - RANGE.0);
        let Some(mut value) = value(wavelength) else { continue };
        if under_d65 {
            value *= at(&D65, wavelength) / 100.0;
        }
        for (sum, table) in xyz.iter_mut().zip([&X, &Y, &Z]) {
            *sum += value * at(table, wavelength);
        }
    }
    let integral = if under_d65 { D65_INTEGRAL } else { Y_INTEGRAL };
    xyz_to_rgb(xyz.map(|v| v * (RANGE.1 - RANGE.0) / f64::from(POINTS) / integral))
}

/// The value of a piecewise linear spectrum; `None` outside of its samples.
fn sampled(samples: &[(f64, f64)], wavelength: f64) -> Option<f64> {
    let (first, last) = (samples.first()?, samples.last()?);
    if wavelength < first.0 || wavelength > last.0 {
        return None;
    }
    let next = samples.partition_point(|s| s.0 <= wavelength).clamp(1, samples.len() - 1);
    let ((w0, v0), (w1, v1)) = (samples[next - 1], samples[next]);
    Some(v0 + (v1 - v0) * (wavelength - w0) / (w1 - w0))
}

/// A colour and whether it had to be clipped.
fn clip(rgb: [f64; 3], role: Role) -> (Rgb, bool) {
    let high = if role == Role::Reflectance { 1.0 } else { f64::INFINITY };
    let clipped = rgb.map(|v| v.clamp(0.0, high));
    #[expect(clippy::cast_possible_truncation, reason = "colours are f32")]
    (Rgb::from(clipped.map(|v| v as f32)), clipped != rgb)
}

/// The colour of `<spectrum>`, and whether it had to be clipped.
pub(super) fn to_rgb(spectrum: &SpectrumValue, role: Role) -> (Rgb, bool) {
    let is_emission = role == Role::Emission;
    match spectrum {
        // The equal-energy illuminant has X = Y = Z.
        SpectrumValue::Uniform(v) if is_emission => clip(xyz_to_rgb([*v; 3]), role),
        #[expect(clippy::cast_possible_truncation, reason = "colours are f32")]
        SpectrumValue::Uniform(v) => (Rgb::splat(*v as f32), false),
        SpectrumValue::Sampled(samples) => {
            clip(integrate(|w| sampled(samples, w), !is_emission), role)
        }
    }
}

/// Planck's law: spectral radiance of a black body, W·m⁻²·sr⁻¹·nm⁻¹, at a wavelength in
/// nanometres.
fn planck(wavelength: f64, kelvin: f64) -> f64 {
    const C: f64 = 299_792_458.0;
    const H: f64 = 6.626_070_15e-34;
    const K: f64 = 1.380_649e-23;
    let lambda = wavelength * 1e-9;
    let exponent = H * C / (lambda * K * kelvin);
    2.0 * H * C * C / lambda.powi(5) / exponent.exp_m1() * 1e-9
}

/// The colour of a black body.
pub(super) fn blackbody(kelvin: f64) -> Rgb {
    clip(integrate(|w| Some(planck(w, kelvin)), false), Role::Emission).0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::values::spectrum;

    fn close(text: &str, role: Role, expected: [f32; 3]) {
        let (rgb, _) = to_rgb(&spectrum(text).unwrap(), role);
        for (a, b) in rgb.to_array().into_iter().zip(expected) {
            assert!((a - b).abs() <= 2e-4 * b.abs().max(0.1), "{text} {role:?}: {rgb:?}");
        }
    }

    /// Read from Mitsuba 3.9.1's `scalar_rgb` variant.
    #[test]
    fn spectra_have_the_colours_of_mitsuba() {
        let ramp = "400:0.1, 500:0.5, 600:0.9 700:0.3";
        close(ramp, Role::Reflectance, [0.854_797, 0.687_54, 0.265_015]);
        close(ramp, Role::Emission, [0.999_234, 0.6597, 0.229_444]);
        close("2.0", Role::Emission, [2.409_59, 1.896_58, 1.817_83]);
        close("360:1 830:1", Role::Emission, [1.204_88, 0.948_228, 0.909_267]);
        close("360:1 830:1", Role::Unbounded, [0.998_985, 0.998_874, 0.998_802]);
        close("360:1 830:1", Role::Reflectance, [0.998_985, 0.998_874, 0.998_802]);
        close("500:1 510:1 530:0.2", Role::Reflectance, [0.0, 0.222_697, 0.011_589_1]);
        close("400:0.1, 500:0.5", Role::Unbounded, [0.0, 0.022_213_1, 0.340_056]);
        close("0.7", Role::Reflectance, [0.7, 0.7, 0.7]);
        assert!(to_rgb(&spectrum("500:1 510:1").unwrap(), Role::Reflectance).1);
    }

    #[test]
    fn hot_bodies_are_blue() {
        let (cold, hot) = (blackbody(2000.0), blackbody(10_000.0));
        assert!(cold.r > cold.g && cold.g > cold.b, "{cold:?}");
        assert!(hot.b > hot.r, "{hot:?}");
        // Wien's displacement law: 2.8978e6 nm·K.
        let peak = 2.897_77e6 / 5000.0;
        assert!(planck(peak, 5000.0) > planck(peak - 2.0, 5000.0));
        assert!(planck(peak, 5000.0) > planck(peak + 2.0, 5000.0));
    }
}
