//! Audits and pictures as a user meets them: their files, limits and figures.

mod common;

use common::run::{chordfield, err, files, folder, out, summary};

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
        &[&small[..], &["--map", "--compare", "--rounds", "3", "--json", "--samples", "4"]].concat(),
    );
    let record = summary(&run);
    assert!(record["exact"]["mean_rgb_error"].as_f64().expect("an error") < 0.05, "{record}");
    assert_eq!((record["objects"].as_u64(), record["samples"].as_u64()), (Some(3), Some(4)));
    let written = ["random-volumes-map.png", "random-volumes.json", "random-volumes.png"];
    assert_eq!(files(&folder.path().join("out")), written);

    for speed_up in ["first_view", "warm"] {
        let speed_up = &record["exact"][speed_up];
        let range = [0, 1].map(|end| speed_up["range"][end].as_f64().expect("an end of the range"));
        let median = speed_up["speed_up"].as_f64().expect("a speed-up");
        assert!(0.0 < range[0] && range[0] <= median && median <= range[1], "{record}");
    }
    assert_eq!(record["exact"]["rounds"], 3);
    let alone = chordfield(folder.path(), &[&small[..], &["--rounds", "3"]].concat());
    assert_eq!(alone.status.code(), Some(2), "rounds of nothing");

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
