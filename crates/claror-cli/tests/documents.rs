//! The documents speak of files that exist.

use std::path::Path;

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

/// What stands between backquotes in `text`.
fn quoted(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

#[test]
fn every_file_that_the_architecture_names_exists() {
    let text = std::fs::read_to_string(root().join("ARCHITECTURE.md")).expect("ARCHITECTURE.md");
    let named: Vec<&str> = quoted(&text).filter(|q| q.starts_with("crates/")).collect();
    assert!(named.len() > 10, "the path of a pixel names its files");
    let missing: Vec<&&str> = named.iter().filter(|p| !root().join(p).exists()).collect();
    assert!(missing.is_empty(), "ARCHITECTURE.md names what does not exist: {missing:?}");
}

#[test]
fn every_scene_and_document_that_the_readme_names_exists() {
    let text = std::fs::read_to_string(root().join("README.md")).expect("README.md");
    let scenes = quoted(&text).filter(|q| q.ends_with(".xml") && !q.contains(' '));
    let missing: Vec<&str> = scenes.filter(|s| !root().join("scenes").join(s).exists()).collect();
    assert!(missing.is_empty(), "README.md names scenes that do not exist: {missing:?}");
    for link in text.split("](").skip(1).filter_map(|l| l.split(')').next()) {
        let is_file = !link.starts_with("http");
        assert!(!is_file || root().join(link).exists(), "README.md links to {link}");
    }
}
