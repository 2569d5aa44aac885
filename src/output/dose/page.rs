//! The report of a study as one page of HTML.

mod plots;

use std::collections::BTreeMap;
use std::fmt::Write as _;

use crate::error::Result;
use crate::modes::dose::{BeamFigures, CaseFigures, DoseReport, Illustrations};
use crate::output::page::curves::{Axis, COLOURS, Curve, Curves, Point, Spacing};
use crate::output::page::{document, escape, grouped, short};
use plots::{depths, picture_of, polar};

/// Organs that have a curve of their own.
const CURVES: usize = 6;

/// Cases that have a table.
const CASES: usize = 12;

/// The whole page.
///
/// # Errors
/// If a picture cannot be encoded.
pub fn page(report: &DoseReport, shown: &Illustrations) -> Result<String> {
    let pictures: String =
        shown.pictures.iter().map(|picture| picture_of(report, picture)).collect::<Result<_>>()?;
    let pictures = if pictures.is_empty() {
        String::new()
    } else {
        format!("<div class=\"panels many\">{pictures}</div>")
    };
    Ok(document(
        &format!("Dose paths: {}", report.study.name),
        &[
            ("", what(report)),
            ("", tiles(report)),
            ("Round the patient", polar(report)),
            ("Fields over the phantom", pictures),
            ("What is left on the way", depths(report, &shown.depths)),
            ("Organs", cases(report)),
            ("Own lengths", histograms(report)),
            ("Errors of lengths", errors(report)),
            ("How to read it", definitions()),
        ],
    ))
}

fn what(report: &DoseReport) -> String {
    let study = &report.study;
    let inputs: String = study
        .inputs
        .iter()
        .map(|input| {
            format!("<br>{} {} sha256 {}", escape(&input.role), escape(&input.file), escape(&input.sha256))
        })
        .collect();
    let settings: String = study.settings.iter().map(|s| format!("<br>set {}", escape(s))).collect();
    format!(
        "<p class=\"lead\">{}</p><p><b>Primary radiation only: no scatter, not for clinical use.</b></p>\
         <p class=\"command\"><code>{}</code><br>{} {}{inputs}{settings}</p>",
        escape(&study.description),
        escape(&report.command),
        report.program,
        report.version
    )
}

fn tiles(report: &DoseReport) -> String {
    let tile = |value: String, words: String| format!("<div><b>{value}</b>{words}</div>");
    let mut all = vec![
        tile(grouped(report.paths), format!("paths in {} fields", grouped(report.fields.len() as u64))),
        tile(
            grouped(report.cases.len() as u64),
            match report.study.parameters.is_empty() {
                true => "case".into(),
                false => format!("cases, swept over {}", escape(&report.study.parameters.join(", "))),
            },
        ),
    ];
    if let [case] = &report.cases[..] {
        all.push(tile(
            format!("{} %", percent(case.figures.transmitted_photons)),
            "of photons left at the ends".into(),
        ));
        all.push(tile(
            format!("{} %", percent(case.figures.absorbed_energy)),
            "of the energy absorbed at first interactions".into(),
        ));
    }
    let worst = report.errors.iter().map(|e| e.length_mm.max).reduce(f64::max);
    all.extend(worst.map(|mm| {
        tile(
            format!("{} mm", short(mm)),
            format!("largest error of a length by {}, on a sample", report.method),
        )
    }));
    format!("<div class=\"tiles\">{}</div>", all.concat())
}

fn percent(share: f64) -> String {
    short(100.0 * share)
}

/// The organs that absorb most over some beams.
fn leading<'a>(beams: impl Iterator<Item = &'a BeamFigures>) -> Vec<String> {
    let mut sums: BTreeMap<&str, f64> = BTreeMap::new();
    for organ in beams.flat_map(|beam| &beam.organs) {
        *sums.entry(&organ.organ).or_default() += organ.absorbed_share;
    }
    let mut all: Vec<(&str, f64)> = sums.into_iter().collect();
    all.sort_by(|a, b| b.1.total_cmp(&a.1));
    all.into_iter().take(CURVES).map(|(name, _)| name.to_owned()).collect()
}

/// An angle to a hundredth, without zeros at its end.
fn degrees(angle: f64) -> String {
    format!("{}", (angle * 100.0).round() / 100.0)
}

/// What a field is called: its angles, and what is swept.
fn field_name(report: &DoseReport, index: usize) -> String {
    let Some(field) = report.fields.get(index) else { return String::new() };
    let mut words: Vec<String> = field
        .angles
        .iter()
        .map(|angles| {
            let couch = if angles.couch_deg == 0.0 {
                String::new()
            } else {
                format!(", couch {}°", degrees(angles.couch_deg))
            };
            format!("gantry {}°{couch}", degrees(angles.gantry_deg))
        })
        .collect();
    if let Some(case) = report.cases.get(field.case) {
        let swept = report.study.parameters.iter().zip(&case.values);
        words.extend(
            swept.filter(|(name, _)| !name.ends_with("_deg")).map(|(name, value)| format!("{name} {value}")),
        );
    }
    if words.is_empty() { format!("field {index}") } else { words.join(", ") }
}

fn case_name(report: &DoseReport, case: &CaseFigures) -> String {
    let swept = report.study.parameters.iter().zip(&case.values);
    let words: Vec<String> = swept.map(|(name, value)| format!("{name} {value}")).collect();
    if words.is_empty() { case.scene.clone() } else { words.join(", ") }
}

fn cases(report: &DoseReport) -> String {
    let mut html = String::new();
    for case in report.cases.iter().take(CASES) {
        let figures = &case.figures;
        let mut organs: Vec<_> = figures.organs.iter().collect();
        organs.sort_by(|a, b| b.absorbed_share.total_cmp(&a.absorbed_share));
        let rows: String = organs
            .iter()
            .map(|o| {
                let some = |value: Option<f64>, unit: f64| value.map_or_else(|| "–".into(), |v| short(v / unit));
                format!(
                    "<tr><th>{}</th><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
                    escape(&o.organ),
                    percent(o.met_share),
                    short(o.mean_length_mm),
                    short(o.shortest_mm),
                    short(o.longest_mm),
                    short(o.mean_mu_length),
                    short(o.energy_imparted_kev),
                    percent(o.absorbed_share),
                    some(o.area_mm2, 100.0),
                    some(o.volume_mm3, 1000.0),
                )
            })
            .collect();
        let _ = write!(
            html,
            "<h3>{}</h3><p>{} paths over {} control points, {} keV photons on average: {} % of the photons and {} % of their \
             energy left at the ends; {} % of the energy absorbed in organs.</p><div class=\"wide\"><table><thead><tr><th>organ</th>\
             <th>met by, %</th><th>mean length, mm</th><th>least</th><th>most</th><th>mean μL</th><th>imparted, keV per photon</th>\
             <th>absorbed, %</th><th>area, cm²</th><th>volume, cm³</th></tr></thead><tbody>{rows}</tbody></table></div>",
            escape(&case_name(report, case)),
            grouped(figures.paths),
            case.control_points,
            short(case.mean_energy_kev),
            percent(figures.transmitted_photons),
            percent(figures.transmitted_energy),
            percent(figures.absorbed_energy),
        );
    }
    if report.cases.len() > CASES {
        let _ = write!(
            html,
            "<p class=\"note\">{} more cases are in the tables.</p>",
            report.cases.len() - CASES
        );
    }
    html
}

/// Length-area histograms of the organs that absorb most, over the first case.
fn histograms(report: &DoseReport) -> String {
    let Some(case) = report.cases.first() else { return String::new() };
    let organs = leading(std::iter::once(&case.figures));
    let curve = |(i, name): (usize, &String)| {
        let organ = case.figures.organs.iter().find(|o| &o.organ == name)?;
        let points = organ.histogram.iter().filter_map(|bar| {
            let middle = 0.5 * (bar.from_mm + bar.to_mm?);
            Some(Point {
                x: middle,
                y: bar.area_mm2.map_or(bar.paths as f64, |a| a / 100.0),
                name: name.clone(),
            })
        });
        Some(Curve {
            name: name.clone(),
            colour: COLOURS[i % COLOURS.len()],
            points: points.collect(),
            dashed: false,
        })
    };
    let has_area = case.figures.organs.iter().any(|o| o.area_mm2.is_some());
    let plot = Curves {
        across: Axis { name: "own length, mm", spacing: Spacing::Linear },
        up: Axis {
            name: if has_area { "area of the isocentre plane, cm² per bin" } else { "paths per bin" },
            spacing: Spacing::Linear,
        },
        curves: organs.iter().enumerate().filter_map(curve).collect(),
    };
    let html = plot.html();
    if html.is_empty() || report.cases.len() == 1 {
        html
    } else {
        format!("<p>Of the first case, {}.</p>{html}", escape(&case_name(report, case)))
    }
}

fn errors(report: &DoseReport) -> String {
    let rows: String = report
        .errors
        .iter()
        .map(|e| {
            format!(
                "<tr><th>{}</th><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
                escape(&e.scene),
                grouped(e.paths),
                short(e.length_mm.mean),
                short(e.length_mm.p99),
                short(e.length_mm.p999),
                short(e.length_mm.max),
                short(e.transmission.max)
            )
        })
        .collect();
    if rows.is_empty() {
        return rows;
    }
    format!(
        "<p>Lengths by <b>{}</b> against exact clipping, on a seeded sample of the study's paths.</p><div class=\"wide\"><table>\
         <thead><tr><th>scene</th><th>paths</th><th>mean, mm</th><th>p99</th><th>p99.9</th><th>max</th><th>max ΔT</th></tr></thead>\
         <tbody>{rows}</tbody></table></div>",
        report.method
    )
}

fn definitions() -> String {
    "<dl><dt>Own length</dt><dd>In an organ and in none of the organs within it. Own lengths and the part outside add up to \
     the path.</dd><dt>Imparted, absorbed</dt><dd>Of the energy that the primary photons lose in the organ, the share μ_en/μ: \
     what is absorbed where they first interact. Scattered photons are not followed.</dd><dt>Reference energy</dt><dd>The \
     energy of quantities that are told for one energy; photons and energy are of the whole spectrum, which hardens on the way.\
     </dd><dt>Area, volume</dt><dd>Of the isocentre plane, and of the organ, that the paths stand for.</dd></dl>\
     <p class=\"note\">Primary radiation only: no scatter, not for clinical use.</p>"
        .into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modes::Control;
    use crate::modes::dose::{Dose, NoPaths};
    use crate::modes::project::Method;
    use crate::scene::{Folder, SceneText};
    use crate::study::Study;

    const STUDY: &str = r#"
        name = "round <the> sphere"
        scene = "calibration"
        [beam]
        sad_mm = 800
        isocentre = "sphere"
        control_points = [{ gantry_deg = "0..360:30" }]
        [paths]
        field = { circle_mm = 40, spacing_mm = 8 }
        [spectrum]
        kvp = 80
    "#;

    #[test]
    fn the_page_shows_each_part_and_names_cannot_become_markup() {
        let study = Study::build(&SceneText::new("study.toml", STUDY), &Folder::none(), &[], false);
        let study = study.expect("a study");
        let dose = Dose::new(&study, Method::Exact(None)).expect("ready");
        let report = dose.run(&mut NoPaths, &Control::none()).expect("a report");
        let shown = dose.illustrations(&Control::none()).expect("illustrations");
        let html = page(&report, &shown).expect("a page");
        for heading in [
            "Round the patient",
            "Fields over the phantom",
            "What is left on the way",
            "Organs",
            "Own lengths",
            "Errors of lengths",
        ] {
            assert!(html.contains(&format!("<h2>{heading}</h2>")), "{heading}");
        }
        assert_eq!(html.matches("<img ").count(), 4);
        assert!(html.contains("round &lt;the&gt; sphere") && !html.contains("NaN"));
        assert!(html.contains("gantry 90°") && html.contains("no scatter, not for clinical use"));
        // Without a study at hand, as for joined parts of another machine, the figures stand alone.
        let bare = page(&report, &Illustrations::default()).expect("a page");
        assert!(!bare.contains("<img ") && bare.contains("<h2>Organs</h2>"));
    }

    #[test]
    fn angles_are_written_as_people_do() {
        assert_eq!([30.0, -32.5, 0.125].map(degrees), ["30", "-32.5", "0.13"]);
    }
}
