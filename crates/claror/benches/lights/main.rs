//! What the choice among many lights costs and gains.
//!
//! `cargo bench --bench lights`, after `--` perhaps the numbers of lights. Small triangles that shine downwards, as many as given, of very
//! different power, below the ceiling of a hall; receivers on its floor. Printed are the CPU time
//! of a light sample and the relative variance of the irradiance (without visibility) that it
//! estimates from one sample.

#[path = "../trace/clock.rs"]
mod clock;

use claror::bsdf::BsdfId;
use claror::emitter::{Emitter, EmitterId, LightReference, LightSampler};
use claror::math::statistics::{Moments, TestRng};
use claror::math::{Vec2, Vec3};
use claror::scene::SceneTables;
use claror::shape::{Mesh, MeshId, Shape, ShapeId, ShapeKind};
use claror::spectrum::Rgb;
use claror::texture::{Texture, TextureId};
use clock::Clock;

const SAMPLES: usize = 1 << 20;
const SAMPLES_PER_RECEIVER: usize = 1 << 12;
/// Edge of the hall's floor.
const HALL: f32 = 100.0;

fn main() {
    println!("{:>8}  {:>9}  {:>10}  {:>18}", "lights", "build s", "ns/sample", "relative variance");
    let given: Vec<usize> = std::env::args().filter_map(|arg| arg.parse().ok()).collect();
    let counts = if given.is_empty() { &[1, 10, 100, 1000, 10_000, 100_000][..] } else { &given };
    for &count in counts {
        bench(count);
    }
}

fn bench(count: usize) {
    let tables = hall(count);
    let wall = std::time::Instant::now();
    let lights = LightSampler::build(&tables).expect("the lights are sound");
    let build = wall.elapsed().as_secs_f64();
    let receivers = SAMPLES / SAMPLES_PER_RECEIVER;
    let (seconds, variance) = Clock::new().time(|| {
        let mut rng = TestRng::new(2);
        (0..receivers).map(|_| relative_variance(&tables, &lights, &mut rng)).sum::<f64>()
    });
    let time = seconds / SAMPLES as f64 * 1e9;
    println!("{count:>8}  {build:>9.3}  {time:>10.0}  {:>18.2}", variance / receivers as f64);
}

/// Of the irradiance from one light sample at a random place on the floor.
fn relative_variance(tables: &SceneTables, lights: &LightSampler, rng: &mut TestRng) -> f64 {
    let p = Vec3::new(rng.next_f32() * HALL, rng.next_f32() * HALL, 0.0);
    let reference = LightReference { p, n: Some(Vec3::Z), without_sky: false };
    let mut moments = Moments::default();
    for _ in 0..SAMPLES_PER_RECEIVER {
        let u_select = rng.next_f32();
        let sample = lights.sample(tables, &reference, u_select, rng.next_vec2());
        moments.add(sample.map_or(0.0, |s| f64::from(s.wi.z.max(0.0) * s.radiance.r / s.pdf)));
    }
    moments.variance() / (moments.mean * moments.mean)
}

/// One mesh per power of ten in radiance, so that the lights differ.
fn hall(count: usize) -> SceneTables {
    let mut tables = SceneTables::default();
    let mut rng = TestRng::new(1);
    for (i, radiance) in [1.0, 10.0, 100.0].into_iter().enumerate() {
        let mut mesh = Mesh::default();
        for _ in 0..(count + 2 - i) / 3 {
            let place = rng.next_vec2() * HALL;
            let corner = place.extend(8.0 + 2.0 * rng.next_f32());
            let first = mesh.positions.len() as u32;
            let turn = Vec2::from_angle(6.0 * rng.next_f32()).extend(0.0);
            mesh.positions.extend([
                corner,
                corner + 0.1 * turn.cross(Vec3::Z),
                corner + 0.1 * turn,
            ]);
            mesh.triangles.push([first, first + 2, first + 1]);
        }
        tables.shapes.meshes.push(mesh);
        tables.shapes.shapes.push(Shape {
            kind: ShapeKind::Mesh(MeshId(i as u32)),
            bsdf: BsdfId(0),
            emitter: Some(EmitterId(i as u32)),
            flip_normals: false,
        });
        tables.textures.textures.push(Texture::Constant(Rgb::splat(radiance)));
        let (shape, radiance) = (ShapeId(i as u32), TextureId(i as u32));
        tables.emitters.emitters.push(Emitter::Area { shape, radiance });
    }
    tables
}
