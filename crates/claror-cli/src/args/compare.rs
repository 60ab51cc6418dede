//! Options of `claror compare`.

use std::path::PathBuf;

use clap::{Args, ValueEnum, ValueHint};

use crate::units;

#[derive(Debug, Args)]
pub(crate) struct CompareArgs {
    /// Picture to judge
    #[arg(value_name = "A", value_hint = ValueHint::FilePath)]
    pub(crate) picture: PathBuf,
    /// Picture to compare with, the reference
    #[arg(value_name = "B", value_hint = ValueHint::FilePath)]
    pub(crate) reference: PathBuf,
    /// Compare this layer of OpenEXR files [default: the picture itself]
    #[arg(long, value_name = "NAME")]
    pub(crate) layer: Option<String>,
    /// Exit with 6 if a measure is above the value: mse, relmse, relmse-trimmed, mape, mean (its
    /// size), max, flip or dssim; may be repeated
    #[arg(long, value_name = "MEASURE=VALUE", value_parser = parse_threshold)]
    pub(crate) fail_above: Vec<(Metric, f64)>,
    /// Write where the pictures differ, in false colours
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) error_image: Option<PathBuf>,
    /// What the error image shows
    #[arg(long, value_name = "KIND", default_value = "relative", requires = "error_image")]
    pub(crate) error_kind: ErrorKind,
    /// Error at the end of the colours
    #[arg(
        long,
        value_name = "VALUE",
        default_value = "1",
        value_parser = units::parse_positive,
        requires = "error_image"
    )]
    pub(crate) error_scale: f32,
    /// For FLIP, show both pictures brighter by this many stops
    #[arg(
        long,
        value_name = "STOPS",
        default_value = "0",
        value_parser = units::parse_finite,
        allow_negative_numbers = true
    )]
    pub(crate) exposure: f32,
}

/// How the difference of two pictures is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Metric {
    Mse,
    Relmse,
    RelmseTrimmed,
    Mape,
    Mean,
    Max,
    Flip,
    Dssim,
}

/// What an error image shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ErrorKind {
    /// |a - b| / (|b| + 0.01), from black over purple and orange to yellow
    Relative,
    /// |a - b|, in the same colours
    Absolute,
    /// Red where a is brighter, blue where it is darker
    Signed,
    /// Visible difference (FLIP)
    Flip,
}

fn parse_threshold(text: &str) -> Result<(Metric, f64), String> {
    let (name, value) = units::parse_assignment(text)?;
    let metric = Metric::from_str(&name, true).map_err(|_| {
        "the measures are mse, relmse, relmse-trimmed, mape, mean, max, flip and dssim".to_owned()
    })?;
    match value.parse::<f64>() {
        Ok(value) if value >= 0.0 => Ok((metric, value)),
        _ => Err("expected a number not below 0".to_owned()),
    }
}
