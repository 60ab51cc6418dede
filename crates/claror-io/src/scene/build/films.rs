//! Films, reconstruction filters and samplers: what sensors hold.

use claror::film::{CropWindow, FilmSettings, FilterKind};
use claror::sampler::{SamplerKind, SamplerSettings};

use super::Builder;
use crate::diagnostic::Subject;
use crate::scene::description::{ObjectIndex, Tag};
use crate::scene::properties::Properties;
use crate::scene::values::short;

/// All film plugins.
const FILMS: [&str; 2] = ["hdrfilm", "ldrfilm"];
/// All filter plugins.
const FILTERS: [&str; 6] = ["box", "tent", "gaussian", "mitchell", "catmullrom", "lanczos"];
/// All sampler plugins, those of Mitsuba 0.6 included.
const SAMPLERS: [&str; 10] = [
    "independent",
    "sobol",
    "stratified",
    "multijitter",
    "orthogonal",
    "ldsampler",
    "halton",
    "hammersley",
    "owen",
    "zsobol",
];
/// Longest edge of a film; its product is bounded by [`crate::Limits::max_film_pixels`].
const MAX_EDGE: i64 = 1 << 30;

impl<'a> Builder<'a> {
    /// The film of a sensor.
    pub(super) fn film(&mut self, sensor: &Properties<'a>) -> FilmSettings {
        let Some(index) = self.only_nested(sensor, Tag::Film) else {
            return film_of(768, 576, FilterKind::Gaussian { stddev: 0.5 });
        };
        let properties = self.properties(index);
        if !FILMS.contains(&properties.plugin()) {
            self.unsupported(&properties, &FILMS, "\"hdrfilm\" is used instead");
            return film_of(768, 576, FilterKind::Gaussian { stddev: 0.5 });
        }
        let edge = |name, default: u32| {
            u32::try_from(properties.integer(name, i64::from(default), 1..=MAX_EDGE))
                .unwrap_or(default)
        };
        let (width, height) = (edge("width", 768), edge("height", 576));
        let filter = match self.only_nested(&properties, Tag::Rfilter) {
            Some(filter) => self.filter(filter),
            None => FilterKind::Gaussian { stddev: 0.5 },
        };
        let crop = self.crop(&properties, width, height);
        let pixels = u64::from(crop.width) * u64::from(crop.height);
        if pixels > self.options.limits.max_film_pixels {
            let limit = self.options.limits.max_film_pixels;
            let message = format!(
                "a film of {} x {} pixels is larger than the limit of {limit}",
                crop.width, crop.height
            );
            let span = properties.span_of("width");
            self.log.error_about(Subject::Memory, span, message, None);
        }
        let alpha = properties.choice(
            "pixel_format",
            &[
                ("rgb", false),
                ("rgba", true),
                ("luminance", false),
                ("luminance_alpha", true),
                // As the film holds them: spectral and XYZ pictures are rendered as RGB.
                ("xyz", false),
                ("xyza", true),
            ],
        );
        // The output files' names and the command line decide on their formats.
        properties.ignore(&["component_format", "file_format", "sample_border", "compensate"]);
        if properties.plugin() == "ldrfilm" {
            properties.ignore(&["gamma", "exposure", "key", "burn", "tonemap_method"]);
        }
        self.finish(properties);
        FilmSettings { width, height, crop, filter, alpha }
    }

    fn crop(&self, properties: &Properties<'a>, width: u32, height: u32) -> CropWindow {
        let x = properties.count("crop_offset_x", 0, 0);
        let y = properties.count("crop_offset_y", 0, 0);
        let w = properties.count("crop_width", width, 1);
        let h = properties.count("crop_height", height, 1);
        for (name, offset, size, edge) in
            [("crop_width", x, w, width), ("crop_height", y, h, height)]
        {
            if u64::from(offset) + u64::from(size) > u64::from(edge) {
                let message = format!(
                    "the crop window ends at {}, beyond the film's edge {edge}",
                    u64::from(offset) + u64::from(size)
                );
                let hint = "give crop_width and crop_height together with the offsets";
                properties.error(name, message, Some(hint.into()));
                return CropWindow { x: 0, y: 0, width, height };
            }
        }
        CropWindow { x, y, width: w, height: h }
    }

    fn filter(&mut self, index: ObjectIndex) -> FilterKind {
        let properties = self.properties(index);
        let within = |name, default: f32, high: f32| {
            let what = format!("above 0 and at most {high}");
            properties.float_that(name, default, &what, |v| v > 0.0 && v <= high)
        };
        let filter = match properties.plugin() {
            "box" => FilterKind::Box { radius: within("radius", 0.5, 16.0) },
            "tent" => FilterKind::Tent { radius: within("radius", 1.0, 16.0) },
            "gaussian" => FilterKind::Gaussian { stddev: within("stddev", 0.5, 4.0) },
            "mitchell" => {
                let third = 1.0 / 3.0;
                let short_of_ten = |v: f32| v.abs() <= 10.0;
                let (b_name, c_name) = if properties.has("A") { ("A", "B") } else { ("b", "c") };
                FilterKind::Mitchell {
                    b: properties.float_that(b_name, third, "between -10 and 10", short_of_ten),
                    c: properties.float_that(c_name, third, "between -10 and 10", short_of_ten),
                }
            }
            "catmullrom" => FilterKind::CatmullRom,
            "lanczos" => FilterKind::Lanczos {
                lobes: u32::try_from(properties.integer("lobes", 3, 1..=16)).unwrap_or(3),
            },
            _ => {
                self.unsupported(&properties, &FILTERS, "\"gaussian\" is used instead");
                FilterKind::Gaussian { stddev: 0.5 }
            }
        };
        self.finish(properties);
        filter
    }

    /// The sampler of a sensor. Nearly every scene file says `independent` without meaning it:
    /// all names stand for Owen-scrambled Sobol points, which the command line may override.
    pub(super) fn sampler(&mut self, sensor: &Properties<'a>) -> SamplerSettings {
        let default = SamplerSettings { kind: SamplerKind::Sobol, sample_count: 4, seed: 0 };
        let Some(index) = self.only_nested(sensor, Tag::Sampler) else { return default };
        let properties = self.properties(index);
        if !SAMPLERS.contains(&properties.plugin()) {
            self.unsupported(&properties, &SAMPLERS, "Sobol points are used instead");
            return default;
        }
        let sample_count = properties.count("sample_count", default.sample_count, 1);
        let seed = properties.integer("seed", 0, 0..=i64::MAX).unsigned_abs();
        match properties.plugin() {
            "stratified" | "multijitter" => properties.ignore(&["jitter"]),
            "orthogonal" => properties.ignore(&["jitter", "strength"]),
            _ => {}
        }
        self.finish(properties);
        SamplerSettings { kind: SamplerKind::Sobol, sample_count, seed }
    }
}

fn film_of(width: u32, height: u32, filter: FilterKind) -> FilmSettings {
    let crop = CropWindow { x: 0, y: 0, width, height };
    FilmSettings { width, height, crop, filter, alpha: false }
}

/// `width` over `height`.
pub(super) fn aspect(film: &FilmSettings) -> f64 {
    f64::from(film.width) / f64::from(film.height)
}

/// The unit suffix of lengths such as `50mm` taken off.
pub(super) fn millimetres(text: &str) -> Result<f64, String> {
    let number = text.trim().strip_suffix("mm").unwrap_or(text.trim());
    match crate::scene::values::float(number) {
        Ok(v) if v > 0.0 => Ok(v),
        _ => Err(format!("\"{}\" is no length such as 50mm", short(text))),
    }
}
