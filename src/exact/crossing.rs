//! How the line of a [`Shear`] meets a face: through it, along it or not at all.
//!
//! In the line's frame a face covers the origin of the plane or does not. Coverage is decided by exact signs with ties
//! broken alike for all faces, so that crossings always come in pairs: no line leaks through an edge.

use super::shear::{Shear, Sheared};
use crate::geometry::numeric::{DoubleDouble, gamma};
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

/// Twice the area of the triangle of the origin, `u` and `v`, and the sum of its products' sizes.
#[inline(always)]
fn area(u: [f64; 2], v: [f64; 2]) -> (f64, f64) {
    let (left, right) = (u[0] * v[1], u[1] * v[0]);
    (left - right, left.abs() + right.abs())
}

/// Whether the sign of an area is beyond doubt.
#[inline(always)]
fn is_sure(area: f64, size: f64) -> bool {
    area.abs() > SIGN_ERROR * size + UNDERFLOW
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
        let ((of_a, size_a), (of_b, size_b), (of_c, size_c)) = (area(b, c), area(c, a), area(a, b));
        let areas = Areas { of: [of_a, of_b, of_c], size: size_a + size_b + size_c };
        if !(is_sure(of_a, size_a) && is_sure(of_b, size_b) && is_sure(of_c, size_c)) {
            return Self::by_exact_signs(corners, &areas);
        }
        let left = [of_a > 0.0, of_b > 0.0, of_c > 0.0];
        match left {
            [true, true, true] => Self::Through(place(corners, &areas), 1),
            [false, false, false] => Self::Through(place(corners, &areas), -1),
            _ => Self::None,
        }
    }

    /// As [`of_triangle`](Self::of_triangle), where rounding leaves a sign in doubt: the line passes near an edge's line.
    #[cold]
    fn by_exact_signs(corners: &[Sheared; 3], areas: &Areas) -> Self {
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

/// Of the triangles of the line and each edge, by the corner across from it: twice the areas, and the sizes of all products.
struct Areas {
    of: [f64; 3],
    size: f64,
}

/// Where the line passes through a face it covers, mm: the mean of the corners' places, weighted by the areas.
///
/// The areas err by γ₄ of their products' sizes, which moves the mean by as much of the face's extent along the line as that
/// is of the whole area. Where this is more than corners err along the line, in faces seen nearly edge-on, a closer look is
/// taken.
#[inline(always)]
fn place(corners: &[Sheared; 3], areas: &Areas) -> f64 {
    let [a, b, c] = [corners[0].along, corners[1].along, corners[2].along];
    let [of_a, of_b, of_c] = [areas.of[0].abs(), areas.of[1].abs(), areas.of[2].abs()];
    let total = of_a + of_b + of_c;
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    // Written so that NaN takes the closer look.
    let is_good = areas.size * (high - low) < total * low.abs().max(high.abs());
    if !is_good {
        return place_in_edge_on_face(corners);
    }
    // Rounding may not put the crossing off the face.
    ((of_a * a + of_b * b + of_c * c) / total).clamp(low, high)
}

/// As [`place`], with areas that are right for the corners as they are, whatever is lost in their differences; and on that
/// part of the line that is over the face when it is seen from the side.
#[cold]
fn place_in_edge_on_face(corners: &[Sheared; 3]) -> f64 {
    let area = |u: [f64; 2], v: [f64; 2]| {
        (DoubleDouble::product(u[0], v[1]) - DoubleDouble::product(u[1], v[0])).to_f64().abs()
    };
    let [a, b, c] = corners.map(|v| v.across);
    let areas = [area(b, c), area(c, a), area(a, b)];
    let total: f64 = areas.iter().sum();
    let [low, high] = span_over_face(corners);
    let t = areas.iter().zip(corners).map(|(of, corner)| of * corner.along).sum::<f64>() / total;
    // Without area, anywhere on the face is within rounding.
    if t.is_finite() { t.max(low).min(high) } else { low + 0.5 * (high - low) }
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
    let [low, high] = span_over_face(corners);
    Interval::new(low, high).filter(|part| part.length() > 0.0)
}

/// Between which places the line is over a face, as seen from the side: the face is taken for a triangle in one plane with
/// the line, across by the larger coordinate. From +∞ to −∞ if nowhere; a line that the face covers
/// is over it somewhere.
fn span_over_face(corners: &[Sheared; 3]) -> [f64; 2] {
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
    [low, high]
}
