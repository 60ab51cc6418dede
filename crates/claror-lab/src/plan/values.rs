//! Values of plans: what may stand at the right of `=`.

use std::fmt;

use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer};

use super::SEED_LIMIT;

/// A number, word or switch, as the command line takes it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Scalar(pub String);

impl Scalar {
    fn new(value: &toml::Value) -> Option<Self> {
        match value {
            toml::Value::String(text) => Some(Self(text.clone())),
            toml::Value::Integer(number) => Some(Self(number.to_string())),
            toml::Value::Float(number) if number.is_finite() => Some(Self(number.to_string())),
            toml::Value::Boolean(switch) => Some(Self(switch.to_string())),
            _ => None,
        }
    }

    /// The number, if it is one.
    pub fn number(&self) -> Option<f64> {
        self.0.parse().ok()
    }
}

/// Parameters with their values, in the order of the file. Names are full: `integrator.error`.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Assignments(pub Vec<(String, Scalar)>);

impl Assignments {
    /// Sets a parameter, in place of an earlier value.
    pub fn set(&mut self, name: &str, value: Scalar) {
        match self.0.iter_mut().find(|(other, _)| other == name) {
            Some((_, old)) => *old = value,
            None => self.0.push((name.to_owned(), value)),
        }
    }

    /// Sets all parameters of `others`.
    pub fn extend(&mut self, others: &Self) {
        for (name, value) in &others.0 {
            self.set(name, value.clone());
        }
    }
}

impl<'de> Deserialize<'de> for Assignments {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut found = Self::default();
        for (name, value) in parameters(deserializer)? {
            let expected =
                || D::Error::custom(format!("{name}: expected a number, a word, true or false"));
            let value = Scalar::new(&value).ok_or_else(expected)?;
            found.set(&name, value);
        }
        Ok(found)
    }
}

/// Parameters with lists of values, in the order of the file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Vary(pub Vec<(String, Vec<Scalar>)>);

impl<'de> Deserialize<'de> for Vary {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut found = Vec::new();
        for (name, value) in parameters(deserializer)? {
            let list = value.as_array().filter(|list| !list.is_empty());
            let scalars: Option<Vec<Scalar>> =
                list.and_then(|list| list.iter().map(Scalar::new).collect());
            let expected =
                || D::Error::custom(format!("{name}: expected a list of values, as in [0.1, 0.2]"));
            found.push((name.clone(), scalars.ok_or_else(expected)?));
        }
        Ok(Self(found))
    }
}

/// Names and values of a table. A dot in a name that is not quoted makes a table in a table.
fn parameters<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Vec<(String, toml::Value)>, D::Error> {
    let mut found = Vec::new();
    for (name, value) in toml::Table::deserialize(deserializer)? {
        match value {
            toml::Value::Table(inner) => {
                found
                    .extend(inner.into_iter().map(|(key, value)| (format!("{name}.{key}"), value)));
            }
            value => found.push((full_name(&name), value)),
        }
    }
    Ok(found)
}

/// A name without an object is one of the integrator's.
pub(crate) fn full_name(name: &str) -> String {
    if name.contains('.') { name.to_owned() } else { format!("integrator.{name}") }
}

/// Width and height in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size(pub [u32; 2]);

impl std::str::FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers =
            text.split_once(['x', 'X', '×']).map(|(w, h)| (w.trim().parse(), h.trim().parse()));
        match numbers {
            Some((Ok(width), Ok(height))) if width > 0 && height > 0 => Ok(Self([width, height])),
            _ => Err("expected WIDTHxHEIGHT in pixels, as in \"640x480\"".to_owned()),
        }
    }
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.0[0], self.0[1])
    }
}

impl<'de> Deserialize<'de> for Size {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(D::Error::custom)
    }
}

/// A time in seconds: a number of seconds, or a text such as "15s", "5m", "1h 30m".
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Duration(pub f64);

impl<'de> Deserialize<'de> for Duration {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Times;
        impl Visitor<'_> for Times {
            type Value = f64;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a time above 0 such as \"15s\", \"5m\" or a number of seconds")
            }
            fn visit_i64<E: Error>(self, seconds: i64) -> Result<f64, E> {
                Ok(seconds as f64)
            }
            fn visit_f64<E: Error>(self, seconds: f64) -> Result<f64, E> {
                Ok(seconds)
            }
            fn visit_str<E: Error>(self, text: &str) -> Result<f64, E> {
                let time = humantime::parse_duration(text);
                time.map(|time| time.as_secs_f64())
                    .map_err(|_| E::invalid_value(serde::de::Unexpected::Str(text), &self))
            }
        }
        let seconds = deserializer.deserialize_any(Times)?;
        if seconds > 0.0 && seconds.is_finite() {
            return Ok(Self(seconds));
        }
        Err(D::Error::custom("a time must be above 0"))
    }
}

/// A number for all settings, or a list that is swept.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(untagged, expecting = "expected a whole number above 0, or a list of them")]
pub enum OneOrMany {
    /// One.
    One(u32),
    /// A sweep.
    Many(Vec<u32>),
}

impl OneOrMany {
    /// Whether it is swept.
    pub fn is_list(&self) -> bool {
        matches!(self, Self::Many(_))
    }

    fn all(&self) -> &[u32] {
        match self {
            Self::One(number) => std::slice::from_ref(number),
            Self::Many(numbers) => numbers,
        }
    }
}

pub(super) fn some_spp<'de, D: Deserializer<'de>>(d: D) -> Result<Option<OneOrMany>, D::Error> {
    let spp = OneOrMany::deserialize(d)?;
    if spp.all().is_empty() || spp.all().contains(&0) {
        return Err(D::Error::custom("expected whole numbers above 0"));
    }
    Ok(Some(spp))
}

pub(super) fn some_count<'de, D: Deserializer<'de>>(d: D) -> Result<Option<u32>, D::Error> {
    match u32::deserialize(d)? {
        0 => Err(D::Error::custom("expected a whole number above 0")),
        count => Ok(Some(count)),
    }
}

pub(super) fn threads<'de, D: Deserializer<'de>>(d: D) -> Result<Option<u16>, D::Error> {
    match u16::deserialize(d)? {
        count @ 1..=4096 => Ok(Some(count)),
        _ => Err(D::Error::custom("expected a number of threads from 1 to 4096")),
    }
}

pub(super) fn reference_spp<'de, D: Deserializer<'de>>(d: D) -> Result<u32, D::Error> {
    match u32::deserialize(d)? {
        0 | 1 => Err(D::Error::custom("a reference needs 2 samples per pixel at least")),
        spp => Ok(spp),
    }
}

pub(super) fn counts<'de, D: Deserializer<'de>>(d: D) -> Result<Vec<u32>, D::Error> {
    let counts = Vec::<u32>::deserialize(d)?;
    if counts.is_empty() || counts.contains(&0) {
        return Err(D::Error::custom("expected a list of whole numbers above 0"));
    }
    Ok(counts)
}

pub(super) fn positive_list<'de, D: Deserializer<'de>>(d: D) -> Result<Vec<f64>, D::Error> {
    let numbers = Vec::<f64>::deserialize(d)?;
    if numbers.iter().all(|&v| v > 0.0 && v.is_finite()) {
        return Ok(numbers);
    }
    Err(D::Error::custom("expected a list of numbers above 0"))
}

pub(super) fn seeds<'de, D: Deserializer<'de>>(d: D) -> Result<Vec<u64>, D::Error> {
    let seeds = Vec::<u64>::deserialize(d)?;
    let twice = (1..seeds.len()).any(|i| seeds[..i].contains(&seeds[i]));
    if seeds.is_empty() || twice || seeds.iter().any(|&seed| seed >= SEED_LIMIT) {
        let message = format!("expected different whole numbers from 0 to {}", SEED_LIMIT - 1);
        return Err(D::Error::custom(message));
    }
    Ok(seeds)
}

pub(super) fn some_seeds<'de, D: Deserializer<'de>>(d: D) -> Result<Option<Vec<u64>>, D::Error> {
    seeds(d).map(Some)
}
