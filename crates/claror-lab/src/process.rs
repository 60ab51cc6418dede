//! The renderer as a process of its own, so that time and memory are its own.

use std::io::{self, BufRead, BufReader, Read};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::Value;
use wait4::{ResUse, Wait4};

/// Time between two looks at a process.
const PERIOD: Duration = Duration::from_millis(10);
/// Time that a process has to end in order before it is killed.
const GRACE: Duration = Duration::from_secs(10);

/// What a process that ended said and took.
#[derive(Debug, Clone)]
pub(crate) struct Finished {
    /// Exit code; nothing if a signal ended it.
    pub(crate) code: Option<i32>,
    /// Objects on its standard output.
    pub(crate) events: Vec<Value>,
    /// What it said on standard error.
    pub(crate) stderr: String,
    /// Processor seconds, user and system.
    pub(crate) cpu_seconds: f64,
    /// Largest resident memory in bytes, as the system says. On Linux at least that of the
    /// process that started it.
    pub(crate) peak_memory_bytes: u64,
    /// Wall-clock seconds from start to end.
    pub(crate) seconds: f64,
    /// Whether it was asked to stop.
    pub(crate) stopped: bool,
}

impl Finished {
    /// The last object with `"event": name`.
    pub(crate) fn event(&self, name: &str) -> Option<&Value> {
        self.events.iter().rev().find(|event| event["event"] == name)
    }

    /// Its error messages without their label, or what else can be said.
    pub(crate) fn message(&self) -> String {
        let said = self.stderr.trim();
        let said = said.strip_prefix("error: ").unwrap_or(said);
        // What follows after a mistake in the options is of no use here.
        let said = said.split("\n\nUsage:").next().unwrap_or(said);
        match (said, self.code) {
            ("", Some(code)) => format!("exit code {code} without a message"),
            ("", None) => "it was killed by a signal, perhaps for want of memory".to_owned(),
            (said, _) => said.to_owned(),
        }
    }
}

/// What to know while a process runs.
pub(crate) trait Watching {
    /// Whether to stop: asked again and again.
    fn cancelled(&self) -> bool;
    /// The process' number, once it is there.
    fn started(&self, _pid: u32) {}
    /// Share that is done, as it says.
    fn fraction(&self, _fraction: f64) {}
}

/// Runs a command that writes JSON objects to standard output. When it is cancelled the process
/// gets SIGTERM, and SIGKILL if it takes its time.
///
/// # Errors
/// If it cannot be started.
pub(crate) fn run(command: &[String], watching: &dyn Watching) -> io::Result<Finished> {
    let start = Instant::now();
    let mut child = spawn(command)?;
    watching.started(child.id());
    let fraction = Arc::new(Mutex::new(None));
    let events = child.stdout.take().map(|out| {
        let fraction = Arc::clone(&fraction);
        thread::spawn(move || read_events(out, &fraction))
    });
    let stderr = child.stderr.take().map(|mut out| {
        thread::spawn(move || {
            let mut bytes = Vec::new();
            // What came before an error is all there is to tell.
            let _ = out.read_to_end(&mut bytes);
            String::from_utf8_lossy(&bytes).into_owned()
        })
    });
    let show = || {
        let said = fraction.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(fraction) = said {
            watching.fraction(fraction);
        }
    };
    let (used, stopped) = wait(child, watching, &show)?;
    Ok(Finished {
        code: used.status.code(),
        events: events.and_then(|thread| thread.join().ok()).unwrap_or_default(),
        stderr: stderr.and_then(|thread| thread.join().ok()).unwrap_or_default(),
        cpu_seconds: (used.rusage.utime + used.rusage.stime).as_secs_f64(),
        peak_memory_bytes: used.rusage.maxrss,
        seconds: start.elapsed().as_secs_f64(),
        stopped,
    })
}

fn spawn(command: &[String]) -> io::Result<Child> {
    let (program, arguments) = command
        .split_first()
        .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "no program"))?;
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    // In a group of its own: Ctrl-C in the terminal reaches it through us alone.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    command.spawn()
}

fn read_events(out: impl Read, fraction: &Mutex<Option<f64>>) -> Vec<Value> {
    let mut events = Vec::new();
    for line in BufReader::new(out).lines().map_while(Result::ok) {
        let Ok(event) = serde_json::from_str::<Value>(&line) else { continue };
        if event["event"] == "progress" {
            let share = event["fraction"].as_f64();
            *fraction.lock().unwrap_or_else(PoisonError::into_inner) = share;
        } else {
            events.push(event);
        }
    }
    events
}

fn wait(mut child: Child, watching: &dyn Watching, show: &dyn Fn()) -> io::Result<(ResUse, bool)> {
    let mut asked: Option<Instant> = None;
    loop {
        if let Some(used) = child.try_wait4()? {
            return Ok((used, asked.is_some()));
        }
        show();
        match asked {
            None if watching.cancelled() => {
                ask_to_stop(&mut child);
                asked = Some(Instant::now());
            }
            Some(since) if since.elapsed() > GRACE => {
                // One that cannot be killed ends by itself.
                let _ = child.kill();
            }
            _ => {}
        }
        thread::sleep(PERIOD);
    }
}

#[cfg(unix)]
fn ask_to_stop(child: &mut Child) {
    use rustix::process::{Pid, Signal, kill_process_group};
    let pid = i32::try_from(child.id()).ok().and_then(Pid::from_raw);
    // It may have ended in the meantime.
    let _ = pid.map(|pid| kill_process_group(pid, Signal::TERM));
}

#[cfg(not(unix))]
fn ask_to_stop(child: &mut Child) {
    let _ = child.kill();
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    struct Stop(Duration, Instant);

    impl Watching for Stop {
        fn cancelled(&self) -> bool {
            self.1.elapsed() > self.0
        }
    }

    fn shell(script: &str, stop: Duration) -> Finished {
        let command = ["sh", "-c", script].map(str::to_owned);
        run(&command, &Stop(stop, Instant::now())).expect("a shell")
    }

    const NEVER: Duration = Duration::from_secs(600);

    #[test]
    fn events_messages_and_codes_arrive() {
        let script = "echo '{\"event\":\"result\",\"spp\":4}'; echo noise; \
                      echo 'error: it is bad' >&2; exit 3";
        let found = shell(script, NEVER);
        assert_eq!(found.code, Some(3));
        assert_eq!(found.event("result").expect("said")["spp"], 4);
        assert_eq!(found.message(), "it is bad");
        assert!(!found.stopped && found.peak_memory_bytes > 0);
        let killed = shell("kill -9 $$", NEVER);
        assert_eq!(killed.code, None);
        assert!(killed.message().contains("killed"), "{}", killed.message());
    }

    #[test]
    fn processor_time_is_counted() {
        let busy = shell("i=0; while [ $i -lt 200000 ]; do i=$((i+1)); done", NEVER);
        let idle = shell("true", NEVER);
        assert!(busy.cpu_seconds > idle.cpu_seconds, "{} {}", busy.cpu_seconds, idle.cpu_seconds);
    }

    #[test]
    fn a_process_and_its_children_are_asked_to_stop() {
        let found = shell("trap 'exit 5' TERM; sleep 600 & wait", Duration::from_millis(300));
        assert!(found.stopped);
        assert_eq!(found.code, Some(5));
    }
}
