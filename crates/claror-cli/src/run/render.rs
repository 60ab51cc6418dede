//! `claror render`: scene in, pictures out.

use std::path::Path;
use std::time::Duration;

use claror::integrator::{Aov, GridCache, IrradianceCache};
use claror::render::{
    CacheMode, Fingerprint, RenderError, RenderOutput, RenderSettings, RenderState, Start,
    StartingCache, StopReason,
};
use claror::scene::Scene;
use claror_io::image::MetadataValue;
use claror_io::scene::LoadedScene;
use rayon::ThreadPool;
use serde_json::{Value, json};

use super::cache_file::{self, CacheFile, CacheWriter};
use super::load;
use super::observer::Watch;
use super::show_points::{self, Points, Shown};
use super::state_file;
use super::statistics::{self, Times};
use super::verify::{self, Checking, Verified};
use crate::args::{self, RenderArgs};
use crate::config::{Checkpoint, RenderConfig, Task};
use crate::exit::{Exit, Failure};
use crate::messages::{Console, Report};
use crate::output::Content;
use crate::progress::{OnInterrupt, Phase, seconds};
use crate::signals::Interrupts;
use crate::{memory, parameters, units};

/// Everything that stays the same while the picture is made.
struct Job<'a> {
    config: &'a RenderConfig,
    console: &'a Console,
    interrupts: &'a Interrupts,
    pool: &'a ThreadPool,
    settings: RenderSettings,
    sensor: usize,
    /// What the picture depends on, by name.
    parameters: Vec<(String, String)>,
}

/// Renders a scene.
pub(crate) fn run(args: RenderArgs, task: Task, console: &mut Console) -> Result<Exit, Failure> {
    let mut config = RenderConfig::new(args, task, console.json)?;
    console.stdout_taken = config.takes_stdout();
    let console = &*console;
    let interrupts = Interrupts::listen();
    console.detail(&format!("claror {}", env!("CARGO_PKG_VERSION")));
    console.event(&json!({
        "event": "start",
        "command": match task {
            Task::Render => "render",
            Task::Verify => "verify",
        },
        "version": env!("CARGO_PKG_VERSION"),
        "scene": config.scene.scene.to_string_lossy(),
    }));
    let pool = load::thread_pool(&config.scene)?;
    let mut loaded = load::load(&config.scene, console, &interrupts, &pool)?;
    let sensor = config.apply(&mut loaded.tables)?;
    if !config.follow_show_points(&loaded.tables.integrator)? {
        let warning = "show_points: no picture goes to a file beside which the points could be \
                       shown; --show-points FILE says where";
        console.warning(&Report::warning(warning));
    }
    if config.verify.is_some() {
        verify::check_possible(&loaded.tables)?;
    }
    check_memory(&config, &loaded, sensor)?;
    let job = Job {
        settings: RenderSettings {
            scene_hash: Some(format!("{:032x}", loaded.content_hash)),
            ..config.stop.clone()
        },
        parameters: resolved_parameters(&loaded, sensor),
        config: &config,
        console,
        interrupts: &interrupts,
        pool: &pool,
        sensor,
    };
    for (name, value) in &job.parameters {
        console.detail(&format!("{name} = {value}"));
    }
    let resume = resumed_state(&job)?;
    let first = first_cache(&job)?;
    let scene = load::build(loaded.tables, &config.scene, console, &interrupts, &pool)?;
    let rendered = render(&job, &scene, resume, first)?;
    finish(&job, &scene, &rendered)
}

fn check_memory(config: &RenderConfig, loaded: &LoadedScene, sensor: usize) -> Result<(), Failure> {
    let sensor = &loaded.tables.sensors[sensor];
    let channels = |aov: &Aov| aov.kind.channels().len();
    let aovs = loaded.tables.aovs.iter().map(channels).sum();
    let needed = memory::film_bytes(sensor, aovs, config.checkpoint.is_some());
    let crop = sensor.film.crop;
    let purpose = format!("a film of {}x{} pixels", crop.width, crop.height);
    memory::check(needed, &purpose, config.scene.max_memory)
}

/// What the picture depends on besides the scene's content: `$names` first, then parameters.
fn resolved_parameters(loaded: &LoadedScene, sensor: usize) -> Vec<(String, String)> {
    let sensor = &loaded.tables.sensors[sensor];
    let defines = loaded.parameters.iter().map(|(name, value)| (format!("${name}"), value.clone()));
    let listed = parameters::list(&loaded.tables.integrator, sensor);
    defines.chain(listed).collect()
}

/// The state of an earlier run, if there is one to go on from.
fn resumed_state(job: &Job) -> Result<Option<RenderState>, Failure> {
    let Some(checkpoint) = &job.config.checkpoint else { return Ok(None) };
    let file = checkpoint.file.display();
    match (checkpoint.file.exists(), checkpoint.resume) {
        (true, true) => {
            let state = state_file::read(&checkpoint.file)?;
            job.console.detail(&format!("going on from {file}"));
            Ok(Some(state))
        }
        (true, false) => {
            let warning = format!("{file} will be overwritten; --resume would go on from it");
            job.console.warning(&Report::warning(warning));
            Ok(None)
        }
        (false, true) => {
            let warning = format!("there is no {file} to resume; starting from the beginning");
            job.console.warning(&Report::warning(warning));
            Ok(None)
        }
        (false, false) => Ok(None),
    }
}

/// The cache to begin with, if one is asked for.
fn first_cache(job: &Job) -> Result<Option<CacheFile>, Failure> {
    let Some(cache) = &job.config.cache else { return Ok(None) };
    let file = cache.file.display();
    match cache.mode {
        args::CacheMode::Write => return Ok(None),
        args::CacheMode::Update if !cache.file.exists() => {
            let warning = format!("there is no {file} to update; it will be made");
            job.console.warning(&Report::warning(warning));
            return Ok(None);
        }
        args::CacheMode::Update | args::CacheMode::Read => {}
    }
    let found = cache_file::read(&cache.file).map_err(|failure| {
        if cache.file.exists() { failure } else { failure.hint("--cache-mode write makes it") }
    })?;
    let count = units::plural(found.contents.records.len() as u64, "record");
    job.console.detail(&format!("{count} read from {file}"));
    Ok(Some(found))
}

/// What came of it.
struct Rendered<'a> {
    output: RenderOutput,
    elapsed: Duration,
    /// Until the cache was ready.
    prepass: Option<Duration>,
    /// Records that the cache began with.
    read_records: usize,
    writer: Option<CacheWriter<'a>>,
}

impl Rendered<'_> {
    fn times(&self) -> Times {
        Times { prepass: self.prepass, all: self.elapsed }
    }
}

fn render<'a>(
    job: &Job<'a>,
    scene: &Scene,
    resume: Option<RenderState>,
    first: Option<CacheFile>,
) -> Result<Rendered<'a>, Failure> {
    let samples = resume.as_ref().map_or(0, |state| state.film.sample_counts().1);
    let checkpoint = job.config.checkpoint.as_ref();
    let read_records = first.as_ref().map_or(0, |first| first.contents.records.len());
    let writer = cache_writer(job, scene, first.as_ref());
    // What is not only read is written.
    let mode = if writer.is_some() { CacheMode::Update } else { CacheMode::Read };
    let cache = first.map(|CacheFile { fingerprint, contents, .. }| StartingCache {
        fingerprint,
        contents,
        mode,
    });
    let start = Start { state: resume, cache };
    let phase = Phase::start(job.console, job.interrupts, "render", OnInterrupt::Worker);
    let (output, prepass) = {
        let writer = writer.as_ref();
        let watch = Watch::new(&phase, job.interrupts, &job.settings, checkpoint, writer, samples);
        let work = || claror::render::render(scene, job.sensor, &job.settings, start, &watch);
        (job.pool.install(work).map_err(|error| refuse(job, error))?, watch.prepass())
    };
    let elapsed = phase.finish();
    Ok(Rendered { output, elapsed, prepass, read_records, writer })
}

fn cache_writer<'a>(
    job: &Job<'a>,
    scene: &Scene,
    first: Option<&CacheFile>,
) -> Option<CacheWriter<'a>> {
    let cache = job.config.cache.as_ref().filter(|c| c.mode != args::CacheMode::Read)?;
    let sensor = &scene.tables.sensors[job.sensor];
    let fingerprint = Fingerprint::of_cache(scene, sensor, &job.settings);
    Some(CacheWriter::new(&cache.file, fingerprint, sensor, first))
}

fn refuse(job: &Job, error: RenderError) -> Failure {
    match error {
        RenderError::StateMismatch { what, state, now } => {
            let file = job.config.checkpoint.as_ref().map(|c| c.file.display().to_string());
            let file = file.unwrap_or_default();
            let message = format!(
                "{file} is a checkpoint of another render: its {what} is {state}, here it is {now}"
            );
            let hint = if what == Fingerprint::CACHE_CONTENT {
                "give the --cache of that render with --cache-mode read, or another --checkpoint \
                 file"
            } else {
                "give the options of that render, or another --checkpoint file"
            };
            Failure::new(Exit::Mismatch, message).hint(hint)
        }
        RenderError::CacheMismatch { what, cache, now } => {
            let file = job.config.cache.as_ref().map(|c| c.file.display().to_string());
            let file = file.unwrap_or_default();
            let message = format!(
                "{file} is a cache for other renders: its {what} is {cache}, here it is {now}"
            );
            Failure::new(Exit::Mismatch, message).hint(cache_file::REPLACE)
        }
        error => Failure::usage(error.to_string()),
    }
}

/// Writes a checkpoint, whole or not at all.
pub(crate) fn write_checkpoint(
    checkpoint: &Checkpoint,
    state: &RenderState,
) -> Result<(), Failure> {
    state_file::write(&checkpoint.file, state)
        .map_err(|error| Failure::io("cannot write", &checkpoint.file, &error))
}

/// Writes checkpoint and pictures, checks them, and tells what became of the render.
fn finish(job: &Job, scene: &Scene, rendered: &Rendered) -> Result<Exit, Failure> {
    let (output, elapsed) = (&rendered.output, rendered.elapsed);
    let content = Content {
        picture: &output.picture,
        layers: job.config.layers,
        exposure: job.config.exposure,
        metadata: metadata(job, output, elapsed),
    };
    let phase = Phase::start(job.console, job.interrupts, "write", OnInterrupt::Worker);
    let mut written = write_all(job, &content, &output.state);
    written.extend(rewrite_cache(rendered, output.cache.as_ref()));
    let shown = show_points(job, scene, output).transpose();
    let shown = shown.unwrap_or_else(|failure| {
        written.push(Err(failure));
        None
    });
    phase.finish();
    report_non_finite(job, output);
    if written.iter().any(Result::is_err) {
        let reports = written.into_iter().filter_map(Result::err).flat_map(|f| f.reports);
        return Err(Failure { exit: Exit::File, reports: reports.collect() });
    }
    for output in &job.config.outputs {
        job.console.result(&output.name());
    }
    if let Some(shown) = &shown {
        job.console.result(&shown.line());
    }
    job.console.result(&summary(output, elapsed));
    report_cache(job, rendered);
    let verified = verified(job, scene, output, elapsed)?;
    let mut event = result_event(job, rendered);
    event["show_points"] = shown.map_or(Value::Null, |shown| shown.json());
    if let Some(verified) = &verified {
        verified.show(job.console, output.cache.as_ref());
        event["verification"] = verified.json(output.cache.as_ref());
    }
    job.console.event(&event);
    let cut_short = job.config.verify.is_some() && job.interrupts.requested();
    if output.stop == StopReason::Cancelled || cut_short {
        return Ok(Exit::Interrupted);
    }
    if let (Some(verified), Some(config)) = (verified, &job.config.verify) {
        verified.judge(config.strict)?;
    }
    Ok(Exit::Success)
}

/// Checks the picture, if that was asked for and the picture is complete.
fn verified(
    job: &Job,
    scene: &Scene,
    output: &RenderOutput,
    elapsed: Duration,
) -> Result<Option<Verified>, Failure> {
    let Some(config) = &job.config.verify else { return Ok(None) };
    if output.stop == StopReason::Cancelled {
        return Ok(None);
    }
    let (console, interrupts, pool) = (job.console, job.interrupts, job.pool);
    let checking = Checking { config, console, interrupts, pool, sensor: job.sensor };
    verify::run(&checking, scene, output, elapsed)
}

/// Draws the records of the cache or the points of the grid, if that was asked for and there are any.
fn show_points(job: &Job, scene: &Scene, output: &RenderOutput) -> Option<Result<Shown, Failure>> {
    let config = job.config.show_points.as_ref()?;
    let Some(points) = Points::of(output) else {
        let file = config.file.display();
        let warning = format!("{file} is not written: not all points are there yet");
        job.console.warning(&Report::warning(warning));
        return None;
    };
    let sensor = &scene.tables.sensors[job.sensor];
    let (picture, exposure) = (&output.picture, job.config.exposure);
    let work = || show_points::write(config, scene, sensor, picture, points, exposure);
    Some(job.pool.install(work))
}

/// A cache that could not be written when it was ready gets a second chance.
fn rewrite_cache(
    rendered: &Rendered,
    cache: Option<&IrradianceCache>,
) -> Option<Result<(), Failure>> {
    let writer = rendered.writer.as_ref().filter(|writer| !writer.is_written())?;
    Some(writer.write(cache?))
}

/// All at the same time: after Ctrl-C nobody wants to wait.
fn write_all(job: &Job, content: &Content, state: &RenderState) -> Vec<Result<(), Failure>> {
    std::thread::scope(|scope| {
        let checkpoint = job
            .config
            .checkpoint
            .as_ref()
            .map(|checkpoint| scope.spawn(|| write_checkpoint(checkpoint, state)));
        let pictures: Vec<_> = job
            .config
            .outputs
            .iter()
            .map(|output| {
                let write = || output.write(content, &job.console.stdout);
                scope.spawn(move || job.pool.install(write))
            })
            .collect();
        checkpoint
            .into_iter()
            .chain(pictures)
            .map(|thread| thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
            .collect()
    })
}

fn report_non_finite(job: &Job, output: &RenderOutput) {
    let Some((row, column, sample)) = output.non_finite.first else { return };
    let count = units::plural(output.non_finite.count, "sample");
    job.console.warning(&Report::warning(format!(
        "{count} NaN or infinite, counted as black; the first in column {column}, row {row}, \
         sample {sample}"
    )));
}

fn report_cache(job: &Job, rendered: &Rendered) {
    let (output, times) = (&rendered.output, rendered.times());
    if let Some(grid) = &output.grid {
        job.console.result(&statistics::grid_summary(grid, &output.lookups));
    }
    let Some(cache) = &output.cache else { return };
    let (made, lookups) = (&cache.statistics, &output.lookups);
    job.console.result(&statistics::summary(made, lookups, rendered.read_records));
    for line in statistics::details(made, lookups, &times) {
        job.console.detail(&line);
    }
}

fn stop_reason(stop: StopReason) -> &'static str {
    match stop {
        StopReason::Samples => "samples",
        StopReason::Time => "time",
        StopReason::Error => "error",
        StopReason::Cancelled => "interrupted",
    }
}

/// `64 spp`, or `4 to 64 spp, 14.2 on average` where pixels were left alone.
fn samples_per_pixel(output: &RenderOutput) -> String {
    let counts = &output.picture.samples.image.data;
    let most = counts.iter().copied().fold(0.0, f32::max);
    if most <= output.spp as f32 {
        return format!("{} spp", output.spp);
    }
    format!("{} to {most} spp, {:.1} on average", output.spp, mean_spp(output))
}

/// Samples per pixel, mean over the picture.
fn mean_spp(output: &RenderOutput) -> f64 {
    let counts = &output.picture.samples.image.data;
    counts.iter().map(|&n| f64::from(n)).sum::<f64>() / counts.len().max(1) as f64
}

/// `64 spp, 1.2 s, 5.31 Mrays/s, estimated error 0.0123; stopped by samples`.
fn summary(output: &RenderOutput, elapsed: Duration) -> String {
    let image = &output.picture.beauty.image;
    let mut parts = vec![
        format!("{}x{} pixels", image.width, image.height),
        samples_per_pixel(output),
        units::duration(elapsed),
    ];
    let rate = output.rays as f64 / elapsed.as_secs_f64().max(1e-9);
    parts.push(format!("{}rays/s", units::decimal(rate)));
    if output.error.is_finite() {
        parts.push(format!("estimated error {:.4}", output.error));
    }
    let reason = match output.stop {
        StopReason::Samples => "all samples done",
        StopReason::Time => "time is over",
        StopReason::Error => "error small enough",
        StopReason::Cancelled => "interrupted",
    };
    format!("{}: {reason}", parts.join(", "))
}

/// What an OpenEXR file says about how it was made.
fn metadata(job: &Job, output: &RenderOutput, elapsed: Duration) -> Vec<(String, MetadataValue)> {
    let text = |name: &str, value: &str| (name.to_owned(), MetadataValue::Text(value.to_owned()));
    let number = |name: &str, value: f64| (name.to_owned(), MetadataValue::Number(value));
    let scene = job.config.scene.scene.file_name().map(|name| name.to_string_lossy());
    let mut metadata = vec![
        text("software", concat!("claror ", env!("CARGO_PKG_VERSION"))),
        text("claror.version", env!("CARGO_PKG_VERSION")),
        text("claror.scene", &scene.unwrap_or_default()),
        text("claror.scene_hash", job.settings.scene_hash.as_deref().unwrap_or_default()),
        text("claror.sensor", &job.sensor.to_string()),
        number("claror.spp", output.spp.into()),
        number("claror.seconds", seconds(elapsed)),
        number("claror.rays", output.rays as f64),
        text("claror.stop_reason", stop_reason(output.stop)),
    ];
    if output.error.is_finite() {
        metadata.push(number("claror.estimated_error", output.error.into()));
    }
    if let Some(cache) = &output.cache {
        metadata.push(number("claror.records", cache.records.len() as f64));
    }
    if let Some(grid) = &output.grid {
        metadata.push(number("claror.grid_points", grid.len() as f64));
    }
    let parameters = job.parameters.iter();
    metadata.extend(parameters.map(|(name, value)| text(&format!("claror.{name}"), value)));
    metadata
}

fn result_event(job: &Job, rendered: &Rendered) -> Value {
    let (output, elapsed) = (&rendered.output, rendered.elapsed);
    let image = &output.picture.beauty.image;
    let parameters: serde_json::Map<String, Value> =
        job.parameters.iter().map(|(name, value)| (name.clone(), json!(value))).collect();
    let file = |path: &Path| path.to_string_lossy().into_owned();
    json!({
        "event": "result",
        "outputs": job.config.outputs.iter().map(crate::output::Output::name).collect::<Vec<_>>(),
        "checkpoint": job.config.checkpoint.as_ref().map(|checkpoint| file(&checkpoint.file)),
        "width": image.width,
        "height": image.height,
        "spp": output.spp,
        "mean_spp": mean_spp(output),
        "seconds": seconds(elapsed),
        "seconds_by_phase": rendered.times().json(),
        "rays": output.rays,
        "peak_memory_bytes": memory::peak(),
        "rays_per_second": output.rays as f64 / elapsed.as_secs_f64().max(1e-9),
        "error": output.error.is_finite().then_some(output.error),
        "non_finite_samples": output.non_finite.count,
        "stop": stop_reason(output.stop),
        "scene_hash": job.settings.scene_hash,
        "cache": output.cache.as_ref().map(|cache| {
            let mut object = statistics::cache_json(&cache.statistics);
            object["lookups"] = statistics::lookups_json(&output.lookups);
            object["read"] = json!(rendered.read_records);
            object["file"] = json!(job.config.cache.as_ref().map(|cache| file(&cache.file)));
            object
        }),
        "grid_points": output.grid.as_ref().map(GridCache::len),
        "grid": output.grid.as_ref().map(|grid| statistics::grid_json(grid, &output.lookups)),
        "parameters": parameters,
    })
}
