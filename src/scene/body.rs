//! From a raw surface to a proved body, with every fault in words.

use std::path::Path;

use glam::DVec3;

use super::folder::Folder;
use super::mesh_file::{self, ReadOptions};
use super::schema::MeshSpec;
use super::shape::{Shape, frame::Frame};
use crate::error::{Error, Result};
use crate::exact::Body;
use crate::geometry::numeric::gamma;
use crate::geometry::{ClosedMesh, MeshFault, TriMesh, check_components, self_crossing, written_grid};

/// A body and what was mended to make it one.
pub struct Proved {
    /// The body.
    pub body: Body,
    /// Repairs, in words.
    pub notices: Vec<String>,
}

/// Proves that `mesh` bounds a body: closed, two-manifold, oriented, not crossing itself, no volume counted twice.
///
/// `written_grid_mm` is the grid of the file's coordinates, if scaling or turning has hidden it from `mesh`.
///
/// # Errors
/// The first fault, about `subject`, with its place and a remedy.
pub fn prove(subject: &str, mesh: TriMesh, written_grid_mm: Option<f64>) -> Result<Proved> {
    let fault = |f: MeshFault| Error::input(subject, f.to_string(), f.remedy());
    let (surface, notices) = ClosedMesh::new(mesh).map_err(fault)?;
    let surface = match written_grid_mm {
        Some(grid_mm) => surface.with_written_grid_mm(grid_mm),
        None => surface,
    };
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
    let mut proved = prove(&path.display().to_string(), file.mesh, None)?;
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
        groups: spec.chosen_groups()?,
        weld_file_units: spec.weld_mm / scale,
        ..ReadOptions::default()
    };
    let file = mesh_file::read(&path, &options)?;
    let frame = Frame::turned(DVec3::from(spec.rotate_deg), DVec3::from(spec.move_mm));
    let grid_mm = scale * written_grid(&file.mesh.vertices) + placing_error_mm(&file.mesh, spec);
    let placed = file.mesh.map_vertices(|v| frame.to_organ(v * scale));
    let mut proved = prove(&spec.file, placed, Some(grid_mm))?;
    proved.notices.splice(0..0, file.notices);
    Ok(proved)
}

/// How far rounding moves a vertex while it is placed, mm: one product for the unit, five operations of the rotation, whose
/// numbers err by ten more (an angle's sine and two products of matrices), one sum; rounded up to twenty.
fn placing_error_mm(mesh: &TriMesh, spec: &MeshSpec) -> f64 {
    let reach = mesh.vertices.iter().map(|v| v.length()).fold(0.0, f64::max);
    gamma(20) * (spec.units.mm() * reach + DVec3::from(spec.move_mm).length())
}

/// The body of one or several shapes side by side, mm.
pub fn of_shapes(organ: &str, shapes: &[Shape]) -> Result<Proved> {
    let mut mesh = TriMesh::default();
    for shape in shapes {
        mesh.append(&shape.tessellate().map_err(|p| Error::input(p.key, p.problem, p.remedy))?);
    }
    prove(organ, mesh, None)
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use super::*;
    use crate::geometry::primitives::prism;

    /// The OBJ text of a prism askew, coordinates with six decimals.
    fn askew(radius: f64) -> String {
        let mesh = prism(4);
        let mut text = String::new();
        for v in mesh.vertices.iter().map(|v| radius * (glam::DMat3::from_rotation_y(0.5) * v)) {
            writeln!(text, "v {:.6} {:.6} {:.6}", v.x, v.y, v.z).expect("text");
        }
        for [a, b, c] in &mesh.faces {
            writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).expect("text");
        }
        text
    }

    #[test]
    fn a_prism_of_six_decimals_is_convex_in_any_unit_turned_and_moved() {
        let folder = tempfile::tempdir().expect("a folder");
        let scene = folder.path().join("scene.toml");
        for (units, radius) in [("mm", 100.0), ("cm", 10.0), ("m", 0.1), ("inch", 4.0)] {
            std::fs::write(folder.path().join("prism.obj"), askew(radius)).expect("a file");
            for placing in ["", "rotate_deg = [10, 20, 30]\nmove_mm = [1e3, -77.7, 1.234567891]\n"] {
                let text = format!("file = \"prism.obj\"\nunits = \"{units}\"\n{placing}");
                let spec: MeshSpec = toml::from_str(&text).expect("a spec");
                let body = of_mesh(&spec, &Folder::of(&scene)).expect("a body").body;
                assert!(body.convexity().is_ok(), "{units} {placing}: {:?}", body.convexity().err());
            }
        }
    }
}
