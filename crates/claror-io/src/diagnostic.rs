//! Messages about files, with the place that they speak of.

use std::fmt;
use std::path::PathBuf;

/// How bad it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The scene can be used; the user should know nevertheless.
    Warning,
    /// The scene cannot be used.
    Error,
}

/// What an error is about; decides the exit code of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Subject {
    /// What the scene says: exit code 3.
    Scene,
    /// A file that is missing, unreadable, cut or malformed: exit code 4.
    File,
    /// More memory than allowed or available: exit code 5.
    Memory,
}

/// One message with its place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// How bad it is.
    pub severity: Severity,
    /// What it is about.
    pub subject: Subject,
    /// The file it speaks of.
    pub file: PathBuf,
    /// Line (from 1) and column (from 1, in characters), where known.
    pub position: Option<(u32, u32)>,
    /// What is wrong, one sentence without a full stop.
    pub message: String,
    /// The line of the file, for the user to see; shortened when very long.
    pub excerpt: Option<String>,
    /// What to do, such as the nearest known name.
    pub hint: Option<String>,
}

impl fmt::Display for Diagnostic {
    /// `error: message` / `  --> file:line:column` / excerpt with a caret / `help: hint`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let severity = match self.severity {
            Severity::Warning => "warning",
            Severity::Error => "error",
        };
        writeln!(f, "{severity}: {}", self.message)?;
        write!(f, "  --> {}", self.file.display())?;
        if let Some((line, column)) = self.position {
            write!(f, ":{line}:{column}")?;
            if let Some(excerpt) = &self.excerpt {
                let gutter = line.to_string();
                let blank = " ".repeat(gutter.len());
                write!(f, "\n {blank} |\n {gutter} | {excerpt}")?;
                if column as usize <= excerpt.chars().count() + 1 {
                    let indent = " ".repeat(column.saturating_sub(1) as usize);
                    write!(f, "\n {blank} | {indent}^")?;
                }
            }
        }
        if let Some(hint) = &self.hint {
            write!(f, "\n  help: {hint}")?;
        }
        Ok(())
    }
}

/// Why a mesh, picture or other data file could not be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}: {message}", file.display())]
pub struct ReadError {
    /// The file.
    pub file: PathBuf,
    /// What it is about.
    pub subject: Subject,
    /// Line from 1, for text formats.
    pub line: Option<u32>,
    /// What is wrong, one sentence without a full stop.
    pub message: String,
    /// What to do.
    pub hint: Option<String>,
}
