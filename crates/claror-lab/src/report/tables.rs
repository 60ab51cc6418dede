//! Tables of one scene: settings, phases, runs.

use maud::{Markup, PreEscaped, html};

use super::charts::seeds;
use super::number::rich;
use super::pictures::first_run;
use super::{Scene, command_line, number, page};
use crate::study::{Run, Series, Setting, Spread, Summary};

/// A column of the table of settings.
struct Column {
    title: &'static str,
    of: fn(&Summary) -> Option<Spread>,
    format: fn(f64) -> String,
}

const COLUMNS: [Column; 10] = [
    Column { title: "CPU s", of: |s| Some(s.cpu_seconds), format: number::number },
    Column { title: "Wall s", of: |s| Some(s.seconds), format: number::number },
    Column { title: "Records", of: |s| s.records, format: number::whole },
    Column { title: "Memory MiB", of: |s| Some(s.peak_memory_bytes), format: number::mebibytes },
    Column { title: "MSE", of: |s| Some(s.mse), format: number::scientific },
    Column { title: "relMSE", of: |s| Some(s.rel_mse), format: number::scientific },
    Column { title: "MAPE %", of: |s| Some(s.mape), format: |v| number::number(100.0 * v) },
    Column { title: "Bias %", of: |s| Some(s.bias), format: signed_percent },
    Column { title: "SSIM", of: |s| Some(s.ssim), format: number::fraction },
    Column { title: "FLIP", of: |s| Some(s.flip), format: number::fraction },
];

/// Per cent with a plus above 0, without the sign of per cent.
fn signed_percent(v: f64) -> String {
    let sign = if v > 0.0 { "+" } else { "" };
    format!("{sign}{}", number::number(100.0 * v))
}

fn all<'a>(scene: &'a Scene<'_>) -> Vec<(&'a Series, &'a Setting)> {
    let series = scene.study.series.iter();
    series.flat_map(|s| s.settings.iter().map(move |t| (s, t))).collect()
}

/// All settings, sortable.
pub(super) fn settings(scene: &Scene<'_>) -> Markup {
    html! {
        h3 id={(scene.slug) "-settings"} { "All settings" }
        div.scroll tabindex="0" role="region" aria-label={"All settings of " (scene.study.name)} {
            table.sortable {
                caption { span { "Medians over the seeds; below them the smallest and the largest value where they differ." } }
                thead { tr {
                    th scope="col" data-kind="text" { "Series" } th scope="col" data-kind="text" { "Setting" } th.num scope="col" data-kind="number" { "Runs" }
                    @for column in &COLUMNS { th.num scope="col" data-kind="number" { (column.title) } }
                } }
                tbody { @for (series, setting) in all(scene) { (setting_row(series, setting)) } }
            }
        }
    }
}

fn setting_row(series: &Series, setting: &Setting) -> Markup {
    let failed = setting.failures.len();
    html! {
        tr.failed[setting.summary.is_none()] {
            td data-value=(series.label) { (series.label) }
            th scope="row" data-value=(setting.label) { (setting.label) }
            td.num data-value=(setting.runs.len()) { (setting.runs.len()) @if failed > 0 { br; span.bad { (failed) " failed" } } }
            @for column in &COLUMNS {
                @match setting.summary.as_ref().and_then(|s| (column.of)(s)) {
                    Some(spread) => td.num data-value=[spread.median.is_finite().then_some(spread.median)] {
                        (rich(&(column.format)(spread.median)))
                        @if let Some(range) = number::range(&spread, &column.format) { br; small { (rich(&range)) } }
                    },
                    None => td.num.muted { "–" },
                }
            }
        }
    }
}

/// Where the time goes: shares of the phases of the run with the median time.
pub(super) fn phases(scene: &Scene<'_>) -> Markup {
    let rows: Vec<_> =
        all(scene).into_iter().filter_map(|(s, t)| Some((s, t, typical(t)?))).collect();
    let mut names: Vec<&str> = Vec::new();
    // The run with most phases gives the order.
    let mut by_count: Vec<&Run> = rows.iter().map(|row| row.2).collect();
    by_count.sort_by_key(|run| std::cmp::Reverse(run.phases.len()));
    for (name, _) in by_count.iter().flat_map(|run| &run.phases) {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    if names.is_empty() {
        return PreEscaped(String::new());
    }
    html! {
        h3 { "Where the time goes" }
        p.legend { @for (i, name) in names.iter().enumerate() { span { i class={"swatch phase-" (i % 6)} {} (name) } } }
        div.scroll tabindex="0" role="region" aria-label="Phase times" {
            table.phases {
                caption { span { "Shares of the phases in the run of median CPU time, in wall-clock time." } }
                thead { tr { th scope="col" { "Series" } th scope="col" { "Setting" } th scope="col" { "Shares" } @for name in &names { th.num scope="col" { (name) " s" } } th.num scope="col" { "Sum s" } } }
                tbody { @for (series, setting, run) in &rows { (phase_row(series, setting, run, &names)) } }
            }
        }
    }
}

fn phase_row(series: &Series, setting: &Setting, run: &Run, names: &[&str]) -> Markup {
    let time = |name: &str| -> f64 {
        run.phases.iter().filter(|(n, t)| n == name && *t > 0.0).map(|(_, t)| t).sum()
    };
    let sum: f64 = names.iter().map(|name| time(name)).sum();
    let share = |name: &str| if sum > 0.0 { 100.0 * time(name) / sum } else { 0.0 };
    html! {
        tr {
            td { (series.label) } th scope="row" { (setting.label) }
            td { div.stack { @for (i, name) in names.iter().enumerate() { @if share(name) > 0.0 {
                span class={"phase-" (i % 6)} style=(format!("width:{:.2}%", share(name))) title=(format!("{name}: {:.0} %", share(name))) {}
            } } } }
            @for name in names { td.num { @if time(name) > 0.0 { (number::number(time(name))) } @else { span.muted { "–" } } } }
            td.num { (number::number(sum)) }
        }
    }
}

/// The run of median processor time, if it told its phases.
fn typical(setting: &Setting) -> Option<&Run> {
    let mut runs: Vec<&Run> = setting.runs.iter().filter(|r| !r.phases.is_empty()).collect();
    runs.sort_by(|a, b| a.cpu_seconds.total_cmp(&b.cpu_seconds).then(a.seed.cmp(&b.seed)));
    runs.get(runs.len().saturating_sub(1) / 2).copied()
}

/// Every run and the parameters in force.
pub(super) fn runs(scene: &Scene<'_>) -> Markup {
    let count: usize = all(scene).iter().map(|(_, t)| t.runs.len()).sum();
    html! {
        details.runs { summary { "All " (count) " runs with their commands" }
            div.scroll tabindex="0" role="region" aria-label="All runs" {
                table {
                    caption { span { "Each run as it was made. Load is that of the machine when the run began, without the run." } }
                    thead { tr {
                        th scope="col" { "Run" } th.num scope="col" { "Seed" } th scope="col" { "Began" } th.num scope="col" { "Load" } th.num scope="col" { "CPU s" }
                        th.num scope="col" { "Wall s" } th.num scope="col" { "spp" } th.num scope="col" { "Rays" } th.num scope="col" { "Records" } th.num scope="col" { "relMSE" } th scope="col" { "Picture" } th scope="col" { "Command" }
                    } }
                    tbody { @for (_, setting) in all(scene) { @for run in &setting.runs { (run_row(run)) } } }
                }
            }
        }
        details.runs { summary { "Parameters in force" }
            @for (series, setting) in all(scene) { @if let Some(run) = first_run(setting) { @if !run.parameters.is_empty() {
                details { summary { (series.label) ", " (setting.label) " (seeds " (seeds(setting)) ")" }
                    dl.parameters { @for (name, value) in &run.parameters { div { dt { (name) } dd { (value) } } } }
                }
            } } }
        }
    }
}

fn run_row(run: &Run) -> Markup {
    html! {
        tr {
            th scope="row" { code { (run.id) } } td.num { (run.seed) } td { (run.started) } td.num { (format!("{:.2}", run.load)) }
            td.num { (number::number(run.cpu_seconds)) } td.num { (number::number(run.seconds)) } td.num { (number::number(run.spp)) }
            td.num { (number::whole(run.rays as f64)) } td.num { @match run.records { Some(n) => (number::whole(n as f64)), None => "–" } }
            td.num { (rich(&number::scientific(run.errors.rel_mse))) } td { code { (run.picture.display()) } } td { (page::command(&command_line(&run.command))) }
        }
    }
}
