//! A picture of where the checks were and what they found.

use claror::film::Picture;
use claror::image::Image;
use claror::spectrum::Rgb;
use claror::verify::PictureReport;

/// Grey of the picture's mean, and the brightest grey: dots stand out against it.
const MEAN_GREY: f64 = 0.12;
const BRIGHTEST: f64 = 0.4;
/// Pixels of the picture's shorter side per pixel of a dot's radius.
const PIXELS_PER_RADIUS: usize = 150;

const NOTHING_SURE: Rgb = Rgb::new(0.25, 0.3, 0.25);
const PALE: f64 = 0.25;

/// The render in grey with a dot per check: red where the picture is surely too bright, blue
/// where it is surely too dark, in full colour from the tolerance on; greenish where the checks
/// leave room for no error at all.
pub(crate) fn draw(picture: &Picture, report: &PictureReport) -> Image {
    let beauty = &picture.beauty.image;
    let mut image = Image::new(beauty.width, beauty.height, 3);
    let scale = MEAN_GREY / report.mean[3].max(1e-30);
    let pixels = beauty.data.chunks_exact(beauty.channels);
    for (grey, pixel) in image.data.chunks_exact_mut(3).zip(pixels) {
        let luminance = Rgb::new(pixel[0], pixel[1], pixel[2]).luminance();
        grey.fill((f64::from(luminance) * scale).clamp(0.0, BRIGHTEST) as f32);
    }
    let mut dots: Vec<((u32, u32), f64)> = report
        .checks
        .iter()
        .map(|check| (check.pixel, report.sure_error(check) / report.tolerance))
        .collect();
    // The worst on top.
    dots.sort_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    let radius = beauty.width.min(beauty.height) / PIXELS_PER_RADIUS;
    for (pixel, error) in dots {
        dot(&mut image, pixel, radius, colour(error));
    }
    image
}

/// From a pale to a full colour.
fn colour(error: f64) -> Rgb {
    if error == 0.0 {
        return NOTHING_SURE;
    }
    let pale = (PALE * (1.0 - error.abs())).max(0.0) as f32;
    if error > 0.0 { Rgb::new(1.0, pale, pale) } else { Rgb::new(pale, pale, 1.0) }
}

fn dot(image: &mut Image, (x, y): (u32, u32), radius: usize, colour: Rgb) {
    let (x, y) = (x as usize, y as usize);
    let near = |at: usize, size: usize| at.saturating_sub(radius)..(at + radius + 1).min(size);
    for row in near(y, image.height) {
        for column in near(x, image.width) {
            let (dx, dy) = (column.abs_diff(x), row.abs_diff(y));
            if dx * dx + dy * dy <= radius * radius {
                let at = 3 * (row * image.width + column);
                image.data[at..at + 3].copy_from_slice(&colour.to_array());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_tell_the_sign() {
        assert_eq!(colour(0.0), NOTHING_SURE);
        assert_eq!(colour(2.0), Rgb::new(1.0, 0.0, 0.0));
        assert_eq!(colour(-1.0), Rgb::new(0.0, 0.0, 1.0));
        assert!(colour(0.1).g > 0.2 && colour(-0.1).b == 1.0);
    }

    #[test]
    fn dots_are_cut_at_the_edges() {
        let mut image = Image::new(4, 3, 3);
        dot(&mut image, (0, 2), 1, Rgb::WHITE);
        let lit: Vec<usize> = (0..12).filter(|i| image.data[3 * i] == 1.0).collect();
        assert_eq!(lit, [4, 8, 9]);
    }
}
