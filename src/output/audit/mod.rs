//! The files of an audit: a page to look at, and its figures as JSON and CSV.
//!
//! | file | content |
//! |---|---|
//! | `audit.html` | the report: one file, no network, no script |
//! | `audit.json` | all figures; written last, so a folder without it holds an unfinished run |
//! | `organs.csv` | a row for each organ and kind of error |
//! | `sections.csv` | a row for each view, or aim |
//! | `histogram.csv` | errors by magnitude |
//! | `worst.csv` | the worst rays, with what finds each again |

mod csv;
mod definitions;
mod page;
mod panels;

use std::path::Path;

use super::{create_folder, json, write_atomically};
use crate::error::{Error, Result};
use crate::modes::audit::{AuditReport, Pictures};

/// The page's name.
pub const PAGE: &str = "audit.html";

/// The record's name.
pub const RECORD: &str = "audit.json";

/// Writes all files of a report into `folder`, which is made if missing; `pictures` are those of the worst ray's view.
///
/// # Errors
/// The first file that cannot be written. Files are whole or absent.
pub fn write(folder: &Path, report: &AuditReport, pictures: Option<&Pictures>) -> Result<()> {
    create_folder(folder)?;
    let record = folder.join(RECORD);
    match std::fs::remove_file(&record) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(Error::io("replace", &record, e)),
        _ => {}
    }
    let panels = pictures.map(|pictures| panels::panels(pictures, report.tolerance_mm)).transpose()?;
    for (name, text) in [
        (PAGE, page::page(report, panels.as_deref().unwrap_or_default())),
        ("organs.csv", csv::organs(report)),
        ("sections.csv", csv::sections(report)),
        ("histogram.csv", csv::histogram(report)),
        ("worst.csv", csv::worst(report)),
    ] {
        write_atomically(&folder.join(name), |out| out.write_all(text.as_bytes()))?;
    }
    json::write(&record, report)?;
    Ok(())
}
