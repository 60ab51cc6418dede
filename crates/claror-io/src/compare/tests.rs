//! Tests of the measures on small pictures.

use claror::image::Image;

use super::*;

const WIDTH: usize = 64;
const HEIGHT: usize = 48;

/// Of the changed stripes, and of them upside down.
const SSIM: [f64; 2] = [0.938_178_186, -0.325_219_978];

fn picture(f: impl Fn(usize, usize, usize) -> f32) -> Image {
    let mut image = Image::new(WIDTH, HEIGHT, 3);
    for (i, v) in image.data.iter_mut().enumerate() {
        *v = f(i / 3 % WIDTH, i / 3 / WIDTH, i % 3).clamp(0.0, 1.0);
    }
    image
}

/// Stripes in a checkerboard, and the same partly darker and with bright dots.
fn stripes() -> (Image, Image) {
    let reference = |x: usize, y: usize, c: usize| {
        let stripe = ((x * 3 + y * 2 + c * 11) % 64) as f32 / 63.0;
        stripe * if (x / 16 + y / 12) % 2 == 1 { 1.0 } else { 0.3 }
    };
    let changed = |x: usize, y: usize, c: usize| {
        let dot = if (x * x + y * 7 + c).is_multiple_of(23) { 0.2 } else { 0.0 };
        reference(x, y, c) * if x < 32 { 1.0 } else { 0.9 } + dot
    };
    (picture(changed), picture(reference))
}

/// Values of the authors' program (flip-evaluator 1.7, LDR, linear input) for [`stripes`].
#[test]
fn flip_agrees_with_the_authors_program() {
    let (changed, reference) = stripes();
    let near = FlipOptions { pixels_per_degree: 30.0, ..FlipOptions::default() };
    let cases = [
        (
            FlipOptions::default(),
            0.133_349_88,
            [0.367_027_6, 0.046_591_3, 0.200_748_9, 0.142_075_2],
        ),
        (near, 0.155_931_32, [0.495_248_6, 0.046_019_2, 0.178_173_1, 0.132_265_2]),
    ];
    for (options, mean, pixels) in cases {
        let result = flip(&changed, &reference, &options).unwrap();
        assert!((result.mean - mean).abs() < 1e-4, "{} is not {mean}", result.mean);
        let places = [(0, 0), (20, 10), (40, 24), (63, 47)];
        for ((x, y), wanted) in places.into_iter().zip(pixels) {
            let got = result.map.pixel(x, y)[0];
            assert!((got - wanted).abs() < 1e-4, "{got} is not {wanted} at ({x}, {y})");
        }
    }
}

#[test]
fn flip_of_equal_pictures_is_zero_and_of_opposites_one() {
    let (changed, _) = stripes();
    assert_eq!(flip(&changed, &changed, &FlipOptions::default()).unwrap().mean, 0.0);
    let green = picture(|_, _, c| if c == 1 { 1.0 } else { 0.0 });
    let blue = picture(|_, _, c| if c == 2 { 1.0 } else { 0.0 });
    // The paper scales by this pair, the most distant colours of sRGB.
    let mean = flip(&green, &blue, &FlipOptions::default()).unwrap().mean;
    assert!((mean - 1.0).abs() < 1e-4, "{mean}");
}

#[test]
fn flip_exposure_and_tone_map_act_on_linear_colours() {
    let (changed, reference) = stripes();
    let half = |image: &Image| Image {
        data: image.data.iter().map(|v| v / 2.0).collect(),
        ..image.clone()
    };
    let options = FlipOptions { exposure: 1.0, ..FlipOptions::default() };
    let brightened = flip(&half(&changed), &half(&reference), &options).unwrap();
    let plain = flip(&changed, &reference, &FlipOptions::default()).unwrap();
    assert_eq!(brightened, plain);
    let options = FlipOptions { tone_map: ToneMap::Reinhard, ..FlipOptions::default() };
    let bright = |v: f32| vec![v; changed.data.len()];
    let [five, nine] = [5.0, 9.0].map(|v| Image { data: bright(v), ..changed.clone() });
    // Both are white without, 5/6 and 9/10 with the tone map.
    assert_eq!(flip(&five, &nine, &FlipOptions::default()).unwrap().mean, 0.0);
    assert!(flip(&five, &nine, &options).unwrap().mean > 0.01);
}

/// Values of scikit-image 0.26 (`structural_similarity` with Gaussian weights of deviation 1.5 and
/// the population's covariance), applied to the encoded luminance of [`stripes`].
#[test]
fn ssim_agrees_with_another_program() {
    let (changed, reference) = stripes();
    let flipped = picture(|x, y, c| changed.pixel(x, HEIGHT - 1 - y)[c]);
    for (image, wanted) in [(changed, SSIM[0]), (flipped, SSIM[1])] {
        let got = ssim(&image, &reference).unwrap();
        assert!((got - wanted).abs() < 1e-5, "{got} is not {wanted}");
    }
}

#[test]
fn ssim_of_flat_pictures_compares_their_means() {
    let flat = |v: f32| picture(|_, _, _| crate::image::srgb_to_linear(v));
    let (a, b) = (0.25_f64, 0.75);
    let wanted = (2.0 * a * b + 1e-4) / (a * a + b * b + 1e-4);
    let got = ssim(&flat(0.25), &flat(0.75)).unwrap();
    // Grey is a weighted sum whose weights are rounded, and sRGB is kept in 32 bits.
    assert!((got - wanted).abs() < 1e-5, "{got} is not {wanted}");
    let (changed, _) = stripes();
    assert_eq!(ssim(&changed, &changed), Ok(1.0));
    // Smaller than a window.
    let dot = Image { width: 1, height: 1, channels: 1, data: vec![1.0] };
    assert_eq!(ssim(&dot, &dot), Ok(1.0));
    let infinite = Image { data: vec![f32::INFINITY], ..dot.clone() };
    assert!(ssim(&infinite, &dot).unwrap() < 0.01);
}

#[test]
fn halves_measure_without_their_own_noise() {
    let grey = |data: Vec<f32>| Image { width: data.len(), height: 1, channels: 1, data };
    let (x, a, b) = (grey(vec![1.5, 2.0]), grey(vec![0.5, 2.5]), grey(vec![1.5, 1.5]));
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} is not {b}");
    // (1.5 - 0.5)(1.5 - 1.5) and (2 - 2.5)(2 - 1.5), over r² = 1 and 4.
    let found = rel_mse_from_halves(&x, [&a, &b]).unwrap();
    near(found, -0.25 / (4.0 + 0.01) / 2.0);
    near(rel_mse_of_halves([&a, &b]).unwrap(), (0.25 / 1.01 + 0.25 / 4.01) / 2.0);
    assert_eq!(mean_of_halves([&a, &b]).unwrap().data, [1.0, 1.0, 1.0, 2.0, 2.0, 2.0]);
    // Equal halves: the plain measure.
    near(rel_mse_from_halves(&x, [&a, &a]).unwrap(), metrics(&x, &a).unwrap().rel_mse);
    let holes = grey(vec![f32::NAN, 2.0]);
    near(rel_mse_from_halves(&holes, [&a, &b]).unwrap(), -0.25 / 4.01);
}

#[test]
fn metrics_by_hand() {
    let x = Image { width: 2, height: 1, channels: 3, data: vec![1.0, 2.0, 0.0, 3.0, 2.0, 0.5] };
    let r = Image { width: 2, height: 1, channels: 3, data: vec![2.0, 2.0, 0.0, 2.0, 2.0, 0.0] };
    let m = metrics(&x, &r).unwrap();
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} is not {b}");
    near(m.mse, (1.0 + 1.0 + 0.25) / 6.0);
    near(m.rel_mse, (2.0 / 4.01 + 0.25 / 0.01) / 6.0);
    near(m.rel_mse_trimmed, (1.0 / 4.01) / 3.0);
    near(m.mape, (2.0 / 2.01 + 0.5 / 0.01) / 6.0);
    near(m.mean_error, 0.5 / 6.0);
    near(m.max_error, 1.0);
    assert_eq!(m.channel_ratio, [1.0, 1.0, f64::INFINITY]);
    assert_eq!((m.pixels, m.non_finite, m.non_finite_reference), (2, 0, 0));
}

#[test]
fn pixels_that_are_not_finite_are_counted_and_left_out() {
    let (mut x, r) = stripes();
    let clean = metrics(&x, &x).unwrap();
    assert_eq!((clean.mse, clean.channel_ratio), (0.0, [1.0; 3]));
    let before = metrics(&r, &r).unwrap();
    x.data.copy_from_slice(&r.data);
    x.data[4] = f32::NAN;
    x.data[5] = f32::INFINITY;
    let mut reference = r.clone();
    reference.data[3001] = f32::NEG_INFINITY;
    let m = metrics(&x, &reference).unwrap();
    assert_eq!((m.non_finite, m.non_finite_reference), (1, 1));
    assert_eq!((m.mse, m.mean_error, m.mape), (before.mse, 0.0, 0.0));
    assert!(flip(&x, &reference, &FlipOptions::default()).unwrap().mean.is_finite());
}

#[test]
fn grey_compares_with_colour_and_other_sizes_are_refused() {
    let grey = Image { width: 1, height: 2, channels: 1, data: vec![0.25, 0.5] };
    let colour = Image {
        width: 1,
        height: 2,
        channels: 4,
        data: vec![0.25, 0.25, 0.25, 1.0, 0.5, 0.5, 0.5, 0.0],
    };
    assert_eq!(metrics(&grey, &colour).unwrap().max_error, 0.0);
    let wide = Image { width: 2, height: 1, ..grey.clone() };
    let error = metrics(&grey, &wide).unwrap_err();
    assert_eq!(error.to_string(), "the sizes differ: 1 × 2 and 2 × 1 pixels");
    assert_eq!(flip(&grey, &wide, &FlipOptions::default()), Err(error));
    let empty = Image::new(0, 3, 3);
    assert_eq!(metrics(&empty, &empty), Err(CompareError::Empty));
}

#[test]
fn error_pictures_show_size_and_sign() {
    let r = Image { width: 4, height: 1, channels: 1, data: vec![1.0, 1.0, 1.0, 1.0] };
    let x = Image { width: 4, height: 1, channels: 1, data: vec![1.0, 1.5, 0.5, f32::NAN] };
    let signed = error_picture(&x, &r, ErrorMeasure::Signed, 0.5).unwrap();
    let expected = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0];
    assert_eq!(signed.data, expected);
    let absolute = error_picture(&x, &r, ErrorMeasure::Absolute, 0.5).unwrap();
    assert_eq!(absolute.pixel(0, 0), magma(0.0).to_array());
    assert_eq!(absolute.pixel(1, 0), magma(1.0).to_array());
    assert_eq!(absolute.pixel(1, 0), absolute.pixel(2, 0));
    let relative = error_picture(&x, &r, ErrorMeasure::Relative, 1.0).unwrap();
    assert_eq!(relative.pixel(1, 0), magma(0.5 / 1.01).to_array());
    assert_eq!(magma(f32::NAN), magma(0.0));
    assert!(magma(0.2).luminance() < magma(0.8).luminance());
}
