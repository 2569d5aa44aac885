//! What a reader has found so far: checked vertices and faces, not yet chosen from or welded.

use std::fmt::Display;
use std::path::Path;
use std::rc::Rc;

use glam::DVec3;

use super::{MeshFile, ReadOptions, polygon, weld};
use crate::geometry::TriMesh;
use crate::{Error, Result};

/// Coordinates beyond this, in any unit, are refused: no body is that large, and up to here (also scaled by a
/// thousand, to 10¹⁸) volumes and products of two face normals stay below 10⁷⁴, far from overflow.
const LARGEST_COORDINATE: f64 = 1e15;

/// Names listed in an error, at most.
const MOST_NAMES_LISTED: usize = 24;

/// Names that many sections may share: a file can repeat the use of a name far more often than its letters.
pub(super) type NameList = Rc<[String]>;

/// A mesh being read from a file.
pub(super) struct Draft<'a> {
    path: &'a Path,
    max_faces: usize,
    vertices: Vec<DVec3>,
    faces: Vec<[u32; 3]>,
    sections: Vec<Section>,
    polygons: usize,
    first_overlap: Option<String>,
    notices: Vec<String>,
    shares_vertices: bool,
}

/// A run of faces under the same names; it ends where the next one begins.
struct Section {
    names: Vec<NameList>,
    first_face: usize,
}

impl Section {
    /// Its names, empty ones left out.
    fn names(&self) -> impl Iterator<Item = &String> {
        self.names.iter().flat_map(|list| list.iter()).filter(|name| !name.is_empty())
    }
}

impl<'a> Draft<'a> {
    pub fn new(path: &'a Path, max_faces: usize) -> Self {
        Self {
            path,
            max_faces,
            vertices: Vec::new(),
            faces: Vec::new(),
            sections: Vec::new(),
            polygons: 0,
            first_overlap: None,
            notices: Vec::new(),
            shares_vertices: true,
        }
    }

    /// An error about the file as a whole.
    pub fn refuse(&self, problem: impl Into<String>, remedy: impl Into<String>) -> Error {
        Error::input(self.path.display().to_string(), problem, remedy)
    }

    /// An error about one place in the file.
    pub fn refuse_at(
        &self,
        place: impl Display,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Error {
        Error::input(format!("{}, {place}", self.path.display()), problem, remedy)
    }

    pub fn notice(&mut self, sentence: String) {
        self.notices.push(sentence);
    }

    pub fn vertex_count(&self) -> usize {
        self.vertices.len()
    }

    pub fn has_faces(&self) -> bool {
        !self.faces.is_empty()
    }

    /// Says that the format repeats a vertex in every face, so that joining them is not worth a notice.
    pub fn repeats_vertices(&mut self) {
        self.shares_vertices = false;
    }

    /// The faces that follow stand under all names of these lists; empty names are none.
    pub fn begin_section(&mut self, names: Vec<NameList>) {
        self.sections.push(Section { names, first_face: self.faces.len() });
    }

    /// Adds a vertex. Errors as of [`check_position`](Self::check_position).
    pub fn add_vertex(&mut self, position: DVec3, place: impl Display) -> Result<()> {
        self.check_position(position, place)?;
        self.vertices.push(position);
        Ok(())
    }

    /// An error if a coordinate is not finite or absurdly large.
    pub fn check_position(&self, position: DVec3, place: impl Display) -> Result<()> {
        if !position.is_finite() {
            return Err(self.refuse_at(
                place,
                format!("the vertex is at {position}"),
                "every coordinate must be a finite number: repair or export the mesh again",
            ));
        }
        if position.abs().max_element() > LARGEST_COORDINATE {
            return Err(self.refuse_at(
                place,
                format!("the vertex is at {position}, beyond {LARGEST_COORDINATE:e}"),
                "check the unit of the export; the file may also be damaged",
            ));
        }
        Ok(())
    }

    /// An error if a face has too few corners.
    pub fn check_corners(&self, count: usize, place: impl Display) -> Result<()> {
        if count >= 3 {
            return Ok(());
        }
        Err(self.refuse_at(
            place,
            format!("the face has {count} of the three corners it needs"),
            "delete the face or give it its missing corners",
        ))
    }

    /// Adds a polygon over known vertices, as triangles. An error if it has fewer than three corners or the
    /// file too many triangles.
    pub fn add_polygon(&mut self, corners: &[u32], place: impl Display) -> Result<()> {
        self.check_corners(corners.len(), &place)?;
        self.expect_faces(corners.len() - 2)?;
        if let &[a, b, c] = corners {
            self.faces.push([a, b, c]);
            return Ok(());
        }
        let points: Vec<DVec3> = corners.iter().map(|&v| self.vertices[v as usize]).collect();
        let split = polygon::split(&points);
        self.faces.extend(split.triangles.iter().map(|triangle| triangle.map(|i| corners[i])));
        self.polygons += 1;
        if split.overlaps && self.first_overlap.is_none() {
            self.first_overlap = Some(place.to_string());
        }
        Ok(())
    }

    /// An error if `more` triangles would be too many.
    pub fn expect_faces(&self, more: usize) -> Result<()> {
        if more <= self.max_faces.saturating_sub(self.faces.len()) {
            return Ok(());
        }
        Err(self.refuse(
            format!("the mesh has more than the limit of {} triangles", self.max_faces),
            "reduce the mesh to what the study needs, or raise the limit",
        ))
    }

    /// The chosen faces, welded. An error if a chosen name is not there or no face is left.
    pub fn finish(mut self, options: &ReadOptions) -> Result<MeshFile> {
        if self.faces.is_empty() {
            return Err(self.refuse("there are no faces in it", "export the mesh with its faces"));
        }
        let groups = self.names();
        if let Some(chosen) = &options.groups {
            self.keep_only(chosen, &groups)?;
        }

        let whole = TriMesh { vertices: self.vertices, faces: self.faces };
        let welded = weld(&whole, options.weld_file_units);
        if welded.mesh.faces.is_empty() {
            return Err(Error::input(
                self.path.display().to_string(),
                "no face has three distinct vertices",
                "check the export's unit and precision, or give a smaller welding distance",
            ));
        }

        let mut notices = self.notices;
        if self.polygons > 0 {
            notices.push(format!(
                "{} split into triangles",
                counted(self.polygons, "polygon was", "polygons were")
            ));
        }
        if let Some(place) = self.first_overlap {
            notices.push(format!(
                "the polygon at {place} could not be split without overlap: split it where it was modelled"
            ));
        }
        if welded.joined > 0 && self.shares_vertices {
            notices.push(format!(
                "{} with another at the same place",
                counted(welded.joined, "vertex was joined", "vertices were joined")
            ));
        }
        if welded.collapsed > 0 {
            notices.push(format!(
                "{} removed: two of its corners are the same vertex",
                counted(welded.collapsed, "face was", "faces were")
            ));
        }
        Ok(MeshFile { mesh: welded.mesh, groups, notices })
    }

    /// Every name under which there are faces, once, in order of appearance.
    fn names(&self) -> Vec<String> {
        let mut seen = std::collections::HashSet::new();
        let mut names = Vec::new();
        for (section, faces) in self.sections_with_faces() {
            if !faces.is_empty() {
                names.extend(section.names().filter(|&name| seen.insert(name)).cloned());
            }
        }
        names
    }

    fn sections_with_faces(&self) -> impl Iterator<Item = (&Section, std::ops::Range<usize>)> {
        let ends = self.sections.iter().skip(1).map(|s| s.first_face).chain([self.faces.len()]);
        self.sections.iter().zip(ends).map(|(section, end)| (section, section.first_face..end))
    }

    fn keep_only(&mut self, chosen: &[String], names: &[String]) -> Result<()> {
        if chosen.is_empty() {
            return Err(self.refuse("the list of chosen groups is empty", "name a group or drop the list"));
        }
        if let Some(unknown) = chosen.iter().find(|name| !names.contains(name)) {
            let remedy = match names {
                [] => "the file names no groups: drop the list of groups".to_owned(),
                _ => format!("choose among {}", listed(names)),
            };
            return Err(self.refuse(format!("there is no group “{unknown}” with faces"), remedy));
        }
        let kept = self
            .sections_with_faces()
            .filter(|(section, _)| section.names().any(|name| chosen.contains(name)))
            .flat_map(|(_, faces)| &self.faces[faces])
            .copied()
            .collect();
        self.faces = kept;
        Ok(())
    }
}

/// `1 face was`, `2 faces were`.
fn counted(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// Names in quotation marks, a long list cut short.
fn listed(names: &[String]) -> String {
    let quoted: Vec<String> = names.iter().take(MOST_NAMES_LISTED).map(|name| format!("“{name}”")).collect();
    match names.len().saturating_sub(MOST_NAMES_LISTED) {
        0 => quoted.join(", "),
        more => format!("{} and {more} more", quoted.join(", ")),
    }
}
