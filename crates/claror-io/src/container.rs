//! Files of claror's own: checkpoints of renders in progress, and irradiance caches.
//!
//! A file is a header of text lines, so that one can see with any tool what it holds, followed by
//! blocks of bytes that the renderer gave:
//!
//! ```text
//! claror checkpoint 1              or: claror cache 1
//! field⇥seed⇥0                     one line per field; tab, line feed and \ as \t, \n and \\
//! block⇥state⇥123⇥0123456789abcdef    name, bytes, XXH3 of the bytes
//! end⇥0123456789abcdef               XXH3 of all lines above
//! ```
//!
//! Every byte is covered by a checksum, and a file is only ever replaced as a whole.

use std::io::{self, Write};
use std::path::Path;

use xxhash_rust::xxh3::xxh3_64;

use crate::diagnostic::ReadError;
use crate::limits::Limits;
use crate::source::{Source, printable};
use crate::write;

/// What a file holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The state of a render.
    Checkpoint,
    /// An irradiance cache.
    Cache,
}

impl Kind {
    const ALL: [Self; 2] = [Self::Checkpoint, Self::Cache];

    /// As the first line says it.
    fn name(self) -> &'static str {
        match self {
            Self::Checkpoint => "checkpoint",
            Self::Cache => "cache",
        }
    }

    /// In a message.
    fn noun(self) -> &'static str {
        match self {
            Self::Checkpoint => "a checkpoint",
            Self::Cache => "an irradiance cache",
        }
    }

    /// All of the first line but the version.
    fn magic(self) -> String {
        format!("claror {} ", self.name())
    }
}

/// The version that is written, and the only one that is read.
const VERSION: &str = "1";

/// Longer headers are taken for nonsense.
const MAX_HEADER_BYTES: usize = 1 << 20;

/// What identifies the content, as names and values.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Header {
    /// Such as scene hash, size, seed and the integrator's parameters; in a fixed order.
    pub fields: Vec<(String, String)>,
}

impl Header {
    /// The value of a field.
    pub fn get(&self, name: &str) -> Option<&str> {
        self.fields.iter().find(|f| f.0 == name).map(|f| f.1.as_str())
    }
}

/// The content of a file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Container {
    /// What this is.
    pub header: Header,
    /// Named pieces of bytes.
    pub blocks: Vec<(String, Vec<u8>)>,
}

impl Container {
    /// The bytes of a block.
    pub fn block(&self, name: &str) -> Option<&[u8]> {
        self.blocks.iter().find(|b| b.0 == name).map(|b| b.1.as_slice())
    }
}

/// The first field in which two headers differ, as a sentence; `None` when they are the same.
pub fn difference(stored: &Header, now: &Header) -> Option<String> {
    let name = |f: &(String, String)| f.0.clone();
    let names = now.fields.iter().map(name).chain(stored.fields.iter().map(name));
    for name in names {
        let message = match (stored.get(&name), now.get(&name)) {
            (a, b) if a == b => continue,
            (Some(a), Some(b)) => format!("{name} is {a} in the file and {b} now"),
            (Some(a), None) => format!("{name} is {a} in the file and not given now"),
            (None, _) => format!("{name} is not in the file"),
        };
        return Some(message);
    }
    None
}

/// Writes a file; `path` names the old file or the whole new one at every moment.
pub fn write(path: &Path, kind: Kind, container: &Container) -> io::Result<()> {
    write::atomically(path, |w| write_to(w, kind, container))
}

fn write_to(w: &mut impl Write, kind: Kind, container: &Container) -> io::Result<()> {
    let mut header = format!("{}{VERSION}\n", kind.magic());
    for (name, value) in &container.header.fields {
        header.push_str(&format!("field\t{}\t{}\n", escape(name), escape(value)));
    }
    for (name, bytes) in &container.blocks {
        let (name, hash) = (escape(name), xxh3_64(bytes));
        header.push_str(&format!("block\t{name}\t{}\t{hash:016x}\n", bytes.len()));
    }
    if header.len() > MAX_HEADER_BYTES {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "the fields are too long"));
    }
    let hash = xxh3_64(header.as_bytes());
    writeln!(w, "{header}end\t{hash:016x}")?;
    container.blocks.iter().try_for_each(|(_, bytes)| w.write_all(bytes))
}

/// Reads a file that must be of this kind, all checksums verified.
pub fn read(path: &Path, kind: Kind, limits: &Limits) -> Result<Container, ReadError> {
    from_bytes(&Source::new(path).read(limits)?, kind, path)
}

/// [`read`] of bytes in memory; `path` only names them in messages.
pub fn from_bytes(bytes: &[u8], kind: Kind, path: &Path) -> Result<Container, ReadError> {
    let source = Source::new(path);
    let (header, sizes, mut rest) = parse_header(bytes, kind, source)?;
    let mut blocks = Vec::new();
    for Block { name, length, hash } in sizes {
        let Some((block, tail)) = rest.split_at_checked(length) else {
            let have = rest.len();
            return Err(
                source.error(format!("the file is cut: {have} of {length} bytes of {name}"))
            );
        };
        if xxh3_64(block) != hash {
            return Err(
                source.error(format!("the file is damaged: the checksum of {name} is wrong"))
            );
        }
        blocks.push((name, block.to_vec()));
        rest = tail;
    }
    if !rest.is_empty() {
        return Err(
            source.error(format!("{} bytes follow the end of the file's content", rest.len()))
        );
    }
    Ok(Container { header, blocks })
}

/// A block as the header announces it.
struct Block {
    name: String,
    length: usize,
    hash: u64,
}

type Parsed<'a> = (Header, Vec<Block>, &'a [u8]);

fn parse_header<'a>(
    bytes: &'a [u8],
    kind: Kind,
    source: Source<'_>,
) -> Result<Parsed<'a>, ReadError> {
    let mut header = Header::default();
    let mut blocks = Vec::new();
    let mut at = 0;
    for number in 1.. {
        let rest = &bytes[at..bytes.len().min(MAX_HEADER_BYTES + 32)];
        let end = rest.iter().position(|&b| b == b'\n');
        let Some(line) = end.and_then(|end| str::from_utf8(&rest[..end]).ok()) else {
            if number > 1 || bytes.starts_with(kind.magic().as_bytes()) {
                return Err(source.error_at(number, "the header is cut"));
            }
            return Err(other_file(bytes, kind, source));
        };
        let bad = || {
            let text = printable(line.as_bytes(), 60);
            source.error_at(number, format!("the header is damaged: \"{text}\""))
        };
        let words: Vec<&str> = line.split('\t').collect();
        match words.as_slice() {
            _ if number == 1 => check_first_line(line, kind, source)?,
            ["field", name, value] => {
                let field = unescape(name).zip(unescape(value)).ok_or_else(bad)?;
                header.fields.push(field);
            }
            ["block", name, length, hash] => blocks.push(Block {
                name: unescape(name).ok_or_else(bad)?,
                length: length.parse().map_err(|_| bad())?,
                hash: u64::from_str_radix(hash, 16).map_err(|_| bad())?,
            }),
            ["end", hash] => {
                if u64::from_str_radix(hash, 16) != Ok(xxh3_64(&bytes[..at])) {
                    return Err(source.error("the checksum of the header is wrong"));
                }
                return Ok((header, blocks, &bytes[at + line.len() + 1..]));
            }
            _ => return Err(bad()),
        }
        at += line.len() + 1;
    }
    Err(source.error("the header does not end"))
}

fn check_first_line(line: &str, kind: Kind, source: Source<'_>) -> Result<(), ReadError> {
    match line.strip_prefix(&kind.magic()) {
        Some(VERSION) => Ok(()),
        Some(version) => {
            let version = printable(version.as_bytes(), 20);
            let name = kind.name();
            Err(source.error(format!(
                "a {name} of version {version} cannot be read, only version {VERSION}"
            )))
        }
        None => Err(other_file(line.as_bytes(), kind, source)),
    }
}

/// The error for a file that does not begin as one of this kind.
fn other_file(bytes: &[u8], kind: Kind, source: Source<'_>) -> ReadError {
    let other = Kind::ALL.into_iter().find(|other| bytes.starts_with(other.magic().as_bytes()));
    match other {
        Some(other) => source.error(format!("this is {}, not {}", other.noun(), kind.noun())),
        None => source.error(format!("this is not {}", kind.noun())),
    }
}

fn escape(text: &str) -> String {
    text.replace('\\', "\\\\").replace('\t', "\\t").replace('\n', "\\n")
}

fn unescape(text: &str) -> Option<String> {
    let mut out = String::with_capacity(text.len());
    let mut chars = text.chars();
    while let Some(c) = chars.next() {
        out.push(match c {
            '\\' => match chars.next()? {
                't' => '\t',
                'n' => '\n',
                '\\' => '\\',
                _ => return None,
            },
            c => c,
        });
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn sample() -> Container {
        let field = |n: &str, v: &str| (n.to_owned(), v.to_owned());
        let fields = vec![field("scene", "a\tb\\\nc"), field("seed", "3"), field("spp", "")];
        let blocks = vec![("state".into(), (0..=255).collect()), ("nothing".into(), Vec::new())];
        Container { header: Header { fields }, blocks }
    }

    fn bytes_of(container: &Container) -> Vec<u8> {
        let mut bytes = Vec::new();
        write_to(&mut bytes, Kind::Checkpoint, container).unwrap();
        bytes
    }

    #[test]
    fn round_trip_through_a_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ckpt");
        write(&path, Kind::Checkpoint, &sample()).unwrap();
        assert_eq!(read(&path, Kind::Checkpoint, &Limits::default()).unwrap(), sample());
        let limits = Limits { max_data_file_bytes: 10, ..Limits::default() };
        assert!(read(&path, Kind::Checkpoint, &limits).is_err());
    }

    #[test]
    fn every_cut_and_every_changed_byte_is_noticed() {
        let bytes = bytes_of(&sample());
        let read = |bytes: &[u8]| from_bytes(bytes, Kind::Checkpoint, Path::new("a.ckpt"));
        assert_eq!(read(&bytes).unwrap(), sample());
        for end in 0..bytes.len() {
            assert!(read(&bytes[..end]).is_err(), "cut at {end}");
        }
        for at in 0..bytes.len() {
            let mut changed = bytes.clone();
            changed[at] ^= 0x20;
            // The checksums are written in hexadecimal, of which upper case means the same.
            let is_case = bytes[at].is_ascii_lowercase() && changed[at].is_ascii_hexdigit();
            assert!(is_case || read(&changed).is_err(), "changed at {at}");
        }
        assert!(read(&[bytes.as_slice(), b"x"].concat()).is_err());
    }

    #[test]
    fn the_first_difference_is_named() {
        let now = sample().header;
        assert_eq!(difference(&now, &now), None);
        let mut other = now.clone();
        other.fields[1].1 = "4".into();
        let message = difference(&now, &other).unwrap();
        assert_eq!(message, "seed is 3 in the file and 4 now");
        other.fields.remove(1);
        let message = difference(&now, &other).unwrap();
        assert_eq!(message, "seed is 3 in the file and not given now");
        assert_eq!(difference(&other, &now).unwrap(), "seed is not in the file");
    }

    #[test]
    fn other_versions_and_files_are_told_apart() {
        let of = |text: &str, kind| {
            from_bytes(text.as_bytes(), kind, Path::new("a")).unwrap_err().message
        };
        let message = |text: &str| of(text, Kind::Checkpoint);
        assert!(message("claror checkpoint 2\n").contains("version 2"));
        assert_eq!(message("\x7fELF\n"), "this is not a checkpoint");
        assert_eq!(message(""), "this is not a checkpoint");
        assert_eq!(message("claror checkpoint 1"), "the header is cut");
        for end in ["", "\n", "\nend"] {
            let cache = format!("claror cache 1{end}");
            assert_eq!(message(&cache), "this is an irradiance cache, not a checkpoint");
        }
        let whole = String::from_utf8_lossy(&bytes_of(&sample())).into_owned();
        let message = of(&whole, Kind::Cache);
        assert_eq!(message, "this is a checkpoint, not an irradiance cache");
        assert_eq!(of("claror", Kind::Cache), "this is not an irradiance cache");
    }

    proptest! {
        #[test]
        fn any_bytes_are_survived(tail in proptest::collection::vec(any::<u8>(), 0..400)) {
            let bytes = [b"claror checkpoint 1\n".as_slice(), &tail].concat();
            prop_assert!(from_bytes(&bytes, Kind::Checkpoint, Path::new("a")).is_err());
        }
    }
}
