//! The picture with the records of the irradiance cache, or the points of a grid, drawn into it.

use std::f32::consts::TAU;

use claror::film::Picture;
use claror::image::Image;
use claror::integrator::{GridCache, IrradianceCache, VisibleRecords};
use claror::irradiance::Record;
use claror::math::Vec2;
use claror::render::RenderOutput;
use claror::scene::Scene;
use claror::sensor::{Camera, Sensor};
use serde_json::{Value, json};

use super::compare;
use crate::config::ShowPoints;
use crate::exit::Failure;
use crate::units;

/// Pixels of the picture's shorter side per pixel of a dot's radius, and the least radius.
const PIXELS_PER_RADIUS: f32 = 300.0;
const LEAST_RADIUS: f32 = 1.2;
/// Width of rings, pixels, and how much of the picture they cover.
const RING_WIDTH: f32 = 1.0;
const RING_OPACITY: f32 = 0.4;
/// Straight pieces of a ring.
const PIECES: u16 = 64;

/// What was drawn.
#[derive(Debug)]
pub(crate) struct Shown {
    file: String,
    name: &'static str,
    /// Why some are not seen.
    why: &'static str,
    all: usize,
    drawn: usize,
    hidden: usize,
    outside: usize,
}

impl Shown {
    /// `points.png: 1234 of 1300 records drawn; 40 hidden, 26 outside of the picture`.
    pub(crate) fn line(&self) -> String {
        let Self { file, name, why, all, drawn, hidden, outside } = self;
        let all = units::plural(*all as u64, name);
        format!("{file}: {drawn} of {all} drawn; {hidden} {why}, {outside} outside of the picture")
    }

    pub(crate) fn json(&self) -> Value {
        let Self { file, drawn, hidden, outside, .. } = self;
        json!({ "file": file, "drawn": drawn, "hidden": hidden, "outside": outside })
    }
}

/// What is drawn.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Points<'a> {
    Records(&'a IrradianceCache),
    Grid(&'a GridCache),
}

impl<'a> Points<'a> {
    /// What a render was made with.
    pub(crate) fn of(output: &'a RenderOutput) -> Option<Self> {
        let cache = output.cache.as_ref().map(Self::Records);
        cache.or(output.grid.as_ref().map(Self::Grid))
    }
}

/// Draws and writes the picture, whole or not at all.
pub(crate) fn write(
    config: &ShowPoints,
    scene: &Scene,
    sensor: &Sensor,
    picture: &Picture,
    points: Points,
    exposure: f32,
) -> Result<Shown, Failure> {
    let mut canvas = Canvas::new(&picture.beauty.image, exposure, config.color.to_array());
    let (all, drawn, hidden, outside) = match points {
        Points::Records(cache) => {
            let visible = cache.visible_records(scene, sensor);
            draw(&mut canvas, sensor, &cache.records, &visible, config.radii);
            (cache.records.len(), visible.visible.len(), visible.hidden, visible.outside)
        }
        Points::Grid(grid) => {
            let used = grid.used_points();
            let drawn = draw_grid(&mut canvas, sensor, &used);
            (grid.len(), drawn, grid.len() - used.len(), used.len() - drawn)
        }
    };
    compare::write(&config.file, config.format, &canvas.image)?;
    let (name, why) = match points {
        Points::Records(_) => ("record", "hidden or in mirrors only"),
        Points::Grid(_) => ("grid point", "not on diffuse surfaces"),
    };
    let file = config.file.display().to_string();
    Ok(Shown { file, name, why, all, drawn, hidden, outside })
}

/// Draws the points of a grid; returns how many are in the picture.
fn draw_grid(canvas: &mut Canvas, sensor: &Sensor, points: &[Vec2]) -> usize {
    let crop = sensor.film.crop;
    let corner = Vec2::new(crop.x as f32, crop.y as f32);
    let size = Vec2::new(crop.width as f32, crop.height as f32);
    let places = points.iter().map(|film| *film - corner);
    let inside = places.filter(|at| at.cmpge(Vec2::ZERO).all() && at.cmplt(size).all());
    inside.map(|at| canvas.dot(at)).count()
}

fn draw(
    canvas: &mut Canvas,
    sensor: &Sensor,
    records: &[Record],
    visible: &VisibleRecords,
    radii: bool,
) {
    let crop = sensor.film.crop;
    let corner = Vec2::new(crop.x as f32, crop.y as f32);
    let rings = if radii { visible.visible.as_slice() } else { &[] };
    let camera = Camera::new(sensor);
    for seen in rings {
        let ring = ring(&camera, &records[seen.index], corner);
        canvas.ring(&ring);
    }
    // On top.
    for seen in &visible.visible {
        canvas.dot(seen.film - corner);
    }
}

/// Corners of the outline of what a record reaches along its tangent plane, pixels of the picture;
/// none where the camera cannot see that far.
fn ring(camera: &Camera, record: &Record, corner: Vec2) -> Vec<Option<Vec2>> {
    let across = record.normal.cross(record.axis);
    let [short, long] = record.radii;
    let at = |piece: u16| {
        let (sin, cos) = (TAU * f32::from(piece) / f32::from(PIECES)).sin_cos();
        let p = record.position + record.axis * (short * cos) + across * (long * sin);
        Some(camera.project(p)? - corner)
    };
    (0..=PIECES).map(at).collect()
}

/// A picture as a screen shows it, to draw on.
struct Canvas {
    image: Image,
    color: [f32; 3],
    dot_radius: f32,
}

impl Canvas {
    /// The picture as an 8-bit file would show it, still linear.
    fn new(picture: &Image, exposure: f32, color: [f32; 3]) -> Self {
        let mut image = picture.clone();
        let factor = exposure.exp2();
        for pixel in image.data.chunks_exact_mut(picture.channels) {
            for value in pixel.iter_mut().take(3) {
                // Comparisons, because `clamp` keeps NaN.
                let shown = *value * factor;
                *value = if shown > 0.0 { shown.min(1.0) } else { 0.0 };
            }
        }
        let side = image.width.min(image.height) as f32;
        Self { image, color, dot_radius: (side / PIXELS_PER_RADIUS).max(LEAST_RADIUS) }
    }

    /// A dot around a place, its edge smoothed.
    fn dot(&mut self, center: Vec2) {
        let radius = self.dot_radius;
        let covered =
            self.near(center, center, radius + 0.5, |pixel| radius + 0.5 - pixel.distance(center));
        self.blend(&covered, 1.0);
    }

    /// A closed line through the corners.
    fn ring(&mut self, corners: &[Option<Vec2>]) {
        let longest = self.image.width.max(self.image.height) as f32;
        let half = 0.5 * RING_WIDTH;
        let mut covered = Vec::new();
        for pair in corners.windows(2) {
            let &[Some(a), Some(b)] = pair else { continue };
            // Close to the plane of the camera what is straight in the world is not on the film.
            if a.distance(b) > longest {
                continue;
            }
            covered.extend(self.near(a, b, half + 0.5, |pixel| half + 0.5 - distance(pixel, a, b)));
        }
        // Pieces overlap at their ends: once is enough.
        covered.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
        covered.dedup_by_key(|c| c.0);
        self.blend(&covered, RING_OPACITY);
    }

    /// Pixels of the box around `a` and `b` that are covered, with how much.
    fn near(
        &self,
        a: Vec2,
        b: Vec2,
        margin: f32,
        coverage: impl Fn(Vec2) -> f32,
    ) -> Vec<(usize, f32)> {
        let (width, height) = (self.image.width, self.image.height);
        // Conversions to integers saturate.
        let range = |low: f32, high: f32, size: usize| {
            let end = ((high + margin).ceil().max(0.0) as usize).min(size);
            ((low - margin).floor().max(0.0) as usize).min(end)..end
        };
        let (low, high) = (a.min(b), a.max(b));
        let columns = range(low.x, high.x, width);
        let mut covered = Vec::new();
        for y in range(low.y, high.y, height) {
            for x in columns.clone() {
                let share = coverage(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
                if share > 0.0 {
                    covered.push((y * width + x, share.min(1.0)));
                }
            }
        }
        covered
    }

    fn blend(&mut self, covered: &[(usize, f32)], opacity: f32) {
        let channels = self.image.channels;
        for &(pixel, share) in covered {
            let share = share * opacity;
            let values = &mut self.image.data[pixel * channels..(pixel + 1) * channels];
            // Where there is alpha, what is drawn is opaque.
            for (value, new) in values.iter_mut().zip(self.color.into_iter().chain([1.0])) {
                *value += (new - *value) * share;
            }
        }
    }
}

/// Distance of a point from the line between two others.
fn distance(p: Vec2, a: Vec2, b: Vec2) -> f32 {
    let way = b - a;
    let length2 = way.length_squared();
    let t = if length2 > 0.0 { ((p - a).dot(way) / length2).clamp(0.0, 1.0) } else { 0.0 };
    p.distance(a + way * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use claror::film::{CropWindow, FilmSettings, FilterKind};
    use claror::integrator::VisibleRecord;
    use claror::math::{Transform, Vec3};
    use claror::sampler::{SamplerKind, SamplerSettings};
    use claror::sensor::SensorKind;
    use claror::spectrum::Rgb;

    /// Columns and rows of the pixels that are not white.
    fn marked(image: &Image) -> Vec<(usize, usize)> {
        let all = (0..image.height).flat_map(|y| (0..image.width).map(move |x| (x, y)));
        all.filter(|(x, y)| image.pixel(*x, *y)[0] < 0.999).collect()
    }

    fn white(width: usize, height: usize, channels: usize) -> Image {
        let mut image = Image::new(width, height, channels);
        image.data.fill(1.0);
        image
    }

    #[test]
    fn dots_are_round_and_cut_at_the_edges() {
        let mut canvas = Canvas::new(&white(20, 12, 3), 0.0, [0.0; 3]);
        canvas.dot(Vec2::new(5.5, 4.5));
        assert_eq!(canvas.image.pixel(5, 4), [0.0; 3], "its centre");
        let marked = marked(&canvas.image);
        assert!(marked.iter().all(|(x, y)| x.abs_diff(5) <= 1 && y.abs_diff(4) <= 1));
        assert_eq!(marked.len(), 9);
        for outside in [Vec2::new(-5.0, 3.0), Vec2::new(30.0, 3.0), Vec2::new(1e30, -1e30)] {
            let before = canvas.image.clone();
            canvas.dot(outside);
            assert_eq!(canvas.image, before);
        }
        canvas.dot(Vec2::new(20.0, 12.0));
        assert!(canvas.image.pixel(19, 11)[0] < 0.5);
    }

    #[test]
    fn pictures_are_shown_as_8_bits_show_them() {
        let mut picture = white(2, 1, 4);
        picture.data.copy_from_slice(&[0.25, 8.0, f32::NAN, 0.5, -1.0, 0.0, 0.1, 0.0]);
        let mut canvas = Canvas::new(&picture, 1.0, [1.0, 0.0, 0.0]);
        assert_eq!(canvas.image.data, [0.5, 1.0, 0.0, 0.5, 0.0, 0.0, 0.2, 0.0]);
        canvas.dot(Vec2::new(0.5, 0.5));
        assert_eq!(canvas.image.pixel(0, 0), [1.0, 0.0, 0.0, 1.0], "opaque");
    }

    fn record(p: Vec3) -> Record {
        Record {
            corral: 0,
            corral_distance: 0.0,
            key: 0,
            position: p,
            normal: -Vec3::Z,
            axis: Vec3::X,
            irradiance: Rgb::WHITE,
            translational: [Vec3::ZERO; 3],
            rotational: [Vec3::ZERO; 3],
            radii: [0.1, 0.2],
            max_angle: 0.3,
            harmonic_mean_distance: 1.0,
            natural_radius: 1.0,
            flags: 0,
        }
    }

    /// Half a unit is 50 pixels at the distance of the record.
    fn sensor() -> Sensor {
        Sensor {
            name: String::new(),
            kind: SensorKind::Orthographic,
            to_world: Transform::IDENTITY,
            near_clip: 0.1,
            far_clip: 10.0,
            film: FilmSettings {
                width: 200,
                height: 200,
                crop: CropWindow { x: 60, y: 50, width: 90, height: 80 },
                filter: FilterKind::Box { radius: 0.5 },
                alpha: false,
            },
            sampler: SamplerSettings { kind: SamplerKind::Sobol, sample_count: 1, seed: 0 },
        }
    }

    /// In a crop window dots and rings lie where the camera sees them.
    #[test]
    fn rings_have_the_radii_of_the_records() {
        let sensor = sensor();
        let record = record(Vec3::new(0.0, 0.0, 2.0));
        let film = Camera::new(&sensor).project(record.position).expect("in front");
        assert_eq!(film, Vec2::splat(100.0));
        let visible = VisibleRecords {
            visible: vec![VisibleRecord { index: 0, film }],
            hidden: 0,
            outside: 0,
        };
        for radii in [false, true] {
            let mut canvas = Canvas::new(&white(90, 80, 3), 0.0, [0.0; 3]);
            draw(&mut canvas, &sensor, &[record], &visible, radii);
            let offsets = marked(&canvas.image)
                .into_iter()
                .map(|(x, y)| Vec2::new(x as f32 + 0.5, y as f32 + 0.5) - Vec2::new(40.0, 50.0));
            let (dot, ring): (Vec<Vec2>, Vec<Vec2>) = offsets.partition(|o| o.length() < 3.0);
            assert!(!dot.is_empty() && ring.is_empty() != radii);
            // 10 pixels along the axis, 20 across it.
            for o in &ring {
                let on_ellipse = (*o / Vec2::new(10.0, 20.0)).length();
                assert!((on_ellipse - 1.0).abs() < 0.12, "{o}");
            }
            assert!(!radii || ring.len() > 90, "{}", ring.len());
        }
    }
}
