//! The files of a dose-path study.
//!
//! | file | content |
//! |---|---|
//! | `paths.csv` | a row for each path |
//! | `path_organs.csv` | a row for each path and organ, and one for the part outside every organ |
//! | `path_segments.csv` | a row for each stretch of a path in one organ, in order |
//! | `cases.csv`, `fields.csv` | a row for each combination of the swept parameters; for each control point of it |
//! | `case_organs.csv`, `field_organs.csv` | a row for each of them and organ |
//! | `histograms.csv` | length-area and length-volume histograms of each of them and organ |
//! | `errors.csv` | errors against exact lengths on a sample of the paths |
//! | `dose.html` | the report to look at: one file, no network, no script |
//! | `dose.json` | all but the paths, with the study's hash, parameters and version; written last |
//!
//! Lengths are mm, energies keV, angles degrees; units stand in the heads. Tables can be had as JSON lines, too. A part of a study
//! (`shard-03-of-16/`) has the tables of its paths, and `sums.json`.

mod figures;
mod page;
mod paths;
mod rows;

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

pub use paths::{PathFiles, Table};
pub use rows::Format;

use super::{AtomicFile, json, write_atomically};
use crate::error::{Error, Result};
use crate::modes::dose::{DoseReport, Illustrations, Part, Shard};
use crate::scene::regular_file;
use crate::study::Study;

/// The record's name.
pub const RECORD: &str = "dose.json";

/// The page's name.
pub const PAGE: &str = "dose.html";

/// The name of a part's record.
pub const SUMS: &str = "sums.json";

/// Writes the tables of fields and cases, the page, and the record.
///
/// # Errors
/// The first file that cannot be written. Files are whole or absent.
pub fn write(folder: &Path, report: &DoseReport, shown: &Illustrations, formats: &[Format]) -> Result<()> {
    for &format in formats {
        for (stem, text) in figures::tables(report, format) {
            let path = folder.join(format!("{stem}.{}", format.ending()));
            write_atomically(&path, |out| out.write_all(text.as_bytes()))?;
        }
    }
    let page = page::page(report, shown)?;
    write_atomically(&folder.join(PAGE), |out| out.write_all(page.as_bytes()))?;
    json::write(&folder.join(RECORD), report)?;
    Ok(())
}

/// Makes sure that no table takes the place of a file that the study reads, such as its list of paths, named `paths.csv` too.
///
/// # Errors
/// The first such file.
pub fn spare_inputs(folder: &Path, study_file: &Path, study: &Study) -> Result<()> {
    // A folder that is not there yet holds nothing.
    let Ok(folder) = folder.canonicalize() else { return Ok(()) };
    let tables = Table::ALL.map(Table::stem).into_iter().chain(figures::STEMS);
    let names: Vec<String> = tables.map(|stem| format!("{stem}.{}", Format::Csv.ending())).collect();
    for input in study.inputs() {
        let path = study_file.with_file_name(&input.file);
        let Ok(real) = path.canonicalize() else { continue };
        let is_target = real.parent() == Some(&folder)
            && real.file_name().is_some_and(|name| names.iter().any(|table| name == table.as_str()));
        if is_target {
            return Err(Error::input(
                path.display().to_string(),
                "the study reads this file, and a table of that name would take its place",
                "give another folder with --output",
            ));
        }
    }
    Ok(())
}

/// Where a part of a study lies.
pub fn part_folder(folder: &Path, shard: Shard) -> PathBuf {
    let digits = shard.of().to_string().len();
    folder.join(format!("shard-{:0digits$}-of-{}", shard.number(), shard.of()))
}

/// Writes a part's record.
///
/// # Errors
/// If it cannot be written.
pub fn write_part(folder: &Path, part: &Part) -> Result<()> {
    json::write(&folder.join(SUMS), part)?;
    Ok(())
}

/// A part's record. `None` if there is none: the part was not finished.
///
/// # Errors
/// A record that cannot be read.
pub fn read_part(folder: &Path) -> Result<Option<Part>> {
    let path = folder.join(SUMS);
    if !path.exists() {
        return Ok(None);
    }
    let file = regular_file::open(&path, "part's record")?;
    serde_json::from_reader(BufReader::new(file)).map(Some).map_err(|e| {
        Error::input(
            path.display().to_string(),
            format!("this is no part's record: {e}"),
            "make the part anew",
        )
    })
}

/// The finished parts in a folder, with where each lies, in order.
///
/// # Errors
/// A folder or a record that cannot be read.
pub fn read_parts(folder: &Path) -> Result<Vec<(PathBuf, Part)>> {
    let refused = |e| Error::io("read", folder, e);
    let mut parts = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(refused)? {
        let path = entry.map_err(refused)?.path();
        let is_part = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("shard-"));
        if is_part && let Some(part) = read_part(&path)? {
            parts.push((path, part));
        }
    }
    parts.sort_by_key(|(_, part)| (part.shard.of(), part.shard.number()));
    Ok(parts)
}

/// Joins the tables of paths that the first of `parts` has into `folder`, a line at a time: one line of heads, then all rows.
/// Returns the tables' names.
///
/// # Errors
/// A table that is missing in a part, or cannot be read or written.
pub fn join_tables(folder: &Path, parts: &[PathBuf]) -> Result<Vec<String>> {
    let mut joined = Vec::new();
    for (table, format) in Table::ALL.into_iter().flat_map(|t| [(t, Format::Csv), (t, Format::JsonLines)]) {
        let name = paths::name(table, format);
        if !parts.first().is_some_and(|part| part.join(&name).exists()) {
            continue;
        }
        let mut out = AtomicFile::begin(&folder.join(&name))?;
        for (index, part) in parts.iter().enumerate() {
            let path = part.join(&name);
            let refused = |e| Error::io("read", &path, e);
            let mut rows = BufReader::with_capacity(1 << 20, regular_file::open(&path, "part's table")?);
            if format == Format::Csv {
                let mut head = Vec::new();
                rows.read_until(b'\n', &mut head).map_err(refused)?;
                if index == 0 {
                    out.append(&head)?;
                }
            }
            loop {
                let bytes = rows.fill_buf().map_err(refused)?;
                let count = bytes.len();
                if count == 0 {
                    break;
                }
                out.append(bytes)?;
                rows.consume(count);
            }
        }
        out.commit()?;
        joined.push(name);
    }
    Ok(joined)
}
