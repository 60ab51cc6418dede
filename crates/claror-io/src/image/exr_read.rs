//! OpenEXR in.

use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};

use claror::image::Image;
use exr::image::{AnyChannels, FlatImage, FlatSamples};
use exr::meta::MetaData;
use exr::prelude::{ReadChannels, ReadLayers};

use super::read::{DecodedImage, check_size, first_line};
use crate::diagnostic::ReadError;
use crate::limits::Limits;
use crate::source::{Source, printable};

/// `layer` is the name of the wanted layer; `None` takes the one without a name, else the first.
pub(super) fn decode(
    bytes: &[u8],
    source: Source<'_>,
    layer: Option<&str>,
    limits: &Limits,
) -> Result<DecodedImage, ReadError> {
    check_headers(bytes, source, limits)?;
    let decoded = guarded(source, || {
        exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .all_layers()
            .all_attributes()
            .non_parallel()
            .from_buffered(Cursor::new(bytes))
    })?;
    let layers = named_layers(&decoded);
    let names = || layers.iter().map(|l| l.name.clone()).collect::<Vec<_>>();
    let found = match layer {
        Some(name) => layers.iter().find(|l| l.name == name),
        None => layers.iter().find(|l| l.name.is_empty()).or(layers.first()),
    };
    let Some(found) = found else {
        let what = layer.map_or("with known channels".to_owned(), |name| format!("\"{name}\""));
        let mut error = source.error(format!("the picture has no layer {what}"));
        error.hint = Some(format!("its layers are: {}", names().join(", ")));
        return Err(error);
    };
    let image = interleave(found, source)?;
    Ok(DecodedImage { image, is_srgb_encoded: false, layers: names() })
}

/// Sizes, before anything is decoded.
fn check_headers(bytes: &[u8], source: Source<'_>, limits: &Limits) -> Result<(), ReadError> {
    let meta = guarded(source, || MetaData::read_from_buffered(Cursor::new(bytes), false))?;
    let mut decoded_bytes = 0_u64;
    for header in &meta.headers {
        if header.deep {
            return Err(source.error("deep OpenEXR pictures are not supported"));
        }
        let (width, height) = (header.layer_size.width() as u64, header.layer_size.height() as u64);
        let samples = width.saturating_mul(height);
        let bytes_per_pixel: u64 =
            header.channels.list.iter().map(|c| c.sample_type.bytes_per_sample() as u64).sum();
        decoded_bytes = decoded_bytes.saturating_add(samples.saturating_mul(bytes_per_pixel));
        check_size(source, limits, width, height, bytes.len(), decoded_bytes)?;
        // Every chunk has an entry of 8 bytes in the offset table and a header of at least 8.
        if (header.chunk_count as u64).saturating_mul(16) > bytes.len() as u64 {
            return Err(source.error("the file is cut: it is shorter than its table of offsets"));
        }
    }
    Ok(())
}

/// Runs the decoder. It must not panic, but its authors do not promise so for hostile files; a
/// panic in it is an error about the file. Nothing outlives the closure but its result, so there
/// is no broken state to be seen.
fn guarded<T>(
    source: Source<'_>,
    decode: impl FnOnce() -> Result<T, exr::error::Error>,
) -> Result<T, ReadError> {
    match catch_unwind(AssertUnwindSafe(decode)) {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(error)) => Err(source.error(format!(
            "the OpenEXR picture cannot be decoded: {}",
            first_line(&error.to_string())
        ))),
        Err(_) => Err(source.error("the OpenEXR picture cannot be decoded")),
    }
}

/// Channels that together make a picture: grey, RGB or X, Y, Z, each perhaps with alpha.
struct NamedLayer<'a> {
    /// "" for bare `R`, `G`, `B`; "albedo" for `albedo.R`, …; for pictures of several parts, the
    /// part's name in front.
    name: String,
    size: (usize, usize),
    channels: Vec<&'a exr::image::AnyChannel<FlatSamples>>,
}

/// Suffixes of channels, in the order of a picture's samples. The first set of which a layer has
/// all is used; alpha is appended where there is one.
const CHANNEL_SETS: [&[&str]; 5] =
    [&["R", "G", "B"], &["X", "Y", "Z"], &["Y"], &["U", "V"], &["R"]];

fn named_layers(picture: &FlatImage) -> Vec<NamedLayer<'_>> {
    let mut layers: Vec<NamedLayer<'_>> = Vec::new();
    for part in &picture.layer_data {
        let part_name = part.attributes.layer_name.as_ref().map(ToString::to_string);
        let part_name = part_name.filter(|_| picture.layer_data.len() > 1).unwrap_or_default();
        let mut prefixes: Vec<String> = Vec::new();
        for channel in &part.channel_data.list {
            let name = channel.name.to_string();
            let prefix = name.rsplit_once('.').map_or("", |(prefix, _)| prefix);
            if !prefixes.iter().any(|p| p == prefix) {
                prefixes.push(prefix.to_owned());
            }
        }
        for prefix in prefixes {
            let channels = picture_channels(&part.channel_data, &prefix);
            let name = match (part_name.is_empty(), prefix.is_empty()) {
                (true, _) => prefix,
                (false, true) => part_name.clone(),
                (false, false) => format!("{part_name}.{prefix}"),
            };
            let is_new = layers.iter().all(|l| l.name != name);
            if is_new && !channels.is_empty() {
                layers.push(NamedLayer { name, size: (part.size.0, part.size.1), channels });
            }
        }
    }
    layers
}

/// The channels below `prefix` that make a picture; empty when there are none.
fn picture_channels<'a>(
    channels: &'a AnyChannels<FlatSamples>,
    prefix: &str,
) -> Vec<&'a exr::image::AnyChannel<FlatSamples>> {
    let find = |suffix: &str| {
        let wanted =
            if prefix.is_empty() { suffix.to_owned() } else { format!("{prefix}.{suffix}") };
        channels.list.iter().find(|c| c.name.to_string().eq_ignore_ascii_case(&wanted))
    };
    let set =
        CHANNEL_SETS.iter().find_map(|set| set.iter().map(|s| find(s)).collect::<Option<Vec<_>>>());
    let mut found = match set {
        Some(found) => found,
        // A single channel of any name, such as depth.T.
        None => {
            let own = |name: &str| name.rsplit_once('.').map_or("", |(p, _)| p) == prefix;
            let mut all = channels.list.iter().filter(|c| own(&c.name.to_string()));
            match (all.next(), all.next()) {
                (Some(only), None) => return vec![only],
                _ => return Vec::new(),
            }
        }
    };
    found.extend(find("A"));
    found
}

fn interleave(layer: &NamedLayer<'_>, source: Source<'_>) -> Result<Image, ReadError> {
    let (width, height) = layer.size;
    let count = layer.channels.len();
    let total = (width as u64) * (height as u64) * (count as u64);
    let mut data: Vec<f32> = source.reserve(total, "the picture")?;
    data.resize(total as usize, 0.0);
    for (i, channel) in layer.channels.iter().enumerate() {
        if channel.sampling.0 != 1 || channel.sampling.1 != 1 {
            let name = printable(channel.name.to_string().as_bytes(), 40);
            let mut error = source.error(format!("channel \"{name}\" is subsampled"));
            error.hint = Some("luminance-chroma pictures are not supported; save it as RGB".into());
            return Err(error);
        }
        let targets = data[i..].iter_mut().step_by(count);
        let have = channel.sample_data.len();
        if have != width * height {
            return Err(source.error("the OpenEXR picture cannot be decoded: a channel is cut"));
        }
        match &channel.sample_data {
            FlatSamples::F16(values) => {
                targets.zip(values).for_each(|(t, v)| *t = v.to_f32());
            }
            FlatSamples::F32(values) => targets.zip(values).for_each(|(t, v)| *t = *v),
            FlatSamples::U32(values) => targets.zip(values).for_each(|(t, v)| *t = *v as f32),
        }
    }
    Ok(Image { width, height, channels: count, data })
}
