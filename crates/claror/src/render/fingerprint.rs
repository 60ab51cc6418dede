use super::{RenderError, RenderSettings};
use crate::integrator::IntegratorKind;
use crate::scene::Scene;
use crate::sensor::Sensor;

/// All that decides a picture's bits, as named values; two renders with equal fingerprints add
/// up to one picture.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Fingerprint {
    /// Name and value, in a fixed order.
    pub entries: Vec<(String, String)>,
}

impl Fingerprint {
    /// Of a render of `scene` through `sensor`.
    pub fn new(scene: &Scene, sensor: &Sensor, settings: &RenderSettings) -> Self {
        let film = &sensor.film;
        let crop = &film.crop;
        let integrator = &scene.tables.integrator;
        let aovs: Vec<String> =
            scene.tables.aovs.iter().map(|a| format!("{}:{}", a.name, a.kind.name())).collect();
        let depth = integrator.max_depth.map_or_else(|| "none".to_owned(), |d| d.to_string());
        let cache = match integrator.kind {
            IntegratorKind::IrradianceCache => format!("{:?}", integrator.cache),
            _ => String::new(),
        };
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
            ("max_depth", depth),
            ("rr_depth", integrator.rr_depth.to_string()),
            ("early_roulette", integrator.early_roulette.to_string()),
            ("hide_emitters", integrator.hide_emitters.to_string()),
            ("irradiance cache", cache),
            ("further layers", aovs.join(",")),
            ("shapes", scene.tables.shapes.shapes.len().to_string()),
            ("light sources", scene.tables.emitters.emitters.len().to_string()),
        ];
        let entries = entries.map(|(name, value)| (name.to_owned(), value));
        Self { entries: entries.to_vec() }
    }

    /// An error that names the first difference between this, the fingerprint of a state, and
    /// that of the render that wants to continue it.
    pub fn check(&self, now: &Self) -> Result<(), RenderError> {
        for (name, value) in &now.entries {
            let state = self.entries.iter().find(|e| e.0 == *name).map_or("", |e| &e.1);
            if state != value {
                return Err(RenderError::StateMismatch {
                    what: name.clone(),
                    state: state.to_owned(),
                    now: value.clone(),
                });
            }
        }
        Ok(())
    }
}
