//! What the user reads: results on standard output, everything else on standard error; or, with
//! `--json`, one object per line on standard output.

use std::fmt::Write as _;
use std::io::{self, IsTerminal, Write};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use claror_io::{Diagnostic, ReadError, Severity};
use serde_json::{Value, json};

use crate::exit::{Exit, Failure};

/// How much is said.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Verbosity {
    /// Errors only.
    Quiet,
    /// Results, warnings, progress.
    Normal,
    /// Also how it went: versions, timings.
    Verbose,
}

/// One message about a file or about the work itself.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Report {
    pub(crate) severity: Severity,
    pub(crate) message: String,
    pub(crate) file: Option<PathBuf>,
    pub(crate) position: Option<(u32, u32)>,
    pub(crate) hint: Option<String>,
    /// As plain text, several lines, no colour; without the hint when `diagnostic` is false.
    text: String,
    diagnostic: bool,
}

impl Report {
    fn plain(severity: Severity, message: String) -> Self {
        let label = label(severity);
        Self {
            severity,
            text: format!("{label}: {message}"),
            message,
            file: None,
            position: None,
            hint: None,
            diagnostic: false,
        }
    }

    /// An error without a place in a file.
    pub(crate) fn error(message: impl Into<String>) -> Self {
        Self::plain(Severity::Error, message.into())
    }

    /// A warning without a place in a file.
    pub(crate) fn warning(message: impl Into<String>) -> Self {
        Self::plain(Severity::Warning, message.into())
    }

    /// The message as shown, with or without colour. Control characters, which a hostile file
    /// may bring along, do not reach the terminal.
    pub(crate) fn render(&self, colour: bool) -> String {
        let mut text = self.text.clone();
        if !self.diagnostic
            && let Some(hint) = &self.hint
        {
            let _ = write!(text, "\n  help: {hint}");
        }
        let text = without_controls(&text);
        if colour { paint(&text, self.severity) } else { text }
    }

    /// The message as a JSON object.
    pub(crate) fn json(&self, exit: Option<Exit>) -> Value {
        let mut object = json!({ "event": label(self.severity), "message": self.message });
        if let Some(file) = &self.file {
            object["file"] = json!(file.to_string_lossy());
        }
        if let Some((line, column)) = self.position {
            object["line"] = json!(line);
            object["column"] = json!(column);
        }
        if let Some(hint) = &self.hint {
            object["hint"] = json!(hint);
        }
        if let Some(exit) = exit {
            object["exit_code"] = json!(exit as u8);
        }
        object
    }
}

impl From<&Diagnostic> for Report {
    fn from(diagnostic: &Diagnostic) -> Self {
        Self {
            severity: diagnostic.severity,
            message: diagnostic.message.clone(),
            file: Some(diagnostic.file.clone()),
            position: diagnostic.position,
            hint: diagnostic.hint.clone(),
            text: diagnostic.to_string(),
            diagnostic: true,
        }
    }
}

impl From<&ReadError> for Report {
    fn from(error: &ReadError) -> Self {
        let mut report = Self::error(error.message.clone());
        report.text = format!("error: {}\n  --> {}", error.message, error.file.display());
        if let Some(line) = error.line {
            let _ = write!(report.text, ":{line}");
            report.position = Some((line, 1));
        }
        report.file = Some(error.file.clone());
        report.hint = error.hint.clone();
        report
    }
}

fn label(severity: Severity) -> &'static str {
    match severity {
        Severity::Warning => "warning",
        Severity::Error => "error",
    }
}

/// The text with every control character but the line feed made harmless, one for one, so that
/// carets stay under what they point at.
pub(crate) fn without_controls(text: &str) -> String {
    text.chars()
        .map(|c| match c {
            '\n' => '\n',
            '\t' => ' ',
            c if c.is_control() => '\u{fffd}',
            // Bidirectional overrides can make a message read as something else.
            '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => '\u{fffd}',
            c => c,
        })
        .collect()
}

const RESET: &str = "\x1b[0m";
const BOLD: &str = "\x1b[1m";
const BLUE: &str = "\x1b[1;34m";
const CYAN: &str = "\x1b[1;36m";

/// Colours the parts of a message: its label, the arrow, the gutter and the caret.
fn paint(text: &str, severity: Severity) -> String {
    let strong = match severity {
        Severity::Warning => "\x1b[1;33m",
        Severity::Error => "\x1b[1;31m",
    };
    let label = label(severity);
    let mut out = String::new();
    for (index, line) in text.lines().enumerate() {
        if index > 0 {
            out.push('\n');
        }
        if index == 0
            && let Some(message) = line.strip_prefix(label)
        {
            let _ = write!(out, "{strong}{label}{RESET}{BOLD}{message}{RESET}");
        } else if let Some(place) = line.strip_prefix("  --> ") {
            let _ = write!(out, "  {BLUE}-->{RESET} {place}");
        } else if let Some(hint) = line.strip_prefix("  help: ") {
            let _ = write!(out, "  {CYAN}help:{RESET} {hint}");
        } else if let Some((gutter, rest)) = line.split_once(" |") {
            let rest =
                if rest.trim() == "^" { format!("{strong}{rest}{RESET}") } else { rest.to_owned() };
            let _ = write!(out, "{BLUE}{gutter} |{RESET}{rest}");
        } else {
            out.push_str(line);
        }
    }
    out
}

/// Standard output. What goes wrong with it is remembered until the work is done: a reader that
/// leaves early, such as `head`, must not cost the picture.
#[derive(Debug, Clone, Default)]
pub(crate) struct Stdout {
    error: Arc<Mutex<Option<io::Error>>>,
}

impl Stdout {
    /// Writes bytes and flushes; after the first error nothing more is written.
    pub(crate) fn write(&self, bytes: &[u8]) {
        let mut error = self.error.lock().unwrap_or_else(PoisonError::into_inner);
        if error.is_none() {
            let mut out = io::stdout().lock();
            *error = out.write_all(bytes).and_then(|()| out.flush()).err();
        }
    }

    fn line(&self, line: &str) {
        self.write(format!("{line}\n").as_bytes());
    }

    /// A JSON object on a line of its own.
    pub(crate) fn object(&self, object: &Value) {
        self.line(&object.to_string());
    }

    /// What went wrong; nothing if the reader simply had enough.
    fn failure(&self) -> Option<Failure> {
        let error = self.error.lock().unwrap_or_else(PoisonError::into_inner).take()?;
        if error.kind() == io::ErrorKind::BrokenPipe {
            return None;
        }
        let message = format!("cannot write standard output: {}", crate::exit::describe(&error));
        Some(Failure::new(Exit::File, message))
    }
}

/// Where messages go.
#[derive(Debug)]
pub(crate) struct Console {
    /// One JSON object per line on standard output instead of text.
    pub(crate) json: bool,
    pub(crate) verbosity: Verbosity,
    /// Colour on standard error.
    pub(crate) colour: bool,
    /// Standard error is a terminal that can redraw a line.
    pub(crate) interactive: bool,
    /// Standard output carries a picture: the summary goes to standard error.
    pub(crate) stdout_taken: bool,
    pub(crate) stdout: Stdout,
}

impl Console {
    /// As the environment and the options ask.
    pub(crate) fn new(json: bool, verbosity: Verbosity) -> Self {
        let terminal =
            io::stderr().is_terminal() && std::env::var_os("TERM").is_none_or(|t| t != "dumb");
        Self {
            json,
            verbosity,
            colour: terminal && !no_color(),
            interactive: terminal,
            stdout_taken: false,
            stdout: Stdout::default(),
        }
    }

    /// One line of results.
    pub(crate) fn result(&self, line: &str) {
        if self.json || self.verbosity == Verbosity::Quiet {
            return;
        }
        let line = without_controls(line);
        if self.stdout_taken { stderr_line(&line) } else { self.stdout.line(&line) }
    }

    /// One JSON object, when they are asked for.
    pub(crate) fn event(&self, object: &Value) {
        if self.json {
            self.stdout.object(object);
        }
    }

    /// Something that the user should know.
    pub(crate) fn warning(&self, report: &Report) {
        if self.json {
            self.event(&report.json(None));
        } else if self.verbosity > Verbosity::Quiet {
            stderr_line(&report.render(self.colour));
        }
    }

    /// Something that only the curious want to know.
    pub(crate) fn detail(&self, line: &str) {
        if !self.json && self.verbosity == Verbosity::Verbose {
            stderr_line(&without_controls(line));
        }
    }

    /// Tells why the program ends, all of it, and with which code.
    pub(crate) fn failure(&self, failure: &Failure) -> Exit {
        for report in &failure.reports {
            let is_error = report.severity == Severity::Error;
            self.event(&report.json(is_error.then_some(failure.exit)));
            let shown = if self.json { is_error } else { self.verbosity > Verbosity::Quiet };
            if shown || is_error {
                stderr_line(&report.render(self.colour));
            }
        }
        let errors = failure.reports.iter().filter(|r| r.severity == Severity::Error).count();
        if errors > 1 {
            stderr_line(&format!("{errors} errors"));
        }
        failure.exit
    }

    /// The exit code of a command that succeeded with `exit`: standard output may have failed.
    pub(crate) fn finish(&self, exit: Exit) -> Exit {
        match self.stdout.failure() {
            Some(failure) => self.failure(&failure),
            None => exit,
        }
    }
}

/// The convention of no-color.org: set and not empty.
pub(crate) fn no_color() -> bool {
    std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty())
}

/// Writes a line to standard error. When even that fails there is nobody left to tell.
pub(crate) fn stderr_line(line: &str) {
    let _ = writeln!(io::stderr().lock(), "{line}");
}

#[cfg(test)]
mod tests {
    use super::*;
    use claror_io::diagnostic::Subject;

    fn diagnostic() -> Diagnostic {
        Diagnostic {
            severity: Severity::Error,
            subject: Subject::Scene,
            file: "box.xml".into(),
            position: Some((3, 5)),
            message: "unknown BSDF \"difuse\"".into(),
            excerpt: Some("    <bsdf type=\"difuse\"/>".into()),
            hint: Some("did you mean \"diffuse\"?".into()),
        }
    }

    #[test]
    fn a_diagnostic_is_shown_as_it_displays_itself() {
        let diagnostic = diagnostic();
        assert_eq!(Report::from(&diagnostic).render(false), diagnostic.to_string());
    }

    #[test]
    fn colour_adds_nothing_but_colour() {
        let report = Report::from(&diagnostic());
        let mut painted = report.render(true);
        assert!(painted.contains("\x1b[1;31merror"));
        assert!(painted.contains("\x1b[1;31m     ^"), "{painted:?}");
        for code in [RESET, BOLD, BLUE, CYAN, "\x1b[1;31m"] {
            painted = painted.replace(code, "");
        }
        assert_eq!(painted, report.render(false));
    }

    #[test]
    fn a_report_as_json_names_the_place() {
        let object = Report::from(&diagnostic()).json(Some(Exit::Scene));
        assert_eq!(object["event"], "error");
        assert_eq!(object["file"], "box.xml");
        assert_eq!((&object["line"], &object["column"]), (&json!(3), &json!(5)));
        assert_eq!(object["exit_code"], 3);
    }

    #[test]
    fn escape_sequences_of_a_file_do_not_reach_the_terminal() {
        let report = Report::error("bad \x1b[2Jname\u{202e}\ttab");
        assert_eq!(report.render(false), "error: bad \u{fffd}[2Jname\u{fffd} tab");
    }

    #[test]
    fn a_hint_follows_a_plain_message() {
        let failure = Failure::usage("no").hint("yes");
        assert_eq!(failure.reports[0].render(false), "error: no\n  help: yes");
    }
}
