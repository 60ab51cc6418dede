//! What all commands that read a scene share: threads, loading, building.

use std::num::NonZero;

use claror::scene::{Scene, SceneError, SceneTables};
use claror_io::scene::{LoadOptions, LoadedScene};
use rayon::ThreadPool;

use crate::args::SceneArgs;
use crate::exit::{Exit, Failure};
use crate::messages::{Console, Report};
use crate::progress::{OnInterrupt, Phase};
use crate::signals::Interrupts;
use crate::units;

/// The threads that do the work.
pub(crate) fn thread_pool(args: &SceneArgs) -> Result<ThreadPool, Failure> {
    let available = || std::thread::available_parallelism().map_or(1, NonZero::get);
    let threads = args.threads.map_or_else(available, usize::from);
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|index| format!("worker {index}"))
        .build()
        .map_err(|error| {
            let what = units::plural(threads as u64, "thread");
            Failure::new(Exit::Memory, format!("cannot start {what}: {error}"))
                .hint("--threads sets another number")
        })
}

/// Reads the scene and shows its warnings.
pub(crate) fn load(
    args: &SceneArgs,
    console: &Console,
    interrupts: &Interrupts,
    pool: &ThreadPool,
) -> Result<LoadedScene, Failure> {
    let options = LoadOptions {
        defines: args.defines.clone(),
        lenient: args.lenient,
        ..LoadOptions::default()
    };
    let phase = Phase::start(console, interrupts, "load", OnInterrupt::Exit);
    let loaded = pool.install(|| claror_io::scene::load(&args.scene, &options))?;
    phase.finish();
    for warning in &loaded.warnings {
        console.warning(&Report::from(warning));
    }
    Ok(loaded)
}

/// Derives from the tables what rendering needs.
pub(crate) fn build(
    tables: SceneTables,
    args: &SceneArgs,
    console: &Console,
    interrupts: &Interrupts,
    pool: &ThreadPool,
) -> Result<Scene, Failure> {
    let needed = crate::memory::build_bytes(&tables);
    crate::memory::check(needed, "the geometry of this scene", args.max_memory)?;
    let phase = Phase::start(console, interrupts, "build", OnInterrupt::Exit);
    let scene = pool.install(|| Scene::build(tables)).map_err(|error| refuse(args, &error))?;
    phase.finish();
    Ok(scene)
}

fn refuse(args: &SceneArgs, error: &SceneError) -> Failure {
    use claror::accel::AccelError;
    let exit = match error {
        SceneError::Accel(AccelError::TooManyPrimitives(_)) => Exit::Memory,
        _ => Exit::Scene,
    };
    Failure::new(exit, format!("{}: {error}", args.scene.display()))
}
