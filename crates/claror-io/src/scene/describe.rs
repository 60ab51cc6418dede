//! XML → [`Description`]: the first of the two stages of reading a scene.

use std::path::{Path, PathBuf};

use claror::math::DMat4;

use super::description::{Description, Object, ObjectIndex, Property, Tag, Value};
use super::element::{Element, offset};
use super::nearest::hint;
use super::parameters::Parameters;
use super::search::SearchPath;
use super::source::{Files, Log, Span};
use super::xml::{Event, Reader};
use super::{operations, text};
use crate::Limits;
use crate::diagnostic::{Diagnostic, Severity, Subject};

/// Elements other than objects that may stand inside an object.
const PROPERTY_ELEMENTS: [&str; 18] = [
    "float",
    "integer",
    "boolean",
    "string",
    "vector",
    "point",
    "rgb",
    "srgb",
    "spectrum",
    "blackbody",
    "transform",
    "ref",
    "include",
    "alias",
    "default",
    "path",
    "texture",
    "bsdf",
];

/// More named properties than any plugin has parameters: bounds the search for duplicates.
const MAX_PARAMETERS: usize = 500;
/// More includes than any scene has: files that include each other many times are a bomb.
const MAX_INCLUDES: usize = 10_000;

/// What an open element is.
enum Frame {
    Object(ObjectIndex),
    Transform {
        owner: ObjectIndex,
        name: String,
        span: Span,
        matrix: Option<DMat4>,
    },
    /// A property: nothing may stand inside.
    Leaf(String),
    /// Inside of something that could not be understood: said once, for the outermost.
    Skipped,
}

/// The file that is being read.
struct File {
    number: u32,
    path: PathBuf,
    old: bool,
    /// Where its objects go, unless it is the scene itself: the parent and the name of the
    /// include.
    parent: Option<(ObjectIndex, String)>,
}

/// Reads a scene file with its includes.
pub(super) struct Describer<'a> {
    pub(super) log: &'a Log,
    pub(super) files: &'a dyn Files,
    pub(super) limits: &'a Limits,
    pub(super) parameters: Parameters,
    pub(super) search: SearchPath,
    pub(super) description: Description,
    /// All files, in the order of reading.
    pub(super) files_read: Vec<PathBuf>,
    /// Files that are being read, outermost first, by their canonical names.
    stack: Vec<PathBuf>,
    bytes_left: u64,
    /// A part of the scene could not be read: what refers to it is not to be complained about.
    pub(super) incomplete: bool,
    /// A limit was exceeded: nothing more is read.
    stopped: bool,
}

impl<'a> Describer<'a> {
    /// Nothing read yet.
    pub(super) fn new(
        scene: &Path,
        defines: &[(String, String)],
        limits: &'a Limits,
        files: &'a dyn Files,
        log: &'a Log,
    ) -> Self {
        Self {
            log,
            files,
            limits,
            parameters: Parameters::new(defines),
            search: SearchPath::new(scene),
            description: Description::default(),
            files_read: Vec::new(),
            stack: Vec::new(),
            bytes_left: limits.max_scene_bytes,
            incomplete: false,
            stopped: false,
        }
    }

    /// Reads the scene file.
    pub(super) fn scene(&mut self, path: &Path) {
        self.file(path, None, None);
    }

    /// Reads one file; `from` is where it was asked for.
    fn file(&mut self, path: &Path, from: Option<Span>, parent: Option<(ObjectIndex, String)>) {
        let bytes = match self.files.read(path, self.bytes_left) {
            Ok(bytes) => bytes,
            Err(error) => {
                let (subject, message) = text::describe_io(path, &error, self.limits);
                self.incomplete = true;
                self.stopped |= subject == Subject::Memory;
                return self.unreadable(path, from, subject, message);
            }
        };
        self.bytes_left = self.bytes_left.saturating_sub(bytes.len() as u64);
        self.files_read.push(path.to_path_buf());
        let (content, problem) = text::decode(bytes);
        let number = self.log.add_source(path.to_path_buf(), content.clone());
        if let Some(problem) = problem {
            self.incomplete = true;
            let span = Span { file: number, offset: offset(problem.offset) };
            return self.log.error_about(Subject::File, span, problem.message, Some(problem.hint));
        }
        self.stack.push(text::canonical(path));
        self.events(&content, File { number, path: path.to_path_buf(), old: false, parent });
        self.stack.pop();
    }

    fn unreadable(&self, path: &Path, from: Option<Span>, subject: Subject, message: String) {
        if let Some(span) = from {
            return self.log.error_about(subject, span, message, None);
        }
        self.log.push(Diagnostic {
            severity: Severity::Error,
            subject,
            file: path.to_path_buf(),
            position: None,
            message,
            excerpt: None,
            hint: None,
        });
    }

    fn events(&mut self, content: &str, mut file: File) {
        let mut reader = Reader::new(content, self.limits.max_xml_depth as usize);
        let mut frames: Vec<Frame> = Vec::new();
        let mut told_text = false;
        loop {
            match reader.next() {
                Ok(Event::Start { name, attributes, offset: position }) => {
                    let parameters = &mut self.parameters;
                    let span = Span { file: file.number, offset: offset(position) };
                    let element = Element::new(name, span, attributes, parameters, self.log);
                    if self.bytes_left < element.bytes() {
                        self.incomplete = true;
                        self.stopped = true;
                        let message = "the scene is too large after substitution of parameters";
                        return self.log.error_about(Subject::Memory, span, message, None);
                    }
                    self.bytes_left -= element.bytes();
                    let frame = self.start(&mut file, frames.last_mut(), &element);
                    frames.push(frame);
                }
                Ok(Event::End) => self.end(frames.pop()),
                Ok(Event::Text { offset: position }) if !told_text => {
                    told_text = true;
                    let span = Span { file: file.number, offset: offset(position) };
                    self.log.warning(span, "text between elements is ignored", None);
                }
                Ok(Event::Text { .. }) => {}
                Ok(Event::Eof) => return,
                Err(error) => {
                    let span = Span { file: file.number, offset: offset(error.offset) };
                    self.incomplete = true;
                    return self.log.error(span, error.message, error.hint);
                }
            }
            if self.stopped || self.log.is_full() {
                return;
            }
        }
    }

    fn start(&mut self, file: &mut File, parent: Option<&mut Frame>, element: &Element) -> Frame {
        match parent {
            None => self.root(file, element),
            Some(Frame::Skipped) => Frame::Skipped,
            Some(Frame::Leaf(name)) => {
                let message = format!("<{}> cannot stand inside <{name}>", element.name);
                self.log.error(element.span, message, None);
                Frame::Skipped
            }
            Some(Frame::Transform { matrix, .. }) => {
                let operation = operations::read(element, file.old, self.log);
                *matrix = matrix.zip(operation).map(|(m, op)| op * m);
                Frame::Leaf(element.name.to_owned())
            }
            Some(Frame::Object(owner)) => self.child(file, *owner, element),
        }
    }

    fn end(&mut self, frame: Option<Frame>) {
        if let Some(Frame::Transform { owner, name, span, matrix }) = frame {
            let value = matrix.map_or(Value::Broken, |m| Value::Transform(Box::new(m)));
            self.add_property(owner, name, value, span);
        }
    }

    fn root(&mut self, file: &mut File, element: &Element) -> Frame {
        let Some(tag) = object_tag(element) else {
            let message = format!("the root element is <{}>, not <scene>", element.name);
            self.log.error(element.span, message, Some("is this a scene file?".into()));
            return Frame::Skipped;
        };
        if tag != Tag::Scene && file.parent.is_none() {
            let message = format!("the root element is <{}>, not <scene>", element.name);
            self.log.error(element.span, message, None);
            return Frame::Skipped;
        }
        let required: &[&str] = if tag == Tag::Scene { &["version"] } else { &["version", "type"] };
        element.check(required, &["type", "id", "name"], self.log);
        if let Some(version) = element.get("version") {
            match major_version(version) {
                Some(major) => file.old = major < 2,
                None => {
                    let message = format!("invalid version \"{}\"", super::values::short(version));
                    let hint = "write for instance version=\"3.0.0\"";
                    self.log.error(element.span_of("version"), message, Some(hint.into()));
                }
            }
        }
        match file.parent.clone() {
            Some((parent, _)) if tag == Tag::Scene => Frame::Object(parent),
            Some((parent, name)) => self.object(tag, Some((parent, name)), element, file.old),
            None => self.object(tag, None, element, file.old),
        }
    }

    fn child(&mut self, file: &File, owner: ObjectIndex, element: &Element) -> Frame {
        if let Some(tag) = object_tag(element) {
            if tag == Tag::Scene {
                self.log.error(element.span, "<scene> cannot stand inside of another object", None);
                return Frame::Skipped;
            }
            element.check(&["type"], &["id", "name"], self.log);
            let name = element.get("name").unwrap_or_default().to_owned();
            return self.object(tag, Some((owner, name)), element, file.old);
        }
        match element.name {
            "transform" => {
                element.check(&["name"], &[], self.log);
                let name = element.get("name").unwrap_or_default().to_owned();
                let span = element.span;
                return Frame::Transform { owner, name, span, matrix: Some(DMat4::IDENTITY) };
            }
            "ref" => self.reference(owner, element),
            "include" => self.include(file, owner, element),
            "alias" => self.alias(element),
            "default" => {
                // A default that could not be substituted is known nevertheless.
                element.check(&["name", "value"], &[], self.log);
                let get = |name| element.get(name).unwrap_or_default();
                self.parameters.set_default(get("name"), get("value"));
            }
            "path" => self.path(file, owner, element),
            _ if operations::NAMES.contains(&element.name) => {
                let message = format!("<{}> may stand inside <transform> only", element.name);
                self.log.error(element.span, message, None);
            }
            _ => return self.property(file, owner, element),
        }
        Frame::Leaf(element.name.to_owned())
    }

    fn property(&mut self, file: &File, owner: ObjectIndex, element: &Element) -> Frame {
        if element.name == "blackbody" && file.old {
            operations::old_blackbody(&mut self.description, owner, element, self.log);
            return Frame::Leaf(element.name.to_owned());
        }
        let context = operations::Context {
            old: file.old,
            log: self.log,
            files: self.files,
            search: &self.search,
            from: &file.path,
            limits: self.limits,
        };
        let Some(value) = operations::property(element, &context) else {
            let objects = Tag::ALL.iter().map(|(name, _)| *name);
            let known = PROPERTY_ELEMENTS.iter().copied().chain(objects);
            let message = format!("unknown element <{}>", super::values::short(element.name));
            let hint = super::nearest::nearest(element.name, known);
            self.log.error(element.span, message, hint.map(|h| format!("did you mean <{h}>?")));
            return Frame::Skipped;
        };
        if let (value, Some(read)) = value {
            self.files_read.push(read);
            self.named_property(owner, value, element);
        } else {
            self.named_property(owner, value.0, element);
        }
        Frame::Leaf(element.name.to_owned())
    }

    fn named_property(&mut self, owner: ObjectIndex, value: Value, element: &Element) {
        if let Some(name) = element.get("name") {
            self.add_property(owner, name.to_owned(), value, element.span);
        }
    }

    fn add_property(&mut self, owner: ObjectIndex, name: String, value: Value, span: Span) {
        let properties = &mut self.description.objects[owner].properties;
        // Names in the scene itself do not matter; it may have very many children.
        if owner != 0 && !name.is_empty() {
            let named = || properties.iter().filter(|p| !p.name.is_empty());
            if let Some(first) = named().find(|p| p.name == name) {
                let message = format!("\"{}\" is set twice", super::values::short(&name));
                let place = self.log.describe(first.span);
                self.log.error(span, message, Some(format!("first set at {place}")));
                return;
            }
            if named().count() >= MAX_PARAMETERS {
                let message = format!("an object has more than {MAX_PARAMETERS} parameters");
                return self.log.error(span, message, None);
            }
        }
        properties.push(Property { name, value, span });
    }

    fn object(
        &mut self,
        tag: Tag,
        parent: Option<(ObjectIndex, String)>,
        element: &Element,
        old: bool,
    ) -> Frame {
        let index = self.description.objects.len();
        let id = element.get("id").filter(|id| !id.is_empty()).map(str::to_owned);
        if let Some(id) = &id {
            self.add_id(id, index, element.span_of("id"));
        }
        self.description.objects.push(Object {
            tag,
            plugin: match tag {
                Tag::Scene => "scene".to_owned(),
                _ => element.get("type").unwrap_or_default().to_owned(),
            },
            id,
            span: element.span,
            properties: Vec::new(),
            old,
        });
        if let Some((parent, name)) = parent {
            self.add_property(parent, name, Value::Object(index), element.span);
        }
        Frame::Object(index)
    }

    fn add_id(&mut self, id: &str, index: ObjectIndex, span: Span) {
        if let Some(first) = self.description.ids.get(id) {
            let message = format!("the id \"{}\" is used twice", super::values::short(id));
            let hint = self
                .description
                .objects
                .get(*first)
                .map(|o| format!("first used at {}", self.log.describe(o.span)));
            return self.log.error(span, message, hint);
        }
        self.description.ids.insert(id.to_owned(), index);
    }

    fn reference(&mut self, owner: ObjectIndex, element: &Element) {
        if element.check(&["id"], &["name"], self.log) {
            let name = element.get("name").unwrap_or_default().to_owned();
            let id = element.get("id").unwrap_or_default().to_owned();
            self.add_property(owner, name, Value::Reference(id), element.span);
        }
    }

    fn alias(&mut self, element: &Element) {
        if !element.check(&["id", "as"], &[], self.log) {
            return;
        }
        let id = element.get("id").unwrap_or_default();
        let Some(index) = self.description.ids.get(id).copied() else {
            let known = self.description.ids.keys().map(String::as_str);
            let message = format!("no object has the id \"{}\" yet", super::values::short(id));
            return self.log.error(element.span_of("id"), message, hint(id, known));
        };
        self.add_id(element.get("as").unwrap_or_default(), index, element.span_of("as"));
    }

    fn path(&mut self, file: &File, owner: ObjectIndex, element: &Element) {
        if !element.check(&["value"], &[], self.log) {
            return;
        }
        if owner != 0 {
            return self.log.error(element.span, "<path> may stand inside <scene> only", None);
        }
        let folder = element.get("value").unwrap_or_default();
        if !self.search.add_folder(self.files, folder, &file.path) {
            let message = format!("there is no folder \"{}\"", super::values::short(folder));
            self.log.error_about(Subject::File, element.span_of("value"), message, None);
        }
    }

    fn include(&mut self, file: &File, owner: ObjectIndex, element: &Element) {
        if !element.check(&["filename"], &["name"], self.log) {
            return;
        }
        let span = element.span_of("filename");
        let name = element.get("filename").unwrap_or_default();
        let Some(path) = self.search.find_include(self.files, name, &file.path) else {
            self.incomplete = true;
            let message = format!("included file \"{}\" is not found", super::values::short(name));
            return self.log.error_about(Subject::File, span, message, None);
        };
        if let Err((message, stop)) = self.may_include(&path) {
            self.incomplete = true;
            self.stopped |= stop;
            return self.log.error(span, message, None);
        }
        let parent = (owner, element.get("name").unwrap_or_default().to_owned());
        self.file(&path, Some(span), Some(parent));
    }

    /// Why a file must not be included here, and whether that ends everything.
    fn may_include(&self, path: &Path) -> Result<(), (String, bool)> {
        let path = text::canonical(path);
        if let Some(first) = self.stack.iter().position(|p| *p == path) {
            let cycle = self.stack[first..].iter().chain([&path]);
            let names: Vec<String> = cycle.map(|p| text::file_name(p)).collect();
            return Err((format!("the file includes itself: {}", names.join(" -> ")), false));
        }
        let max_depth = self.limits.max_include_depth;
        if self.stack.len() > max_depth as usize {
            return Err((format!("includes are nested deeper than {max_depth}"), true));
        }
        if self.files_read.len() > MAX_INCLUDES {
            return Err((format!("there are more than {MAX_INCLUDES} includes"), true));
        }
        Ok(())
    }
}

/// The kind of object that an element is; `<spectrum type=…>` is a texture.
fn object_tag(element: &Element) -> Option<Tag> {
    if element.name == "spectrum" && element.get("type").is_some() {
        return Some(Tag::Texture);
    }
    Tag::ALL.iter().find(|(name, _)| *name == element.name).map(|(_, tag)| *tag)
}

/// The first number of `major.minor.patch`.
fn major_version(version: &str) -> Option<u32> {
    let parts: Vec<&str> = version.trim().split('.').collect();
    let is_number =
        |p: &&str| !p.is_empty() && p.len() <= 6 && p.bytes().all(|b| b.is_ascii_digit());
    if parts.len() > 3 || !parts.iter().all(is_number) {
        return None;
    }
    parts.first()?.parse().ok()
}
