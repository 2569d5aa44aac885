//! The files of a benchmark: a page to look at, plots, and all figures as JSON and CSV.
//!
//! | `bench curve` | `bench scale` | `bench paper` | `bench choice` | content |
//! |---|---|---|---|---|
//! | `curve.html` | `scale.html` | `paper.html` | `choice.html` | the report: one file, no network, no script |
//! | `curve.csv` | `scale.csv` | `paper.csv` | `choice.csv` | a row for each method, setting and size |
//! | `curve-cold.svg`, `curve-warm.svg` | `scale-faces.svg` … | `paper-tomatoes-distance-error.svg` … | | its plots |
//! | `curve.json` | `scale.json` | `paper.json` | `choice.json` | all figures; written last, so a folder without it holds an unfinished run |

mod choice;
mod curve;
mod paper;
mod scale;

use std::path::Path;

use serde::Serialize;

use super::page::{escape, short};
use super::{create_folder, json, remove_stale, write_atomically};
use crate::error::Result;

use crate::modes::bench::choice::ChoiceReport;
use crate::modes::bench::curve::CurveReport;
use crate::modes::bench::paper::PaperReport;
use crate::modes::bench::scale::ScaleReport;
use crate::modes::bench::{Machine, Times};

/// Writes the files of an error–time curve into `folder`, which is made if missing.
///
/// # Errors
/// The first file that cannot be written. Files are whole or absent.
pub fn write_curve(folder: &Path, report: &CurveReport) -> Result<()> {
    write(folder, "curve", &curve::files(report), report)
}

/// Writes the files of studies of scale into `folder`, which is made if missing.
///
/// # Errors
/// The first file that cannot be written. Files are whole or absent.
pub fn write_scale(folder: &Path, report: &ScaleReport) -> Result<()> {
    write(folder, "scale", &scale::files(report), report)
}

/// Writes the files of a study of choices into `folder`, which is made if missing.
///
/// # Errors
/// The first file that cannot be written. Files are whole or absent.
pub fn write_choice(folder: &Path, report: &ChoiceReport) -> Result<()> {
    write(folder, "choice", &choice::files(report), report)
}

/// The table of choices as text.
pub fn choice_table(report: &ChoiceReport) -> String {
    choice::table(report)
}

/// Writes the files of the paper's tables and figures into `folder`, which is made if missing.
///
/// # Errors
/// The first file that cannot be written. Files are whole or absent.
pub fn write_paper(folder: &Path, report: &PaperReport) -> Result<()> {
    write(folder, "paper", &paper::files(report), report)
}

/// The table of an error–time curve as text.
pub fn curve_table(report: &CurveReport) -> String {
    curve::table(report)
}

/// The tables of studies of scale as text.
pub fn scale_table(report: &ScaleReport) -> String {
    scale::table(report)
}

/// The paper's tables and ours as text.
pub fn paper_table(report: &PaperReport) -> String {
    paper::table(report)
}

/// A file's name and its text.
type Named = (String, String);

fn write(folder: &Path, name: &str, files: &[Named], report: &impl Serialize) -> Result<()> {
    create_folder(folder)?;
    let record = folder.join(format!("{name}.json"));
    remove_stale(&record)?;
    for (name, text) in files {
        write_atomically(&folder.join(name), |out| out.write_all(text.as_bytes()))?;
    }
    json::write(&record, report)?;
    Ok(())
}

/// What cold and warm mean in a table of methods.
const COLD_AND_WARM: &str = "<i>cold</i> is from the scene as read to the last length, with all trees and tables, <i>warm</i> \
                             the same views again";

/// Where and how times were measured, and by which command; `terms` says what is told in words of its own.
fn machine(machine: &Machine, command: &str, complete: bool, terms: &str) -> String {
    let build =
        if machine.optimized { "" } else { " <b>Built with debug assertions: times mean little.</b>" };
    let partial = if complete { "" } else { "<p><b>Interrupted: this is what was measured before.</b></p>" };
    format!(
        "<p class=\"lead\">{}, {} of {} cores, {}, {} instructions, {}.{build} Times are medians of rounds in which all \
         take turns, after one to warm up; {terms}.</p><p class=\"command\"><code>{}</code></p>{partial}",
        escape(&machine.processor),
        machine.threads,
        machine.cores,
        escape(&machine.system),
        machine.widest_instructions,
        machine.date,
        escape(command),
    )
}

/// The columns of [`times`] in a table of comma-separated values.
const TIMES: &str = "cold_s,cold_least_s,cold_most_s,warm_s,warm_least_s,warm_most_s,rounds";

/// Times cold and warm as those columns.
fn times(cold: &Times, warm: &Times) -> String {
    let of = |times: &Times| format!("{},{},{}", times.seconds, times.least, times.most);
    format!("{},{},{}", of(cold), of(warm), cold.rounds)
}

/// Seconds in few characters, with a mark if they are unsteady.
fn seconds(times: &Times) -> String {
    let mark = if times.unsteady { " ±" } else { "" };
    format!("{}{mark}", short(times.seconds))
}
