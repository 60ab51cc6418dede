use super::{Sensor, SensorKind};
use crate::math::{Ray, Vec2, Vec3};

/// A [`Sensor`] made ready to send rays.
#[derive(Debug, Clone)]
pub struct Camera {
    projection: Projection,
    to_world: crate::math::Transform,
    near_clip: f32,
    far_clip: f32,
    /// Columns and rows of the whole film.
    film: Vec2,
    /// Camera space of film coordinate (0, 0) and of one film width and height: the position is
    /// `corner − film_fraction · span`, on the plane z = 1 where there is perspective.
    corner: Vec2,
    span: Vec2,
}

#[derive(Debug, Clone, Copy)]
enum Projection {
    Pinhole,
    Lens { radius: f32, focus_distance: f32 },
    Parallel,
}

impl Camera {
    /// Ready for rays.
    pub fn new(sensor: &Sensor) -> Self {
        let film = Vec2::new(sensor.film.width as f32, sensor.film.height as f32);
        let aspect = film.x / film.y;
        let (projection, half_width, offset) = match sensor.kind {
            SensorKind::Perspective { fov_x, principal_point_offset } => {
                (Projection::Pinhole, (0.5 * fov_x).tan(), principal_point_offset)
            }
            SensorKind::ThinLens {
                fov_x,
                principal_point_offset,
                aperture_radius,
                focus_distance,
            } => {
                let lens = Projection::Lens { radius: aperture_radius, focus_distance };
                (lens, (0.5 * fov_x).tan(), principal_point_offset)
            }
            SensorKind::Orthographic => (Projection::Parallel, 1.0, Vec2::ZERO),
        };
        let span = 2.0 * half_width * Vec2::new(1.0, 1.0 / aspect);
        Self {
            projection,
            to_world: sensor.to_world,
            near_clip: sensor.near_clip,
            far_clip: sensor.far_clip,
            film,
            corner: 0.5 * span - offset * span,
            span,
        }
    }

    /// True when [`Camera::ray`] uses its lens sample.
    pub fn has_lens(&self) -> bool {
        matches!(self.projection, Projection::Lens { .. })
    }

    /// The ray through the film position `film` (pixels of the whole film, row 0 at the top) and
    /// the point of the lens that belongs to `lens` ∈ [0, 1)². It starts on the near clip plane
    /// and ends on the far one; its direction is a unit vector.
    pub fn ray(&self, film: Vec2, lens: Vec2) -> Ray {
        let xy = self.corner - film / self.film * self.span;
        let (origin, direction) = match self.projection {
            Projection::Parallel => {
                let o = self.to_world.point(xy.extend(self.near_clip));
                let d = self.to_world.vector(Vec3::Z).normalize();
                return Ray { o, d, t_max: self.far_clip - self.near_clip };
            }
            Projection::Pinhole => (Vec3::ZERO, xy.extend(1.0)),
            Projection::Lens { radius, focus_distance } => {
                let o = (radius * square_to_disk(lens)).extend(0.0);
                (o, (xy * focus_distance).extend(focus_distance) - o)
            }
        };
        let direction = direction.normalize();
        let near = self.near_clip / direction.z;
        let d = self.to_world.vector(direction).normalize();
        let o = self.to_world.point(origin) + d * near;
        Ray { o, d, t_max: self.far_clip / direction.z - near }
    }

    /// The film position at which the point `p` is seen, pixels of the whole film; with a lens
    /// through its centre. `None` where no ray goes: not between the clip planes. What
    /// [`Camera::ray`] reaches from a position comes back to it.
    pub fn project(&self, p: Vec3) -> Option<Vec2> {
        let local = self.to_world.inverse_point(p);
        if !(local.z >= self.near_clip && local.z <= self.far_clip) {
            return None;
        }
        let xy = match self.projection {
            Projection::Parallel => local.truncate(),
            Projection::Pinhole | Projection::Lens { .. } => local.truncate() / local.z,
        };
        let film = (self.corner - xy) / self.span * self.film;
        film.is_finite().then_some(film)
    }
}

/// Unit square → unit disk, equal areas (Shirley and Chiu 1997, the concentric map).
fn square_to_disk(u: Vec2) -> Vec2 {
    use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};
    let p = 2.0 * u - Vec2::ONE;
    if p == Vec2::ZERO {
        return p;
    }
    let (radius, angle) = if p.x.abs() > p.y.abs() {
        (p.x, FRAC_PI_4 * p.y / p.x)
    } else {
        (p.y, FRAC_PI_2 - FRAC_PI_4 * p.x / p.y)
    };
    radius * Vec2::from_angle(angle)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{CropWindow, FilmSettings, FilterKind};
    use crate::math::{DAffine3, DMat3, DVec3, Transform};
    use crate::sampler::{SamplerKind, SamplerSettings};

    /// Mitsuba's `lookat`: +z of the camera to the target, +x to the left.
    fn look_at(origin: DVec3, target: DVec3, up: DVec3) -> Transform {
        let z = (target - origin).normalize();
        let x = up.cross(z).normalize();
        let axes = DMat3::from_cols(x, z.cross(x), z);
        Transform::new(DAffine3::from_mat3_translation(axes, origin)).unwrap()
    }

    fn sensor(kind: SensorKind) -> Sensor {
        let up = DVec3::Y;
        Sensor {
            name: String::new(),
            kind,
            to_world: look_at(DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.2, 0.5, -0.3), up),
            near_clip: 0.5,
            far_clip: 20.0,
            film: FilmSettings {
                width: 160,
                height: 100,
                crop: CropWindow { x: 20, y: 10, width: 96, height: 64 },
                filter: FilterKind::Box { radius: 0.5 },
                alpha: false,
            },
            sampler: SamplerSettings { kind: SamplerKind::Sobol, sample_count: 1, seed: 0 },
        }
    }

    /// Rays of Mitsuba 3.9.1 (`sensor.sample_ray`, scalar_rgb) at the crop positions (0.1, 0.2)
    /// and (0.7, 0.9), lens sample (0.3, 0.8): origin, direction, length.
    fn agrees(kind: SensorKind, expected: [[f32; 7]; 2]) {
        let camera = Camera::new(&sensor(kind));
        for (crop, e) in [(Vec2::new(0.1, 0.2), expected[0]), (Vec2::new(0.7, 0.9), expected[1])] {
            let film = Vec2::new(20.0, 10.0) + crop * Vec2::new(96.0, 64.0);
            let ray = camera.ray(film, Vec2::new(0.3, 0.8));
            let o = Vec3::new(e[0], e[1], e[2]);
            let d = Vec3::new(e[3], e[4], e[5]);
            assert!((ray.o - o).length() < 3e-6, "{kind:?}: {} for {o}", ray.o);
            assert!((ray.d - d).length() < 3e-6, "{kind:?}: {} for {d}", ray.d);
            assert!((ray.t_max - e[6]).abs() < 3e-5, "{kind:?}: {} for {}", ray.t_max, e[6]);
        }
    }

    #[test]
    fn perspective_agrees_with_mitsuba() {
        let kind = SensorKind::Perspective {
            fov_x: 40.0_f32.to_radians(),
            principal_point_offset: Vec2::new(0.1, -0.2),
        };
        agrees(
            kind,
            [
                [0.805973, 1.896175, 2.531784, -0.375039, -0.200685, -0.905025, 20.176_695],
                [0.943016, 1.802954, 2.540935, -0.113332, -0.391891, -0.913004, 19.60948],
            ],
        );
    }

    #[test]
    fn thin_lens_agrees_with_mitsuba() {
        let kind = SensorKind::ThinLens {
            fov_x: 40.0_f32.to_radians(),
            principal_point_offset: Vec2::ZERO,
            aperture_radius: 0.25,
            focus_distance: 3.0,
        };
        agrees(
            kind,
            [
                [0.825366, 1.953581, 2.500989, -0.454424, -0.319328, -0.831582, 20.18171],
                [0.962409, 1.86036, 2.51014, -0.194742, -0.513028, -0.835989, 19.64843],
            ],
        );
    }

    #[test]
    fn orthographic_agrees_with_mitsuba() {
        agrees(
            SensorKind::Orthographic,
            [
                [0.247612, 2.108966, 2.570421, -0.215509, -0.404079, -0.888975, 19.5],
                [1.000656, 1.596721, 2.620704, -0.215509, -0.404079, -0.888975, 19.5],
            ],
        );
    }

    /// Whatever a ray passes is projected to where the ray came from; outside of the film as well.
    #[test]
    fn projection_is_the_inverse_of_rays() {
        let principal_point_offset = Vec2::new(0.1, -0.2);
        for kind in [
            SensorKind::Perspective { fov_x: 1.2, principal_point_offset },
            SensorKind::ThinLens {
                fov_x: 1.2,
                principal_point_offset,
                aperture_radius: 0.2,
                focus_distance: 2.0,
            },
            SensorKind::Orthographic,
        ] {
            let camera = Camera::new(&sensor(kind));
            for film in [Vec2::ZERO, Vec2::new(7.3, 99.5), Vec2::new(-30.0, 150.0)] {
                let ray = camera.ray(film, Vec2::splat(0.5));
                for share in [0.001, 0.1, 0.999] {
                    let seen = camera.project(ray.at(share * ray.t_max)).expect("in between");
                    assert!((seen - film).length() < 2e-3, "{kind:?}: {seen} for {film}");
                }
                for outside in [-0.01, 1.01] {
                    assert_eq!(camera.project(ray.at(outside * ray.t_max)), None, "{kind:?}");
                }
            }
            // Behind the camera.
            assert_eq!(camera.project(Vec3::new(1.8, 3.5, 6.3)), None, "{kind:?}");
        }
    }

    /// With a lens, what is in focus is seen at one position through all of it.
    #[test]
    fn projection_is_sharp_in_focus() {
        let kind = SensorKind::ThinLens {
            fov_x: 0.8,
            principal_point_offset: Vec2::ZERO,
            aperture_radius: 0.25,
            focus_distance: 3.0,
        };
        let camera = Camera::new(&sensor(kind));
        let to_world = sensor(kind).to_world;
        let film = Vec2::new(30.0, 80.0);
        let ray = camera.ray(film, Vec2::new(0.1, 0.7));
        let (o, d) = (to_world.inverse_point(ray.o), to_world.inverse_vector(ray.d));
        let seen = camera.project(ray.at((3.0 - o.z) / d.z)).expect("between the planes");
        assert!((seen - film).length() < 1e-3, "{seen}");
    }

    /// All rays of one film position meet in the plane of focus.
    #[test]
    fn lens_is_sharp_at_the_focus_distance() {
        let kind = SensorKind::ThinLens {
            fov_x: 0.8,
            principal_point_offset: Vec2::ZERO,
            aperture_radius: 0.25,
            focus_distance: 3.0,
        };
        let camera = Camera::new(&sensor(kind));
        let to_world = sensor(kind).to_world;
        let meeting = |lens: Vec2| {
            let ray = camera.ray(Vec2::new(30.0, 80.0), lens);
            let (o, d) = (to_world.inverse_point(ray.o), to_world.inverse_vector(ray.d));
            o + d * ((3.0 - o.z) / d.z)
        };
        let center = meeting(Vec2::splat(0.5));
        for lens in [Vec2::new(0.01, 0.02), Vec2::new(0.99, 0.4), Vec2::new(0.3, 0.9)] {
            assert!((meeting(lens) - center).length() < 1e-5);
        }
    }

    /// The concentric map keeps areas: a fine grid fills rings of equal area equally.
    #[test]
    fn disk_map_keeps_areas() {
        let n = 1001;
        let mut rings = [0_u32; 4];
        for i in 0..n * n {
            let u = Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32;
            rings[((square_to_disk(u).length_squared() * 4.0) as usize).min(3)] += 1;
        }
        let quarter = f64::from(n * n) / 4.0;
        assert!(rings.iter().all(|&c| (f64::from(c) / quarter - 1.0).abs() < 0.01), "{rings:?}");
    }
}
