//! The numbers after the header, one after the other.

use super::header::{Element, NumberKind, PropertyKind};
use crate::source::printable;

/// Why there is no next number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum ValueError {
    /// The file ends.
    End,
    /// Something else stands there (ascii only).
    NotANumber { line: usize, word: String },
}

/// The fewest bytes that numbers can take: what a file must hold at least for its row counts.
#[derive(Debug, Clone, Copy)]
pub(super) enum MinBytes {
    /// A digit and a separator.
    Ascii,
    /// The size of the type.
    Binary,
}

impl MinBytes {
    pub(super) fn value(self, kind: NumberKind) -> u64 {
        match self {
            Self::Ascii => 2,
            Self::Binary => kind.size() as u64,
        }
    }

    /// Of one row; lists may be empty.
    pub(super) fn needed(self, element: &Element) -> u64 {
        let property = |kind| match kind {
            PropertyKind::Scalar(kind) => self.value(kind),
            PropertyKind::List { count, .. } => self.value(count),
        };
        element.properties.iter().map(|p| property(p.kind)).sum()
    }
}

/// A stream of numbers.
pub(super) trait Values {
    const MIN_BYTES: MinBytes;

    /// The next number.
    fn number(&mut self, kind: NumberKind) -> Result<f64, ValueError>;

    /// The next number where only an integer makes sense.
    fn integer(&mut self, kind: NumberKind) -> Result<i64, ValueError>;

    /// Bytes left; for ascii one more, since the last separator may be missing.
    fn remaining(&self) -> usize;

    /// True when something follows the last number, blanks aside.
    fn has_more(&mut self) -> bool;

    /// " (line 7)" or " (byte 1234)": shortly before this the last number stood.
    fn place(&self) -> String;
}

/// Binary numbers, `BIG`-endian or little-endian.
pub(super) struct BinaryValues<'a, const BIG: bool> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a, const BIG: bool> BinaryValues<'a, BIG> {
    pub(super) fn new(bytes: &'a [u8], at: usize) -> Self {
        Self { bytes, at }
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], ValueError> {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let mut value = *rest.first_chunk::<N>().ok_or(ValueError::End)?;
        self.at += N;
        if BIG {
            value.reverse();
        }
        Ok(value)
    }
}

impl<const BIG: bool> Values for BinaryValues<'_, BIG> {
    const MIN_BYTES: MinBytes = MinBytes::Binary;

    fn number(&mut self, kind: NumberKind) -> Result<f64, ValueError> {
        Ok(match kind {
            NumberKind::F32 => f64::from(f32::from_le_bytes(self.take()?)),
            NumberKind::F64 => f64::from_le_bytes(self.take()?),
            NumberKind::U64 => u64::from_le_bytes(self.take()?) as f64,
            _ => self.integer(kind)? as f64,
        })
    }

    fn integer(&mut self, kind: NumberKind) -> Result<i64, ValueError> {
        Ok(match kind {
            NumberKind::I8 => i64::from(i8::from_le_bytes(self.take()?)),
            NumberKind::U8 => i64::from(u8::from_le_bytes(self.take()?)),
            NumberKind::I16 => i64::from(i16::from_le_bytes(self.take()?)),
            NumberKind::U16 => i64::from(u16::from_le_bytes(self.take()?)),
            NumberKind::I32 => i64::from(i32::from_le_bytes(self.take()?)),
            NumberKind::U32 => i64::from(u32::from_le_bytes(self.take()?)),
            NumberKind::I64 => i64::from_le_bytes(self.take()?),
            NumberKind::U64 => i64::try_from(u64::from_le_bytes(self.take()?)).unwrap_or(i64::MAX),
            NumberKind::F32 => whole(f64::from(f32::from_le_bytes(self.take()?))),
            NumberKind::F64 => whole(f64::from_le_bytes(self.take()?)),
        })
    }

    fn remaining(&self) -> usize {
        self.bytes.len().saturating_sub(self.at)
    }

    fn has_more(&mut self) -> bool {
        self.remaining() > 0
    }

    fn place(&self) -> String {
        format!(" (byte {})", self.at)
    }
}

/// Indices stored as floating point numbers; -1, which no reader accepts, unless whole.
fn whole(value: f64) -> i64 {
    if value.fract() == 0.0 && value.abs() < 1e15 { value as i64 } else { -1 }
}

/// Numbers as text, between blanks.
pub(super) struct AsciiValues<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
}

impl<'a> AsciiValues<'a> {
    pub(super) fn new(bytes: &'a [u8], at: usize, line: usize) -> Self {
        Self { bytes, at, line }
    }

    fn word(&mut self) -> Result<&'a [u8], ValueError> {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let start = rest.iter().position(|b| !b.is_ascii_whitespace()).ok_or(ValueError::End)?;
        self.line += rest[..start].iter().filter(|&&b| b == b'\n').count();
        let word = &rest[start..];
        let end = word.iter().position(u8::is_ascii_whitespace).unwrap_or(word.len());
        self.at += start + end;
        Ok(&word[..end])
    }

    fn not_a_number(&self, word: &[u8]) -> ValueError {
        ValueError::NotANumber { line: self.line, word: printable(word, 40) }
    }
}

impl Values for AsciiValues<'_> {
    const MIN_BYTES: MinBytes = MinBytes::Ascii;

    fn number(&mut self, kind: NumberKind) -> Result<f64, ValueError> {
        let word = self.word()?;
        let text = str::from_utf8(word).map_err(|_| self.not_a_number(word))?;
        // Rounded once: a decimal taken to f64 first could end at the other neighbour in f32.
        let value = match kind {
            NumberKind::F32 => text.parse::<f32>().map(f64::from),
            _ => text.parse::<f64>(),
        };
        value.map_err(|_| self.not_a_number(word))
    }

    fn integer(&mut self, _: NumberKind) -> Result<i64, ValueError> {
        let word = self.word()?;
        let text = str::from_utf8(word).map_err(|_| self.not_a_number(word))?;
        text.parse().map_err(|_| self.not_a_number(word))
    }

    fn remaining(&self) -> usize {
        self.bytes.len().saturating_sub(self.at) + 1
    }

    fn has_more(&mut self) -> bool {
        self.word().is_ok()
    }

    fn place(&self) -> String {
        format!(" (line {})", self.line)
    }
}
