//! Scenes damaged at random: whatever comes, there is an answer and no panic.
//!
//! `CLAROR_MUTATIONS=1000000` runs longer than the default.

use super::*;

/// SplitMix64 (Steele, Lea and Flood 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, bound: usize) -> usize {
        usize::try_from(self.next() % bound.max(1) as u64).unwrap()
    }
}

/// A scene that uses most of the language.
const SEED: &str = r##"<scene version="3.0.0">
<default name="spp" value="16"/><path value="folder"/>
<integrator type="aov"><string name="aovs" value="d:depth"/><integrator type="path">
<integer name="max_depth" value="-1"/></integrator></integrator>
<sensor type="thinlens" id="eye"><float name="aperture_radius" value="0.1"/>
<string name="focal_length" value="50mm"/><string name="fov_axis" value="smaller"/>
<transform name="to_world"><lookat origin="0 0 5" target="0,0,0" up="0 1 0"/></transform>
<sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
<film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="48"/>
<integer name="crop_width" value="32"/><rfilter type="lanczos"/></film></sensor>
<bsdf type="twosided" id="red"><bsdf type="diffuse"><srgb name="reflectance" value="#ff8000"/></bsdf></bsdf>
<bsdf type="blendbsdf" id="mix"><float name="weight" value="0.5"/><ref id="red"/>
<bsdf type="roughconductor"><string name="material" value="Au"/><float name="alpha" value="0.2"/></bsdf></bsdf>
<bsdf type="principled" id="p"><rgb name="base_color" value="0.1 0.2 0.3"/></bsdf>
<alias id="p" as="q"/>
<shape type="sphere"><point name="center" x="1" y="2" z="3"/><ref id="mix"/></shape>
<shape type="cylinder"><point name="p1" value="1 2 3"/><ref id="q"/></shape>
<shape type="cube"><transform name="to_world"><matrix value="1 0 0 0 1 0 0 0 1"/>
<rotate x="1" angle="30"/><scale value="2"/></transform><bsdf type="bumpmap">
<texture type="checkerboard"><transform name="to_uv"><scale x="4"/></transform></texture>
<bsdf type="plastic"><string name="int_ior" value="water"/></bsdf></bsdf></shape>
<shape type="shapegroup" id="g"><shape type="disk"/><shape type="rectangle"/></shape>
<shape type="instance"><ref id="g"/><transform name="to_world"><translate x="4"/></transform></shape>
<shape type="rectangle"><emitter type="area"><spectrum name="radiance" value="400:1, 700:2"/></emitter></shape>
<emitter type="spot"><rgb name="intensity" value="1"/></emitter>
<emitter type="directional"><vector name="direction" value="0 -1 0"/></emitter>
<include filename="b.xml"/>
</scene>"##;

const INCLUDED: &str = "<scene version=\"0.6.0\"><bsdf type=\"dielectric\"><float name=\"intIOR\" \
                        value=\"1.5\"/></bsdf><shape type=\"sphere\"><transform name=\"toWorld\">\
                        <lookAt origin=\"1 2 3\" target=\"0 0 0\"/></transform><ref id=\"red\"/>\
                        </shape></scene>";

/// What is put into scenes.
const WORDS: [&str; 24] = [
    "<",
    ">",
    "\"",
    "/>",
    "</",
    "&",
    "$spp",
    "$",
    "\\$",
    "<!--",
    "<![CDATA[",
    "<?",
    "&#x41;",
    "1e999",
    "nan",
    "-1",
    "0",
    "id=\"red\"",
    "<ref id=\"mix\"/>",
    "<bsdf type=\"",
    "é",
    "\u{0}",
    "b.xml",
    "scene.xml",
];

fn mutate(bytes: &mut Vec<u8>, random: &mut Random) {
    let at = random.below(bytes.len());
    let end = (at + 1 + random.below(30)).min(bytes.len());
    match random.below(6) {
        0 => bytes[at] ^= 1 << random.below(8),
        1 => drop(bytes.drain(at..end)),
        2 => {
            let word = WORDS[random.below(WORDS.len())].bytes();
            drop(bytes.splice(at..at, word));
        }
        3 => {
            let copy = bytes[at..end].to_vec();
            let to = random.below(bytes.len());
            drop(bytes.splice(to..to, copy));
        }
        4 => {
            let word = WORDS[random.below(WORDS.len())].bytes();
            drop(bytes.splice(at..end, word));
        }
        // Cuts the file, now and then.
        _ if random.below(8) == 0 => bytes.truncate(at),
        _ => bytes.swap(at, end - 1),
    }
}

#[test]
fn the_undamaged_scene_is_good() {
    let files = [("a/scene.xml", SEED), ("a/b.xml", INCLUDED), ("a/folder/c.xml", "")];
    if let Err(diagnostics) = load_memory(&files, &LoadOptions::default()) {
        panic!("{}", text_of(&diagnostics));
    }
}

#[test]
fn damaged_scenes_are_answered() {
    let count = std::env::var("CLAROR_MUTATIONS").ok().and_then(|n| n.parse().ok());
    let count: u64 = count.unwrap_or(3000);
    let mut accepted = 0;
    for i in 0..count {
        let mut random = Random(i);
        let mut files = [SEED, INCLUDED].map(|text| text.as_bytes().to_vec());
        for _ in 0..=random.below(6) {
            let which = usize::from(random.below(4) == 0);
            if files[which].is_empty() {
                files[which].push(b'<');
            }
            mutate(&mut files[which], &mut random);
        }
        let [scene, included] = files;
        let memory = Memory(BTreeMap::from([
            ("a/scene.xml".into(), scene),
            ("a/b.xml".into(), included),
            ("a/folder/c.xml".into(), Vec::new()),
        ]));
        let options = LoadOptions { lenient: i % 2 == 0, ..LoadOptions::default() };
        match load_from(&memory, Path::new("a/scene.xml"), &options) {
            Ok(loaded) => {
                accepted += 1;
                assert_eq!(loaded.shape_names.len(), loaded.tables.shapes.shapes.len());
            }
            Err(diagnostics) => {
                assert!(diagnostics.iter().any(|d| d.severity == crate::Severity::Error), "{i}");
                assert!(!text_of(&diagnostics).is_empty());
            }
        }
    }
    // Not everything breaks a scene.
    assert!(accepted > count / 1000, "{accepted} of {count}");
}
