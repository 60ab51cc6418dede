//! The light sampler as a whole: densities against samples, closed forms, Mitsuba's numbers.

mod density;

use self::density::{check, check_solid_angles, density, draw, level};

use super::*;
use crate::image::Image;
use crate::interaction::SurfaceInteraction;
use crate::math::statistics::{Moments, TestRng};
use crate::math::{DAffine3, DMat3, DVec3, Ray, Vec2};
use crate::scene::test_scene::{TestScene, place};
use crate::scene::{Scene, SceneTables};
use crate::shape::{Mesh, MeshId, ShapeKind};
use crate::texture::{Texture, TextureFilter, UvTransform, WrapMode};
use std::f64::consts::PI;

fn lit_by(kind: ShapeKind, flip: bool) -> Scene {
    let mut t = TestScene::default();
    add_light(&mut t, kind, flip, Rgb::new(2.0, 3.0, 4.0));
    t.build()
}

fn add_light(t: &mut TestScene, kind: ShapeKind, flip: bool, radiance: Rgb) -> ShapeId {
    let black = t.diffuse(Rgb::BLACK);
    let shape = t.shape(kind, black);
    t.tables.shapes.shapes[shape.0 as usize].flip_normals = flip;
    t.emit(shape, radiance);
    shape
}

fn mesh(t: &mut TestScene, mesh: Mesh) -> ShapeKind {
    t.tables.shapes.meshes.push(mesh);
    ShapeKind::Mesh(MeshId(t.tables.shapes.meshes.len() as u32 - 1))
}

fn at(x: f32, y: f32, z: f32) -> LightReference {
    LightReference { p: Vec3::new(x, y, z), n: None, without_sky: false }
}

fn rectangle() -> ShapeKind {
    ShapeKind::Rectangle(place(
        DVec3::new(0.1, 0.2, 0.3),
        DVec3::new(0.2, -0.3, 1.0),
        DVec3::new(1.0, 0.6, 1.0),
    ))
}

fn sheared(z: f64) -> Transform {
    let axes = DMat3::from_cols(
        DVec3::new(1.0, 0.1, 0.2),
        DVec3::new(0.5, 0.8, 0.0),
        DVec3::new(0.0, -0.2, 0.7),
    );
    Transform::new(DAffine3::from_mat3_translation(axes, DVec3::new(0.0, 0.0, z))).unwrap()
}

#[test]
fn rectangles_far_and_near() {
    let scene = lit_by(rectangle(), false);
    for (i, reference) in
        [at(0.5, 1.0, 4.0), at(0.3, 0.1, 1.0), at(0.0, 0.5, 0.6), at(2.5, 0.0, 1.0)]
            .iter()
            .enumerate()
    {
        check(&scene, reference, i as u64, &format!("rectangle {i}"));
    }
    let scene = lit_by(ShapeKind::Rectangle(sheared(0.0)), false);
    check(&scene, &at(0.4, 0.2, 1.0), 7, "sheared rectangle");
}

#[test]
fn behind_a_rectangle_there_is_no_light() {
    for (flip, z) in [(false, -2.0), (true, 3.0)] {
        let scene = lit_by(rectangle(), flip);
        let mut rng = TestRng::new(1);
        for _ in 0..100 {
            assert!(draw(&scene, &at(0.0, 0.0, z), &mut rng).is_none());
            assert!(draw(&scene, &at(0.0, 0.0, 1.0 - z), &mut rng).is_some());
        }
    }
}

#[test]
fn triangles_far_and_near() {
    let mut t = TestScene::default();
    let kind = mesh(
        &mut t,
        Mesh {
            positions: vec![Vec3::ZERO, Vec3::new(1.3, 0.1, 0.2), Vec3::new(0.2, 1.0, 0.0)],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        },
    );
    add_light(&mut t, kind, false, Rgb::WHITE);
    let scene = t.build();
    for (i, reference) in
        [at(0.5, 1.0, 4.0), at(0.4, 0.3, 0.5), at(-0.3, 0.5, 0.9)].iter().enumerate()
    {
        check(&scene, reference, i as u64, &format!("triangle {i}"));
    }
}

#[test]
fn triangles_with_vertex_normals_shine_on_their_side() {
    let mut t = TestScene::default();
    // Normals that lean so far that a part shines to the back of the triangle.
    let lean = |x: f32, y: f32| Vec3::new(x, y, 0.3).normalize();
    let kind = mesh(
        &mut t,
        Mesh {
            positions: vec![Vec3::ZERO, Vec3::new(2.0, 0.0, 0.0), Vec3::new(0.0, 2.0, 0.0)],
            normals: vec![lean(-1.0, -1.0), lean(1.0, 0.0), lean(0.0, 1.0)],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        },
    );
    add_light(&mut t, kind, false, Rgb::WHITE);
    let scene = t.build();
    check(&scene, &at(-1.0, 0.5, 1.5), 1, "smooth triangle from the front");
    check(&scene, &at(-1.5, -1.5, -0.5), 2, "smooth triangle from the back");
    check(&scene, &at(0.2, 0.3, 0.7), 3, "smooth triangle, near");
}

#[test]
fn spheres_from_outside_and_inside() {
    let ball = |scale| place(DVec3::new(0.2, 0.1, 0.0), DVec3::new(1.0, 2.0, 0.5), scale);
    for (i, scale) in [DVec3::splat(1.2), DVec3::new(0.7, 1.2, 1.0)].into_iter().enumerate() {
        let scene = lit_by(ShapeKind::Sphere(ball(scale)), false);
        check(&scene, &at(2.0, 1.0, 1.5), 1, &format!("sphere {i} from outside"));
        check(&scene, &at(0.2, 1.5, 0.0), 2, &format!("sphere {i}, near"));
        assert!(draw(&scene, &at(0.2, 0.3, 0.0), &mut TestRng::new(1)).is_none());
        let scene = lit_by(ShapeKind::Sphere(ball(scale)), true);
        check(&scene, &at(0.3, 0.4, 0.2), 3, &format!("sphere {i} from inside"));
        assert!(draw(&scene, &at(0.2, 3.3, 0.0), &mut TestRng::new(1)).is_none());
    }
}

#[test]
fn disks_and_cylinders() {
    let transform = place(DVec3::ZERO, DVec3::new(0.3, 0.2, 1.0), DVec3::new(0.8, 0.8, 1.0));
    let scene = lit_by(ShapeKind::Disk(transform), false);
    check(&scene, &at(0.5, 1.0, 3.0), 1, "disk");
    check(&scene, &at(0.3, 0.1, 0.5), 2, "disk, near");
    let scene = lit_by(ShapeKind::Disk(sheared(0.0)), true);
    check(&scene, &at(0.3, 0.1, -1.5), 3, "sheared disk from behind");
    for flip in [false, true] {
        for (transform, what) in [(transform, "cylinder"), (sheared(-0.5), "sheared cylinder")] {
            let scene = lit_by(ShapeKind::Cylinder(transform), flip);
            check_solid_angles(&scene, &at(1.0, 1.5, 2.0), 4, &format!("{what}, {flip}"));
            if flip {
                check(&scene, &at(0.05, 0.1, 0.1), 5, &format!("{what} from inside"));
            }
        }
    }
}

fn envmap_scene(transform: Transform) -> Scene {
    let mut t = TestScene::default();
    let mut image = Image::new(8, 5, 3);
    for (i, value) in image.data.iter_mut().enumerate() {
        let (x, y, c) = (i / 3 % 8, i / 24, i % 3);
        *value = ((x * 7 + y * 5 + c * 3) % 11) as f32 / 11.0;
    }
    t.tables.textures.images.push(image);
    let emitter = Emitter::Envmap { image: ImageId(0), scale: 1.5, to_world: transform };
    t.tables.emitters.emitters.push(emitter);
    t.build()
}

#[test]
fn environments() {
    let turned = place(DVec3::ZERO, DVec3::new(1.0, 2.0, 0.5), DVec3::ONE);
    check(&envmap_scene(turned), &at(1.0, 2.0, 3.0), 1, "envmap");
    let mut t = TestScene::default();
    t.tables.emitters.emitters.push(Emitter::Constant { radiance: Rgb::WHITE });
    let scene = t.build();
    check(&scene, &at(0.0, 0.0, 0.0), 2, "constant");
    let n = Some(Vec3::new(0.6, 0.0, -0.8));
    check(
        &scene,
        &LightReference { p: Vec3::ZERO, n, without_sky: false },
        3,
        "constant above a surface",
    );
}

#[test]
fn sun_and_sky_are_sampled_as_a_mixture() {
    let mut t = TestScene::default();
    let towards = Vec3::new(0.3, 0.4, 0.8).normalize();
    t.tables.emitters.emitters.push(Emitter::Constant { radiance: Rgb::splat(0.5) });
    t.tables.emitters.emitters.push(Emitter::SunDisc {
        direction: towards,
        half_angle: 0.8,
        radiance: Rgb::splat(4.0),
    });
    add_light(&mut t, rectangle(), false, Rgb::splat(5.0));
    let scene = t.build();
    let inside = scene.lights.environment_radiance(&scene.tables, towards);
    assert_eq!(inside, Rgb::splat(4.5));
    check(&scene, &at(0.5, 1.0, 4.0), 1, "sun, sky and lamp");
}

/// The radiance of a map with the pixels of `envmap_scene`, printed by Mitsuba 3.9.1.
#[test]
fn envmap_reads_as_in_mitsuba() {
    let scene = envmap_scene(Transform::IDENTITY);
    for (d, expected) in ENVMAP_VALUES {
        let value = scene.lights.environment_radiance(&scene.tables, Vec3::from(d).normalize());
        for (v, e) in value.to_array().into_iter().zip(expected) {
            assert!((v - e).abs() < 1e-5, "{d:?}: {value:?}, expected {expected:?}");
        }
    }
}

const ENVMAP_VALUES: [([f32; 3], [f32; 3]); 9] = [
    ([0.0, 0.0, 1.0], [0.954545, 0.613636, 0.272727]),
    ([0.0, 0.0, -1.0], [0.954545, 0.613636, 1.022727]),
    ([1.0, 0.0, 0.0], [0.545455, 0.954545, 0.613636]),
    ([0.001, -1.0, 0.002], [1.003124, 0.051604, 0.460309]),
    ([0.3, 0.4, -0.5], [0.739077, 0.862641, 0.273241]),
    ([-0.3, 0.9, 0.2], [0.558187, 0.967278, 0.637564]),
    ([-0.7, -0.4, -0.01], [0.567902, 0.713448, 0.644865]),
    ([0.01, 0.2, -0.9], [0.979194, 0.62888, 0.823263]),
    ([-0.01, 0.2, -0.9], [0.967861, 0.636356, 0.842554]),
];

/// Mean of cos·radiance/pdf over light samples at a surface with normal `n`.
fn irradiance(scene: &Scene, p: Vec3, n: Vec3, samples: usize, seed: u64) -> Moments {
    let mut rng = TestRng::new(seed);
    let reference = LightReference { p, n: Some(n), without_sky: false };
    let mut moments = Moments::default();
    for _ in 0..samples {
        let value = draw(scene, &reference, &mut rng)
            .map_or(0.0, |s| f64::from(s.wi.dot(n).max(0.0)) * f64::from(s.radiance.r / s.pdf));
        moments.add(value);
    }
    moments
}

fn assert_irradiance(scene: &Scene, p: Vec3, n: Vec3, expected: f64, what: &str) {
    let moments = irradiance(scene, p, n, 20_000, 5);
    assert!(moments.p_value(expected) > level(), "{what}: {moments:?}, expected {expected}");
    assert!((moments.mean - expected).abs() < 0.05 * expected, "{what}: {}", moments.mean);
}

/// Closed forms: the disk on its axis, Lambert's sphere, and the rectangle above its corner.
#[test]
fn irradiance_has_its_closed_forms() {
    for h in [0.3, 1.0, 5.0] {
        let down = |scale| place(DVec3::new(0.0, 0.0, h), -DVec3::Z, scale);
        let disk = lit_by(ShapeKind::Disk(down(DVec3::new(0.8, 0.8, 1.0))), false);
        let expected = 2.0 * PI * 0.64 / (0.64 + h * h);
        assert_irradiance(&disk, Vec3::ZERO, Vec3::Z, expected, &format!("disk at {h}"));

        let sphere = lit_by(ShapeKind::Sphere(down(DVec3::splat(0.9 * h))), false);
        let expected = 2.0 * PI * 0.81;
        assert_irradiance(&sphere, Vec3::ZERO, Vec3::Z, expected, &format!("sphere at {h}"));

        let (a, b) = (0.9, 0.5);
        let corner = place(DVec3::new(0.0, 0.0, h), -DVec3::Z, DVec3::new(a, b, 1.0));
        let rectangle = lit_by(ShapeKind::Rectangle(corner), false);
        let p = corner.point(Vec3::new(1.0, 1.0, 0.0)) - Vec3::Z * h as f32;
        let (x, y) = (2.0 * a / h, 2.0 * b / h);
        let half = |x: f64, y: f64| x / (1.0 + x * x).sqrt() * (y / (1.0 + x * x).sqrt()).atan();
        let expected = 2.0 * 0.5 * (half(x, y) + half(y, x));
        assert_irradiance(&rectangle, p, Vec3::Z, expected, &format!("rectangle at {h}"));
    }
}

#[test]
fn point_spot_and_directional() {
    let mut t = TestScene::default();
    let position = Vec3::new(0.0, 0.0, 2.0);
    t.tables.emitters.emitters.push(Emitter::Point { position, intensity: Rgb::splat(8.0) });
    let scene = t.build();
    let s = draw(&scene, &at(0.0, 0.0, 0.0), &mut TestRng::new(1)).unwrap();
    assert!(s.is_delta && s.pdf == 1.0 && s.wi == Vec3::Z && s.distance == 2.0);
    assert_eq!(s.radiance, Rgb::splat(2.0));
    assert!(
        draw(
            &scene,
            &LightReference { p: position, n: None, without_sky: false },
            &mut TestRng::new(1)
        )
        .is_none()
    );

    let mut t = TestScene::default();
    let (direction, irradiance) = (Vec3::new(0.0, 0.6, -0.8), Rgb::splat(3.0));
    t.tables.emitters.emitters.push(Emitter::Directional { direction, irradiance });
    let scene = t.build();
    let s = draw(&scene, &at(0.0, 0.0, 0.0), &mut TestRng::new(1)).unwrap();
    assert!(s.is_delta && s.pdf == 1.0 && s.wi == -direction && s.distance.is_infinite());
    assert_eq!(s.radiance, irradiance);
    assert!(!scene.lights.has_environment());
    assert_eq!(s.shadow_ray(Vec3::ONE).t_max, f32::INFINITY);
}

/// Falloff without and with the texture of `envmap_scene`, printed by Mitsuba 3.9.1: intensity
/// (2, 3, 4), cutoff 25°, beam 10°, along +z, times the squared distance.
#[test]
fn spot_as_in_mitsuba() {
    for textured in [false, true] {
        let mut t = TestScene::default();
        t.tables
            .textures
            .images
            .push(envmap_scene(Transform::IDENTITY).tables.textures.images[0].clone());
        t.tables.textures.textures.push(Texture::Bitmap {
            image: ImageId(0),
            filter: TextureFilter::Bilinear,
            wrap: WrapMode::Repeat,
            to_uv: UvTransform::IDENTITY,
            scale: 1.0,
        });
        t.tables.emitters.emitters.push(Emitter::Spot {
            to_world: Transform::IDENTITY,
            intensity: Rgb::new(2.0, 3.0, 4.0),
            cutoff_angle: 25.0_f32.to_radians(),
            beam_width: 10.0_f32.to_radians(),
            texture: textured.then_some(TextureId(0)),
        });
        let scene = t.build();
        for (p, plain, with_texture) in SPOT_VALUES {
            let p = Vec3::from(p);
            let sample = draw(
                &scene,
                &LightReference { p, n: None, without_sky: false },
                &mut TestRng::new(1),
            );
            let value = sample.map_or(Rgb::BLACK, |s| s.radiance * p.length_squared());
            let expected = if textured { with_texture } else { plain };
            for (v, e) in value.to_array().into_iter().zip(expected) {
                assert!((v - e).abs() < 1e-5, "{p}: {value:?}, expected {expected:?}");
            }
        }
    }
}

/// Point, falloff times intensity, the same with the texture.
type SpotValue = ([f32; 3], [f32; 3], [f32; 3]);
const SPOT_VALUES: [SpotValue; 5] = [
    ([0.0, 0.0, 2.0], [2.000000, 3.000000, 4.000000], [1.272727, 1.227273, 0.727273]),
    ([0.2, 0.1, 1.0], [1.65275, 2.479126, 3.305501], [0.588734, 1.31128, 1.259795]),
    ([0.35, -0.1, 1.0], [0.66643, 0.999645, 1.33286], [0.380013, 0.342661, 0.820388]),
    ([-0.2, -0.3, 1.0], [0.689729, 1.034594, 1.379458], [0.306725, 0.424438, 0.761189]),
    ([0.4, 0.3, 1.0], [0.000000, 0.000000, 0.000000], [0.000000, 0.000000, 0.000000]),
];

#[test]
fn textured_lights_shine_what_the_texture_says() {
    let mut t = TestScene::default();
    let color0 = t.color(Rgb::splat(2.0));
    let color1 = t.color(Rgb::BLACK);
    let shape = add_light(&mut t, rectangle(), false, Rgb::WHITE);
    t.tables.textures.textures.push(Texture::Checkerboard {
        color0,
        color1,
        to_uv: UvTransform::IDENTITY,
    });
    let radiance = TextureId(t.tables.textures.textures.len() as u32 - 1);
    t.tables.emitters.emitters[0] = Emitter::Area { shape, radiance };
    let scene = t.build();
    let reference = at(0.3, 0.1, 2.0);
    let mut rng = TestRng::new(1);
    let (mut lit, mut agreeing) = (0, 0);
    for _ in 0..1000 {
        let s = draw(&scene, &reference, &mut rng).unwrap();
        let si = scene.intersect(&Ray::new(reference.p, s.wi));
        let seen = si.map(|si| scene.lights.emitted_radiance(&scene.tables, &si));
        agreeing += usize::from(seen == Some(s.radiance));
        lit += usize::from(!s.radiance.is_black());
    }
    // Half of the texture is black; rounding may take a few points over an edge.
    assert!(agreeing >= 995 && (400..600).contains(&lit), "{agreeing}, {lit}");
}

#[test]
fn a_quad_of_two_triangles_is_one_light() {
    let corner = |x: f32, z: f32| Vec3::new(x, 548.8, z);
    let positions =
        vec![corner(343., 227.), corner(343., 332.), corner(213., 332.), corner(213., 227.)];
    let quad = |triangles: Vec<[u32; 3]>, positions: &[Vec3], normals: Vec<Vec3>| {
        let mut t = TestScene::default();
        let positions = positions.to_vec();
        let kind = mesh(&mut t, Mesh { positions, normals, triangles, ..Mesh::default() });
        add_light(&mut t, kind, false, Rgb::WHITE);
        t.build()
    };
    let scene = quad(vec![[0, 1, 2], [0, 2, 3]], &positions, vec![]);
    assert_eq!(scene.lights.light_count(), 1);
    check(&scene, &at(300.0, 300.0, 300.0), 1, "merged quad");
    check(&scene, &at(300.0, 500.0, 300.0), 2, "merged quad, near");
    let scene = quad(vec![[0, 1, 2], [2, 3, 0]], &positions, vec![-Vec3::Y; 4]);
    assert_eq!(scene.lights.light_count(), 1);
    // Turned around, leaning or of another shape: two lights.
    for (triangles, moved) in [
        (vec![[0, 1, 2], [0, 3, 2]], Vec3::ZERO),
        (vec![[0, 1, 2], [0, 2, 3]], Vec3::new(0.0, 0.01, 0.0)),
        (vec![[0, 1, 2], [0, 2, 3]], Vec3::new(0.1, 0.0, 0.0)),
    ] {
        let mut positions = positions.clone();
        positions[3] += moved;
        assert_eq!(quad(triangles, &positions, vec![]).lights.light_count(), 2);
    }
}

/// Many lights of all kinds, each found with the density that is said, whose sum is 1.
#[test]
fn many_lights_of_all_kinds() {
    let mut t = TestScene::default();
    let mut rng = TestRng::new(11);
    let mut random = |scale: f64| {
        let mut next = || f64::from(rng.next_f32()) - 0.5;
        DVec3::new(next(), next(), next()) * scale
    };
    for i in 0..40 {
        let transform = place(random(6.0) + DVec3::Z * 4.0, random(1.0), DVec3::splat(0.2));
        let kind = match i % 4 {
            0 => ShapeKind::Rectangle(transform),
            1 => ShapeKind::Sphere(transform),
            2 => ShapeKind::Disk(transform),
            _ => ShapeKind::Cylinder(transform),
        };
        add_light(&mut t, kind, false, Rgb::splat(1.0 + i as f32));
    }
    t.tables.emitters.emitters.push(Emitter::Constant { radiance: Rgb::splat(0.5) });
    let scene = t.build();
    // Lights hide each other: only what is visible has a density by a ray. So compare each
    // sample's density with that of the surface it lies on.
    let reference = at(0.0, 0.0, 0.0);
    let mut moments = Moments::default();
    let mut draws = TestRng::new(3);
    let mut compared = 0;
    for _ in 0..20_000 {
        let Some(s) = draw(&scene, &reference, &mut draws) else {
            moments.add(0.0);
            continue;
        };
        moments.add(f64::from(s.radiance.r / s.pdf));
        if s.target.is_some() && !scene.occluded(&s.shadow_ray(reference.p)) {
            let found = density(&scene, &reference, s.wi);
            compared += usize::from((f64::from(s.pdf) - found).abs() < 1e-2 * found);
        }
    }
    assert!(compared > 3000, "{compared}");
    // The integral of radiance over all directions, by each light alone.
    let expected: f64 = alone(&scene.tables, reference);
    assert!(moments.p_value(expected) > level(), "{moments:?}, expected {expected}");
}

/// Integral of radiance over solid angle, each emitter sampled alone so finely that its error is
/// small.
fn alone(tables: &SceneTables, reference: LightReference) -> f64 {
    let mut total = 0.0;
    for i in 0..tables.emitters.emitters.len() {
        let mut one = tables.clone();
        let kept = one.emitters.emitters[i].clone();
        one.emitters.emitters = vec![kept];
        let lights = LightSampler::build(&one).expect("one light is usable");
        let n = 64;
        for k in 0..n * n {
            let u = Vec2::new((k % n) as f32 + 0.5, (k / n) as f32 + 0.5) / n as f32;
            if let Some(s) = lights.sample(&one, &reference, 0.5, u) {
                total += f64::from(s.radiance.r / s.pdf) / f64::from(n * n);
            }
        }
    }
    total
}

#[test]
fn surfaces_without_light_have_none() {
    let mut t = TestScene::default();
    let black = t.diffuse(Rgb::BLACK);
    t.shape(rectangle(), black);
    let scene = t.build();
    let ray = Ray::new(Vec3::new(0.1, 0.2, 3.0), -Vec3::Z);
    let si: SurfaceInteraction = scene.intersect(&ray).unwrap();
    assert!(scene.lights.emitted_radiance(&scene.tables, &si).is_black());
    assert_eq!(scene.lights.pdf_surface(&scene.tables, &at(0.1, 0.2, 3.0), ray.d, &si), 0.0);
    assert!(draw(&scene, &at(0.0, 0.0, 3.0), &mut TestRng::new(1)).is_none());
    assert_eq!(scene.lights.light_count(), 0);
}

#[test]
fn bad_environment_maps_are_refused() {
    for image in
        [Image::default(), Image { width: 1, height: 1, channels: 1, data: vec![f32::NAN] }]
    {
        let mut tables = SceneTables::default();
        tables.textures.images.push(image);
        tables.emitters.emitters.push(Emitter::Envmap {
            image: ImageId(0),
            scale: 1.0,
            to_world: Transform::IDENTITY,
        });
        let result = LightSampler::build(&tables);
        assert_eq!(result.err(), Some(LightError::EnvironmentMap { emitter: 0 }));
    }
}
