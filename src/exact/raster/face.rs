//! One face in the image: which pixels of a row it covers, and how deep it is there.
//!
//! ```text
//!              high
//!             ╱   ╲          rows below `mid`: between the long edge low–high and the edge low–mid
//!    long ─▶ ╱     ╲         rows above:       between the long edge and the edge mid–high
//!           ╱       mid
//!         low ───╯           a row's pixels: from the ceiling of one crossing to before the ceiling of the other
//! ```
//!
//! A pixel centre stands for the point moved by an infinitesimal (ε, ε²), as in
//! [`cover`](crate::geometry::predicates::cover): a vertex on a row counts as below it, and a centre on an edge as right of it.
//! So an edge crosses those rows r with y₀ ≤ r < y₁, and the centres left of it are those below the ceiling of its
//! crossing. That ceiling is exact, hence the same for both faces of an edge, whichever way they go along it.

use pulp::Simd;
use robust::{Coord, orient2d};

use super::edge_on::THICKNESS;
use super::projection::Place;
use crate::exact::round;
use crate::geometry::numeric::{DoubleDouble, gamma, greater, lesser};

/// Where an edge crosses rows. Of its ends, the first is the lower.
#[derive(Clone, Copy)]
pub struct Edge {
    pub low: [f64; 2],
    high: [f64; 2],
    /// Columns by row.
    pub slope: f64,
}

impl Edge {
    #[inline(always)]
    pub fn new(low: &Place, high: &Place) -> Self {
        Self { low: [low.x, low.y], high: [high.x, high.y], slope: (high.x - low.x) / (high.y - low.y) }
    }

    /// The first column whose pixel is not left of the edge, in a row that the edge crosses. `tolerance` bounds the rounding
    /// of a crossing.
    #[inline(always)]
    pub fn first_right(self, row: i32, tolerance: f64) -> i32 {
        let crossing = self.low[0] + (f64::from(row) - self.low[1]) * self.slope;
        let (column, above) = round::nearest(crossing);
        if above.abs() <= tolerance {
            return first_right_exact(self.low, self.high, [column, row]);
        }
        column + i32::from(above > 0.0)
    }
}

/// As [`Edge::first_right`], if the crossing is too near to this column to tell.
///
/// It takes the ends one by one: an edge that is lent to a function has to be kept in memory by all others.
#[cold]
#[inline(never)]
fn first_right_exact(low: [f64; 2], high: [f64; 2], [column, row]: [i32; 2]) -> i32 {
    let coord = |[x, y]: [f64; 2]| Coord { x, y };
    let centre = Coord { x: f64::from(column), y: f64::from(row) };
    let is_left = orient2d(coord(low), coord(high), centre) > 0.0;
    column + i32::from(is_left)
}

/// How the corners of a face lie, lowest first, and whether that order is as they are wound. Told by which of
/// a < b, b < c and c < a hold; corners in the same row may come in any order.
const ORDERS: [([usize; 3], bool); 8] = [
    ([0, 1, 2], true),
    ([0, 2, 1], false),
    ([1, 0, 2], false),
    ([0, 1, 2], true),
    ([2, 1, 0], false),
    ([2, 0, 1], true),
    ([1, 2, 0], true),
    ([0, 1, 2], true),
];

/// The order of three corners by their rows: see [`ORDERS`].
#[inline(always)]
pub fn order([a, b, c]: [i32; 3]) -> ([usize; 3], bool) {
    ORDERS[usize::from(a < b) | usize::from(b < c) << 1 | usize::from(c < a) << 2]
}

/// The depth over a face: affine in column and row.
#[derive(Clone, Copy)]
pub struct Slope {
    pub base: Place,
    pub per_column: f64,
    pub per_row: f64,
    /// Of the corners: rounding may not put a crossing off the face.
    pub lowest: f64,
    pub highest: f64,
}

/// Which faces need a closer look: factors of their extents.
#[derive(Clone, Copy, Debug)]
pub struct Care {
    per_pixel: f64,
    per_depth: f64,
    of_thickness: f64,
    /// How far off a depth may be.
    depth_error: f64,
}

impl Care {
    /// With roundings of the corners of so much across and in depth.
    ///
    /// In f64 a slope errs, over the face's extents Eₓ, E_y, E_z, by γ₁₂ · Eₓ E_y E_z / |area| in depth, and by as much as
    /// a move of γ₁₂ · Eₓ E_y max(Eₓ, E_y) / |area| in place. That may be no more than the corners' own error: more than that in
    /// needles, and in faces seen almost edge-on.
    pub fn new(place_error: f64, depth: f64) -> Self {
        Self {
            per_pixel: gamma(12) / place_error,
            per_depth: 1.0 / depth,
            of_thickness: THICKNESS * place_error,
            // As much as the corners may be off, over the same distance.
            depth_error: gamma(96) * depth,
        }
    }
}

impl Slope {
    /// The slope of a face, and its depth kept within `limits`; and whether that is right: if not, it needs care, or the face
    /// may be edge-on.
    #[inline(always)]
    pub fn new([a, b, c]: [&Place; 3], care: Care, limits: [f64; 2]) -> (Self, bool) {
        let (x1, y1, z1) = (b.x - a.x, b.y - a.y, b.depth - a.depth);
        let (x2, y2, z2) = (c.x - a.x, c.y - a.y, c.depth - a.depth);
        let area = x1 * y2 - x2 * y1;
        let extent = |p: f64, q: f64| greater(p.abs(), q.abs());
        let (ex, ey, ez) = (extent(x1, x2), extent(y1, y2), extent(z1, z2));
        let least = ex * ey * (greater(ex, ey) * care.per_pixel + ez * care.per_depth)
            + (ex + ey) * care.of_thickness;
        let inverse = 1.0 / area;
        let slopes = [(z1 * y2 - z2 * y1) * inverse, (z2 * x1 - z1 * x2) * inverse];
        (Self::of([a, b, c], slopes, limits), area.abs() > least)
    }

    /// As above for any face, in double-double; and whether depths in f64 are right then. The slopes of a face without area are
    /// infinite or not numbers.
    ///
    /// A depth is the sum of two products that may be huge, and errs by γ₈ of them: two roundings of a quotient of a
    /// rounded area, an offset, a product and two sums. Of a face seen all but edge-on that is as little as a move in place
    /// of γ₈ of its extent, yet may put the crossing far beyond the face's edge, where the body ends.
    #[cold]
    #[inline(never)]
    pub fn careful([a, b, c]: [Place; 3], care: Care, limits: [f64; 2]) -> (Self, bool) {
        let edge = |to: Place| {
            [(to.x, a.x), (to.y, a.y), (to.depth, a.depth)].map(|(p, q)| DoubleDouble::difference(p, q))
        };
        let ([x1, y1, z1], [x2, y2, z2]) = (edge(b), edge(c));
        let area = (x1 * y2 - x2 * y1).to_f64();
        let slopes = [(z1 * y2 - z2 * y1).to_f64() / area, (z2 * x1 - z1 * x2).to_f64() / area];
        let extent = |key: fn(&Place) -> f64| {
            let [a, b, c] = [&a, &b, &c].map(key);
            a.max(b).max(c) - a.min(b).min(c)
        };
        // Written so that what is not a number is not right.
        let rise = slopes[0].abs() * extent(|p| p.x) + slopes[1].abs() * extent(|p| p.y);
        (Self::of([&a, &b, &c], slopes, limits), gamma(8) * rise <= care.depth_error)
    }

    #[inline(always)]
    fn of([a, b, c]: [&Place; 3], [per_column, per_row]: [f64; 2], limits: [f64; 2]) -> Self {
        let lowest = lesser(a.depth, lesser(b.depth, c.depth));
        let highest = greater(a.depth, greater(b.depth, c.depth));
        let clamp = |depth: f64| greater(limits[0], lesser(depth, limits[1]));
        Self { base: *a, per_column, per_row, lowest: clamp(lowest), highest: clamp(highest) }
    }

    /// The depth over a row, still to be kept within the face.
    #[inline(always)]
    pub fn row(&self, row: i32) -> f64 {
        self.base.depth + self.per_row * (f64::from(row) - self.base.y)
    }

    /// The depth at a column of that row. A slope that is not a number, of a face without area, gives the face's own depth.
    #[inline(always)]
    pub fn depth(&self, of_row: f64, column: f64) -> f64 {
        let depth = of_row + self.per_column * (column - self.base.x);
        greater(lesser(depth, self.highest), self.lowest)
    }
}

impl Slope {
    /// As [`depth`](Self::depth), at many columns.
    #[inline(always)]
    pub fn depths<S: Simd>(&self, simd: S, of_row: f64, columns: S::f64s) -> S::f64s {
        let splat = |x: f64| simd.splat_f64s(x);
        let limits = [splat(self.lowest), splat(self.highest)];
        depths_of(simd, splat(of_row), splat(self.per_column), splat(self.base.x), columns, limits)
    }
}

/// As [`Slope::depth`], of many faces, or at many columns.
#[inline(always)]
pub fn depths_of<S: Simd>(
    simd: S,
    of_row: S::f64s,
    per_column: S::f64s,
    x: S::f64s,
    columns: S::f64s,
    [lowest, highest]: [S::f64s; 2],
) -> S::f64s {
    let depths = simd.add_f64s(of_row, simd.mul_f64s(per_column, simd.sub_f64s(columns, x)));
    // As `lesser` and `greater` choose: a depth that is not a number is the face's own.
    simd.max_f64s(simd.min_f64s(depths, highest), lowest)
}
