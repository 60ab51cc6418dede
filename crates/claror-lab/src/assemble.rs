//! From runs on disk to a study: errors against the reference, statistics.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::equal_time::{Contest, Tried};
use crate::error::LabError;
use crate::folder::{read_json, write_json};
use crate::jobs::SeriesJobs;
use crate::lab::{Job, Lab, Measurement, PICTURE, RunResult, SceneInfo};
use crate::reference::{self, Loaded};
use crate::statistics::{series_slope, summary, time_and_error, time_to_error};
use crate::study::{
    EqualError, EqualTime, Errors, Illustration, LookupCost, Run, SceneStudy, Series, SeriesKind,
    Setting, Study,
};
use crate::{machine, measure};

/// All that was run.
pub(crate) struct Findings {
    /// When the experiment began, if no run says earlier.
    pub(crate) started: String,
    /// Runs by name.
    pub(crate) results: BTreeMap<String, RunResult>,
    /// Further pictures by the name of the setting's first run.
    pub(crate) illustrations: BTreeMap<String, Result<Vec<Illustration>, String>>,
    /// For each scene and each comparison at equal time the contenders.
    pub(crate) contests: Vec<Vec<Vec<Contest>>>,
    /// For each scene costs and failures.
    pub(crate) lookups: Vec<(Vec<LookupCost>, Vec<String>)>,
}

/// Errors of a run, and of which reference they are.
#[derive(Debug, Serialize, Deserialize)]
struct Measured {
    reference: String,
    errors: Errors,
}

const ERRORS: &str = "errors.json";

/// The study; `counts` gets the number of runs and of failures.
pub(crate) fn study(
    lab: &Lab,
    series: &[SeriesJobs],
    mut findings: Findings,
    counts: &RefCell<(usize, usize)>,
) -> Result<Study, LabError> {
    let options = lab.options;
    let plan = &options.plan.plan;
    let mut scenes = Vec::new();
    for (index, scene) in lab.scenes.iter().enumerate() {
        let reference = reference::obtain(lab, scene)?;
        let maker = Maker { lab, scene, reference, counts };
        let own = series.iter().filter(|series| series.scene == index);
        let contests = std::mem::take(&mut findings.contests[index]);
        let lookups = std::mem::take(&mut findings.lookups[index]);
        scenes.push(maker.scene(own, &findings, contests, lookups)?);
    }
    let all = scenes.iter().flat_map(|scene| &scene.series).flat_map(|series| &series.settings);
    let started = all.flat_map(|setting| &setting.runs).map(|run| &run.started).min();
    let started = started.cloned().unwrap_or(findings.started);
    let threads = plan.threads.map_or_else(machine::cores, usize::from);
    Ok(Study {
        title: plan.title.clone(),
        plan: options.plan.name.clone(),
        about: plan.about.clone(),
        plan_text: options.plan.text.clone(),
        command: options.command.clone(),
        started,
        machine: machine::machine(threads),
        scenes,
    })
}

/// Makes the study of a scene.
struct Maker<'a> {
    lab: &'a Lab<'a>,
    scene: &'a SceneInfo,
    reference: Loaded,
    counts: &'a RefCell<(usize, usize)>,
}

impl Maker<'_> {
    fn scene<'s>(
        &self,
        own: impl Iterator<Item = &'s SeriesJobs>,
        findings: &Findings,
        contests: Vec<Vec<Contest>>,
        (lookups, lookup_failures): (Vec<LookupCost>, Vec<String>),
    ) -> Result<SceneStudy, LabError> {
        let plan = &self.lab.options.plan.plan;
        let mut series =
            own.map(|jobs| self.series(jobs, findings)).collect::<Result<Vec<_>, _>>()?;
        let equal_error = equal_error(plan.equal_error.as_ref().map(|e| &e.rel_mse[..]), &series);
        let mut equal_time = Vec::new();
        for (equal, contests) in plan.equal_time.iter().zip(contests) {
            for (at, time) in equal.times.iter().enumerate() {
                let chosen = |c: &Contest| Some((c.name.clone(), c.chosen[at]?));
                let entries = contests.iter().filter_map(chosen).collect();
                let seconds = time.0 * self.lab.options.time_scale;
                equal_time.push(EqualTime { seconds, entries });
            }
            for contest in contests {
                series.push(self.contest(contest)?);
            }
        }
        if !lookup_failures.is_empty() {
            series.push(self.failed_lookups(lookup_failures));
        }
        Ok(SceneStudy {
            name: self.scene.name.clone(),
            file: self.scene.file.display().to_string(),
            hash: self.scene.hash.clone(),
            size: self.scene.size,
            reference: self.reference.reference.clone(),
            series,
            equal_time,
            equal_error,
            lookups,
        })
    }

    fn series(&self, jobs: &SeriesJobs, findings: &Findings) -> Result<Series, LabError> {
        let plan = &self.lab.options.plan.plan.series[jobs.series];
        let mut settings = Vec::new();
        for (setting, jobs) in &jobs.settings {
            let missing = || Err(crate::lab::NOT_RUN.to_owned());
            let result = |job: &Job| findings.results.get(&job.id).cloned().unwrap_or_else(missing);
            let results = jobs.iter().map(|job| (Some(job.seed), result(job)));
            let (runs, mut failures) = self.runs(results)?;
            let pictures = jobs.first().and_then(|job| findings.illustrations.get(&job.id));
            let illustrations = match pictures {
                Some(Ok(found)) => found.clone(),
                Some(Err(message)) => {
                    failures.push(message.clone());
                    Vec::new()
                }
                None => Vec::new(),
            };
            let (label, note) = (setting.label.clone(), setting.note.clone());
            settings.push(Setting {
                summary: summary(&runs),
                illustrations,
                ..self.setting(label, note, setting.x, runs, failures)
            });
        }
        let mut series = Series {
            name: plan.name.get_ref().clone(),
            label: plan.label().to_owned(),
            note: plan.note.clone(),
            kind: jobs.kind.clone(),
            settings,
            slope: None,
        };
        series.slope = series_slope(&series);
        Ok(series)
    }

    fn contest(&self, contest: Contest) -> Result<Series, LabError> {
        let mut settings = Vec::new();
        for tried in contest.settings {
            let Tried { label, note, seconds, results } = tried;
            let results = results.into_iter().map(|(job, result)| (job.map(|j| j.seed), result));
            let (runs, failures) = self.runs(results)?;
            settings.push(self.setting(label, note, Some(seconds), runs, failures));
        }
        let (name, label, note) = (contest.name, contest.label, contest.note);
        Ok(Series { name, label, note, kind: SeriesKind::EqualTime, settings, slope: None })
    }

    /// Look-ups that could not be timed, as a series without runs.
    fn failed_lookups(&self, failures: Vec<String>) -> Series {
        let setting =
            self.setting("look-ups".to_owned(), String::new(), None, Vec::new(), failures);
        Series {
            name: "lookups".to_owned(),
            label: "Look-ups".to_owned(),
            note: String::new(),
            kind: SeriesKind::Steps,
            settings: vec![setting],
            slope: None,
        }
    }

    fn setting(
        &self,
        label: String,
        note: String,
        x: Option<f64>,
        runs: Vec<Run>,
        failures: Vec<String>,
    ) -> Setting {
        let mut counts = self.counts.borrow_mut();
        counts.0 += runs.len();
        counts.1 += failures.len();
        let summary = summary(&runs);
        Setting { label, note, x, runs, summary, illustrations: Vec::new(), failures }
    }

    /// Runs with their errors, and why others are missing: a message of several seeds once.
    fn runs(
        &self,
        results: impl Iterator<Item = (Option<u64>, RunResult)>,
    ) -> Result<(Vec<Run>, Vec<String>), LabError> {
        let (mut runs, mut failed) = (Vec::new(), Vec::<(String, Vec<String>)>::new());
        for (seed, result) in results {
            let with_errors = match result {
                Ok(found) => self.with_errors(found)?,
                Err(message) => Err(message),
            };
            match with_errors {
                Ok(run) => runs.push(run),
                Err(message) => {
                    let seed = seed.map(|seed| seed.to_string());
                    match failed.iter_mut().find(|(other, _)| *other == message) {
                        Some((_, seeds)) => seeds.extend(seed),
                        None => failed.push((message, seed.into_iter().collect())),
                    }
                }
            }
        }
        runs.sort_by_key(|run| run.seed);
        let tell = |(message, seeds): (String, Vec<String>)| match &seeds[..] {
            [] => message,
            [seed] => format!("seed {seed}: {message}"),
            seeds => format!("seeds {}: {message}", seeds.join(", ")),
        };
        Ok((runs, failed.into_iter().map(tell).collect()))
    }

    fn with_errors(&self, found: Measurement) -> Result<Result<Run, String>, LabError> {
        let folder = self.lab.folder.path(&found.id);
        let errors = match self.errors(&folder)? {
            Ok(errors) => errors,
            Err(message) => return Ok(Err(message)),
        };
        Ok(Ok(Run {
            picture: Path::new("runs").join(&found.id).join(PICTURE),
            id: found.id,
            seed: found.seed,
            command: found.command,
            started: found.started,
            load: found.load,
            seconds: found.seconds,
            cpu_seconds: found.cpu_seconds,
            phases: found.phases,
            peak_memory_bytes: found.peak_memory_bytes,
            records: found.records,
            spp: found.spp,
            rays: found.rays,
            errors,
            parameters: found.parameters,
        }))
    }

    /// Errors of the picture in a folder: kept ones if they are of this reference.
    fn errors(&self, folder: &Path) -> Result<Result<Errors, String>, LabError> {
        let note = folder.join(ERRORS);
        if let Some(kept) = read_json::<Measured>(&note)
            && kept.reference == self.reference.key
        {
            return Ok(Ok(kept.errors));
        }
        let picture = match measure::read(&folder.join(PICTURE)) {
            Ok(picture) => picture,
            Err(message) => return Ok(Err(message)),
        };
        match self.reference.picture.errors(&picture) {
            Ok(errors) => {
                let reference = self.reference.key.clone();
                write_json(&note, &Measured { reference, errors })?;
                Ok(Ok(errors))
            }
            Err(error) => Ok(Err(error.to_string())),
        }
    }
}

/// For each error the time that sweeps need to reach it.
fn equal_error(wanted: Option<&[f64]>, series: &[Series]) -> Vec<EqualError> {
    let sweeps = series.iter().filter(|series| matches!(series.kind, SeriesKind::Sweep { .. }));
    let curves: Vec<_> =
        sweeps.map(|series| (series.name.clone(), time_and_error(&series.settings))).collect();
    let times = |error: f64| {
        curves.iter().map(|(name, points)| (name.clone(), time_to_error(points, error))).collect()
    };
    let of = |&rel_mse: &f64| EqualError { rel_mse, cpu_seconds: times(rel_mse) };
    wanted.unwrap_or_default().iter().map(of).collect()
}
