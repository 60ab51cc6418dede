//! Pixels of the picture against paths.

use super::estimate::{Estimate, Share, stratified_mean};
use super::strata::Strata;
use super::{VerifySettings, worst_first};
use crate::film::{FilterSampler, LAYERS, Picture};
use crate::integrator::{IntegratorKind, IntegratorSettings, radiance};
use crate::math::Vec2;
use crate::sampler::{Sampler, SamplerKind, SamplerSettings};
use crate::scene::Scene;
use crate::sensor::{Camera, Sensor};
use crate::spectrum::Rgb;

/// Independent batches of paths per check: their spread tells the error of their mean, although
/// the paths of a batch are stratified.
pub(super) const BATCHES: u32 = 16;
/// Keeps the random numbers apart from those of the picture.
const STREAM: u64 = 0x7c15_3a91_e04b_d26d;
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
    /// The luminance that paths give.
    pub fn expected(&self) -> f64 {
        f64::from(self.value.luminance()) - self.difference[3]
    }

    /// Difference in luminance over its standard error.
    pub fn sigmas(&self) -> f64 {
        if self.difference[3] == 0.0 { 0.0 } else { self.difference[3] / self.variance[3].sqrt() }
    }
}

/// Red, green, blue, luminance.
fn with_luminance(sum: [f64; 3]) -> [f64; 4] {
    let [r, g, b] = sum;
    [r, g, b, 0.212_671 * r + 0.715_16 * g + 0.072_169 * b]
}

/// Makes checks.
pub(super) struct PictureChecker<'a> {
    scene: &'a Scene,
    picture: &'a Picture,
    integrator: IntegratorSettings,
    camera: Camera,
    filter: FilterSampler,
    strata: Strata,
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
        let (mut mean, mut squares) = ([0.0; 4], [0.0; 4]);
        let mut layers = [0.0; LAYERS];
        for batch in 0..BATCHES {
            let differences = self.batch((index, batch), pixel, &parts, rays);
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
        rays: &mut u64,
    ) -> [[f64; 3]; LAYERS] {
        let samples = SamplerSettings {
            kind: SamplerKind::Sobol,
            sample_count: self.per_batch,
            seed: self.seed,
        };
        let (x, y) = (self.crop.0 + pixel.0, self.crop.1 + pixel.1);
        let center = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
        let mut sums = [[0.0; 3]; LAYERS];
        for index in 0..self.per_batch {
            let mut sampler = Sampler::new(&samples, stream, index);
            let (offset, weight) = self.filter.sample(sampler.next_2d());
            let lens = if self.camera.has_lens() { sampler.next_2d() } else { Vec2::splat(0.5) };
            let ray = self.camera.ray(center + offset, lens);
            let found =
                radiance(self.scene, &self.integrator, None, &ray, &mut sampler, rays).layers();
            // What is not finite counts as black, as in the picture.
            let is_finite = found.iter().all(|layer| layer.is_finite());
            let weight = f64::from(weight) / f64::from(self.per_batch);
            for ((sum, found), part) in sums.iter_mut().zip(found).zip(parts) {
                for c in 0..3 {
                    let found = if is_finite { f64::from(found[c]) } else { 0.0 };
                    sum[c] += weight * (f64::from(part[c]) - found);
                }
            }
        }
        sums
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
        let mean = mean(checker.picture);
        let over = |f: &dyn Fn(&PictureCheck) -> f64| -> Estimate {
            stratified_mean(&checks.iter().map(f).collect::<Vec<f64>>(), strata)
        };
        let reference: [f64; 4] = std::array::from_fn(|c| {
            // A black picture is measured by what it should be.
            let expected = || -over(&|check| check.difference[c]).value;
            [mean[c], expected()].into_iter().find(|m| *m > 0.0).unwrap_or(1.0)
        });
        let scale = move |check: &PictureCheck| {
            relative_scale(f64::from(check.value.luminance()), reference[3])
        };
        let mean_square = |floored: bool| {
            move |check: &PictureCheck| {
                let term = |c: usize| {
                    let square = check.difference[c].powi(2) - check.variance[c];
                    let value = f64::from(check.value[c]);
                    if floored { square / (value * value + RELATIVE_FLOOR) } else { square }
                };
                (term(0) + term(1) + term(2)) / 3.0
            }
        };
        let places: Vec<(f64, f64, f64)> = checks
            .iter()
            .map(|c| (c.difference[3], c.variance[3].sqrt(), settings.tolerance * scale(c)))
            .collect();
        Self {
            paths: checker.paths(),
            mean,
            bias: std::array::from_fn(|c| {
                over(&|check| check.difference[c]).scaled(1.0 / reference[c])
            }),
            layers: std::array::from_fn(|layer| {
                over(&|check| check.layers[layer]).scaled(1.0 / reference[3])
            }),
            mse: over(&mean_square(false)),
            rel_mse: over(&mean_square(true)),
            beyond: Share::new(places.iter().copied()),
            tolerance: settings.tolerance,
            worst: worst_first(
                checks
                    .iter()
                    .zip(&places)
                    .map(|(check, place)| (place.0.abs() - Share::SIGMAS * place.1) / scale(check)),
            ),
            checks,
        }
    }

    /// Error of a check's pixel relative to what [`PictureReport::tolerance`] is relative to, as
    /// far as it is sure: bright is positive, 0 is not sure.
    pub fn sure_error(&self, check: &PictureCheck) -> f64 {
        let scale = relative_scale(f64::from(check.value.luminance()), self.mean[3]);
        let difference = check.difference[3];
        let sure = (difference.abs() - Share::SIGMAS * check.variance[3].sqrt()).max(0.0);
        if sure > 0.0 { sure.copysign(difference) / scale } else { 0.0 }
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
