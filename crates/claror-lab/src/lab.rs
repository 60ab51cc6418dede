//! What all parts of an experiment share: the program, the scenes, the folder, and how a run is
//! made or found.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use xxhash_rust::xxh3::{Xxh3, xxh3_64};

use crate::error::LabError;
use crate::folder::{Folder, read_json, write_json};
use crate::plan::PlanFile;
use crate::process::{self, Finished, Watching};
use crate::settings::Choice;
use crate::{machine, names};

/// What is asked for.
#[derive(Debug, Clone)]
pub struct Options {
    /// The plan, with what the command line changes in it.
    pub plan: PlanFile,
    /// Scene files.
    pub scenes: Vec<PathBuf>,
    /// Options of every `claror render` and `claror info` that say how to read the scene.
    pub scene_arguments: Vec<String>,
    /// Where everything goes.
    pub folder: PathBuf,
    /// Factor on the times of equal-time comparisons.
    pub time_scale: f64,
    /// Pictures to compare with, instead of references that are rendered.
    pub reference: Option<[PathBuf; 2]>,
    /// Where rendered references are kept.
    pub references: PathBuf,
    /// Command line of the experiment.
    pub command: Vec<String>,
    /// The program `claror`.
    pub program: PathBuf,
    /// Nothing is rendered: the study is put together from what is there.
    pub report_only: bool,
    /// What time it is.
    pub clock: fn() -> SystemTime,
}

/// How far the experiment is.
#[derive(Debug, Clone, PartialEq)]
pub struct Progress {
    /// What is done now: `run 3 of 40: path, 16 spp, seed 0`.
    pub task: String,
    /// Share of this kind of work that is done, 0 to 1, if it can be known.
    pub fraction: Option<f64>,
    /// Seconds left of this kind of work, as runs before took them.
    pub remaining: Option<f64>,
}

/// Who looks on, and may stop the experiment.
pub trait Watch {
    /// Whether to stop; asked again and again.
    fn cancelled(&self) -> bool;
    /// Something began or went on.
    fn progress(&self, progress: &Progress);
    /// A run came to its end: one line, and whether it failed.
    fn done(&self, line: &str, failed: bool);
}

/// A scene as the program understands it.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneInfo {
    /// File name without ending, unique in the experiment.
    pub name: String,
    /// As given.
    pub file: PathBuf,
    /// Hash of its content.
    pub hash: String,
    /// Size of the pictures in pixels.
    pub size: [usize; 2],
}

/// One run that is to be made.
#[derive(Debug, Clone, PartialEq)]
pub struct Job {
    /// Unique name: scene, series, setting, seed, and a hash of all that the run depends on.
    pub id: String,
    /// Index of the scene.
    pub scene: usize,
    /// For readers: `path, 16 spp, seed 0`.
    pub label: String,
    /// Seed of the sample pattern.
    pub seed: u64,
    /// What it sets.
    pub choice: Choice,
}

/// What a run took, without its errors: these depend on the reference.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measurement {
    /// See [`crate::study::Run`], as the other members.
    pub id: String,
    pub(crate) seed: u64,
    pub(crate) command: Vec<String>,
    pub(crate) started: String,
    pub(crate) load: f64,
    pub(crate) seconds: f64,
    pub(crate) cpu_seconds: f64,
    /// Wall-clock seconds of the process from start to end.
    pub(crate) process_seconds: f64,
    pub(crate) phases: Vec<(String, f64)>,
    pub(crate) peak_memory_bytes: u64,
    pub(crate) records: Option<u64>,
    pub(crate) spp: f64,
    pub(crate) rays: u64,
    pub(crate) parameters: BTreeMap<String, String>,
}

/// A finished run, or why there is none.
pub type RunResult = Result<Measurement, String>;

/// Why a run is missing of which nothing is known.
pub(crate) const NOT_RUN: &str = "not run yet";

/// The experiment.
pub struct Lab<'a> {
    pub(crate) options: &'a Options,
    pub(crate) folder: Folder,
    pub(crate) watch: &'a dyn Watch,
    pub(crate) scenes: Vec<SceneInfo>,
    program: u64,
}

/// Asks the program about the scenes.
///
/// # Errors
/// If one of them cannot be rendered.
pub fn scenes(options: &Options, watch: &dyn Watch) -> Result<Vec<SceneInfo>, LabError> {
    let mut found: Vec<SceneInfo> = Vec::new();
    for file in &options.scenes {
        let stem = file.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        let stem = names::slug(&stem.unwrap_or_default());
        let same = found.iter().filter(|other| other.file.file_stem() == file.file_stem()).count();
        let name = if same == 0 { stem } else { format!("{stem}-{}", same + 1) };
        found.push(scene(options, file, name, watch)?);
    }
    Ok(found)
}

/// A process that is only watched for its end.
struct Quiet<'a>(&'a dyn Watch);

impl Watching for Quiet<'_> {
    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}

fn scene(
    options: &Options,
    file: &Path,
    name: String,
    watch: &dyn Watch,
) -> Result<SceneInfo, LabError> {
    let mut command = vec![text(&options.program), "info".to_owned(), text(file)];
    command.extend(options.scene_arguments.iter().cloned());
    command.push("--json".to_owned());
    let told = process::run(&command, &Quiet(watch))
        .map_err(LabError::file("cannot start", &options.program))?;
    if told.stopped {
        return Err(LabError::Interrupted);
    }
    let refused = |message: String| LabError::Scene { message, code: told.code.unwrap_or(70) };
    let result = told.event("result").filter(|_| told.code == Some(0));
    let result = result.ok_or_else(|| refused(told.message()))?;
    let hash = result["hash"].as_str().unwrap_or_default().to_owned();
    let size = options.plan.plan.size.map(|size| size.0.map(|v| v as usize));
    let size = size.or_else(|| film_size(result));
    let size = size.ok_or_else(|| refused(format!("{}: no film", file.display())))?;
    Ok(SceneInfo { name, file: file.to_owned(), hash, size })
}

/// Width and height of what is rendered of the film.
fn film_size(result: &Value) -> Option<[usize; 2]> {
    let crop = result["settings"]["film.crop"].as_str()?;
    let numbers: Vec<usize> = crop.split(',').filter_map(|v| v.trim().parse().ok()).collect();
    <[usize; 4]>::try_from(numbers).ok().map(|[_, _, width, height]| [width, height])
}

/// A path as an argument.
pub(crate) fn text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

/// A hash of the program's file, so that runs of one build are not taken for those of another.
fn program_hash(program: &Path) -> Result<u64, LabError> {
    let mut file = std::fs::File::open(program).map_err(LabError::file("cannot read", program))?;
    let mut hasher = Xxh3::new();
    let mut buffer = vec![0; 1 << 20];
    loop {
        let read = std::io::Read::read(&mut file, &mut buffer);
        match read.map_err(LabError::file("cannot read", program))? {
            0 => return Ok(hasher.digest()),
            count => hasher.update(&buffer[..count]),
        }
    }
}

/// What a job of a scene is called, given all that it depends on.
pub(crate) struct Naming {
    program: u64,
}

impl Naming {
    pub(crate) fn new(options: &Options) -> Result<Self, LabError> {
        Ok(Self { program: program_hash(&options.program)? })
    }

    /// A unique name that tells what it is. The hash covers whatever can change the result: the
    /// build of the program, the scene, the options. It does not cover where files are.
    pub(crate) fn id(&self, readable: &[&str], scene: &SceneInfo, arguments: &[String]) -> String {
        let whole = format!("{:x} {} {}", self.program, scene.hash, arguments.join("\u{1f}"));
        let readable: Vec<String> = readable.iter().map(|part| names::slug(part)).collect();
        let readable: String = readable.join("-").chars().take(80).collect();
        format!("{readable}-{:08x}", xxh3_64(whole.as_bytes()) >> 32)
    }
}

impl<'a> Lab<'a> {
    /// Opens the folder.
    ///
    /// # Errors
    /// If it cannot be written or is in use.
    pub fn open(
        options: &'a Options,
        scenes: Vec<SceneInfo>,
        watch: &'a dyn Watch,
    ) -> Result<Self, LabError> {
        let folder = Folder::open(&options.folder)?;
        Ok(Self { options, folder, watch, scenes, program: program_hash(&options.program)? })
    }

    pub(crate) fn naming(&self) -> Naming {
        Naming { program: self.program }
    }

    /// The start of a command line: program, command, scene and how to read it.
    pub(crate) fn command(&self, scene: &SceneInfo, arguments: &[String]) -> Vec<String> {
        let program = text(&self.options.program);
        [&[program, "render".to_owned(), text(&scene.file)], arguments].concat()
    }

    /// Runs a command that writes `picture`.
    pub(crate) fn process(
        &self,
        command: &[String],
        picture: &Path,
        on_fraction: &dyn Fn(f64),
    ) -> Result<Finished, LabError> {
        let watching = Child { lab: self, picture, on_fraction };
        let finished = process::run(command, &watching)
            .map_err(LabError::file("cannot start", &self.options.program))?;
        self.folder.note_idle();
        Ok(finished)
    }

    /// A run: the finished one if there is one, else it is made. `on_fraction` hears how far the
    /// process is.
    ///
    /// # Errors
    /// If the user stops it or the folder cannot be written; not if the run itself fails.
    pub fn obtain(&self, job: &Job, on_fraction: &dyn Fn(f64)) -> Result<RunResult, LabError> {
        if let Some(found) = self.finished(job) {
            return Ok(Ok(found));
        }
        if self.options.report_only {
            let failure = read_json(&self.folder.path(&job.id).join(FAILURE));
            return Ok(Err(failure.unwrap_or_else(|| NOT_RUN.to_owned())));
        }
        if self.watch.cancelled() {
            return Err(LabError::Interrupted);
        }
        let result = self.make(job, on_fraction)?;
        match &result {
            Ok(found) => {
                let line = format!("{}: {:.1} s", job.label, found.process_seconds);
                self.watch.done(&line, false);
            }
            Err(message) => self.watch.done(&format!("{}: {message}", job.label), true),
        }
        Ok(result)
    }

    /// The run if it is finished.
    pub(crate) fn finished(&self, job: &Job) -> Option<Measurement> {
        finished(&self.folder.path(&job.id))
    }

    fn make(&self, job: &Job, on_fraction: &dyn Fn(f64)) -> Result<RunResult, LabError> {
        let folder = self.folder.run(&job.id)?;
        let picture = folder.join(PICTURE);
        let scene = &self.scenes[job.scene];
        let mut command = self.command(scene, &arguments(self.options, scene, job));
        command.extend(["--json".to_owned(), "-o".to_owned(), text(&picture)]);
        let load = machine::load();
        let started = now(self.options);
        let finished = self.process(&command, &picture, on_fraction)?;
        if finished.stopped {
            return Err(LabError::Interrupted);
        }
        let result = finished.event("result").filter(|_| finished.code == Some(0));
        let Some(result) = result else {
            let message = finished.message();
            write_json(&folder.join(FAILURE), &message)?;
            return Ok(Err(message));
        };
        let found = Measurement {
            id: job.id.clone(),
            seed: job.seed,
            command,
            started,
            load,
            ..measurement(&finished, result)
        };
        // An old failure is over; that it stays would do no harm.
        let _ = std::fs::remove_file(folder.join(FAILURE));
        write_json(&folder.join(RUN), &found)?;
        Ok(Ok(found))
    }
}

pub(crate) const PICTURE: &str = "picture.exr";
const RUN: &str = "run.json";
const FAILURE: &str = "failure.json";

/// The finished run in a folder, if its picture is there as well.
pub(crate) fn finished(folder: &Path) -> Option<Measurement> {
    read_json(&folder.join(RUN)).filter(|_| folder.join(PICTURE).is_file())
}

/// All options of a job that change its result.
pub(crate) fn arguments(options: &Options, scene: &SceneInfo, job: &Job) -> Vec<String> {
    let mut arguments = options.scene_arguments.clone();
    arguments.extend(job.choice.arguments());
    let threads = options.plan.plan.threads.map_or_else(machine::cores, usize::from);
    let common = [
        ("--size", format!("{}x{}", scene.size[0], scene.size[1])),
        ("--seed", job.seed.to_string()),
        ("--threads", threads.to_string()),
    ];
    // Without a size the scene's own film and crop are taken.
    let given = options.plan.plan.size.is_some();
    let common = common.into_iter().filter(|(name, _)| given || *name != "--size");
    arguments.extend(common.flat_map(|(name, value)| [name.to_owned(), value]));
    arguments
}

/// What time it is, RFC 3339.
pub(crate) fn now(options: &Options) -> String {
    humantime::format_rfc3339_seconds((options.clock)()).to_string()
}

/// What a process told of its run; who made it and when is filled in by others.
fn measurement(finished: &Finished, result: &Value) -> Measurement {
    let number = |value: &Value| value.as_f64().unwrap_or(0.0);
    let parameters = result["parameters"].as_object().into_iter().flatten();
    let parameters = parameters
        .map(|(name, value)| (name.clone(), value.as_str().unwrap_or_default().to_owned()));
    Measurement {
        id: String::new(),
        seed: 0,
        command: Vec::new(),
        started: String::new(),
        load: 0.0,
        seconds: number(&result["seconds"]),
        cpu_seconds: finished.cpu_seconds,
        process_seconds: finished.seconds,
        phases: phases(finished, result),
        // What the program says of itself does not hold what its parent had when it was started.
        peak_memory_bytes: result["peak_memory_bytes"]
            .as_u64()
            .unwrap_or(finished.peak_memory_bytes),
        // The points of a grid are what records are to a cache.
        records: result["cache"]["records"].as_u64().or(result["grid"]["points"].as_u64()),
        spp: result["mean_spp"].as_f64().unwrap_or_else(|| number(&result["spp"])),
        rays: result["rays"].as_u64().unwrap_or(0),
        parameters: parameters.collect(),
    }
}

/// Seconds of the phases in order; that of rendering is told in parts.
fn phases(finished: &Finished, result: &Value) -> Vec<(String, f64)> {
    let mut phases = Vec::new();
    for event in finished.events.iter().filter(|event| event["state"] == "end") {
        let (Some(name), Some(seconds)) = (event["phase"].as_str(), event["seconds"].as_f64())
        else {
            continue;
        };
        match result["seconds_by_phase"].as_object().filter(|_| name == "render") {
            Some(parts) => {
                let parts = parts.iter().filter_map(|(name, v)| Some((name.clone(), v.as_f64()?)));
                phases.extend(parts);
            }
            None => phases.push((name.to_owned(), seconds)),
        }
    }
    phases
}

/// The renderer at work.
struct Child<'a> {
    lab: &'a Lab<'a>,
    picture: &'a Path,
    on_fraction: &'a dyn Fn(f64),
}

impl Watching for Child<'_> {
    fn cancelled(&self) -> bool {
        self.lab.watch.cancelled()
    }

    fn started(&self, pid: u32) {
        self.lab.folder.note_running(pid, self.picture);
    }

    fn fraction(&self, fraction: f64) {
        (self.on_fraction)(fraction);
    }
}
