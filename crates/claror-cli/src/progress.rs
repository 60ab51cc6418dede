//! How far the work is: a bar on a terminal, a line now and then in a pipe, or JSON events.
//!
//! A phase has a ticker of its own that shows the last known state, so that whoever works only
//! stores numbers, and long steps without news still show that time passes. The ticker also
//! watches for Ctrl-C in phases that cannot be ended half-way.

use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::bar::Bar;
use crate::exit::Exit;
use crate::messages::{Console, Report, Stdout, Verbosity, stderr_line};
use crate::signals::Interrupts;
use crate::units;

/// What is known about the work at a moment.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Snapshot {
    /// Share done, 0 to 1, if it can be known.
    pub(crate) fraction: Option<f64>,
    /// Rays traced in this phase.
    pub(crate) rays: u64,
    /// Estimated relative error of the picture.
    pub(crate) error: Option<f64>,
    /// Samples per pixel done, and to do if that is known.
    pub(crate) samples: Option<(u32, Option<u32>)>,
    /// What is done now, if the phase has parts.
    pub(crate) task: Option<String>,
    /// Time left as the worker knows it, when it stops by the clock.
    pub(crate) remaining: Option<Duration>,
    /// A part of the phase that `fraction` and `rays` are about, if they are not about all of it.
    pub(crate) stage: Option<Stage>,
}

/// A part of a phase with a name of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stage {
    pub(crate) name: &'static str,
    /// Since the phase began, when the stage did.
    pub(crate) begin: Duration,
    /// Records so far.
    pub(crate) records: u64,
    /// Stride of the lattice of pixels that is looked through.
    pub(crate) stride: Option<u32>,
}

impl Snapshot {
    /// Time left: what the worker says, else by the rule of three once there is enough to go by.
    /// Steps of a stage do not take equal times.
    fn remaining(&self, elapsed: Duration) -> Option<Duration> {
        if self.stage.is_some() {
            return None;
        }
        self.remaining.or_else(|| {
            // Parts of unequal length: only the worker knows.
            let done = self.fraction.filter(|_| self.task.is_none());
            let done = done.filter(|f| *f > 0.001 && *f <= 1.0)?;
            Duration::try_from_secs_f64(elapsed.as_secs_f64() * (1.0 - done) / done).ok()
        })
    }

    /// `42 %, 12 s, 17 s left, 3.21 Mrays/s, error 0.0123, 64/256 spp`.
    fn line(&self, elapsed: Duration) -> String {
        let mut parts: Vec<String> = Vec::new();
        parts.extend(self.task.clone());
        if let Some(fraction) = self.fraction {
            parts.push(format!("{:3.0} %", (fraction * 100.0).floor()));
        }
        parts.push(units::duration(elapsed));
        if let Some(remaining) = self.remaining(elapsed) {
            parts.push(format!("{} left", units::duration(remaining)));
        }
        let time = self.rays_time(elapsed);
        // Eighty columns have room for rays or records.
        if let Some(stage) = self.stage.filter(|stage| stage.records > 0) {
            parts.push(units::plural(stage.records, "record"));
            let stride = stage.stride.map(|stride| units::plural(stride.into(), "pixel"));
            parts.extend(stride.map(|stride| format!("every {stride}")));
        } else if self.rays > 0 && !time.is_zero() {
            let rate = self.rays as f64 / time.as_secs_f64();
            parts.push(format!("{}rays/s", units::decimal(rate)));
        }
        if let Some(error) = self.error {
            parts.push(format!("error {error:.4}"));
        }
        match self.samples {
            Some((done, Some(all))) => parts.push(format!("{done}/{all} spp")),
            Some((done, None)) => parts.push(format!("{done} spp")),
            None => {}
        }
        parts.join(", ")
    }

    /// Time that the rays took.
    fn rays_time(&self, elapsed: Duration) -> Duration {
        elapsed.saturating_sub(self.stage.map_or(Duration::ZERO, |stage| stage.begin))
    }

    fn json(&self, phase: &str, elapsed: Duration) -> Value {
        json!({
            "event": "progress",
            "phase": phase,
            "stage": self.stage.map(|stage| stage.name),
            "fraction": self.fraction,
            "elapsed": seconds(elapsed),
            "remaining": self.remaining(elapsed).map(seconds),
            "rays": self.rays,
            "rays_per_second": self.rays as f64 / self.rays_time(elapsed).as_secs_f64().max(1e-9),
            "records": self.stage.map(|stage| stage.records),
            "stride": self.stage.and_then(|stage| stage.stride),
            "error": self.error,
            "task": self.task,
            "spp": self.samples.map(|(done, _)| done),
        })
    }
}

/// What a phase and its ticker share.
#[derive(Debug, Default)]
struct State {
    snapshot: Snapshot,
    /// Said in between, not shown yet.
    lines: Vec<String>,
}

/// Seconds with milliseconds, as they stand in JSON.
pub(crate) fn seconds(time: Duration) -> f64 {
    (time.as_secs_f64() * 1e3).round() / 1e3
}

/// What happens on Ctrl-C while a phase runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum OnInterrupt {
    /// Nothing is lost: the program ends at once.
    Exit,
    /// The worker asks for it and ends in order.
    Worker,
}

/// A phase of the work; shown until it is dropped or finished.
#[derive(Debug)]
pub(crate) struct Phase<'a> {
    console: &'a Console,
    name: &'static str,
    start: Instant,
    state: Arc<Mutex<State>>,
    ticker: Option<(mpsc::Sender<()>, JoinHandle<()>)>,
}

impl<'a> Phase<'a> {
    /// Begins to show a phase.
    pub(crate) fn start(
        console: &'a Console,
        interrupts: &Interrupts,
        name: &'static str,
        on_interrupt: OnInterrupt,
    ) -> Self {
        console.event(&json!({ "event": "phase", "phase": name, "state": "begin" }));
        let start = Instant::now();
        let state = Arc::new(Mutex::new(State::default()));
        let display = Display::new(console, name);
        let ticker = Ticker {
            display,
            start,
            state: Arc::clone(&state),
            interrupts: interrupts.clone(),
            on_interrupt,
            is_stopping: interrupts.requested(),
        };
        let (stop, stopped) = mpsc::channel();
        let handle = std::thread::Builder::new()
            .name("progress".to_owned())
            .spawn(move || ticker.run(&stopped))
            .ok();
        // Without a thread to show it the work goes on unseen.
        let ticker = handle.map(|handle| (stop, handle));
        Self { console, name, start, state, ticker }
    }

    /// Stores what is known; the ticker shows it.
    pub(crate) fn update(&self, snapshot: Snapshot) {
        self.lock().snapshot = snapshot;
    }

    /// Says something in between, above the bar.
    pub(crate) fn warn(&self, report: &Report) {
        if self.console.json {
            self.console.warning(report);
        } else if self.console.verbosity > Verbosity::Quiet {
            self.lock().lines.push(report.render(self.console.colour));
        }
    }

    /// Tells of a part that is done: a line of its own where there is no bar.
    pub(crate) fn say(&self, line: &str) {
        if self.console.json {
            let done = json!({ "event": "progress", "phase": self.name, "done": line });
            self.console.event(&done);
        } else if self.console.verbosity > Verbosity::Quiet && !self.console.interactive {
            self.lock().lines.push(line.to_owned());
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Ends the display and reports the time that the phase took.
    pub(crate) fn finish(mut self) -> Duration {
        self.clear();
        let elapsed = self.start.elapsed();
        self.console.event(&json!({
            "event": "phase",
            "phase": self.name,
            "state": "end",
            "seconds": seconds(elapsed),
        }));
        self.console.detail(&format!("{:7} {}", self.name, units::duration(elapsed)));
        elapsed
    }

    fn clear(&mut self) {
        if let Some((stop, handle)) = self.ticker.take() {
            drop(stop);
            // A ticker that panicked has already been reported by the panic hook.
            let _ = handle.join();
        }
    }
}

impl Drop for Phase<'_> {
    fn drop(&mut self) {
        self.clear();
    }
}

/// Shows a phase from a thread of its own.
struct Ticker {
    display: Display,
    start: Instant,
    state: Arc<Mutex<State>>,
    interrupts: Interrupts,
    on_interrupt: OnInterrupt,
    /// After an interrupt nothing more is drawn: the terminal is clean whenever the end comes.
    is_stopping: bool,
}

impl Ticker {
    const PERIOD: Duration = Duration::from_millis(50);

    fn run(mut self, stopped: &mpsc::Receiver<()>) {
        while stopped.recv_timeout(Self::PERIOD) == Err(RecvTimeoutError::Timeout) {
            if self.interrupts.requested() && self.on_interrupt == OnInterrupt::Exit {
                self.display.clear();
                stderr_line("interrupted");
                // The other threads cannot be asked to stop here.
                std::process::exit(i32::from(Exit::Interrupted as u8));
            }
            let snapshot = self.say_lines();
            if self.interrupts.requested() {
                if !std::mem::replace(&mut self.is_stopping, true) {
                    self.display.say("stopping; Ctrl-C again ends at once");
                }
            } else {
                self.display.show(&snapshot, self.start.elapsed());
            }
        }
        self.display.clear();
        self.say_lines();
    }

    /// Shows what was said in between, and returns what is known.
    fn say_lines(&mut self) -> Snapshot {
        let (lines, snapshot) = {
            let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
            (std::mem::take(&mut state.lines), state.snapshot.clone())
        };
        lines.iter().for_each(|line| self.display.say(line));
        snapshot
    }
}

/// The three ways to show progress, and none.
enum Display {
    Hidden,
    Bar { name: &'static str, bar: Bar },
    Lines { name: &'static str, next: Duration },
    Json { name: &'static str, next: Duration, stdout: Stdout },
}

impl Display {
    /// Shorter phases are over before anyone could read their bar.
    const FIRST_BAR: Duration = Duration::from_millis(150);
    const LINE_PERIOD: Duration = Duration::from_secs(10);
    const JSON_PERIOD: Duration = Duration::from_secs(1);

    fn new(console: &Console, name: &'static str) -> Self {
        if console.json {
            Self::Json { name, next: Self::JSON_PERIOD, stdout: console.stdout.clone() }
        } else if console.verbosity == Verbosity::Quiet {
            Self::Hidden
        } else if console.interactive {
            Self::Bar { name, bar: Bar::new(console.colour) }
        } else {
            Self::Lines { name, next: Self::LINE_PERIOD }
        }
    }

    fn show(&mut self, snapshot: &Snapshot, elapsed: Duration) {
        let stage = snapshot.stage.map(|stage| stage.name);
        match self {
            Self::Hidden => {}
            Self::Bar { name, bar } => {
                if elapsed >= Self::FIRST_BAR {
                    bar.draw(stage.unwrap_or(name), snapshot.fraction, &snapshot.line(elapsed));
                }
            }
            Self::Lines { name, next } => {
                if elapsed >= *next {
                    *next += Self::LINE_PERIOD;
                    let name = stage.unwrap_or(name);
                    stderr_line(&format!("{name}: {}", snapshot.line(elapsed).trim_start()));
                }
            }
            Self::Json { name, next, stdout } => {
                if elapsed >= *next {
                    *next += Self::JSON_PERIOD;
                    stdout.object(&snapshot.json(name, elapsed));
                }
            }
        }
    }

    /// A message that stays, above the bar.
    fn say(&mut self, line: &str) {
        self.clear();
        if !matches!(self, Self::Hidden | Self::Json { .. }) {
            stderr_line(line);
        }
    }

    fn clear(&mut self) {
        if let Self::Bar { bar, .. } = self {
            bar.clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn snapshot() -> Snapshot {
        Snapshot {
            fraction: Some(0.25),
            rays: 30_000_000,
            error: Some(0.0123),
            samples: Some((64, Some(256))),
            ..Snapshot::default()
        }
    }

    #[test]
    fn a_line_says_all_that_is_known() {
        assert_eq!(
            snapshot().line(Duration::from_secs(10)),
            " 25 %, 10 s, 30 s left, 3.00 Mrays/s, error 0.0123, 64/256 spp"
        );
        assert_eq!(Snapshot::default().line(Duration::from_millis(1500)), "1.5 s");
    }

    #[test]
    fn the_worker_knows_better_when_it_will_stop() {
        let clocked = Snapshot { remaining: Some(Duration::from_secs(5)), ..snapshot() };
        assert_eq!(clocked.remaining(Duration::from_secs(10)), Some(Duration::from_secs(5)));
    }

    #[test]
    fn parts_of_unequal_length_predict_nothing() {
        let part = Snapshot { task: Some("run 1 of 4".to_owned()), ..snapshot() };
        assert_eq!(part.remaining(Duration::from_secs(10)), None);
        assert!(part.line(Duration::from_secs(10)).starts_with("run 1 of 4,  25 %, 10 s, 3.00"));
    }

    #[test]
    fn nothing_done_predicts_nothing() {
        let start = Snapshot { fraction: Some(0.0), ..Snapshot::default() };
        assert_eq!(start.remaining(Duration::from_secs(10)), None);
    }

    #[test]
    fn a_stage_has_its_own_rate_and_predicts_nothing() {
        let begin = Duration::from_secs(4);
        let stage = Stage { name: "records", begin, records: 1250, stride: Some(8) };
        let snapshot = Snapshot {
            fraction: Some(0.4),
            rays: 18_000_000,
            stage: Some(stage),
            ..Snapshot::default()
        };
        let line = snapshot.line(Duration::from_secs(10));
        assert_eq!(line, " 40 %, 10 s, 1 250 records, every 8 pixels");
        let event = snapshot.json("render", Duration::from_secs(10));
        assert_eq!((&event["phase"], &event["stage"]), (&json!("render"), &json!("records")));
        assert_eq!((&event["records"], &event["stride"]), (&json!(1250), &json!(8)));
        assert_eq!((&event["rays_per_second"], &event["remaining"]), (&json!(3e6), &Value::Null));
    }

    #[test]
    fn an_event_is_flat_json() {
        let event = snapshot().json("render", Duration::from_secs(10));
        assert_eq!(event["event"], "progress");
        assert_eq!(event["rays_per_second"], 3e6);
        assert_eq!(event["remaining"], 30.0);
    }
}
