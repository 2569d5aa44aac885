//! Files that appear whole or not at all.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::{Error, Result};

/// Writes a file in one step: into a temporary file in the same folder, which is flushed, synced to the disk and
/// renamed to `path`. Returns the number of bytes.
///
/// Readers see the old file or the whole new one, never a part. The new file has the permissions of any newly
/// created file (those that the process's umask leaves). A symbolic link at `path` is replaced by the file.
///
/// # Errors
/// If the folder does not exist or cannot be written, if `path` is something else than a regular file (a folder, a
/// device), if `content` fails, or if the disk refuses (also at the last flush). Then an old file at `path`
/// is as it was, and the temporary file is gone.
pub fn write_atomically(path: &Path, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<u64> {
    let temporary = temporary_file_for(path)?;
    let bytes = fill(temporary.as_file(), content).map_err(|e| Error::io("write", path, e))?;
    temporary.persist(path).map_err(|e| Error::io("replace", path, e.error))?;
    Ok(bytes)
}

/// A file that is written piece by piece over a long run, and appears at its path when it is [committed](Self::commit): whole,
/// or not at all. Dropped before that, it leaves nothing.
#[derive(Debug)]
pub struct AtomicFile {
    path: PathBuf,
    out: BufWriter<File>,
    temporary: tempfile::NamedTempFile,
}

impl AtomicFile {
    /// Begins the file that is to appear at `path`.
    ///
    /// # Errors
    /// As [`write_atomically`].
    pub fn begin(path: &Path) -> Result<Self> {
        let temporary = temporary_file_for(path)?;
        // A handle of its own: the temporary file's would add its name to what the disk says.
        let file = temporary.as_file().try_clone().map_err(|e| Error::io("create", path, e))?;
        Ok(Self { path: path.to_owned(), out: BufWriter::with_capacity(1 << 16, file), temporary })
    }

    /// Adds bytes at its end.
    ///
    /// # Errors
    /// If the disk refuses.
    pub fn append(&mut self, bytes: &[u8]) -> Result<()> {
        self.out.write_all(bytes).map_err(|e| Error::io("write", &self.path, e))
    }

    /// Lets the file appear, flushed and synced, in place of one of that name.
    ///
    /// # Errors
    /// If the disk refuses, also at the last flush; then nothing appears.
    pub fn commit(self) -> Result<()> {
        let Self { path, out, temporary } = self;
        let file = out.into_inner().map_err(|e| Error::io("write", &path, e.into_error()))?;
        file.sync_all().map_err(|e| Error::io("write", &path, e))?;
        temporary.persist(&path).map_err(|e| Error::io("replace", &path, e.error))?;
        Ok(())
    }
}

/// A new file in the folder of `path`, to be renamed to it.
fn temporary_file_for(path: &Path) -> Result<tempfile::NamedTempFile> {
    if path.metadata().is_ok_and(|about| !about.is_file()) {
        // Renaming onto a device would replace the device.
        let reason = io::Error::other("it exists and is not a regular file");
        return Err(Error::io("replace", path, reason));
    }
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    temporary_file(folder).map_err(|e| Error::io("create", path, e))
}

/// Creates a folder and those above it, where they do not exist yet.
///
/// # Errors
/// If the system refuses, for example because a file is in the way.
pub fn create_folder(path: &Path) -> Result<()> {
    std::fs::create_dir_all(path).map_err(|e| Error::io("create", path, e))
}

/// Removes an earlier run's record, which would describe files that are about to change.
///
/// # Errors
/// If the system refuses.
pub fn remove_stale(record: &Path) -> Result<()> {
    match std::fs::remove_file(record) {
        Err(e) if e.kind() != io::ErrorKind::NotFound => Err(Error::io("replace", record, e)),
        _ => Ok(()),
    }
}

fn temporary_file(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".chordfield-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // Temporary files are private by default; this asks for what `File::create` asks for, less the umask.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}

/// Writes the content, and only returns once the disk has it.
fn fill(file: &File, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<u64> {
    let mut counted = Counted { inner: BufWriter::with_capacity(1 << 16, file), bytes: 0 };
    content(&mut counted)?;
    // Dropping a buffer swallows its last error, a full disk for example; flushing reports it.
    counted.flush()?;
    file.sync_all()?;
    Ok(counted.bytes)
}

/// A writer that counts what went through it.
struct Counted<W> {
    inner: W,
    bytes: u64,
}

impl<W: Write> Write for Counted<W> {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let written = self.inner.write(buffer)?;
        self.bytes += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::error::Error as _;

    fn entries(folder: &Path) -> usize {
        std::fs::read_dir(folder).expect("a folder").count()
    }

    #[test]
    fn the_file_holds_what_was_written_and_the_bytes_are_counted() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.txt");
        let bytes = write_atomically(&path, |w| w.write_all(&[7; 100_000])).expect("written");
        assert_eq!(bytes, 100_000);
        assert_eq!(std::fs::read(&path).expect("read"), [7; 100_000]);
        write_atomically(&path, |w| write!(w, "new")).expect("replaced");
        assert_eq!(std::fs::read(&path).expect("read"), b"new");
        assert_eq!(entries(folder.path()), 1);
    }

    #[test]
    fn a_failing_content_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.txt");
        std::fs::write(&path, "old").expect("written");
        let error = write_atomically(&path, |w| {
            w.write_all(&[0; 1 << 20])?;
            Err(io::Error::other("no more data"))
        })
        .expect_err("refused");
        assert_eq!(error.to_string(), format!("cannot write {}", path.display()));
        assert_eq!(error.source().expect("a reason").to_string(), "no more data");
        assert_eq!(std::fs::read(&path).expect("read"), b"old");
        assert_eq!(entries(folder.path()), 1);
    }

    #[test]
    fn a_file_written_piece_by_piece_appears_when_it_is_committed_and_not_before() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.csv");
        let mut file = AtomicFile::begin(&path).expect("begun");
        for _ in 0..3 {
            file.append(&[7; 50_000]).expect("written");
        }
        assert!(!path.exists());
        file.commit().expect("committed");
        assert_eq!(std::fs::read(&path).expect("read"), [7; 150_000]);
        AtomicFile::begin(&path).expect("begun").append(b"half").expect("written");
        assert_eq!((entries(folder.path()), path.metadata().expect("a file").len()), (1, 150_000));
    }

    #[test]
    fn missing_folders_files_as_folders_and_folders_as_files_are_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("file");
        std::fs::write(&file, "old").expect("written");
        let write = |path: &Path| write_atomically(path, |w| w.write_all(b"new"));
        for path in [folder.path().join("missing/a.txt"), file.join("a.txt")] {
            assert!(matches!(write(&path), Err(Error::Io { action: "create", .. })), "{}", path.display());
        }
        assert!(matches!(write(folder.path()), Err(Error::Io { action: "replace", .. })));
        assert!(matches!(create_folder(&file.join("below")), Err(Error::Io { action: "create", .. })));
        assert_eq!(std::fs::read(&file).expect("read"), b"old");
        assert_eq!(entries(folder.path()), 1);
        create_folder(&folder.path().join("a/b")).expect("created");
        write(&folder.path().join("a/b/c")).expect("written");
    }

    #[cfg(unix)]
    #[test]
    fn permissions_are_those_of_any_new_file_and_devices_are_not_replaced() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().expect("a folder");
        let [ours, plain] = ["ours", "plain"].map(|name| folder.path().join(name));
        write_atomically(&ours, |w| w.write_all(b"x")).expect("written");
        File::create(&plain).expect("created");
        let mode = |path: &Path| path.metadata().expect("a file").permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
        let null = Path::new("/dev/null");
        assert!(matches!(write_atomically(null, |_| Ok(())), Err(Error::Io { action: "replace", .. })));
    }

    /// A disk that is full when the buffer is emptied.
    struct FullAtFlush;

    impl Write for FullAtFlush {
        fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
            Ok(buffer.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Err(io::ErrorKind::StorageFull.into())
        }
    }

    #[test]
    fn an_error_of_the_last_flush_is_not_lost() {
        let mut counted = Counted { inner: FullAtFlush, bytes: 0 };
        counted.write_all(b"abc").expect("buffered");
        assert_eq!(counted.bytes, 3);
        assert_eq!(counted.flush().expect_err("full").kind(), io::ErrorKind::StorageFull);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_reported_even_if_everything_fitted_the_buffer() {
        // Every write to this device fails as on a full disk; three bytes stay in the buffer until the flush.
        let full = File::options().write(true).open("/dev/full").expect("the device");
        let error = fill(&full, |w| w.write_all(b"abc")).expect_err("full");
        assert_eq!(error.kind(), io::ErrorKind::StorageFull);
    }
}
