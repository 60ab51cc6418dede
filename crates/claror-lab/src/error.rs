//! Why an experiment cannot begin or go on.

use std::io;
use std::path::{Path, PathBuf};

use crate::plan::PlanError;
use crate::report::ReportError;

/// Why an experiment cannot begin or go on. Runs that fail are no such reason: the study notes
/// them.
#[derive(Debug, thiserror::Error)]
pub enum LabError {
    /// There is no good plan.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// What is asked for cannot be.
    #[error("{0}")]
    Usage(String),
    /// The program refuses the scene.
    #[error("{message}")]
    Scene {
        /// What it said.
        message: String,
        /// Its exit code.
        code: i32,
    },
    /// A file or folder could not be read or written.
    #[error("{what} {}: {error}", path.display())]
    File {
        /// `cannot write`.
        what: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// A picture cannot be used as a reference.
    #[error("{0}")]
    Reference(String),
    /// The reference could not be rendered.
    #[error("the reference cannot be made: {message}")]
    ReferenceFailed {
        /// What the program said.
        message: String,
        /// Its exit code.
        code: i32,
    },
    /// Another experiment writes to the folder.
    #[error("{} is in use by another `claror bench`{}", folder.display(), process(pid))]
    Locked {
        /// The folder.
        folder: PathBuf,
        /// Its process, if it said so.
        pid: Option<u32>,
    },
    /// The user asked to stop.
    #[error("interrupted")]
    Interrupted,
    /// The report could not be written.
    #[error(transparent)]
    Report(#[from] ReportError),
}

fn process(pid: &Option<u32>) -> String {
    pid.map_or(String::new(), |pid| format!(" (process {pid})"))
}

impl LabError {
    pub(crate) fn file(what: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |error| Self::File { what, path, error }
    }
}
