//! Typed access to the properties of an object, with all the complaints about them.
//!
//! Every property that is asked for becomes a known name; when the object is finished, the
//! properties that nobody asked for are reported with the nearest known name. Complaints go to
//! the log, and the caller gets a usable value, so that one pass finds everything that is wrong.

use std::cell::RefCell;

use claror::math::{DAffine3, DMat4, DVec3, Transform, Vec3};

use super::description::{Object, ObjectIndex, Property, Value};
use super::nearest::hint;
use super::source::{Log, Span};
use super::values::short;

/// The properties of one object.
pub(super) struct Properties<'a> {
    object: &'a Object,
    log: &'a Log,
    known: RefCell<Vec<&'static str>>,
    /// By index of the property: asked for.
    used: RefCell<Vec<bool>>,
}

impl<'a> Properties<'a> {
    /// Nothing asked for yet.
    pub(super) fn new(object: &'a Object, log: &'a Log) -> Self {
        let used = RefCell::new(vec![false; object.properties.len()]);
        Self { object, log, known: RefCell::default(), used }
    }

    /// The object.
    pub(super) fn object(&self) -> &'a Object {
        self.object
    }

    /// The type of the plugin.
    pub(super) fn plugin(&self) -> &'a str {
        &self.object.plugin
    }

    /// The object's element.
    pub(super) fn span(&self) -> Span {
        self.object.span
    }

    /// The place of a property, or of the object when it is not there.
    pub(super) fn span_of(&self, name: &str) -> Span {
        self.object.properties.iter().find(|p| p.name == name).map_or(self.object.span, |p| p.span)
    }

    /// True when there is a property of that name, readable or not.
    pub(super) fn is_given(&self, name: &str) -> bool {
        self.object.properties.iter().any(|p| p.name == name)
    }

    /// True when the property is given. It becomes a known name.
    pub(super) fn has(&self, name: &'static str) -> bool {
        self.get(name).is_some()
    }

    /// The property of that name, unless it is missing or broken.
    pub(super) fn get(&self, name: &'static str) -> Option<&'a Property> {
        let mut known = self.known.borrow_mut();
        if !known.contains(&name) {
            known.push(name);
        }
        let index = self.object.properties.iter().position(|p| p.name == name)?;
        self.used.borrow_mut()[index] = true;
        let property = &self.object.properties[index];
        (property.value != Value::Broken).then_some(property)
    }

    /// Something is wrong with the property `name`.
    pub(super) fn error(&self, name: &str, message: impl Into<String>, hint: Option<String>) {
        self.log.error(self.span_of(name), message, hint);
    }

    fn wrong_type(&self, property: &Property, expected: &str) {
        let message = format!(
            "\"{}\" of \"{}\" is {}, expected {expected}",
            property.name,
            short(self.plugin()),
            property.value.type_name()
        );
        self.log.error(property.span, message, None);
    }

    /// A number; an integer is welcome, too.
    pub(super) fn double(&self, name: &'static str) -> Option<f64> {
        let property = self.get(name)?;
        match property.value {
            Value::Float(v) => Some(v),
            #[expect(clippy::cast_precision_loss, reason = "integers are far below 2^53")]
            Value::Integer(v) => Some(v as f64),
            _ => {
                self.wrong_type(property, "a float");
                None
            }
        }
    }

    /// A number in single precision.
    pub(super) fn opt_float(&self, name: &'static str) -> Option<f32> {
        let wide = self.double(name)?;
        #[expect(clippy::cast_possible_truncation, reason = "the scene is rendered in f32")]
        let narrow = wide as f32;
        if !narrow.is_finite() {
            let message = format!("\"{name}\" = {wide:e} is too large for single precision");
            self.error(name, message, None);
            return None;
        }
        Some(narrow)
    }

    /// A number in single precision, or the default.
    pub(super) fn float(&self, name: &'static str, default: f32) -> f32 {
        self.opt_float(name).unwrap_or(default)
    }

    /// A number for which `good` holds; `what` says how it must be.
    pub(super) fn float_that(
        &self,
        name: &'static str,
        default: f32,
        what: &str,
        good: impl Fn(f32) -> bool,
    ) -> f32 {
        let value = self.float(name, default);
        if good(value) {
            return value;
        }
        self.error(name, format!("\"{name}\" = {value} must be {what}"), None);
        default
    }

    /// A positive number.
    pub(super) fn positive(&self, name: &'static str, default: f32) -> f32 {
        self.float_that(name, default, "positive", |v| v > 0.0)
    }

    /// A whole number.
    pub(super) fn opt_integer(&self, name: &'static str) -> Option<i64> {
        let property = self.get(name)?;
        if let Value::Integer(v) = property.value {
            return Some(v);
        }
        self.wrong_type(property, "an integer");
        None
    }

    /// A whole number in `range`, or the default.
    pub(super) fn integer(
        &self,
        name: &'static str,
        default: i64,
        range: std::ops::RangeInclusive<i64>,
    ) -> i64 {
        let Some(value) = self.opt_integer(name) else { return default };
        if range.contains(&value) {
            return value;
        }
        let (low, high) = (range.start(), range.end());
        let what = if *high >= i64::from(i32::MAX) {
            format!("at least {low}")
        } else {
            format!("between {low} and {high}")
        };
        self.error(name, format!("\"{name}\" = {value} must be {what}"), None);
        default
    }

    /// [`Properties::integer`] from `low` to 2³² − 1.
    pub(super) fn count(&self, name: &'static str, default: u32, low: u32) -> u32 {
        let range = i64::from(low)..=i64::from(u32::MAX);
        u32::try_from(self.integer(name, i64::from(default), range)).unwrap_or(default)
    }

    /// A boolean, or the default.
    pub(super) fn boolean(&self, name: &'static str, default: bool) -> bool {
        match self.get(name) {
            Some(Property { value: Value::Boolean(v), .. }) => *v,
            Some(property) => {
                self.wrong_type(property, "a boolean");
                default
            }
            None => default,
        }
    }

    /// A string.
    pub(super) fn string(&self, name: &'static str) -> Option<&'a str> {
        let property = self.get(name)?;
        if let Value::String(v) = &property.value {
            return Some(v);
        }
        self.wrong_type(property, "a string");
        None
    }

    /// Numbers, booleans and strings as texts, for parameters that read texts themselves: those
    /// with a name that is `wanted`, in the order of the file.
    pub(super) fn texts(&self, wanted: impl Fn(&str) -> bool) -> Vec<(&'a str, String)> {
        let mut texts = Vec::new();
        let mut used = self.used.borrow_mut();
        for (property, used) in self.object.properties.iter().zip(used.iter_mut()) {
            if !wanted(&property.name) {
                continue;
            }
            *used = true;
            let text = match &property.value {
                Value::Float(v) => v.to_string(),
                Value::Integer(v) => v.to_string(),
                Value::Boolean(v) => v.to_string(),
                Value::String(v) => v.clone(),
                Value::Broken => continue,
                _ => {
                    self.wrong_type(property, "a number, boolean or string");
                    continue;
                }
            };
            texts.push((property.name.as_str(), text));
        }
        texts
    }

    /// One of several words, or the first of them as the default; case is ignored.
    pub(super) fn choice<T: Copy>(&self, name: &'static str, known: &[(&'static str, T)]) -> T {
        let default = known[0].1;
        let Some(word) = self.string(name) else { return default };
        match known.iter().find(|(k, _)| k.eq_ignore_ascii_case(word)) {
            Some((_, value)) => *value,
            None => {
                let message = format!("\"{name}\" = \"{}\" is not known", short(word));
                self.error(name, message, hint(word, known.iter().map(|(k, _)| *k)));
                default
            }
        }
    }

    /// A point or vector.
    pub(super) fn vector(&self, name: &'static str) -> Option<DVec3> {
        let property = self.get(name)?;
        if let Value::Vector(v) = property.value {
            return Some(v);
        }
        self.wrong_type(property, "a vector");
        None
    }

    /// A point or vector in single precision.
    pub(super) fn vec3(&self, name: &'static str) -> Option<Vec3> {
        let narrow = self.vector(name)?.as_vec3();
        if !narrow.is_finite() {
            self.error(name, format!("\"{name}\" is too large for single precision"), None);
            return None;
        }
        Some(narrow)
    }

    /// A 4 × 4 matrix.
    pub(super) fn matrix(&self, name: &'static str) -> Option<DMat4> {
        let property = self.get(name)?;
        if let Value::Transform(m) = &property.value {
            return Some(**m);
        }
        self.wrong_type(property, "a transform");
        None
    }

    /// An affine map, the identity when it is not given.
    pub(super) fn affine(&self, name: &'static str) -> DAffine3 {
        let Some(matrix) = self.matrix(name) else { return DAffine3::IDENTITY };
        let last = matrix.row(3);
        if last.x != 0.0 || last.y != 0.0 || last.z != 0.0 || last.w == 0.0 {
            let message = format!("\"{name}\" is a projection: its last row must be 0 0 0 1");
            self.error(name, message, None);
            return DAffine3::IDENTITY;
        }
        DAffine3::from_mat4(matrix * (1.0 / last.w))
    }

    /// `affine(name)` times `local` as an invertible transform.
    pub(super) fn transform(&self, name: &'static str, local: DAffine3) -> Transform {
        let to_world = self.affine(name) * local;
        Transform::new(to_world).unwrap_or_else(|| {
            let (message, hint) = if to_world.is_finite() {
                let message = format!("\"{name}\" of \"{}\" is singular", short(self.plugin()));
                (message, "a scale of zero or a matrix of too small a rank cannot be inverted")
            } else {
                (format!("\"{name}\" of \"{}\" is not finite", short(self.plugin())), "")
            };
            self.error(name, message, (!hint.is_empty()).then(|| hint.to_owned()));
            Transform::IDENTITY
        })
    }

    /// All nested or referred objects for which `wanted` holds, in the order of the file. They
    /// count as asked for.
    pub(super) fn objects(
        &self,
        wanted: impl Fn(&Property, ObjectIndex) -> bool,
    ) -> Vec<(&'a Property, ObjectIndex)> {
        let mut used = self.used.borrow_mut();
        let mut found = Vec::new();
        for (i, property) in self.object.properties.iter().enumerate() {
            if let Value::Object(index) = property.value
                && !used[i]
                && wanted(property, index)
            {
                used[i] = true;
                found.push((property, index));
            }
        }
        found
    }

    /// True when something could not be read or resolved, which has been told.
    pub(super) fn has_broken(&self) -> bool {
        self.object.properties.iter().any(|p| p.value == Value::Broken)
    }

    /// Names that are known but have no meaning here.
    pub(super) fn ignore(&self, names: &[&'static str]) {
        for name in names {
            self.get(name);
        }
    }

    /// Counts everything as asked for: the plugin is not known.
    pub(super) fn ignore_all(&self) {
        self.used.borrow_mut().fill(true);
    }

    /// Reports the properties that nobody asked for. `name_of` says what an object is.
    pub(super) fn finish(self, name_of: impl Fn(ObjectIndex) -> String) {
        let used = self.used.into_inner();
        let known = self.known.into_inner();
        for (property, _) in self.object.properties.iter().zip(used).filter(|(_, used)| !used) {
            let plugin = short(&self.object.plugin);
            let (message, hint) = match (&property.value, property.name.as_str()) {
                (Value::Object(index), "") => {
                    (format!("\"{plugin}\" has no use for {}", name_of(*index)), None)
                }
                // A reference that could not be resolved: told already.
                (Value::Broken, "") => continue,
                (_, name) => (
                    format!("\"{plugin}\" has no parameter \"{}\"", short(name)),
                    hint(name, known.iter().copied()),
                ),
            };
            self.log.error(property.span, message, hint);
        }
    }
}
