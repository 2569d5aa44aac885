//! Beams as users write them: the `[beam]` table of a scene file, and the command line's changes to it.
//!
//! ```toml
//! [beam]                          # one of three ways to place source and detector:
//! kind = "cone"                   # or "parallel"
//! gantry_deg = "0..360:30"        # 1. angles of IEC 61217 about an isocentre; numbers, lists or ranges
//! couch_deg = 0                   #    every gantry with every couch with every collimator angle, the last turning fastest
//! collimator_deg = [0, 90]
//! patient_position = "HFS"        #    HFS, HFP, FFS or FFP
//! isocentre_mm = [0, 0, 350]      #    patient LPS
//! sad_mm = 1000                   #    source to isocentre
//! sdd_mm = 1500                   #    source to detector
//! detector = { size_mm = [640, 640], pixels = [512, 512], offset_mm = [0, 0] }
//!                                 # 2. source_mm, detector_centre_mm, column_direction and row_direction
//!                                 # 3. matrices = [[[…4], […4], […4]], …] with sdd_mm (see `matrix.rs`)
//! ```
//!
//! The detector must lie beyond the isocentre (SDD > SAD): a path ends at its pixel, so a detector nearer to the source would cut
//! the patient short, and the usual cause is two numbers swapped. Who wants a detector inside the patient says so with a
//! free pose.

use std::ops::Range;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::iec::{IecAngles, PatientPosition};
use super::matrix;
use super::panel::Panel;
use super::problem::{BeamProblem, Given, coordinates, distance};
use super::ranges::{Angles, MAX_VIEWS};
use super::view::{Pose, View};
use crate::geometry::UnitDir;

/// Source to isocentre where none is given, mm: the usual C-arm and linac distance.
pub const DEFAULT_SAD_MM: f64 = 1000.0;
/// Source to detector where none is given, mm: the usual distance of a kV imager.
pub const DEFAULT_SDD_MM: f64 = 1500.0;
/// Detector pixels, columns and rows, where none are given.
pub const DEFAULT_PIXELS: [u32; 2] = [512, 512];
/// Detector width where no size is given, mm. At the default distances it sees 427 mm at the isocentre: an adult trunk with its arms (400
/// mm) and a margin. The height follows from square pixels.
pub const DEFAULT_WIDTH_MM: f64 = 640.0;

/// How far the detector's two directions may be from perpendicular, as the cosine between them: what rounding to six typed
/// digits leaves. The row direction is then made exactly perpendicular.
const TYPED_COSINE: f64 = 1e-5;

/// How rays leave the source.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BeamKind {
    /// From one point.
    #[default]
    Cone,
    /// All along one direction.
    Parallel,
}

/// A 3×4 matrix by rows, from patient mm to pixels.
pub type ProjectionMatrix = [[f64; 4]; 3];

/// The `[beam]` table: what is given, nothing yet believed. [`BeamSpec::views`] believes or refuses it.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BeamSpec {
    /// Cone (default) or parallel.
    pub kind: Option<Given<BeamKind>>,
    /// Source to isocentre, mm; [`DEFAULT_SAD_MM`].
    pub sad_mm: Option<Given<f64>>,
    /// Source to detector plane, mm; [`DEFAULT_SDD_MM`], required with matrices.
    pub sdd_mm: Option<Given<f64>>,
    /// The isocentre, patient LPS, mm; the patient's origin. With matrices, any point the beams look at.
    pub isocentre_mm: Option<Given<[f64; 3]>>,
    /// Gantry angles φ; 0.
    pub gantry_deg: Option<Given<Angles>>,
    /// Couch angles θ; 0.
    pub couch_deg: Option<Given<Angles>>,
    /// Collimator angles χ; 0.
    pub collimator_deg: Option<Given<Angles>>,
    /// How the patient lies; head first, supine.
    pub patient_position: Option<Given<PatientPosition>>,
    /// Free pose: the source, patient LPS, mm. For parallel rays, their direction is from here to the detector's centre.
    pub source_mm: Option<Given<[f64; 3]>>,
    /// Free pose: the centre of the detector, patient LPS, mm.
    pub detector_centre_mm: Option<Given<[f64; 3]>>,
    /// Free pose: where columns increase, of any length.
    pub column_direction: Option<Given<[f64; 3]>>,
    /// Free pose: where rows increase, of any length, perpendicular to the columns.
    pub row_direction: Option<Given<[f64; 3]>>,
    /// One view per 3×4 matrix, from homogeneous patient mm to homogeneous pixels.
    pub matrices: Option<Given<Vec<ProjectionMatrix>>>,
    /// The detector.
    pub detector: DetectorSpec,
}

/// The `[beam.detector]` table.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DetectorSpec {
    /// Width and height from edge to edge, mm; [`DEFAULT_WIDTH_MM`] with square pixels.
    pub size_mm: Option<Given<[f64; 2]>>,
    /// Columns and rows; [`DEFAULT_PIXELS`].
    pub pixels: Option<Given<[u32; 2]>>,
    /// Shift of the detector's centre off the beam's axis along X_b and Y_b, mm.
    pub offset_mm: Option<Given<[f64; 2]>>,
}

/// Evaluates an expression with each key's name and field, so that no list of keys can miss one.
macro_rules! for_each_key {
    ($apply:ident) => {
        $apply! {
            "kind" => kind, "sad_mm" => sad_mm, "sdd_mm" => sdd_mm, "isocentre_mm" => isocentre_mm,
            "gantry_deg" => gantry_deg, "couch_deg" => couch_deg, "collimator_deg" => collimator_deg,
            "patient_position" => patient_position, "source_mm" => source_mm,
            "detector_centre_mm" => detector_centre_mm, "column_direction" => column_direction,
            "row_direction" => row_direction, "matrices" => matrices,
            "detector.size_mm" => detector.size_mm, "detector.pixels" => detector.pixels,
            "detector.offset_mm" => detector.offset_mm
        }
    };
}

/// Keys that only angles about an isocentre have a use for.
const IEC_KEYS: [&str; 6] =
    ["sad_mm", "gantry_deg", "couch_deg", "collimator_deg", "patient_position", "detector.offset_mm"];
/// Keys of a free pose, all required.
const FREE_KEYS: [&str; 4] = ["source_mm", "detector_centre_mm", "column_direction", "row_direction"];

impl BeamSpec {
    /// The keys that are given, with their places in the scene's text (bytes; `None` if they did not come from there).
    fn given(&self) -> Vec<(&'static str, Option<Range<usize>>)> {
        macro_rules! list {
            ($($key:literal => $($field:ident).+),+) => {
                [$(($key, self.$($field).+.as_ref().map(Given::span))),+]
            };
        }
        for_each_key!(list).into_iter().filter_map(|(key, span)| span.map(|span| (key, span))).collect()
    }

    /// Where the scene's text gives the value of `key` (as in [`BeamProblem::key`]), bytes. `None` if it does not.
    pub fn span_of(&self, key: &str) -> Option<Range<usize>> {
        self.given().into_iter().find_map(|(name, span)| if name == key { span } else { None })
    }

    /// These keys, with those that `changes` gives in their place.
    pub fn overridden_by(mut self, changes: Self) -> Self {
        macro_rules! take {
            ($($key:literal => $($field:ident).+),+) => {
                $(if changes.$($field).+.is_some() { self.$($field).+ = changes.$($field).+; })+
            };
        }
        for_each_key!(take);
        self
    }

    /// The views of the beam, in order: gantry outermost, then couch, then collimator; or the list's order. At least one, at
    /// most [`MAX_VIEWS`]. The error names the first key at fault.
    pub fn views(&self) -> Result<Vec<View>, BeamProblem> {
        let given: Vec<&'static str> = self.given().into_iter().map(|(key, _)| key).collect();
        if let Some(matrices) = &self.matrices {
            let foreign = [&IEC_KEYS[..], &FREE_KEYS[..], &["detector.size_mm"]].concat();
            refuse(&given, &foreign, "a beam of matrices, which fix the whole pose", "matrices")?;
            self.views_of_matrices(matrices.get())
        } else if given.iter().any(|key| FREE_KEYS.contains(key)) {
            let foreign = [&IEC_KEYS[..], &["sdd_mm", "isocentre_mm"]].concat();
            refuse(&given, &foreign, "a free pose, which its four vectors fix", "the free pose")?;
            Ok(vec![self.free_view()?])
        } else {
            self.views_of_angles()
        }
    }

    fn views_of_angles(&self) -> Result<Vec<View>, BeamProblem> {
        let sad_mm = distance("sad_mm", value_or(&self.sad_mm, DEFAULT_SAD_MM))?;
        let sdd_mm = distance("sdd_mm", value_or(&self.sdd_mm, DEFAULT_SDD_MM))?;
        if sdd_mm <= sad_mm {
            return Err(BeamProblem::new(
                if self.sdd_mm.is_some() { "sdd_mm" } else { "sad_mm" },
                format!("the detector (SDD {sdd_mm} mm) is not beyond the isocentre (SAD {sad_mm} mm)"),
                "give an SDD greater than the SAD; for a detector inside the patient use a free pose",
            ));
        }
        let isocentre_mm = coordinates("isocentre_mm", value_or(&self.isocentre_mm, [0.0; 3]))?;
        let machine = Machine { kind: self.kind(), sad_mm, sdd_mm, isocentre_mm, detector: self.detector()? };
        let zero = Angles::from(0.0);
        let angles = |key, given: &Option<Given<Angles>>| -> Result<Vec<f64>, BeamProblem> {
            let angles = given.as_ref().map_or(&zero, Given::get).degrees();
            angles.iter().try_for_each(|angle| super::problem::finite(key, *angle).map(drop))?;
            Ok(angles.to_vec())
        };
        let gantries = angles("gantry_deg", &self.gantry_deg)?;
        let couches = angles("couch_deg", &self.couch_deg)?;
        let collimators = angles("collimator_deg", &self.collimator_deg)?;
        let count = gantries.len().saturating_mul(couches.len()).saturating_mul(collimators.len());
        at_most_max_views(count, "gantry_deg")?;

        let patient_position = value_or(&self.patient_position, PatientPosition::default());
        let mut views = Vec::with_capacity(count);
        for &gantry_deg in &gantries {
            for &couch_deg in &couches {
                for &collimator_deg in &collimators {
                    views.push(machine.view(IecAngles {
                        gantry_deg,
                        couch_deg,
                        collimator_deg,
                        patient_position,
                    })?);
                }
            }
        }
        Ok(views)
    }

    fn free_view(&self) -> Result<View, BeamProblem> {
        let vector = |key: &'static str, given: &Option<Given<[f64; 3]>>| {
            let value = given.as_ref().ok_or_else(|| {
                BeamProblem::new(
                    key,
                    "is missing from the free pose",
                    format!("a free pose needs all of {}", FREE_KEYS.join(", ")),
                )
            })?;
            Ok(DVec3::from(coordinates(key, *value.get())?))
        };
        let source = vector("source_mm", &self.source_mm)?;
        let centre = vector("detector_centre_mm", &self.detector_centre_mm)?;
        let direction = |key, given| {
            UnitDir::new(vector(key, given)?).map(UnitDir::get).ok_or_else(|| {
                BeamProblem::new(key, "has no direction: its length is zero", "give a vector other than zero")
            })
        };
        let column = direction("column_direction", &self.column_direction)?;
        let row = direction("row_direction", &self.row_direction)?;
        let cosine = column.dot(row);
        if cosine.abs() > TYPED_COSINE {
            return Err(BeamProblem::new(
                "row_direction",
                format!("is {:.4}° from perpendicular to column_direction", cosine.asin().to_degrees().abs()),
                "give two perpendicular directions, to six digits",
            ));
        }
        let row = (row - cosine * column).normalize();

        let detector = self.detector()?;
        let [width, height] = detector.spacing_mm();
        let panel = Panel::centred(centre, width * column, height * row, detector.pixels);
        let view = match self.kind() {
            BeamKind::Cone => View::cone(source, panel, Pose::Free),
            BeamKind::Parallel => {
                let downstream = UnitDir::new(centre - source).ok_or_else(|| {
                    BeamProblem::new("source_mm", "is the detector's centre", "move the source upstream")
                })?;
                View::parallel(source, downstream, (centre - source).length(), panel, Pose::Free)
            }
        };
        // A free pose has no SDD of its own to blame.
        view.map_err(|problem| if problem.key == "sdd_mm" { problem.blamed_on("source_mm") } else { problem })
    }

    fn views_of_matrices(&self, matrices: &[ProjectionMatrix]) -> Result<Vec<View>, BeamProblem> {
        if self.kind() == BeamKind::Parallel {
            return Err(BeamProblem::new(
                "kind",
                "matrices describe cones",
                "drop kind = \"parallel\" or the matrices",
            ));
        }
        if matrices.is_empty() {
            return Err(BeamProblem::new("matrices", "the list is empty", "give one 3×4 matrix per view"));
        }
        at_most_max_views(matrices.len(), "matrices")?;
        let Some(sdd_mm) = &self.sdd_mm else {
            return Err(BeamProblem::new(
                "sdd_mm",
                "is missing: a matrix does not say how far from the source the detector stands",
                "give the source-to-detector distance, sdd_mm",
            ));
        };
        let sdd_mm = distance("sdd_mm", *sdd_mm.get())?;
        let isocentre = DVec3::from(coordinates("isocentre_mm", value_or(&self.isocentre_mm, [0.0; 3]))?);
        let pixels = value_or(&self.detector.pixels, DEFAULT_PIXELS);
        let views = matrices.iter().enumerate();
        views.map(|(index, p)| matrix::view_of(p, index, sdd_mm, isocentre, pixels)).collect()
    }

    fn kind(&self) -> BeamKind {
        value_or(&self.kind, BeamKind::default())
    }

    fn detector(&self) -> Result<Detector, BeamProblem> {
        let pixels = value_or(&self.detector.pixels, DEFAULT_PIXELS);
        if pixels.contains(&0) {
            return Err(BeamProblem::new(
                "detector.pixels",
                format!("{} × {} pixels are no image", pixels[0], pixels[1]),
                "give at least one column and one row",
            ));
        }
        let square = DEFAULT_WIDTH_MM / f64::from(pixels[0]) * f64::from(pixels[1]);
        let size_mm = value_or(&self.detector.size_mm, [DEFAULT_WIDTH_MM, square]);
        for side in size_mm {
            distance("detector.size_mm", side)?;
        }
        let offset_mm = coordinates("detector.offset_mm", value_or(&self.detector.offset_mm, [0.0; 2]))?;
        Ok(Detector { size_mm, pixels, offset_mm })
    }
}

/// A detector whose numbers are finite and positive.
struct Detector {
    size_mm: [f64; 2],
    pixels: [u32; 2],
    offset_mm: [f64; 2],
}

impl Detector {
    fn spacing_mm(&self) -> [f64; 2] {
        [0, 1].map(|axis| self.size_mm[axis] / f64::from(self.pixels[axis]))
    }
}

/// What all views of a beam of angles share.
struct Machine {
    kind: BeamKind,
    sad_mm: f64,
    sdd_mm: f64,
    isocentre_mm: [f64; 3],
    detector: Detector,
}

impl Machine {
    fn view(&self, angles: IecAngles) -> Result<View, BeamProblem> {
        let axes = angles.beam_axes();
        let isocentre = DVec3::from(self.isocentre_mm);
        let source = isocentre + self.sad_mm * axes.z;
        let [right, up] = self.detector.offset_mm;
        let centre = isocentre - (self.sdd_mm - self.sad_mm) * axes.z + right * axes.x + up * axes.y;
        let [width, height] = self.detector.spacing_mm();
        let panel = Panel::centred(centre, width * axes.x, -height * axes.y, self.detector.pixels);
        let pose =
            Pose::Iec { angles, sad_mm: self.sad_mm, sdd_mm: self.sdd_mm, isocentre_mm: self.isocentre_mm };
        match self.kind {
            BeamKind::Cone => View::cone(source, panel, pose),
            BeamKind::Parallel => {
                let downstream = UnitDir::new(-axes.z).ok_or_else(|| {
                    BeamProblem::new("gantry_deg", "gives no direction", "give finite angles in degrees")
                })?;
                View::parallel(source, downstream, self.sdd_mm, panel, pose)
            }
        }
    }
}

fn value_or<T: Copy>(given: &Option<Given<T>>, default: T) -> T {
    given.as_ref().map_or(default, |given| *given.get())
}

/// Refuses keys that would silently have no effect.
fn refuse(given: &[&'static str], foreign: &[&str], form: &str, keep: &str) -> Result<(), BeamProblem> {
    match given.iter().find(|key| foreign.contains(key)) {
        None => Ok(()),
        Some(key) => Err(BeamProblem::new(
            key,
            format!("has no meaning in {form}"),
            format!("drop {key}, or {keep} in favour of angles about an isocentre"),
        )),
    }
}

fn at_most_max_views(count: usize, key: &'static str) -> Result<(), BeamProblem> {
    if count <= MAX_VIEWS {
        return Ok(());
    }
    let problem = format!("the beam has {count} views; at most {MAX_VIEWS} are allowed");
    Err(BeamProblem::new(key, problem, "use coarser steps or shorter lists"))
}
