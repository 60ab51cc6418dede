//! The header: which elements follow, with which properties.

use crate::diagnostic::ReadError;
use crate::source::{Source, printable};

/// How the numbers after the header are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// A numeric type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NumberKind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl NumberKind {
    fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "long" | "int64" => Self::I64,
            "ulong" | "uint64" => Self::U64,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes in a binary file.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    pub(super) fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }
}

/// One number or a list of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PropertyKind {
    Scalar(NumberKind),
    List { count: NumberKind, item: NumberKind },
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: PropertyKind,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Element {
    pub(super) name: String,
    /// Rows.
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// Offset of the first byte after the header.
    pub(super) body_start: usize,
    /// Line of that byte, from 1.
    pub(super) body_line: usize,
    pub(super) warnings: Vec<String>,
}

/// More elements, or properties of one, are taken for nonsense.
const MAX_ENTRIES: usize = 1024;

/// A longer header line is taken for nonsense, and so is a file without line ends.
const MAX_LINE: usize = 4096;

impl Header {
    pub(super) fn parse(bytes: &[u8], source: Source<'_>) -> Result<Self, ReadError> {
        let mut lines = HeaderLines { bytes, at: 0, line: 0, source };
        if lines.next()? != ["ply"] {
            return Err(
                source.error_at(1, "this is not a PLY file: it does not begin with \"ply\"")
            );
        }
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        loop {
            let words = lines.next()?;
            let fail = |message: String| Err(source.error_at(lines.line, message));
            match words.as_slice() {
                [] | ["comment" | "obj_info", ..] => {}
                ["format", name, version] => {
                    encoding = Some(match *name {
                        "ascii" => Encoding::Ascii,
                        "binary_little_endian" => Encoding::LittleEndian,
                        "binary_big_endian" => Encoding::BigEndian,
                        _ => return fail(format!("unknown PLY format \"{name}\"")),
                    });
                    if *version != "1.0" {
                        return fail(format!("unknown PLY version \"{version}\""));
                    }
                }
                ["element", name, count] => {
                    let Ok(count) = count.parse() else {
                        return fail(format!("\"{count}\" is not a number of rows"));
                    };
                    elements.push(Element { name: (*name).into(), count, properties: vec![] });
                }
                ["property", rest @ ..] => {
                    let property = parse_property(rest, source, lines.line)?;
                    let Some(element) = elements.last_mut() else {
                        return fail("\"property\" before the first \"element\"".into());
                    };
                    element.properties.push(property);
                    if element.properties.len() > MAX_ENTRIES {
                        return fail(format!("more than {MAX_ENTRIES} properties"));
                    }
                }
                ["end_header"] => break,
                _ => return fail(format!("unknown PLY header line \"{}\"", words.join(" "))),
            }
            if elements.len() > MAX_ENTRIES {
                return fail(format!("more than {MAX_ENTRIES} elements"));
            }
        }
        let Some(encoding) = encoding else {
            return Err(source.error("the PLY header has no line \"format\""));
        };
        let (body_start, body_line) = (lines.at, lines.line + 1);
        Ok(Self { encoding, elements, body_start, body_line, warnings: Vec::new() })
    }
}

fn parse_property(words: &[&str], source: Source<'_>, line: usize) -> Result<Property, ReadError> {
    let kind = |name: &str| {
        NumberKind::from_name(name)
            .ok_or_else(|| source.error_at(line, format!("unknown PLY type \"{name}\"")))
    };
    match *words {
        ["list", count, item, name] => {
            let (count, item) = (kind(count)?, kind(item)?);
            if count.is_float() {
                return Err(source.error_at(line, "the length of a list must have an integer type"));
            }
            Ok(Property { name: name.into(), kind: PropertyKind::List { count, item } })
        }
        [scalar, name] => {
            Ok(Property { name: name.into(), kind: PropertyKind::Scalar(kind(scalar)?) })
        }
        _ => Err(source.error_at(line, "a PLY property is a type and a name")),
    }
}

struct HeaderLines<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
    source: Source<'a>,
}

impl<'a> HeaderLines<'a> {
    /// The words of the next line.
    fn next(&mut self) -> Result<Vec<&'a str>, ReadError> {
        self.line += 1;
        let rest = &self.bytes[self.at..];
        let Some(end) = rest.iter().take(MAX_LINE).position(|&b| b == b'\n') else {
            let message = if rest.len() < MAX_LINE {
                "the PLY header is cut"
            } else {
                "this is not a PLY header"
            };
            return Err(self.source.error_at(self.line, message));
        };
        self.at += end + 1;
        match str::from_utf8(&rest[..end]) {
            Ok(text) => Ok(text.split_ascii_whitespace().collect()),
            // Comments come in every encoding.
            Err(_) if rest.starts_with(b"comment") || rest.starts_with(b"obj_info") => Ok(vec![]),
            Err(_) => {
                let text = printable(&rest[..end], 40);
                Err(self.source.error_at(self.line, format!("not a PLY header line: \"{text}\"")))
            }
        }
    }
}
