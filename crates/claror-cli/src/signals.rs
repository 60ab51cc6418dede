//! Ctrl-C and SIGTERM: once, the work ends in order; twice, the program ends.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use crate::exit::Exit;

/// Whether the user asked to stop. Clones share the answer.
#[derive(Debug, Clone, Default)]
pub(crate) struct Interrupts {
    requested: Arc<AtomicBool>,
}

impl Interrupts {
    /// Listens from now on. A signal that cannot be caught keeps its usual effect.
    pub(crate) fn listen() -> Self {
        let requested = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            let status = i32::from(Exit::Interrupted as u8);
            // Runs first, hence ends the program only if an earlier signal has set the flag.
            let second =
                flag::register_conditional_shutdown(signal, status, Arc::clone(&requested));
            if second.is_ok() {
                let _ = flag::register(signal, Arc::clone(&requested));
            }
        }
        Self { requested }
    }

    /// True from the first signal on.
    pub(crate) fn requested(&self) -> bool {
        self.requested.load(Ordering::Relaxed)
    }
}
