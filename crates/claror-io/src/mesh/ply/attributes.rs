//! Further properties, which become mesh attributes.
//!
//! Mitsuba's rules: `r g b` or `red green blue` are `vertex_color` (for faces `face_color`);
//! `foo_r foo_g foo_b` are `vertex_foo_color`; `foo_x foo_y foo_z` or `foo_0 foo_1 foo_2` are
//! `vertex_foo`, and so is a single `foo_x`, `foo_0` or `foo_1`. Other names are ignored. Integer
//! values are taken as they are, also in colours.

use claror::shape::MeshAttribute;

use super::header::{Element, NumberKind, PropertyKind};
use crate::diagnostic::ReadError;
use crate::source::Source;

/// Suffixes that number the channels of an attribute.
const SUFFIXES: [[&str; 3]; 3] = [["x", "y", "z"], ["0", "1", "2"], ["1", "2", "3"]];

/// More attributes are not read: a polygon of n vertices repeats its own n times, which must not
/// turn a small file into a large mesh.
const MAX_ATTRIBUTES: usize = 32;

/// Attributes of an element while its rows are read.
pub(super) struct AttributeReader {
    /// Per property of the element: the place of its value in `row`.
    slots: Vec<Option<usize>>,
    /// Values of the current row, attribute after attribute.
    row: Vec<f32>,
    attributes: Vec<MeshAttribute>,
}

impl AttributeReader {
    /// `owner` is "vertex" or "face".
    pub(super) fn new(element: &Element, owner: &str, warnings: &mut Vec<String>) -> Self {
        let mut slots = vec![None; element.properties.len()];
        let mut attributes: Vec<MeshAttribute> = Vec::new();
        let mut next = 0;
        for (name, properties) in attribute_groups(element) {
            let name = format!("{owner}_{name}");
            if attributes.iter().any(|a| a.name == name) {
                continue;
            }
            if attributes.len() == MAX_ATTRIBUTES {
                warnings.push(format!("only the first {MAX_ATTRIBUTES} attributes are read"));
                break;
            }
            let is_integer = |&i: &usize| match element.properties[i].kind {
                PropertyKind::Scalar(kind) => !matches!(kind, NumberKind::F32 | NumberKind::F64),
                PropertyKind::List { .. } => false,
            };
            if name.ends_with("_color") && properties.iter().any(is_integer) {
                warnings.push(format!(
                    "\"{name}\" is stored as integers, which are taken as they are: \
                     colours should be in [0, 1]"
                ));
            }
            for &property in &properties {
                slots[property] = Some(next);
                next += 1;
            }
            let (per_face, channels) = (owner == "face", properties.len());
            attributes.push(MeshAttribute { name, per_face, channels, data: Vec::new() });
        }
        Self { slots, row: vec![0.0; next], attributes }
    }

    /// Where the value of the element's property `i` goes.
    pub(super) fn slot(&self, i: usize) -> Option<usize> {
        self.slots[i]
    }

    pub(super) fn reserve(&mut self, rows: u64, source: Source<'_>) -> Result<(), ReadError> {
        for attribute in &mut self.attributes {
            let count = rows.saturating_mul(attribute.channels as u64);
            attribute.data = source.reserve(count, "the mesh attributes")?;
        }
        Ok(())
    }

    /// Sets a value of the current row.
    pub(super) fn set(&mut self, slot: usize, value: f32) {
        self.row[slot] = value;
    }

    /// Appends the current row, which stays.
    pub(super) fn push_row(&mut self) {
        let mut rest = self.row.as_slice();
        for attribute in &mut self.attributes {
            let (values, tail) = rest.split_at(attribute.channels);
            attribute.data.extend_from_slice(values);
            rest = tail;
        }
    }

    pub(super) fn finish(self) -> Vec<MeshAttribute> {
        self.attributes
    }
}

/// Names (without owner) and property indices of the attributes of an element.
fn attribute_groups(element: &Element) -> Vec<(String, Vec<usize>)> {
    let find = |name: &str| {
        let is_scalar = |kind| matches!(kind, PropertyKind::Scalar(_));
        element.properties.iter().position(|p| p.name == name && is_scalar(p.kind))
    };
    let all =
        |names: [String; 3]| -> Option<Vec<usize>> { names.iter().map(|n| find(n)).collect() };
    let mut groups = Vec::new();
    for names in [["r", "g", "b"], ["red", "green", "blue"]] {
        if let Some(properties) = all(names.map(str::to_owned)) {
            groups.push(("color".to_owned(), properties));
        }
    }
    for property in &element.properties {
        let Some((prefix, suffix)) = property.name.rsplit_once('_') else { continue };
        if prefix.is_empty() || matches!(property.name.as_str(), "texture_u" | "texture_s") {
            continue;
        }
        let named = |suffixes: [&str; 3]| all(suffixes.map(|s| format!("{prefix}_{s}")));
        if suffix == "r" {
            groups.extend(named(["r", "g", "b"]).map(|p| (format!("{prefix}_color"), p)));
        }
        let Some(suffixes) = SUFFIXES.into_iter().find(|s| s[0] == suffix) else { continue };
        // "foo_1" counts from 0 when there is a "foo_0".
        if suffix == "1" && find(&format!("{prefix}_0")).is_some() {
            continue;
        }
        let is_single = find(&format!("{prefix}_{}", suffixes[1])).is_none();
        let properties = named(suffixes)
            .or_else(|| is_single.then(|| find(&property.name).into_iter().collect()));
        groups.extend(properties.filter(|p| !p.is_empty()).map(|p| (prefix.to_owned(), p)));
    }
    groups
}
