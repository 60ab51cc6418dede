//! Integrators.

use claror::integrator::{
    Aov, AovKind, CACHE_PARAMETERS, GRID_PARAMETERS, GridParameter, IntegratorKind,
    IntegratorSettings, ParameterError, is_cache_parameter,
};

use super::Builder;
use crate::scene::description::{ObjectIndex, Tag};
use crate::scene::nearest::{hint, nearest};
use crate::scene::properties::Properties;
use crate::scene::values::short;

/// All integrator plugins.
const PLUGINS: [&str; 8] =
    ["path", "irrcache", "gridcache", "direct", "aov", "depth", "volpath", "volpathmis"];

impl<'a> Builder<'a> {
    /// The integrator of the scene.
    pub(super) fn scene_integrator(&mut self, index: ObjectIndex) {
        let span = self.object(index).span;
        if let Some(first) = self.integrator.replace(span) {
            let hint = format!("the first is at {}", self.log.describe(first));
            self.log.error(span, "only one integrator can be used", Some(hint));
        }
        if let Some(settings) = self.integrator(index) {
            self.tables.integrator = settings;
        }
    }

    fn integrator(&mut self, index: ObjectIndex) -> Option<IntegratorSettings> {
        let properties = self.properties(index);
        properties.ignore(&["block_size", "samples_per_pass", "timeout"]);
        let settings = match properties.plugin() {
            // Without media the volumetric integrators are path tracers.
            "path" | "volpath" | "volpathmis" => Some(path(&properties)),
            "direct" => Some(direct(&properties)),
            "irrcache" => Some(self.irrcache(&properties)),
            "gridcache" => Some(self.gridcache(&properties)),
            "depth" => {
                Some(IntegratorSettings { kind: IntegratorKind::Depth, ..Default::default() })
            }
            "aov" => self.aov(&properties),
            _ => {
                self.unsupported(&properties, &PLUGINS, "\"path\" is used instead");
                None
            }
        };
        self.finish(properties);
        settings
    }

    /// `irrcache` by itself, or around a path tracer as in Mitsuba 0.6.
    fn irrcache(&mut self, properties: &Properties<'a>) -> IntegratorSettings {
        let (inner, is_nested) = self.path_inside(properties);
        let mut settings = IntegratorSettings { kind: IntegratorKind::IrradianceCache, ..inner };
        properties.ignore(&CACHE_PARAMETERS.iter().map(|p| p.name).collect::<Vec<_>>());
        // What was set by which name.
        let mut given: Vec<(&str, &str)> = Vec::new();
        if !is_nested && properties.is_given("max_depth") {
            given.push(("max_depth", "max_depth"));
        }
        for (name, value) in properties.texts(is_cache_parameter) {
            match settings.set_cache_parameter(name, &value) {
                Ok(targets) => {
                    for target in targets {
                        if let Some((_, other)) = given.iter().find(|(t, _)| *t == target) {
                            let message = format!("\"{name}\" stands beside \"{other}\": give one");
                            properties.error(name, message, None);
                        }
                        given.push((target, name));
                    }
                }
                Err(error) => cannot_be(properties, name, &value, error),
            }
        }
        settings
    }

    /// `gridcache` by itself or around a path tracer.
    fn gridcache(&mut self, properties: &Properties<'a>) -> IntegratorSettings {
        let (inner, _) = self.path_inside(properties);
        let mut settings = IntegratorSettings { kind: IntegratorKind::GridCache, ..inner };
        properties.ignore(&GRID_PARAMETERS.iter().map(|p| p.name).collect::<Vec<_>>());
        for (name, value) in properties.texts(|name| GridParameter::named(name).is_some()) {
            let Some(parameter) = GridParameter::named(name) else { continue };
            if let Err(error) = parameter.set(&mut settings.grid, &value) {
                cannot_be(properties, name, &value, error);
            }
        }
        settings
    }

    /// The path tracer that an integrator stands around, or what its own parameters say of one;
    /// and whether there is a nested one.
    fn path_inside(&mut self, properties: &Properties<'a>) -> (IntegratorSettings, bool) {
        let nested = self.nested(properties, Tag::Integrator);
        if let Some((second, _)) = nested.get(1) {
            let message = format!("\"{}\" takes one nested integrator", properties.plugin());
            self.log.error(second.span, message, None);
        }
        match nested.first() {
            Some((_, index)) => (self.integrator(*index).unwrap_or_default(), true),
            None => (path(properties), false),
        }
    }

    fn aov(&mut self, properties: &Properties<'a>) -> Option<IntegratorSettings> {
        let list = properties.string("aovs");
        if list.is_none() {
            self.missing(properties, "aovs");
        }
        for token in list.unwrap_or_default().split(',').map(str::trim).filter(|t| !t.is_empty()) {
            let (name, word) = token.split_once(':').unwrap_or((token, token));
            match AovKind::from_name(word.trim()) {
                Some(kind) => {
                    self.tables.aovs.push(Aov { name: name.trim().to_owned(), kind });
                }
                None => {
                    let known: Vec<&str> = AovKind::ALL.iter().map(|k| k.name()).collect();
                    let message = format!("aov \"{}\" is not known", short(word));
                    properties.error("aovs", message, hint(word.trim(), known));
                }
            }
        }
        let nested = self.nested(properties, Tag::Integrator);
        if let Some((second, _)) = nested.get(1) {
            let message = "\"aov\" takes one nested integrator";
            self.log.error(second.span, message, None);
        }
        let (_, index) = nested.first()?;
        self.integrator(*index)
    }
}

/// Complains about the value of a parameter of the cache.
fn cannot_be(properties: &Properties, name: &str, value: &str, error: ParameterError) {
    match error {
        ParameterError::Value { expected, words } => {
            let message = format!("\"{name}\" = {} must be {expected}", short(value));
            // A list that is in the message need not be repeated.
            let near = nearest(value, words).map(|near| format!("did you mean \"{near}\"?"));
            properties.error(name, message, near);
        }
        other => {
            let message = format!("\"{name}\" = {} cannot be", short(value));
            properties.error(name, message, Some(other.to_string()));
        }
    }
}

/// `max_depth`, where −1 means no limit.
fn max_depth(properties: &Properties) -> Option<u32> {
    let range = -1..=i64::from(u32::MAX);
    u32::try_from(properties.integer("max_depth", -1, range)).ok()
}

fn path(properties: &Properties) -> IntegratorSettings {
    IntegratorSettings {
        kind: IntegratorKind::Path,
        max_depth: max_depth(properties),
        rr_depth: properties.count("rr_depth", 5, 1),
        early_roulette: properties.boolean("early_roulette", true),
        hide_emitters: properties.boolean("hide_emitters", false),
        ..Default::default()
    }
}

fn direct(properties: &Properties) -> IntegratorSettings {
    let both = properties.count("shading_samples", 1, 1);
    let emitter_samples = properties.count("emitter_samples", both, 0);
    let bsdf_samples = properties.count("bsdf_samples", both, 0);
    if properties.is_given("shading_samples") {
        for name in ["emitter_samples", "bsdf_samples"] {
            if properties.is_given(name) {
                let message = format!("\"{name}\" stands beside \"shading_samples\": give one");
                properties.error(name, message, None);
            }
        }
    }
    if emitter_samples == 0 && bsdf_samples == 0 {
        let message = "\"direct\" needs emitter or bsdf samples";
        properties.error("emitter_samples", message, None);
    }
    IntegratorSettings {
        kind: IntegratorKind::Direct { emitter_samples, bsdf_samples },
        max_depth: Some(2),
        hide_emitters: properties.boolean("hide_emitters", false),
        ..Default::default()
    }
}
