//! Good plans are understood, bad ones refused with place and advice.

use super::*;

#[test]
fn ready_plans_are_good() {
    for ready in READY {
        let found = PlanFile::read(ready.name).unwrap_or_else(|e| panic!("{}: {e}", ready.name));
        assert!(!found.plan.about.is_empty(), "{} says nothing of itself", ready.name);
        assert_eq!(found.text, ready.text);
    }
}

#[test]
fn everything_is_understood() {
    let text = r#"
title = "T"
about = "A"
seeds = [0, 2]
threads = 2
size = "40x30"
set = { "integrator.max_depth" = 8, film.rfilter = "box", rr_depth = 4 }
[reference]
spp = 100
[[series]]
name = "path"
label = "Path tracing"
note = "n"
integrator = "path"
spp = [1, 2]
seeds = [5]
illustrate = true
[[series]]
name = "cache"
vary = { accuracy = [0.5, 1e-3], "integrator.index" = ["bvh"] }
[[equal_time]]
times = ["15s", "5m", 2, 0.5]
contenders = [ { series = "path" }, { series = "cache", knob = "error", from = 1, to = 0.01 } ]
[equal_error]
rel_mse = [1e-2, 1]
[lookups]
records = [1000]
indices = ["bvh"]
"#;
    let plan = PlanFile::parse("p.toml", text).expect("a good plan").plan;
    let scalar = |name: &str, value: &str| (name.to_owned(), Scalar(value.to_owned()));
    assert_eq!(
        plan.set.0,
        [
            scalar("integrator.max_depth", "8"),
            scalar("film.rfilter", "box"),
            scalar("integrator.rr_depth", "4")
        ]
    );
    assert_eq!(plan.size, Some(Size([40, 30])));
    assert_eq!(plan.series[0].seeds.as_deref(), Some(&[5][..]));
    let names: Vec<&str> = plan.series[1].vary.0.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["integrator.accuracy", "integrator.index"]);
    assert_eq!(plan.series[1].vary.0[0].1[1], Scalar("0.001".into()));
    let times: Vec<f64> = plan.equal_time[0].times.iter().map(|time| time.0).collect();
    assert_eq!(times, [15.0, 300.0, 2.0, 0.5]);
    assert_eq!(plan.equal_error.expect("given").rel_mse, [0.01, 1.0]);
}

/// What stands below the title, the line of the mistake, and a part of the message.
const BAD: &[(&str, u32, &str)] = &[
    ("seeds = []", 2, "different whole numbers"),
    ("seeds = [1, 1]", 2, "different whole numbers"),
    ("seeds = [-1]", 2, "-1"),
    ("seeds = [2000000000]", 2, "999999999"),
    ("threads = 0", 2, "from 1 to 4096"),
    ("size = \"10\"", 2, "WIDTHxHEIGHT"),
    ("size = \"0x10\"", 2, "WIDTHxHEIGHT"),
    ("sizes = \"10x10\"", 2, "unknown field `sizes`, expected one of"),
    ("set = { max_depth = [1] }", 2, "integrator.max_depth: expected a number"),
    ("[reference]\nspp = 1", 3, "2 samples per pixel"),
    ("[[series]]\nspp = 4", 2, "missing field `name`"),
    ("[[series]]\nname = 'a b'", 3, "letters, digits"),
    ("[[series]]\nname = 'a'\nspp = 0", 4, "above 0"),
    ("[[series]]\nname = 'a'\nspp = 'many'", 4, "a whole number above 0, or a list"),
    ("[[series]]\nname = 'a'\nvary = { error = 0.1 }", 4, "expected a list of values"),
    ("[[series]]\nname = 'a'\nvary = { error = [] }", 4, "expected a list of values"),
    ("[[series]]\nname = 'a'\nspp = [1]\nsteps = [{ label = 's' }]", 3, "steps and a sweep"),
    ("[[series]]\nname = 'a'\ncumulative = true", 3, "has no steps"),
    ("[[series]]\nname = 'a'\nsteps = [{ lable = 's' }]", 4, "lable"),
    ("[[series]]\nname = 'a'\n[[series]]\nname = 'a'", 5, "two series are called `a`"),
    (
        "[[series]]\nname = 'a'\n[[equal_time]]\ntimes = [1]\ncontenders = [{ series = 'b' }]",
        6,
        "there is no series `b`; the plan has a",
    ),
    (
        "[[series]]\nname = 'a'\n[[equal_time]]\ntimes = ['soon']\ncontenders = []",
        5,
        "a time above 0 such as",
    ),
    (
        "[[series]]\nname = 'a'\n[[equal_time]]\ntimes = [1]\n\
         contenders = [{ series = 'a', knob = 'error' }]",
        6,
        "a knob needs `from`",
    ),
    ("[lookups]\nrecords = []", 3, "whole numbers above 0"),
    ("[[series]\nname = 'a'", 2, ""),
];

#[test]
fn bad_plans_are_refused_with_the_place() {
    for (text, line, part) in BAD {
        let text = format!("title = 't'\n{text}\n");
        let error = PlanFile::parse("p.toml", &text).expect_err(&text);
        let PlanError::Wrong(diagnostic) = error else { panic!("{error}") };
        assert!(diagnostic.message.contains(part), "{text}: {}", diagnostic.message);
        assert_eq!(diagnostic.position.map(|(line, _)| line), Some(*line), "{diagnostic}");
    }
}

#[test]
fn a_plan_without_work_is_refused() {
    let error = PlanFile::parse("p.toml", "title = 't'").expect_err("nothing to do");
    assert!(error.to_string().contains("measures nothing"), "{error}");
}

#[test]
fn unknown_plans_name_the_ready_ones() {
    let error = PlanFile::read("thesys").expect_err("no such plan");
    assert!(matches!(&error, PlanError::Unknown { ready, .. } if ready.contains("thesis")));
}
