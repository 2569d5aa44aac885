//! From a raw surface to a proved body, with every fault in words.

use std::path::Path;

use glam::DVec3;

use super::folder::Folder;
use super::mesh_file::{self, ReadOptions};
use super::schema::MeshSpec;
use super::shape::{Shape, frame::Frame};
use crate::error::{Error, Result};
use crate::exact::Body;
use crate::geometry::{ClosedMesh, MeshFault, TriMesh, check_components, self_crossing};

/// A body and what was mended to make it one.
pub struct Proved {
    /// The body.
    pub body: Body,
    /// Repairs, in words.
    pub notices: Vec<String>,
}

/// Proves that `mesh` bounds a body: closed, two-manifold, oriented, not crossing itself, no volume counted twice.
///
/// # Errors
/// The first fault, about `subject`, with its place and a remedy.
pub fn prove(subject: &str, mesh: TriMesh) -> Result<Proved> {
    let fault = |f: MeshFault| Error::input(subject, f.to_string(), f.remedy());
    let (surface, notices) = ClosedMesh::new(mesh).map_err(fault)?;
    let body = Body::new(surface);
    // A convex surface cannot cross itself; the search is for the others.
    if body.convexity().is_err() {
        if let Some((pairs, place)) = self_crossing(body.surface()) {
            return Err(fault(MeshFault::SelfCrossing { pairs, place }));
        }
        check_components(body.surface()).map_err(fault)?;
    }
    Ok(Proved { body, notices: notices.iter().map(ToString::to_string).collect() })
}

/// The body of a mesh file on its own, in the file's units.
pub fn of_file(path: &Path) -> Result<Proved> {
    let file = mesh_file::read(path, &ReadOptions::default())?;
    let mut proved = prove(&path.display().to_string(), file.mesh)?;
    proved.notices.splice(0..0, file.notices);
    Ok(proved)
}

/// The body of a scene's mesh organ, in the scene's frame, mm.
pub fn of_mesh(spec: &MeshSpec, folder: &Folder) -> Result<Proved> {
    let numbers = spec.rotate_deg.iter().chain(&spec.move_mm).chain(std::iter::once(&spec.weld_mm));
    if numbers.into_iter().any(|x| !x.is_finite()) || spec.weld_mm < 0.0 {
        return Err(Error::input(
            &spec.file,
            "`rotate_deg`, `move_mm` and `weld_mm` must be finite, and `weld_mm` not negative",
            "give ordinary numbers",
        ));
    }
    let path = folder.resolve(&spec.file)?;
    let scale = spec.units.mm();
    let options = ReadOptions {
        groups: spec.groups.clone().or_else(|| spec.group.clone().map(|g| vec![g])),
        weld_file_units: spec.weld_mm / scale,
        ..ReadOptions::default()
    };
    let file = mesh_file::read(&path, &options)?;
    let frame = Frame::turned(DVec3::from(spec.rotate_deg), DVec3::from(spec.move_mm));
    let placed = file.mesh.map_vertices(|v| frame.to_organ(v * scale));
    let mut proved = prove(&spec.file, placed)?;
    proved.notices.splice(0..0, file.notices);
    Ok(proved)
}

/// The body of one or several shapes side by side, mm.
pub fn of_shapes(organ: &str, shapes: &[Shape]) -> Result<Proved> {
    let mut mesh = TriMesh::default();
    for shape in shapes {
        mesh.append(&shape.tessellate().map_err(|p| Error::input(p.key, p.problem, p.remedy))?);
    }
    prove(organ, mesh)
}
