//! Shapes written as equations, and meshes inscribed in them.
//!
//! A shape is written in local coordinates, turned about the local origin, moved, and cut by half-spaces of
//! organ coordinates:
//!
//! ```text
//!   kind + numbers ──► rotate_deg or axes ──► move_mm ──► cuts ──► mesh with vertices on the true surface
//! ```
//!
//! Meshes lie within the true body (convex kinds: hulls of points of the surface; tubes: inscribed outside and
//! circumscribed inside), so bodies that do not cross keep not crossing. How deep a mesh lies under its surface is
//! [`Shape::tessellation_depth_mm`]. A *nested* mesh must keep clear of its parent's by that much.

mod body;
mod checks;
mod cut;
pub(super) mod frame;
mod layout;
mod solid;
mod spec;
mod tube;
mod volume;

use glam::DVec3;

use self::body::Body;
use self::cut::{Cut, CutBody, CutPlan};
use self::frame::Frame;
use self::solid::{Smooth, Solid, polytope_body};
pub use self::spec::{DEFAULT_FACES, MAX_CUTS, MAX_FACES, MAX_POINTS, MIN_FACES, ShapeSpec};
use crate::geometry::{Bounds, HullError, Interval, Line, TriMesh, convex_hull};

/// What is wrong with a shape, by the key at fault, and what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{key}`: {problem}; {remedy}")]
pub struct ShapeProblem {
    /// The key in the scene file.
    pub key: String,
    /// What is wrong with it.
    pub problem: String,
    /// What the user can do about it.
    pub remedy: String,
}

impl ShapeProblem {
    fn new(key: impl Into<String>, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { key: key.into(), problem: problem.into(), remedy: remedy.into() }
    }
}

/// A validated closed shape in organ coordinates, mm. Read from a scene file as [`ShapeSpec`] describes.
#[derive(Clone, Debug, PartialEq, serde::Deserialize)]
#[serde(try_from = "ShapeSpec")]
pub struct Shape {
    solid: Solid,
    frame: Frame,
    /// In organ coordinates.
    cuts: Vec<Cut>,
    faces: usize,
}

/// How near the number of faces comes to the number asked for, as a ratio. Points stand on rings of whole numbers of
/// quarters, so small meshes cannot do better.
const FACES_RATIO: f64 = 1.05;

/// How much finer than the whole body's its points may be after cuts, as a ratio of spacings. A cut that leaves less
/// than about this ratio squared of the curved surface gives fewer faces than asked for, instead of points without
/// end on what was cut away.
const FINEST_AFTER_CUTS: f64 = 0.2;

impl Shape {
    /// Whether the kind of shape is convex, whatever its numbers and cuts: its mesh is then convex exactly.
    pub fn is_convex_by_construction(&self) -> bool {
        matches!(self.solid, Solid::Smooth(_) | Solid::Polytope(_))
    }

    /// A closed mesh of about the asked number of faces, every vertex on the true surface (inner walls of tubes:
    /// within it), mm. Convex kinds give a mesh that is convex exactly.
    ///
    /// Boxes and hulls have as many faces as they have; a body cut down to a sliver has fewer. Errors if the cuts leave nothing, or leave a tube in
    /// pieces.
    pub fn tessellate(&self) -> Result<TriMesh, ShapeProblem> {
        Ok(self.mesh_and_depth(false)?.0)
    }

    /// How deep the mesh lies under the true surface at worst, mm: measured along face normals on a grid in each
    /// face for smooth convex kinds, a bound for tubes and rods, 0 for polyhedra.
    ///
    /// Errors where [`Self::tessellate`] does.
    pub fn tessellation_depth_mm(&self) -> Result<f64, ShapeProblem> {
        Ok(self.mesh_and_depth(true)?.1)
    }

    /// The volume of the true body, mm³. Closed forms; smooth bodies with cuts by adaptive quadrature of exact slice
    /// areas, to 1e-8 of the uncut body. 0 if the cuts leave nothing.
    pub fn volume_mm3(&self) -> f64 {
        let local_cuts: Vec<Cut> = self.cuts.iter().map(|cut| self.frame.cut_to_local(cut)).collect();
        match &self.solid {
            Solid::Smooth(smooth) if local_cuts.is_empty() => smooth.volume(),
            Solid::Smooth(smooth) => {
                smooth.body().pieces.iter().map(|piece| volume::cut_piece_volume(piece, &local_cuts)).sum()
            }
            Solid::Polytope(_) => self.tessellate().map_or(0.0, |mesh| mesh.signed_volume()),
            Solid::EllipticTube(tube) => tube.volume(&local_cuts).unwrap_or(0.0),
            Solid::TorusSector(torus) => torus.volume(),
        }
    }

    /// Whether a point of organ coordinates, mm, is in the true body; its surface counts, up to rounding.
    pub fn contains(&self, point: DVec3) -> bool {
        let local = self.frame.to_local(point);
        let in_solid = match &self.solid {
            Solid::Smooth(smooth) => smooth.body().contains(local),
            Solid::Polytope(mesh) => polytope_body(mesh).contains(local),
            Solid::EllipticTube(tube) => tube.contains(local),
            Solid::TorusSector(torus) => torus.contains(local),
        };
        in_solid && self.cuts.iter().all(|cut| cut.height(point) <= 0.0)
    }

    /// The part of a line in the true body, mm along it: the closed form a mesh's chords are judged by.
    ///
    /// `None` if the line misses or only touches, and for kinds that are not convex, where one interval cannot tell
    /// (see [`Self::is_convex_by_construction`]).
    pub fn chord(&self, line: &Line) -> Option<Interval> {
        let body = self.convex_body()?;
        let cut_body = CutBody { body: &body, frame: self.frame, cuts: &self.cuts };
        cut_body.chord(line, &[], &[]).filter(|chord| chord.length() > 0.0)
    }

    fn convex_body(&self) -> Option<Body> {
        match &self.solid {
            Solid::Smooth(smooth) => Some(smooth.body()),
            Solid::Polytope(mesh) => Some(polytope_body(mesh)),
            Solid::EllipticTube(_) | Solid::TorusSector(_) => None,
        }
    }

    /// The mesh, and how deep it lies, mm; 0 for smooth kinds unless measuring was asked for, which costs more than the mesh.
    fn mesh_and_depth(&self, measure: bool) -> Result<(TriMesh, f64), ShapeProblem> {
        let local_cuts: Vec<Cut> = self.cuts.iter().map(|cut| self.frame.cut_to_local(cut)).collect();
        match &self.solid {
            Solid::Smooth(smooth) => self.tessellate_smooth(smooth, measure),
            Solid::Polytope(mesh) => Ok((self.tessellate_polytope(mesh)?, 0.0)),
            Solid::EllipticTube(tube) => {
                let (mesh, depth_mm) = tube.tessellate(&local_cuts, self.faces)?;
                Ok((self.placed(mesh), depth_mm))
            }
            Solid::TorusSector(torus) => {
                let (mesh, depth_mm) = torus.tessellate(self.faces);
                Ok((self.placed(mesh), depth_mm))
            }
        }
    }

    fn placed(&self, mesh: TriMesh) -> TriMesh {
        mesh.map_vertices(|p| self.frame.to_organ(p))
    }

    fn tessellate_smooth(&self, smooth: &Smooth, measure: bool) -> Result<(TriMesh, f64), ShapeProblem> {
        let body = smooth.body();
        let cut_body = CutBody { body: &body, frame: self.frame, cuts: &self.cuts };
        let uncut = |spacing: f64| -> Vec<DVec3> {
            smooth.points(spacing).into_iter().map(|p| self.frame.to_organ(p)).collect()
        };
        let coarse = Bounds::of(uncut(f64::MAX)).diagonal();
        let spacing = spacing_for(self.faces, [coarse, 0.0], |h| hull_faces(uncut(h).len()));
        let rough = hull(&uncut(spacing))?;
        let mesh = if self.cuts.is_empty() {
            rough
        } else {
            let plan = CutPlan::new(&cut_body, &rough);
            let points = |h: f64| plan.points(&uncut(h), h);
            let range = [coarse, spacing * FINEST_AFTER_CUTS];
            let spacing = spacing_for(self.faces, range, |h| hull_faces(points(h).len()));
            hull(&points(spacing))?
        };
        let depth_mm = if measure { measured_depth(&cut_body, &mesh) } else { 0.0 };
        Ok((mesh, depth_mm))
    }

    /// Clips a polyhedron by one half-space after the other: corners within, and crossings of edges.
    fn tessellate_polytope(&self, mesh: &TriMesh) -> Result<TriMesh, ShapeProblem> {
        let mut mesh = self.placed(mesh.clone());
        for cut in &self.cuts {
            let mut points: Vec<DVec3> =
                mesh.vertices.iter().copied().filter(|&p| cut.height(p) <= 0.0).collect();
            for [a, b, c] in mesh.triangles() {
                for (p, q) in [(a, b), (b, c), (c, a)] {
                    let (hp, hq) = (cut.height(p), cut.height(q));
                    if hp < 0.0 && hq > 0.0 {
                        points.push(p + (hp / (hp - hq)) * (q - p));
                    }
                }
            }
            mesh = hull(&points)?;
        }
        Ok(mesh)
    }
}

fn hull(points: &[DVec3]) -> Result<TriMesh, ShapeProblem> {
    convex_hull(points).map_err(|error| match error {
        HullError::TooFew(_) | HullError::Flat => ShapeProblem::new(
            "cuts",
            "nothing with a volume is left of the shape",
            "move the cuts (they keep `normal · p ≤ offset_mm` in organ coordinates) or drop the organ",
        ),
        HullError::NotFinite(_) => {
            ShapeProblem::new("shape", "a point overflows", "use numbers a body can have, in mm")
        }
    })
}

/// Faces of the hull of points that are all corners: Euler's formula with triangles.
fn hull_faces(points: usize) -> usize {
    (2 * points).saturating_sub(4)
}

/// The spacing, mm, within `[coarse, finest]` that gives about the wanted number of faces; `faces_at` grows as the
/// spacing shrinks.
fn spacing_for(wanted: usize, [coarse, finest]: [f64; 2], faces_at: impl Fn(f64) -> usize) -> f64 {
    let (mut high, mut low) = (coarse, coarse);
    // Steps small enough that no trial has many times the faces wanted.
    while faces_at(low) < wanted && low > finest {
        (high, low) = (low, 0.7 * low);
    }
    let off = |faces: usize| (faces as f64 / wanted as f64).max(wanted as f64 / faces.max(1) as f64);
    let mut best = (low, off(faces_at(low)));
    // Spacings within 2⁻²⁰ of each other differ by no face.
    for _ in 0..20 {
        if best.1 <= FACES_RATIO {
            break;
        }
        let middle = 0.5 * (low + high);
        let faces = faces_at(middle);
        if off(faces) < best.1 {
            best = (middle, off(faces));
        }
        if faces < wanted { high = middle } else { low = middle }
    }
    best.0
}

/// The greatest distance from a face to the true surface, along the face's normal, over a grid in every face.
fn measured_depth(body: &CutBody, mesh: &TriMesh) -> f64 {
    const GRID: usize = 6;
    let mut deepest: f64 = 0.0;
    for [a, b, c] in mesh.triangles() {
        let normal = (b - a).cross(c - a);
        for i in 0..=GRID {
            for j in 0..=GRID - i {
                let (u, v) = (i as f64 / GRID as f64, j as f64 / GRID as f64);
                deepest = deepest.max(body.distance_to_surface(a + u * (b - a) + v * (c - a), normal));
            }
        }
    }
    deepest
}

#[cfg(test)]
mod tests;
