//! The program as a user meets it: commands, files, exit codes.

mod common;

use std::process::{Command, Stdio};

use common::run::{chordfield, err, files, folder, out, summary};
use common::{MetaImage, nested_balls};

#[test]
fn projecting_writes_pictures_data_and_a_record_and_is_silent_when_piped() {
    let folder = folder();
    let run = chordfield(folder.path(), &["project", "balls.toml", "--gantry", "0,90", "--npy"]);
    assert_eq!((run.status.code(), out(&run).as_str(), err(&run).as_str()), (Some(0), "", ""));
    let written = files(&folder.path().join("out"));
    for view in ["g000", "g090"] {
        for product in [
            "radiograph.png",
            "colour.png",
            "transmission.mha",
            "transmission.npy",
            "p.mha",
            "p.npy",
            "lengths",
        ] {
            assert!(written.contains(&format!("balls-{view}-{product}")), "{product} is not in {written:?}");
        }
    }
    assert_eq!(
        files(&folder.path().join("out/balls-g090-lengths")),
        ["inner.mha", "inner.npy", "outer.mha", "outer.npy"]
    );

    let record = std::fs::read(folder.path().join("out/balls.json")).expect("a record");
    let record: serde_json::Value = serde_json::from_slice(&record).expect("JSON");
    assert_eq!(record["frames"]["lengths"], "mm");
    assert_eq!(record["scene"]["organs"][1]["inside"], "outer");
    assert_eq!(record["summary"]["rays"], 2 * 64 * 64);
    for view in record["views"].as_array().expect("views") {
        for file in view["files"].as_array().expect("files") {
            let path = folder.path().join("out").join(file["file"].as_str().expect("a name"));
            let bytes = std::fs::metadata(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display())).len();
            assert_eq!(file["bytes"], bytes);
        }
    }
}

#[test]
fn images_read_back_with_spacing_place_and_direction() {
    let folder = folder();
    let run = chordfield(folder.path(), &["project", "balls.toml", "--gantry", "90", "--npy"]);
    assert_eq!(run.status.code(), Some(0), "{}", err(&run));
    let path = |name: &str| folder.path().join("out").join(name);
    let image = MetaImage::read(&path("balls-g090-lengths/outer.mha"));
    assert_eq!(image.numbers("DimSize"), [64.0, 64.0, 1.0]);
    assert_eq!(image.numbers("ElementSpacing")[..2], [1.875, 1.875]);
    // From the patient's left: columns run to the back, rows down to the feet, the detector lies to the right.
    assert_eq!(image.numbers("TransformMatrix")[..6], [0.0, 1.0, 0.0, 0.0, 0.0, -1.0]);
    assert_eq!(image.numbers("Offset"), [-500.0, -59.0625, 59.0625]);
    assert_eq!(image.text("ElementType"), "MET_FLOAT");
    assert_eq!(image.values.len(), 64 * 64);

    let npy = std::fs::read(path("balls-g090-lengths/outer.npy")).expect("an array");
    let data: Vec<f32> = npy[npy.len() - 4 * 64 * 64..]
        .chunks_exact(4)
        .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        .collect();
    assert_eq!(data, image.values);

    let png = image::open(path("balls-g090-radiograph.png")).expect("a PNG");
    let image::DynamicImage::ImageLuma16(grey) = png else { panic!("not 16-bit grey") };
    let p = MetaImage::read(&path("balls-g090-p.mha")).values;
    let brightest = grey.pixels().enumerate().max_by_key(|(_, pixel)| pixel.0).expect("pixels").0;
    let highest = p.iter().copied().fold(0.0, f32::max);
    assert!(p[brightest] > 0.95 * highest, "white is where p is high");
    assert_eq!(grey.get_pixel(0, 0).0, [0], "air is black");
}

#[test]
fn json_goes_to_standard_output_and_nothing_else_does() {
    let folder = folder();
    let run =
        chordfield(folder.path(), &["project", "balls.toml", "--json", "--write", "p", "--threads", "1"]);
    let summary = summary(&run);
    assert_eq!((&summary["method"], &summary["threads"]), (&"auto".into(), &1.into()));
    let count = |key: &str| summary[key].as_u64().unwrap_or_else(|| panic!("no {key}"));
    assert_eq!(
        count("organ_rays"),
        count("organ_rays_exact")
            + count("organ_rays_interpolated")
            + count("organ_rays_skipped_by_bounds")
            + count("organ_rays_skipped_unneeded")
    );
    assert!(summary["seconds"]["project"].as_f64().is_some());
    assert_eq!(files(&folder.path().join("out")), ["balls-g000-p.mha", "balls.json"]);
}

#[test]
fn float_images_are_the_same_bytes_for_one_two_and_eight_threads() {
    let folder = folder();
    let project = |threads: &str| {
        let args = [
            "project",
            "balls.toml",
            "--threads",
            threads,
            "-o",
            threads,
            "--photons",
            "5000",
            "--seed",
            "3",
        ];
        assert_eq!(chordfield(folder.path(), &args).status.code(), Some(0));
        let folder = folder.path().join(threads);
        [
            "balls-g000-p.mha",
            "balls-g000-colour.png",
            "balls-g000-radiograph.png",
            "balls-g000-lengths/inner.mha",
        ]
        .map(|file| std::fs::read(folder.join(file)).expect(file))
    };
    let one = project("1");
    assert!(one == project("2") && one == project("8"));
}

#[test]
fn bad_input_exits_2_with_the_place_and_leaves_nothing() {
    let folder = folder();
    let broken = nested_balls(64).replace("[10, 5, -8]", "[45, 0, 0]");
    std::fs::write(folder.path().join("crossing.toml"), broken).expect("a scene");
    let run = chordfield(folder.path(), &["project", "crossing.toml"]);
    assert_eq!((run.status.code(), out(&run).as_str()), (Some(2), ""));
    assert!(err(&run).contains("organs `outer` and `inner` cross"), "{}", err(&run));
    assert!(err(&run).contains("crossing.toml:15"), "{}", err(&run));
    assert!(!folder.path().join("out").exists());

    for (args, words) in [
        (&["project", "nobody"][..], "no phantom of that name"),
        (&["project", "missing.toml"], "cannot read missing.toml"),
        (&["project", "balls.toml", "--gantry", "0..360"], "--gantry"),
        (&["project", "balls.toml", "--energy-kev", "5"], "5"),
        (&["project", "balls.toml", "--size", "0x64"], "pixels"),
        (&["project", "balls.toml", "--size", "46340x46340"], "103.1 GB"),
        (&["project", "balls.toml", "--photons", "-1"], "photon"),
        (&["phantom", "show", "nobody"], "nobody"),
    ] {
        let run = chordfield(folder.path(), args);
        assert_eq!(run.status.code(), Some(2), "{args:?}");
        assert!(err(&run).contains(words), "{args:?}: {}", err(&run));
    }
    assert!(!folder.path().join("out").exists());
}

#[test]
fn another_tube_voltage_still_passes_the_scenes_filters() {
    let folder = folder();
    let with = |spectrum: &str| nested_balls(16).replace("energy_keV = 60", spectrum);
    let filters = "filters = [{ material = \"bone_cortical\", thickness_mm = 5 }]";
    std::fs::write(folder.path().join("a.toml"), with(&format!("kvp = 80\n{filters}"))).expect("a scene");
    std::fs::write(folder.path().join("b.toml"), with(&format!("kvp = 120\n{filters}"))).expect("a scene");
    std::fs::write(folder.path().join("bare.toml"), with("kvp = 120")).expect("a scene");
    let p = |scene: &str, more: &[&str]| {
        let out = format!("out-{scene}");
        let args = [&["project", scene, "--write", "p", "-o", &out], more].concat();
        let run = chordfield(folder.path(), &args);
        assert_eq!(run.status.code(), Some(0), "{}", err(&run));
        MetaImage::read(&folder.path().join(out).join("balls-g000-p.mha")).values
    };
    let changed = p("a.toml", &["--kvp", "120"]);
    assert_eq!(changed, p("b.toml", &[]));
    assert_ne!(changed, p("bare.toml", &[]));
}

#[test]
fn a_file_in_the_way_of_the_output_folder_is_named() {
    let folder = folder();
    std::fs::write(folder.path().join("out"), "mine").expect("a file");
    let run = chordfield(folder.path(), &["project", "balls.toml"]);
    assert_eq!(run.status.code(), Some(2));
    assert!(err(&run).contains("cannot create out"), "{}", err(&run));
    assert_eq!(std::fs::read_to_string(folder.path().join("out")).expect("still there"), "mine");
}

#[test]
fn check_tells_ready_from_refused() {
    let folder = folder();
    let tetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    std::fs::write(folder.path().join("good.obj"), tetrahedron).expect("a mesh");
    std::fs::write(folder.path().join("open.obj"), tetrahedron.replace("f 2 3 4\n", "")).expect("a mesh");

    let good = chordfield(folder.path(), &["check", "good.obj", "balls.toml"]);
    assert_eq!(good.status.code(), Some(0));
    assert!(out(&good).contains("good.obj: ready") && out(&good).contains("convex"), "{}", out(&good));
    assert!(out(&good).contains("2 organs that do not cross"), "{}", out(&good));

    let bad = chordfield(folder.path(), &["check", "open.obj", "--json"]);
    assert_eq!(bad.status.code(), Some(2));
    let findings: serde_json::Value = serde_json::from_slice(&bad.stdout).expect("JSON");
    assert_eq!(findings[0]["usable"], false);
    let problem = &findings[0]["problems"][0];
    assert!(problem["problem"].as_str().expect("words").contains("3 edges have a face on one side only"));
    assert!(problem["remedy"].as_str().expect("words").contains("close the holes"));
}

#[test]
fn a_closed_pipe_ends_quietly() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_chordfield"))
        .args(["completions", "bash"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    drop(child.stdout.take());
    let run = child.wait_with_output().expect("it ends");
    assert_eq!((run.status.code(), err(&run).as_str()), (Some(0), ""));
}

#[test]
fn a_run_that_fails_half_way_leaves_no_record_not_even_an_earlier_runs() {
    let folder = folder();
    let project =
        || chordfield(folder.path(), &["project", "balls.toml", "--write", "p", "--gantry", "0,90"]);
    assert_eq!(project().status.code(), Some(0));
    // A folder where the second view's file belongs.
    let in_the_way = folder.path().join("out/balls-g090-p.mha");
    std::fs::remove_file(&in_the_way).expect("removed");
    std::fs::create_dir(&in_the_way).expect("a folder");
    let run = project();
    assert_eq!(run.status.code(), Some(2));
    assert!(err(&run).contains("balls-g090-p.mha"), "{}", err(&run));
    assert_eq!(files(&folder.path().join("out")), ["balls-g000-p.mha", "balls-g090-p.mha"]);
}

#[cfg(target_os = "linux")]
#[test]
fn an_interrupt_exits_130_and_leaves_no_partial_file() {
    let folder = folder();
    let child = Command::new(env!("CARGO_BIN_EXE_chordfield"))
        .current_dir(folder.path())
        .args(["project", "balls.toml", "--gantry", "0..360:1", "--size", "4000x4000", "--threads", "1"])
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let folder_of_output = folder.path().join("out");
    // The folder appears when work begins; by then the signal is handled.
    for _ in 0..500 {
        if folder_of_output.exists() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill");
    assert!(killed.success());
    let run = child.wait_with_output().expect("it ends");
    assert_eq!(run.status.code(), Some(130), "{}", err(&run));
    assert!(err(&run).contains("interrupted"), "{}", err(&run));
    let left = files(&folder_of_output);
    assert!(!left.iter().any(|f| f == "balls.json" || f.starts_with(".tmp")), "{left:?}");
}

#[test]
fn an_exported_phantom_has_the_same_lengths_to_the_last_bit() {
    let folder = folder();
    let run = |args: &[&str]| {
        let run = chordfield(folder.path(), args);
        assert_eq!(run.status.code(), Some(0), "{}", err(&run));
    };
    // A folder of the phantom's name does not hide it.
    std::fs::create_dir(folder.path().join("calibration")).expect("a folder");
    run(&["phantom", "export", "calibration", "exported"]);
    for (scene, to) in [("calibration", "a"), ("exported/calibration.toml", "b")] {
        run(&["project", scene, "--write", "lengths", "--size", "50x50", "-o", to]);
    }
    for organ in ["sphere", "box", "tetrahedron", "cylinder"] {
        let read = |run: &str| {
            MetaImage::read(&folder.path().join(format!("{run}/calibration-g000-lengths/{organ}.mha"))).values
        };
        assert!(read("a").iter().any(|&length| length > 0.0));
        assert_eq!(read("a"), read("b"), "{organ}");
    }
    let shown = chordfield(folder.path(), &["phantom", "list"]);
    assert!(out(&shown).lines().count() >= 4 && out(&shown).contains("adult-skeleton"));
}

/// A scene that takes many seconds to load: balls of very many faces, each crossing all others.
#[cfg(target_os = "linux")]
fn slow_scene() -> String {
    let ball = |name: &str, x: f64| {
        format!(
            "[[organ]]\nname = \"{name}\"\nmaterial = \"water\"\n\
             shape = {{ kind = \"ellipsoid\", half_axes_mm = [50, 50, 50], faces = 100000, move_mm = [{x:?}, 0, 0] }}\n"
        )
    };
    (0..12).map(|i| ball(&format!("ball {i}"), f64::from(i))).collect()
}

/// Whether the process catches SIGINT, by the mask that the kernel shows.
#[cfg(target_os = "linux")]
fn catches_interrupts(process: u32) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).is_some_and(|mask| mask & 0b10 != 0)
}

#[cfg(target_os = "linux")]
#[test]
fn interrupting_a_run_that_still_loads_its_scene_stops_it_at_once() {
    let folder = folder();
    std::fs::write(folder.path().join("slow.toml"), slow_scene()).expect("a scene");
    for command in ["project", "check"] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_chordfield"))
            .current_dir(folder.path())
            .args([command, "slow.toml"])
            .stdin(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the program starts");
        while !catches_interrupts(child.id()) && child.try_wait().expect("a status").is_none() {
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
        assert!(kill.expect("kill runs").success());
        assert_eq!(child.wait().expect("an end").code(), Some(130), "{command}");
    }
}

#[cfg(unix)]
#[test]
fn a_named_pipe_is_refused_instead_of_waited_for() {
    let folder = folder();
    let pipe = folder.path().join("never.toml");
    assert!(Command::new("mkfifo").arg(&pipe).status().expect("mkfifo runs").success());
    let run = chordfield(folder.path(), &["project", "never.toml"]);
    assert_eq!(run.status.code(), Some(2));
    assert!(err(&run).contains("never.toml: this is not a regular file"), "{}", err(&run));
}
