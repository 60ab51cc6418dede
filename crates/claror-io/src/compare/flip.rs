//! FLIP: how visible the difference is to someone who flips between two pictures.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild 2020: FLIP: a difference
//! evaluator for alternating images (LDR-FLIP). Equation and section numbers refer to it.

use std::f64::consts::PI;

use claror::image::Image;
use claror::math::Vec3;
use claror::spectrum::Rgb;

use super::color::ColorSpaces;
use super::{CompareError, check_sizes, colors};

/// How linear radiance becomes what a screen shows, in [0, 1].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ToneMap {
    /// Cut off above 1.
    #[default]
    Clamp,
    /// Colour divided by 1 + luminance (Reinhard et al. 2002), then cut off.
    Reinhard,
}

/// How the pictures are looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlipOptions {
    /// Colours are multiplied by 2 to this power first.
    pub exposure: f32,
    /// Applied to linear colours.
    pub tone_map: ToneMap,
    /// Pixels per degree of the observer's view.
    pub pixels_per_degree: f32,
}

impl Default for FlipOptions {
    /// The paper's observer: 0.7 m from a screen 0.7 m and 3840 pixels wide.
    fn default() -> Self {
        let pixels_per_degree = (3840.0 * PI / 180.0) as f32;
        Self { exposure: 0.0, tone_map: ToneMap::Clamp, pixels_per_degree }
    }
}

/// The difference in [0, 1] per pixel, and its mean.
#[derive(Debug, Clone, PartialEq)]
pub struct FlipResult {
    /// Mean over the pixels.
    pub mean: f64,
    /// One channel.
    pub map: Image,
}

/// Exponent and knee of the colour difference (section 4.1.3), exponent of the feature difference
/// and width of the feature detectors in degrees (section 4.2).
const QC: f32 = 0.7;
const PC: f32 = 0.4;
const PT: f32 = 0.95;
const QF: f32 = 0.5;
const FEATURE_WIDTH: f64 = 0.082;

/// Compares linear pictures. What is not finite counts as black.
pub fn flip(
    picture: &Image,
    reference: &Image,
    options: &FlipOptions,
) -> Result<FlipResult, CompareError> {
    check_sizes(picture, reference)?;
    let spaces = ColorSpaces::new();
    let [a, b] = [picture, reference].map(|image| Seen::new(image, options, &spaces));
    let max_distance = hyab(spaces.hunt_lab(Vec3::Y), spaces.hunt_lab(Vec3::Z)).powf(QC);
    let data: Vec<f32> = (0..a.lab.len())
        .map(|i| {
            let color = color_difference(hyab(a.lab[i], b.lab[i]), max_distance);
            let edge = (a.edges[i] - b.edges[i]).abs();
            let point = (a.points[i] - b.points[i]).abs();
            let feature = (std::f32::consts::FRAC_1_SQRT_2 * edge.max(point)).powf(QF);
            // Features make differences in colour more visible (equation 5).
            color.powf(1.0 - feature.min(1.0))
        })
        .collect();
    let mean = data.iter().map(|&v| f64::from(v)).sum::<f64>() / data.len() as f64;
    let map = Image { width: picture.width, height: picture.height, channels: 1, data };
    Ok(FlipResult { mean, map })
}

/// A picture as the observer perceives it.
struct Seen {
    /// Blurred by the eye, in L*a*b* with the Hunt effect.
    lab: Vec<Vec3>,
    /// Strength of edges and of points.
    edges: Vec<f32>,
    points: Vec<f32>,
}

impl Seen {
    fn new(image: &Image, options: &FlipOptions, spaces: &ColorSpaces) -> Self {
        let size = (image.width, image.height);
        let ppd = f64::from(options.pixels_per_degree.max(1e-3));
        let opponent: Vec<Vec3> =
            colors(image).map(|c| spaces.ycxcz(displayed(c, options))).collect();
        let lab = contrast_sensitivity(&opponent, size, ppd)
            .into_iter()
            .map(|c| spaces.hunt_lab(spaces.rgb_from_ycxcz(c).clamp(Vec3::ZERO, Vec3::ONE)))
            .collect();
        let grey: Vec<f32> = opponent.iter().map(|c| (c.x + 16.0) / 116.0).collect();
        let kernels = FeatureKernels::new(ppd);
        let edges = feature_strength(&grey, size, &kernels.blur, &kernels.edge);
        let points = feature_strength(&grey, size, &kernels.blur, &kernels.point);
        Self { lab, edges, points }
    }
}

/// What the screen shows, linear.
fn displayed(color: Rgb, options: &FlipOptions) -> Vec3 {
    let c = if color.is_finite() { color * options.exposure.exp2() } else { Rgb::BLACK };
    let c = match options.tone_map {
        ToneMap::Clamp => c,
        ToneMap::Reinhard => c * (1.0 / (1.0 + c.luminance().max(0.0))),
    };
    Vec3::from_array(c.to_array()).clamp(Vec3::ZERO, Vec3::ONE)
}

/// Distance of colours too far apart for the Euclidean one (Abasi et al. 2020).
fn hyab(a: Vec3, b: Vec3) -> f32 {
    let d = a - b;
    d.x.abs() + d.y.hypot(d.z)
}

/// Compresses large distances: up to a share PC of the largest they take PT of the range.
fn color_difference(distance: f32, max_distance: f32) -> f32 {
    let d = distance.powf(QC);
    let knee = PC * max_distance;
    if d < knee { PT / knee * d } else { PT + (d - knee) / (max_distance - knee) * (1.0 - PT) }
}

/// Sensitivity to contrast per opponent channel as sums of two Gaussians over the spatial
/// frequency: weight and width of each (table 1).
const SENSITIVITY: [[[f64; 2]; 2]; 3] =
    [[[1.0, 0.0047], [0.0, 1e-5]], [[1.0, 0.0053], [0.0, 1e-5]], [[34.1, 0.04], [13.5, 0.025]]];

/// Blurs each opponent channel as the eye does (section 4.1.1).
fn contrast_sensitivity(image: &[Vec3], size: (usize, usize), ppd: f64) -> Vec<Vec3> {
    // Three standard deviations of the widest Gaussian.
    let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * ppd).ceil() as i64;
    let mut out = vec![Vec3::ZERO; image.len()];
    for (channel, gaussians) in SENSITIVITY.into_iter().enumerate() {
        let plane: Vec<f32> = image.iter().map(|c| c[channel]).collect();
        // In space, a Gaussian of width b becomes one of 1/b, and separates into rows and columns.
        let kernels = gaussians.map(|[a, b]| {
            let kernel: Vec<f64> = (-radius..=radius)
                .map(|x| (-PI * PI * (x as f64 / ppd).powi(2) / b).exp())
                .collect();
            let sum: f64 = kernel.iter().sum();
            (a * (PI / b).sqrt() * sum * sum, kernel.iter().map(|v| (v / sum) as f32).collect())
        });
        let total: f64 = kernels.iter().map(|k: &(f64, Vec<f32>)| k.0).sum();
        for (weight, kernel) in kernels.into_iter().filter(|k| k.0 > 0.0) {
            let weight = (weight / total) as f32;
            for (o, v) in out.iter_mut().zip(separable(&plane, size, &kernel, &kernel)) {
                o[channel] += weight * v;
            }
        }
    }
    out
}

/// One-dimensional parts of the feature detectors (section 4.2.1).
struct FeatureKernels {
    blur: Vec<f32>,
    edge: Vec<f32>,
    point: Vec<f32>,
}

impl FeatureKernels {
    fn new(ppd: f64) -> Self {
        let deviation = 0.5 * FEATURE_WIDTH * ppd;
        let radius = (3.0 * deviation).ceil() as i64;
        let kernel = |f: &dyn Fn(f64) -> f64| {
            let gauss = |x: f64| (-x * x / (2.0 * deviation * deviation)).exp();
            let values = (-radius..=radius).map(|x| f(x as f64) * gauss(x as f64));
            normalised(values.collect())
        };
        Self {
            blur: kernel(&|_| 1.0),
            edge: kernel(&|x| -x),
            point: kernel(&|x| (x / deviation).powi(2) - 1.0),
        }
    }
}

/// Scaled so that positive values add up to 1 and negative ones to -1.
fn normalised(values: Vec<f64>) -> Vec<f32> {
    let positive: f64 = values.iter().filter(|&&v| v > 0.0).sum();
    let negative: f64 = -values.iter().filter(|&&v| v < 0.0).sum::<f64>();
    let scale = |v: f64| if v > 0.0 { v / positive } else { v / negative.max(f64::MIN_POSITIVE) };
    values.into_iter().map(|v| scale(v) as f32).collect()
}

/// Length of the response to `kernel` along both axes, blurred across.
fn feature_strength(grey: &[f32], size: (usize, usize), blur: &[f32], kernel: &[f32]) -> Vec<f32> {
    let along_x = separable(grey, size, kernel, blur);
    let along_y = separable(grey, size, blur, kernel);
    along_x.into_iter().zip(along_y).map(|(x, y)| x.hypot(y)).collect()
}

/// Convolution (as correlation) with `horizontal` and then `vertical`; edges continue.
fn separable(
    plane: &[f32],
    (width, height): (usize, usize),
    horizontal: &[f32],
    vertical: &[f32],
) -> Vec<f32> {
    let clamped = |i: usize, offset: usize, radius: usize, size: usize| {
        (i + offset).saturating_sub(radius).min(size - 1)
    };
    let mut rows = vec![0.0; plane.len()];
    let radius = horizontal.len() / 2;
    for (row, out) in plane.chunks_exact(width).zip(rows.chunks_exact_mut(width)) {
        for (x, out) in out.iter_mut().enumerate() {
            let at = |k| row[clamped(x, k, radius, width)];
            *out = horizontal.iter().enumerate().map(|(k, w)| w * at(k)).sum();
        }
    }
    let mut out = vec![0.0; plane.len()];
    let radius = vertical.len() / 2;
    for (y, out) in out.chunks_exact_mut(width).enumerate() {
        for (k, w) in vertical.iter().enumerate() {
            let row = &rows[clamped(y, k, radius, height) * width..][..width];
            out.iter_mut().zip(row).for_each(|(o, v)| *o += w * v);
        }
    }
    out
}
