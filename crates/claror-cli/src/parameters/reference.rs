//! The page about all parameters, made from the tables that read them.

use std::fmt::Write;
use std::io;
use std::path::Path;

use claror::integrator::{
    CACHE_ALIASES, CACHE_PARAMETERS, CacheParameter, Change, GRID_PARAMETERS, IntegratorSettings,
    IrrCacheSettings, Parameter as Named,
};
use claror::irradiance::Criterion;
use claror::sensor::Sensor;
use claror_io::scene::{Files, LoadOptions, load_from};

use super::{PARAMETERS, Parameter, integrator_parameters};

/// What a parameter that is not of the cache means, and what it can be.
struct Description {
    name: &'static str,
    doc: &'static str,
    values: &'static str,
}

const fn describe(name: &'static str, doc: &'static str, values: &'static str) -> Description {
    Description { name, doc, values }
}

/// One for each of [`PARAMETERS`], in any order.
const DESCRIPTIONS: &[Description] = &[
    describe(
        "integrator.type",
        "how light is computed",
        "one of irrcache, gridcache, path, direct, depth; volpath is path",
    ),
    describe(
        "integrator.max_depth",
        "longest path: 1 is emission seen directly, 2 adds direct light, 3 one bounce, and so on",
        "a whole number of at least 0; -1: no limit",
    ),
    describe(
        "integrator.rr_depth",
        "paths of this length or more may end by Russian roulette",
        "a whole number of at least 1",
    ),
    describe(
        "integrator.early_roulette",
        "paths that carry little may end by roulette before `rr_depth`: the same mean in less time",
        "true or false",
    ),
    describe(
        "integrator.hide_emitters",
        "lights are not seen by the camera; what is behind them is",
        "true or false",
    ),
    describe(
        "integrator.emitter_samples",
        "of `direct`: samples of lights per camera sample",
        "a whole number; not 0 if `bsdf_samples` is",
    ),
    describe(
        "integrator.bsdf_samples",
        "of `direct`: samples of the material per camera sample",
        "a whole number; not 0 if `emitter_samples` is",
    ),
    describe(
        "sampler.type",
        "sample pattern: Owen-scrambled Sobol points, or independent ones",
        "one of sobol, independent",
    ),
    describe(
        "sampler.seed",
        "another seed gives another picture of the same mean; the same seed the same bits",
        "a whole number up to 2^64 - 1",
    ),
    describe(
        "sampler.sample_count",
        "samples per pixel, as `--spp`; `irrcache` may stop earlier where a pixel is done",
        "a whole number of at least 1",
    ),
    describe(
        "sensor.near_clip",
        "nothing nearer than this is seen by the camera",
        "a number above 0, scene units",
    ),
    describe(
        "sensor.far_clip",
        "nothing farther than this is seen by the camera",
        "a number above 0, scene units",
    ),
    describe("film.width", "width of the picture; gives up a crop", "a whole number, pixels"),
    describe("film.height", "height of the picture; gives up a crop", "a whole number, pixels"),
    describe("film.crop", "the part of the film that is rendered", "X,Y,W,H in pixels of the film"),
    describe("film.alpha", "the picture has an alpha channel", "true or false"),
    describe(
        "film.rfilter",
        "reconstruction filter, with Mitsuba's parameters",
        "one of box, tent, gaussian, mitchell, catmullrom, lanczos",
    ),
];

const INTRODUCTION: &str = "\
# Parameters

<!-- Written by `claror parameters --markdown`. Do not edit: change the tables in the code. -->

A scene file sets a parameter inside of its `<integrator>`, `<sampler>`, `<sensor>` or `<film>`;
`-p OBJECT.NAME=VALUE` sets it on the command line and wins. `claror render -v` prints the values in force, and so do the
metadata of an EXR file. A misspelt name is an error with a suggestion.
";

const CACHE_INTRODUCTION: &str = "
## Irradiance caching

Of the integrator `irrcache`: `-p integrator.NAME=VALUE`. The tutorial explains them from [Ward's records](tutorial/04-records.md) on,
[the table of artefacts](artefacts.md) says which to change when something looks wrong.

Defaults are those of `criterion` = `hessian`; where another criterion has another one, it follows. \"Other names\" are those
of Mitsuba 0.6, pbrt-v2, Radiance and the thesis that set the same parameter. Capitals and underscores in names do not
matter: `clampNeighbor` and `minweight` need no entry. [How the values relate](parameters-of-others.md).
";

/// The page in Markdown.
pub(crate) fn markdown() -> String {
    let mut page = INTRODUCTION.to_owned();
    let (integrator, sensor) = defaults();
    let (of_integrator, others) = PARAMETERS.split_at(integrator_parameters());
    section(&mut page, "Integrator", of_integrator, &integrator, &sensor);
    cache_section(&mut page);
    grid_section(&mut page, &integrator);
    let (of_sampler, others) = split(others, "sampler.");
    section(&mut page, "Sampler", of_sampler, &integrator, &sensor);
    let (of_sensor, of_film) = split(others, "sensor.");
    section(&mut page, "Sensor", of_sensor, &integrator, &sensor);
    section(&mut page, "Film", of_film, &integrator, &sensor);
    page
}

/// All parameters for the terminal, one below the other.
pub(crate) fn text() -> String {
    let (integrator, sensor) = defaults();
    let mut text = String::new();
    for parameter in PARAMETERS {
        let Description { doc, values, .. } = description(parameter.name);
        let default = (parameter.get)(&integrator, &sensor).unwrap_or_else(|| "1".to_owned());
        text += &format!("{} = {default}\n    {doc}\n    {values}\n", parameter.name);
    }
    for parameter in CACHE_PARAMETERS {
        let CacheParameter { name, doc, .. } = parameter;
        let default = default_of(parameter, "").replace('`', "");
        text += &format!("integrator.{name} = {default}\n    {doc}\n    {}\n", values(parameter));
    }
    for parameter in GRID_PARAMETERS {
        let Named { name, doc, .. } = parameter;
        let default = parameter.get(&integrator.grid);
        text += &format!(
            "integrator.{name} = {default} (gridcache)\n    {doc}\n    {}\n",
            values(parameter)
        );
    }
    text
}

fn split<'a>(parameters: &'a [Parameter], object: &str) -> (&'a [Parameter], &'a [Parameter]) {
    let inside = parameters.iter().take_while(|p| p.name.starts_with(object)).count();
    parameters.split_at(inside)
}

fn section(
    page: &mut String,
    title: &str,
    parameters: &[Parameter],
    integrator: &IntegratorSettings,
    sensor: &Sensor,
) {
    *page += &format!("\n## {title}\n\n| name | meaning | values | default |\n|---|---|---|---|\n");
    for parameter in parameters {
        let Description { name, doc, values } = description(parameter.name);
        // What only `direct` has is 1 there.
        let default = (parameter.get)(integrator, sensor).unwrap_or_else(|| "1".to_owned());
        row(page, &[&format!("`{name}`"), doc, values, &default]);
    }
}

fn cache_section(page: &mut String) {
    *page += CACHE_INTRODUCTION;
    *page += "\n| name | meaning | values | default | other names |\n|---|---|---|---|---|\n";
    for parameter in CACHE_PARAMETERS {
        let name = format!("`{}`", parameter.name);
        let default = default_of(parameter, "`");
        let others = other_names(parameter.name);
        row(page, &[&name, parameter.doc, &values(parameter), &default, &others]);
    }
    let others = other_names("max_depth");
    *page += &format!("\n`max_depth` is also set by {others}.\n");
    let free = CACHE_PARAMETERS.iter().filter(|parameter| parameter.changes < Change::Records);
    let free: Vec<String> = free.map(|parameter| format!("`{}`", parameter.name)).collect();
    *page += &format!(
        "A cache file made with one value of {} serves any other; all other parameters above make other records.\n",
        free.join(" or ")
    );
}

fn grid_section(page: &mut String, integrator: &IntegratorSettings) {
    *page += "\n## Grid in the picture\n\nOf the integrator `gridcache`; [what it is for](tutorial/03-grid.md).\n\n";
    *page += "| name | meaning | values | default |\n|---|---|---|---|\n";
    for parameter in GRID_PARAMETERS {
        let name = format!("`{}`", parameter.name);
        let default = parameter.get(&integrator.grid);
        row(page, &[&name, parameter.doc, &values(parameter), &default]);
    }
}

/// The default, and those of the criteria that have another one. `quote` stands around names.
fn default_of(parameter: &CacheParameter, quote: &str) -> String {
    let of =
        |criterion| parameter.get(&IrrCacheSettings { criterion, ..IrrCacheSettings::default() });
    let usual = parameter.get(&IrrCacheSettings::default());
    let mut text = usual.clone();
    if parameter.name == "criterion" {
        return text;
    }
    let mut others: Vec<(String, Vec<String>)> = Vec::new();
    for criterion in Criterion::ALL {
        let value = of(criterion);
        if value == usual {
            continue;
        }
        let name = format!("{quote}{}{quote}", criterion.name());
        match others.iter_mut().find(|(other, _)| *other == value) {
            Some((_, names)) => names.push(name),
            None => others.push((value, vec![name])),
        }
    }
    for (value, names) in others {
        text += &format!("; {}: {value}", names.join(", "));
    }
    text
}

/// What it can be, with its unit.
fn values<S>(parameter: &Named<S>) -> String {
    match parameter.unit {
        "" | "1" => parameter.expected(),
        unit => format!("{}, {unit}", parameter.expected()),
    }
}

/// Names elsewhere of what a parameter is.
fn other_names(target: &str) -> String {
    let of_others = CACHE_ALIASES.iter().filter(|alias| alias.targets().contains(&target));
    let names: Vec<String> =
        of_others.map(|alias| format!("`{}` ({})", alias.name, alias.system)).collect();
    names.join(", ")
}

fn row(page: &mut String, cells: &[&str]) {
    for cell in cells {
        let cell = cell.replace('|', "\\|");
        write!(page, "| {cell} ").expect("writing to memory does not fail");
    }
    *page += "|\n";
}

fn description(name: &str) -> &'static Description {
    let found = DESCRIPTIONS.iter().find(|description| description.name == name);
    found.expect("a test finds a description of every parameter")
}

/// What holds in a scene that says nothing about it.
fn defaults() -> (IntegratorSettings, Sensor) {
    let scene = load_from(&Bare, Path::new("bare.xml"), &LoadOptions::default());
    let tables = scene.expect("the bare scene is valid").tables;
    let sensor = tables.sensors.into_iter().next().expect("it has a sensor");
    (tables.integrator, sensor)
}

/// A scene that says nothing.
struct Bare;

impl Files for Bare {
    fn read(&self, _: &Path, _: u64) -> io::Result<Vec<u8>> {
        let scene =
            r#"<scene version="3.0.0"><sensor type="perspective"/><shape type="sphere"/></scene>"#;
        Ok(scene.as_bytes().to_vec())
    }

    fn is_file(&self, _: &Path) -> bool {
        true
    }

    fn is_dir(&self, _: &Path) -> bool {
        false
    }

    fn list(&self, _: &Path) -> Vec<String> {
        Vec::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_parameter_is_described_once() {
        for parameter in PARAMETERS {
            let described = DESCRIPTIONS.iter().filter(|d| d.name == parameter.name).count();
            assert_eq!(described, 1, "{}", parameter.name);
        }
        assert_eq!(DESCRIPTIONS.len(), PARAMETERS.len(), "of parameters that do not exist");
    }

    #[test]
    fn defaults_of_criteria_are_told() {
        let accuracy = CacheParameter::find("accuracy").expect("it exists");
        assert_eq!(default_of(accuracy, "`"), "0.2; `tabellion04`: 1");
        assert_eq!(other_names("accuracy"), "`aa` (Radiance), `A` (thesis)");
    }

    #[test]
    fn page_and_text_name_all() {
        let (page, text) = (markdown(), text());
        for name in crate::parameters::names() {
            assert!(text.contains(&format!("{name} = ")), "{name}");
            let short = name.strip_prefix("integrator.").unwrap_or(&name);
            let listed = [&*name, short].iter().any(|n| page.contains(&format!("\n| `{n}` |")));
            assert!(listed, "{name}");
        }
    }
}
