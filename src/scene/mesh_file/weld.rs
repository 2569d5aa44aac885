//! Welding: vertices at the same place become one.

use std::collections::HashMap;

use glam::DVec3;

use crate::geometry::TriMesh;

/// A mesh after welding, and what welding did.
#[derive(Clone, Debug, PartialEq)]
pub struct Welded {
    /// The mesh over shared vertices, numbered in order of first use.
    pub mesh: TriMesh,
    /// How many used vertices were joined to another.
    pub joined: usize,
    /// How many faces were removed because two of their corners became (or already were) one vertex.
    pub collapsed: usize,
}

/// The mesh with vertices at most `tolerance` apart joined, and without the faces that this collapses.
/// Vertices that no face uses are dropped.
///
/// `tolerance` is in the unit of the vertices. At 0, positions are joined that are equal number for number
/// (−0 equals 0). Above 0, vertices are taken in order of first use, and each joins the nearest earlier
/// vertex that was *kept* if that is within the tolerance: no vertex moves by more than the tolerance, and a
/// chain of near vertices does not collapse into one point. The result is a function of the mesh alone, but
/// at positive tolerances it may depend on the order of its faces. A tolerance that is negative or NaN acts as 0.
pub fn weld(mesh: &TriMesh, tolerance: f64) -> Welded {
    let mut kept = Kept::new(tolerance);
    let mut new_index: Vec<Option<u32>> = vec![None; mesh.vertices.len()];
    let mut used = 0;
    let mut collapsed = 0;
    let mut faces = Vec::with_capacity(mesh.faces.len());
    for face in &mesh.faces {
        let [a, b, c] = face.map(|v| {
            *new_index[v as usize].get_or_insert_with(|| {
                used += 1;
                kept.find_or_keep(mesh.vertices[v as usize])
            })
        });
        if a == b || b == c || c == a {
            collapsed += 1;
        } else {
            faces.push([a, b, c]);
        }
    }
    let joined = used - kept.positions.len();
    let mut mesh = TriMesh { vertices: kept.positions, faces };
    if collapsed > 0 {
        // Those that only a removed face used.
        mesh.drop_unused_vertices();
    }
    Welded { mesh, joined, collapsed }
}

/// The vertices kept so far, findable by place.
struct Kept {
    tolerance: f64,
    positions: Vec<DVec3>,
    by_bits: HashMap<[u64; 3], u32>,
    by_cell: HashMap<[i64; 3], Vec<u32>>,
}

impl Kept {
    fn new(tolerance: f64) -> Self {
        // `max` turns NaN into 0, too.
        let tolerance = tolerance.max(0.0);
        Self { tolerance, positions: Vec::new(), by_bits: HashMap::new(), by_cell: HashMap::new() }
    }

    /// The kept vertex that `position` joins; if there is none, `position` is kept.
    fn find_or_keep(&mut self, position: DVec3) -> u32 {
        // −0 + 0 is +0: the two zeros get the same bits.
        let position = position + DVec3::ZERO;
        let bits = position.to_array().map(f64::to_bits);
        if let Some(&equal) = self.by_bits.get(&bits) {
            return equal;
        }
        let index = self.nearest(position).unwrap_or_else(|| self.keep(position));
        self.by_bits.insert(bits, index);
        index
    }

    fn keep(&mut self, position: DVec3) -> u32 {
        let index = self.positions.len() as u32;
        self.positions.push(position);
        if self.tolerance > 0.0 {
            self.by_cell.entry(self.cell(position)).or_default().push(index);
        }
        index
    }

    /// The nearest kept vertex within the tolerance, the earliest of equally near ones.
    fn nearest(&self, position: DVec3) -> Option<u32> {
        if self.tolerance == 0.0 {
            return None;
        }
        let [x, y, z] = self.cell(position);
        let around = |c: i64| [c.saturating_sub(1), c, c.saturating_add(1)];
        let mut best: Option<(f64, u32)> = None;
        for i in around(x) {
            for j in around(y) {
                for k in around(z) {
                    for &index in self.by_cell.get(&[i, j, k]).into_iter().flatten() {
                        let distance = self.positions[index as usize].distance(position);
                        let nearer = best.is_none_or(|b| (distance, index) < b);
                        if distance <= self.tolerance && nearer {
                            best = Some((distance, index));
                        }
                    }
                }
            }
        }
        best.map(|(_, index)| index)
    }

    /// The grid cell of a position. Cells are two tolerances wide: vertices within one tolerance then lie in
    /// touching cells even after the quotient's rounding, as long as it is below 2⁵¹; beyond that, coordinates
    /// are so coarse that only equal ones are within the tolerance, and those share a cell.
    fn cell(&self, position: DVec3) -> [i64; 3] {
        (position / (2.0 * self.tolerance)).floor().to_array().map(|c| c as i64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strip(points: &[[f64; 3]]) -> TriMesh {
        let vertices: Vec<DVec3> = points.iter().map(|&p| DVec3::from(p)).collect();
        let faces = (0..vertices.len() as u32 / 3).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
        TriMesh { vertices, faces }
    }

    #[test]
    fn equal_positions_and_the_two_zeros_become_one_vertex() {
        let soup = strip(&[
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [-0.0, 0.0, -0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
        ]);
        let welded = weld(&soup, 0.0);
        assert_eq!((welded.mesh.vertices.len(), welded.joined, welded.collapsed), (4, 2, 0));
        assert_eq!(welded.mesh.faces, [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn the_smallest_difference_keeps_vertices_apart_at_tolerance_zero() {
        let next = 1.0f64.next_up();
        let soup = strip(&[[1.0, 0.0, 0.0], [next, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        assert_eq!(weld(&soup, 0.0).mesh.vertices.len(), 3);
        assert_eq!(weld(&soup, 1e-12).collapsed, 1);
    }

    #[test]
    fn a_collapsed_face_goes_and_its_lonely_vertex_with_it() {
        let soup = strip(&[
            [9.0, 9.0, 9.0],
            [0.0, 0.0, 0.0],
            [0.05, 0.0, 0.0],
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
        ]);
        let welded = weld(&soup, 0.1);
        assert_eq!((welded.mesh.vertices.len(), welded.collapsed), (3, 1));
        assert_eq!(welded.mesh.faces, [[0, 1, 2]]);
    }

    #[test]
    fn a_chain_of_near_vertices_moves_none_beyond_the_tolerance() {
        // 100 points, 0.4 apart, along a diagonal across cell boundaries and through the origin.
        let chain: Vec<[f64; 3]> = (0..100)
            .flat_map(|i| {
                let x = 0.4 * (f64::from(i) - 50.0);
                [[x, x, -x], [x, x + 100.0, 0.0], [x + 100.0, x, 0.0]]
            })
            .collect();
        let soup = strip(&chain);
        let welded = weld(&soup, 1.0);
        assert!(welded.joined > 0 && welded.collapsed == 0);
        for (before, after) in soup.triangles().zip(welded.mesh.triangles()) {
            for (b, a) in before.iter().zip(after) {
                assert!(b.distance(a) <= 1.0, "{b} moved to {a}");
            }
        }
        let kept = &welded.mesh.vertices;
        for (i, a) in kept.iter().enumerate() {
            assert!(kept[..i].iter().all(|b| a.distance(*b) > 1.0), "{a} should have been joined");
        }
    }

    #[test]
    fn a_tolerance_far_below_the_coordinates_digits_still_joins_equal_ones() {
        let far = 1e15;
        let soup = strip(&[
            [far, 0.0, 0.0],
            [0.0, far, 0.0],
            [0.0, 0.0, far],
            [far, 0.0, 0.0],
            [0.0, -far, 0.0],
            [0.0, 0.0, -far],
        ]);
        assert_eq!(weld(&soup, 1e-300).mesh.vertices.len(), 5);
    }
}
