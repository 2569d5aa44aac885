//! The methods as a user meets them: engines by name, what `auto` chooses, trees and what they report.

mod common;

use common::run::{chordfield, err, folder, summary};

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
