//! `claror compare`.

use crate::common::{Folder, picture};

#[test]
fn equal_pictures_do_not_differ() {
    let folder = Folder::new();
    folder.run("render room.xml -q -o a.exr").expect(0);
    let run = folder
        .run("compare a.exr a.exr --fail-above mse=0 --fail-above flip=0 --fail-above mean=0")
        .expect(0);
    for name in ["mse", "relmse", "mape", "mean", "flip"] {
        assert!(run.stdout.lines().any(|l| l.trim_start().starts_with(name)), "{}", run.stdout);
    }
}

#[test]
fn a_difference_above_the_threshold_fails() {
    let folder = Folder::new();
    folder.run("render room.xml -q -o a.exr").expect(0);
    folder.run("render room.xml -q -o b.exr --seed 1").expect(0);
    folder.run("compare a.exr b.exr").expect(0);
    folder.run("compare a.exr b.exr --fail-above relmse=1e9").expect(0);
    let run = folder.run("compare a.exr b.exr --fail-above relmse=1e-9").expect(6);
    assert!(run.stderr.contains("relmse") && run.stderr.contains("above 0.000000001"), "{run:#?}");
    let run = folder.run("compare a.exr b.exr --fail-above mse=0 -q").expect(6);
    assert_eq!(run.stdout, "");
}

#[test]
fn a_darker_picture_has_a_negative_mean() {
    let folder = Folder::new();
    let pfm = |value: f32| {
        let pixels: Vec<u8> = [value; 16 * 16 * 3].iter().flat_map(|v| v.to_le_bytes()).collect();
        [&b"PF\n16 16\n-1.0\n"[..], &pixels].concat()
    };
    folder.write("dark.pfm", pfm(0.5));
    folder.write("bright.pfm", pfm(1.0));
    let run = folder.run("compare dark.pfm bright.pfm --json").expect(0);
    let result = run.events().pop().expect("a result");
    assert_eq!(result["mean"], -0.5);
    assert_eq!(result["mse"], 0.25);
    // The sign does not hide a bias from the check.
    folder.run("compare dark.pfm bright.pfm --fail-above mean=0.4").expect(6);
}

#[test]
fn the_error_picture_is_written() {
    let folder = Folder::new();
    folder.run("render room.xml -q -o a.exr -o a.png").expect(0);
    folder.run("render room.xml -q -o b.exr --seed 1").expect(0);
    folder.run("compare a.exr b.exr --error-image difference.png").expect(0);
    let image = picture(&folder.path("difference.png"));
    assert_eq!((image.width, image.height), (24, 24));
    // A PNG is compared by the light that it stands for.
    let run = folder.run("compare a.png a.exr --json").expect(0);
    let result = run.events().pop().expect("a result");
    assert!(result["flip"].as_f64().is_some_and(|flip| flip < 0.02), "{result}");
}

#[test]
fn other_sizes_and_nan_fail_the_check() {
    let folder = Folder::new();
    folder.run("render room.xml -q --spp 1 -o a.exr").expect(0);
    folder.run("render room.xml -q --spp 1 -o b.exr --size 8x8").expect(0);
    let run = folder.run("compare a.exr b.exr").expect(6);
    assert!(run.stderr.contains("24") && run.stderr.contains('8'), "{}", run.stderr);
    let pixels: Vec<u8> = [f32::NAN, 1.0, 1.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    folder.write("nan.pfm", [&b"PF\n1 1\n-1.0\n"[..], &pixels].concat());
    let run = folder.run("compare nan.pfm nan.pfm --fail-above mse=1").expect(6);
    assert!(run.stderr.contains("NaN"), "{}", run.stderr);
}
