//! The program as a user meets it: commands, files, exit codes.

mod common;

use std::path::Path;
use std::process::{Command, Output, Stdio};

use common::{MetaImage, nested_balls};

fn chordfield(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_chordfield"))
        .current_dir(folder)
        .args(args)
        .stdin(Stdio::null())
        .output()
        .expect("the program starts")
}

fn out(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn err(output: &Output) -> String {
    // Messages are wrapped to the width of a page.
    let text = String::from_utf8_lossy(&output.stderr).replace(['|', '\n'], " ");
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The run's summary, printed by `--json` and nothing else.
fn summary(run: &Output) -> serde_json::Value {
    assert_eq!(run.status.code(), Some(0), "{}", err(run));
    serde_json::from_slice(&run.stdout).expect("only JSON")
}

/// A folder with the scene `balls.toml`, 64 × 64 pixels.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("balls.toml"), nested_balls(64)).expect("a scene");
    folder
}

fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .map(|entries| {
            entries.map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned()).collect()
        })
        .unwrap_or_default();
    names.sort();
    names
}

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

#[test]
fn the_engine_named_traces_every_organ_and_the_summary_says_so() {
    let folder = folder();
    for engine in ["clip", "walk", "raster", "bvh"] {
        let args = ["project", "balls.toml", "--method", engine, "--json", "--write", "p"];
        let summary = summary(&chordfield(folder.path(), &args));
        assert_eq!(summary["method"], engine);
        // Both balls, in one view.
        assert_eq!((&summary["organs"], &summary["views"]), (&2.into(), &1.into()));
        assert_eq!(summary["engines"], serde_json::json!({ engine: 2 }));
    }
}

#[test]
fn auto_puts_organs_in_trees_only_where_they_are_quicker_and_says_so() {
    let folder = folder();
    let run = |more: &[&str]| {
        let args = [&["project", "balls.toml", "--json", "--write", "lengths", "-o", "a"], more].concat();
        summary(&chordfield(folder.path(), &args))
    };
    let few_faces = run(&[]);
    assert_eq!((&few_faces["method"], &few_faces["ritree"]["trees"]["trees"]), (&"auto".into(), &0.into()));
    assert_eq!(few_faces["organ_rays_interpolated"], 0);
    let words = few_faces["choice"].as_str().expect("words");
    assert!(words.contains("no organ in an RI-tree") && words.contains("raster 2"), "{words}");
    let choices = few_faces["choices"].as_array().expect("a choice for each organ");
    assert_eq!(choices.len(), 2);
    for choice in choices {
        let [exact, tree] = ["exact_s", "tree_s"].map(|key| choice[key].as_f64().expect("an estimate"));
        assert!(choice["chosen"] == "raster" && 0.0 < exact && exact <= tree, "{choice}");
    }
    let trees = run(&["--tree-planes", "500", "--tolerance", "3mm"]);
    assert_eq!(trees["ritree"]["trees"]["trees"], 1, "the outer ball has 600 faces, the inner one 400");
    assert!(trees["organ_rays_interpolated"].as_u64().is_some_and(|n| n > 0));
    let paper = run(&["--distance-threshold", "0.1"]);
    assert_eq!((&paper["method"], &paper["ritree"]["trees"]["trees"]), (&"ritree".into(), &2.into()));
    assert!(paper["choice"].is_null());
}

#[test]
fn ritrees_report_what_they_did_and_draw_their_map() {
    let folder = folder();
    let args = [
        "project",
        "balls.toml",
        "--method",
        "ritree",
        "--max-depth",
        "16",
        "--map",
        "--json",
        "--write",
        "p",
    ];
    let run = chordfield(folder.path(), &args);
    let summary = summary(&run);
    assert_eq!(summary["method"], "ritree");
    let trees = &summary["ritree"];
    assert_eq!(trees["settings"]["parameters"]["max_depth"], 16);
    for (group, key) in [
        ("queries", "queries"),
        ("queries", "interpolated"),
        ("trees", "samples_taken"),
        ("trees", "tree_bytes"),
        ("sampled_error_mm", "compared"),
    ] {
        assert!(trees[group][key].as_u64().is_some_and(|n| n > 0), "{group}.{key}: {trees}");
    }
    let map = image::open(folder.path().join("out/balls-g000-map.png")).expect("a map").to_rgb8();
    let count = |grey: u8| map.pixels().filter(|p| p.0 == [grey; 3]).count();
    assert!(count(255) > 0 && count(96) > 0 && count(0) > 0, "traced, interpolated and empty pixels");
    for bad in [["--distance-threshold", "nan"], ["--prune-keep", "2"], ["--cache-mb", "-1"]] {
        let run = chordfield(folder.path(), &["project", "balls.toml", "--method", "ritree", bad[0], bad[1]]);
        assert_eq!(run.status.code(), Some(2), "{bad:?}");
    }
}

#[test]
fn a_tolerance_in_millimetres_is_kept_to_and_thresholds_are_of_the_papers_interpolation() {
    let folder = folder();
    let run = |more: &[&str]| {
        let args = ["project", "balls.toml", "--json", "--write", "lengths", "--size", "200x200"];
        chordfield(folder.path(), &[&args[..], more].concat())
    };
    for tolerance in ["2mm", "2"] {
        let trees = &summary(&run(&["--tolerance", tolerance]))["ritree"];
        assert_eq!(trees["settings"]["interpolation"], "squared-chord");
        assert_eq!(trees["settings"]["tolerance_mm"], 2.0);
        let error = |key: &str| trees["sampled_error_mm"][key].as_f64().expect("a figure");
        assert!(error("p999") <= 2.0 && error("max") <= 10.0, "{trees}");
    }
    let paper = summary(&run(&["--interpolation", "quadrilinear"]));
    assert_eq!(paper["ritree"]["settings"]["interpolation"], "quadrilinear");
    for bad in [
        ["--tolerance", "1mm", "--max-depth", "20"],
        ["--tolerance", "1mm", "--interpolation", "quadrilinear"],
        ["--distance-threshold", "0.1", "--interpolation", "squared-chord"],
        ["--tolerance", "0mm", "--interpolation", "squared-chord"],
        ["--tolerance", "1cm", "--interpolation", "squared-chord"],
    ] {
        assert_eq!(run(&bad).status.code(), Some(2), "{bad:?}");
    }
}

/// What a projection may hold beside cache, images and meshes: the program itself, spectra and tables, the stacks and
/// scratch of its threads.
#[cfg(target_os = "linux")]
const MEMORY_SLACK: f64 = 40e6;

#[cfg(target_os = "linux")]
#[test]
fn peak_memory_stays_under_cache_plus_images_plus_meshes_plus_slack() {
    let folder = folder();
    let args = [
        "project",
        "balls.toml",
        "--method",
        "ritree",
        "--cache-mb",
        "4",
        "--size",
        "512x512",
        "--gantry",
        "0..360:60",
        "--json",
        "--threads",
        "2",
        "--write",
        "p",
    ];
    let run = chordfield(folder.path(), &args);
    assert_eq!(run.status.code(), Some(0), "{}", err(&run));
    let summary = summary(&run);
    let peak = summary["peak_bytes"].as_f64().expect("Linux tells");
    // p and T of a view by tiles and once more as an image; a thousand faces of some 500 bytes.
    let (images, meshes) = (3.0 * 512.0 * 512.0 * 4.0, 1000.0 * 500.0);
    assert!(peak < 4e6 + images + meshes + MEMORY_SLACK, "{} MB", peak / 1e6);
    assert!(summary["ritree"]["trees"]["tree_bytes"].as_f64().expect("bytes") <= 4e6);
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

#[test]
fn an_audit_writes_a_page_that_needs_nothing_else_and_its_figures_and_is_repeatable() {
    let folder = folder();
    let args = ["audit", "balls.toml", "--method", "ritree", "--gantry", "0,90", "-o", "report", "--json"];
    let report = summary(&chordfield(folder.path(), &args));
    let names = ["audit.html", "audit.json", "histogram.csv", "organs.csv", "sections.csv", "worst.csv"];
    assert_eq!(files(&folder.path().join("report")), names);
    let read =
        |name: &str| std::fs::read_to_string(folder.path().join("report").join(name)).expect("a text file");
    assert_eq!(serde_json::from_str::<serde_json::Value>(&read("audit.json")).expect("JSON"), report);
    assert_eq!((&report["method"], &report["against"]), (&"ritree".into(), &"reference".into()));
    assert_eq!(report["rays"]["count"], 2 * 64 * 64);
    assert_eq!(report["organs"][1]["organ"], "inner");
    assert!(report["whole"]["interpolated_interior_mm"]["compared"].as_u64().expect("a count") > 1000);
    let page = read("audit.html");
    assert!(page.contains("<svg") && page.contains("data:image/png;base64,"), "plots and pictures");
    assert!(!page.contains("<script") && !page.contains("http"), "nothing is fetched or run");
    // Heads and a row each for three quantities' kinds and parts, for all organs and for two.
    assert_eq!(read("organs.csv").lines().count(), 1 + 3 * 12);
    let again = chordfield(folder.path(), &[&args[..], &["--threads", "1"]].concat());
    let again = summary(&again);
    assert_eq!(again["whole"], report["whole"]);
}

#[test]
fn a_broken_limit_exits_1_and_names_the_worst_ray_which_its_command_finds_again() {
    let folder = folder();
    for rays in [&["--gantry", "30"][..], &["--rays", "2e4", "--seed", "7"]] {
        let args =
            [&["audit", "balls.toml", "--method", "ritree", "--json", "--limit-mm", "0.001"], rays].concat();
        let run = chordfield(folder.path(), &args);
        assert_eq!(run.status.code(), Some(1), "{}", err(&run));
        let report: serde_json::Value = serde_json::from_slice(&run.stdout).expect("only JSON");
        let worst = &report["worst"][0];
        let said = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(said.lines().count(), 1, "{said}");
        let command = worst["reproduce"].as_str().expect("a command");
        assert!(said.contains(command) && said.contains("limit of 0.001 mm"), "{said}");

        let words: Vec<&str> = command.split(' ').collect();
        assert_eq!(words[0], "chordfield");
        let found = summary(&chordfield(folder.path(), &[&words[1..], &["--json"]].concat()));
        for key in ["method_mm", "reference_mm", "cell_depth"] {
            assert_eq!(found[key], worst[key], "{key} of {command}");
        }
        let text = out(&chordfield(folder.path(), &words[1..]));
        assert!(text.contains(&worst["method_mm"].to_string()), "{text}");
        assert!(text.contains(&worst["reference_mm"].to_string()), "{text}");
    }
    assert_eq!(files(folder.path()), ["balls.toml"], "without a folder nothing is written");

    let exact = ["audit", "balls.toml", "--method", "exact", "--limit-mm", "1e-9"];
    let run = chordfield(folder.path(), &exact);
    assert_eq!(run.status.code(), Some(0), "{}", err(&run));
    for kind in ["mesh to closed form", "method to closed form"] {
        assert!(out(&run).contains(kind), "{}", out(&run));
    }
    for (bad, words) in [
        (&["--rays", "0"][..], "--rays"),
        (&["--rays", "100", "--method", "raster"], "raster engine"),
        (&["--tolerance-mm", "nan"], "tolerance"),
        (&["--ray", "0,0,0,0,0,0", "--organ", "inner"], "no direction"),
        (&["--pixel", "0,64,0", "--organ", "inner"], "no such pixel"),
        (&["--pixel", "0,1,1", "--organ", "nobody"], "no such organ"),
    ] {
        let run = chordfield(folder.path(), &[&["audit", "balls.toml"], bad].concat());
        assert_eq!(run.status.code(), Some(2), "{bad:?}");
        assert!(err(&run).contains(words), "{bad:?}: {}", err(&run));
    }
}

#[test]
fn tracing_writes_a_picture_its_map_and_a_record_that_tells_the_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let small = ["trace", "random-volumes", "--count", "3", "--seed", "2", "--size", "40x30", "-o", "out"];
    let run = chordfield(
        folder.path(),
        &[&small[..], &["--map", "--compare", "--json", "--samples", "4"]].concat(),
    );
    let record = summary(&run);
    assert!(record["exact"]["mean_rgb_error"].as_f64().expect("an error") < 0.05, "{record}");
    assert_eq!((record["objects"].as_u64(), record["samples"].as_u64()), (Some(3), Some(4)));
    let written = ["random-volumes-map.png", "random-volumes.json", "random-volumes.png"];
    assert_eq!(files(&folder.path().join("out")), written);

    for speed_up in ["first_view", "warm"] {
        assert!(record["exact"][speed_up]["speed_up"].as_f64().expect("a speed-up") > 0.0, "{record}");
    }

    let looked_through = [&small[..], &["--application", "absorption", "--compare", "--json"]].concat();
    let record = summary(&chordfield(folder.path(), &looked_through));
    assert_eq!(record["application"], "absorption");
    assert!(record["exact"]["mean_length_error"].as_f64().expect("an error") < 0.1, "{record}");
    assert!(folder.path().join("out/random-volumes-absorption.png").is_file());
    let open_bodies = ["trace", "tomatoes", "--application", "absorption"];
    assert!(err(&chordfield(folder.path(), &open_bodies)).contains("closed convex"));

    for (bad, words) in [
        (&["--samples", "5"][..], "--samples"),
        (&["--method", "walk"], "ritree"),
        (&["--size", "0x5"], "--size"),
        (&["--count", "0"], "--count"),
    ] {
        let run = chordfield(folder.path(), &[&["trace", "random-volumes"], bad].concat());
        assert_eq!(run.status.code(), Some(2), "{bad:?}");
        assert!(err(&run).contains(words), "{bad:?}: {}", err(&run));
    }
    let run = chordfield(folder.path(), &["trace", "nothing-of-that-name"]);
    assert!(err(&run).contains("bezier-surface"), "{}", err(&run));
}
