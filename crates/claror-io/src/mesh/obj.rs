//! Wavefront OBJ.
//!
//! Read: `v`, `vt`, `vn` and polygonal `f`, which become fans as in Mitsuba. Everything else
//! (groups, materials, lines, points, curves) is skipped. Beyond Mitsuba: negative (relative)
//! indices, lines continued by a backslash, `vt` with one coordinate.

use std::collections::BTreeMap;

use claror::math::{Vec2, Vec3};

use super::finish::RawMesh;
use crate::diagnostic::ReadError;
use crate::limits::Limits;
use crate::source::{Source, printable};

/// No such index; also the end of a chain.
const NONE: u32 = u32::MAX;

/// Longest chain of corners at one position before they go to a tree.
const MAX_CHAIN: u32 = 16;

pub(super) fn parse(
    bytes: &[u8],
    source: Source<'_>,
    limits: &Limits,
) -> Result<RawMesh, ReadError> {
    check_is_text(bytes, source)?;
    let mut parser = Parser::new(source, limits.max_mesh_elements);
    let mut lines = Lines { rest: bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), line: 0 };
    let mut joined = Vec::new();
    while let Some((line, text)) = lines.next(&mut joined) {
        parser.statement(line, text)?;
    }
    parser.check_forward_references()?;
    Ok(parser.finish())
}

/// UTF-16 and binary files get a message of their own.
fn check_is_text(bytes: &[u8], source: Source<'_>) -> Result<(), ReadError> {
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
        return Err(source.error("the file is UTF-16; OBJ files are plain text"));
    }
    match bytes.iter().position(|&b| b == 0) {
        None => Ok(()),
        Some(at) => {
            let line = 1 + bytes[..at].iter().filter(|&&b| b == b'\n').count();
            Err(source.error_at(line, "a zero byte: this is not a text file"))
        }
    }
}

/// Splits into lines, those continued by a backslash joined.
struct Lines<'a> {
    rest: &'a [u8],
    line: usize,
}

impl<'a> Lines<'a> {
    /// The next line with its number from 1; `joined` is room for continued ones.
    fn next<'b>(&mut self, joined: &'b mut Vec<u8>) -> Option<(usize, &'b [u8])>
    where
        'a: 'b,
    {
        let first = self.physical()?;
        let number = self.line;
        let Some(mut head) = first.strip_suffix(b"\\") else { return Some((number, first)) };
        joined.clear();
        loop {
            joined.extend_from_slice(head);
            joined.push(b' ');
            let Some(next) = self.physical() else { break };
            match next.strip_suffix(b"\\") {
                Some(more) => head = more,
                None => {
                    joined.extend_from_slice(next);
                    break;
                }
            }
        }
        Some((number, joined))
    }

    fn physical(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        self.line += 1;
        let end = self.rest.iter().position(|&b| b == b'\n').unwrap_or(self.rest.len());
        let text = &self.rest[..end];
        self.rest = self.rest.get(end + 1..).unwrap_or(&[]);
        Some(text.strip_suffix(b"\r").unwrap_or(text))
    }
}

/// A combination of position, texture coordinate and normal that became a vertex of the mesh.
#[derive(Clone, Copy)]
struct Corner {
    position: u32,
    uv: u32,
    normal: u32,
    /// Next corner at the same position, or [`NONE`].
    next: u32,
}

struct Parser<'a> {
    source: Source<'a>,
    max_elements: u64,
    positions: Vec<Vec3>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    /// In the order in which the faces first use them.
    corners: Vec<Corner>,
    /// Per position its first corner, or [`NONE`].
    first_corner: Vec<u32>,
    /// Corners whose chain would be too long: a hostile file must not cost quadratic time.
    crowded: BTreeMap<(u32, u32, u32), u32>,
    triangles: Vec<[u32; 3]>,
    polygon: Vec<u32>,
    /// The highest indices used so far: unlike positions, these may be defined after the face.
    last_uv: Reference,
    last_normal: Reference,
    skipped_faces: usize,
}

/// The highest index from 1 that a face used, and where.
#[derive(Clone, Copy)]
struct Reference {
    index: u32,
    line: usize,
}

impl Reference {
    fn note(&mut self, index: u32, line: usize) {
        if index != NONE && index >= self.index {
            *self = Self { index: index + 1, line };
        }
    }
}

impl<'a> Parser<'a> {
    fn new(source: Source<'a>, max_elements: u64) -> Self {
        Self {
            source,
            max_elements,
            positions: Vec::new(),
            uvs: Vec::new(),
            normals: Vec::new(),
            corners: Vec::new(),
            first_corner: Vec::new(),
            crowded: BTreeMap::new(),
            triangles: Vec::new(),
            polygon: Vec::new(),
            last_uv: Reference { index: 0, line: 0 },
            last_normal: Reference { index: 0, line: 0 },
            skipped_faces: 0,
        }
    }

    fn statement(&mut self, line: usize, text: &[u8]) -> Result<(), ReadError> {
        let mut words = words(text);
        match words.next() {
            Some(b"v") => {
                let p = self.numbers::<3>(line, text, words, 3)?;
                self.positions.push(Vec3::from_array(p));
                self.check_count(line, "vertices", self.positions.len())
            }
            Some(b"vn") => {
                let n = self.numbers::<3>(line, text, words, 3)?;
                self.normals.push(Vec3::from_array(n));
                self.check_count(line, "normals", self.normals.len())
            }
            Some(b"vt") => {
                let uv = self.numbers::<2>(line, text, words, 1)?;
                self.uvs.push(Vec2::from_array(uv));
                self.check_count(line, "texture coordinates", self.uvs.len())
            }
            Some(b"f") => self.face(line, words),
            _ => Ok(()),
        }
    }

    /// Up to `N` finite numbers, at least `required`; the others are 0.
    fn numbers<'t, const N: usize>(
        &self,
        line: usize,
        text: &[u8],
        mut words: impl Iterator<Item = &'t [u8]>,
        required: usize,
    ) -> Result<[f32; N], ReadError> {
        let mut values = [0.0; N];
        for (i, value) in values.iter_mut().enumerate() {
            let Some(word) = words.next() else {
                if i >= required {
                    break;
                }
                let message = format!("{i} of {required} numbers in \"{}\"", printable(text, 60));
                return Err(self.source.error_at(line, message));
            };
            let parsed = str::from_utf8(word).ok().and_then(|w| w.parse::<f32>().ok());
            *value = match parsed {
                Some(v) if v.is_finite() => v,
                Some(_) => {
                    let message = format!("\"{}\" is not a finite number", printable(word, 40));
                    return Err(self.source.error_at(line, message));
                }
                None => {
                    let message = format!("\"{}\" is not a number", printable(word, 40));
                    return Err(self.source.error_at(line, message));
                }
            };
        }
        Ok(values)
    }

    fn face<'t>(
        &mut self,
        line: usize,
        words: impl Iterator<Item = &'t [u8]>,
    ) -> Result<(), ReadError> {
        let mut polygon = std::mem::take(&mut self.polygon);
        polygon.clear();
        for word in words {
            if word.starts_with(b"#") {
                break;
            }
            polygon.push(self.corner(line, word)?);
        }
        if polygon.len() < 3 {
            self.skipped_faces += 1;
        }
        // A fan around the first corner, as Mitsuba does.
        for pair in polygon.windows(2).skip(1) {
            self.triangles.push([polygon[0], pair[0], pair[1]]);
        }
        self.polygon = polygon;
        self.check_count(line, "vertices", self.corners.len())?;
        self.check_count(line, "triangles", self.triangles.len())
    }

    /// The vertex of the mesh for `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn corner(&mut self, line: usize, word: &[u8]) -> Result<u32, ReadError> {
        let mut parts = word.split(|&b| b == b'/');
        let position = parts.next().unwrap_or_default();
        let uv = parts.next().unwrap_or_default();
        let normal = parts.next().unwrap_or_default();
        if position.is_empty() || parts.next().is_some() {
            let message = format!("\"{}\" is not a vertex of a face", printable(word, 40));
            return Err(self.source.error_at(line, message));
        }
        let count = self.positions.len();
        let position = self.index(line, "vertex", position, count)?;
        if position as usize >= count {
            let message = out_of_range("vertex", u64::from(position) + 1, count);
            return Err(self.source.error_at(line, message));
        }
        let uv = self.index(line, "texture coordinate", uv, self.uvs.len())?;
        let normal = self.index(line, "normal", normal, self.normals.len())?;
        self.last_uv.note(uv, line);
        self.last_normal.note(normal, line);
        Ok(self.intern(position, uv, normal))
    }

    /// From 1 upwards, or negative: counted back from the last one read so far. Empty is [`NONE`].
    /// The result may lie beyond `count`.
    fn index(&self, line: usize, what: &str, word: &[u8], count: usize) -> Result<u32, ReadError> {
        if word.is_empty() {
            return Ok(NONE);
        }
        let Some(value) = parse_integer(word) else {
            let message = format!("\"{}\" is not a {what} index", printable(word, 40));
            return Err(self.source.error_at(line, message));
        };
        // 0 is no index; the counts stay well below NONE.
        let index = if value > 0 { value - 1 } else { value + count as i64 };
        match u32::try_from(index) {
            Ok(index) if value != 0 && index < NONE - 1 => Ok(index),
            _ => Err(self.source.error_at(line, out_of_range(what, value, count))),
        }
    }

    fn check_forward_references(&self) -> Result<(), ReadError> {
        let check = |what: &str, last: Reference, count: usize| {
            if last.index as usize <= count {
                return Ok(());
            }
            Err(self.source.error_at(last.line, out_of_range(what, last.index, count)))
        };
        check("texture coordinate", self.last_uv, self.uvs.len())?;
        check("normal", self.last_normal, self.normals.len())
    }

    /// The number of the corner with these indices; made when it is new.
    fn intern(&mut self, position: u32, uv: u32, normal: u32) -> u32 {
        if self.first_corner.len() <= position as usize {
            self.first_corner.resize(self.positions.len(), NONE);
        }
        let head = self.first_corner[position as usize];
        let mut at = head;
        let mut length = 0;
        while at != NONE {
            let corner = self.corners[at as usize];
            if corner.uv == uv && corner.normal == normal {
                return at;
            }
            at = corner.next;
            length += 1;
        }
        let new = self.corners.len() as u32;
        if length >= MAX_CHAIN {
            let found = *self.crowded.entry((position, uv, normal)).or_insert(new);
            if found == new {
                self.corners.push(Corner { position, uv, normal, next: NONE });
            }
            return found;
        }
        self.corners.push(Corner { position, uv, normal, next: head });
        self.first_corner[position as usize] = new;
        new
    }

    /// Also keeps every index below [`NONE`].
    fn check_count(&self, line: usize, what: &str, count: usize) -> Result<(), ReadError> {
        if count as u64 <= self.max_elements && count < NONE as usize / 3 {
            return Ok(());
        }
        let message = format!("more {what} than the limit of {}", self.max_elements);
        Err(ReadError { line: u32::try_from(line).ok(), ..self.source.too_large(message) })
    }

    fn finish(self) -> RawMesh {
        let Self { positions, uvs, normals, corners, triangles, .. } = self;
        let mut raw = RawMesh { triangles, ..RawMesh::default() };
        raw.positions = corners.iter().map(|c| positions[c.position as usize]).collect();
        if corners.iter().any(|c| c.uv != NONE) {
            raw.uvs = corners
                .iter()
                .map(|c| if c.uv == NONE { Vec2::ZERO } else { uvs[c.uv as usize] })
                .collect();
        }
        if corners.iter().any(|c| c.normal != NONE) {
            raw.normals = corners
                .iter()
                .map(|c| if c.normal == NONE { Vec3::ZERO } else { normals[c.normal as usize] })
                .collect();
        }
        if self.skipped_faces > 0 {
            raw.warnings.push(format!(
                "{} faces with fewer than 3 vertices were skipped",
                self.skipped_faces
            ));
        }
        raw
    }
}

fn out_of_range(what: &str, value: impl std::fmt::Display, count: usize) -> String {
    format!("{what} index {value} is out of range: there are {count}")
}

/// The words of a line, between blanks.
fn words(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.split(|b| matches!(b, b' ' | b'\t' | b'\r' | 0x0b | 0x0c)).filter(|w| !w.is_empty())
}

/// An optional sign and up to 18 digits.
fn parse_integer(word: &[u8]) -> Option<i64> {
    let (negative, digits) = match word {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, word),
    };
    if digits.is_empty() || digits.len() > 18 {
        return None;
    }
    let mut value = 0_i64;
    for &digit in digits {
        if !digit.is_ascii_digit() {
            return None;
        }
        value = 10 * value + i64::from(digit - b'0');
    }
    Some(if negative { -value } else { value })
}
