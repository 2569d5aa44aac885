//! Mesh files: OBJ, STL and PLY become one welded triangle mesh.
//!
//! ```text
//! bytes ─► obj │ stl │ ply ─► draft ─► chosen groups ─► weld ─► MeshFile
//!          (line, triangle or         (names of        (shared
//!           face named in errors)      o, g, solid)     vertices)
//! ```
//!
//! The formats are read by the crates `tobj`, `stl_io` and `ply-rs-bw`; what each of them leaves unchecked is
//! checked around it, and text STL is read here, because `stl_io` knows it in f32 only.
//!
//! Nothing is proved about the surface here: closed, consistently outward and free of crossings is what the
//! geometry checks say. What is proved: the numbers are finite, every face has three distinct vertices that
//! exist, and equal positions are one vertex. Other files that a mesh file names (materials, textures) are
//! never opened.

mod draft;
mod obj;
mod ply;
mod polygon;
mod stl;
#[cfg(test)]
mod tests;
mod weld;

use std::fmt;
use std::path::Path;

use super::regular_file;
use crate::geometry::TriMesh;
use crate::{Error, Result};
use draft::Draft;

pub use weld::{Welded, weld};

/// A format of mesh files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Wavefront OBJ: text, polygons over shared vertices, named objects and groups.
    Obj,
    /// Stereolithography: text or binary, triangles without shared vertices.
    Stl,
    /// Polygon file format: text or binary of either byte order, polygons over shared vertices.
    Ply,
}

impl Format {
    /// The format that a file's extension names, in any case. `None` if it names none of ours.
    pub fn of_extension(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "obj" => Some(Self::Obj),
            "stl" => Some(Self::Stl),
            "ply" => Some(Self::Ply),
            _ => None,
        }
    }

    /// The format that a file's first bytes show. `None` if they show none of ours.
    fn of_content(bytes: &[u8]) -> Option<Self> {
        if ply::is_ply(bytes) {
            Some(Self::Ply)
        } else if stl::is_stl(bytes) {
            Some(Self::Stl)
        } else {
            obj::is_obj(bytes).then_some(Self::Obj)
        }
    }

    /// The format of a file: its extension's, or its content's where it has no extension.
    fn of(path: &Path, bytes: &[u8]) -> Result<Self> {
        let found = match path.extension() {
            Some(_) => Self::of_extension(path),
            None => Self::of_content(bytes),
        };
        found.ok_or_else(|| {
            Error::input(
                path.display().to_string(),
                "this is not a mesh format that can be read",
                "give an .obj, .stl or .ply file (the extension's case does not matter)",
            )
        })
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Obj => "OBJ",
            Self::Stl => "STL",
            Self::Ply => "PLY",
        })
    }
}

/// How to read a mesh file.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadOptions {
    /// The format; by default the one of the extension, or of the content of a file without extension.
    pub format: Option<Format>,
    /// Only the faces of these OBJ objects or groups, or of these solids of a text STL; all faces if `None`.
    pub groups: Option<Vec<String>>,
    /// Vertices at most this far apart become one, in the file's own length unit. 0 joins equal positions only.
    pub weld_file_units: f64,
    /// Larger files are refused before they are read.
    pub max_bytes: u64,
    /// Files with more triangles are refused.
    pub max_faces: usize,
}

impl Default for ReadOptions {
    /// All faces, equal positions joined, at most 2 GiB and 20 million triangles (some 5 GB while welding).
    fn default() -> Self {
        Self { format: None, groups: None, weld_file_units: 0.0, max_bytes: 2 << 30, max_faces: 20_000_000 }
    }
}

/// A mesh as a file gives it.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshFile {
    /// The chosen faces over shared vertices, in the file's own length unit; vertices in order of first use.
    pub mesh: TriMesh,
    /// All names that [`ReadOptions::groups`] could choose in this file, in order of appearance.
    pub groups: Vec<String>,
    /// What was repaired or left out, as sentences for the user.
    pub notices: Vec<String>,
}

/// The mesh in a file, in the file's own length unit and frame.
///
/// # Errors
/// If the file cannot be read, is larger than the options allow, is cut short, holds no faces, numbers that
/// are not finite, vertices that do not exist or faces with fewer than three corners; if a chosen group is not
/// there; if the welding distance is negative or not finite. Each names file, element and remedy. Memory stays
/// in proportion to the file's real size, whatever its header announces.
pub fn read(path: &Path, options: &ReadOptions) -> Result<MeshFile> {
    let kind = regular_file::Kind {
        name: "mesh file",
        max_bytes: options.max_bytes,
        if_too_large: "reduce the mesh to what the study needs, or raise the limit",
    };
    read_bytes(path, &regular_file::read(path, kind)?, options)
}

/// As [`read`], from the bytes of a file; `path` serves for messages and for the extension.
///
/// # Errors
/// As [`read`], except those of the file system.
pub fn read_bytes(path: &Path, bytes: &[u8], options: &ReadOptions) -> Result<MeshFile> {
    let distance = options.weld_file_units;
    if !(distance.is_finite() && distance >= 0.0) {
        return Err(Error::input(
            path.display().to_string(),
            format!("the welding distance is {distance}"),
            "give a finite distance of 0 or more",
        ));
    }
    let mut draft = Draft::new(path, options.max_faces);
    if bytes.is_empty() {
        return Err(draft.refuse("the file is empty", "export the mesh again"));
    }
    match options.format.map_or_else(|| Format::of(path, bytes), Ok)? {
        Format::Obj => obj::read(bytes, &mut draft)?,
        Format::Stl => stl::read(bytes, &mut draft)?,
        Format::Ply => ply::read(bytes, &mut draft)?,
    }
    draft.finish(options)
}

/// The lines of a text without their line ends (LF, CR LF or a lone CR), numbered from 1. Bytes that are not
/// UTF-8 become replacement characters: they occur in comments and names only, or make a number unreadable.
fn numbered_lines(bytes: &[u8]) -> impl Iterator<Item = (usize, std::borrow::Cow<'_, str>)> {
    const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";
    let text = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
    let end = if text.contains(&b'\n') { b'\n' } else { b'\r' };
    text.split(move |&b| b == end).enumerate().map(|(i, line)| (i + 1, String::from_utf8_lossy(line)))
}
