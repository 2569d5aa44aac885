//! How the line of a [`Shear`] meets a face: through it, along it or not at all.
//!
//! In the line's frame a face covers the origin of the plane or does not. Coverage is decided by exact signs with ties
//! broken alike for all faces, so that crossings always come in pairs: no line leaks through an edge.

use super::shear::{Shear, Sheared};
use crate::geometry::numeric::gamma;
use crate::geometry::predicates::cover;
use crate::geometry::{ClosedMesh, Interval};

/// How a line meets a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Crossing {
    /// Not at all.
    None,
    /// Passes through at this place, mm; +1 leaving, −1 entering.
    Through(f64, i32),
    /// Lies in the face's plane and overlaps the face.
    Along(Interval),
}

/// A cross product of two plane vectors errs by γ₂ of the sum of its products' sizes, which is itself rounded twice.
const SIGN_ERROR: f64 = gamma(4);
/// What products lose by underflow is far less than this, mm².
const UNDERFLOW: f64 = 1e-300;

/// Twice the area of the triangle of the origin, `u` and `v`, and whether its sign is beyond doubt.
#[inline(always)]
fn area(u: [f64; 2], v: [f64; 2]) -> (f64, bool) {
    let (left, right) = (u[0] * v[1], u[1] * v[0]);
    let area = left - right;
    (area, area.abs() > SIGN_ERROR * (left.abs() + right.abs()) + UNDERFLOW)
}

impl Crossing {
    /// Of the line of `shear` and a face of `surface`.
    #[inline(always)]
    pub fn of(surface: &ClosedMesh, face: u32, shear: &Shear) -> Self {
        let [a, b, c] = surface.mesh().triangle(face as usize);
        Self::of_triangle(&[shear.apply(a), shear.apply(b), shear.apply(c)])
    }

    /// Of a triangle with these corners, counter-clockwise seen from outside.
    #[inline(always)]
    pub fn of_triangle(corners: &[Sheared; 3]) -> Self {
        let [a, b, c] = [corners[0].across, corners[1].across, corners[2].across];
        let (of_c, c_is_sure) = area(a, b);
        let (of_a, a_is_sure) = area(b, c);
        let (of_b, b_is_sure) = area(c, a);
        let areas = [of_a, of_b, of_c];
        if !(a_is_sure && b_is_sure && c_is_sure) {
            return Self::by_exact_signs(corners, areas);
        }
        let left = [of_a > 0.0, of_b > 0.0, of_c > 0.0];
        match left {
            [true, true, true] => Self::Through(place(corners, areas), 1),
            [false, false, false] => Self::Through(place(corners, areas), -1),
            _ => Self::None,
        }
    }

    /// As [`of_triangle`](Self::of_triangle), where rounding leaves a sign in doubt: the line passes near an edge's line.
    #[cold]
    fn by_exact_signs(corners: &[Sheared; 3], areas: [f64; 3]) -> Self {
        let across = corners.map(|v| v.across);
        for axis in 0..2 {
            let coordinates = across.map(|p| p[axis]);
            if coordinates.iter().all(|&x| x > 0.0) || coordinates.iter().all(|&x| x < 0.0) {
                return Self::None;
            }
        }
        match cover(across, [0.0, 0.0]) {
            0 => overlap_of_edge_on_face(corners).map_or(Self::None, Self::Along),
            winding => Self::Through(place(corners, areas), winding),
        }
    }
}

/// Where the line passes through a face it covers, mm.
#[inline(always)]
fn place(corners: &[Sheared; 3], areas: [f64; 3]) -> f64 {
    let [a, b, c] = [corners[0].along, corners[1].along, corners[2].along];
    let [of_a, of_b, of_c] = [areas[0].abs(), areas[1].abs(), areas[2].abs()];
    let total = of_a + of_b + of_c;
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    let t = if total > 0.0 {
        (of_a * a + of_b * b + of_c * c) / total
    } else {
        // Seen so nearly edge-on that the areas underflow: anywhere on the face is within rounding.
        0.5 * (low + high)
    };
    // Rounding may not put the crossing off the face.
    t.clamp(low, high)
}

/// The overlap of the line with a face whose plane holds it. `None` if the plane does not, exactly.
fn overlap_of_edge_on_face(corners: &[Sheared; 3]) -> Option<Interval> {
    let [a, b, c] = corners.map(|v| v.across);
    let area = |u: [f64; 2], v: [f64; 2]| {
        let coord = |q: [f64; 2]| robust::Coord { x: q[0], y: q[1] };
        robust::orient2d(coord(u), coord(v), coord([0.0, 0.0]))
    };
    if area(a, b) != 0.0 || area(b, c) != 0.0 || area(c, a) != 0.0 {
        return None;
    }
    // The face is a triangle in the plane of the line: across by the larger coordinate, along by the other.
    let axis = usize::from(
        corners.iter().map(|v| v.across[1].abs()).fold(0.0, f64::max)
            > corners.iter().map(|v| v.across[0].abs()).fold(0.0, f64::max),
    );
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut add = |t: f64| (low, high) = (low.min(t), high.max(t));
    for i in 0..3 {
        let (p, q) = (corners[i], corners[(i + 1) % 3]);
        let (u, v) = (p.across[axis], q.across[axis]);
        if u == 0.0 {
            add(p.along);
        }
        if (u < 0.0 && v > 0.0) || (u > 0.0 && v < 0.0) {
            let t = (u * q.along - v * p.along) / (u - v);
            add(t.clamp(p.along.min(q.along), p.along.max(q.along)));
        }
    }
    Interval::new(low, high).filter(|part| part.length() > 0.0)
}
