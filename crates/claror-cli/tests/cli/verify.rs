//! `claror verify` and `claror render --verify`.

use crate::common::{Folder, Run, picture};
use serde_json::Value;

fn verification(run: &Run) -> Value {
    let result = run.events().into_iter().find(|event| event["event"] == "result");
    result.expect("a result")["verification"].clone()
}

#[test]
fn a_verification_has_all_numbers() {
    let folder = Folder::new();
    let run = folder.run("verify room.xml -i irrcache --spp 64 --verify=64 --verify-bias 1 --json");
    let found = verification(&run.expect(0));
    assert_eq!(found["checks"], 64);
    assert_eq!(found["claims"]["bias"]["verdict"], "confirmed");
    for (part, of) in [("picture", "bias"), ("picture", "layers")] {
        for estimate in found[part][of].as_object().expect("estimates").values() {
            for number in ["value", "standard_error", "low", "high"] {
                assert!(estimate[number].is_number(), "{part}.{of}: {estimate}");
            }
        }
    }
    let cache = &found["cache"];
    assert_eq!(cache["beyond"]["of"], cache["served"]);
    assert!(cache["bias"]["value"].is_number() && cache["mse"]["value"].is_number(), "{cache}");
    // No picture was asked for.
    assert_eq!(folder.files(), ["room.xml"]);
}

/// A count is a count: the same numbers on any number of threads, and after the picture is written.
#[test]
fn counted_checks_are_reproducible() {
    let folder = Folder::new();
    let of = |arguments: &str| {
        let mut found = verification(&folder.run(arguments));
        found["seconds"] = Value::Null;
        found
    };
    let one = of("verify room.xml --json --verify=300 -t 1");
    assert_eq!(one["checks"], 300);
    assert_eq!(of("verify room.xml --json --verify=300 -t 3"), one);
    assert_eq!(of("render room.xml --json --verify=300"), one);
    assert_eq!(folder.files(), ["room.exr", "room.png", "room.xml"]);
    assert_ne!(of("verify room.xml --json --verify=300 --seed 1"), one);
}

/// The refuted claim is an error and code 6, with the picture written; what is not decided is one
/// only if that was asked for.
#[test]
fn refuted_claims_fail() {
    let folder = Folder::new();
    // With one sample per pixel most pixels are off, and that shows.
    let refuted = "render room.xml -o a.exr --spp 1 --verify=512 --verify-paths 256";
    let run = folder.run(refuted).expect(6);
    assert!(run.stderr.contains("of the pixels are off by over 5 %: more than 5 %"), "{run:#?}");
    assert!(folder.exists("a.exr"));
    let run = folder.run(&format!("{refuted} --json")).expect(6);
    let events = run.events();
    let error = events.iter().find(|e| e["event"] == "error").expect("an error");
    assert_eq!(error["exit_code"], 6);
    let result = events.iter().find(|e| e["event"] == "result").expect("a result");
    assert_eq!(result["verification"]["claims"]["share"]["verdict"], "refuted");

    let open = "verify room.xml --spp 64 --verify=16 --verify-paths 16 --verify-bias 0.01 \
                --verify-share 0.5";
    let run = folder.run(open).expect(0);
    assert!(run.stdout.contains(" is open; "), "{run:#?}");
    let run = folder.run(&format!("{open} --strict")).expect(6);
    assert!(run.stderr.contains("is open"), "{run:#?}");
}

#[test]
fn the_picture_of_the_checks_is_written() {
    let folder = Folder::new();
    let options = "--spp 1 --verify=32 --verify-share 1 --verify-bias 1 --verify-picture";
    let run = folder.run(&format!("verify room.xml {options} checks.exr")).expect(0);
    assert!(run.stdout.contains("checks.exr"), "{run:#?}");
    let image = picture(&folder.path("checks.exr"));
    assert_eq!((image.width, image.height, image.channels), (24, 24, 3));
    let coloured = image.data.chunks_exact(3).filter(|p| p[0] != p[1] || p[1] != p[2]).count();
    assert!((16..=32).contains(&coloured), "{coloured} dots for 32 checks");
    assert_eq!(folder.files(), ["checks.exr", "room.xml"]);
}

/// The checks so far are told, and the program says that it was interrupted.
#[cfg(unix)]
#[test]
fn ctrl_c_ends_the_checks() {
    use std::io::{BufRead, BufReader};
    let folder = Folder::new();
    let mut child = folder.start("verify room.xml --spp 1 --verify=10000000 --json");
    let lines = BufReader::new(child.stdout.take().expect("piped")).lines();
    let mut lines = lines.map(|line| line.expect("text"));
    // The second progress event comes after some rounds.
    let is_progress = |line: &String| line.contains("progress");
    lines.by_ref().filter(is_progress).nth(1).expect("it goes on");
    let status =
        std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(status.expect("kill runs").success());
    let last = lines.last().expect("a result");
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    let result: Value = serde_json::from_str(&last).expect("an object");
    let checks = result["verification"]["checks"].as_u64().expect("a number");
    assert!((250..10_000_000).contains(&checks), "{checks}");
}

#[test]
fn debias_is_a_parameter_of_the_cache() {
    let folder = Folder::new();
    let run = folder.run("render room.xml -i irrcache -p integrator.debias=0.25 --spp 4 --json");
    let result = run.expect(0).events().pop().expect("a result");
    assert_eq!(result["parameters"]["integrator.debias"], "0.25");
}

/// Without a number the checks take a share of the render's time, at least one round.
#[test]
fn checks_follow_the_time() {
    let folder = Folder::new();
    let options = "--spp 64 --verify --verify-share 1 --verify-bias 1 -o a.exr";
    let run = folder.run(&format!("render room.xml {options} --json")).expect(0);
    let checks = verification(&run)["checks"].as_u64().expect("a number");
    assert!(checks >= 256 && checks.is_multiple_of(256), "{checks}");
    let run = folder.run(&format!("render room.xml {options}")).expect(0);
    for part in ["verification by", "mean", "from indirect", "relmse", "share"] {
        assert!(run.stdout.contains(part), "{part} in {}", run.stdout);
    }
}
