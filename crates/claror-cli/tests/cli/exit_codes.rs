//! The table of exit codes, and that nothing is written when something is wrong.

use crate::common::{Folder, ROOM};

/// What is typed, the exit code, and a part of the message.
const CASES: &[(&str, i32, &str)] = &[
    // Usage.
    ("", 2, "Usage"),
    ("rendr room.xml", 2, "render"),
    ("render", 2, "SCENE"),
    ("render room.xml --sppp 3", 2, "--spp"),
    ("render room.xml --spp 0", 2, "0"),
    ("render room.xml --time soon", 2, "such as `90s`"),
    ("render room.xml --size 10", 2, "WIDTHxHEIGHT"),
    ("render room.xml -o a.jpeg", 2, "the endings are .exr, .png, .hdr and .pfm"),
    ("render room.xml -o a.exr -o ./a.exr", 2, "written twice"),
    ("render room.xml -o a.exr --checkpoint a.exr", 2, "written twice"),
    ("render room.xml -o - --json", 2, "standard output"),
    ("render room.xml -o - -o -", 2, "once"),
    ("render room.xml --resume", 2, "--checkpoint"),
    ("render room.xml --crop 20,20,8,8", 2, "beyond the film of 24x24"),
    ("render room.xml --sensor 2", 2, "0 (front), 1 (top)"),
    ("render room.xml --aov albdo", 2, "albedo"),
    ("render room.xml -i bdpt", 2, "path, direct, gridcache and depth"),
    ("render room.xml -p integrator.maxdepth=3", 2, "did you mean \"integrator.max_depth\"?"),
    ("render room.xml -p integrator.max_depth=deep", 2, "integrator.max_depth"),
    ("render room.xml -p integrator.emitter_samples=3", 2, "-i direct"),
    ("render room.xml --strict", 2, "--strict needs --verify"),
    ("render room.xml --verify-picture a.png", 2, "--verify-picture needs --verify"),
    ("render room.xml --verify=3", 2, "16"),
    ("verify room.xml --verify-share 2", 2, "a share above 0 and up to 1"),
    ("verify room.xml --verify-picture a.jpeg", 2, "the endings are .exr, .png, .hdr and .pfm"),
    ("verify room.xml -o a.png --verify-picture ./a.png", 2, "written twice"),
    ("verify room.xml -i depth", 2, "computes no light"),
    ("render room.xml -i irrcache -p integrator.debias=1.5", 2, "between 0 and 1"),
    ("render room.xml -p integrator.debias=0.5", 2, "integrator.debias"),
    ("compare a.exr b.exr --fail-above rmse=1", 2, "mse, relmse"),
    ("completions tcl", 2, "bash"),
    ("render room.xml --cache a.cache", 2, "-i irrcache"),
    ("render room.xml -i irrcache --cache-mode read", 2, "--cache"),
    ("render room.xml -i irrcache --cache a.exr -o a.exr", 2, "written twice"),
    ("render room.xml -i irrcache --cache room.xml", 2, "--cache-mode"),
    ("cache", 2, "export"),
    ("cache export room.xml", 2, "--ply"),
    // Scene.
    ("render bad.xml", 3, "shpere"),
    ("check bad.xml", 3, "2 errors"),
    ("info bad.xml", 3, "bad.xml:2:"),
    ("render room.xml -Dcolour=3", 3, "colour"),
    // File.
    ("render missing.xml", 4, "missing.xml"),
    ("check .", 4, "."),
    ("render room.xml -o no/folder/a.exr", 4, "there is no folder no/folder"),
    ("render room.xml -o folder.exr", 4, "it is a folder"),
    ("check no_mesh.xml", 4, "nowhere.obj"),
    ("compare missing.exr room.xml", 4, "missing.exr"),
    ("compare room.xml room.xml", 4, "not a picture"),
    ("render room.xml --checkpoint no/a.ckpt", 4, "no"),
    ("render room.xml --checkpoint room.xml --resume -o a.exr", 4, "room.xml"),
    ("render room.xml -i irrcache --cache no/a.cache", 4, "there is no folder no"),
    ("render room.xml -i irrcache --cache a.cache --cache-mode read", 4, "--cache-mode write"),
    ("cache info a.cache", 4, "there is no such file"),
    ("cache info room.xml", 4, "this is not an irradiance cache"),
    ("cache export no_mesh.xml --csv a.csv", 4, "this is not an irradiance cache"),
    // Memory.
    ("render room.xml --size 100000x100000 -o a.exr", 5, "100000x100000 pixels would need"),
    ("render room.xml --size 4294967295x4294967295 -o a.exr", 5, "would need"),
    ("render room.xml --max-memory 10k -o a.exr", 5, "10.0 KiB are allowed"),
];

fn folder() -> Folder {
    let folder = Folder::new();
    folder.write(
        "bad.xml",
        "<scene version=\"3.0.0\">\n  <shape type=\"shpere\"/>\n  <emitter type=\"lamp\"/>\n</scene>",
    );
    let mesh =
        "<shape type=\"obj\"><string name=\"filename\" value=\"nowhere.obj\"/></shape></scene>";
    folder.write("no_mesh.xml", ROOM.replace("</scene>", mesh));
    std::fs::create_dir(folder.path("folder.exr")).expect("a folder");
    folder
}

#[test]
fn every_mistake_has_its_code_and_message() {
    let folder = folder();
    let before = folder.files();
    let mut wrong = Vec::new();
    for (arguments, code, message) in CASES {
        let run = folder.run(arguments);
        let clean = (run.stdout.is_empty() || arguments.contains("--json"))
            && !run.stderr.contains("panicked")
            && !run.stderr.contains("this is a bug")
            && folder.files() == before;
        if run.code != Some(*code) || !run.stderr.contains(message) || !clean {
            wrong
                .push(format!("claror {arguments}: expected {code} and {message:?}, got {run:#?}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn help_and_version_succeed() {
    let folder = Folder::new();
    let help = folder.run("--help").expect(0);
    for code in ["0  ", "2  ", "3  ", "4  ", "5  ", "6  ", "7  ", "70 ", "130"] {
        assert!(help.stdout.contains(&format!("\n  {code}")), "{code} in {}", help.stdout);
    }
    assert_eq!(help.stderr, "");
    let version = folder.run("--version").expect(0);
    assert_eq!(version.stdout, format!("claror {}\n", env!("CARGO_PKG_VERSION")));
    for command in ["render", "verify", "info", "check", "compare", "cache", "completions", "man"] {
        assert!(help.stdout.contains(command));
        folder.run(&format!("{command} --help")).expect(0);
    }
}

#[test]
fn documents_are_made_from_the_options() {
    let folder = Folder::new();
    let man = folder.run("man").expect(0).stdout;
    for part in [
        ".TH claror 1",
        "CLAROR RENDER",
        "CLAROR VERIFY",
        "EXIT STATUS",
        "checkpoint",
        "CLAROR_THREADS",
    ] {
        assert!(man.contains(part), "{part} is missing");
    }
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = folder.run(&format!("completions {shell}")).expect(0).stdout;
        assert!(script.contains("checkpoint"), "{shell}");
    }
}

#[test]
fn checks_say_ok() {
    let folder = Folder::new();
    let run = folder.run("check room.xml").expect(0);
    assert_eq!((run.stdout.as_str(), run.stderr.as_str()), ("room.xml: ok\n", ""));
    assert_eq!(folder.files(), ["room.xml"]);
}

#[test]
fn lenient_replaces_and_says_so() {
    let folder = Folder::new();
    let hair = "<shape type=\"sphere\"><bsdf type=\"hair\"/></shape></scene>";
    folder.write("hair.xml", ROOM.replace("</scene>", hair));
    let run = folder.run("check hair.xml").expect(3);
    assert!(run.stderr.contains("hair") && run.stderr.contains("hair.xml:"), "{}", run.stderr);
    let run = folder.run("check hair.xml --lenient").expect(0);
    assert!(run.stderr.starts_with("warning: "), "{}", run.stderr);
    assert_eq!(run.stdout, "hair.xml: ok, 1 warning\n");
}

#[test]
fn threads_come_from_the_environment_too() {
    let folder = Folder::new();
    let run = |threads: &str| {
        let mut command = folder.command("check room.xml");
        crate::common::Run::from(
            command.env("CLAROR_THREADS", threads).output().expect("it starts"),
        )
    };
    run("1").expect(0);
    run("none").expect(2);
}

#[test]
fn info_tells_what_was_understood() {
    let folder = Folder::new();
    let info = folder.run("info room.xml").expect(0).stdout;
    for part in ["3: 1 rectangle, 2 sphere", "area on lamp", "\"front\"", "24x24", "max_depth 6"] {
        assert!(info.contains(part), "{part} in {info}");
    }
}

#[cfg(unix)]
#[test]
fn a_reader_that_leaves_is_no_error() {
    let folder = Folder::new();
    for arguments in ["man", "info room.xml", "--help", "render room.xml --json"] {
        let mut child = folder.start(arguments);
        drop(child.stdout.take());
        let run = crate::common::Run::from(child.wait_with_output().expect("it ends"));
        assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""), "{arguments}");
    }
    assert!(folder.exists("room.exr"), "the picture is written all the same");
}
