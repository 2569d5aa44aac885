//! Closed surfaces: what a raw mesh must prove before any ray meets it.
//!
//! ```text
//! TriMesh ──► finite? faces? ──► every edge in two faces? ──► one winding per component ──► outward ──► ClosedMesh
//!               (fault)              (fault: open,                (turned, notice)          (turned,
//!                                     not manifold)                                          notice)
//! ```

use std::collections::BTreeMap;

use glam::DVec3;

use super::boxtree::BoxTree;
use super::fault::{MeshFault, Notice};
use super::inside::{Side, crossings_ahead, side_of_surface, winding_around};
use super::numeric::settled;
use super::rounding::rounding_tolerance_mm;
use super::topology::{Components, Edges};
use super::{Bounds, TriMesh};

/// A closed, 2-manifold, outward-looking surface, and the box hierarchy over its faces.
///
/// Several components are allowed: side by side, or as a cavity (inward-looking, inside another). That the surface
/// does not cross itself and that its components share no volume is proved separately, by `self_crossing` and
/// `check_components`, because bodies made as convex hulls cannot.
#[derive(Clone, Debug)]
pub struct ClosedMesh {
    mesh: TriMesh,
    components: Vec<u32>,
    component_count: usize,
    edges: Edges,
    tree: BoxTree,
    rounding_tolerance_mm: f64,
}

impl ClosedMesh {
    /// Proves that `mesh` is closed, turning faces outward where the file had them wrong; each repair is a notice.
    ///
    /// # Errors
    /// The first fault found, with its place: see [`MeshFault`].
    pub fn new(mesh: TriMesh) -> Result<(Self, Vec<Notice>), MeshFault> {
        let mut notices = Vec::new();
        check_numbers(&mesh)?;
        let mut mesh = mesh.map_vertices(|v| DVec3::from(v.to_array().map(settled)));
        let before = mesh.faces.len();
        mesh.faces.retain(|&[a, b, c]| a != b && b != c && c != a);
        if mesh.faces.len() < before {
            notices.push(Notice::CollapsedFaces(before - mesh.faces.len()));
        }
        if mesh.faces.is_empty() {
            return Err(MeshFault::Empty);
        }
        match mesh.drop_unused_vertices() {
            0 => {}
            unused => notices.push(Notice::UnusedVertices(unused)),
        }

        let mut edges = Edges::new(&mesh)?;
        let turned = edges.make_winding_consistent(&mut mesh)?;
        if turned > 0 {
            notices.push(Notice::TurnedFaces { turned, of: mesh.faces.len() });
        }
        let Components { of_face, count } = edges.components(mesh.faces.len());
        let tree = BoxTree::build(&face_boxes(&mesh));
        let rounding_tolerance_mm = rounding_tolerance_mm(&mesh.vertices, None);
        let mut closed =
            Self { mesh, components: of_face, component_count: count, edges, tree, rounding_tolerance_mm };
        closed.turn_outward(&mut notices)?;
        Ok((closed, notices))
    }

    /// The same surface, known to have been written on a grid of this spacing, mm: see
    /// [`written_grid`](super::written_grid). Without, the grid is taken from its coordinates, which shows it no more
    /// once they were scaled or turned.
    pub fn with_written_grid_mm(mut self, grid_mm: f64) -> Self {
        self.rounding_tolerance_mm = rounding_tolerance_mm(&self.mesh.vertices, Some(grid_mm));
        self
    }

    /// The same surface, a part of `whole`, whose rounding it shares.
    pub(super) fn with_rounding_of(mut self, whole: &Self) -> Self {
        self.rounding_tolerance_mm = whole.rounding_tolerance_mm;
        self
    }

    /// How far rounding of its vertices can make a convex surface's vertex stand out of a face's plane, mm.
    pub fn rounding_tolerance_mm(&self) -> f64 {
        self.rounding_tolerance_mm
    }

    /// The triangles, outward.
    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// The faces on the other side of each of a face's edges: entry `i` across the edge from corner `i` to `i + 1`.
    pub fn neighbours(&self, face: usize) -> [u32; 3] {
        self.edges.neighbours(face)
    }

    /// The hierarchy of the faces' boxes.
    pub fn tree(&self) -> &BoxTree {
        &self.tree
    }

    /// How many pieces are not joined by an edge.
    pub fn component_count(&self) -> usize {
        self.component_count
    }

    /// The component of each face, numbered in the order of their first faces.
    pub(super) fn component_of_face(&self) -> &[u32] {
        &self.components
    }

    /// One face of each component: the first in the mesh's order.
    pub fn first_faces(&self) -> impl Iterator<Item = usize> + '_ {
        // Components are numbered in the order of their first faces.
        let mut next = 0;
        let firsts = self.components.iter().enumerate().filter_map(move |(face, &component)| {
            let is_first = component == next;
            next += u32::from(is_first);
            is_first.then_some(face)
        });
        // After the last, the rest of a large mesh need not be looked at.
        firsts.take(self.component_count)
    }

    /// The number of handles of a surface of one component: 0 for a ball, 1 for a torus.
    pub fn genus(&self) -> i64 {
        let (v, f) = (self.mesh.vertices.len() as i64, self.mesh.faces.len() as i64);
        let euler = v - f * 3 / 2 + f;
        (2 * self.component_count as i64 - euler) / 2
    }

    /// The box around it, mm.
    pub fn bounds(&self) -> Bounds {
        self.tree.bounds()
    }

    /// The enclosed volume, mm³; positive.
    pub fn volume_mm3(&self) -> f64 {
        self.mesh.signed_volume()
    }

    /// The centre of mass of the enclosed volume, mm. It may lie outside a body that is not convex.
    pub fn centroid_mm(&self) -> DVec3 {
        self.mesh.centroid_mm()
    }

    /// On which side of the surface `point` lies. Exact.
    pub fn side_of(&self, point: DVec3) -> Side {
        side_of_surface(&self.mesh, &self.tree, point)
    }

    /// How often the surface winds around a point: once inside a solid. `None` on the surface. Exact.
    pub(super) fn winding_around(&self, point: DVec3) -> Option<i32> {
        winding_around(&self.mesh, &self.tree, point)
    }

    /// The greatest height `normal · (vertex − from)` of a vertex above `at_least`, and that vertex. `None` if there is
    /// none. In the unit of `normal` times mm.
    pub fn farthest_vertex(&self, normal: DVec3, from: DVec3, at_least: f64) -> Option<(f64, DVec3)> {
        let best = std::cell::Cell::new((at_least, None));
        let highest_in = |b: &Bounds| {
            let corner = DVec3::select(normal.cmpge(DVec3::ZERO), b.max, b.min);
            normal.dot(corner - from)
        };
        let look_at = |face: u32| {
            for vertex in self.mesh.triangle(face as usize) {
                let height = normal.dot(vertex - from);
                if height > best.get().0 {
                    best.set((height, Some(vertex)));
                }
            }
        };
        self.tree.visit(|b| highest_in(b) > best.get().0, look_at);
        let (height, vertex) = best.get();
        vertex.map(|v| (height, v))
    }

    /// Whether some vertex has a height `normal · (vertex − from)` above `height`: as [`farthest_vertex`](Self::farthest_vertex)
    /// would find, but the first will do.
    pub fn reaches_above(&self, normal: DVec3, from: DVec3, height: f64) -> bool {
        let is_found = std::cell::Cell::new(false);
        let highest_in = |b: &Bounds| {
            let corner = DVec3::select(normal.cmpge(DVec3::ZERO), b.max, b.min);
            normal.dot(corner - from)
        };
        let look_at = |face: u32| {
            let is_above = |vertex: DVec3| normal.dot(vertex - from) > height;
            is_found.set(is_found.get() || self.mesh.triangle(face as usize).into_iter().any(is_above));
        };
        // Most that do reach so high do in the boxes that reach highest.
        self.tree.items_down_by(highest_in).iter().for_each(|&face| look_at(face));
        self.tree.visit(|b| !is_found.get() && highest_in(b) > height, look_at);
        is_found.get()
    }

    /// A bound of the vertices' heights over the plane through `from` across `normal`, no more than `slack` above the highest
    /// (or above `at_least`, if that is higher), and the highest vertex seen on the way. Quicker than to find the highest.
    pub fn height_bound(
        &self,
        normal: DVec3,
        from: DVec3,
        at_least: f64,
        slack: f64,
    ) -> (f64, Option<DVec3>) {
        let best = std::cell::Cell::new((at_least, None));
        let bound = std::cell::Cell::new(at_least);
        self.tree.visit(
            |b| {
                let corner = DVec3::select(normal.cmpge(DVec3::ZERO), b.max, b.min);
                let height = normal.dot(corner - from);
                let is_higher = height > best.get().0 + slack;
                if !is_higher {
                    bound.set(bound.get().max(height));
                }
                is_higher
            },
            |face| {
                for vertex in self.mesh.triangle(face as usize) {
                    let height = normal.dot(vertex - from);
                    if height > best.get().0 {
                        best.set((height, Some(vertex)));
                    }
                }
            },
        );
        let (height, vertex) = best.get();
        (bound.get().max(height), vertex)
    }

    /// The distance from `point` to the surface, mm, in f64.
    pub fn distance_mm(&self, point: DVec3) -> f64 {
        let to_face = |f: usize| super::predicates::squared_distance(point, self.mesh.triangle(f));
        // Any face bounds the search; a few spread over the mesh bound it well.
        let few = (0..self.mesh.faces.len()).step_by(1 + self.mesh.faces.len() / 16).map(to_face);
        let nearest = std::cell::Cell::new(few.fold(f64::INFINITY, f64::min));
        self.tree.visit(
            |b| (point.clamp(b.min, b.max) - point).length_squared() < nearest.get(),
            |f| nearest.set(nearest.get().min(to_face(f as usize))),
        );
        nearest.get().sqrt()
    }

    /// Makes solids look outward and cavities inward.
    fn turn_outward(&mut self, notices: &mut Vec<Notice>) -> Result<(), MeshFault> {
        let of = self.component_count;
        let pieces = self.pieces();
        if let Some(flat) = pieces.iter().position(Piece::is_flat) {
            return Err(MeshFault::Flat { component: flat + 1, of });
        }
        let around: Vec<Vec<usize>> = (0..of).map(|c| self.enclosing(c, &pieces[c])).collect();
        let is_wrong: Vec<bool> =
            (0..of).map(|c| (pieces[c].volume > 0.0) != around[c].len().is_multiple_of(2)).collect();
        // Solid and cavity may both look the wrong way, as in a mirrored file. If only one does, nobody can tell
        // whether it is turned or a solid within a solid.
        if let Some(inner) = (0..of).find(|&c| around[c].iter().any(|&o| is_wrong[o] != is_wrong[c])) {
            return Err(MeshFault::OverlappingComponents { component: inner + 1, of });
        }
        let components = is_wrong.iter().filter(|&&wrong| wrong).count();
        if components == 0 {
            return Ok(());
        }
        for face in 0..self.mesh.faces.len() {
            if is_wrong[self.components[face] as usize] {
                self.edges.turn(&mut self.mesh, face);
            }
        }
        notices.push(Notice::TurnedInsideOut { components, of });
        Ok(())
    }

    fn pieces(&self) -> Vec<Piece> {
        let mut pieces =
            vec![Piece { bounds: Bounds::EMPTY, volume: 0.0, faces: Vec::new() }; self.component_count];
        for (face, &component) in self.components.iter().enumerate() {
            let piece = &mut pieces[component as usize];
            piece.faces.push(face as u32);
            piece.bounds = self.mesh.triangle(face).into_iter().fold(piece.bounds, Bounds::with);
        }
        for piece in &mut pieces {
            let apex = piece.bounds.centre();
            let cone = |&face: &u32| {
                let [a, b, c] = self.mesh.triangle(face as usize).map(|p| p - apex);
                a.dot(b.cross(c)) / 6.0
            };
            piece.volume = piece.faces.iter().map(cone).sum();
        }
        pieces
    }

    /// The other components that enclose this one.
    ///
    /// Asked of its corners and face centres in turn, as the first may lie on another's surface. A component all of
    /// whose places do so is taken to be enclosed by none.
    fn enclosing(&self, component: usize, piece: &Piece) -> Vec<usize> {
        if self.component_count == 1 {
            return Vec::new();
        }
        let triangles = || piece.faces.iter().map(|&f| self.mesh.triangle(f as usize));
        let corners = triangles().map(|[corner, _, _]| corner);
        let centres = triangles().map(|[a, b, c]| (a + b + c) / 3.0);
        corners.chain(centres).find_map(|place| self.around(component, place)).unwrap_or_default()
    }

    /// The components but one that wind around a place. `None` if it lies on one of them.
    fn around(&self, but: usize, place: DVec3) -> Option<Vec<usize>> {
        let mut turns: BTreeMap<usize, i32> = BTreeMap::new();
        let mut on_another = false;
        crossings_ahead(&self.mesh, &self.tree, place, |face, crossing| {
            let component = self.components[face as usize] as usize;
            if component != but {
                match crossing {
                    Some(winding) => *turns.entry(component).or_default() += winding,
                    None => on_another = true,
                }
            }
        });
        (!on_another).then(|| turns.into_iter().filter(|&(_, n)| n != 0).map(|(c, _)| c).collect())
    }
}

/// One component of a surface.
#[derive(Clone)]
struct Piece {
    bounds: Bounds,
    /// Enclosed, mm³; negative if it looks inwards.
    volume: f64,
    faces: Vec<u32>,
}

impl Piece {
    /// Written so that NaN is flat.
    fn is_flat(&self) -> bool {
        let encloses = self.volume.abs() > SMALLEST_FILL * self.bounds.size().max_element().powi(3);
        !encloses
    }
}

/// A component that fills less than this share of its cube encloses nothing but rounding: 2⁻⁵² of a cube, times the
/// some hundred faces whose volumes cancel.
const SMALLEST_FILL: f64 = 1e-13;

fn check_numbers(mesh: &TriMesh) -> Result<(), MeshFault> {
    if mesh.faces.is_empty() {
        return Err(MeshFault::Empty);
    }
    if let Some(vertex) = mesh.vertices.iter().position(|v| !v.is_finite()) {
        return Err(MeshFault::NotFinite { vertex: vertex + 1 });
    }
    if let Some(vertex) = mesh.vertices.iter().position(|v| v.abs().max_element() > LARGEST_COORDINATE_MM) {
        return Err(MeshFault::TooFar { vertex: vertex + 1, limit_mm: LARGEST_COORDINATE_MM });
    }
    let count = mesh.vertices.len() as u32;
    match mesh.faces.iter().position(|f| f.iter().any(|&v| v >= count)) {
        Some(face) => Err(MeshFault::IndexOutOfRange { face: face + 1, vertices: mesh.vertices.len() }),
        None => Ok(()),
    }
}

/// Coordinates beyond a thousand million kilometres leave the range in which the exact predicates were checked, and hold no
/// patient.
const LARGEST_COORDINATE_MM: f64 = 1e15;

fn face_boxes(mesh: &TriMesh) -> Vec<Bounds> {
    mesh.triangles().map(Bounds::of).collect()
}

#[cfg(test)]
mod tests;
