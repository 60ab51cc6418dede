use rayon::prelude::*;

use super::{Film, LAYER_NAMES, LAYERS, PixelSums, TILE_SIZE, Tile};
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

    /// The samples of each row of tiles.
    fn tile_rows(&mut self) -> impl Iterator<Item = &mut [f32]> {
        let row = self.image.width * self.image.channels * TILE_SIZE as usize;
        self.image.data.chunks_mut(row)
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
        let layers = std::iter::once(&mut picture.beauty)
            .chain(&mut picture.parts)
            .chain([&mut picture.variance, &mut picture.samples])
            .chain(&mut picture.aovs);
        // Per row of tiles, the part of every layer that belongs to it.
        let per_row = film.crop.width.div_ceil(TILE_SIZE) as usize;
        let mut rows: Vec<(&[Tile], Vec<&mut [f32]>)> =
            film.tiles.chunks(per_row).map(|tiles| (tiles, Vec::new())).collect();
        for layer in layers {
            for (row, samples) in rows.iter_mut().zip(layer.tile_rows()) {
                row.1.push(samples);
            }
        }
        let width = film.crop.width as usize;
        rows.par_iter_mut().for_each(|(tiles, layers)| {
            let mut values = Vec::new();
            for tile in *tiles {
                let w = tile.window;
                for (i, pixel) in tile.pixels.iter().enumerate() {
                    let sums = &tile.aovs[i * film.aov_channels..(i + 1) * film.aov_channels];
                    let x = (w.x - film.crop.x) as usize + i % w.width as usize;
                    let at = i / w.width as usize * width + x;
                    values.clear();
                    pixel_values(pixel, alpha, aovs, sums, &mut values);
                    let mut values = values.as_slice();
                    for samples in layers.iter_mut() {
                        let n = samples.len() / (w.height as usize * width);
                        let (mine, rest) = values.split_at(n);
                        samples[at * n..(at + 1) * n].copy_from_slice(mine);
                        values = rest;
                    }
                }
            }
        });
        picture
    }
}

/// The values of all layers at one pixel: beauty, parts, variance, samples, further layers.
fn pixel_values(pixel: &PixelSums, alpha: bool, aovs: &[Aov], sums: &[f64], values: &mut Vec<f32>) {
    values.extend(pixel.beauty().to_array());
    values.extend(alpha.then(|| pixel.alpha()));
    for i in 0..LAYERS {
        values.extend(pixel.layer(i).to_array());
    }
    values.extend(pixel.variance().to_array());
    values.push(pixel.count as f32);
    let scale = if pixel.count == 0 { 0.0 } else { 1.0 / pixel.normaliser() };
    let mut sums = sums.iter();
    for aov in aovs {
        let scale = if aov.kind.is_index() { 1.0 } else { scale };
        let own = sums.by_ref().take(aov.kind.channels().len());
        values.extend(own.map(|sum| (sum * scale) as f32));
    }
}
