use super::FilterKind;
use crate::math::Vec2;

impl FilterKind {
    /// Half width of the support, pixels.
    pub fn radius(self) -> f32 {
        match self {
            Self::Box { radius } | Self::Tent { radius } => radius,
            Self::Gaussian { stddev } => 4.0 * stddev,
            Self::Mitchell { .. } | Self::CatmullRom => 2.0,
            Self::Lanczos { lobes } => lobes as f32,
        }
    }

    /// The filter at distance `x` pixels from the pixel's centre, along one axis and not
    /// normalised; the filter of a pixel is the product over both axes.
    pub fn eval(self, x: f32) -> f32 {
        let radius = self.radius();
        let x = x.abs();
        if x > radius {
            return 0.0;
        }
        match self {
            Self::Box { .. } => 1.0,
            Self::Tent { .. } => 1.0 - x / radius,
            Self::Gaussian { stddev } => {
                let g = |x: f32| (-0.5 * (x / stddev).powi(2)).exp();
                g(x) - g(radius)
            }
            Self::Mitchell { b, c } => piecewise_cubic(x, b, c),
            Self::CatmullRom => piecewise_cubic(x, 0.0, 0.5),
            Self::Lanczos { lobes } => sinc(x) * sinc(x / lobes as f32),
        }
    }
}

/// Mitchell and Netravali 1988, *Reconstruction filters in computer graphics*, eq. 8; `x ≥ 0`.
fn piecewise_cubic(x: f32, b: f32, c: f32) -> f32 {
    let (p3, p2, p1, p0) = if x < 1.0 {
        (12.0 - 9.0 * b - 6.0 * c, -18.0 + 12.0 * b + 6.0 * c, 0.0, 6.0 - 2.0 * b)
    } else {
        (-b - 6.0 * c, 6.0 * b + 30.0 * c, -12.0 * b - 48.0 * c, 8.0 * b + 24.0 * c)
    };
    (((p3 * x + p2) * x + p1) * x + p0) / 6.0
}

/// sin(πx)/(πx).
fn sinc(x: f32) -> f32 {
    let a = std::f32::consts::PI * x;
    if a.abs() < 1e-4 { 1.0 } else { a.sin() / a }
}

/// Cells of the tabulated inverse distribution of a filter.
const CELLS: usize = 1024;

/// Filter importance sampling: places samples with the density |filter|, so that each pixel is
/// estimated from its own samples alone (Ernst, Stamminger and Greiner 2006). Filters with
/// negative lobes give negative weights.
#[derive(Debug, Clone)]
pub struct FilterSampler {
    kind: FilterKind,
    /// Positions of the CELLS + 1 quantiles of |filter| along one axis; empty for the box.
    quantiles: Vec<f32>,
    /// 1 / (CELLS · ∫ filter): makes the mean weight 1.
    scale: f32,
    radius: f32,
}

impl FilterSampler {
    /// Tabulates the filter.
    pub fn new(kind: FilterKind) -> Self {
        let radius = kind.radius();
        if matches!(kind, FilterKind::Box { .. }) {
            return Self { kind, quantiles: Vec::new(), scale: 1.0, radius };
        }
        const STEPS: usize = 64 * CELLS;
        let width = 2.0 * f64::from(radius) / STEPS as f64;
        let left = |i: usize| i as f64 * width - f64::from(radius);
        let value = |i: usize| f64::from(kind.eval((left(i) + 0.5 * width) as f32)) * width;
        let total: f64 = (0..STEPS).map(value).sum();
        let total_abs: f64 = (0..STEPS).map(|i| value(i).abs()).sum();
        let mut quantiles = Vec::with_capacity(CELLS + 1);
        quantiles.push(-radius);
        let mut below = 0.0;
        for i in 0..STEPS {
            let here = value(i).abs() / total_abs * CELLS as f64;
            while quantiles.len() < CELLS && quantiles.len() as f64 <= below + here {
                let part = (quantiles.len() as f64 - below) / here;
                quantiles.push((left(i) + part * width) as f32);
            }
            below += here;
        }
        quantiles.resize(CELLS + 1, radius);
        Self { kind, quantiles, scale: (CELLS as f64 / total) as f32, radius }
    }

    /// Offset from the pixel's centre, pixels, and the sample's weight (1 on average).
    pub fn sample(&self, u: Vec2) -> (Vec2, f32) {
        if self.quantiles.is_empty() {
            return ((2.0 * u - Vec2::ONE) * self.radius, 1.0);
        }
        let (x, weight_x) = self.sample_axis(u.x);
        let (y, weight_y) = self.sample_axis(u.y);
        (Vec2::new(x, y), weight_x * weight_y)
    }

    fn sample_axis(&self, u: f32) -> (f32, f32) {
        let u = u * CELLS as f32;
        let cell = (u as usize).min(CELLS - 1);
        let (a, b) = (self.quantiles[cell], self.quantiles[cell + 1]);
        let x = a + (b - a) * (u - cell as f32);
        // The density is exactly 1 / (CELLS · (b − a)), which makes the weight exact, too.
        (x, self.kind.eval(x) * (b - a) * self.scale)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [FilterKind; 6] = [
        FilterKind::Box { radius: 0.5 },
        FilterKind::Tent { radius: 1.0 },
        FilterKind::Gaussian { stddev: 0.5 },
        FilterKind::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 },
        FilterKind::CatmullRom,
        FilterKind::Lanczos { lobes: 3 },
    ];

    /// Values of Mitsuba 3.9.1 (`rfilter.eval`), whose Gaussian is a polynomial fit, good to 4e-4.
    #[test]
    fn values_agree_with_mitsuba() {
        let cases = [
            (ALL[1], 0.278_18, 0.721_818),
            (ALL[2], 0.0, 0.999_247),
            (ALL[2], 0.5, 0.606_423),
            (ALL[2], 1.5, 0.010_758),
            (ALL[3], 0.0, 0.888_889),
            (ALL[3], 0.741_82, 0.264_555),
            (ALL[3], 1.483_64, -0.035_335),
            (ALL[4], 0.370_91, 0.732_607),
            (ALL[4], 1.298_18, -0.073_435),
            (ALL[5], 1.390_91, -0.147_015),
            (ALL[5], 2.225_45, 0.028_948),
        ];
        for (filter, x, value) in cases {
            let tolerance = if filter == ALL[2] { 5e-4 } else { 1e-5 };
            assert!(
                (filter.eval(x) - value).abs() < tolerance,
                "{filter:?} at {x}: {}",
                filter.eval(x)
            );
            assert_eq!(filter.eval(x), filter.eval(-x));
            assert_eq!(filter.eval(filter.radius() * 1.001), 0.0);
        }
    }

    /// ∫ x²·f / ∫ f along one axis by quadrature and by samples: the samples follow the filter.
    #[test]
    fn samples_follow_the_filter() {
        for filter in ALL {
            let sampler = FilterSampler::new(filter);
            let n = 200_000;
            let (mut weight, mut second, mut fourth) = (0.0, 0.0, 0.0);
            let (mut area, mut area_second, mut area_fourth) = (0.0, 0.0, 0.0);
            for i in 0..n {
                let u = (i as f32 + 0.5) / n as f32;
                let (p, w) = sampler.sample(Vec2::new(u, 0.5));
                let (_, w0) = sampler.sample(Vec2::new(0.5, 0.5));
                // The weight along y is common to all of them.
                let w = f64::from(w / w0.sqrt());
                let x = f64::from(p.x);
                weight += w;
                second += w * x * x;
                fourth += w * x.powi(4);
                let x = f64::from((2.0 * u - 1.0) * filter.radius());
                let f = f64::from(filter.eval(x as f32));
                area += f;
                area_second += f * x * x;
                area_fourth += f * x.powi(4);
            }
            let n = f64::from(n);
            assert!((weight / n - 1.0).abs() < 1e-3, "{filter:?}: mean weight {}", weight / n);
            assert!((second / weight - area_second / area).abs() < 1e-3, "{filter:?}");
            assert!((fourth / weight - area_fourth / area).abs() < 2e-3, "{filter:?}");
        }
    }

    /// The density is close to |filter|: along one axis no weight is far from ±∫|f|/∫f. The last
    /// cells of filters that end like a parabola have 3 times their mean.
    #[test]
    fn weights_are_bounded() {
        for filter in &ALL[1..] {
            let sampler = FilterSampler::new(*filter);
            for i in 0..10_000 {
                let (x, w) = sampler.sample_axis((i as f32 + 0.5) / 10_000.0);
                assert!(w.abs() < 4.0 && x.abs() <= filter.radius(), "{filter:?}: {w} at {x}");
            }
        }
    }
}
