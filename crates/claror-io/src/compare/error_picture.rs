//! Pictures of the difference, in false colours.

use claror::image::Image;
use claror::spectrum::Rgb;

use super::{CompareError, check_sizes, colors};
use crate::image::srgb_to_linear;

/// What an error picture shows, per pixel as the mean over the channels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ErrorMeasure {
    /// |x - r| / (|r| + 0.01), from black over purple and orange to pale yellow at `scale`.
    #[default]
    Relative,
    /// |x - r|, in the same colours.
    Absolute,
    /// x - r: red where the picture is too bright, blue where too dark, full at `scale`.
    Signed,
}

/// The error as a linear RGB picture; `scale` is the error at the end of the colours. Pixels that
/// are not finite in either picture are green, which the colours do not contain.
pub fn error_picture(
    picture: &Image,
    reference: &Image,
    measure: ErrorMeasure,
    scale: f32,
) -> Result<Image, CompareError> {
    check_sizes(picture, reference)?;
    let mut out = Image::new(picture.width, picture.height, 3);
    let pairs = colors(picture).zip(colors(reference));
    for ((x, r), out) in pairs.zip(out.data.chunks_exact_mut(3)) {
        let color = if x.is_finite() && r.is_finite() {
            false_color(x, r, measure, scale)
        } else {
            Rgb::new(0.0, 1.0, 0.0)
        };
        out.copy_from_slice(&color.to_array());
    }
    Ok(out)
}

fn false_color(x: Rgb, r: Rgb, measure: ErrorMeasure, scale: f32) -> Rgb {
    let error = x - r;
    match measure {
        ErrorMeasure::Absolute => magma(error.map(f32::abs).mean() / scale),
        ErrorMeasure::Relative => {
            let relative = |e: f32, r: f32| e.abs() / (r.abs() + 0.01);
            let relative =
                Rgb::new(relative(error.r, r.r), relative(error.g, r.g), relative(error.b, r.b));
            magma(relative.mean() / scale)
        }
        ErrorMeasure::Signed => {
            let t = (error.mean() / scale).clamp(-1.0, 1.0);
            Rgb::new(t.max(0.0), 0.0, (-t).max(0.0))
        }
    }
}

/// The colour map "magma" (van der Walt and Smith 2015), linear sRGB, at `t` in [0, 1]: ten of its
/// colours, straight lines between them.
pub fn magma(t: f32) -> Rgb {
    const COLORS: [u32; 10] = [
        0x00_00_04, 0x18_0f_3d, 0x44_0f_76, 0x72_1f_81, 0x9e_2f_7f, 0xcd_40_71, 0xf1_60_5d,
        0xfd_96_68, 0xfe_ca_8d, 0xfc_fd_bf,
    ];
    let t = if t > 0.0 { t.min(1.0) } else { 0.0 } * (COLORS.len() - 1) as f32;
    let i = (t as usize).min(COLORS.len() - 2);
    let channel = |shift: u32| {
        let [a, b] = [COLORS[i], COLORS[i + 1]].map(|c| (c >> shift & 0xff) as f32 / 255.0);
        srgb_to_linear(a + (t - i as f32) * (b - a))
    };
    Rgb::new(channel(16), channel(8), channel(0))
}
