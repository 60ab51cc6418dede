//! Scene files: the Mitsuba 3 XML dialect.
//!
//! Reading has two stages. The first (`describe`) turns XML with its includes, defaults and
//! references into a description: objects with typed properties, each with its place in a file.
//! The second (`build`) makes the flat [`SceneTables`] of it. Both go on after an error, so that
//! all of them are shown at once.
//!
//! # What is understood
//! Files of version 2 and 3 as they are; older ones are upgraded as Mitsuba does (`toWorld` →
//! `to_world`, …). Parameters have Mitsuba 3's names, types and defaults; deviations:
//! - a sampler of any kind stands for Owen-scrambled Sobol points,
//! - constant reflectances above 1 and negative radiances are errors,
//! - `<srgb>` (three values or `#rrggbb`) is accepted in every version,
//! - films of any kind are of `f32`; the output's name decides on its format.

mod build;
mod describe;
mod description;
mod element;
mod hash;
mod nearest;
mod operations;
mod parameters;
mod properties;
mod resolve;
mod search;
mod source;
mod text;
mod upgrade;
mod values;
mod xml;

#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

use claror::scene::SceneTables;

use crate::Limits;
use crate::diagnostic::Diagnostic;

pub use hash::content_hash;
pub use nearest::hint as nearest_name_hint;
pub use source::{Disk, Files};

/// How a scene file is to be read.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct LoadOptions {
    /// `-D name=value`: values for `$name`, before those of `<default>`.
    pub defines: Vec<(String, String)>,
    /// Replace plugins that are not supported (materials by a grey diffuse) and warn.
    pub lenient: bool,
    /// Bounds on what the files may make the program allocate.
    pub limits: Limits,
}

/// A scene and what else its user wants to know.
#[derive(Debug, Clone)]
pub struct LoadedScene {
    /// The scene.
    pub tables: SceneTables,
    /// What was odd but usable.
    pub warnings: Vec<Diagnostic>,
    /// All files that were read: the scene, its includes, meshes, pictures, spectra.
    pub files: Vec<PathBuf>,
    /// `$name`s with the values that were used.
    pub parameters: Vec<(String, String)>,
    /// By shape: its `id`, or its plugin and line.
    pub shape_names: Vec<String>,
    /// See [`content_hash`].
    pub content_hash: u128,
}

/// Reads a scene file and everything that it refers to.
///
/// # Errors
/// Everything that is wrong with the scene, errors and warnings, in the order of the files.
pub fn load(path: &Path, options: &LoadOptions) -> Result<LoadedScene, Vec<Diagnostic>> {
    load_from(&Disk, path, options)
}

/// [`load`] with scene descriptions from anywhere; meshes and pictures come from the disk.
///
/// # Errors
/// As [`load`].
pub fn load_from(
    files: &dyn Files,
    path: &Path,
    options: &LoadOptions,
) -> Result<LoadedScene, Vec<Diagnostic>> {
    let log = source::Log::default();
    let mut describer =
        describe::Describer::new(path, &options.defines, &options.limits, files, &log);
    describer.scene(path);
    let incomplete = describer.incomplete;
    let describe::Describer { mut description, parameters, search, mut files_read, .. } = describer;
    if incomplete || description.objects.is_empty() {
        return Err(log.finish());
    }
    report_unused_defines(&parameters, path, &log);
    upgrade::upgrade(&mut description, &log);
    resolve::resolve(&mut description, &log);
    let mut builder = build::Builder::new(&description, &log, options, files, &search);
    builder.scene();
    let build::Builder { tables, shape_names, files_read: data_files, .. } = builder;
    if log.has_errors() {
        return Err(log.finish());
    }
    files_read.extend(data_files);
    Ok(LoadedScene {
        content_hash: content_hash(&tables),
        tables,
        warnings: log.finish(),
        files: files_read,
        parameters: parameters.resolved(),
        shape_names,
    })
}

fn report_unused_defines(parameters: &parameters::Parameters, path: &Path, log: &source::Log) {
    for (name, hint) in parameters.unused_defines() {
        log.push(Diagnostic {
            severity: crate::Severity::Error,
            subject: crate::diagnostic::Subject::Scene,
            file: path.to_path_buf(),
            position: None,
            message: format!("nothing in the scene uses ${}", values::short(&name)),
            excerpt: None,
            hint,
        });
    }
}
