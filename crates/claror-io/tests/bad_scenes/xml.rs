//! Files that are no text, no XML, or XML with bad intentions.

use claror_io::diagnostic::Subject;

use crate::{Case, raw, scene};

/// Encodes ASCII as UTF-16, little endian.
fn utf16(text: &str) -> Vec<u8> {
    text.encode_utf16().flat_map(u16::to_le_bytes).collect()
}

/// `count` elements, each inside the one before.
fn nested(count: usize) -> String {
    let mut text = "<scene version=\"3.0.0\">".to_owned();
    text.push_str(&"<shape type=\"shapegroup\">".repeat(count));
    text.push_str(&"</shape>".repeat(count));
    text + "</scene>"
}

fn attributes(count: usize) -> String {
    let list: Vec<String> = (0..count).map(|i| format!("a{i}=\"\"")).collect();
    format!("<scene {}/>", list.join(" "))
}

const BOMB: &str = "<?xml version=\"1.0\"?>\n<!DOCTYPE lolz [\n<!ENTITY a \"ha\">\n\
                    <!ENTITY b \"&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;\">\n\
                    <!ENTITY c \"&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;\">]>\n\
                    <scene version=\"3.0.0\">&c;</scene>";

pub(crate) fn cases() -> Vec<Case> {
    let cut = "<scene version=\"3.0.0\">\n  <bsdf type=\"diffuse\">\n    <rgb name=\"refl";
    vec![
        raw("empty file", "", "scene.xml:1:1: the file holds no XML element"),
        raw("blank file", "\n\n  ", "the file holds no XML element"),
        raw("only a comment", "<!-- -->", "the file holds no XML element"),
        raw("a picture", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "1:1: the file is not UTF-8")
            .about(Subject::File),
        raw("zero bytes", b"<scene\0\0\0\0", "1:7: the file is not a text: it holds a zero byte")
            .about(Subject::File),
        raw("UTF-16", [vec![0xff, 0xfe], utf16("<scene/>")].concat(), "1:1: the file is UTF-16")
            .about(Subject::File),
        raw("UTF-16 without mark", utf16("<scene/>"), "the file is UTF-16 (save it as UTF-8)")
            .about(Subject::File),
        raw("Latin-1", b"<scene>\n<!-- gr\xfcn -->\n</scene>", "2:8: the file is not UTF-8")
            .about(Subject::File),
        raw("not XML", "v 0 0 0\nv 1 0 0\n", "1:1: this is not XML: text before the root element"),
        raw("cut in a tag", cut, "3:10: the value of \"name\" of <rgb> never ends"),
        raw("cut between tags", &cut[..46], "ends inside <bsdf (the file may have been cut)"),
        raw("cut after a tag", &cut[..47], "2:3: the file ends before <bsdf> is closed"),
        raw("entity bomb", BOMB, "2:1: document type declarations are not allowed"),
        raw(
            "external entity",
            "<!DOCTYPE s [<!ENTITY e SYSTEM \"file:///etc/passwd\">]>\n<scene>&e;</scene>",
            "1:1: document type declarations are not allowed",
        ),
        raw("unknown entity", "<scene version=\"&e;\"/>", "1:17: unknown entity &e;"),
        raw("nested 200 000 deep", nested(200_000), "elements are nested deeper than 64"),
        raw("many attributes", attributes(100_000), "<scene> has more than 64 attributes"),
        raw(
            "wrong end tag",
            "<scene version=\"3.0.0\">\n<bsdf type=\"null\">\n</shape>\n</scene>",
            "3:1: </shape> closes <bsdf>: expected </bsdf>",
        ),
        scene(
            "no quotes",
            "<float name=fov value=\"1\"/>",
            "2:8: the value of \"name\" of <float>",
        ),
        scene(
            "missing quote",
            "<float name=\"a value=\"1\"/>",
            "2:23: missing space before '1' in <float>",
        ),
        scene(
            "attribute twice",
            "<ref id=\"a\" id=\"b\"/>",
            "<ref> has the attribute \"id\" twice",
        ),
        raw(
            "two roots",
            "<scene version=\"3.0.0\"/>\n<scene/>",
            "2:1: <scene> stands after the root",
        ),
        raw(
            "open comment",
            "<scene version=\"3.0.0\">\n <!-- </scene>",
            "2:2: this comment is never closed by -->",
        ),
        raw("a web page", "<html><body/></html>", "the root element is <html>, not <scene>"),
        raw("a bare material", "<bsdf version=\"3.0.0\" type=\"null\"/>", "<bsdf>, not <scene>"),
        raw("no version", "<scene/>", "1:1: <scene> needs the attribute \"version\""),
        raw("odd version", "<scene version=\"new\"/>", "1:8: invalid version \"new\""),
    ]
}
