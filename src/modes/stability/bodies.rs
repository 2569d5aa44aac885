//! Bodies that are hard on purpose.

use glam::DVec3;

use crate::exact::Body;
use crate::geometry::primitives::{block, cube, icosphere, inside_out, prism};
use crate::geometry::{ClosedMesh, MeshFault, TriMesh};

/// A body and what is hard about it.
pub struct HardBody {
    /// In words.
    pub name: &'static str,
    /// The body.
    pub body: Body,
}

/// From 10⁻⁶ to 10⁶ mm in size, 10⁶ mm off the origin, plates and needles of aspect 10⁵, slivers, all but coplanar faces, 4 to
/// 327 680 faces; hollow, starred, and a shell a micrometre thick.
///
/// # Errors
/// None, unless a surface here is not closed.
pub fn hard_bodies() -> Result<Vec<HardBody>, MeshFault> {
    let ball = |subdivisions: u32, radius: DVec3| icosphere(subdivisions).map_vertices(|v| radius * v);
    let round = |subdivisions, radius_mm| ball(subdivisions, DVec3::splat(radius_mm));
    let meshes = [
        ("tetrahedron", tetrahedron()),
        ("cube", cube(64.0)),
        ("ball of 80 faces", round(1, 50.0)),
        ("ball of 1 280 faces", round(3, 50.0)),
        ("ball of 327 680 faces", round(7, 50.0)),
        ("ball of 1e-6 mm", round(2, 5e-7)),
        ("ball of 1e6 mm", round(2, 5e5)),
        ("ball 1e6 mm off", round(2, 50.0).map_vertices(|v| v + DVec3::new(1e6, -1e6, 1e6))),
        ("plate of aspect 1e5", block([-50.0, -50.0, 0.0], [50.0, 50.0, 1e-3])),
        ("lens of aspect 1e5", ball(3, DVec3::new(50.0, 50.0, 5e-4))),
        ("needle of aspect 1e5", ball(3, DVec3::new(5e-4, 5e-4, 50.0))),
        ("prism of slivers", prism(720).map_vertices(|v| v * DVec3::new(30.0, 30.0, 5.0))),
        ("faces all but coplanar", roof(1e-9)),
        ("hollow ball", hollow(round(2, 50.0), cube(40.0))),
        ("star", star()),
        ("shell of 1e-3 mm", hollow(round(2, 50.0), round(2, 49.999))),
    ];
    let body = |(name, mesh): (&'static str, TriMesh)| {
        Ok(HardBody { name, body: Body::new(ClosedMesh::new(mesh)?.0) })
    };
    meshes.into_iter().map(body).collect()
}

/// Of corners with few digits.
fn tetrahedron() -> TriMesh {
    let vertices = vec![DVec3::ZERO, 48.0 * DVec3::X, 40.0 * DVec3::Y, 56.0 * DVec3::Z];
    TriMesh { vertices, faces: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] }
}

/// A block whose roof's four faces rise to its middle by `height_mm`.
fn roof(height_mm: f64) -> TriMesh {
    let mut mesh = block([-40.0, -30.0, -20.0], [40.0, 30.0, 0.0]);
    let on_top = |f: &[u32; 3]| f.iter().all(|&v| mesh.vertices[v as usize].z == 0.0);
    let (top, rest): (Vec<_>, Vec<_>) = mesh.faces.iter().copied().partition(on_top);
    let middle = mesh.vertices.len() as u32;
    // The outline of both triangles of the top, as they are wound: the edges that they do not share.
    let edges = || top.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let outline = edges().filter(|&[a, b]| !edges().any(|other| other == [b, a]));
    mesh.faces = rest.into_iter().chain(outline.map(|[a, b]| [a, b, middle])).collect();
    mesh.vertices.push(DVec3::new(0.0, 0.0, height_mm));
    mesh
}

fn hollow(mut outer: TriMesh, cavity: TriMesh) -> TriMesh {
    outer.append(&inside_out(cavity));
    outer
}

/// A ball every third of whose vertices is drawn in.
fn star() -> TriMesh {
    let mut mesh = icosphere(2);
    for (i, vertex) in mesh.vertices.iter_mut().enumerate() {
        *vertex *= if i % 3 == 0 { 20.0 } else { 50.0 };
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hard_bodies_are_closed_and_those_meant_to_be_convex_are() {
        let bodies = hard_bodies().expect("closed");
        let not_convex: Vec<_> =
            bodies.iter().filter(|hard| hard.body.convexity().is_err()).map(|hard| hard.name).collect();
        assert_eq!(not_convex, ["hollow ball", "star", "shell of 1e-3 mm"]);
        let faces = bodies.iter().map(|hard| hard.body.surface().mesh().faces.len());
        assert_eq!((faces.clone().min(), faces.max()), (Some(4), Some(327_680)));
    }
}
