//! The kinds of rays that a path tracer shoots.

use claror::accel::Accel;
use claror::interaction::Detail;
use claror::interaction::SurfaceInteraction;
use claror::math::{Frame, Ray, Vec3};
use claror::shape::ShapeTable;
use std::f32::consts::TAU;

/// Rays of one kind.
pub(crate) struct RaySet {
    pub(crate) name: &'static str,
    pub(crate) any_hit: bool,
    pub(crate) rays: Vec<Ray>,
}

/// Pixels of the picture whose camera rays begin everything.
const WIDTH: usize = 640;
const HEIGHT: usize = 480;
/// Strata of the hemisphere over every origin.
const STRATA: [usize; 2] = [16, 32];
/// Origins of hemispheres.
const ORIGINS: usize = 600;

/// Reproducible numbers in [0, 1) (Steele, Lea and Flood 2014: SplitMix).
pub(crate) struct Numbers(pub(crate) u64);

impl Numbers {
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub(crate) fn next(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / 16_777_216.0
    }

    fn shuffle<T>(&mut self, values: &mut [T]) {
        for i in (1..values.len()).rev() {
            values.swap(i, (self.bits() % (i as u64 + 1)) as usize);
        }
    }
}

/// All sets. The camera stands in the middle of the scene's box, a little off the centre, and looks
/// along -x: inside the room, outside of the open scene.
pub(crate) fn all(accel: &Accel, shapes: &ShapeTable) -> Vec<RaySet> {
    let mut numbers = Numbers(7);
    let primary = primary(accel);
    let hits: Vec<SurfaceInteraction> = primary
        .iter()
        .filter_map(|ray| {
            accel.intersect(shapes, ray).map(|hit| shapes.interaction(ray, &hit, Detail::Point))
        })
        .collect();
    let step = (hits.len() / ORIGINS).max(1);
    let origins: Vec<&SurfaceInteraction> = hits.iter().step_by(step).take(ORIGINS).collect();
    let ordered: Vec<Ray> = origins.iter().flat_map(|si| hemisphere(si, &mut numbers)).collect();
    let mut within = ordered.clone();
    for rays in within.chunks_mut(STRATA[0] * STRATA[1]) {
        numbers.shuffle(rays);
    }
    let mut shuffled = ordered.clone();
    numbers.shuffle(&mut shuffled);
    let shadow = hits.iter().map(|si| shadow(si, accel, &mut numbers)).collect();
    let set = |name, any_hit, rays| RaySet { name, any_hit, rays };
    vec![
        set("primary", false, primary),
        set("hemisphere in order", false, ordered),
        set("hemisphere shuffled", false, within),
        set("all shuffled", false, shuffled),
        set("shadow (any hit)", true, shadow),
    ]
}

fn primary(accel: &Accel) -> Vec<Ray> {
    let bounds = accel.bounds();
    let eye = bounds.center() + bounds.extent() * Vec3::new(0.45, 0.06, 0.04);
    let forward = (bounds.center() - eye).normalize();
    let side = forward.cross(Vec3::Y).normalize();
    let up = side.cross(forward);
    let pixel = |i: usize| {
        let x = ((i % WIDTH) as f32 + 0.5) / WIDTH as f32 - 0.5;
        let y = ((i / WIDTH) as f32 + 0.5) / HEIGHT as f32 - 0.5;
        Ray::new(eye, (forward + side * (1.6 * x) + up * (-1.2 * y)).normalize())
    };
    (0..WIDTH * HEIGHT).map(pixel).collect()
}

/// Cosine-distributed rays, one per stratum, stratum by stratum.
fn hemisphere(si: &SurfaceInteraction, numbers: &mut Numbers) -> Vec<Ray> {
    let n = if si.ng.dot(si.wo) < 0.0 { -si.ng } else { si.ng };
    let frame = Frame::from_normal(n);
    let mut rays = Vec::with_capacity(STRATA[0] * STRATA[1]);
    for i in 0..STRATA[0] {
        for j in 0..STRATA[1] {
            let u = (i as f32 + numbers.next()) / STRATA[0] as f32;
            let phi = (j as f32 + numbers.next()) / STRATA[1] as f32 * TAU;
            let local = Vec3::new(u.sqrt() * phi.cos(), u.sqrt() * phi.sin(), (1.0 - u).sqrt());
            rays.push(si.spawn_ray(frame.to_world(local).normalize()));
        }
    }
    rays
}

/// Towards a random point of a rectangle under the ceiling.
fn shadow(si: &SurfaceInteraction, accel: &Accel, numbers: &mut Numbers) -> Ray {
    let bounds = accel.bounds();
    let spread = Vec3::new(numbers.next() - 0.5, 0.0, numbers.next() - 0.5) * 0.4;
    let target = bounds.center() + bounds.extent() * (spread + Vec3::new(0.0, 0.48, 0.0));
    let distance = (target - si.p).length();
    let d = (target - si.p) / distance;
    Ray { t_max: distance * 0.999, ..si.spawn_ray(d) }
}
