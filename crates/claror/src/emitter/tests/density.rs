//! Samples of lights against their densities.

use crate::emitter::{LightReference, LightSample};
use crate::math::statistics::{Moments, SphereTest, TestRng, sidak};
use crate::math::warp::uniform_sphere;
use crate::math::{Frame, Ray, Vec2, Vec3};
use crate::scene::Scene;
use std::f64::consts::PI;

/// Level of each chi-square test here; there are fewer than 100 of them.
pub(super) fn level() -> f64 {
    sidak(0.01, 100)
}

/// Density of the direction `d` by what the ray kernel says that is hit.
pub(super) fn density(scene: &Scene, reference: &LightReference, d: Vec3) -> f64 {
    let pdf = match scene.intersect(&Ray::new(reference.p, d)) {
        Some(si) if scene.lights.emitted_radiance(&scene.tables, &si).is_black() => 0.0,
        Some(si) => scene.lights.pdf_surface(&scene.tables, reference, d, &si),
        None => scene.lights.pdf_environment(&scene.tables, reference, d),
    };
    f64::from(pdf)
}

pub(super) fn draw(
    scene: &Scene,
    reference: &LightReference,
    rng: &mut TestRng,
) -> Option<LightSample> {
    let u_select = rng.next_f32();
    scene.lights.sample(&scene.tables, reference, u_select, rng.next_vec2())
}

/// A map of the sphere onto itself that blows up the surroundings of a direction, so that a small
/// light fills many cells of a chi-square test: scaling of the stereographic projection.
struct Zoom {
    frame: Frame,
    factor: f32,
}

impl Zoom {
    /// Onto these directions.
    fn onto(directions: &[Vec3]) -> Self {
        let axis = directions.iter().sum::<Vec3>().normalize_or(Vec3::Z);
        let widest = directions.iter().map(|d| (*d - axis).length()).fold(0.0, f32::max);
        let half_angle = (0.5 * widest).min(1.0).asin();
        // Edges must not fall onto those of the cells.
        Self { frame: Frame::from_normal(axis), factor: (0.8 / half_angle.tan()).max(1.0) }
    }

    /// Scales the tangent of half of the angle to the axis; also the scale of lengths there.
    fn scaled(d: Vec3, factor: f32) -> (Vec3, f32) {
        let (x, y) = (d.x / (1.0 + d.z), d.y / (1.0 + d.z));
        let before = x * x + y * y;
        let after = factor * factor * before;
        let scale = 2.0 * factor / (1.0 + after);
        let image = Vec3::new(x * scale, y * scale, (1.0 - after) / (1.0 + after));
        (image, factor * (1.0 + before) / (1.0 + after))
    }

    fn forward(&self, d: Vec3) -> Vec3 {
        Self::scaled(self.frame.to_local(d), self.factor).0
    }

    /// The original of a direction, and the solid angle there over that here.
    fn back(&self, d: Vec3) -> (Vec3, f64) {
        let (d, scale) = Self::scaled(d, 1.0 / self.factor);
        (self.frame.to_world(d), f64::from(scale * scale))
    }
}

/// Chi-square of the sampled directions, and each sample's own pdf and radiance against those of
/// the surface that a ray finds there.
pub(super) fn check(scene: &Scene, reference: &LightReference, seed: u64, what: &str) {
    let zoom = check_each(scene, reference, seed, what);
    let mut rng = TestRng::new(seed + 1000);
    let test = SphereTest {
        rows: 16,
        columns: 16,
        subdivisions: 32,
        samples: 30_000,
        ..SphereTest::default()
    };
    let sample = |_| {
        let sample = draw(scene, reference, &mut rng)?;
        let is_visible = !scene.occluded(&sample.shadow_ray(reference.p));
        is_visible.then(|| zoom.forward(sample.wi))
    };
    let result = test.run(sample, |d| {
        let (d, scale) = zoom.back(d);
        density(scene, reference, d) * scale
    });
    assert!(result.p_value > level(), "{what}: {result:?}");
}

/// The same for densities with poles, which quadrature fails on: per cell of directions, the
/// solid angle of the light that the samples' mean of 1/pdf says, against that by stratified rays.
pub(super) fn check_solid_angles(scene: &Scene, reference: &LightReference, seed: u64, what: &str) {
    const CELLS: usize = 4;
    const STRATA: usize = 400;
    let zoom = check_each(scene, reference, seed, what);
    let cell = |d: Vec3| {
        let of = |x: f32| ((0.5 * (x + 1.0) * CELLS as f32) as usize).min(CELLS - 1);
        let at = zoom.frame.to_local(d).truncate() * 2.0;
        of(at.x.clamp(-1.0, 1.0)) * CELLS + of(at.y.clamp(-1.0, 1.0))
    };
    let mut expected = [0.0; CELLS * CELLS];
    for i in 0..STRATA * STRATA {
        let u = Vec2::new((i % STRATA) as f32 + 0.5, (i / STRATA) as f32 + 0.5) / STRATA as f32;
        let (d, scale) = zoom.back(uniform_sphere(u));
        let is_lit = density(scene, reference, d) > 0.0;
        expected[cell(d)] += f64::from(u8::from(is_lit)) * 4.0 * PI * scale;
    }
    let mut moments = [Moments::default(); CELLS * CELLS];
    let mut rng = TestRng::new(seed + 1000);
    for _ in 0..20_000 {
        let sample = draw(scene, reference, &mut rng)
            .filter(|s| !scene.occluded(&s.shadow_ray(reference.p)));
        for (c, m) in moments.iter_mut().enumerate() {
            m.add(sample.filter(|s| cell(s.wi) == c).map_or(0.0, |s| f64::from(1.0 / s.pdf)));
        }
    }
    let rays = (STRATA * STRATA) as f64;
    for (m, e) in moments.iter().zip(expected.map(|e| e / rays)) {
        assert!((m.mean - e).abs() < 0.02 * e || m.p_value(e) > level(), "{what}: {m:?}, {e}");
    }
}

/// Each sample's own pdf and visibility against what a ray finds.
fn check_each(scene: &Scene, reference: &LightReference, seed: u64, what: &str) -> Zoom {
    let mut rng = TestRng::new(seed);
    let mut disagreeing = 0;
    let mut directions = vec![];
    for _ in 0..1000 {
        let Some(sample) = draw(scene, reference, &mut rng) else { continue };
        assert!((sample.wi.length() - 1.0).abs() < 1e-5, "{what}: {sample:?}");
        directions.push(sample.wi);
        let shadow_ray = sample.shadow_ray(reference.p);
        let is_hidden = scene.occluded(&shadow_ray);
        if is_hidden && let Some(blocker) = scene.intersect(&shadow_ray) {
            // Another light, or the dark side of a shape that shines inwards.
            let dark = scene.lights.emitted_radiance(&scene.tables, &blocker).is_black();
            assert!(dark || blocker.t < 0.99 * sample.distance, "{what}: shadowed by itself");
        }
        let found = density(scene, reference, sample.wi);
        // At the very edge of a light a ray may pass by.
        if !is_hidden && (f64::from(sample.pdf) - found).abs() > 2e-3 * found {
            disagreeing += 1;
        }
    }
    assert!(disagreeing <= 5, "{what}: {disagreeing} of 1000 densities differ");
    Zoom::onto(&directions)
}
