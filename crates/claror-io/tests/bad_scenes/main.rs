//! Bad scenes: every case gives the expected message, within bounded time.
//!
//! `cargo test -p claror-io --test bad_scenes -- --nocapture` prints the table.

mod data;
mod plugins;
mod structure;
mod values;
mod xml;

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use claror_io::diagnostic::Subject;
use claror_io::scene::{LoadOptions, load};
use claror_io::{Diagnostic, Severity};

/// One bad scene.
struct Case {
    name: &'static str,
    /// File names with their bytes; the first is the scene.
    files: Vec<(String, Vec<u8>)>,
    defines: &'static [(&'static str, &'static str)],
    /// What the messages must contain, one each, in order.
    expected: Vec<&'static str>,
    subject: Subject,
}

impl Case {
    fn file(mut self, name: &str, bytes: impl Into<Vec<u8>>) -> Self {
        self.files.push((name.to_owned(), bytes.into()));
        self
    }

    fn about(self, subject: Subject) -> Self {
        Self { subject, ..self }
    }

    /// A folder with all files.
    fn write(&self) -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        for (name, bytes) in &self.files {
            fs::write(folder.path().join(name), bytes).expect("a small file can be written");
        }
        folder
    }

    /// One further message.
    fn and(mut self, expected: &'static str) -> Self {
        self.expected.push(expected);
        self
    }
}

/// A scene file with these bytes.
fn raw(name: &'static str, scene: impl Into<Vec<u8>>, expected: &'static str) -> Case {
    Case {
        name,
        files: vec![("scene.xml".to_owned(), scene.into())],
        defines: &[],
        expected: vec![expected],
        subject: Subject::Scene,
    }
}

/// A scene with a camera, whose further content begins in line 2, column 1.
fn scene(name: &'static str, body: &str, expected: &'static str) -> Case {
    let camera = "<sensor type=\"perspective\"/>";
    raw(name, format!("<scene version=\"3.0.0\">\n{body}\n{camera}\n</scene>\n"), expected)
}

/// Longest time that a bad scene may take.
const LIMIT: Duration = Duration::from_secs(5);

/// What went wrong with a case.
fn run(case: &Case) -> Result<(), String> {
    let folder = case.write();
    let path = folder.path().join(&case.files[0].0);
    let defines = case.defines.iter().map(|(n, v)| ((*n).to_owned(), (*v).to_owned())).collect();
    let options = LoadOptions { defines, ..LoadOptions::default() };
    let begin = Instant::now();
    let result = load(&path, &options);
    let seconds = begin.elapsed();
    let diagnostics = match result {
        Ok(_) => return Err("the scene was accepted".to_owned()),
        Err(diagnostics) => diagnostics,
    };
    let errors = diagnostics.iter().filter(|d| d.severity == Severity::Error);
    let errors: Vec<&Diagnostic> = errors.collect();
    let got: Vec<String> = errors.iter().map(|d| shown(d, folder.path())).collect();
    println!("{}\n  expected {:?}", case.name, case.expected);
    for line in &got {
        println!("  got      {line}");
    }
    if errors.len() != case.expected.len() {
        return Err(format!("{} messages instead of {}", errors.len(), case.expected.len()));
    }
    for (line, expected) in got.iter().zip(&case.expected) {
        if !line.contains(expected) {
            return Err(format!("{expected:?} is not in {line:?}"));
        }
    }
    if errors[0].subject != case.subject {
        return Err(format!("the subject is {:?}, not {:?}", errors[0].subject, case.subject));
    }
    if seconds > LIMIT {
        return Err(format!("it took {seconds:?}"));
    }
    Ok(())
}

/// `file:line:column: message (hint)`.
fn shown(diagnostic: &Diagnostic, folder: &Path) -> String {
    let name = diagnostic.file.strip_prefix(folder).unwrap_or(&diagnostic.file);
    let (line, column) = diagnostic.position.unwrap_or_default();
    let hint = diagnostic.hint.as_ref().map_or_else(String::new, |h| format!(" ({h})"));
    let prefix = format!("{}{}", folder.display(), std::path::MAIN_SEPARATOR);
    let message = diagnostic.message.replace(&prefix, "");
    format!("{}:{line}:{column}: {message}{hint}", name.display())
}

#[test]
fn bad_scenes_are_told_clearly() {
    let cases: Vec<Case> =
        [xml::cases(), structure::cases(), values::cases(), plugins::cases(), data::cases()]
            .into_iter()
            .flatten()
            .collect();
    let failures: Vec<String> = cases
        .iter()
        .filter_map(|case| run(case).err().map(|reason| format!("{}: {reason}", case.name)))
        .collect();
    println!("{} cases", cases.len());
    assert!(cases.len() >= 60);
    assert!(failures.is_empty(), "{} failures:\n{}", failures.len(), failures.join("\n"));
}

#[test]
fn messages_end_after_a_hundred() {
    let body = format!("<scene version=\"3.0.0\">\n{}</scene>", "<x/>\n".repeat(100_000));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    fs::write(&path, body).unwrap();
    let begin = Instant::now();
    let diagnostics = load(&path, &LoadOptions::default()).unwrap_err();
    assert!(begin.elapsed() < LIMIT);
    assert_eq!(diagnostics.len(), 101);
    assert_eq!(diagnostics[100].message, "further messages are not shown");
}

#[test]
fn missing_scenes_have_no_excerpt() {
    let folder = tempfile::tempdir().unwrap();
    for (path, message) in
        [(folder.path().join("no.xml"), "is not found"), (folder.path().into(), "is a folder")]
    {
        let diagnostics = load(&path, &LoadOptions::default()).unwrap_err();
        assert_eq!(diagnostics.len(), 1);
        assert!(diagnostics[0].message.ends_with(message), "{}", diagnostics[0].message);
        assert_eq!((diagnostics[0].subject, diagnostics[0].position), (Subject::File, None));
    }
}

#[test]
fn odd_scenes_are_read_with_a_warning() {
    for case in data::odd() {
        let folder = case.write();
        let path = folder.path().join("scene.xml");
        let loaded = load(&path, &LoadOptions::default()).unwrap();
        let got: Vec<String> = loaded.warnings.iter().map(|w| shown(w, folder.path())).collect();
        assert_eq!(got.len(), case.expected.len(), "{}: {got:?}", case.name);
        for (line, expected) in got.iter().zip(&case.expected) {
            assert!(line.contains(expected), "{}: {line}", case.name);
        }
    }
}
