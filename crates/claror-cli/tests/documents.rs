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

/// All Markdown files below `folder`, sorted, as paths from the root.
fn pages(folder: &str) -> Vec<String> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(root().join(folder)).expect("a folder") {
        let entry = entry.expect("an entry");
        let name = format!("{folder}/{}", entry.file_name().to_string_lossy());
        if entry.path().is_dir() {
            found.extend(pages(&name));
        } else if name.ends_with(".md") {
            found.push(name.trim_start_matches("./").to_owned());
        }
    }
    found.sort();
    found
}

fn read(page: &str) -> String {
    std::fs::read_to_string(root().join(page)).expect(page)
}

/// A page without code and comments, in which nothing is a link.
fn prose(text: &str) -> String {
    let fenced = text.split("\n```").step_by(2).collect::<Vec<_>>().join("\n");
    let visible: Vec<&str> = fenced
        .split("<!--")
        .enumerate()
        .map(|(i, part)| if i == 0 { part } else { part.split_once("-->").map_or("", |p| p.1) })
        .collect();
    visible.concat().split('`').step_by(2).collect()
}

/// Where links and images lead.
fn links(text: &str) -> Vec<String> {
    let prose = prose(text);
    let markdown = prose.split("](").skip(1).filter_map(|l| l.split(')').next());
    let html = prose.split(" src=\"").skip(1).filter_map(|l| l.split('"').next());
    markdown.chain(html).map(|link| link.split(' ').next().unwrap_or("").to_owned()).collect()
}

/// What a heading is called in links.
fn anchor(heading: &str) -> String {
    let kept = heading.trim().chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.collect::<String>().to_lowercase().replace(' ', "-")
}

fn has_anchor(page: &str, wanted: &str) -> bool {
    let text = read(page);
    let outside = text.split("\n```").step_by(2).flat_map(str::lines);
    let mut headings = outside.filter(|l| l.starts_with('#')).map(|l| l.trim_start_matches('#'));
    headings.any(|heading| anchor(heading) == wanted)
}

/// What is wrong with a link of a page, if anything.
fn fault(page: &str, link: &str) -> Option<String> {
    if link.contains("://") || link.starts_with("mailto:") {
        return None;
    }
    let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
    let mut target = Path::new(page).parent().expect("a folder").to_path_buf();
    for part in Path::new(file).components() {
        match part {
            std::path::Component::ParentDir => drop(target.pop()),
            part => target.push(part),
        }
    }
    let target = if file.is_empty() { page.to_owned() } else { target.display().to_string() };
    let wrong = |what: &str| Some(format!("{page}: {link} {what}"));
    if !root().join(&target).exists() {
        return wrong("does not exist");
    }
    if page.starts_with("docs/") && !target.starts_with("docs/") {
        return wrong("leads out of the book");
    }
    if !anchor.is_empty() && !has_anchor(&target, anchor) {
        return wrong("names no heading");
    }
    None
}

#[test]
fn no_link_is_broken() {
    let at_root = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md"];
    let all = at_root.map(str::to_owned).into_iter().chain(pages("docs"));
    let faults: Vec<String> = all
        .flat_map(|page| links(&read(&page)).into_iter().filter_map(move |l| fault(&page, &l)))
        .collect();
    assert!(faults.is_empty(), "{faults:#?}");
}

#[test]
fn broken_links_are_found() {
    let text =
        "[a](b.md) `[no](c.md)` ![d](e.png)\n```\n[no](f.md)\n```\n<!-- [no](g.md) -->[h](i.md#j)";
    assert_eq!(links(text), ["b.md", "e.png", "i.md#j"]);
    for bad in ["nowhere.md", "verify.md#nowhere", "../README.md", "museum/none.png"] {
        assert!(fault("docs/README.md", bad).is_some(), "{bad}");
    }
    for good in ["verify.md", "verify.md#limits", "https://example.org"] {
        assert_eq!(fault("docs/README.md", good), None);
    }
}

#[test]
fn the_table_of_contents_has_every_page_once() {
    let listed = links(&read("docs/SUMMARY.md"));
    for page in pages("docs").iter().filter(|page| *page != "docs/SUMMARY.md") {
        let page = page.trim_start_matches("docs/");
        let times = listed.iter().filter(|link| *link == page).count();
        assert_eq!(times, 1, "docs/SUMMARY.md lists {page} {times} times");
    }
}

/// Pages that the program writes are as it writes them now.
#[test]
fn written_pages_are_up_to_date() {
    for (page, command) in [("docs/parameters.md", "parameters"), ("docs/command-line.md", "man")] {
        let run = std::process::Command::new(env!("CARGO_BIN_EXE_claror"))
            .args([command, "--markdown"])
            .output()
            .expect("the program runs");
        let now = String::from_utf8(run.stdout).expect("UTF-8");
        assert!(
            now == read(page),
            "{page} is out of date: cargo run -p claror-cli -- {command} --markdown > {page}"
        );
    }
}
