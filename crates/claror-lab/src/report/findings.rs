//! What the numbers say, in plain sentences. Each sentence repeats rows of the report and links to
//! them; nothing is said that is not there.

use super::number;
use crate::study::{EqualError, EqualTime, SceneStudy, Series, SeriesKind, Setting, Summary};

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

/// Of all errors that two series reach, the smallest: who needs less time. If no error is reached
/// by two series, that is said.
fn equal_error(scene: &SceneStudy) -> Option<Finding> {
    let bracketed = |row: &EqualError| row.cpu_seconds.iter().filter(|(_, t)| t.is_some()).count();
    let by_error = |a: &&EqualError, b: &&EqualError| a.rel_mse.total_cmp(&b.rel_mse);
    let Some(row) = scene.equal_error.iter().filter(|row| bracketed(row) >= 2).min_by(by_error)
    else {
        let any = !scene.equal_error.is_empty();
        let text = "No two methods bracket the same relMSE, so that times at equal error cannot be compared.";
        return any.then(|| finding("equal-error", text.into()));
    };
    let mut times: Vec<(&str, f64)> =
        row.cpu_seconds.iter().filter_map(|(name, t)| Some((label(scene, name), (*t)?))).collect();
    times.sort_by(|a, b| a.1.total_cmp(&b.1));
    let [(first, least), .., (last, most)] = times[..] else { return None };
    let mut text = format!(
        "To a relMSE of {}, {first} took {} of CPU time and {last} {}: {} times less.",
        number::round_number(row.rel_mse),
        number::seconds(least),
        number::seconds(most),
        number::times(most / least),
    );
    let between: Vec<String> = times[1..times.len() - 1]
        .iter()
        .map(|(name, t)| format!("{name} took {}", number::seconds(*t)))
        .collect();
    if !between.is_empty() {
        text += &format!(" Between them, {}.", list(&between));
    }
    let missing: Vec<String> = (row.cpu_seconds.iter())
        .filter(|(_, t)| t.is_none())
        .map(|(name, _)| label(scene, name).to_owned())
        .collect();
    if !missing.is_empty() {
        let verb = if missing.len() == 1 { "does" } else { "do" };
        text +=
            &format!(" {} {verb} not bracket this error and cannot be compared.", list(&missing));
    }
    Some(finding("equal-error", text))
}

/// In the longest of the equal times: who has the smallest error.
fn equal_time(scene: &SceneStudy) -> Option<Finding> {
    let longest = scene.equal_time.iter().max_by(|a, b| a.seconds.total_cmp(&b.seconds))?;
    let error = |(series, _, setting): &(&Series, usize, &Setting)| {
        let error = setting.summary.as_ref()?.rel_mse.median;
        (error > 0.0).then(|| (series.label.clone(), error))
    };
    let mut errors: Vec<(String, f64)> =
        contenders(scene, longest).iter().filter_map(error).collect();
    errors.sort_by(|a, b| a.1.total_cmp(&b.1));
    let [(best, least), .., (worst, most)] = &errors[..] else { return None };
    let text = format!(
        "In about {}\u{202f}s of wall-clock time, {best} reached a relMSE of {} and {worst} {}: {} times as much.",
        number::plain(longest.seconds),
        number::scientific(*least),
        number::scientific(*most),
        number::times(most / least),
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
            (SeriesKind::EqualTime, 1) => "time",
            (SeriesKind::EqualTime, _) => "times",
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
            cpu_seconds: vec![("path".into(), path), ("ic".into(), ic), ("x".into(), None)],
        };
        scene.equal_error = vec![
            row(1e-2, Some(10.0), Some(1.0)),
            row(1e-3, Some(148.0), Some(2.1)),
            row(1e-4, None, Some(9.0)),
        ];
        let text = equal_error(&scene).unwrap().text;
        assert_eq!(
            text.replace('\u{202f}', " "),
            "To a relMSE of 10⁻³, Caching took 2.10 s of CPU time and Path tracing 148 s: 70 times less. \
             x does not bracket this error and cannot be compared."
        );
        scene.equal_error.truncate(0);
        scene.equal_error.push(row(1e-4, None, Some(9.0)));
        assert!(equal_error(&scene).unwrap().text.starts_with("No two methods bracket"));
    }

    #[test]
    fn in_equal_time_the_errors_are_set_against_each_other() {
        let mut scene = two();
        let entries =
            vec![("path".into(), 0), ("ic".into(), 0), ("path".into(), 9), ("no".into(), 0)];
        scene.equal_time = vec![EqualTime { seconds: 2.0, entries }];
        let text = equal_time(&scene).unwrap().text.replace('\u{202f}', " ");
        assert!(text.contains("Caching reached a relMSE of 1.00 × 10⁻³"), "{text}");
        assert!(text.ends_with("Path tracing 1.00 × 10⁻²: 10 times as much."), "{text}");
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
