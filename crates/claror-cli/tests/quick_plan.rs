//! The quick plan on a shipped scene, and its report in a browser.

#![allow(clippy::unwrap_used, reason = "tests only")]

#[path = "../../claror-lab/tests/browser/mod.rs"]
#[allow(dead_code, reason = "the tests of the report use all of it")]
mod browser;

use std::path::Path;
use std::process::Command;

use browser::Browser;
use serde_json::{Value, json};

/// What the README tells newcomers to try.
#[test]
fn the_quick_plan_makes_a_report_that_opens() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("report");
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/thesis-box.xml");
    let run = Command::new(env!("CARGO_BIN_EXE_claror"))
        .arg("bench")
        .arg(&scene)
        .args(["--plan", "quick", "--json", "--out"])
        .arg(&out)
        .arg("--references")
        .arg(folder.path().join("references"))
        .output()
        .unwrap();
    let told = String::from_utf8_lossy(&run.stdout);
    assert_eq!(run.status.code(), Some(0), "{told}");

    let study: Value =
        serde_json::from_slice(&std::fs::read(out.join("study.json")).unwrap()).unwrap();
    let series = study["scenes"][0]["series"].as_array().unwrap();
    assert!(series.len() >= 3);
    for setting in series.iter().flat_map(|s| s["settings"].as_array().unwrap()) {
        assert_eq!(setting["failures"], json!([]), "{setting}");
        assert!(setting["summary"]["rel_mse"]["median"].as_f64().unwrap().is_finite());
    }
    opens_in_a_browser(&out.join("report.html"), series.len());
}

fn opens_in_a_browser(page: &Path, series: usize) {
    let Some(program) = browser::find() else { return };
    let mut browser = Browser::start(&program);
    browser.open(page, 1280, 900, false);
    let count = |browser: &mut Browser, what: &str| {
        let found = browser.value(&format!("document.querySelectorAll({what:?}).length"));
        found.as_u64().unwrap() as usize
    };
    // Time and error of every series, drawn.
    assert!(count(&mut browser, "figure.chart .live svg .mark-symbol.role-mark path") > 3 * series);
    assert_eq!(count(&mut browser, ".comparer canvas"), 1);
    assert!(count(&mut browser, "img") > 0);
    browser.screenshot("quick", true);
    browser.expect_nothing_asked_or_complained();
}
