//! The parameters of `irrcache` by name: the one table that scene files, the command line, the
//! documents and the fingerprints of pictures and caches go by.

mod aliases;
mod table;

use super::IrrCacheSettings;
use crate::integrator::IntegratorSettings;
use crate::integrator::parameter::{Change, Field, Parameter, ParameterError};
pub use aliases::{ALIASES, CacheAlias};
use aliases::{Meaning, same_name};
pub use table::PARAMETERS;

/// One parameter of [`IrrCacheSettings`].
pub type CacheParameter = Parameter<IrrCacheSettings>;

impl CacheParameter {
    /// The parameter of this name, capitals and underscores aside.
    pub fn find(name: &str) -> Option<&'static Self> {
        PARAMETERS.iter().find(|parameter| same_name(parameter.name, name))
    }
}

impl IntegratorSettings {
    /// Sets a parameter of the cache by its name here or elsewhere. Returns the names here of what
    /// was set, which may be `max_depth`.
    pub fn set_cache_parameter(
        &mut self,
        name: &str,
        value: &str,
    ) -> Result<Vec<&'static str>, ParameterError> {
        if let Some(parameter) = CacheParameter::find(name) {
            parameter.set(&mut self.cache, value)?;
            return Ok(vec![parameter.name]);
        }
        let unknown = || ParameterError::Unknown(name.to_owned());
        let alias = CacheAlias::find(name).ok_or_else(unknown)?;
        match alias.meaning {
            Meaning::Only { value: is_so, why } if !is_so(value.trim()) => {
                return Err(ParameterError::Refused(why));
            }
            Meaning::Only { .. } => {}
            Meaning::Is(names) => {
                let targets: Vec<_> =
                    names.iter().filter_map(|n| CacheParameter::find(n)).collect();
                for parameter in targets {
                    parameter.set(&mut self.cache, value)?;
                }
            }
            Meaning::Becomes { to, expected, convert } => {
                let expected =
                    || ParameterError::Value { expected: expected.into(), words: vec![] };
                let converted = convert(value.trim()).ok_or_else(expected)?;
                match CacheParameter::find(to) {
                    Some(parameter) => parameter.set(&mut self.cache, &converted)?,
                    None => self.max_depth = converted.parse().ok(),
                }
            }
        }
        Ok(alias.targets())
    }
}

/// Whether [`IntegratorSettings::set_cache_parameter`] knows the name.
pub fn is_cache_parameter(name: &str) -> bool {
    CacheParameter::find(name).is_some() || CacheAlias::find(name).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::irradiance::Criterion;

    /// Another value of each parameter than the default.
    fn other(parameter: &CacheParameter) -> String {
        let now = parameter.get(&IrrCacheSettings::default());
        match parameter.field {
            Field::Number { is_good, .. } => {
                let known = [0.37_f32, 1.5];
                known.into_iter().find(|&v| is_good(v)).expect("a good one").to_string()
            }
            Field::Count { least, .. } => (least + 1).to_string(),
            Field::Switch { .. } => (now != "true").to_string(),
            Field::Word { words, .. } => {
                words().into_iter().find(|word| *word != now).expect("two words").to_owned()
            }
        }
    }

    /// What is set is what is got, nothing else changes but what follows a criterion or the error,
    /// and names are unique.
    #[test]
    fn every_parameter_is_set_and_got() {
        let default = IrrCacheSettings::default();
        for parameter in PARAMETERS {
            let mut settings = default;
            let value = other(parameter);
            parameter.set(&mut settings, &value).expect(parameter.name);
            assert_eq!(parameter.get(&settings), value, "{}", parameter.name);
            assert_ne!(settings, default, "{}", parameter.name);
            for unchanged in PARAMETERS.iter().filter(|p| p.name != parameter.name) {
                let derived = ["gather_samples", "noise", "min_pixel_spacing"];
                let follows = derived.contains(&unchanged.name)
                    && matches!(parameter.name, "error" | "quality");
                if parameter.name != "criterion" && !follows {
                    let (was, is) = (unchanged.get(&default), unchanged.get(&settings));
                    assert_eq!(was, is, "{} by {}", unchanged.name, parameter.name);
                }
            }
            assert!(!parameter.doc.is_empty() && !parameter.doc.ends_with('.'));
        }
        for (i, parameter) in PARAMETERS.iter().enumerate() {
            assert!(PARAMETERS[..i].iter().all(|p| p.name != parameter.name));
        }
    }

    /// The values in force can be set again, whatever the criterion.
    #[test]
    fn listed_values_are_values() {
        for criterion in Criterion::ALL {
            let settings = IrrCacheSettings { criterion, ..Default::default() };
            for parameter in PARAMETERS {
                let mut again = settings;
                parameter.set(&mut again, &parameter.get(&settings)).expect(parameter.name);
                assert_eq!(parameter.get(&again), parameter.get(&settings), "{}", parameter.name);
            }
        }
    }

    /// Values from elsewhere, and what they are here.
    #[test]
    fn names_of_others_are_known() {
        for (name, value, here) in [
            ("resolution", "14", &[("gather_samples", "392")][..]),
            ("quality", "2", &[("quality", "2")]),
            ("quality_adjustment", "0.5", &[("overlap", "2")]),
            ("clampNeighbor", "true", &[("clamp_neighbor", "true")]),
            ("clampScreen", "true", &[]),
            ("indirectOnly", "false", &[]),
            ("debug", "false", &[]),
            ("minweight", "0.25", &[("min_weight", "0.25")]),
            ("minpixelspacing", "2.5", &[("min_pixel_spacing", "2.5")]),
            ("maxpixelspacing", "15", &[("max_pixel_spacing", "15")]),
            ("maxangledifference", "12", &[("max_angle", "12")]),
            ("nsamples", "4096", &[("gather_samples", "4096")]),
            ("maxindirectdepth", "3", &[("max_depth", "5")]),
            ("aa", "0.15", &[("error", "0.15"), ("accuracy", "0.15")]),
            ("ar", "256", &[("ambient_resolution", "256")]),
            ("ad", "1024", &[("gather_samples", "1024")]),
            ("as", "0", &[]),
            ("ab", "0", &[("max_depth", "2")]),
            ("A", "0.3", &[("accuracy", "0.3")]),
            ("a", "0.3", &[("accuracy", "0.3")]),
        ] {
            let mut settings = IntegratorSettings::default();
            let set = settings.set_cache_parameter(name, value).expect(name);
            let names: Vec<&str> = here.iter().map(|(name, _)| *name).collect();
            assert_eq!(set, names, "{name}");
            assert!(is_cache_parameter(name));
            for (target, expected) in here {
                let found = match CacheParameter::find(target) {
                    Some(parameter) => parameter.get(&settings.cache),
                    None => settings.max_depth.expect("a limit").to_string(),
                };
                assert_eq!(found, *expected, "{name}");
            }
        }
    }

    #[test]
    fn what_others_do_alone_is_refused() {
        for (name, value, why) in [
            ("as", "512", "bias"),
            ("clampScreen", "false", "min_radius"),
            ("indirectOnly", "true", "--layers"),
            ("direct", "false", "--layers"),
            ("debug", "true", "painted"),
            ("maxspeculardepth", "5", "max_depth"),
            ("av", "0.1", "ambient"),
            ("resolution", "2", "from 3 to 181"),
            ("ab", "-1", "a whole number"),
            ("aa", "0", "above 0"),
            ("ac", "0", "no parameter `ac`"),
        ] {
            let mut settings = IntegratorSettings::default();
            let error = settings.set_cache_parameter(name, value).expect_err(name).to_string();
            assert!(error.contains(why), "{name}: {error}");
            assert_eq!(settings, IntegratorSettings::default());
        }
    }

    /// No name means two things, and what an alias sets exists.
    #[test]
    fn aliases_are_sound() {
        for (i, alias) in ALIASES.iter().enumerate() {
            assert!(CacheParameter::find(alias.name).is_none(), "{} is ours", alias.name);
            assert!(ALIASES[..i].iter().all(|other| !same_name(other.name, alias.name)));
            for target in alias.targets() {
                assert!(target == "max_depth" || PARAMETERS.iter().any(|p| p.name == target));
            }
        }
    }

    #[test]
    fn impossible_values_are_refused() {
        for (name, value) in [
            ("criterion", "ward"),
            ("error", "0"),
            ("error", "nan"),
            ("accuracy", "inf"),
            ("gather_samples", "15"),
            ("gather_samples", "1e9"),
            ("analytic_direct", "maybe"),
            ("debias", "1.5"),
            ("debias", "-0.1"),
        ] {
            let mut settings = IrrCacheSettings::default();
            let parameter = CacheParameter::find(name).expect(name);
            assert!(parameter.set(&mut settings, value).is_err(), "{name}={value} was accepted");
            assert_eq!(settings, IrrCacheSettings::default());
        }
    }
}
