//! Plugins and their parameters.

use claror_io::diagnostic::Subject;

use crate::{Case, raw, scene};

/// A scene whose only camera is this.
fn camera(name: &'static str, sensor: &str, expected: &'static str) -> Case {
    raw(name, format!("<scene version=\"3.0.0\">\n{sensor}\n</scene>"), expected)
}

/// A camera with a film.
fn film(name: &'static str, content: &str, expected: &'static str) -> Case {
    let film = format!("<film type=\"hdrfilm\">{content}</film>");
    camera(name, &format!("<sensor type=\"perspective\">{film}</sensor>"), expected)
}

fn integer(name: &str, value: &str) -> String {
    format!("<integer name=\"{name}\" value=\"{value}\"/>")
}

fn unsupported() -> Vec<Case> {
    vec![
        scene(
            "misspelt plugin",
            "<bsdf type=\"difuse\"/>",
            "2:1: bsdf plugin \"difuse\" is not supported (did you mean \"diffuse\"?)",
        ),
        scene(
            "many unsupported plugins",
            "<bsdf type=\"hair\"/>\n<shape type=\"bsplinecurve\"/>\n<emitter type=\"projector\"/>\n\
             <integrator type=\"prb\"/>\n<texture type=\"volume\"/>\n\
             <shape type=\"sphere\"><medium type=\"homogeneous\" name=\"interior\"/></shape>",
            "2:1: bsdf plugin \"hair\" is not supported",
        )
        .and("3:1: shape plugin \"bsplinecurve\" is not supported")
        .and("4:1: emitter plugin \"projector\" is not supported")
        .and("5:1: integrator plugin \"prb\" is not supported")
        .and("6:1: texture plugin \"volume\" is not supported")
        .and("7:22: medium plugin \"homogeneous\" is not supported"),
        camera("unknown sensor", "<sensor type=\"perspectiv\"/>", "did you mean \"perspective\"?"),
        film(
            "unknown filter",
            "<rfilter type=\"gauss\"/>",
            "rfilter plugin \"gauss\" is not supported",
        ),
        camera(
            "unknown sampler",
            "<sensor type=\"perspective\"><sampler type=\"stratifed\"/></sensor>",
            "did you mean \"stratified\"?",
        ),
    ]
}

fn materials() -> Vec<Case> {
    let bsdf = |kind: &str, content: &str| format!("<bsdf type=\"{kind}\">{content}</bsdf>");
    let string = |name: &str, value: &str| format!("<string name=\"{name}\" value=\"{value}\"/>");
    let float = |name: &str, value: &str| format!("<float name=\"{name}\" value=\"{value}\"/>");
    let null = "<bsdf type=\"null\"/>";
    let blend = |i: usize| {
        format!(
            "<bsdf type=\"blendbsdf\" id=\"b{}\"><float name=\"weight\" value=\"0.5\"/>\
             <ref id=\"b{i}\"/><ref id=\"b{i}\"/></bsdf>\n",
            i + 1
        )
    };
    let blends: String = (0..12).map(blend).collect();
    vec![
        scene(
            "unknown metal",
            &bsdf("conductor", &string("material", "au")),
            "\"au\" is no known metal (did you mean \"Au\"?)",
        ),
        scene(
            "metal and eta",
            &bsdf("conductor", &(string("material", "Au") + &float("eta", "1"))),
            "\"material\" stands beside \"eta\" and \"k\"",
        ),
        scene(
            "unknown glass",
            &bsdf("dielectric", &string("int_ior", "bk8")),
            "\"bk8\" has no known index of refraction (did you mean \"bk7\"?)",
        ),
        scene(
            "negative glass",
            &bsdf("dielectric", &float("int_ior", "-1")),
            "\"int_ior\" = -1 must be positive",
        ),
        scene(
            "one alpha",
            &bsdf("roughconductor", &float("alpha_u", "0.1")),
            "\"alpha_u\" and \"alpha_v\" must be given together",
        ),
        scene(
            "unknown distribution",
            &bsdf("roughplastic", &string("distribution", "gxg")),
            "\"distribution\" = \"gxg\" is not known (did you mean \"ggx\"?)",
        ),
        scene(
            "textured plastic alpha",
            &bsdf("roughplastic", "<texture type=\"checkerboard\" name=\"alpha\"/>"),
            "\"alpha\" of \"roughplastic\" is an object, expected a float",
        ),
        scene(
            "twosided nothing",
            &bsdf("twosided", ""),
            "\"twosided\" needs 1 or 2 nested <bsdf>, found 0",
        ),
        scene("twosided glass", &bsdf("twosided", "<bsdf type=\"dielectric\"/>"), "2:1: "),
        scene(
            "blend of one",
            &bsdf("blendbsdf", &(float("weight", "0.5") + null)),
            "\"blendbsdf\" needs 2 nested <bsdf>, found 1",
        ),
        scene(
            "blend without weight",
            &bsdf("blendbsdf", &null.repeat(2)),
            "\"blendbsdf\" needs the parameter \"weight\"",
        ),
        scene(
            "blend of 4096",
            &format!("<bsdf type=\"diffuse\" id=\"b0\"/>\n{blends}"),
            "scene.xml:6:1",
        ),
        scene("bumps of nothing", &bsdf("bumpmap", null), "\"bumpmap\" needs a nested <texture>"),
        scene(
            "texture that is a material",
            &bsdf("diffuse", "<bsdf type=\"null\" name=\"reflectance\"/>"),
            "\"reflectance\" of \"diffuse\" is an object, expected a colour",
        ),
        scene(
            "nested for nothing",
            &bsdf("diffuse", null),
            "\"diffuse\" has no use for a nested <bsdf>",
        ),
        scene(
            "attribute of nothing",
            &bsdf(
                "diffuse",
                "<texture type=\"mesh_attribute\" name=\"reflectance\"><string name=\"name\" value=\"color\"/></texture>",
            ),
            "\"color\" begins neither with vertex_ nor with face_",
        ),
        scene(
            "two materials",
            &format!("<shape type=\"sphere\">{null}{null}</shape>"),
            "\"sphere\" takes one bsdf only",
        ),
    ]
}

fn lights_and_shapes() -> Vec<Case> {
    let shape = |kind: &str, content: &str| format!("<shape type=\"{kind}\">{content}</shape>");
    let area = "<emitter type=\"area\"/>";
    vec![
        scene("light on nothing", area, "emitter \"area\" must stand inside a <shape>"),
        scene(
            "point on a shape",
            &shape("sphere", "<emitter type=\"point\"/>"),
            "emitter \"point\" cannot be put on a shape",
        ),
        scene(
            "shining group",
            &shape("shapegroup", &shape("sphere", area)),
            "a shape of a shapegroup cannot shine",
        ),
        scene(
            "instance of a sphere",
            &shape("instance", &shape("sphere", "")),
            "\"instance\" places a \"shapegroup\", not a \"sphere\"",
        ),
        scene("instance of nothing", &shape("instance", ""), "\"instance\" needs a \"shapegroup\""),
        scene(
            "group in a group",
            &shape("shapegroup", &shape("shapegroup", "")),
            "\"shapegroup\" cannot stand inside \"shapegroup\"",
        ),
        scene(
            "flat cylinder",
            &shape("cylinder", "<point name=\"p0\" value=\"1\"/><point name=\"p1\" value=\"1\"/>"),
            "\"p0\" and \"p1\" of \"cylinder\" are the same point",
        ),
        scene(
            "two surroundings",
            &"<emitter type=\"constant\"/>\n".repeat(2),
            "3:1: only one emitter may surround the scene",
        ),
        scene(
            "light going nowhere",
            "<emitter type=\"directional\"><vector name=\"direction\" value=\"0\"/></emitter>",
            "\"direction\" of \"directional\" is zero",
        ),
        scene(
            "hazy sky",
            "<emitter type=\"sunsky\"><float name=\"turbidity\" value=\"11\"/></emitter>",
            "2:24: turbidity 11 is not between 1 and 10",
        ),
        scene(
            "two suns",
            "<emitter type=\"sunsky\"><vector name=\"sun_direction\" value=\"0 0 1\"/>\
             <float name=\"hour\" value=\"9\"/></emitter>",
            "\"hour\" stands beside \"sun_direction\"",
        ),
        scene(
            "thirteenth month",
            "<emitter type=\"sky\"><integer name=\"month\" value=\"13\"/></emitter>",
            "\"month\" = 13 must be between 1 and 12",
        ),
        scene(
            "sun nowhere",
            "<emitter type=\"sun\"><vector name=\"sun_direction\" value=\"0\"/></emitter>",
            "the sun's direction is no direction",
        ),
        scene(
            "wide spot",
            "<emitter type=\"spot\"><float name=\"cutoff_angle\" value=\"95\"/></emitter>",
            "\"cutoff_angle\" = 95 must be between 0 and 90",
        ),
        scene(
            "textured point",
            "<emitter type=\"point\"><texture type=\"checkerboard\" name=\"intensity\"/></emitter>",
            "\"intensity\" of \"point\" cannot vary over a surface",
        ),
    ]
}

fn cameras() -> Vec<Case> {
    let sensor = |content: &str| format!("<sensor type=\"perspective\">{content}</sensor>");
    let float = |name: &str, value: &str| format!("<float name=\"{name}\" value=\"{value}\"/>");
    let size = |w: &str, h: &str| integer("width", w) + &integer("height", h);
    vec![
        film("no width", &size("0", "100"), "\"width\" = 0 must be between 1 and 1073741824"),
        film(
            "negative height",
            &size("100", "-5"),
            "\"height\" = -5 must be between 1 and 1073741824",
        ),
        film("10^9 columns", &size("1000000000", "1000000000"), "larger than the limit")
            .about(Subject::Memory),
        film("10^12 columns", &size("1000000000000", "1"), "\"width\" = 1000000000000 must be"),
        film(
            "float width",
            "<float name=\"width\" value=\"10\"/>",
            "\"width\" of \"hdrfilm\" is a float, expected an integer",
        ),
        film(
            "crop outside",
            &(size("10", "10") + &integer("crop_offset_x", "5")),
            "the crop window ends at 15, beyond the film's edge 10",
        ),
        film(
            "unknown format",
            "<string name=\"pixel_format\" value=\"rbg\"/>",
            "did you mean \"rgb\"?",
        ),
        camera(
            "180 degrees",
            &sensor(&float("fov", "180")),
            "\"fov\" = 180 must be between 0 and 180 degrees",
        ),
        camera(
            "fov axis",
            &sensor("<string name=\"fov_axis\" value=\"z\"/>"),
            "\"fov_axis\" = \"z\" is not known",
        ),
        camera(
            "focal length",
            &sensor("<string name=\"focal_length\" value=\"50cm\"/>"),
            "is no length such as 50mm",
        ),
        camera(
            "fov and focal length",
            &sensor(&(float("fov", "40") + "<string name=\"focal_length\" value=\"50mm\"/>")),
            "\"focal_length\" stands beside \"fov\"",
        ),
        camera(
            "near beyond far",
            &sensor(&(float("near_clip", "5") + &float("far_clip", "1"))),
            "\"near_clip\" = 5 is not below \"far_clip\" = 1",
        ),
        camera(
            "scaled camera",
            &sensor("<transform name=\"to_world\"><scale value=\"2\"/></transform>"),
            "must not scale",
        ),
        camera(
            "lens without aperture",
            "<sensor type=\"thinlens\"/>",
            "\"thinlens\" needs the parameter \"aperture_radius\"",
        ),
        camera(
            "no samples",
            &sensor(&format!(
                "<sampler type=\"independent\">{}</sampler>",
                integer("sample_count", "0")
            )),
            "\"sample_count\" = 0 must be at least 1",
        ),
    ]
}

fn integrators() -> Vec<Case> {
    let path = |content: &str| format!("<integrator type=\"path\">{content}</integrator>");
    vec![
        scene(
            "two integrators",
            &format!("{}\n{}", path(""), path("")),
            "3:1: only one integrator can be used",
        ),
        scene(
            "negative depth",
            &path(&integer("max_depth", "-3")),
            "\"max_depth\" = -3 must be at least -1",
        ),
        scene(
            "no roulette depth",
            &path(&integer("rr_depth", "0")),
            "\"rr_depth\" = 0 must be at least 1",
        ),
        scene(
            "more corrections than look-ups",
            "<integrator type=\"irrcache\"><float name=\"debias\" value=\"1.5\"/></integrator>",
            "\"debias\" = 1.5 must be a number between 0 and 1",
        ),
        scene(
            "misspelt criterion",
            "<integrator type=\"irrcache\"><string name=\"criterion\" value=\"ward89\"/></integrator>",
            "\"criterion\" = ward89 must be one of hessian, krivanek06, tabellion04, ward92, ward88, \
             thesis (did you mean \"ward88\"?)",
        ),
        scene(
            "misspelt parameter of the cache",
            "<integrator type=\"irrcache\">\n<float name=\"accurcy\" value=\"0.1\"/></integrator>",
            "3:1: \"irrcache\" has no parameter \"accurcy\" (did you mean \"accuracy\"?)",
        ),
        scene(
            "two names of one parameter",
            "<integrator type=\"irrcache\">\n<float name=\"A\" value=\"0.1\"/>\n\
             <float name=\"accuracy\" value=\"0.1\"/></integrator>",
            "4:1: \"accuracy\" stands beside \"A\": give one",
        ),
        scene(
            "what another program does alone",
            "<integrator type=\"irrcache\">\n<boolean name=\"debug\" value=\"true\"/></integrator>",
            "3:1: \"debug\" = true cannot be (records are not painted into the picture)",
        ),
        scene(
            "colour of a parameter of the cache",
            "<integrator type=\"irrcache\"><rgb name=\"noise\" value=\"0.1\"/></integrator>",
            "\"noise\" of \"irrcache\" is an rgb, expected a number, boolean or string",
        ),
        scene(
            "misspelt depth",
            &path(&integer("max_dept", "3")),
            "\"path\" has no parameter \"max_dept\" (did you mean \"max_depth\"?)",
        ),
        scene(
            "unknown aov",
            "<integrator type=\"aov\"><string name=\"aovs\" value=\"d:depht\"/></integrator>",
            "aov \"depht\" is not known (did you mean \"depth\"?)",
        ),
    ]
}

pub(crate) fn cases() -> Vec<Case> {
    [unsupported(), materials(), lights_and_shapes(), cameras(), integrators()]
        .into_iter()
        .flatten()
        .collect()
}
