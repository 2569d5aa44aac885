//! The vertex of a convex body that is farthest along a direction, by climbing over the surface.

use glam::DVec3;

use super::Walker;

impl Walker {
    /// The vertex farthest along `normal`, found by climbing from one neighbour to the next: on a convex surface, a vertex that
    /// no neighbour is above is above all, but for the rounding of heights. `None` if edges are flat within rounding, where a
    /// climb might end too early.
    pub fn highest_vertex(&self, normal: DVec3) -> Option<DVec3> {
        let start_of = |half_edge: u32| {
            let corner = self.faces[half_edge as usize / 4].corners[half_edge as usize % 4];
            self.vertices[corner as usize]
        };
        let mut here = 4 * self.seeds.facing(normal);
        let mut height = normal.dot(start_of(here));
        for _ in 0..if self.is_strict { self.faces.len() } else { 0 } {
            let (mut around, mut next) = (here, None);
            loop {
                let [edge, before] = [around % 4, (around % 4 + 2) % 3].map(|edge| edge as usize);
                let face = &self.faces[around as usize / 4];
                let above = normal.dot(self.vertices[face.corners[(edge + 1) % 3] as usize]);
                if above > height {
                    (height, next) = (above, Some(face.twins[edge]));
                }
                around = face.twins[before];
                if around == here {
                    break;
                }
            }
            match next {
                Some(higher) => here = higher,
                None => return Some(start_of(here)),
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::primitives::{cube, icosphere};
    use crate::geometry::{ClosedMesh, ConvexMesh, TriMesh};

    fn walker(mesh: TriMesh) -> Walker {
        Walker::new(&ConvexMesh::new(ClosedMesh::new(mesh).expect("closed").0).expect("convex"))
    }

    #[test]
    fn a_climb_ends_at_the_highest_vertex_of_all() {
        for subdivisions in [0, 2, 4] {
            let mesh = icosphere(subdivisions).map_vertices(|v| v * DVec3::new(100.0, 8.0, 60.0) + 300.0);
            let walker = walker(mesh.clone());
            for i in 0..200 {
                let (a, b) = (f64::from(i) * 2.4, f64::from(i) * 0.7);
                let normal = DVec3::new(a.cos() * b.sin(), a.sin() * b.sin(), b.cos());
                let highest = mesh.vertices.iter().map(|v| normal.dot(*v)).fold(f64::NEG_INFINITY, f64::max);
                let climbed = walker.highest_vertex(normal).expect("no flat edges");
                assert!(highest - normal.dot(climbed) < 1e-12, "{normal}");
            }
        }
    }

    #[test]
    fn nothing_is_climbed_where_edges_are_flat() {
        assert_eq!(walker(cube(2.0)).highest_vertex(DVec3::ONE), None);
    }
}
