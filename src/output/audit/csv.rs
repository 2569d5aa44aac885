//! An audit's figures as CSV (RFC 4180), with units in the heads of columns.

use std::borrow::Cow;
use std::fmt::Write as _;

use crate::modes::audit::{AuditReport, OrganFigures};
use crate::modes::figures::Figures;

/// The columns of [`Figures`].
const FIGURES: &str = "compared,mean_reference,bias,mean,rms,p50,p95,p99,p99.9,max,beyond_tolerance_share";

/// A row for each organ and kind of error; first all organs together.
pub fn organs(report: &AuditReport) -> String {
    let mut text = format!("organ,kind,quantity,unit,{FIGURES}\n");
    for organ in std::iter::once(&report.whole).chain(&report.organs) {
        for (kind, quantity, unit, figures) in kinds(organ) {
            let _ = writeln!(text, "{},{kind},{quantity},{unit},{}", field(&organ.organ), numbers(figures));
        }
    }
    text
}

fn kinds(organ: &OrganFigures) -> Vec<(&'static str, &'static str, &'static str, &Figures)> {
    let mut rows = Vec::new();
    let kinds = [
        ("method", Some(&organ.method)),
        ("accumulation", organ.accumulation.as_ref()),
        ("mesh", organ.mesh.as_ref()),
        ("total", organ.total.as_ref()),
    ];
    for (name, kind) in kinds.into_iter().filter_map(|(name, kind)| Some((name, kind?))) {
        rows.push((name, "length", "mm", &kind.length_mm));
        rows.push((name, "transmission", "1", &kind.transmission));
    }
    rows.push(("interpolated interior", "length", "mm", &organ.interpolated_interior_mm));
    rows.push(("interpolated silhouette", "length", "mm", &organ.interpolated_silhouette_mm));
    rows.push(("traced interior", "length", "mm", &organ.traced_interior_mm));
    rows.push(("traced silhouette", "length", "mm", &organ.traced_silhouette_mm));
    rows
}

/// Two rows for each view, or aim: its lengths and its transmissions.
pub fn sections(report: &AuditReport) -> String {
    let mut text = format!("section,gantry_deg,rays,interpolated,quantity,unit,{FIGURES}\n");
    for section in &report.sections {
        let gantry = section.gantry_deg.map(|deg| deg.to_string()).unwrap_or_default();
        let head = format!("{},{gantry},{},{}", field(&section.label), section.rays, section.interpolated);
        let _ = writeln!(text, "{head},length,mm,{}", numbers(&section.length_mm));
        let _ = writeln!(text, "{head},transmission,1,{}", numbers(&section.transmission));
    }
    text
}

/// A row for each organ and bar.
pub fn histogram(report: &AuditReport) -> String {
    let mut text = String::from("organ,error_from_mm,error_to_mm,interpolated,traced\n");
    for organ in std::iter::once(&report.whole).chain(&report.organs) {
        for bar in organ.histogram.iter().filter(|bar| bar.interpolated + bar.traced > 0) {
            let name = field(&organ.organ);
            let _ =
                writeln!(text, "{name},{},{},{},{}", bar.from_mm, bar.to_mm, bar.interpolated, bar.traced);
        }
    }
    text
}

/// A row for each of the worst rays.
pub fn worst(report: &AuditReport) -> String {
    let mut text = String::from(
        "rank,organ,error_mm,method_mm,reference_mm,found,cell_depth,rounding_mm,place,view,column,row,\
         source_x_mm,source_y_mm,source_z_mm,path_x_mm,path_y_mm,path_z_mm,reproduce\n",
    );
    for ray in &report.worst {
        let depth = ray.cell_depth.map(|d| d.to_string()).unwrap_or_default();
        let rounding = ray.rounding_mm.map(|mm| mm.to_string()).unwrap_or_default();
        let pixel = ray.pixel.map_or(",,".into(), |[view, column, row]| format!("{view},{column},{row}"));
        let [source, path] = [ray.source_mm, ray.path_mm].map(|[x, y, z]| format!("{x},{y},{z}"));
        let (organ, place, reproduce) = (field(&ray.organ), field(&ray.place), field(&ray.reproduce));
        let _ = writeln!(
            text,
            "{},{organ},{},{},{},{},{depth},{rounding},{place},{pixel},{source},{path},{reproduce}",
            ray.rank, ray.error_mm, ray.method_mm, ray.reference_mm, ray.found
        );
    }
    text
}

fn numbers(f: &Figures) -> String {
    let values =
        [f.mean_reference, f.bias, f.mean, f.rms, f.p50, f.p95, f.p99, f.p999, f.max, f.beyond_tolerance];
    let values: Vec<String> = values.iter().map(f64::to_string).collect();
    format!("{},{}", f.compared, values.join(","))
}

/// A text as one field, in quotes where it must be.
pub fn field(text: &str) -> Cow<'_, str> {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\"")).into()
    } else {
        text.into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commas_and_quotes_stay_within_their_field() {
        assert_eq!(field("left, \"lower\" lobe"), "\"left, \"\"lower\"\" lobe\"");
        assert_eq!(field("liver"), "liver");
    }
}
