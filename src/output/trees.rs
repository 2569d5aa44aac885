//! Files of trees, kept from one run for a later one.

use std::fs::File;
use std::path::Path;

use super::write_atomically;
use crate::error::{Error, Result};
use crate::modes::project::KeepsTrees;
use crate::ritree::{Loaded, Unreadable};

/// Writes the trees that a run has grown. Returns the file's bytes.
///
/// # Errors
/// As [`write_atomically`]; a method without trees.
pub fn save(path: &Path, trees: &impl KeepsTrees) -> Result<u64> {
    write_atomically(path, |out| trees.save_trees(out))
}

/// Takes over the trees of an earlier run.
///
/// # Errors
/// A file that cannot be read, is not whole, or belongs to another version, other bodies or other settings. Then nothing of it
/// is taken over.
pub fn load(path: &Path, trees: &mut impl KeepsTrees) -> Result<Loaded> {
    let mut file = File::open(path).map_err(|e| Error::io("read", path, e))?;
    trees.load_trees(&mut file).map_err(|e| match e {
        Unreadable::Io(e) => Error::io("read", path, e),
        Unreadable::Refused { problem, remedy } => Error::input(path.display().to_string(), problem, remedy),
    })
}
