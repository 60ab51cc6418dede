//! What the user sees of a panic: one line instead of a backtrace.

use std::panic::PanicHookInfo;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::messages::{stderr_line, without_controls};

/// Replaces Rust's report of a panic by one line. Only the first panic is told: others follow
/// from it in other threads.
pub(crate) fn install_hook() {
    let told = AtomicBool::new(false);
    std::panic::set_hook(Box::new(move |info| {
        if !told.swap(true, Ordering::Relaxed) {
            stderr_line(&line(info));
        }
    }));
}

fn line(info: &PanicHookInfo) -> String {
    let payload = info.payload();
    let message = payload
        .downcast_ref::<&str>()
        .map(|text| (*text).to_owned())
        .or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no message".to_owned());
    let place = info.location().map_or_else(|| "unknown place".to_owned(), ToString::to_string);
    let version = env!("CARGO_PKG_VERSION");
    let text =
        format!("error: this is a bug in claror {version}, please report it: {message} ({place})");
    without_controls(&text).replace('\n', " ")
}
