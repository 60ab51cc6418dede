//! A little renderer of parallelograms and spheres with constant or linear radiance, and Lambert's
//! formula for the exact irradiance of such scenes.

use crate::irradiance::{Cell, Grid, Hemisphere};
use crate::math::statistics::{TestRng, gauss_legendre};
use crate::math::{DVec3, Vec2};
use crate::spectrum::Rgb;

/// `corner + s·u + t·v`, s and t in [0, 1].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Quad {
    pub(crate) corner: DVec3,
    pub(crate) u: DVec3,
    pub(crate) v: DVec3,
    pub(crate) radiance: f64,
    /// Added to the radiance: this times `s`.
    pub(crate) slope: f64,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct Sphere {
    pub(crate) centre: DVec3,
    pub(crate) radius: f64,
    pub(crate) radiance: f64,
}

/// Everything is seen from the origin of a frame that each call gives: see [`Scene::hemisphere`].
#[derive(Debug, Clone, Default)]
pub(crate) struct Scene {
    pub(crate) quads: Vec<Quad>,
    pub(crate) spheres: Vec<Sphere>,
    pub(crate) background: f64,
}

impl Quad {
    pub(crate) fn new(corner: [f64; 3], u: [f64; 3], v: [f64; 3], radiance: f64) -> Self {
        let [corner, u, v] = [corner, u, v].map(DVec3::from);
        Self { corner, u, v, radiance, slope: 0.0 }
    }

    fn hit(&self, o: DVec3, d: DVec3) -> Option<(f64, DVec3, f64)> {
        let n = self.u.cross(self.v);
        let t = n.dot(self.corner - o) / n.dot(d);
        if !(t > 1e-9 && t.is_finite()) {
            return None;
        }
        let p = o + t * d - self.corner;
        let (s, r) = (p.cross(self.v).dot(n), self.u.cross(p).dot(n));
        let (s, r) = (s / n.length_squared(), r / n.length_squared());
        let inside = (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&r);
        inside.then(|| (t, n.normalize(), self.radiance + self.slope * s))
    }

    /// Irradiance at `x` with normal +z, wholly visible, by quadrature.
    fn integral(&self, x: DVec3) -> f64 {
        let n = self.u.cross(self.v);
        let rule = gauss_legendre(96);
        let mut sum = 0.0;
        for &(s, ws) in &rule {
            for &(t, wt) in &rule {
                // The rule is that of [-1, 1].
                let (s, t) = (0.5 + 0.5 * s, 0.5 + 0.5 * t);
                let r = self.corner + s * self.u + t * self.v - x;
                let kernel = r.z.max(0.0) * n.dot(r).abs() / r.length_squared().powi(2);
                sum += 0.25 * ws * wt * kernel * (self.radiance + self.slope * s);
            }
        }
        sum
    }

    /// Corners relative to `x`, counter-clockwise about z as projected to the tangent plane.
    pub(crate) fn corners(&self, x: DVec3) -> Vec<DVec3> {
        let c = self.corner - x;
        vec![c, c + self.u, c + self.u + self.v, c + self.v]
    }
}

impl Scene {
    /// The walls and ceiling of a box from the origin to `size`; the floor is where receivers are.
    /// Radiance of the walls x = 0, x = max, y = 0, y = max, and the ceiling.
    pub(crate) fn room(size: [f64; 3], l: [f64; 5]) -> Self {
        let [x, y, z] = size;
        let quads = vec![
            Quad::new([0.0; 3], [0.0, y, 0.0], [0.0, 0.0, z], l[0]),
            Quad::new([x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z], l[1]),
            Quad::new([0.0; 3], [x, 0.0, 0.0], [0.0, 0.0, z], l[2]),
            Quad::new([0.0, y, 0.0], [x, 0.0, 0.0], [0.0, 0.0, z], l[3]),
            Quad::new([0.0, 0.0, z], [x, 0.0, 0.0], [0.0, y, 0.0], l[4]),
        ];
        Self { quads, ..Self::default() }
    }

    fn trace(&self, o: DVec3, d: DVec3) -> (f64, DVec3, f64) {
        let mut best = (f64::INFINITY, DVec3::ZERO, self.background);
        for hit in self.quads.iter().filter_map(|q| q.hit(o, d)) {
            if hit.0 < best.0 {
                best = hit;
            }
        }
        for s in &self.spheres {
            let to = s.centre - o;
            let along = to.dot(d);
            let inside = s.radius * s.radius - (to - along * d).length_squared();
            let t = along - inside.max(0.0).sqrt();
            if inside > 0.0 && t > 1e-9 && t < best.0 {
                best = (t, (o + t * d - s.centre) / s.radius, s.radiance);
            }
        }
        best
    }

    /// Samples from `x` with normal +z; full jitter.
    pub(crate) fn hemisphere(&self, x: [f64; 3], grid: Grid, rng: &mut TestRng) -> Hemisphere {
        self.hemisphere_with(x, grid, |_, _| rng.next_vec2())
    }

    /// Samples from `x` with normal +z.
    pub(crate) fn hemisphere_with(
        &self,
        x: [f64; 3],
        grid: Grid,
        mut jitter: impl FnMut(u32, u32) -> Vec2,
    ) -> Hemisphere {
        let (columns, rows) = grid.size();
        let mut cells = Vec::new();
        for j in 0..rows {
            for i in 0..columns {
                let direction = grid.direction(i, j, jitter(i, j));
                let (distance, normal, l) = self.trace(DVec3::from(x), direction.as_dvec3());
                cells.push(Cell {
                    direction,
                    distance: distance as f32,
                    normal: normal.as_vec3(),
                    flags: 0,
                    radiance: Rgb::new(l as f32, 0.5 * l as f32, 2.0 * l as f32),
                });
            }
        }
        Hemisphere::new(grid, cells).expect("a cell each")
    }

    /// Irradiance at `x` with normal +z of all quads with constant radiance, of which those from
    /// `occluders` on hide the others, but not each other. Of channel 0.
    pub(crate) fn irradiance(&self, x: [f64; 3], occluders: usize) -> f64 {
        let x = DVec3::from(x);
        let mut sum = 0.0;
        for (k, quad) in self.quads.iter().enumerate() {
            let seen = clip(quad.corners(x), DVec3::Z);
            let mut f = form_factor(&seen);
            if quad.slope != 0.0 {
                sum += quad.integral(x);
                continue;
            }
            if k < occluders {
                for occluder in &self.quads[occluders..] {
                    f -= form_factor(&behind(seen.clone(), &occluder.corners(x)));
                }
            }
            sum += std::f64::consts::PI * quad.radiance * f;
        }
        for s in &self.spheres {
            // Wholly above the horizon, hiding nothing that shines.
            let v = s.centre - x;
            sum +=
                std::f64::consts::PI * s.radiance * s.radius * s.radius * v.z / v.length().powi(3);
        }
        sum
    }
}

/// Lambert's formula, for a polygon above the horizon in any orientation.
pub(crate) fn form_factor(polygon: &[DVec3]) -> f64 {
    let mut sum = 0.0;
    for (k, a) in polygon.iter().enumerate() {
        let b = polygon[(k + 1) % polygon.len()];
        let c = a.cross(b);
        if c.length() > 0.0 {
            sum += c.z / c.length() * c.length().atan2(a.dot(b));
        }
    }
    (sum / std::f64::consts::TAU).abs()
}

/// The part with `plane · p ≥ 0`.
fn clip(polygon: Vec<DVec3>, plane: DVec3) -> Vec<DVec3> {
    let mut out = Vec::new();
    for (k, &a) in polygon.iter().enumerate() {
        let b = polygon[(k + 1) % polygon.len()];
        let (da, db) = (plane.dot(a), plane.dot(b));
        if da >= 0.0 {
            out.push(a);
        }
        if (da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0) {
            out.push(a + (b - a) * (da / (da - db)));
        }
    }
    out
}

/// The part of a polygon that a convex one, which is nearer, hides.
fn behind(polygon: Vec<DVec3>, occluder: &[DVec3]) -> Vec<DVec3> {
    let middle: DVec3 = occluder.iter().sum();
    (0..occluder.len()).fold(polygon, |polygon, k| {
        let plane = occluder[k].cross(occluder[(k + 1) % occluder.len()]);
        clip(polygon, if plane.dot(middle) >= 0.0 { plane } else { -plane })
    })
}

/// Gradient (x, y) and Hessian (xx, xy, yy) of a function of the position, by central differences.
pub(crate) fn differences(
    f: impl Fn([f64; 3]) -> f64,
    x: [f64; 3],
    h: f64,
) -> ([f64; 2], [f64; 3]) {
    let at = |dx: f64, dy: f64| f([x[0] + dx * h, x[1] + dy * h, x[2]]);
    let gradient =
        [(at(1.0, 0.0) - at(-1.0, 0.0)) / (2.0 * h), (at(0.0, 1.0) - at(0.0, -1.0)) / (2.0 * h)];
    let xx = (at(1.0, 0.0) + at(-1.0, 0.0) - 2.0 * at(0.0, 0.0)) / (h * h);
    let yy = (at(0.0, 1.0) + at(0.0, -1.0) - 2.0 * at(0.0, 0.0)) / (h * h);
    let xy = (at(1.0, 1.0) + at(-1.0, -1.0) - at(1.0, -1.0) - at(-1.0, 1.0)) / (4.0 * h * h);
    (gradient, [xx, xy, yy])
}
