//! References: two independent halves by path tracing, made once and kept for later experiments.

use std::cell::Cell;
use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64;

use crate::error::LabError;
use crate::folder::{read_json, write_json};
use crate::forecast::Pace;
use crate::lab::{Lab, Options, Progress, SceneInfo, text};
use crate::measure::{self, ReferencePicture};
use crate::plan::{SEED_LIMIT, Scalar};
use crate::study::Reference;
use crate::{machine, names};

/// Parameters of all runs that say what light there is, and so belong to the reference as well.
const SHARED: [&str; 4] = ["max_depth", "rr_depth", "early_roulette", "hide_emitters"];
/// The exit code for a checkpoint of another render.
const MISMATCH: i32 = 7;

/// A reference with its pictures.
pub(crate) struct Loaded {
    /// What the study says of it.
    pub(crate) reference: Reference,
    /// The pictures.
    pub(crate) picture: ReferencePicture,
    /// A name for what it holds.
    pub(crate) key: String,
}

/// What is noted of a finished half.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Half {
    command: Vec<String>,
    cpu_seconds: f64,
}

/// The given reference of a scene, or the one that is kept, or a new one.
///
/// # Errors
/// If given pictures cannot be read or have another size, if the renderer fails, or if the user
/// stops it.
pub(crate) fn obtain(lab: &Lab, scene: &SceneInfo) -> Result<Loaded, LabError> {
    match &lab.options.reference {
        Some(halves) => given(halves, scene),
        None => rendered(lab, scene),
    }
}

/// Pictures that the user gives.
///
/// # Errors
/// If they cannot be read or have another size.
pub(crate) fn given(files: &[PathBuf; 2], scene: &SceneInfo) -> Result<Loaded, LabError> {
    let picture = load(files, scene)?;
    let hash = |path: &PathBuf| fs::read(path).map(|bytes| xxh3_64(&bytes)).unwrap_or(0);
    let reference = Reference {
        halves: files.clone().map(full_path),
        spp: 0,
        cpu_seconds: 0.0,
        rel_mse: picture.rel_mse,
        commands: Vec::new(),
    };
    let key = format!("given {:x} {:x}", hash(&files[0]), hash(&files[1]));
    Ok(Loaded { reference, picture, key })
}

fn full_path(path: PathBuf) -> PathBuf {
    path.canonicalize().unwrap_or(path)
}

fn load(files: &[PathBuf; 2], scene: &SceneInfo) -> Result<ReferencePicture, LabError> {
    let read = |path: &PathBuf| measure::read(path).map_err(LabError::Reference);
    let halves = [read(&files[0])?, read(&files[1])?];
    let [width, height] = scene.size;
    for (image, file) in halves.iter().zip(files) {
        if [image.width, image.height] != scene.size {
            return Err(LabError::Reference(format!(
                "{} has {}x{} pixels, pictures of {} have {width}x{height}",
                file.display(),
                image.width,
                image.height,
                scene.name
            )));
        }
    }
    ReferencePicture::new(halves).map_err(|error| LabError::Reference(error.to_string()))
}

/// Options of both halves, but for seed and threads.
fn arguments(options: &Options, scene: &SceneInfo) -> Vec<String> {
    let plan = &options.plan.plan;
    let mut arguments = options.scene_arguments.clone();
    let spp = plan.reference.spp.div_ceil(2);
    arguments.extend(["-i", "path", "--spp", &spp.to_string()].map(str::to_owned));
    if plan.size.is_some() {
        let size = format!("{}x{}", scene.size[0], scene.size[1]);
        arguments.extend(["--size".to_owned(), size]);
    }
    for (name, Scalar(value)) in &plan.set.0 {
        let shared = match name.strip_prefix("integrator.") {
            Some(name) => SHARED.contains(&name),
            None => !name.starts_with("sampler."),
        };
        if shared {
            arguments.extend(["-p".to_owned(), format!("{name}={value}")]);
        }
    }
    arguments
}

/// Where the reference of a scene is kept.
pub(crate) fn place(options: &Options, scene: &SceneInfo) -> PathBuf {
    let arguments = arguments(options, scene);
    let version = env!("CARGO_PKG_VERSION");
    let whole = format!("{version} {} {:?} {arguments:?}", scene.hash, scene.size);
    let name = format!(
        "{}-{}x{}-{}spp-{:016x}",
        names::slug(&scene.name),
        scene.size[0],
        scene.size[1],
        options.plan.plan.reference.spp,
        xxh3_64(whole.as_bytes())
    );
    options.references.join(name)
}

/// Whether a finished reference is there.
pub(crate) fn is_there(options: &Options, scene: &SceneInfo) -> bool {
    let folder = place(options, scene);
    options.reference.is_some() || (0..2).all(|i| finished(&folder, i).is_some())
}

fn picture_of(folder: &Path, index: usize) -> PathBuf {
    folder.join(format!("half-{}.exr", index + 1))
}

fn note_of(folder: &Path, index: usize) -> PathBuf {
    folder.join(format!("half-{}.json", index + 1))
}

fn finished(folder: &Path, index: usize) -> Option<Half> {
    read_json(&note_of(folder, index)).filter(|_| picture_of(folder, index).is_file())
}

fn rendered(lab: &Lab, scene: &SceneInfo) -> Result<Loaded, LabError> {
    let folder = place(lab.options, scene);
    if !is_there(lab.options, scene) && lab.options.report_only {
        return Err(LabError::Reference(format!(
            "there is no reference of {} yet: run once without --report-only",
            scene.name
        )));
    }
    let halves = if is_there(lab.options, scene) {
        [0, 1].map(|i| finished(&folder, i)).map(|half| half.unwrap_or_else(lost))
    } else {
        fs::create_dir_all(&folder).map_err(LabError::file("cannot make folder", &folder))?;
        let _lock = wait_for_lock(lab, &folder)?;
        [half(lab, scene, &folder, 0)?, half(lab, scene, &folder, 1)?]
    };
    let files = [0, 1].map(|i| full_path(picture_of(&folder, i)));
    let picture = load(&files, scene)?;
    let reference = Reference {
        halves: files,
        spp: 2 * u64::from(lab.options.plan.plan.reference.spp.div_ceil(2)),
        cpu_seconds: halves.iter().map(|half| half.cpu_seconds).sum(),
        rel_mse: picture.rel_mse,
        commands: halves.into_iter().map(|half| half.command).collect(),
    };
    let key = folder.file_name().map(|name| name.to_string_lossy().into_owned());
    Ok(Loaded { reference, picture, key: key.unwrap_or_default() })
}

/// A half whose note vanished between two looks: its picture is still there.
fn lost() -> Half {
    Half { command: Vec::new(), cpu_seconds: 0.0 }
}

/// Two experiments that need the same reference make it once.
fn wait_for_lock(lab: &Lab, folder: &Path) -> Result<File, LabError> {
    let path = folder.join("lock");
    let file = File::options().write(true).create(true).truncate(false).open(&path);
    let file = file.map_err(LabError::file("cannot write", &path))?;
    while let Err(TryLockError::WouldBlock) = file.try_lock() {
        if lab.watch.cancelled() {
            return Err(LabError::Interrupted);
        }
        lab.watch.progress(&Progress {
            task: "waiting for another experiment to make the reference".to_owned(),
            fraction: None,
            remaining: None,
        });
        std::thread::sleep(std::time::Duration::from_millis(200));
    }
    Ok(file)
}

/// A half of the reference: the finished one, or one that goes on from its checkpoint.
fn half(lab: &Lab, scene: &SceneInfo, folder: &Path, index: usize) -> Result<Half, LabError> {
    if let Some(half) = finished(folder, index) {
        return Ok(half);
    }
    let picture = picture_of(folder, index);
    let checkpoint = folder.join(format!("half-{}.ckpt", index + 1));
    let spent_file = folder.join(format!("half-{}.spent.json", index + 1));
    let command = command(lab, scene, index, &picture, &checkpoint);
    let (start, pace) = (Instant::now(), Cell::new(Pace::default()));
    let show = |fraction: f64| {
        let mut current = pace.get();
        let times = current.rest_and_whole(start.elapsed().as_secs_f64(), fraction);
        pace.set(current);
        lab.watch.progress(&Progress {
            task: format!("reference of {}, half {} of 2", scene.name, index + 1),
            fraction: Some((index as f64 + fraction) / 2.0),
            remaining: times.map(|(rest, whole)| rest + (1 - index) as f64 * whole),
        });
    };
    lab.watch.progress(&Progress {
        task: format!("reference of {}", scene.name),
        fraction: None,
        remaining: None,
    });
    let mut again = true;
    loop {
        let made = lab.process(&command, &picture, &show)?;
        let spent = read_json::<f64>(&spent_file).unwrap_or(0.0) + made.cpu_seconds;
        if made.stopped {
            write_json(&spent_file, &spent)?;
            return Err(LabError::Interrupted);
        }
        if made.code == Some(0) {
            let half = Half { command, cpu_seconds: spent };
            write_json(&note_of(folder, index), &half)?;
            // They served their purpose.
            let _ = fs::remove_file(&checkpoint);
            let _ = fs::remove_file(&spent_file);
            let line = format!("reference of {}, half {}: {spent:.1} s", scene.name, index + 1);
            lab.watch.done(&line, false);
            return Ok(half);
        }
        if made.code == Some(MISMATCH) && std::mem::take(&mut again) {
            // A checkpoint of another build, say: from the beginning then.
            fs::remove_file(&checkpoint).map_err(LabError::file("cannot remove", &checkpoint))?;
            continue;
        }
        let code = made.code.unwrap_or(70);
        return Err(LabError::ReferenceFailed { message: made.message(), code });
    }
}

fn command(
    lab: &Lab,
    scene: &SceneInfo,
    index: usize,
    picture: &Path,
    checkpoint: &Path,
) -> Vec<String> {
    let threads = lab.options.plan.plan.threads.map_or_else(machine::cores, usize::from);
    let mut arguments = arguments(lab.options, scene);
    let seed = SEED_LIMIT + index as u64;
    let rest = [
        ("--seed", seed.to_string()),
        ("--threads", threads.to_string()),
        ("--checkpoint", text(checkpoint)),
        ("-o", text(picture)),
    ];
    arguments.extend(rest.into_iter().flat_map(|(name, value)| [name.to_owned(), value]));
    arguments.extend(["--resume", "--every", "30s", "--json"].map(str::to_owned));
    lab.command(scene, &arguments)
}
