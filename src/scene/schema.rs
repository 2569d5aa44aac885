//! A scene file as users write it: what is given, nothing yet believed.
//!
//! ```toml
//! name = "two organs"
//!
//! [beam]                              # see `beam.rs`
//! gantry_deg = "0..360:30"
//!
//! [spectrum]
//! kvp = 120                           # or energy_keV = 60, or file = "spectrum.csv"
//! filters = [{ material = "water", thickness_mm = 10 }]
//! response = "energy-integrating"     # or "counting"
//!
//! [[organ]]
//! name = "trunk"
//! material = "soft_tissue"            # a NIST material, as in `physics/data`
//! density_g_cm3 = 1.04                # the material's own if left out
//! colour = "#d8b08c"
//! extinction_per_mm = 0.01            # or opacity = 0.5, per crossing
//! shape = { kind = "elliptic-cylinder", … }
//!
//! [[organ]]
//! name = "liver"
//! inside = "trunk"                    # found from geometry; checked if given
//! material = "soft_tissue"
//! mesh = { file = "organs.obj", groups = ["liver"], units = "cm", rotate_deg = [0, 0, 90], move_mm = [1, 2, 3] }
//! ```

use serde::Deserialize;

use super::beam::BeamSpec;
use super::shape::Shape;
use crate::error::{Error, Result};
use crate::physics::{DetectorResponse, Filter};

/// A whole scene file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneSpec {
    /// What the scene is called; the file's name if left out.
    pub name: Option<String>,
    /// What it shows, in a sentence or two.
    #[serde(default)]
    pub description: String,
    /// Where rays come from.
    #[serde(default)]
    pub beam: BeamSpec,
    /// What they are made of, and what detects them.
    #[serde(default)]
    pub spectrum: SpectrumSpec,
    /// The organs, in any order.
    #[serde(default)]
    pub organ: Vec<OrganSpec>,
}

/// The `[spectrum]` table: one of three sources of photons, filters, and the detector's response.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpectrumSpec {
    /// One energy, keV.
    #[serde(rename = "energy_keV")]
    pub energy_kev: Option<f64>,
    /// A tungsten tube at this voltage.
    pub kvp: Option<u32>,
    /// A CSV file with columns `energy_keV,weight`, beside the scene.
    pub file: Option<String>,
    /// What the beam passes before the patient.
    #[serde(default)]
    pub filters: Vec<Filter>,
    /// What the detector makes of a photon.
    #[serde(default)]
    pub response: DetectorResponse,
}

/// One `[[organ]]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OrganSpec {
    /// Its name, once in a scene.
    pub name: String,
    /// The organ it must lie directly in.
    pub inside: Option<String>,
    /// What it is made of.
    pub material: String,
    /// Its density, g/cm³.
    pub density_g_cm3: Option<f64>,
    /// Its colour, `#rrggbb` in sRGB.
    pub colour: Option<String>,
    /// How much of what lies behind one crossing hides, 0 to 1.
    pub opacity: Option<f64>,
    /// How fast what lies behind is hidden, per mm of path.
    pub extinction_per_mm: Option<f64>,
    /// Its body as an equation.
    pub shape: Option<Shape>,
    /// Its body as several equations side by side.
    #[serde(default)]
    pub shapes: Vec<Shape>,
    /// Its body as a surface in a file.
    pub mesh: Option<MeshSpec>,
}

/// A surface in a file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeshSpec {
    /// The file, relative to the scene's folder and inside it.
    pub file: String,
    /// Names of the OBJ groups or objects that make up the organ; all if left out.
    pub groups: Option<Vec<String>>,
    /// One group's name.
    pub group: Option<String>,
    /// The unit of the file's coordinates.
    #[serde(default)]
    pub units: Unit,
    /// Corners nearer than this become one, mm; 0 joins equal corners only.
    #[serde(default)]
    pub weld_mm: f64,
    /// Turned about the scene's x axis, then y, then z, before it is moved.
    #[serde(default)]
    pub rotate_deg: [f64; 3],
    /// Moved by this, mm.
    #[serde(default)]
    pub move_mm: [f64; 3],
}

impl MeshSpec {
    /// The chosen groups. `None` for all. An error if they are said in both ways.
    pub fn chosen_groups(&self) -> Result<Option<Vec<String>>> {
        match (&self.groups, &self.group) {
            (Some(_), Some(_)) => Err(Error::input(
                &self.file,
                "both `group` and `groups` are given",
                "put all names into `groups` and drop `group`",
            )),
            (Some(groups), None) => Ok(Some(groups.clone())),
            (None, group) => Ok(group.clone().map(|name| vec![name])),
        }
    }
}

/// A unit of length.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Unit {
    /// Millimetres.
    #[default]
    Mm,
    /// Centimetres.
    Cm,
    /// Metres.
    M,
    /// Inches, 25.4 mm.
    Inch,
}

impl Unit {
    /// How many millimetres one is.
    pub fn mm(self) -> f64 {
        match self {
            Self::Mm => 1.0,
            Self::Cm => 10.0,
            Self::M => 1000.0,
            Self::Inch => 25.4,
        }
    }
}
