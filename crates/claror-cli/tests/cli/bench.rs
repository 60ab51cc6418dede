//! `claror bench`: what it finds, that it goes on after any end, and what it refuses.

use std::path::PathBuf;

use serde_json::Value;

use crate::common::{Folder, Run, bits};

const PLAN: &str = r#"
title = "Small"
about = "Two methods."
seeds = [0, 1]
size = "16x16"
threads = 1
set = { max_depth = 4 }
[reference]
spp = 64
[[series]]
name = "path"
label = "Path tracing"
integrator = "path"
spp = [1, 4, 16]
[[series]]
name = "cache"
integrator = "irrcache"
spp = 2
steps = [{ label = "coarse", set = { error = 0.4 } }]
seeds = [0]
illustrate = true
[equal_error]
rel_mse = [1e6]
"#;

const BENCH: &str = "bench room.xml --plan plan.toml --out out --references refs";

fn folder(plan: &str) -> Folder {
    let folder = Folder::new();
    folder.write("plan.toml", plan);
    folder
}

fn json(folder: &Folder, name: &str) -> Value {
    serde_json::from_slice(&folder.read(name)).expect("a whole file")
}

/// Names of the run folders of which `note` is there.
fn runs(folder: &Folder, note: &str) -> Vec<String> {
    let Ok(entries) = std::fs::read_dir(folder.path("out/runs")) else { return Vec::new() };
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let with_note: Vec<PathBuf> = paths.filter(|path| path.join(note).exists()).collect();
    let mut names: Vec<String> = with_note
        .iter()
        .map(|path| path.file_name().expect("a name").to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// Runs that were made: the lines that tell so.
fn made(run: &Run) -> usize {
    run.stderr.lines().filter(|line| line.contains(", seed ") && !line.contains("bench:")).count()
}

/// Least squares in the logarithms of the medians of time and error.
fn slope_of(settings: &[Value]) -> f64 {
    let ln = |setting: &Value, name: &str| {
        setting["summary"][name]["median"].as_f64().expect("a median").ln()
    };
    let points: Vec<(f64, f64)> =
        settings.iter().map(|s| (ln(s, "cpu_seconds"), ln(s, "rel_mse"))).collect();
    let n = points.len() as f64;
    let sum = |f: fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>();
    let (x, y, xx, xy) = (sum(|p| p.0), sum(|p| p.1), sum(|p| p.0 * p.0), sum(|p| p.0 * p.1));
    (n * xy - x * y) / (n * xx - x * x)
}

#[test]
fn a_study_holds_all_runs_with_errors_and_commands() {
    let folder = folder(PLAN);
    let run = folder.run(BENCH).expect(0);
    assert!(run.stdout.contains("7 runs, 0 failures"), "{run:#?}");
    assert_eq!(made(&run), 7, "{run:#?}");
    let study = json(&folder, "out/study.json");
    assert_eq!((&study["title"], &study["plan"]), (&"Small".into(), &"plan.toml".into()));
    let scene = &study["scenes"][0];
    assert_eq!(scene["size"], serde_json::json!([16, 16]));
    assert_eq!(scene["reference"]["spp"], 64);
    assert!(scene["reference"]["rel_mse"].as_f64().expect("a number") > 0.0);
    let path = &scene["series"][0];
    assert_eq!(path["kind"]["sweep"]["parameter"], "spp");
    // Renders of milliseconds: their times say nothing, but the slope is that of the table.
    let slope = path["slope"]["exponent"].as_f64().expect("three settings");
    let expected = slope_of(path["settings"].as_array().expect("settings"));
    assert!((slope - expected).abs() <= 1e-6 * expected.abs().max(1.0), "{slope} {expected}");
    let medians: Vec<f64> = (0..3)
        .map(|i| path["settings"][i]["summary"]["mse"]["median"].as_f64().expect("two runs"))
        .collect();
    assert!(medians[0] > medians[2], "{medians:?}");
    let step = &scene["series"][1]["settings"][0];
    assert_eq!(
        (&step["label"], step["runs"].as_array().map(Vec::len)),
        (&"coarse".into(), Some(1))
    );
    let run = &step["runs"][0];
    assert!(run["records"].as_u64() > Some(0) && run["peak_memory_bytes"].as_u64() > Some(1 << 20));
    for picture in step["illustrations"].as_array().expect("pictures") {
        let file = format!("out/{}", picture["picture"].as_str().expect("a path"));
        assert!(folder.read(&file).starts_with(b"\x89PNG"), "{file}");
    }
    assert!(step["illustrations"].as_array().map(Vec::len) >= Some(4));
    // The tables have a line per run, the first one a header.
    let lines = |name: &str| String::from_utf8_lossy(&folder.read(name)).lines().count();
    assert_eq!((lines("out/results.csv"), lines("out/results.jsonl")), (8, 7));
}

/// A reader who repeats a command of the study gets the picture, bit for bit.
#[test]
fn commands_can_be_repeated() {
    let folder = folder(PLAN);
    folder.run(&format!("{BENCH} -q --seeds 1")).expect(0);
    let study = json(&folder, "out/study.json");
    let run = &study["scenes"][0]["series"][0]["settings"][1]["runs"][0];
    let words: Vec<&str> = run["command"]
        .as_array()
        .expect("words")
        .iter()
        .skip(1)
        .map(|word| word.as_str().expect("text"))
        .collect();
    let picture = folder.path(&format!("out/{}", run["picture"].as_str().expect("a path")));
    let before = bits(&picture);
    std::fs::remove_file(&picture).expect("it was there");
    folder.run(&words.join(" ")).expect(0);
    assert_eq!(bits(&picture), before);
}

#[test]
fn only_what_is_missing_is_made_again() {
    let folder = folder(PLAN);
    folder.run(BENCH).expect(0);
    let all = runs(&folder, "run.json");
    assert_eq!(all.len(), 7);
    let again = folder.run(BENCH).expect(0);
    assert_eq!(made(&again), 0, "{again:#?}");
    // A run without its note, one without its picture, and one that is cut off.
    std::fs::remove_file(folder.path(&format!("out/runs/{}/run.json", all[0]))).expect("there");
    std::fs::remove_file(folder.path(&format!("out/runs/{}/picture.exr", all[1]))).expect("there");
    folder.write(&format!("out/runs/{}/run.json", all[2]), "{\"id\":");
    let again = folder.run(BENCH).expect(0);
    assert_eq!(made(&again), 3, "{again:#?}");
    assert_eq!(runs(&folder, "run.json"), all);
    // The reference is not made again, also not for another experiment.
    assert!(!again.stderr.contains("reference"), "{again:#?}");
    let other = folder.run(&BENCH.replace("--out out", "--out other")).expect(0);
    assert!(made(&other) == 7 && !other.stderr.contains("reference"), "{other:#?}");
}

/// Results of another plan or scene in the same folder are neither used nor touched.
#[test]
fn results_of_others_are_left_alone() {
    let folder = folder(PLAN);
    folder.run(&format!("{BENCH} -q")).expect(0);
    let before = runs(&folder, "run.json");
    folder.write("room.xml", crate::common::ROOM.replace("20, 18, 15", "2, 18, 15"));
    let run = folder.run(BENCH).expect(0);
    assert_eq!(made(&run), 7, "{run:#?}");
    assert_eq!(runs(&folder, "run.json").len(), 14);
    assert!(before.iter().all(|id| folder.exists(&format!("out/runs/{id}/picture.exr"))));
}

#[test]
fn failures_are_noted_and_the_rest_goes_on() {
    let bad = "[[series]]\nname = 'bad'\nset = { no_such_thing = 3 }\n";
    let folder = folder(&PLAN.replace("[equal_error]", &format!("{bad}[equal_error]")));
    let run = folder.run(BENCH).expect(6);
    assert!(run.stdout.contains("7 runs, 1 failure"), "{run:#?}");
    assert!(run.stderr.contains("1 failure, the first: seeds 0, 1:"), "{run:#?}");
    let study = json(&folder, "out/study.json");
    let setting = &study["scenes"][0]["series"][2]["settings"][0];
    assert!(setting["failures"][0].as_str().expect("a message").contains("no_such_thing"));
    assert_eq!(setting["summary"], Value::Null);
    // Without the series all is well.
    folder.write("plan.toml", PLAN);
    folder.run(&format!("{BENCH} --report-only")).expect(0);
}

#[test]
fn a_report_is_made_of_what_is_there() {
    let folder = folder(PLAN);
    let run = folder.run(&format!("{BENCH} --report-only")).expect(4);
    assert!(run.stderr.contains("no reference of room yet"), "{run:#?}");
    folder.run(&format!("{BENCH} --seeds 1 -q")).expect(0);
    let run = folder.run(&format!("{BENCH} --report-only")).expect(6);
    assert!(run.stdout.contains("4 runs, 3 failures"), "{run:#?}");
    assert!(run.stderr.contains("not run yet") && made(&run) == 0, "{run:#?}");
}

#[test]
fn equal_times_are_searched() {
    let equal = "[[equal_time]]\ntimes = ['40s']\ncontenders = [{ series = 'path' }, \
                 { series = 'cache', knob = 'gather_samples', from = 16, to = 4096 }]";
    let folder = folder(&format!("{PLAN}{equal}"));
    // Whatever the machine, some setting stays below the time or is told to be too slow.
    let run = folder.run(&format!("{BENCH} --time-scale 0.01 --seeds 1"));
    assert!(matches!(run.code, Some(0 | 6)), "{run:#?}");
    let study = json(&folder, "out/study.json");
    let scene = &study["scenes"][0];
    let entries = scene["equal_time"][0]["entries"].as_array().expect("contenders");
    assert_eq!(scene["equal_time"][0]["seconds"], 0.4);
    assert_eq!(entries[0], serde_json::json!(["equal-time-path", 0]));
    let names: Vec<&str> = (0..4).map(|i| scene["series"][i]["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["path", "cache", "equal-time-path", "equal-time-cache"]);
    assert_eq!(scene["series"][3]["settings"][0]["x"], 0.4);
}

#[test]
fn given_references_are_taken() {
    let folder = folder(PLAN);
    for seed in [1, 2] {
        let render = "render room.xml -q -i path --size 16x16 --spp 32";
        folder.run(&format!("{render} --seed {seed} -o {seed}.exr")).expect(0);
    }
    folder.run(&format!("{BENCH} -q --reference 1.exr 2.exr")).expect(0);
    assert!(!folder.exists("refs"));
    let study = json(&folder, "out/study.json");
    assert_eq!(study["scenes"][0]["reference"]["spp"], 0);
}

#[test]
fn references_go_to_the_cache_folder_of_the_user() {
    let folder = folder(PLAN);
    let mut command = folder.command("bench room.xml --plan plan.toml --out out -q --seeds 1");
    let output = command.env("XDG_CACHE_HOME", folder.path("cache")).output();
    Run::from(output.expect("the program starts")).expect(0);
    assert!(folder.exists("cache/claror/references"));
}

#[test]
fn a_dry_run_lists_and_writes_nothing() {
    let folder = folder(PLAN);
    let before = folder.files();
    let run = folder.run("bench room.xml --plan plan.toml --dry-run --references refs").expect(0);
    let line = run.stdout.lines().find(|line| line.contains("path, 4 spp, seed 1"));
    assert!(line.expect("a run").contains("-i path --spp 4 -p integrator.max_depth=4"), "{run:#?}");
    assert!(run.stdout.contains("7 runs, 0 done"), "{run:#?}");
    assert_eq!(folder.files(), before);
    let run = folder.run(&format!("{BENCH} --dry-run --json")).expect(0);
    let result = run.events().pop().expect("a result");
    assert_eq!(result["runs"].as_array().map(Vec::len), Some(7));
}

#[test]
fn ready_plans_are_printed_and_taken_by_name() {
    let folder = Folder::new();
    for plan in claror_lab::plan::READY {
        let run = folder.run(&format!("bench --print-plan {}", plan.name)).expect(0);
        assert_eq!(run.stdout, plan.text);
        let dry = format!("bench room.xml --plan {} --dry-run --size 16x16", plan.name);
        folder.run(&dry).expect(0);
    }
    folder.run("bench --print-plan thesys").expect(2);
}

#[test]
fn events_tell_of_the_course() {
    let folder = folder(PLAN);
    let run = folder.run(&format!("{BENCH} --seeds 1 --json")).expect(0);
    let events = run.events();
    assert_eq!((&events[0]["event"], &events[0]["command"]), (&"start".into(), &"bench".into()));
    let result = events.last().expect("a result");
    assert_eq!((&result["runs"], &result["failures"]), (&4.into(), &0.into()));
    let done = events.iter().filter(|event| event["done"].is_string()).count();
    // Two halves of the reference, and the runs.
    assert_eq!(done, 6);
}

/// What is typed, the exit code, and a part of the message.
const CASES: &[(&str, i32, &str)] = &[
    ("bench", 2, "--plan"),
    ("bench room.xml --plan quick", 2, "--out"),
    ("bench room.xml --plan quick --out out --seeds 0", 2, "0"),
    ("bench room.xml --plan quick --out out --reference a.exr", 2, "2 values"),
    ("bench room.xml room.xml --plan plan.toml --out out --reference a.exr b.exr", 2, "one scene"),
    ("bench room.xml --plan thesys --out out", 4, "quick, thesis, equal-time"),
    ("bench room.xml --plan . --out out", 4, "cannot read ."),
    ("bench room.xml --plan bad.toml --out out", 4, "bad.toml:3:1"),
    ("bench room.xml --plan bad.toml --out out", 4, "expected one of `title`"),
    ("bench missing.xml --plan plan.toml --out out", 4, "missing.xml"),
    ("bench bad.xml --plan plan.toml --out out", 3, "shpere"),
    ("bench room.xml --plan plan.toml --out room.xml/out", 4, "room.xml/out"),
    ("bench room.xml --plan plan.toml --out out --reference a.exr b.exr", 4, "a.exr"),
    ("bench room.xml --plan plan.toml --out out --reference s.pfm s.pfm", 4, "have 16x16"),
];

#[test]
fn mistakes_are_told_at_once_and_nothing_is_written() {
    let folder = folder(PLAN);
    folder.write("bad.toml", "title = 'a'\nseeds = [1]\nsprites = 3\n");
    folder.write("bad.xml", "<scene version=\"3.0.0\"><shape type=\"shpere\"/></scene>");
    let pixels = 1.0_f32.to_le_bytes().repeat(4);
    folder.write("s.pfm", [&b"Pf\n2 2\n-1.0\n"[..], &pixels].concat());
    let before = folder.files();
    for (arguments, code, part) in CASES {
        let run = folder.run(arguments).expect(*code);
        assert!(run.stderr.contains(part), "{arguments}: {run:#?}");
        assert_eq!(run.stderr.matches("error: ").count(), 1, "{arguments}: {run:#?}");
        assert_eq!(folder.files(), before, "{arguments}");
    }
}

#[cfg(target_os = "linux")]
mod ends {
    //! Ctrl-C and kill -9 in the middle.

    use std::process::{Child, Command};
    use std::thread::sleep;
    use std::time::Duration;

    use super::*;

    /// A run that ends, and then one that does not.
    const ENDLESS: &str = "title = 't'\nsize = '16x16'\nthreads = 1\nseeds = [0]\n\
        [reference]\nspp = 4\n[[series]]\nname = 'p'\nintegrator = 'path'\nspp = [1]\n\
        [[series]]\nname = 'q'\nintegrator = 'path'\nspp = [100000000]\nseeds = [0, 1]\n";

    fn signal(child: &Child, name: &str) {
        let status = Command::new("kill").args([name, &child.id().to_string()]).status();
        assert!(status.expect("kill runs").success());
    }

    /// Waits until a renderer of the series `q` runs, and returns its number.
    fn wait_for_renderer(folder: &Folder, other_than: &str) -> String {
        for _ in 0..60_000 {
            let note = std::fs::read_to_string(folder.path("out/running")).unwrap_or_default();
            if let Some((pid, picture)) = note.split_once('\n')
                && picture.contains("room-q-")
                && pid != other_than
            {
                return pid.to_owned();
            }
            sleep(Duration::from_millis(2));
        }
        panic!("no renderer was started");
    }

    /// Whether the process is there and no mere entry in the table of processes.
    fn is_alive(pid: &str) -> bool {
        let state = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
        state.rsplit(')').next().is_some_and(|rest| {
            let state = rest.split_whitespace().next();
            state.is_some_and(|state| state != "Z" && state != "X")
        })
    }

    #[test]
    fn ctrl_c_ends_the_renderer_and_says_how_to_go_on() {
        for name in ["-INT", "-TERM"] {
            let folder = folder(ENDLESS);
            let bench = folder.start(BENCH);
            let renderer = wait_for_renderer(&folder, "");
            let done = runs(&folder, "run.json").len();
            signal(&bench, name);
            let run = Run::from(bench.wait_with_output().expect("it ends")).expect(130);
            let last = run.stderr.lines().last().expect("a line");
            assert!(last.contains("the same command goes on"), "{run:#?}");
            assert!(!is_alive(&renderer));
            assert_eq!(runs(&folder, "run.json").len(), done);
            assert!(!folder.exists("out/study.json"));
        }
    }

    #[test]
    fn after_kill_nine_only_the_run_in_progress_is_lost() {
        let folder = folder(ENDLESS);
        let mut bench = folder.start(BENCH);
        let renderer = wait_for_renderer(&folder, "");
        // Nobody else may write there meanwhile.
        let second = folder.run(BENCH).expect(4);
        assert!(second.stderr.contains("in use by another"), "{second:#?}");
        let done = runs(&folder, "run.json");
        signal(&bench, "-KILL");
        bench.wait().expect("it ends");
        assert!(is_alive(&renderer), "it knows nothing of it");
        // The next one ends the renderer that was left behind, keeps what is done, and goes on.
        let again = folder.start(BENCH);
        wait_for_renderer(&folder, &renderer);
        assert!(!is_alive(&renderer));
        assert!(runs(&folder, "run.json").len() >= done.len());
        signal(&again, "-INT");
        Run::from(again.wait_with_output().expect("it ends")).expect(130);
        folder.write("plan.toml", ENDLESS.replace("100000000", "2"));
        let run = folder.run(BENCH).expect(0);
        assert_eq!(made(&run), 3 - done.len(), "{run:#?}");
    }

    #[test]
    fn a_reference_goes_on_from_its_checkpoint() {
        let folder = folder(&ENDLESS.replace("spp = 4\n", "spp = 100000000\n"));
        let spent = || {
            let mut bench = folder.start(&format!("{BENCH} --json"));
            let out = bench.stdout.take().expect("a pipe");
            let lines = std::io::BufRead::lines(std::io::BufReader::new(out));
            // The renderer works as soon as a share is told.
            let tells = |line: &String| {
                let event: Value = serde_json::from_str(line).expect("an object");
                event["fraction"].as_f64().is_some_and(|share| share > 0.0)
            };
            let mut lines = lines.map_while(Result::ok);
            assert!(lines.any(|line| tells(&line)), "no progress");
            signal(&bench, "-INT");
            let rest = lines.last().expect("a result");
            assert!(rest.contains("\"interrupted\":true"), "{rest}");
            assert_eq!(bench.wait().expect("it ends").code(), Some(130));
            let place = std::fs::read_dir(folder.path("refs")).expect("a folder").next();
            let place = place.expect("a reference").expect("an entry").path();
            assert!(place.join("half-1.ckpt").is_file());
            let text = std::fs::read_to_string(place.join("half-1.spent.json")).expect("a note");
            text.trim().parse::<f64>().expect("seconds")
        };
        let first = spent();
        assert!(first > 0.0 && spent() > first);
    }
}
