//! The container of checkpoints and caches, in memory: `cargo +nightly fuzz run checkpoint fuzz/seeds/checkpoint`. No input may
//! panic, hang or take much memory. The checksums of the header are put right, or else hardly any
//! input would get past them.

#![no_main]

use std::path::Path;

use claror_io::container::{Kind, difference, from_bytes};
use libfuzzer_sys::fuzz_target;
use xxhash_rust::xxh3::xxh3_64;

fuzz_target!(|data: &[u8]| {
    let mut data = data.to_vec();
    if let Some(end) = data.windows(5).position(|w| w == b"\nend\t") {
        let hash = format!("{:016x}\n", xxh3_64(&data[..=end]));
        let at = (end + 5).min(data.len());
        let tail = data.len().min(at + hash.len());
        data.splice(at..tail, hash.bytes());
    }
    if let Ok(container) = from_bytes(&data, Kind::Checkpoint, Path::new("t")) {
        assert_eq!(difference(&container.header, &container.header), None);
    }
});
