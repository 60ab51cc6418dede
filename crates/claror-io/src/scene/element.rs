//! One XML element with substituted attributes, and the checks that all elements share.

use super::nearest::hint;
use super::parameters::Parameters;
use super::source::{Log, Span};
use super::xml::Attribute;

/// An attribute after substitution.
#[derive(Debug)]
struct Substituted<'a> {
    name: &'a str,
    value: String,
    span: Span,
}

/// A start tag.
#[derive(Debug)]
pub(super) struct Element<'a> {
    pub(super) name: &'a str,
    pub(super) span: Span,
    attributes: Vec<Substituted<'a>>,
    /// An attribute could not be substituted (and the user has been told).
    broken: bool,
}

impl<'a> Element<'a> {
    /// Substitutes parameters in the attributes of a start tag.
    pub(super) fn new(
        name: &'a str,
        span: Span,
        attributes: Vec<Attribute<'a>>,
        parameters: &mut Parameters,
        log: &Log,
    ) -> Self {
        let mut broken = false;
        let mut substitute = |attribute: Attribute<'a>| {
            let span = Span { offset: offset(attribute.offset), ..span };
            let value = if attribute.value.contains('$') {
                parameters.substitute(&attribute.value).unwrap_or_else(|(message, hint)| {
                    log.error(span, message, hint);
                    broken = true;
                    String::new()
                })
            } else {
                attribute.value.into_owned()
            };
            Substituted { name: attribute.name, value, span }
        };
        let attributes = attributes.into_iter().map(&mut substitute).collect();
        Self { name, span, attributes, broken }
    }

    /// The value of an attribute.
    pub(super) fn get(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|a| a.name == name).map(|a| a.value.as_str())
    }

    /// The place of an attribute, or of the element when it is not there.
    pub(super) fn span_of(&self, name: &str) -> Span {
        self.attributes.iter().find(|a| a.name == name).map_or(self.span, |a| a.span)
    }

    /// Bytes of all values: what substitution made counts against the size of the scene.
    pub(super) fn bytes(&self) -> u64 {
        self.attributes.iter().map(|a| a.value.len() as u64).sum()
    }

    /// Reports attributes that are not allowed, and required ones that are missing; true when
    /// all is well.
    pub(super) fn check(&self, required: &[&str], optional: &[&str], log: &Log) -> bool {
        let mut good = !self.broken;
        let known = || required.iter().chain(optional).copied();
        for attribute in &self.attributes {
            if !known().any(|k| k == attribute.name) {
                let message =
                    format!("unexpected attribute \"{}\" of <{}>", attribute.name, self.name);
                log.error(attribute.span, message, hint(attribute.name, known()));
                good = false;
            }
        }
        for name in required {
            if self.get(name).is_none() {
                let message = format!("<{}> needs the attribute \"{name}\"", self.name);
                log.error(self.span, message, None);
                good = false;
            }
        }
        good
    }
}

/// A place in a file; files are shorter than 4 GiB by [`crate::Limits::max_scene_bytes`].
pub(super) fn offset(bytes: usize) -> u32 {
    u32::try_from(bytes).unwrap_or(u32::MAX)
}
