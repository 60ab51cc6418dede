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

/// What the scene files' page says of integrators follows the tables of their parameters.
#[test]
fn every_parameter_of_the_cache_is_documented() {
    let cache = claror::integrator::CACHE_PARAMETERS.iter().map(|parameter| parameter.name);
    let grid = claror::integrator::GRID_PARAMETERS.iter().map(|parameter| parameter.name);
    let tables = [("irrcache", cache.collect::<Vec<_>>()), ("gridcache", grid.collect())];
    let text = std::fs::read_to_string(root().join("docs/scene-files.md")).expect("scene-files.md");
    for (integrator, known) in tables {
        let heading = format!("\n## `{integrator}`");
        let (_, section) = text.split_once(&heading).expect("a section about it");
        let section = section.split("\n## ").next().expect("its text");
        let rows = section.lines().filter(|line| line.starts_with("| `"));
        let named: Vec<&str> =
            rows.flat_map(|row| quoted(row.split('|').nth(1).unwrap_or(""))).collect();
        let missing: Vec<&&str> = known.iter().filter(|name| !named.contains(name)).collect();
        assert!(missing.is_empty(), "docs/scene-files.md lacks {missing:?}");
        let made_up: Vec<&&str> = named.iter().filter(|name| !known.contains(name)).collect();
        assert!(made_up.is_empty(), "docs/scene-files.md makes up {made_up:?}");
    }
}

#[test]
fn every_name_of_another_program_is_documented() {
    let file = root().join("docs/parameters-of-others.md");
    let text = std::fs::read_to_string(file).expect("parameters-of-others.md");
    let rows = text.lines().filter(|line| line.starts_with("| "));
    let named: Vec<&str> =
        rows.flat_map(|row| quoted(row.split('|').nth(2).unwrap_or(""))).collect();
    for alias in claror::integrator::CACHE_ALIASES {
        assert!(named.contains(&alias.name), "{} of {} is missing", alias.name, alias.system);
    }
    let known = |name: &&&str| claror::integrator::is_cache_parameter(name);
    assert!(named.iter().all(|name| known(&name)), "{named:?}");
}
