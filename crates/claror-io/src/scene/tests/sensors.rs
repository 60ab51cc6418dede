//! Cameras, films, samplers and integrators.

use claror::film::{CropWindow, FilterKind};
use claror::integrator::{AovKind, GridCacheSettings, IntegratorKind, Interpolation, Quantity};
use claror::math::{Vec2, Vec3};
use claror::sampler::SamplerKind;
use claror::sensor::{Sensor, SensorKind};

use super::*;

/// The only camera of a scene.
fn sensor(kind: &str, content: &str) -> Sensor {
    let text = format!(
        "<scene version=\"3.0.0\"><sensor type=\"{kind}\" id=\"eye\">{content}</sensor></scene>"
    );
    match load_memory(&[("scene.xml", &text)], &LoadOptions::default()) {
        Ok(loaded) => loaded.tables.sensors.into_iter().next().unwrap(),
        Err(diagnostics) => panic!("{}", text_of(&diagnostics)),
    }
}

fn film(width: u32, height: u32) -> String {
    format!(
        "<film type=\"hdrfilm\"><integer name=\"width\" value=\"{width}\"/>\
         <integer name=\"height\" value=\"{height}\"/></film>"
    )
}

fn degrees(content: &str, width: u32, height: u32) -> f32 {
    match sensor("perspective", &(content.to_owned() + &film(width, height))).kind {
        SensorKind::Perspective { fov_x, .. } => fov_x.to_degrees(),
        other => panic!("{other:?}"),
    }
}

/// `x_fov` as Mitsuba 3.9.1 reports it.
#[test]
fn fields_of_view_are_those_of_mitsuba() {
    for (axis, wide, tall) in [
        ("x", 40.0, 40.0),
        ("y", 60.428_967, 25.631_268),
        ("diagonal", 34.305_28, 21.836_924),
        ("smaller", 60.428_967, 40.0),
        ("larger", 40.0, 25.631_268),
    ] {
        let content = format!(
            "<float name=\"fov\" value=\"40\"/><string name=\"fov_axis\" value=\"{axis}\"/>"
        );
        assert!((degrees(&content, 128, 80) - wide).abs() < 1e-4, "{axis}");
        assert!((degrees(&content, 80, 128) - tall).abs() < 1e-4, "{axis}");
    }
    let lens = "<string name=\"focal_length\" value=\"35mm\"/>";
    assert!((degrees(lens, 128, 80) - 55.321_94).abs() < 1e-4);
    assert!((degrees("", 768, 576) - 38.184_84).abs() < 1e-4);
}

#[test]
fn cameras_keep_their_parameters() {
    let eye = sensor(
        "thinlens",
        "<float name=\"aperture_radius\" value=\"0.1\"/>\
         <float name=\"focus_distance\" value=\"4\"/><float name=\"near_clip\" value=\"0.5\"/>\
         <float name=\"principal_point_offset_x\" value=\"0.25\"/>\
         <transform name=\"to_world\"><lookat origin=\"0 0 5\" target=\"0 0 0\" up=\"0 1 0\"/>\
         </transform>",
    );
    let SensorKind::ThinLens { principal_point_offset, aperture_radius, focus_distance, .. } =
        eye.kind
    else {
        panic!("{:?}", eye.kind)
    };
    assert_eq!(principal_point_offset, Vec2::new(0.25, 0.0));
    assert_eq!((aperture_radius, focus_distance), (0.1, 4.0));
    assert_eq!((eye.near_clip, eye.far_clip), (0.5, 1e4));
    assert_eq!(eye.name, "eye");
    assert_eq!(eye.to_world.point(Vec3::ZERO), Vec3::new(0.0, 0.0, 5.0));
    assert_eq!(eye.to_world.vector(Vec3::Z), Vec3::NEG_Z);
    assert_eq!(sensor("orthographic", "").kind, SensorKind::Orthographic);
}

#[test]
fn films_keep_their_parameters() {
    let eye = sensor(
        "perspective",
        "<film type=\"hdrfilm\"><integer name=\"width\" value=\"160\"/>\
         <integer name=\"height\" value=\"100\"/><integer name=\"crop_offset_x\" value=\"20\"/>\
         <integer name=\"crop_offset_y\" value=\"30\"/><integer name=\"crop_width\" value=\"96\"/>\
         <integer name=\"crop_height\" value=\"64\"/>\
         <string name=\"pixel_format\" value=\"rgba\"/>\
         <string name=\"component_format\" value=\"float32\"/>\
         <rfilter type=\"mitchell\"/></film>",
    );
    assert_eq!(eye.film.crop, CropWindow { x: 20, y: 30, width: 96, height: 64 });
    assert_eq!((eye.film.width, eye.film.height, eye.film.alpha), (160, 100, true));
    assert_eq!(eye.film.filter, FilterKind::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 });
    let default = sensor("perspective", "").film;
    assert_eq!((default.width, default.height, default.alpha), (768, 576, false));
    assert_eq!(default.filter, FilterKind::Gaussian { stddev: 0.5 });
}

#[test]
fn filters_by_name() {
    for (text, expected) in [
        ("<rfilter type=\"box\"/>", FilterKind::Box { radius: 0.5 }),
        (
            "<rfilter type=\"tent\"><float name=\"radius\" value=\"2\"/></rfilter>",
            FilterKind::Tent { radius: 2.0 },
        ),
        (
            "<rfilter type=\"gaussian\"><float name=\"stddev\" value=\"0.4\"/></rfilter>",
            FilterKind::Gaussian { stddev: 0.4 },
        ),
        ("<rfilter type=\"catmullrom\"/>", FilterKind::CatmullRom),
        ("<rfilter type=\"lanczos\"/>", FilterKind::Lanczos { lobes: 3 }),
    ] {
        let film = sensor("perspective", &format!("<film type=\"ldrfilm\">{text}</film>")).film;
        assert_eq!(film.filter, expected);
    }
}

#[test]
fn samplers_by_name() {
    for name in ["independent", "stratified", "multijitter", "orthogonal", "ldsampler", "sobol"] {
        let text = format!(
            "<sampler type=\"{name}\"><integer name=\"sample_count\" value=\"64\"/>\
             <integer name=\"seed\" value=\"7\"/></sampler>"
        );
        let sampler = sensor("perspective", &text).sampler;
        let expected = (SamplerKind::Sobol, 64, 7);
        assert_eq!((sampler.kind, sampler.sample_count, sampler.seed), expected);
    }
}

#[test]
fn several_sensors() {
    let text = "<scene version=\"3.0.0\"><sensor type=\"orthographic\" id=\"a\"/>\
                <film type=\"hdrfilm\" id=\"f\"><integer name=\"width\" value=\"9\"/></film>\
                <sensor type=\"perspective\" id=\"b\"><ref id=\"f\"/></sensor></scene>";
    let loaded = load_memory(&[("scene.xml", text)], &LoadOptions::default()).unwrap();
    let names: Vec<&str> = loaded.tables.sensors.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names, ["a", "b"]);
    assert_eq!(loaded.tables.sensors[1].film.width, 9);
}

#[test]
fn integrators_keep_their_parameters() {
    let settings = scene(
        "<integrator type=\"volpath\"><integer name=\"max_depth\" value=\"3\"/>\
         <integer name=\"rr_depth\" value=\"9\"/><boolean name=\"hide_emitters\" value=\"true\"/>\
         </integrator>",
    )
    .tables
    .integrator;
    assert_eq!(settings.kind, IntegratorKind::Path);
    assert_eq!((settings.max_depth, settings.rr_depth, settings.hide_emitters), (Some(3), 9, true));
    let none = scene("").tables.integrator;
    assert_eq!((none.kind, none.max_depth), (IntegratorKind::IrradianceCache, None));
    let debiased =
        "<integrator type=\"irrcache\"><float name=\"debias\" value=\"0.25\"/></integrator>";
    assert_eq!(scene(debiased).tables.integrator.cache.debias, 0.25);
    // As a file of Mitsuba 0.6 says it.
    let old = "<integrator type=\"irrcache\"><integer name=\"resolution\" value=\"20\"/>\
               <boolean name=\"clampNeighbor\" value=\"true\"/>\
               <float name=\"quality\" value=\"1.5\"/><boolean name=\"debug\" value=\"false\"/>\
               <integrator type=\"path\"><integer name=\"max_depth\" value=\"9\"/></integrator>\
               </integrator>";
    let old = scene(old).tables.integrator;
    assert_eq!((old.cache.gather_samples, old.cache.clamp_neighbor), (Some(800), Some(true)));
    assert_eq!((old.cache.quality, old.max_depth), (1.5, Some(9)));
    let direct =
        "<integrator type=\"direct\"><integer name=\"shading_samples\" value=\"2\"/></integrator>";
    let expected = IntegratorKind::Direct { emitter_samples: 2, bsdf_samples: 2 };
    assert_eq!(scene(direct).tables.integrator.kind, expected);
    assert_eq!(scene("<integrator type=\"depth\"/>").tables.integrator.kind, IntegratorKind::Depth);
}

/// Alone or around a path tracer.
#[test]
fn grids_have_parameters() {
    let alone = scene(
        "<integrator type=\"gridcache\"><integer name=\"step\" value=\"5\"/>\
         <integer name=\"max_depth\" value=\"4\"/>\
         <string name=\"interpolation\" value=\"ward\"/></integrator>",
    )
    .tables
    .integrator;
    assert_eq!((alone.kind, alone.max_depth), (IntegratorKind::GridCache, Some(4)));
    assert_eq!((alone.grid.step, alone.grid.interpolation), (5, Interpolation::Ward));
    let around = scene(
        "<integrator type=\"gridcache\"><string name=\"quantity\" value=\"color\"/>\
         <integer name=\"gather_samples\" value=\"64\"/><integrator type=\"path\">\
         <integer name=\"max_depth\" value=\"9\"/></integrator></integrator>",
    )
    .tables
    .integrator;
    assert_eq!((around.kind, around.max_depth), (IntegratorKind::GridCache, Some(9)));
    assert_eq!((around.grid.quantity, around.grid.gather_samples), (Quantity::Color, 64));
    let none = scene("<integrator type=\"gridcache\"/>").tables.integrator;
    assert_eq!(none.grid, GridCacheSettings::default());
}

#[test]
fn aov_has_a_nested_integrator() {
    let tables = scene(
        "<integrator type=\"aov\"><string name=\"aovs\" value=\"d:depth, n:sh_normal\"/>\
         <integrator type=\"direct\"/></integrator>",
    )
    .tables;
    assert!(matches!(tables.integrator.kind, IntegratorKind::Direct { .. }));
    let aovs: Vec<(&str, AovKind)> =
        tables.aovs.iter().map(|a| (a.name.as_str(), a.kind)).collect();
    assert_eq!(aovs, [("d", AovKind::Depth), ("n", AovKind::ShadingNormal)]);
    let tables = scene(
        "<integrator type=\"aov\"><string name=\"aovs\" value=\"e:irradiance, cache_miss\"/>\
         <integrator type=\"irrcache\"/></integrator>",
    )
    .tables;
    assert_eq!(tables.integrator.kind, IntegratorKind::IrradianceCache);
    let kinds: Vec<AovKind> = tables.aovs.iter().map(|aov| aov.kind).collect();
    assert_eq!(kinds, [AovKind::Irradiance, AovKind::CacheMiss]);
}
