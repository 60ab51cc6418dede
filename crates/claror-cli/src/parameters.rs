//! Parameters of a render by name: what `-p` sets, what `-v` and the picture's metadata list, and
//! what a checkpoint must agree on.

use std::fmt::Display;
use std::str::FromStr;

use claror::film::{CropWindow, FilterKind};
use claror::integrator::{
    CACHE_ALIASES, CACHE_PARAMETERS, GRID_PARAMETERS, GridParameter, IntegratorKind,
    IntegratorSettings, Parameter as Named, is_cache_parameter,
};
use claror::sampler::SamplerKind;
use claror::sensor::Sensor;

pub(crate) mod reference;

/// What the parameters belong to.
#[derive(Debug)]
pub(crate) struct Target<'a> {
    pub(crate) integrator: &'a mut IntegratorSettings,
    pub(crate) sensor: &'a mut Sensor,
}

/// One parameter.
struct Parameter {
    name: &'static str,
    get: fn(&IntegratorSettings, &Sensor) -> Option<String>,
    set: fn(&mut Target, &str) -> Result<(), String>,
}

/// All parameters, in the order in which they are listed.
const PARAMETERS: &[Parameter] = &[
    Parameter {
        name: "integrator.type",
        get: |integrator, _| Some(integrator_name(integrator.kind).to_owned()),
        set: |target, value| set_integrator(target.integrator, value),
    },
    Parameter {
        name: "integrator.max_depth",
        get: |integrator, _| Some(integrator.max_depth.map_or(-1, i64::from).to_string()),
        set: |target, value| match number::<i64>(value)? {
            -1 => {
                target.integrator.max_depth = None;
                Ok(())
            }
            depth => {
                let depth = u32::try_from(depth);
                target.integrator.max_depth =
                    Some(depth.map_err(|_| "expected a depth, or -1 for no limit".to_owned())?);
                Ok(())
            }
        },
    },
    Parameter {
        name: "integrator.rr_depth",
        get: |integrator, _| Some(integrator.rr_depth.to_string()),
        set: |target, value| match number(value)? {
            0 => Err("Russian roulette begins at depth 1 or later".to_owned()),
            depth => assign(&mut target.integrator.rr_depth, depth),
        },
    },
    Parameter {
        name: "integrator.early_roulette",
        get: |integrator, _| Some(integrator.early_roulette.to_string()),
        set: |target, value| assign(&mut target.integrator.early_roulette, boolean(value)?),
    },
    Parameter {
        name: "integrator.hide_emitters",
        get: |integrator, _| Some(integrator.hide_emitters.to_string()),
        set: |target, value| assign(&mut target.integrator.hide_emitters, boolean(value)?),
    },
    Parameter {
        name: "integrator.emitter_samples",
        get: |integrator, _| direct(integrator.kind).map(|(emitter, _)| emitter.to_string()),
        set: |target, value| set_direct(target.integrator, Some(number(value)?), None),
    },
    Parameter {
        name: "integrator.bsdf_samples",
        get: |integrator, _| direct(integrator.kind).map(|(_, bsdf)| bsdf.to_string()),
        set: |target, value| set_direct(target.integrator, None, Some(number(value)?)),
    },
    Parameter {
        name: "sampler.type",
        get: |_, sensor| Some(sampler_name(sensor.sampler.kind).to_owned()),
        set: |target, value| set_sampler(target.sensor, value),
    },
    Parameter {
        name: "sampler.seed",
        get: |_, sensor| Some(sensor.sampler.seed.to_string()),
        set: |target, value| assign(&mut target.sensor.sampler.seed, number(value)?),
    },
    Parameter {
        name: "sampler.sample_count",
        get: |_, sensor| Some(sensor.sampler.sample_count.to_string()),
        set: |target, value| match number(value)? {
            0 => Err("a pixel needs at least one sample".to_owned()),
            count => assign(&mut target.sensor.sampler.sample_count, count),
        },
    },
    Parameter {
        name: "sensor.near_clip",
        get: |_, sensor| Some(sensor.near_clip.to_string()),
        set: |target, value| assign(&mut target.sensor.near_clip, positive(value)?),
    },
    Parameter {
        name: "sensor.far_clip",
        get: |_, sensor| Some(sensor.far_clip.to_string()),
        set: |target, value| assign(&mut target.sensor.far_clip, positive(value)?),
    },
    Parameter {
        name: "film.width",
        get: |_, sensor| Some(sensor.film.width.to_string()),
        set: |target, value| resize(target.sensor, number(value)?, target.sensor.film.height),
    },
    Parameter {
        name: "film.height",
        get: |_, sensor| Some(sensor.film.height.to_string()),
        set: |target, value| resize(target.sensor, target.sensor.film.width, number(value)?),
    },
    Parameter {
        name: "film.crop",
        get: |_, sensor| {
            let CropWindow { x, y, width, height } = sensor.film.crop;
            Some(format!("{x},{y},{width},{height}"))
        },
        set: |target, value| crop(target.sensor, crate::units::parse_crop(value)?),
    },
    Parameter {
        name: "film.alpha",
        get: |_, sensor| Some(sensor.film.alpha.to_string()),
        set: |target, value| assign(&mut target.sensor.film.alpha, boolean(value)?),
    },
    Parameter {
        name: "film.rfilter",
        get: |_, sensor| Some(filter_name(sensor.film.filter)),
        set: |target, value| set_filter(target.sensor, value),
    },
];

/// Names of all parameters: those of the irradiance cache and of the grid follow the others of the
/// integrator.
pub(crate) fn names() -> Vec<String> {
    let (integrator, others) = PARAMETERS.split_at(integrator_parameters());
    let name = |parameter: &Parameter| parameter.name.to_owned();
    let of_cache = CACHE_PARAMETERS.iter().map(|parameter| parameter.name);
    let is_new = |name: &&str| CACHE_PARAMETERS.iter().all(|parameter| parameter.name != *name);
    let of_grid = GRID_PARAMETERS.iter().map(|parameter| parameter.name).filter(is_new);
    let stored = of_cache.chain(of_grid).map(|name| format!("integrator.{name}"));
    integrator.iter().map(name).chain(stored).chain(others.iter().map(name)).collect()
}

/// What the help says about `-p`.
pub(crate) fn help() -> String {
    let (of_integrator, others) = PARAMETERS.split_at(integrator_parameters());
    let join = |parameters: &[Parameter]| {
        parameters.iter().map(|parameter| parameter.name).collect::<Vec<_>>().join(", ")
    };
    let mut text = format!(
        "Set a parameter, such as integrator.max_depth=4\n\nThe parameters are: {}, {}; and with \
         the integrator irrcache:\n",
        join(of_integrator),
        join(others)
    );
    fn line<S>(parameter: &Named<S>) -> String {
        let Named { name, doc, .. } = parameter;
        format!("\n- integrator.{name}: {doc} ({})", parameter.expected())
    }
    text.extend(CACHE_PARAMETERS.iter().map(line));
    text += "\n\nWith the integrator gridcache:\n";
    text.extend(GRID_PARAMETERS.iter().map(line));
    let others: Vec<&str> = CACHE_ALIASES.iter().map(|alias| alias.name).collect();
    text += "\n\nNames of other programs are taken for irrcache as well: ";
    text += &others.join(", ");
    text + "\n\nA max_depth of -1 is no limit, emitter_samples and bsdf_samples are of direct, film.crop is \
          X,Y,W,H. `-v` shows the values in force."
}

/// How many of the first parameters are the integrator's.
fn integrator_parameters() -> usize {
    PARAMETERS.iter().take_while(|parameter| parameter.name.starts_with("integrator.")).count()
}

/// Sets the parameter `name`; the error says what is wrong and, second, what to do.
pub(crate) fn set(target: &mut Target, name: &str, value: &str) -> Result<(), (String, String)> {
    let wrong = |why| (format!("`{value}` cannot be the value of {name}"), why);
    if let Some(parameter) = PARAMETERS.iter().find(|parameter| parameter.name == name) {
        return (parameter.set)(target, value.trim()).map_err(wrong);
    }
    if let Some(name) = name.strip_prefix("integrator.") {
        let of_grid = GridParameter::named(name);
        let uses_grid = target.integrator.kind == IntegratorKind::GridCache;
        match of_grid {
            Some(parameter) if uses_grid || !is_cache_parameter(name) => {
                return set_of_grid(target.integrator, parameter, value).map_err(wrong);
            }
            _ if is_cache_parameter(name) => {
                return set_of_cache(target.integrator, name, value).map_err(wrong);
            }
            _ => {}
        }
    }
    let names = names();
    let known = names.iter().map(String::as_str);
    let all = || format!("known are: {}", names.join(", "));
    let hint = claror_io::scene::nearest_name_hint(name, known).unwrap_or_else(all);
    Err((format!("there is no parameter `{name}`"), hint))
}

fn set_of_cache(settings: &mut IntegratorSettings, name: &str, value: &str) -> Result<(), String> {
    if settings.kind != IntegratorKind::IrradianceCache {
        return Err("only the integrator irrcache has it; add -i irrcache".to_owned());
    }
    settings.set_cache_parameter(name, value).map(drop).map_err(|error| error.to_string())
}

fn set_of_grid(
    settings: &mut IntegratorSettings,
    parameter: &GridParameter,
    value: &str,
) -> Result<(), String> {
    if settings.kind != IntegratorKind::GridCache {
        return Err("only the integrator gridcache has it; add -i gridcache".to_owned());
    }
    parameter.set(&mut settings.grid, value).map_err(|error| error.to_string())
}

/// All parameters with their values, those that do not apply left out.
pub(crate) fn list(integrator: &IntegratorSettings, sensor: &Sensor) -> Vec<(String, String)> {
    let (of_integrator, others) = PARAMETERS.split_at(integrator_parameters());
    let value = |parameter: &Parameter| {
        Some((parameter.name.to_owned(), (parameter.get)(integrator, sensor)?))
    };
    let has_cache = integrator.kind == IntegratorKind::IrradianceCache;
    let of_cache = CACHE_PARAMETERS.iter().filter(|_| has_cache).map(|parameter| {
        (format!("integrator.{}", parameter.name), parameter.get(&integrator.cache))
    });
    let has_grid = integrator.kind == IntegratorKind::GridCache;
    let of_grid = GRID_PARAMETERS.iter().filter(|_| has_grid).map(|parameter| {
        (format!("integrator.{}", parameter.name), parameter.get(&integrator.grid))
    });
    let of_integrator = of_integrator.iter().filter_map(value);
    let stored = of_cache.chain(of_grid);
    of_integrator.chain(stored).chain(others.iter().filter_map(value)).collect()
}

fn assign<T>(place: &mut T, value: T) -> Result<(), String> {
    *place = value;
    Ok(())
}

fn number<T: FromStr>(value: &str) -> Result<T, String> {
    value.parse().map_err(|_| "expected a whole number in range".to_owned())
}

fn positive(value: &str) -> Result<f32, String> {
    crate::units::parse_positive(value)
}

fn boolean(value: &str) -> Result<bool, String> {
    match value {
        "true" | "yes" | "1" => Ok(true),
        "false" | "no" | "0" => Ok(false),
        _ => Err("expected true or false".to_owned()),
    }
}

pub(crate) fn integrator_name(kind: IntegratorKind) -> &'static str {
    match kind {
        IntegratorKind::Path => "path",
        IntegratorKind::Direct { .. } => "direct",
        IntegratorKind::Depth => "depth",
        IntegratorKind::IrradianceCache => "irrcache",
        IntegratorKind::GridCache => "gridcache",
    }
}

/// Another algorithm; `volpath` is `path` where there are no media, as in scene files.
pub(crate) fn set_integrator(settings: &mut IntegratorSettings, name: &str) -> Result<(), String> {
    settings.kind = match name {
        "path" | "volpath" => IntegratorKind::Path,
        // What the scene says about the numbers of samples stays.
        "direct" => match direct(settings.kind) {
            Some(_) => settings.kind,
            None => IntegratorKind::Direct { emitter_samples: 1, bsdf_samples: 1 },
        },
        "depth" => IntegratorKind::Depth,
        "irrcache" => IntegratorKind::IrradianceCache,
        "gridcache" => IntegratorKind::GridCache,
        _ => {
            return Err(
                "the integrators are irrcache, path, direct, gridcache and depth".to_owned()
            );
        }
    };
    Ok(())
}

fn direct(kind: IntegratorKind) -> Option<(u32, u32)> {
    match kind {
        IntegratorKind::Direct { emitter_samples, bsdf_samples } => {
            Some((emitter_samples, bsdf_samples))
        }
        _ => None,
    }
}

fn set_direct(
    settings: &mut IntegratorSettings,
    emitter: Option<u32>,
    bsdf: Option<u32>,
) -> Result<(), String> {
    let Some(old) = direct(settings.kind) else {
        return Err("only the integrator direct has it; add -i direct".to_owned());
    };
    let (emitter_samples, bsdf_samples) = (emitter.unwrap_or(old.0), bsdf.unwrap_or(old.1));
    if emitter_samples == 0 && bsdf_samples == 0 {
        return Err("at least one of the two numbers of samples must not be 0".to_owned());
    }
    settings.kind = IntegratorKind::Direct { emitter_samples, bsdf_samples };
    Ok(())
}

fn sampler_name(kind: SamplerKind) -> &'static str {
    match kind {
        SamplerKind::Sobol => "sobol",
        SamplerKind::Independent => "independent",
    }
}

/// Another sample pattern.
pub(crate) fn set_sampler(sensor: &mut Sensor, name: &str) -> Result<(), String> {
    sensor.sampler.kind = match name {
        "sobol" => SamplerKind::Sobol,
        "independent" => SamplerKind::Independent,
        _ => return Err("the samplers are sobol and independent".to_owned()),
    };
    Ok(())
}

/// Another size of the film. The horizontal field of view belongs to the sensor and stays; a crop
/// would mean another part of the picture and is given up.
pub(crate) fn resize(sensor: &mut Sensor, width: u32, height: u32) -> Result<(), String> {
    if width == 0 || height == 0 {
        return Err("a picture needs at least one pixel each way".to_owned());
    }
    sensor.film.width = width;
    sensor.film.height = height;
    sensor.film.crop = CropWindow { x: 0, y: 0, width, height };
    Ok(())
}

/// Only a part of the film.
pub(crate) fn crop(sensor: &mut Sensor, [x, y, width, height]: [u32; 4]) -> Result<(), String> {
    let (columns, rows) = (sensor.film.width, sensor.film.height);
    let inside =
        |start: u32, length: u32, all: u32| start.checked_add(length).is_some_and(|end| end <= all);
    if !inside(x, width, columns) || !inside(y, height, rows) {
        return Err(format!("the crop reaches beyond the film of {columns}x{rows} pixels"));
    }
    sensor.film.crop = CropWindow { x, y, width, height };
    Ok(())
}

fn filter_name(filter: FilterKind) -> String {
    fn with(name: &str, value: impl Display) -> String {
        format!("{name}({value})")
    }
    match filter {
        FilterKind::Box { radius } => with("box", radius),
        FilterKind::Tent { radius } => with("tent", radius),
        FilterKind::Gaussian { stddev } => with("gaussian", stddev),
        FilterKind::Mitchell { b, c } => with("mitchell", format_args!("{b},{c}")),
        FilterKind::CatmullRom => "catmullrom".to_owned(),
        FilterKind::Lanczos { lobes } => with("lanczos", lobes),
    }
}

/// Filters by name, with Mitsuba's default parameters.
fn set_filter(sensor: &mut Sensor, name: &str) -> Result<(), String> {
    sensor.film.filter = match name {
        "box" => FilterKind::Box { radius: 0.5 },
        "tent" => FilterKind::Tent { radius: 1.0 },
        "gaussian" => FilterKind::Gaussian { stddev: 0.5 },
        "mitchell" => FilterKind::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 },
        "catmullrom" => FilterKind::CatmullRom,
        "lanczos" => FilterKind::Lanczos { lobes: 3 },
        _ => {
            return Err(
                "the filters are box, tent, gaussian, mitchell, catmullrom and lanczos".to_owned()
            );
        }
    };
    Ok(())
}

#[cfg(test)]
mod tests;
