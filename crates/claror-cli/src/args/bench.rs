//! Options of `claror bench`.

use std::path::PathBuf;

use clap::{Args, ValueHint};
use claror_lab::plan::Size;

use crate::units;

#[derive(Debug, Args)]
#[command(after_help = notes())]
pub(crate) struct BenchArgs {
    /// Scene files, in the XML format of Mitsuba 3
    #[arg(
        value_name = "SCENE",
        value_hint = ValueHint::FilePath,
        required_unless_present = "print_plan"
    )]
    pub(crate) scenes: Vec<PathBuf>,
    /// What is measured: the name of a ready plan, or a file in TOML
    #[arg(
        long,
        value_name = "NAME|FILE",
        value_hint = ValueHint::FilePath,
        required_unless_present = "print_plan"
    )]
    pub(crate) plan: Option<String>,
    /// Folder for runs, tables, study and report; an experiment that was stopped goes on in it
    #[arg(
        long,
        value_name = "DIR",
        value_hint = ValueHint::DirPath,
        required_unless_present_any = ["print_plan", "dry_run"]
    )]
    pub(crate) out: Option<PathBuf>,
    /// Show all runs without making any
    #[arg(long)]
    pub(crate) dry_run: bool,
    /// Make no runs: put study and report together from what is there
    #[arg(long, conflicts_with = "dry_run")]
    pub(crate) report_only: bool,
    /// Write a ready plan to standard output, to start one's own from
    #[arg(long, value_name = "NAME", exclusive = true)]
    pub(crate) print_plan: Option<String>,
    #[command(flatten)]
    pub(crate) changes: ChangeArgs,
    #[command(flatten)]
    pub(crate) reference: ReferenceArgs,
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
}

/// What to change in the plan.
#[derive(Debug, Args)]
#[command(next_help_heading = "Changes to the plan")]
pub(crate) struct ChangeArgs {
    /// Run every setting with this many seeds
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub(crate) seeds: Option<u16>,
    /// Size of the pictures
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = parse_size)]
    pub(crate) size: Option<Size>,
    /// Threads of each run [default: what the plan says, else as many as the processor runs at
    /// once]
    #[arg(
        short,
        long,
        env = "CLAROR_THREADS",
        hide_env_values = true,
        value_name = "N",
        value_parser = clap::value_parser!(u16).range(1..=4096)
    )]
    pub(crate) threads: Option<u16>,
    /// Multiply the times of equal-time comparisons
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = parse_factor)]
    pub(crate) time_scale: f64,
}

/// What pictures are compared with.
#[derive(Debug, Args)]
#[command(next_help_heading = "Reference")]
pub(crate) struct ReferenceArgs {
    /// Compare with these pictures: two independent renders of the scene in the same size
    #[arg(
        long,
        value_names = ["FILE", "FILE"],
        num_args = 2,
        value_hint = ValueHint::FilePath,
        conflicts_with = "reference_spp"
    )]
    pub(crate) reference: Option<Vec<PathBuf>>,
    /// Samples per pixel of the reference, both halves together
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..))]
    pub(crate) reference_spp: Option<u32>,
    /// Folder in which references are kept for later experiments [default:
    /// $XDG_CACHE_HOME/claror/references, else ~/.cache/claror/references]
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub(crate) references: Option<PathBuf>,
}

/// How to read the scenes.
#[derive(Debug, Args)]
#[command(next_help_heading = "Scene")]
pub(crate) struct SceneArgs {
    /// Set a parameter of the scene files: replaces its "default" element and stands for $NAME
    #[arg(short = 'D', long = "define", value_name = "NAME=VALUE", value_parser = units::parse_assignment)]
    pub(crate) defines: Vec<(String, String)>,
    /// Replace unsupported plugins by grey diffuse, with a warning, instead of refusing the scene
    #[arg(long)]
    pub(crate) lenient: bool,
}

fn parse_size(text: &str) -> Result<Size, String> {
    let (width, height) = units::parse_size(text)?;
    Ok(Size([width, height]))
}

fn parse_factor(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(factor) if factor > 0.0 && factor.is_finite() => Ok(factor),
        _ => Err("expected a number larger than 0".to_owned()),
    }
}

fn notes() -> String {
    let mut text = "Ready plans:\n".to_owned();
    for plan in claror_lab::plan::READY {
        text += &format!("  {:12} {}\n", plan.name, plan.about);
    }
    text + "
Examples:
  claror bench scenes/thesis-box.xml --plan quick --out quick
  claror bench a.xml b.xml --plan thesis --out thesis --seeds 1 --time-scale 0.1
  claror bench --print-plan quick > mine.toml
  claror bench room.xml --plan mine.toml --out mine --dry-run

Ctrl-C or a crash loses the run in progress and nothing else: the same command goes on. Every run
is a process of its own; its command line is in the report. Exit code 6 says that runs failed."
}
