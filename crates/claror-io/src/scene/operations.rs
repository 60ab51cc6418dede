//! Leaf elements: the operations of `<transform>` and the values of properties.

use std::path::{Path, PathBuf};

use claror::math::{DMat4, DVec3};

use super::description::{Description, Object, ObjectIndex, Property, SpectrumValue, Tag, Value};
use super::element::Element;
use super::nearest::hint;
use super::search::SearchPath;
use super::source::{Files, Log};
use super::{text, values};
use crate::Limits;
use crate::diagnostic::Subject;

/// Elements that may stand inside `<transform>`.
pub(super) const NAMES: [&str; 5] = ["translate", "rotate", "scale", "lookat", "matrix"];

/// Reads an attribute; tells the user what is wrong with it.
fn read_attribute<T>(
    element: &Element,
    name: &str,
    log: &Log,
    read: impl FnOnce(&str) -> Result<T, String>,
) -> Option<T> {
    match read(element.get(name)?) {
        Ok(value) => Some(value),
        Err(reason) => {
            let message = format!("\"{name}\" of <{}>: {reason}", element.name);
            log.error(element.span_of(name), message, None);
            None
        }
    }
}

/// `x`, `y`, `z`, or `value` with one or three numbers.
fn components(element: &Element, default: f64, log: &Log) -> Option<DVec3> {
    if element.get("value").is_some() {
        if let Some(name) = ["x", "y", "z"].into_iter().find(|n| element.get(n).is_some()) {
            let message = format!("<{}> has both \"value\" and \"{name}\"", element.name);
            log.error(element.span_of(name), message, None);
            return None;
        }
        return read_attribute(element, "value", log, values::triple);
    }
    let component = |name: &str| match element.get(name) {
        Some(_) => read_attribute(element, name, log, values::float),
        None => Some(default),
    };
    Some(DVec3::new(component("x")?, component("y")?, component("z")?))
}

/// One operation of a transform; `None` after an error. Files of Mitsuba 0.6 write `lookAt`.
pub(super) fn read(element: &Element, old: bool, log: &Log) -> Option<DMat4> {
    const XYZ: [&str; 4] = ["value", "x", "y", "z"];
    let name = if old && element.name == "lookAt" { "lookat" } else { element.name };
    match name {
        "translate" => {
            let good = element.check(&[], &XYZ, log);
            let v = components(element, 0.0, log)?;
            good.then(|| DMat4::from_translation(v))
        }
        "scale" => {
            let good = element.check(&[], &XYZ, log);
            let v = components(element, 1.0, log)?;
            good.then(|| DMat4::from_scale(v))
        }
        "rotate" => {
            let good = element.check(&["angle"], &XYZ, log);
            let axis = components(element, 0.0, log)?;
            let angle = read_attribute(element, "angle", log, values::float)?;
            let rotation = values::rotation(axis, angle);
            if rotation.is_none() {
                log.error(element.span, "the axis of <rotate> is zero", None);
            }
            rotation.filter(|_| good)
        }
        "matrix" => {
            let good = element.check(&["value"], &[], log);
            let matrix = read_attribute(element, "value", log, values::matrix)?;
            good.then_some(matrix)
        }
        "lookat" => look_at(element, log),
        _ => {
            let message = format!("<{}> cannot stand inside <transform>", element.name);
            log.error(element.span, message, hint(element.name, NAMES));
            None
        }
    }
}

fn look_at(element: &Element, log: &Log) -> Option<DMat4> {
    if !element.check(&["origin", "target"], &["up"], log) {
        return None;
    }
    let origin = read_attribute(element, "origin", log, values::vector)?;
    let target = read_attribute(element, "target", log, values::vector)?;
    let up = match element.get("up") {
        Some(_) => read_attribute(element, "up", log, values::vector)?,
        None => DVec3::ZERO,
    };
    let matrix = values::look_at(origin, target, up);
    if matrix.is_none() {
        let message = "<lookat> looks nowhere: target at origin, or up along the view";
        log.error(element.span, message, None);
    }
    matrix
}

/// What the value of a property may need.
pub(super) struct Context<'a> {
    pub(super) old: bool,
    pub(super) log: &'a Log,
    pub(super) files: &'a dyn Files,
    pub(super) search: &'a SearchPath,
    pub(super) from: &'a Path,
    pub(super) limits: &'a Limits,
}

/// The value of a property and the file that it was read from, if any; `None` when there is no
/// such element.
pub(super) fn property(element: &Element, context: &Context) -> Option<(Value, Option<PathBuf>)> {
    let log = context.log;
    let named = |read: &dyn Fn(&str) -> Result<Value, String>| {
        let good = element.check(&["name", "value"], &[], log);
        let value = read_attribute(element, "value", log, read);
        value.filter(|_| good).unwrap_or(Value::Broken)
    };
    let rgb = |v: DVec3| Value::Rgb(v.to_array());
    let value = match element.name {
        "float" => named(&|t| values::float(t).map(Value::Float)),
        "integer" => named(&|t| values::integer(t).map(Value::Integer)),
        "boolean" => named(&|t| values::boolean(t).map(Value::Boolean)),
        "string" => named(&|t| Ok(Value::String(t.to_owned()))),
        "srgb" => named(&|t| values::srgb(t).map(rgb)),
        "rgb" => named(&|t| {
            if t.trim_start().starts_with('#') {
                let reason = "hexadecimal colours are sRGB: write <srgb …> instead of <rgb …>";
                return Err(reason.to_owned());
            }
            values::triple(t).map(rgb)
        }),
        "vector" | "point" => {
            let names: &[&str] = match element.get("value") {
                Some(_) => &["name", "value"],
                None => &["name", "x", "y", "z"],
            };
            let good = element.check(names, &[], log);
            let value = if good { components(element, 0.0, log) } else { None };
            value.map_or(Value::Broken, Value::Vector)
        }
        "spectrum" => return Some(spectrum(element, context)),
        _ => return None,
    };
    Some((value, None))
}

fn spectrum(element: &Element, context: &Context) -> (Value, Option<PathBuf>) {
    let log = context.log;
    let broken = (Value::Broken, None);
    if !element.check(&["name"], &["value", "filename"], log) {
        return broken;
    }
    match (element.get("value"), element.get("filename")) {
        (Some(text), None) => {
            // Mitsuba 0.6 wrote colours as spectra of three values.
            if let (true, Ok([_, _, _])) = (context.old, values::floats(text).as_deref()) {
                let rgb = read_attribute(element, "value", log, values::vector);
                return (rgb.map_or(Value::Broken, |v| Value::Rgb(v.to_array())), None);
            }
            let value = read_attribute(element, "value", log, values::spectrum);
            (value.map_or(Value::Broken, |s| Value::Spectrum(Box::new(s))), None)
        }
        (None, Some(name)) => match spectrum_file(name, element, context) {
            Some((value, path)) => (Value::Spectrum(Box::new(value)), Some(path)),
            None => broken,
        },
        _ => {
            let message = "<spectrum> needs either \"value\" or \"filename\"";
            log.error(element.span, message, None);
            broken
        }
    }
}

fn spectrum_file(
    name: &str,
    element: &Element,
    context: &Context,
) -> Option<(SpectrumValue, PathBuf)> {
    let span = element.span_of("filename");
    let failed = |subject, message: String| {
        context.log.error_about(subject, span, message, None);
        None
    };
    let Some(path) = context.search.find(context.files, name, context.from) else {
        return failed(Subject::File, format!("\"{}\" is not found", values::short(name)));
    };
    // A measured spectrum has a few hundred lines.
    const MAX_BYTES: u64 = 1 << 20;
    let bytes = match context.files.read(&path, MAX_BYTES) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == std::io::ErrorKind::FileTooLarge => {
            return failed(Subject::File, format!("\"{}\" is larger than 1 MiB", path.display()));
        }
        Err(error) => {
            let (subject, message) = text::describe_io(&path, &error, context.limits);
            return failed(subject, message);
        }
    };
    match values::spectrum_file(&String::from_utf8_lossy(&bytes)) {
        Ok(value) => Some((value, path)),
        Err(reason) => failed(Subject::File, format!("\"{}\": {reason}", path.display())),
    }
}

/// `<blackbody temperature="5000K"/>` of Mitsuba 0.6 as the texture of today.
pub(super) fn old_blackbody(
    description: &mut Description,
    owner: ObjectIndex,
    element: &Element,
    log: &Log,
) {
    if !element.check(&["name", "temperature"], &["scale"], log) {
        return;
    }
    let kelvin = |t: &str| values::float(t.trim().trim_end_matches(['K', 'k']));
    let span = element.span;
    let property = |name: &str, value: Option<f64>| Property {
        name: name.to_owned(),
        value: value.map_or(Value::Broken, Value::Float),
        span,
    };
    let mut properties =
        vec![property("temperature", read_attribute(element, "temperature", log, kelvin))];
    if element.get("scale").is_some() {
        properties.push(property("scale", read_attribute(element, "scale", log, values::float)));
    }
    let index = description.objects.len();
    description.objects.push(Object {
        tag: Tag::Texture,
        plugin: "blackbody".to_owned(),
        id: None,
        span,
        properties,
        old: true,
    });
    let name = element.get("name").unwrap_or_default().to_owned();
    description.objects[owner].properties.push(Property {
        name,
        value: Value::Object(index),
        span,
    });
}
