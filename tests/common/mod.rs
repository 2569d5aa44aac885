//! What several test files need: scenes as text, and readers that know nothing of the writers.
#![allow(dead_code)]

pub mod run;

use std::path::Path;

use chordfield::scene::{Folder, Scene, SceneText};
use chordfield::study::Study;

/// The scene of a TOML text.
pub fn scene(toml: &str) -> chordfield::Result<Scene> {
    Scene::build(&SceneText::new("test.toml", toml), &Folder::none())
}

/// Two organs, one in the other, seen by a parallel beam of `pixels`² pixels over 120 mm.
pub fn nested_balls(pixels: u32) -> String {
    format!(
        r##"
name = "balls"
[beam]
kind = "parallel"
detector = {{ size_mm = [120, 120], pixels = [{pixels}, {pixels}] }}
[spectrum]
energy_keV = 60
[[organ]]
name = "outer"
material = "water"
colour = "#ffffff"
extinction_per_mm = 0.02
shape = {{ kind = "ellipsoid", half_axes_mm = [50, 40, 45], faces = 600 }}
[[organ]]
name = "inner"
inside = "outer"
material = "bone_cortical"
colour = "#ff0000"
opacity = 0.5
shape = {{ kind = "ellipsoid", half_axes_mm = [20, 15, 10], faces = 400, move_mm = [10, 5, -8] }}
"##
    )
}

/// A water box of 100 × 200 × 300 mm about the origin, with a bone box on its left, near the front.
pub const BOXES: &str = r##"
name = "boxes"
[spectrum]
energy_keV = 60
[[organ]]
name = "water"
material = "water"
density_g_cm3 = 1.0
shape = { kind = "box", min_mm = [-50, -100, -150], max_mm = [50, 100, 150] }
[[organ]]
name = "bone"
material = "bone_cortical"
density_g_cm3 = 1.92
shape = { kind = "box", min_mm = [20, -90, -20], max_mm = [40, -60, 20] }
"##;

/// A folder with the scene `boxes.toml` and others.
pub fn folder(scenes: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in scenes.iter().chain(&[("boxes.toml", BOXES)]) {
        std::fs::write(folder.path().join(name), text).expect("a file");
    }
    folder
}

/// The study `text`, as if it lay in `folder`.
pub fn study_in(folder: &Path, text: &str, settings: &[&str], zip: bool) -> chordfield::Result<Study> {
    let settings: Vec<String> = settings.iter().map(|s| (*s).into()).collect();
    let file = folder.join("study.toml");
    Study::build(&SceneText::new("study.toml", text), &Folder::of(&file), &settings, zip)
}

/// A MetaImage, read by its specification.
pub struct MetaImage {
    pub header: Vec<(String, String)>,
    pub values: Vec<f32>,
}

impl MetaImage {
    pub fn read(path: &Path) -> Self {
        let bytes = std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let mut header = Vec::new();
        let mut at = 0;
        loop {
            let end = at + bytes[at..].iter().position(|&b| b == b'\n').expect("a header line");
            let line = std::str::from_utf8(&bytes[at..end]).expect("ASCII");
            at = end + 1;
            let (key, value) = line.split_once('=').expect("key = value");
            header.push((key.trim().to_owned(), value.trim().to_owned()));
            // By the specification the data follow this line.
            if key.trim() == "ElementDataFile" {
                break;
            }
        }
        let values =
            bytes[at..].chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        Self { header, values }
    }

    pub fn text(&self, key: &str) -> &str {
        let found = self.header.iter().find(|(k, _)| k == key);
        &found.unwrap_or_else(|| panic!("no {key}")).1
    }

    pub fn numbers(&self, key: &str) -> Vec<f64> {
        self.text(key).split_whitespace().map(|n| n.parse().expect("a number")).collect()
    }
}
