//! From a plan's series to the settings that are run: sweeps, combinations and steps.

use crate::plan::{Assignments, OneOrMany, Plan, Scalar, SeriesPlan, StepPlan};
use crate::study::SeriesKind;

/// One command line, but for scene, seed and files.
#[derive(Debug, Clone, PartialEq)]
pub struct SettingPlan {
    /// See [`crate::study::Setting::label`].
    pub label: String,
    /// See [`crate::study::Setting::note`].
    pub note: String,
    /// See [`crate::study::Setting::x`].
    pub x: Option<f64>,
    /// What it sets.
    pub choice: Choice,
}

/// What a setting says to the renderer.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Choice {
    /// Name of the integrator; the scene's if not given.
    pub integrator: Option<String>,
    /// Samples per pixel; the scene's if not given.
    pub spp: Option<u32>,
    /// Wall-clock seconds after which it stops.
    pub seconds: Option<f64>,
    /// Parameters.
    pub set: Assignments,
}

impl Choice {
    /// As options of `claror render`.
    pub fn arguments(&self) -> Vec<String> {
        let mut arguments = Vec::new();
        let mut add = |name: &str, value: String| arguments.extend([name.to_owned(), value]);
        if let Some(integrator) = &self.integrator {
            add("-i", integrator.clone());
        }
        if let Some(spp) = self.spp {
            add("--spp", spp.to_string());
        }
        if let Some(seconds) = self.seconds {
            add("--time", format!("{seconds}s"));
        }
        for (name, Scalar(value)) in &self.set.0 {
            add("-p", format!("{name}={value}"));
        }
        arguments
    }

    /// What a series sets before it varies anything.
    pub fn of_series(plan: &Plan, series: &SeriesPlan) -> Self {
        let mut set = plan.set.clone();
        set.extend(&series.set);
        let spp = match series.spp {
            Some(OneOrMany::One(spp)) => Some(spp),
            _ => None,
        };
        Self { integrator: series.integrator.clone(), spp, seconds: None, set }
    }
}

/// What varies in a series, and its settings in order.
pub fn settings(plan: &Plan, series: &SeriesPlan) -> (SeriesKind, Vec<SettingPlan>) {
    let base = Choice::of_series(plan, series);
    if !series.steps.is_empty() {
        return (SeriesKind::Steps, steps(&base, series));
    }
    let mut varied: Vec<(String, Vec<Scalar>)> = Vec::new();
    if let Some(OneOrMany::Many(counts)) = &series.spp {
        let counts = counts.iter().map(|spp| Scalar(spp.to_string())).collect();
        varied.push((SPP.to_owned(), counts));
    }
    varied.extend(series.vary.0.iter().cloned());
    let kind = match &varied[..] {
        [(name, values)] if values.iter().all(|value| value.number().is_some()) => {
            SeriesKind::Sweep { parameter: name.clone() }
        }
        _ => SeriesKind::Steps,
    };
    let combinations = combinations(&varied);
    let settings = combinations.iter().map(|values| {
        let mut choice = base.clone();
        for (name, value) in values {
            match value.0.parse() {
                Ok(spp) if name == SPP => choice.spp = Some(spp),
                _ => choice.set.set(name, value.clone()),
            }
        }
        let x = match (&kind, &values[..]) {
            (SeriesKind::Sweep { .. }, [(_, value)]) => value.number(),
            _ => None,
        };
        let label = values.iter().map(|(name, value)| value_label(name, value));
        let label = label.collect::<Vec<_>>().join(", ");
        let label = if label.is_empty() { series.label().to_owned() } else { label };
        SettingPlan { label, note: String::new(), x, choice }
    });
    let settings = settings.collect();
    (kind, settings)
}

const SPP: &str = "spp";

/// `16 spp`, `accuracy=0.1`.
fn value_label(name: &str, Scalar(value): &Scalar) -> String {
    if name == SPP {
        return format!("{value} spp");
    }
    format!("{}={value}", name.strip_prefix("integrator.").unwrap_or(name))
}

/// All combinations; the last parameter varies fastest. Of no parameters there is one.
fn combinations(varied: &[(String, Vec<Scalar>)]) -> Vec<Vec<(String, Scalar)>> {
    let mut all = vec![Vec::new()];
    for (name, values) in varied {
        let longer = |start: &Vec<(String, Scalar)>| -> Vec<Vec<(String, Scalar)>> {
            let end = |value: &Scalar| [&start[..], &[(name.clone(), value.clone())]].concat();
            values.iter().map(end).collect()
        };
        all = all.iter().flat_map(longer).collect();
    }
    all
}

fn steps(base: &Choice, series: &SeriesPlan) -> Vec<SettingPlan> {
    let mut start = base.clone();
    let step = |step: &StepPlan| {
        let mut choice = start.clone();
        choice.integrator = step.integrator.clone().or(choice.integrator);
        choice.spp = step.spp.or(choice.spp);
        choice.set.extend(&step.set);
        if series.cumulative {
            start = choice.clone();
        }
        SettingPlan { label: step.label.clone(), note: step.note.clone(), x: None, choice }
    };
    series.steps.iter().map(step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::PlanFile;

    fn all(text: &str) -> Vec<(SeriesKind, Vec<SettingPlan>)> {
        let plan = PlanFile::parse("test.toml", text).expect("a good plan").plan;
        plan.series.iter().map(|series| settings(&plan, series)).collect()
    }

    fn labels(settings: &[SettingPlan]) -> Vec<&str> {
        settings.iter().map(|setting| setting.label.as_str()).collect()
    }

    fn line(setting: &SettingPlan) -> String {
        setting.choice.arguments().join(" ")
    }

    #[test]
    fn a_sweep_has_numbers() {
        let found = all("title = 't'\nset = { max_depth = 8 }\n[[series]]\nname = 'p'\n\
                         integrator = 'path'\nspp = [4, 16]");
        let (kind, settings) = &found[0];
        assert_eq!(*kind, SeriesKind::Sweep { parameter: "spp".into() });
        assert_eq!(labels(settings), ["4 spp", "16 spp"]);
        assert_eq!(settings[1].x, Some(16.0));
        assert_eq!(line(&settings[1]), "-i path --spp 16 -p integrator.max_depth=8");
    }

    #[test]
    fn several_parameters_make_all_combinations_in_the_order_of_the_file() {
        let found = all("title = 't'\n[[series]]\nname = 's'\nspp = 2\nset = { index = 'bvh' }\n\
                         vary = { error = [0.1, 0.05], criterion = ['ward88', 'hessian'] }");
        let (kind, settings) = &found[0];
        assert_eq!(*kind, SeriesKind::Steps);
        assert_eq!(settings.len(), 4);
        assert_eq!(settings[1].label, "error=0.1, criterion=hessian");
        assert_eq!(
            line(&settings[2]),
            "--spp 2 -p integrator.index=bvh -p integrator.error=0.05 -p integrator.criterion=ward88"
        );
    }

    #[test]
    fn steps_begin_with_the_series_or_with_the_step_before() {
        let text = |cumulative: bool| {
            format!(
                "title = 't'\n[[series]]\nname = 's'\nintegrator = 'irrcache'\nset = {{ error = 0.1 }}\n\
                 cumulative = {cumulative}\nsteps = [\n{{ label = 'a', set = {{ nearest = 4 }} }},\n\
                 {{ label = 'b', note = 'n', spp = 9, set = {{ error = 0.2 }} }} ]"
            )
        };
        let apart = &all(&text(false))[0].1;
        assert_eq!(line(&apart[1]), "-i irrcache --spp 9 -p integrator.error=0.2");
        let together = &all(&text(true))[0].1;
        assert_eq!(line(&together[0]), line(&apart[0]));
        assert_eq!(
            line(&together[1]),
            "-i irrcache --spp 9 -p integrator.error=0.2 -p integrator.nearest=4"
        );
        assert_eq!(together[1].note, "n");
    }

    #[test]
    fn a_series_without_anything_has_one_setting() {
        let found = all("title = 't'\n[[series]]\nname = 's'\nlabel = 'As it is'");
        assert_eq!(labels(&found[0].1), ["As it is"]);
        assert_eq!(line(&found[0].1[0]), "");
    }
}
