//! A pull parser for the XML that scene files use: elements, attributes, comments, CDATA,
//! processing instructions, character references and the five predefined entities.
//!
//! Document type declarations are refused: they are where entity bombs and external entities
//! live, and no scene file needs one. The parser keeps only the stack of open elements, whose
//! depth is bounded, so that memory and stack do not grow with hostile nesting.

use std::borrow::Cow;

/// A malformed document.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct XmlError {
    /// Bytes from the beginning.
    pub(super) offset: usize,
    pub(super) message: String,
    pub(super) hint: Option<String>,
}

/// `name="value"`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Attribute<'a> {
    pub(super) name: &'a str,
    pub(super) value: Cow<'a, str>,
    /// Bytes from the beginning to the name.
    pub(super) offset: usize,
}

/// What comes next in the document.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Event<'a> {
    /// `<name …>` or `<name …/>`; the latter is followed by its own [`Event::End`].
    Start { name: &'a str, attributes: Vec<Attribute<'a>>, offset: usize },
    /// `</name>`.
    End,
    /// Characters other than white space between elements.
    Text { offset: usize },
    /// The document is complete.
    Eof,
}

/// More attributes than any element of a scene has.
const MAX_ATTRIBUTES: usize = 64;

/// The parser.
pub(super) struct Reader<'a> {
    text: &'a str,
    at: usize,
    open: Vec<(&'a str, usize)>,
    max_depth: usize,
    pending_end: bool,
    seen_root: bool,
}

type Result<T> = std::result::Result<T, XmlError>;

fn fail<T>(offset: usize, message: impl Into<String>) -> Result<T> {
    Err(XmlError { offset, message: message.into(), hint: None })
}

fn fail_with<T>(offset: usize, message: impl Into<String>, hint: impl Into<String>) -> Result<T> {
    Err(XmlError { offset, message: message.into(), hint: Some(hint.into()) })
}

impl<'a> Reader<'a> {
    /// A reader of `text` that refuses elements nested deeper than `max_depth`.
    pub(super) fn new(text: &'a str, max_depth: usize) -> Self {
        let at = if text.starts_with('\u{feff}') { '\u{feff}'.len_utf8() } else { 0 };
        Self { text, at, open: Vec::new(), max_depth, pending_end: false, seen_root: false }
    }

    /// The next event. After an error or [`Event::Eof`] nothing more should be asked for.
    pub(super) fn next(&mut self) -> Result<Event<'a>> {
        if self.pending_end {
            self.pending_end = false;
            self.open.pop();
            return Ok(Event::End);
        }
        loop {
            let begin = self.at;
            let rest = &self.text[begin..];
            if rest.is_empty() {
                return self.end_of_text();
            }
            let Some(rest) = rest.strip_prefix('<') else {
                if let Some(event) = self.text_until_markup()? {
                    return Ok(event);
                }
                continue;
            };
            if rest.starts_with("!--") {
                self.skip_to("-->", begin, 4, "comment")?;
            } else if rest.starts_with("![CDATA[") {
                self.skip_to("]]>", begin, 9, "CDATA section")?;
                return Ok(Event::Text { offset: begin });
            } else if rest.starts_with('!') {
                return fail_with(
                    begin,
                    "document type declarations are not allowed",
                    "remove the <!DOCTYPE …> and the entities that it defines",
                );
            } else if rest.starts_with('?') {
                self.skip_to("?>", begin, 2, "processing instruction")?;
            } else if rest.starts_with('/') {
                return self.end_tag(begin);
            } else {
                return self.start_tag(begin);
            }
        }
    }

    fn end_of_text(&self) -> Result<Event<'a>> {
        match self.open.last() {
            Some((name, offset)) => fail_with(
                *offset,
                format!("the file ends before <{name}> is closed"),
                "the file may have been cut",
            ),
            None if self.seen_root => Ok(Event::Eof),
            None => fail(self.at, "the file holds no XML element"),
        }
    }

    fn text_until_markup(&mut self) -> Result<Option<Event<'a>>> {
        let begin = self.at;
        let rest = &self.text[begin..];
        let length = rest.find('<').unwrap_or(rest.len());
        self.at += length;
        let text = &rest[..length];
        let blank = text.len() - text.trim_start().len();
        if blank == text.len() {
            return Ok(None);
        }
        let offset = begin + blank;
        if self.open.is_empty() {
            let place = if self.seen_root { "after" } else { "before" };
            return fail(offset, format!("this is not XML: text {place} the root element"));
        }
        Ok(Some(Event::Text { offset }))
    }

    fn skip_to(&mut self, end: &str, begin: usize, skip: usize, what: &str) -> Result<()> {
        let from = begin + skip;
        match self.text.get(from..).and_then(|t| t.find(end)) {
            Some(i) => {
                self.at = from + i + end.len();
                Ok(())
            }
            None => fail(begin, format!("this {what} is never closed by {end}")),
        }
    }

    fn end_tag(&mut self, begin: usize) -> Result<Event<'a>> {
        self.at = begin + 2;
        let name = self.name();
        self.skip_white();
        if !self.eat(b'>') {
            return fail(begin, format!("</{name} is not closed by >"));
        }
        match self.open.pop() {
            Some((expected, _)) if expected == name => Ok(Event::End),
            Some((expected, _)) => {
                fail(begin, format!("</{name}> closes <{expected}>: expected </{expected}>"))
            }
            None => fail(begin, format!("</{name}> closes nothing")),
        }
    }

    fn start_tag(&mut self, begin: usize) -> Result<Event<'a>> {
        self.at = begin + 1;
        let name = self.name();
        if name.is_empty() {
            return fail_with(
                begin,
                "< without the name of an element",
                "write &lt; for a plain <",
            );
        }
        if self.open.is_empty() && self.seen_root {
            return fail(begin, format!("<{name}> stands after the root element"));
        }
        if self.open.len() >= self.max_depth {
            return fail(begin, format!("elements are nested deeper than {}", self.max_depth));
        }
        let mut attributes: Vec<Attribute<'a>> = Vec::new();
        loop {
            let white = self.skip_white();
            if self.eat(b'>') {
                break;
            }
            if self.text[self.at..].starts_with("/>") {
                self.at += 2;
                self.pending_end = true;
                break;
            }
            if self.at == self.text.len() {
                return fail_with(
                    begin,
                    format!("the file ends inside <{name}"),
                    "the file may have been cut",
                );
            }
            let attribute = self.attribute(name, white)?;
            if attributes.iter().any(|a| a.name == attribute.name) {
                let message = format!("<{name}> has the attribute \"{}\" twice", attribute.name);
                return fail(attribute.offset, message);
            }
            attributes.push(attribute);
            if attributes.len() > MAX_ATTRIBUTES {
                return fail(begin, format!("<{name}> has more than {MAX_ATTRIBUTES} attributes"));
            }
        }
        self.seen_root = true;
        self.open.push((name, begin));
        Ok(Event::Start { name, attributes, offset: begin })
    }

    fn attribute(&mut self, element: &str, white_before: bool) -> Result<Attribute<'a>> {
        let offset = self.at;
        let name = self.name();
        if name.is_empty() || !white_before {
            let found = self.text[self.at..].chars().next().unwrap_or(' ');
            let what =
                if name.is_empty() { "unexpected character" } else { "missing space before" };
            let shown = if name.is_empty() { found.to_string() } else { name.to_owned() };
            return fail(offset, format!("{what} '{}' in <{element}>", shown.escape_debug()));
        }
        self.skip_white();
        if !self.eat(b'=') {
            return fail(offset, format!("attribute \"{name}\" of <{element}> has no value"));
        }
        self.skip_white();
        let quote = match self.text.as_bytes().get(self.at) {
            Some(q @ (b'"' | b'\'')) => *q,
            _ => {
                let message = format!("the value of \"{name}\" of <{element}> is not in quotes");
                return fail(offset, message);
            }
        };
        let begin = self.at + 1;
        let Some(length) = self.text.as_bytes()[begin..].iter().position(|b| *b == quote) else {
            return fail(offset, format!("the value of \"{name}\" of <{element}> never ends"));
        };
        let raw = &self.text[begin..begin + length];
        if let Some(i) = raw.find('<') {
            return fail_with(
                begin + i,
                format!("the value of \"{name}\" of <{element}> holds a <"),
                "a quote is missing, or write &lt;",
            );
        }
        self.at = begin + length + 1;
        Ok(Attribute { name, value: unescape(raw, begin)?, offset })
    }

    /// Reads a name; empty when there is none.
    fn name(&mut self) -> &'a str {
        let rest = &self.text[self.at..];
        let is_name = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | ':');
        let length = rest.find(|c| !is_name(c)).unwrap_or(rest.len());
        self.at += length;
        &rest[..length]
    }

    fn skip_white(&mut self) -> bool {
        let rest = &self.text[self.at..];
        let trimmed = rest.trim_start_matches([' ', '\t', '\r', '\n']);
        self.at += rest.len() - trimmed.len();
        rest.len() != trimmed.len()
    }

    fn eat(&mut self, byte: u8) -> bool {
        let found = self.text.as_bytes().get(self.at) == Some(&byte);
        self.at += usize::from(found);
        found
    }
}

/// Replaces character references and predefined entities, and line ends by spaces.
fn unescape(raw: &str, offset: usize) -> Result<Cow<'_, str>> {
    if !raw.contains(['&', '\n', '\t', '\r']) {
        return Ok(Cow::Borrowed(raw));
    }
    let mut out = String::with_capacity(raw.len());
    let mut rest = raw;
    while let Some(i) = rest.find(['&', '\n', '\t', '\r']) {
        out.push_str(&rest[..i]);
        let at = offset + raw.len() - rest.len() + i;
        rest = &rest[i..];
        if !rest.starts_with('&') {
            out.push(' ');
            rest = &rest[1..];
            continue;
        }
        // The longest reference is &#x10FFFF;
        let end = rest.bytes().take(12).position(|b| b == b';');
        let Some(character) = end.and_then(|e| resolve(&rest[1..e])) else {
            let name: String = rest.chars().take(12).take_while(|c| *c != ';').collect();
            return fail_with(
                at,
                format!("unknown entity {name};"),
                "write &amp; for a plain &; only lt, gt, amp, apos, quot and &#…; are known",
            );
        };
        out.push(character);
        rest = &rest[end.unwrap_or(0) + 1..];
    }
    out.push_str(rest);
    Ok(Cow::Owned(out))
}

/// The character that `&name;` stands for.
fn resolve(name: &str) -> Option<char> {
    match name {
        "lt" => Some('<'),
        "gt" => Some('>'),
        "amp" => Some('&'),
        "apos" => Some('\''),
        "quot" => Some('"'),
        _ => {
            let digits = name.strip_prefix('#')?;
            let code = match digits.strip_prefix('x') {
                Some(hex) => u32::from_str_radix(hex, 16).ok()?,
                None => digits.parse().ok()?,
            };
            char::from_u32(code).filter(|c| *c != '\0')
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn events(text: &str) -> Result<Vec<String>> {
        let mut reader = Reader::new(text, 8);
        let mut out = Vec::new();
        loop {
            match reader.next()? {
                Event::Start { name, attributes, .. } => {
                    let list: Vec<String> =
                        attributes.iter().map(|a| format!("{}={}", a.name, a.value)).collect();
                    out.push(format!("<{name} {}>", list.join(",")));
                }
                Event::End => out.push("end".into()),
                Event::Text { .. } => out.push("text".into()),
                Event::Eof => return Ok(out),
            }
        }
    }

    #[test]
    fn documents_become_events() {
        let text = "\u{feff}<?xml version='1.0'?><!-- <a> --><s v=\"1\"\n w = 'a&lt;&#x41;&#66;'>\
                    <x/> t <![CDATA[<]]></s >\n<!-- end -->";
        let expected = ["<s v=1,w=a<AB>", "<x >", "end", "text", "text", "end"];
        assert_eq!(events(text).unwrap(), expected);
    }

    #[test]
    fn malformed_documents_name_the_place() {
        for (text, offset, message) in [
            ("", 0, "no XML element"),
            ("  <!-- only -->", 15, "no XML element"),
            ("abc", 0, "text before the root"),
            ("<a/>b", 4, "text after the root"),
            ("<a/><b/>", 4, "after the root"),
            ("<a><b></a>", 6, "expected </b>"),
            ("<a><b/>", 0, "ends before <a> is closed"),
            ("<a", 0, "ends inside <a"),
            ("</a>", 0, "closes nothing"),
            ("<a b></a>", 3, "no value"),
            ("<a b=1/>", 3, "not in quotes"),
            ("<a b='1/>", 3, "never ends"),
            ("<a b='1><c d='2'/></a>", 8, "holds a <"),
            ("<a b='1'c='2'/>", 8, "missing space before 'c'"),
            ("<a b='1' b='2'/>", 9, "twice"),
            ("<a b='&nbsp;'/>", 6, "unknown entity &nbsp;"),
            ("<a b='&#0;'/>", 6, "unknown entity"),
            ("<a b='x&'/>", 7, "unknown entity"),
            ("<a %/>", 3, "unexpected character '%'"),
            ("< a/>", 0, "without the name"),
            ("<!DOCTYPE a><a/>", 0, "not allowed"),
            ("<a><!-- -></a>", 3, "never closed"),
            ("<a><!", 3, "not allowed"),
            ("<1><2><3><4><5><6><7><8><9>", 24, "deeper than 8"),
        ] {
            let error = events(text).unwrap_err();
            assert!(error.message.contains(message), "{text}: {error:?}");
            assert_eq!(error.offset, offset, "{text}: {error:?}");
        }
    }
}
