//! What the numbers say, in plain sentences. Each sentence repeats rows of the report and links to
//! them; nothing is said that is not there.

use super::number;
use crate::study::{
    EqualError, EqualTime, SceneStudy, Series, SeriesKind, Setting, Summary, TimeToError,
};

/// A sentence and the rows that it rests on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Finding {
    pub text: String,
    /// Part of the scene's section, such as `settings`.
    pub part: &'static str,
}

fn finding(part: &'static str, text: String) -> Finding {
    Finding { text, part }
}

/// The findings of one scene, the most telling first.
pub(super) fn of_scene(scene: &SceneStudy) -> Vec<Finding> {
    let mut out = Vec::new();
    out.extend(equal_error(scene));
    out.extend(equal_time(scene));
    out.extend(best(scene));
    out.extend(bias(scene));
    out.extend(slopes(scene));
    out.extend(reference(scene));
    out.extend(failures(scene));
    out
}

/// Label of a series by its name.
pub(super) fn label<'a>(scene: &'a SceneStudy, name: &'a str) -> &'a str {
    scene.series.iter().find(|s| s.name == name).map_or(name, |s| s.label.as_str())
}

/// The settings that made a picture in a given time, with their series.
pub(super) fn contenders<'a>(
    scene: &'a SceneStudy,
    entries: &'a EqualTime,
) -> Vec<(&'a Series, usize, &'a Setting)> {
    let find = |(name, index): &'a (String, usize)| {
        let series = scene.series.iter().find(|s| &s.name == name)?;
        Some((series, *index, series.settings.get(*index)?))
    };
    entries.entries.iter().filter_map(find).collect()
}

/// Who needs least time to an error and who most, of those whose times can be told apart.
pub(super) struct Ratio<'a> {
    /// Name of the series and its time.
    pub fastest: (&'a str, TimeToError),
    /// The same of the slowest.
    pub slowest: (&'a str, TimeToError),
}

impl Ratio<'_> {
    /// Whether both times are known, and not only a bound of one.
    pub(super) fn is_exact(&self) -> bool {
        let is_reached = |t| matches!(t, TimeToError::Reached(_));
        is_reached(self.fastest.1) && is_reached(self.slowest.1)
    }

    /// Time of the slowest over that of the fastest, or a lower bound of that.
    pub(super) fn factor(&self) -> f64 {
        self.slowest.1.bounds()[0] / self.fastest.1.bounds()[1]
    }
}

/// `None` if no two times can be told apart.
pub(super) fn fastest_and_slowest(row: &EqualError) -> Option<Ratio<'_>> {
    let times = || row.cpu_seconds.iter().map(|(name, t)| (name.as_str(), *t));
    let fastest = times().min_by(|a, b| a.1.bounds()[1].total_cmp(&b.1.bounds()[1]))?;
    let slowest = times().max_by(|a, b| a.1.bounds()[0].total_cmp(&b.1.bounds()[0]))?;
    let ratio = Ratio { fastest, slowest };
    (ratio.factor().is_finite() && ratio.factor() > 1.0).then_some(ratio)
}

/// Of all errors that two series reach, the smallest; else the smallest at which at least bounds
/// tell two series apart: who needs less time. If there is none, that is said.
fn equal_error(scene: &SceneStudy) -> Option<Finding> {
    let compared =
        scene.equal_error.iter().filter_map(|row| Some((row, fastest_and_slowest(row)?)));
    let order = |(row, ratio): &(&EqualError, Ratio<'_>)| (!ratio.is_exact(), row.rel_mse);
    let by_order = |a: &(&EqualError, Ratio<'_>), b: &(&EqualError, Ratio<'_>)| {
        let ((a_bound, a_error), (b_bound, b_error)) = (order(a), order(b));
        a_bound.cmp(&b_bound).then(a_error.total_cmp(&b_error))
    };
    let Some((row, ratio)) = compared.min_by(by_order) else {
        let any = !scene.equal_error.is_empty();
        let text = "No two methods reach the same relMSE, so that times at equal error cannot be compared.";
        return any.then(|| finding("equal-error", text.into()));
    };
    let name = |(name, _): (&str, TimeToError)| label(scene, name).to_owned();
    let mut text = format!(
        "To a relMSE of {}, {} {} of CPU time and {} {}: {}{} times less.",
        number::round_number(row.rel_mse),
        name(ratio.fastest),
        took(ratio.fastest.1),
        name(ratio.slowest),
        took(ratio.slowest.1),
        if ratio.is_exact() { "" } else { "more than " },
        number::times(ratio.factor()),
    );
    let others: Vec<String> = (row.cpu_seconds.iter())
        .filter(|(n, _)| n != ratio.fastest.0 && n != ratio.slowest.0)
        .map(|(n, t)| format!("{} {}", label(scene, n), took(*t)))
        .collect();
    if !others.is_empty() {
        text += &format!(" {}.", list(&others));
    }
    Some(finding("equal-error", text))
}

fn took(time: TimeToError) -> String {
    match time {
        TimeToError::Reached(t) => format!("took {}", number::seconds(t)),
        TimeToError::AtMost(t) => format!("took at most {}", number::seconds(t)),
        TimeToError::NotIn(t) => format!("was not there in {}", number::seconds(t)),
        TimeToError::Unknown => "has no settings to tell".into(),
    }
}

/// In the longest of the equal times: who has the smallest error, and how much more the others.
fn equal_time(scene: &SceneStudy) -> Option<Finding> {
    let longest = scene.equal_time.iter().max_by(|a, b| a.seconds.total_cmp(&b.seconds))?;
    let error = |(series, _, setting): &(&Series, usize, &Setting)| {
        let error = setting.summary.as_ref()?.rel_mse.median;
        (error > 0.0).then(|| (series.label.clone(), error))
    };
    let mut errors: Vec<(String, f64)> =
        contenders(scene, longest).iter().filter_map(error).collect();
    errors.sort_by(|a, b| a.1.total_cmp(&b.1));
    let [(best, least), others @ ..] = &errors[..] else { return None };
    let other = |(name, error): &(String, f64)| {
        let times = number::times(error / least);
        format!("{name} {} ({times} times as much)", number::scientific(*error))
    };
    let others = list(&others.iter().map(other).collect::<Vec<_>>());
    let text = format!(
        "In about {}\u{202f}s of wall-clock time, {best} reached a relMSE of {}{}{others}.",
        number::plain(longest.seconds),
        number::scientific(*least),
        if others.is_empty() { "" } else { ", " },
    );
    Some(finding("equal-time", text))
}

fn measured(scene: &SceneStudy) -> impl Iterator<Item = (&Series, &Setting, &Summary)> {
    scene.series.iter().flat_map(|series| {
        series.settings.iter().filter_map(move |s| Some((series, s, s.summary.as_ref()?)))
    })
}

fn best(scene: &SceneStudy) -> Option<Finding> {
    let (series, setting, summary) = measured(scene)
        .filter(|m| m.2.rel_mse.median.is_finite())
        .min_by(|a, b| a.2.rel_mse.median.total_cmp(&b.2.rel_mse.median))?;
    let (who, time) = (
        format!("{} ({})", series.label, setting.label),
        number::seconds(summary.cpu_seconds.median),
    );
    let (error, floor) = (summary.rel_mse.median, scene.reference.rel_mse);
    let text = if error > floor {
        let error = number::scientific(error);
        format!("The smallest relMSE of all, {error}, was that of {who} in {time} of CPU time.")
    } else {
        let floor = number::scientific(floor);
        format!(
            "The smallest relMSE of all was that of {who} in {time} of CPU time: it is below that \
             of the reference, {floor}, and cannot be told exactly."
        )
    };
    Some(finding("settings", text))
}

fn bias(scene: &SceneStudy) -> Option<Finding> {
    let by_bias =
        |a: &(_, _, &Summary), b: &(_, _, &Summary)| a.2.bias.median.total_cmp(&b.2.bias.median);
    let finite = || measured(scene).filter(|m| m.2.bias.median.is_finite());
    let (low, high) = (finite().min_by(by_bias)?, finite().max_by(by_bias)?);
    if std::ptr::eq(low.1, high.1) {
        return None;
    }
    let one = |(series, setting, summary): (&Series, &Setting, &Summary)| {
        let bias = number::percent(summary.bias.median, true);
        format!("{bias} ({}, {})", series.label, setting.label)
    };
    Some(finding("settings", format!("The bias lay between {} and {}.", one(low), one(high))))
}

fn slopes(scene: &SceneStudy) -> Option<Finding> {
    let one = |series: &Series| {
        let slope = series.slope?;
        let [exponent, low, high] =
            [slope.exponent, slope.low, slope.high].map(|v| format!("{v:.2}").replace('-', "−"));
        Some(format!("{} with time to the power {exponent} [{low}, {high}]", series.label))
    };
    let all: Vec<String> = scene.series.iter().filter_map(one).collect();
    let text = format!("The relMSE fell: {} (95 % intervals in brackets).", all.join("; "));
    (!all.is_empty()).then(|| finding("charts", text))
}

fn reference(scene: &SceneStudy) -> Option<Finding> {
    let floor = scene.reference.rel_mse;
    let below = measured(scene).filter(|m| m.2.rel_mse.median < floor).count();
    let text = format!(
        "The reference itself has a relMSE of about {}. {} below it: the measure is free of the \
         reference's noise in the mean, but such small errors are uncertain.",
        number::scientific(floor),
        if below == 1 { "One setting lies".into() } else { format!("{below} settings lie") },
    );
    (floor > 0.0 && below > 0).then(|| finding("reference", text))
}

fn failures(scene: &SceneStudy) -> Option<Finding> {
    let failed: Vec<String> = scene
        .series
        .iter()
        .flat_map(|series| series.settings.iter().map(move |setting| (series, setting)))
        .filter(|(_, setting)| !setting.failures.is_empty())
        .map(|(series, setting)| format!("{} ({})", series.label, setting.label))
        .collect();
    let text = format!("Not all runs finished: some of {} failed.", list(&failed));
    (!failed.is_empty()).then(|| finding("failures", text))
}

/// `a`, `a and b`, `a, b and c`.
pub(super) fn list(items: &[String]) -> String {
    match items {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// What was compared, for the head of the report: `Path tracing (7 settings) and …`.
pub(super) fn compared(scene: &SceneStudy) -> String {
    let one = |series: &Series| {
        let n = series.settings.len();
        let what = match (&series.kind, n) {
            (SeriesKind::Steps, 1) => "step",
            (SeriesKind::Steps, _) => "steps",
            (SeriesKind::EqualTime, 1) => "setting of equal time",
            (SeriesKind::EqualTime, _) => "settings of equal time",
            (SeriesKind::Sweep { .. }, 1) => "setting",
            (SeriesKind::Sweep { .. }, _) => "settings",
        };
        format!("{} ({n} {what})", series.label)
    };
    list(&scene.series.iter().map(one).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::testing::{scene, series, summary};
    use crate::study::Slope;
    use crate::study::TimeToError::{AtMost, NotIn, Reached, Unknown};

    fn two() -> SceneStudy {
        let path = vec![Some(summary(10.0, 1e-2, 0.001)), Some(summary(40.0, 2.5e-3, 0.0)), None];
        let cache = vec![Some(summary(2.0, 1e-3, -0.012))];
        scene(vec![series("path", "Path tracing", path), series("ic", "Caching", cache)])
    }

    #[test]
    fn times_at_equal_error_are_those_of_the_smallest_error_that_two_reach() {
        let mut scene = two();
        let row = |rel_mse, path, ic| EqualError {
            rel_mse,
            cpu_seconds: vec![("path".into(), path), ("ic".into(), ic), ("x".into(), Unknown)],
        };
        scene.equal_error = vec![
            row(1e-2, Reached(10.0), Reached(1.0)),
            row(1e-3, Reached(148.0), Reached(2.1)),
            row(1e-4, NotIn(200.0), Reached(9.0)),
        ];
        let text_of =
            |scene: &SceneStudy| equal_error(scene).unwrap().text.replace('\u{202f}', " ");
        assert_eq!(
            text_of(&scene),
            "To a relMSE of 10⁻³, Caching took 2.10 s of CPU time and Path tracing took 148 s: \
             70 times less. x has no settings to tell."
        );
        scene.equal_error.drain(..2);
        assert!(text_of(&scene).contains(
            "Caching took 9.00 s of CPU time and Path tracing was not there in 200 s: more than 22 times less."
        ));
        scene.equal_error = vec![row(1e-4, Reached(200.0), AtMost(9.0))];
        assert!(text_of(&scene).contains("Caching took at most 9.00 s of CPU time"));
        // Neither is known to be faster.
        scene.equal_error = vec![row(1e-4, NotIn(1.0), AtMost(9.0))];
        assert!(text_of(&scene).starts_with("No two methods reach"));
    }

    #[test]
    fn in_equal_time_the_errors_are_set_against_each_other() {
        let mut scene = two();
        let entries =
            vec![("path".into(), 0), ("ic".into(), 0), ("path".into(), 9), ("no".into(), 0)];
        scene.equal_time = vec![EqualTime { seconds: 2.0, entries }];
        let text = equal_time(&scene).unwrap().text.replace('\u{202f}', " ");
        assert!(text.contains("Caching reached a relMSE of 1.00 × 10⁻³"), "{text}");
        assert!(text.ends_with("Path tracing 1.00 × 10⁻² (10 times as much)."), "{text}");
    }

    #[test]
    fn the_rest_is_said_as_it_is_measured() {
        let mut scene = two();
        scene.series[0].slope = Some(Slope { exponent: -0.98, low: -1.01, high: -0.95 });
        let all = of_scene(&scene);
        let text =
            all.iter().map(|f| f.text.replace('\u{202f}', " ")).collect::<Vec<_>>().join("\n");
        assert!(text.contains("1.00 × 10⁻³, was that of Caching (s0) in 2.00 s"), "{text}");
        assert!(
            text.contains("between −1.20 % (Caching, s0) and +0.100 % (Path tracing, s0)"),
            "{text}"
        );
        assert!(
            text.contains("Path tracing with time to the power −0.98 [−1.01, −0.95]"),
            "{text}"
        );
        assert!(text.contains("some of Path tracing (s2) failed"), "{text}");
        assert!(of_scene(&super::super::testing::scene(Vec::new())).is_empty());
    }
}
