//! The state of a render as a checkpoint file: what was rendered how, then the sums.

use std::io;
use std::path::Path;

use claror::render::RenderState;
use claror_io::container::{self, Container, Header, Kind};
use claror_io::diagnostic::Subject;
use claror_io::{Limits, ReadError};

/// Name of the block with the state.
const STATE: &str = "state";

/// Writes a state, whole or not at all.
pub(crate) fn write(path: &Path, state: &RenderState) -> io::Result<()> {
    let header = Header { fields: state.fingerprint.entries.clone() };
    let blocks = vec![(STATE.to_owned(), state.to_bytes())];
    container::write(path, Kind::Checkpoint, &Container { header, blocks })
}

/// Reads a state.
pub(crate) fn read(path: &Path) -> Result<RenderState, ReadError> {
    let error = |message: String| ReadError {
        file: path.to_owned(),
        subject: Subject::File,
        line: None,
        message,
        hint: None,
    };
    let container = container::read(path, Kind::Checkpoint, &Limits::default())?;
    let bytes = container
        .block(STATE)
        .ok_or_else(|| error("the checkpoint holds no state of a render".to_owned()))?;
    RenderState::from_bytes(bytes).map_err(|e| error(format!("the state of the render: {e}")))
}
