//! The pictures of a scene, ready for the page: PNG where they are shown, half floats where they
//! are examined.

use std::io::{self, Write};
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use claror::image::Image;
use claror_io::compare::{ErrorMeasure, FlipOptions, error_picture, flip, magma};
use claror_io::image::{BitDepth, read, srgb_to_linear, write_png};
use claror_io::limits::Limits;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use half::f16;
use rayon::prelude::*;

use super::charts;
use crate::study::{Run, SceneStudy, Series, SeriesKind, Setting};

/// Widest picture of a strip in pixels; wider ones are averaged down by a whole factor.
const MAX_STRIP_WIDTH: usize = 800;

/// What the page holds of one scene's pictures.
pub(super) struct Pictures {
    /// The reference, as PNG and for the comparer; nothing if it cannot be read.
    pub reference: Option<Shown>,
    /// First-seed pictures, in the order of the plan.
    pub shown: Vec<Shown>,
    /// Difference at the end of the colours of signed maps.
    pub signed_scale: f32,
    /// By what factor the pictures in strips are smaller.
    pub reduced: usize,
    /// What could not be shown, one sentence each.
    pub problems: Vec<String>,
}

/// One picture.
#[derive(Default)]
pub(super) struct Shown {
    /// Index of the series and the setting.
    pub place: (usize, usize),
    pub label: String,
    /// Data addresses of PNG files; nothing if no strip shows them.
    pub png: Option<String>,
    pub signed: Option<String>,
    pub flip: Option<String>,
    /// Half floats and FLIP bytes for the comparer, packed; nothing if there was no room.
    pub packed: Option<Packed>,
}

/// Data of the comparer.
pub(super) struct Packed {
    /// Three planes of half floats.
    pub colors: String,
    /// One plane of bytes, 255 is FLIP 1.
    pub flip: Option<String>,
}

impl Packed {
    fn bytes(&self) -> usize {
        self.colors.len() + self.flip.as_ref().map_or(0, String::len)
    }
}

impl Pictures {
    /// The picture of a setting.
    pub(super) fn of(&self, place: (usize, usize)) -> Option<&Shown> {
        self.shown.iter().find(|s| s.place == place)
    }

    /// Reads and encodes all pictures of a scene.
    pub(super) fn of_scene(scene: &SceneStudy, folder: &Path) -> Self {
        let mut problems = Vec::new();
        let reference = reference(scene, folder).map_err(|e| problems.push(e)).ok();
        let signed_scale = reference.as_ref().map_or(1.0, signed_scale);
        let mut jobs = Vec::new();
        for (i, series) in scene.series.iter().enumerate() {
            for (j, setting) in series.settings.iter().enumerate() {
                if let Some(run) = first_run(setting) {
                    jobs.push(((i, j), format!("{}, {}", series.label, setting.label), run));
                }
            }
        }
        let make = |((place, label, run), importance): ((_, String, &Run), u8)| {
            let picture = load(&folder.join(&run.picture))?;
            let [width, height] = scene.size;
            if (picture.width, picture.height) != (width, height) {
                return Err(format!(
                    "{label} cannot be shown: it is not of {width} × {height} pixels."
                ));
            }
            let job = Job { place, label, strip: importance < 2, signed_scale };
            job.shown(&picture, reference.as_ref())
        };
        let with_importance: Vec<_> = jobs
            .into_iter()
            .map(|job| {
                let i = importance(scene, job.0);
                (job, i)
            })
            .collect();
        // In the order of the jobs, whoever makes them.
        let made: Vec<Result<Shown, String>> = with_importance.into_par_iter().map(make).collect();
        let mut shown = Vec::new();
        for result in made {
            match result {
                Ok(one) => shown.push(one),
                Err(problem) => problems.push(problem),
            }
        }
        let shown_reference = reference.as_ref().map(|image| Shown {
            label: "Reference".into(),
            png: png(image).ok(),
            packed: pack(image).ok().map(|colors| Packed { colors, flip: None }),
            ..Shown::default()
        });
        Self {
            reduced: reference.as_ref().map_or(1, |r| r.width.div_ceil(MAX_STRIP_WIDTH)),
            reference: shown_reference,
            shown,
            signed_scale,
            problems,
        }
    }

    /// Bytes of what strips show and of the reference, which always stay.
    fn fixed_bytes(&self) -> usize {
        let length = |t: &Option<String>| t.as_ref().map_or(0, String::len);
        let visible = |s: &Shown| length(&s.png) + length(&s.signed) + length(&s.flip);
        let reference = self.reference.iter();
        let packed = reference.clone().filter_map(|r| r.packed.as_ref()).map(Packed::bytes);
        reference.chain(&self.shown).map(visible).sum::<usize>() + packed.sum::<usize>()
    }

    /// Bytes of all.
    pub(super) fn bytes(&self) -> usize {
        let packed = self.shown.iter().filter_map(|s| s.packed.as_ref());
        self.fixed_bytes() + packed.map(Packed::bytes).sum::<usize>()
    }

    /// Drops the comparer's data of the least important pictures until the rest fits, and says so.
    pub(super) fn keep_within(&mut self, budget: usize, scene: &SceneStudy) {
        let mut used = self.fixed_bytes();
        let mut order: Vec<usize> = (0..self.shown.len()).collect();
        order.sort_by_key(|&i| importance(scene, self.shown[i].place));
        let mut left_out = Vec::new();
        for i in order {
            let bytes = self.shown[i].packed.as_ref().map_or(0, Packed::bytes);
            if used + bytes > budget {
                self.shown[i].packed = None;
                left_out.push(self.shown[i].label.clone());
            } else {
                used += bytes;
            }
        }
        if !left_out.is_empty() {
            self.problems.push(format!(
                "Left out of the comparer, to keep its pictures below {} MB: {}. Their \
                 files are in the folder runs/.",
                budget.div_ceil(1_000_000),
                left_out.join("; ")
            ));
        }
    }
}

/// Whether a series is shown setting by setting: steps, and whatever there are further pictures of.
pub(super) fn is_shown_in_steps(series: &Series) -> bool {
    let is_illustrated = series.settings.iter().any(|s| !s.illustrations.is_empty());
    matches!(series.kind, SeriesKind::Steps) || is_illustrated
}

/// 0 for equal times, 1 for what is shown setting by setting, 2 for other settings.
fn importance(scene: &SceneStudy, (series, setting): (usize, usize)) -> u8 {
    let series = &scene.series[series];
    let is_here = |entry: &(String, usize)| entry.0 == series.name && entry.1 == setting;
    if scene.equal_time.iter().any(|t| t.entries.iter().any(is_here)) {
        0
    } else if is_shown_in_steps(series) {
        1
    } else {
        2
    }
}

/// The run with the smallest seed.
pub(super) fn first_run(setting: &Setting) -> Option<&Run> {
    setting.runs.iter().min_by_key(|run| run.seed)
}

/// A linear RGB picture.
fn load(path: &Path) -> Result<Image, String> {
    let decoded =
        read(path, &Limits::default()).map_err(|e| format!("A picture cannot be shown: {e}."))?;
    let linear = |v: f32| if decoded.is_srgb_encoded { srgb_to_linear(v) } else { v };
    let mut out = Image::new(decoded.image.width, decoded.image.height, 3);
    let pixels = decoded.image.data.chunks_exact(decoded.image.channels.max(1));
    for (out, pixel) in out.data.chunks_exact_mut(3).zip(pixels) {
        let rgb = if let [r, g, b, ..] = *pixel { [r, g, b] } else { [pixel[0]; 3] };
        out.copy_from_slice(&rgb.map(linear));
    }
    Ok(out)
}

/// The mean of the halves.
fn reference(scene: &SceneStudy, folder: &Path) -> Result<Image, String> {
    let [mut a, b] = [
        load(&folder.join(&scene.reference.halves[0]))?,
        load(&folder.join(&scene.reference.halves[1]))?,
    ];
    if (a.width, a.height) != (b.width, b.height) {
        return Err("The halves of the reference differ in size.".into());
    }
    a.data.iter_mut().zip(&b.data).for_each(|(a, b)| *a = 0.5 * (*a + b));
    Ok(a)
}

/// A tenth of the reference's mean, rounded to one digit: noise and bias both show at it.
fn signed_scale(reference: &Image) -> f32 {
    let values = reference.data.iter().filter(|v| v.is_finite());
    let (sum, n) = values.fold((0.0, 0u32), |(sum, n), &v| (sum + f64::from(v), n + 1));
    let scale = 0.1 * sum / f64::from(n.max(1));
    if !(scale > 0.0 && scale.is_finite()) {
        return 1.0;
    }
    let unit = 10f64.powf(scale.log10().floor());
    ((scale / unit).round() * unit) as f32
}

/// A picture to be encoded.
struct Job {
    place: (usize, usize),
    label: String,
    strip: bool,
    signed_scale: f32,
}

impl Job {
    fn shown(self, picture: &Image, reference: Option<&Image>) -> Result<Shown, String> {
        let fail = |e: &dyn std::fmt::Display| format!("{} cannot be shown: {e}.", self.label);
        let colors = pack(picture).map_err(|e| fail(&e))?;
        let mut shown = Shown { place: self.place, label: self.label.clone(), ..Shown::default() };
        let mut flip_bytes = None;
        if let Some(reference) = reference {
            let map = flip(picture, reference, &FlipOptions::default()).map_err(|e| fail(&e))?.map;
            flip_bytes = Some(pack_bytes(&map).map_err(|e| fail(&e))?);
            if self.strip {
                let signed =
                    error_picture(picture, reference, ErrorMeasure::Signed, self.signed_scale)
                        .map_err(|e| fail(&e))?;
                shown.signed = Some(png(&signed).map_err(|e| fail(&e))?);
                shown.flip = Some(png(&in_magma(&map)).map_err(|e| fail(&e))?);
            }
        }
        if self.strip {
            shown.png = Some(png(picture).map_err(|e| fail(&e))?);
        }
        shown.packed = Some(Packed { colors, flip: flip_bytes });
        Ok(shown)
    }
}

fn in_magma(map: &Image) -> Image {
    let data = map.data.iter().flat_map(|&v| magma(v).to_array()).collect();
    Image { width: map.width, height: map.height, channels: 3, data }
}

/// A PNG as a data address.
fn png(image: &Image) -> Result<String, String> {
    let mut bytes = Vec::new();
    let small = reduced(image, image.width.div_ceil(MAX_STRIP_WIDTH));
    write_png(&mut bytes, &small, 0.0, BitDepth::Eight).map_err(|e| e.to_string())?;
    Ok(data_address(&bytes))
}

fn data_address(png: &[u8]) -> String {
    format!("data:image/png;base64,{}", STANDARD.encode(png))
}

/// Means of blocks of `factor` × `factor` pixels; a rest at the edges is cut off.
fn reduced(image: &Image, factor: usize) -> Image {
    if factor <= 1 {
        return image.clone();
    }
    let mut out = Image::new(image.width / factor, (image.height / factor).max(1), image.channels);
    for y in 0..out.height {
        for x in 0..out.width {
            for c in 0..out.channels {
                let rows = (y * factor..(y + 1) * factor).filter(|&y| y < image.height);
                let cells = rows.flat_map(|y| (x * factor..(x + 1) * factor).map(move |x| (x, y)));
                let (sum, n) =
                    cells.fold((0.0, 0.0), |(s, n), (x, y)| (s + image.pixel(x, y)[c], n + 1.0));
                out.data[(y * out.width + x) * out.channels + c] = sum / n;
            }
        }
    }
    out
}

/// An illustration as a data address, if it is a PNG that can be read.
pub(super) fn illustration(path: &Path) -> Result<String, String> {
    let fail =
        |e: &dyn std::fmt::Display| format!("The picture {} cannot be shown: {e}.", path.display());
    let bytes = std::fs::read(path).map_err(|e| fail(&e))?;
    if !bytes.starts_with(&[0x89, b'P', b'N', b'G']) {
        return Err(fail(&"it is not a PNG file"));
    }
    claror_io::image::decode(&bytes, path, None, &Limits::default()).map_err(|e| fail(&e))?;
    Ok(data_address(&bytes))
}

/// Half floats, planes of R, G and B. A value is told by its difference to the value on the left,
/// from which that of the channel before is taken, since channels rise and fall together; signs go
/// to the lowest bit; high bytes before low ones, deflated, base64. The page undoes it.
fn pack(image: &Image) -> io::Result<String> {
    let pixels = image.data.len() / 3;
    let mut bytes = Vec::with_capacity(image.data.len() * 2);
    let mut before = vec![0u16; pixels];
    for channel in 0..3 {
        let mut left = 0u16;
        let mut words = Vec::with_capacity(pixels);
        let plane = image.data.iter().skip(channel).step_by(3);
        for (&v, before) in plane.zip(&mut before) {
            let bits = half_bits(v);
            let difference = bits.wrapping_sub(left);
            left = bits;
            words.push(sign_to_end(difference.wrapping_sub(*before)));
            *before = difference;
        }
        bytes.extend(words.iter().map(|w| (w >> 8) as u8));
        bytes.extend(words.iter().map(|w| (w & 0xff) as u8));
    }
    deflated(&bytes)
}

/// 0, −1, 1, −2, … as 0, 1, 2, 3, …
fn sign_to_end(v: u16) -> u16 {
    let sign = if v & 0x8000 == 0 { 0 } else { 0xffff };
    (v << 1) ^ sign
}

/// Values beyond the largest half float are cut to it; NaN stays.
fn half_bits(v: f32) -> u16 {
    let largest = f16::MAX.to_f32();
    f16::from_f32(v.clamp(-largest, largest)).to_bits()
}

/// One byte a pixel, rounded.
fn pack_bytes(map: &Image) -> io::Result<String> {
    deflated(
        &map.data.iter().map(|v| (v.clamp(0.0, 1.0) * 255.0).round() as u8).collect::<Vec<u8>>(),
    )
}

fn deflated(bytes: &[u8]) -> io::Result<String> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(8));
    encoder.write_all(bytes)?;
    Ok(STANDARD.encode(encoder.finish()?))
}

/// Alternative text of a setting's picture.
pub(super) fn alt(what: &str, label: &str, scene: &str) -> String {
    format!("{what} of {scene}: {label}")
}

/// Name of a scene fit for ids.
pub(super) fn scene_slug(index: usize, scene: &SceneStudy) -> String {
    format!("{}-{}", index + 1, charts::slug(&scene.name))
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::*;

    #[test]
    fn packed_colours_come_back_as_half_floats() {
        let data = vec![0.1, 2.0, -3.0, 1e9, f32::NAN, 0.0, 0.5, 1e-3, 7.0];
        let image = Image { width: 3, height: 1, channels: 3, data };
        let deflated = STANDARD.decode(pack(&image).unwrap()).unwrap();
        let mut bytes = Vec::new();
        flate2::read::ZlibDecoder::new(&deflated[..]).read_to_end(&mut bytes).unwrap();
        assert_eq!(bytes.len(), 18);
        let mut before = [0u16; 3];
        for channel in 0..3 {
            let plane = &bytes[channel * 6..channel * 6 + 6];
            let mut value = 0u16;
            for x in 0..3 {
                let word = u16::from(plane[x]) << 8 | u16::from(plane[3 + x]);
                let signed = (word >> 1) ^ (word & 1).wrapping_neg();
                before[x] = before[x].wrapping_add(signed);
                value = value.wrapping_add(before[x]);
                assert_eq!(value, half_bits(image.data[x * 3 + channel]), "{channel} {x}");
            }
        }
        assert_eq!(half_bits(1e9), 0x7bff);
    }

    #[test]
    fn what_has_no_room_is_left_out_last_things_first() {
        use crate::report::testing::{scene, series};
        use crate::study::EqualTime;
        let mut study = scene(vec![series("a", "A", vec![None, None, None])]);
        study.equal_time = vec![EqualTime { seconds: 1.0, entries: vec![("a".into(), 2)] }];
        let shown = |i: usize| Shown {
            place: (0, i),
            label: format!("A, s{i}"),
            packed: Some(Packed { colors: "x".repeat(90), flip: Some("x".repeat(10)) }),
            ..Shown::default()
        };
        let mut pictures = Pictures {
            reference: Some(Shown { png: Some("x".repeat(50)), ..Shown::default() }),
            shown: (0..3).map(shown).collect(),
            signed_scale: 1.0,
            reduced: 1,
            problems: Vec::new(),
        };
        assert_eq!(pictures.bytes(), 350);
        pictures.keep_within(350, &study);
        assert!(pictures.problems.is_empty());
        pictures.keep_within(260, &study);
        assert_eq!(pictures.bytes(), 250);
        assert!(pictures.shown[1].packed.is_none() && pictures.shown[2].packed.is_some());
        assert!(pictures.problems[0].contains("MB: A, s1. Their files"), "{:?}", pictures.problems);
    }

    #[test]
    fn reduced_pictures_are_means() {
        let data = (0..15).map(|v| v as f32).collect();
        let image = Image { width: 5, height: 3, channels: 1, data };
        assert_eq!(reduced(&image, 2).data, [3.0, 5.0]);
    }

    #[test]
    fn the_scale_of_signed_maps_is_a_round_tenth_of_the_mean() {
        let image = Image { width: 1, height: 1, channels: 3, data: vec![0.5, 0.7, f32::INFINITY] };
        assert!((signed_scale(&image) - 0.06).abs() < 1e-6);
        let black = Image::new(1, 1, 3);
        assert!((signed_scale(&black) - 1.0).abs() < 1e-6);
    }
}
