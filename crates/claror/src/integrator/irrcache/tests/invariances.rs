//! What must not depend on units, place, colour names or the surface's own colour.

use super::*;
use crate::math::{DAffine3, Transform};
use crate::scene::SceneTables;
use crate::texture::{Texture, UvTransform};

/// A small room with a mirror, two spheres and a lamp; red is not blue.
fn room() -> TestScene {
    let mut t = mixed_room(32);
    t.tables.integrator = cached(IrrCacheSettings::default());
    t
}

/// The scene with its camera moved, turned or scaled.
fn moved(tables: &SceneTables, by: DAffine3) -> Scene {
    let mut tables = tables.clone();
    let compose = |t: &Transform| {
        let old = DAffine3::from_mat3_translation(
            t.to_world.matrix3.as_dmat3(),
            t.to_world.translation.as_dvec3(),
        );
        Transform::new(by * old).expect("still invertible")
    };
    for mesh in &mut tables.shapes.meshes {
        for p in &mut mesh.positions {
            *p = by.transform_point3(p.as_dvec3()).as_vec3();
        }
    }
    for shape in &mut tables.shapes.shapes {
        use ShapeKind::{Cylinder, Disk, Mesh, Rectangle, Sphere};
        match &mut shape.kind {
            Mesh(_) => {}
            Rectangle(t) | Disk(t) | Sphere(t) | Cylinder(t) => *t = compose(t),
        }
    }
    let factor = by.matrix3.x_axis.length();
    for sensor in &mut tables.sensors {
        sensor.to_world = compose(&sensor.to_world);
        sensor.near_clip = (f64::from(sensor.near_clip) * factor) as f32;
        sensor.far_clip = (f64::from(sensor.far_clip) * factor) as f32;
    }
    Scene::build(tables).expect("as sound as before")
}

fn scaled(factor: f64) -> Scene {
    moved(&room().tables, DAffine3::from_scale(DVec3::splat(factor)))
}

fn picture(scene: &Scene) -> (IrradianceCache, Vec<f32>) {
    let settings = RenderSettings { spp: Some(16), ..Default::default() };
    let output = render(scene, 0, &settings, None, &Silent).expect("a sound scene");
    (output.cache.expect("a cache"), output.picture.beauty.image.data)
}

/// Powers of two round to nothing: whatever differs is a length, an area or a number in the
/// program that has no business there.
#[test]
fn scaling_by_powers_of_two_changes_no_bit() {
    let (cache, pixels) = picture(&scaled(1.0));
    for exponent in [-10, 10] {
        let factor = 2_f32.powi(exponent);
        let (other, other_pixels) = picture(&scaled(factor.into()));
        assert_eq!(cache.records.len(), other.records.len(), "2^{exponent}");
        for (a, b) in cache.records.iter().zip(&other.records) {
            let expected = Record {
                position: a.position * factor,
                radii: a.radii.map(|r| r * factor),
                natural_radius: a.natural_radius * factor,
                harmonic_mean_distance: a.harmonic_mean_distance * factor,
                corral_distance: a.corral_distance * factor,
                translational: a.translational.map(|g| g / factor),
                ..*a
            };
            assert_eq!(expected, *b, "2^{exponent}");
        }
        assert_eq!(cache.statistics, other.statistics, "2^{exponent}");
        assert!(pixels == other_pixels, "2^{exponent}: another picture");
    }
}

/// Other factors round differently. A walk that an edge then parts from its twin takes another way
/// at random, so single pixels may differ; the mean must not, nor the number of records.
#[test]
fn scaling_by_other_factors_changes_roundings() {
    let (cache, pixels) = picture(&scaled(1.0));
    let mean = |pixels: &[f32]| pixels.iter().map(|&x| f64::from(x)).sum::<f64>();
    for factor in [1e-3, 7.0, 1e3] {
        let (other, other_pixels) = picture(&scaled(factor));
        let (a, b) = (cache.records.len() as f64, other.records.len() as f64);
        assert!((a - b).abs() <= 0.02 * a, "{factor}: {a} and {b} records");
        let ratio = mean(&other_pixels) / mean(&pixels);
        assert!((ratio - 1.0).abs() < 1e-4, "{factor}: {ratio}");
    }
}

/// Brighter light of the same distribution makes the same records, exactly as much brighter, and so
/// are samples of the picture. How many samples a pixel gets is another matter: what is almost black
/// on a display gets few.
#[test]
fn brightness_scales_records_and_samples_exactly() {
    let lit = |factor: f32| {
        let mut t = room();
        let Emitter::Area { radiance, .. } = t.tables.emitters.emitters[0] else { unreachable!() };
        t.tables.textures.textures[radiance.0 as usize] =
            Texture::Constant(Rgb::new(9.0, 8.0, 7.0) * factor);
        let scene = t.build();
        let cache = build(&scene);
        let samples = camera_samples(&scene, &cache);
        (cache, samples)
    };
    let (cache, samples) = lit(1.0);
    for exponent in [-12, 20] {
        let factor = 2_f32.powi(exponent);
        let (other, other_samples) = lit(factor);
        assert_eq!(cache.records.len(), other.records.len(), "2^{exponent}");
        for (a, b) in cache.records.iter().zip(&other.records) {
            let expected = Record {
                irradiance: a.irradiance * factor,
                translational: a.translational.map(|g| g * factor),
                rotational: a.rotational.map(|g| g * factor),
                ..*a
            };
            assert_eq!(expected, *b, "2^{exponent}");
        }
        assert_eq!(cache.statistics, other.statistics, "2^{exponent}");
        for (a, b) in samples.iter().zip(&other_samples) {
            assert_eq!(a.layers().map(|layer| layer * factor), b.layers(), "2^{exponent}");
        }
    }
}

/// Four samples of every pixel.
fn camera_samples(scene: &Scene, cache: &IrradianceCache) -> Vec<LayeredRadiance> {
    let camera = Camera::new(&scene.tables.sensors[0]);
    let streams = SamplerSettings { kind: SamplerKind::Sobol, sample_count: 4, seed: 1 };
    let sample = |i: u32| {
        let pixel = (i / 4 % 32, i / 4 / 32);
        let mut sampler = Sampler::new(&streams, pixel, i % 4);
        let within = sampler.next_2d();
        let film = Vec2::new(pixel.0 as f32, pixel.1 as f32) + within;
        let ray = camera.ray(film, sampler.next_2d());
        let settings = &scene.tables.integrator;
        radiance(scene, settings, Some(cache), &ray, &mut sampler, &mut 0)
    };
    (0..32 * 32 * 4).map(sample).collect()
}

/// Nothing prefers an axis of the world. The hash's cells and their rims lie elsewhere and every
/// random number means another direction, so means agree within 4.5 standard errors and half a per
/// cent of what all look-ups share. An invisible sphere around the room keeps the scene's extent:
/// shares of it bound radii, and a box along the axes grows around a room that is turned.
#[test]
fn rotating_scene_and_camera_changes_noise_only() {
    let (still, turned) = {
        let axis = DVec3::new(1.0, 2.0, -0.5).normalize();
        let mut t = room();
        let around = place(DVec3::ZERO, DVec3::Z, DVec3::splat(1.75));
        let black = t.diffuse(Rgb::BLACK);
        t.shape(ShapeKind::Sphere(around), black);
        let tables = t.tables;
        (moved(&tables, DAffine3::IDENTITY), moved(&tables, DAffine3::from_axis_angle(axis, 0.7)))
    };
    let (a, b) = (build(&still), build(&turned));
    let (n, m) = (a.records.len() as f64, b.records.len() as f64);
    let (mean, error) = film_mean(&still, Some(&a), 100_000);
    let (other, other_error) = film_mean(&turned, Some(&b), 100_000);
    assert!((n - m).abs() < 0.1 * n, "{n} and {m} records");
    let tolerance = 4.5 * error.hypot(other_error) + 0.005 * mean;
    assert!((mean - other).abs() < tolerance, "{mean} and {other}, tolerance {tolerance}");
    assert!(tolerance < 0.02 * mean, "the test could tell nothing");
}

/// Red light and surfaces made green, green ones blue, blue ones red: the picture likewise. Radii
/// and batches follow luminance, which differs, so only records of the same number of rays are
/// compared bit for bit; the means of the pictures within 4.5 standard errors and half a per cent.
#[test]
fn permuted_channels_permute_records_and_picture() {
    let turn = |c: Rgb| Rgb::new(c.b, c.r, c.g);
    let scene = |is_turned: bool, cache: IrrCacheSettings| {
        let mut t = mixed_room(32);
        t.tables.textures.textures[0] = Texture::Constant(Rgb::new(0.8, 0.3, 0.5));
        if is_turned {
            for texture in &mut t.tables.textures.textures {
                if let Texture::Constant(color) = texture {
                    *color = turn(*color);
                }
            }
        }
        t.tables.integrator = cached(cache);
        t.build()
    };
    // One batch whatever the noise, walks to their end: nothing asks for the luminance.
    let exact = IrrCacheSettings {
        bounces: Bounces::Path,
        noise: Some(1e9),
        smoothing: Some(0.0),
        ..Default::default()
    };
    let [a, b] = [false, true].map(|is_turned| build(&scene(is_turned, exact)));
    let mut common = 0;
    for record in &a.records {
        if let Some(other) = b.records.iter().find(|other| other.key == record.key) {
            assert_eq!(other.irradiance, turn(record.irradiance), "record {}", record.key);
            common += 1;
        }
    }
    assert!(common >= 20 && common > a.records.len() / 4, "{common} of {}", a.records.len());

    let [a, b] = [false, true].map(|is_turned| scene(is_turned, IrrCacheSettings::default()));
    let (x, y) = (build(&a), build(&b));
    for (part, turned) in [
        (red as fn(&LayeredRadiance) -> Rgb, green as fn(&LayeredRadiance) -> Rgb),
        (green, blue),
        (blue, red),
    ] {
        let (mean, error) = film_mean_of(&a, Some(&x), 50_000, part);
        let (other, other_error) = film_mean_of(&b, Some(&y), 50_000, turned);
        let tolerance = 4.5 * error.hypot(other_error) + 0.005 * mean;
        assert!((mean - other).abs() < tolerance, "{mean} and {other}, tolerance {tolerance}");
        assert!(tolerance < 0.03 * mean, "the test could tell nothing");
    }
}

fn red(found: &LayeredRadiance) -> Rgb {
    Rgb::splat(found.indirect.r)
}

fn green(found: &LayeredRadiance) -> Rgb {
    Rgb::splat(found.indirect.g)
}

fn blue(found: &LayeredRadiance) -> Rgb {
    Rgb::splat(found.indirect.b)
}

/// A floor does not see itself: with one bounce of indirect light its colour is in none of its
/// records. A cache of outgoing light instead of irradiance fails.
#[test]
fn a_surface_own_texture_is_not_in_its_records() {
    let floor_records = |is_chequered: bool| {
        let mut t = mixed_room(32);
        let white = t.color(Rgb::WHITE);
        let dark = t.color(Rgb::new(0.1, 0.02, 0.3));
        let to_uv = UvTransform([8.0, 0.0, 0.0, 0.0, 8.0, 0.0]);
        let reflectance = if is_chequered {
            let texture = Texture::Checkerboard { color0: white, color1: dark, to_uv };
            t.tables.textures.textures.push(texture);
            crate::texture::TextureId(t.tables.textures.textures.len() as u32 - 1)
        } else {
            white
        };
        let bsdf = t.bsdf(Bsdf::Diffuse { reflectance });
        let floor = place(DVec3::new(0.0, -0.999, 0.0), DVec3::Y, DVec3::ONE);
        t.shape(ShapeKind::Rectangle(floor), bsdf);
        // Two surfaces and the camera's: light, wall, floor.
        t.tables.integrator =
            IntegratorSettings { max_depth: Some(3), ..cached(IrrCacheSettings::default()) };
        let cache = build(&t.build());
        let is_floor = |record: &Record| (record.position.y + 0.999).abs() < 1e-5;
        cache.records.into_iter().filter(is_floor).collect::<Vec<_>>()
    };
    let (plain, chequered) = (floor_records(false), floor_records(true));
    assert!(plain.len() >= 12, "{} records", plain.len());
    let mut common = 0;
    for record in &plain {
        if let Some(other) = chequered.iter().find(|other| other.key == record.key) {
            assert_eq!(record.irradiance, other.irradiance, "record {}", record.key);
            common += 1;
        }
    }
    assert!(common > plain.len() / 2, "{common} of {}", plain.len());
}
