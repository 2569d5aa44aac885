//! The tables of paths: written block by block while a study runs, so that memory does not grow with the study.

use std::path::Path;

use super::rows::{Format, Rows};
use crate::error::Result;
use crate::modes::dose::{Block, Keeper, OrganRow, PathRow};
use crate::output::AtomicFile;
use crate::study::{Case, Study};

/// What stands for the part outside every organ.
const OUTSIDE: &str = "(outside)";

/// A table of paths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Table {
    /// One row for each path.
    Paths,
    /// One row for each path and organ, and one for the part outside.
    Organs,
    /// One row for each stretch of a path in one organ.
    Segments,
}

const PATH_HEADS: [&str; 26] = [
    "case",
    "field",
    "path",
    "target",
    "source_x_mm",
    "source_y_mm",
    "source_z_mm",
    "target_x_mm",
    "target_y_mm",
    "target_z_mm",
    "length_mm",
    "outside_mm",
    "mass_thickness_g_cm2",
    "mu_length",
    "water_equivalent_by_mu_mm",
    "water_equivalent_by_electrons_mm",
    "transmission_at_reference_energy",
    "transmission_of_photons",
    "transmission_of_signal",
    "mean_energy_at_target_keV",
    "inverse_square",
    "fluence_at_target",
    "target_organ",
    "collision_kerma_pGy_cm2",
    "water_collision_kerma_pGy_cm2",
    "remark",
];

const ORGAN_HEADS: [&str; 16] = [
    "case",
    "field",
    "path",
    "organ",
    "order",
    "segments",
    "places",
    "own_length_mm",
    "entry_mm",
    "exit_mm",
    "mass_thickness_g_cm2",
    "mu_length",
    "water_equivalent_by_mu_mm",
    "water_equivalent_by_electrons_mm",
    "transmission_at_reference_energy",
    "energy_imparted_keV_per_photon",
];

const SEGMENT_HEADS: [&str; 8] =
    ["case", "field", "path", "place", "organ", "entry_mm", "exit_mm", "length_mm"];

impl Table {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Paths, Self::Organs, Self::Segments];

    /// The file's name without its ending.
    pub fn stem(self) -> &'static str {
        match self {
            Self::Paths => "paths",
            Self::Organs => "path_organs",
            Self::Segments => "path_segments",
        }
    }

    fn heads(self) -> &'static [&'static str] {
        match self {
            Self::Paths => &PATH_HEADS,
            Self::Organs => &ORGAN_HEADS,
            Self::Segments => &SEGMENT_HEADS,
        }
    }

    /// A block's rows.
    fn rows(self, format: Format, study: &Study, block: &Block) -> String {
        let mut rows = Rows::new(format, self.heads());
        let field = &study.fields()[block.field];
        let case = study.case_of(field);
        let organs = &study.scene_of(case).organs;
        let at = At { case, ids: [field.case() as u64, block.field as u64], first_path: field.first_path() };
        let name = |organ: usize| organs[organ].name.as_str();
        for path in &block.paths {
            match self {
                Self::Paths => at.path(path, &name, &mut rows),
                Self::Organs => at.organs(path, block, &name, &mut rows),
                Self::Segments => at.segments(path, block, &name, &mut rows),
            }
        }
        rows.text()
    }
}

/// Where a block's rows stand.
struct At<'a> {
    case: &'a Case,
    /// Case and field.
    ids: [u64; 2],
    first_path: u64,
}

impl At<'_> {
    fn begin(&self, path: &PathRow, rows: &mut Rows) {
        rows.count(self.ids[0]).count(self.ids[1]).count(path.number);
    }

    fn path<'o>(&self, path: &PathRow, name: &dyn Fn(usize) -> &'o str, rows: &mut Rows) {
        self.begin(path, rows);
        rows.word(self.case.point_name(path.number - self.first_path).unwrap_or_default());
        rows.point(path.shot.source_mm.to_array()).point(path.shot.target_mm().to_array());
        rows.number(path.length_mm).number(path.outside_mm).number(path.mass_g_cm2).number(path.mu_length);
        rows.number(path.water_by_mu_mm).number(path.water_by_electrons_mm);
        rows.number(path.transmission_reference).number(path.transmission_photons);
        rows.number(path.transmission_signal).maybe(path.mean_energy_kev);
        rows.number(path.inverse_square).number(path.fluence);
        rows.word(path.target_organ.map(name).unwrap_or_default());
        rows.maybe(path.kerma_pgy_cm2).number(path.water_kerma_pgy_cm2);
        rows.word(&remark(path, name)).end();
    }

    fn organs<'o>(&self, path: &PathRow, block: &Block, name: &dyn Fn(usize) -> &'o str, rows: &mut Rows) {
        for organ in &block.organs[path.organs.clone()] {
            self.begin(path, rows);
            rows.word(name(organ.organ)).count(organ.order.into()).count(organ.segments.into());
            rows.word(&places(path, organ, block));
            rows.number(organ.own_length_mm).number(organ.entry_mm).number(organ.exit_mm);
            rows.number(organ.mass_g_cm2).number(organ.mu_length);
            rows.number(organ.water_by_mu_mm).number(organ.water_by_electrons_mm);
            rows.number((-organ.mu_length).exp()).number(organ.absorbed_kev).end();
        }
        self.begin(path, rows);
        rows.word(OUTSIDE).word("").word("").word("").number(path.outside_mm).maybe(None).maybe(None);
        rows.number(0.0).number(0.0).number(0.0).number(0.0).number(1.0).number(0.0).end();
    }

    fn segments<'o>(&self, path: &PathRow, block: &Block, name: &dyn Fn(usize) -> &'o str, rows: &mut Rows) {
        for (place, stretch) in (1..).zip(&block.stretches[path.stretches.clone()]) {
            self.begin(path, rows);
            rows.count(place).word(name(stretch.organ)).number(stretch.entry_mm).number(stretch.exit_mm);
            rows.number(stretch.exit_mm - stretch.entry_mm).end();
        }
    }
}

/// The places of an organ's stretches in the path's sequence, from 1: `2;4`.
fn places(path: &PathRow, organ: &OrganRow, block: &Block) -> String {
    let mut text = String::new();
    for (place, stretch) in (1_u32..).zip(&block.stretches[path.stretches.clone()]) {
        if stretch.organ == organ.organ {
            if !text.is_empty() {
                text.push(';');
            }
            text.push_str(&place.to_string());
        }
    }
    text
}

/// What is worth saying of a path.
fn remark<'o>(path: &PathRow, name: &dyn Fn(usize) -> &'o str) -> String {
    let mut remarks = Vec::new();
    if path.organs.is_empty() {
        remarks.push("meets no organ".into());
    }
    if let Some(organ) = path.source_organ {
        remarks.push(format!("source inside {}", name(organ)));
    }
    if path.target_outside {
        remarks.push("target outside the scene".into());
    }
    remarks.join("; ")
}

/// Files of tables of paths, being written.
pub struct PathFiles {
    files: Vec<(Table, Format, AtomicFile)>,
}

impl PathFiles {
    /// Begins the files of these tables, each in these formats.
    ///
    /// # Errors
    /// If the folder cannot be written.
    pub fn begin(folder: &Path, tables: &[Table], formats: &[Format]) -> Result<Self> {
        let mut files = Vec::new();
        for &table in tables {
            for &format in formats {
                let mut file = AtomicFile::begin(&folder.join(name(table, format)))?;
                file.append(Rows::new(format, table.heads()).head(&[]).as_bytes())?;
                files.push((table, format, file));
            }
        }
        Ok(Self { files })
    }

    /// Lets the files appear; returns their names.
    ///
    /// # Errors
    /// If the disk refuses.
    pub fn commit(self) -> Result<Vec<String>> {
        self.files
            .into_iter()
            .map(|(table, format, file)| file.commit().map(|()| name(table, format)))
            .collect()
    }
}

/// A table's file.
pub(super) fn name(table: Table, format: Format) -> String {
    format!("{}.{}", table.stem(), format.ending())
}

impl Keeper for PathFiles {
    type Kept = Vec<String>;

    fn keep(&self, study: &Study, block: &Block) -> Vec<String> {
        self.files.iter().map(|(table, format, _)| table.rows(*format, study, block)).collect()
    }

    fn take(&mut self, kept: Vec<String>) -> Result<()> {
        self.files.iter_mut().zip(kept).try_for_each(|((.., file), text)| file.append(text.as_bytes()))
    }
}
