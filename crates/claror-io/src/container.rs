//! Checkpoints of renders in progress.
//!
//! A file is a header of text lines, so that one can see with any tool what it holds, followed by
//! blocks of bytes that the renderer gave:
//!
//! ```text
//! claror checkpoint 1
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

const FIRST_LINE: &str = "claror checkpoint 1";

/// Longer headers are taken for nonsense.
const MAX_HEADER_BYTES: usize = 1 << 20;

/// What identifies a render, as names and values.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct CheckpointHeader {
    /// Such as scene hash, size, seed and the integrator's parameters; in a fixed order.
    pub fields: Vec<(String, String)>,
}

impl CheckpointHeader {
    /// The value of a field.
    pub fn get(&self, name: &str) -> Option<&str> {
        self.fields.iter().find(|f| f.0 == name).map(|f| f.1.as_str())
    }
}

/// A render in progress.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Checkpoint {
    /// Which render this is.
    pub header: CheckpointHeader,
    /// Its state: named pieces of bytes.
    pub blocks: Vec<(String, Vec<u8>)>,
}

impl Checkpoint {
    /// The bytes of a block.
    pub fn block(&self, name: &str) -> Option<&[u8]> {
        self.blocks.iter().find(|b| b.0 == name).map(|b| b.1.as_slice())
    }
}

/// The first field in which two renders differ, as a sentence; `None` when they are the same.
pub fn difference(stored: &CheckpointHeader, now: &CheckpointHeader) -> Option<String> {
    let name = |f: &(String, String)| f.0.clone();
    let names = now.fields.iter().map(name).chain(stored.fields.iter().map(name));
    for name in names {
        let message = match (stored.get(&name), now.get(&name)) {
            (a, b) if a == b => continue,
            (Some(a), Some(b)) => format!("{name} is {a} in the checkpoint and {b} now"),
            (Some(a), None) => format!("{name} is {a} in the checkpoint and not given now"),
            (None, _) => format!("{name} is not in the checkpoint"),
        };
        return Some(message);
    }
    None
}

/// Writes a checkpoint; `path` names the old file or the whole new one at every moment.
pub fn write(path: &Path, checkpoint: &Checkpoint) -> io::Result<()> {
    write::atomically(path, |w| write_to(w, checkpoint))
}

fn write_to(w: &mut impl Write, checkpoint: &Checkpoint) -> io::Result<()> {
    let mut header = format!("{FIRST_LINE}\n");
    for (name, value) in &checkpoint.header.fields {
        header.push_str(&format!("field\t{}\t{}\n", escape(name), escape(value)));
    }
    for (name, bytes) in &checkpoint.blocks {
        let (name, hash) = (escape(name), xxh3_64(bytes));
        header.push_str(&format!("block\t{name}\t{}\t{hash:016x}\n", bytes.len()));
    }
    if header.len() > MAX_HEADER_BYTES {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "the fields are too long"));
    }
    let hash = xxh3_64(header.as_bytes());
    writeln!(w, "{header}end\t{hash:016x}")?;
    checkpoint.blocks.iter().try_for_each(|(_, bytes)| w.write_all(bytes))
}

/// Reads a checkpoint, all checksums verified.
pub fn read(path: &Path, limits: &Limits) -> Result<Checkpoint, ReadError> {
    from_bytes(&Source::new(path).read(limits)?, path)
}

/// [`read`] of bytes in memory; `path` only names them in messages.
pub fn from_bytes(bytes: &[u8], path: &Path) -> Result<Checkpoint, ReadError> {
    let source = Source::new(path);
    let (header, sizes, mut rest) = parse_header(bytes, source)?;
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
        return Err(source.error(format!("{} bytes follow the end of the checkpoint", rest.len())));
    }
    Ok(Checkpoint { header, blocks })
}

/// A block as the header announces it.
struct Block {
    name: String,
    length: usize,
    hash: u64,
}

type Parsed<'a> = (CheckpointHeader, Vec<Block>, &'a [u8]);

fn parse_header<'a>(bytes: &'a [u8], source: Source<'_>) -> Result<Parsed<'a>, ReadError> {
    let mut header = CheckpointHeader::default();
    let mut blocks = Vec::new();
    let mut at = 0;
    for number in 1.. {
        let rest = &bytes[at..bytes.len().min(MAX_HEADER_BYTES + 32)];
        let end = rest.iter().position(|&b| b == b'\n');
        let Some(line) = end.and_then(|end| str::from_utf8(&rest[..end]).ok()) else {
            let is_ours = bytes.starts_with(FIRST_LINE.as_bytes());
            let what = if is_ours { "the header is cut" } else { "this is not a checkpoint" };
            return Err(source.error_at(number, what));
        };
        let bad = || {
            let text = printable(line.as_bytes(), 60);
            source.error_at(number, format!("the header of the checkpoint is damaged: \"{text}\""))
        };
        let words: Vec<&str> = line.split('\t').collect();
        match words.as_slice() {
            [first] if number == 1 => check_first_line(first, source)?,
            _ if number == 1 => return Err(source.error_at(1, "this is not a checkpoint")),
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
                    return Err(source.error("the checksum of the checkpoint's header is wrong"));
                }
                return Ok((header, blocks, &bytes[at + line.len() + 1..]));
            }
            _ => return Err(bad()),
        }
        at += line.len() + 1;
    }
    Err(source.error("the header does not end"))
}

fn check_first_line(line: &str, source: Source<'_>) -> Result<(), ReadError> {
    if line == FIRST_LINE {
        return Ok(());
    }
    Err(match line.strip_prefix("claror checkpoint ") {
        Some(version) => {
            let version = printable(version.as_bytes(), 20);
            source.error(format!("checkpoints of version {version} cannot be read, only version 1"))
        }
        None => source.error("this is not a checkpoint"),
    })
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

    fn sample() -> Checkpoint {
        let field = |n: &str, v: &str| (n.to_owned(), v.to_owned());
        let fields = vec![field("scene", "a\tb\\\nc"), field("seed", "3"), field("spp", "")];
        let blocks = vec![("state".into(), (0..=255).collect()), ("nothing".into(), Vec::new())];
        Checkpoint { header: CheckpointHeader { fields }, blocks }
    }

    fn bytes_of(checkpoint: &Checkpoint) -> Vec<u8> {
        let mut bytes = Vec::new();
        write_to(&mut bytes, checkpoint).unwrap();
        bytes
    }

    #[test]
    fn round_trip_through_a_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ckpt");
        write(&path, &sample()).unwrap();
        assert_eq!(read(&path, &Limits::default()).unwrap(), sample());
        let limits = Limits { max_data_file_bytes: 10, ..Limits::default() };
        assert!(read(&path, &limits).is_err());
    }

    #[test]
    fn every_cut_and_every_changed_byte_is_noticed() {
        let bytes = bytes_of(&sample());
        let read = |bytes: &[u8]| from_bytes(bytes, Path::new("a.ckpt"));
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
        assert_eq!(message, "seed is 3 in the checkpoint and 4 now");
        other.fields.remove(1);
        let message = difference(&now, &other).unwrap();
        assert_eq!(message, "seed is 3 in the checkpoint and not given now");
        assert_eq!(difference(&other, &now).unwrap(), "seed is not in the checkpoint");
    }

    #[test]
    fn other_versions_and_files_are_told_apart() {
        let message = |text: &str| from_bytes(text.as_bytes(), Path::new("a")).unwrap_err().message;
        assert!(message("claror checkpoint 2\n").contains("version 2"));
        assert_eq!(message("\x7fELF\n"), "this is not a checkpoint");
        assert_eq!(message(""), "this is not a checkpoint");
    }

    proptest! {
        #[test]
        fn any_bytes_are_survived(tail in proptest::collection::vec(any::<u8>(), 0..400)) {
            let bytes = [b"claror checkpoint 1\n".as_slice(), &tail].concat();
            prop_assert!(from_bytes(&bytes, Path::new("a")).is_err());
        }
    }
}
