//! The shaft of a cell: all places where its lines are between their planes, and what of a surface lies there.
//!
//! ```text
//!    plane 0          plane 1       The hull of the cell's two rectangles. Planes that touch it part it from boxes, edges and
//!      ┌─┐     ╱────┐               faces; what no plane parts from it may lie in it. So a list of what may lie in it holds
//!      │ │────╱     │               all that does, proved.
//!      └─┘────╲─────┘
//! ```

use std::ops::ControlFlow;

use glam::DVec3;

use crate::geometry::{Bounds, ClosedMesh};
use crate::linespace::LineFrame;
use crate::ritree::Place;

/// A separation below this, in box units, is not believed: far more than rounding, even of a body a thousand times its size
/// from the origin.
const LEAST_SEPARATION: f64 = 1e-9;

/// A cosine between a face's normal and a line below this is not believed to have a sign.
const LEAST_COSINE: f64 = 1e-9;

/// Which way all lines of a cell go through a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Looks {
    Along,
    Against,
    /// Some may go one way, some the other, some along it.
    Either,
}

/// The shaft of a cell of a frame, mm.
pub(super) struct Shaft<'s> {
    surface: &'s ClosedMesh,
    /// Of the frame: heights are counted from there.
    origin: DVec3,
    /// Normals, per mm, and the heights below which no line of the cell comes, box units.
    planes: [(DVec3, f64); 8],
    /// The corners of its two rectangles.
    corners: [DVec3; 8],
    /// From plane to plane: the ways of all lines of the cell lie between these.
    ways: [DVec3; 4],
}

impl<'s> Shaft<'s> {
    /// The shaft of `place`, a cell of `frame`, to hold `surface` against.
    pub fn new(frame: &LineFrame, place: &Place, surface: &'s ClosedMesh) -> Self {
        let axis = place.pair.axes()[0];
        let (low, high) = (place.cell.low, place.cell.high);
        let mut planes = [(DVec3::ZERO, 0.0); 8];
        for (plane, (normal, least)) in planes.iter_mut().zip(place.cell.shaft_planes(place.pair)) {
            *plane = (frame.normal_mm(normal), least - LEAST_SEPARATION);
        }
        let corners = std::array::from_fn(|i| {
            let pick = |a: usize| if i >> (a % 2) & 1 == 0 { low[a] } else { high[a] };
            frame.ends(axis, std::array::from_fn(pick))[i >> 2]
        });
        let ways = std::array::from_fn(|i| {
            // The least of u − s is that of the lowest u and the highest s, and so on.
            let pick = |a: usize| if (i >> (a % 2) & 1 == 0) == (a < 2) { high[a] } else { low[a] };
            let [start, end] = frame.ends(axis, std::array::from_fn(pick));
            end - start
        });
        Self { surface, origin: frame.point_mm(DVec3::ZERO), planes, corners, ways }
    }

    /// Whether no line of the cell meets the body, proved by one plane that has all of it behind.
    pub fn misses_all(&self) -> bool {
        let mut planes = self.planes.iter();
        planes.any(|&(n, least)| self.surface.farthest_vertex(n, self.origin, least).is_none())
    }

    /// Whether a plane parts the shaft from the hull of some points.
    fn misses(&self, points: &[DVec3]) -> bool {
        let is_behind = |(n, least): &(DVec3, f64)| points.iter().all(|p| n.dot(*p - self.origin) < *least);
        self.planes.iter().any(is_behind)
    }

    fn misses_box(&self, bounds: &Bounds) -> bool {
        self.planes.iter().any(|&(n, least)| {
            let corner = DVec3::select(n.cmpge(DVec3::ZERO), bounds.max, bounds.min);
            n.dot(corner - self.origin) < least
        })
    }

    /// Whether the face's plane, or one of the shaft's, parts the two.
    fn misses_face(&self, triangle: &[DVec3; 3]) -> bool {
        if self.misses(triangle) {
            return true;
        }
        let [a, b, c] = *triangle;
        let normal = (b - a).cross(c - a);
        // A thousandth of a millionth of the body, as for the shaft's own planes.
        let slack = LEAST_SEPARATION * normal.length() * (self.corners[7] - self.corners[0]).length();
        let heights = self.corners.map(|corner| normal.dot(corner - a));
        heights.iter().all(|&h| h > slack) || heights.iter().all(|&h| h < -slack)
    }

    /// Calls `face` with each face that lines of the cell may meet, until it breaks; whether it never did.
    pub fn all_faces(&self, mut face: impl FnMut(usize) -> ControlFlow<()>) -> bool {
        let is_over = std::cell::Cell::new(false);
        self.surface.tree().visit(
            |bounds| !is_over.get() && !self.misses_box(bounds),
            |f| {
                let f = f as usize;
                if !is_over.get() && !self.misses_face(&self.surface.mesh().triangle(f)) {
                    is_over.set(face(f).is_break());
                }
            },
        );
        !is_over.get()
    }

    fn looks(&self, face: usize) -> Looks {
        let [a, b, c] = self.surface.mesh().triangle(face);
        let normal = (b - a).cross(c - a);
        let slack = LEAST_COSINE * normal.length();
        let slopes = self.ways.map(|way| (normal.dot(way), slack * way.length()));
        if slopes.iter().all(|(slope, slack)| slope > slack) {
            Looks::Along
        } else if slopes.iter().all(|(slope, slack)| *slope < -slack) {
            Looks::Against
        } else {
            Looks::Either
        }
    }

    /// Whether all lines of the cell cross the surface equally often, proved: what [`Sheets::Unknown`] does not say.
    ///
    /// As a line moves, its crossings change in number only where it meets an edge whose faces it goes through in opposite
    /// ways, or lies in a face. If each face that may lie in the shaft is gone through one way by all lines of the cell, and
    /// both faces of each edge there the same way, none does.
    pub fn sheets(&self) -> Sheets {
        let mut faces = 0;
        let is_proved = self.all_faces(|face| {
            faces += 1;
            let looks = self.looks(face);
            if looks == Looks::Either {
                return ControlFlow::Break(());
            }
            let corners = self.surface.mesh().triangle(face);
            let turns = |(i, &other): (usize, &u32)| {
                // An edge in the shaft has both faces there, each of which is looked at.
                (other as usize) > face
                    && !self.misses(&[corners[i], corners[(i + 1) % 3]])
                    && self.looks(other as usize) != looks
            };
            if self.surface.neighbours(face).iter().enumerate().any(turns) {
                return ControlFlow::Break(());
            }
            ControlFlow::Continue(())
        });
        match (is_proved, faces) {
            (true, 0) => Sheets::None,
            (true, _) => Sheets::Constant,
            (false, _) => Sheets::Unknown,
        }
    }
}

/// What is proved of how often the lines of a cell cross a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sheets {
    /// None crosses it.
    None,
    /// All cross it equally often.
    Constant,
    /// Nothing.
    Unknown,
}
