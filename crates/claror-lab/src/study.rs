//! What an experiment found: everything that a report shows, in the order in which it shows it.
//!
//! Times are seconds, memory is bytes, errors are those of [`Errors`]; paths are relative to the
//! folder of the report.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// A whole experiment: one plan on one or more scenes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Study {
    /// Title of the plan.
    pub title: String,
    /// Name of a ready plan, or the plan's file.
    pub plan: String,
    /// What the plan says of itself, one paragraph.
    pub about: String,
    /// The plan as TOML, so that anyone can repeat it.
    pub plan_text: String,
    /// Command line of the experiment.
    pub command: Vec<String>,
    /// When the first run began, RFC 3339.
    pub started: String,
    /// Where it ran.
    pub machine: Machine,
    /// What was found, scene by scene.
    pub scenes: Vec<SceneStudy>,
}

/// The computer and the program that made the runs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Machine {
    /// Name of the processor.
    pub processor: String,
    /// Processors that the system runs at once.
    pub cores: usize,
    /// Threads that each run used.
    pub threads: usize,
    /// Main memory in bytes.
    pub memory_bytes: u64,
    /// Operating system and its version.
    pub system: String,
    /// Version of claror.
    pub version: String,
    /// Optimised or debug build.
    pub build: String,
}

/// What was found on one scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SceneStudy {
    /// File name without ending.
    pub name: String,
    /// Scene file as given.
    pub file: String,
    /// Hash of the scene's content, 32 hexadecimal digits.
    pub hash: String,
    /// Width and height of the pictures in pixels.
    pub size: [usize; 2],
    /// What pictures were compared with.
    pub reference: Reference,
    /// Series of settings, in the order of the plan.
    pub series: Vec<Series>,
    /// Pictures made in the same time.
    pub equal_time: Vec<EqualTime>,
    /// Time that each series needs to reach an error.
    pub equal_error: Vec<EqualError>,
    /// What a look-up costs, by index and number of records.
    pub lookups: Vec<LookupCost>,
}

/// The picture that others are compared with: the mean of two independent halves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// The two halves, OpenEXR, full paths.
    pub halves: [PathBuf; 2],
    /// Samples per pixel of both halves together; 0 if pictures were given.
    pub spp: u64,
    /// Processor seconds that it took, in this or an earlier experiment.
    pub cpu_seconds: f64,
    /// Relative mean squared error of the mean of the halves, estimated from their difference.
    pub rel_mse: f64,
    /// Command lines that made the halves; empty if pictures were given.
    pub commands: Vec<Vec<String>>,
}

/// One method at several settings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// Short name, unique in the plan: `path`.
    pub name: String,
    /// Name in charts and tables: `Path tracing`.
    pub label: String,
    /// What it is for, one or two sentences; may be empty.
    pub note: String,
    /// What varies from setting to setting.
    pub kind: SeriesKind,
    /// Settings in the order of the plan.
    pub settings: Vec<Setting>,
    /// How the error falls with time, if there are at least three settings.
    pub slope: Option<Slope>,
}

/// What varies in a series.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SeriesKind {
    /// Numbers of one parameter, such as `spp` or `integrator.accuracy`: [`Setting::x`] holds them.
    Sweep {
        /// The parameter.
        parameter: String,
    },
    /// Steps with a name each: a ladder of methods, or an ablation of several parameters.
    Steps,
    /// Settings searched so that they fill a time: [`Setting::x`] is the time in seconds.
    EqualTime,
}

/// One setting of a method: the same command with each seed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Setting {
    /// Name in tables: `accuracy=0.1`, `16 spp`, or the name of the step.
    pub label: String,
    /// What to see in it, for steps; may be empty.
    pub note: String,
    /// The number that varies, if it is a number.
    pub x: Option<f64>,
    /// Finished runs, by seed. Empty if all failed.
    pub runs: Vec<Run>,
    /// Medians and extremes over the seeds; without runs none.
    pub summary: Option<Summary>,
    /// Further pictures, made in a run of their own that is not timed.
    pub illustrations: Vec<Illustration>,
    /// Why runs are missing, one message each.
    pub failures: Vec<String>,
}

/// One run of the renderer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Unique name in the study, also of its folder under `runs/`.
    pub id: String,
    /// Seed of the sample pattern.
    pub seed: u64,
    /// The command line, to be repeated in a shell.
    pub command: Vec<String>,
    /// When it began, RFC 3339.
    pub started: String,
    /// Load average of the machine when it began, without the run itself.
    pub load: f64,
    /// Wall-clock seconds of rendering, as the program says.
    pub seconds: f64,
    /// Processor seconds of the whole process, user and system.
    pub cpu_seconds: f64,
    /// Wall-clock seconds of the phases, in order.
    pub phases: Vec<(String, f64)>,
    /// Largest resident memory in bytes.
    pub peak_memory_bytes: u64,
    /// Records in the cache, or grid points with `gridcache`.
    pub records: Option<u64>,
    /// Samples per pixel in the mean.
    pub spp: f64,
    /// Rays traced.
    pub rays: u64,
    /// Error of the picture.
    pub errors: Errors,
    /// The picture, OpenEXR.
    pub picture: PathBuf,
    /// Parameters in force.
    pub parameters: BTreeMap<String, String>,
}

/// How far a picture is from its reference.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Mean squared error.
    pub mse: f64,
    /// Relative mean squared error, free of the reference's own noise: mean of
    /// (x − a)(x − b) / (r² + 0.01), where a, b are the halves and r their mean. Can be below 0
    /// where the picture is better than the reference can tell.
    pub rel_mse: f64,
    /// Mean absolute error relative to the reference.
    pub mape: f64,
    /// Mean of the picture over mean of the reference, minus 1.
    pub bias: f64,
    /// Mean structural similarity of the tone-mapped luminance: 1 is equal.
    pub ssim: f64,
    /// Mean visible difference (FLIP): 0 is equal.
    pub flip: f64,
}

/// A quantity over the seeds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Median.
    pub median: f64,
    /// Smallest.
    pub low: f64,
    /// Largest.
    pub high: f64,
}

/// Quantities of a setting over the seeds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Wall-clock seconds of rendering.
    pub seconds: Spread,
    /// Processor seconds.
    pub cpu_seconds: Spread,
    /// Largest resident memory in bytes.
    pub peak_memory_bytes: Spread,
    /// Records, if there are any.
    pub records: Option<Spread>,
    /// The fields of [`Errors`].
    pub mse: Spread,
    /// See [`Errors::rel_mse`].
    pub rel_mse: Spread,
    /// See [`Errors::mape`].
    pub mape: Spread,
    /// See [`Errors::bias`].
    pub bias: Spread,
    /// See [`Errors::ssim`].
    pub ssim: Spread,
    /// See [`Errors::flip`].
    pub flip: Spread,
}

/// A further picture of a setting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Illustration {
    /// What it shows, for readers and as alternative text: `records`, `harmonic mean distance`.
    pub title: String,
    /// PNG file.
    pub picture: PathBuf,
}

/// Exponent of the error against time: error ∝ time^exponent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Slope {
    /// Least squares in the logarithms of `rel_mse` and `cpu_seconds`.
    pub exponent: f64,
    /// Ends of its 95 % interval.
    pub low: f64,
    /// See [`Slope::low`].
    pub high: f64,
}

/// Pictures made in about the same time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EqualTime {
    /// The time in wall-clock seconds.
    pub seconds: f64,
    /// The contenders: name of the series, index of its setting.
    pub entries: Vec<(String, usize)>,
}

/// Time that each series needs to reach an error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EqualError {
    /// The error, as [`Errors::rel_mse`].
    pub rel_mse: f64,
    /// Name of the series, and when it reaches the error.
    pub cpu_seconds: Vec<(String, TimeToError)>,
}

/// When a series reaches an error, processor seconds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TimeToError {
    /// Between two settings, interpolated in the logarithms of time and error.
    Reached(f64),
    /// Its fastest setting, which took this long, is already better.
    AtMost(f64),
    /// No setting is that good, and the slowest took this long.
    NotIn(f64),
    /// There are no settings with a time and an error.
    Unknown,
}

impl TimeToError {
    /// Least and most time that it can be.
    pub fn bounds(self) -> [f64; 2] {
        match self {
            Self::Reached(t) => [t, t],
            Self::AtMost(t) => [0.0, t],
            Self::NotIn(t) => [t, f64::INFINITY],
            Self::Unknown => [0.0, f64::INFINITY],
        }
    }
}

/// What a look-up costs in a cache of some size.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LookupCost {
    /// Name of the index: `octree`.
    pub index: String,
    /// Records in the cache.
    pub records: u64,
    /// Nanoseconds per look-up, median of several passes.
    pub nanoseconds: f64,
    /// Records that a look-up tests, in the mean.
    pub candidates: f64,
}
