//! Runs that are stopped, and outputs that cannot be written: nothing is left half-done, and one sentence says why.
#![cfg(target_os = "linux")]

mod common;

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use common::nested_balls;
use common::run::err;

const PROGRAM: &str = env!("CARGO_BIN_EXE_chordfield");

/// Signals, and the exit codes by which shells tell them.
const SIGNALS: [(&str, i32); 2] = [("-INT", 130), ("-TERM", 143)];

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("balls.toml"), nested_balls(64)).expect("a scene");
    std::fs::write(folder.path().join("study.toml"), STUDY).expect("a study");
    folder
}

fn start(folder: &Path, args: &[&str]) -> Child {
    Command::new(PROGRAM)
        .current_dir(folder)
        .args(args)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts")
}

/// All files below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let paths = entries.map(|entry| entry.expect("an entry").path());
    paths.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}

fn pause(milliseconds: u64) {
    std::thread::sleep(Duration::from_millis(milliseconds));
}

/// Waits until the process catches SIGINT and SIGTERM, by the mask that the kernel shows.
fn wait_until_signals_are_caught(child: &mut Child) {
    let catches = |process: u32| {
        let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
        let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:").map(str::trim));
        let wanted = 1 << 1 | 1 << 14;
        mask.and_then(|mask| u64::from_str_radix(mask, 16).ok()).is_some_and(|mask| mask & wanted == wanted)
    };
    while !catches(child.id()) && child.try_wait().expect("a status").is_none() {
        pause(2);
    }
}

/// Stops a run by each signal, some time after it has begun; looks at what is left.
fn stop(args: &[&str], after: u64, look: impl Fn(&Path)) {
    for (signal, exit_code) in SIGNALS {
        let folder = folder();
        let mut child = start(folder.path(), args);
        wait_until_signals_are_caught(&mut child);
        pause(after);
        let killed = Command::new("kill").args([signal, &child.id().to_string()]).status().expect("kill");
        assert!(killed.success(), "{args:?} had ended by itself");
        let run = child.wait_with_output().expect("it ends");
        assert_eq!(run.status.code(), Some(exit_code), "{args:?} {signal}: {}", err(&run));
        assert!(run.stdout.is_empty(), "{args:?}");
        assert!(err(&run).len() < 100, "{}", err(&run));
        let left = files(folder.path());
        assert!(!left.iter().any(|file| file.to_string_lossy().contains(".chordfield-")), "{left:?}");
        look(folder.path());
    }
}

fn assert_nothing_new(folder: &Path) {
    let mut left = files(folder);
    left.sort();
    assert_eq!(left, ["balls.toml", "study.toml"].map(|name| folder.join(name)));
}

fn assert_no_record(folder: &Path) {
    let left = files(&folder.join("out"));
    assert!(!left.iter().any(|file| file.extension().is_some_and(|e| e == "json")), "{left:?}");
}

#[test]
fn projections_stopped_leave_whole_files_and_no_record() {
    for method in ["exact", "ritree"] {
        let args = ["project", "balls.toml", "--gantry", "0..360:1", "--size", "900x900", "--method", method];
        stop(&[&args[..], &["--write", "p"]].concat(), 600, |folder| {
            assert_no_record(folder);
            for file in files(&folder.join("out")) {
                let bytes = file.metadata().expect("a file").len();
                assert!(bytes > 4 * 900 * 900, "{} has {bytes} bytes", file.display());
            }
        });
    }
}

#[test]
fn audits_stopped_write_nothing() {
    let views = ["audit", "balls.toml", "--gantry", "0..360:1", "--size", "900x900", "-o", "out"];
    let lines = ["audit", "balls.toml", "--rays", "1e10", "-o", "out"];
    let aimed = ["audit", "balls.toml", "--adversarial", "1e9"];
    for args in [&views[..], &lines, &aimed] {
        stop(args, 200, assert_nothing_new);
    }
}

#[test]
fn oracles_sweeps_benchmarks_and_checks_are_stopped_at_once() {
    let (oracles, stress) = (["audit", "adult", "--oracles"], ["audit", "balls.toml", "--stress", "1e9"]);
    for args in [&oracles[..], &stress, &["bench", "curve", "balls.toml"]] {
        stop(args, 200, assert_nothing_new);
    }
    stop(&["check", "adult", "adult", "adult", "adult", "adult", "adult"], 50, |_| {});
}

#[test]
fn benchmarks_stopped_leave_a_whole_report_of_what_was_measured_or_none() {
    for bench in ["choice", "scale", "paper"] {
        for (signal, exit_code) in SIGNALS {
            let folder = folder();
            let mut child = start(folder.path(), &["bench", bench, "-o", "out"]);
            wait_until_signals_are_caught(&mut child);
            pause(600);
            let killed = Command::new("kill").args([signal, &child.id().to_string()]).status().expect("kill");
            assert!(killed.success(), "{bench} had ended by itself");
            let run = child.wait_with_output().expect("it ends");
            assert_eq!(run.status.code(), Some(exit_code), "{bench} {signal}: {}", err(&run));
            let left = files(&folder.path().join("out"));
            assert!(!left.iter().any(|file| file.to_string_lossy().contains(".chordfield-")), "{left:?}");
            for record in left.iter().filter(|file| file.extension().is_some_and(|e| e == "json")) {
                let text = std::fs::read_to_string(record).expect("a record");
                assert!(serde_json::from_str::<serde_json::Value>(&text).is_ok(), "{}", record.display());
            }
        }
    }
}

/// A hundred million paths through the balls.
const STUDY: &str = "scene = \"balls.toml\"
paths = { field = { rectangle_mm = [80, 80], spacing_mm = 0.08 } }
beam = { control_points = [{ gantry_deg = \"0..360:3.6\" }] }
";

#[test]
fn studies_stopped_leave_no_table_and_no_record() {
    for more in
        [&["--method", "exact"][..], &["--method", "ritree"], &["--shard", "1/2"], &["--write", "none"]]
    {
        let args = [&["dose", "study.toml", "--json"], more].concat();
        stop(&args, 300, |folder| assert_eq!(files(&folder.join("out")), [] as [PathBuf; 0], "{args:?}"));
    }
}

#[test]
fn pictures_stopped_are_not_there() {
    let scene = ["trace", "random-volumes", "--seed", "2", "--size", "3000x3000", "--json"];
    for more in [&["--method", "exact"][..], &["--method", "ritree"], &["--compare"], &["--count-operations"]]
    {
        let args = [&scene[..], more].concat();
        stop(&args, 300, |folder| assert_eq!(files(&folder.join("out")), [] as [PathBuf; 0], "{args:?}"));
    }
}

#[test]
fn an_export_stopped_anywhere_names_no_mesh_that_is_missing() {
    for after in [0, 300, 500, 520, 540, 600, 700] {
        let folder = folder();
        let mut child = start(folder.path(), &["phantom", "export", "adult", "out"]);
        wait_until_signals_are_caught(&mut child);
        pause(after);
        // It may have ended by itself.
        let _ = Command::new("kill").args(["-TERM", &child.id().to_string()]).output();
        let run = child.wait_with_output().expect("it ends");
        let left = files(&folder.path().join("out"));
        assert!(!left.iter().any(|file| file.to_string_lossy().contains(".chordfield-")), "{left:?}");
        let is_whole = left.iter().any(|file| file.extension().is_some_and(|e| e == "toml"));
        assert_eq!(run.status.code(), Some(if is_whole { 0 } else { 143 }), "{}", err(&run));
        if is_whole {
            let text = std::fs::read_to_string(folder.path().join("out/adult.toml")).expect("a scene");
            for line in text.lines().filter_map(|line| line.strip_prefix("file = \"")) {
                let mesh = folder.path().join("out").join(line.trim_end_matches('"'));
                assert!(mesh.exists(), "{}", mesh.display());
            }
        }
    }
}

/// Runs the program by a shell that does `first`.
fn by_shell(folder: &Path, first: &str, args: &[&str]) -> Output {
    let script = format!("{first}; exec \"$0\" \"$@\"");
    let words = ["-c", &script, PROGRAM];
    Command::new("sh").current_dir(folder).args(words).args(args).output().expect("sh")
}

const PROJECT: [&str; 7] = ["project", "balls.toml", "--size", "300x300", "--write", "p", "--npy"];
const AUDIT: [&str; 6] = ["audit", "balls.toml", "--size", "100x100", "-o", "out"];

#[test]
fn a_file_that_may_not_grow_is_named_and_none_of_it_is_left() {
    for args in [&PROJECT[..], &AUDIT, &["phantom", "export", "adult-skeleton", "out"]] {
        let folder = folder();
        // Files of 16 blocks of 512 bytes, and no signal about it.
        let run = by_shell(folder.path(), "ulimit -f 16; trap '' 25", args);
        assert_eq!(run.status.code(), Some(2), "{args:?}: {}", err(&run));
        let said = err(&run);
        assert!(said.contains("cannot write out/") && said.contains("File too large"), "{args:?}: {said}");
        let left = files(&folder.path().join("out"));
        assert!(left.iter().all(|file| file.metadata().expect("a file").len() <= 16 * 512), "{left:?}");
        assert!(!left.iter().any(|file| file.to_string_lossy().contains(".chordfield-")), "{left:?}");
        assert_no_record(folder.path());
    }
}

#[test]
fn a_full_disk_is_told_in_a_sentence_and_holds_no_part_of_the_file() {
    // The first file that does not fit; what fits before it is whole.
    let commands: [(&[&str], &str); 5] = [
        (&PROJECT, "out/balls-g000-p.mha"),
        (
            &["project", "balls.toml", "--method", "ritree", "-o", "images", "--save-trees", "out/trees"],
            "out/trees",
        ),
        (&["dose", "study.toml", "--set", "paths.field.spacing=2"], "out/path"),
        (&["trace", "random-volumes", "--count", "2", "--size", "400x400"], "out/random-volumes"),
        (&["phantom", "export", "adult", "out"], "out/meshes/trunk.obj"),
    ];
    for (args, file) in commands {
        let folder = folder();
        std::fs::create_dir(folder.path().join("out")).expect("a folder");
        // A disk of 64 kB, seen by the shell alone.
        let script = "mount -t tmpfs -o size=64k none out || exit 77; \"$0\" \"$@\"; code=$?; ls -AR out >&2; exit $code";
        let run = Command::new("unshare")
            .current_dir(folder.path())
            .args(["--map-root-user", "--mount", "sh", "-c", script, PROGRAM])
            .args(args)
            .output();
        let Ok(run) = run else { return };
        let said = err(&run);
        if run.status.code() == Some(77) || said.contains("unshare failed") {
            // No disk may be made here; the limit of a file's size stands for it above.
            return;
        }
        assert_eq!(run.status.code(), Some(2), "{args:?}: {said}");
        assert!(
            said.contains(&format!("cannot write {file}")) && said.contains("No space left"),
            "{args:?}: {said}"
        );
        assert!(!said.contains(".chordfield-") && !said.contains(".json"), "{args:?}: {said}");
    }
}

#[test]
fn folders_where_nothing_can_be_made_are_named() {
    for output in ["/proc/out", "/proc/version/out"] {
        for args in [&PROJECT[..4], &AUDIT[..4], &["phantom", "export", "calibration"]] {
            let folder = folder();
            let to = if args[0] == "phantom" { vec![output] } else { vec!["-o", output] };
            let run = start(folder.path(), &[args, &to].concat()).wait_with_output().expect("it ends");
            assert_eq!(run.status.code(), Some(2), "{args:?}: {}", err(&run));
            assert!(err(&run).contains(&format!("cannot create {output}")), "{args:?}: {}", err(&run));
        }
    }
}

#[test]
fn readers_that_have_seen_enough_end_a_run_quietly_when_its_files_are_whole() {
    let trace = ["trace", "random-volumes", "--count", "1", "--size", "32x32", "--json"];
    let commands: [(&[&str], Option<&str>); 11] = [
        (&["dose", "study.toml", "--set", "paths.field.spacing=20", "--json"], Some("out/dose.json")),
        (&trace, Some("out/random-volumes.json")),
        (&["bench", "curve", "balls.toml", "--sizes", "8x8", "--rounds", "1", "--json"], None),
        (&["completions", "bash"], None),
        (&["audit", "balls.toml", "--organ", "outer", "--ray=0,0,-90,0,0,90"], None),
        (&["project", "balls.toml", "--json"], Some("out/balls.json")),
        (&["audit", "balls.toml", "--json", "-o", "out"], Some("out/audit.json")),
        (&["audit", "balls.toml", "--stress", "8"], None),
        (&["check", "balls.toml"], None),
        (&["phantom", "show", "adult"], None),
        (&["phantom", "list"], None),
    ];
    for (args, record) in commands {
        let folder = folder();
        let mut child = start(folder.path(), args);
        drop(child.stdout.take());
        let run = child.wait_with_output().expect("it ends");
        assert_eq!((run.status.code(), err(&run).as_str()), (Some(0), ""), "{args:?}");
        assert!(record.is_none_or(|record| folder.path().join(record).exists()), "{args:?}");
    }
    // Nobody hears the words; the exit code still tells.
    let folder = folder();
    let mut child = start(folder.path(), &["audit", "balls.toml", "--limit-mm", "0.1"]);
    drop((child.stdout.take(), child.stderr.take()));
    // The summary found no reader, which ends the run before the limit is judged.
    assert!(matches!(child.wait().expect("it ends").code(), Some(0 | 1)));
}

#[test]
fn an_output_folder_that_vanishes_stops_the_run_with_its_name() {
    let folder = folder();
    let args = ["project", "balls.toml", "--gantry", "0..360:1", "--size", "300x300", "--write", "p"];
    let mut child = start(folder.path(), &args);
    let out = folder.path().join("out");
    while files(&out).is_empty() && child.try_wait().expect("a status").is_none() {
        pause(2);
    }
    // A file that is just made keeps the folder for a moment.
    while std::fs::remove_dir_all(&out).is_err() && out.exists() {}
    let run = child.wait_with_output().expect("it ends");
    assert_eq!(run.status.code(), Some(2), "{}", err(&run));
    assert!(err(&run).contains("out/balls-g") && err(&run).contains("cannot"), "{}", err(&run));
    assert!(!out.exists(), "it is not made anew");
}

#[test]
fn a_mesh_that_is_gone_is_named() {
    let folder = folder();
    let scene = nested_balls(16).replace(
        "shape = { kind = \"ellipsoid\", half_axes_mm = [20, 15, 10], faces = 400, move_mm = [10, 5, -8] }",
        "mesh = { file = \"gone.obj\" }",
    );
    std::fs::write(folder.path().join("gone.toml"), scene).expect("a scene");
    let study = "scene = \"gone.toml\"\npaths = { points = [{ at_mm = [0, 0, 0] }] }\n";
    std::fs::write(folder.path().join("gone-study.toml"), study).expect("a study");
    let world = "sky = { radius = 900, colours = [\"#000000\", \"#ffffff\"] }
        cameras = [{ eye = [0, -60, 0], target = [0, 0, 0] }]
        [[object]]
        name = \"mesh\"
        shape = { kind = \"mesh\", file = \"gone.obj\" }\n";
    std::fs::write(folder.path().join("gone-world.toml"), world).expect("a scene");
    for args in [
        ["project", "gone.toml"],
        ["audit", "gone.toml"],
        ["dose", "gone-study.toml"],
        ["trace", "gone-world.toml"],
    ] {
        let run = start(folder.path(), &args).wait_with_output().expect("it ends");
        assert_eq!(run.status.code(), Some(2), "{}", err(&run));
        assert!(err(&run).contains("gone.obj") && err(&run).contains("No such file"), "{}", err(&run));
    }
}
