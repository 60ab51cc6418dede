//! `claror check`: is this a scene?

use serde_json::json;

use super::load;
use crate::args::SceneArgs;
use crate::exit::{Exit, Failure};
use crate::messages::Console;
use crate::signals::Interrupts;

/// Reads the scene and derives what rendering needs, which finds what reading cannot.
pub(crate) fn run(args: &SceneArgs, console: &Console) -> Result<Exit, Failure> {
    let interrupts = Interrupts::listen();
    let pool = load::thread_pool(args)?;
    let loaded = load::load(args, console, &interrupts, &pool)?;
    let warnings = loaded.warnings.len();
    load::build(loaded.tables, args, console, &interrupts, &pool)?;
    console.result(&match warnings {
        0 => format!("{}: ok", args.scene.display()),
        _ => {
            let warnings = crate::units::plural(warnings as u64, "warning");
            format!("{}: ok, {warnings}", args.scene.display())
        }
    });
    console.event(&json!({
        "event": "result",
        "scene": args.scene.to_string_lossy(),
        "ok": true,
        "warnings": warnings,
    }));
    Ok(Exit::Success)
}
