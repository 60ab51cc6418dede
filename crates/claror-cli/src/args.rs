//! What was typed: options and their help, from which manual and completions are made as well.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Parser, Subcommand, ValueEnum, ValueHint};
use claror::verify::{LEAST_CHECKS, MOST_CHECKS};

use crate::units;

mod bench;
mod cache;
mod compare;
mod show;

pub(crate) use bench::BenchArgs;
pub(crate) use cache::{CacheCommand, ExportArgs, LookupsArgs};
pub(crate) use compare::{CompareArgs, ErrorKind, Metric};
pub(crate) use show::{PointColor, ShowArgs};

/// Physically based renderer for Mitsuba 3 scenes.
#[derive(Debug, Parser)]
#[command(
    name = "claror",
    version,
    after_help = crate::exit::TABLE,
    subcommand_required = true,
    arg_required_else_help = true,
    max_term_width = 100
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
    #[command(flatten)]
    pub(crate) common: CommonArgs,
}

/// Options of every command.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct CommonArgs {
    /// Write one JSON object per line to standard output, and nothing else
    ///
    /// Every object has a member "event": start, phase, progress, warning, error or result.
    #[arg(long, global = true, help_heading = "Messages")]
    pub(crate) json: bool,
    /// Print errors only
    #[arg(short, long, global = true, conflicts_with = "verbose", help_heading = "Messages")]
    pub(crate) quiet: bool,
    /// Also print versions, resolved parameters and timings
    #[arg(short, long, global = true, help_heading = "Messages")]
    pub(crate) verbose: bool,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Render a scene to pictures
    Render(Box<RenderArgs>),
    /// Render a scene and measure how far the picture is off, by paths
    #[command(after_help = VERIFY_NOTES)]
    Verify(Box<RenderArgs>),
    /// Show what was understood of a scene: counts, lights, memory, warnings
    Info(SceneArgs),
    /// Read and validate a scene without rendering it
    Check(SceneArgs),
    /// Measure how far two pictures differ
    Compare(CompareArgs),
    /// Look into a file of `render --cache`
    #[command(subcommand, subcommand_required = true, arg_required_else_help = true)]
    Cache(CacheCommand),
    /// Repeat an experiment: many runs, measured time and error, a report
    Bench(Box<BenchArgs>),
    /// Write a completion script for a shell to standard output
    Completions(CompletionsArgs),
    /// Write the manual page to standard output
    Man(MarkdownArgs),
    /// List all parameters that -p sets, with meaning, values and defaults
    Parameters(MarkdownArgs),
}

/// The scene and how to read it.
#[derive(Debug, Args)]
pub(crate) struct SceneArgs {
    /// Scene file, in the XML format of Mitsuba 3
    #[arg(value_name = "SCENE", value_hint = ValueHint::FilePath)]
    pub(crate) scene: PathBuf,
    /// Set a parameter of the scene file: replaces its "default" element and stands for $NAME
    #[arg(
        short = 'D',
        long = "define",
        value_name = "NAME=VALUE",
        value_parser = units::parse_assignment,
        help_heading = "Scene"
    )]
    pub(crate) defines: Vec<(String, String)>,
    /// Replace unsupported plugins by grey diffuse, with a warning, instead of refusing the scene
    #[arg(long, help_heading = "Scene")]
    pub(crate) lenient: bool,
    /// Threads to use [default: as many as the processor runs at once]
    #[arg(
        short,
        long,
        env = "CLAROR_THREADS",
        hide_env_values = true,
        value_name = "N",
        value_parser = clap::value_parser!(u16).range(1..=4096)
    )]
    pub(crate) threads: Option<u16>,
    /// Refuse to use more memory than this, for instance 8G [default: what is available]
    #[arg(
        long,
        env = "CLAROR_MAX_MEMORY",
        hide_env_values = true,
        value_name = "SIZE",
        value_parser = units::parse_bytes
    )]
    pub(crate) max_memory: Option<u64>,
}

#[derive(Debug, Args)]
#[command(after_help = RENDER_NOTES)]
pub(crate) struct RenderArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
    #[command(flatten)]
    pub(crate) stop: StopArgs,
    #[command(flatten)]
    pub(crate) change: ChangeArgs,
    #[command(flatten)]
    pub(crate) checkpoint: CheckpointArgs,
    #[command(flatten)]
    pub(crate) cache: CacheArgs,
    #[command(flatten)]
    pub(crate) show: ShowArgs,
    #[command(flatten)]
    pub(crate) verify: VerifyArgs,
}

const RENDER_NOTES: &str = "\
Examples:
  claror render scenes/cornell-box.xml
  claror render room.xml -o room.exr -o room.png --spp 1024 --error 0.01
  claror render room.xml --time 10m --checkpoint room.ckpt      # Ctrl-C at any time
  claror render room.xml --time 10m --checkpoint room.ckpt --resume
  claror render room.xml -i irrcache --cache room.cache --sensor 0
  claror render room.xml -i irrcache --cache room.cache --sensor 1 --cache-mode update
  claror render room.xml -i irrcache --show-points points.png --show-radii
  claror render room.xml --size 320x180 -p integrator.max_depth=4 -o - | display exr:-

Ctrl-C ends the tile, writes pictures and checkpoint and exits with 130; twice, it stops at once.
`claror --help` lists the exit codes.";

const VERIFY_NOTES: &str = "\
Examples:
  claror verify room.xml -i irrcache
  claror verify room.xml -i irrcache --verify=4096 --strict --json
  claror verify room.xml --checkpoint room.ckpt --resume --verify-picture checks.png

Pixels of the picture are compared with paths whose random numbers are independent of it. The
checks take as long as the render unless --verify=N says how many there are. Pictures are written
only with -o. With a refuted claim the exit code is 6.";

/// Where the picture goes.
#[derive(Debug, Args)]
#[command(next_help_heading = "Output")]
pub(crate) struct OutputArgs {
    /// Picture to write, in the format of its ending: exr, png, hdr, pfm; may be repeated; `-` is
    /// standard output [default: the scene's name with .exr and .png, in the current folder]
    #[arg(short, long = "output", value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) outputs: Vec<PathBuf>,
    /// Format of `-o -`
    #[arg(long, value_name = "FORMAT", default_value = "exr", hide_possible_values = false)]
    pub(crate) format: Format,
    /// Make 8-bit pictures brighter by this many stops (factors of two)
    #[arg(
        long,
        value_name = "STOPS",
        default_value = "0",
        value_parser = units::parse_finite,
        allow_negative_numbers = true
    )]
    pub(crate) exposure: f32,
    /// Also write the parts of the light as layers of the EXR file
    ///
    /// Emission, direct, indirect and rest, in this order, sum to the picture bit for bit; indirect
    /// is what diffuse surfaces make of light that was scattered before. Also written are variance
    /// and number of samples.
    #[arg(long)]
    pub(crate) layers: bool,
    /// Also write features of what is seen as layers of the EXR file, separated by commas
    ///
    /// The features are albedo, depth, position, uv, geo_normal, sh_normal, dp_du, dp_dv,
    /// prim_index and shape_index; of the integrator irrcache also irradiance,
    /// harmonic_mean_distance, record_radius, record_count, lookup_weight and cache_miss.
    /// NAME:FEATURE gives the layer a name of its own.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub(crate) aov: Vec<String>,
}

/// When the render is done.
#[derive(Debug, Args)]
#[command(next_help_heading = "When to stop (the first one wins)")]
pub(crate) struct StopArgs {
    /// Samples per pixel [default: what the scene says, unless --time or --error is given]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) spp: Option<u32>,
    /// Time to render in this run, such as 60s, 10m or 2h
    #[arg(long, value_name = "TIME", value_parser = units::parse_duration)]
    pub(crate) time: Option<Duration>,
    /// Estimated relative error of the picture
    #[arg(long, value_name = "ERROR", value_parser = units::parse_positive)]
    pub(crate) error: Option<f32>,
}

/// What to change in the scene.
#[derive(Debug, Args)]
#[command(next_help_heading = "Changes to the scene")]
pub(crate) struct ChangeArgs {
    /// How light is computed: irrcache, path, direct, gridcache or depth
    #[arg(short, long, value_name = "NAME")]
    pub(crate) integrator: Option<String>,
    /// Set a parameter, such as integrator.max_depth=4
    #[arg(
        long_help = crate::parameters::help(),
        short = 'p',
        long = "parameter",
        value_name = "OBJECT.KEY=VALUE",
        value_parser = units::parse_assignment
    )]
    pub(crate) parameters: Vec<(String, String)>,
    /// Camera, by its number from 0 or its id
    #[arg(long, value_name = "SENSOR")]
    pub(crate) sensor: Option<String>,
    /// Size of the film in pixels; the horizontal field of view stays, a crop does not
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = units::parse_size)]
    pub(crate) size: Option<(u32, u32)>,
    /// Render only this part of the film, in pixels of the whole film
    #[arg(long, value_name = "X,Y,W,H", value_parser = units::parse_crop)]
    pub(crate) crop: Option<[u32; 4]>,
    /// Sample pattern: sobol or independent
    #[arg(long, value_name = "NAME")]
    pub(crate) sampler: Option<String>,
    /// Seed of the sample pattern [default: what the scene says, else 0]
    #[arg(long, value_name = "N")]
    pub(crate) seed: Option<u64>,
}

/// How to stop today and go on tomorrow.
#[derive(Debug, Args)]
#[command(next_help_heading = "Checkpoints")]
pub(crate) struct CheckpointArgs {
    /// Keep the state of the render in this file, whole at any moment
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) checkpoint: Option<PathBuf>,
    /// Time between two checkpoints
    #[arg(
        long,
        value_name = "TIME",
        default_value = "60s",
        value_parser = units::parse_duration,
        requires = "checkpoint"
    )]
    pub(crate) every: Duration,
    /// Go on from the checkpoint, to the same bits as without a break; start if there is none
    #[arg(long, requires = "checkpoint")]
    pub(crate) resume: bool,
}

/// How to keep the records of one view for the next.
#[derive(Debug, Args)]
#[command(next_help_heading = "Irradiance cache (of the integrator irrcache)")]
pub(crate) struct CacheArgs {
    /// Keep the irradiance cache in this file, or begin with the one in it
    ///
    /// A cache serves every view of a scene: camera, film and sample count may be others than those
    /// it was made with; the scene's files, the parameters of irrcache and the seed may not. The
    /// file is written as soon as the cache is complete, before the first sample.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) cache: Option<PathBuf>,
    /// What becomes of the cache file [default: write, but an old file is not touched]
    #[arg(long, value_name = "MODE", requires = "cache")]
    pub(crate) cache_mode: Option<CacheMode>,
}

/// What becomes of the cache file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum CacheMode {
    /// Make a cache for this view and write it in place of what the file holds
    Write,
    /// Begin with the cache in the file, add what this view lacks, and write all of it
    Update,
    /// Use the cache in the file as it is; where it has no records, single rays take their place
    Read,
}

/// How the finished picture is checked.
#[derive(Debug, Args)]
#[command(next_help_heading = "Verification")]
pub(crate) struct VerifyArgs {
    /// Measure how far the finished picture is off, by comparing N of its pixels with paths
    /// [default without N: as many as fit in a tenth of the render's time, for `claror verify` in
    /// the same time again, at least 256]
    #[arg(
        long,
        value_name = "N",
        num_args = 0..=1,
        require_equals = true,
        value_parser = clap::value_parser!(u32)
            .range(i64::from(LEAST_CHECKS)..=i64::from(MOST_CHECKS))
    )]
    pub(crate) verify: Option<Option<u32>>,
    /// Paths per pixel that is checked [default: 64]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(16..=1_048_576))]
    pub(crate) verify_paths: Option<u32>,
    /// Claim: the mean of the picture is off by no more than this share of it [default: 0.003]
    #[arg(long, value_name = "SHARE", value_parser = units::parse_share)]
    pub(crate) verify_bias: Option<f64>,
    /// Relative error from which a pixel counts as off [default: 0.05]
    #[arg(long, value_name = "ERROR", value_parser = units::parse_share)]
    pub(crate) verify_tolerance: Option<f64>,
    /// Claim: no more than this share of the pixels is off by more than that [default: 0.05]
    #[arg(long, value_name = "SHARE", value_parser = units::parse_share)]
    pub(crate) verify_share: Option<f64>,
    /// Write the picture in grey with the checks as dots: red too bright, blue too dark
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) verify_picture: Option<PathBuf>,
    /// Exit with 6 also if a claim is neither confirmed nor refuted
    #[arg(long)]
    pub(crate) strict: bool,
}

/// For pages of the book.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct MarkdownArgs {
    /// Write Markdown, as in docs/
    #[arg(long)]
    pub(crate) markdown: bool,
}

#[derive(Debug, Args)]
pub(crate) struct CompletionsArgs {
    /// The shell
    pub(crate) shell: clap_complete::Shell,
}

/// Picture formats that can be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// OpenEXR, 32-bit float, layers and metadata
    Exr,
    /// PNG, 8-bit sRGB
    Png,
    /// Radiance RGBE
    Hdr,
    /// Portable float map, 32-bit float
    Pfm,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_definition_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn all_parameters_and_features_are_in_the_help() {
        let mut command = Cli::command();
        let render = command.find_subcommand_mut("render").expect("it exists");
        let help = render.render_long_help().to_string();
        let features = claror::integrator::AovKind::ALL.into_iter().map(|kind| kind.name());
        for name in crate::parameters::names().into_iter().chain(features.map(str::to_owned)) {
            assert!(help.contains(&name), "{name} is not in the help");
        }
    }

    #[test]
    fn defines_need_no_space() {
        let cli = Cli::try_parse_from(["claror", "render", "a.xml", "-Dspp=4", "-D", "b=c=d"])
            .expect("valid");
        let Command::Render(args) = cli.command else { panic!("render was asked for") };
        let pair = |a: &str, b: &str| (a.to_owned(), b.to_owned());
        assert_eq!(args.scene.defines, [pair("spp", "4"), pair("b", "c=d")]);
    }

    #[test]
    fn exposures_and_seeds_may_look_like_options() {
        let cli = Cli::try_parse_from(["claror", "render", "a.xml", "--exposure", "-1.5"]);
        let Command::Render(args) = cli.expect("valid").command else { panic!("render") };
        assert_eq!(args.output.exposure, -1.5);
    }

    #[test]
    fn impossible_values_are_refused() {
        for bad in [
            &["--spp", "0"][..],
            &["--spp", "-3"],
            &["--time", "0s"],
            &["--error", "nan"],
            &["--size", "0x10"],
            &["--threads", "0"],
            &["--resume"],
            &["--verify=15"],
            &["--verify=many"],
            &["--verify-share", "1.5"],
            &["--every", "5s"],
            &["--cache-mode", "read"],
            &["--show-radii"],
            &["--show-color", "red"],
            &["--show-points", "a.png", "--show-color", "mauve"],
            &["--cache", "a.cache", "--cache-mode", "append"],
            &["-q", "-v"],
            &["--format", "gif"],
            &["-D", "novalue"],
        ] {
            let words = ["claror", "render", "a.xml"].iter().chain(bad);
            assert!(Cli::try_parse_from(words).is_err(), "{bad:?} was accepted");
        }
    }
}
