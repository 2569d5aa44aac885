//! Wavefront OBJ: triangle meshes as text, one or several in a file.

use std::io::{self, Write};
use std::path::Path;

use super::atomic::write_atomically;
use crate::geometry::TriMesh;
use crate::{Error, Result};

/// A mesh and the name under which a file holds it.
#[derive(Clone, Copy, Debug)]
pub struct NamedMesh<'a> {
    /// The object's name; control characters become spaces, and a backslash at the end goes.
    pub name: &'a str,
    /// The triangles, mm.
    pub mesh: &'a TriMesh,
}

/// Writes meshes as the objects (`o NAME`) of one OBJ file, after `comments`, one a line. Returns the number
/// of bytes. Coordinates are written in their shortest form that reads back as the same f64.
///
/// # Errors
/// If there is no mesh, if a name is empty, a coordinate not finite or a corner not a vertex, or if the file cannot
/// be written. Source: Wavefront, *Advanced Visualizer* manual, appendix B1.
pub fn write(path: &Path, comments: &[&str], meshes: &[NamedMesh]) -> Result<u64> {
    let named: Vec<(String, &TriMesh)> = meshes.iter().map(|m| (one_line(m.name), m.mesh)).collect();
    check(path, &named)?;
    write_atomically(path, |out| {
        for comment in comments {
            writeln!(out, "# {}", one_line(comment))?;
        }
        // OBJ counts vertices from 1, and through all objects of a file.
        let mut first_vertex = 1;
        for (name, mesh) in &named {
            write_object(out, name, mesh, first_vertex)?;
            first_vertex += mesh.vertices.len() as u64;
        }
        Ok(())
    })
}

fn write_object(out: &mut dyn Write, name: &str, mesh: &TriMesh, first_vertex: u64) -> io::Result<()> {
    writeln!(out, "o {name}")?;
    for v in &mesh.vertices {
        writeln!(out, "v {} {} {}", v.x, v.y, v.z)?;
    }
    for face in &mesh.faces {
        let [a, b, c] = face.map(|v| first_vertex + u64::from(v));
        writeln!(out, "f {a} {b} {c}")?;
    }
    Ok(())
}

fn check(path: &Path, meshes: &[(String, &TriMesh)]) -> Result<()> {
    let refused = |problem: String, remedy: &str| Error::input(path.display().to_string(), problem, remedy);
    if meshes.is_empty() {
        return Err(refused("there is no mesh to write".into(), "choose at least one organ"));
    }
    for (name, mesh) in meshes {
        if name.is_empty() {
            return Err(refused("a mesh has no name".into(), "name every organ"));
        }
        if let Some(i) = mesh.vertices.iter().position(|v| !v.is_finite()) {
            return Err(refused(format!("{name}: vertex {i} is not finite"), "check the organ's numbers"));
        }
        if let Some(i) = mesh.faces.iter().position(|f| f.iter().any(|&v| v as usize >= mesh.vertices.len()))
        {
            return Err(refused(
                format!("{name}: face {i} has a vertex that does not exist"),
                "check the organ's mesh",
            ));
        }
    }
    Ok(())
}

/// Text that stays on its line: a backslash at the end would draw the next line to it.
fn one_line(text: &str) -> String {
    let line: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    line.trim().trim_end_matches(['\\', ' ']).to_owned()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::mesh_file::{ReadOptions, read};

    fn tetrahedron(offset: f64) -> TriMesh {
        let vertices = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].map(|v| v / 3.0 + offset).to_vec();
        TriMesh { vertices, faces: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] }
    }

    #[test]
    fn several_meshes_come_back_by_name_with_the_same_bits() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("organs.obj");
        let [liver, spleen] = [0.1, -1e3].map(tetrahedron);
        let meshes = [
            NamedMesh { name: "liver", mesh: &liver },
            NamedMesh { name: " left\nspleen \\", mesh: &spleen },
        ];
        let bytes = write(&path, &["chordfield,\nmillimetres \\"], &meshes).expect("written");
        assert_eq!(bytes, path.metadata().expect("a file").len());
        for (name, mesh) in [("liver", &liver), ("left spleen", &spleen)] {
            let options = ReadOptions { groups: Some(vec![name.into()]), ..ReadOptions::default() };
            let back = read(&path, &options).expect("a mesh");
            assert_eq!(back.groups, ["liver", "left spleen"]);
            let points = |m: &TriMesh| m.triangles().collect::<Vec<_>>();
            assert_eq!(points(&back.mesh), points(mesh));
        }
    }

    #[test]
    fn meshes_that_cannot_be_read_back_are_not_written() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("organs.obj");
        let mut unfinished = tetrahedron(0.0);
        unfinished.vertices[2].y = f64::NAN;
        let mut torn = tetrahedron(0.0);
        torn.faces[3][1] = 4;
        let good = tetrahedron(0.0);
        for (name, mesh) in [("nan", &unfinished), ("torn", &torn), (" \n", &good)] {
            assert!(write(&path, &[], &[NamedMesh { name, mesh }]).is_err(), "{name}");
        }
        assert!(write(&path, &[], &[]).is_err());
        assert!(!path.exists());
    }
}
