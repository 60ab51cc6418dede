use std::sync::atomic::{AtomicBool, Ordering};

use super::Observer;
use super::cache::Prepared;
use crate::film::{FilterSampler, Tile};
use crate::integrator::{
    Aov, GridCache, IntegratorSettings, IrradianceCache, LayeredRadiance, Stored, eval_aovs,
    radiance_from,
};
use crate::math::{Ray, Vec2};
use crate::sampler::{Sampler, SamplerTable};
use crate::scene::Scene;
use crate::sensor::{Camera, Sensor};

/// What all tiles of a render share.
pub(super) struct TileRenderer<'a> {
    scene: &'a Scene,
    integrator: IntegratorSettings,
    cache: Option<&'a IrradianceCache>,
    grid: Option<&'a GridCache>,
    aovs: &'a [Aov],
    camera: Camera,
    filter: FilterSampler,
}

/// What the work on a tile came to.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct TileWork {
    pub(super) samples: u64,
    pub(super) rays: u64,
}

impl<'a> TileRenderer<'a> {
    pub(super) fn new(scene: &'a Scene, sensor: &'a Sensor, prepared: &'a Prepared) -> Self {
        Self {
            scene,
            integrator: scene.tables.integrator,
            cache: prepared.cache.as_ref(),
            grid: prepared.grid.as_ref(),
            aovs: &scene.tables.aovs,
            camera: Camera::new(sensor),
            filter: FilterSampler::new(sensor.film.filter),
        }
    }

    /// Brings every pixel of the tile to its goal, `samples` the streams; leaves off between two
    /// pixels when the observer cancels or `stop` is set.
    pub(super) fn render(
        &self,
        tile: &mut Tile,
        samples: &SamplerTable,
        observer: &dyn Observer,
        stop: &AtomicBool,
    ) -> TileWork {
        let mut work = TileWork::default();
        let mut values = Vec::new();
        for i in 0..tile.pixels.len() {
            if observer.is_cancelled() || stop.load(Ordering::Relaxed) {
                break;
            }
            let (first, goal) = (tile.pixels[i].count, tile.pixels[i].goal);
            for index in first..goal {
                self.sample(tile, i, index, samples, &mut values, &mut work.rays);
            }
            work.samples += u64::from(goal.saturating_sub(first));
        }
        work
    }

    /// Adds one sample to pixel `i` of the tile.
    fn sample(
        &self,
        tile: &mut Tile,
        i: usize,
        index: u32,
        samples: &SamplerTable,
        values: &mut Vec<f32>,
        rays: &mut u64,
    ) {
        let window = tile.window;
        let (x, y) = (window.x + i as u32 % window.width, window.y + i as u32 / window.width);
        let mut sampler = samples.sampler((x, y), index);
        let (ray, weight) = self.camera_ray((x, y), &mut sampler);
        let cache = self.cache.map(|cache| Stored::Cache(cache.seen_by((x, y))));
        let stored = cache.or(self.grid.map(Stored::Grid));
        let mut sample =
            radiance_from(self.scene, &self.integrator, stored, &ray, &mut sampler, rays);
        tile.lookups = tile.lookups.merged(sample.lookups);
        if !sample.layers().iter().all(|layer| layer.is_finite()) {
            tile.non_finite.note((y, x, index));
            sample = LayeredRadiance { alpha: sample.alpha, ..Default::default() };
        }
        tile.pixels[i].add(&sample, weight);
        if !self.aovs.is_empty() {
            eval_aovs(self.scene, self.cache, self.aovs, &ray, &mut sampler, rays, values);
            let n = values.len();
            self.add_aovs(&mut tile.aovs[i * n..(i + 1) * n], values, weight, index);
        }
    }

    fn camera_ray(&self, pixel: (u32, u32), sampler: &mut Sampler) -> (Ray, f32) {
        let (offset, weight) = self.filter.sample(sampler.next_2d());
        let lens = if self.camera.has_lens() { sampler.next_2d() } else { Vec2::splat(0.5) };
        let center = Vec2::new(pixel.0 as f32 + 0.5, pixel.1 as f32 + 0.5);
        (self.camera.ray(center + offset, lens), weight)
    }

    /// Averages are sums like the picture's, indices come from the first sample.
    fn add_aovs(&self, sums: &mut [f64], values: &[f32], weight: f32, index: u32) {
        let mut pairs = sums.iter_mut().zip(values);
        for aov in self.aovs {
            for (sum, &value) in pairs.by_ref().take(aov.kind.channels().len()) {
                match (aov.kind.is_index(), index) {
                    (true, 0) => *sum = f64::from(value),
                    (true, _) => {}
                    (false, _) if value.is_finite() => *sum += f64::from(value * weight),
                    (false, _) => {}
                }
            }
        }
    }
}
