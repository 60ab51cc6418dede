//! Scene files with includes and spectra, in memory: `cargo +nightly fuzz run scene_xml -- \
//! -dict=dictionaries/scene_xml.txt`. No input may panic, hang or take much memory.

#![no_main]

use std::io;
use std::path::Path;

use claror_io::Limits;
use claror_io::scene::{Files, LoadOptions, load_from};
use libfuzzer_sys::fuzz_target;

/// A scene and one other file, which goes by several names.
struct Two<'a> {
    scene: &'a [u8],
    other: &'a [u8],
}

impl Two<'_> {
    fn get(&self, path: &Path) -> Option<&[u8]> {
        match path.to_str()? {
            "scene.xml" => Some(self.scene),
            "b.xml" | "a.spd" => Some(self.other),
            _ => None,
        }
    }
}

impl Files for Two<'_> {
    fn read(&self, path: &Path, max_bytes: u64) -> io::Result<Vec<u8>> {
        let bytes = self.get(path).ok_or(io::ErrorKind::NotFound)?;
        if bytes.len() as u64 > max_bytes {
            return Err(io::ErrorKind::FileTooLarge.into());
        }
        Ok(bytes.to_vec())
    }

    fn is_file(&self, path: &Path) -> bool {
        self.get(path).is_some()
    }

    fn is_dir(&self, path: &Path) -> bool {
        path == Path::new("folder")
    }

    fn list(&self, _folder: &Path) -> Vec<String> {
        vec!["scene.xml".to_owned(), "b.xml".to_owned()]
    }
}

/// What stands between the two files of an input.
const SEPARATOR: &[u8] = b"\n=====\n";

fuzz_target!(|data: &[u8]| {
    let cut = data.windows(SEPARATOR.len()).position(|w| w == SEPARATOR);
    let (scene, other) = match cut {
        Some(i) => (&data[..i], &data[i + SEPARATOR.len()..]),
        None => (data, &b""[..]),
    };
    let limits = Limits { max_scene_bytes: 1 << 20, ..Limits::default() };
    let options = LoadOptions {
        defines: vec![("spp".to_owned(), "4".to_owned())],
        lenient: data.len() % 2 == 1,
        limits,
    };
    match load_from(&Two { scene, other }, Path::new("scene.xml"), &options) {
        Ok(loaded) => assert_eq!(loaded.shape_names.len(), loaded.tables.shapes.shapes.len()),
        Err(diagnostics) => {
            assert!(!diagnostics.is_empty());
            for diagnostic in diagnostics {
                assert!(!diagnostic.to_string().is_empty());
            }
        }
    }
});
