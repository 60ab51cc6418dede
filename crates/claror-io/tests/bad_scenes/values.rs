//! Numbers, colours, spectra and transforms.

use claror_io::diagnostic::Subject;

use crate::{Case, scene};

/// A sphere with that property.
fn sphere(name: &'static str, property: &str, expected: &'static str) -> Case {
    scene(name, &format!("<shape type=\"sphere\">{property}</shape>"), expected)
}

/// A sphere with that operation in its transform.
fn moved(name: &'static str, operation: &str, expected: &'static str) -> Case {
    let transform = format!("<transform name=\"to_world\">{operation}</transform>");
    sphere(name, &transform, expected)
}

/// A diffuse material with that reflectance.
fn diffuse(name: &'static str, property: &str, expected: &'static str) -> Case {
    scene(name, &format!("<bsdf type=\"diffuse\">{property}</bsdf>"), expected)
}

fn numbers() -> Vec<Case> {
    let radius = |value: &str| format!("<float name=\"radius\" value=\"{value}\"/>");
    vec![
        sphere("a word", &radius("big"), "2:43: \"value\" of <float>: \"big\" is not a number"),
        sphere("NaN", &radius("NaN"), "\"NaN\" is not a number"),
        sphere("infinity", &radius("-inf"), "\"-inf\" is not finite"),
        sphere("1e999", &radius("1e999"), "2:43: \"value\" of <float>: \"1e999\" is not finite"),
        sphere("1e300", &radius("1e300"), "\"radius\" = 1e300 is too large for single precision"),
        sphere("negative radius", &radius("-1"), "\"radius\" = -1 must be positive"),
        sphere("zero radius", &radius("0"), "\"radius\" = 0 must be positive"),
        sphere("no value", "<float name=\"radius\"/>", "<float> needs the attribute \"value\""),
        sphere("empty value", &radius(""), "\"\" is not a number"),
        sphere(
            "fraction for an integer",
            "<integer name=\"radius\" value=\"1.5\"/>",
            "\"1.5\" is not an integer",
        ),
        sphere(
            "float for an integer",
            "<string name=\"radius\" value=\"1\"/>",
            "2:22: \"radius\" of \"sphere\" is a string, expected a float",
        ),
        sphere(
            "yes",
            "<boolean name=\"flip_normals\" value=\"yes\"/>",
            "\"yes\" is neither \"true\" nor \"false\"",
        ),
        sphere(
            "misspelt parameter",
            "<float name=\"radios\" value=\"1\"/>",
            "2:22: \"sphere\" has no parameter \"radios\" (did you mean \"radius\"?)",
        ),
        sphere(
            "point of two",
            "<point name=\"center\" value=\"1 2\"/>",
            "expected 1 or 3 values, found 2",
        ),
        sphere(
            "point without z",
            "<point name=\"center\" x=\"1\" y=\"2\"/>",
            "<point> needs the attribute \"z\"",
        ),
    ]
}

fn colors() -> Vec<Case> {
    let rgb = |value: &str| format!("<rgb name=\"reflectance\" value=\"{value}\"/>");
    let spectrum = |value: &str| format!("<spectrum name=\"reflectance\" {value}/>");
    vec![
        diffuse(
            "albedo above 1",
            &rgb("0.5 1.5 0.5"),
            "\"reflectance\" = 0.5 1.5 0.5 must be between 0 and 1",
        ),
        diffuse("albedo below 0", &rgb("-0.1"), "must be between 0 and 1"),
        diffuse(
            "grey albedo above 1",
            "<float name=\"reflectance\" value=\"2\"/>",
            "2:22: \"reflectance\" = 2 2 2 must be between 0 and 1",
        ),
        diffuse("two channels", &rgb("0.5, 0.5"), "expected 1 or 3 values, found 2"),
        diffuse("hexadecimal rgb", &rgb("#ff8000"), "write <srgb …> instead of <rgb …>"),
        diffuse(
            "short hexadecimal",
            "<srgb name=\"reflectance\" value=\"#ff80\"/>",
            "\"#ff80\" is not of the form #rrggbb",
        ),
        diffuse("NaN in a colour", &rgb("0.5 nan 0.5"), "\"nan\" is not a number"),
        diffuse(
            "descending spectrum",
            &spectrum("value=\"500:1 400:1\""),
            "wavelengths must ascend: 500 is followed by 400",
        ),
        diffuse(
            "half a pair",
            &spectrum("value=\"400:1 500\""),
            "\"500\" is not of the form wavelength:value",
        ),
        diffuse("one sample", &spectrum("value=\"400:1\""), "a spectrum needs at least 2 samples"),
        diffuse("no spectrum", &spectrum(""), "<spectrum> needs either \"value\" or \"filename\""),
        diffuse(
            "missing spectrum",
            &spectrum("filename=\"a.spd\""),
            "2:51: \"a.spd\" is not found",
        )
        .about(Subject::File),
        diffuse(
            "broken spectrum",
            &spectrum("filename=\"a.spd\""),
            "line 2: \"x\" is not a number",
        )
        .file("a.spd", "400 1\n500 x\n")
        .about(Subject::File),
        diffuse(
            "string for a colour",
            "<string name=\"reflectance\" value=\"red\"/>",
            "is a string, expected a colour",
        ),
        scene(
            "negative radiance",
            "<shape type=\"sphere\"><emitter type=\"area\"><rgb name=\"radiance\" value=\"-1\"/>\
             </emitter></shape>",
            "\"radiance\" = -1 -1 -1 must be at least 0",
        ),
    ]
}

fn transforms() -> Vec<Case> {
    vec![
        moved(
            "zero scale",
            "<scale value=\"1 0 1\"/>",
            "2:22: \"to_world\" of \"sphere\" is singular",
        ),
        moved("zero axis", "<rotate angle=\"90\"/>", "2:49: the axis of <rotate> is zero"),
        moved("no angle", "<rotate x=\"1\"/>", "<rotate> needs the attribute \"angle\""),
        moved(
            "looking nowhere",
            "<lookat origin=\"1 1 1\" target=\"1 1 1\" up=\"0 1 0\"/>",
            "<lookat> looks nowhere",
        ),
        moved(
            "up along the view",
            "<lookat origin=\"0 0 0\" target=\"0 2 0\" up=\"0 1 0\"/>",
            "<lookat> looks nowhere",
        ),
        moved(
            "matrix of 15",
            &format!("<matrix value=\"{}\"/>", "1 ".repeat(15)),
            "a matrix has 9 or 16 values, found 15",
        ),
        moved(
            "rank 1 matrix",
            "<matrix value=\"1 2 3 2 4 6 3 6 9\"/>",
            "\"to_world\" of \"sphere\" is singular",
        ),
        moved(
            "projection",
            "<matrix value=\"1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0\"/>",
            "\"to_world\" is a projection",
        ),
        moved(
            "overflow",
            &"<scale value=\"1e200\"/>".repeat(2),
            "\"to_world\" of \"sphere\" is not finite",
        ),
        moved(
            "value and x",
            "<scale value=\"1\" x=\"2\"/>",
            "<scale> has both \"value\" and \"x\"",
        ),
        sphere(
            "transform as a number",
            "<float name=\"to_world\" value=\"1\"/>",
            "is a float, expected a transform",
        ),
    ]
}

pub(crate) fn cases() -> Vec<Case> {
    [numbers(), colors(), transforms()].into_iter().flatten().collect()
}
