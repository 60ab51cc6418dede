//! The integrator `gridcache`: what is told of its grid, and what it cannot do.

use crate::common::{Folder, bits, picture};
use serde_json::json;

const RENDER: &str =
    "render room.xml -i gridcache -p integrator.step=5 -p integrator.gather_samples=16";

#[test]
fn the_grid_is_counted_and_drawn() {
    let folder = Folder::new();
    let run = folder.run(&format!("{RENDER} --spp 2 --json -o a.exr -o a.png --show-points b.png"));
    let result = run.expect(0).events().last().expect("a result").clone();
    let lines = |size: &str| {
        let last = result[size].as_u64().expect("a size") - 1;
        last.div_ceil(5) + 1
    };
    let points = lines("width") * lines("height");
    assert_eq!(result["grid_points"], json!(points));
    assert_eq!(result["cache"], json!(null));
    let used = result["grid"]["used"].as_u64().expect("a count");
    assert!(used > 0 && used <= points);
    assert_eq!(result["show_points"]["drawn"], json!(used));
    assert_eq!(result["parameters"]["integrator.step"], json!("5"));
    let [shown, dots] = ["a.png", "b.png"].map(|name| picture(&folder.path(name)));
    assert!(shown.data.iter().zip(&dots.data).any(|(a, b)| a > b), "nothing was drawn");
    let run = folder.run(&format!("{RENDER} --spp 2 -o a.exr")).expect(0);
    assert!(run.stdout.contains(&format!("{points} grid points every 5 pixels")), "{}", run.stdout);
}

/// A checkpoint needs no grid: it is made again.
#[test]
fn a_render_goes_on_to_the_same_bits() {
    let folder = Folder::new();
    folder.run(&format!("{RENDER} -q --spp 6 -o a.exr")).expect(0);
    folder.run(&format!("{RENDER} -q --spp 2 -o b.exr --checkpoint b.ckpt")).expect(0);
    let resume = "--spp 6 -o b.exr --checkpoint b.ckpt --resume";
    let run = folder.run(&format!("{RENDER} {resume} -p integrator.step=6")).expect(7);
    assert!(run.stderr.contains("its step is 5, here it is 6"), "{}", run.stderr);
    folder.run(&format!("{RENDER} -q -t 3 {resume}")).expect(0);
    assert_eq!(bits(&folder.path("a.exr")), bits(&folder.path("b.exr")));
}

#[test]
fn what_grids_cannot_do_is_said() {
    let folder = Folder::new();
    for (arguments, what) in [
        ("--cache a.cache", "--cache: the integrator gridcache uses no irradiance cache"),
        ("--show-points a.png --show-radii", "--show-radii: the integrator gridcache uses no"),
        ("--aov irradiance", "layer irradiance: the integrator gridcache uses no"),
        ("-p integrator.step=0", "a whole number from 1 to 65536"),
        ("-p integrator.error=0.1", "add -i irrcache"),
        ("-i path -p integrator.step=5", "add -i gridcache"),
    ] {
        let command = format!("{RENDER} -o a.exr {arguments}");
        let command = match arguments.starts_with("-i") {
            true => format!("render room.xml -o a.exr {arguments}"),
            false => command,
        };
        let run = folder.run(&command).expect(2);
        assert!(run.stderr.contains(what), "{arguments}: {}", run.stderr);
    }
    assert_eq!(folder.files(), ["room.xml"]);
}
