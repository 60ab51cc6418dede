//! Shapes, materials, textures and emitters.

use claror::bsdf::{Bsdf, BsdfId, MicrofacetKind, metal};
use claror::emitter::Emitter;
use claror::math::Vec3;
use claror::shape::{ShapeId, ShapeKind};
use claror::spectrum::Rgb;
use claror::texture::{Texture, TextureId};

use super::*;

fn constant(loaded: &LoadedScene, id: TextureId) -> Rgb {
    match loaded.tables.textures.textures[id.0 as usize] {
        Texture::Constant(color) => color,
        ref other => panic!("{other:?}"),
    }
}

/// A scene of one material; it comes last.
fn bsdf(kind: &str, content: &str) -> (LoadedScene, Bsdf) {
    let loaded = scene(&format!("<bsdf type=\"{kind}\">{content}</bsdf>"));
    let last = loaded.tables.bsdfs.bsdfs.last().unwrap().clone();
    (loaded, last)
}

fn shape(kind: &str, content: &str) -> ShapeKind {
    let loaded = scene(&format!("<shape type=\"{kind}\">{content}</shape>"));
    loaded.tables.shapes.shapes[0].kind.clone()
}

fn emitter(kind: &str, content: &str) -> Emitter {
    let loaded = scene(&format!("<emitter type=\"{kind}\">{content}</emitter>"));
    loaded.tables.emitters.emitters[0].clone()
}

#[test]
fn spheres_have_centers_and_radii() {
    let kind = shape(
        "sphere",
        "<point name=\"center\" x=\"1\" y=\"2\" z=\"3\"/><float name=\"radius\" value=\"0.5\"/>\
         <transform name=\"to_world\"><scale value=\"2\"/><translate x=\"1\"/></transform>",
    );
    let ShapeKind::Sphere(to_world) = kind else { panic!("{kind:?}") };
    // Mitsuba 3.9.1 meets it from the right at (4, 4, 6).
    assert_eq!(to_world.point(Vec3::X), Vec3::new(4.0, 4.0, 6.0));
}

#[test]
fn cylinders_have_axes() {
    let kind = shape(
        "cylinder",
        "<point name=\"p0\" x=\"1\" y=\"2\" z=\"3\"/><point name=\"p1\" x=\"2\" y=\"4\" z=\"2\"/>\
         <float name=\"radius\" value=\"0.5\"/>",
    );
    let ShapeKind::Cylinder(to_world) = kind else { panic!("{kind:?}") };
    // A hit as Mitsuba 3.9.1 reports it: point and uv.
    let local = to_world.inverse_point(Vec3::new(2.047_72, 3.0, 2.5));
    let u = local.y.atan2(local.x) / std::f32::consts::TAU;
    assert!((local.x.hypot(local.y) - 1.0).abs() < 1e-4, "{local}");
    assert!((u - 0.041_744_7).abs() < 1e-4 && (local.z - 0.591_287).abs() < 1e-4, "{u} {local}");
}

#[test]
fn every_shape_is_read() {
    let loaded = scene(
        "<shape type=\"rectangle\"/><shape type=\"disk\"/><shape type=\"cube\">\
         <boolean name=\"flip_normals\" value=\"true\"/></shape>\
         <shape type=\"shapegroup\" id=\"g\"><shape type=\"sphere\"/><shape type=\"cube\"/></shape>\
         <shape type=\"instance\"><ref id=\"g\"/></shape>\
         <shape type=\"instance\"><ref id=\"g\"/><transform name=\"to_world\">\
         <translate x=\"3\"/></transform></shape>",
    );
    let shapes = &loaded.tables.shapes;
    assert_eq!((shapes.shapes.len(), shapes.meshes.len()), (5, 2));
    assert!(shapes.shapes[2].flip_normals && !shapes.shapes[0].flip_normals);
    assert_eq!(shapes.groups.len(), 1);
    assert_eq!(shapes.groups[0].shapes.iter().map(|s| s.0).collect::<Vec<_>>(), [3, 4]);
    assert_eq!(shapes.instances.len(), 2);
    assert_eq!(shapes.instances[1].transform.point(Vec3::ZERO), Vec3::new(3.0, 0.0, 0.0));
    assert_eq!(loaded.shape_names[0], "rectangle (line 1)");
}

#[test]
fn what_shines_does_not_reflect_unless_told() {
    let light = "<emitter type=\"area\"><rgb name=\"radiance\" value=\"3 2 1\"/></emitter>";
    let loaded = scene(&format!("<shape type=\"sphere\">{light}</shape>"));
    let shape = &loaded.tables.shapes.shapes[0];
    let Bsdf::Diffuse { reflectance } = loaded.tables.bsdfs.bsdfs[shape.bsdf.0 as usize] else {
        panic!("not diffuse")
    };
    assert_eq!(constant(&loaded, reflectance), Rgb::BLACK);
    let emitter = &loaded.tables.emitters.emitters[shape.emitter.unwrap().0 as usize];
    let Emitter::Area { shape: ShapeId(0), radiance } = emitter else { panic!("{emitter:?}") };
    assert_eq!(constant(&loaded, *radiance), Rgb::new(3.0, 2.0, 1.0));
}

#[test]
fn glasses_and_plastics_have_the_defaults_of_mitsuba() {
    let eta = 1.5046 / 1.000_277;
    for kind in ["dielectric", "thindielectric", "roughdielectric"] {
        let (_, made) = bsdf(kind, "");
        let (Bsdf::Dielectric { eta: found, .. }
        | Bsdf::ThinDielectric { eta: found, .. }
        | Bsdf::RoughDielectric { eta: found, .. }) = made
        else {
            panic!("{made:?}")
        };
        assert!((found - eta).abs() < 1e-6, "{kind}");
    }
    let (loaded, made) = bsdf("roughplastic", "<string name=\"int_ior\" value=\"water\"/>");
    let Bsdf::RoughPlastic {
        distribution,
        sample_visible,
        alpha,
        eta,
        diffuse_reflectance,
        nonlinear,
        ..
    } = made
    else {
        panic!("{made:?}")
    };
    assert_eq!(
        (distribution, sample_visible, alpha, nonlinear),
        (MicrofacetKind::Beckmann, true, 0.1, false)
    );
    assert!((eta - 1.333 / 1.000_277).abs() < 1e-6);
    assert_eq!(constant(&loaded, diffuse_reflectance), Rgb::splat(0.5));
    let (_, made) = bsdf("plastic", "<boolean name=\"nonlinear\" value=\"true\"/>");
    assert!(
        matches!(made, Bsdf::Plastic { nonlinear: true, eta, .. } if (eta - 1.49 / 1.000_277).abs() < 1e-6)
    );
}

#[test]
fn metals_by_name_and_by_number() {
    let (loaded, made) = bsdf("conductor", "<string name=\"material\" value=\"Au\"/>");
    let Bsdf::Conductor { eta, k, .. } = made else { panic!("{made:?}") };
    assert_eq!((constant(&loaded, eta), constant(&loaded, k)), metal("Au").unwrap());
    let (loaded, made) = bsdf("roughconductor", "<rgb name=\"eta\" value=\"1 2 3\"/>");
    let Bsdf::RoughConductor { eta, k, alpha_u, alpha_v, .. } = made else { panic!("{made:?}") };
    assert_eq!(constant(&loaded, eta), Rgb::new(1.0, 2.0, 3.0));
    assert_eq!((constant(&loaded, k), alpha_u), (Rgb::WHITE, alpha_v));
    let (loaded, made) = bsdf(
        "roughconductor",
        "<float name=\"alpha_u\" value=\"0.2\"/><float name=\"alpha_v\" value=\"0.4\"/>\
         <string name=\"distribution\" value=\"ggx\"/>",
    );
    let Bsdf::RoughConductor { distribution, alpha_u, alpha_v, .. } = made else {
        panic!("{made:?}")
    };
    assert_eq!(distribution, MicrofacetKind::Ggx);
    assert_eq!(constant(&loaded, alpha_u), Rgb::splat(0.2));
    assert_eq!(constant(&loaded, alpha_v), Rgb::splat(0.4));
}

#[test]
fn nested_materials_keep_their_order() {
    let (red, blue) = ("<bsdf type=\"diffuse\"/>", "<bsdf type=\"plastic\"/>");
    let (_, made) = bsdf("twosided", &format!("{red}{blue}"));
    assert!(matches!(made, Bsdf::TwoSided { front: BsdfId(0), back: BsdfId(1) }));
    let (_, made) = bsdf("twosided", red);
    assert!(matches!(made, Bsdf::TwoSided { front: BsdfId(0), back: BsdfId(0) }));
    let weight = "<float name=\"weight\" value=\"0.25\"/>";
    let (loaded, made) = bsdf("blendbsdf", &format!("{red}{blue}{weight}"));
    let Bsdf::Blend { weight, first: BsdfId(0), second: BsdfId(1) } = made else {
        panic!("{made:?}")
    };
    assert_eq!(constant(&loaded, weight), Rgb::splat(0.25));
    let (_, made) = bsdf("mask", red);
    assert!(matches!(made, Bsdf::Mask { nested: BsdfId(0), .. }));
    let (_, made) = bsdf("bumpmap", &format!("{red}<texture type=\"checkerboard\"/>"));
    assert!(matches!(made, Bsdf::BumpMap { .. }));
    let (_, made) =
        bsdf("normalmap", &format!("{red}<texture name=\"normalmap\" type=\"checkerboard\"/>"));
    assert!(matches!(made, Bsdf::NormalMap { .. }));
    assert!(matches!(bsdf("null", "").1, Bsdf::Null));
}

#[test]
fn principled_has_one_index_of_refraction() {
    let eta = |content: &str| match bsdf("principled", content).1 {
        Bsdf::Principled(principled) => principled.eta,
        other => panic!("{other:?}"),
    };
    assert!((eta("") - 1.5).abs() < 1e-6);
    assert_eq!(eta("<float name=\"eta\" value=\"1.33\"/>"), 1.33);
    assert!((eta("<float name=\"specular\" value=\"1\"/>") - 1.788_788_5).abs() < 1e-5);
}

#[test]
fn textures_keep_their_parameters() {
    let loaded = scene(
        "<bsdf type=\"diffuse\"><texture type=\"mesh_attribute\" name=\"reflectance\">\
         <string name=\"name\" value=\"vertex_color\"/><float name=\"scale\" value=\"2\"/>\
         </texture></bsdf>\
         <bsdf type=\"diffuse\"><texture type=\"checkerboard\" name=\"reflectance\">\
         <transform name=\"to_uv\"><scale x=\"2\" y=\"3\"/><translate x=\"0.25\" y=\"0.5\"/>\
         </transform></texture></bsdf>",
    );
    let textures = &loaded.tables.textures.textures;
    assert!(textures.contains(&Texture::MeshAttribute { name: "vertex_color".into(), scale: 2.0 }));
    let Some(Texture::Checkerboard { color0, color1, to_uv }) = textures.last() else {
        panic!("{textures:?}")
    };
    assert_eq!(constant(&loaded, *color0), Rgb::splat(0.4));
    assert_eq!(constant(&loaded, *color1), Rgb::splat(0.2));
    // As Mitsuba 3.9.1 reports it.
    assert_eq!(to_uv.0, [2.0, 0.0, 0.25, 0.0, 3.0, 0.5]);
}

#[test]
fn emitters_keep_their_parameters() {
    let intensity = "<rgb name=\"intensity\" value=\"3 2 1\"/>";
    let color = Rgb::new(3.0, 2.0, 1.0);
    assert_eq!(
        emitter("point", &format!("{intensity}<point name=\"position\" value=\"1 2 3\"/>")),
        Emitter::Point { position: Vec3::new(1.0, 2.0, 3.0), intensity: color }
    );
    let moved = "<transform name=\"to_world\"><translate x=\"4\"/></transform>";
    assert_eq!(
        emitter("point", moved),
        Emitter::Point { position: Vec3::new(4.0, 0.0, 0.0), intensity: Rgb::WHITE }
    );
    let Emitter::Spot { cutoff_angle, beam_width, .. } = emitter("spot", intensity) else {
        panic!("not a spot")
    };
    assert!((cutoff_angle.to_degrees() - 20.0).abs() < 1e-5);
    assert!((beam_width.to_degrees() - 15.0).abs() < 1e-5);
    assert_eq!(
        emitter("directional", "<vector name=\"direction\" value=\"0 0 -2\"/>"),
        Emitter::Directional { direction: Vec3::NEG_Z, irradiance: Rgb::WHITE }
    );
    let turned = "<transform name=\"to_world\"><matrix value=\"0 0 1 0 1 0 1 0 0\"/></transform>";
    assert_eq!(
        emitter("directional", turned),
        Emitter::Directional { direction: Vec3::X, irradiance: Rgb::WHITE }
    );
    assert_eq!(
        emitter(
            "constant",
            "<spectrum name=\"radiance\" type=\"d65\"><float name=\"scale\" value=\"4\"/></spectrum>"
        ),
        Emitter::Constant { radiance: Rgb::splat(4.0) }
    );
    let Emitter::Constant { radiance } =
        emitter("constant", "<spectrum name=\"radiance\" value=\"2.0\"/>")
    else {
        panic!("not constant")
    };
    // As Mitsuba 3.9.1 reports it: a uniform spectrum is not white.
    assert!((radiance.r - 2.409_59).abs() < 1e-4 && (radiance.b - 1.817_83).abs() < 1e-4);
}

#[test]
fn daylight_is_a_sky_and_a_sun() {
    let direction = "<vector name=\"sun_direction\" value=\"0 0.6 0.8\"/>";
    let kinds = |kind: &str| {
        let loaded = scene(&format!("<emitter type=\"{kind}\">{direction}</emitter>"));
        let is_sky = |e: &Emitter| matches!(e, Emitter::Envmap { .. });
        loaded.tables.emitters.emitters.iter().map(is_sky).collect::<Vec<bool>>()
    };
    assert_eq!(kinds("sunsky"), [true, false]);
    assert_eq!(kinds("sky"), [true]);
    assert_eq!(kinds("sun"), [false]);
    let Emitter::SunDisc { direction, half_angle, .. } = emitter("sun", direction) else {
        panic!("no sun")
    };
    assert!((direction - Vec3::new(0.0, 0.6, 0.8)).length() < 1e-6);
    assert!((half_angle.to_degrees() - 0.2679).abs() < 1e-5);
    // Tokyo at nine, as Mitsuba 3.9.1 reports it.
    let Emitter::SunDisc { direction, .. } = emitter("sun", "<float name=\"hour\" value=\"9\"/>")
    else {
        panic!("no sun")
    };
    let expected = Vec3::new(0.095_695_2, -0.614_786, 0.782_867);
    assert!((direction - expected).length() < 1e-4, "{direction}");
}
