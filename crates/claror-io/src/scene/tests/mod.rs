//! Whole scenes from text.

mod forms;
mod mutations;
mod plugins;
mod sensors;

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use super::*;

/// Files in memory.
#[derive(Default)]
struct Memory(BTreeMap<PathBuf, Vec<u8>>);

impl Files for Memory {
    fn read(&self, path: &Path, max_bytes: u64) -> io::Result<Vec<u8>> {
        let bytes = self.0.get(path).ok_or(io::ErrorKind::NotFound)?;
        if bytes.len() as u64 > max_bytes {
            return Err(io::ErrorKind::FileTooLarge.into());
        }
        Ok(bytes.clone())
    }

    fn is_file(&self, path: &Path) -> bool {
        self.0.contains_key(path)
    }

    fn is_dir(&self, path: &Path) -> bool {
        self.0.keys().any(|file| file.starts_with(path) && file != path)
    }

    fn list(&self, folder: &Path) -> Vec<String> {
        let inside = self.0.keys().filter(|file| file.parent() == Some(folder));
        inside.filter_map(|file| Some(file.file_name()?.to_string_lossy().into_owned())).collect()
    }
}

/// Reads files in memory, the first of which is the scene.
fn load_memory(
    files: &[(&str, &str)],
    options: &LoadOptions,
) -> Result<LoadedScene, Vec<Diagnostic>> {
    let entry = |(name, text): &(&str, &str)| (PathBuf::from(name), text.as_bytes().to_vec());
    load_from(&Memory(files.iter().map(entry).collect()), Path::new(files[0].0), options)
}

/// A scene of that version with a camera and this content; it must load without a word.
fn scene_of(version: &str, body: &str) -> LoadedScene {
    let camera = "<sensor type=\"perspective\"/>";
    let text = format!("<scene version=\"{version}\">{body}{camera}</scene>");
    let loaded = match load_memory(&[("scene.xml", &text)], &LoadOptions::default()) {
        Ok(loaded) => loaded,
        Err(diagnostics) => panic!("{}", text_of(&diagnostics)),
    };
    assert!(loaded.warnings.is_empty(), "{}", text_of(&loaded.warnings));
    loaded
}

/// A scene of version 3 with a camera and this content.
fn scene(body: &str) -> LoadedScene {
    scene_of("3.0.0", body)
}

fn text_of(diagnostics: &[Diagnostic]) -> String {
    diagnostics.iter().map(|d| format!("{d}\n")).collect()
}

/// The scenes that come with the reference pictures, if they are there.
fn reference_scenes() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/scenes");
    let folder = std::env::var_os("CLAROR_REFERENCE_SCENES").map_or(beside, PathBuf::from);
    folder.is_dir().then_some(folder)
}

fn scenes_below(folder: &Path, found: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for path in entries.filter_map(|e| e.ok()).map(|e| e.path()) {
        if path.is_dir() {
            scenes_below(&path, found);
        } else if path.extension().is_some_and(|e| e == "xml") {
            found.push(path);
        }
    }
}

fn all_load(folder: &Path) -> usize {
    let mut scenes = Vec::new();
    scenes_below(folder, &mut scenes);
    scenes.sort();
    let mut bad = Vec::new();
    for scene in &scenes {
        match load(scene, &LoadOptions::default()) {
            // Triangles without area are in the best of meshes.
            Ok(loaded) => bad.extend(
                loaded.warnings.into_iter().filter(|w| !w.message.ends_with("have no area")),
            ),
            Err(diagnostics) => bad.extend(diagnostics),
        }
    }
    assert!(bad.is_empty(), "{}", text_of(&bad));
    scenes.len()
}

#[test]
fn reference_scenes_load_without_a_word() {
    match reference_scenes() {
        Some(folder) => assert!(all_load(&folder) > 10),
        None => println!("skipped: no reference scenes (set CLAROR_REFERENCE_SCENES)"),
    }
}

#[test]
fn our_scenes_load_without_a_word() {
    assert!(all_load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes")) > 3);
}
