//! A chart as a static SVG, for papers and for paper.

use maud::{Markup, html};

use super::chart::{Axis, Chart, Line, Mark};

/// Where colours come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Colors {
    /// Written out: a file of its own, on white.
    Fixed,
    /// Variables of the page, which follow its theme.
    Page,
}

/// Distinct also without colour vision and 4.5 : 1 on white; `report.css` holds the same.
const SERIES: [&str; 6] = ["#0b5fa5", "#b34700", "#00704f", "#a03a78", "#6f5500", "#444444"];
/// Dash patterns, one by one with the colours.
const DASHES: [&str; 4] = ["none", "7 3", "2 3", "9 3 2 3"];
const SIZE: [f64; 2] = [640.0, 400.0];
/// Left, right, top, bottom.
const MARGIN: [f64; 4] = [74.0, 16.0, 14.0, 52.0];
const LEGEND_LINE: f64 = 22.0;

impl Colors {
    fn series(self, style: usize) -> String {
        let n = style % SERIES.len();
        if self == Self::Fixed { SERIES[n].into() } else { format!("var(--series-{n})") }
    }

    fn ink(self) -> &'static str {
        if self == Self::Fixed { "#1c1c1a" } else { "var(--ink)" }
    }

    fn grid(self) -> &'static str {
        if self == Self::Fixed { "#dcdcd8" } else { "var(--grid)" }
    }

    fn muted(self) -> &'static str {
        if self == Self::Fixed { "#595955" } else { "var(--muted)" }
    }
}

/// Where values lie on the paper.
struct Scale<'a> {
    axis: &'a Axis,
    from: f64,
    to: f64,
}

impl Scale<'_> {
    fn at(&self, v: f64) -> f64 {
        let f = |v: f64| if self.axis.log { v.ln() } else { v };
        let [low, high] = self.axis.domain.map(f);
        self.from + (f(v) - low) / (high - low) * (self.to - self.from)
    }
}

/// The chart as an SVG element.
pub(super) fn draw(chart: &Chart, colors: Colors) -> Markup {
    let legend = legend_rows(chart);
    let height = SIZE[1] + LEGEND_LINE * (legend.len() as f64 + 0.2);
    let x = Scale { axis: &chart.x, from: MARGIN[0], to: SIZE[0] - MARGIN[1] };
    let y = Scale { axis: &chart.y, from: SIZE[1] - MARGIN[3], to: MARGIN[2] };
    html! {
        svg xmlns="http://www.w3.org/2000/svg" viewBox={"0 0 " (SIZE[0]) " " (height)} width=(SIZE[0]) height=(height)
            role="img" aria-label={(chart.title) ". " (chart.caption)} font-family="Helvetica, Arial, sans-serif" font-size="13" {
            title { (chart.title) }
            @if colors == Colors::Fixed { rect width="100%" height="100%" fill="#ffffff" {} }
            (axes(&x, &y, colors))
            @if !chart.front.is_empty() {
                path d=(front_path(chart, &x, &y)) fill="none" stroke=(colors.muted()) stroke-width="1.2" stroke-dasharray="5 4" {}
            }
            @for line in &chart.lines { (series(line, &x, &y, colors)) }
            @for (row, entries) in legend.iter().enumerate() {
                @for (at, label, line) in entries {
                    (legend_entry(*at, SIZE[1] + LEGEND_LINE * (row as f64 + 0.5), label, *line, colors))
                }
            }
        }
    }
}

/// The chart as a whole file.
pub(super) fn file(chart: &Chart) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{}\n",
        draw(chart, Colors::Fixed).into_string()
    )
}

fn axes(x: &Scale<'_>, y: &Scale<'_>, colors: Colors) -> Markup {
    let (left, right, top, bottom) = (x.from, x.to, y.to, y.from);
    html! {
        g stroke=(colors.grid()) {
            @for (v, label) in &x.axis.ticks {
                @let at = round(x.at(*v));
                line x1=(at) x2=(at) y1=(top) y2=(bottom) opacity=(if label.is_some() { "1" } else { "0.45" }) {}
            }
            @for (v, label) in &y.axis.ticks {
                @let at = round(y.at(*v));
                line x1=(left) x2=(right) y1=(at) y2=(at) opacity=(if label.is_some() { "1" } else { "0.45" }) {}
            }
        }
        g fill=(colors.ink()) {
            @for (v, label) in &x.axis.ticks { @if let Some(label) = label {
                text x=(round(x.at(*v))) y=(bottom + 18.0) text-anchor="middle" { (label) }
            } }
            @for (v, label) in &y.axis.ticks { @if let Some(label) = label {
                text x=(left - 8.0) y=(round(y.at(*v)) + 4.0) text-anchor="end" { (label) }
            } }
            text x=(0.5 * (left + right)) y=(bottom + 40.0) text-anchor="middle" { (x.axis.title) }
            text transform={"translate(16 " (0.5 * (top + bottom)) ") rotate(-90)"} text-anchor="middle" { (y.axis.title) }
        }
        path d={"M" (left) " " (top) "V" (bottom) "H" (right)} fill="none" stroke=(colors.ink()) {}
        @if !y.axis.log && y.axis.domain[0] < 0.0 && y.axis.domain[1] > 0.0 {
            line x1=(left) x2=(right) y1=(round(y.at(0.0))) y2=(round(y.at(0.0))) stroke=(colors.muted()) stroke-width="1.5" {}
        }
    }
}

fn series(line: &Line, x: &Scale<'_>, y: &Scale<'_>, colors: Colors) -> Markup {
    let color = colors.series(line.style);
    let place = |m: &Mark| (round(x.at(m.x[0])), round(y.at(m.y[0])));
    let mut marks: Vec<&Mark> = line.marks.iter().collect();
    marks.sort_by(|a, b| a.x[0].total_cmp(&b.x[0]));
    let points: Vec<String> =
        marks.iter().map(|m| place(m)).map(|(x, y)| format!("{x},{y}")).collect();
    html! {
        g stroke=(color) fill=(color) {
            @if line.joined && points.len() > 1 {
                polyline points=(points.join(" ")) fill="none" stroke-width="1.8" stroke-dasharray=(DASHES[line.style % DASHES.len()]) {}
            }
            @for m in &marks {
                @let (px, py) = place(m);
                path d={"M" (px) " " (round(y.at(m.y[1]))) "V" (round(y.at(m.y[2]))) "M" (round(x.at(m.x[1]))) " " (py) "H" (round(x.at(m.x[2])))} fill="none" stroke-width="1.2" {}
                path class="mark" d=(shape(line.style, px, py)) stroke-width="1" { title { (line.label) ", " (m.setting) ": " (m.x_text) ", " (m.y_text) } }
                @if m.front { circle cx=(px) cy=(py) r="8.5" fill="none" stroke=(colors.ink()) stroke-width="1" {} }
            }
        }
    }
}

/// The mark of a style about a point: circle, square, triangle, diamond, triangle down, cross.
fn shape(style: usize, x: f64, y: f64) -> String {
    let polygon = |corners: &[[f64; 2]]| {
        let corner = |c: &[f64; 2]| format!("{} {}", round(x + c[0]), round(y + c[1]));
        format!("M{}Z", corners.iter().map(corner).collect::<Vec<_>>().join("L"))
    };
    match (style + style / SERIES.len()) % 6 {
        0 => format!("M{} {}a4.5 4.5 0 1 0 9 0a4.5 4.5 0 1 0 -9 0Z", round(x - 4.5), round(y)),
        1 => polygon(&[[-4.0, -4.0], [4.0, -4.0], [4.0, 4.0], [-4.0, 4.0]]),
        2 => polygon(&[[0.0, -5.5], [5.0, 4.0], [-5.0, 4.0]]),
        3 => polygon(&[[0.0, -6.0], [6.0, 0.0], [0.0, 6.0], [-6.0, 0.0]]),
        4 => polygon(&[[0.0, 5.5], [5.0, -4.0], [-5.0, -4.0]]),
        _ => polygon(&[
            [-1.5, -5.0],
            [1.5, -5.0],
            [1.5, -1.5],
            [5.0, -1.5],
            [5.0, 1.5],
            [1.5, 1.5],
            [1.5, 5.0],
            [-1.5, 5.0],
            [-1.5, 1.5],
            [-5.0, 1.5],
            [-5.0, -1.5],
            [-1.5, -1.5],
        ]),
    }
}

/// A stair: between two settings the front is as good as the earlier one.
fn front_path(chart: &Chart, x: &Scale<'_>, y: &Scale<'_>) -> String {
    let mut path = String::new();
    for [px, py] in &chart.front {
        let (px, py) = (round(x.at(*px)), round(y.at(*py)));
        path += &if path.is_empty() { format!("M{px} {py}") } else { format!("H{px}V{py}") };
    }
    path
}

/// The marks of a chart with their names, as a list of the page.
pub(super) fn key(chart: &Chart) -> Markup {
    let front = (!chart.front.is_empty()).then(|| ("Pareto front".into(), None));
    let entries = chart.lines.iter().map(|l| (l.key(), Some(l))).chain(front);
    html! {
        ul.chart-key {
            @for (label, line) in entries {
                li { svg width="26" height="16" viewBox="0 0 26 16" aria-hidden="true" { (sample(0.0, 8.0, line, Colors::Page)) } (label) }
            }
        }
    }
}

type LegendEntry<'a> = (f64, String, Option<&'a Line>);

/// Entries with their x, as many in a row as fit (about 7 units a letter). `None` is the front.
fn legend_rows(chart: &Chart) -> Vec<Vec<LegendEntry<'_>>> {
    let mut entries: Vec<_> = chart.lines.iter().map(|l| (l.key(), Some(l))).collect();
    if !chart.front.is_empty() {
        entries.push(("Pareto front".into(), None));
    }
    let mut rows: Vec<Vec<LegendEntry<'_>>> = Vec::new();
    let mut at = f64::INFINITY;
    for (label, line) in entries {
        let label = shortened(&label, 70);
        let width = 48.0 + 7.0 * label.chars().count() as f64;
        if at + width > SIZE[0] {
            rows.push(Vec::new());
            at = MARGIN[0];
        }
        if let Some(row) = rows.last_mut() {
            row.push((at, label, line));
        }
        at += width;
    }
    rows
}

fn shortened(text: &str, letters: usize) -> String {
    if text.chars().count() <= letters {
        return text.into();
    }
    text.chars().take(letters - 1).chain(['…']).collect()
}

fn legend_entry(x: f64, y: f64, label: &str, line: Option<&Line>, colors: Colors) -> Markup {
    html! {
        (sample(x, y, line, colors))
        text x=(x + 32.0) y=(y + 4.5) fill=(colors.ink()) { (label) }
    }
}

/// Line and mark of a series, 26 units wide; without a series those of the front.
fn sample(x: f64, y: f64, line: Option<&Line>, colors: Colors) -> Markup {
    html! {
        @match line {
            Some(line) => {
                @let color = colors.series(line.style);
                @if line.joined {
                    line x1=(x) x2=(x + 26.0) y1=(y) y2=(y) stroke=(color) stroke-width="1.8" stroke-dasharray=(DASHES[line.style % DASHES.len()]) {}
                }
                path d=(shape(line.style, x + 13.0, y)) fill=(color) {}
            }
            None => line x1=(x) x2=(x + 26.0) y1=(y) y2=(y) stroke=(colors.muted()) stroke-width="1.2" stroke-dasharray="5 4" {},
        }
    }
}

/// Two digits are enough on paper.
fn round(v: f64) -> f64 {
    (v * 100.0).round() / 100.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_put_decades_at_equal_distances() {
        let axis = Axis { domain: [1.0, 100.0], ..Axis::new("", true) };
        let scale = Scale { axis: &axis, from: 0.0, to: 200.0 };
        assert!((scale.at(10.0) - 100.0).abs() < 1e-9);
    }
}
