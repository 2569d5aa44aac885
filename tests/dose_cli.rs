//! Dose-path studies as a user meets them: what is refused, the shipped studies, runs in parts.

mod common;

use std::path::{Path, PathBuf};
use std::process::Command;

use common::run::chordfield;
use common::{folder, study_in};

#[test]
fn a_list_of_paths_is_not_replaced_by_the_table_of_that_name() {
    const LIST: &str =
        "source_x_mm,source_y_mm,source_z_mm,target_x_mm,target_y_mm,target_z_mm\n0,-900,0,1,90,2\n";
    let study = "scene = \"boxes.toml\"\npaths = { csv = \"paths.csv\" }\n";
    let folder = folder(&[("study.toml", study), ("paths.csv", LIST)]);
    let run = |output: &str| {
        let args = ["dose", "study.toml", "-o", output];
        let program = env!("CARGO_BIN_EXE_chordfield");
        Command::new(program).current_dir(folder.path()).args(args).output().expect("the program runs")
    };
    let (refused, elsewhere) = (run("."), run("out"));
    assert_eq!((refused.status.code(), elsewhere.status.code()), (Some(2), Some(0)));
    let words = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(words.contains("paths.csv: the study reads this file"), "{words}");
    assert_eq!(std::fs::read_to_string(folder.path().join("paths.csv")).expect("read"), LIST);
    assert!(!folder.path().join("dose.json").exists() && folder.path().join("out/paths.csv").exists());
}

#[test]
fn bad_studies_are_refused_with_their_line() {
    let folder = folder(&[]);
    std::fs::write(
        folder.path().join("nan.csv"),
        "source_x_mm,source_y_mm,source_z_mm,target_x_mm,target_y_mm,target_z_mm\n1,2,3,4,5,6\n1,NaN,3,4,5,6\n",
    )
    .expect("a file");
    let point = "[paths]\npoints = [{ at_mm = [0, 0, 0] }]\n";
    for (text, line, words) in [
        (format!("scene = \"giraffe.toml\"\n{point}"), Some(1), "cannot read"),
        (format!("scene = \"../boxes.toml\"\n{point}"), Some(1), "leaves the scene's folder"),
        (format!("{point}[beam]\nsad_mm = 0\n"), Some(4), "not positive"),
        (format!("{point}[beam]\nisocentre = \"bonne\"\n"), Some(4), "no organ `bonne`"),
        (format!("{point}[beam]\nsource_mm = [0, 0, 0]\n"), Some(2), "the point is the source"),
        (
            format!("{point}[beam]\ncontrol_points = [{{ gantry_deg = [0, 1], weight = [1, 2, 3] }}]\n"),
            Some(4),
            "cannot go with",
        ),
        (format!("{point}[beam]\ncontrol_points = [{{ weight = -1 }}]\n"), Some(4), "no weight"),
        (format!("{point}[beam]\ngantry = 3\n"), Some(4), "unknown field"),
        (format!("{point}[spectrum]\nkvp = 70\n"), Some(4), "no embedded spectrum"),
        (format!("{point}[spectrum]\nenergy_keV = 5\n"), Some(4), "outside the attenuation table"),
        (format!("reference_energy_keV = 3e4\n{point}"), Some(1), "outside the attenuation table"),
        (format!("{point}[spectrum]\nresponse = \"counting\"\n"), Some(3), "no photons"),
        (format!("{point}[organ.bonne]\ndensity_g_cm3 = 1\n"), Some(3), "no organ `bonne`"),
        (format!("{point}[organ.bone]\ndensity_g_cm3 = -1\n"), Some(4), "no density"),
        (
            "[paths]\npoints = [{ organ = \"bone\", at_mm = [0, 0, 0] }]\n".into(),
            Some(2),
            "not inside `bone`",
        ),
        ("[paths]\npoints = [{ name = \"nowhere\" }]\n".into(), Some(2), "no place"),
        ("[paths]\nfan = { width_mm = 1, points = 1 }\n".into(), Some(2), "no fan"),
        (
            "[paths]\nfan = { width_mm = 1, points = 3 }\ngrid = { size_mm = [1, 1], points = [1, 1] }\n"
                .into(),
            Some(1),
            "one kind",
        ),
        ("[paths]\nsegments_mm = [[0, 0, 0, 1, 1, 1], [1, 1, 1, 1, 1, 1]]\n".into(), Some(2), "coincide"),
        (
            format!("{point}[[sweep]]\nspectrum.energy_keV = [60, 5]\n"),
            Some(4),
            "outside the attenuation table",
        ),
        (format!("{point}[[sweep]]\nbeam.sad_mm = [1000, \"far\"]\n"), Some(4), "does not serve"),
        (format!("{point}[[sweep]]\nbeam.gantry_deg = [0, 0]\n"), Some(4), "twice"),
        (format!("{point}[[sweep]]\nbeam.gantry_deg = \"0..90\"\n"), Some(4), "no step"),
        ("[paths]\ncsv = \"nan.csv\"\n".into(), None, "nan.csv:3"),
    ] {
        // Lines are those of the text; a small scene is quicker to build.
        let settings: &[&str] = if text.starts_with("scene") { &[] } else { &["scene=boxes.toml"] };
        let error = study_in(folder.path(), &text, settings, false).expect_err(&text);
        let told = error.to_string();
        assert!(told.contains(words), "{text}: {told}");
        assert_eq!(error.line(), line, "{text}: {told}");
    }
    // An arc's own angles would silently win over a sweep of the beam's; without control points it counts.
    let arc = format!("{point}[beam]\ncontrol_points = [{{ gantry_deg = \"0..90:30\" }}]\n");
    let settings = ["scene=boxes.toml", "beam.gantry=0..360:90", "beam.control_points=[]"];
    let error = study_in(folder.path(), &arc, &settings[..2], false).expect_err("an arc").to_string();
    assert!(error.contains("--set beam.gantry=0..360:90") && error.contains("no effect"), "{error}");
    assert_eq!(study_in(folder.path(), &arc, &settings, false).expect("a sweep").fields().len(), 4);
    let error = study_in(folder.path(), point, &["scene=boxes.toml", "beam.sad=-3"], false)
        .expect_err("a setting")
        .to_string();
    assert!(error.contains("--set beam.sad=-3") && error.contains("not positive"), "{error}");
}

fn studies() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("phantoms/studies")
}

fn lines(path: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    text.lines().map(String::from).collect()
}

#[test]
fn shipped_studies_run_and_say_what_they_are() {
    let out = tempfile::tempdir().expect("a folder");
    for name in ["abdomen-ap-pa-lateral", "liver-arc", "head-cross-fire", "lung-wel-fan"] {
        let file = studies().join(format!("{name}.toml"));
        let run =
            chordfield(out.path(), &["dose", &file.to_string_lossy(), "-o", name, "--write", "paths,organs"]);
        assert_eq!(run.status.code(), Some(0), "{name}: {}", String::from_utf8_lossy(&run.stderr));
        let told = String::from_utf8_lossy(&run.stdout);
        assert!(told.contains("no scatter, not for clinical use"), "{told}");
        let record = std::fs::read(out.path().join(name).join("dose.json")).expect("a record");
        let record: serde_json::Value = serde_json::from_slice(&record).expect("JSON");
        assert_eq!(record["notice"], "primary radiation only: no scatter, not for clinical use");
        let hash = record["study"]["inputs"][0]["sha256"].as_str().expect("a hash");
        assert_eq!(hash.len(), 64);
        let paths = record["paths"].as_u64().expect("a number");
        assert_eq!(lines(&out.path().join(name).join("paths.csv")).len() as u64, paths + 1, "{name}");
        assert!(record["errors"][0]["length_mm"]["max"].as_f64() < Some(1e-8), "{name}");
    }
}

#[test]
fn a_split_run_joins_to_the_same_files_and_is_resumed_where_it_stopped() {
    let out = tempfile::tempdir().expect("a folder");
    let file = studies().join("liver-arc.toml").to_string_lossy().into_owned();
    let base =
        ["dose", &file, "--set", "beam.control_points=[{gantry_deg=[0,40]}]", "--set", "spectrum.kvp=80,100"];
    let run = |more: &[&str]| {
        let run = chordfield(out.path(), &[&base[..], more].concat());
        assert_eq!(run.status.code(), Some(0), "{}", String::from_utf8_lossy(&run.stderr));
        String::from_utf8_lossy(&run.stdout).into_owned()
    };
    let plan = run(&["--dry-run"]);
    assert!(plan.contains("paths in 4 fields of 2 cases"), "{plan}");
    assert!(!out.path().join("out").exists());
    run(&["-o", "whole", "--format", "csv,json"]);
    for part in ["1/3", "2/3", "3/3"] {
        run(&["-o", "parts", "--format", "csv,json", "--shard", part, "--threads", "1"]);
    }
    assert!(run(&["-o", "parts", "--shard", "2/3", "--resume"]).contains("there already"));
    run(&["-o", "parts", "--format", "csv,json", "--join"]);
    for table in [
        "paths",
        "path_organs",
        "path_segments",
        "fields",
        "field_organs",
        "cases",
        "case_organs",
        "histograms",
    ] {
        for ending in ["csv", "jsonl"] {
            let [whole, joined] = ["whole", "parts"].map(|f| {
                std::fs::read(out.path().join(f).join(format!("{table}.{ending}"))).expect("a table")
            });
            assert!(whole == joined, "{table}.{ending} differs");
        }
    }
    // Rows of the path table: no field is empty but those that may be, and JSON lines say the same.
    let rows = lines(&out.path().join("whole/paths.csv"));
    let json = lines(&out.path().join("whole/paths.jsonl"));
    assert_eq!(rows.len(), json.len() + 1);
    let first: serde_json::Value = serde_json::from_str(&json[0]).expect("JSON");
    let length = rows[0].split(',').position(|head| head == "length_mm").expect("a column");
    assert_eq!(rows[1].split(',').nth(length), Some(first["length_mm"].to_string().trim_end_matches(".0")));
    let foreign = chordfield(out.path(), &["dose", &file, "-o", "parts", "--join"]);
    assert_eq!(foreign.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&foreign.stderr).contains("another study"));
}
