//! Pixels of the picture against paths.

use super::estimate::{Estimate, Noise, Share, stratified_mean};
use super::strata::Strata;
use super::{VerifySettings, worst_first};
use crate::film::{FilterSampler, LAYERS, Picture};
use crate::integrator::{IntegratorKind, IntegratorSettings, radiance};
use crate::math::{Ray, Vec2};
use crate::sampler::{Sampler, SamplerKind, SamplerSettings};
use crate::scene::Scene;
use crate::sensor::{Camera, Sensor};
use crate::spectrum::Rgb;

/// Independent batches of paths per check: their spread tells the error of their mean, although
/// the paths of a batch are stratified.
pub(super) const BATCHES: u32 = 16;
/// Keeps the random numbers apart from those of the picture.
const STREAM: u64 = 0x7c15_3a91_e04b_d26d;
/// Further camera rays per path where the edge of something that emits is near: a lamp's edge is
/// bright, and would be most of the noise.
const EDGE_RAYS: u32 = 16;
/// An edge: emission differs between neighbours by more than this share of the picture's mean.
const EDGE: f64 = 0.01;
/// Keeps their random numbers apart from those of the paths.
const EDGE_STREAM: u64 = 0x51d7_348b_b02c_96ef;
/// Squared floor of relative errors, as in `claror compare`.
const RELATIVE_FLOOR: f64 = 0.01;

/// One pixel against paths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PictureCheck {
    /// Column and row in the picture.
    pub pixel: (u32, u32),
    /// The picture's value.
    pub value: Rgb,
    /// Value minus mean of the paths: red, green, blue, luminance.
    pub difference: [f64; 4],
    /// Squared standard error of the paths' mean, likewise.
    pub variance: [f64; 4],
    /// Difference in luminance by layer.
    pub layers: [f64; LAYERS],
}

impl PictureCheck {
    /// The picture's luminance.
    pub fn luminance(&self) -> f64 {
        f64::from(self.value.luminance())
    }

    /// The luminance that paths give.
    pub fn expected(&self) -> f64 {
        self.luminance() - self.difference[3]
    }

    /// Squared error without the paths' own, mean of the channels; relative to the squared value
    /// plus a finite `floor`.
    fn mean_square(&self, floor: f64) -> f64 {
        let term = |c: usize| {
            let square = self.difference[c].powi(2) - self.variance[c];
            let value = f64::from(self.value[c]);
            if floor.is_finite() { square / (value * value + floor) } else { square }
        };
        (term(0) + term(1) + term(2)) / 3.0
    }
}

/// Red, green, blue, luminance.
fn with_luminance(sum: [f64; 3]) -> [f64; 4] {
    let [r, g, b] = sum;
    [r, g, b, 0.212_671 * r + 0.715_16 * g + 0.072_169 * b]
}

/// What is not finite counts as black, as in the picture.
fn finite(layers: [Rgb; LAYERS]) -> [Rgb; LAYERS] {
    if layers.iter().all(|layer| layer.is_finite()) { layers } else { [Rgb::BLACK; LAYERS] }
}

fn add(sum: &mut [f64; 3], colour: Rgb, scale: f64) {
    for (sum, value) in sum.iter_mut().zip(colour.to_array()) {
        *sum += f64::from(value) * scale;
    }
}

/// Makes checks.
pub(super) struct PictureChecker<'a> {
    scene: &'a Scene,
    picture: &'a Picture,
    integrator: IntegratorSettings,
    camera: Camera,
    filter: FilterSampler,
    strata: Strata,
    /// Mean of the picture: red, green, blue, luminance.
    mean: [f64; 4],
    crop: (u32, u32),
    seed: u64,
    per_batch: u32,
}

impl<'a> PictureChecker<'a> {
    pub(super) fn new(
        scene: &'a Scene,
        sensor: &Sensor,
        picture: &'a Picture,
        strata: Strata,
        paths: u32,
    ) -> Self {
        let given = scene.tables.integrator;
        let is_direct = matches!(given.kind, IntegratorKind::Direct { .. });
        let max_depth = if is_direct { Some(2) } else { given.max_depth };
        Self {
            scene,
            picture,
            integrator: IntegratorSettings { kind: IntegratorKind::Path, max_depth, ..given },
            camera: Camera::new(sensor),
            filter: FilterSampler::new(sensor.film.filter),
            strata,
            mean: mean(picture),
            crop: (sensor.film.crop.x, sensor.film.crop.y),
            seed: sensor.sampler.seed ^ STREAM,
            per_batch: paths.div_ceil(BATCHES).max(1),
        }
    }

    /// Paths per check.
    pub(super) fn paths(&self) -> u32 {
        self.per_batch * BATCHES
    }

    /// Check `index`; a pure function of it.
    pub(super) fn check(&self, index: u32, rays: &mut u64) -> PictureCheck {
        let independent = SamplerSettings {
            kind: SamplerKind::Independent,
            sample_count: self.per_batch,
            seed: self.seed,
        };
        let place = Sampler::new(&independent, (index, u32::MAX), 0).next_2d();
        let point = self.strata.point(index as usize % self.strata.count, place);
        let pixel = self.strata.pixel(point);
        let (x, y) = (pixel.0 as usize, pixel.1 as usize);
        let parts: [Rgb; LAYERS] = std::array::from_fn(|layer| {
            let value = self.picture.parts[layer].image.pixel(x, y);
            Rgb::new(value[0], value[1], value[2])
        });
        let is_edge = self.is_edge(x, y);
        let (mut mean, mut squares) = ([0.0; 4], [0.0; 4]);
        let mut layers = [0.0; LAYERS];
        for batch in 0..BATCHES {
            let differences = self.batch((index, batch), pixel, &parts, is_edge, rays);
            let total = with_luminance(std::array::from_fn(|c| {
                differences.iter().map(|layer| layer[c]).sum()
            }));
            for (sum, layer) in layers.iter_mut().zip(differences) {
                *sum += with_luminance(layer)[3] / f64::from(BATCHES);
            }
            // Welford's update.
            for c in 0..4 {
                let step = total[c] - mean[c];
                mean[c] += step / f64::from(batch + 1);
                squares[c] += step * (total[c] - mean[c]);
            }
        }
        let scale = 1.0 / f64::from(BATCHES * (BATCHES - 1));
        let [r, g, b] = std::array::from_fn(|c| self.picture.beauty.image.pixel(x, y)[c]);
        PictureCheck {
            pixel,
            value: Rgb::new(r, g, b),
            difference: mean,
            variance: squares.map(|s| s * scale),
            layers,
        }
    }

    /// Mean difference of the picture's layers to the paths of a batch. The weights of the filter
    /// are 1 on average, so that those of the difference may be taken, too: it is smaller.
    fn batch(
        &self,
        stream: (u32, u32),
        pixel: (u32, u32),
        parts: &[Rgb; LAYERS],
        is_edge: bool,
        rays: &mut u64,
    ) -> [[f64; 3]; LAYERS] {
        let samples = SamplerSettings {
            kind: SamplerKind::Sobol,
            sample_count: self.per_batch,
            seed: self.seed,
        };
        let mut sums = [[0.0; 3]; LAYERS];
        for index in 0..self.per_batch {
            let mut sampler = Sampler::new(&samples, stream, index);
            let (ray, weight) = self.camera_ray(pixel, &mut sampler);
            let scale = weight / f64::from(self.per_batch);
            let found =
                radiance(self.scene, &self.integrator, None, &ray, &mut sampler, rays).layers();
            for ((sum, found), part) in sums.iter_mut().zip(finite(found)).zip(parts) {
                add(sum, *part - found, scale);
            }
            if is_edge {
                // What more camera rays tell better.
                let known = self.first_emission(&ray, &mut sampler, rays) - parts[0];
                add(&mut sums[0], known, scale);
            }
        }
        let edge_rays = if is_edge { EDGE_RAYS * self.per_batch } else { 0 };
        let samples = SamplerSettings { seed: self.seed ^ EDGE_STREAM, ..samples };
        for index in 0..edge_rays {
            let mut sampler = Sampler::new(&samples, stream, index);
            let (ray, weight) = self.camera_ray(pixel, &mut sampler);
            let found = self.first_emission(&ray, &mut sampler, rays);
            add(&mut sums[0], parts[0] - found, weight / f64::from(edge_rays));
        }
        sums
    }

    /// A ray of the pixel in this column and row of the picture, and its weight.
    fn camera_ray(&self, pixel: (u32, u32), sampler: &mut Sampler) -> (Ray, f64) {
        let (offset, weight) = self.filter.sample(sampler.next_2d());
        let lens = if self.camera.has_lens() { sampler.next_2d() } else { Vec2::splat(0.5) };
        let (x, y) = (self.crop.0 + pixel.0, self.crop.1 + pixel.1);
        let center = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
        (self.camera.ray(center + offset, lens), f64::from(weight))
    }

    /// Emission of the first surface that a camera ray meets, which holds no chance: all of the
    /// layer emission but what is seen through invisible surfaces.
    fn first_emission(&self, ray: &Ray, sampler: &mut Sampler, rays: &mut u64) -> Rgb {
        let max_depth = self.integrator.max_depth.map_or(1, |limit| limit.min(1));
        let settings = IntegratorSettings { max_depth: Some(max_depth), ..self.integrator };
        let found = radiance(self.scene, &settings, None, ray, sampler, rays);
        finite(found.layers())[0]
    }

    /// Whether emission differs between a pixel of the picture and its neighbours. The picture
    /// alone decides, so this biases nothing.
    fn is_edge(&self, x: usize, y: usize) -> bool {
        let image = &self.picture.parts[0].image;
        let near = |at: usize, size: usize| at.saturating_sub(1)..(at + 2).min(size);
        let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
        for row in near(y, image.height) {
            for column in near(x, image.width) {
                let pixel = image.pixel(column, row);
                let value = f64::from(Rgb::new(pixel[0], pixel[1], pixel[2]).luminance());
                (least, most) = (least.min(value), most.max(value));
            }
        }
        most - least > EDGE * self.mean[3]
    }
}

/// How far the picture is off, by its checks.
#[derive(Debug, Clone, PartialEq)]
pub struct PictureReport {
    /// All checks, in order.
    pub checks: Vec<PictureCheck>,
    /// Paths per check.
    pub paths: u32,
    /// Mean of the picture: red, green, blue, luminance.
    pub mean: [f64; 4],
    /// Error of that mean, relative to it: red, green, blue, luminance.
    pub bias: [Estimate; 4],
    /// What each layer adds to the error of the luminance, relative to the mean of the picture.
    pub layers: [Estimate; LAYERS],
    /// Mean over pixels and channels of the squared error, the checks' own noise taken off: may
    /// come out slightly negative.
    pub mse: Estimate,
    /// The same over squared value + 0.01.
    pub rel_mse: Estimate,
    /// Pixels whose luminance is off by more than the tolerance.
    pub beyond: Share,
    /// Tolerance of [`PictureReport::beyond`], relative to the square root of squared value plus
    /// a hundredth of the picture's squared mean.
    pub tolerance: f64,
    /// How exact the checks are.
    pub noise: Noise,
    /// Checks that are surely off, the worst first.
    pub worst: Vec<usize>,
}

impl PictureReport {
    pub(super) fn new(
        checks: Vec<PictureCheck>,
        checker: &PictureChecker,
        settings: &VerifySettings,
    ) -> Self {
        let strata = checker.strata.count;
        let mean = checker.mean;
        let over = |f: &dyn Fn(&PictureCheck) -> f64| -> Estimate {
            stratified_mean(&checks.iter().map(f).collect::<Vec<f64>>(), strata)
        };
        let reference: [f64; 4] = std::array::from_fn(|c| {
            // A black picture is measured by what it should be.
            let expected = || -over(&|check| check.difference[c]).value;
            [mean[c], expected()].into_iter().find(|m| *m > 0.0).unwrap_or(1.0)
        });
        let noise = Noise::new(checks.iter().map(|c| (c.luminance(), c.variance[3])));
        let scale = |check: &PictureCheck| relative_scale(check.luminance(), reference[3]);
        let error = |check: &PictureCheck| noise.error(check.luminance(), check.variance[3]);
        let place = |c: &PictureCheck| (c.difference[3], error(c), settings.tolerance * scale(c));
        let excess = |c: &PictureCheck| c.difference[3].abs() - Share::SIGMAS * error(c);
        Self {
            paths: checker.paths(),
            mean,
            bias: std::array::from_fn(|c| {
                over(&|check| check.difference[c]).scaled(1.0 / reference[c])
            }),
            layers: std::array::from_fn(|layer| {
                over(&|check| check.layers[layer]).scaled(1.0 / reference[3])
            }),
            mse: over(&|check| check.mean_square(f64::INFINITY)),
            rel_mse: over(&|check| check.mean_square(RELATIVE_FLOOR)),
            beyond: Share::new(checks.iter().map(place)),
            tolerance: settings.tolerance,
            noise,
            worst: worst_first(checks.iter().map(|check| excess(check) / scale(check))),
            checks,
        }
    }

    /// Difference of a check's luminance over its standard error.
    pub fn sigmas(&self, check: &PictureCheck) -> f64 {
        let error = self.noise.error(check.luminance(), check.variance[3]);
        if check.difference[3] == 0.0 { 0.0 } else { check.difference[3] / error }
    }

    /// Error of a check's pixel relative to what [`PictureReport::tolerance`] is relative to, as
    /// far as it is sure: bright is positive, 0 is not sure.
    pub fn sure_error(&self, check: &PictureCheck) -> f64 {
        let error = self.noise.error(check.luminance(), check.variance[3]);
        let sure = (check.difference[3].abs() - Share::SIGMAS * error).max(0.0);
        let scale = relative_scale(check.luminance(), self.mean[3]);
        if sure > 0.0 { sure.copysign(check.difference[3]) / scale } else { 0.0 }
    }
}

/// What differences at a place of this value are relative to, in a picture of this mean.
pub(super) fn relative_scale(value: f64, mean: f64) -> f64 {
    (value * value + RELATIVE_FLOOR * mean * mean).sqrt()
}

/// Mean of the whole picture: red, green, blue, luminance.
fn mean(picture: &Picture) -> [f64; 4] {
    let image = &picture.beauty.image;
    let mut sums = [0.0; 3];
    for pixel in image.data.chunks_exact(image.channels) {
        for (sum, value) in sums.iter_mut().zip(pixel) {
            *sum += f64::from(*value);
        }
    }
    let pixels = (image.width * image.height).max(1) as f64;
    with_luminance(sums.map(|sum| sum / pixels))
}
