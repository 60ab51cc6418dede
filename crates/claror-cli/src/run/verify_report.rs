//! What checks found, in words and as JSON.

use std::time::Duration;

use claror::film::LAYER_NAMES;
use claror::integrator::IrradianceCache;
use claror::verify::{
    CacheReport, Estimate, Interval, PictureCheck, PictureReport, Share, Verdict, Verification,
};
use serde_json::{Map, Value, json};

use super::verify::{worst_lookups, worst_pixels};
use crate::progress::seconds;
use crate::units;

/// Worst places in the text; JSON has all.
const WORST_SHOWN: usize = 3;
/// More checks than this are as good as impossible.
const VERY_MANY: f64 = 1e8;

/// A line of the report: what, its value.
fn line(name: &str, value: &str) -> String {
    format!("  {name:16} {value}")
}

/// `+0.12 % ± 0.35 %`.
fn percent(estimate: &Estimate) -> String {
    format!("{:+.2} % ± {:.2} %", 100.0 * estimate.value, 100.0 * estimate.margin())
}

/// `0.3 %`: a limit as it was given.
fn limit(value: f64) -> String {
    format!("{} %", (100.0 * value * 1e6).round() / 1e6)
}

/// `1.2 to 3.4 %`.
fn range(interval: &Interval) -> String {
    format!("{:.1} to {:.1} %", 100.0 * interval.low, 100.0 * interval.high)
}

fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Confirmed => "confirmed",
        Verdict::Refuted => "refuted",
        Verdict::Undecided => "undecided",
    }
}

/// What the checks say about the claim on the mean of the picture: "off by …".
pub(crate) fn bias_claim(found: &Verification) -> String {
    let measured = percent(&found.picture.bias[3]);
    let claim = limit(found.settings.max_bias);
    match found.bias_verdict() {
        Verdict::Confirmed => format!("off by {measured}: at most {claim}, confirmed"),
        Verdict::Refuted => format!("off by {measured}: more than {claim}"),
        Verdict::Undecided => {
            let needed = found.checks_to_decide();
            let hint = if needed < VERY_MANY {
                format!("about {} would tell", units::plural(needed.ceil() as u64, "check"))
            } else {
                "it is too close to that".to_owned()
            };
            format!("off by {measured}: whether by more than {claim} is open; {hint}")
        }
    }
}

/// What the checks say about the claim on the share of pixels that are off.
pub(crate) fn share_claim(found: &Verification) -> String {
    let beyond = &found.picture.beyond;
    let measured = range(&beyond.interval());
    let (off, claim) = (limit(found.picture.tolerance), limit(found.settings.max_share));
    let what = format!("{measured} of the pixels are off by over {off}");
    match found.share_verdict() {
        Verdict::Confirmed => format!("{what}: at most {claim}, confirmed"),
        Verdict::Refuted => format!("{what}: more than {claim}"),
        Verdict::Undecided => {
            let doubt = beyond.possibly - beyond.surely;
            let hint = if doubt > beyond.surely {
                format!("{doubt} of {} are in doubt, more --verify-paths would tell", beyond.of)
            } else {
                "more checks would tell".to_owned()
            };
            format!("{what}: whether more than {claim} is open; {hint}")
        }
    }
}

/// The report as text.
pub(crate) fn lines(
    found: &Verification,
    cache: Option<&IrradianceCache>,
    elapsed: Duration,
) -> Vec<String> {
    let picture = &found.picture;
    let mut lines = vec![format!(
        "verification by {} of {} paths, {}rays, {}; ± and ranges hold with 95 %",
        units::plural(picture.checks.len() as u64, "check"),
        picture.paths,
        units::decimal(found.rays as f64),
        units::duration(elapsed),
    )];
    lines.push(line("mean", &bias_claim(found)));
    lines.extend(picture_lines(picture));
    lines.push(line("share", &share_claim(found)));
    lines.extend(picture_worst(picture));
    if let (Some(report), Some(cache)) = (&found.cache, cache) {
        lines.extend(cache_lines(report, cache));
    }
    lines
}

fn picture_worst(picture: &PictureReport) -> Vec<String> {
    let shown = worst_pixels(picture).into_iter().take(WORST_SHOWN);
    let place = |check: &PictureCheck| {
        let (x, y) = check.pixel;
        let (value, expected) = (f64::from(check.value.luminance()), check.expected());
        let sigmas = picture.sigmas(check);
        let text = format!("column {x}, row {y}: {value:.4} for {expected:.4}, {sigmas:+.1} sigma");
        line("worst", &text)
    };
    shown.map(place).collect()
}

fn picture_lines(picture: &PictureReport) -> Vec<String> {
    let [red, green, blue, _] = &picture.bias;
    let colours = [red, green, blue].map(percent).join(", ");
    let mut lines = vec![line("  by colour", &colours)];
    for (name, layer) in LAYER_NAMES.iter().zip(&picture.layers) {
        lines.push(line(&format!("  from {name}"), &percent(layer)));
    }
    let root = |v: f64| v.max(0.0).sqrt();
    let interval = picture.mse.interval();
    lines.push(line(
        "error",
        &format!(
            "rmse {:.4} ({:.4} to {:.4}), relmse {:.2e} ± {:.1e}, without the checks' noise",
            root(picture.mse.value),
            root(interval.low),
            root(interval.high),
            picture.rel_mse.value,
            picture.rel_mse.margin(),
        ),
    ));
    lines
}

fn cache_lines(report: &CacheReport, cache: &IrradianceCache) -> Vec<String> {
    let (served, all) = report.served;
    let mut lines = Vec::new();
    if let Some(bias) = &report.bias {
        lines.push(line("cache", &format!("its light is off by {}", percent(bias))));
    }
    if let Some((rmse, low, high)) = report.rmse() {
        let spread = range(&Interval { low, high });
        let text = format!(
            "rmse {:.1} % of the mean ({spread}), by {} walks per check",
            100.0 * rmse,
            report.walks
        );
        lines.push(line("  look-ups", &text));
        let beyond = &report.beyond;
        let text =
            format!("{} are off by over {}", range(&beyond.interval()), limit(report.tolerance));
        lines.push(line("", &text));
    }
    if all > 0 {
        let unserved = range(&report.unserved().sure_interval());
        let text =
            format!("{} of {} points ({unserved})", all - served, units::grouped(all as u64));
        lines.push(line("  not served", &text));
    }
    for check in worst_lookups(report).into_iter().take(WORST_SHOWN) {
        let (Some((value, expected)), Some(probe)) = (check.irradiance(), &check.probe) else {
            continue;
        };
        let (x, y) = check.pixel;
        let (sigmas, cause) = (report.sigmas(check), cache.cause(probe).name());
        let text = format!(
            "column {x}, row {y}: {value:.4} for {expected:.4}, {sigmas:+.1} sigma, {cause}"
        );
        lines.push(line("  worst", &text));
    }
    lines
}

fn estimate_json(estimate: &Estimate) -> Value {
    let interval = estimate.interval();
    json!({
        "value": estimate.value,
        "standard_error": estimate.standard_error,
        "dof": estimate.dof,
        "low": interval.low,
        "high": interval.high,
    })
}

fn share_json(share: &Share) -> Value {
    let (interval, sure) = (share.interval(), share.sure_interval());
    json!({
        "surely": share.surely,
        "possibly": share.possibly,
        "of": share.of,
        "low": interval.low,
        "high": interval.high,
        "surely_low": sure.low,
        "surely_high": sure.high,
    })
}

/// The report as JSON: all numbers. What is not finite is null.
pub(crate) fn json(
    found: &Verification,
    cache: Option<&IrradianceCache>,
    elapsed: Duration,
) -> Value {
    let settings = &found.settings;
    let cache = found.cache.as_ref().zip(cache);
    json!({
        "checks": found.picture.checks.len(),
        "seconds": seconds(elapsed),
        "rays": found.rays,
        "verdict": verdict(found.verdict()),
        "claims": {
            "bias": { "limit": settings.max_bias, "verdict": verdict(found.bias_verdict()) },
            "share": { "limit": settings.max_share, "verdict": verdict(found.share_verdict()) },
        },
        "checks_to_decide": Some(found.checks_to_decide()).filter(|n| *n < VERY_MANY),
        "picture": picture_json(&found.picture),
        "cache": cache.map(|(report, cache)| cache_json(report, cache)),
    })
}

fn picture_json(picture: &PictureReport) -> Value {
    let [red, green, blue, luminance] = &picture.bias;
    let layers: Map<String, Value> = LAYER_NAMES
        .iter()
        .zip(&picture.layers)
        .map(|(name, layer)| ((*name).to_owned(), estimate_json(layer)))
        .collect();
    let worst: Vec<Value> = worst_pixels(picture)
        .into_iter()
        .map(|check| {
            json!({
                "column": check.pixel.0,
                "row": check.pixel.1,
                "value": check.value.luminance(),
                "expected": check.expected(),
                "sigmas": picture.sigmas(check),
            })
        })
        .collect();
    json!({
        "paths": picture.paths,
        "mean": picture.mean,
        "bias": {
            "red": estimate_json(red),
            "green": estimate_json(green),
            "blue": estimate_json(blue),
            "luminance": estimate_json(luminance),
        },
        "layers": layers,
        "mse": estimate_json(&picture.mse),
        "relmse": estimate_json(&picture.rel_mse),
        "tolerance": picture.tolerance,
        "beyond": share_json(&picture.beyond),
        "worst": worst,
    })
}

fn cache_json(report: &CacheReport, cache: &IrradianceCache) -> Value {
    let worst: Vec<Value> = worst_lookups(report)
        .into_iter()
        .filter_map(|check| {
            let (value, expected) = check.irradiance()?;
            Some(json!({
                "column": check.pixel.0,
                "row": check.pixel.1,
                "irradiance": value,
                "expected": expected,
                "sigmas": report.sigmas(check),
                "cause": cache.cause(check.probe.as_ref()?).name(),
            }))
        })
        .collect();
    json!({
        "walks": report.walks,
        "points": report.served.1,
        "served": report.served.0,
        "mean_irradiance": report.mean,
        "bias": report.bias.as_ref().map(estimate_json),
        "mse": report.mse.as_ref().map(estimate_json),
        "tolerance": report.tolerance,
        "beyond": share_json(&report.beyond),
        "worst": worst,
    })
}
