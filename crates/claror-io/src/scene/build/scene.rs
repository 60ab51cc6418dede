//! The scene itself: what its children are.

use claror::integrator::IntegratorKind;

use super::Builder;
use crate::scene::description::{ObjectIndex, Tag};

/// The scene's own object.
const ROOT: ObjectIndex = 0;

impl<'a> Builder<'a> {
    /// Makes everything. What is wrong goes to the log; then the tables are of no use.
    pub(in crate::scene) fn scene(&mut self) {
        let properties = self.properties(ROOT);
        let children = properties.objects(|_, _| true);
        for (property, index) in children {
            match self.tag(index) {
                Tag::Integrator => self.scene_integrator(index),
                Tag::Sensor => self.sensor(index),
                Tag::Shape => self.world_shape(index),
                Tag::Emitter => self.world_emitter(index),
                Tag::Bsdf => {
                    self.bsdf(index);
                }
                Tag::Texture => {
                    self.texture_object(index, super::spectrum::Role::Unbounded);
                }
                // Parts of sensors that are referred to are made with what refers to them.
                Tag::Film | Tag::Sampler | Tag::Rfilter if self.object(index).id.is_some() => {}
                Tag::Medium | Tag::Phase | Tag::Volume => {
                    self.unsupported(&self.properties(index), &[], "it is left out");
                }
                tag => {
                    let message = format!("<{}> cannot stand inside <scene>", tag.name());
                    self.log.error(property.span, message, None);
                }
            }
            if self.log.is_full() {
                return;
            }
        }
        if self.integrator.is_none() {
            self.tables.integrator.kind = IntegratorKind::IrradianceCache;
        }
        if self.tables.sensors.is_empty() && !self.log.has_errors() {
            let message = "the scene has no sensor: nobody looks at it";
            self.log.error(properties.span(), message, None);
        }
        properties.ignore(&["bbox"]);
        self.finish(properties);
        if !self.log.has_errors() {
            self.check_bsdfs();
        }
    }
}
