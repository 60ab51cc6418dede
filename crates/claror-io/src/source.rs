//! The bytes of a data file together with its name, so that every message can say where.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use crate::diagnostic::{ReadError, Subject};
use crate::limits::Limits;

/// Names the file in errors.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Source<'a> {
    /// The file.
    pub(crate) path: &'a Path,
}

impl<'a> Source<'a> {
    pub(crate) fn new(path: &'a Path) -> Self {
        Self { path }
    }

    /// The file is missing, cut or malformed.
    pub(crate) fn error(self, message: impl Into<String>) -> ReadError {
        ReadError {
            file: PathBuf::from(self.path),
            subject: Subject::File,
            line: None,
            message: message.into(),
            hint: None,
        }
    }

    /// The same, with the line (from 1) of a text file.
    pub(crate) fn error_at(self, line: usize, message: impl Into<String>) -> ReadError {
        ReadError { line: u32::try_from(line).ok(), ..self.error(message) }
    }

    /// More memory than allowed or available.
    pub(crate) fn too_large(self, message: impl Into<String>) -> ReadError {
        ReadError { subject: Subject::Memory, ..self.error(message) }
    }

    /// An error unless `count` of `what` (such as "vertices") is within `limit`.
    pub(crate) fn check_limit(self, what: &str, count: u64, limit: u64) -> Result<(), ReadError> {
        if count <= limit {
            return Ok(());
        }
        Err(self.too_large(format!("{count} {what} are more than the limit of {limit}")))
    }

    /// The whole file. Only regular files are opened: a pipe or a device could block or never end.
    pub(crate) fn read(self, limits: &Limits) -> Result<Vec<u8>, ReadError> {
        let metadata = std::fs::metadata(self.path).map_err(|e| self.io("read", &e))?;
        if !metadata.is_file() {
            return Err(self.error("this is not a regular file"));
        }
        self.check_limit("bytes", metadata.len(), limits.max_data_file_bytes)?;
        let mut bytes = self.reserve(metadata.len(), "the file")?;
        // A file that grows meanwhile is read to the length it had.
        File::open(self.path)
            .and_then(|file| file.take(metadata.len()).read_to_end(&mut bytes))
            .map_err(|e| self.io("read", &e))?;
        Ok(bytes)
    }

    /// An empty vector with room for `count` values, or an error where memory is short.
    pub(crate) fn reserve<T>(self, count: u64, what: &str) -> Result<Vec<T>, ReadError> {
        let mut values = Vec::new();
        let bytes = count.saturating_mul(size_of::<T>() as u64);
        usize::try_from(count)
            .ok()
            .filter(|&n| values.try_reserve_exact(n).is_ok())
            .map(|_| values)
            .ok_or_else(|| self.too_large(format!("no memory for {what} ({bytes} bytes)")))
    }

    fn io(self, verb: &str, error: &io::Error) -> ReadError {
        match error.kind() {
            io::ErrorKind::NotFound => self.error("there is no such file"),
            io::ErrorKind::PermissionDenied => self.error("permission denied"),
            io::ErrorKind::OutOfMemory => self.too_large("no memory for the file"),
            _ => self.error(format!("could not {verb} the file: {error}")),
        }
    }
}

/// `text` with control characters replaced, cut to `max` characters, for use in messages.
pub(crate) fn printable(text: &[u8], max: usize) -> String {
    let text = String::from_utf8_lossy(&text[..text.len().min(4 * max)]);
    let mut out: String =
        text.chars().take(max).map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
    if text.chars().count() > max {
        out.push('…');
    }
    out
}
