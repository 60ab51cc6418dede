//! `claror bench`: repeats an experiment and writes what was found.

use std::cell::Cell;
use std::path::PathBuf;
use std::time::{Duration, SystemTime};

use claror_lab::jobs::Outlook;
use claror_lab::plan::{PlanError, PlanFile, READY, ReadyPlan};
use claror_lab::{LabError, Options, Outcome, Overrides, Progress, Watch};
use serde_json::json;

use crate::args::BenchArgs;
use crate::exit::{Exit, Failure, describe};
use crate::messages::{Console, Report, Verbosity, stderr_line};
use crate::progress::{OnInterrupt, Phase, Snapshot};
use crate::signals::Interrupts;
use crate::units;

/// Runs a plan on scenes.
pub(crate) fn run(args: &BenchArgs, console: &Console) -> Result<Exit, Failure> {
    if let Some(name) = &args.print_plan {
        return print_plan(name, console);
    }
    let options = options(args)?;
    let interrupts = Interrupts::listen();
    console.event(&json!({
        "event": "start",
        "command": "bench",
        "version": env!("CARGO_PKG_VERSION"),
        "plan": options.plan.name,
        "scenes": args.scenes.iter().map(|scene| scene.to_string_lossy()).collect::<Vec<_>>(),
    }));
    let phase = Phase::start(console, &interrupts, "bench", OnInterrupt::Worker);
    let runs = Cell::new(0);
    let watcher = Watcher { interrupts: &interrupts, phase: &phase, runs: &runs };
    if args.dry_run {
        let outlook = claror_lab::outlook(&options, &watcher);
        phase.finish();
        show_outlook(&outlook.map_err(failure)?, console);
        return Ok(Exit::Success);
    }
    let outcome = claror_lab::run(&options, &watcher);
    phase.finish();
    match outcome {
        Ok(outcome) => Ok(tell(&outcome, console)),
        Err(LabError::Interrupted) => Ok(tell_interrupted(runs.get(), console)),
        Err(error) => Err(failure(error)),
    }
}

fn print_plan(name: &str, console: &Console) -> Result<Exit, Failure> {
    let plan = ReadyPlan::find(name).ok_or_else(|| {
        let names: Vec<&str> = READY.iter().map(|plan| plan.name).collect();
        Failure::usage(format!("there is no ready plan `{name}`"))
            .hint(format!("the ready plans are {}", names.join(", ")))
    })?;
    if console.json {
        console.event(&json!({ "event": "result", "plan": name, "text": plan.text }));
    } else {
        console.stdout.write(plan.text.as_bytes());
    }
    Ok(Exit::Success)
}

fn options(args: &BenchArgs) -> Result<Options, Failure> {
    let mut plan = PlanFile::read(args.plan.as_deref().unwrap_or_default())
        .map_err(|error| failure(error.into()))?;
    let changes = Overrides {
        seeds: args.changes.seeds.map(usize::from),
        size: args.changes.size,
        threads: args.changes.threads,
        reference_spp: args.reference.reference_spp,
    };
    changes.apply(&mut plan.plan);
    let program = std::env::current_exe()
        .map_err(|e| Failure::new(Exit::File, format!("cannot find myself: {}", describe(&e))))?;
    let mut scene_arguments = Vec::new();
    for (name, value) in &args.scene.defines {
        scene_arguments.extend(["-D".to_owned(), format!("{name}={value}")]);
    }
    if args.scene.lenient {
        scene_arguments.push("--lenient".to_owned());
    }
    let reference = args.reference.reference.clone();
    Ok(Options {
        plan,
        scenes: args.scenes.clone(),
        scene_arguments,
        folder: args.out.clone().unwrap_or_default(),
        time_scale: args.changes.time_scale,
        reference: reference.and_then(|files| <[PathBuf; 2]>::try_from(files).ok()),
        references: references(args)?,
        command: std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect(),
        program,
        report_only: args.report_only,
        clock,
    })
}

/// Where references are kept.
fn references(args: &BenchArgs) -> Result<PathBuf, Failure> {
    let variable = |name| std::env::var_os(name).filter(|value| !value.is_empty());
    let cache = variable("XDG_CACHE_HOME").map(PathBuf::from).filter(|path| path.is_absolute());
    let cache = cache.or_else(|| variable("HOME").map(|home| PathBuf::from(home).join(".cache")));
    let default = cache.map(|cache| cache.join("claror").join("references"));
    args.reference.references.clone().or(default).ok_or_else(|| {
        Failure::usage("there is no home folder to keep references in")
            .hint("--references says where")
    })
}

#[expect(clippy::disallowed_methods, reason = "the study says when runs were made")]
fn clock() -> SystemTime {
    SystemTime::now()
}

fn failure(error: LabError) -> Failure {
    match error {
        LabError::Plan(PlanError::Wrong(diagnostic)) => Failure::from(vec![*diagnostic]),
        LabError::Plan(error @ PlanError::Unknown { .. }) => {
            let hint = match &error {
                PlanError::Unknown { ready, .. } => format!("the ready plans are {ready}"),
                _ => String::new(),
            };
            Failure::new(Exit::File, error.to_string()).hint(hint)
        }
        LabError::Usage(message) => Failure::usage(message),
        LabError::Scene { message, code } => Failure::new(exit_of(code), message),
        LabError::ReferenceFailed { code, .. } => Failure::new(exit_of(code), error.to_string()),
        LabError::File { what, path, error } => Failure::io(what, &path, &error),
        LabError::Reference(message) => Failure::new(Exit::File, message)
            .hint("--reference takes two independent renders of the scene in the plan's size"),
        LabError::Locked { .. } => {
            Failure::new(Exit::File, error.to_string()).hint("wait for it, or give another --out")
        }
        LabError::Interrupted => Failure::new(Exit::Interrupted, error.to_string()),
        LabError::Plan(PlanError::Unreadable { .. }) | LabError::Report(_) => {
            Failure::new(Exit::File, error.to_string())
        }
    }
}

/// The exit code that the program gave for the same mistake.
fn exit_of(code: i32) -> Exit {
    let known = [Exit::Usage, Exit::Scene, Exit::File, Exit::Memory, Exit::Mismatch];
    known.into_iter().find(|exit| *exit as i32 == code).unwrap_or(Exit::Bug)
}

fn show_outlook(outlook: &Outlook, console: &Console) {
    for (scene, is_there) in &outlook.references {
        let state = if *is_there { "there" } else { "to be made" };
        console.result(&format!("reference of {scene}: {state}"));
    }
    let width = outlook.runs.iter().map(|run| run.label.chars().count()).max().unwrap_or(0);
    for run in &outlook.runs {
        let state = if run.done { "done" } else { "-" };
        let arguments = run.arguments.join(" ");
        console.result(&format!("{state:4}  {:width$}  {arguments}", run.label));
    }
    let done = outlook.runs.iter().filter(|run| run.done).count();
    let count = units::plural(outlook.runs.len() as u64, "run");
    console.result(&format!("{count}, {done} done"));
    for line in &outlook.later {
        console.result(&format!("then {line}"));
    }
    let runs = outlook.runs.iter().map(|run| {
        json!({ "id": run.id, "label": run.label, "arguments": run.arguments, "done": run.done })
    });
    console.event(&json!({
        "event": "result",
        "references": outlook.references.iter()
            .map(|(scene, done)| json!({ "scene": scene, "done": done })).collect::<Vec<_>>(),
        "runs": runs.collect::<Vec<_>>(),
        "later": outlook.later,
    }));
}

/// What came of it, and the exit code that says whether all runs succeeded.
fn tell(outcome: &Outcome, console: &Console) -> Exit {
    let runs = units::plural(outcome.runs as u64, "run");
    console.result(&outcome.report.display().to_string());
    for file in outcome.files.iter().filter(|file| **file != outcome.report) {
        console.result(&file.display().to_string());
    }
    console.result(&format!("{runs}, {}", units::plural(outcome.failures as u64, "failure")));
    console.event(&json!({
        "event": "result",
        "report": outcome.report.to_string_lossy(),
        "files": outcome.files.iter().map(|file| file.to_string_lossy()).collect::<Vec<_>>(),
        "runs": outcome.runs,
        "failures": outcome.failures,
        "interrupted": false,
    }));
    if outcome.failures == 0 {
        return Exit::Success;
    }
    let scenes = &outcome.study.scenes;
    let settings = scenes.iter().flat_map(|s| &s.series).flat_map(|series| &series.settings);
    let first = settings.flat_map(|setting| &setting.failures).next();
    let first = first.map(|message| message.lines().next().unwrap_or_default().to_owned());
    let count = units::plural(outcome.failures as u64, "failure");
    let message = format!("{count}, the first: {}", first.unwrap_or_default());
    let hint = "the report names all; the same command tries them again";
    console.failure(&Failure::new(Exit::CheckFailed, message).hint(hint))
}

fn tell_interrupted(runs: usize, console: &Console) -> Exit {
    console.event(&json!({ "event": "result", "interrupted": true, "runs": runs }));
    if !console.json && console.verbosity > Verbosity::Quiet {
        let runs = units::plural(runs as u64, "new run");
        stderr_line(&format!("interrupted after {runs}; the same command goes on from there"));
    }
    Exit::Interrupted
}

/// Shows what the laboratory does.
struct Watcher<'a> {
    interrupts: &'a Interrupts,
    phase: &'a Phase<'a>,
    /// Runs that were made.
    runs: &'a Cell<usize>,
}

impl Watch for Watcher<'_> {
    fn cancelled(&self) -> bool {
        self.interrupts.requested()
    }

    fn progress(&self, progress: &Progress) {
        let remaining = progress.remaining.and_then(|s| Duration::try_from_secs_f64(s).ok());
        self.phase.update(Snapshot {
            fraction: progress.fraction,
            remaining,
            task: Some(progress.task.clone()),
            ..Snapshot::default()
        });
    }

    fn done(&self, line: &str, failed: bool) {
        self.runs.set(self.runs.get() + usize::from(!failed));
        if failed {
            self.phase.warn(&Report::warning(line));
        } else {
            self.phase.say(line);
        }
    }
}
