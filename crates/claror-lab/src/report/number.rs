//! Numbers as readers want them: three significant digits, a real minus sign, powers of ten.

use maud::{Markup, html};

use crate::study::Spread;

/// What stands where there is no number.
const NONE: &str = "–";
const SUPERSCRIPTS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];

/// Three significant digits; powers of ten below 0.001 and from 100 000.
pub(super) fn number(v: f64) -> String {
    if !v.is_finite() {
        return NONE.into();
    }
    let size = v.abs();
    if size == 0.0 {
        "0".into()
    } else if (0.001..99_950.0).contains(&size) {
        let digits = (2 - size.log10().floor() as i32).max(0) as usize;
        minus(&format!("{v:.digits$}"))
    } else {
        scientific(v)
    }
}

/// As `1.23 × 10⁻³`.
pub(super) fn scientific(v: f64) -> String {
    if !v.is_finite() {
        return NONE.into();
    }
    if v == 0.0 {
        return "0".into();
    }
    let text = format!("{v:.2e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    format!("{}\u{202f}×\u{202f}10{}", minus(mantissa), superscript(exponent))
}

/// `10⁻³`, for ticks of axes and round errors.
pub(super) fn power_of_ten(exponent: i32) -> String {
    format!("10{}", superscript(&exponent.to_string()))
}

/// `1 × 10⁻³` in its shortest form: `10⁻³`, `5 × 10⁻⁴`, `0.02`.
pub(super) fn round_number(v: f64) -> String {
    if !(v.is_finite() && v > 0.0) {
        return number(v);
    }
    let exponent = (v.log10() + 1e-9).floor() as i32;
    let mantissa = v / 10f64.powi(exponent);
    if (mantissa - 1.0).abs() < 1e-6 {
        power_of_ten(exponent)
    } else {
        let digits = (mantissa * 100.0).round() / 100.0;
        format!("{digits}\u{202f}×\u{202f}{}", power_of_ten(exponent))
    }
}

fn superscript(digits: &str) -> String {
    let one = |c: char| match c.to_digit(10) {
        Some(d) => SUPERSCRIPTS[d as usize],
        None => '⁻',
    };
    digits.chars().map(one).collect()
}

fn minus(text: &str) -> String {
    text.replace('-', "−")
}

/// As few digits as a given number needs, three at most: `0.4`, `2`, `148`.
pub(super) fn plain(v: f64) -> String {
    let text = number(v);
    if text.contains('.') && !text.contains('×') {
        text.trim_end_matches('0').trim_end_matches('.').into()
    } else {
        text
    }
}

/// Text with raised digits as markup, because few fonts have all of them in one style.
pub(super) fn rich(text: &str) -> Markup {
    let mut parts: Vec<(bool, String)> = Vec::new();
    for c in text.chars() {
        let digit =
            SUPERSCRIPTS.iter().position(|&s| s == c).and_then(|d| char::from_digit(d as u32, 10));
        let (raised, c) = match (digit, c) {
            (Some(digit), _) => (true, digit),
            (None, '⁻') => (true, '−'),
            _ => (false, c),
        };
        match parts.last_mut() {
            Some((same, part)) if *same == raised => part.push(c),
            _ => parts.push((raised, c.to_string())),
        }
    }
    html! { @for (raised, part) in &parts { @if *raised { sup { (part) } } @else { (part) } } }
}

/// A fraction as per cent; `signed` puts a plus before what is above 0.
pub(super) fn percent(v: f64, signed: bool) -> String {
    let sign = if signed && v > 0.0 { "+" } else { "" };
    if v.is_finite() { format!("{sign}{}\u{202f}%", number(v * 100.0)) } else { NONE.into() }
}

/// Seconds.
pub(super) fn seconds(v: f64) -> String {
    format!("{}\u{202f}s", number(v))
}

/// Bytes as MiB.
pub(super) fn mebibytes(v: f64) -> String {
    number(v / f64::from(1 << 20))
}

/// Whole numbers in groups of three.
pub(super) fn whole(v: f64) -> String {
    if !v.is_finite() {
        return NONE.into();
    }
    let digits = format!("{:.0}", v.abs());
    let mut out = String::new();
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push('\u{202f}');
        }
        out.push(c);
    }
    if v <= -0.5 { format!("−{out}") } else { out }
}

/// Four digits after the point, for measures in [0, 1].
pub(super) fn fraction(v: f64) -> String {
    if v.is_finite() { minus(&format!("{v:.4}")) } else { NONE.into() }
}

/// How many times as much: two digits, more if it is large.
pub(super) fn times(ratio: f64) -> String {
    if ratio < 9.95 { format!("{ratio:.1}") } else { whole(round_to_two(ratio)) }
}

fn round_to_two(v: f64) -> f64 {
    let unit = 10f64.powi(v.log10().floor() as i32 - 1);
    (v / unit).round() * unit
}

/// `low–high`, or nothing if both read the same as the median.
pub(super) fn range(spread: &Spread, format: &dyn Fn(f64) -> String) -> Option<String> {
    let (low, high) = (format(spread.low), format(spread.high));
    // A power of ten that both share is written once.
    let shorter = match (low.split_once('\u{202f}'), high.split_once('\u{202f}')) {
        (Some((mantissa, a)), Some((_, b))) if a == b && a.starts_with('×') => mantissa,
        _ => &low,
    };
    // A dash after a minus sign would read as a number.
    let dash = if spread.low < 0.0 { " … " } else { "–" };
    (low != high).then(|| format!("{shorter}{dash}{high}"))
}

/// Median and range in one line.
pub(super) fn spread(spread: &Spread, format: &dyn Fn(f64) -> String) -> String {
    let median = format(spread.median);
    range(spread, format).map_or(median.clone(), |range| format!("{median} [{range}]"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        let cases = [
            (0.0, "0"),
            (2.0, "2.00"),
            (148.4, "148"),
            (12_345.6, "12346"),
            (0.012_34, "0.0123"),
            (-0.5, "−0.500"),
            (1.234e-5, "1.23\u{202f}×\u{202f}10⁻⁵"),
            (1.0e12, "1.00\u{202f}×\u{202f}10¹²"),
            (f64::NAN, "–"),
            (f64::INFINITY, "–"),
        ];
        for (v, text) in cases {
            assert_eq!(number(v), text, "{v}");
        }
        assert_eq!(whole(1_234_567.0), "1\u{202f}234\u{202f}567");
        assert_eq!(whole(-0.2), "0");
        assert_eq!(round_number(1e-3), "10⁻³");
        assert_eq!(round_number(5e-4), "5\u{202f}×\u{202f}10⁻⁴");
        assert_eq!(times(70.47), "70");
        assert_eq!(times(1.26), "1.3");
        assert_eq!(times(12_345.0), "12\u{202f}000");
        assert_eq!(percent(0.031, true), "+3.10\u{202f}%");
    }

    #[test]
    fn ranges_that_read_the_same_are_left_out() {
        let same = Spread { median: 2.0, low: 2.000_1, high: 2.000_2 };
        assert_eq!(spread(&same, &number), "2.00");
        let wide = Spread { median: 2.0, low: 1.5, high: 3.0 };
        assert_eq!(spread(&wide, &number), "2.00 [1.50–3.00]");
        let small = Spread { median: 2e-4, low: 1e-4, high: 3e-4 };
        let text = range(&small, &scientific).unwrap();
        assert_eq!(text, "1.00–3.00\u{202f}×\u{202f}10⁻⁴");
    }

    #[test]
    fn raised_digits_become_markup() {
        let html = rich("<2\u{202f}×\u{202f}10⁻¹² s").into_string();
        assert_eq!(html, "&lt;2\u{202f}×\u{202f}10<sup>−12</sup> s");
        assert_eq!([plain(0.4), plain(2.0), plain(148.0)], ["0.4", "2", "148"]);
    }
}
