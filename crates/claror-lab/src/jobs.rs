//! All runs of a plan that can be known before the first one is made.

use crate::error::LabError;
use crate::lab::{Job, Naming, Options, SceneInfo, arguments, finished};
use crate::order::interleaved;
use crate::plan::SeriesPlan;
use crate::reference;
use crate::settings::{Choice, SettingPlan, settings};
use crate::study::SeriesKind;

/// A series of a scene with its jobs.
#[derive(Debug, Clone)]
pub struct SeriesJobs {
    /// Index of the scene.
    pub scene: usize,
    /// Index in the plan.
    pub series: usize,
    /// What varies.
    pub kind: SeriesKind,
    /// Settings, each with a job per seed.
    pub settings: Vec<(SettingPlan, Vec<Job>)>,
}

/// What a run of a series is called, and what it sets.
pub(crate) struct Described<'a> {
    pub(crate) scene: usize,
    pub(crate) series: &'a str,
    pub(crate) setting: &'a str,
    pub(crate) choice: &'a Choice,
}

impl Described<'_> {
    pub(crate) fn job(
        &self,
        options: &Options,
        scenes: &[SceneInfo],
        naming: &Naming,
        seed: u64,
    ) -> Job {
        let scene = &scenes[self.scene];
        let mut job = Job {
            id: String::new(),
            scene: self.scene,
            label: format!("{}, {}, seed {seed}", self.series, self.setting),
            seed,
            choice: self.choice.clone(),
        };
        if scenes.len() > 1 {
            job.label = format!("{}: {}", scene.name, job.label);
        }
        let arguments = arguments(options, scene, &job);
        let seed = format!("s{seed}");
        job.id = naming.id(&[&scene.name, self.series, self.setting, &seed], scene, &arguments);
        job
    }
}

/// All series of all scenes.
pub(crate) fn all(options: &Options, scenes: &[SceneInfo], naming: &Naming) -> Vec<SeriesJobs> {
    let plan = &options.plan.plan;
    let of = |(scene, series): (usize, usize)| {
        let entry: &SeriesPlan = &plan.series[series];
        let seeds = entry.seeds.as_ref().unwrap_or(&plan.seeds);
        let (kind, found) = settings(plan, entry);
        let with_jobs = |setting: SettingPlan| {
            let described = Described {
                scene,
                series: entry.name.get_ref(),
                setting: &setting.label,
                choice: &setting.choice,
            };
            let jobs = seeds.iter().map(|&seed| described.job(options, scenes, naming, seed));
            let jobs = jobs.collect();
            (setting, jobs)
        };
        SeriesJobs { scene, series, kind, settings: found.into_iter().map(with_jobs).collect() }
    };
    let pairs = (0..scenes.len()).flat_map(|scene| (0..plan.series.len()).map(move |s| (scene, s)));
    pairs.map(of).collect()
}

/// The jobs in the order in which they are run, each with its round.
pub(crate) fn ordered(series: &[SeriesJobs]) -> Vec<&Job> {
    let settings = series.iter().flat_map(|series| &series.settings);
    let jobs: Vec<(usize, &Job)> = settings.flat_map(|(_, jobs)| jobs.iter().enumerate()).collect();
    let order = interleaved(jobs.iter().map(|(round, job)| (*round, job.id.as_str())));
    order.into_iter().map(|at| jobs[at].1).collect()
}

/// One line of what would be done.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlannedRun {
    /// See [`Job::id`].
    pub id: String,
    /// See [`Job::label`].
    pub label: String,
    /// Options of `claror render`, but for the files.
    pub arguments: Vec<String>,
    /// Whether it is there already.
    pub done: bool,
}

/// What an experiment would do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outlook {
    /// Name of each scene, and whether its reference is there already.
    pub references: Vec<(String, bool)>,
    /// All runs in order.
    pub runs: Vec<PlannedRun>,
    /// What follows and depends on what runs before take.
    pub later: Vec<String>,
}

/// What an experiment would do; nothing is written.
///
/// # Errors
/// If the program cannot be read.
pub fn outlook(options: &Options, scenes: &[SceneInfo]) -> Result<Outlook, LabError> {
    let naming = Naming::new(options)?;
    let series = all(options, scenes, &naming);
    let planned = |job: &Job| PlannedRun {
        id: job.id.clone(),
        label: job.label.clone(),
        arguments: arguments(options, &scenes[job.scene], job),
        done: finished(&options.folder.join("runs").join(&job.id)).is_some(),
    };
    let plan = &options.plan.plan;
    let mut later = Vec::new();
    let illustrated = plan.series.iter().filter(|series| series.illustrate);
    let pictures: usize = illustrated.map(|series| settings(plan, series).1.len()).sum();
    if pictures > 0 {
        later.push(format!("{} runs for further pictures", pictures * scenes.len()));
    }
    for equal in &plan.equal_time {
        let times = equal.times.iter().map(|time| format!("{} s", time.0 * options.time_scale));
        let names = equal.contenders.iter().map(|c| c.series.get_ref().as_str());
        later.push(format!(
            "equal time ({}): {}",
            times.collect::<Vec<_>>().join(", "),
            names.collect::<Vec<_>>().join(", ")
        ));
    }
    if let Some(lookups) = &plan.lookups {
        later.push(format!("look-ups in caches of {:?} records", lookups.records));
    }
    let there = |scene: &SceneInfo| (scene.name.clone(), reference::is_there(options, scene));
    Ok(Outlook {
        references: scenes.iter().map(there).collect(),
        runs: ordered(&series).into_iter().map(planned).collect(),
        later,
    })
}
