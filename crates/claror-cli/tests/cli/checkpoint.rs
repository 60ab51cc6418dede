//! Stopping and going on: Ctrl-C, SIGTERM, kill -9, full disks.

use std::process::{Child, Command};
use std::time::{Duration, Instant};

use crate::common::{Folder, Run, bits, picture};

fn signal(child: &Child, name: &str) {
    let status = Command::new("kill").args([name, &child.id().to_string()]).status();
    assert!(status.expect("kill runs").success());
}

/// Waits until the program is in the middle of its render.
fn wait_for_checkpoint(folder: &Folder, name: &str) {
    let start = Instant::now();
    while !folder.exists(name) {
        assert!(start.elapsed() < Duration::from_secs(60), "no checkpoint was written");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// A render that does not end by itself, with checkpoints after every round.
const ENDLESS: &str = "render room.xml --spp 100000000 -o a.exr --checkpoint a.ckpt --every 1ms";

#[test]
fn ctrl_c_writes_everything_within_a_second() {
    for name in ["-INT", "-TERM"] {
        let folder = Folder::new();
        let child = folder.start(ENDLESS);
        wait_for_checkpoint(&folder, "a.ckpt");
        let start = Instant::now();
        signal(&child, name);
        let run = Run::from(child.wait_with_output().expect("it ends")).expect(130);
        assert!(start.elapsed() < Duration::from_secs(1), "{:?}", start.elapsed());
        assert!(run.stdout.trim_end().ends_with(": interrupted"), "{run:#?}");
        assert_eq!(folder.files(), ["a.ckpt", "a.exr", "room.xml"]);
        assert_eq!(picture(&folder.path("a.exr")).width, 24);
    }
}

#[test]
fn a_resumed_render_has_the_same_bits() {
    let folder = Folder::new();
    let child = folder.start(ENDLESS);
    wait_for_checkpoint(&folder, "a.ckpt");
    signal(&child, "-INT");
    Run::from(child.wait_with_output().expect("it ends")).expect(130);
    let run = folder.run("render room.xml --json --spp 1 -o a.exr --checkpoint a.ckpt --resume");
    let done = run.expect(0).events().last().expect("a result")["spp"].as_u64().expect("a count");
    // However far it came: a little further, by other threads, and once without a break.
    let spp = done + 50;
    folder
        .run(&format!("render room.xml --spp {spp} -t 3 -o a.exr --checkpoint a.ckpt --resume"))
        .expect(0);
    folder.run(&format!("render room.xml --spp {spp} -t 1 -o b.exr")).expect(0);
    assert_eq!(bits(&folder.path("a.exr")), bits(&folder.path("b.exr")));
}

#[test]
fn a_finished_render_can_be_continued() {
    let folder = Folder::new();
    folder.run("render room.xml --spp 3 -o a.exr --checkpoint a.ckpt").expect(0);
    folder.run("render room.xml --spp 9 -o a.exr --checkpoint a.ckpt --resume").expect(0);
    folder.run("render room.xml --spp 9 -o b.exr").expect(0);
    assert_eq!(bits(&folder.path("a.exr")), bits(&folder.path("b.exr")));
}

#[test]
fn checkpoints_of_other_renders_are_refused() {
    let folder = Folder::new();
    folder.run("render room.xml -o a.exr --checkpoint a.ckpt").expect(0);
    let old = folder.read("a.exr");
    folder.write("other.xml", crate::common::ROOM.replace("0.6, 0.5, 0.4", "0.7, 0.5, 0.4"));
    for (change, difference) in [
        ("other.xml", "scene"),
        ("room.xml --seed 3", "seed"),
        ("room.xml --size 30x30", "film size"),
        ("room.xml -p integrator.max_depth=3", "max_depth"),
        ("room.xml --crop 0,0,9,9", "crop"),
        ("room.xml -i direct", "integrator"),
        ("room.xml --sampler independent", "sampler"),
        ("room.xml --aov albedo", "layers"),
    ] {
        let arguments = format!("render {change} --checkpoint a.ckpt --resume -o a.exr");
        let run = folder.run(&arguments).expect(7);
        assert!(run.stderr.contains(difference), "{change}: {}", run.stderr);
        assert_eq!(folder.read("a.exr"), old);
    }
    let threads = "render room.xml -t 1 --checkpoint a.ckpt --resume -o a.exr";
    folder.run(threads).expect(0);
}

#[test]
fn broken_checkpoints_are_refused() {
    let folder = Folder::new();
    folder.run("render room.xml --spp 1 -o a.exr --checkpoint a.ckpt").expect(0);
    let whole = folder.read("a.ckpt");
    for part in 0..10 {
        folder.write("a.ckpt", &whole[..whole.len() * part / 10]);
        let run = folder.run("render room.xml -o a.exr --checkpoint a.ckpt --resume").expect(4);
        assert!(run.stderr.contains("a.ckpt"), "{}", run.stderr);
    }
    let mut flipped = whole.clone();
    let middle = flipped.len() / 2;
    flipped[middle] ^= 1;
    folder.write("a.ckpt", flipped);
    folder.run("render room.xml -o a.exr --checkpoint a.ckpt --resume").expect(4);
}

#[test]
fn without_a_checkpoint_a_resumed_render_starts() {
    let folder = Folder::new();
    let run = folder.run("render room.xml -o a.exr --checkpoint a.ckpt --resume").expect(0);
    assert!(run.stderr.contains("there is no a.ckpt"), "{}", run.stderr);
    let run = folder.run("render room.xml -o a.exr --checkpoint a.ckpt").expect(0);
    assert!(run.stderr.contains("--resume"), "{}", run.stderr);
}

#[test]
fn kill_leaves_whole_files() {
    let folder = Folder::new();
    folder.write("a.exr", "the old picture");
    for delay in [0, 7, 23, 51] {
        let mut child = folder.start(ENDLESS);
        wait_for_checkpoint(&folder, "a.ckpt");
        std::thread::sleep(Duration::from_millis(delay));
        child.kill().expect("it runs");
        child.wait().expect("it ends");
        assert_eq!(folder.read("a.exr"), b"the old picture");
        folder.run("render room.xml --spp 1 -q -o b.exr --checkpoint a.ckpt --resume").expect(0);
    }
}

/// A limit on the size of files stands for a disk that is full.
#[test]
fn a_full_disk_leaves_the_old_file() {
    let folder = Folder::new();
    folder.write("a.exr", "the old picture");
    folder.write("a.ckpt", "the old state");
    let claror = env!("CARGO_BIN_EXE_claror");
    let script = format!(
        "trap '' XFSZ; ulimit -f 1; exec {claror} render room.xml --size 200x200 --spp 1 \
         -o a.exr --checkpoint a.ckpt"
    );
    let output = Command::new("sh").args(["-c", &script]).current_dir(folder.path("")).output();
    let run = Run::from(output.expect("sh runs")).expect(4);
    assert!(run.stderr.contains("cannot write a.exr"), "{}", run.stderr);
    assert!(run.stderr.contains("cannot write a.ckpt"), "{}", run.stderr);
    assert_eq!(folder.read("a.exr"), b"the old picture");
    assert_eq!(folder.read("a.ckpt"), b"the old state");
    assert_eq!(folder.files(), ["a.ckpt", "a.exr", "room.xml"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_device_is_reported() {
    let folder = Folder::new();
    std::os::unix::fs::symlink("/dev/full", folder.path("full.exr")).expect("a link");
    let run = folder.run("render room.xml -o full.exr").expect(4);
    assert!(run.stderr.contains("cannot write full.exr: no space left"), "{}", run.stderr);
    let full = || std::fs::File::options().write(true).open("/dev/full").expect("/dev/full");
    let output = folder.command("info room.xml").stdout(full()).output().expect("it starts");
    Run::from(output).expect(4);
}

/// The second signal does not wait for anything.
#[test]
fn ctrl_c_while_loading_ends_at_once() {
    let folder = Folder::new();
    let many: String = (0..40_000)
        .map(|i| format!("<shape type=\"sphere\"><float name=\"radius\" value=\"{i}.5\"/></shape>"))
        .collect();
    folder.write("many.xml", crate::common::ROOM.replace("</scene>", &format!("{many}</scene>")));
    let child = folder.start("info many.xml");
    std::thread::sleep(Duration::from_millis(100));
    signal(&child, "-INT");
    let start = Instant::now();
    let run = Run::from(child.wait_with_output().expect("it ends"));
    assert!(start.elapsed() < Duration::from_secs(1), "{:?}", start.elapsed());
    // A very fast machine may be done already.
    assert!(matches!(run.code, Some(0 | 130)), "{run:#?}");
}
