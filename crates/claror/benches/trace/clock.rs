//! CPU time where the system tells it, time on the wall elsewhere.

use std::time::Instant;

/// A stopwatch.
pub(crate) struct Clock {
    start: Instant,
}

impl Clock {
    pub(crate) fn new() -> Self {
        Self { start: Instant::now() }
    }

    /// Seconds that `f` took, and its result.
    pub(crate) fn time<T>(&self, f: impl FnOnce() -> T) -> (f64, T) {
        let before = self.now();
        let result = std::hint::black_box(f());
        (self.now() - before, result)
    }

    fn now(&self) -> f64 {
        thread_cpu_seconds().unwrap_or_else(|| self.start.elapsed().as_secs_f64())
    }
}

/// Processor time of this thread.
#[cfg(all(unix, not(target_vendor = "apple")))]
fn thread_cpu_seconds() -> Option<f64> {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    Some(time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9)
}

#[cfg(not(all(unix, not(target_vendor = "apple"))))]
fn thread_cpu_seconds() -> Option<f64> {
    None
}
