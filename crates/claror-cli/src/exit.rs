//! How the program ends: exit codes and the failures that lead to them.

use std::path::Path;
use std::process::ExitCode;

use claror_io::diagnostic::Subject;
use claror_io::{Diagnostic, ReadError, Severity};

use crate::messages::Report;

/// Exit codes; the numbers are a promise to scripts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Exit {
    Success = 0,
    Usage = 2,
    Scene = 3,
    File = 4,
    Memory = 5,
    CheckFailed = 6,
    Mismatch = 7,
    /// A panic. `EX_SOFTWARE` of `sysexits.h`.
    Bug = 70,
    Interrupted = 130,
}

/// The exit codes as help and manual show them.
pub(crate) const TABLE: &str = "\
Exit codes:
  0    done
  2    usage: an option or its value is wrong
  3    scene: the scene file says something wrong or unsupported
  4    file: missing, unreadable, malformed or not writable
  5    memory or device: more memory than allowed or available, or no thread can be started
  6    check failed: `compare --fail-above` found a larger difference, a verification refuted
       what is claimed of the picture, or runs of `bench` failed
  7    mismatch: the checkpoint or cache belongs to another scene or to other parameters
  70   a bug in claror
  130  interrupted: Ctrl-C or SIGTERM; the picture so far and the checkpoint are written";

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// What ends a command early.
#[derive(Debug)]
pub(crate) struct Failure {
    /// How the program ends.
    pub(crate) exit: Exit,
    /// What the user is told, all of it.
    pub(crate) reports: Vec<Report>,
}

impl Failure {
    /// One message.
    pub(crate) fn new(exit: Exit, message: impl Into<String>) -> Self {
        Self { exit, reports: vec![Report::error(message)] }
    }

    /// The command line asks for something that cannot be.
    pub(crate) fn usage(message: impl Into<String>) -> Self {
        Self::new(Exit::Usage, message)
    }

    /// A file could not be read or written.
    pub(crate) fn io(what: &str, file: &Path, error: &std::io::Error) -> Self {
        Self::new(Exit::File, format!("{what} {}: {}", file.display(), describe(error)))
    }

    /// What can be done about it, added to the last message.
    pub(crate) fn hint(mut self, hint: impl Into<String>) -> Self {
        if let Some(last) = self.reports.last_mut() {
            last.hint = Some(hint.into());
        }
        self
    }
}

impl From<Vec<Diagnostic>> for Failure {
    fn from(diagnostics: Vec<Diagnostic>) -> Self {
        let errors = diagnostics.iter().filter(|d| d.severity == Severity::Error);
        Self {
            exit: exit_of(errors.map(|d| d.subject)),
            reports: diagnostics.iter().map(Report::from).collect(),
        }
    }
}

impl From<ReadError> for Failure {
    fn from(error: ReadError) -> Self {
        Self { exit: exit_of(std::iter::once(error.subject)), reports: vec![Report::from(&error)] }
    }
}

/// The exit code of several errors: that of their subject if they all agree; otherwise the scene
/// is to blame.
fn exit_of(subjects: impl Iterator<Item = Subject>) -> Exit {
    let mut exits = subjects.map(|subject| match subject {
        Subject::Scene => Exit::Scene,
        Subject::File => Exit::File,
        Subject::Memory => Exit::Memory,
    });
    let first = exits.next().unwrap_or(Exit::Scene);
    if exits.all(|exit| exit == first) { first } else { Exit::Scene }
}

/// An input/output error in words, without Rust's "(os error 2)".
pub(crate) fn describe(error: &std::io::Error) -> String {
    let text = error.to_string();
    match text.find(" (os error") {
        Some(end) => text[..end].to_lowercase(),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_lists_every_code() {
        let codes = [
            Exit::Success,
            Exit::Usage,
            Exit::Scene,
            Exit::File,
            Exit::Memory,
            Exit::CheckFailed,
            Exit::Mismatch,
            Exit::Bug,
            Exit::Interrupted,
        ];
        for code in codes {
            let number = format!("  {:<5}", code as u8);
            assert!(TABLE.contains(&number), "{code:?} is not in the table");
        }
    }

    #[test]
    fn several_errors_share_their_exit_code_or_blame_the_scene() {
        let of = |subjects: &[Subject]| exit_of(subjects.iter().copied());
        assert_eq!(of(&[Subject::File, Subject::File]), Exit::File);
        assert_eq!(of(&[Subject::Memory]), Exit::Memory);
        assert_eq!(of(&[Subject::File, Subject::Scene]), Exit::Scene);
    }

    #[test]
    fn io_errors_lose_their_number() {
        let error = std::io::Error::from_raw_os_error(2);
        assert_eq!(describe(&error), "no such file or directory");
    }
}
