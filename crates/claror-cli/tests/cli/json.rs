//! `--json`: one object per line on standard output, nothing else.

use crate::common::Folder;
use serde_json::Value;

fn kinds(events: &[Value]) -> Vec<&str> {
    events.iter().map(|event| event["event"].as_str().expect("every object has a kind")).collect()
}

#[test]
fn a_render_tells_its_course() {
    let folder = Folder::new();
    let run = folder.run("render room.xml --json --spp 3").expect(0);
    assert_eq!(run.stderr, "");
    let events = run.events();
    let kinds = kinds(&events);
    assert_eq!((kinds[0], kinds[kinds.len() - 1]), ("start", "result"));
    for phase in ["load", "build", "render", "write"] {
        let of =
            |state| events.iter().filter(|e| e["phase"] == phase && e["state"] == state).count();
        assert_eq!((of("begin"), of("end")), (1, 1), "{phase}");
    }
    let result = &events[events.len() - 1];
    assert_eq!(result["spp"], 3);
    assert_eq!(result["stop"], "samples");
    assert_eq!(result["outputs"], serde_json::json!(["room.exr", "room.png"]));
    assert_eq!(result["parameters"]["integrator.max_depth"], "6");
}

#[test]
fn progress_comes_every_second() {
    let folder = Folder::new();
    let run = folder.run("render room.xml --json --time 2500ms").expect(0);
    let events = run.events();
    let progress: Vec<&Value> = events.iter().filter(|e| e["event"] == "progress").collect();
    assert_eq!(progress.len(), 2, "{events:#?}");
    for event in progress {
        assert!(event["rays_per_second"].as_f64().is_some_and(|r| r > 0.0), "{event}");
        assert!(event["remaining"].as_f64().is_some_and(|r| r < 1.6), "{event}");
        assert!(event["error"].as_f64().is_some_and(|e| e > 0.0), "{event}");
    }
}

#[test]
fn errors_are_objects_too() {
    let folder = Folder::new();
    folder.write("bad.xml", "<scene version=\"3.0.0\">\n  <shape type=\"shpere\"/>\n</scene>");
    let run = folder.run("render bad.xml --json").expect(3);
    let events = run.events();
    let error = events.iter().find(|e| e["event"] == "error").expect("an error");
    assert_eq!(error["exit_code"], 3);
    assert_eq!((&error["line"], &error["file"]), (&2.into(), &"bad.xml".into()));
    assert!(error["hint"].as_str().is_some_and(|h| h.contains("sphere")), "{error}");

    let run = folder.run("render room.xml --json --spp none").expect(2);
    let events = run.events();
    assert_eq!(kinds(&events), ["error"]);
    assert_eq!(events[0]["exit_code"], 2);
}

#[test]
fn info_check_and_compare_have_results() {
    let folder = Folder::new();
    folder.run("render room.xml -q -o a.exr").expect(0);
    let last = |arguments: &str| {
        let run = folder.run(arguments).expect(0);
        let events = run.events();
        let result = events.last().expect("an object").clone();
        assert_eq!(result["event"], "result");
        result
    };
    let info = last("info room.xml --json");
    assert_eq!(info["shapes"]["sphere"], 2);
    assert_eq!(info["lights"], serde_json::json!({ "area": 1, "constant": 1 }));
    assert_eq!(info["settings"]["film.width"], "24");
    assert_eq!(last("check room.xml --json")["ok"], true);
    assert_eq!(last("compare a.exr a.exr --json")["relmse"], 0.0);
}
