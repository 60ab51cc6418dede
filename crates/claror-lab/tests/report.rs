//! The report of a made-up study: its files, and the page in a browser.

#![allow(clippy::unwrap_used, reason = "tests only")]

mod browser;
mod fixture;

use std::fs;
use std::path::PathBuf;

use browser::Browser;
use serde_json::json;

fn written() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let study = fixture::build(folder.path());
    let path = claror_lab::report::write(&study, folder.path()).unwrap();
    (folder, path)
}

#[test]
fn nothing_of_a_hostile_name_becomes_markup() {
    let (folder, path) = written();
    let page = fs::read_to_string(&path).unwrap();
    assert!(!page.contains(fixture::HOSTILE));
    assert!(!page.contains("<img src=x"));
    assert!(page.contains("&lt;script&gt;&quot;&amp;"));
    // The plan holds the end of a script.
    assert!(page.contains("title = &quot;&lt;/script&gt;&quot;"));
    let charts = fs::read_dir(folder.path().join("charts")).unwrap();
    for chart in charts {
        let path = chart.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        let tame = |c: char| c.is_ascii_alphanumeric() || "-.".contains(c);
        assert!(name.chars().all(tame), "{name}");
        let text = fs::read_to_string(&path).unwrap();
        assert!(name.ends_with(".csv") || !text.contains("<img"), "{name}");
        assert!(!text.contains("NaN") && !text.contains("inf"), "{name}");
    }
}

#[test]
fn what_cannot_be_shown_is_said() {
    let (_folder, path) = written();
    let page = fs::read_to_string(&path).unwrap();
    assert!(page.contains("Irradiance caching, error=0.02: relMSE is 0 or less"));
    assert!(page.contains("exit code 5, not enough memory"));
    assert!(page.contains("No run of this setting finished."));
    assert!(page.contains("runs/nowhere.exr: there is no such file"));
    assert!(page.contains("≤ 0.05") && page.contains("&gt; 2.00"));
    for odd in ["\"NaN\"", ">NaN", ">inf", "\"inf\""] {
        assert!(!markup(&page).contains(odd), "{odd}");
    }
}

/// The page without its scripts and data.
fn markup(page: &str) -> String {
    let mut parts = page.split("<script");
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |all, part| all + part.split_once("</script>").map_or("", |p| p.1))
}

#[test]
fn the_same_study_gives_the_same_page() {
    let (folder, path) = written();
    let first = fs::read(&path).unwrap();
    claror_lab::report::write(&fixture::build(folder.path()), folder.path()).unwrap();
    assert!(fs::read(&path).unwrap() == first);
}

#[test]
fn a_folder_that_cannot_be_written_is_an_error_with_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let study = fixture::build(folder.path());
    fs::write(folder.path().join("charts"), "in the way").unwrap();
    let error = claror_lab::report::write(&study, folder.path()).unwrap_err();
    assert!(error.to_string().contains("charts"), "{error}");
    assert!(!folder.path().join("report.html").exists());
}

#[test]
fn the_page_works_in_a_browser() {
    let Some(program) = browser::find() else { return };
    let (_folder, path) = written();
    let mut browser = Browser::start(&program);
    browser.open(&path, 1280, 900, false);
    charts_are_drawn(&mut browser);
    pictures_have_alternatives(&mut browser);
    comparer_works(&mut browser);
    tables_sort(&mut browser);
    themes(&mut browser, &path);
    phone(&mut browser, &path);
    browser.expect_nothing_asked_or_complained();
}

fn charts_are_drawn(browser: &mut Browser) {
    browser.screenshot("light", true);
    let figures = browser.value("document.querySelectorAll('figure.chart').length");
    assert!(figures.as_u64().unwrap() >= 10, "{figures}");
    // Every chart has as many marks as the data that it names, in both forms.
    let counts = browser.value(
        "(() => {
            const charts = JSON.parse(document.getElementById('chart-data').textContent);
            return [...document.querySelectorAll('figure.chart')].map((figure, i) => [
                charts[i].lines.reduce((n, l) => n + l.marks.length, 0),
                [...figure.querySelectorAll('.live svg .mark-symbol.role-mark')].at(-1).querySelectorAll('path').length,
                figure.querySelectorAll('.static path.mark').length,
            ]);
        })()",
    );
    for count in counts.as_array().unwrap() {
        let count = count.as_array().unwrap();
        assert!(count[0].as_u64().unwrap() > 0);
        assert!(count[1] == count[0] && count[2] == count[0], "{counts}");
    }
    tooltip_tells(browser);
    assert!(browser.print("print") > 10_000);
}

/// Median, range, seeds and command of the mark under the pointer.
fn tooltip_tells(browser: &mut Browser) {
    let place = browser.value(
        "(() => {
            const figure = document.getElementById('chart-1-thesis-box-relmse-time');
            figure.scrollIntoView({ behavior: 'instant', block: 'center' });
            const box = [...figure.querySelectorAll('.live svg .mark-symbol.role-mark')].at(-1).querySelector('path').getBoundingClientRect();
            return [box.left + box.width / 2, box.top + box.height / 2];
        })()",
    );
    browser.hover(place[0].as_f64().unwrap(), place[1].as_f64().unwrap());
    browser.wait_for("document.querySelector('#vg-tooltip-element.visible') !== null");
    let text = browser.value("document.getElementById('vg-tooltip-element').textContent");
    for part in ["Path tracing", "1 spp", "1, 2, 3", "claror render", "relMSE", "["] {
        assert!(text.as_str().unwrap().contains(part), "{part} in {text}");
    }
    browser.screenshot("tooltip", false);
    browser.hover(1.0, 1.0);
}

fn pictures_have_alternatives(browser: &mut Browser) {
    let without = "[...document.images].filter(i => !i.alt.trim()).length";
    assert_eq!(browser.value(without), json!(0));
    assert!(browser.value("document.images.length").as_u64().unwrap() >= 20);
    assert_eq!(browser.value("document.querySelectorAll('img[src=x]').length"), json!(0));
    // Unnamed controls, unlabelled tables, repeated ids.
    let nameless = "[...document.querySelectorAll('button, select, input')].filter(e => !e.textContent.trim() && !e.ariaLabel && !e.closest('label')).length";
    assert_eq!(browser.value(nameless), json!(0));
    assert_eq!(
        browser.value("document.querySelectorAll('main table:not(:has(caption))').length"),
        json!(0)
    );
    let repeated = "(() => { const ids = [...document.querySelectorAll('body > :not(script) [id]')].filter(e => !e.closest('.live')).map(e => e.id); return ids.length - new Set(ids).size; })()";
    assert_eq!(browser.value(repeated), json!(0));
    let dangling = "[...document.querySelectorAll('a[href^=\"#\"]')].filter(a => !a.closest('.live') && !document.getElementById(decodeURIComponent(a.hash.slice(1)))).map(a => a.hash)";
    assert_eq!(browser.value(dangling), json!([]));
}

/// The pixels of the first comparer, as a sum that changes with any of them.
fn pixels(browser: &mut Browser) -> i64 {
    let sum = "(() => {
        const canvas = document.querySelector('.comparer canvas');
        const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext('2d', { willReadFrequently: true });
        copy.drawImage(canvas, 0, 0);
        const { data } = copy.getImageData(0, 0, canvas.width, canvas.height);
        let hash = 0;
        for (const v of data) hash = (hash * 31 + v) | 0;
        return hash;
    })()";
    browser.value(sum).as_i64().unwrap()
}

fn comparer_works(browser: &mut Browser) {
    browser.value("document.querySelector('.comparer').scrollIntoView({ behavior: 'instant' }); document.querySelector('.comparer canvas').focus()");
    browser.screenshot("comparer-wipe", false);
    let mut seen = vec![("wipe", pixels(browser))];
    for key in ["ArrowRight", "1", "2", "3", "d", "f", "w"] {
        browser.key(key);
        let now = pixels(browser);
        // The wipe stands where the arrow left it.
        let again = if key == "w" { Some("ArrowRight") } else { None };
        for (name, before) in &seen {
            assert_eq!(now == *before, again == Some(*name), "{key} after {name}");
        }
        seen.push((key, now));
        browser.screenshot(&format!("comparer-{key}"), false);
    }
    browser.key("1");
    let a = pixels(browser);
    browser.key(" ");
    let b = pixels(browser);
    browser.key(" ");
    assert!(a != b && pixels(browser) == a, "space flips between A and B");
    browser.key("]");
    let brighter = pixels(browser);
    browser.key("[");
    assert!(brighter != a && pixels(browser) == a, "exposure goes up and down");
    browser.key("+");
    let zoomed = pixels(browser);
    browser.key("ArrowUp");
    assert!(zoomed != a && pixels(browser) != zoomed, "zoom and pan");
    browser.key("0");
    assert_eq!(pixels(browser), a);
    wipe_is_dragged(browser);
    examine_chooses(browser);
}

fn wipe_is_dragged(browser: &mut Browser) {
    browser.key("w");
    let before = pixels(browser);
    let place = browser.value(
        "(() => { const b = document.querySelector('.comparer canvas').getBoundingClientRect(); return [b.left, b.top, b.width, b.height]; })()",
    );
    let [left, top, width, height] = [0, 1, 2, 3].map(|i| place[i].as_f64().unwrap());
    // One arrow moved it from 1/2 to 0.52 of the picture, which fills the height.
    let shown = height * fixture::SIZE[0] as f64 / fixture::SIZE[1] as f64;
    let line = left + width / 2.0 + 0.02 * shown.min(width);
    let y = top + height / 3.0;
    browser.mouse("mousePressed", line, y);
    browser.mouse("mouseMoved", line - 100.0, y);
    browser.mouse("mouseReleased", line - 100.0, y);
    assert_ne!(pixels(browser), before, "the line follows the pointer");
    let told = browser.value("document.querySelector('.comparer .pixel').textContent");
    let told = told.as_str().unwrap();
    let mut lines = told.lines();
    let place: Vec<usize> = numbers(lines.next().unwrap()).iter().map(|&v| v as usize).collect();
    // The reference's half floats are those of the files.
    let r = numbers(lines.last().unwrap());
    let wanted = fixture::reference_pixel(place[0], place[1]);
    for (r, wanted) in r.iter().zip(wanted) {
        let step = 2f64.powi(-11) * f64::from(wanted) + 1e-4;
        assert!((r - f64::from(wanted)).abs() <= step, "{told} {wanted:?}");
    }
}

fn numbers(line: &str) -> Vec<f64> {
    line.split([' ', ',']).filter_map(|word| word.parse().ok()).collect()
}

fn examine_chooses(browser: &mut Browser) {
    let chosen = browser.value(
        "(() => { document.querySelector('.to-comparer').click(); const [a, b] = document.querySelector('.comparer').querySelectorAll('select'); return [a.value, b.value]; })()",
    );
    assert_eq!(chosen, json!(["0-2", "reference"]));
}

fn tables_sort(browser: &mut Browser) {
    let column = |browser: &mut Browser| {
        let values = browser.value("[...document.querySelector('table.sortable').tBodies[0].rows].map(r => Number(r.cells[8].dataset.value))");
        values.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect::<Vec<f64>>()
    };
    browser.value("document.querySelectorAll('table.sortable th button')[8].click()");
    let up = column(browser);
    assert!(up.is_sorted(), "{up:?}");
    browser.value("document.querySelectorAll('table.sortable th button')[8].click()");
    let down = column(browser);
    assert!(down.iter().rev().is_sorted(), "{down:?}");
    let state = "document.querySelectorAll('table.sortable th')[8].ariaSort";
    assert_eq!(browser.value(state), json!("descending"));
}

/// Contrast of the theme's colours with the page, WCAG 2.
const CONTRASTS: &str = "(() => {
    const probe = document.createElement('span');
    document.body.append(probe);
    const luminance = (name) => {
        probe.style.color = `var(${name})`;
        const linear = getComputedStyle(probe).color.match(/[\\d.]+/g).slice(0, 3).map((v) => {
            const c = v / 255;
            return c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
        });
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
    };
    const contrast = (a, b) => {
        const [x, y] = [luminance(a), luminance(b)].sort((p, q) => q - p);
        return (x + 0.05) / (y + 0.05);
    };
    const out = {};
    for (const back of ['--paper', '--raised', '--warning']) {
        for (const text of ['--ink', '--muted', '--link', '--bad']) out[`${text} on ${back}`] = contrast(text, back);
    }
    for (let i = 0; i < 6; i++) out[`--series-${i}`] = contrast(`--series-${i}`, '--paper');
    out['--focus'] = contrast('--focus', '--paper');
    probe.remove();
    return out;
})()";

fn themes(browser: &mut Browser, path: &std::path::Path) {
    let check = |browser: &mut Browser| {
        let contrasts = browser.value(CONTRASTS);
        for (what, ratio) in contrasts.as_object().unwrap() {
            assert!(ratio.as_f64().unwrap() >= 4.5, "{what}: {ratio}");
        }
    };
    let background = "getComputedStyle(document.body).backgroundColor";
    let light = browser.value(background);
    check(browser);
    browser.open(path, 1280, 900, true);
    let dark = browser.value(background);
    assert_ne!(light, dark);
    check(browser);
    let ink = "document.querySelector('.live svg text').getAttribute('fill')";
    let dark_ink = browser.value(ink);
    browser.screenshot("dark", true);
    // system → light, whatever the system says.
    browser.value(
        "delete document.documentElement.dataset.charts; document.getElementById('theme').click()",
    );
    browser.wait_for("document.documentElement.dataset.charts === 'drawn'");
    assert_eq!(browser.value(background), light);
    assert_ne!(browser.value(ink), dark_ink, "charts follow the theme");
    browser.value("localStorage.clear()");
}

fn phone(browser: &mut Browser, path: &std::path::Path) {
    browser.open(path, 360, 740, false);
    let overflow = "document.documentElement.scrollWidth - document.documentElement.clientWidth";
    browser.screenshot("phone", true);
    assert_eq!(browser.value(overflow), json!(0));
    // Tab order begins with the skip link, which then shows itself.
    browser.value("document.activeElement.blur(); scrollTo(0, 0)");
    browser.call(
        "Input.dispatchKeyEvent",
        json!({"type": "keyDown", "key": "Tab", "code": "Tab", "windowsVirtualKeyCode": 9}),
    );
    assert_eq!(browser.value("document.activeElement.className"), json!("skip"));
    assert_eq!(
        browser.value("document.activeElement.getBoundingClientRect().left >= 0"),
        json!(true)
    );
}
