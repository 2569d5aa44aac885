//! Raw triangle meshes, as files and tessellations give them: nothing is proved about them yet.

use glam::DVec3;

use super::Bounds;

/// Triangles over shared vertices, mm. A *claim* of a surface; `ClosedMesh` is the proof.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriMesh {
    /// Vertex positions, mm.
    pub vertices: Vec<DVec3>,
    /// Indices of each triangle's corners, counter-clockwise seen from outside.
    pub faces: Vec<[u32; 3]>,
}

impl TriMesh {
    /// The three corners of a face.
    pub fn triangle(&self, face: usize) -> [DVec3; 3] {
        self.faces[face].map(|v| self.vertices[v as usize])
    }

    /// All triangles as corner positions.
    pub fn triangles(&self) -> impl Iterator<Item = [DVec3; 3]> + '_ {
        (0..self.faces.len()).map(|f| self.triangle(f))
    }

    /// The box around the vertices.
    pub fn bounds(&self) -> Bounds {
        Bounds::of(self.vertices.iter().copied())
    }

    /// The enclosed volume, mm³ (divergence theorem); negative if the faces look inwards. Meaningless for open meshes.
    ///
    /// Tetrahedra are taken from the box's centre, so that a mesh far from the origin loses no digits.
    pub fn signed_volume(&self) -> f64 {
        let apex = self.bounds().centre();
        self.triangles().map(|[a, b, c]| (a - apex).dot((b - apex).cross(c - apex)) / 6.0).sum()
    }

    /// The surface's area, mm².
    pub fn area(&self) -> f64 {
        self.triangles().map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length()).sum()
    }

    /// Every vertex moved by `f`; faces are kept. A reflection turns the surface inside out.
    pub fn map_vertices(mut self, f: impl Fn(DVec3) -> DVec3) -> Self {
        for v in &mut self.vertices {
            *v = f(*v);
        }
        self
    }

    /// The triangles of `other` added to these.
    pub fn append(&mut self, other: &Self) {
        let offset = self.vertices.len() as u32;
        self.vertices.extend_from_slice(&other.vertices);
        self.faces.extend(other.faces.iter().map(|f| f.map(|v| v + offset)));
    }
}
