//! JSON: records for people and programs.

use std::path::Path;

use serde::Serialize;

use super::atomic::write_atomically;
use crate::{Error, Result};

/// Writes a record as indented JSON with a line end. Returns the number of bytes. JSON knows no NaN and no
/// infinity: both become `null`.
///
/// # Errors
/// If the file cannot be written, or the record has a map whose keys are not text or numbers.
pub fn write(path: &Path, record: &impl Serialize) -> Result<u64> {
    write_atomically(path, |out| {
        serde_json::to_writer_pretty(&mut *out, record)?;
        writeln!(out)
    })
}

/// A record as indented JSON with a line end, for standard output.
///
/// # Errors
/// If the record has a map whose keys are not text or numbers.
pub fn text(record: &impl Serialize) -> Result<String> {
    let text = serde_json::to_string_pretty(record)
        .map_err(|e| Error::io("write", Path::new("the record as JSON"), e.into()))?;
    Ok(text + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Serialize)]
    struct Record {
        sad_mm: f64,
        organs: Vec<&'static str>,
        missing: Option<f64>,
        nan: f64,
    }

    #[test]
    fn a_record_reads_back_with_the_same_numbers() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.json");
        let record = Record { sad_mm: 0.1 + 0.2, organs: vec!["liver"], missing: None, nan: f64::NAN };
        write(&path, &record).expect("written");
        let text = std::fs::read_to_string(&path).expect("read");
        assert!(text.ends_with("}\n") && text.contains("\n  \"sad_mm\""));
        let value: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(value["sad_mm"].as_f64(), Some(0.1 + 0.2));
        assert_eq!(value["organs"][0], "liver");
        assert!(value["missing"].is_null() && value["nan"].is_null());
    }

    #[test]
    fn a_record_that_json_cannot_hold_leaves_no_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.json");
        let unheard: std::collections::BTreeMap<Vec<u8>, u8> = [(vec![1], 1)].into();
        assert!(write(&path, &unheard).is_err());
        assert!(text(&unheard).is_err(), "an empty line would pass for a record");
        assert!(!path.exists());
    }
}
