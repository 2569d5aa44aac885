//! Convex bodies: closed surfaces all of whose vertices lie behind all of their face planes.

use std::collections::HashMap;

use glam::DVec3;

use super::numeric::{gamma, unit_normal};
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
    /// Every vertex is held against every face's plane (a branch-and-bound search, about n log n).
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
        let tolerance_mm = rounding_tolerance_mm(surface.mesh().vertices.iter());
        let (depth_mm, place) = planes.iter().fold((0.0, DVec3::ZERO), |worst, plane| {
            surface.farthest_vertex(plane.normal, plane.point, worst.0).unwrap_or(worst)
        });
        if depth_mm > tolerance_mm {
            return Err(Box::new((surface, NotConvex::Reflex { depth_mm, tolerance_mm, place })));
        }
        Ok(Self { surface, planes, plane_of_face, reflex_depth_mm: depth_mm })
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

/// How far rounding of its vertices can make a convex surface's vertex stand out of a face's plane, mm.
///
/// Two terms: the grid on which the coordinates were written (decimals of a text file, f32 of an STL file) moves
/// vertex and plane by up to half a grid diagonal each; and f64 arithmetic errs by γ₁₀ of the extent (three
/// differences, a dot product, a unit normal of three roundings).
pub fn rounding_tolerance_mm<'a>(vertices: impl Iterator<Item = &'a DVec3> + Clone) -> f64 {
    let bounds = Bounds::of(vertices.clone().copied());
    let largest = bounds.min.abs().max(bounds.max.abs()).max_element();
    let arithmetic = gamma(10) * bounds.diagonal();
    let grid = written_grid_mm(vertices, largest);
    let half_diagonal = 0.5 * 3f64.sqrt() * grid;
    arithmetic + 2.0 * half_diagonal
}

/// The coarsest grid all coordinates lie on: a decimal one of up to nine places, else the spacing of f32, else of
/// f64, at the largest coordinate.
///
/// Bodies whose coordinates are short decimals by nature (a 10 mm cube) would seem written on a coarse grid, so
/// no grid coarser than a micrometre, the coarsest that mesh writers use, is assumed.
fn written_grid_mm<'a>(vertices: impl Iterator<Item = &'a DVec3> + Clone, largest: f64) -> f64 {
    let coordinates = || vertices.clone().flat_map(|v| v.to_array());
    let on_decimal_grid = |places: i32| {
        let scale = 10f64.powi(places);
        // A decimal is off its nearest f64 by half a unit in the last place, and so is the product.
        coordinates()
            .all(|x| ((x * scale).round() - x * scale).abs() <= 4.0 * f64::EPSILON * (x * scale).abs())
    };
    let f64_spacing = largest * f64::EPSILON;
    if let Some(places) = (6..=9).find(|&p| on_decimal_grid(p)) {
        return 10f64.powi(-places).max(f64_spacing);
    }
    if coordinates().all(|x| f64::from(x as f32) == x) {
        return largest * f64::from(f32::EPSILON);
    }
    f64_spacing
}

#[cfg(test)]
mod tests {
    use super::super::primitives::{cube, icosphere};
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
    fn two_cubes_side_by_side_are_not_convex() {
        let mut pair = cube(2.0);
        pair.append(&cube(2.0).map_vertices(|v| v + 5.0));
        assert_eq!(convex(pair).err(), Some(NotConvex::Components(2)));
    }
}
