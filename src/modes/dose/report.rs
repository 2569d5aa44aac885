//! What a study has found, in figures.

use serde::{Deserialize, Serialize};

use super::sums::{FieldSums, MAX_BINS, Nodes, OrganSums};
use crate::modes::figures::Figures;
use crate::scene::iec::IecAngles;
use crate::study::{Case, Field, Input, Study};

/// What every output says.
pub const NOTICE: &str = "primary radiation only: no scatter, not for clinical use";

/// All that a study has found, but its paths. Lengths are mm, energies keV, angles degrees; energies and shares of fields are
/// per photon that leaves the source into the field, those of cases per photon of all control points by weight.
#[derive(Clone, Debug, Serialize)]
pub struct DoseReport {
    /// The program.
    pub program: &'static str,
    /// Its version.
    pub version: &'static str,
    /// What this is not.
    pub notice: &'static str,
    /// The command line that made the report; set by whoever knows it.
    pub command: String,
    /// Which study.
    pub study: StudyWords,
    /// How lengths were found.
    pub method: &'static str,
    /// How many paths were followed.
    pub paths: u64,
    /// Each combination of the swept parameters' values.
    pub cases: Vec<CaseFigures>,
    /// Each control point of each case.
    pub fields: Vec<FieldFigures>,
    /// Errors of lengths against exact ones, by scene; and by part, if the study was split.
    pub errors: Vec<SampledErrors>,
}

/// Which study it was.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudyWords {
    /// Its name.
    pub name: String,
    /// What it is for.
    pub description: String,
    /// The files that made it, itself first, with their hashes.
    pub inputs: Vec<Input>,
    /// What took the place of what its file says.
    pub settings: Vec<String>,
    /// The swept parameters.
    pub parameters: Vec<String>,
}

impl StudyWords {
    /// Of `study`.
    pub fn of(study: &Study) -> Self {
        Self {
            name: study.name().into(),
            description: study.description().into(),
            inputs: study.inputs().to_vec(),
            settings: study.settings().to_vec(),
            parameters: study.parameters().to_vec(),
        }
    }
}

/// One case: what it is, and the sums over its control points by weight.
#[derive(Clone, Debug, Serialize)]
pub struct CaseFigures {
    /// Its number.
    pub case: usize,
    /// The scene's name.
    pub scene: String,
    /// The swept parameters' values.
    pub values: Vec<toml::Value>,
    /// The energy of quantities of a single energy, keV.
    #[serde(rename = "reference_energy_keV")]
    pub reference_energy_kev: f64,
    /// The mean energy of the photons before the patient, keV.
    #[serde(rename = "mean_energy_keV")]
    pub mean_energy_kev: f64,
    /// How many control points it has.
    pub control_points: usize,
    /// Over all of them.
    #[serde(flatten)]
    pub figures: BeamFigures,
}

/// One field: where it comes from, and what it does.
#[derive(Clone, Debug, Serialize)]
pub struct FieldFigures {
    /// Its number.
    pub field: usize,
    /// Its case.
    pub case: usize,
    /// Its place among the case's control points.
    pub control_point: usize,
    /// The machine's angles; `None` where sources are placed by hand.
    pub angles: Option<IecAngles>,
    /// The source, patient LPS, mm; `None` if each path has its own.
    pub source_mm: Option<[f64; 3]>,
    /// Its weight as given.
    pub weight: f64,
    /// Its weight as a share of its case's.
    pub share: f64,
    /// Its first path.
    pub first_path: u64,
    /// What it does.
    #[serde(flatten)]
    pub figures: BeamFigures,
}

/// What a beam does.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BeamFigures {
    /// Paths.
    pub paths: u64,
    /// Those that meet no organ.
    pub paths_meeting_nothing: u64,
    /// The mean length of paths, mm.
    pub mean_length_mm: f64,
    /// The mean length outside every organ, mm.
    pub mean_outside_mm: f64,
    /// The share of photons left at the paths' ends.
    pub transmitted_photons: f64,
    /// The share of the photons' energy left there.
    pub transmitted_energy: f64,
    /// Mean transmission at the reference energy.
    pub transmission_reference: f64,
    /// The share of the primary energy absorbed in organs.
    pub absorbed_energy: f64,
    /// Each organ that is met.
    pub organs: Vec<OrganFigures>,
}

/// What a beam does in an organ.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OrganFigures {
    /// Its name.
    pub organ: String,
    /// Paths that meet it.
    pub paths: u64,
    /// The share of photons whose paths meet it.
    pub met_share: f64,
    /// Their mean own length, mm.
    pub mean_length_mm: f64,
    /// The shortest, mm.
    pub shortest_mm: f64,
    /// The longest, mm.
    pub longest_mm: f64,
    /// The number of the longest's path.
    pub longest_path: u64,
    /// The mean of their μL at the reference energy.
    pub mean_mu_length: f64,
    /// Energy imparted by the primary: absorbed where photons first interact, keV per photon.
    #[serde(rename = "energy_imparted_keV")]
    pub energy_imparted_kev: f64,
    /// The same as a share of the primary energy.
    pub absorbed_share: f64,
    /// The share of the primary energy that interacts there, be it absorbed or scattered.
    pub removed_share: f64,
    /// The area of the isocentre plane that leads to it, mm²; `None` of paths that stand for none.
    pub area_mm2: Option<f64>,
    /// Its volume that the beam passes, mm³; likewise.
    pub volume_mm3: Option<f64>,
    /// How paths, area and volume are distributed over own lengths.
    pub histogram: Vec<LengthBar>,
}

/// Of own lengths from one to another, mm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LengthBar {
    /// The least length, included, mm.
    pub from_mm: f64,
    /// The greatest, excluded, mm; `None` of the last possible bin, which has no end.
    pub to_mm: Option<f64>,
    /// Paths.
    pub paths: u64,
    /// The area of the isocentre plane that they stand for, mm²: the length-area histogram.
    pub area_mm2: Option<f64>,
    /// The organ's volume that they stand for, mm³: the length-volume histogram.
    pub volume_mm3: Option<f64>,
}

/// Errors of a sample's lengths.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SampledErrors {
    /// The scene.
    pub scene: String,
    /// How many paths were taken from the study's.
    pub paths: u64,
    /// Of the random numbers that chose them.
    pub seed: u64,
    /// By what they were judged.
    pub against: String,
    /// All organs' chords, mm.
    pub length_mm: Figures,
    /// The paths' transmission at the scene's mean energy.
    pub transmission: Figures,
    /// Each organ's chords, mm.
    pub organs: Vec<OrganErrors>,
}

/// One organ's errors.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct OrganErrors {
    /// Its name.
    pub organ: String,
    /// Of its chords, mm.
    pub length_mm: Figures,
}

impl BeamFigures {
    /// Of sums over paths that may stand for a pencil or not.
    fn of(sums: &FieldSums, mean_energy_kev: f64, bin_mm: f64, has_pencils: bool, names: &[String]) -> Self {
        let photons = sums.photons;
        let met = sums.organs.iter().zip(names).filter(|(organ, _)| organ.paths > 0);
        let organs: Vec<OrganFigures> = met
            .map(|(organ, name)| OrganFigures::of(organ, name, photons, mean_energy_kev, bin_mm, has_pencils))
            .collect();
        Self {
            paths: sums.paths,
            paths_meeting_nothing: sums.paths_meeting_nothing,
            mean_length_mm: sums.length / photons,
            mean_outside_mm: sums.outside / photons,
            transmitted_photons: sums.transmitted / photons,
            transmitted_energy: sums.transmitted_energy / photons / mean_energy_kev,
            transmission_reference: sums.transmitted_reference / photons,
            absorbed_energy: organs.iter().map(|organ| organ.absorbed_share).sum::<f64>() + 0.0,
            organs,
        }
    }
}

impl OrganFigures {
    fn of(
        sums: &OrganSums,
        name: &str,
        photons: f64,
        mean_energy_kev: f64,
        bin_mm: f64,
        has_pencils: bool,
    ) -> Self {
        let edge = |i: usize| i as f64 * bin_mm;
        let filled = sums.bins.iter().enumerate().filter(|(_, bin)| bin.paths > 0);
        let histogram = filled.map(|(i, bin)| LengthBar {
            from_mm: edge(i),
            to_mm: (i + 1 < MAX_BINS).then(|| edge(i + 1)),
            paths: bin.paths,
            area_mm2: has_pencils.then_some(bin.area_mm2),
            volume_mm3: has_pencils.then_some(bin.volume_mm3),
        });
        let energy_imparted_kev = sums.absorbed / photons;
        Self {
            organ: name.into(),
            paths: sums.paths,
            met_share: sums.photons / photons,
            mean_length_mm: sums.length / sums.photons,
            shortest_mm: sums.shortest_mm,
            longest_mm: sums.longest_mm,
            longest_path: sums.longest_path,
            mean_mu_length: sums.mu_length / sums.photons,
            energy_imparted_kev,
            absorbed_share: energy_imparted_kev / mean_energy_kev,
            removed_share: sums.removed / photons / mean_energy_kev,
            area_mm2: has_pencils.then_some(sums.area_mm2),
            volume_mm3: has_pencils.then_some(sums.volume_mm3),
            histogram: histogram.collect(),
        }
    }
}

/// Makes figures of fields' sums as they come, in order, and of each case's by weight.
pub(super) struct Collector<'a> {
    study: &'a Study,
    names: Vec<Vec<String>>,
    /// The sums of the case whose fields are coming.
    open: FieldSums,
    fields: Vec<FieldFigures>,
    cases: Vec<CaseFigures>,
}

impl<'a> Collector<'a> {
    pub fn new(study: &'a Study) -> Self {
        let names =
            |scene: &crate::scene::Scene| scene.organs.iter().map(|organ| organ.name.clone()).collect();
        Self {
            study,
            names: study.scenes().iter().map(names).collect(),
            open: FieldSums::default(),
            fields: Vec::new(),
            cases: Vec::new(),
        }
    }

    /// Takes the sums of the next field.
    pub fn take(&mut self, nodes: Nodes<FieldSums>) {
        let Some(sums) = nodes.total() else { return };
        let index = self.fields.len();
        let Some(field) = self.study.fields().get(index) else { return };
        let case = self.study.case_of(field);
        let figures = self.figures(case, &sums);
        self.fields.push(FieldFigures {
            field: index,
            case: field.case(),
            control_point: field.control_point(),
            angles: field.machine().angles.filter(|_| !case.is_list()),
            source_mm: (!case.is_list()).then(|| field.machine().source_mm.to_array()),
            weight: field.weight(),
            share: field.share(),
            first_path: field.first_path(),
            figures,
        });
        // By weight: each control point's photons are its share of the case's, whatever its field's size.
        self.open += &sums.scaled(field.share() / sums.photons, field.share());
        if self.study.fields().get(index + 1).is_none_or(|next| next.case() != field.case()) {
            self.close(field);
        }
    }

    /// The report of all that was taken.
    pub fn report(self, method: &'static str, errors: Vec<SampledErrors>) -> DoseReport {
        DoseReport {
            program: "chordfield",
            version: env!("CARGO_PKG_VERSION"),
            notice: NOTICE,
            command: String::new(),
            study: StudyWords::of(self.study),
            method,
            paths: self.fields.iter().map(|field| field.figures.paths).sum(),
            cases: self.cases,
            fields: self.fields,
            errors,
        }
    }

    fn close(&mut self, last: &Field) {
        let case = self.study.case_of(last);
        let sums = std::mem::take(&mut self.open);
        self.cases.push(CaseFigures {
            case: last.case(),
            scene: self.study.scene_of(case).name.clone(),
            values: case.values().to_vec(),
            reference_energy_kev: case.reference_energy_kev,
            mean_energy_kev: case.spectrum.mean_energy_kev(),
            control_points: last.control_point() + 1,
            figures: self.figures(case, &sums),
        });
    }

    fn figures(&self, case: &Case, sums: &FieldSums) -> BeamFigures {
        let mean_energy_kev = case.spectrum.mean_energy_kev();
        let names = &self.names[case.scene()];
        BeamFigures::of(sums, mean_energy_kev, case.histogram_bin_mm, case.has_pencils(), names)
    }
}
