//! Bytes → text, and words for what the file system says.

use std::io;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use crate::Limits;
use crate::diagnostic::Subject;

/// Why bytes are not a text.
pub(super) struct NotText {
    pub(super) offset: usize,
    pub(super) message: String,
    pub(super) hint: String,
}

/// The text of a file, or of its readable beginning and what is wrong with the rest.
pub(super) fn decode(bytes: Vec<u8>) -> (Rc<str>, Option<NotText>) {
    let not_text = |offset, message: &str, hint: &str| {
        Some(NotText { offset, message: message.into(), hint: hint.into() })
    };
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        let problem = not_text(0, "the file is UTF-16", "save it as UTF-8");
        return (Rc::from(""), problem);
    }
    if matches!(bytes[..], [b'<', 0, ..] | [0, b'<', ..]) {
        let problem = not_text(0, "the file is UTF-16", "save it as UTF-8");
        return (Rc::from(""), problem);
    }
    match String::from_utf8(bytes) {
        Ok(text) => match text.find('\0') {
            Some(i) => (
                Rc::from(&text[..i]),
                not_text(i, "the file is not a text: it holds a zero byte", "is it a scene file?"),
            ),
            None => (Rc::from(text), None),
        },
        Err(error) => {
            let valid = error.utf8_error().valid_up_to();
            let bytes = error.into_bytes();
            let end = bytes.len().min(valid + 40);
            let shown = String::from_utf8_lossy(&bytes[..end]);
            let problem = not_text(valid, "the file is not UTF-8", "save it as UTF-8");
            (Rc::from(shown), problem)
        }
    }
}

/// What could not be read and why.
pub(super) fn describe_io(path: &Path, error: &io::Error, limits: &Limits) -> (Subject, String) {
    let shown = path.display();
    match error.kind() {
        io::ErrorKind::NotFound => (Subject::File, format!("\"{shown}\" is not found")),
        io::ErrorKind::PermissionDenied => {
            (Subject::File, format!("\"{shown}\" may not be read: permission denied"))
        }
        io::ErrorKind::IsADirectory => (Subject::File, format!("\"{shown}\" is a folder")),
        io::ErrorKind::FileTooLarge => {
            let limit = limits.max_scene_bytes >> 20;
            let message = format!("the scene with its includes is larger than {limit} MiB");
            (Subject::Memory, message)
        }
        _ => (Subject::File, format!("\"{shown}\" cannot be read: {error}")),
    }
}

/// A name by which a file is known again, as far as the file system tells.
pub(super) fn canonical(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_path_buf())
}

/// The last part of a path, for messages.
pub(super) fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
