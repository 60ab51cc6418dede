//! The page as a whole: head, summary, scenes, plan, glossary, data.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::{Scene, command_line, findings, glossary, number, scene};
use crate::study::{Machine, Study};

const CSS: &str = include_str!("../../assets/report.css");
const SCRIPTS: [&str; 6] = [
    include_str!("../../assets/vega.min.js"),
    include_str!("../../assets/vega-lite.min.js"),
    include_str!("../../assets/vega-embed.min.js"),
    include_str!("../../assets/charts.js"),
    include_str!("../../assets/comparer.js"),
    include_str!("../../assets/report.js"),
];
const VEGA_LICENSES: &str = include_str!("../../assets/LICENSE-vega.txt");
/// Nothing may be loaded from anywhere, whatever the page contains.
const POLICY: &str = "default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; \
                      script-src 'unsafe-inline'; base-uri 'none'; form-action 'none'";

/// The report.
pub(super) fn page(study: &Study, scenes: &[Scene<'_>]) -> Markup {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="generator" content={"claror " (study.machine.version)};
                meta name="color-scheme" content="light dark";
                title { (study.title) }
                link rel="icon" href="data:,";
                style { (PreEscaped(CSS)) }
            }
            body {
                a.skip href="#summary" { "Skip to the summary" }
                (header(study, scenes))
                main {
                    (summary(study, scenes))
                    @for one in scenes { (scene::section(one)) }
                    (plan(study))
                    (glossary::section())
                }
                footer {
                    p { "Made by claror " (study.machine.version) ". This page holds all its pictures, data and programs; it asks no network for anything." }
                    details { summary { "Licences of the chart library" } pre.text tabindex="0" { (VEGA_LICENSES) } }
                }
                (data(scenes))
                @for script in SCRIPTS { script { (PreEscaped(script)) } }
            }
        }
    }
}

fn header(study: &Study, scenes: &[Scene<'_>]) -> Markup {
    html! {
        header.top {
            div.bar {
                p.brand { "claror bench" }
                nav aria-label="Contents" {
                    a href="#summary" { "Summary" }
                    @for scene in scenes { a href={"#" (scene.slug)} { (scene.study.name) } }
                    a href="#plan" { "Plan" }
                    a href="#glossary" { "Measures" }
                }
                button #theme type="button" hidden { "Theme: system" }
            }
            h1 { (study.title) }
            @if !study.about.is_empty() { p.about { (study.about) } }
        }
    }
}

fn summary(study: &Study, scenes: &[Scene<'_>]) -> Markup {
    html! {
        section #summary tabindex="-1" aria-labelledby="summary-title" {
            h2 #summary-title { "Summary" }
            @for scene in scenes {
                div.findings {
                    h3 { a href={"#" (scene.slug)} { (scene.study.name) } }
                    p.compared { "Compared: " (findings::compared(scene.study)) "." }
                    @let found = findings::of_scene(scene.study);
                    @if found.is_empty() { p { "No setting has a finished run: nothing can be said." } }
                    ul { @for one in &found {
                        li { (number::rich(&one.text)) " " a.rows href={"#" (scene.slug) "-" (one.part)} aria-label={"Rows of: " (one.text)} { "rows" } }
                    } }
                }
            }
            @if scenes.is_empty() { p { "The plan has no scene." } }
            (facts(study))
        }
    }
}

fn facts(study: &Study) -> Markup {
    let Machine { processor, cores, threads, memory_bytes, system, version, build } =
        &study.machine;
    let mut seeds: Vec<u64> = (study.scenes.iter())
        .flat_map(|scene| &scene.series)
        .flat_map(|series| &series.settings)
        .flat_map(|setting| setting.runs.iter().map(|run| run.seed))
        .collect();
    seeds.sort_unstable();
    seeds.dedup();
    let seeds = seeds.iter().map(u64::to_string).collect::<Vec<_>>().join(", ");
    html! {
        dl.facts {
            div { dt { "Processor" } dd { (processor) ", " (cores) " at once; " (threads) @if *threads == 1 { " thread a run" } @else { " threads a run" } } }
            div { dt { "Memory" } dd { (number::number(*memory_bytes as f64 / f64::from(1 << 30))) " GiB" } }
            div { dt { "System" } dd { (system) } }
            div { dt { "Program" } dd { "claror " (version) ", " (build) " build" } }
            div { dt { "Began" } dd { time datetime=(study.started) { (study.started) } } }
            div { dt { "Seeds" } dd { @if seeds.is_empty() { "–" } @else { (seeds) } } }
            div { dt { "Plan" } dd { (study.plan) } }
            div.wide { dt { "Command" } dd { (command(&command_line(&study.command))) } }
        }
    }
}

/// A command line with a button that copies it.
pub(super) fn command(line: &str) -> Markup {
    html! {
        span.command { code { (line) } button.copy type="button" hidden data-copy=(line) aria-label={"Copy the command " (line)} { "Copy" } }
    }
}

fn plan(study: &Study) -> Markup {
    html! {
        section #plan aria-labelledby="plan-title" {
            h2 #plan-title { "Plan, and how to repeat it" }
            p { "Save the plan below as " code { "plan.toml" } " beside the scenes and run the command of the summary with it in place of " code { (study.plan) } ". The same seeds give the same pictures, bit for bit, for any number of threads on the same machine; times depend on the machine and on what else it does." }
            p { "A single run is repeated by its command line, in the table of runs of its scene." }
            @if study.plan_text.is_empty() { p { "The plan's text was not kept." } }
            @else { pre.text tabindex="0" aria-label="The plan as TOML" { (study.plan_text) } button.copy type="button" hidden data-copy=(study.plan_text) { "Copy the plan" } }
        }
    }
}

/// What the scripts read. `<` is escaped, so that no text can end the element.
fn data(scenes: &[Scene<'_>]) -> Markup {
    let charts: Vec<_> = scenes.iter().flat_map(|scene| &scene.charts).collect();
    let json =
        serde_json::to_string(&charts).unwrap_or_else(|_| "[]".into()).replace('<', "\\u003c");
    html! { script #chart-data type="application/json" { (PreEscaped(json)) } }
}
