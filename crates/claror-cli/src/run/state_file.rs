//! Checkpoint files.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use claror::render::RenderState;
use claror_io::Limits;
use claror_io::ReadError;
use claror_io::diagnostic::Subject;

const MAGIC: &[u8; 8] = b"claror-1";

/// Writes a state, whole or not at all.
pub(crate) fn write(path: &Path, state: &RenderState) -> Result<(), io::Error> {
    claror_io::write::atomically(path, |w: &mut BufWriter<&File>| {
        w.write_all(MAGIC)?;
        w.write_all(&state.to_bytes())
    })
}

/// Reads a state.
pub(crate) fn read(path: &Path, _limits: &Limits) -> Result<RenderState, ReadError> {
    let error = |message: String| ReadError {
        file: path.to_owned(),
        subject: Subject::File,
        line: None,
        message,
        hint: None,
    };
    let bytes = std::fs::read(path).map_err(|e| error(crate::exit::describe(&e)))?;
    let body = bytes
        .strip_prefix(MAGIC)
        .ok_or_else(|| error("this is not a checkpoint of this version".to_owned()))?;
    RenderState::from_bytes(body).map_err(|e| error(format!("the checkpoint is broken: {e}")))
}
