//! Blocks of a convex body: a ray goes in once and out once, so that two depths of a pixel say all, and the quotients are
//! taken once they are known.
//!
//! ```text
//!   faces ──▶ depth of the entry ┐     length · (1/exit − 1/entry) in a cone,
//!         ──▶ depth of the exit  ┘     length · (exit − entry) in a parallel beam
//! ```
//!
//! Where rounding has folded the outline, faces may cover a pixel twice in one way. That is seen as it happens, and the ray is
//! left to the engine for single rays, as are rays in the plane of a face: what a ray gets depends on it alone, not on its
//! block.

use std::ops::Range;

use pulp::Simd;

use super::edge_on::{self, EdgeOn};
use super::face::{Edge, Slope, greater, order};
use super::pixels::Pixels;
use super::projection::Place;
use super::tracer::{BLOCK_COLUMNS, BLOCK_ROWS, RUN, SeenFace, Tracer};
use crate::exact::record::{Passes, Record, Way};
use crate::geometry::Upstream;

/// No instructions handle more pixels side by side.
const LANES: usize = 8;

/// A row of depths: lanes may reach beyond the block on either side.
const PITCH: usize = BLOCK_COLUMNS as usize + 2 * LANES;

/// Depths of one way.
const PLANE: usize = PITCH * BLOCK_ROWS as usize;

/// Stands for no depth: those are no less than 0. Alike for both ways, so that the length between is 0.
const UNSET: f64 = -1.0;

/// Faces no larger than this, in columns and rows, are held against all pixels of their box.
const SMALL: i32 = 4;

/// Sides of edges of small faces err by less: every operand is less than 8, and each of the two products errs by three
/// roundings of its factors and one of its own, so that the whole errs by less than γ₁₀ · 2 · 8².
const SIDE_ERROR: f64 = 1e-12;

/// The depths of a block's rays where they enter and where they leave. Unset between blocks.
#[derive(Default)]
pub struct Depths {
    planes: Vec<f64>,
    is_any_set: bool,
}

/// The plane of depths of a way.
#[inline(always)]
fn plane_of(way: Way) -> usize {
    match way {
        Way::In => 0,
        Way::Out => PLANE,
    }
}

/// Sets the depths that are inside. Returns those of them that were set before.
#[inline(always)]
fn set<S: Simd>(simd: S, old: &mut S::f64s, depths: S::f64s, is_inside: S::m64s) -> S::m64s {
    let is_set = simd.less_than_or_equal_f64s(simd.splat_f64s(0.0), *old);
    // The greater, as no depth is less than none. To store only the lanes inside is slow on some machines, and what the
    // compiler makes of a choice between old and new.
    let depths = simd.select_f64s(is_inside, depths, simd.splat_f64s(UNSET));
    *old = simd.max_f64s(depths, *old);
    simd.and_m64s(is_inside, is_set)
}

impl Depths {
    fn unset(&mut self, at: usize) {
        for plane in [Way::In, Way::Out].map(plane_of) {
            self.planes[plane + at] = UNSET;
        }
    }
}

/// An edge of a small face, in columns and rows from the first of its box.
#[derive(Clone, Copy)]
struct SmallEdge {
    from: [f64; 2],
    along: [f64; 2],
}

impl SmallEdge {
    /// `sign` is that of the face's area, so that pixels within it are left of all edges.
    #[inline(always)]
    fn new(from: &Place, to: &Place, [column, row]: [i32; 2], sign: f64) -> Self {
        Self {
            from: [from.x - f64::from(column), from.y - f64::from(row)],
            along: [sign * (to.x - from.x), sign * (to.y - from.y)],
        }
    }
}

impl Tracer<'_, '_> {
    /// Traces a block of a convex body seen from without.
    #[inline(always)]
    pub fn trace_block_of_chords<const CONE: bool, S: Simd, R: Record>(
        &mut self,
        simd: S,
        block: &Pixels,
        record: &mut R,
    ) {
        self.block.depths.planes.resize(2 * PLANE, UNSET);
        self.each_face(block, |tracer, face| tracer.mark::<CONE, S>(simd, face, block));
        if !self.block.edge_on.is_empty() {
            edge_on::sort(&mut self.block.edge_on);
            for e in &self.block.edge_on {
                self.block.depths.unset(depth_at(block, e.row, e.column));
            }
            self.trace_edge_on(record);
        }
        if std::mem::take(&mut self.block.depths.is_any_set) {
            self.report_chords::<CONE, R>(block, record);
        }
    }

    /// Marks the depths of a face at the pixels it covers.
    #[inline(always)]
    fn mark<const CONE: bool, S: Simd>(&mut self, simd: S, face: &SeenFace, block: &Pixels) {
        // Of the whole way, from the source to the pixel: shares from 0 to 1.
        let limits = if CONE { [1.0, f64::INFINITY] } else { [0.0, 1.0] };
        let [a, b, c] = face.places.each_ref();
        let (mut slope, is_sure) = Slope::new([a, b, c], self.seen.care, limits);
        if !is_sure {
            slope = self.look_closely(face, limits, block);
        }
        self.block.depths.is_any_set = true;
        let outline =
            Outline { face: face.number, corners: [a, b, c], slope, rows: face.rows, turn: face.turn };
        let (columns, rows) = (&face.columns, face.within.clone());
        if is_sure && columns.len() as i32 <= SMALL && face.last_row - face.first_row <= SMALL {
            self.mark_small(simd, &outline, [columns.start, face.first_row], rows, block);
        } else {
            self.mark_rows(simd, &outline, rows, &block.columns, block);
        }
    }

    /// Marks rows of pixels, from edge to edge, but none beyond some columns.
    #[inline(always)]
    fn mark_rows<S: Simd>(
        &mut self,
        simd: S,
        outline: &Outline,
        rows: Range<i32>,
        columns: &Range<i32>,
        block: &Pixels,
    ) {
        let columns = columns.start.max(block.columns.start)..columns.end.min(block.columns.end);
        let (order, is_even) = order(outline.rows);
        let [a, b, c] = order;
        let [low, mid, high] = [outline.corners[a], outline.corners[b], outline.corners[c]];
        let (long, below, above) = (Edge::new(low, high), Edge::new(low, mid), Edge::new(mid, high));
        let is_right_out = is_even != self.seen.projection.is_mirrored();
        let slope = &outline.slope;
        for row in rows {
            let by_long = long.first_right(row, self.seen.crossing_error);
            let short = if row < outline.turn { below } else { above };
            let by_short = short.first_right(row, self.seen.crossing_error);
            let start = by_long.min(by_short).max(columns.start);
            let end = by_long.max(by_short).min(columns.end);
            let way = if (by_long < by_short) == is_right_out { Way::Out } else { Way::In };
            let of_row = slope.row(row);
            if start >= end {
                continue;
            }
            let at = plane_of(way) + depth_at(block, row, start);
            let groups = (end - start) as usize / S::F64_LANES + 1;
            let depths = &mut self.block.depths.planes[at..at + groups * S::F64_LANES];
            let mut lanes = simd.add_f64s(simd.splat_f64s(f64::from(start)), first_lanes(simd));
            for (group, old) in S::as_mut_simd_f64s(depths).0.iter_mut().enumerate() {
                let is_before_end = simd.less_than_f64s(lanes, simd.splat_f64s(f64::from(end)));
                let is_twice = set(simd, old, slope.depths(simd, of_row, lanes), is_before_end);
                if is_any(simd, is_twice) {
                    let column = start + (group * S::F64_LANES) as i32;
                    note_twice(simd, &mut self.block.edge_on, outline.face, [column, row], is_twice);
                }
                lanes = simd.add_f64s(lanes, simd.splat_f64s(S::F64_LANES as f64));
            }
        }
    }

    /// Marks a face in a small box, from its first pixel on.
    #[inline(always)]
    fn mark_small<S: Simd>(
        &mut self,
        simd: S,
        outline: &Outline,
        [left, first_row]: [i32; 2],
        rows: Range<i32>,
        block: &Pixels,
    ) {
        let [a, b, c] = outline.corners;
        let is_positive = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y) > 0.0;
        let sign = if is_positive { 1.0 } else { -1.0 };
        let way = if is_positive != self.seen.projection.is_mirrored() { Way::Out } else { Way::In };
        let edges = [(a, b), (b, c), (c, a)].map(|(p, q)| SmallEdge::new(p, q, [left, first_row], sign));
        let [least, most] = [block.columns.start, block.columns.end - 1].map(|c| f64::from(c - left));
        for group in (0..SMALL).step_by(S::F64_LANES) {
            let lanes = simd.add_f64s(simd.splat_f64s(f64::from(group)), first_lanes(simd));
            let is_in_block = simd.and_m64s(
                simd.less_than_or_equal_f64s(simd.splat_f64s(least), lanes),
                simd.less_than_or_equal_f64s(lanes, simd.splat_f64s(most)),
            );
            let columns = simd.add_f64s(simd.splat_f64s(f64::from(left)), lanes);
            // What no edge changes: within them.
            let mut across = [simd.splat_f64s(0.0); 3];
            for (across, SmallEdge { from, along }) in across.iter_mut().zip(&edges) {
                let offsets = simd.sub_f64s(lanes, simd.splat_f64s(from[0]));
                *across = simd.mul_f64s(simd.splat_f64s(along[1]), offsets);
            }
            for row in rows.clone() {
                let height = f64::from(row - first_row);
                let side = |edge: usize| {
                    let SmallEdge { from, along } = edges[edge];
                    simd.sub_f64s(simd.splat_f64s(along[0] * (height - from[1])), across[edge])
                };
                let (first, second, third) = (side(0), side(1), side(2));
                let inside = simd.min_f64s(simd.min_f64s(first, second), third);
                let is_inside = simd.less_than_f64s(simd.splat_f64s(SIDE_ERROR), inside);
                let may_be = simd.less_than_or_equal_f64s(simd.splat_f64s(-SIDE_ERROR), inside);
                if is_any(simd, simd.xor_m64s(is_inside, may_be)) {
                    let columns = left + group..left + group + S::F64_LANES as i32;
                    self.mark_in_doubt(simd, outline, row, columns, block);
                    continue;
                }
                let depths = outline.slope.depths(simd, outline.slope.row(row), columns);
                let at = plane_of(way) + depth_at(block, row, left + group);
                let old = &mut self.block.depths.planes[at..at + S::F64_LANES];
                let old = &mut S::as_mut_simd_f64s(old).0[0];
                let is_twice = set(simd, old, depths, simd.and_m64s(is_inside, is_in_block));
                if is_any(simd, is_twice) {
                    let first = [left + group, row];
                    note_twice(simd, &mut self.block.edge_on, outline.face, first, is_twice);
                }
            }
        }
    }

    /// Marks some columns of a row by exact signs.
    #[cold]
    #[inline(never)]
    fn mark_in_doubt<S: Simd>(
        &mut self,
        simd: S,
        outline: &Outline,
        row: i32,
        columns: Range<i32>,
        block: &Pixels,
    ) {
        self.mark_rows(simd, outline, row..row + 1, &columns, block);
    }

    /// Reports all rays of the block, and leaves the depths unset.
    #[inline(always)]
    fn report_chords<const CONE: bool, R: Record>(&mut self, block: &Pixels, record: &mut R) {
        let (mut lengths, mut entries, mut exits) = ([0.0; RUN], [0.0; RUN], [0.0; RUN]);
        for row in block.rows.clone() {
            for start in block.columns.clone().step_by(RUN) {
                let count = RUN.min((block.columns.end - start) as usize);
                let at = depth_at(block, row, start);
                let ray = self.ray(row, start);
                let (first, second) = self.block.depths.planes.split_at_mut(PLANE);
                let (ins, outs) = (&mut first[at..at + count], &mut second[at..at + count]);
                let mut most = UNSET;
                for &depth in ins.iter() {
                    most = greater(depth, most);
                }
                if most < 0.0 {
                    continue;
                }
                let lengths = &mut lengths[..count];
                measure(&self.view.grid, row, start, lengths);
                if R::ASKS_ENDS {
                    for (places, depths) in [(&mut entries, &*ins), (&mut exits, &*outs)] {
                        for ((place, depth), length) in places.iter_mut().zip(depths).zip(&*lengths) {
                            *place = if CONE { length / depth } else { length * depth };
                        }
                    }
                }
                for ((length, a), b) in lengths.iter_mut().zip(&*ins).zip(&*outs) {
                    *length *= if CONE { (a - b) / (a * b) } else { b - a };
                }
                let ends = if R::ASKS_ENDS { count } else { 0 };
                let ends_mm = [&entries[..ends], &exits[..ends]];
                record.passes(ray, &Passes { lengths_mm: lengths, ends_mm });
                ins.fill(UNSET);
                outs.fill(UNSET);
            }
        }
    }
}

/// Lists pixels that are covered twice, to be traced by themselves.
#[cold]
#[inline(never)]
fn note_twice<S: Simd>(
    simd: S,
    pixels: &mut Vec<EdgeOn>,
    face: u32,
    [column, row]: [i32; 2],
    is_twice: S::m64s,
) {
    let mut lanes = [0.0; LANES];
    S::as_mut_simd_f64s(&mut lanes[..S::F64_LANES]).0[0] =
        simd.select_f64s(is_twice, simd.splat_f64s(1.0), simd.splat_f64s(0.0));
    let twice = (0..S::F64_LANES).filter(|&i| lanes[i] > 0.0);
    pixels.extend(twice.map(|i| EdgeOn { row, column: column + i as i32, face }));
}

/// 0, 1, 2, …
#[inline(always)]
fn first_lanes<S: Simd>(_: S) -> S::f64s {
    S::as_simd_f64s(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0][..S::F64_LANES]).0[0]
}

#[inline(always)]
fn is_any<S: Simd>(simd: S, mask: S::m64s) -> bool {
    simd.first_true_m64s(mask) < S::F64_LANES
}

/// A face in the image.
struct Outline<'s> {
    face: u32,
    corners: [&'s Place; 3],
    slope: Slope,
    /// Ceilings of the corners' rows.
    rows: [i32; 3],
    /// The middle of them.
    turn: i32,
}

/// Where the depth of a pixel stands in its plane: of one of the block, or up to `LANES` columns off it.
#[inline(always)]
fn depth_at(block: &Pixels, row: i32, column: i32) -> usize {
    (row - block.rows.start) as usize * PITCH + (column - block.columns.start + LANES as i32) as usize
}

/// The lengths of rays in a row: to the last bit those of their segments.
#[inline(always)]
pub fn measure(grid: &crate::geometry::RayGrid, row: i32, first: i32, lengths: &mut [f64]) {
    match grid.upstream() {
        Upstream::Path(path) => lengths.fill(path.length()),
        Upstream::Source(source) => {
            for (i, length) in lengths.iter_mut().enumerate() {
                *length = (grid.point((first + i as i32) as u32, row as u32) - source).length();
            }
        }
    }
}
