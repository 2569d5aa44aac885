//! Which pixels of its rows a face covers, for as many rows at a time as the machine's instructions take.

use pulp::Simd;

use super::face::{Edge, order};
use super::pixels::Pixels;
use super::projection::Place;
use super::tracer::BLOCK_ROWS;
use crate::exact::round;

/// No instructions handle more numbers side by side.
pub const LANES: usize = 8;

/// More rows than a block has are not looked at.
const ROWS: usize = BLOCK_ROWS as usize + LANES;

/// What a face covers of rows of a block. All numbers are whole, and stand in the lowest bits of doubles: see
/// [`whole`](round::whole).
pub struct Rows {
    starts: [f64; ROWS],
    ends: [f64; ROWS],
    /// 1 if the longest edge is left of the others.
    is_long_left: [f64; ROWS],
}

impl Default for Rows {
    fn default() -> Self {
        Self { starts: [0.0; ROWS], ends: [0.0; ROWS], is_long_left: [0.0; ROWS] }
    }
}

/// The pixels of a row that a face covers.
#[derive(Clone, Copy)]
pub struct Covered {
    /// The first of their columns.
    pub start: i32,
    /// How many they are; none if that is negative.
    pub count: i32,
    /// Whether the longest edge is left of the others.
    pub is_long_left: bool,
}

/// A face's edges: the one from its lowest row to its highest, and those below and above its middle corner. And where they
/// turn from one to the other; and whether the corners, lowest first, are in the order in which they are wound.
struct Edges {
    long: Edge,
    below: Edge,
    above: Edge,
    turn: i32,
    is_even: bool,
}

impl Edges {
    #[inline(always)]
    fn new(corners: &[Place; 3]) -> Self {
        let rows = corners.each_ref().map(|corner| round::ceil(corner.y));
        let (order, is_even) = order(rows);
        let [low, mid, high] = order.map(|i| &corners[i]);
        let (long, below, above) = (Edge::new(low, high), Edge::new(low, mid), Edge::new(mid, high));
        Self { long, below, above, turn: rows[order[1]], is_even }
    }

    /// Where the two edges cross a row.
    fn crossings(&self, row: i32, tolerance: f64) -> [i32; 2] {
        let short = if row < self.turn { self.below } else { self.above };
        [self.long.first_right(row, tolerance), short.first_right(row, tolerance)]
    }
}

impl Rows {
    /// Finds what a face covers of some pixels, of no more rows than a block has, which all lie between its lowest and its
    /// highest. Crossings err by less than `tolerance`. Returns whether pixels right of its longest edge are in it if the corners,
    /// lowest first, are wound as the rows and columns are.
    #[inline(always)]
    pub fn find<S: Simd>(&mut self, simd: S, corners: &[Place; 3], pixels: &Pixels, tolerance: f64) -> bool {
        let Pixels { columns, rows } = pixels;
        let edges = Edges::new(corners);
        let Edges { long, below, above, .. } = &edges;
        let turn = simd.splat_f64s(f64::from(edges.turn));
        let groups = rows.len().div_ceil(S::F64_LANES) * S::F64_LANES;
        let starts = S::as_mut_simd_f64s(&mut self.starts[..groups]).0;
        let ends = S::as_mut_simd_f64s(&mut self.ends[..groups]).0;
        let is_long_left = S::as_mut_simd_f64s(&mut self.is_long_left[..groups]).0;
        let [left, right] = [columns.start, columns.end].map(|column| simd.splat_f64s(f64::from(column)));
        let whole = simd.splat_f64s(round::WHOLE);
        let mut row = simd.add_f64s(simd.splat_f64s(f64::from(rows.start)), first_lanes(simd));
        let mut is_in_doubt = false;
        for ((start, end), is_left) in starts.iter_mut().zip(ends).zip(is_long_left) {
            let is_below = simd.less_than_f64s(row, turn);
            let of_short = |of: fn(&Edge) -> f64| {
                simd.select_f64s(is_below, simd.splat_f64s(of(below)), simd.splat_f64s(of(above)))
            };
            let of_long = |of: fn(&Edge) -> f64| simd.splat_f64s(of(long));
            let crossing = |x: S::f64s, y: S::f64s, slope: S::f64s| {
                simd.add_f64s(x, simd.mul_f64s(simd.sub_f64s(row, y), slope))
            };
            let [x, y, slope]: [fn(&Edge) -> f64; 3] =
                [|edge| edge.low[0], |edge| edge.low[1], |edge| edge.slope];
            let (first, first_doubt) =
                first_right(simd, crossing(of_long(x), of_long(y), of_long(slope)), tolerance);
            let (second, second_doubt) =
                first_right(simd, crossing(of_short(x), of_short(y), of_short(slope)), tolerance);
            *start = simd.add_f64s(simd.max_f64s(simd.min_f64s(first, second), left), whole);
            *end = simd.add_f64s(simd.min_f64s(simd.max_f64s(first, second), right), whole);
            let (yes, no) = (simd.splat_f64s(round::WHOLE + 1.0), whole);
            *is_left = simd.select_f64s(simd.less_than_f64s(first, second), yes, no);
            is_in_doubt |= is_any(simd, simd.or_m64s(first_doubt, second_doubt));
            row = simd.add_f64s(row, simd.splat_f64s(S::F64_LANES as f64));
        }
        if is_in_doubt {
            self.find_one_by_one(corners, pixels, tolerance);
        }
        edges.is_even
    }

    /// As [`find`](Self::find), with exact signs where crossings are too near to a pixel to tell.
    #[cold]
    #[inline(never)]
    pub fn find_one_by_one(
        &mut self,
        corners: &[Place; 3],
        Pixels { columns, rows }: &Pixels,
        tolerance: f64,
    ) {
        let edges = Edges::new(corners);
        for (i, row) in rows.clone().enumerate() {
            let [first, second] = edges.crossings(row, tolerance);
            self.starts[i] = round::WHOLE + f64::from(first.min(second).max(columns.start));
            self.ends[i] = round::WHOLE + f64::from(first.max(second).min(columns.end));
            self.is_long_left[i] = round::WHOLE + f64::from(u8::from(first < second));
        }
    }

    /// What the face covers of a row, counted from the first that was looked at.
    #[inline(always)]
    pub fn covered(&self, row: usize) -> Covered {
        let start = round::whole(self.starts[row]);
        let is_long_left = round::whole(self.is_long_left[row]) != 0;
        Covered { start, count: round::whole(self.ends[row]).wrapping_sub(start), is_long_left }
    }
}

/// The first columns whose pixels are not left of these crossings; and whether it is too near to tell.
#[inline(always)]
fn first_right<S: Simd>(simd: S, crossings: S::f64s, tolerance: f64) -> (S::f64s, S::m64s) {
    let whole = simd.splat_f64s(round::WHOLE);
    let nearest = simd.sub_f64s(simd.add_f64s(crossings, whole), whole);
    let above = simd.sub_f64s(crossings, nearest);
    let is_above = simd.less_than_f64s(simd.splat_f64s(0.0), above);
    let one_more = simd.select_f64s(is_above, simd.splat_f64s(1.0), simd.splat_f64s(0.0));
    let is_in_doubt = simd.less_than_or_equal_f64s(simd.abs_f64s(above), simd.splat_f64s(tolerance));
    (simd.add_f64s(nearest, one_more), is_in_doubt)
}

/// 0, 1, 2, …
#[inline(always)]
pub fn first_lanes<S: Simd>(_: S) -> S::f64s {
    S::as_simd_f64s(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0][..S::F64_LANES]).0[0]
}

/// Whether any lane is set.
#[inline(always)]
pub fn is_any<S: Simd>(simd: S, mask: S::m64s) -> bool {
    simd.first_true_m64s(mask) < S::F64_LANES
}
