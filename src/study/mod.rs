//! Studies: from a file under version control to numbered paths through a scene.
//!
//! ```text
//! study.toml ─► schema ─► sweep ─► cases: scene, photons, densities ─► fields: one control point each ─► paths by number
//! ```
//!
//! A *case* is one combination of the swept parameters' values. Each of its control points is a *field*: a source, and the
//! paths that lead from it. Paths are numbered through all fields, and made when they are asked for: a study of 10⁸ paths
//! is as small as its fields.

mod case;
mod list;
mod paths;
mod plane;
mod schema;
mod sweep;

use std::path::Path;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use toml::{Table, Value};

use crate::error::{Error, Result};
use crate::scene::regular_file::{self, Kind};
use crate::scene::text::Step;
use crate::scene::{Folder, Scene, SceneText};

pub use case::{Case, Field};
pub use paths::{Machine, Pencil, Shot};

use case::Builder;
use schema::StudySpec;
use sweep::Sweep;

/// More cases, or fields, than this are surely mistyped; the report keeps some ten kilobytes of each.
pub const MAX_FIELDS: usize = 50_000;

/// A study file longer than 16 MiB is no study file.
const STUDY_FILE: Kind = Kind {
    name: "study file",
    max_bytes: 16 << 20,
    if_too_large: "give a study file in TOML; long lists of paths belong in a CSV file beside it",
};

/// A file that a study depends on, and its SHA-256.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Input {
    /// `study`, `scene`, `paths` or `spectrum`.
    pub role: String,
    /// Its name, or the phantom's.
    pub file: String,
    /// In hexadecimal.
    pub sha256: String,
}

impl Input {
    fn new(role: &str, file: &str, bytes: &[u8]) -> Self {
        let digest = Sha256::digest(bytes);
        let sha256 = digest.iter().map(|byte| format!("{byte:02x}")).collect();
        Self { role: role.into(), file: file.into(), sha256 }
    }
}

/// A study, all of it checked.
#[derive(Debug)]
pub struct Study {
    name: String,
    description: String,
    settings: Vec<String>,
    parameters: Vec<String>,
    inputs: Vec<Input>,
    scenes: Vec<Scene>,
    cases: Vec<Case>,
    fields: Vec<Field>,
}

impl Study {
    /// The study of a file, with `settings` (`key=values`) in place of what it says; with `zip`, they go together.
    ///
    /// # Errors
    /// The first thing that is wrong, with its place in the file or its setting.
    pub fn load(path: &Path, settings: &[String], zip: bool) -> Result<Self> {
        let text = regular_file::read_text(path, STUDY_FILE)?;
        Self::build(&SceneText::new(path.display().to_string(), text), &Folder::of(path), settings, zip)
    }

    /// The study that `text` describes, with files from `folder`.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn build(text: &SceneText, folder: &Folder, settings: &[String], zip: bool) -> Result<Self> {
        let spec: StudySpec = text.parse()?;
        let document: Table = text.parse()?;
        let sweep = Sweep::new(text, &spec.sweep, settings, zip)?;
        let count = sweep.cases().filter(|cases| *cases <= MAX_FIELDS).ok_or_else(|| {
            let problem = format!("the sweeps make more than {MAX_FIELDS} cases");
            text.error(&[Step::Key("sweep")], problem, "here", "use coarser steps or shorter lists")
        })?;
        let mut builder = Builder::new(text, folder, &sweep);
        for index in 0..count {
            let spec = case_spec(text, &document, &sweep, index)?;
            builder.add(&spec, sweep.values(index))?;
        }
        let Builder { scenes, cases, fields, mut inputs, .. } = builder;
        inputs.insert(0, Input::new("study", text.name(), text.text().as_bytes()));
        Ok(Self {
            name: spec.name.unwrap_or_else(|| stem(text.name())),
            description: spec.description,
            settings: settings.to_vec(),
            parameters: sweep.keys(),
            inputs,
            scenes: scenes.into_iter().map(|(_, scene)| scene).collect(),
            cases,
            fields,
        })
    }

    /// What it is called.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What it is for.
    pub fn description(&self) -> &str {
        &self.description
    }

    /// What took the place of what the file says: `key=values`.
    pub fn settings(&self) -> &[String] {
        &self.settings
    }

    /// The names of the swept parameters.
    pub fn parameters(&self) -> &[String] {
        &self.parameters
    }

    /// The files it depends on, itself first; mesh files of scenes are not among them.
    pub fn inputs(&self) -> &[Input] {
        &self.inputs
    }

    /// The scenes that its cases use.
    pub fn scenes(&self) -> &[Scene] {
        &self.scenes
    }

    /// Its cases, in the sweeps' order: the last table turns fastest.
    pub fn cases(&self) -> &[Case] {
        &self.cases
    }

    /// The fields of all cases, in order.
    pub fn fields(&self) -> &[Field] {
        &self.fields
    }

    /// How many paths there are.
    pub fn paths(&self) -> u64 {
        self.fields.last().map_or(0, |field| field.first_path() + field.paths())
    }

    /// A field's case.
    pub fn case_of(&self, field: &Field) -> &Case {
        &self.cases[field.case()]
    }

    /// A case's scene.
    pub fn scene_of(&self, case: &Case) -> &Scene {
        &self.scenes[case.scene()]
    }

    /// The path of a field, by its number there. The number must be less than [`Field::paths`].
    pub fn shot(&self, field: &Field, index: u64) -> Shot {
        self.case_of(field).paths.shot(field.machine(), index)
    }
}

/// The document of a case, as typed values.
fn case_spec(text: &SceneText, document: &Table, sweep: &Sweep, case: usize) -> Result<StudySpec> {
    let mut with_values = document.clone();
    sweep.apply(case, &mut with_values);
    with_values.try_into().map_err(|error: toml::de::Error| {
        let problem = error.message().trim_end().to_owned();
        let remedy = "give values of the kind that the study's file takes here";
        // One of the values does not serve; each is tried on its own.
        let culprit = sweep.keys().into_iter().zip(sweep.values(case)).find(|(key, _)| {
            let mut alone = document.clone();
            sweep.apply_only(case, key, &mut alone);
            alone.try_into::<StudySpec>().is_err()
        });
        let (key, value) = culprit.unwrap_or_else(|| (String::new(), Value::Boolean(false)));
        sweep
            .blame(text, &key, &format!("{value} does not serve: {problem}"), remedy)
            .unwrap_or_else(|| text.error(&[Step::Key("sweep")], problem, "here", remedy))
    })
}

fn stem(file: &str) -> String {
    Path::new(file).file_stem().map_or_else(|| "study".into(), |stem| stem.to_string_lossy().into_owned())
}

/// An error at a place of the study's text, or at what was swept there.
#[derive(Clone, Copy)]
struct Blame<'a> {
    text: &'a SceneText,
    sweep: &'a Sweep,
}

impl Blame<'_> {
    fn at(&self, path: &[Step], problem: &str, remedy: &str) -> Error {
        let words: Vec<String> = path
            .iter()
            .map(|step| match step {
                Step::Key(key) => (*key).to_owned(),
                Step::Index(i) => i.to_string(),
            })
            .collect();
        let name = words.join(".");
        self.sweep
            .blame(self.text, &name, problem, remedy)
            .unwrap_or_else(|| self.text.error(path, format!("{name}: {problem}"), "here", remedy))
    }
}
