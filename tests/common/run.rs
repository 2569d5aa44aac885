//! Runs of the program, and what they said.
#![allow(dead_code)]

use std::path::Path;
use std::process::{Command, Output, Stdio};

use super::nested_balls;

pub fn chordfield(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_chordfield"))
        .current_dir(folder)
        .args(args)
        .stdin(Stdio::null())
        .output()
        .expect("the program starts")
}

pub fn out(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

pub fn err(output: &Output) -> String {
    // Messages are wrapped to the width of a page.
    let text = String::from_utf8_lossy(&output.stderr).replace(['|', '\n'], " ");
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The run's summary, printed by `--json` and nothing else.
pub fn summary(run: &Output) -> serde_json::Value {
    assert_eq!(run.status.code(), Some(0), "{}", err(run));
    serde_json::from_slice(&run.stdout).expect("only JSON")
}

/// A folder with the scene `balls.toml`, 64 × 64 pixels.
pub fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("balls.toml"), nested_balls(64)).expect("a scene");
    folder
}

pub fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .map(|entries| {
            entries.map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned()).collect()
        })
        .unwrap_or_default();
    names.sort();
    names
}
