//! Text → numbers, colours, spectra and transforms.

use claror::math::{DMat4, DVec3};

use super::description::SpectrumValue;

/// The reason why a text could not be read.
pub(super) type Reason = String;

/// A finite number.
pub(super) fn float(text: &str) -> Result<f64, Reason> {
    let text = text.trim();
    match text.parse::<f64>() {
        Ok(v) if v.is_finite() => Ok(v),
        Ok(v) if v.is_nan() => Err(format!("\"{}\" is not a number", short(text))),
        Ok(_) => Err(format!("\"{}\" is not finite", short(text))),
        Err(_) => Err(format!("\"{}\" is not a number", short(text))),
    }
}

/// A whole number.
pub(super) fn integer(text: &str) -> Result<i64, Reason> {
    let text = text.trim();
    text.parse().map_err(|_| format!("\"{}\" is not an integer", short(text)))
}

/// `true` or `false`, in any case.
pub(super) fn boolean(text: &str) -> Result<bool, Reason> {
    match text.trim() {
        t if t.eq_ignore_ascii_case("true") => Ok(true),
        t if t.eq_ignore_ascii_case("false") => Ok(false),
        t => Err(format!("\"{}\" is neither \"true\" nor \"false\"", short(t))),
    }
}

/// The parts of a list: separated by commas or white space.
fn tokens(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| c == ',' || c.is_whitespace()).filter(|t| !t.is_empty())
}

/// A list of finite numbers.
pub(super) fn floats(text: &str) -> Result<Vec<f64>, Reason> {
    tokens(text).map(float).collect()
}

/// One value for all three, or three values.
pub(super) fn triple(text: &str) -> Result<DVec3, Reason> {
    match floats(text)?[..] {
        [v] => Ok(DVec3::splat(v)),
        [x, y, z] => Ok(DVec3::new(x, y, z)),
        ref other => Err(format!("expected 1 or 3 values, found {}", other.len())),
    }
}

/// Exactly three values.
pub(super) fn vector(text: &str) -> Result<DVec3, Reason> {
    match floats(text)?[..] {
        [x, y, z] => Ok(DVec3::new(x, y, z)),
        ref other => Err(format!("expected 3 values, found {}", other.len())),
    }
}

/// `<srgb>`: `#rrggbb` or three values in 0..1, decoded to linear.
pub(super) fn srgb(text: &str) -> Result<DVec3, Reason> {
    let text = text.trim();
    let encoded = match text.strip_prefix('#') {
        Some(hex) if hex.len() == 6 && hex.bytes().all(|b| b.is_ascii_hexdigit()) => {
            let code = u32::from_str_radix(hex, 16).map_err(|e| e.to_string())?;
            let channel = |shift: u32| f64::from((code >> shift) & 255) / 255.0;
            DVec3::new(channel(16), channel(8), channel(0))
        }
        Some(_) => return Err(format!("\"{}\" is not of the form #rrggbb", short(text))),
        None => triple(text)?,
    };
    Ok(encoded.map(srgb_to_linear))
}

/// The sRGB transfer function (IEC 61966-2-1), encoded → linear.
fn srgb_to_linear(v: f64) -> f64 {
    if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// `<spectrum value=…>`: one value, or `wavelength:value` pairs with ascending wavelengths.
pub(super) fn spectrum(text: &str) -> Result<SpectrumValue, Reason> {
    if !text.contains(':') {
        return match floats(text)?[..] {
            [v] => Ok(SpectrumValue::Uniform(v)),
            ref other => Err(format!(
                "expected one value or a list of wavelength:value pairs, found {} values",
                other.len()
            )),
        };
    }
    let mut samples = Vec::new();
    for token in tokens(text) {
        let Some((wavelength, value)) = token.split_once(':') else {
            return Err(format!("\"{}\" is not of the form wavelength:value", short(token)));
        };
        samples.push((float(wavelength)?, float(value)?));
    }
    check_samples(&samples)?;
    Ok(SpectrumValue::Sampled(samples))
}

/// A spectrum file: lines of wavelength and value, `#` begins a comment.
pub(super) fn spectrum_file(text: &str) -> Result<SpectrumValue, Reason> {
    let mut samples = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        match floats(line).map_err(|e| format!("line {}: {e}", i + 1))?[..] {
            [wavelength, value] => samples.push((wavelength, value)),
            ref other => {
                return Err(format!(
                    "line {}: expected a wavelength and a value, found {} numbers",
                    i + 1,
                    other.len()
                ));
            }
        }
    }
    check_samples(&samples)?;
    Ok(SpectrumValue::Sampled(samples))
}

fn check_samples(samples: &[(f64, f64)]) -> Result<(), Reason> {
    if samples.len() < 2 {
        return Err(format!("a spectrum needs at least 2 samples, found {}", samples.len()));
    }
    if let Some(w) = samples.windows(2).find(|w| w[1].0 <= w[0].0) {
        return Err(format!("wavelengths must ascend: {} is followed by {}", w[0].0, w[1].0));
    }
    Ok(())
}

/// Rotation by `degrees` around `axis`; `None` for the zero axis.
pub(super) fn rotation(axis: DVec3, degrees: f64) -> Option<DMat4> {
    Some(DMat4::from_axis_angle(axis.try_normalize()?, degrees.to_radians()))
}

/// Camera to world for a viewer at `origin` who looks at `target`: +z forward, +x left.
/// Without an up vector any one is taken.
pub(super) fn look_at(origin: DVec3, target: DVec3, up: DVec3) -> Option<DMat4> {
    let forward = (target - origin).try_normalize()?;
    let up = if up == DVec3::ZERO { forward.any_orthonormal_vector() } else { up };
    // Parallel vectors leave rounding errors instead of zero.
    let left = up.try_normalize()?.cross(forward);
    if left.length() < 1e-12 {
        return None;
    }
    let left = left.normalize();
    let up = forward.cross(left);
    let column = |v: DVec3, w: f64| v.extend(w);
    Some(DMat4::from_cols(
        column(left, 0.0),
        column(up, 0.0),
        column(forward, 0.0),
        column(origin, 1.0),
    ))
}

/// 16 values (4 × 4) or 9 values (3 × 3), row by row.
pub(super) fn matrix(text: &str) -> Result<DMat4, Reason> {
    let v = floats(text)?;
    match v.len() {
        16 => {
            let rows: [f64; 16] = std::array::from_fn(|i| v[i]);
            Ok(DMat4::from_cols_array(&rows).transpose())
        }
        9 => {
            let at = |row: usize, column: usize| match (row < 3, column < 3) {
                (true, true) => v[3 * row + column],
                _ => f64::from(u8::from(row == column)),
            };
            let columns: [f64; 16] = std::array::from_fn(|i| at(i % 4, i / 4));
            Ok(DMat4::from_cols_array(&columns))
        }
        n => Err(format!("a matrix has 9 or 16 values, found {n}")),
    }
}

/// At most the first 40 characters, for messages.
pub(super) fn short(text: &str) -> String {
    let mut out: String =
        text.chars().take(40).map(|c| if c.is_control() { '·' } else { c }).collect();
    if text.chars().nth(40).is_some() {
        out.push('…');
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_must_be_finite() {
        assert_eq!(float(" 1.5e3 "), Ok(1500.0));
        assert_eq!(float(".5"), Ok(0.5));
        for bad in ["nan", "inf", "-Infinity", "1e999", "", "1.0f", "0x10", "1,5", "1 2"] {
            assert!(float(bad).is_err(), "{bad}");
        }
        assert_eq!(integer("-7"), Ok(-7));
        assert!(integer("7.0").is_err());
        assert!(integer("99999999999999999999").is_err());
        assert_eq!(boolean("True"), Ok(true));
        assert!(boolean("1").is_err());
    }

    #[test]
    fn colours() {
        assert_eq!(triple("0.5"), Ok(DVec3::splat(0.5)));
        assert_eq!(triple("1, 2 ,3"), Ok(DVec3::new(1.0, 2.0, 3.0)));
        assert!(triple("1 2").is_err());
        let c = srgb("#ff8000").unwrap();
        assert!((c - DVec3::new(1.0, 0.215_860_5, 0.0)).length() < 1e-6, "{c}");
        assert!(srgb("#ff80").is_err());
        assert!(srgb("#ff80é").is_err());
    }

    #[test]
    fn spectra() {
        assert_eq!(spectrum("0.5"), Ok(SpectrumValue::Uniform(0.5)));
        let sampled = SpectrumValue::Sampled(vec![(400.0, 1.0), (500.0, 2.0)]);
        assert_eq!(spectrum("400:1, 500:2"), Ok(sampled.clone()));
        assert_eq!(spectrum_file("# a comment\n400 1\n\n500\t2\n"), Ok(sampled));
        for bad in ["", "1 2 3", "400:1", "400:1 500", "500:1 400:2", "400:1 400:2", "400:x 500:1"]
        {
            assert!(spectrum(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn transforms() {
        let m = matrix("1 2 3 4 5 6 7 8 9 10 11 12 0 0 0 1").unwrap();
        assert_eq!(m.transform_point3(DVec3::ZERO), DVec3::new(4.0, 8.0, 12.0));
        let m = matrix("1 2 3 4 5 6 7 8 9").unwrap();
        assert_eq!(m.transform_point3(DVec3::X), DVec3::new(1.0, 4.0, 7.0));
        assert!(matrix("1 2 3").is_err());
        let r = rotation(DVec3::new(0.0, 0.0, 2.0), 90.0).unwrap();
        assert!((r.transform_vector3(DVec3::X) - DVec3::Y).length() < 1e-15);
        assert!(rotation(DVec3::ZERO, 90.0).is_none());
        let eye = look_at(DVec3::new(1.0, 2.0, 3.0), DVec3::new(1.0, 2.0, 5.0), DVec3::Y).unwrap();
        assert_eq!(eye.transform_vector3(DVec3::Z), DVec3::Z);
        assert_eq!(eye.transform_vector3(DVec3::X), DVec3::X);
        assert!(look_at(DVec3::ZERO, DVec3::ZERO, DVec3::Y).is_none());
        assert!(
            look_at(DVec3::ZERO, DVec3::new(0.1, 0.3, 0.7), DVec3::new(0.2, 0.6, 1.4)).is_none()
        );
        assert!(look_at(DVec3::ZERO, DVec3::X, DVec3::ZERO).is_some());
    }
}
