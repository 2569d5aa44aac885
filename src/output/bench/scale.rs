//! Cost as one quantity grows.

use std::fmt::Write as _;

use super::{COLD_AND_WARM, Named, TIMES, machine, seconds, times};
use crate::modes::bench::scale::{Fit, ScaleReport, ScaleRow, Study, methods};
use crate::output::page::curves::{Axis, COLOURS, Curve, Curves, Point, Spacing};
use crate::output::page::{document, escape, grouped, short};

pub fn files(report: &ScaleReport) -> Vec<Named> {
    let mut files = vec![("scale.html".into(), page(report)), ("scale.csv".into(), csv(report))];
    for study in &report.studies {
        let svg = plot(study).file();
        if !svg.is_empty() {
            let word = study.name.split([' ', ',']).next().unwrap_or_default();
            files.push((format!("scale-{word}.svg"), svg));
        }
    }
    files
}

/// Seconds over size: cold drawn through, warm dashed. Where each size has a method of its own, they make one curve.
fn plot(study: &Study) -> Curves<'_> {
    let methods = methods(&study.rows);
    let is_one = methods.len() == study.rows.len();
    let groups: Vec<(String, Vec<&ScaleRow>)> = if is_one {
        vec![("--method ritree".into(), study.rows.iter().collect())]
    } else {
        let own = |m: &str| study.rows.iter().filter(|row| row.options == m).collect();
        methods.into_iter().map(|m| (m.to_owned(), own(m))).collect()
    };
    let curve = |i: usize, name: &str, rows: &[&ScaleRow], is_warm: bool| Curve {
        name: if is_warm { String::new() } else { name.trim_start_matches("--method ").into() },
        colour: COLOURS[i % COLOURS.len()],
        points: rows
            .iter()
            .map(|row| Point {
                x: row.size,
                y: if is_warm { row.warm.seconds } else { row.cold.seconds },
                name: format!("{name}, {}", if is_warm { "warm" } else { "cold" }),
            })
            .collect(),
        dashed: is_warm,
    };
    let both = groups
        .iter()
        .enumerate()
        .flat_map(|(i, (name, rows))| [false, true].map(|is_warm| curve(i, name, rows, is_warm)));
    Curves {
        across: Axis { name: study.name, spacing: Spacing::Logarithmic },
        up: Axis { name: "seconds", spacing: Spacing::Logarithmic },
        curves: both.collect(),
    }
}

fn page(report: &ScaleReport) -> String {
    let mut sections = vec![("", machine(&report.machine, &report.command, report.complete, COLD_AND_WARM))];
    for study in &report.studies {
        sections.push((study.name, section(study)));
    }
    document("Cost and scale", &sections)
}

fn section(study: &Study) -> String {
    let row = |row: &ScaleRow| {
        format!(
            "<tr><td>{}</td><th><code>{}</code></th><td>{}</td><td>{}</td><td>{}</td><td>{}</td>\
             <td>{}</td></tr>",
            short(row.size),
            row.options,
            seconds(&row.cold),
            seconds(&row.warm),
            short(row.load_s),
            short(row.tree_bytes as f64 / 1e6),
            grouped(row.tree_cells),
        )
    };
    let rows: String = study.rows.iter().map(row).collect();
    format!(
        "<p>{}. Drawn through: cold; dashed: warm.</p>{}{}<details><summary>All figures</summary><div class=\"wide\"><table><thead><tr><th>{}</th><th>method</th>\
         <th>cold, s</th><th>warm, s</th><th>reading the scene, s</th><th>trees, MB</th><th>cells looked at</th></tr></thead>\
         <tbody>{rows}</tbody></table></div></details>",
        escape(&study.setup),
        plot(study).html(),
        fits(study),
        study.name,
    )
}

fn fits(study: &Study) -> String {
    if study.fits.is_empty() {
        return String::new();
    }
    let end = |size: Option<f64>| size.map_or_else(|| "–".into(), short);
    let row = |fit: &Fit| {
        format!(
            "<tr><th><code>{}</code></th><td>{:.2}</td><td>{:.2}</td><td>{}</td><td>{}</td></tr>",
            fit.options,
            fit.cold_exponent,
            fit.warm_exponent,
            end(fit.size_at_a_minute),
            end(fit.size_at_full_memory)
        )
    };
    let rows: String = study.fits.iter().map(row).collect();
    format!(
        "<div class=\"wide\"><table><thead><tr><th>cost ∝ {}^exponent</th><th>exponent, cold</th><th>warm</th>\
         <th>a minute at</th><th>memory full at</th></tr></thead><tbody>{rows}</tbody></table></div>",
        study.name
    )
}

fn csv(report: &ScaleReport) -> String {
    let mut text = format!("study,size,options,{TIMES},load_s,scene_bytes,tree_bytes,tree_cells\n");
    for study in &report.studies {
        for row in &study.rows {
            let _ = writeln!(
                text,
                "\"{}\",{},{},{},{},{},{},{}",
                study.name,
                row.size,
                row.options,
                times(&row.cold, &row.warm),
                row.load_s,
                row.scene_bytes.map(|b| b.to_string()).unwrap_or_default(),
                row.tree_bytes,
                row.tree_cells,
            );
        }
    }
    text
}

/// As text for a terminal.
pub fn table(report: &ScaleReport) -> String {
    let mut text = String::new();
    for study in &report.studies {
        let _ = writeln!(text, "{}: {}", study.name, study.setup);
        for row in &study.rows {
            let cells = match row.tree_cells {
                0 => String::new(),
                cells => format!("{cells:>12} cells"),
            };
            let _ = writeln!(
                text,
                "{:>10}  {:44}{:>10} s cold{:>10} s warm{cells}",
                short(row.size),
                row.options,
                seconds(&row.cold),
                seconds(&row.warm)
            );
        }
        for fit in &study.fits {
            let ends = [("a minute", fit.size_at_a_minute), ("memory full", fit.size_at_full_memory)];
            let end = |(what, size): (&str, Option<f64>)| {
                size.map_or(String::new(), |size| format!("; {what} at {}", short(size)))
            };
            let end: String = ends.into_iter().map(end).collect();
            let _ = writeln!(
                text,
                "            {:44}∝ size^{:.2} cold, ^{:.2} warm{end}",
                fit.options, fit.cold_exponent, fit.warm_exponent
            );
        }
    }
    text
}
