//! OpenEXR out: one part, scan lines, ZIP compression, any number of named channels.
//!
//! Our own writer because equal pictures must be equal files: the library keeps attributes in a
//! hash map and writes them in another order in each run. Layout: OpenEXR file layout, version 2
//! (Academy Software Foundation, "OpenEXR File Layout").

use std::io::Write;

use claror::image::Image;
use exr::prelude::f16;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use rayon::prelude::*;

use super::WriteError;

/// How the samples of a layer are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SampleFormat {
    /// 32-bit float.
    #[default]
    Float,
    /// 16-bit float, rounded to nearest.
    Half,
}

/// Channels of an OpenEXR file that belong together.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer<'a> {
    /// Comes before the channels' names with a dot; empty for the main layer.
    pub name: String,
    /// One name per channel of the picture, such as R, G, B.
    pub channels: Vec<String>,
    /// The samples.
    pub image: &'a Image,
    /// How they are stored.
    pub format: SampleFormat,
}

impl<'a> Layer<'a> {
    /// A layer with the usual channel names: Y, YA, RGB or RGBA.
    pub fn new(name: impl Into<String>, image: &'a Image) -> Self {
        let names: &[&str] = match image.channels {
            1 => &["Y"],
            2 => &["Y", "A"],
            3 => &["R", "G", "B"],
            _ => &["R", "G", "B", "A"],
        };
        Self::with_channels(name, names, image)
    }

    /// A layer with other channel names, such as X, Y, Z.
    pub fn with_channels(name: impl Into<String>, channels: &[&str], image: &'a Image) -> Self {
        let channels = channels.iter().map(|&c| c.to_owned()).collect();
        Self { name: name.into(), channels, image, format: SampleFormat::Float }
    }
}

/// The value of a metadata attribute.
#[derive(Debug, Clone, PartialEq)]
pub enum MetadataValue {
    /// Text.
    Text(String),
    /// A whole number.
    Integer(i32),
    /// A real number.
    Number(f64),
}

/// Lines that are compressed together.
const LINES_PER_CHUNK: usize = 16;

/// A channel as the file lists it.
struct Channel<'a> {
    name: String,
    format: SampleFormat,
    image: &'a Image,
    index: usize,
}

/// Writes layers of equal size, in parallel on the current rayon pool. Attribute names of the format itself (such as `channels`) are
/// refused, as are channel names that occur twice.
pub fn write_exr(
    w: &mut impl Write,
    layers: &[Layer<'_>],
    metadata: &[(String, MetadataValue)],
) -> Result<(), WriteError> {
    let channels = sorted_channels(layers)?;
    let (width, height) = (channels[0].image.width, channels[0].image.height);
    let mut head = header(&channels, metadata)?;
    let mut offset = (head.len() + 8 * height.div_ceil(LINES_PER_CHUNK)) as u64;
    // Compression takes nearly all the time, and chunks know nothing of each other.
    let compressed: Vec<Result<Vec<u8>, WriteError>> = (0..height.div_ceil(LINES_PER_CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let first = chunk * LINES_PER_CHUNK;
            let rows = first..height.min(first + LINES_PER_CHUNK);
            compress(&raw_lines(&channels, width, rows))
        })
        .collect();
    let mut chunks = Vec::new();
    for (chunk, data) in compressed.into_iter().enumerate() {
        let data = data?;
        head.extend(offset.to_le_bytes());
        offset += 8 + data.len() as u64;
        chunks.push(((chunk * LINES_PER_CHUNK) as i32, data));
    }
    w.write_all(&head)?;
    for (y, data) in chunks {
        w.write_all(&y.to_le_bytes())?;
        w.write_all(&(data.len() as i32).to_le_bytes())?;
        w.write_all(&data)?;
    }
    Ok(())
}

/// All channels of all layers, in the alphabetical order that the format wants.
fn sorted_channels<'a>(layers: &'a [Layer<'_>]) -> Result<Vec<Channel<'a>>, WriteError> {
    let unsupported = |message: String| Err(WriteError::Unsupported(message));
    let mut channels = Vec::new();
    for layer in layers {
        let image = layer.image;
        let first = layers[0].image;
        if (image.width, image.height) != (first.width, first.height) {
            return unsupported(format!("layer \"{}\" has another size", layer.name));
        }
        if layer.channels.len() != image.channels {
            return unsupported(format!("layer \"{}\" has another number of channels", layer.name));
        }
        for (index, channel) in layer.channels.iter().enumerate() {
            let name = match (layer.name.as_str(), channel.as_str()) {
                ("", channel) => channel.to_owned(),
                (layer, "") => layer.to_owned(),
                (layer, channel) => format!("{layer}.{channel}"),
            };
            check_name(&name)?;
            channels.push(Channel { name, format: layer.format, image, index });
        }
    }
    channels.sort_by(|a, b| a.name.cmp(&b.name));
    if let Some(pair) = channels.windows(2).find(|pair| pair[0].name == pair[1].name) {
        return unsupported(format!("channel \"{}\" occurs twice", pair[0].name));
    }
    let fits = |n: usize| n > 0 && n < (1 << 24);
    match channels.first() {
        Some(c) if fits(c.image.width) && fits(c.image.height) => Ok(channels),
        _ => unsupported("OpenEXR cannot hold a picture of this size".into()),
    }
}

/// Names are 1 to 255 bytes without zero.
fn check_name(name: &str) -> Result<(), WriteError> {
    if (1..=255).contains(&name.len()) && !name.contains('\0') {
        return Ok(());
    }
    Err(WriteError::Unsupported(format!("\"{}\" is not an OpenEXR name", name.escape_debug())))
}

fn header(
    channels: &[Channel<'_>],
    metadata: &[(String, MetadataValue)],
) -> Result<Vec<u8>, WriteError> {
    let has_long_names = channels.iter().map(|c| &c.name).chain(metadata.iter().map(|m| &m.0));
    let long_names = if has_long_names.into_iter().any(|n| n.len() > 31) { 0x400 } else { 0 };
    let mut out = 20_000_630_u32.to_le_bytes().to_vec();
    out.extend((2_u32 | long_names).to_le_bytes());

    let mut list = Vec::new();
    for channel in channels {
        list.extend(channel.name.as_bytes());
        list.push(0);
        let kind = if channel.format == SampleFormat::Half { 1_i32 } else { 2 };
        list.extend(kind.to_le_bytes());
        list.extend([0; 4]); // not "perceptually linear", and reserved
        list.extend([1_i32.to_le_bytes(), 1_i32.to_le_bytes()].concat()); // sampling
    }
    list.push(0);
    let image = channels[0].image;
    let window: Vec<u8> = [0, 0, image.width as i32 - 1, image.height as i32 - 1]
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    let zip = [3];
    let increasing_y = [0];
    let required: [(&str, &str, &[u8]); 8] = [
        ("channels", "chlist", &list),
        ("compression", "compression", &zip),
        ("dataWindow", "box2i", &window),
        ("displayWindow", "box2i", &window),
        ("lineOrder", "lineOrder", &increasing_y),
        ("pixelAspectRatio", "float", &1_f32.to_le_bytes()),
        ("screenWindowCenter", "v2f", &[0; 8]),
        ("screenWindowWidth", "float", &1_f32.to_le_bytes()),
    ];
    for (name, kind, value) in required {
        push_attribute(&mut out, name, kind, value);
    }
    for (i, (name, value)) in metadata.iter().enumerate() {
        check_name(name)?;
        let is_taken = required.iter().any(|r| r.0 == name)
            || ["type", "chunkCount", "name", "view", "tiles", "version"].contains(&name.as_str())
            || metadata[..i].iter().any(|m| &m.0 == name);
        if is_taken {
            let message = format!("the OpenEXR attribute \"{name}\" is taken");
            return Err(WriteError::Unsupported(message));
        }
        match value {
            MetadataValue::Text(text) => push_attribute(&mut out, name, "string", text.as_bytes()),
            MetadataValue::Integer(v) => push_attribute(&mut out, name, "int", &v.to_le_bytes()),
            MetadataValue::Number(v) => push_attribute(&mut out, name, "double", &v.to_le_bytes()),
        }
    }
    out.push(0);
    Ok(out)
}

fn push_attribute(out: &mut Vec<u8>, name: &str, kind: &str, value: &[u8]) {
    for text in [name, kind] {
        out.extend(text.as_bytes());
        out.push(0);
    }
    out.extend((value.len() as i32).to_le_bytes());
    out.extend(value);
}

/// Line after line, and within a line channel after channel.
fn raw_lines(channels: &[Channel<'_>], width: usize, rows: std::ops::Range<usize>) -> Vec<u8> {
    let mut raw = Vec::with_capacity(rows.len() * width * channels.len() * 4);
    for y in rows {
        for channel in channels {
            let image = channel.image;
            let row = &image.data[y * width * image.channels..][..width * image.channels];
            let values = row[channel.index..].iter().step_by(image.channels);
            match channel.format {
                SampleFormat::Float => raw.extend(values.flat_map(|v| v.to_le_bytes())),
                SampleFormat::Half => {
                    raw.extend(values.flat_map(|&v| f16::from_f32(v).to_le_bytes()));
                }
            }
        }
    }
    raw
}

/// ZIP as the format defines it: bytes at even places first, then those at odd places; each but
/// the first replaced by its difference to the one before, plus 128; zlib. Kept raw where that
/// would not be smaller.
fn compress(raw: &[u8]) -> Result<Vec<u8>, WriteError> {
    let even = raw.iter().step_by(2);
    let odd = raw.iter().skip(1).step_by(2);
    let mut bytes: Vec<u8> = even.chain(odd).copied().collect();
    for i in (1..bytes.len()).rev() {
        bytes[i] = bytes[i].wrapping_sub(bytes[i - 1]).wrapping_add(128);
    }
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(&bytes)?;
    let packed = encoder.finish()?;
    Ok(if packed.len() < raw.len() { packed } else { raw.to_vec() })
}
