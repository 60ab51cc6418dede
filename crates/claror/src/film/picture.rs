use super::{Film, LAYER_NAMES};
use crate::image::Image;
use crate::integrator::Aov;

/// A named picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Name; empty for the beauty.
    pub name: String,
    /// Suffixes of the channels.
    pub channels: Vec<&'static str>,
    /// The samples.
    pub image: Image,
}

/// What a film becomes.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// The picture proper: R, G, B, and alpha where the film has one.
    pub beauty: Layer,
    /// Emission, direct, indirect, rest: sum to the beauty bit for bit when added in this order
    /// in `f32`.
    pub parts: Vec<Layer>,
    /// The further layers that were asked for.
    pub aovs: Vec<Layer>,
    /// Variance of the beauty if samples were independent (R, G, B); infinite where there are
    /// less than two samples.
    pub variance: Layer,
    /// Samples per pixel.
    pub samples: Layer,
}

impl Layer {
    fn new(name: &str, channels: &[&'static str], film: &Film) -> Self {
        let (width, height) = (film.crop.width as usize, film.crop.height as usize);
        let image = Image::new(width, height, channels.len());
        Self { name: name.to_owned(), channels: channels.to_vec(), image }
    }

    fn set(&mut self, x: usize, y: usize, values: &[f32]) {
        let n = self.image.channels;
        let i = (y * self.image.width + x) * n;
        self.image.data[i..i + n].copy_from_slice(values);
    }
}

impl Picture {
    /// Divides the sums of the film.
    pub fn new(film: &Film, alpha: bool, aovs: &[Aov]) -> Self {
        const RGB: [&str; 4] = ["R", "G", "B", "A"];
        let channels = if alpha { 4 } else { 3 };
        let mut picture = Self {
            beauty: Layer::new("", &RGB[..channels], film),
            parts: LAYER_NAMES.map(|name| Layer::new(name, &RGB[..3], film)).to_vec(),
            aovs: aovs.iter().map(|a| Layer::new(&a.name, a.kind.channels(), film)).collect(),
            variance: Layer::new("variance", &RGB[..3], film),
            samples: Layer::new("samples", &["N"], film),
        };
        film.for_each_pixel(|x, y, pixel, sums| {
            let beauty = pixel.beauty().to_array();
            let beauty = [beauty[0], beauty[1], beauty[2], pixel.alpha()];
            picture.beauty.set(x, y, &beauty[..channels]);
            for (i, part) in picture.parts.iter_mut().enumerate() {
                part.set(x, y, &pixel.layer(i).to_array());
            }
            picture.variance.set(x, y, &pixel.variance().to_array());
            picture.samples.set(x, y, &[pixel.count as f32]);
            let scale = if pixel.count == 0 { 0.0 } else { 1.0 / pixel.normaliser() };
            let mut sums = sums.iter();
            for (layer, aov) in picture.aovs.iter_mut().zip(aovs) {
                let scale = if aov.kind.is_index() { 1.0 } else { scale };
                let n = layer.image.channels;
                let mut values = [0.0; 3];
                for (value, sum) in values[..n].iter_mut().zip(&mut sums) {
                    *value = (sum * scale) as f32;
                }
                layer.set(x, y, &values[..n]);
            }
        });
        picture
    }
}
