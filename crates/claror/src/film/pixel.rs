use super::LAYERS;
use crate::integrator::LayeredRadiance;
use crate::spectrum::Rgb;

/// Sums over the samples of one pixel, in the order of the samples: wherever a render is
/// interrupted and continued, the same additions happen in the same order.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PixelSums {
    /// Weighted radiance by layer and channel.
    pub layers: [[f64; 3]; LAYERS],
    /// Squares of the weighted radiance of all layers together.
    pub squares: [f64; 3],
    /// Weighted alpha.
    pub alpha: f64,
    /// Weights of the reconstruction filter.
    pub weight: f64,
    /// The beauty as it was at the last power of two that is smaller than `count`.
    pub earlier: [f32; 3],
    /// Mean of the direct light as if nothing stood in its way: in closed form, and by the samples.
    /// Without filter weights, so that both stay positive.
    pub control: [[f32; 3]; 2],
    /// What all samples met, if they met the same; else [`PixelSums::MIXED`].
    pub signature: u32,
    /// Samples.
    pub count: u32,
    /// Samples at the end of the round that is under way, or was the last.
    pub goal: u32,
}

/// Which layer is direct light.
const DIRECT: usize = 1;

impl PixelSums {
    /// Signature of a pixel whose samples met different things.
    pub const MIXED: u32 = 1;

    /// Adds a finite sample that the reconstruction filter gives this weight.
    pub fn add(&mut self, sample: &LayeredRadiance, weight: f32) {
        if self.count.is_power_of_two() {
            self.earlier = self.beauty().to_array();
        }
        let weight = f64::from(weight);
        let mut total = [0.0; 3];
        for (sum, layer) in self.layers.iter_mut().zip(sample.layers()) {
            for (channel, value) in layer.to_array().into_iter().enumerate() {
                let value = f64::from(value) * weight;
                sum[channel] += value;
                total[channel] += value;
            }
        }
        for (square, total) in self.squares.iter_mut().zip(total) {
            *square += total * total;
        }
        self.alpha += f64::from(sample.alpha) * weight;
        self.weight += weight;
        if self.count == 0 {
            self.signature = sample.signature;
        } else if self.signature != sample.signature {
            self.signature = Self::MIXED;
        }
        self.count += 1;
        let pace = 1.0 / self.count as f32;
        let control = [sample.control.exact, sample.control.sampled];
        for (mean, new) in self.control.iter_mut().zip(control) {
            for (mean, new) in mean.iter_mut().zip(new.to_array()) {
                *mean += (new - *mean) * pace;
            }
        }
    }

    /// Factor of the direct light: what the samples would have been without noise over what they
    /// were, had nothing stood in their way.
    fn correction(&self, channel: usize) -> f64 {
        let [exact, sampled] = self.control.map(|mean| f64::from(mean[channel]));
        if exact > 0.0 && sampled > 0.0 { exact / sampled } else { 1.0 }
    }

    /// What sums are divided by: the sum of the weights, so that a constant picture stays
    /// constant. Where few samples with weights of both signs happen to cancel, the expectation
    /// of that sum, the number of samples, takes its place.
    pub fn normaliser(&self) -> f64 {
        let count = f64::from(self.count);
        if self.weight > 0.25 * count || self.count == 1 { self.weight } else { count }
    }

    /// One layer's mean.
    pub fn layer(&self, layer: usize) -> Rgb {
        if self.count == 0 {
            return Rgb::BLACK;
        }
        let scale = 1.0 / self.normaliser();
        let mut mean = self.layers[layer].map(|sum| sum * scale);
        if layer == DIRECT {
            for (channel, mean) in mean.iter_mut().enumerate() {
                *mean *= self.correction(channel);
            }
        }
        Rgb::from(mean.map(|m| m as f32))
    }

    /// The picture: the `f32` sum of the layers from the first to the last, which is how whoever
    /// adds up stored layers gets the same bits.
    pub fn beauty(&self) -> Rgb {
        (1..LAYERS).fold(self.layer(0), |sum, i| sum + self.layer(i))
    }

    /// Share of the pixel that is covered by something.
    pub fn alpha(&self) -> f32 {
        if self.count == 0 { 0.0 } else { (self.alpha / self.normaliser()) as f32 }
    }

    /// Variance of the beauty by the spread of the samples: what it would be if these were
    /// independent. Stratified samples err less. Infinite below two samples.
    pub fn variance(&self) -> Rgb {
        if self.count < 2 {
            return Rgb::splat(f32::INFINITY);
        }
        let n = f64::from(self.count);
        let channel = |c: usize| {
            let mean = self.layers.iter().map(|layer| layer[c]).sum::<f64>() / n;
            ((self.squares[c] / n - mean * mean).max(0.0) / (n - 1.0)) as f32
        };
        Rgb::new(channel(0), channel(1), channel(2))
    }

    /// Estimate of the squared error of the beauty per channel, from the difference between its
    /// earlier and its later samples. With means A over m, B over n − m and M over all n samples,
    /// `A − B = (A − M)·n/(n − m)`, whose square has, for uncorrelated parts, the expectation
    /// `Var(M)·n²/(m·(n − m))`. The parts of a stratified sequence are negatively correlated, so
    /// it errs on the safe side, by far less than [`PixelSums::variance`].
    pub fn squared_error(&self) -> [f64; 3] {
        if self.count < 2 {
            return [f64::INFINITY; 3];
        }
        let n = f64::from(self.count);
        let m = f64::from(self.count.next_power_of_two() / 2);
        let beauty = self.beauty();
        let square = |c: usize| f64::from(self.earlier[c] - beauty[c]).powi(2) * m / (n - m);
        [square(0), square(1), square(2)]
    }
}
