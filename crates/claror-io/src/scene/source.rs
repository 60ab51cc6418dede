//! Scene description files in memory, places in them, and the log of what is wrong with them.

use std::cell::RefCell;
use std::io;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use crate::diagnostic::{Diagnostic, Severity, Subject};

/// Where scene descriptions and spectra come from: the file system, or a test.
pub trait Files {
    /// The bytes of a file.
    ///
    /// # Errors
    /// Whatever the file system says; [`io::ErrorKind::FileTooLarge`] beyond `max_bytes`.
    fn read(&self, path: &Path, max_bytes: u64) -> io::Result<Vec<u8>>;
    /// True when there is a file (not a folder) of that name.
    fn is_file(&self, path: &Path) -> bool;
    /// True when there is a folder of that name.
    fn is_dir(&self, path: &Path) -> bool;
    /// Names of some files in a folder, for "did you mean".
    fn list(&self, folder: &Path) -> Vec<String>;
}

/// The file system.
#[derive(Debug, Clone, Copy, Default)]
pub struct Disk;

impl Files for Disk {
    fn read(&self, path: &Path, max_bytes: u64) -> io::Result<Vec<u8>> {
        use io::Read;
        let file = std::fs::File::open(path)?;
        let mut bytes = Vec::new();
        // One byte more than allowed tells a full file from one that is too large; the size
        // that the system reports may be 0 (pipes) or change.
        file.take(max_bytes.saturating_add(1)).read_to_end(&mut bytes)?;
        if bytes.len() as u64 > max_bytes {
            return Err(io::ErrorKind::FileTooLarge.into());
        }
        Ok(bytes)
    }

    fn is_file(&self, path: &Path) -> bool {
        // Not `is_file`: a named pipe or /dev/stdin is readable, too.
        std::fs::metadata(path).is_ok_and(|m| !m.is_dir())
    }

    fn is_dir(&self, path: &Path) -> bool {
        path.is_dir()
    }

    fn list(&self, folder: &Path) -> Vec<String> {
        let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
        let name = |e: io::Result<std::fs::DirEntry>| e.ok().map(|e| e.file_name());
        let names = entries.take(1000).filter_map(name);
        let mut names: Vec<String> = names.map(|n| n.to_string_lossy().into_owned()).collect();
        // Folders list their files in any order.
        names.sort();
        names
    }
}

/// A place in a scene description.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Span {
    /// Index into [`Sources::files`].
    pub(super) file: u32,
    /// Bytes from the beginning.
    pub(super) offset: u32,
}

/// One scene description file.
#[derive(Debug)]
pub(super) struct SourceFile {
    pub(super) path: PathBuf,
    pub(super) text: Rc<str>,
}

/// All scene description files that were read.
#[derive(Debug, Default)]
pub(super) struct Sources {
    pub(super) files: Vec<SourceFile>,
}

/// Longest excerpt, characters.
const MAX_EXCERPT: usize = 160;

impl Sources {
    /// Line and column (from 1, in characters) of a place.
    pub(super) fn position(&self, span: Span) -> (u32, u32) {
        let Some(file) = self.files.get(span.file as usize) else { return (1, 1) };
        position_in(&file.text, span.offset as usize)
    }

    /// `file:line:column` of a place.
    pub(super) fn describe(&self, span: Span) -> String {
        let (line, column) = self.position(span);
        format!("{}:{line}:{column}", self.path(span).display())
    }

    /// The file of a place.
    pub(super) fn path(&self, span: Span) -> &Path {
        self.files.get(span.file as usize).map_or(Path::new(""), |f| &f.path)
    }

    fn excerpt(&self, span: Span) -> Option<String> {
        let text = &self.files.get(span.file as usize)?.text;
        let offset = floor_char_boundary(text, span.offset as usize);
        let begin = text[..offset].rfind('\n').map_or(0, |i| i + 1);
        let line = text[begin..].lines().next().unwrap_or("");
        let mut shown: String = line
            .chars()
            .take(MAX_EXCERPT)
            .map(|c| if c == '\t' { ' ' } else { c })
            .map(|c| if c.is_control() { '·' } else { c })
            .collect();
        if line.chars().nth(MAX_EXCERPT).is_some() {
            shown.push('…');
        }
        Some(shown)
    }
}

/// Line and column (from 1, in characters) of a byte of a text.
fn position_in(text: &str, offset: usize) -> (u32, u32) {
    let before = &text[..floor_char_boundary(text, offset)];
    let line = before.bytes().filter(|b| *b == b'\n').count() + 1;
    let begin = before.rfind('\n').map_or(0, |i| i + 1);
    let column = before[begin..].chars().count() + 1;
    (u32::try_from(line).unwrap_or(u32::MAX), u32::try_from(column).unwrap_or(u32::MAX))
}

fn floor_char_boundary(text: &str, offset: usize) -> usize {
    let mut i = offset.min(text.len());
    while !text.is_char_boundary(i) {
        i -= 1;
    }
    i
}

/// Messages beyond this many are dropped: the user mends the first ones first, and a
/// hostile file must not make millions.
const MAX_MESSAGES: usize = 100;

/// Collects what is wrong: reading goes on after an error, so that the user sees all of them.
#[derive(Debug, Default)]
pub(super) struct Log {
    sources: RefCell<Sources>,
    entries: RefCell<Vec<Diagnostic>>,
}

impl Log {
    /// Registers a file; the number is that of [`Span::file`].
    pub(super) fn add_source(&self, path: PathBuf, text: Rc<str>) -> u32 {
        let mut sources = self.sources.borrow_mut();
        sources.files.push(SourceFile { path, text });
        u32::try_from(sources.files.len() - 1).unwrap_or(u32::MAX)
    }

    /// Something is wrong with what the scene says.
    pub(super) fn error(&self, span: Span, message: impl Into<String>, hint: Option<String>) {
        self.add(Severity::Error, Subject::Scene, span, message.into(), hint);
    }

    /// Something is odd, but the scene can be used.
    pub(super) fn warning(&self, span: Span, message: impl Into<String>, hint: Option<String>) {
        self.add(Severity::Warning, Subject::Scene, span, message.into(), hint);
    }

    /// As [`Log::error`], about a file or about memory.
    pub(super) fn error_about(
        &self,
        subject: Subject,
        span: Span,
        message: impl Into<String>,
        hint: Option<String>,
    ) {
        self.add(Severity::Error, subject, span, message.into(), hint);
    }

    fn add(
        &self,
        severity: Severity,
        subject: Subject,
        span: Span,
        message: String,
        hint: Option<String>,
    ) {
        if self.entries.borrow().len() >= MAX_MESSAGES {
            // A file of nothing but warnings must not hide its only error.
            if severity == Severity::Warning || self.has_errors() {
                return;
            }
        }
        let sources = self.sources.borrow();
        self.entries.borrow_mut().push(Diagnostic {
            severity,
            subject,
            file: sources.path(span).to_path_buf(),
            position: Some(sources.position(span)),
            message,
            excerpt: sources.excerpt(span),
            hint,
        });
    }

    /// A message without a place in a scene description.
    pub(super) fn push(&self, diagnostic: Diagnostic) {
        self.entries.borrow_mut().push(diagnostic);
    }

    /// True after the first error.
    pub(super) fn has_errors(&self) -> bool {
        self.entries.borrow().iter().any(|d| d.severity == Severity::Error)
    }

    /// True when so much is wrong that reading on is of no use.
    pub(super) fn is_full(&self) -> bool {
        self.entries.borrow().len() >= MAX_MESSAGES && self.has_errors()
    }

    /// `file:line:column` of a place.
    pub(super) fn describe(&self, span: Span) -> String {
        self.sources.borrow().describe(span)
    }

    /// Line of a place.
    pub(super) fn line(&self, span: Span) -> u32 {
        self.sources.borrow().position(span).0
    }

    /// The file of a place.
    pub(super) fn path(&self, span: Span) -> PathBuf {
        self.sources.borrow().path(span).to_path_buf()
    }

    /// All messages, in the order of their discovery, and a last one if there may be more.
    pub(super) fn finish(self) -> Vec<Diagnostic> {
        let mut entries = self.entries.into_inner();
        // Reading may have ended here, so that the rest cannot be counted.
        if let (true, Some(last)) = (entries.len() >= MAX_MESSAGES, entries.last()) {
            let more = Diagnostic {
                severity: entries.iter().map(|d| d.severity).max().unwrap_or(last.severity),
                subject: Subject::Scene,
                file: last.file.clone(),
                position: None,
                message: "further messages are not shown".to_owned(),
                excerpt: None,
                hint: None,
            };
            entries.push(more);
        }
        entries
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_count_characters() {
        let text = "aé\nüb<c";
        assert_eq!(position_in(text, 0), (1, 1));
        assert_eq!(position_in(text, text.find('<').unwrap()), (2, 3));
        assert_eq!(position_in(text, 1000), (2, 5));
    }

    #[test]
    fn the_log_keeps_an_error_after_a_hundred_warnings() {
        let log = Log::default();
        let file = log.add_source("a.xml".into(), "x".into());
        let span = Span { file, offset: 0 };
        for _ in 0..500 {
            log.warning(span, "odd", None);
        }
        log.error(span, "wrong", None);
        log.error(span, "wrong, too", None);
        let messages = log.finish();
        assert_eq!(messages.len(), 102);
        assert_eq!(messages[100].message, "wrong");
        assert_eq!(messages[101].message, "further messages are not shown");
    }
}
