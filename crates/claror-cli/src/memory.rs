//! How much memory there is, and how much a render will need: refusing at once is better than
//! being killed later.

use claror::film::PixelSums;
use claror::scene::SceneTables;
use claror::sensor::Sensor;

use crate::exit::{Exit, Failure};
use crate::units;

/// Bytes per triangle of the hierarchy while it is built: more than it has in the end.
const BUILD_BYTES_PER_TRIANGLE: u64 = 200;
/// Channels of a picture besides its further layers: beauty, four parts, variance, samples.
const PICTURE_CHANNELS: u64 = 4 + 4 * 3 + 3 + 1;

/// What a render needs besides the scene's tables, bytes.
pub(crate) fn film_bytes(sensor: &Sensor, aov_channels: usize, checkpoint: bool) -> u64 {
    let pixels = u64::from(sensor.film.crop.width).saturating_mul(sensor.film.crop.height.into());
    let sums = size_of::<PixelSums>() as u64 + 8 * aov_channels as u64;
    let picture = 4 * (PICTURE_CHANNELS + aov_channels as u64);
    // A checkpoint and a file are put together in memory before they are written.
    let copies = if checkpoint { sums + picture } else { picture };
    pixels.saturating_mul(sums + picture + copies)
}

/// What the hierarchy over the geometry needs while it is built, bytes.
pub(crate) fn build_bytes(tables: &SceneTables) -> u64 {
    let triangles: u64 = tables.shapes.meshes.iter().map(|m| m.triangles.len() as u64).sum();
    let others = (tables.shapes.shapes.len() + tables.shapes.instances.len()) as u64;
    (triangles + others) * BUILD_BYTES_PER_TRIANGLE
}

/// What the tables hold, bytes.
pub(crate) fn table_bytes(tables: &SceneTables) -> u64 {
    let mesh = |mesh: &claror::shape::Mesh| {
        let attributes: usize = mesh.attributes.iter().map(|a| size_of_val(&a.data[..])).sum();
        size_of_val(&mesh.positions[..])
            + size_of_val(&mesh.normals[..])
            + size_of_val(&mesh.uvs[..])
            + size_of_val(&mesh.triangles[..])
            + attributes
    };
    let meshes: usize = tables.shapes.meshes.iter().map(mesh).sum();
    let images: usize = tables.textures.images.iter().map(|i| size_of_val(&i.data[..])).sum();
    let records = size_of_val(&tables.shapes.shapes[..])
        + size_of_val(&tables.shapes.instances[..])
        + size_of_val(&tables.bsdfs.bsdfs[..])
        + size_of_val(&tables.textures.textures[..])
        + size_of_val(&tables.emitters.emitters[..]);
    (meshes + images + records) as u64
}

/// Fails if `needed` bytes for `purpose` are more than `limit`, or than what is available.
pub(crate) fn check(needed: u64, purpose: &str, limit: Option<u64>) -> Result<(), Failure> {
    let (bound, origin) = match (limit, available()) {
        (Some(limit), _) => (limit, "allowed"),
        (None, Some(available)) => (available, "available"),
        (None, None) => return Ok(()),
    };
    if needed <= bound {
        return Ok(());
    }
    let (needed, bound) = (units::bytes(needed), units::bytes(bound));
    let message = format!("{purpose} would need {needed} of memory; {bound} are {origin}");
    Err(Failure::new(Exit::Memory, message).hint("--max-memory sets another limit"))
}

/// Memory that can be had without swapping, as Linux tells it: for the machine and for the
/// control group that the program runs in.
fn available() -> Option<u64> {
    let machine = std::fs::read_to_string("/proc/meminfo").ok().and_then(|t| mem_available(&t));
    let number = |file: &str| std::fs::read_to_string(file).ok()?.trim().parse::<u64>().ok();
    let group = number("/sys/fs/cgroup/memory.max")
        .map(|max| max.saturating_sub(number("/sys/fs/cgroup/memory.current").unwrap_or(0)));
    match (machine, group) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    }
}

/// Most memory that the program has held so far, bytes, as Linux tells it. Unlike what a parent
/// process learns it does not count what that parent held when it started the program.
pub(crate) fn peak() -> Option<u64> {
    std::fs::read_to_string("/proc/self/status").ok().and_then(|t| kibibytes(&t, "VmHWM:"))
}

fn mem_available(meminfo: &str) -> Option<u64> {
    kibibytes(meminfo, "MemAvailable:")
}

/// The number of bytes in the line that starts with `name`.
fn kibibytes(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.trim().strip_suffix(" kB")?.trim().parse::<u64>().ok().map(|kib| kib << 10)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn available_memory_is_read() {
        let text = "MemTotal:       16384 kB\nMemFree: 1 kB\nMemAvailable:    2048 kB\n";
        assert_eq!(mem_available(text), Some(2048 << 10));
        assert_eq!(mem_available("MemTotal: 1 kB"), None);
    }

    #[test]
    fn too_much_is_refused() {
        let failure = check(2000, "this film", Some(1000)).expect_err("more than allowed");
        assert_eq!(failure.exit, Exit::Memory);
        check(1000, "this film", Some(1000)).expect("just allowed");
        assert!(check(u64::MAX, "this film", None).is_err() || available().is_none());
    }
}
