//! What is to be measured: plans in TOML.

mod check;
mod ready;
#[cfg(test)]
mod tests;
mod values;

use std::path::{Path, PathBuf};

use claror_io::diagnostic::Subject;
use claror_io::{Diagnostic, Severity};
use serde::Deserialize;
use toml::Spanned;

pub use ready::{READY, ReadyPlan};
pub(crate) use values::full_name;
pub use values::{Assignments, Duration, OneOrMany, Scalar, Size, Vary};

/// Seeds of runs stay below; those of references lie above.
pub const SEED_LIMIT: u64 = 1_000_000_000;

/// A plan: which settings of which methods are measured how often against which reference.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Title of the report.
    pub title: String,
    /// What the plan is for.
    #[serde(default)]
    pub about: String,
    /// Seeds of the sample pattern: every setting is run with each.
    #[serde(default = "one_seed", deserialize_with = "values::seeds")]
    pub seeds: Vec<u64>,
    /// Threads of each run; as many as the processor runs at once if not given.
    #[serde(default, deserialize_with = "values::threads")]
    pub threads: Option<u16>,
    /// Size of the pictures; the scene's if not given.
    #[serde(default)]
    pub size: Option<Size>,
    /// Parameters of all runs.
    #[serde(default)]
    pub set: Assignments,
    /// The picture that others are compared with.
    #[serde(default)]
    pub reference: ReferencePlan,
    /// Methods at several settings.
    #[serde(default)]
    pub series: Vec<SeriesPlan>,
    /// Pictures that may take the same time.
    #[serde(default)]
    pub equal_time: Vec<EqualTimePlan>,
    /// Errors for which the time is looked up in the series.
    #[serde(default)]
    pub equal_error: Option<EqualErrorPlan>,
    /// Sizes of caches in which a look-up is timed.
    #[serde(default)]
    pub lookups: Option<LookupsPlan>,
}

fn one_seed() -> Vec<u64> {
    vec![0]
}

/// How good the reference is.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReferencePlan {
    /// Samples per pixel of both halves together.
    #[serde(deserialize_with = "values::reference_spp")]
    pub spp: u32,
}

impl Default for ReferencePlan {
    fn default() -> Self {
        Self { spp: 4096 }
    }
}

/// One method at several settings.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SeriesPlan {
    /// Short name, unique in the plan.
    pub name: Spanned<String>,
    /// Name in charts; the short one if not given.
    #[serde(default)]
    pub label: Option<String>,
    /// What it is for.
    #[serde(default)]
    pub note: String,
    /// How light is computed; as the scene says if not given.
    #[serde(default)]
    pub integrator: Option<String>,
    /// Samples per pixel: a number for all settings, or a list that is swept.
    #[serde(default, deserialize_with = "values::some_spp")]
    pub spp: Option<OneOrMany>,
    /// Parameters of all its settings.
    #[serde(default)]
    pub set: Assignments,
    /// Parameters that are swept: all combinations.
    #[serde(default)]
    pub vary: Vary,
    /// Settings with a name each, instead of a sweep.
    #[serde(default)]
    pub steps: Vec<StepPlan>,
    /// Whether each step keeps the parameters of the steps before.
    #[serde(default)]
    pub cumulative: bool,
    /// Seeds instead of the plan's.
    #[serde(default, deserialize_with = "values::some_seeds")]
    pub seeds: Option<Vec<u64>>,
    /// Whether further pictures of each setting are made.
    #[serde(default)]
    pub illustrate: bool,
}

impl SeriesPlan {
    /// Name in charts and tables.
    pub fn label(&self) -> &str {
        self.label.as_deref().unwrap_or(self.name.get_ref())
    }
}

/// One step of a ladder of methods.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StepPlan {
    /// Name in tables.
    pub label: String,
    /// What to see in it.
    #[serde(default)]
    pub note: String,
    /// Instead of the series' integrator.
    #[serde(default)]
    pub integrator: Option<String>,
    /// Instead of the series' samples per pixel.
    #[serde(default, deserialize_with = "values::some_count")]
    pub spp: Option<u32>,
    /// Parameters on top of the series'.
    #[serde(default)]
    pub set: Assignments,
}

/// Pictures that may take the same time.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EqualTimePlan {
    /// Wall-clock times of rendering.
    pub times: Vec<Duration>,
    /// Who competes.
    pub contenders: Vec<Contender>,
}

/// A method that is made to take a given time.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contender {
    /// The series whose integrator and parameters it has.
    pub series: Spanned<String>,
    /// Parameter that is searched; without one samples are added until the time is over.
    #[serde(default)]
    pub knob: Option<Spanned<String>>,
    /// Its value where the picture takes the least time.
    #[serde(default)]
    pub from: Option<f64>,
    /// Its value where the picture takes the most time.
    #[serde(default)]
    pub to: Option<f64>,
}

/// Errors for which the time is looked up.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EqualErrorPlan {
    /// Relative mean squared errors.
    #[serde(deserialize_with = "values::positive_list")]
    pub rel_mse: Vec<f64>,
}

/// Sizes of caches in which a look-up is timed.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LookupsPlan {
    /// Records that the caches hold, about.
    #[serde(deserialize_with = "values::counts")]
    pub records: Vec<u32>,
    /// Names of the indices; all that the program knows if none are given.
    #[serde(default)]
    pub indices: Vec<String>,
}

/// A plan with the text it was read from.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanFile {
    /// Name of a ready plan, or the file as given.
    pub name: String,
    /// As it stands in the file.
    pub text: String,
    /// What it means.
    pub plan: Plan,
}

/// Why there is no plan.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PlanError {
    /// Neither a ready plan nor a file.
    #[error("there is no plan `{name}`: neither a ready one nor a file")]
    Unknown {
        /// As given.
        name: String,
        /// Names of the ready plans.
        ready: String,
    },
    /// The file says something wrong.
    #[error("{0}")]
    Wrong(Box<Diagnostic>),
    /// The file cannot be read.
    #[error("cannot read {}: {why}", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// In words.
        why: String,
    },
}

impl PlanFile {
    /// The ready plan of this name, or the plan in a file.
    ///
    /// # Errors
    /// If there is neither, or if the file is no plan.
    pub fn read(name: &str) -> Result<Self, PlanError> {
        let path = Path::new(name);
        if let Some(ready) = ReadyPlan::find(name) {
            return Self::parse(name, ready.text);
        }
        match std::fs::read_to_string(path) {
            Ok(text) => Self::parse(name, &text),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                let ready: Vec<&str> = READY.iter().map(|plan| plan.name).collect();
                Err(PlanError::Unknown { name: name.to_owned(), ready: ready.join(", ") })
            }
            Err(error) => {
                Err(PlanError::Unreadable { file: path.to_owned(), why: error.to_string() })
            }
        }
    }

    /// Understands a plan; `name` is what messages call it.
    ///
    /// # Errors
    /// If the text is no plan: the first mistake with its place.
    pub fn parse(name: &str, text: &str) -> Result<Self, PlanError> {
        let wrong = |message: String, at: Option<usize>| wrong(name, text, message, at);
        let plan: Plan = toml::from_str(text).map_err(|error| {
            wrong(error.message().to_owned(), error.span().map(|span| span.start))
        })?;
        check::check(&plan).map_err(|mistake| wrong(mistake.message, mistake.at))?;
        Ok(Self { name: name.to_owned(), text: text.to_owned(), plan })
    }
}

/// A mistake with its place; `at` counts bytes.
fn wrong(name: &str, text: &str, message: String, at: Option<usize>) -> PlanError {
    let before = at.and_then(|at| text.get(..at));
    let position = before.map(|before| {
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap_or("").chars().count() + 1;
        (line as u32, column as u32)
    });
    let excerpt = position.and_then(|(line, _)| text.lines().nth(line as usize - 1));
    PlanError::Wrong(Box::new(Diagnostic {
        severity: Severity::Error,
        subject: Subject::File,
        file: name.into(),
        position,
        message: message.trim().replace('\n', "; "),
        excerpt: excerpt.map(|line| line.chars().take(120).collect()),
        hint: Some(
            "docs/bench.md describes plans; `claror bench --print-plan NAME` shows one".to_owned(),
        ),
    }))
}
