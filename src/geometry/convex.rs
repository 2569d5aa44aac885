//! Convex bodies: closed surfaces all of whose vertices lie behind all of their face planes.

use std::cmp::Ordering;
use std::collections::HashMap;

use glam::DVec3;

use super::numeric::unit_normal;
use super::predicates::side_of_plane;
use super::rounding::arithmetic_mm;
use super::{Bounds, ClosedMesh};

/// A face plane in vertex form: the half-space `normal · (p − point) ≤ 0`.
///
/// The point is a corner of the face, not the foot of the normal: `normal · (point − origin)` then keeps its digits
/// however far from the origin the body lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// A point of the plane, mm.
    pub point: DVec3,
    /// The outward unit normal.
    pub normal: DVec3,
}

/// A convex body: the intersection of its face planes' half-spaces is the body, within
/// [`reflex_depth_mm`](Self::reflex_depth_mm).
#[derive(Clone, Debug)]
pub struct ConvexMesh {
    surface: ClosedMesh,
    /// Each plane once, in the order of the first face in it.
    planes: Vec<Plane>,
    /// By face; a face without area has none.
    plane_of_face: Vec<Option<u32>>,
    reflex_depth_mm: f64,
    is_strict: bool,
}

/// Why a closed surface is not convex. Not an error: such a body is traced by other means.
#[derive(Clone, Debug, PartialEq)]
pub enum NotConvex {
    /// It has several components.
    Components(usize),
    /// It has handles.
    Handles(i64),
    /// A vertex stands out of a face's plane.
    Reflex {
        /// How far at worst, mm.
        depth_mm: f64,
        /// The depth that rounding of the vertices could explain, mm.
        tolerance_mm: f64,
        /// The vertex.
        place: DVec3,
    },
}

impl std::fmt::Display for NotConvex {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Components(n) => write!(f, "it has {n} components"),
            Self::Handles(1) => write!(f, "it has a handle"),
            Self::Handles(n) => write!(f, "it has {n} handles"),
            Self::Reflex { depth_mm, tolerance_mm, place } => write!(
                f,
                "the vertex at {} stands {depth_mm:.3e} mm out of a face's plane (rounding explains {tolerance_mm:.1e} mm)",
                super::fault::Place(*place)
            ),
        }
    }
}

impl ConvexMesh {
    /// Proves that `surface` is convex within the rounding of its vertices, or hands it back with the reason.
    ///
    /// A surface that is convex at each of its edges by exact signs, and that a point within sees once in each direction, is
    /// convex as a whole (see `is_strictly_convex`). Where that does not tell, as in flat faces of many triangles, every
    /// vertex is held against every face's plane: a branch-and-bound search.
    pub fn new(surface: ClosedMesh) -> Result<Self, Box<(ClosedMesh, NotConvex)>> {
        if surface.component_count() > 1 {
            let count = surface.component_count();
            return Err(Box::new((surface, NotConvex::Components(count))));
        }
        if surface.genus() != 0 {
            let handles = surface.genus();
            return Err(Box::new((surface, NotConvex::Handles(handles))));
        }
        // A face without area bounds nothing: its plane is left out, and its neighbours close the body.
        let (planes, plane_of_face) = distinct_planes(&surface);
        if planes.len() == plane_of_face.len() && is_strictly_convex(&surface) {
            // No vertex stands out of an exact plane, so only the rounding of normals and heights is left.
            let reflex_depth_mm = arithmetic_mm(surface.bounds());
            return Ok(Self { surface, planes, plane_of_face, reflex_depth_mm, is_strict: true });
        }
        let tolerance_mm = surface.rounding_tolerance_mm();
        let (depth_mm, place) = planes.iter().fold((0.0, DVec3::ZERO), |worst, plane| {
            surface.farthest_vertex(plane.normal, plane.point, worst.0).unwrap_or(worst)
        });
        if depth_mm > tolerance_mm {
            return Err(Box::new((surface, NotConvex::Reflex { depth_mm, tolerance_mm, place })));
        }
        Ok(Self { surface, planes, plane_of_face, reflex_depth_mm: depth_mm, is_strict: false })
    }

    /// The surface.
    pub fn surface(&self) -> &ClosedMesh {
        &self.surface
    }

    /// The face planes: each once, however many faces lie in it.
    pub fn planes(&self) -> &[Plane] {
        &self.planes
    }

    /// The index of a face's plane. `None` if the face has no area.
    pub fn plane_of(&self, face: usize) -> Option<u32> {
        self.plane_of_face[face]
    }

    /// How far the worst vertex stands out of a face's plane, mm: no more than rounding explains.
    pub fn reflex_depth_mm(&self) -> f64 {
        self.reflex_depth_mm
    }

    /// Whether it is convex at each edge by exact signs, and no two faces at an edge lie in one plane.
    pub fn is_strict(&self) -> bool {
        self.is_strict
    }

    /// The box around it, mm.
    pub fn bounds(&self) -> Bounds {
        self.surface.bounds()
    }
}

/// The planes of the faces, and each face's; faces whose normals are equal to the last bit and whose corners lie in
/// one another's planes without rounding share one. A cylinder's end of five hundred triangles is one plane.
fn distinct_planes(surface: &ClosedMesh) -> (Vec<Plane>, Vec<Option<u32>>) {
    let mut planes: Vec<Plane> = Vec::new();
    let mut by_normal: HashMap<[u64; 3], Vec<u32>> = HashMap::new();
    let of_face = surface
        .mesh()
        .triangles()
        .map(|triangle| {
            let normal = unit_normal(triangle)?;
            // Adding zero makes −0 and 0 one key.
            let alike = by_normal.entry((normal + 0.0).to_array().map(f64::to_bits)).or_default();
            let in_plane = |p: &Plane| triangle.iter().all(|&corner| p.normal.dot(corner - p.point) == 0.0);
            if let Some(&known) = alike.iter().find(|&&i| in_plane(&planes[i as usize])) {
                return Some(known);
            }
            planes.push(Plane { point: triangle[0], normal });
            alike.push(planes.len() as u32 - 1);
            alike.last().copied()
        })
        .collect();
    (planes, of_face)
}

/// Whether a surface of one component is strictly convex, by exact signs: `false` where in doubt.
///
/// It is if it is convex at every edge, if a point lies below all faces, and if each direction from there meets one face
/// only (Mehlhorn et al. 1999, doi:10.1016/S0925-7721(98)00036-4). As the point sees all faces from behind, every direction
/// meets as many as one direction does: without that a surface could wind around the point twice.
fn is_strictly_convex(surface: &ClosedMesh) -> bool {
    let mesh = surface.mesh();
    let middle = mesh.vertices.iter().sum::<DVec3>() / mesh.vertices.len() as f64;
    let is_below = |face: usize, p: DVec3| side_of_plane(mesh.triangle(face), p) == Ordering::Less;
    let is_convex_at = |face: usize| {
        let corners = mesh.faces[face];
        surface.neighbours(face).into_iter().all(|other| {
            // Each edge is asked about once.
            let apex = mesh.faces[other as usize].into_iter().find(|v| !corners.contains(v));
            (other as usize) < face || apex.is_some_and(|v| is_below(face, mesh.vertices[v as usize]))
        })
    };
    (0..mesh.faces.len()).all(|face| is_convex_at(face) && is_below(face, middle))
        && surface.winding_around(middle) == Some(1)
}

#[cfg(test)]
mod tests {
    use super::super::primitives::{cube, icosphere, prism};
    use super::super::rounding::written_grid;
    use super::*;

    fn convex(mesh: super::super::TriMesh) -> Result<ConvexMesh, NotConvex> {
        ConvexMesh::new(ClosedMesh::new(mesh).expect("closed").0).map_err(|refused| refused.1)
    }

    #[test]
    fn cubes_and_ellipsoids_are_convex_wherever_they_lie() {
        for offset in [0.0, 1e3, 1e6] {
            let moved = |v: DVec3| 50.0 * v * DVec3::new(1.0, 0.2, 3.0) + offset;
            let body = convex(icosphere(3).map_vertices(moved)).expect("convex");
            assert_eq!(body.planes().len(), 1280);
            assert!(body.reflex_depth_mm() <= 1e-9, "{offset}: {}", body.reflex_depth_mm());
        }
        let cube = convex(cube(2.0)).expect("convex");
        assert_eq!((cube.reflex_depth_mm(), cube.planes().len()), (0.0, 6));
    }

    #[test]
    fn exact_signs_and_the_search_agree_on_what_is_convex() {
        let surface = |mesh| ClosedMesh::new(mesh).expect("closed").0;
        let ball = icosphere(3).map_vertices(|v| v * DVec3::new(100.0, 80.0, 60.0));
        assert!(is_strictly_convex(&surface(ball.clone())));
        // Flat faces of several triangles are for the search.
        assert!(!is_strictly_convex(&surface(cube(2.0))));
        // Dents of one vertex, deeper than the faces around it bulge.
        for depth in [0.03, 0.1] {
            let mut dented = ball.clone();
            dented.vertices[77] *= 1.0 - depth;
            assert!(!is_strictly_convex(&surface(dented)), "{depth}");
        }
        // Convex at every edge but one ring: two balls through a neck.
        let neck = ball.map_vertices(|v| v * DVec3::new(1.0, 1.0, 0.2 + (v.z / 60.0).powi(2)));
        assert!(!is_strictly_convex(&surface(neck)));
    }

    #[test]
    fn a_dent_of_a_millimetre_is_found_and_measured() {
        let mut dented = icosphere(4).map_vertices(|v| 100.0 * v);
        dented.vertices[777] *= 0.99;
        let Err(NotConvex::Reflex { depth_mm, .. }) = convex(dented) else { panic!("taken for convex") };
        assert!((0.5..3.0).contains(&depth_mm), "{depth_mm}");
    }

    #[test]
    fn a_hull_written_with_six_decimals_stays_convex() {
        let rounded = icosphere(3).map_vertices(|v| (100.0 * v * 1e6).round() / 1e6);
        let body = convex(rounded).expect("convex within a micrometre's rounding");
        assert!(body.reflex_depth_mm() < 2e-6);
        let as_f32 = icosphere(3).map_vertices(|v| (100.0 * v).as_vec3().as_dvec3());
        assert!(convex(as_f32).is_ok());
    }

    #[test]
    fn a_hull_whose_file_was_turned_or_in_metres_stays_convex_on_the_grid_of_its_file() {
        // Six decimals of a metre: no grid of millimetres explains them, the file's does.
        // The prism stands askew, or its faces would be on the grid.
        let askew = glam::DMat3::from_rotation_y(0.5);
        let in_metres = prism(4).map_vertices(|v| (askew * v * 0.1 * 1e6).round() / 1e6);
        let as_f32 = prism(4).map_vertices(|v| (askew * v * 100.0).as_vec3().as_dvec3());
        let turn = glam::DMat3::from_rotation_x(0.3) * glam::DMat3::from_rotation_z(0.7);
        for (file, scale_mm) in [(in_metres, 1000.0), (as_f32, 1.0)] {
            let grid_mm = scale_mm * written_grid(&file.vertices);
            let placed = file.map_vertices(|v| turn * (v * scale_mm));
            let (surface, _) = ClosedMesh::new(placed).expect("closed");
            assert!(ConvexMesh::new(surface.clone()).is_err(), "else nothing is shown");
            let body = ConvexMesh::new(surface.with_written_grid_mm(grid_mm)).expect("convex");
            assert!(body.reflex_depth_mm() <= 2.0 * grid_mm, "{}", body.reflex_depth_mm());
        }
    }

    #[test]
    fn a_dent_deeper_than_the_files_grid_is_still_found() {
        let mut dented = icosphere(4).map_vertices(|v| (0.1 * v * 1e6).round() / 1e6);
        dented.vertices[777] *= 0.99;
        let grid_mm = 1000.0 * written_grid(&dented.vertices);
        let (surface, _) = ClosedMesh::new(dented.map_vertices(|v| 1000.0 * v)).expect("closed");
        assert!(ConvexMesh::new(surface.with_written_grid_mm(grid_mm)).is_err());
    }

    #[test]
    fn two_cubes_side_by_side_are_not_convex() {
        let mut pair = cube(2.0);
        pair.append(&cube(2.0).map_vertices(|v| v + 5.0));
        assert_eq!(convex(pair).err(), Some(NotConvex::Components(2)));
    }
}
