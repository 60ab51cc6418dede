//! The computer: what it is and how busy it is.

use crate::study::Machine;

/// What can be known of this computer.
pub(crate) fn machine(threads: usize) -> Machine {
    Machine {
        processor: processor().unwrap_or_else(|| std::env::consts::ARCH.to_owned()),
        cores: cores(),
        threads,
        memory_bytes: memory().unwrap_or(0),
        system: system(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        build: if cfg!(debug_assertions) { "debug" } else { "optimised" }.to_owned(),
    }
}

/// Processors that the system runs at once.
pub(crate) fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
}

/// Mean number of processes that ran or waited in the last minute; 0 where it cannot be known.
pub(crate) fn load() -> f64 {
    let text = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    text.split_whitespace().next().and_then(|first| first.parse().ok()).unwrap_or(0.0)
}

/// The value of the first line `name<separator>value` of a file.
fn field(file: &str, name: &str, separator: char) -> Option<String> {
    let text = std::fs::read_to_string(file).ok()?;
    let pairs = text.lines().filter_map(|line| line.split_once(separator));
    let mut values = pairs.filter(|(key, _)| key.trim() == name).map(|(_, value)| value.trim());
    values.next().map(|value| value.trim_matches('"').to_owned())
}

fn processor() -> Option<String> {
    field("/proc/cpuinfo", "model name", ':')
}

fn memory() -> Option<u64> {
    let text = field("/proc/meminfo", "MemTotal", ':')?;
    let kilobytes: u64 = text.split_whitespace().next()?.parse().ok()?;
    Some(kilobytes * 1024)
}

fn system() -> String {
    let name = field("/etc/os-release", "PRETTY_NAME", '=');
    let name = name.unwrap_or_else(|| std::env::consts::OS.to_owned());
    match std::fs::read_to_string("/proc/sys/kernel/osrelease") {
        Ok(kernel) => format!("{name}, kernel {}", kernel.trim()),
        Err(_) => name,
    }
}
