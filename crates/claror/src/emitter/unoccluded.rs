//! Irradiance of a surface by a light if nothing is in the way, in closed form.
//!
//! A light sample then has to tell no more than visibility (Heitz, Hill and McGuire 2018:
//! Combining analytic direct illumination and stochastic shadows): where a light is wholly
//! visible, nothing of its noise is left.

use std::f64::consts::{FRAC_1_PI, PI};

use super::LightSampler;
use super::area::Area;
use super::light::{AlignedLight, Light, LightTables};
use crate::math::{DVec3, Vec3};
use crate::scene::SceneTables;
use crate::spectrum::Rgb;

/// With more lights the closed forms of all of them cost more than samples of some.
const MAX_LIGHTS: usize = 8;

impl LightSampler {
    /// Whether [`LightSampler::unoccluded_irradiance`] knows all lights at finite places, and
    /// there are some.
    pub fn has_closed_form(&self) -> bool {
        let lights = &self.flat.lights;
        (1..=MAX_LIGHTS).contains(&lights.len())
            && lights.iter().all(|AlignedLight(light)| self.is_closed(light))
    }

    fn is_closed(&self, light: &Light) -> bool {
        match light {
            Light::Area(light) => {
                self.flat.is_uniform(light.source) && light.area.has_closed_form()
            }
            Light::Point { .. } => true,
            Light::Spot(spot) => spot.texture.is_none(),
        }
    }

    /// Irradiance (W·m⁻²) by all lights at finite places, as if nothing stood in their way, of a
    /// surface at `p` with unit normal `n`. Only where [`LightSampler::has_closed_form`].
    pub fn unoccluded_irradiance(&self, tables: &SceneTables, p: Vec3, n: Vec3) -> Rgb {
        let tables = self.flat.tables(tables);
        let lights = self.flat.lights.iter();
        lights.fold(Rgb::BLACK, |sum, AlignedLight(l)| sum + l.unoccluded_irradiance(tables, p, n))
    }
}

impl Light {
    fn unoccluded_irradiance(&self, tables: LightTables, p: Vec3, n: Vec3) -> Rgb {
        let from_point = |position: Vec3, intensity: &dyn Fn(Vec3) -> Rgb| {
            let to_light = position - p;
            let distance2 = to_light.length_squared();
            let wi = to_light / distance2.sqrt();
            let scale = (n.dot(wi) / distance2).max(0.0);
            if scale.is_finite() { intensity(-wi) * scale } else { Rgb::BLACK }
        };
        match self {
            Self::Area(light) => {
                let radiance = tables.sources[light.source as usize].radiance;
                radiance * light.area.form_factor(p, n) * std::f32::consts::PI
            }
            Self::Point { position, intensity } => from_point(*position, &|_| *intensity),
            Self::Spot(spot) => from_point(spot.position, &|d| {
                spot.falloff(d).map_or(Rgb::BLACK, |(share, _)| spot.intensity * share)
            }),
        }
    }
}

impl Area {
    fn has_closed_form(&self) -> bool {
        match self {
            Self::Triangle(_) | Self::Parallelogram(_) => true,
            Self::Ellipsoid(s) => s.outer_sphere().is_some(),
            Self::SmoothTriangle(_) | Self::Disk(_) | Self::Cylinder(_) => false,
        }
    }

    /// Share of what the surface at `p` sees (weighted by the cosine to `n`) that this one would
    /// fill; 0 where there is no closed form.
    fn form_factor(&self, p: Vec3, n: Vec3) -> f32 {
        match self {
            Self::Triangle(s) => polygon(&s.outline(), s.normal(), p, n),
            Self::Parallelogram(s) => polygon(&s.outline(), s.normal(), p, n),
            Self::Ellipsoid(s) => s.outer_sphere().map_or(0.0, |(c, r)| sphere(c, r, p, n)),
            Self::SmoothTriangle(_) | Self::Disk(_) | Self::Cylinder(_) => 0.0,
        }
    }
}

/// Lambert's formula for a convex polygon that shines to the side of `facing`, the part below the
/// horizon cut off. Small lights are differences of large numbers: double precision.
fn polygon(outline: &[Vec3], facing: Vec3, p: Vec3, n: Vec3) -> f32 {
    if (p - outline[0]).dot(facing) <= 0.0 {
        return 0.0;
    }
    let (p, n) = (p.as_dvec3(), n.as_dvec3());
    let mut sum = 0.0;
    let mut edge = |a: DVec3, b: DVec3| {
        let cross = a.cross(b);
        let sin = cross.length();
        if sin > 0.0 {
            sum += sin.atan2(a.dot(b)) / sin * cross.dot(n);
        }
    };
    let Some(&last) = outline.last() else { return 0.0 };
    let mut before = last.as_dvec3() - p;
    let mut before_height = before.dot(n);
    // Where the outline goes below the horizon and comes back; a convex one does so once.
    let (mut below, mut above) = (None, None);
    for corner in outline {
        let corner = corner.as_dvec3() - p;
        let height = corner.dot(n);
        let horizon = || before + (corner - before) * (before_height / (before_height - height));
        match (before_height > 0.0, height > 0.0) {
            (true, true) => edge(before, corner),
            (true, false) => {
                let at = horizon();
                edge(before, at);
                below = Some(at);
            }
            (false, true) => {
                let at = horizon();
                edge(at, corner);
                above = Some(at);
            }
            (false, false) => {}
        }
        (before, before_height) = (corner, height);
    }
    // The edge along the horizon lies in a plane with the normal only for rounding: it adds its
    // whole angle.
    if let (Some(below), Some(above)) = (below, above) {
        edge(below, above);
    }
    (0.5 * FRAC_1_PI * sum.abs()) as f32
}

/// A sphere, cut off by the horizon or not (Snyder 1996: Area light sources for real-time
/// graphics).
fn sphere(centre: Vec3, radius: f32, p: Vec3, n: Vec3) -> f32 {
    let to_centre = centre.as_dvec3() - p.as_dvec3();
    let distance = to_centre.length();
    let sin = f64::from(radius) / distance;
    let cos_centre = to_centre.dot(n.as_dvec3()) / distance;
    if sin >= 1.0 || cos_centre <= -sin {
        return 0.0;
    }
    if cos_centre >= sin {
        return (sin * sin * cos_centre) as f32;
    }
    let sin_centre = (1.0 - cos_centre * cos_centre).max(0.0).sqrt();
    let x = (1.0 / (sin * sin) - 1.0).sqrt();
    let y = (-x * cos_centre / sin_centre).clamp(-1.0, 1.0);
    let root = sin_centre * (1.0 - y * y).sqrt();
    let factor = (cos_centre * y.acos() - x * root) * sin * sin + (root / x).atan();
    (factor / PI).max(0.0) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quadrature of cos·cos/(π·d²) over a fine grid of the parallelogram.
    fn quadrature(corner: Vec3, edges: [Vec3; 2], share: f64, p: Vec3, n: Vec3) -> f64 {
        let steps = 1500;
        let area = edges[0].as_dvec3().cross(edges[1].as_dvec3());
        let facing = area.normalize();
        let mut sum = 0.0;
        for i in 0..steps {
            for j in 0..steps {
                let (u, v) = ((f64::from(i) + 0.5) / 1500.0, (f64::from(j) + 0.5) / 1500.0);
                if share < 1.0 && u + v >= 1.0 {
                    continue;
                }
                let q = corner.as_dvec3() + edges[0].as_dvec3() * u + edges[1].as_dvec3() * v;
                let d = q - p.as_dvec3();
                let cos = d.dot(n.as_dvec3()).max(0.0) * (-d.dot(facing)).max(0.0);
                sum += cos / d.length_squared().powi(2);
            }
        }
        sum * area.length() / (PI * f64::from(steps * steps))
    }

    #[test]
    fn polygons_agree_with_quadrature_above_across_and_below_the_horizon() {
        let corner = Vec3::new(-0.6, 1.0, 2.0);
        let edges = [Vec3::new(0.2, 1.1, 0.1), Vec3::new(1.3, 0.0, 0.3)];
        let facing = edges[0].cross(edges[1]).normalize();
        let outline = [corner, corner + edges[0], corner + edges[0] + edges[1], corner + edges[1]];
        let triangle = [corner, corner + edges[0], corner + edges[1]];
        for n in [Vec3::Z, Vec3::Y, Vec3::new(0.3, -0.8, 0.52), Vec3::new(0.1, -0.99, 0.02)] {
            let n = n.normalize();
            for p in [Vec3::ZERO, Vec3::new(0.2, 1.4, 1.5), Vec3::new(-3.0, 1.5, 0.4)] {
                for (outline, share) in [(&outline[..], 1.0), (&triangle[..], 0.5)] {
                    let exact = f64::from(polygon(outline, facing, p, n));
                    let seen = quadrature(corner, edges, share, p, n);
                    let tolerance = 2e-3 * seen + 2e-5;
                    assert!((exact - seen).abs() < tolerance, "{exact} {seen} at {p} {n}");
                }
            }
        }
        assert_eq!(polygon(&outline, -facing, Vec3::ZERO, Vec3::Z), 0.0, "from behind");
    }

    /// A far and small light: differences of large numbers.
    #[test]
    fn small_lights_do_not_cancel() {
        let (size, far) = (1e-3_f32, 100.0_f32);
        let outline = [
            Vec3::new(0.0, 0.0, far),
            Vec3::new(0.0, size, far),
            Vec3::new(size, size, far),
            Vec3::new(size, 0.0, far),
        ];
        let expected = size * size / (std::f32::consts::PI * far * far);
        let found = polygon(&outline, -Vec3::Z, Vec3::ZERO, Vec3::Z);
        assert!((found / expected - 1.0).abs() < 1e-4, "{found} {expected}");
    }

    #[test]
    fn spheres_agree_with_quadrature_of_their_cone() {
        let n = Vec3::Z;
        for centre in [
            Vec3::new(0.0, 0.3, 2.0),
            Vec3::new(1.5, 0.0, 0.3),
            Vec3::new(1.5, 0.0, -0.3),
            Vec3::new(1.5, 0.0, 0.0),
            Vec3::new(0.9, 0.1, -0.7),
        ] {
            let radius = 0.8_f32;
            let axis = centre.normalize().as_dvec3();
            let sin2 = f64::from(radius * radius / centre.length_squared());
            let frame = crate::math::Frame::from_normal(axis.as_vec3());
            let (mut sum, steps) = (0.0, 1000);
            let least = (1.0 - sin2).sqrt();
            for i in 0..steps {
                for j in 0..steps {
                    let cos = 1.0 - (1.0 - least) * (f64::from(i) + 0.5) / f64::from(steps);
                    let phi = 2.0 * PI * (f64::from(j) + 0.5) / f64::from(steps);
                    let sin = (1.0 - cos * cos).sqrt();
                    let local = DVec3::new(sin * phi.cos(), sin * phi.sin(), cos).as_vec3();
                    sum += f64::from(frame.to_world(local).dot(n).max(0.0));
                }
            }
            let seen = sum * 2.0 * (1.0 - least) / f64::from(steps * steps);
            let exact = f64::from(sphere(centre, radius, Vec3::ZERO, n));
            assert!((exact - seen).abs() < 1e-4 * seen + 1e-6, "{exact} {seen} at {centre}");
        }
        assert_eq!(sphere(Vec3::new(0.0, 0.0, -2.0), 1.0, Vec3::ZERO, n), 0.0);
    }
}
