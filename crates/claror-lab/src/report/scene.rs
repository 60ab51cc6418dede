//! The section of one scene.

use maud::{Markup, PreEscaped, html};

use super::chart::Chart;
use super::number::rich;
use super::pictures::is_shown_in_steps;
use super::{Scene, chart_file, command_line, findings, number, page, strips, svg, tables};
use crate::study::TimeToError;

/// Everything about one scene.
pub(super) fn section(scene: &Scene<'_>) -> Markup {
    let study = scene.study;
    html! {
        section.scene id=(scene.slug) aria-labelledby={(scene.slug) "-title"} {
            h2 id={(scene.slug) "-title"} { "Scene " (study.name) }
            (facts(scene))
            (notes(scene))
            (charts(scene))
            (equal_error(scene))
            (strips::equal_time(scene))
            (strips::comparer(scene))
            @for (index, series) in study.series.iter().enumerate() {
                @if is_shown_in_steps(series) { (strips::steps(scene, index)) }
            }
            (tables::settings(scene))
            (tables::phases(scene))
            (tables::runs(scene))
        }
    }
}

fn facts(scene: &Scene<'_>) -> Markup {
    let study = scene.study;
    let reference = &study.reference;
    html! {
        p id={(scene.slug) "-reference"} {
            code { (study.file) } ", " (study.size[0]) " × " (study.size[1]) " pixels, content "
            code { (study.hash) } ". Compared with "
            @if reference.spp > 0 { "a reference of " (number::whole(reference.spp as f64)) " samples per pixel in two halves, " (number::seconds(reference.cpu_seconds)) " of CPU time" }
            @else { "a given reference in two halves" }
            "; its own relMSE is about " (rich(&number::scientific(reference.rel_mse))) "."
        }
        details { summary { "Where the reference is and how it was made" }
            ul { @for half in &reference.halves { li { code { (half.display()) } } } }
            @if reference.commands.is_empty() { p { "The pictures were given." } }
            @for command in &reference.commands { p { (page::command(&command_line(command))) } }
        }
    }
}

/// What each series is for, what failed, what could not be shown.
fn notes(scene: &Scene<'_>) -> Markup {
    let series: Vec<_> = scene.study.series.iter().filter(|s| !s.note.is_empty()).collect();
    let mut problems = scene.pictures.problems.clone();
    problems.extend(scene.illustrations.values().flatten().filter_map(|r| r.clone().err()));
    let failed = || scene.study.series.iter().flat_map(|s| s.settings.iter().map(move |t| (s, t)));
    html! {
        @if !series.is_empty() {
            dl.series { @for one in series { div { dt { (one.label) } dd { (one.note) } } } }
        }
        @if failed().any(|(_, t)| !t.failures.is_empty()) {
            div.warning id={(scene.slug) "-failures"} role="note" {
                h3 { "Failed runs" }
                ul { @for (series, setting) in failed().filter(|(_, t)| !t.failures.is_empty()) {
                    li { strong { (series.label) ", " (setting.label) } ": " (setting.failures.join("; ")) "."
                        @if setting.runs.is_empty() { " No run of this setting finished." } }
                } }
            }
        }
        @if !problems.is_empty() {
            div.warning role="note" { h3 { "Not shown" } ul { @for problem in &problems { li { (problem) } } } }
        }
    }
}

fn charts(scene: &Scene<'_>) -> Markup {
    html! {
        h3 id={(scene.slug) "-charts"} { "Charts" }
        @if scene.charts.is_empty() { p { "There are not enough finished settings for a chart." } }
        div.charts { @for chart in &scene.charts { (figure(scene, chart)) } }
    }
}

fn figure(scene: &Scene<'_>, chart: &Chart) -> Markup {
    let file = chart_file(scene, chart);
    html! {
        figure.chart id={"chart-" (file)} {
            figcaption { h4 { (chart.title) } p { (chart.caption) } }
            div.live aria-hidden="true" {}
            div.live-key { (svg::key(chart)) }
            div.static { (svg::draw(chart, svg::Colors::Page)) }
            p.small.noprint { "For papers: " a href={"charts/" (file) ".svg"} { "SVG" } ", " a href={"charts/" (file) ".csv"} { "CSV" } button.save-png type="button" hidden aria-label={"Save as PNG: " (chart.title)} { "PNG" } }
            @if !chart.left_out.is_empty() {
                details.small open[chart.left_out.len() <= 2] { summary { (chart.left_out.len()) " not drawn as measured" }
                    ul { @for one in &chart.left_out { li { (one) } } } }
            }
        }
    }
}

fn equal_error(scene: &Scene<'_>) -> Markup {
    let rows = &scene.study.equal_error;
    let mut names: Vec<&str> = Vec::new();
    for (name, _) in rows.iter().flat_map(|row| &row.cpu_seconds) {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    if rows.is_empty() {
        return PreEscaped(String::new());
    }
    html! {
        h3 id={(scene.slug) "-equal-error"} { "CPU time to equal error" }
        div.scroll tabindex="0" role="region" aria-label="CPU time to equal error" {
            table.names {
                caption { span { "CPU seconds to reach a relMSE, interpolated between settings; ≤ where already the fastest setting of a method is better, > where not even its slowest is that good. Fastest in bold, the ratio is that of the slowest to it." } }
                thead { tr { th scope="col" { "relMSE" } @for name in &names { th.num scope="col" { (findings::label(scene.study, name)) } } th.num scope="col" { "Ratio" } } }
                tbody { @for row in rows { (error_row(row, &names)) } }
            }
        }
    }
}

fn time_to_error(time: TimeToError) -> String {
    match time {
        TimeToError::Reached(t) => number::number(t),
        TimeToError::AtMost(t) => format!("≤ {}", number::number(t)),
        TimeToError::NotIn(t) => format!("> {}", number::number(t)),
        TimeToError::Unknown => "–".into(),
    }
}

fn error_row(row: &crate::study::EqualError, names: &[&str]) -> Markup {
    let time = |name: &str| {
        let found = row.cpu_seconds.iter().find(|(n, _)| n == name);
        found.map_or(TimeToError::Unknown, |(_, t)| *t)
    };
    let ratio = findings::fastest_and_slowest(row);
    let fastest = ratio.as_ref().map_or("", |r| r.fastest.0);
    html! {
        tr {
            th scope="row" { (rich(&number::round_number(row.rel_mse))) }
            @for name in names {
                td.num { @let text = time_to_error(time(name));
                    @if *name == fastest { strong { (text) } } @else { (text) } }
            }
            td.num { @match ratio {
                Some(r) => { @if !r.is_exact() { "> " } (number::times(r.factor())) "\u{202f}×" },
                None => "–",
            } }
        }
    }
}
