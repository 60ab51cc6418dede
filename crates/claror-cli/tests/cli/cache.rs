//! Cache files: kept, used again, added to, refused, looked into.

use crate::common::{Folder, ROOM, bits};

/// A quick render with an irradiance cache that has all its parts.
const RENDER: &str = "render room.xml -i irrcache -p integrator.max_depth=-1 \
                      -p integrator.gather_samples=100 -p integrator.noise=1";

fn records(folder: &Folder, file: &str) -> u64 {
    let run = folder.run(&format!("cache info {file} --json")).expect(0);
    run.events()[0]["statistics"]["records"].as_u64().expect("a count")
}

#[test]
fn a_cache_that_was_kept_gives_the_same_picture() {
    let folder = Folder::new();
    let run = folder.run(&format!("{RENDER} --json -o a.exr --cache a.cache")).expect(0);
    let result = run.events().last().expect("a result").clone();
    assert_eq!(
        (&result["cache"]["read"], &result["cache"]["file"]),
        (&0.into(), &"a.cache".into())
    );
    assert_eq!(folder.files(), ["a.cache", "a.exr", "room.xml"]);
    let file = folder.read("a.cache");
    assert!(file.starts_with(b"claror cache 1\n"));
    for (mode, threads) in [("read", 1), ("read", 3), ("update", 2)] {
        let run = folder.run(&format!(
            "{RENDER} --json -t {threads} -o b.exr --cache a.cache --cache-mode {mode}"
        ));
        let again = run.expect(0).events().last().expect("a result").clone();
        assert_eq!(again["cache"]["records"], result["cache"]["records"], "{mode}");
        assert_eq!(again["cache"]["read"], result["cache"]["records"], "{mode}");
        assert!(again["rays"].as_u64() < result["rays"].as_u64(), "{mode}");
        assert_eq!(bits(&folder.path("a.exr")), bits(&folder.path("b.exr")), "{mode}");
    }
    assert!(folder.read("a.cache") == file, "nothing was missing, so nothing has changed");
}

#[test]
fn another_view_adds_to_a_cache() {
    let folder = Folder::new();
    folder.run(&format!("{RENDER} -q -o a.exr --cache a.cache")).expect(0);
    let first = records(&folder, "a.cache");
    let top = format!("{RENDER} --sensor top --spp 2 -o b.exr --cache a.cache");
    let run = folder.run(&format!("{top} --cache-mode update")).expect(0);
    assert!(run.stdout.contains(&format!("({first} read)")), "{}", run.stdout);
    let both = records(&folder, "a.cache");
    assert!(both > first, "{first} records, then {both}");
    let info = folder.run("cache info a.cache").expect(0).stdout;
    assert!(info.contains("what they saw"), "{info}");
    let view = |name: &str, count| format!("\"{name}\" at (0, ") + "%" + &format!(": {count} rec");
    for (name, count) in [("front", first), ("top", both - first)] {
        let view = view(name, count);
        let (begin, end) = view.split_once('%').expect("both parts");
        assert!(info.contains(begin) && info.contains(end), "{view} in {info}");
    }
    // What the second view needs is there now; and a new cache is smaller.
    folder.run(&format!("{top} -q --cache-mode update")).expect(0);
    assert_eq!(records(&folder, "a.cache"), both);
    folder.run(&format!("{top} -q --cache-mode write")).expect(0);
    assert!(records(&folder, "a.cache") < both);
}

#[test]
fn nothing_is_used_or_replaced_unasked() {
    let folder = Folder::new();
    folder.write("a.cache", "somebody's file");
    let run = folder.run(&format!("{RENDER} -o a.exr --cache a.cache")).expect(2);
    assert!(run.stderr.contains("read uses it"), "{}", run.stderr);
    for mode in ["read", "update"] {
        let arguments = format!("{RENDER} -o a.exr --cache a.cache --cache-mode {mode}");
        let run = folder.run(&arguments).expect(4);
        assert!(run.stderr.contains("this is not an irradiance cache"), "{}", run.stderr);
    }
    assert_eq!(folder.read("a.cache"), b"somebody's file");
    folder.run(&format!("{RENDER} -o a.exr --cache a.cache --cache-mode write")).expect(0);
    let run = folder.run(&format!("{RENDER} -o a.exr --cache b.cache --cache-mode update"));
    assert!(run.expect(0).stderr.contains("there is no b.cache"));
    assert!(records(&folder, "b.cache") > 0);
}

#[test]
fn caches_of_other_renders_are_refused() {
    let folder = Folder::new();
    folder.write("other.xml", ROOM.replace("0.6, 0.5, 0.4", "0.7, 0.5, 0.4"));
    folder.run(&format!("{RENDER} -q -o a.exr --cache a.cache")).expect(0);
    let (cache, picture) = (folder.read("a.cache"), folder.read("a.exr"));
    for (change, difference) in [
        ("other.xml", "scene"),
        ("room.xml --seed 3", "seed"),
        ("room.xml -p integrator.max_depth=5", "max_depth is none, here it is 5"),
        ("room.xml -p integrator.error=0.2", "error is 0.05, here it is 0.2"),
        ("room.xml -p integrator.criterion=ward88", "criterion is hessian"),
        ("room.xml -p integrator.bounces=path", "bounces is hash"),
        ("room.xml -p integrator.gather_samples=99", "gather_samples is 100"),
        ("room.xml -p integrator.contact_shadows=false", "contact_shadows is true"),
    ] {
        for mode in ["read", "update"] {
            let render = RENDER.replace("room.xml", "").replacen("render", "", 1);
            let run = folder.run(&format!(
                "render {render} {change} -o a.exr --cache a.cache --cache-mode {mode}"
            ));
            let run = run.expect(7);
            assert!(run.stderr.contains(difference), "{change}: {}", run.stderr);
            assert!(run.stderr.contains("--cache-mode write"), "{}", run.stderr);
        }
    }
    assert!(folder.read("a.cache") == cache && folder.read("a.exr") == picture);
    let same = "--size 30x20 --crop 1,1,20,10 --spp 2 -p integrator.hide_emitters=true";
    folder.run(&format!("{RENDER} {same} -o a.exr --cache a.cache --cache-mode read")).expect(0);
}

#[test]
fn checkpoints_and_caches_are_told_apart() {
    let folder = Folder::new();
    folder.run(&format!("{RENDER} -q -o a.exr --cache a.cache --checkpoint a.ckpt")).expect(0);
    let run = folder.run(&format!("{RENDER} -o a.exr --cache a.ckpt --cache-mode read")).expect(4);
    let message = "this is a checkpoint, not an irradiance cache";
    assert!(run.stderr.contains(message), "{}", run.stderr);
    let run = folder.run(&format!("{RENDER} -o a.exr --checkpoint a.cache --resume")).expect(4);
    let message = "this is an irradiance cache, not a checkpoint";
    assert!(run.stderr.contains(message), "{}", run.stderr);
}

/// A picture is finished with the cache that it was begun with, wherever that comes from.
#[test]
fn a_resumed_render_keeps_its_cache() {
    let folder = Folder::new();
    folder.run(&format!("{RENDER} -q --spp 9 -o whole.exr")).expect(0);
    let first = format!("{RENDER} -q -o a.exr --checkpoint a.ckpt");
    folder.run(&format!("{first} --spp 3 --cache a.cache")).expect(0);
    folder.run(&format!("{first} --spp 5 --resume")).expect(0);
    let rest = format!("{first} --spp 9 --resume --cache a.cache --cache-mode read");
    folder.run(&rest).expect(0);
    assert_eq!(bits(&folder.path("a.exr")), bits(&folder.path("whole.exr")));
    let top = format!("{RENDER} -q --sensor top -o b.exr --cache a.cache --cache-mode update");
    folder.run(&top).expect(0);
    let run = folder.run(&rest).expect(7);
    assert!(run.stderr.contains("irradiance cache"), "{}", run.stderr);
}

#[test]
fn broken_caches_are_refused() {
    let folder = Folder::new();
    folder.run(&format!("{RENDER} -q -o a.exr --cache a.cache")).expect(0);
    let whole = folder.read("a.cache");
    for part in 0..10 {
        folder.write("a.cache", &whole[..whole.len() * part / 10]);
        let run = folder.run("cache info a.cache").expect(4);
        assert!(run.stderr.contains("a.cache"), "{}", run.stderr);
    }
    for part in 0..10 {
        let mut flipped = whole.clone();
        flipped[whole.len() * part / 10] ^= 1;
        folder.write("a.cache", flipped);
        let run = folder.run(&format!("{RENDER} -o b.exr --cache a.cache --cache-mode read"));
        assert!(run.expect(4).stderr.contains("a.cache"));
    }
    assert!(!folder.exists("b.exr"));
}

#[test]
fn records_are_exported() {
    let folder = Folder::new();
    folder.run(&format!("{RENDER} -q -o a.exr --cache a.cache")).expect(0);
    let count = records(&folder, "a.cache");
    let run = folder.run("cache export a.cache --ply a.ply --csv a.csv").expect(0);
    assert_eq!(run.stdout, format!("a.ply\na.csv\n{count} records\n"));
    let table = String::from_utf8(folder.read("a.csv")).expect("text");
    assert_eq!(table.lines().count() as u64, count + 1);
    let ply = folder.read("a.ply");
    let header = String::from_utf8_lossy(&ply[..200]).into_owned();
    assert!(header.contains(&format!("element vertex {count}\n")), "{header}");
    folder.run("cache export a.cache --ply no/a.ply").expect(4);
    folder.run("cache export a.cache --ply b.ply --csv b.ply").expect(2);
    assert_eq!(folder.files(), ["a.cache", "a.csv", "a.exr", "a.ply", "room.xml"]);
}

/// The program is stopped while it makes records: a part of a cache is of no use.
#[cfg(unix)]
#[test]
fn ctrl_c_before_the_cache_is_complete_writes_none() {
    use std::io::{BufRead, BufReader};
    let folder = Folder::new();
    folder.write("a.cache", "the old cache");
    let slow = "-p integrator.noise=1e-9 -p integrator.error=1e-6 --size 300x300";
    let mut child = folder
        .start(&format!("{RENDER} {slow} --json -o a.exr --cache a.cache --cache-mode write"));
    let mut lines = BufReader::new(child.stdout.take().expect("it is piped")).lines();
    // Progress is told before, once a second: first of the hash's walks, then of records.
    let is_told = |line: &str| line.contains("\"stage\":\"records\"");
    let told = lines.find(|line| line.as_ref().is_ok_and(|line| is_told(line)));
    let told = told.expect("it makes records").expect("text");
    let told: serde_json::Value = serde_json::from_str(&told).expect("an object");
    assert_eq!((&told["event"], &told["phase"]), (&"progress".into(), &"render".into()));
    assert!(told["fraction"].as_f64().is_some_and(|f| (0.0..1.0).contains(&f)), "{told}");
    assert!(told["records"].is_u64() && told["stride"].is_u64(), "{told}");
    let status =
        std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(status.expect("kill runs").success());
    lines.for_each(drop);
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    assert_eq!(folder.read("a.cache"), b"the old cache");
    assert_eq!(folder.files(), ["a.cache", "a.exr", "room.xml"]);
}

/// The picture is not lost with the cache.
#[cfg(target_os = "linux")]
#[test]
fn a_cache_that_cannot_be_written_is_told_at_the_end() {
    let folder = Folder::new();
    std::os::unix::fs::symlink("/dev/full", folder.path("full.cache")).expect("a link");
    let run = folder.run(&format!("{RENDER} -o a.exr --cache full.cache --cache-mode write"));
    let run = run.expect(4);
    let error = "error: cannot write full.cache: no space left";
    assert!(run.stderr.contains(error), "{}", run.stderr);
    assert!(folder.exists("a.exr"));
}

#[test]
fn look_ups_are_measured() {
    let folder = Folder::new();
    folder.run(&format!("{RENDER} -q -o a.exr --cache a.cache")).expect(0);
    let count = records(&folder, "a.cache");
    let arguments = "cache lookups a.cache --index octree,cells";
    let run = folder.run(&format!("{arguments} --json")).expect(0);
    let result = run.events()[0].clone();
    assert_eq!((&result["file"], &result["records"]), (&"a.cache".into(), &count.into()));
    let costs = result["lookups"].as_array().expect("a list");
    let names: Vec<_> = costs.iter().map(|cost| cost["index"].as_str()).collect();
    assert_eq!(names, [Some("octree"), Some("cells")]);
    for cost in costs {
        assert!(cost["nanoseconds"].as_f64() > Some(0.0), "{cost}");
        assert!(cost["records_used"].as_f64() >= Some(1.0), "{cost}");
        assert_eq!(cost["records_used"], costs[0]["records_used"]);
    }
    let table = folder.run(arguments).expect(0).stdout;
    assert!(table.contains(&format!("{count} records")) && table.lines().count() == 4, "{table}");
    assert!(folder.run("cache lookups a.cache --index tree").expect(2).stderr.contains("octree"));
    folder.run("cache lookups b.cache").expect(4);
}

#[test]
fn a_cache_without_records_has_nothing_to_measure() {
    let folder = Folder::new();
    // Nothing but sky.
    folder.run(&format!("{RENDER} --crop 0,0,4,4 -q -o a.exr --cache a.cache")).expect(0);
    assert_eq!(records(&folder, "a.cache"), 0);
    let run = folder.run("cache lookups a.cache").expect(0);
    assert!(run.stdout.contains("holds no records"), "{}", run.stdout);
    let run = folder.run("cache lookups a.cache --json").expect(0);
    assert_eq!(run.events()[0]["lookups"], serde_json::json!([]));
}
