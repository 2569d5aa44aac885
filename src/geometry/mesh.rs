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
    #[inline(always)]
    pub fn triangle(&self, face: usize) -> [DVec3; 3] {
        let [a, b, c] = self.faces[face];
        [self.vertices[a as usize], self.vertices[b as usize], self.vertices[c as usize]]
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

    /// The centre of mass of what the surface encloses, mm, by tetrahedra from one vertex: far from the origin too, none is
    /// much larger than the body. Not finite if nothing is enclosed.
    pub fn centroid_mm(&self) -> DVec3 {
        let base = self.vertices.first().copied().unwrap_or_default();
        let (mut volume, mut moment) = (0.0, DVec3::ZERO);
        for corners in self.triangles() {
            let [a, b, c] = corners.map(|corner| corner - base);
            let six_volumes = a.dot(b.cross(c));
            volume += six_volumes;
            moment += six_volumes * (a + b + c);
        }
        base + moment / (4.0 * volume)
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

    /// Drops the vertices of no face and numbers the others in order of first use. Returns how many were dropped.
    pub fn drop_unused_vertices(&mut self) -> usize {
        let mut new_index: Vec<Option<u32>> = vec![None; self.vertices.len()];
        let mut used = Vec::with_capacity(self.vertices.len());
        for corner in self.faces.as_flattened_mut() {
            let old = *corner as usize;
            *corner = *new_index[old].get_or_insert_with(|| {
                used.push(self.vertices[old]);
                used.len() as u32 - 1
            });
        }
        let dropped = self.vertices.len() - used.len();
        self.vertices = used;
        dropped
    }

    /// The triangles of `other` added to these.
    pub fn append(&mut self, other: &Self) {
        let offset = self.vertices.len() as u32;
        self.vertices.extend_from_slice(&other.vertices);
        self.faces.extend(other.faces.iter().map(|f| f.map(|v| v + offset)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_centroid_of_a_cube_far_away_is_its_middle_and_children_weigh_by_volume() {
        use crate::geometry::primitives::cube;
        let far = DVec3::new(1e4, -2e4, 3e4);
        let mut mesh = cube(2.0).map_vertices(|v| v + far);
        assert!((mesh.centroid_mm() - far).length() < 1e-9);
        // Eight times the volume, nine units away.
        mesh.append(&cube(4.0).map_vertices(|v| v + far + DVec3::new(9.0, 0.0, 0.0)));
        assert!((mesh.centroid_mm() - far - DVec3::new(8.0, 0.0, 0.0)).length() < 1e-9);
    }

    #[test]
    fn unused_vertices_go_and_the_rest_is_numbered_by_first_use() {
        let vertices = (0..5).map(|i| DVec3::splat(f64::from(i))).collect();
        let mut mesh = TriMesh { vertices, faces: vec![[4, 1, 3]] };
        assert_eq!(mesh.drop_unused_vertices(), 2);
        assert_eq!(mesh.faces, [[0, 1, 2]]);
        assert_eq!(mesh.vertices, [4.0, 1.0, 3.0].map(DVec3::splat));
        assert_eq!(mesh.drop_unused_vertices(), 0);
    }
}
