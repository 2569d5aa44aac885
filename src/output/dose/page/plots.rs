//! The pictures and plots of a study's page.

use std::collections::BTreeMap;

use super::{degrees, field_name, leading};
use crate::error::Result;
use crate::modes::dose::{BeamFigures, DepthCurve, DepthPoint, DoseReport, FieldFigures, FieldPicture};
use crate::output::image::{RgbImage, image_of};
use crate::output::page::curves::{Axis, COLOURS, Curve, Curves, Point, Spacing};
use crate::output::page::polar::Polar;
use crate::output::page::{base64, escape, short};
use crate::output::png;

/// Polar plots of a page.
const PLOTS: usize = 4;

/// Fewer gantry angles make no polar plot.
const LEAST_ANGLES: usize = 3;

/// The colour of paths over a picture, and how much of it there is.
const MARK: [f32; 3] = [255.0, 120.0, 0.0];
const MARK_SHARE: f32 = 0.6;

/// Fields that differ in the gantry's angle only: a curve round the patient.
fn rounds(report: &DoseReport) -> Vec<(String, Vec<&FieldFigures>)> {
    let mut groups: BTreeMap<String, Vec<&FieldFigures>> = BTreeMap::new();
    for field in &report.fields {
        let (Some(angles), Some(case)) = (&field.angles, report.cases.get(field.case)) else { continue };
        let swept = report.study.parameters.iter().zip(&case.values);
        let others = swept.filter(|(name, _)| !name.ends_with("gantry_deg"));
        let mut name: Vec<String> = others.map(|(name, value)| format!("{name} {value}")).collect();
        if angles.couch_deg != 0.0 {
            name.push(format!("couch {}°", degrees(angles.couch_deg)));
        }
        groups.entry(name.join(", ")).or_default().push(field);
    }
    groups.into_iter().filter(|(_, fields)| fields.len() >= LEAST_ANGLES).take(PLOTS).collect()
}

/// Polar plots of what organs absorb, round the patient.
pub fn polar(report: &DoseReport) -> String {
    let plot = |(name, fields): (String, Vec<&FieldFigures>)| {
        let organs = leading(fields.iter().map(|field| &field.figures));
        let curve = |(i, organ): (usize, String)| Curve {
            points: fields
                .iter()
                .filter_map(|field| {
                    let share = share_of(&field.figures, &organ);
                    Some(Point {
                        x: field.angles.as_ref()?.gantry_deg,
                        y: 100.0 * share,
                        name: organ.clone(),
                    })
                })
                .collect(),
            name: organ,
            colour: COLOURS[i % COLOURS.len()],
            dashed: false,
        };
        let curves = organs.into_iter().enumerate().map(curve).collect();
        let html = Polar { name: "% of the field's energy absorbed in the organ", curves }.html();
        if name.is_empty() { html } else { format!("<div><h3>{}</h3>{html}</div>", escape(&name)) }
    };
    let plots: Vec<String> = rounds(report).into_iter().map(plot).filter(|html| !html.is_empty()).collect();
    if plots.is_empty() { String::new() } else { format!("<div class=\"panels\">{}</div>", plots.concat()) }
}

fn share_of(beam: &BeamFigures, organ: &str) -> f64 {
    beam.organs.iter().find(|o| o.organ == organ).map_or(0.0, |o| o.absorbed_share)
}

/// A field's picture, with its paths.
pub fn picture_of(report: &DoseReport, picture: &FieldPicture) -> Result<String> {
    let [columns, rows] = picture.pixels.map(|n| n as usize);
    let most =
        picture.line_integral.iter().copied().filter(|p| p.is_finite()).fold(f32::MIN_POSITIVE, f32::max);
    let mut rgb: Vec<[f32; 3]> =
        picture.line_integral.iter().map(|p| [255.0 * (p / most).clamp(0.0, 1.0); 3]).collect();
    let mut is_marked = vec![false; rgb.len()];
    for [column, row] in &picture.marks {
        let (column, row) = (column.round(), row.round());
        // Paths beyond the picture have no mark.
        if (0.0..columns as f64).contains(&column) && (0.0..rows as f64).contains(&row) {
            is_marked[row as usize * columns + column as usize] = true;
        }
    }
    for (pixel, _) in rgb.iter_mut().zip(&is_marked).filter(|(_, marked)| **marked) {
        *pixel = std::array::from_fn(|c| (1.0 - MARK_SHARE) * pixel[c] + MARK_SHARE * MARK[c]);
    }
    let samples: Vec<u8> = rgb.iter().flatten().map(|v| v.round() as u8).collect();
    let image: RgbImage = image_of(columns, rows, samples)?;
    let name = escape(&field_name(report, picture.field));
    Ok(format!(
        "<figure><img alt=\"{name}\" src=\"data:image/png;base64,{}\"><figcaption><b>{name}</b> as seen from the source: p, \
         white {}; orange: paths; {} mm of the isocentre plane a side</figcaption></figure>",
        base64::encode(&png::rgb_bytes(&image)?),
        short(most.into()),
        short(picture.side_mm)
    ))
}

/// What is left of the photons along a path of a field.
pub fn depths(report: &DoseReport, curves: &[DepthCurve]) -> String {
    let plot = |curve: &DepthCurve| {
        let name = |organ: Option<usize>| {
            organ.and_then(|o| curve.organs.get(o)).map_or_else(|| "outside".into(), Clone::clone)
        };
        // From the first surface to the last: outside them, nothing happens.
        let first = curve.points.iter().position(|p| p.organ.is_some()).unwrap_or(1).saturating_sub(1);
        let last = curve.points.iter().rposition(|p| p.organ.is_some()).unwrap_or(first);
        type Share = fn(&DepthPoint) -> f64;
        let kinds: [(&str, Share); 3] = [
            ("reference energy", |p| p.transmission_reference),
            ("photons", |p| p.transmission_photons),
            ("energy", |p| p.transmission_energy),
        ];
        let line = |(i, (kind, share)): (usize, (&str, Share))| Curve {
            name: kind.into(),
            colour: COLOURS[i],
            points: curve.points[first..=last]
                .iter()
                .map(|p| Point {
                    x: p.depth_mm - curve.points[first].depth_mm,
                    y: share(p),
                    name: name(p.organ),
                })
                .collect(),
            dashed: false,
        };
        let plot = Curves {
            across: Axis { name: "depth behind the first surface, mm", spacing: Spacing::Linear },
            up: Axis { name: "share left", spacing: Spacing::Logarithmic },
            curves: kinds.into_iter().enumerate().map(line).collect(),
        };
        let mut order: Vec<String> = Vec::new();
        for point in &curve.points[first..=last] {
            let name = name(point.organ);
            if point.organ.is_some() && order.last() != Some(&name) {
                order.push(name);
            }
        }
        format!(
            "<div><h3>{}</h3>{}<p class=\"note\">Path {}, the nearest to the axis; through {}.</p></div>",
            escape(&field_name(report, curve.field)),
            plot.html(),
            curve.path,
            if order.is_empty() { "no organ".into() } else { escape(&order.join(", ")) }
        )
    };
    let all: String = curves.iter().map(plot).collect();
    if all.is_empty() { all } else { format!("<div class=\"panels\">{all}</div>") }
}
