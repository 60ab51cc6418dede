use super::*;
use crate::film::{CropWindow, FilmSettings, FilterKind};
use crate::integrator::{IntegratorKind, radiance, radiance_from};
use crate::integrator::{Stored, gridcache::lattice::Cell};
use crate::math::{DVec3, Vec3};
use crate::render::{Observer, Progress, RenderSettings, RenderState, render};
use crate::sampler::Sampler;
use crate::scene::test_scene::{TestScene, mixed_room};
use std::f32::consts::PI;
use std::time::Duration;

const FILM: FilmSettings = FilmSettings {
    width: 47,
    height: 33,
    crop: CropWindow { x: 0, y: 0, width: 47, height: 33 },
    filter: FilterKind::Box { radius: 0.5 },
    alpha: false,
};

fn settings(grid: GridCacheSettings) -> IntegratorSettings {
    IntegratorSettings { kind: IntegratorKind::GridCache, grid, ..Default::default() }
}

fn room(pixels: u32, grid: GridCacheSettings) -> TestScene {
    let mut t = mixed_room(pixels);
    t.tables.integrator = settings(grid);
    t
}

fn build(scene: &Scene) -> GridCache {
    GridCache::build(scene, &scene.tables.sensors[0], &|| false).expect("not cancelled")
}

/// Interpolates values of points between which nothing differs but their place in the picture.
fn interpolated(lattice: &Lattice, kind: Interpolation, film: Vec2, value: fn(Vec2) -> f64) -> f64 {
    let flat = Place { p: Vec3::ZERO, n: Vec3::Z };
    let cell = lattice.cell(film);
    let weights = cell.weights(kind, &flat, &[Some(flat); 4]);
    let values = cell.corners.map(|corner| value(lattice.film(corner)));
    let sum: f64 = weights.iter().zip(values).map(|(weight, value)| weight * value).sum();
    sum / weights.iter().sum::<f64>()
}

/// All film positions on a fine raster between the outermost points.
fn positions(lattice: &Lattice) -> Vec<Vec2> {
    let (first, last) = (lattice.film(0), lattice.film(lattice.len() - 1));
    let size = last - first;
    let at = |i: u32| first + size * Vec2::new((i % 97) as f32 / 96.0, (i / 97) as f32 / 96.0);
    (0..97 * 97).map(at).collect()
}

/// The bound is the rounding of positions of some tens of pixels.
#[test]
fn bilinear_interpolation_reproduces_a_ramp() {
    let ramp = |film: Vec2| 3.0 + 0.25 * f64::from(film.x) - 0.5 * f64::from(film.y);
    for step in [1, 5, 7, 20, 1000] {
        let lattice = Lattice::new(&FILM, step);
        for film in positions(&lattice) {
            let found = interpolated(&lattice, Interpolation::Bilinear, film, ramp);
            assert!((found - ramp(film)).abs() < 2e-5, "step {step}, {film}: {found}");
        }
    }
}

#[test]
fn the_mean_of_four_is_constant_in_a_cell() {
    let lattice = Lattice::new(&FILM, 10);
    let value = |film: Vec2| f64::from(film.x * film.y);
    let mut by_cell: Vec<([usize; 4], f64)> = Vec::new();
    for film in positions(&lattice) {
        let corners = lattice.cell(film).corners;
        let found = interpolated(&lattice, Interpolation::Nearest4, film, value);
        match by_cell.iter().find(|(other, _)| *other == corners) {
            Some((_, constant)) => assert_eq!(found, *constant, "{film}"),
            None => by_cell.push((corners, found)),
        }
    }
    // Lines at 0, 10, 20, 30, 40 and 46, and at 0, 10, 20, 30 and 32.
    assert_eq!((lattice.len(), by_cell.len()), (6 * 5, 5 * 4));
    by_cell.dedup_by_key(|(_, constant)| *constant);
    assert_eq!(by_cell.len(), 5 * 4, "neighbours differ");
}

/// Every pixel lies between points, and a crop window has the cells of the whole film.
#[test]
fn grids_enclose_the_pixels() {
    let cell = |lattice: &Lattice, film: Vec2| {
        let Cell { corners, within } = lattice.cell(film);
        (corners.map(|corner| lattice.pixel(corner)), within)
    };
    for step in [1, 3, 20, 46, 47, 65_536] {
        let whole = Lattice::new(&FILM, step);
        assert_eq!(whole.pixel(0), (0, 0));
        assert_eq!(whole.pixel(whole.len() - 1), (46, 32));
        let crop = CropWindow { x: 21, y: 9, width: 12, height: 11 };
        let part = Lattice::new(&FilmSettings { crop, ..FILM }, step);
        assert!(part.len() <= whole.len());
        for i in 0..12 * 11 {
            let corner = Vec2::new((21 + i % 12) as f32, (9 + i / 12) as f32);
            for film in [corner, corner + Vec2::splat(0.5), corner + Vec2::ONE] {
                assert_eq!(cell(&part, film), cell(&whole, film), "step {step}, {film}");
            }
        }
    }
    // A film of one pixel has one point, four times.
    let crop = CropWindow { x: 0, y: 0, width: 1, height: 1 };
    let tiny = Lattice::new(&FilmSettings { width: 1, height: 1, crop, ..FILM }, 20);
    assert_eq!(tiny.cell(Vec2::splat(0.5)).corners, [0; 4]);
}

#[test]
fn the_weight_of_ward_counts_lengths_and_turns() {
    let cell = Cell { corners: [0, 1, 2, 3], within: Vec2::splat(0.1) };
    let at = Place { p: Vec3::ZERO, n: Vec3::Z };
    let flat = Place { p: Vec3::new(0.5, 0.0, 0.0), n: Vec3::Z };
    let turned = Some(Place { p: Vec3::new(0.0, 0.5, 0.0), n: Vec3::X });
    let back = Some(Place { p: Vec3::new(0.0, 0.0, -2.0), n: -Vec3::Z });
    let weights = cell.weights(Interpolation::Ward, &at, &[Some(flat), turned, back, None]);
    let expected = [2.0, 1.0 / 1.5, 1.0 / (2.0 + 2.0_f64.sqrt()), 0.0];
    for (found, expected) in weights.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-12, "{found}, {expected}");
    }
    // Normals that round to more than 1 in their product, and the point itself.
    let long = Some(Place { n: 1.000_000_1 * Vec3::Z, ..flat });
    let weights = cell.weights(Interpolation::Ward, &at, &[long, Some(at), turned, None]);
    assert_eq!(weights, [0.0, 1.0, 0.0, 0.0]);
    assert_eq!(cell.weights(Interpolation::Bilinear, &at, &[None; 4]), [0.0; 4]);
}

/// Indirect irradiance in a furnace of emission 1 is π ρ/(1 − ρ), and what is seen 1/(1 − ρ).
/// Paths are sums of many terms; five standard errors of the mean of all points, from their own
/// spread.
#[test]
fn a_furnace_has_its_closed_form() {
    for quantity in Quantity::ALL {
        let grid = GridCacheSettings { step: 4, quantity, ..Default::default() };
        let mut t = TestScene::default();
        let bsdf = t.diffuse(Rgb::splat(0.5));
        let shape = t.room(bsdf);
        t.emit(shape, Rgb::WHITE);
        t.camera(DVec3::new(0.3, 0.2, -0.9), DVec3::new(0.0, -0.2, 1.0), 80.0, 25);
        t.tables.integrator = settings(grid);
        let scene = t.build();
        let cache = build(&scene);
        assert_eq!((cache.len(), cache.used_points().len()), (49, 49));
        // All reflected light, or the irradiance.
        let (scale, expected) = match quantity {
            Quantity::Color => (1.0, 1.0),
            Quantity::Irradiance => (1.0 / PI, 1.0),
        };
        let points = cache.points.iter().flatten().map(|point| point.light);
        let values: Vec<f32> = points.map(|l| scale * (l.direct + l.rest + l.indirect).r).collect();
        let n = values.len() as f32;
        let mean = values.iter().sum::<f32>() / n;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / (n - 1.0);
        let tolerance = 5.0 * (variance / n).sqrt();
        assert!((mean - expected).abs() < tolerance, "{quantity:?}: {mean} ± {tolerance}");
        assert!(tolerance < 0.03, "{quantity:?}: the test could tell nothing");
        for interpolation in Interpolation::ALL {
            let changed = GridCacheSettings { interpolation, ..grid };
            let cache = GridCache { settings: changed, ..build(&scene) };
            let [found, _] = means(&scene, Some(&cache), 7, 64);
            // The picture is made of the points, of which each is off as above.
            let off = 5.0 * variance.sqrt();
            let wrong = found.iter().find(|value| (**value - 2.0).abs() > off);
            assert_eq!(wrong, None, "{quantity:?}, {interpolation:?}, {off}");
        }
    }
}

/// Mean radiance, and its indirect layer, of the pixels of the first camera, luminances.
fn means(scene: &Scene, grid: Option<&GridCache>, seed: u64, count: u32) -> [Vec<f32>; 2] {
    let sensor = &scene.tables.sensors[0];
    let camera = Camera::new(sensor);
    let (width, height) = (sensor.film.width, sensor.film.height);
    let streams = SamplerSettings { kind: SamplerKind::Sobol, sample_count: count, seed };
    let pixel = |i: u32| {
        let (mut all, mut indirect) = (0.0, 0.0);
        for index in 0..count {
            let pixel = (i % width, i / width);
            let mut sampler = Sampler::new(&streams, pixel, index);
            let film = Vec2::new(pixel.0 as f32, pixel.1 as f32) + sampler.next_2d();
            let ray = camera.ray(film, sampler.next_2d());
            let settings = &scene.tables.integrator;
            let stored = grid.map(Stored::Grid);
            let found = radiance_from(scene, settings, stored, &ray, &mut sampler, &mut 0);
            all += found.layers().iter().map(|l| l.luminance()).sum::<f32>();
            indirect += found.indirect.luminance();
        }
        [all, indirect].map(|sum| sum / count as f32)
    };
    let found: Vec<[f32; 2]> = (0..width * height).into_par_iter().map(pixel).collect();
    [0, 1].map(|part| found.iter().map(|values| values[part]).collect())
}

fn mean(values: &[f32]) -> f64 {
    values.iter().map(|value| f64::from(*value)).sum::<f64>() / values.len() as f64
}

/// With a point in every pixel the indirect light is that of paths: sixteen grids and pictures of
/// independent seeds, six standard errors of the mean difference (2.4e-5 by Student's t with 15
/// degrees of freedom), and half a per cent for what changes within a pixel.
#[test]
fn a_step_of_one_pixel_has_the_mean_of_paths() {
    for interpolation in Interpolation::ALL {
        let grid =
            GridCacheSettings { step: 1, gather_samples: 64, interpolation, ..Default::default() };
        let run = |seed: u64| {
            let mut t = room(24, grid);
            t.tables.sensors[0].sampler.seed = seed;
            let scene = t.build();
            let cache = build(&scene);
            let found = means(&scene, Some(&cache), seed, 16).map(|values| mean(&values));
            let paths = means(&scene, None, seed + 100, 64).map(|values| mean(&values));
            [0, 1].map(|part| found[part] / paths[part] - 1.0)
        };
        let runs: Vec<[f64; 2]> = (0..16).map(run).collect();
        for part in [0, 1] {
            let mean = runs.iter().map(|run| run[part]).sum::<f64>() / 16.0;
            let variance = runs.iter().map(|run| (run[part] - mean).powi(2)).sum::<f64>() / 15.0;
            let error = (variance / 16.0).sqrt();
            assert!(mean.abs() < 6.0 * error + 5e-3, "{interpolation:?} {part}: {mean} ± {error}");
            assert!(6.0 * error < 0.02, "the test could tell nothing: {error}");
        }
    }
}

/// The picture of indirect light comes closer to that of paths as the grid becomes finer and its
/// points more exact: the squared error is below half from one to the next. Two pictures by paths,
/// so that their noise, independent, is not in the product of the differences to them.
#[test]
fn finer_grids_are_closer_to_paths() {
    let scene = room(24, GridCacheSettings::default()).build();
    let paths = [9, 10].map(|seed| means(&scene, None, seed, 1024)[1].clone());
    let error = |step: u32, gather_samples: u32| {
        let scene = room(24, GridCacheSettings { step, gather_samples, ..Default::default() });
        let scene = scene.build();
        let [_, found] = means(&scene, Some(&build(&scene)), 3, 64);
        let product = |i: usize| (found[i] - paths[0][i]) * (found[i] - paths[1][i]);
        mean(&(0..found.len()).map(product).collect::<Vec<_>>())
    };
    let errors = [error(12, 16), error(4, 256), error(1, 1024)];
    assert!(errors.windows(2).all(|pair| pair[1] < 0.5 * pair[0]), "{errors:?}");
}

/// What is not diffuse, and everything but indirect light at what is, has the bits of a path; with
/// the colour of the grid emission is exact.
#[test]
fn only_what_is_interpolated_differs_from_paths() {
    for quantity in Quantity::ALL {
        let scene = room(32, GridCacheSettings { step: 8, quantity, ..Default::default() }).build();
        let (cache, camera) = (build(&scene), Camera::new(&scene.tables.sensors[0]));
        let settings = &scene.tables.integrator;
        let samples = SamplerSettings { kind: SamplerKind::Sobol, sample_count: 1, seed: 3 };
        let (mut mirrored, mut served) = (0, 0);
        for i in 0..32 * 32 {
            let film = Vec2::new((i % 32) as f32 + 0.5, (i / 32) as f32 + 0.5);
            let ray = camera.ray(film, Vec2::splat(0.5));
            let sampler = || Sampler::new(&samples, (i % 32, i / 32), 0);
            let stored = Some(Stored::Grid(&cache));
            let found = radiance_from(&scene, settings, stored, &ray, &mut sampler(), &mut 0);
            let path = radiance(&scene, settings, None, &ray, &mut sampler(), &mut 0);
            assert_eq!((found.emission, found.alpha), (path.emission, path.alpha));
            if found.lookups.lookups == 0 || found.lookups.uncached > 0 {
                mirrored += u32::from(!path.rest.is_black());
                assert_eq!(found.layers(), path.layers());
            } else {
                served += 1;
                let is_exact = found.direct == path.direct && found.rest == path.rest;
                assert_eq!(is_exact, quantity == Quantity::Irradiance || !is_lit(&found, &path));
            }
        }
        assert!(mirrored > 20 && served > 500, "{mirrored}, {served}");
    }
}

/// Whether either has direct light.
fn is_lit(a: &LayeredRadiance, b: &LayeredRadiance) -> bool {
    !a.direct.is_black() || !b.direct.is_black()
}

struct Silent;

impl Observer for Silent {
    fn elapsed(&self) -> Duration {
        Duration::ZERO
    }
    fn is_cancelled(&self) -> bool {
        false
    }
    fn progress(&self, _: &Progress) {}
    fn checkpoint(&self, _: &RenderState) {}
}

/// Threads, and a break after some of the samples, change no bit; other parameters are refused.
#[test]
fn threads_and_resumption_change_no_bit() {
    for quantity in Quantity::ALL {
        let grid = GridCacheSettings { step: 5, quantity, ..Default::default() };
        let scene = room(24, grid).build();
        let run = |scene: &Scene, threads: usize, spp: u32, state: Option<RenderState>| {
            let settings = RenderSettings { spp: Some(spp), ..Default::default() };
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| render(scene, 0, &settings, state, &Silent))
        };
        let whole = run(&scene, 1, 6, None).unwrap();
        assert_eq!(whole.grid.as_ref().unwrap().len(), 36);
        let first = run(&scene, 3, 2, None).unwrap();
        let state = RenderState::from_bytes(&first.state.to_bytes()).unwrap();
        let other = room(24, GridCacheSettings { step: 6, ..grid }).build();
        let error = run(&other, 1, 6, Some(state.clone())).unwrap_err().to_string();
        assert!(error.contains("has step 5, this render has 6"), "{error}");
        let resumed = run(&scene, 2, 6, Some(state)).unwrap();
        assert_eq!(resumed.state.to_bytes(), whole.state.to_bytes(), "{quantity:?}");
        assert!(whole.lookups.lookups > 0 && whole.rays > whole.grid.unwrap().rays);
    }
}

#[test]
fn every_parameter_is_set_and_got() {
    for (name, value) in
        [("step", "7"), ("gather_samples", "99"), ("interpolation", "ward"), ("quantity", "color")]
    {
        let mut settings = GridCacheSettings::default();
        let parameter = GridParameter::named(name).expect(name);
        assert_ne!(parameter.get(&settings), value);
        parameter.set(&mut settings, value).expect(name);
        assert_eq!(parameter.get(&settings), value);
        assert!(parameter.set(&mut settings, "0").is_err(), "{name} was 0");
    }
    assert!(PARAMETERS.iter().all(|p| GridParameter::named(p.name).is_some()));
}
