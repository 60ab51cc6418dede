//! The charts of a scene.

use super::chart::{Axis, Chart, Line, Mark};
use super::{command_line, number};
use crate::study::{SceneStudy, Series, SeriesKind, Setting, Spread, Summary};

/// A quantity that charts show: title of the axis, where it is, how it reads.
struct Quantity {
    title: &'static str,
    of: fn(&Summary) -> Option<Spread>,
    format: fn(f64) -> String,
}

const CPU: Quantity =
    Quantity { title: "CPU time in s", of: |s| Some(s.cpu_seconds), format: number::number };
const REL_MSE: Quantity =
    Quantity { title: "relMSE", of: |s| Some(s.rel_mse), format: number::scientific };
const RECORDS: Quantity = Quantity { title: "Records", of: |s| s.records, format: number::whole };
const BIAS: Quantity =
    Quantity { title: "Bias", of: |s| Some(s.bias), format: |v| number::percent(v, true) };

/// All charts that the settings of a scene allow, in the order of the report.
pub(super) fn of_scene(scene: &SceneStudy) -> Vec<Chart> {
    let mut charts = Vec::new();
    let parameters = parameters(scene);
    charts.extend(parameters.iter().filter_map(|p| against_parameter(scene, p, &CPU)));
    charts.extend(error_against_time(scene));
    for quantity in [&REL_MSE, &RECORDS, &BIAS] {
        charts.extend(parameters.iter().filter_map(|p| against_parameter(scene, p, quantity)));
    }
    charts.extend(lookup_cost(scene));
    charts
}

/// Parameters that series sweep, samples per pixel first, then in the order of the plan.
fn parameters(scene: &SceneStudy) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for series in &scene.series {
        if let SeriesKind::Sweep { parameter } = &series.kind
            && !names.contains(&parameter.as_str())
        {
            names.push(parameter);
        }
    }
    names.sort_by_key(|name| !is_spp(name));
    names
}

fn is_spp(parameter: &str) -> bool {
    parameter.rsplit('.').next().is_some_and(|last| matches!(last, "spp" | "sample_count"))
}

fn parameter_title(parameter: &str) -> String {
    if is_spp(parameter) {
        return "Samples per pixel".into();
    }
    let name = parameter.rsplit('.').next().unwrap_or(parameter).replace('_', " ");
    match name.as_str() {
        "accuracy" => "Accuracy a".into(),
        "error" => "Error parameter".into(),
        _ => {
            name.chars().take(1).flat_map(char::to_uppercase).chain(name.chars().skip(1)).collect()
        }
    }
}

fn against_parameter(scene: &SceneStudy, parameter: &str, y: &Quantity) -> Option<Chart> {
    let swept =
        |s: &Series| matches!(&s.kind, SeriesKind::Sweep { parameter: p } if p == parameter);
    let x = |setting: &Setting| {
        let x = setting.x?;
        Some(([x; 3], number::number(x)))
    };
    let lines = lines(scene, &swept, &x, y, &|_| String::new());
    let values: Vec<f64> = lines.iter().flat_map(|l| &l.marks).map(|m| m.x[0]).collect();
    if values.len() < 2 {
        return None;
    }
    let title = parameter_title(parameter);
    let lower = title.chars().take(1).flat_map(char::to_lowercase).chain(title.chars().skip(1));
    let lower: String =
        if title.starts_with("Accuracy") { "accuracy a".into() } else { lower.collect() };
    let what = if y.title == CPU.title { "CPU time" } else { y.title };
    let chart = Chart {
        id: format!("{}-{}", slug(what), slug(parameter)),
        title: format!("{what} against {lower}"),
        caption: caption(what).into(),
        x: Axis::new(&title, spans_decade(&values)),
        y: if y.title == BIAS.title { Axis::percent(y.title) } else { Axis::new(y.title, true) },
        lines,
        front: Vec::new(),
        left_out: Vec::new(),
    };
    chart.finished()
}

fn caption(what: &str) -> &'static str {
    match what {
        "Bias" => {
            "Mean of the picture over mean of the reference, minus 1: above 0 too bright, below 0 too dark."
        }
        "Records" => "How many records the cache holds at each value.",
        "relMSE" => "How the error follows the parameter: lower is better.",
        _ => "What each value costs: the efficiency chart of the thesis.",
    }
}

/// Whether the values are better shown by their logarithms.
fn spans_decade(values: &[f64]) -> bool {
    let positive = values.iter().copied().filter(|&v| v > 0.0);
    let (low, high) = positive.fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
    values.iter().all(|&v| v > 0.0) && high >= 8.0 * low
}

fn error_against_time(scene: &SceneStudy) -> Option<Chart> {
    let x = |setting: &Setting| {
        let cpu = setting.summary.as_ref()?.cpu_seconds;
        Some((triple(cpu), number::spread(&cpu, &number::number)))
    };
    let note = |s: &Series| s.slope.map(|slope| format!("slope {}", short(slope.exponent)));
    let chart = Chart {
        id: "relmse-time".into(),
        title: "relMSE against CPU time".into(),
        caption: "Lower and further left is better. The dashed line is the Pareto front: settings \
                  that no other beats in both time and error. Bars span the seeds."
            .into(),
        x: Axis::new(CPU.title, true),
        y: Axis::new(REL_MSE.title, true),
        lines: lines(scene, &|_| true, &x, &REL_MSE, &|s| note(s).unwrap_or_default()),
        front: Vec::new(),
        left_out: Vec::new(),
    };
    let mut chart = chart.finished()?;
    mark_front(&mut chart);
    Some(chart)
}

fn short(exponent: f64) -> String {
    number::fraction(exponent).chars().take(if exponent < 0.0 { 5 } else { 4 }).collect()
}

/// Marks the settings that no other beats in both coordinates, and lists them by x.
fn mark_front(chart: &mut Chart) {
    let mut marks: Vec<&mut Mark> = chart.lines.iter_mut().flat_map(|l| &mut l.marks).collect();
    marks.sort_by(|a, b| a.x[0].total_cmp(&b.x[0]).then(a.y[0].total_cmp(&b.y[0])));
    let mut best = f64::INFINITY;
    for mark in marks {
        if mark.y[0] < best {
            best = mark.y[0];
            mark.front = true;
            chart.front.push([mark.x[0], mark.y[0]]);
        }
    }
}

type Coordinate<'a> = &'a dyn Fn(&Setting) -> Option<([f64; 3], String)>;

/// The settings of the wanted series as lines, by the order of the plan.
fn lines(
    scene: &SceneStudy,
    wanted: &dyn Fn(&Series) -> bool,
    x: Coordinate<'_>,
    y: &Quantity,
    note: &dyn Fn(&Series) -> String,
) -> Vec<Line> {
    let line = |(style, series): (usize, &Series)| {
        let mark = |setting: &Setting| {
            let spread = (y.of)(setting.summary.as_ref()?)?;
            let (x, x_text) = x(setting)?;
            let y_text = number::spread(&spread, &y.format);
            Some(Mark {
                setting: setting.label.clone(),
                x,
                y: triple(spread),
                x_text,
                y_text,
                seeds: seeds(setting),
                command: setting.runs.first().map(|r| command_line(&r.command)).unwrap_or_default(),
                front: false,
            })
        };
        let marks: Vec<Mark> = series.settings.iter().filter_map(mark).collect();
        let joined = !matches!(series.kind, SeriesKind::Steps);
        (!marks.is_empty()).then(|| Line {
            label: series.label.clone(),
            note: note(series),
            style,
            joined,
            marks,
        })
    };
    let series = scene.series.iter().enumerate().filter(|(_, s)| wanted(s));
    series.filter_map(line).collect()
}

/// Seeds of the finished runs: `1, 2, 3`.
pub(super) fn seeds(setting: &Setting) -> String {
    setting.runs.iter().map(|r| r.seed.to_string()).collect::<Vec<_>>().join(", ")
}

fn lookup_cost(scene: &SceneStudy) -> Option<Chart> {
    let mut lines: Vec<Line> = Vec::new();
    for cost in &scene.lookups {
        let label = cost.index.replace('_', " ");
        let at = lines.iter().position(|l| l.label == label).unwrap_or_else(|| {
            lines.push(Line {
                label,
                note: String::new(),
                style: lines.len(),
                joined: true,
                marks: Vec::new(),
            });
            lines.len() - 1
        });
        lines[at].marks.push(Mark {
            setting: format!("{} records tested", number::number(cost.candidates)),
            x: [cost.records as f64; 3],
            y: [cost.nanoseconds; 3],
            x_text: number::whole(cost.records as f64),
            y_text: format!("{} ns", number::number(cost.nanoseconds)),
            seeds: String::new(),
            command: String::new(),
            front: false,
        });
    }
    let chart = Chart {
        id: "lookup-records".into(),
        title: "Cost of a look-up against number of records".into(),
        caption: "How each index copes with a growing cache: flatter is better.".into(),
        x: Axis::new("Records", true),
        y: Axis::new("Time per look-up in ns", true),
        lines,
        front: Vec::new(),
        left_out: Vec::new(),
    };
    chart.finished()
}

fn triple(s: Spread) -> [f64; 3] {
    [s.median, s.low, s.high]
}

/// A text as part of a file name: ASCII letters, digits and hyphens, never empty.
pub(super) fn slug(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars().take(60) {
        if c.is_ascii_alphanumeric() {
            out.push(c.to_ascii_lowercase());
        } else if !out.is_empty() && !out.ends_with('-') {
            out.push('-');
        }
    }
    let out = out.trim_end_matches('-');
    if out.is_empty() { "x".into() } else { out.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_is_what_nothing_beats() {
        let at = |x: f64, y: f64| Mark {
            setting: String::new(),
            x: [x; 3],
            y: [y; 3],
            x_text: String::new(),
            y_text: String::new(),
            seeds: String::new(),
            command: String::new(),
            front: false,
        };
        let line = |style, marks| Line {
            label: String::new(),
            note: String::new(),
            style,
            joined: true,
            marks,
        };
        let mut chart = Chart {
            id: String::new(),
            title: String::new(),
            caption: String::new(),
            x: Axis::new("", true),
            y: Axis::new("", true),
            lines: vec![
                line(0, vec![at(1.0, 8.0), at(4.0, 2.0), at(9.0, 3.0)]),
                line(1, vec![at(1.0, 9.0), at(2.0, 5.0), at(3.0, 5.0)]),
            ],
            front: Vec::new(),
            left_out: Vec::new(),
        };
        mark_front(&mut chart);
        assert_eq!(chart.front, [[1.0, 8.0], [2.0, 5.0], [4.0, 2.0]]);
        let on: Vec<bool> = chart.lines.iter().flat_map(|l| &l.marks).map(|m| m.front).collect();
        assert_eq!(on, [true, true, false, false, true, false]);
    }

    #[test]
    fn file_names_are_tame() {
        assert_eq!(slug("../<script>\"&é"), "script");
        assert_eq!(slug("..."), "x");
        assert_eq!(slug("Thesis Box 2"), "thesis-box-2");
    }
}
