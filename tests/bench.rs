//! Benchmarks as a user runs them: files, figures, interruption.

mod common;

use std::path::Path;
use std::process::{Command, Output, Stdio};

use common::nested_balls;

fn chordfield(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_chordfield"));
    command.current_dir(folder).args(args).stdin(Stdio::null());
    command
}

fn json(path: &Path) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(path).expect("a report")).expect("JSON")
}

fn run(folder: &Path, args: &[&str]) -> Output {
    chordfield(folder, args).output().expect("the program starts")
}

#[test]
fn a_curve_is_a_page_plots_and_figures_with_a_recommendation() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("balls.toml"), nested_balls(64)).expect("a scene");
    let args = ["bench", "curve", "balls.toml", "--sizes", "32x32,16x16", "--rounds", "3", "-o", "b"];
    let output = run(folder.path(), &args);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let table = String::from_utf8_lossy(&output.stdout);
    assert!(table.contains("--method raster") && table.contains("16×16"), "{table}");

    let report = json(&folder.path().join("b/curve.json"));
    assert_eq!(report["command"], "chordfield bench curve balls.toml --sizes 32x32,16x16 --rounds 3 -o b");
    assert_eq!((&report["complete"], &report["organs"]), (&true.into(), &2.into()));
    let rows = report["rows"].as_array().expect("rows");
    assert_eq!(rows.len(), 2 * 15, "fifteen methods and settings at two sizes");
    assert_eq!(rows[0]["pixels"], serde_json::json!([16, 16]), "the smallest first");
    assert!(rows.iter().all(|row| row["cold"]["seconds"].as_f64().is_some_and(|s| s > 0.0)));
    assert!(rows.iter().any(|row| row["on_cold_front"] == true && row["exact"] == true));
    assert!(report["recommendation"].as_str().is_some_and(|words| words.contains("32×32")));

    let csv = std::fs::read_to_string(folder.path().join("b/curve.csv")).expect("a table");
    let columns: Vec<usize> = csv.lines().map(|line| line.split(',').count()).collect();
    assert_eq!(columns, vec![columns[0]; 31], "a head and thirty rows of as many fields");
    let page = std::fs::read_to_string(folder.path().join("b/curve.html")).expect("a page");
    assert!(page.contains("<svg") && !page.contains("NaN") && !page.contains("src=\"http"));
    let plot = std::fs::read_to_string(folder.path().join("b/curve-warm.svg")).expect("a plot");
    assert!(plot.starts_with("<svg xmlns"));
}

#[test]
fn the_papers_figures_are_a_page_plots_and_tables_beside_its_own() {
    let folder = tempfile::tempdir().expect("a folder");
    let args = ["bench", "paper", "--quick", "--scale", "0.004", "--scenes", "tomatoes,adult", "-o", "p"];
    let output = run(folder.path(), &args);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let table = String::from_utf8_lossy(&output.stdout);
    assert!(table.contains("Tomatoes: distance threshold (Table 1)") && table.contains("(2.650)"), "{table}");

    let report = json(&folder.path().join("p/paper.json"));
    assert_eq!((&report["complete"], &report["quick"]), (&true.into(), &true.into()));
    let sweeps = report["sweeps"].as_array().expect("sweeps");
    assert_eq!(sweeps.len(), 2, "thresholds of the tomatoes and of the phantom");
    let rows = sweeps[0]["rows"].as_array().expect("rows");
    assert!(rows.iter().all(|row| row["flop_speed_up"].as_f64().is_some_and(|s| s > 0.0)), "{rows:?}");
    assert_eq!(rows[0]["published"]["cpu_speed_up"], 1.89);
    assert!(sweeps[1]["verdict"]["sentence"].as_str().is_some_and(|words| words.contains("direction is")));

    let csv = std::fs::read_to_string(folder.path().join("p/paper.csv")).expect("a table");
    let columns: Vec<usize> = csv.lines().map(|line| line.split(',').count()).collect();
    assert!(columns.len() == 1 + 1 + 2 && columns.iter().all(|n| *n == columns[0]), "{columns:?}");
    let page = std::fs::read_to_string(folder.path().join("p/paper.html")).expect("a page");
    assert!(page.contains("<svg") && !page.contains("NaN") && !page.contains("src=\"http"));
    let plot = folder.path().join("p/paper-adult-distance-speed-up.svg");
    assert!(std::fs::read_to_string(plot).expect("a plot").starts_with("<svg xmlns"));
}

#[test]
fn what_cannot_be_measured_is_refused_and_nothing_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    for args in [
        &["bench", "curve", "missing.toml", "-o", "b"][..],
        &["bench", "curve", "calibration", "--limit-s", "nan", "-o", "b"],
        &["bench", "curve", "calibration", "--sizes", "0x4", "-o", "b"],
        &["bench", "paper", "--scale", "0", "-o", "b"],
        &["bench", "paper", "--rounds", "1", "-o", "b"],
        &["bench", "paper", "--scenes", "teapot", "-o", "b"],
    ] {
        assert_eq!(run(folder.path(), args).status.code(), Some(2), "{args:?}");
        assert!(!folder.path().join("b").exists(), "{args:?}");
    }
}

#[test]
fn one_study_of_scale_may_be_run_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let args = ["bench", "scale", "--studies", "cache", "--quick", "--json"];
    let output = run(folder.path(), &args);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let studies = report["studies"].as_array().expect("studies");
    assert_eq!((studies.len(), &studies[0]["name"]), (1, &"cache, kB".into()));
    assert_eq!(run(folder.path(), &["bench", "scale", "--studies", "giraffes"]).status.code(), Some(2));
}

#[cfg(unix)]
#[test]
fn an_interrupted_study_leaves_a_whole_report_that_says_so() {
    for name in ["scale", "paper"] {
        let folder = tempfile::tempdir().expect("a folder");
        let mut child = chordfield(folder.path(), &["bench", name, "-q", "-o", "s"])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the program starts");
        // The folder appears when work begins; by then the signal is handled.
        while !folder.path().join("s").exists() && child.try_wait().expect("a status").is_none() {
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
        let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill");
        assert!(killed.success());
        assert_eq!(child.wait().expect("an end").code(), Some(130));
        let report = json(&folder.path().join(format!("s/{name}.json")));
        assert_eq!(report["complete"], false);
        let page = std::fs::read_to_string(folder.path().join(format!("s/{name}.html"))).expect("a page");
        assert!(page.contains("Interrupted") && page.ends_with("</html>\n"));
    }
}
