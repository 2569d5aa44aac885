//! Chords without rounding, in big rationals: the judge of the judges.
//!
//! ```text
//!   f64 numbers, taken as they are ──▶ f64 sieve with a proved margin ──▶ rationals, for the few that are left ──▶ chord
//!   (planes, vertices, the line)        (what cannot decide goes)          (no rounding anywhere)
//! ```
//!
//! Two surfaces are to be kept apart. [`of_planes`] is the chord of the planes that clipping computes with: a corner of each
//! face and its normal, rounded to f64. [`of_triangles`] is that of the surface itself: the flat triangles between the
//! vertices, convex or not. They differ by the rounding of the normals.

mod dyadic;
mod planes;
#[cfg(test)]
mod tests;
mod triangles;

use crate::geometry::{Interval, Line};
use dyadic::{Quotient, Vector};

pub use planes::of_planes;
pub use triangles::of_triangles;

/// What products may lose by underflow is far less than this: added to every margin of the sieves.
const UNDERFLOW: f64 = 1e-300;

/// The parts of a line in a body, in order, disjoint, each with a length; in the length of the line's direction, which stands
/// for 1 mm as everywhere and is so within two units in the last place.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RationalChord {
    parts: Vec<[Quotient; 2]>,
}

/// How far a length in f64 is from the exact one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rounding {
    /// The length less the exact one, mm.
    pub error_mm: f64,
    /// The error's size in units in the last place of the exact length. `None` if that is 0.
    pub ulps_of_length: Option<f64>,
    /// The error's size in units in the last place of the distance to the chord's far end, in which the places along the line
    /// are rounded: a length can be no better than its ends. `None` if there is no chord.
    pub ulps_of_distance: Option<f64>,
}

impl RationalChord {
    /// Where its parts begin and end, each rounded to f64, mm.
    pub fn ends_mm(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        self.parts.iter().map(|part| [part[0].nearest(), part[1].nearest()])
    }

    /// What of it lies within `reach`, whose ends are taken as they are.
    pub fn within(mut self, reach: &Interval) -> Self {
        let end = |t: f64| t.is_finite().then(|| Quotient::of(t));
        let (least, most) = (end(reach.start()), end(reach.end()));
        for [start, end] in &mut self.parts {
            if let Some(least) = least.as_ref().filter(|least| *least > start) {
                start.clone_from(least);
            }
            if let Some(most) = most.as_ref().filter(|most| *most < end) {
                end.clone_from(most);
            }
        }
        self.parts.retain(|[start, end]| start < end);
        self
    }

    fn length(&self) -> Quotient {
        self.parts.iter().fold(Quotient::of(0.0), |sum, [start, end]| sum.plus(&end.minus(start)))
    }

    /// Its length, rounded once to f64, mm.
    pub fn length_mm(&self) -> f64 {
        self.length().nearest()
    }

    /// How far `length_mm`, which must be finite, is from its length.
    pub fn rounding_of(&self, length_mm: f64) -> Rounding {
        let length = self.length();
        let error_mm = Quotient::of(length_mm).minus(&length).nearest();
        let farthest = self.ends_mm().flatten().map(f64::abs).fold(0.0, f64::max);
        Rounding {
            error_mm,
            ulps_of_length: in_ulps(error_mm, length.nearest()),
            ulps_of_distance: in_ulps(error_mm, farthest),
        }
    }

    /// These parts in order, those of no length left out; where two overlap or touch, one.
    fn joined(mut parts: Vec<[Quotient; 2]>) -> Self {
        parts.retain(|[start, end]| start < end);
        parts.sort_unstable();
        let mut joined: Vec<[Quotient; 2]> = Vec::new();
        for [start, end] in parts {
            match joined.last_mut() {
                Some(last) if start <= last[1] => {
                    if end > last[1] {
                        last[1] = end;
                    }
                }
                _ => joined.push([start, end]),
            }
        }
        Self { parts: joined }
    }
}

/// An error in units in the last place of `of`. `None` of 0.
fn in_ulps(error: f64, of: f64) -> Option<f64> {
    (of > 0.0 && of.is_finite()).then(|| error.abs() / (of.next_up() - of))
}

/// A line without rounding.
struct RationalLine {
    origin: Vector,
    dir: Vector,
}

impl RationalLine {
    fn of(line: &Line) -> Self {
        Self { origin: Vector::of(line.origin()), dir: Vector::of(line.dir()) }
    }
}
