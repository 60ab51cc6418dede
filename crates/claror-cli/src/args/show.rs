//! Options that show what the irradiance cache did.

use std::path::PathBuf;

use clap::{Args, ValueEnum, ValueHint};

#[derive(Debug, Args)]
#[command(next_help_heading = "Irradiance cache (of the integrator irrcache)")]
pub(crate) struct ShowArgs {
    /// Also write the picture, as PNG shows it, with a dot for every record that the camera sees, or
    /// for every point of gridcache's grid
    #[arg(
        long,
        visible_alias = "show_points",
        value_name = "FILE",
        value_hint = ValueHint::FilePath
    )]
    pub(crate) show_points: Option<PathBuf>,
    /// Draw rings around these dots: as far as the radii of the records reach
    #[arg(long, visible_alias = "show-points-radii", requires = "show_points")]
    pub(crate) show_radii: bool,
    /// Colour of dots and rings
    #[arg(long, value_name = "COLOR", default_value = "black", requires = "show_points")]
    pub(crate) show_color: PointColor,
}

/// Colours that stand out in some picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PointColor {
    Black,
    White,
    Red,
    Green,
    Blue,
    Yellow,
}
