//! Pictures that took the same time.

use crate::error::LabError;
use crate::jobs::Described;
use crate::lab::{Job, Lab, Progress, RunResult};
use crate::plan::{Contender, EqualTimePlan, Scalar, full_name};
use crate::search::{PROBES, Range};
use crate::settings::Choice;

/// A contender with what was tried.
pub(crate) struct Contest {
    /// Name of its series in the study.
    pub(crate) name: String,
    pub(crate) label: String,
    pub(crate) note: String,
    pub(crate) settings: Vec<Tried>,
    /// For each time the index of the setting that fills it.
    pub(crate) chosen: Vec<Option<usize>>,
}

/// A setting that was tried, or what is wrong.
pub(crate) struct Tried {
    pub(crate) label: String,
    pub(crate) note: String,
    /// The time that it was to take.
    pub(crate) seconds: f64,
    pub(crate) results: Vec<(Option<Job>, RunResult)>,
}

const PROBE: &str = "tried on the way to a setting that fills the time";

/// Runs all contenders of all times on a scene; times outermost, so that contenders take turns.
pub(crate) fn run(
    lab: &Lab,
    scene: usize,
    group: usize,
    plan: &EqualTimePlan,
) -> Result<Vec<Contest>, LabError> {
    let mut contests: Vec<Contest> =
        plan.contenders.iter().map(|contender| contest(lab, group, contender)).collect();
    for time in &plan.times {
        let seconds = time.0 * lab.options.time_scale;
        for (contender, contest) in plan.contenders.iter().zip(&mut contests) {
            let contestant = Contestant { lab, scene, contender, name: contest.name.clone() };
            let chosen = match (&contender.knob, contender.from, contender.to) {
                (Some(_), Some(fast), Some(slow)) => {
                    contestant.search(contest, Range { fast, slow }, seconds)?
                }
                _ => contestant.fill(contest, seconds)?,
            };
            contest.chosen.push(chosen);
        }
    }
    Ok(contests)
}

fn contest(lab: &Lab, group: usize, contender: &Contender) -> Contest {
    let name = contender.series.get_ref();
    let number = if group == 0 { String::new() } else { format!("-{}", group + 1) };
    let series = lab.options.plan.plan.series.iter().find(|s| s.name.get_ref() == name);
    let note = match &contender.knob {
        Some(knob) => format!("{} is chosen so that rendering takes the time.", knob.get_ref()),
        None => "Samples are added until the time is over.".to_owned(),
    };
    Contest {
        name: format!("equal-time{number}-{name}"),
        label: series.map_or(name.clone(), |series| series.label().to_owned()),
        note,
        settings: Vec::new(),
        chosen: Vec::new(),
    }
}

struct Contestant<'a> {
    lab: &'a Lab<'a>,
    scene: usize,
    contender: &'a Contender,
    name: String,
}

impl Contestant<'_> {
    /// What the series sets before it varies anything.
    fn choice(&self) -> Choice {
        let plan = &self.lab.options.plan.plan;
        let name = self.contender.series.get_ref();
        let series = plan.series.iter().find(|series| series.name.get_ref() == name);
        series.map_or_else(Choice::default, |series| Choice::of_series(plan, series))
    }

    fn job(&self, setting: &str, choice: &Choice, seed: u64) -> Job {
        let described = Described { scene: self.scene, series: &self.name, setting, choice };
        described.job(self.lab.options, &self.lab.scenes, &self.lab.naming(), seed)
    }

    fn obtain(&self, job: &Job) -> Result<RunResult, LabError> {
        let show = |fraction: Option<f64>| {
            let task = format!("equal time: {}", job.label);
            self.lab.watch.progress(&Progress { task, fraction, remaining: None });
        };
        show(None);
        self.lab.obtain(job, &|fraction| show(Some(fraction)))
    }

    /// All seeds of a setting, but for those that ran already.
    fn complete(&self, tried: &mut Tried, choice: &Choice) -> Result<(), LabError> {
        let seeds = &self.lab.options.plan.plan.seeds;
        for &seed in &seeds[tried.results.len().min(seeds.len())..] {
            let job = self.job(&tried.label, choice, seed);
            let result = self.obtain(&job)?;
            tried.results.push((Some(job), result));
        }
        Ok(())
    }

    /// Samples until the time is over.
    fn fill(&self, contest: &mut Contest, seconds: f64) -> Result<Option<usize>, LabError> {
        let choice = Choice { seconds: Some(seconds), spp: None, ..self.choice() };
        let label = format!("{seconds} s");
        let mut tried = Tried { label, note: String::new(), seconds, results: Vec::new() };
        self.complete(&mut tried, &choice)?;
        let succeeded = tried.results.iter().any(|(_, result)| result.is_ok());
        contest.settings.push(tried);
        Ok(succeeded.then(|| contest.settings.len() - 1))
    }

    /// The value of the knob with which pictures take the time. What was tried for other times
    /// tells where to begin.
    fn search(
        &self,
        contest: &mut Contest,
        range: Range,
        seconds: f64,
    ) -> Result<Option<usize>, LabError> {
        let first = self.lab.options.plan.plan.seeds[0];
        let mut here: Vec<(f64, usize)> = Vec::new();
        let mut failed = false;
        while here.len() < PROBES && !failed {
            let Some(value) = range.next(&self.known(contest), seconds) else { break };
            let job = self.job(&self.label(value), &self.choice_of(value), first);
            let result = self.obtain(&job)?;
            failed = result.is_err();
            let (label, note) = (self.label(value), PROBE.to_owned());
            contest.settings.push(Tried {
                label,
                note,
                seconds,
                results: vec![(Some(job), result)],
            });
            here.push((value, contest.settings.len() - 1));
        }
        let Some(best) = Range::best(&self.known(contest), seconds) else {
            // A run that failed has said why.
            if !failed {
                let (knob, ends) = (self.knob().1, (range.fast, range.slow));
                let message = format!(
                    "no {knob} between {} and {} takes {seconds} s or less",
                    ends.0, ends.1
                );
                let (label, note) = (format!("{seconds} s"), String::new());
                let results = vec![(None, Err(message))];
                contest.settings.push(Tried { label, note, seconds, results });
            }
            return Ok(None);
        };
        let found = here.iter().find(|(value, _)| *value == best).map(|(_, index)| *index);
        // A value that was tried for another time is a setting of its own here.
        let index = found.unwrap_or_else(|| {
            let (label, note) = (self.label(best), String::new());
            contest.settings.push(Tried { label, note, seconds, results: Vec::new() });
            contest.settings.len() - 1
        });
        let tried = &mut contest.settings[index];
        tried.note = String::new();
        self.complete(tried, &self.choice_of(best))?;
        Ok(Some(index))
    }

    /// Full and short name of the parameter that is searched.
    fn knob(&self) -> (String, String) {
        let given = self.contender.knob.as_ref().map_or("", |knob| knob.get_ref());
        let full = full_name(given);
        let short = full.strip_prefix("integrator.").unwrap_or(&full).to_owned();
        (full, short)
    }

    fn label(&self, value: f64) -> String {
        format!("{}={value}", self.knob().1)
    }

    fn choice_of(&self, value: f64) -> Choice {
        let mut choice = self.choice();
        choice.set.set(&self.knob().0, Scalar(value.to_string()));
        choice
    }

    /// Values of the knob that were tried, with the seconds of rendering.
    fn known(&self, contest: &Contest) -> Vec<(f64, f64)> {
        let prefix = format!("{}=", self.knob().1);
        let of = |tried: &Tried| {
            let value = tried.label.strip_prefix(&prefix)?.parse().ok()?;
            let (_, result) = tried.results.first()?;
            Some((value, result.as_ref().ok()?.seconds))
        };
        contest.settings.iter().filter_map(of).collect()
    }
}
