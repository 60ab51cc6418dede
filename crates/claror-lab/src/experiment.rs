//! A whole experiment: references, runs, pictures, equal times, look-ups, and the study of them.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::assemble::{self, Findings};
use crate::error::LabError;
use crate::forecast::Forecast;
use crate::jobs::{self, Outlook, SeriesJobs};
use crate::lab::{self, Job, Lab, Options, Progress, RunResult, Watch};
use crate::study::{Illustration, Study};
use crate::{equal_time, folder, illustrate, lookups, reference, report, tables};

/// What came of an experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// What was found.
    pub study: Study,
    /// Where the report is.
    pub report: PathBuf,
    /// Files that were written besides the report and the runs.
    pub files: Vec<PathBuf>,
    /// Runs that are in the study.
    pub runs: usize,
    /// Runs that failed or are missing, and other failures.
    pub failures: usize,
}

/// Makes the runs that are missing and puts the study together.
///
/// # Errors
/// If the experiment cannot begin, or the user stops it. Runs that fail are noted in the study.
pub fn run(options: &Options, watch: &dyn Watch) -> Result<Outcome, LabError> {
    let scenes = lab::scenes(options, watch)?;
    check_reference(options, &scenes)?;
    let lab = Lab::open(options, scenes, watch)?;
    let started = lab::now(options);
    let series = jobs::all(options, &lab.scenes, &lab.naming());
    // References first: without them nothing can be said. One is in memory at a time.
    for scene in &lab.scenes {
        reference::obtain(&lab, scene)?;
    }
    let mut findings = Findings {
        started,
        results: run_all(&lab, &series)?,
        illustrations: BTreeMap::new(),
        contests: Vec::new(),
        lookups: Vec::new(),
    };
    findings.illustrations = illustrate_all(&lab, &series, &findings.results)?;
    let plan = &options.plan.plan;
    for scene in 0..lab.scenes.len() {
        let mut contests = Vec::new();
        for (group, equal) in plan.equal_time.iter().enumerate() {
            contests.push(equal_time::run(&lab, scene, group, equal)?);
        }
        findings.contests.push(contests);
    }
    for scene in &lab.scenes {
        let found =
            plan.lookups.as_ref().map(|plan| lookups::run(&lab, scene, plan)).transpose()?;
        findings.lookups.push(found.unwrap_or_default());
    }
    finish(&lab, &series, findings)
}

/// What an experiment would do; nothing is written.
///
/// # Errors
/// If the program refuses a scene.
pub fn outlook(options: &Options, watch: &dyn Watch) -> Result<Outlook, LabError> {
    let scenes = lab::scenes(options, watch)?;
    check_reference(options, &scenes)?;
    jobs::outlook(options, &scenes)
}

/// Given pictures are read before anything is made.
fn check_reference(options: &Options, scenes: &[lab::SceneInfo]) -> Result<(), LabError> {
    let (Some(files), Some(scene)) = (&options.reference, scenes.first()) else { return Ok(()) };
    if scenes.len() > 1 {
        let message = "given reference pictures belong to one scene, and there are several";
        return Err(LabError::Usage(message.to_owned()));
    }
    reference::given(files, scene).map(|_| ())
}

/// What runs of a setting share: everything but the seed.
fn setting_of(job: &Job) -> &str {
    job.label.rsplit_once(", seed ").map_or(job.label.as_str(), |(setting, _)| setting)
}

/// All runs whose settings are known, in their order.
fn run_all(lab: &Lab, series: &[SeriesJobs]) -> Result<BTreeMap<String, RunResult>, LabError> {
    let order = jobs::ordered(series);
    let mut forecast = Forecast::default();
    for job in &order {
        if let Some(found) = lab.finished(job) {
            forecast.learn(setting_of(job), found.process_seconds);
        }
    }
    let mut results = BTreeMap::new();
    for (at, job) in order.iter().enumerate() {
        let is_new = lab.finished(job).is_none();
        let rest = order[at..].iter().filter(|job| lab.finished(job).is_none());
        let remaining = forecast.seconds(rest.map(|job| setting_of(job)));
        let this = forecast.seconds(std::iter::once(setting_of(job)));
        let show = |share: f64| {
            lab.watch.progress(&Progress {
                task: format!("run {} of {}: {}", at + 1, order.len(), job.label),
                fraction: Some((at as f64 + share) / order.len() as f64),
                remaining: remaining.zip(this).map(|(all, this)| (all - share * this).max(0.0)),
            });
        };
        if is_new && !lab.options.report_only {
            show(0.0);
        }
        let result = lab.obtain(job, &show)?;
        if let (true, Ok(found)) = (is_new, &result) {
            forecast.learn(setting_of(job), found.process_seconds);
        }
        results.insert(job.id.clone(), result);
    }
    Ok(results)
}

/// Further pictures of the series that want them, by the name of the setting's first run.
fn illustrate_all(
    lab: &Lab,
    series: &[SeriesJobs],
    results: &BTreeMap<String, RunResult>,
) -> Result<BTreeMap<String, Result<Vec<Illustration>, String>>, LabError> {
    let plan = &lab.options.plan.plan;
    let wanted = series.iter().filter(|series| plan.series[series.series].illustrate);
    let first = wanted.flat_map(|series| &series.settings).filter_map(|(_, jobs)| jobs.first());
    let first: Vec<&Job> = first.collect();
    let mut found = BTreeMap::new();
    let seconds = |job: &&Job| results.get(&job.id)?.as_ref().ok().map(|run| run.process_seconds);
    for (at, job) in first.iter().enumerate() {
        let Some(Ok(run)) = results.get(&job.id) else { continue };
        if !lab.options.report_only {
            lab.watch.progress(&Progress {
                task: format!("pictures {} of {}: {}", at + 1, first.len(), job.label),
                fraction: Some(at as f64 / first.len() as f64),
                remaining: Some(first[at..].iter().filter_map(seconds).sum()),
            });
        }
        found.insert(job.id.clone(), illustrate::obtain(lab, job, run)?);
    }
    Ok(found)
}

/// Errors, statistics, files.
fn finish(lab: &Lab, series: &[SeriesJobs], findings: Findings) -> Result<Outcome, LabError> {
    lab.watch.progress(&Progress {
        task: "comparing with the reference".to_owned(),
        fraction: None,
        remaining: None,
    });
    let counts = RefCell::new((0, 0));
    let study = assemble::study(lab, series, findings, &counts)?;
    let (runs, failures) = counts.into_inner();
    let root = lab.folder.root();
    let files = ["study.json", "results.csv", "results.jsonl"].map(|name| root.join(name)).to_vec();
    folder::write_json(&files[0], &study)?;
    folder::write(&files[1], tables::csv(&study).as_bytes())?;
    folder::write(&files[2], tables::jsonl(&study).as_bytes())?;
    let report = report::write(&study, root)?;
    Ok(Outcome { study, report, files, runs, failures })
}
