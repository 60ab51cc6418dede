//! The commands about cache files.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueHint};
use claror::irradiance::IndexKind;

/// What to do with a cache file.
#[derive(Debug, Subcommand)]
pub(crate) enum CacheCommand {
    /// Show what a cache holds: views, parameters, records, radii, memory
    Info {
        /// Cache file
        #[arg(value_name = "FILE", value_hint = ValueHint::FilePath)]
        file: PathBuf,
    },
    /// Write the records of a cache for other programs
    Export(ExportArgs),
    /// Measure what a look-up costs, by the structure in which records are found
    Lookups(LookupsArgs),
}

#[derive(Debug, Args)]
pub(crate) struct ExportArgs {
    /// Cache file
    #[arg(value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) file: PathBuf,
    #[command(flatten)]
    pub(crate) to: ExportFiles,
}

/// One file at least.
#[derive(Debug, Args)]
#[group(required = true, multiple = true)]
pub(crate) struct ExportFiles {
    /// Write a point cloud, for Blender and MeshLab: binary PLY, one vertex per record
    #[arg(long, value_name = "OUT", value_hint = ValueHint::FilePath)]
    pub(crate) ply: Option<PathBuf>,
    /// Write a table, for spreadsheets and scripts: one line per record, numbers separated by commas
    #[arg(long, value_name = "OUT", value_hint = ValueHint::FilePath)]
    pub(crate) csv: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct LookupsArgs {
    /// Cache file
    #[arg(value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) file: PathBuf,
    /// Only these structures, separated by commas: vector, octree, cells, bvh, leaves
    /// [default: all]
    #[arg(
        long,
        value_name = "NAMES",
        value_delimiter = ',',
        value_parser = parse_index,
        default_value = "vector,octree,cells,bvh,leaves",
        hide_default_value = true
    )]
    pub(crate) index: Vec<IndexKind>,
}

fn parse_index(name: &str) -> Result<IndexKind, String> {
    let known = IndexKind::ALL.into_iter().find(|kind| kind.name().eq_ignore_ascii_case(name));
    known.ok_or_else(|| {
        format!("expected some of {}", IndexKind::ALL.map(IndexKind::name).join(", "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::{Cli, Command};
    use clap::Parser;

    fn indices(words: &[&str]) -> Option<Vec<IndexKind>> {
        let cli =
            Cli::try_parse_from(["claror", "cache", "lookups", "a.cache"].iter().chain(words));
        match cli.ok()?.command {
            Command::Cache(CacheCommand::Lookups(args)) => Some(args.index),
            _ => None,
        }
    }

    #[test]
    fn structures_are_named_or_all() {
        assert_eq!(indices(&[]).map(|all| all.len()), Some(IndexKind::ALL.len()));
        let two = Some(vec![IndexKind::Bvh, IndexKind::Vector]);
        assert_eq!(indices(&["--index", "bvh,VECTOR"]), two);
        assert_eq!(indices(&["--index", "tree"]), None);
        assert_eq!(indices(&["--index", ""]), None);
    }
}
