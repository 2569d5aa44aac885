//! Bodies that are hard on purpose.

use glam::DVec3;

use crate::exact::Body;
use crate::geometry::primitives::{block, cube, icosphere, inside_out, prism};
use crate::geometry::{ClosedMesh, MeshFault, TriMesh};

/// A body and what is hard about it.
#[derive(Clone, Copy, Debug)]
pub struct HardBody {
    /// In words.
    pub name: &'static str,
    mesh: fn() -> TriMesh,
}

impl HardBody {
    /// The body.
    ///
    /// # Errors
    /// None, unless its surface is not closed.
    pub fn body(&self) -> Result<Body, MeshFault> {
        Ok(Body::new(ClosedMesh::new((self.mesh)())?.0))
    }
}

/// From 10⁻⁶ to 10⁶ mm in size, 10⁶ mm off the origin, plates and needles of aspect 10⁵, slivers, all but coplanar faces, 4 to
/// 327 680 faces; hollow, starred, and a shell a micrometre thick.
pub const HARD_BODIES: [HardBody; 16] = [
    HardBody { name: "tetrahedron", mesh: tetrahedron },
    HardBody { name: "cube", mesh: || cube(64.0) },
    HardBody { name: "ball of 80 faces", mesh: || ball(1, 50.0) },
    HardBody { name: "ball of 1 280 faces", mesh: || ball(3, 50.0) },
    HardBody { name: "ball of 327 680 faces", mesh: || ball(7, 50.0) },
    HardBody { name: "ball of 1e-6 mm", mesh: || ball(2, 5e-7) },
    HardBody { name: "ball of 1e6 mm", mesh: || ball(2, 5e5) },
    HardBody {
        name: "ball 1e6 mm off",
        mesh: || ball(2, 50.0).map_vertices(|v| v + DVec3::new(1e6, -1e6, 1e6)),
    },
    HardBody { name: "plate of aspect 1e5", mesh: || block([-50.0, -50.0, 0.0], [50.0, 50.0, 1e-3]) },
    HardBody { name: "lens of aspect 1e5", mesh: || ellipsoid([50.0, 50.0, 5e-4]) },
    HardBody { name: "needle of aspect 1e5", mesh: || ellipsoid([5e-4, 5e-4, 50.0]) },
    HardBody {
        name: "prism of slivers",
        mesh: || prism(720).map_vertices(|v| v * DVec3::new(30.0, 30.0, 5.0)),
    },
    HardBody { name: "faces all but coplanar", mesh: || roof(1e-9) },
    HardBody { name: "hollow ball", mesh: || hollow(ball(2, 50.0), cube(40.0)) },
    HardBody { name: "star", mesh: star },
    HardBody { name: "shell of 1e-3 mm", mesh: || hollow(ball(2, 50.0), ball(2, 49.999)) },
];

fn ball(subdivisions: u32, radius_mm: f64) -> TriMesh {
    icosphere(subdivisions).map_vertices(|v| radius_mm * v)
}

fn ellipsoid(half_axes_mm: [f64; 3]) -> TriMesh {
    icosphere(3).map_vertices(|v| v * DVec3::from(half_axes_mm))
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
        let small = HARD_BODIES.iter().filter(|hard| (hard.mesh)().faces.len() < 10_000);
        let bodies: Vec<_> = small.map(|hard| (hard.name, hard.body().expect("closed"))).collect();
        let not_convex: Vec<_> =
            bodies.iter().filter(|(_, body)| body.convexity().is_err()).map(|(name, _)| *name).collect();
        assert_eq!(not_convex, ["hollow ball", "star", "shell of 1e-3 mm"]);
        let faces = HARD_BODIES.map(|hard| (hard.mesh)().faces.len());
        assert_eq!((faces.iter().min(), faces.iter().max()), (Some(&4), Some(&327_680)));
    }
}
