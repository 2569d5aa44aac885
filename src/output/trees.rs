//! Files of trees, kept from one run for a later one.

use std::io::Read;
use std::path::Path;

use super::write_atomically;
use crate::error::{Error, Result};
use crate::modes::project::{KeepsTrees, TREES_BEGIN};
use crate::ritree::{Loaded, Unreadable};
use crate::scene::regular_file;

/// What such files are called.
const NAME: &str = "file of trees";

/// Makes sure that trees may be written to `path`: nothing is there, or older trees. A name given by mistake, the scene's for
/// example, costs nobody the file of that name.
///
/// # Errors
/// A file that holds something else, or is not a regular one; one that cannot be read.
pub fn check_target(path: &Path) -> Result<()> {
    if !path.exists() {
        return Ok(());
    }
    let mut begin = Vec::new();
    regular_file::open(path, NAME)?
        .take(TREES_BEGIN.len() as u64)
        .read_to_end(&mut begin)
        .map_err(|e| Error::io("read", path, e))?;
    if begin.is_empty() || begin == TREES_BEGIN {
        return Ok(());
    }
    let problem = "is there and holds no trees; it would be lost";
    Err(Error::input(path.display().to_string(), problem, "give --save-trees a name that is free"))
}

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
    let mut file = regular_file::open(path, NAME)?;
    trees.load_trees(&mut file).map_err(|e| match e {
        Unreadable::Io(e) => Error::io("read", path, e),
        Unreadable::Refused { problem, remedy } => Error::input(path.display().to_string(), problem, remedy),
    })
}
