//! Forms of the language: properties, references, parameters, includes, old versions.

use claror::bsdf::Bsdf;
use claror::math::Vec3;
use claror::shape::ShapeKind;
use claror::spectrum::Rgb;
use claror::texture::{Texture, TextureId};

use super::*;

fn constant(loaded: &LoadedScene, id: TextureId) -> Rgb {
    match loaded.tables.textures.textures[id.0 as usize] {
        Texture::Constant(color) => color,
        ref other => panic!("{other:?}"),
    }
}

/// The reflectance of the material of the first shape.
fn reflectance(loaded: &LoadedScene) -> Rgb {
    let bsdf = loaded.tables.shapes.shapes[0].bsdf;
    match loaded.tables.bsdfs.bsdfs[bsdf.0 as usize] {
        Bsdf::Diffuse { reflectance } => constant(loaded, reflectance),
        ref other => panic!("{other:?}"),
    }
}

fn diffuse(property: &str) -> Rgb {
    let text = format!("<shape type=\"sphere\"><bsdf type=\"diffuse\">{property}</bsdf></shape>");
    reflectance(&scene(&text))
}

#[test]
fn colours_in_every_form() {
    let name = "name=\"reflectance\"";
    assert_eq!(diffuse(""), Rgb::splat(0.5));
    assert_eq!(diffuse(&format!("<rgb {name} value=\"0.1, 0.2 0.3\"/>")), Rgb::new(0.1, 0.2, 0.3));
    assert_eq!(diffuse(&format!("<rgb {name} value=\"0.25\"/>")), Rgb::splat(0.25));
    assert_eq!(diffuse(&format!("<float {name} value=\"0.25\"/>")), Rgb::splat(0.25));
    assert_eq!(diffuse(&format!("<integer {name} value=\"1\"/>")), Rgb::WHITE);
    assert_eq!(diffuse(&format!("<spectrum {name} value=\"0.25\"/>")), Rgb::splat(0.25));
    assert_eq!(diffuse(&format!("<srgb {name} value=\"#ffffff\"/>")), Rgb::WHITE);
    let grey = diffuse(&format!("<srgb {name} value=\"0.5\"/>"));
    assert!((grey.r - 0.214_041).abs() < 1e-6);
    let uniform = "<spectrum type=\"uniform\" name=\"reflectance\"><float name=\"value\" value=\"0.7\"/></spectrum>";
    assert_eq!(diffuse(uniform), Rgb::splat(0.7));
    let sampled =
        diffuse(&format!("<spectrum {name} value=\"400:0.1, 500:0.5, 600:0.9 700:0.3\"/>"));
    assert!((sampled.r - 0.854_797).abs() < 1e-4, "{sampled:?}");
}

#[test]
fn spectra_from_files() {
    let text = "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><shape type=\"sphere\">\
                <bsdf type=\"diffuse\"><spectrum name=\"reflectance\" filename=\"a.spd\"/></bsdf>\
                </shape></scene>";
    let files = [("dir/scene.xml", text), ("dir/a.spd", "# a\n400 0.1\n500 0.5\n600 0.9\n700 0.3")];
    let loaded = load_memory(&files, &LoadOptions::default()).unwrap();
    assert!((reflectance(&loaded).r - 0.854_797).abs() < 1e-4);
    assert_eq!(loaded.files, [PathBuf::from("dir/scene.xml"), PathBuf::from("dir/a.spd")]);
}

/// Where the sphere of radius 1 around the origin of a scene went.
fn center(transform: &str) -> Vec3 {
    let text = format!(
        "<shape type=\"sphere\"><transform name=\"to_world\">{transform}</transform></shape>"
    );
    match scene(&text).tables.shapes.shapes[0].kind {
        ShapeKind::Sphere(to_world) => to_world.point(Vec3::ZERO),
        ref other => panic!("{other:?}"),
    }
}

#[test]
fn transforms_act_in_order() {
    assert_eq!(center(""), Vec3::ZERO);
    assert_eq!(center("<translate x=\"1\"/><scale value=\"2\"/>"), Vec3::new(2.0, 0.0, 0.0));
    assert_eq!(center("<scale x=\"2\"/><translate value=\"1 2 3\"/>"), Vec3::new(1.0, 2.0, 3.0));
    let turned = center("<translate x=\"1\"/><rotate z=\"1\" angle=\"90\"/>");
    assert!((turned - Vec3::Y).length() < 1e-6, "{turned}");
    let matrix = "1 0 0 4\n 0 1 0 5\n 0 0 1 6\n 0 0 0 1";
    assert_eq!(center(&format!("<matrix value=\"{matrix}\"/>")), Vec3::new(4.0, 5.0, 6.0));
    let look = "<lookat origin=\"1 2 3\" target=\"0 0 0\" up=\"0 1 0\"/>";
    assert_eq!(center(look), Vec3::new(1.0, 2.0, 3.0));
}

#[test]
fn references_may_point_forward() {
    let loaded = scene(
        "<shape type=\"sphere\"><ref id=\"red\"/></shape>\
         <shape type=\"cube\"><ref name=\"bsdf\" id=\"rot\"/></shape>\
         <bsdf type=\"diffuse\" id=\"red\"><ref name=\"reflectance\" id=\"tex\"/></bsdf>\
         <alias id=\"red\" as=\"rot\"/>\
         <texture type=\"checkerboard\" id=\"tex\"/>",
    );
    let shapes = &loaded.tables.shapes.shapes;
    assert_eq!(shapes[0].bsdf, shapes[1].bsdf);
    assert_eq!(loaded.tables.bsdfs.bsdfs.len(), 1);
}

#[test]
fn parameters_are_substituted() {
    let text = "<scene version=\"3.0.0\"><default name=\"r\" value=\"0.1\"/>\
                <default name=\"size\" value=\"7\"/><sensor type=\"perspective\"/>\
                <shape type=\"sphere\" id=\"s$size\"><bsdf type=\"diffuse\">\
                <rgb name=\"reflectance\" value=\"$r, 0.$size, 0\"/></bsdf></shape></scene>";
    let defines = vec![("r".to_owned(), "0.9".to_owned())];
    let options = LoadOptions { defines, ..LoadOptions::default() };
    let loaded = load_memory(&[("scene.xml", text)], &options).unwrap();
    assert_eq!(reflectance(&loaded), Rgb::new(0.9, 0.7, 0.0));
    assert_eq!(loaded.shape_names, ["s7"]);
    let expected = [("r", "0.9"), ("size", "7")].map(|(n, v)| (n.to_owned(), v.to_owned()));
    assert_eq!(loaded.parameters, expected);
    assert!(load_memory(&[("scene.xml", text)], &LoadOptions::default()).is_ok());
}

#[test]
fn includes_are_read_where_they_stand() {
    let files = [
        (
            "a/scene.xml",
            "<scene version=\"3.0.0\"><default name=\"r\" value=\"0.2\"/>\
             <include filename=\"parts/world.xml\"/><sensor type=\"perspective\"/></scene>",
        ),
        (
            "a/parts/world.xml",
            "<scene version=\"3.0.0\"><shape type=\"sphere\"><ref id=\"m\"/></shape>\
             <include filename=\"material.xml\"/></scene>",
        ),
        (
            "a/parts/material.xml",
            "<bsdf version=\"3.0.0\" type=\"diffuse\" id=\"m\"><rgb name=\"reflectance\" value=\"$r\"/></bsdf>",
        ),
    ];
    let loaded = load_memory(&files, &LoadOptions::default()).unwrap();
    assert_eq!(reflectance(&loaded), Rgb::splat(0.2));
    assert_eq!(loaded.files.len(), 3);
}

#[test]
fn path_adds_a_folder() {
    let text = "<scene version=\"3.0.0\"><path value=\"spectra\"/><sensor type=\"perspective\"/>\
                <shape type=\"sphere\"><bsdf type=\"diffuse\">\
                <spectrum name=\"reflectance\" filename=\"a.spd\"/></bsdf></shape></scene>";
    let files = [("a/scene.xml", text), ("a/spectra/a.spd", "360 0.5\n830 0.5\n")];
    let loaded = load_memory(&files, &LoadOptions::default()).unwrap();
    assert!((reflectance(&loaded).g - 0.4994).abs() < 1e-3);
}

#[test]
fn old_files_are_upgraded() {
    let loaded = scene_of(
        "0.6.0",
        "<shape type=\"sphere\"><transform name=\"toWorld\">\
         <lookAt origin=\"1 2 3\" target=\"0 0 0\" up=\"0 1 0\"/></transform>\
         <bsdf type=\"diffuse\"><spectrum name=\"diffuseReflectance\" value=\"0.1 0.2 0.3\"/></bsdf>\
         </shape><integrator type=\"path\"><integer name=\"maxDepth\" value=\"4\"/></integrator>\
         <bsdf type=\"dielectric\"><float name=\"intIOR\" value=\"1.5\"/>\
         <float name=\"extIOR\" value=\"1.0\"/></bsdf>\
         <bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"checkerboard\">\
         <float name=\"uoffset\" value=\"0.25\"/><float name=\"uscale\" value=\"2\"/>\
         <float name=\"vscale\" value=\"3\"/></texture></bsdf>",
    );
    assert_eq!(reflectance(&loaded), Rgb::new(0.1, 0.2, 0.3));
    assert_eq!(loaded.tables.integrator.max_depth, Some(4));
    assert!(matches!(loaded.tables.bsdfs.bsdfs[1], Bsdf::Dielectric { eta: 1.5, .. }));
    let checkers = loaded.tables.textures.textures.last().unwrap();
    // As Mitsuba 3.9.1 reports it: the offset is scaled, too.
    let Texture::Checkerboard { to_uv, .. } = checkers else { panic!("{checkers:?}") };
    assert_eq!(to_uv.0, [2.0, 0.0, 0.5, 0.0, 3.0, 0.0]);
}

#[test]
fn old_names_are_errors_in_new_files() {
    let text = "<scene version=\"3.0.0\"><sensor type=\"perspective\"/>\
                <integrator type=\"path\"><integer name=\"maxDepth\" value=\"4\"/></integrator></scene>";
    let errors = load_memory(&[("scene.xml", text)], &LoadOptions::default()).unwrap_err();
    assert_eq!(errors[0].hint.as_deref(), Some("did you mean \"max_depth\"?"));
}

#[test]
fn lenient_replaces_what_is_not_supported() {
    let text = "<scene version=\"3.0.0\"><sensor type=\"perspective\"/>\
                <shape type=\"sphere\"><bsdf type=\"hair\"><float name=\"x\" value=\"1\"/></bsdf></shape>\
                <shape type=\"bsplinecurve\"/><emitter type=\"projector\"/>\
                <integrator type=\"prb\"/></scene>";
    let options = LoadOptions { lenient: true, ..LoadOptions::default() };
    let loaded = load_memory(&[("scene.xml", text)], &options).unwrap();
    assert_eq!(reflectance(&loaded), Rgb::splat(0.5));
    assert_eq!(loaded.tables.shapes.shapes.len(), 1);
    assert_eq!(loaded.warnings.len(), 4);
    assert!(loaded.warnings[0].message.contains("\"hair\" is not supported: a grey diffuse"));
}

#[test]
fn fingerprints_tell_scenes_apart() {
    let sphere = |radius: &str| {
        let text =
            format!("<shape type=\"sphere\"><float name=\"radius\" value=\"{radius}\"/></shape>");
        scene(&text).content_hash
    };
    assert_eq!(sphere("1.5"), sphere("1.50"));
    assert_ne!(sphere("1.5"), sphere("1.6"));
    let cube = |x: &str| {
        let text = format!(
            "<shape type=\"cube\"><transform name=\"to_world\"><translate x=\"{x}\"/></transform></shape>"
        );
        scene(&text).content_hash
    };
    assert_ne!(cube("1"), cube("2"));
    // The same on every machine.
    assert_eq!(content_hash(&SceneTables::default()), content_hash(&SceneTables::default()));
}
