//! Cameras.

use claror::math::{DAffine3, Transform, Vec2};
use claror::sensor::{Sensor, SensorKind};

use super::Builder;
use super::films::{aspect, millimetres};
use crate::scene::description::ObjectIndex;
use crate::scene::properties::Properties;

/// All sensor plugins.
const PLUGINS: [&str; 3] = ["perspective", "thinlens", "orthographic"];

/// Which extent of the film the field of view spans.
#[derive(Clone, Copy)]
enum FovAxis {
    X,
    Y,
    Diagonal,
    Smaller,
    Larger,
}

impl<'a> Builder<'a> {
    /// Adds a camera.
    pub(super) fn sensor(&mut self, index: ObjectIndex) {
        let properties = self.properties(index);
        let plugin = properties.plugin();
        if !PLUGINS.contains(&plugin) {
            return self.unsupported(&properties, &PLUGINS, "the sensor is left out");
        }
        let film = self.film(&properties);
        let sampler = self.sampler(&properties);
        let near_clip = properties.positive("near_clip", 1e-2);
        let far_clip = properties.positive("far_clip", 1e4);
        if near_clip >= far_clip {
            let message =
                format!("\"near_clip\" = {near_clip} is not below \"far_clip\" = {far_clip}");
            properties.error("near_clip", message, None);
        }
        properties.ignore(&["shutter_open", "shutter_close"]);
        let kind = if plugin == "orthographic" {
            SensorKind::Orthographic
        } else {
            self.pinhole(&properties, aspect(&film))
        };
        if plugin == "perspective" {
            properties.ignore(&["focus_distance"]);
        }
        let to_world = self.camera_to_world(&properties, plugin != "orthographic");
        let name = self.object(index).id.clone().unwrap_or_default();
        self.finish(properties);
        self.tables.sensors.push(Sensor {
            name,
            kind,
            to_world,
            near_clip,
            far_clip,
            film,
            sampler,
        });
    }

    fn pinhole(&self, properties: &Properties<'a>, aspect: f64) -> SensorKind {
        let fov_x = fov_x(properties, aspect);
        let offset = |name| properties.float(name, 0.0);
        let principal_point_offset =
            Vec2::new(offset("principal_point_offset_x"), offset("principal_point_offset_y"));
        if properties.plugin() == "perspective" {
            return SensorKind::Perspective { fov_x, principal_point_offset };
        }
        if !properties.is_given("aperture_radius") {
            self.missing(properties, "aperture_radius");
        }
        SensorKind::ThinLens {
            fov_x,
            principal_point_offset,
            // As in Mitsuba a lens without extent becomes a very small one.
            aperture_radius: properties
                .float_that("aperture_radius", 0.0, "at least 0", |v| v >= 0.0)
                .max(0.5 * f32::EPSILON),
            focus_distance: properties
                .positive("focus_distance", properties.opt_float("far_clip").unwrap_or(1e4)),
        }
    }

    fn camera_to_world(&self, properties: &Properties<'a>, rigid: bool) -> Transform {
        let transform = properties.transform("to_world", DAffine3::IDENTITY);
        let m = properties.affine("to_world").matrix3;
        let lengths = [m.x_axis, m.y_axis, m.z_axis].map(|axis| axis.length());
        let scales = lengths.iter().any(|l| (l - 1.0).abs() > 1e-3);
        if rigid && scales && transform != Transform::IDENTITY {
            let message = "\"to_world\" of a perspective camera must not scale";
            properties.error("to_world", message, None);
            return Transform::IDENTITY;
        }
        transform
    }
}

/// Horizontal field of view, radians.
fn fov_x(properties: &Properties, aspect: f64) -> f32 {
    let axis = properties.choice(
        "fov_axis",
        &[
            ("x", FovAxis::X),
            ("y", FovAxis::Y),
            ("diagonal", FovAxis::Diagonal),
            ("smaller", FovAxis::Smaller),
            ("larger", FovAxis::Larger),
        ],
    );
    let (degrees, axis) = match properties.double("fov") {
        Some(degrees) => {
            if properties.has("focal_length") {
                let message = "\"focal_length\" stands beside \"fov\": give one of them";
                properties.error("focal_length", message, None);
            }
            (degrees, axis)
        }
        None => (fov_of_focal_length(properties), FovAxis::Diagonal),
    };
    if !(degrees > 0.0 && degrees < 180.0) {
        let message = format!("\"fov\" = {degrees} must be between 0 and 180 degrees");
        properties.error("fov", message, None);
        return 1.0;
    }
    let half = (0.5 * degrees.to_radians()).tan();
    let half_x = match axis {
        FovAxis::X => half,
        FovAxis::Y => half * aspect,
        FovAxis::Diagonal => half / (1.0 + 1.0 / (aspect * aspect)).sqrt(),
        FovAxis::Smaller if aspect > 1.0 => half * aspect,
        FovAxis::Larger if aspect <= 1.0 => half * aspect,
        FovAxis::Smaller | FovAxis::Larger => half,
    };
    #[expect(clippy::cast_possible_truncation, reason = "the camera is f32")]
    let fov = (2.0 * half_x.atan()) as f32;
    fov
}

/// The diagonal field of view, degrees, of a lens on a 36 mm x 24 mm film; 50 mm by default.
fn fov_of_focal_length(properties: &Properties) -> f64 {
    let focal_length = properties.string("focal_length").map_or(Ok(50.0), millimetres);
    let focal_length = focal_length.unwrap_or_else(|reason| {
        properties.error("focal_length", reason, None);
        50.0
    });
    2.0 * (36_f64.hypot(24.0) / (2.0 * focal_length)).atan().to_degrees()
}
