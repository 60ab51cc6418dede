//! What a scene file says, before anything is made of it: objects with typed, located
//! properties.

use std::collections::BTreeMap;

use claror::math::{DMat4, DVec3};

use super::source::Span;

/// Index into [`Description::objects`].
pub(super) type ObjectIndex = usize;

/// The kind of an object, by its XML element.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Tag {
    Scene,
    Integrator,
    Sensor,
    Film,
    Sampler,
    Rfilter,
    Bsdf,
    Texture,
    Emitter,
    Shape,
    Medium,
    Phase,
    Volume,
}

impl Tag {
    /// All kinds with the names of their elements.
    pub(super) const ALL: [(&'static str, Self); 13] = [
        ("scene", Self::Scene),
        ("integrator", Self::Integrator),
        ("sensor", Self::Sensor),
        ("film", Self::Film),
        ("sampler", Self::Sampler),
        ("rfilter", Self::Rfilter),
        ("bsdf", Self::Bsdf),
        ("texture", Self::Texture),
        ("emitter", Self::Emitter),
        ("shape", Self::Shape),
        ("medium", Self::Medium),
        ("phase", Self::Phase),
        ("volume", Self::Volume),
    ];

    /// The name of the element.
    pub(super) fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, t)| *t == self).map_or("object", |(n, _)| n)
    }
}

/// What `<spectrum value=…>` says.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum SpectrumValue {
    /// The same value at all wavelengths.
    Uniform(f64),
    /// Piecewise linear: ascending wavelengths in nanometres and the values there.
    Sampled(Vec<(f64, f64)>),
}

/// The value of a property.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    Float(f64),
    Integer(i64),
    Boolean(bool),
    String(String),
    /// `<vector>` and `<point>`.
    Vector(DVec3),
    Rgb([f64; 3]),
    Spectrum(Box<SpectrumValue>),
    Transform(Box<DMat4>),
    /// `<ref id=…>`, until it is resolved.
    Reference(String),
    /// A nested object, or one that was referred to.
    Object(ObjectIndex),
    /// Could not be read; the user has been told.
    Broken,
}

impl Value {
    /// What the scene file calls it.
    pub(super) fn type_name(&self) -> &'static str {
        match self {
            Self::Float(_) => "a float",
            Self::Integer(_) => "an integer",
            Self::Boolean(_) => "a boolean",
            Self::String(_) => "a string",
            Self::Vector(_) => "a vector",
            Self::Rgb(_) => "an rgb",
            Self::Spectrum(_) => "a spectrum",
            Self::Transform(_) => "a transform",
            Self::Reference(_) | Self::Object(_) => "an object",
            Self::Broken => "unreadable",
        }
    }
}

/// A property of an object.
#[derive(Debug, Clone)]
pub(super) struct Property {
    /// Empty for objects without a name.
    pub(super) name: String,
    pub(super) value: Value,
    /// The element.
    pub(super) span: Span,
}

/// An object: a plugin with its parameters.
#[derive(Debug, Clone)]
pub(super) struct Object {
    pub(super) tag: Tag,
    /// Attribute `type`.
    pub(super) plugin: String,
    pub(super) id: Option<String>,
    pub(super) span: Span,
    pub(super) properties: Vec<Property>,
    /// From a file of Mitsuba 0.x or 1.x.
    pub(super) old: bool,
}

/// A scene file with its includes.
#[derive(Debug, Default)]
pub(super) struct Description {
    /// The first is the scene; the others in the order of the file.
    pub(super) objects: Vec<Object>,
    pub(super) ids: BTreeMap<String, ObjectIndex>,
}
