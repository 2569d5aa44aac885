//! The exact chord of a convex body's planes.
//!
//! ```text
//!   entering planes, each with the interval of f64 that surely holds its crossing:
//!
//!      ├──┤            goes: it ends before E
//!            ├─────┤   stays                         E: the greatest of the lower ends
//!               ├─┤    stays
//!               E
//! ```
//!
//! The plane that decides crosses last of all, so not before any other's lower end, so not before E: its own upper end is
//! not below E, and it stays. What goes crosses before the one that decides. Leaving planes likewise, from the other side.

use super::dyadic::{Quotient, Vector};
use super::{RationalChord, RationalLine, UNDERFLOW};
use crate::geometry::numeric::gamma;
use crate::geometry::{ConvexMesh, Line, Plane};

/// The exact chord of `line` in the intersection of the half-spaces of the planes of `body`, taken as they are stored. Empty
/// if it misses or only touches in a point; a line in a face's plane counts its length in the face.
pub fn of_planes(body: &ConvexMesh, line: &Line) -> RationalChord {
    match deciding(body.planes(), line) {
        Some(planes) => clip(&planes, line),
        None => RationalChord::default(),
    }
}

/// Cyrus–Beck in rationals.
pub(super) fn clip(planes: &[&Plane], line: &Line) -> RationalChord {
    let line = RationalLine::of(line);
    let (mut enter, mut leave): (Option<Quotient>, Option<Quotient>) = (None, None);
    for plane in planes {
        let normal = Vector::of(plane.normal);
        let height = normal.dot(&Vector::of(plane.point).minus(&line.origin));
        let slope = normal.dot(&line.dir);
        match slope.sign() {
            0 if height.sign() < 0 => return RationalChord::default(),
            0 => {}
            side => {
                let t = Quotient::new(height, &slope);
                let (sofar, later) = if side < 0 { (&mut enter, true) } else { (&mut leave, false) };
                if sofar.as_ref().is_none_or(|sofar| (t > *sofar) == later) {
                    *sofar = Some(t);
                }
            }
        }
    }
    match (enter, leave) {
        (Some(start), Some(end)) if start < end => RationalChord { parts: vec![[start, end]] },
        _ => RationalChord::default(),
    }
}

/// Where a plane's crossing surely lies.
#[derive(Clone, Copy, Debug)]
enum Crossing {
    /// In this interval, the line entering.
    Enters([f64; 2]),
    /// In this interval, the line leaving.
    Leaves([f64; 2]),
    /// Rounding hides which way the line goes, or numbers overflow.
    Unknown,
}

/// The planes among which those are that decide the chord. `None` if it surely is empty.
pub(super) fn deciding<'a>(planes: &'a [Plane], line: &Line) -> Option<Vec<&'a Plane>> {
    let crossings: Vec<_> = planes.iter().map(|plane| crossing(plane, line)).collect();
    let (mut latest, mut earliest) = (f64::NEG_INFINITY, f64::INFINITY);
    for crossing in &crossings {
        match crossing {
            Crossing::Enters([low, _]) => latest = latest.max(*low),
            Crossing::Leaves([_, high]) => earliest = earliest.min(*high),
            Crossing::Unknown => {}
        }
    }
    if latest > earliest {
        return None;
    }
    let may_decide = |crossing: &Crossing| match crossing {
        Crossing::Enters([_, high]) => *high >= latest,
        Crossing::Leaves([low, _]) => *low <= earliest,
        Crossing::Unknown => true,
    };
    Some(planes.iter().zip(&crossings).filter(|(_, c)| may_decide(c)).map(|(plane, _)| plane).collect())
}

/// Where `line` crosses `plane`, in f64 with its margin.
///
/// The height n·(v − o) is rounded in the differences, the products and two sums: by γ₄ of the sum of the products' sizes. The
/// slope n·d likewise, by γ₃; two roundings more cover the sums of sizes. With errors Δh and Δs, and t = h/s in f64,
/// |t − exact| ≤ (Δh + |t| Δs) / (|s| − Δs) + γ₂ |t|; that is doubled for the rounding of the margin itself.
fn crossing(plane: &Plane, line: &Line) -> Crossing {
    let (n, p) = (plane.normal, plane.point - line.origin());
    let (height, slope) = (n.dot(p), n.dot(line.dir()));
    let height_error = gamma(6) * n.abs().dot(p.abs()) + UNDERFLOW;
    let slope_error = gamma(6) * n.abs().dot(line.dir().abs()) + UNDERFLOW;
    let t = height / slope;
    let margin =
        2.0 * ((height_error + t.abs() * slope_error) / (slope.abs() - slope_error) + gamma(2) * t.abs());
    // Half of the slope at least is left, so that the margin's denominator has lost no digit that counts.
    let is_known = slope.abs() > 2.0 * slope_error && margin.is_finite();
    let interval = [t - margin, t + margin];
    match is_known {
        false => Crossing::Unknown,
        true if slope < 0.0 => Crossing::Enters(interval),
        true => Crossing::Leaves(interval),
    }
}
