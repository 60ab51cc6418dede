//! Radiance HDR pictures, in memory: `cargo +nightly fuzz run hdr fuzz/seeds/hdr`. No input may panic, hang
//! or take much memory.

#![no_main]

use std::path::Path;

use claror_io::Limits;
use claror_io::image::decode;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    // Other formats have their own targets.
    if !data.starts_with(&*b"#?") {
        return;
    }
    let limits = Limits { max_image_pixels: 1 << 22, ..Limits::default() };
    if let Ok(decoded) = decode(data, Path::new("t"), None, &limits) {
        let image = decoded.image;
        assert!((1..=4).contains(&image.channels));
        assert_eq!(image.data.len(), image.width * image.height * image.channels);
    }
});
