//! Reading a user's file: a regular one, and no more of it than its kind can need.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::error::{Error, Result};

/// What a file is to be read as, for its limit and for messages.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Kind {
    /// In the singular, without article: `mesh file`.
    pub name: &'static str,
    /// The most that is read, bytes.
    pub max_bytes: u64,
    /// What to do about a larger file.
    pub if_too_large: &'static str,
}

/// Opens the regular file at `path`, to be read as what `name` says, in the singular and without article.
///
/// # Errors
/// What the file system says; named pipes, devices and folders.
pub(crate) fn open(path: &Path, name: &str) -> Result<File> {
    let refused = |source| Error::io("read", path, source);
    // Asked before opening: opening a named pipe would wait for its other end.
    if !std::fs::metadata(path).map_err(refused)?.is_file() {
        return Err(Error::input(
            path.display().to_string(),
            "this is not a regular file",
            format!("give the path of a {name}"),
        ));
    }
    File::open(path).map_err(refused)
}

/// The bytes of the regular file at `path`.
///
/// # Errors
/// What the file system says; named pipes, devices and folders, which may have no end; files larger than the kind's limit.
pub(crate) fn read(path: &Path, kind: Kind) -> Result<Vec<u8>> {
    let refused = |source| Error::io("read", path, source);
    let too_large = || {
        Error::input(
            path.display().to_string(),
            format!("the file is larger than the limit of {} bytes for a {}", kind.max_bytes, kind.name),
            kind.if_too_large,
        )
    };
    let file = open(path, kind.name)?;
    if file.metadata().map_err(refused)?.len() > kind.max_bytes {
        return Err(too_large());
    }
    // A file that grows meanwhile, or whose size the system does not tell, is cut at the limit, too.
    let mut bytes = Vec::new();
    file.take(kind.max_bytes.saturating_add(1)).read_to_end(&mut bytes).map_err(refused)?;
    if bytes.len() as u64 > kind.max_bytes { Err(too_large()) } else { Ok(bytes) }
}

/// As [`read`], for text.
///
/// # Errors
/// As [`read`]; bytes that are not UTF-8.
pub(crate) fn read_text(path: &Path, kind: Kind) -> Result<String> {
    String::from_utf8(read(path, kind)?).map_err(|wrong| {
        Error::input(
            path.display().to_string(),
            format!("byte {} is not UTF-8 text", wrong.utf8_error().valid_up_to() + 1),
            format!("save the {} as UTF-8", kind.name),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOTE: Kind = Kind { name: "note", max_bytes: 4, if_too_large: "shorten it" };

    #[test]
    fn a_file_up_to_the_limit_is_read_and_a_longer_one_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("note");
        std::fs::write(&path, "four").expect("a file");
        assert_eq!(read_text(&path, NOTE).expect("read"), "four");
        std::fs::write(&path, "fives").expect("a file");
        let message = read_text(&path, NOTE).expect_err("too long").to_string();
        assert!(message.contains("limit of 4 bytes for a note"), "{message}");
        std::fs::write(&path, [b'a', 0xff]).expect("a file");
        let message = read_text(&path, NOTE).expect_err("no text").to_string();
        assert!(message.contains("byte 2 is not UTF-8"), "{message}");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn devices_folders_and_files_whose_size_is_not_told_are_not_read_without_end() {
        for path in ["/dev/zero", "/"] {
            let message = read(Path::new(path), NOTE).expect_err("no file").to_string();
            assert!(message.contains("not a regular file"), "{message}");
        }
        // A regular file by its metadata, of 0 bytes.
        let message = read(Path::new("/proc/self/status"), NOTE).expect_err("too long").to_string();
        assert!(message.contains("larger than the limit"), "{message}");
    }
}
