//! The records of an irradiance cache, in memory: `cargo +nightly fuzz run cache fuzz/seeds/cache`.
//! No input may panic, hang or take much memory; what is accepted can be looked up, and is written
//! as it was read.

#![no_main]

use claror::integrator::{CacheContents, IrrCacheSettings};
use claror::irradiance::Query;
use claror::math::Bounds3;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Ok(contents) = CacheContents::from_bytes(data) else { return };
    assert_eq!(contents.to_bytes(), data);
    let cache = contents.freeze(&IrrCacheSettings::default(), Bounds3::EMPTY);
    for record in cache.records.iter().take(8) {
        let n = record.normal;
        cache.lookup(&Query { p: record.position, n_smooth: n, n_shading: n });
    }
});
