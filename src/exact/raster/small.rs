//! Faces of a convex body that cover few pixels each: as many of them at a time as the machine's instructions take, held against
//! the first pixel of their boxes, then against the second, and so on.
//!
//! ```text
//!   ·  ·  ·  ·      ·  ·  ·  ·      In the box of each face, the centre in this column and row: is it inside,
//!   · ╱╲  ·  ·      ·  ╱▔▔╲  ·      and how deep is the face there? Those inside are listed without a branch,
//!   ·╱__╲·   ·      · ╱____╲ ·      and their depths are set when the patch is done.
//! ```

use pulp::Simd;

use super::aspect::Aspect;
use super::face::depths_of;
use super::patches::MOST_FACES;
use super::pixels::Pixels;
use super::rows::{LANES, is_any};
use crate::exact::round;

/// Faces no larger than this, in columns and rows, are held against all pixels of their box.
pub const SMALL: i32 = 4;

/// Sides of edges of small faces err by less: every operand is less than 8, and each of the two products errs by three
/// roundings of its factors and one of its own, so that the whole errs by less than γ₁₀ · 2 · 8².
const SIDE_ERROR: f64 = 1e-12;

/// Pixels that the small faces of a patch may cover, and more to write to; a power of two.
const MOST_MARKS: usize = 2 * MOST_FACES * (SMALL * SMALL) as usize;

/// A pixel that a face covers.
#[derive(Clone, Copy, Default)]
pub struct Mark {
    /// Where its depth stands: see [`Shelf`].
    pub at: u32,
    /// In the patch that is looked at.
    pub face: u32,
    pub depth: f64,
}

/// Where the depths of a block stand: from row to row, from column to column one farther, entries before exits.
pub struct Shelf {
    /// Of the depth of an entry at pixel (0, 0) of the image; may be negative.
    pub origin: f64,
    pub pitch: f64,
    /// From an entry's to an exit's.
    pub plane: f64,
}

/// What small faces cover.
pub struct SmallFaces {
    marks: [Mark; MOST_MARKS],
    count: usize,
    /// Faces, and columns and rows in their boxes, where signs are too near to tell.
    pub in_doubt: Vec<[u32; 3]>,
}

impl Default for SmallFaces {
    fn default() -> Self {
        Self { marks: [Mark::default(); MOST_MARKS], count: 0, in_doubt: Vec::new() }
    }
}

impl SmallFaces {
    /// Lists the pixels of a block that small faces cover, of the first `count` of a patch.
    #[inline(always)]
    pub fn find<S: Simd>(
        &mut self,
        simd: S,
        aspect: &Aspect,
        count: usize,
        block: &Pixels,
        shelf: &Shelf,
        is_mirrored: bool,
    ) {
        self.count = 0;
        self.in_doubt.clear();
        for group in 0..count.div_ceil(S::F64_LANES) {
            self.find_of_group(simd, aspect, group, block, shelf, is_mirrored);
        }
    }

    /// What was found.
    #[inline(always)]
    pub fn marks(&self) -> &[Mark] {
        &self.marks[..self.count]
    }

    #[inline(always)]
    fn find_of_group<S: Simd>(
        &mut self,
        simd: S,
        aspect: &Aspect,
        group: usize,
        block: &Pixels,
        shelf: &Shelf,
        is_mirrored: bool,
    ) {
        let splat = |x: f64| simd.splat_f64s(x);
        let of = |list: &[f64; MOST_FACES]| S::as_simd_f64s(list).0[group];
        let is_small = simd.less_than_f64s(splat(0.0), of(&aspect.small));
        if !is_any(simd, is_small) {
            return;
        }
        let (low_column, low_row) = (of(&aspect.low[0]), of(&aspect.low[1]));
        let extent = |axis: usize| {
            let extent = simd.sub_f64s(of(&aspect.high[axis]), of(&aspect.low[axis]));
            simd.select_f64s(is_small, extent, splat(0.0))
        };
        let (columns, rows) = (extent(0), extent(1));
        let is_positive = simd.less_than_f64s(splat(0.0), of(&aspect.areas));
        let sign = simd.select_f64s(is_positive, splat(1.0), splat(-1.0));
        let way = if is_mirrored { [0.0, shelf.plane] } else { [shelf.plane, 0.0] };
        let way = simd.select_f64s(is_positive, splat(way[0]), splat(way[1]));
        let corner = |i: usize| [of(&aspect.corners[i][0]), of(&aspect.corners[i][1])];
        let corners = [corner(0), corner(1), corner(2)];
        let edge = |from: usize, to: usize| {
            let ([x, y], [to_x, to_y]) = (corners[from], corners[to]);
            let along = [simd.sub_f64s(to_x, x), simd.sub_f64s(to_y, y)];
            Edge {
                from: [simd.sub_f64s(x, low_column), simd.sub_f64s(y, low_row)],
                along: [simd.mul_f64s(sign, along[0]), simd.mul_f64s(sign, along[1])],
            }
        };
        let edges = [edge(0, 1), edge(1, 2), edge(2, 0)];
        let [base_x, base_y] = corners[0];
        let base_depth = of(&aspect.corners[0][2]);
        let (per_column, per_row) = (of(&aspect.slopes[0]), of(&aspect.slopes[1]));
        let limits = [of(&aspect.lowest), of(&aspect.highest)];
        let (left, right) = (splat(f64::from(block.columns.start)), splat(f64::from(block.columns.end)));
        let (top, bottom) = (splat(f64::from(block.rows.start)), splat(f64::from(block.rows.end)));
        let mut marked = self.count;
        for y in 0..SMALL {
            let y_in_box = splat(f64::from(y));
            let is_row = simd.less_than_f64s(y_in_box, rows);
            if !is_any(simd, is_row) {
                break;
            }
            let row = simd.add_f64s(low_row, y_in_box);
            let is_row = simd.and_m64s(is_row, is_between(simd, top, row, bottom));
            let of_row = |edge: usize| edges[edge].of_row(simd, y_in_box);
            let of_row = [of_row(0), of_row(1), of_row(2)];
            let depth_of_row = simd.add_f64s(base_depth, simd.mul_f64s(per_row, simd.sub_f64s(row, base_y)));
            let at_row = simd.mul_f64s(row, splat(shelf.pitch));
            let at_row = simd.add_f64s(simd.add_f64s(at_row, splat(shelf.origin + round::WHOLE)), way);
            for x in 0..SMALL {
                let x_in_box = splat(f64::from(x));
                let is_column = simd.less_than_f64s(x_in_box, columns);
                if !is_any(simd, is_column) {
                    break;
                }
                let column = simd.add_f64s(low_column, x_in_box);
                let is_column = simd.and_m64s(is_column, is_between(simd, left, column, right));
                let is_candidate = simd.and_m64s(is_row, is_column);
                let side = |edge: usize| edges[edge].side(simd, of_row[edge], x_in_box);
                let inside = simd.min_f64s(simd.min_f64s(side(0), side(1)), side(2));
                let is_inside = simd.less_than_f64s(splat(SIDE_ERROR), inside);
                let may_be = simd.less_than_or_equal_f64s(splat(-SIDE_ERROR), inside);
                let is_in_doubt = simd.and_m64s(is_candidate, simd.xor_m64s(is_inside, may_be));
                if is_any(simd, is_in_doubt) {
                    self.list_in_doubt(simd, is_in_doubt, group, [x as u32, y as u32]);
                }
                let depths = depths_of(simd, depth_of_row, per_column, base_x, column, limits);
                let is_marked = simd.and_m64s(is_candidate, is_inside);
                let found = [simd.add_f64s(at_row, column), depths];
                marked = self.list(simd, is_marked, group, found, marked);
            }
        }
        self.count = marked;
    }

    /// Lists those that are marked, after `count` others. How many there are then: were that kept in memory, each lane would wait
    /// for the last.
    #[inline(always)]
    fn list<S: Simd>(
        &mut self,
        simd: S,
        is_marked: S::m64s,
        group: usize,
        [at, depths]: [S::f64s; 2],
        mut count: usize,
    ) -> usize {
        let (mut places, mut values, mut any) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        let one =
            simd.select_f64s(is_marked, simd.splat_f64s(round::WHOLE + 1.0), simd.splat_f64s(round::WHOLE));
        for (lanes, of_lanes) in [(&mut places, at), (&mut values, depths), (&mut any, one)] {
            S::as_mut_simd_f64s(&mut lanes[..S::F64_LANES]).0[0] = of_lanes;
        }
        for lane in 0..S::F64_LANES {
            // Written in any case: whether it counts could not be foreseen.
            let face = (group * S::F64_LANES + lane) as u32;
            self.marks[count % MOST_MARKS] =
                Mark { at: round::whole(places[lane]) as u32, face, depth: values[lane] };
            count += round::whole(any[lane]) as usize;
        }
        count
    }

    #[cold]
    #[inline(never)]
    fn list_in_doubt<S: Simd>(&mut self, simd: S, is_in_doubt: S::m64s, group: usize, [x, y]: [u32; 2]) {
        let mut lanes = [0.0; LANES];
        S::as_mut_simd_f64s(&mut lanes[..S::F64_LANES]).0[0] =
            simd.select_f64s(is_in_doubt, simd.splat_f64s(1.0), simd.splat_f64s(0.0));
        let doubtful = (0..S::F64_LANES).filter(|&lane| lanes[lane] > 0.0);
        self.in_doubt.extend(doubtful.map(|lane| [(group * S::F64_LANES + lane) as u32, x, y]));
    }
}

/// Edges of some faces, in columns and rows from the least that have any part in the face.
struct Edge<F> {
    /// Where they start.
    from: [F; 2],
    /// Where they lead, so turned that the face is on the side of greater columns if an edge leads to greater rows.
    along: [F; 2],
}

impl<F: Copy> Edge<F> {
    /// What a row adds to the sides.
    #[inline(always)]
    fn of_row<S: Simd<f64s = F>>(&self, simd: S, y: F) -> F {
        simd.mul_f64s(self.along[0], simd.sub_f64s(y, self.from[1]))
    }

    /// Positive for a pixel within the edge.
    #[inline(always)]
    fn side<S: Simd<f64s = F>>(&self, simd: S, of_row: F, x: F) -> F {
        simd.sub_f64s(of_row, simd.mul_f64s(self.along[1], simd.sub_f64s(x, self.from[0])))
    }
}

/// Whether places are from the first to before the last.
#[inline(always)]
fn is_between<S: Simd>(simd: S, first: S::f64s, place: S::f64s, last: S::f64s) -> S::m64s {
    simd.and_m64s(simd.less_than_or_equal_f64s(first, place), simd.less_than_f64s(place, last))
}
