//! Wavefront OBJ: vertices, polygons, and the names of objects and groups.
//!
//! ```text
//! v 0 0 0            vertex 1 (also: r g b after it; a weight must be 1)
//! o liver            everything that follows belongs to the object “liver”
//! g left front       … and to the groups “left” and “front”
//! f 1 2/7 3//4 -1    corners: vertex/texture/normal, counted from 1, or back from the last vertex
//! ```
//!
//! The vertices and polygons are those that the crate `tobj` reads, in f64 and not yet triangulated. Before it
//! stands a preparation ([`plain`]), because `tobj` names no lines in its errors and lets pass what must not
//! pass here: coordinates that are not finite, weights, faces of one or two corners; because it does not join
//! continued lines and refuses faces above their vertices, an empty `usemtl` and bytes that are not UTF-8; and
//! because it knows one name for a model where OBJ has an object and several groups. `tobj` would also repeat
//! shared vertices in each group; it is given the faces of all groups as one model, and which of them belong to
//! which names is kept beside it.
//!
//! Materials (`mtllib`, `usemtl`), texture coordinates, normals and smoothing say nothing about the surface and
//! are skipped; no file is opened. Lines (`l`), points (`p`) and free-form curves are left out with a notice.
//! Source: Wavefront, *Advanced Visualizer* manual, appendix B1 (object files), version 3.0.

mod plain;

use glam::DVec3;

use super::draft::Draft;
use crate::Result;
use plain::{Plain, statements};

/// Whether a text without extension looks like OBJ: its first statement is one that such files begin with.
pub(super) fn is_obj(bytes: &[u8]) -> bool {
    statements(bytes)
        .next()
        .is_some_and(|s| ["v", "vt", "vn", "f", "o", "g", "s", "mtllib", "usemtl"].contains(&s.keyword()))
}

/// Reads a whole file into `draft`. Errors name the line.
pub(super) fn read(bytes: &[u8], draft: &mut Draft) -> Result<()> {
    let Plain { text, vertices, face_lines, sections } = Plain::of(bytes, draft)?;
    if face_lines.is_empty() {
        return Err(match vertices {
            0 => draft.refuse(
                "there are neither vertices nor faces in it",
                "give an OBJ file with polygons; check that it is an OBJ file at all",
            ),
            _ => draft.refuse("no faces: a point cloud", "make a surface first, or export the faces too"),
        });
    }
    let mesh = load(text, draft)?;

    for (i, &position) in mesh.positions.as_chunks::<3>().0.iter().enumerate() {
        draft.add_vertex(DVec3::from_array(position), format_args!("used vertex {} of {vertices}", i + 1))?;
    }
    let mut sections = sections.into_iter().peekable();
    for (number, (corners, line)) in polygons(&mesh).zip(&face_lines).enumerate() {
        while let Some(section) = sections.next_if(|section| section.first_face <= number) {
            draft.begin_section(section.names);
        }
        draft.add_polygon(corners, format_args!("line {line}"))?;
    }
    Ok(())
}

/// The one mesh in a plain text, as `tobj` reads it. The text goes as soon as it is read: it may be large.
fn load(text: String, draft: &Draft) -> Result<tobj::Mesh> {
    // A vertex is known by its position's number alone, so that faces share it; polygons stay whole.
    let options = tobj::LoadOptions { single_index: false, triangulate: false, ..Default::default() };
    // Nothing is left in the text that names a material; were it otherwise, still nothing would be opened.
    let no_materials = |_: &std::path::Path| Err(tobj::LoadError::OpenFileFailed);
    let (models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &options, no_materials)
        .map_err(|error| draft.refuse(format!("the mesh cannot be read: {error}"), "export it again"))?;
    models
        .into_iter()
        .next()
        .map(|model| model.mesh)
        .ok_or_else(|| draft.refuse("the mesh cannot be read: there is no model in it", "export it again"))
}

/// The corners of each face. (`tobj` leaves the arities out where all are 3.)
fn polygons(mesh: &tobj::Mesh) -> impl Iterator<Item = &[u32]> {
    let mut rest = mesh.indices.as_slice();
    let mut arities = mesh.face_arities.iter();
    std::iter::from_fn(move || {
        let arity = if mesh.face_arities.is_empty() { 3 } else { *arities.next()? as usize };
        let (polygon, after) = rest.split_at_checked(arity)?;
        rest = after;
        Some(polygon)
    })
}
