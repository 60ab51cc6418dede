//! Which records the camera sees, and where.

use rayon::prelude::*;

use super::IrradianceCache;
use crate::bsdf::BsdfAtHit;
use crate::film::CropWindow;
use crate::integrator::light::past;
use crate::irradiance::Record;
use crate::math::{Ray, Vec2};
use crate::scene::Scene;
use crate::sensor::{Camera, Sensor};

/// What is nearer to a record than this share of its distance from the camera does not hide it:
/// its own surface, which rays meet a little before or behind it.
const OWN_SURFACE: f32 = 1e-4;
/// The same in units in the last place of the coordinates, far from the origin.
const ULPS: f32 = 16.0;
/// Invisible surfaces that are looked through.
const MAX_CHAIN: u32 = 64;

/// A record on the film.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VisibleRecord {
    /// Its number.
    pub index: usize,
    /// Where it is seen, pixels of the whole film.
    pub film: Vec2,
}

/// The records of a cache as a camera sees them, mirrors and glass not looked through.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct VisibleRecords {
    /// Those in the picture, in the order of their numbers.
    pub visible: Vec<VisibleRecord>,
    /// Number of those behind something, seen in mirrors or through glass only, or from behind.
    pub hidden: usize,
    /// Number of those outside of the crop window, or not between the clip planes.
    pub outside: usize,
}

enum Place {
    Visible(Vec2),
    Hidden,
    Outside,
}

impl IrradianceCache {
    /// Which records the sensor sees; with a lens, through its centre.
    pub fn visible_records(&self, scene: &Scene, sensor: &Sensor) -> VisibleRecords {
        let camera = Camera::new(sensor);
        let crop = sensor.film.crop;
        let places: Vec<Place> =
            self.records.par_iter().map(|record| place(scene, &camera, crop, record)).collect();
        let mut found = VisibleRecords::default();
        for (index, place) in places.into_iter().enumerate() {
            match place {
                Place::Visible(film) => found.visible.push(VisibleRecord { index, film }),
                Place::Hidden => found.hidden += 1,
                Place::Outside => found.outside += 1,
            }
        }
        found
    }
}

fn place(scene: &Scene, camera: &Camera, crop: CropWindow, record: &Record) -> Place {
    let inside = |film: &Vec2| {
        let [start, size] = [(crop.x, crop.y), (crop.width, crop.height)]
            .map(|(x, y)| Vec2::new(x as f32, y as f32));
        let at = *film - start;
        at.cmpge(Vec2::ZERO).all() && at.cmplt(size).all()
    };
    let Some(film) = camera.project(record.position).filter(inside) else {
        return Place::Outside;
    };
    let ray = camera.ray(film, Vec2::splat(0.5));
    // The ray itself is a little beside the record.
    let distance = (record.position - ray.o).dot(ray.d);
    let rounding = ULPS * f32::EPSILON * record.position.abs().max(ray.o.abs()).max_element();
    let free = distance - (OWN_SURFACE * distance.abs()).max(rounding);
    let is_turned_away = record.normal.dot(ray.d) >= 0.0;
    if is_turned_away || is_hidden(scene, Ray { t_max: free, ..ray }) {
        Place::Hidden
    } else {
        Place::Visible(film)
    }
}

/// Whether something that can be seen stands on the ray.
fn is_hidden(scene: &Scene, mut ray: Ray) -> bool {
    let tables = &scene.tables;
    let mut bsdf = BsdfAtHit::empty();
    let end = ray.at(ray.t_max);
    for _ in 0..MAX_CHAIN {
        let Some(si) = scene.intersect(&ray) else { return false };
        let shape = &tables.shapes.shapes[si.shape.0 as usize];
        tables.bsdfs.read_at_hit(&tables.textures, &tables.shapes, shape.bsdf, &si, &mut bsdf);
        let is_left_out = tables.integrator.hide_emitters && shape.emitter.is_some();
        if !is_left_out && !bsdf.is_null_only() {
            return true;
        }
        ray = past(&si, &ray);
        // From where it starts now, a little off the surface.
        ray.t_max = (end - ray.o).dot(ray.d);
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::{Bsdf, BsdfId};
    use crate::integrator::{CacheContents, IntegratorKind, IrrCacheSettings};
    use crate::math::{DVec3, Vec3};
    use crate::scene::test_scene::{TestScene, mixed_room, place as placed};
    use crate::shape::ShapeKind;
    use crate::spectrum::Rgb;

    fn cache(scene: &Scene) -> IrradianceCache {
        IrradianceCache::build(scene, &scene.tables.sensors[0], &|| false).unwrap()
    }

    fn quick(t: &mut TestScene) {
        t.tables.integrator.kind = IntegratorKind::IrradianceCache;
        t.tables.integrator.cache =
            IrrCacheSettings { gather_samples: Some(100), noise: Some(0.5), ..Default::default() };
    }

    /// In a room with a mirror ball, records are seen where the camera's rays end, and as many as
    /// have such a ray; others are hidden by the balls, or lie on what only the mirror shows.
    #[test]
    fn records_are_seen_where_rays_end() {
        let mut t = mixed_room(64);
        quick(&mut t);
        t.tables.sensors[0].film.crop.x = 10;
        t.tables.sensors[0].film.crop.width = 54;
        let scene = t.build();
        let sensor = &scene.tables.sensors[0];
        let cache = cache(&scene);
        let found = cache.visible_records(&scene, sensor);
        let count = found.visible.len();
        assert_eq!(count + found.hidden + found.outside, cache.records.len());
        assert!(
            count > 50 && found.hidden > 0 && found.outside > 0,
            "{count}, {}, {}",
            found.hidden,
            found.outside
        );
        let camera = Camera::new(sensor);
        for seen in &found.visible {
            assert!(seen.film.x >= 10.0 && seen.film.x < 64.0);
            let si = scene.intersect(&camera.ray(seen.film, Vec2::splat(0.5))).expect("a room");
            let distance = si.p.distance(cache.records[seen.index].position);
            assert!(distance < 1e-3, "{distance} from record {}", seen.index);
        }
        // The key of a record is the pixel for which it was made: seen directly, it is there.
        let by_key = cache.records.iter().enumerate().filter(|(index, record)| {
            let pixel = Vec2::new(record.key as u32 as f32, (record.key >> 32) as f32);
            let film = camera.project(record.position);
            let is_there = film.is_some_and(|f| f.distance(pixel + Vec2::splat(0.5)) < 0.6);
            let is_found = found.visible.iter().any(|seen| seen.index == *index);
            assert!(!is_there || is_found, "record {index} is in its pixel and not found");
            is_there
        });
        assert!(by_key.count() > count * 9 / 10);
    }

    /// A far, tiny, shifted room: what hides a record depends on no absolute length.
    #[test]
    fn what_hides_a_record() {
        for (scale, shift) in [(1.0, 0.0), (1e-4, 0.0), (1e4, 0.0), (1.0, 300.0)] {
            let at = |z: f64| DVec3::new(shift, 0.0, scale * z + shift);
            let make = |in_front: Option<fn(&mut TestScene) -> BsdfId>| {
                let mut t = TestScene::default();
                let grey = t.diffuse(Rgb::splat(0.5));
                let wall = |z: f64, size: f64| {
                    ShapeKind::Rectangle(placed(at(z), -DVec3::Z, DVec3::splat(size * scale)))
                };
                t.shape(wall(2.0, 3.0), grey);
                if let Some(bsdf) = in_front {
                    let bsdf = bsdf(&mut t);
                    t.shape(wall(1.99, 0.5), bsdf);
                }
                t.camera(at(0.0), at(1.0), 60.0, 100);
                t.tables.sensors[0].near_clip = (0.01 * scale) as f32;
                t.tables.sensors[0].far_clip = (100.0 * scale) as f32;
                t.build()
            };
            let record = |normal: Vec3, z: f64| Record {
                corral: 0,
                corral_distance: 0.0,
                key: 0,
                position: at(z).as_vec3(),
                normal,
                axis: Vec3::X,
                irradiance: Rgb::WHITE,
                translational: [Vec3::ZERO; 3],
                rotational: [Vec3::ZERO; 3],
                radii: [0.1 * scale as f32; 2],
                max_angle: 0.3,
                harmonic_mean_distance: 1.0,
                natural_radius: 1.0,
                flags: 0,
            };
            let look = |scene: &Scene, record: Record| {
                let contents = CacheContents { records: vec![record], ..Default::default() };
                let cache = contents.freeze(&IrrCacheSettings::default(), scene.accel.bounds());
                let found = cache.visible_records(scene, &scene.tables.sensors[0]);
                [found.visible.len(), found.hidden, found.outside]
            };
            let what = format!("scale {scale}, shift {shift}");
            let (seen, hidden, outside) = ([1, 0, 0], [0, 1, 0], [0, 0, 1]);
            let open = make(None);
            assert_eq!(look(&open, record(-Vec3::Z, 2.0)), seen, "{what}");
            assert_eq!(look(&open, record(Vec3::Z, 2.0)), hidden, "{what}: from behind");
            assert_eq!(look(&open, record(-Vec3::Z, -1.0)), outside, "{what}: behind the camera");
            let covered = make(Some(|t| t.diffuse(Rgb::WHITE)));
            assert_eq!(look(&covered, record(-Vec3::Z, 2.0)), hidden, "{what}");
            assert_eq!(look(&covered, record(-Vec3::Z, 1.99)), seen, "{what}");
            assert_eq!(look(&make(Some(TestScene::mirror)), record(-Vec3::Z, 2.0)), hidden);
            let invisible = make(Some(|t| t.bsdf(Bsdf::Null)));
            assert_eq!(look(&invisible, record(-Vec3::Z, 2.0)), seen, "{what}");
        }
    }
}
