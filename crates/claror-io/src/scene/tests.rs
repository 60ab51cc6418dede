//! Whole scenes from text.

use std::path::{Path, PathBuf};

use super::*;

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
    let text: Vec<String> = bad.iter().map(ToString::to_string).collect();
    assert!(bad.is_empty(), "{}", text.join("\n"));
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
