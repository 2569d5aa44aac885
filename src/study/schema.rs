//! A study file as users write it: what is given, nothing yet believed.
//!
//! ```toml
//! name = "liver arc"
//! scene = "adult"                       # a phantom's name, or a scene file in the study's folder
//! reference_energy_keV = 60             # of single-energy quantities; the photons' mean energy if left out
//! histogram_bin_mm = 5
//!
//! [beam]
//! kind = "cone"                         # or "parallel"
//! sad_mm = 1000                         # source to isocentre
//! isocentre = "liver"                   # an organ's centroid; or isocentre_mm = [x, y, z], patient LPS
//! gantry_deg = 0                        # IEC 61217; couch_deg, collimator_deg, patient_position likewise
//! control_points = [                    # an arc: angles of each, numbers, lists or ranges, and its weight
//!   { gantry_deg = "180..-180:-2", weight = 1 },
//! ]
//!
//! [paths]                               # one of:
//! field = { circle_mm = 80, spacing_mm = 2 }                     # or rectangle_mm = [w, h], polygon_mm = [[x, y], …]
//! grid = { size_mm = [400, 300], points = [81, 61] }
//! fan = { width_mm = 400, points = 81, along = "x" }
//! points = [{ organ = "liver" }, { name = "node", at_mm = [x, y, z] }]
//! segments_mm = [[x, y, z, x, y, z]]                             # source and target
//! csv = "paths.csv"
//!
//! [spectrum]                            # in place of the scene's; as in scene files
//! kvp = 120
//!
//! [organ.liver]                         # in place of the scene's
//! density_g_cm3 = 1.06
//!
//! [[sweep]]                             # keys of one table go together; tables are multiplied
//! beam.gantry_deg = "0..360:30"
//! ```

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::scene::beam::BeamKind;
use crate::scene::iec::PatientPosition;
use crate::scene::ranges::Angles;
use crate::scene::schema::SpectrumSpec;

/// A whole study file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudySpec {
    /// What it is called; the file's name if left out.
    pub name: Option<String>,
    /// What it is for.
    #[serde(default)]
    pub description: String,
    /// The scene: a phantom's name, or a file.
    #[serde(default = "default_scene")]
    pub scene: String,
    /// At which energy quantities of a single energy are told, keV.
    #[serde(rename = "reference_energy_keV")]
    pub reference_energy_kev: Option<f64>,
    /// How wide the bins of length histograms are, mm.
    pub histogram_bin_mm: Option<f64>,
    /// Where the source stands.
    #[serde(default)]
    pub beam: MachineSpec,
    /// Where paths lead.
    pub paths: PathsSpec,
    /// The photons; the scene's if left out.
    pub spectrum: Option<SpectrumSpec>,
    /// What is different in organs.
    #[serde(default)]
    pub organ: BTreeMap<String, OrganChange>,
    /// What is swept: tables of keys and lists.
    #[serde(default)]
    pub sweep: Vec<toml::Table>,
}

fn default_scene() -> String {
    "adult".into()
}

/// The `[beam]` table.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MachineSpec {
    /// Cone or parallel.
    pub kind: BeamKind,
    /// Source to isocentre, mm.
    pub sad_mm: Option<f64>,
    /// The isocentre, patient LPS, mm.
    pub isocentre_mm: Option<[f64; 3]>,
    /// The organ whose centroid is the isocentre.
    pub isocentre: Option<String>,
    /// Gantry φ, degrees.
    pub gantry_deg: f64,
    /// Couch θ, degrees.
    pub couch_deg: f64,
    /// Collimator χ, degrees.
    pub collimator_deg: f64,
    /// How the patient lies.
    pub patient_position: PatientPosition,
    /// A source in place of angles, patient LPS, mm.
    pub source_mm: Option<[f64; 3]>,
    /// The fields of an arc, or of several static beams.
    pub control_points: Vec<ControlPointSpec>,
}

/// Control points: one, or as many as its lists are long.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ControlPointSpec {
    /// Gantry φ, degrees; the beam's if left out.
    pub gantry_deg: Option<Angles>,
    /// Couch θ, degrees; the beam's if left out.
    pub couch_deg: Option<Angles>,
    /// Collimator χ, degrees; the beam's if left out.
    pub collimator_deg: Option<Angles>,
    /// How much each counts; 1 if left out.
    pub weight: Option<Weights>,
}

/// One weight, or several.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged, expecting = "a weight or a list of weights")]
pub enum Weights {
    /// The same for all.
    One(f64),
    /// One for each.
    Each(Vec<f64>),
}

/// The `[paths]` table: one of its lists and shapes.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PathsSpec {
    /// From the source to points of interest.
    pub points: Option<Vec<PointSpec>>,
    /// From a source to a target, each of its own: x, y, z, x, y, z in patient LPS, mm.
    pub segments_mm: Option<Vec<[f64; 6]>>,
    /// The same from a CSV file in the study's folder.
    pub csv: Option<String>,
    /// A row of paths through the isocentre plane.
    pub fan: Option<FanSpec>,
    /// A grid of them.
    pub grid: Option<GridSpec>,
    /// A field behind an aperture.
    pub field: Option<FieldSpec>,
    /// How far behind the isocentre plane, along the beam's axis, or behind a point, along the path, paths end, mm.
    pub beyond_mm: Option<f64>,
    /// The distance from the source at which the fluence in air is 1, mm; the SAD if left out.
    pub reference_distance_mm: Option<f64>,
}

/// A point of interest.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointSpec {
    /// What it is called.
    pub name: Option<String>,
    /// Patient LPS, mm.
    pub at_mm: Option<[f64; 3]>,
    /// The organ whose centroid it is, or, with `at_mm`, in which it must lie.
    pub organ: Option<String>,
}

/// Paths through equidistant points of a line in the isocentre plane, both ends included.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FanSpec {
    /// From end to end, mm.
    pub width_mm: f64,
    /// How many.
    pub points: u32,
    /// Along which axis of the beam frame.
    #[serde(default)]
    pub along: Along,
}

/// An axis of the beam frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Along {
    /// X_b.
    #[default]
    X,
    /// Y_b.
    Y,
}

/// Paths through the middles of the cells of a rectangle in the isocentre plane.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GridSpec {
    /// Along X_b and Y_b, from edge to edge, mm.
    pub size_mm: [f64; 2],
    /// Cells along X_b and Y_b.
    pub points: [u32; 2],
}

/// Paths through the square cells of the isocentre plane whose middles lie in an aperture.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FieldSpec {
    /// A rectangle about the beam's axis, along X_b and Y_b, mm.
    pub rectangle_mm: Option<[f64; 2]>,
    /// A circle about the beam's axis: its diameter, mm.
    pub circle_mm: Option<f64>,
    /// A polygon: its corners, X_b and Y_b, mm. Even–odd: what is enclosed twice is outside.
    pub polygon_mm: Option<Vec<[f64; 2]>>,
    /// The side of a cell, mm.
    pub spacing_mm: f64,
}

/// What is different in an organ.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OrganChange {
    /// What it is made of.
    pub material: Option<String>,
    /// Its density, g/cm³.
    pub density_g_cm3: Option<f64>,
}

/// Every key that can be swept or set; organs' keys besides.
pub const KEYS: [&str; 31] = [
    "scene",
    "reference_energy_keV",
    "histogram_bin_mm",
    "beam.kind",
    "beam.sad_mm",
    "beam.isocentre_mm",
    "beam.isocentre",
    "beam.gantry_deg",
    "beam.couch_deg",
    "beam.collimator_deg",
    "beam.patient_position",
    "beam.source_mm",
    "beam.control_points",
    "paths.points",
    "paths.segments_mm",
    "paths.csv",
    "paths.fan.width_mm",
    "paths.fan.points",
    "paths.fan.along",
    "paths.grid.size_mm",
    "paths.grid.points",
    "paths.field.rectangle_mm",
    "paths.field.circle_mm",
    "paths.field.polygon_mm",
    "paths.field.spacing_mm",
    "paths.beyond_mm",
    "paths.reference_distance_mm",
    "spectrum.energy_keV",
    "spectrum.kvp",
    "spectrum.file",
    "spectrum.filters",
];

/// The keys of `[organ.NAME]`.
pub const ORGAN_KEYS: [&str; 2] = ["density_g_cm3", "material"];

/// Units that keys end in, which may be left out of a sweep.
pub const UNITS: [&str; 4] = ["_deg", "_mm", "_keV", "_g_cm3"];
