//! [`Description`] → [`SceneTables`]: the second of the two stages of reading a scene.
//!
//! One file per kind of plugin. Each asks a [`Properties`] for the parameters of its plugins, and
//! so defines their names, types and defaults.

mod bsdfs;
mod cie;
mod data;
mod emitters;
mod films;
mod integrators;
mod scene;
mod sensors;
mod shapes;
mod sky;
mod spectrum;
mod textures;

use std::collections::BTreeMap;
use std::path::PathBuf;

use claror::bsdf::BsdfId;
use claror::scene::SceneTables;
use claror::shape::GroupId;
use claror::texture::{ImageId, TextureId};

use super::LoadOptions;
use super::description::{Description, Object, ObjectIndex, Property, Tag};
use super::nearest::{hint, nearest};
use super::properties::Properties;
use super::search::SearchPath;
use super::source::{Files, Log, Span};
use super::values::short;

/// Makes tables of a description.
pub(super) struct Builder<'a> {
    pub(super) description: &'a Description,
    pub(super) log: &'a Log,
    pub(super) options: &'a LoadOptions,
    pub(super) files: &'a dyn Files,
    pub(super) search: &'a SearchPath,
    /// What has been made so far.
    pub(super) tables: SceneTables,
    /// By [`claror::shape::ShapeId`].
    pub(super) shape_names: Vec<String>,
    /// Data files, in the order of reading.
    pub(super) files_read: Vec<PathBuf>,
    bsdfs: BTreeMap<ObjectIndex, BsdfId>,
    textures: BTreeMap<ObjectIndex, TextureId>,
    groups: BTreeMap<ObjectIndex, Option<GroupId>>,
    /// Constant textures by the bits of their colour.
    constants: BTreeMap<[u32; 3], TextureId>,
    /// Pictures by file and whether they are raw.
    images: BTreeMap<(PathBuf, bool), ImageId>,
    /// Default materials by the bits of their reflectance.
    default_bsdfs: BTreeMap<u32, BsdfId>,
    /// By [`BsdfId`].
    bsdf_spans: Vec<Span>,
    environment: Option<Span>,
    integrator: Option<Span>,
}

impl<'a> Builder<'a> {
    /// Nothing made yet.
    pub(super) fn new(
        description: &'a Description,
        log: &'a Log,
        options: &'a LoadOptions,
        files: &'a dyn Files,
        search: &'a SearchPath,
    ) -> Self {
        Self {
            description,
            log,
            options,
            files,
            search,
            tables: SceneTables::default(),
            shape_names: Vec::new(),
            files_read: Vec::new(),
            bsdfs: BTreeMap::new(),
            textures: BTreeMap::new(),
            groups: BTreeMap::new(),
            constants: BTreeMap::new(),
            images: BTreeMap::new(),
            default_bsdfs: BTreeMap::new(),
            bsdf_spans: Vec::new(),
            environment: None,
            integrator: None,
        }
    }

    fn object(&self, index: ObjectIndex) -> &'a Object {
        &self.description.objects[index]
    }

    fn tag(&self, index: ObjectIndex) -> Tag {
        self.object(index).tag
    }

    fn properties(&self, index: ObjectIndex) -> Properties<'a> {
        Properties::new(self.object(index), self.log)
    }

    /// Nested objects of a kind.
    fn nested(&self, properties: &Properties<'a>, tag: Tag) -> Vec<(&'a Property, ObjectIndex)> {
        properties.objects(|_, index| self.tag(index) == tag)
    }

    /// The only nested object of a kind; a second one is an error.
    fn only_nested(&self, properties: &Properties<'a>, tag: Tag) -> Option<ObjectIndex> {
        let found = self.nested(properties, tag);
        if let Some((second, _)) = found.get(1) {
            let message =
                format!("\"{}\" takes one {} only", short(properties.plugin()), tag.name());
            self.log.error(second.span, message, None);
        }
        found.first().map(|(_, index)| *index)
    }

    /// Reports what nobody asked for.
    fn finish(&self, properties: Properties<'a>) {
        // A medium is told as what it is: a plugin that is not supported.
        for (_, index) in self.nested(&properties, Tag::Medium) {
            self.unsupported(&self.properties(index), &[], "it is left out");
        }
        properties.finish(|index| format!("a nested <{}>", self.tag(index).name()));
    }

    /// The plugin is not supported: an error, or a warning that says what is done `instead`.
    fn unsupported(&self, properties: &Properties<'a>, known: &[&str], instead: &str) {
        properties.ignore_all();
        let object = properties.object();
        if object.plugin.is_empty() {
            // Told already: the attribute is missing, or could not be substituted.
            return;
        }
        let plugin = short(&object.plugin);
        let message = format!("{} plugin \"{plugin}\" is not supported", object.tag.name());
        if self.options.lenient {
            return self.log.warning(object.span, format!("{message}: {instead}"), None);
        }
        let hint = match nearest(&plugin, known.iter().copied()) {
            Some(near) => Some(format!("did you mean \"{near}\"?")),
            None if known.is_empty() => None,
            None => hint(&plugin, known.iter().copied())
                .map(|list| format!("{list}; --lenient goes on without it")),
        };
        self.log.error(object.span, message, hint);
    }
}
