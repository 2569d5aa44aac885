//! What `auto` chooses, against the best.

use std::fmt::Write as _;

use super::{Named, machine};
use crate::modes::bench::choice::{ChoiceCell, ChoiceReport};
use crate::output::page::{document, short};

pub fn files(report: &ChoiceReport) -> Vec<Named> {
    vec![("choice.html".into(), page(report)), ("choice.csv".into(), csv(report))]
}

/// What times are.
const FROM_COLD: &str =
    "all are from the scene as read to the last length of the views, with all trees and tables";

/// The ratio beyond which a choice is called a bad one.
const BAD: f64 = 1.3;

fn verdict(report: &ChoiceReport) -> String {
    let bad = report.cells.iter().filter(|cell| cell.ratio > BAD).count();
    format!(
        "{} studies; the worst choice takes {} times the best one's time, and {bad} take more than {BAD} times that",
        report.cells.len(),
        short(report.worst_ratio)
    )
}

fn measured(cell: &ChoiceCell) -> String {
    let words: Vec<String> =
        cell.seconds.iter().map(|(name, seconds)| format!("{name} {}", short(*seconds))).collect();
    words.join(", ")
}

fn page(report: &ChoiceReport) -> String {
    let row = |cell: &ChoiceCell| {
        let class = if cell.ratio > BAD { "strong" } else { "" };
        format!(
            "<tr class=\"{class}\"><td>{}</td><td>{}²</td><td>{}</td><td>{}</td><th>{}</th><td>{}</td><td>{}</td><td>{}</td>\
             <td>{}</td></tr>",
            cell.faces,
            cell.side,
            cell.views,
            cell.tolerance_mm,
            cell.chosen,
            short(cell.ratio),
            measured(cell),
            short(cell.estimate.exact_s),
            short(cell.estimate.tree_s)
        )
    };
    let rows: String = report.cells.iter().map(row).collect();
    let table = format!(
        "<p>{}.</p><div class=\"wide\"><table><thead><tr><th>faces</th><th>pixels</th><th>views</th><th>tolerance, mm</th>\
         <th>chosen</th><th>× the best</th><th>measured, s</th><th>estimate, exact</th><th>tree</th></tr></thead>\
         <tbody>{rows}</tbody></table></div>",
        verdict(report)
    );
    let lead = machine(&report.machine, &report.command, report.complete, FROM_COLD);
    document("What auto chooses", &[("", lead), ("Choices", table)])
}

fn csv(report: &ChoiceReport) -> String {
    let mut text = String::from(
        "faces,side,views,tolerance_mm,chosen,ratio,raster_s,walk_s,bvh_s,ritree_s,estimate_exact_s,estimate_tree_s,leaves\n",
    );
    for cell in &report.cells {
        let of = |name: &str| {
            let found = cell.seconds.iter().find(|(other, _)| *other == name);
            found.map(|(_, seconds)| seconds.to_string()).unwrap_or_default()
        };
        let _ = writeln!(
            text,
            "{},{},{},{},{},{},{},{},{},{},{},{},{}",
            cell.faces,
            cell.side,
            cell.views,
            cell.tolerance_mm,
            cell.chosen,
            cell.ratio,
            of("raster"),
            of("walk"),
            of("bvh"),
            of("ritree"),
            cell.estimate.exact_s,
            cell.estimate.tree_s,
            cell.leaves
        );
    }
    text
}

/// As text for a terminal.
pub fn table(report: &ChoiceReport) -> String {
    let mut text = format!(
        "{:>8}{:>8}{:>7}{:>10}  {:10}{:>8}  measured, s\n",
        "faces", "pixels", "views", "tol, mm", "chosen", "× best"
    );
    for cell in &report.cells {
        let _ = writeln!(
            text,
            "{:>8}{:>8}{:>7}{:>10}  {:10}{:>8}  {}",
            cell.faces,
            format!("{}²", cell.side),
            cell.views,
            cell.tolerance_mm,
            cell.chosen,
            format!("{:.2}", cell.ratio),
            measured(cell)
        );
    }
    text + &verdict(report) + "\n"
}
