//! `claror info`: what was understood of a scene.

use crate::args::SceneArgs;
use crate::exit::{Exit, Failure};
use crate::messages::Console;

pub(crate) fn run(_args: &SceneArgs, _console: &Console) -> Result<Exit, Failure> {
    Ok(Exit::Success)
}
