//! The record beside a run's images: every unit, frame and parameter that made them, and what the run cost.

use std::collections::BTreeMap;

use serde::Serialize;

use super::projection::WrittenFile;
use crate::exact::Engine;
use crate::modes::figures::Figures;
use crate::modes::project::{Estimate, ForestReport, QueryCounts, RayCounts, TreeSettings};
use crate::physics::{PhotonNoise, Spectrum};
use crate::scene::organ::{Organ, Origin};
use crate::scene::{Pose, Scene, View};

/// A whole run.
#[derive(Debug, Serialize)]
pub struct Sidecar {
    program: &'static str,
    version: &'static str,
    notice: &'static str,
    frames: Frames,
    scene: SceneRecord,
    photons: PhotonRecord,
    views: Vec<ViewRecord>,
    summary: Summary,
}

#[derive(Debug, Serialize)]
struct Frames {
    lengths: &'static str,
    angles: &'static str,
    energies: &'static str,
    densities: &'static str,
    patient: &'static str,
    machine: &'static str,
    images: &'static str,
}

const FRAMES: Frames = Frames {
    lengths: "mm",
    angles: "degree",
    energies: "keV",
    densities: "g/cm3",
    patient: "DICOM LPS: +x left, +y posterior, +z superior",
    machine: "IEC 61217; source at gantry angle g is at (sin g, -cos g, 0) of the patient, head first supine",
    images: "row by row from the top left pixel; an organ's own length is its chord less those of its children",
};

#[derive(Debug, Serialize)]
struct SceneRecord {
    name: String,
    source: String,
    description: String,
    organs: Vec<OrganRecord>,
}

/// One organ, as it was projected or as `check` found it.
#[derive(Debug, Serialize)]
pub struct OrganRecord {
    /// Its name.
    pub name: String,
    /// The organ it lies directly in.
    pub inside: Option<String>,
    /// How many organs enclose it.
    pub depth: usize,
    /// Where its surface came from.
    pub origin: String,
    /// What it is made of.
    pub material: &'static str,
    /// Its density, g/cm³.
    pub density_g_cm3: f64,
    /// Triangles of its surface.
    pub faces: usize,
    /// Pieces not joined by an edge.
    pub components: usize,
    /// The volume its surface encloses, mm³.
    pub volume_mm3: f64,
    /// The same without its children's, mm³.
    pub own_volume_mm3: f64,
    /// Whether it is proved convex.
    pub convex: bool,
    /// How far a vertex stands out of a face's plane at worst, mm, if convex.
    pub reflex_depth_mm: Option<f64>,
    /// What was mended.
    pub notices: Vec<String>,
}

impl OrganRecord {
    /// The record of `organ`, one of `organs`.
    pub fn of(organ: &Organ, organs: &[Organ]) -> Self {
        let surface = organ.body.surface();
        let proof = organ.body.convexity().ok();
        Self {
            name: organ.name.clone(),
            inside: organ.parent.map(|p| organs[p].name.clone()),
            depth: organ.depth,
            origin: match &organ.origin {
                Origin::Shapes(shapes) if shapes.len() == 1 => "shape".into(),
                Origin::Shapes(shapes) => format!("{} shapes", shapes.len()),
                Origin::Mesh { file, groups } if groups.is_empty() => file.clone(),
                Origin::Mesh { file, groups } => format!("{file}: {}", groups.join(", ")),
            },
            material: organ.material.name(),
            density_g_cm3: organ.density_g_cm3,
            faces: surface.mesh().faces.len(),
            components: surface.component_count(),
            volume_mm3: surface.volume_mm3(),
            own_volume_mm3: organ.own_volume_mm3(organs),
            convex: proof.is_some(),
            reflex_depth_mm: proof.map(|p| p.reflex_depth_mm()),
            notices: organ.notices.clone(),
        }
    }
}

#[derive(Debug, Serialize)]
struct PhotonRecord {
    #[serde(rename = "mean_energy_keV")]
    mean_energy_kev: f64,
    /// Energy in keV and share of the photons.
    #[serde(rename = "spectrum_keV_share")]
    spectrum: Vec<[f64; 2]>,
    response: crate::physics::DetectorResponse,
    #[serde(skip_serializing_if = "Option::is_none")]
    noise: Option<NoiseRecord>,
}

#[derive(Debug, Serialize)]
struct NoiseRecord {
    photons_per_pixel: f64,
    seed: u64,
}

impl PhotonRecord {
    fn of(
        spectrum: &Spectrum,
        response: crate::physics::DetectorResponse,
        noise: Option<PhotonNoise>,
    ) -> Self {
        Self {
            mean_energy_kev: spectrum.mean_energy_kev(),
            spectrum: spectrum.bins().iter().map(|bin| [bin.energy_kev, bin.weight]).collect(),
            response,
            noise: noise.map(|n| NoiseRecord { photons_per_pixel: n.photons_per_pixel(), seed: n.seed() }),
        }
    }
}

/// One view: its pose and its files.
#[derive(Debug, Serialize)]
pub struct ViewRecord {
    label: String,
    beam: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    iec: Option<crate::scene::iec::IecAngles>,
    source_mm: [f64; 3],
    source_to_detector_mm: f64,
    first_pixel_mm: [f64; 3],
    column_axis: [f64; 3],
    row_axis: [f64; 3],
    pixel_mm: [f64; 2],
    pixels: [u32; 2],
    /// From homogeneous patient mm to homogeneous column and row; none for parallel rays.
    #[serde(skip_serializing_if = "Option::is_none")]
    matrix_patient_mm_to_pixel: Option<[[f64; 4]; 3]>,
    files: Vec<WrittenFile>,
}

impl ViewRecord {
    /// The record of `view`, called `label`, with the files written for it.
    pub fn of(view: &View, label: String, files: Vec<WrittenFile>) -> Self {
        let [column_axis, row_axis, _] = view.direction().map(|axis| axis.to_array());
        let (width, height) = view.spacing_mm();
        let (columns, rows) = view.size();
        Self {
            label,
            beam: if view.is_parallel() { "parallel" } else { "cone" },
            iec: match view.pose() {
                Pose::Iec { angles, .. } => Some(*angles),
                _ => None,
            },
            source_mm: view.source_mm().to_array(),
            source_to_detector_mm: view.source_to_detector_mm(),
            first_pixel_mm: view.origin_mm().to_array(),
            column_axis,
            row_axis,
            pixel_mm: [width, height],
            pixels: [columns, rows],
            matrix_patient_mm_to_pixel: view.matrix(),
            files,
        }
    }
}

/// What a run did and cost.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// How lengths were found.
    pub method: &'static str,
    /// What was chosen and why, if the method is to choose.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub choice: Option<String>,
    /// For each organ, if the method is to choose.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub choices: Vec<ChoiceRecord>,
    /// Views projected.
    pub views: usize,
    /// Organs in the scene.
    pub organs: usize,
    /// Rays, and what was skipped.
    #[serde(flatten)]
    pub counts: RayCounts,
    /// How many organs each exact engine traced, counted per view. Organs in trees are not among them.
    pub engines: BTreeMap<Engine, u64>,
    /// What RI-trees did, if they were used.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ritree: Option<TreeSummary>,
    /// Wall-clock seconds per stage.
    pub seconds: BTreeMap<&'static str, f64>,
    /// Threads that worked.
    pub threads: usize,
    /// The most memory the process held, bytes; none where the system does not tell.
    pub peak_bytes: Option<u64>,
    /// Files written, and their bytes.
    pub files: usize,
    /// Bytes written.
    pub bytes_written: u64,
}

/// What was chosen for one organ.
#[derive(Clone, Debug, Serialize)]
pub struct ChoiceRecord {
    /// Its name.
    pub organ: String,
    /// `ritree`, or the exact engine of least estimated cost.
    pub chosen: &'static str,
    /// What decided.
    #[serde(flatten)]
    pub estimate: Estimate,
}

/// What RI-trees did in a run.
#[derive(Clone, Debug, Serialize)]
pub struct TreeSummary {
    /// How they were grown.
    pub settings: TreeSettings,
    /// What became of the rays that asked them.
    pub queries: QueryCounts,
    /// What they are made of and what building took.
    pub trees: ForestReport,
    /// Errors of interpolated lengths on a seeded sample of the run's rays, mm.
    pub sampled_error_mm: Option<Figures>,
}

impl Sidecar {
    /// The record of a run.
    pub fn new(scene: &Scene, noise: Option<PhotonNoise>, views: Vec<ViewRecord>, summary: Summary) -> Self {
        Self {
            program: "chordfield",
            version: env!("CARGO_PKG_VERSION"),
            notice: "primary radiation only, no scatter; not for clinical use",
            frames: FRAMES,
            scene: SceneRecord {
                name: scene.name.clone(),
                source: scene.source.clone(),
                description: scene.description.clone(),
                organs: scene.organs.iter().map(|o| OrganRecord::of(o, &scene.organs)).collect(),
            },
            photons: PhotonRecord::of(&scene.spectrum, scene.response, noise),
            views,
            summary,
        }
    }

    /// What the run did and cost.
    pub fn summary(&self) -> &Summary {
        &self.summary
    }
}
