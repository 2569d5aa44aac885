//! `--save-trees` and `--load-trees` as a user meets them.

mod common;

use std::process::Output;

use common::run::chordfield;

fn words(run: &Output) -> String {
    // Lines are broken where they would be too long.
    String::from_utf8_lossy(&run.stderr)
        .split_whitespace()
        .filter(|word| *word != "│")
        .collect::<Vec<_>>()
        .join(" ")
}

const SCENE: &str = r#"
    beam = { detector = { size_mm = [150, 150], pixels = [40, 40] } }
    spectrum = { energy_keV = 60 }
    organ = [{ name = "ball", material = "water", density_g_cm3 = 1,
               shape = { kind = "ellipsoid", half_axes_mm = [50, 40, 30], faces = 3000 } }]
"#;

#[test]
fn a_run_that_starts_with_kept_trees_writes_the_same_images_and_grows_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("ball.toml"), SCENE).expect("written");
    let project = |more: &[&str]| {
        let run = chordfield(
            folder.path(),
            &[&["project", "ball.toml", "--write", "lengths", "--json"], more].concat(),
        );
        assert!(run.status.success(), "{}", words(&run));
        serde_json::from_slice::<serde_json::Value>(&run.stdout).expect("JSON")
    };
    let cold = project(&["--save-trees", "ball.trees", "-o", "cold"]);
    assert_eq!(cold["method"], "ritree", "who names a file of trees asks for trees");
    let warm = project(&["--load-trees", "ball.trees", "-o", "warm", "--threads", "1"]);
    let (grown, read) = (&cold["ritree"]["trees"], &warm["ritree"]["trees"]);
    assert!(grown["samples_taken"].as_u64() > Some(0) && grown["loaded_leaves"].is_null());
    assert_eq!((read["samples_taken"].as_u64(), read["left_out_leaves"].as_u64()), (Some(0), Some(0)));
    assert!(read["loaded_leaves"].as_u64() > Some(0) && read["tree_bytes"] == grown["tree_bytes"]);
    let images = |run: &str| -> Vec<Vec<u8>> {
        let mut files: Vec<_> = std::fs::read_dir(folder.path().join(run).join("ball-g000-lengths"))
            .expect("a folder of lengths")
            .map(|entry| entry.expect("an entry").path())
            .collect();
        files.sort();
        files.iter().map(|path| std::fs::read(path).expect("read")).collect()
    };
    assert!(!images("cold").is_empty() && images("cold") == images("warm"));
}

#[test]
fn what_cannot_be_taken_over_is_refused_in_one_sentence_and_nothing_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("ball.toml"), SCENE).expect("written");
    std::fs::write(folder.path().join("other.toml"), SCENE.replace("[50, 40, 30]", "[50, 40, 31]"))
        .expect("written");
    let run = |args: &[&str]| chordfield(folder.path(), args);
    let audit = ["audit", "ball.toml", "--tolerance", "0.5mm"];
    let saved = run(&[&audit[..], &["--save-trees", "ball.trees"]].concat());
    assert!(saved.status.success(), "{}", words(&saved));
    assert!(run(&[&audit[..], &["--load-trees", "ball.trees"]].concat()).status.success());
    let mut bytes = std::fs::read(folder.path().join("ball.trees")).expect("read");
    *bytes.last_mut().expect("bytes") ^= 1;
    std::fs::write(folder.path().join("bad.trees"), &bytes).expect("written");
    std::fs::write(folder.path().join("cut.trees"), &bytes[..bytes.len() / 2]).expect("written");
    for (args, refusal) in [
        (&["audit", "ball.toml", "--load-trees", "bad.trees"][..], "bad.trees: is damaged: its checksum"),
        (&["audit", "ball.toml", "--load-trees", "cut.trees"], "cut.trees: says that it is"),
        (&["audit", "ball.toml", "--load-trees", "ball.toml"], "ball.toml: is not a file of trees"),
        (&["audit", "ball.toml", "--load-trees", "none.trees"], "cannot read none.trees"),
        (&["audit", "other.toml", "--load-trees", "ball.trees"], "other bodies"),
        (
            &["audit", "ball.toml", "--tolerance", "1mm", "--load-trees", "ball.trees"],
            "asks for --tolerance 1mm",
        ),
        (
            &["project", "ball.toml", "-o", "out", "--load-trees", "ball.trees"],
            "without the places of chords",
        ),
        (&["audit", "ball.toml", "--method", "walk", "--save-trees", "x"], "--method walk makes no trees"),
        (
            &["project", "ball.toml", "-o", "out", "--save-trees", "ball.toml"],
            "ball.toml: is there and holds no trees",
        ),
    ] {
        let run = run(args);
        assert_eq!(run.status.code(), Some(2), "{args:?}");
        let words = words(&run);
        assert!(words.contains(refusal), "{args:?}: {words}");
        assert!(!folder.path().join("out").exists() && !folder.path().join("x").exists());
        assert_eq!(std::fs::read_to_string(folder.path().join("ball.toml")).expect("read"), SCENE);
    }
    // Trees may take the place of trees.
    let again = run(&[&audit[..], &["--save-trees", "ball.trees"]].concat());
    assert!(again.status.success(), "{}", words(&again));
}
