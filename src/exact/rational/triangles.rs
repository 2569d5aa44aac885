//! The exact chord of a surface of triangles, convex or not.
//!
//! The frame and the rules are those of the watertight test in f64 (`shear`, `crossing`, `parts`): vertices are sheared along
//! the line, coverage is decided by signs with ties broken by an infinitesimal move, a face in whose plane the line lies
//! counts its overlap. Here all of it is exact, so the surface is the one that was given, not one of rounded vertices.

use super::dyadic::{Dyadic, Quotient, Vector};
use super::{RationalChord, RationalLine, UNDERFLOW};
use crate::exact::shear::Shear;
use crate::geometry::numeric::gamma;
use crate::geometry::predicates::side_of_edge_on_tie;
use crate::geometry::{ClosedMesh, Line};

/// The exact parts of `line` inside `surface`. A line in a face's plane counts its length in the face.
pub fn of_triangles(surface: &ClosedMesh, line: &Line) -> RationalChord {
    let frame = Frame::of(line);
    let (mut through, mut parts) = (Vec::new(), Vec::new());
    for face in 0..surface.mesh().faces.len() {
        let corners = surface.mesh().triangle(face);
        if frame.surely_misses(&corners) {
            continue;
        }
        match frame.crossing(&corners.map(|v| frame.sheared(&Vector::of(v)))) {
            Crossing::None => {}
            Crossing::Through(t, winding) => through.push((t, winding)),
            Crossing::Along(span) => parts.push(span),
        }
    }
    through.sort_unstable();
    let (mut depth, mut begun) = (0, Quotient::of(0.0));
    for (t, winding) in through {
        // Wound counter-clockwise along the line, the face looks along it: the line leaves.
        let before = depth;
        depth -= winding;
        match (before, depth) {
            (0, 1) => begun = t,
            (1, 0) => parts.push([begun.clone(), t]),
            _ => {}
        }
    }
    RationalChord::joined(parts)
}

/// How the line meets a face.
enum Crossing {
    None,
    /// Passes through here; +1 leaving, −1 entering.
    Through(Quotient, i32),
    /// Lies in the face's plane, and in the face from here to there.
    Along([Quotient; 2]),
}

/// A vertex in the line's frame, times the size of the direction's third coordinate: nothing is divided.
struct Sheared {
    across: [Dyadic; 2],
    along: Dyadic,
}

/// The frame in which the line is the third axis.
struct Frame {
    rounded: Shear,
    rounded_origin: glam::DVec3,
    line: RationalLine,
    /// The direction's size along the third axis.
    depth: Dyadic,
    /// By how much the first and second coordinate grow along it.
    slopes: [Dyadic; 2],
}

impl Frame {
    fn of(line: &Line) -> Self {
        let (rounded, exact) = (Shear::new(line), RationalLine::of(line));
        let [x, y, z] = rounded.axes();
        let turned = |d: &Dyadic| if exact.dir.0[z].sign() < 0 { d.negated() } else { d.clone() };
        let (depth, slopes) = (exact.dir.0[z].abs(), [x, y].map(|axis| turned(&exact.dir.0[axis])));
        Self { rounded, rounded_origin: line.origin(), line: exact, depth, slopes }
    }

    /// Whether the face is to one side of the line for sure: all corners on one side of a coordinate plane of the frame, by
    /// more than places across are rounded, which is γ₄ of twice the largest coordinate of v − o (`Shear::across`).
    fn surely_misses(&self, corners: &[glam::DVec3; 3]) -> bool {
        let reach =
            corners.iter().map(|v| (*v - self.rounded_origin).abs().max_element()).fold(0.0, f64::max);
        let margin = gamma(8) * reach + UNDERFLOW;
        let across = corners.map(|v| self.rounded.across(v));
        (0..2).any(|axis| across.iter().all(|p| p[axis] > margin) || across.iter().all(|p| p[axis] < -margin))
    }

    fn sheared(&self, vertex: &Vector) -> Sheared {
        let [x, y, z] = self.rounded.axes();
        let p = vertex.minus(&self.line.origin);
        let across = |axis: usize, slope: &Dyadic| &(&p.0[axis] * &self.depth) - &(slope * &p.0[z]);
        let along = if self.line.dir.0[z].sign() < 0 { p.0[z].negated() } else { p.0[z].clone() };
        Sheared { across: [across(x, &self.slopes[0]), across(y, &self.slopes[1])], along }
    }

    fn crossing(&self, corners: &[Sheared; 3]) -> Crossing {
        let edge = |i: usize| (&corners[i].across, &corners[(i + 1) % 3].across);
        // Twice the area with the line of the edge opposite to each corner.
        let areas = [1, 2, 0].map(|i| {
            let (u, v) = edge(i);
            &(&u[0] * &v[1]) - &(&u[1] * &v[0])
        });
        if areas.iter().all(|area| area.sign() == 0) {
            return self.overlap(corners).map_or(Crossing::None, Crossing::Along);
        }
        let sides = [0, 1, 2].map(|i| {
            let (u, v) = edge((i + 1) % 3);
            match areas[i].sign() {
                0 => side_of_edge_on_tie(u, v),
                side => side,
            }
        });
        if sides[0] == 0 || sides[0] != sides[1] || sides[1] != sides[2] {
            return Crossing::None;
        }
        let sum = |terms: [Dyadic; 3]| &(&terms[0] + &terms[1]) + &terms[2];
        let weighted = sum([0, 1, 2].map(|i| &areas[i] * &corners[i].along));
        let total = sum(areas);
        Crossing::Through(Quotient::new(weighted, &(&total * &self.depth)), sides[0])
    }

    /// The overlap of the line with a face whose plane holds it; of no length where it only touches.
    fn overlap(&self, corners: &[Sheared; 3]) -> Option<[Quotient; 2]> {
        // The face is a triangle in the plane of the line: one coordinate across, and the place along.
        let axis = usize::from(corners.iter().all(|v| v.across[0].sign() == 0));
        let mut places = Vec::new();
        for i in 0..3 {
            let (p, q) = (&corners[i], &corners[(i + 1) % 3]);
            let (u, v) = (&p.across[axis], &q.across[axis]);
            if u.sign() == 0 {
                places.push(Quotient::new(p.along.clone(), &self.depth));
            }
            if u.sign() * v.sign() < 0 {
                let over = &(u * &q.along) - &(v * &p.along);
                places.push(Quotient::new(over, &(&(u - v) * &self.depth)));
            }
        }
        Some([places.iter().min()?.clone(), places.iter().max()?.clone()])
    }
}
