use super::*;

const SOBOL: SamplerSettings =
    SamplerSettings { kind: SamplerKind::Sobol, sample_count: 64, seed: 7 };
const INDEPENDENT: SamplerSettings =
    SamplerSettings { kind: SamplerKind::Independent, sample_count: 64, seed: 7 };

/// Dimension `d` of the first `n` samples of `pixel`.
fn points(settings: &SamplerSettings, pixel: (u32, u32), d: u32, n: u32) -> Vec<Vec2> {
    let at = |i| {
        let mut s = Sampler::new(settings, pixel, i);
        s.set_dimension(d);
        s.next_2d()
    };
    (0..n).map(at).collect()
}

/// True when each of the 2^a × 2^b cells of equal size holds exactly one of the 2^(a+b) points.
fn fills_cells(points: &[Vec2], a: u32, b: u32) -> bool {
    let mut seen = vec![false; points.len()];
    for p in points {
        let i = (p.x * f32::from(1_u16 << a)) as usize;
        let j = (p.y * f32::from(1_u16 << b)) as usize;
        seen[(i << b) | j] = true;
    }
    seen.iter().all(|&s| s)
}

/// The first 2^k points, and each later block of as many, are a (0, k, 2)-net in base 2.
#[test]
fn every_block_is_a_net() {
    for d in [0, 1, 5, 40] {
        for pixel in [(0, 0), (3, 500)] {
            let all = points(&SOBOL, pixel, d, 1024);
            for k in 0..=10_u32 {
                for block in all.chunks(1 << k) {
                    for a in 0..=k {
                        assert!(fills_cells(block, a, k - a), "dimension {d}, 2^{k} points");
                    }
                }
            }
        }
    }
}

#[test]
fn one_dimension_is_stratified() {
    for k in 0..=8_u32 {
        let mut seen = vec![false; 1 << k];
        for i in 0..1 << k {
            let mut s = Sampler::new(&SOBOL, (9, 2), i);
            s.set_dimension(3);
            seen[(s.next_1d() * (1 << k) as f32) as usize] = true;
        }
        assert!(seen.iter().all(|&s| s));
    }
}

/// Chi-square statistic of values in [0, 1) over equal bins.
fn chi_square(values: impl Iterator<Item = f32>, bins: usize) -> f64 {
    let mut counts = vec![0_u32; bins];
    for v in values {
        counts[(v * bins as f32) as usize] += 1;
    }
    let n: u32 = counts.iter().sum();
    let expected = f64::from(n) / bins as f64;
    counts.iter().map(|&c| (f64::from(c) - expected).powi(2) / expected).sum()
}

/// For one sample index over many pixels the values are independent uniform numbers. 255 degrees
/// of freedom: the statistic exceeds 347 with probability 1e-4 (12 statistics here, fixed seed).
#[test]
fn values_over_pixels_are_uniform() {
    for settings in [SOBOL, INDEPENDENT] {
        for index in [0, 1, 37] {
            let over_pixels = |axis: usize| {
                (0..40_000_u32).map(move |i| {
                    let mut s = Sampler::new(&settings, (i % 200, i / 200), index);
                    s.set_dimension(2);
                    s.next_2d()[axis]
                })
            };
            for axis in 0..2 {
                let x2 = chi_square(over_pixels(axis), 256);
                assert!(x2 < 347.0, "{settings:?}, sample {index}, axis {axis}: {x2}");
            }
        }
    }
}

/// Correlation coefficient.
fn correlation(pairs: &[(f32, f32)]) -> f64 {
    let n = pairs.len() as f64;
    let mean = |f: fn(&(f32, f32)) -> f32| pairs.iter().map(|p| f64::from(f(p))).sum::<f64>() / n;
    let (mx, my) = (mean(|p| p.0), mean(|p| p.1));
    let mut sums = [0.0; 3];
    for &(x, y) in pairs {
        let (x, y) = (f64::from(x) - mx, f64::from(y) - my);
        sums[0] += x * x;
        sums[1] += y * y;
        sums[2] += x * y;
    }
    sums[2] / (sums[0] * sums[1]).sqrt()
}

/// Different dimensions of a sample, and the same dimension of neighbouring pixels and of
/// following samples and seeds, are uncorrelated: |r| √n < 4.5 (probability 7e-6 each, fixed
/// seed, some 150 pairs).
#[test]
fn dimensions_pixels_and_seeds_are_uncorrelated() {
    let n = 40_000_u32;
    let limit = 4.5 / f64::from(n).sqrt();
    let value = |settings: &SamplerSettings, i: u32, sample, d: u32| {
        let mut s = Sampler::new(settings, (i % 200, i / 200), sample);
        s.set_dimension(d / 2);
        s.next_2d()[d as usize % 2]
    };
    for settings in [SOBOL, INDEPENDENT] {
        let other_seed = SamplerSettings { seed: 8, ..settings };
        for a in 0..10 {
            for b in 0..a {
                let pairs: Vec<_> = (0..n)
                    .map(|i| (value(&settings, i, 5, a), value(&settings, i, 5, b)))
                    .collect();
                assert!(correlation(&pairs).abs() < limit, "dimensions {a}, {b}");
            }
            let pixels: Vec<_> = (0..n)
                .map(|i| (value(&settings, i, 5, a), value(&settings, i + 1, 5, a)))
                .collect();
            assert!(correlation(&pixels).abs() < limit, "neighbours, dimension {a}");
            let seeds: Vec<_> =
                (0..n).map(|i| (value(&settings, i, 5, a), value(&other_seed, i, 5, a))).collect();
            assert!(correlation(&seeds).abs() < limit, "seeds, dimension {a}");
        }
    }
}

/// Padding must not align blocks: over the samples of one pixel, pairs made of two different
/// blocks fill the square like independent points. 63 degrees of freedom, stratified marginals
/// only lower the statistic; it exceeds 120 with probability 1e-5.
#[test]
fn blocks_of_one_pixel_are_independent() {
    for (d, e) in [(0, 1), (1, 2), (2, 7), (3, 4)] {
        let a = points(&SOBOL, (11, 13), d, 4096);
        let b = points(&SOBOL, (11, 13), e, 4096);
        for (x, y) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let cells = a.iter().zip(&b).map(|(p, q)| {
                let (i, j) = ((p[x] * 8.0).floor(), (q[y] * 8.0).floor());
                (i * 8.0 + j + 0.5) / 64.0
            });
            let x2 = chi_square(cells, 64);
            assert!(x2 < 120.0, "blocks {d}, {e}: {x2}");
        }
    }
}

/// Stratification is what it is for: the error of a smooth integral falls much faster than with
/// independent samples (variance ratio over 200 pixels at 256 samples; a factor of 100 is far
/// below what (0, m, 2)-nets give and far above chance).
#[test]
fn sobol_integrates_better_than_independent() {
    let variance = |settings: &SamplerSettings| {
        let mut sum = 0.0;
        for pixel in 0..200 {
            let p = points(settings, (pixel, 0), 4, 256);
            let mean = p.iter().map(|p| f64::from(p.x * p.x * p.y)).sum::<f64>() / 256.0;
            sum += (mean - 1.0 / 6.0).powi(2);
        }
        sum / 200.0
    };
    let ratio = variance(&INDEPENDENT) / variance(&SOBOL);
    assert!(ratio > 100.0, "ratio {ratio}");
}

#[test]
fn streams_are_pure_functions_of_their_key() {
    for settings in [SOBOL, INDEPENDENT] {
        let mut a = Sampler::new(&settings, (4, 5), 6);
        let (first, second, third) = (a.next_2d(), a.next_1d(), a.next_2d());
        let mut b = Sampler::new(&settings, (4, 5), 6);
        b.set_dimension(2);
        assert_eq!(b.next_2d(), third);
        b.set_dimension(0);
        assert_eq!(b.next_2d(), first);
        assert_eq!(b.next_1d(), second);
    }
}

/// Streams from a table are the streams, inside and outside of its range.
#[test]
fn tables_change_nothing() {
    for settings in [SOBOL, INDEPENDENT] {
        let table = SamplerTable::new(&settings, 8, 12);
        for index in [7, 8, 11, 12, 500] {
            let mut a = Sampler::new(&settings, (3, 1), index);
            let mut b = table.sampler((3, 1), index);
            for _ in 0..40 {
                assert_eq!(a.next_2d(), b.next_2d());
                assert_eq!(a.next_1d(), b.next_1d());
            }
        }
    }
}
