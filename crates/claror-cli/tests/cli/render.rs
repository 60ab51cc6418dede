//! `claror render` as a user sees it.

use crate::common::{Folder, bits, picture};

#[test]
fn a_scene_becomes_an_exr_and_a_png() {
    let folder = Folder::new();
    let run = folder.run("render room.xml").expect(0);
    assert_eq!(folder.files(), ["room.exr", "room.png", "room.xml"]);
    let image = picture(&folder.path("room.exr"));
    assert_eq!((image.width, image.height, image.channels), (24, 24, 3));
    assert!(image.data.iter().all(|v| v.is_finite()));
    let mean = image.data.iter().sum::<f32>() / image.data.len() as f32;
    assert!((0.05..2.0).contains(&mean), "mean {mean}");
    let lines: Vec<&str> = run.stdout.lines().collect();
    assert_eq!(lines[..2], ["room.exr", "room.png"]);
    assert!(lines[2].starts_with("24x24 pixels, 4 spp, "), "{}", run.stdout);
    assert!(lines[2].ends_with(": all samples done"), "{}", run.stdout);
    assert_eq!(run.stderr, "");
}

#[test]
fn every_format_is_written_by_its_ending() {
    let folder = Folder::new();
    folder.run("render room.xml -o a.exr -o a.png -o a.hdr -o a.PFM").expect(0);
    let magic = |name: &str| folder.read(name)[..4].to_vec();
    assert_eq!(magic("a.exr"), [0x76, 0x2f, 0x31, 0x01]);
    assert_eq!(magic("a.png"), [0x89, b'P', b'N', b'G']);
    assert_eq!(&magic("a.hdr")[..2], b"#?");
    assert_eq!(&magic("a.PFM"), b"PF\n2");
    assert_eq!(bits(&folder.path("a.exr")), bits(&folder.path("a.PFM")));
}

#[test]
fn standard_output_takes_the_picture_alone() {
    let folder = Folder::new();
    let run = folder.run("render room.xml -o -").expect(0);
    assert!(run.bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]));
    assert!(run.stderr.contains("24x24 pixels"), "{}", run.stderr);
    folder.write("out.exr", &run.bytes);
    folder.run("render room.xml -o again.exr").expect(0);
    assert_eq!(bits(&folder.path("out.exr")), bits(&folder.path("again.exr")));
    let run = folder.run("render room.xml -o - --format pfm").expect(0);
    assert!(run.bytes.starts_with(b"PF\n24 24\n"));
}

#[test]
fn threads_do_not_change_a_bit() {
    let folder = Folder::new();
    folder.run("render room.xml -t 1 -o one.exr").expect(0);
    for threads in [2, 3, 7] {
        folder.run(&format!("render room.xml -t {threads} -o many.exr")).expect(0);
        assert_eq!(bits(&folder.path("one.exr")), bits(&folder.path("many.exr")));
    }
}

#[test]
fn seeds_and_samplers_change_the_noise() {
    let folder = Folder::new();
    folder.run("render room.xml -o a.exr").expect(0);
    for option in ["--seed 7", "--sampler independent", "-p sampler.seed=9", "-Dspp=5"] {
        folder.run(&format!("render room.xml {option} -o b.exr")).expect(0);
        assert_ne!(bits(&folder.path("a.exr")), bits(&folder.path("b.exr")), "{option}");
    }
}

#[test]
fn size_crop_and_sensor_are_followed() {
    let folder = Folder::new();
    let size = |options: &str| {
        folder.run(&format!("render room.xml --spp 1 -o a.exr {options}")).expect(0);
        let image = picture(&folder.path("a.exr"));
        (image.width, image.height)
    };
    assert_eq!(size("--size 10x5"), (10, 5));
    assert_eq!(size("--crop 3,4,5,6"), (5, 6));
    assert_eq!(size("--size 40x30 --crop 30,20,10,10"), (10, 10));
    assert_eq!(size("--sensor 1"), (8, 6));
    assert_eq!(size("--sensor top"), (8, 6));
    assert_eq!(size("-Dres=9"), (9, 9));
}

#[test]
fn a_crop_is_a_part_of_the_whole() {
    let folder = Folder::new();
    folder.run("render room.xml -o whole.pfm").expect(0);
    folder.run("render room.xml -o part.pfm --crop 5,7,8,9").expect(0);
    let whole = picture(&folder.path("whole.pfm"));
    let part = picture(&folder.path("part.pfm"));
    for (x, y) in [(0, 0), (7, 0), (3, 4), (7, 8)] {
        assert_eq!(part.pixel(x, y), whole.pixel(x + 5, y + 7));
    }
}

#[test]
fn limits_of_any_kind_end_a_render() {
    let folder = Folder::new();
    let reason = |options: &str| {
        let run = folder.run(&format!("render room.xml -o a.exr {options}")).expect(0);
        run.stdout.trim_end().rsplit(": ").next().map(str::to_owned)
    };
    assert_eq!(reason("--time 300ms").as_deref(), Some("time is over"));
    assert_eq!(reason("--error 0.5").as_deref(), Some("error small enough"));
    assert_eq!(reason("--time 1h --spp 3").as_deref(), Some("all samples done"));
}

#[test]
fn parameters_reach_the_integrator() {
    let folder = Folder::new();
    folder.run("render room.xml -p integrator.max_depth=1 -o a.exr").expect(0);
    folder.run("render room.xml -o b.exr").expect(0);
    let sum = |name: &str| picture(&folder.path(name)).data.iter().sum::<f32>();
    assert!(sum("a.exr") < 0.9 * sum("b.exr"));
    folder.run("render room.xml -i depth -o depth.exr").expect(0);
    let depth = picture(&folder.path("depth.exr"));
    assert!((3.0..6.0).contains(&depth.pixel(12, 12)[0]), "{:?}", depth.pixel(12, 12));
}

#[test]
fn layers_sum_to_the_picture() {
    let folder = Folder::new();
    folder.run("render room.xml --layers --aov albedo,depth,my.n:sh_normal -o a.exr").expect(0);
    let limits = claror_io::Limits::default();
    let layer = |name: &str| {
        claror_io::image::read_layer(&folder.path("a.exr"), name, &limits)
            .unwrap_or_else(|e| panic!("{e}"))
            .image
            .data
    };
    let mut sum = layer("emission");
    for name in ["direct", "indirect", "rest"] {
        sum.iter_mut().zip(layer(name)).for_each(|(sum, value)| *sum += value);
    }
    assert_eq!(sum, layer(""));
    assert!(layer("samples").iter().all(|&n| n == 4.0));
    for name in ["Albedo", "Z", "my.n", "variance"] {
        assert!(layer(name).iter().any(|&v| v != 0.0), "{name}");
    }
}

#[test]
fn an_exr_says_how_it_was_made() {
    let folder = Folder::new();
    folder.run("render room.xml --seed 5 -Dspp=3 -o a.exr").expect(0);
    let bytes = folder.read("a.exr");
    let text = String::from_utf8_lossy(&bytes);
    for name in [
        "software",
        "claror.version",
        "claror.scene",
        "claror.scene_hash",
        "claror.sampler.seed",
        "claror.spp",
        "claror.seconds",
        "claror.stop_reason",
        "claror.integrator.max_depth",
        "claror.$spp",
    ] {
        assert!(text.contains(&format!("{name}\0")), "{name} is missing");
    }
}

#[test]
fn quiet_is_quiet_and_verbose_is_not() {
    let folder = Folder::new();
    let run = folder.run("render room.xml -q").expect(0);
    assert_eq!((run.stdout.as_str(), run.stderr.as_str()), ("", ""));
    let run = folder.run("render room.xml -v").expect(0);
    for word in ["claror ", "integrator.max_depth = 6", "load ", "build ", "render "] {
        assert!(run.stderr.contains(word), "{word} in {}", run.stderr);
    }
}

#[test]
fn exposure_concerns_8_bit_pictures_only() {
    let folder = Folder::new();
    folder.run("render room.xml -o a.png -o a.exr").expect(0);
    folder.run("render room.xml -o b.png -o b.exr --exposure -2").expect(0);
    assert_eq!(bits(&folder.path("a.exr")), bits(&folder.path("b.exr")));
    let sum = |name: &str| picture(&folder.path(name)).data.iter().sum::<f32>();
    assert!(sum("b.png") < 0.7 * sum("a.png"));
}
