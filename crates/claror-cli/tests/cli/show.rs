//! Looking at the irradiance cache: layers, the picture of its records, statistics.

use crate::common::{Folder, bits, picture};
use serde_json::{Value, json};

/// A quick render with an irradiance cache.
const RENDER: &str = "render room.xml -i irrcache -p integrator.max_depth=-1 --spp 4 \
                      -p integrator.gather_samples=100 -p integrator.noise=1";

#[test]
fn without_a_cache_there_is_nothing_to_show() {
    let folder = Folder::new();
    for (arguments, what) in [
        ("--aov irradiance", "layer irradiance: the integrator path uses no irradiance cache"),
        ("--aov albedo,my:cache_miss", "layer my: the integrator path uses no irradiance cache"),
        ("-i direct --aov record_radius", "layer record_radius: the integrator direct uses no"),
        ("--show-points a.png", "--show-points: the integrator path uses no irradiance cache"),
        ("--show_points a.png", "--show-points: the integrator path uses no irradiance cache"),
    ] {
        let run = folder.run(&format!("render room.xml -o a.exr {arguments}")).expect(2);
        assert!(run.stderr.contains(what), "{arguments}: {}", run.stderr);
        assert!(run.stderr.contains("-i irrcache chooses the one that does"), "{}", run.stderr);
    }
    assert_eq!(folder.files(), ["room.xml"]);
}

/// Whatever is wrong with the file is said before anything is rendered.
#[test]
fn the_file_is_checked_before_the_render() {
    let folder = Folder::new();
    for (arguments, code, what) in [
        ("--show-points a.gif", 2, "the ending of a.gif names no picture format"),
        ("--show-points -", 2, "--show-points takes a file"),
        ("--show-points ./a.exr", 2, "would be written twice"),
        ("--show-points no/a.png", 4, "there is no folder no"),
        ("--show-radii", 2, "--show-points <FILE>"),
        ("--show-points a.png --show-color mauve", 2, "yellow"),
    ] {
        let run = folder.run(&format!("{RENDER} -o a.exr {arguments}")).expect(code);
        assert!(run.stderr.contains(what), "{arguments}: {}", run.stderr);
    }
    assert_eq!(folder.files(), ["room.xml"]);
}

/// The picture itself is the same bits; the other one is that picture with black in some places.
#[test]
fn records_are_drawn_beside_the_picture() {
    let folder = Folder::new();
    folder.run(&format!("{RENDER} -q -o plain.exr")).expect(0);
    let run = folder.run(&format!("{RENDER} -o a.exr -o a.png --show-points dots.png")).expect(0);
    assert!(run.stdout.contains("dots.png: "), "{}", run.stdout);
    assert_eq!(bits(&folder.path("plain.exr")), bits(&folder.path("a.exr")));
    let [shown, dots] = ["a.png", "dots.png"].map(|name| picture(&folder.path(name)));
    let drawn = shown.data.iter().zip(&dots.data).filter(|(a, b)| a != b).count();
    assert!(drawn > 30 && drawn < shown.data.len() / 2, "{drawn} values differ");
    assert!(shown.data.iter().zip(&dots.data).all(|(a, b)| b <= a), "black darkens");

    folder.run(&format!("{RENDER} -q -o a.png --show-points rings.png --show-radii")).expect(0);
    let rings = picture(&folder.path("rings.png"));
    assert!(rings.data.iter().zip(&dots.data).all(|(a, b)| a <= b), "rings come on top of that");
    assert_ne!(rings, dots);
}

/// As the thesis' scene files ask for it: beside the picture, and no part of it.
#[test]
fn a_scene_can_ask_for_its_records() {
    let folder = Folder::new();
    let options = "-p integrator.show_points=true";
    folder.run(&format!("{RENDER} -q -o b.exr --show-points dots.png")).expect(0);
    let run = folder.run(&format!("{RENDER} {options} -o a.exr -o a.png")).expect(0);
    assert!(run.stdout.contains("a.points.png: "), "{}", run.stdout);
    assert_eq!(bits(&folder.path("b.exr")), bits(&folder.path("a.exr")));
    let [dots, asked] = ["a.points.png", "dots.png"].map(|name| picture(&folder.path(name)));
    assert_eq!(dots, asked);

    // The option wins, other integrators have no such parameter, and a pipe has no name.
    folder.run(&format!("{RENDER} -q {options} -o c.exr --show-points d.png")).expect(0);
    assert!(!folder.path("c.points.png").exists());
    let run = folder.run(&format!("render room.xml -i path {options} -o e.exr")).expect(2);
    assert!(run.stderr.contains("show_points"), "{}", run.stderr);
    let run = folder.run(&format!("{RENDER} {options} -o -")).expect(0);
    assert!(run.stderr.contains("--show-points FILE says where"), "{}", run.stderr);
    let run = folder.run(&format!("{RENDER} {options} -o a.exr -o a.points.png")).expect(2);
    assert!(run.stderr.contains("would be written twice"), "{}", run.stderr);
}

/// A crop of a larger film, with alpha, in linear light.
#[test]
fn size_crop_alpha_and_exposure_are_followed() {
    let folder = Folder::new();
    let options = "--size 40x30 --crop 5,6,20,10 -p film.alpha=true --exposure 1";
    let points = "--show-points dots.exr --show-color white";
    folder.run(&format!("{RENDER} -q {options} -o a.exr {points}")).expect(0);
    let [linear, dots] = ["a.exr", "dots.exr"].map(|name| picture(&folder.path(name)));
    assert_eq!((dots.width, dots.height, dots.channels), (20, 10, 4));
    let mut untouched = 0;
    for (a, b) in linear.data.chunks_exact(4).zip(dots.data.chunks_exact(4)) {
        let shown = [a[0], a[1], a[2]].map(|v| (2.0 * v).clamp(0.0, 1.0));
        untouched += u32::from(b[..3] == shown && b[3] == a[3]);
        assert!(b.iter().zip(shown.iter().chain(&a[3..])).all(|(b, a)| b >= a), "white brightens");
    }
    assert!((50..200).contains(&untouched), "{untouched} of 200 pixels show no dot");
}

#[test]
fn layers_of_the_cache_are_written() {
    let folder = Folder::new();
    let names = "irradiance,harmonic_mean_distance,record_radius,n:record_count,lookup_weight,\
                 cache_miss";
    folder.run(&format!("{RENDER} -q --layers -o a.exr --aov {names}")).expect(0);
    let limits = claror_io::Limits::default();
    let layer = |name: &str| {
        claror_io::image::read_layer(&folder.path("a.exr"), name, &limits)
            .unwrap_or_else(|e| panic!("{e}"))
            .image
    };
    assert_eq!(layer("irradiance").channels, 3);
    for name in ["irradiance", "harmonic_mean_distance", "record_radius", "n", "lookup_weight"] {
        assert!(layer(name).data.iter().any(|&v| v > 0.0), "{name}");
    }
    let misses = layer("cache_miss").data;
    // The sky behind the room has no diffuse surface.
    assert!(misses.contains(&0.0) && misses.contains(&5.0), "{misses:?}");
    assert!(misses.iter().all(|code| code.fract() == 0.0 && (0.0..=5.0).contains(code)));
}

fn result(folder: &Folder, arguments: &str) -> Value {
    let run = folder.run(&format!("{RENDER} --json {arguments}")).expect(0);
    run.events().pop().expect("a result")
}

#[test]
fn statistics_are_complete_and_reproducible() {
    let folder = Folder::new();
    let of = |threads: u32| {
        let arguments = format!("-t {threads} -o a.exr --show-points dots.png --cache a.cache");
        result(&folder, &format!("{arguments} --cache-mode write"))
    };
    let one = of(1);
    let cache = &one["cache"];
    let count = |value: &Value| value.as_u64().unwrap_or_else(|| panic!("a count in {cache}"));
    let levels = cache["levels"].as_array().expect("lattices");
    let by_level: u64 = levels.iter().map(|level| count(&level["records"])).sum();
    assert_eq!(by_level, count(&cache["records"]));
    for name in ["at_largest_radius", "gradient_limited", "ratio_limited"] {
        assert!(count(&cache[name]) <= by_level, "{name}");
    }
    let lookups = &cache["lookups"];
    assert!(count(&lookups["count"]) > 100 && lookups["mean_records"].as_f64() >= Some(1.0));
    let share = count(&lookups["uncached"]) as f64 / count(&lookups["count"]) as f64;
    assert_eq!(lookups["uncached_share"], json!(share));
    for phase in ["prepass", "render"] {
        assert!(one["seconds_by_phase"][phase].is_number(), "{one}");
    }
    let shown = &one["show_points"];
    let all = ["drawn", "hidden", "outside"].map(|name| count(&shown[name])).iter().sum::<u64>();
    assert_eq!((all, &shown["file"]), (by_level, &json!("dots.png")));
    let three = of(3);
    assert_eq!((&three["cache"], &three["show_points"]), (cache, shown));
    let info = folder.run("cache info a.cache --json").expect(0).events().remove(0);
    assert_eq!(info["statistics"]["levels"], cache["levels"]);
}

/// Of a cache that is too small for the view, look-ups fail, and are counted.
#[test]
fn what_the_cache_does_not_serve_is_counted() {
    let folder = Folder::new();
    result(&folder, "--sensor top --size 16x16 --crop 8,8,1,1 -o a.exr --cache a.cache");
    let found = result(&folder, "-o a.exr --cache a.cache --cache-mode read");
    let share = found["cache"]["lookups"]["uncached_share"].as_f64().expect("a share");
    assert!(share > 0.5, "{share}");
    let run = folder.run(&format!("{RENDER} -o a.exr --cache a.cache --cache-mode read"));
    assert!(run.expect(0).stdout.contains(" look-ups uncached\n"));
    let path = folder.run("render room.xml --json -o a.exr").expect(0).events();
    let path = path.last().expect("a result");
    assert_eq!(
        (&path["cache"], &path["seconds_by_phase"]["prepass"]),
        (&json!(null), &json!(null))
    );
}

#[test]
fn details_are_for_those_who_ask() {
    let folder = Folder::new();
    let quiet = folder.run(&format!("{RENDER} -o a.exr")).expect(0);
    let verbose = folder.run(&format!("{RENDER} -v -o a.exr")).expect(0);
    for line in ["records by lattice: ", "radii: ", "look-ups: ", "not stored: ", "time: "] {
        assert!(verbose.stderr.contains(line), "{line} in {}", verbose.stderr);
        assert!(!quiet.stdout.contains(line) && !quiet.stderr.contains(line), "{line}");
    }
}
