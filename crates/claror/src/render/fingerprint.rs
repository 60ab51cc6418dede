use super::RenderSettings;
use crate::integrator::{
    CACHE_PARAMETERS, Change, GRID_PARAMETERS, GridParameter, IntegratorKind, IrrCacheSettings,
};
use crate::scene::Scene;
use crate::sensor::Sensor;

/// All that decides a picture's bits, as named values: two renders with equal fingerprints add
/// up to one picture. Or all that decides what a cache holds where.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Fingerprint {
    /// Name and value, in a fixed order.
    pub entries: Vec<(String, String)>,
}

impl Fingerprint {
    /// Name of the entry of a [`super::RenderState`] that tells its irradiance cache.
    pub const CACHE_CONTENT: &str = "content of the irradiance cache";

    /// Of a render of `scene` through `sensor`.
    pub fn new(scene: &Scene, sensor: &Sensor, settings: &RenderSettings) -> Self {
        let film = &sensor.film;
        let crop = &film.crop;
        let integrator = &scene.tables.integrator;
        let aovs: Vec<String> =
            scene.tables.aovs.iter().map(|a| format!("{}:{}", a.name, a.kind.name())).collect();
        let entries = [
            ("version", env!("CARGO_PKG_VERSION").to_owned()),
            ("scene", settings.scene_hash.clone().unwrap_or_default()),
            ("film size", format!("{} x {}", film.width, film.height)),
            (
                "crop window",
                format!("{} x {} at ({}, {})", crop.width, crop.height, crop.x, crop.y),
            ),
            ("reconstruction filter", format!("{:?}", film.filter)),
            ("sampler", format!("{:?}", sensor.sampler.kind)),
            ("seed", sensor.sampler.seed.to_string()),
            ("camera", format!("{:?}", sensor.kind)),
            ("camera transform", format!("{:?}", sensor.to_world.to_world)),
            ("clip planes", format!("{} to {}", sensor.near_clip, sensor.far_clip)),
            ("integrator", format!("{:?}", integrator.kind)),
            ("max_depth", depth(integrator.max_depth)),
            ("rr_depth", integrator.rr_depth.to_string()),
            ("early_roulette", integrator.early_roulette.to_string()),
            ("hide_emitters", integrator.hide_emitters.to_string()),
            ("further layers", aovs.join(",")),
            ("shapes", scene.tables.shapes.shapes.len().to_string()),
            ("light sources", scene.tables.emitters.emitters.len().to_string()),
        ];
        let mut entries = entries.map(|(name, value)| (name.to_owned(), value)).to_vec();
        if integrator.kind == IntegratorKind::IrradianceCache {
            entries.extend(cache_entries(&integrator.cache, Change::Picture));
        }
        if integrator.kind == IntegratorKind::GridCache {
            let entry = |parameter: &GridParameter| {
                (parameter.name.to_owned(), parameter.get(&integrator.grid))
            };
            let matter = GRID_PARAMETERS.iter().filter(|p| p.changes >= Change::Picture);
            entries.extend(matter.map(entry));
        }
        Self { entries }
    }

    /// Of the irradiance cache of a render. Records of one fingerprint can be mixed whatever view
    /// they were made for: camera, film and sample count are no part of it.
    pub fn of_cache(scene: &Scene, sensor: &Sensor, settings: &RenderSettings) -> Self {
        let integrator = &scene.tables.integrator;
        let entries = [
            ("version", env!("CARGO_PKG_VERSION").to_owned()),
            ("scene", settings.scene_hash.clone().unwrap_or_default()),
            ("seed", sensor.sampler.seed.to_string()),
            ("max_depth", depth(integrator.max_depth)),
            ("rr_depth", integrator.rr_depth.to_string()),
            ("early_roulette", integrator.early_roulette.to_string()),
            ("shapes", scene.tables.shapes.shapes.len().to_string()),
            ("light sources", scene.tables.emitters.emitters.len().to_string()),
        ];
        let mut entries = entries.map(|(name, value)| (name.to_owned(), value)).to_vec();
        entries.extend(cache_entries(&integrator.cache, Change::Records));
        if !integrator.cache.overture() {
            // What its pixels saw when belongs to one view.
            let view = (&sensor.kind, &sensor.to_world.to_world, &sensor.film.crop);
            entries.push(("view".to_owned(), format!("{view:?}")));
        }
        Self { entries }
    }

    /// The first entry of `now` that differs from the one here: its name, its value here, and its
    /// value there.
    pub fn difference(&self, now: &Self) -> Option<(String, String, String)> {
        now.entries.iter().find_map(|(name, value)| {
            let here = self.entries.iter().find(|e| e.0 == *name).map_or("", |e| &e.1);
            (here != value).then(|| (name.clone(), here.to_owned(), value.clone()))
        })
    }
}

/// Parameters of the cache that change so much at least.
fn cache_entries(
    settings: &IrrCacheSettings,
    least: Change,
) -> impl Iterator<Item = (String, String)> {
    let wanted = CACHE_PARAMETERS.iter().filter(move |parameter| parameter.changes >= least);
    wanted.map(|parameter| (parameter.name.to_owned(), parameter.get(settings)))
}

fn depth(max_depth: Option<u32>) -> String {
    max_depth.map_or_else(|| "none".to_owned(), |depth| depth.to_string())
}
