//! Times, sizes and numbers as people type and read them.

use std::time::Duration;

/// `90`, `90s`, `1.5m`, `2h`, `500ms`: seconds unless it says otherwise.
pub(crate) fn parse_duration(text: &str) -> Result<Duration, String> {
    let digits = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at(digits);
    let value: f64 = number.parse().map_err(|_| "expected a time such as `90s`".to_owned())?;
    let scale = match unit {
        "" | "s" => 1.0,
        "ms" => 1e-3,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        "d" => 86400.0,
        _ => return Err(format!("unknown unit `{unit}`; use ms, s, m, h or d, as in `90s`")),
    };
    if value.is_nan() || value <= 0.0 {
        return Err("a time must be larger than 0".to_owned());
    }
    Duration::try_from_secs_f64(value * scale).map_err(|_| "that is too long".to_owned())
}

/// `512x512`.
pub(crate) fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let expected = || "expected WIDTHxHEIGHT in pixels, as in `640x480`".to_owned();
    let (width, height) = text.split_once(['x', 'X', '×']).ok_or_else(expected)?;
    let number = |text: &str| text.trim().parse::<u32>().map_err(|_| expected());
    let size = (number(width)?, number(height)?);
    if size.0 == 0 || size.1 == 0 {
        return Err("a picture needs at least one pixel each way".to_owned());
    }
    Ok(size)
}

/// `X,Y,WIDTH,HEIGHT` in pixels.
pub(crate) fn parse_crop(text: &str) -> Result<[u32; 4], String> {
    let expected = "expected X,Y,WIDTH,HEIGHT in pixels, as in `100,50,64,64`";
    let numbers: Vec<u32> = text
        .split(',')
        .map(|part| part.trim().parse().map_err(|_| expected.to_owned()))
        .collect::<Result<_, String>>()?;
    let crop: [u32; 4] = numbers.try_into().map_err(|_| expected.to_owned())?;
    if crop[2] == 0 || crop[3] == 0 {
        return Err("a crop needs at least one pixel each way".to_owned());
    }
    Ok(crop)
}

/// `2G`, `512MiB`, `1000000`: bytes, with binary multiples.
pub(crate) fn parse_bytes(text: &str) -> Result<u64, String> {
    let expected = || "expected a size such as `512M` or `2G`".to_owned();
    let digits = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at(digits);
    let power = match unit.to_ascii_lowercase().trim_end_matches("ib").trim_end_matches('b') {
        "" => 0,
        "k" => 10,
        "m" => 20,
        "g" => 30,
        "t" => 40,
        _ => return Err(expected()),
    };
    let value: f64 = number.trim().parse().map_err(|_| expected())?;
    let bytes = value * (1_u64 << power) as f64;
    if !(bytes >= 1.0 && bytes < u64::MAX as f64) {
        return Err(expected());
    }
    Ok(bytes as u64)
}

/// A positive, finite number.
pub(crate) fn parse_positive(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("expected a number larger than 0".to_owned()),
    }
}

/// A share above 0 and up to 1.
pub(crate) fn parse_share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value <= 1.0 => Ok(value),
        _ => Err("expected a share above 0 and up to 1, such as `0.05`".to_owned()),
    }
}

/// A finite number.
pub(crate) fn parse_finite(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err("expected a number".to_owned()),
    }
}

/// `NAME=VALUE`, the value possibly empty.
pub(crate) fn parse_assignment(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() => {
            Ok((name.trim().to_owned(), value.to_owned()))
        }
        _ => Err("expected NAME=VALUE".to_owned()),
    }
}

/// `0.8 s`, `12 s`, `3:07 min`, `1:02:03 h`.
pub(crate) fn duration(time: Duration) -> String {
    let seconds = time.as_secs_f64();
    let whole = seconds.round() as u64;
    match whole {
        0..10 => format!("{seconds:.1} s"),
        10..60 => format!("{whole} s"),
        60..3600 => format!("{}:{:02} min", whole / 60, whole % 60),
        _ => format!("{}:{:02}:{:02} h", whole / 3600, whole / 60 % 60, whole % 60),
    }
}

/// `1.50 MiB`.
pub(crate) fn bytes(count: u64) -> String {
    const UNITS: [&str; 5] = ["B", "KiB", "MiB", "GiB", "TiB"];
    let mut value = count as f64;
    let mut unit = 0;
    while value >= 1000.0 && unit + 1 < UNITS.len() {
        value /= 1024.0;
        unit += 1;
    }
    if unit == 0 { format!("{count} B") } else { format!("{} {}", digits(value), UNITS[unit]) }
}

/// `3.21 M`: three significant digits and a decimal prefix.
pub(crate) fn decimal(value: f64) -> String {
    for (limit, prefix) in [(1e9, "G"), (1e6, "M"), (1e3, "k")] {
        if value >= limit {
            return format!("{} {prefix}", digits(value / limit));
        }
    }
    format!("{} ", digits(value))
}

/// Three significant digits.
fn digits(value: f64) -> String {
    let decimals = if value >= 100.0 {
        0
    } else if value >= 10.0 {
        1
    } else {
        2
    };
    format!("{value:.decimals$}")
}

/// `1 234 567`: groups of three, for counts in tables.
pub(crate) fn grouped(count: u64) -> String {
    let plain = count.to_string();
    let mut out = String::new();
    for (index, digit) in plain.chars().enumerate() {
        if index > 0 && (plain.len() - index).is_multiple_of(3) {
            out.push(' ');
        }
        out.push(digit);
    }
    out
}

/// `1 triangle`, `2 triangles`.
pub(crate) fn plural(count: u64, noun: &str) -> String {
    let ending = if count == 1 { "" } else { "s" };
    format!("{} {noun}{ending}", grouped(count))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_read_with_their_unit() {
        let ms = |text| parse_duration(text).map(|d| d.as_millis());
        assert_eq!(ms("60s"), Ok(60_000));
        assert_eq!(ms("1.5m"), Ok(90_000));
        assert_eq!(ms("500ms"), Ok(500));
        assert_eq!(ms("2"), Ok(2_000));
        for bad in ["", "s", "-1s", "0", "nan", "inf", "1e300h", "5 parsec", "1s2"] {
            assert!(parse_duration(bad).is_err(), "{bad:?} was accepted");
        }
    }

    #[test]
    fn sizes_and_crops_are_read() {
        assert_eq!(parse_size("640x480"), Ok((640, 480)));
        assert_eq!(parse_crop("1, 2,3,4"), Ok([1, 2, 3, 4]));
        for bad in ["640", "0x3", "3x0", "-1x2", "axb", "1x2x3", "99999999999x1"] {
            assert!(parse_size(bad).is_err(), "{bad:?} was accepted");
        }
        for bad in ["", "1,2,3", "1,2,3,4,5", "0,0,0,1", "a,0,1,1"] {
            assert!(parse_crop(bad).is_err(), "{bad:?} was accepted");
        }
    }

    #[test]
    fn bytes_are_read_and_written() {
        assert_eq!(parse_bytes("2G"), Ok(2 << 30));
        assert_eq!(parse_bytes("1.5KiB"), Ok(1536));
        assert_eq!(parse_bytes("77"), Ok(77));
        assert!(parse_bytes("lots").is_err() && parse_bytes("-1").is_err());
        assert_eq!(bytes(12), "12 B");
        assert_eq!(bytes(1536), "1.50 KiB");
        assert_eq!(bytes(3 << 30), "3.00 GiB");
    }

    #[test]
    fn numbers_are_written_for_people() {
        assert_eq!(duration(Duration::from_millis(840)), "0.8 s");
        assert_eq!(duration(Duration::from_millis(59_600)), "1:00 min");
        assert_eq!(duration(Duration::from_secs(3723)), "1:02:03 h");
        assert_eq!(decimal(3_210_000.0), "3.21 M");
        assert_eq!(grouped(1_234_567), "1 234 567");
        assert_eq!(plural(1, "triangle"), "1 triangle");
        assert_eq!(plural(12, "triangle"), "12 triangles");
    }
}
