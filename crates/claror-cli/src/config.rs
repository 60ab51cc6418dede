//! What the options mean, as far as it can be said without the scene.

use std::path::{Path, PathBuf};
use std::time::Duration;

use claror::integrator::{Aov, AovKind, IntegratorKind, IntegratorSettings};
use claror::render::RenderSettings;
use claror::scene::SceneTables;
use claror::spectrum::Rgb;
use claror_io::image::Format;

use claror::verify::{Budget, VerifySettings};

use crate::args::{
    self, CacheArgs, CacheMode, ChangeArgs, PointColor, RenderArgs, SceneArgs, ShowArgs, VerifyArgs,
};
use crate::exit::Failure;
use crate::output::{self, Destination, Output};
use crate::parameters::{self, Target};

/// A render as it was asked for.
#[derive(Debug)]
pub(crate) struct RenderConfig {
    pub(crate) scene: SceneArgs,
    pub(crate) outputs: Vec<Output>,
    pub(crate) exposure: f32,
    pub(crate) layers: bool,
    pub(crate) aovs: Vec<Aov>,
    pub(crate) stop: RenderSettings,
    pub(crate) changes: ChangeArgs,
    pub(crate) checkpoint: Option<Checkpoint>,
    pub(crate) cache: Option<Cache>,
    pub(crate) show_points: Option<ShowPoints>,
    pub(crate) verify: Option<VerifyConfig>,
}

/// What is to be done with a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Task {
    /// Make pictures.
    Render,
    /// Make a picture in order to check it.
    Verify,
}

/// How the finished picture is checked.
#[derive(Debug)]
pub(crate) struct VerifyConfig {
    /// Checks; none for a share of the render's time.
    checks: Option<u32>,
    share_of_time: f64,
    /// All but the budget.
    settings: VerifySettings,
    pub(crate) strict: bool,
    pub(crate) picture: Option<(PathBuf, Format)>,
}

impl VerifyConfig {
    /// Time for the checks in units of the render's.
    const RENDER_SHARE: f64 = 0.1;
    const VERIFY_SHARE: f64 = 1.0;

    fn new(args: &VerifyArgs, task: Task) -> Result<Option<Self>, Failure> {
        if task == Task::Render && args.verify.is_none() {
            let lonely = [
                ("--verify-paths", args.verify_paths.is_some()),
                ("--verify-bias", args.verify_bias.is_some()),
                ("--verify-tolerance", args.verify_tolerance.is_some()),
                ("--verify-share", args.verify_share.is_some()),
                ("--verify-picture", args.verify_picture.is_some()),
                ("--strict", args.strict),
            ];
            return match lonely.iter().find(|(_, given)| *given) {
                Some((name, _)) => Err(Failure::usage(format!("{name} needs --verify"))),
                None => Ok(None),
            };
        }
        let picture = args.verify_picture.as_ref();
        let picture = picture.map(|path| picture_file("--verify-picture", path));
        let default = VerifySettings::default();
        Ok(Some(Self {
            checks: args.verify.flatten(),
            share_of_time: match task {
                Task::Render => Self::RENDER_SHARE,
                Task::Verify => Self::VERIFY_SHARE,
            },
            settings: VerifySettings {
                paths: args.verify_paths.unwrap_or(default.paths),
                tolerance: args.verify_tolerance.unwrap_or(default.tolerance),
                max_bias: args.verify_bias.unwrap_or(default.max_bias),
                max_share: args.verify_share.unwrap_or(default.max_share),
                ..default
            },
            strict: args.strict,
            picture: picture.transpose()?,
        }))
    }

    /// For a picture that took `rendered` to render.
    pub(crate) fn settings(&self, rendered: Duration) -> VerifySettings {
        let budget = match self.checks {
            Some(checks) => Budget::Checks(checks),
            None => Budget::Time(rendered.mul_f64(self.share_of_time)),
        };
        VerifySettings { budget, ..self.settings }
    }
}

/// The file of a further picture, and its format.
fn picture_file(option: &str, path: &Path) -> Result<(PathBuf, Format), Failure> {
    let output = Output::new(path, Format::Png)?;
    match output.destination {
        Destination::File(path) => Ok((path, output.format)),
        Destination::Stdout => Err(Failure::usage(format!("{option} takes a file"))),
    }
}

/// A picture that shows the records of the irradiance cache, or the points of a grid.
#[derive(Debug)]
pub(crate) struct ShowPoints {
    pub(crate) file: PathBuf,
    pub(crate) format: Format,
    pub(crate) radii: bool,
    pub(crate) color: Rgb,
}

impl ShowPoints {
    fn new(args: &ShowArgs) -> Result<Option<Self>, Failure> {
        let Some(path) = &args.show_points else { return Ok(None) };
        let (file, format) = picture_file("--show-points", path)?;
        let color = match args.show_color {
            PointColor::Black => Rgb::BLACK,
            PointColor::White => Rgb::WHITE,
            PointColor::Red => Rgb::new(1.0, 0.0, 0.0),
            PointColor::Green => Rgb::new(0.0, 1.0, 0.0),
            PointColor::Blue => Rgb::new(0.0, 0.0, 1.0),
            PointColor::Yellow => Rgb::new(1.0, 1.0, 0.0),
        };
        Ok(Some(Self { file, format, radii: args.show_radii, color }))
    }

    /// Beside a picture: `room.points.png` of `room.exr`.
    fn beside(picture: &Path) -> Self {
        let file = picture.with_extension("points.png");
        Self { file, format: Format::Png, radii: false, color: Rgb::BLACK }
    }
}

/// Where and how often the state is kept.
#[derive(Debug)]
pub(crate) struct Checkpoint {
    pub(crate) file: PathBuf,
    pub(crate) every: Duration,
    pub(crate) resume: bool,
}

/// Where the irradiance cache is kept, and whether an old one is used.
#[derive(Debug)]
pub(crate) struct Cache {
    pub(crate) file: PathBuf,
    pub(crate) mode: CacheMode,
}

impl RenderConfig {
    /// Of the options; fails before any work if the results could not be written.
    pub(crate) fn new(args: RenderArgs, task: Task, json: bool) -> Result<Self, Failure> {
        let outputs = outputs(&args, task, json)?;
        let verify = VerifyConfig::new(&args.verify, task)?;
        let show_points = ShowPoints::new(&args.show)?;
        let checkpoint = args.checkpoint.checkpoint.map(|file| Checkpoint {
            file,
            every: args.checkpoint.every,
            resume: args.checkpoint.resume,
        });
        let cache = cache(args.cache)?;
        let config = Self {
            scene: args.scene,
            outputs,
            exposure: args.output.exposure,
            layers: args.output.layers,
            aovs: args.output.aov.iter().map(|name| aov(name)).collect::<Result<_, _>>()?,
            stop: RenderSettings {
                spp: args.stop.spp,
                max_seconds: args.stop.time.map(|time| time.as_secs_f64()),
                target_error: args.stop.error,
                scene_hash: None,
            },
            changes: args.change,
            checkpoint,
            cache,
            show_points,
            verify,
        };
        output::check_writable(&config.written_files())?;
        Ok(config)
    }

    /// All files that are to be written.
    fn written_files(&self) -> Vec<&Path> {
        let written_cache = self.cache.iter().filter(|cache| cache.mode != CacheMode::Read);
        self.outputs
            .iter()
            .filter_map(Output::file)
            .chain(self.checkpoint.iter().map(|checkpoint| checkpoint.file.as_path()))
            .chain(written_cache.map(|cache| cache.file.as_path()))
            .chain(self.show_points.iter().map(|show| show.file.as_path()))
            .chain(self.verify.iter().filter_map(|v| Some(v.picture.as_ref()?.0.as_path())))
            .collect()
    }

    /// True when a picture goes to standard output.
    pub(crate) fn takes_stdout(&self) -> bool {
        self.outputs.iter().any(|output| output.destination == Destination::Stdout)
    }

    /// Makes the changes that were asked for; returns the number of the sensor.
    pub(crate) fn apply(&self, tables: &mut SceneTables) -> Result<usize, Failure> {
        let index = choose_sensor(tables, self.changes.sensor.as_deref())?;
        let mut target =
            Target { integrator: &mut tables.integrator, sensor: &mut tables.sensors[index] };
        change(&mut target, &self.changes)?;
        let kind = target.integrator.kind;
        for aov in &self.aovs {
            if tables.aovs.iter().any(|other| other.name == aov.name) {
                return Err(Failure::usage(format!("two layers would be called {}", aov.name)));
            }
            tables.aovs.push(aov.clone());
        }
        self.check_cache(kind, &tables.aovs)?;
        Ok(index)
    }

    /// Follows the scene where it wants its records or points shown and no option says how. False
    /// when there is no file beside which that could be.
    pub(crate) fn follow_show_points(
        &mut self,
        integrator: &IntegratorSettings,
    ) -> Result<bool, Failure> {
        let is_wanted = match integrator.kind {
            IntegratorKind::IrradianceCache => integrator.cache.show_points,
            IntegratorKind::GridCache => integrator.grid.show_points,
            _ => false,
        };
        if !is_wanted || self.show_points.is_some() {
            return Ok(true);
        }
        let Some(picture) = self.outputs.iter().find_map(Output::file) else { return Ok(false) };
        self.show_points = Some(ShowPoints::beside(picture));
        output::check_writable(&self.written_files())?;
        Ok(true)
    }

    /// Fails if something is asked of an irradiance cache and the integrator uses none.
    fn check_cache(&self, kind: IntegratorKind, aovs: &[Aov]) -> Result<(), Failure> {
        if kind == IntegratorKind::IrradianceCache {
            return Ok(());
        }
        let layer = aovs.iter().find(|aov| aov.kind.needs_cache());
        // A grid has points, too, but keeps no file, and its points have no radii.
        let has_points = kind == IntegratorKind::GridCache;
        let has_radii = self.show_points.as_ref().is_some_and(|show| show.radii);
        let what = match layer {
            _ if self.cache.is_some() => "--cache".to_owned(),
            _ if has_points && has_radii => "--show-radii".to_owned(),
            _ if self.show_points.is_some() && !has_points => "--show-points".to_owned(),
            Some(aov) => format!("layer {}", aov.name),
            None => return Ok(()),
        };
        let name = parameters::integrator_name(kind);
        Err(Failure::usage(format!("{what}: the integrator {name} uses no irradiance cache"))
            .hint("-i irrcache chooses the one that does"))
    }
}

/// Without a mode nothing that exists is used or replaced: both would surprise somebody.
fn cache(args: CacheArgs) -> Result<Option<Cache>, Failure> {
    let Some(file) = args.cache else { return Ok(None) };
    let mode = match args.cache_mode {
        Some(mode) => mode,
        None if file.exists() => {
            let message = format!("{} exists, and no --cache-mode is given", file.display());
            return Err(Failure::usage(message).hint(
                "read uses it as it is, update adds what this view lacks, write replaces it",
            ));
        }
        None => CacheMode::Write,
    };
    Ok(Some(Cache { file, mode }))
}

fn outputs(args: &RenderArgs, task: Task, json: bool) -> Result<Vec<Output>, Failure> {
    if args.output.outputs.is_empty() {
        return match task {
            Task::Render => Output::defaults(&args.scene.scene),
            Task::Verify => Ok(Vec::new()),
        };
    }
    let format = match args.output.format {
        args::Format::Exr => Format::Exr,
        args::Format::Png => Format::Png,
        args::Format::Hdr => Format::Hdr,
        args::Format::Pfm => Format::Pfm,
    };
    let outputs: Vec<Output> = args
        .output
        .outputs
        .iter()
        .map(|argument| Output::new(argument, format))
        .collect::<Result<_, _>>()?;
    let to_stdout = outputs.iter().filter(|o| o.destination == Destination::Stdout).count();
    if to_stdout > 1 {
        return Err(Failure::usage("-o - can be given once only"));
    }
    if to_stdout == 1 && json {
        return Err(Failure::usage("--json and -o - both want standard output"));
    }
    Ok(outputs)
}

/// A further layer: `albedo`, `Albedo`, or with a name of its own, `colour:albedo`.
fn aov(text: &str) -> Result<Aov, Failure> {
    let (layer, kind) = text.split_once(':').unzip();
    let wanted = kind.unwrap_or(text).trim();
    let found = AovKind::ALL
        .into_iter()
        .find(|kind| kind.name() == wanted || kind.default_layer() == wanted);
    let Some(kind) = found else {
        let names: Vec<&str> = AovKind::ALL.into_iter().map(AovKind::name).collect();
        return Err(Failure::usage(format!("there is no layer `{wanted}`"))
            .hint(format!("the layers are {}", names.join(", "))));
    };
    let name = layer.map_or_else(|| kind.default_layer().to_owned(), |l| l.trim().to_owned());
    Ok(Aov { name, kind })
}

fn choose_sensor(tables: &SceneTables, wanted: Option<&str>) -> Result<usize, Failure> {
    let sensors = &tables.sensors;
    let Some(wanted) = wanted else {
        return if sensors.is_empty() {
            Err(Failure::new(crate::exit::Exit::Scene, "the scene has no sensor"))
        } else {
            Ok(0)
        };
    };
    let by_name = sensors.iter().position(|sensor| sensor.name == wanted);
    let by_number = || wanted.parse().ok().filter(|index| *index < sensors.len());
    by_name.or_else(by_number).ok_or_else(|| {
        let names: Vec<String> = sensors
            .iter()
            .enumerate()
            .map(|(index, sensor)| match sensor.name.as_str() {
                "" => index.to_string(),
                name => format!("{index} ({name})"),
            })
            .collect();
        Failure::usage(format!("the scene has no sensor `{wanted}`"))
            .hint(format!("its sensors are {}", names.join(", ")))
    })
}

/// The options with names of their own first, then `-p` in the order typed.
fn change(target: &mut Target, changes: &ChangeArgs) -> Result<(), Failure> {
    let named = |option: &str, result: Result<(), String>| {
        result.map_err(|why| Failure::usage(format!("{option}: {why}")))
    };
    if let Some(name) = &changes.integrator {
        named("--integrator", parameters::set_integrator(target.integrator, name))?;
    }
    if let Some(name) = &changes.sampler {
        named("--sampler", parameters::set_sampler(target.sensor, name))?;
    }
    if let Some(seed) = changes.seed {
        target.sensor.sampler.seed = seed;
    }
    if let Some((width, height)) = changes.size {
        named("--size", parameters::resize(target.sensor, width, height))?;
    }
    for (name, value) in &changes.parameters {
        parameters::set(target, name, value)
            .map_err(|(what, help)| Failure::usage(what).hint(help))?;
    }
    if let Some(crop) = changes.crop {
        named("--crop", parameters::crop(target.sensor, crop))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_go_by_either_name_or_their_own() {
        let named = |text: &str| aov(text).map(|aov| (aov.name, aov.kind)).ok();
        assert_eq!(named("albedo"), Some(("Albedo".to_owned(), AovKind::Albedo)));
        assert_eq!(named("Ns"), Some(("Ns".to_owned(), AovKind::ShadingNormal)));
        assert_eq!(named("mine:depth"), Some(("mine".to_owned(), AovKind::Depth)));
        assert_eq!(named("colour"), None);
    }
}
