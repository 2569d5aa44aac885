//! Stereolithography files, text and binary: triangles that repeat their vertices.
//!
//! ```text
//! binary:  80 bytes of anything │ u32 n │ n × (normal 3×f32, corners 9×f32, 2 bytes)     84 + 50 n bytes
//! text:    solid NAME … facet normal … outer loop, vertex x y z (three), endloop, endfacet … endsolid
//! ```
//!
//! A binary file may begin with the word `solid`, so the size decides: a file of exactly 84 + 50 n bytes is
//! binary. (In a text, the four bytes of n are printable and would announce 27 GB.) The stored normals are
//! ignored: the order of the corners says what is outside. A text may hold several solids.
//!
//! The triangles of a binary file are those that the crate `stl_io` reads. A text it cannot serve: it reads
//! coordinates as f32, so that 0.1 becomes 0.100000001490116 while the same mesh in OBJ or PLY is exact to 1e-17;
//! no preparation of the text can undo that. (It also ends at the first `endsolid`, names no lines, and refuses
//! facets whose normal is `nan` and keywords in capitals, which exporters write.) Texts are therefore read here.
//!
//! Source: 3D Systems, *Stereolithography Interface Specification*, 1989.

use std::io::{Cursor, Read, Seek, SeekFrom};
use std::rc::Rc;

use glam::{DVec3, Vec3};

use super::draft::Draft;
use super::numbered_lines;
use crate::Result;

const HEADER_BYTES: usize = 84;
const TRIANGLE_BYTES: usize = 50;
/// The free text at the start of a binary header.
const NAME_BYTES: u64 = 80;
/// In the first kilobyte, a binary file has a zero byte: in its header, in n, or in a normal or an attribute.
const TEXT_SAMPLE_BYTES: usize = 1024;

const EXPORT_AGAIN: &str = "the file was cut short or is not STL: export or copy it again";

/// Whether bytes without extension are STL of either kind.
pub(super) fn is_stl(bytes: &[u8]) -> bool {
    has_binary_size(bytes) || is_text(bytes)
}

/// Reads a whole file into `draft`. Errors name the line of a text, the triangle (from 1) of a binary file.
pub(super) fn read(bytes: &[u8], draft: &mut Draft) -> Result<()> {
    draft.repeats_vertices();
    if !has_binary_size(bytes) && is_text(bytes) {
        read_text(bytes, draft)
    } else {
        read_binary(bytes, draft)
    }
}

/// How many triangles a binary header announces. `None` if the file is shorter than a header.
fn announced(bytes: &[u8]) -> Option<u32> {
    let count = bytes.get(HEADER_BYTES - 4..HEADER_BYTES)?;
    Some(u32::from_le_bytes(count.try_into().ok()?))
}

fn binary_size(triangles: u32) -> u64 {
    HEADER_BYTES as u64 + TRIANGLE_BYTES as u64 * u64::from(triangles)
}

fn has_binary_size(bytes: &[u8]) -> bool {
    announced(bytes).is_some_and(|n| binary_size(n) == bytes.len() as u64)
}

fn is_text(bytes: &[u8]) -> bool {
    let start = bytes.trim_ascii_start();
    let sample = &bytes[..bytes.len().min(TEXT_SAMPLE_BYTES)];
    start.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) && !sample.contains(&0)
}

fn read_binary(bytes: &[u8], draft: &mut Draft) -> Result<()> {
    let size = bytes.len() as u64;
    let Some(triangles) = announced(bytes) else {
        return Err(draft.refuse(
            format!("the file has {size} bytes, fewer than the {HEADER_BYTES} of an STL header"),
            EXPORT_AGAIN,
        ));
    };
    // Nothing is allocated before the announced size is known to be there.
    let needed = binary_size(triangles);
    if needed > size {
        return Err(draft.refuse(
            format!(
                "the header announces {triangles} triangles ({needed} bytes), but the file has {size} bytes"
            ),
            EXPORT_AGAIN,
        ));
    }
    if triangles == 0 {
        return Err(draft.refuse("the header announces 0 triangles", "export the mesh with its faces"));
    }
    if needed < size {
        draft.notice(format!("{} bytes after the last triangle were ignored", size - needed));
    }
    // The sizes were compared above, so `stl_io` meets no end of file; it also reserves no memory by the header.
    let damaged = |error: std::io::Error| draft.refuse(format!("it cannot be read: {error}"), EXPORT_AGAIN);
    let mut unnamed = Unnamed(Cursor::new(bytes));
    let found = stl_io::create_stl_reader(&mut unnamed).map_err(damaged)?;
    for (i, triangle) in found.enumerate() {
        let place = BinaryPlace { triangle: i + 1, triangles };
        let corners = triangle
            .map_err(|error| draft.refuse_at(place, format!("it cannot be read: {error}"), EXPORT_AGAIN))?
            .vertices;
        add_triangle(corners.map(|corner| Vec3::from_array(corner.0).as_dvec3()), place, draft)?;
    }
    Ok(())
}

/// A binary file with line ends in place of the name in its header. `stl_io` offers no way to say that a file
/// is binary, and takes one whose name begins with “solid ” for a text; nor does it search far for the end of
/// the first line.
struct Unnamed<'a>(Cursor<&'a [u8]>);

impl Read for Unnamed<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let name_left = NAME_BYTES.saturating_sub(self.0.position()) as usize;
        let count = self.0.read(buffer)?;
        buffer[..count.min(name_left)].fill(b'\n');
        Ok(count)
    }
}

impl Seek for Unnamed<'_> {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.0.seek(to)
    }
}

/// A triangle's place in a binary file.
#[derive(Clone, Copy)]
struct BinaryPlace {
    triangle: usize,
    triangles: u32,
}

impl std::fmt::Display for BinaryPlace {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "triangle {} of {}", self.triangle, self.triangles)
    }
}

fn add_triangle(corners: [DVec3; 3], place: impl std::fmt::Display + Copy, draft: &mut Draft) -> Result<()> {
    let first = draft.vertex_count() as u32;
    for corner in corners {
        draft.add_vertex(corner, place)?;
    }
    draft.add_polygon(&[first, first + 1, first + 2], place)
}

fn read_text(bytes: &[u8], draft: &mut Draft) -> Result<()> {
    let mut solids = 0;
    let mut open_solid = false;
    let mut open_facet: Option<Vec<DVec3>> = None;
    for (line, text) in numbered_lines(bytes) {
        let place = format!("line {line}");
        let mut words = text.split_whitespace();
        let Some(keyword) = words.next() else { continue };
        match (keyword.to_ascii_lowercase().as_str(), &mut open_facet) {
            ("solid", None) => {
                let name = text.trim()[keyword.len()..].trim();
                draft.begin_section(vec![Rc::new([name.to_owned()])]);
                solids += 1;
                open_solid = true;
            }
            ("endsolid", None) => open_solid = false,
            ("facet", None) => open_facet = Some(Vec::with_capacity(3)),
            ("outer" | "endloop", Some(_)) => {}
            ("vertex", Some(corners)) => corners.push(vertex(words, &place, draft)?),
            ("endfacet", Some(corners)) => {
                let Ok(corners) = <[DVec3; 3]>::try_from(corners.as_slice()) else {
                    return Err(draft.refuse_at(
                        place,
                        format!("the facet that ends here has {} vertices instead of 3", corners.len()),
                        "STL knows triangles only: export the mesh again",
                    ));
                };
                add_triangle(corners, place.as_str(), draft)?;
                open_facet = None;
            }
            (_, inside) => {
                let (keyword, where_) = (
                    keyword.chars().take(32).collect::<String>(),
                    if inside.is_some() { "inside" } else { "outside" },
                );
                return Err(draft.refuse_at(
                    place,
                    format!("“{keyword}” is out of place {where_} a facet"),
                    "the file is damaged or not STL: export it again",
                ));
            }
        }
    }
    if open_facet.is_some() || open_solid {
        return Err(draft.refuse("the text ends before “endsolid”", EXPORT_AGAIN));
    }
    if !draft.has_faces() {
        return Err(draft.refuse(
            "there are no triangles between “solid” and “endsolid”",
            "export the mesh with its faces",
        ));
    }
    if solids > 1 {
        draft.notice(format!("{solids} solids were found"));
    }
    Ok(())
}

/// The position in a `vertex` statement.
fn vertex<'a>(words: impl Iterator<Item = &'a str>, place: &str, draft: &Draft) -> Result<DVec3> {
    let numbers: Option<Vec<f64>> = words.map(|word| word.parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x, y, z]) => Ok(DVec3::new(x, y, z)),
        _ => Err(draft.refuse_at(
            place,
            "the vertex is not three numbers",
            "the file is damaged: write “vertex x y z” with decimal points, or export it again",
        )),
    }
}
