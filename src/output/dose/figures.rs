//! The tables of fields and cases.

use super::rows::{Format, Rows};
use crate::modes::dose::{BeamFigures, DoseReport, OrganFigures};

/// What is the same in the tables of fields and of cases.
const BEAM: [&str; 9] = [
    "paths",
    "paths_meeting_no_organ",
    "mean_length_mm",
    "mean_outside_mm",
    "transmission_of_photons",
    "transmission_of_energy",
    "transmission_at_reference_energy",
    "absorbed_share_of_energy",
    "organs_met",
];

const CASE_HEADS: [&str; 14] = [
    "case",
    "scene",
    "reference_energy_keV",
    "mean_energy_keV",
    "control_points",
    BEAM[0],
    BEAM[1],
    BEAM[2],
    BEAM[3],
    BEAM[4],
    BEAM[5],
    BEAM[6],
    BEAM[7],
    BEAM[8],
];

const FIELD_HEADS: [&str; 20] = [
    "case",
    "field",
    "control_point",
    "gantry_deg",
    "couch_deg",
    "collimator_deg",
    "source_x_mm",
    "source_y_mm",
    "source_z_mm",
    "weight",
    "weight_share",
    BEAM[0],
    BEAM[1],
    BEAM[2],
    BEAM[3],
    BEAM[4],
    BEAM[5],
    BEAM[6],
    BEAM[7],
    BEAM[8],
];

const ORGAN_HEADS: [&str; 15] = [
    "case",
    "field",
    "organ",
    "paths",
    "share_of_photons",
    "mean_own_length_mm",
    "shortest_own_length_mm",
    "longest_own_length_mm",
    "longest_path",
    "mean_mu_length",
    "energy_imparted_keV_per_photon",
    "absorbed_share_of_energy",
    "interacting_share_of_energy",
    "area_mm2",
    "volume_mm3",
];

const HISTOGRAM_HEADS: [&str; 8] =
    ["case", "field", "organ", "from_mm", "to_mm", "paths", "area_mm2", "volume_mm3"];

const ERROR_HEADS: [&str; 14] = [
    "scene",
    "organ",
    "quantity",
    "unit",
    "sampled_paths",
    "seed",
    "compared",
    "mean",
    "rms",
    "p50",
    "p95",
    "p99",
    "p99.9",
    "max",
];

/// The tables' file names, without endings.
pub const STEMS: [&str; 6] = ["cases", "case_organs", "fields", "field_organs", "histograms", "errors"];

/// All tables: file names without endings, and texts.
pub fn tables(report: &DoseReport, format: Format) -> [(&'static str, String); 6] {
    let [of_cases, of_case_organs, of_fields, of_field_organs, of_lengths, of_errors] = STEMS;
    [
        (of_cases, cases(report, format)),
        (of_case_organs, organs(report, format, false)),
        (of_fields, fields(report, format)),
        (of_field_organs, organs(report, format, true)),
        (of_lengths, histograms(report, format)),
        (of_errors, errors(report, format)),
    ]
}

/// One row for each case, with the swept parameters' values.
fn cases(report: &DoseReport, format: Format) -> String {
    let mut rows = Rows::new(format, &CASE_HEADS);
    for case in &report.cases {
        rows.count(case.case as u64).word(&case.scene).number(case.reference_energy_kev);
        rows.number(case.mean_energy_kev).count(case.control_points as u64);
        beam(&case.figures, &mut rows);
        values(report, &case.values, &mut rows);
        rows.end();
    }
    rows.head(&report.study.parameters) + &rows.text()
}

/// One row for each field, with the swept parameters' values.
fn fields(report: &DoseReport, format: Format) -> String {
    let mut rows = Rows::new(format, &FIELD_HEADS);
    for field in &report.fields {
        let angle = |of: fn(&crate::scene::iec::IecAngles) -> f64| field.angles.as_ref().map(of);
        rows.count(field.case as u64).count(field.field as u64).count(field.control_point as u64);
        rows.maybe(angle(|a| a.gantry_deg)).maybe(angle(|a| a.couch_deg)).maybe(angle(|a| a.collimator_deg));
        rows.point(field.source_mm.unwrap_or([f64::NAN; 3])).number(field.weight).number(field.share);
        beam(&field.figures, &mut rows);
        values(report, &report.cases[field.case].values, &mut rows);
        rows.end();
    }
    rows.head(&report.study.parameters) + &rows.text()
}

fn beam(figures: &BeamFigures, rows: &mut Rows) {
    rows.count(figures.paths).count(figures.paths_meeting_nothing);
    rows.number(figures.mean_length_mm).number(figures.mean_outside_mm);
    rows.number(figures.transmitted_photons).number(figures.transmitted_energy);
    rows.number(figures.transmission_reference).number(figures.absorbed_energy);
    rows.count(figures.organs.len() as u64);
}

fn values(report: &DoseReport, values: &[toml::Value], rows: &mut Rows) {
    for (name, value) in report.study.parameters.iter().zip(values) {
        rows.value(name, value);
    }
}

/// One row for each field and organ, or for each case and organ; first the swept parameters' values are the same in a case.
fn organs(report: &DoseReport, format: Format, of_fields: bool) -> String {
    let mut rows = Rows::new(format, &ORGAN_HEADS);
    each(report, of_fields, &mut |case, field, organ| {
        start(&mut rows, case, field).word(&organ.organ).count(organ.paths);
        rows.number(organ.met_share).number(organ.mean_length_mm);
        rows.number(organ.shortest_mm).number(organ.longest_mm).count(organ.longest_path);
        rows.number(organ.mean_mu_length).number(organ.energy_imparted_kev);
        rows.number(organ.absorbed_share).number(organ.removed_share);
        rows.maybe(organ.area_mm2).maybe(organ.volume_mm3);
        values(report, &report.cases[case].values, &mut rows);
        rows.end();
    });
    rows.head(&report.study.parameters) + &rows.text()
}

/// One row for each field, organ and bin of own length; then the same of cases, without a field.
fn histograms(report: &DoseReport, format: Format) -> String {
    let mut rows = Rows::new(format, &HISTOGRAM_HEADS);
    for of_fields in [true, false] {
        each(report, of_fields, &mut |case, field, organ| {
            for bar in &organ.histogram {
                start(&mut rows, case, field).word(&organ.organ).number(bar.from_mm).maybe(bar.to_mm);
                rows.count(bar.paths).maybe(bar.area_mm2).maybe(bar.volume_mm3).end();
            }
        });
    }
    rows.head(&[]) + &rows.text()
}

/// Each organ of all fields, or of all cases.
fn each(report: &DoseReport, of_fields: bool, row: &mut dyn FnMut(usize, Option<usize>, &OrganFigures)) {
    if of_fields {
        for field in &report.fields {
            field.figures.organs.iter().for_each(|organ| row(field.case, Some(field.field), organ));
        }
    } else {
        for case in &report.cases {
            case.figures.organs.iter().for_each(|organ| row(case.case, None, organ));
        }
    }
}

fn start(rows: &mut Rows, case: usize, field: Option<usize>) -> &mut Rows {
    rows.count(case as u64).maybe(field.map(|field| field as f64))
}

/// One row for each organ's lengths, and for all lengths and transmissions, of each sample.
fn errors(report: &DoseReport, format: Format) -> String {
    let mut rows = Rows::new(format, &ERROR_HEADS);
    for sample in &report.errors {
        let all = [
            ("all organs", "length", "mm", &sample.length_mm),
            ("all organs", "transmission", "1", &sample.transmission),
        ];
        let organs =
            sample.organs.iter().map(|organ| (organ.organ.as_str(), "length", "mm", &organ.length_mm));
        for (organ, quantity, unit, f) in all.into_iter().chain(organs) {
            rows.word(&sample.scene)
                .word(organ)
                .word(quantity)
                .word(unit)
                .count(sample.paths)
                .count(sample.seed);
            rows.count(f.compared).number(f.mean).number(f.rms);
            rows.number(f.p50).number(f.p95).number(f.p99).number(f.p999).number(f.max).end();
        }
    }
    rows.head(&[]) + &rows.text()
}
