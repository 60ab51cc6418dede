//! A chart: what the interactive and the static one draw, and what the CSV file lists.

use serde::Serialize;

use super::ticks::ticks;

/// Points of several series over two axes.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Chart {
    /// Unique in its scene, fit for file names: `relmse-time`.
    pub id: String,
    pub title: String,
    /// How it is to be read, one sentence or two.
    pub caption: String,
    pub x: Axis,
    pub y: Axis,
    pub lines: Vec<Line>,
    /// Corners of the Pareto front by x; empty if the chart has none.
    pub front: Vec<[f64; 2]>,
    /// What could not be drawn, one sentence each.
    pub left_out: Vec<String>,
}

/// An axis.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Axis {
    pub title: String,
    pub log: bool,
    /// Values are fractions shown as signed per cent, and 0 is always in sight.
    pub percent: bool,
    /// First and last value, with room for the marks.
    pub domain: [f64; 2],
    /// Lesser ticks have no label.
    pub ticks: Vec<(f64, Option<String>)>,
}

impl Axis {
    /// An axis that [`Chart::finished`] fits to the marks.
    pub(super) fn new(title: &str, log: bool) -> Self {
        Self { title: title.into(), log, percent: false, domain: [0.0, 1.0], ticks: Vec::new() }
    }

    /// Signed per cent.
    pub(super) fn percent(title: &str) -> Self {
        Self { percent: true, ..Self::new(title, false) }
    }

    /// Domain and ticks for these values; nothing without any.
    fn fit(&mut self, values: impl Iterator<Item = f64>, about: usize) -> Option<()> {
        let zero = self.percent.then_some(0.0);
        self.domain = domain(values.chain(zero), self.log)?;
        self.ticks = ticks(self, about);
        Some(())
    }
}

/// A series in a chart.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Line {
    pub label: String,
    /// What its key says besides: the slope. May be empty.
    pub note: String,
    /// Which colour and mark it has; a series has the same ones in all charts of a scene.
    pub style: usize,
    /// Whether its marks are joined.
    pub joined: bool,
    pub marks: Vec<Mark>,
}

/// A setting in a chart.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Mark {
    pub setting: String,
    /// Median, smallest, largest.
    pub x: [f64; 3],
    pub y: [f64; 3],
    /// The same as text, true where the bars are cut.
    pub x_text: String,
    pub y_text: String,
    pub seeds: String,
    pub command: String,
    /// Whether no other setting is both faster and better.
    pub front: bool,
}

impl Line {
    /// Label and note.
    pub(super) fn key(&self) -> String {
        if self.note.is_empty() {
            self.label.clone()
        } else {
            format!("{} · {}", self.label, self.note)
        }
    }
}

impl Chart {
    /// Leaves out what the axes cannot show, says so, and fits the axes to the rest. Nothing if no
    /// mark is left.
    pub(super) fn finished(mut self) -> Option<Self> {
        for line in &mut self.lines {
            let marks = std::mem::take(&mut line.marks);
            for mark in marks {
                match unshowable(&mark, &self.x, &self.y) {
                    Some(why) => {
                        self.left_out.push(format!("{}, {}: {why}.", line.label, mark.setting));
                    }
                    None => line.marks.push(mark),
                }
            }
        }
        self.lines.retain(|line| !line.marks.is_empty());
        for log in [(self.x.log, 0), (self.y.log, 1)] {
            if log.0 {
                self.cut_bars(log.1);
            }
        }
        let marks: Vec<&Mark> = self.lines.iter().flat_map(|line| &line.marks).collect();
        if marks.is_empty() {
            return None;
        }
        self.x.fit(marks.iter().flat_map(|m| m.x), 7)?;
        self.y.fit(marks.iter().flat_map(|m| m.y), 6)?;
        Some(self)
    }

    /// Bars that reach to 0 or below on a logarithmic axis end at half the smallest median.
    fn cut_bars(&mut self, axis: usize) {
        let of = |m: &Mark| if axis == 0 { m.x } else { m.y };
        let marks = self.lines.iter().flat_map(|line| &line.marks);
        let end = 0.5 * marks.map(|m| of(m)[0]).fold(f64::INFINITY, f64::min);
        for line in &mut self.lines {
            for mark in &mut line.marks {
                if of(mark)[1] > 0.0 {
                    continue;
                }
                let values = if axis == 0 { &mut mark.x } else { &mut mark.y };
                values[1] = end;
                let text = format!(
                    "{}, {}: the range reaches below 0, its bar is cut.",
                    line.label, mark.setting
                );
                self.left_out.push(text);
            }
        }
    }

    /// The marks as comma-separated values, with a header.
    pub(super) fn csv(&self) -> String {
        let mut out = String::from(
            "series,setting,x,x_low,x_high,y,y_low,y_high,pareto_front,seeds,command\n",
        );
        for line in &self.lines {
            for m in &line.marks {
                let numbers = m.x.iter().chain(&m.y).map(f64::to_string).collect::<Vec<_>>();
                let front = if m.front { "1" } else { "0" };
                let texts = [&m.seeds, &m.command].map(|t| quoted(t)).join(",");
                let (label, setting) = (quoted(&line.label), quoted(&m.setting));
                out += &format!("{label},{setting},{},{front},{texts}\n", numbers.join(","));
            }
        }
        out
    }
}

/// A field of a CSV file (RFC 4180). Spreadsheets take what begins with `=`, `+`, `-` or `@` for a
/// formula, so these get an apostrophe.
fn quoted(text: &str) -> String {
    let guard = if text.starts_with(['=', '+', '-', '@']) { "'" } else { "" };
    format!("\"{guard}{}\"", text.replace('"', "\"\""))
}

fn unshowable(mark: &Mark, x: &Axis, y: &Axis) -> Option<String> {
    if mark.x.iter().chain(&mark.y).any(|v| !v.is_finite()) {
        return Some("not a finite number".into());
    }
    let beyond = |axis: &Axis, v: f64| axis.log && v <= 0.0;
    let axis = [(x, mark.x[0]), (y, mark.y[0])].into_iter().find(|(axis, v)| beyond(axis, *v))?.0;
    Some(format!("{} is 0 or less, which a logarithmic axis cannot show", axis.title))
}

/// First and last value with 4 % room at both ends.
fn domain(values: impl Iterator<Item = f64>, log: bool) -> Option<[f64; 2]> {
    let to = |v: f64| if log { v.ln() } else { v };
    let from = |v: f64| if log { v.exp() } else { v };
    let (low, high) = values
        .map(to)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    if low > high {
        return None;
    }
    let smallest = if log { 0.5 } else { 1e-3 * high.abs().max(1e-6) };
    let room = 0.04 * (high - low).max(smallest);
    let (low, high) = (low - room, high + room);
    Some([from(low), from(high)])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mark(setting: &str, y: [f64; 3]) -> Mark {
        Mark {
            setting: setting.into(),
            x: [1.0, 1.0, 1.0],
            y,
            x_text: String::new(),
            y_text: String::new(),
            seeds: "1".into(),
            command: "claror \"a\"".into(),
            front: false,
        }
    }

    fn chart(marks: Vec<Mark>) -> Chart {
        let axis = || Axis::new("", true);
        let lines =
            vec![Line { label: "=A".into(), note: String::new(), style: 0, joined: true, marks }];
        Chart {
            id: "c".into(),
            title: String::new(),
            caption: String::new(),
            x: axis(),
            y: axis(),
            lines,
            front: Vec::new(),
            left_out: Vec::new(),
        }
    }

    #[test]
    fn what_a_logarithm_cannot_show_is_left_out_and_said() {
        let marks = vec![
            mark("good", [1e-3, -1e-4, 2e-3]),
            mark("below", [-1e-6, -2e-6, 1e-6]),
            mark("nan", [f64::NAN, 1.0, 1.0]),
        ];
        let chart = chart(marks).finished().unwrap();
        assert_eq!(chart.lines[0].marks.len(), 1);
        assert_eq!(chart.lines[0].marks[0].y, [1e-3, 5e-4, 2e-3]);
        assert_eq!(chart.left_out.len(), 3);
        assert!(chart.left_out[0].starts_with("=A, below:  is 0 or less"));
        assert!(chart.y.domain[0] > 0.0 && chart.y.domain[0] < 5e-4 && chart.y.domain[1] > 2e-3);
    }

    #[test]
    fn a_chart_of_nothing_is_none() {
        assert!(chart(vec![mark("below", [0.0, 0.0, 0.0])]).finished().is_none());
    }

    #[test]
    fn csv_is_quoted_and_no_formula() {
        let text = chart(vec![mark("a", [1.0, 1.0, 2.0])]).csv();
        assert!(
            text.ends_with("\"'=A\",\"a\",1,1,1,1,1,2,0,\"1\",\"claror \"\"a\"\"\"\n"),
            "{text}"
        );
    }
}
