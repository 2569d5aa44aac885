//! The exact chord of a surface of triangles, convex or not.
//!
//! The frame and the rules are those of the watertight test in f64 (`shear`, `crossing`, `parts`): vertices are sheared along
//! the line, coverage is decided by signs with ties broken by an infinitesimal move, a face in whose plane the line lies
//! counts its overlap. Here all of it is exact, so the surface is the one that was given, not one of rounded vertices.

use num_rational::BigRational;
use num_traits::Zero;

use super::{RationalChord, RationalLine, UNDERFLOW, Vector, sign};
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
    let (mut depth, mut begun) = (0, BigRational::zero());
    for (t, winding) in through {
        // Wound counter-clockwise along the line, the face looks along it: the line leaves.
        let before = depth;
        depth -= winding;
        match (before, depth) {
            (0, 1) => begun = t,
            (1, 0) => parts.push([std::mem::take(&mut begun), t]),
            _ => {}
        }
    }
    RationalChord::joined(parts)
}

/// How the line meets a face.
enum Crossing {
    None,
    /// Passes through here; +1 leaving, −1 entering.
    Through(BigRational, i32),
    /// Lies in the face's plane, and in the face from here to there.
    Along([BigRational; 2]),
}

/// A vertex in the line's frame.
struct Sheared {
    across: [BigRational; 2],
    along: BigRational,
}

/// The frame in which the line is the third axis.
struct Frame {
    rounded: Shear,
    rounded_origin: glam::DVec3,
    line: RationalLine,
    slopes: [BigRational; 2],
}

impl Frame {
    fn of(line: &Line) -> Self {
        let (rounded, exact) = (Shear::new(line), RationalLine::of(line));
        let [x, y, z] = rounded.axes();
        let slopes = [x, y].map(|axis| &exact.dir.0[axis] / &exact.dir.0[z]);
        Self { rounded, rounded_origin: line.origin(), line: exact, slopes }
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
        let across =
            [(x, &self.slopes[0]), (y, &self.slopes[1])].map(|(axis, slope)| &p.0[axis] - slope * &p.0[z]);
        Sheared { across, along: &p.0[z] / &self.line.dir.0[z] }
    }

    fn crossing(&self, corners: &[Sheared; 3]) -> Crossing {
        let edge = |i: usize| (&corners[i].across, &corners[(i + 1) % 3].across);
        // Twice the area with the line of the edge opposite to each corner.
        let areas = [1, 2, 0].map(|i| {
            let (u, v) = edge(i);
            &u[0] * &v[1] - &u[1] * &v[0]
        });
        if areas.iter().all(Zero::is_zero) {
            return overlap(corners).map_or(Crossing::None, Crossing::Along);
        }
        let sides = [0, 1, 2].map(|i| {
            let (u, v) = edge((i + 1) % 3);
            match sign(&areas[i]) {
                0 => side_of_edge_on_tie(u, v),
                side => side,
            }
        });
        if sides[0] == 0 || sides[0] != sides[1] || sides[1] != sides[2] {
            return Crossing::None;
        }
        let total: BigRational = areas.iter().sum();
        let weighted: BigRational =
            areas.iter().zip(corners).map(|(area, corner)| area * &corner.along).sum();
        Crossing::Through(weighted / total, sides[0])
    }
}

/// The overlap of the line with a face whose plane holds it; of no length where it only touches.
fn overlap(corners: &[Sheared; 3]) -> Option<[BigRational; 2]> {
    // The face is a triangle in the plane of the line: one coordinate across, and the place along.
    let axis = usize::from(corners.iter().all(|v| v.across[0].is_zero()));
    let mut places = Vec::new();
    for i in 0..3 {
        let (p, q) = (&corners[i], &corners[(i + 1) % 3]);
        let (u, v) = (&p.across[axis], &q.across[axis]);
        if u.is_zero() {
            places.push(p.along.clone());
        }
        if sign(u) * sign(v) < 0 {
            places.push((u * &q.along - v * &p.along) / (u - v));
        }
    }
    Some([places.iter().min()?.clone(), places.iter().max()?.clone()])
}
