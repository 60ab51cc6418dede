//! Elements, attributes, references, includes and parameters.

use claror_io::diagnostic::Subject;

use crate::{Case, raw, scene};

/// `count` objects of which each refers to the next.
fn chain(count: usize) -> String {
    let link = |i| format!("<bsdf type=\"twosided\" id=\"b{i}\"><ref id=\"b{}\"/></bsdf>\n", i + 1);
    let links: String = (0..count).map(link).collect();
    format!("{links}<bsdf type=\"diffuse\" id=\"b{count}\"/>")
}

fn including(names: &[&str]) -> String {
    let list: String = names.iter().map(|n| format!("\n<include filename=\"{n}\"/>")).collect();
    format!("<scene version=\"3.0.0\">{list}\n</scene>")
}

/// Files of which each includes the next `width` times.
fn tower(case: Case, height: usize, width: usize) -> Case {
    (0..height).fold(case, |case, i| {
        let next = format!("{}.xml", i + 1);
        case.file(&format!("{i}.xml"), including(&vec![next.as_str(); width]))
    })
}

/// Parameters that double in length.
fn doubling() -> String {
    let line = |i| format!("<default name=\"a{}\" value=\"$a{i}$a{i}\"/>\n", i + 1);
    let lines: String = (0..40).map(line).collect();
    format!("<default name=\"a0\" value=\"0123456789\"/>\n{lines}")
}

fn references() -> Vec<Case> {
    vec![
        scene(
            "unknown reference",
            "<bsdf type=\"null\" id=\"white\"/>\n<shape type=\"sphere\"><ref id=\"whit\"/></shape>",
            "3:22: no object has the id \"whit\" (did you mean \"white\"?)",
        ),
        scene(
            "reference cycle",
            "<bsdf type=\"twosided\" id=\"a\"><ref id=\"b\"/></bsdf>\n\
             <bsdf type=\"twosided\" id=\"b\"><ref id=\"a\"/></bsdf>",
            "3:30: objects refer to each other: a -> b -> a",
        ),
        scene(
            "reference to itself",
            "<bsdf type=\"mask\" id=\"m\"><ref id=\"m\"/></bsdf>",
            "objects refer to each other: m -> m",
        ),
        scene(
            "reference to a shape",
            "<shape type=\"sphere\" id=\"s\"><ref id=\"s\"/></shape>",
            "s -> s",
        ),
        scene("long chain of references", &chain(300), "objects are nested deeper than 100"),
        scene(
            "id twice",
            "<bsdf type=\"null\" id=\"a\"/>\n<bsdf type=\"null\" id=\"a\"/>",
            "3:19: the id \"a\" is used twice (first used at",
        ),
        scene(
            "alias of nothing",
            "<bsdf type=\"null\" id=\"abc\"/><alias id=\"abd\" as=\"x\"/>",
            "no object has the id \"abd\" yet (did you mean \"abc\"?)",
        ),
    ]
}

fn includes() -> Vec<Case> {
    vec![
        raw(
            "include cycle",
            including(&["b.xml"]),
            "b.xml:2:10: the file includes itself: scene.xml -> b.xml -> scene.xml",
        )
        .file("b.xml", including(&["scene.xml"])),
        raw("include of itself", including(&["scene.xml"]), "scene.xml -> scene.xml"),
        raw(
            "missing include",
            including(&["no.xml"]),
            "2:10: included file \"no.xml\" is not found",
        )
        .about(Subject::File),
        tower(
            raw("includes too deep", including(&["0.xml"]), "includes are nested deeper than 15"),
            20,
            1,
        ),
        tower(raw("include bomb", including(&["0.xml"]), "more than 10000 includes"), 14, 10)
            .file("14.xml", "<scene version=\"3.0.0\"/>"),
        raw("broken include", including(&["b.xml"]), "b.xml:1:1: the file ends inside <scene")
            .file("b.xml", "<scene version=\"3.0.0\""),
    ]
}

fn parameters() -> Vec<Case> {
    vec![
        scene(
            "undefined parameter",
            "<default name=\"spp\" value=\"4\"/>\n<integrator type=\"$sp\"/>",
            "3:13: undefined parameter $sp (did you mean \"spp\"?)",
        ),
        scene("doubling parameters", &doubling(), "the value is longer than 1048576 bytes"),
        Case {
            defines: &[("ssp", "4")],
            ..scene(
                "unused definition",
                "<default name=\"spp\" value=\"4\"/>",
                "nothing in the scene uses $ssp (did you mean \"spp\"?)",
            )
        },
    ]
}

fn elements() -> Vec<Case> {
    vec![
        scene(
            "unknown element",
            "<bsfd type=\"null\"/>",
            "2:1: unknown element <bsfd> (did you mean <bsdf>?)",
        ),
        scene(
            "unknown attribute",
            "<bsdf type=\"null\" ident=\"a\"/>",
            "2:19: unexpected attribute \"ident\" of <bsdf>",
        ),
        scene("no type", "<bsdf id=\"a\"/>", "2:1: <bsdf> needs the attribute \"type\""),
        scene(
            "element in a value",
            "<bsdf type=\"mask\"><float name=\"opacity\" value=\"1\"><bsdf type=\"null\"/></float>\
             <bsdf type=\"null\"/></bsdf>",
            "<bsdf> cannot stand inside <float>",
        ),
        scene("scene in a scene", "<scene version=\"3.0.0\"/>", "2:1: <scene> cannot stand inside"),
        scene(
            "translate alone",
            "<shape type=\"sphere\"><translate x=\"1\"/></shape>",
            "2:22: <translate> may stand inside <transform> only",
        ),
        scene(
            "unknown operation",
            "<shape type=\"sphere\"><transform name=\"to_world\"><rotat x=\"1\" angle=\"9\"/>\
             </transform></shape>",
            "<rotat> cannot stand inside <transform> (did you mean \"rotate\"?)",
        ),
        scene(
            "property twice",
            "<shape type=\"sphere\">\n<float name=\"radius\" value=\"1\"/>\n\
             <float name=\"radius\" value=\"2\"/></shape>",
            "4:1: \"radius\" is set twice (first set at",
        ),
        scene(
            "film in the scene",
            "<film type=\"hdrfilm\"/>",
            "<film> cannot stand inside <scene>",
        ),
        scene(
            "parameter of the scene",
            "<float name=\"foo\" value=\"1\"/>",
            "\"scene\" has no parameter \"foo\"",
        ),
        raw("no sensor", "<scene version=\"3.0.0\"/>", "1:1: the scene has no sensor"),
    ]
}

pub(crate) fn cases() -> Vec<Case> {
    [references(), includes(), parameters(), elements()].into_iter().flatten().collect()
}
