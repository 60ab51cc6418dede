use super::*;
use crate::integrator::LayeredRadiance;
use crate::spectrum::Rgb;

fn sample(i: u32) -> LayeredRadiance {
    let v = |k: u32| (i.wrapping_mul(2_654_435_761).wrapping_add(k) >> 20) as f32 / 999.0;
    LayeredRadiance {
        emission: Rgb::new(v(1), v(77), v(5)),
        direct: Rgb::splat(v(1_000_000)),
        indirect: Rgb::splat(v(3_000_000)),
        rest: Rgb::new(0.1, v(9), 1e-3),
        alpha: 1.0,
        ..Default::default()
    }
}

#[test]
fn layers_sum_to_the_beauty_bit_for_bit() {
    let mut pixel = PixelSums::default();
    for i in 0..1000 {
        pixel.add(&sample(i), if i % 9 == 0 { -0.7 } else { 1.2 });
        let [e, d, n, r] = [0, 1, 2, 3].map(|l| pixel.layer(l));
        assert_eq!(pixel.beauty(), ((e + d) + n) + r);
    }
}

/// A constant scene stays constant under every filter, also where weights are negative.
#[test]
fn constants_stay_constant() {
    let constant = LayeredRadiance { emission: Rgb::splat(3.0), alpha: 1.0, ..Default::default() };
    for kind in [FilterKind::CatmullRom, FilterKind::Gaussian { stddev: 0.5 }] {
        let filter = FilterSampler::new(kind);
        let mut pixel = PixelSums::default();
        for i in 0..64_u16 {
            let u = f32::from(i.reverse_bits() >> 10) / 64.0;
            pixel.add(&constant, filter.sample((u, f32::from(i) / 64.0).into()).1);
        }
        assert!((pixel.beauty().g - 3.0).abs() < 1e-6 && (pixel.alpha() - 1.0).abs() < 1e-6);
    }
}

/// Weights that cancel do not blow up.
#[test]
fn cancelling_weights_are_harmless() {
    let mut pixel = PixelSums::default();
    pixel.add(&sample(1), 1.0);
    pixel.add(&sample(2), -1.0);
    assert!(pixel.beauty().is_finite() && pixel.beauty().max_component() < 10.0);
}

/// The variance is the textbook one of the mean: values 0 and 2 in turn have a mean of 1 with a
/// variance of 1/(n − 1).
#[test]
fn variance_is_of_the_mean() {
    let mut pixel = PixelSums::default();
    for i in 0..100 {
        let emission = Rgb::splat(if i % 2 == 0 { 0.0 } else { 2.0 });
        pixel.add(&LayeredRadiance { emission, ..Default::default() }, 1.0);
    }
    assert!((pixel.variance().r - 1.0 / 99.0).abs() < 1e-8);
    assert_eq!(PixelSums::default().variance(), Rgb::splat(f32::INFINITY));
}

/// For independent samples the squared error from two parts has the right expectation, at powers
/// of two and between: variance 1/12 of a uniform number over n. 20 000 pixels: the relative
/// standard error is √2/√20000 = 1 %; 4.5 of these.
#[test]
fn squared_error_is_calibrated() {
    use crate::sampler::{Sampler, SamplerKind, SamplerSettings};
    let streams = SamplerSettings { kind: SamplerKind::Independent, sample_count: 1, seed: 3 };
    for n in [2_u32, 3, 5, 16, 24] {
        let mut sum = 0.0;
        for x in 0..20_000 {
            let mut pixel = PixelSums::default();
            for i in 0..n {
                let emission = Rgb::splat(Sampler::new(&streams, (x, n), i).next_1d());
                pixel.add(&LayeredRadiance { emission, ..Default::default() }, 1.0);
            }
            sum += pixel.squared_error()[0];
        }
        let ratio = sum / 20_000.0 * 12.0 * f64::from(n);
        assert!((ratio - 1.0).abs() < 0.045, "{n} samples: {ratio}");
    }
}

#[test]
fn tiles_cover_the_crop_once() {
    let crop = CropWindow { x: 5, y: 7, width: 37, height: 18 };
    let film = Film::new(crop, 2);
    let mut seen = vec![0; 37 * 18];
    film.for_each_pixel(|x, y, _, aovs| {
        seen[y * 37 + x] += 1;
        assert_eq!(aovs.len(), 2);
    });
    assert!(seen.iter().all(|&n| n == 1));
    assert!(film.tiles.iter().all(|t| t.window.x >= 5 && t.window.x + t.window.width <= 42));
}

#[test]
fn the_first_non_finite_sample_is_in_reading_order() {
    let mut a = NonFinite::default();
    a.note((3, 1, 0));
    a.note((2, 9, 5));
    let mut b = NonFinite::default();
    b.note((2, 9, 4));
    assert_eq!(a.merged(b), NonFinite { count: 3, first: Some((2, 9, 4)) });
    assert_eq!(NonFinite::default().merged(a), a);
}
