//! Chords of convex bodies by walking over the surface from face to face.
//!
//! ```text
//!    faces that look at the source, in the line's frame        a face whose every edge has the line on its inner side is
//!          ╱╲─────╱╲────╲                                      pierced; otherwise step over an edge that parts the
//!  start ─▶ ●╲ ──▶ ╲ ──▶ ╲ × line                              line from the face. To step over the outline, to a face
//!          ╲__╲─────╲╱────╲                                    that looks away, proves that the line misses.
//! ```
//!
//! Seen along the line, the faces of a convex body that look one way are a regular triangulation of its outline, in which
//! such a walk never meets a face twice (Edelsbrunner 1990, doi:10.1007/BF02122779). Entry and exit are two walks.
//!
//! Vertices are rounded one by one into the line's frame (`shear`), and from there on every sign is exact, ties broken as
//! everywhere (`predicates::side_of_edge`). So the face that a line pierces is a function of the line alone, wherever the
//! walk began. What rounding of the vertices could decide wrongly is not decided here: lines within [`Walker`]'s slack of
//! the outline, faces seen nearly edge-on, and walks longer than any should be, are [`Unsure`] and go to an engine that is not in doubt.

mod abreast;
mod climb;
mod cone;
mod held;
mod seeds;
mod sets;
#[cfg(test)]
mod tests;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::shear::Across;
use crate::geometry::numeric::{UNIT_ROUNDOFF, gamma};
use crate::geometry::predicates::side_of_edge;
use crate::geometry::{ConvexMesh, Interval, Line};
use seeds::SeedTable;

/// The walk cannot tell, and another engine should.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unsure;

/// A line's way through a convex body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pass {
    /// The part of the line in the body, along its direction.
    pub chord: Interval,
    /// The face through which it enters.
    pub entry_face: u32,
    /// The face through which it leaves.
    pub exit_face: u32,
}

/// Faces from which to walk to the entry and to the exit. Any faces will do; near ones are quicker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seeds {
    /// Near the entry.
    pub entry: u32,
    /// Near the exit.
    pub exit: u32,
}

/// A convex body made ready for walks: 76 bytes a face, and a table of seeds of 16 bytes a face, up to two megabytes.
#[derive(Clone, Debug)]
pub struct Walker {
    faces: Vec<Face>,
    /// In the order in which the faces use them, so that near ones lie together.
    vertices: Vec<DVec3>,
    centre: DVec3,
    /// No vertex is farther from the centre in any coordinate, mm.
    reach: f64,
    /// How far the outline may be off for the vertices' own rounding, mm.
    outline_slack: f64,
    /// No walk over a fair mesh is longer than a few times across it.
    longest_walk: u32,
    /// Whether no edge is flat or reflex, so that one can climb.
    is_strict: bool,
    seeds: SeedTable,
}

/// A face's corners, and across each edge (from corner i to i + 1) the neighbour: all that a step asks, in one cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Face {
    corners: [u32; 3],
    /// The neighbour's half of the edge: 4 · face + edge.
    twins: [u32; 3],
    /// The neighbour's corner off the edge.
    apexes: [u32; 3],
    /// Outward, of unit length; zero if the face has no area.
    normal: DVec3,
}

/// A vertex that stands `reflex_depth_mm` out of a face's plane may stand several times that out of a plane through an
/// edge of the outline, in between the planes of the edge's two faces: 16 times where these meet at 7°.
const OUTLINE_FACTOR: f64 = 16.0;

/// Faces seen more nearly edge-on than this are left to other engines: a plane's crossing errs by the rounding over this
/// cosine.
const STEEP: f64 = 0.01;

impl Walker {
    /// Makes `body` ready.
    pub fn new(body: &ConvexMesh) -> Self {
        let mut mesh = body.surface().mesh().clone();
        mesh.drop_unused_vertices();
        let face = |f: usize| {
            let (corners, across) = (mesh.faces[f], body.surface().neighbours(f));
            // The neighbour runs along the common edge the other way, so that its edge starts where this one ends.
            let twin = |i: usize| {
                let theirs = mesh.faces[across[i] as usize];
                let edge = theirs.iter().position(|&v| v == corners[(i + 1) % 3]).unwrap_or(0);
                (4 * across[i] + edge as u32, theirs[(edge + 2) % 3])
            };
            let [(t0, a0), (t1, a1), (t2, a2)] = [twin(0), twin(1), twin(2)];
            let normal = body.plane_of(f).map_or(DVec3::ZERO, |plane| body.planes()[plane as usize].normal);
            Face { corners, twins: [t0, t1, t2], apexes: [a0, a1, a2], normal }
        };
        let bounds = body.bounds();
        let mut walker = Self {
            faces: (0..mesh.faces.len()).into_par_iter().map(face).collect(),
            centre: bounds.centre(),
            reach: 0.5 * bounds.size().max_element(),
            outline_slack: OUTLINE_FACTOR * body.reflex_depth_mm(),
            longest_walk: 16 + 8 * mesh.faces.len().isqrt() as u32,
            is_strict: body.is_strict(),
            seeds: SeedTable::empty(),
            vertices: mesh.vertices,
        };
        walker.seeds = SeedTable::new(&walker);
        walker
    }

    /// A point in the middle of the body, mm, and the linear map from mm about it to a frame in which the body is about a
    /// ball of radius 1: its ellipsoid of inertia becomes that ball.
    pub fn ball_frame(&self) -> (DVec3, DMat3) {
        self.seeds.ball_frame()
    }

    /// A vertex about as far along `normal` as any: of an ellipsoid, one near the farthest.
    pub fn vertex_towards(&self, normal: DVec3) -> DVec3 {
        self.vertices[self.faces[self.seeds.facing(normal) as usize].corners[0] as usize]
    }

    /// Whether the line from `origin` along `dir`, mm, passes so far by that it surely misses: quicker than a walk.
    #[inline]
    pub fn passes_by(&self, origin: DVec3, dir: DVec3) -> bool {
        self.seeds.passes_by(origin, dir)
    }

    /// The line's way through the body, from seeds by the line's place. `Ok(None)` if it misses.
    pub fn pass(&self, line: &Line) -> Result<Option<Pass>, Unsure> {
        match self.seeds.near(line.origin(), line.dir()) {
            Some(mut seeds) => self.pass_from(line.origin(), line.dir(), &mut seeds),
            None => Ok(None),
        }
    }

    /// As [`pass`](Self::pass), from seeds that are known; on return they are the faces where the walks ended: good seeds
    /// for a line nearby. `dir` may have any length but 0, and the chord is in its unit.
    ///
    /// As exact as clipping: the planes are the same, and the faces those pierced once the vertices have moved by no more
    /// than γ₈ of their distance from the line's origin (see `shear`). On a line within that of a vertex, two of its faces
    /// are looked at, not all, and the ends may be off by a hundred times as much.
    #[inline(always)]
    pub fn pass_from(&self, origin: DVec3, dir: DVec3, seeds: &mut Seeds) -> Result<Option<Pass>, Unsure> {
        let view = LineView::new(self, origin, dir);
        let (mut entry, mut exit) =
            (self.stand_on(&view, seeds.entry, -1.0), self.stand_on(&view, seeds.exit, 1.0));
        if !entry.is_surely_pierced(&view) {
            let Some(face) = self.walk(&view, entry, &mut seeds.entry, -1.0)? else { return Ok(None) };
            entry = face;
        }
        if !exit.is_surely_pierced(&view) {
            // A line that enters leaves; within the slack both may be in doubt.
            exit = self.walk(&view, exit, &mut seeds.exit, 1.0)?.ok_or(Unsure)?;
        }
        let chord = Interval::new(self.crossing(&view, &entry, -1.0)?, self.crossing(&view, &exit, 1.0)?);
        let (entry_face, exit_face) = (entry.face(), exit.face());
        Ok(chord.filter(|c| c.length() > 0.0).map(|chord| Pass { chord, entry_face, exit_face }))
    }

    /// The way through two faces that the line surely pierces.
    #[inline(always)]
    fn pass_through(&self, view: &LineView, faces: Seeds) -> Result<Option<Pass>, Unsure> {
        let start = self.crossing_of_plane(view, faces.entry, -1.0)?;
        let chord = Interval::new(start, self.crossing_of_plane(view, faces.exit, 1.0)?);
        let through = |chord| Pass { chord, entry_face: faces.entry, exit_face: faces.exit };
        Ok(chord.filter(|c| c.length() > 0.0).map(through))
    }

    /// The face pierced among those that look along the line (`sign` 1) or against it (−1), walking from `at`. `None` if
    /// the line passes outside the outline. `last` becomes the face where the walk ends.
    #[inline(never)]
    fn walk(
        &self,
        view: &LineView,
        mut at: Standing,
        last: &mut u32,
        sign: f64,
    ) -> Result<Option<Standing>, Unsure> {
        if at.area() <= view.sure_mm2 {
            // A seed that looks the wrong way.
            at = self.stand_on(view, self.seeds.towards(self, sign * view.dir), sign);
            if at.area() <= view.sure_mm2 {
                return Err(Unsure);
            }
        }
        for _ in 0..self.longest_walk {
            *last = at.face();
            let Some(edge) = at.parting_edge(view, sign)? else { return Ok(Some(at)) };
            let next = self.step(view, &at, edge, sign);
            if next.area() < -view.sure_mm2 {
                return if self.is_beyond_outline(view, &at, edge) { Ok(None) } else { Err(Unsure) };
            }
            at = next;
        }
        Err(Unsure)
    }

    /// Whether the line passes so far beyond an edge of the outline that no rounding of vertices could matter.
    fn is_beyond_outline(&self, view: &LineView, at: &Standing, edge: usize) -> bool {
        let (a, b) = (at.corners[edge], at.corners[(edge + 1) % 3]);
        let slack_mm = self.outline_slack + view.rounding_mm;
        at.sides[edge] < -slack_mm * (a[0].abs() + a[1].abs() + b[0].abs() + b[1].abs() + slack_mm)
    }

    /// Stands on a face, at its first edge.
    #[inline(always)]
    fn stand_on(&self, view: &LineView, face: u32, sign: f64) -> Standing {
        let [a, b, c] = self.faces[face as usize].corners;
        let (a, b, c) = (self.place(view, a), self.place(view, b), self.place(view, c));
        let sides = [sign * cross(a, b), sign * cross(b, c), sign * cross(c, a)];
        Standing { half_edge: 4 * face, corners: [a, b, c], sides }
    }

    /// Steps over an edge, to stand at the neighbour's half of it.
    #[inline(always)]
    fn step(&self, view: &LineView, from: &Standing, edge: usize, sign: f64) -> Standing {
        let face = &self.faces[from.face() as usize];
        let edge_of_face = (from.half_edge as usize % 4 + edge) % 3;
        let apex = self.place(view, face.apexes[edge_of_face]);
        let [p, q, r] = from.corners;
        let (a, b) = match edge {
            0 => (q, p),
            1 => (r, q),
            _ => (p, r),
        };
        Standing {
            half_edge: face.twins[edge_of_face],
            corners: [a, b, apex],
            sides: [-from.sides[edge], sign * cross(b, apex), sign * cross(apex, a)],
        }
    }

    /// A vertex across the line, mm.
    #[inline(always)]
    fn place(&self, view: &LineView, vertex: u32) -> [f64; 2] {
        view.across.place(self.vertices[vertex as usize])
    }

    /// Where the line crosses the face, in the direction's unit.
    #[inline(always)]
    fn crossing(&self, view: &LineView, at: &Standing, sign: f64) -> Result<f64, Unsure> {
        let t = self.crossing_of_plane(view, at.face(), sign)?;
        if at.is_surely_pierced(view) { Ok(t) } else { self.crossing_near_edges(view, at, sign, t) }
    }

    #[inline(always)]
    fn crossing_of_plane(&self, view: &LineView, face: u32, sign: f64) -> Result<f64, Unsure> {
        let Face { normal, corners: [corner, ..], .. } = self.faces[face as usize];
        let slope = normal.dot(view.dir);
        let t = normal.dot(self.vertices[corner as usize] - view.origin) / slope;
        if slope * sign > view.steep { Ok(t) } else { Err(Unsure) }
    }

    /// As clipping has it: where the line runs within rounding of an edge, the later entry and the earlier exit of the two
    /// faces counts.
    #[cold]
    fn crossing_near_edges(&self, view: &LineView, at: &Standing, sign: f64, t: f64) -> Result<f64, Unsure> {
        let twins = self.faces[at.face() as usize].twins;
        let near = (0..3).filter(|&edge| at.sides[edge] <= view.sure_mm2);
        near.map(|edge| twins[(at.half_edge as usize % 4 + edge) % 3] / 4).try_fold(t, |t, face| {
            let across = self.crossing_of_plane(view, face, sign)?;
            Ok(if sign > 0.0 { t.min(across) } else { t.max(across) })
        })
    }
}

/// A line as the walk sees it.
#[derive(Clone, Copy, Default)]
struct LineView {
    across: Across,
    origin: DVec3,
    dir: DVec3,
    /// Vertices across the line err by less, mm.
    rounding_mm: f64,
    /// Sides of edges beyond this are right without looking closer, even for the vertices before they were rounded, mm².
    sure_mm2: f64,
    /// Slopes below this are those of faces seen nearly edge-on.
    steep: f64,
}

impl LineView {
    #[inline(always)]
    fn new(walker: &Walker, origin: DVec3, dir: DVec3) -> Self {
        let across = Across::of(origin, dir);
        let [x, y] = across.place(walker.centre);
        // |across| of any vertex: that of the centre, and 2 · reach, as the slopes are at most 1.
        let largest = x.abs().max(y.abs()) + 2.0 * walker.reach;
        // Each coordinate across errs by γ₄ of twice the farthest vertex's.
        let rounding_mm = gamma(8) * ((origin - walker.centre).abs().max_element() + walker.reach);
        let a = dir.abs();
        Self {
            across,
            origin,
            dir,
            rounding_mm,
            // Two products, a difference: γ₂ of 2 · largest², and as much again for three sides that make an area; and each
            // of the four factors off by its rounding.
            sure_mm2: (16.0 * UNIT_ROUNDOFF * largest + 4.0 * rounding_mm) * largest,
            steep: STEEP * (a.x + a.y + a.z),
        }
    }
}

/// A face walked on, from one of its edges.
#[derive(Clone, Copy, Default)]
struct Standing {
    /// 4 · face + the edge that the corners and sides are counted from.
    half_edge: u32,
    /// In the line's frame, mm.
    corners: [[f64; 2]; 3],
    /// Twice the area of line and edge, positive with the line on the inner side, mm².
    sides: [f64; 3],
}

impl Standing {
    #[inline(always)]
    fn face(&self) -> u32 {
        self.half_edge / 4
    }

    /// Twice the face's area, positive if it looks the right way.
    #[inline]
    fn area(&self) -> f64 {
        self.sides[0] + self.sides[1] + self.sides[2]
    }

    /// Whether the line pierces the face, and not near an edge.
    #[inline(always)]
    fn is_surely_pierced(&self, view: &LineView) -> bool {
        let [s0, s1, s2] = self.sides;
        s0.min(s1).min(s2) > view.sure_mm2
    }

    /// An edge that has the line on its outer side: the farther, if there are two. `None` if the line pierces the face.
    #[inline]
    fn parting_edge(&self, view: &LineView, sign: f64) -> Result<Option<usize>, Unsure> {
        let [s0, s1, s2] = self.sides;
        let least = s0.min(s1).min(s2);
        if least > view.sure_mm2 {
            return Ok(None);
        }
        let farthest = if least == s0 { 0 } else { 1 + usize::from(least == s2) };
        if least < -view.sure_mm2 {
            return Ok(Some(farthest));
        }
        self.parting_edge_by_exact_signs(sign)
    }

    #[cold]
    fn parting_edge_by_exact_signs(&self, sign: f64) -> Result<Option<usize>, Unsure> {
        for edge in 0..3 {
            match side_of_edge(self.corners[edge], self.corners[(edge + 1) % 3], [0.0, 0.0]) {
                0 => return Err(Unsure),
                side if f64::from(side) * sign < 0.0 => return Ok(Some(edge)),
                _ => {}
            }
        }
        Ok(None)
    }
}

#[inline]
fn cross(u: [f64; 2], v: [f64; 2]) -> f64 {
    u[0] * v[1] - u[1] * v[0]
}
