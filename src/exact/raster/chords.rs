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

use pulp::Simd;

use super::edge_on::{self, EdgeOn};
use super::face::Slope;
use super::pixels::Pixels;
use super::rows::{Covered, LANES, first_lanes, is_any};
use super::small::Shelf;
use super::tracer::{RUN, SeenFace, SeenPatch, Tracer};
use super::workspace::{Block, Workspace};
use crate::exact::record::{Passes, Record, Way};
use crate::geometry::numeric::greater;
use crate::geometry::{RayGrid, Upstream};

/// Pixels of the body's rectangle for each face, at most. Where faces cover more, quotients at once are quicker than depths that
/// are gone through again.
pub const MOST_PIXELS: usize = 16;

/// Stands for no depth: those are no less than 0. Alike for both ways, so that the length between is 0.
const UNSET: f64 = -1.0;

/// The depths of a block's rays where they enter and where they leave. Unset between blocks.
#[derive(Default)]
pub struct Depths {
    /// Those of the entries, row by row, then those of the exits.
    planes: Vec<f64>,
    /// The block's first column and row.
    first: [i32; 2],
    /// From row to row: lanes may reach beyond the block on either side.
    pitch: usize,
    /// Depths of a way.
    plane: usize,
    is_any_set: bool,
}

impl Depths {
    /// Begins a block. All depths are unset then, whatever the shape of the last.
    fn begin(&mut self, block: &Pixels) {
        self.first = [block.columns.start, block.rows.start];
        self.pitch = block.columns.len() + 2 * LANES;
        self.plane = self.pitch * block.rows.len();
        self.planes.resize(2 * self.plane, UNSET);
    }

    /// Where the depth of an entry stands: of one of the block's pixels, or up to `LANES` columns off it.
    #[inline(always)]
    fn entry_at(&self, row: i32, column: i32) -> usize {
        (row - self.first[1]) as usize * self.pitch + (column - self.first[0] + LANES as i32) as usize
    }

    #[inline(always)]
    fn at(&self, way: Way, row: i32, column: i32) -> usize {
        self.entry_at(row, column) + if way == Way::Out { self.plane } else { 0 }
    }

    /// The same of all pixels.
    fn shelf(&self) -> Shelf {
        let [first_column, first_row] = self.first.map(f64::from);
        let pitch = self.pitch as f64;
        Shelf { origin: LANES as f64 - first_column - first_row * pitch, pitch, plane: self.plane as f64 }
    }

    /// The pixel whose depth stands there.
    fn pixel_at(&self, at: usize) -> [i32; 2] {
        let at = at % self.plane;
        let (row, column) = ((at / self.pitch) as i32, (at % self.pitch) as i32 - LANES as i32);
        [self.first[0] + column, self.first[1] + row]
    }

    fn unset(&mut self, row: i32, column: i32) {
        for way in [Way::In, Way::Out] {
            let at = self.at(way, row, column);
            self.planes[at] = UNSET;
        }
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

impl Tracer<'_, '_> {
    /// Traces a block of a convex body seen from without.
    #[inline(always)]
    pub fn trace_block_of_chords<const CONE: bool, S: Simd, R: Record>(
        &mut self,
        simd: S,
        block: &Pixels,
        record: &mut R,
    ) {
        self.work.block.depths.begin(block);
        self.each_patch::<CONE, true>(
            block,
            #[inline(always)]
            |tracer, patch| {
                tracer.mark_small(simd, patch, block);
                tracer.each_face_of(
                    patch,
                    #[inline(always)]
                    |tracer, face| tracer.mark(simd, face, block),
                );
            },
        );
        if !self.work.block.edge_on.is_empty() {
            edge_on::sort(&mut self.work.block.edge_on);
            for e in &self.work.block.edge_on {
                self.work.block.depths.unset(e.row, e.column);
            }
            self.trace_edge_on(record);
        }
        if std::mem::take(&mut self.work.block.depths.is_any_set) {
            self.report_chords::<CONE, R>(block, record);
        }
    }

    /// Marks the depths of a face at the pixels it covers.
    #[inline(always)]
    fn mark<S: Simd>(&mut self, simd: S, face: &SeenFace, block: &Pixels) {
        let slope = self.slope_of(face, block);
        self.work.block.depths.is_any_set = true;
        let pixels = self.work.aspect.pixels(face.face).intersection(block);
        self.mark_rows(simd, face, &slope, &pixels);
    }

    /// Marks the depths of the small faces of a patch.
    #[inline(always)]
    fn mark_small<S: Simd>(&mut self, simd: S, patch: &SeenPatch, block: &Pixels) {
        let Workspace { aspect, small, block: Block { depths, edge_on, .. }, .. } = &mut *self.work;
        let is_mirrored = self.seen.projection.is_mirrored();
        small.find(simd, aspect, patch.numbers.len(), block, &depths.shelf(), is_mirrored);
        depths.is_any_set |= !small.marks().is_empty();
        for mark in small.marks() {
            let old = &mut depths.planes[mark.at as usize];
            let is_twice = *old >= 0.0;
            *old = greater(mark.depth, *old);
            if is_twice {
                let [column, row] = depths.pixel_at(mark.at as usize);
                edge_on.push(EdgeOn { row, column, face: patch.numbers[mark.face as usize] });
            }
        }
        if !self.work.small.in_doubt.is_empty() {
            self.mark_in_doubt(simd, patch);
        }
    }

    /// Marks single pixels by exact signs.
    #[cold]
    #[inline(never)]
    fn mark_in_doubt<S: Simd>(&mut self, simd: S, patch: &SeenPatch) {
        self.work.block.depths.is_any_set = true;
        for [face, x, y] in std::mem::take(&mut self.work.small.in_doubt) {
            let (face, slope) = (face as usize, self.work.aspect.slope(face as usize));
            let Pixels { columns, rows } = self.work.aspect.pixels(face);
            let (column, row) = (columns.start + x as i32, rows.start + y as i32);
            let pixel = Pixels { columns: column..column + 1, rows: row..row + 1 };
            self.mark_rows(simd, &patch.face(face), &slope, &pixel);
        }
    }

    /// Marks rows of pixels, from edge to edge, but only `pixels`, which are in the block.
    #[inline(always)]
    fn mark_rows<S: Simd>(&mut self, simd: S, face: &SeenFace, slope: &Slope, pixels: &Pixels) {
        let corners = [0, 1, 2].map(|corner| self.work.aspect.corner(face.face, corner));
        let is_even = self.work.rows.find(simd, &corners, pixels, self.seen.crossing_error);
        let is_right_out = is_even != self.seen.projection.is_mirrored();
        for (i, row) in pixels.rows.clone().enumerate() {
            let Covered { start, count, is_long_left } = self.work.rows.covered(i);
            if count <= 0 {
                continue;
            }
            let of_row = slope.row(row);
            let way = if is_long_left == is_right_out { Way::Out } else { Way::In };
            let groups = (count as usize).div_ceil(S::F64_LANES);
            let at = self.work.block.depths.at(way, row, start);
            let depths = &mut self.work.block.depths.planes[at..at + groups * S::F64_LANES];
            let mut lanes = simd.add_f64s(simd.splat_f64s(f64::from(start)), first_lanes(simd));
            let end = simd.splat_f64s(f64::from(start + count));
            for (group, old) in S::as_mut_simd_f64s(depths).0.iter_mut().enumerate() {
                let is_before_end = simd.less_than_f64s(lanes, end);
                let is_twice = set(simd, old, slope.depths(simd, of_row, lanes), is_before_end);
                if is_any(simd, is_twice) {
                    let column = start + (group * S::F64_LANES) as i32;
                    note_twice(simd, &mut self.work.block.edge_on, face.number, [column, row], is_twice);
                }
                lanes = simd.add_f64s(lanes, simd.splat_f64s(S::F64_LANES as f64));
            }
        }
    }

    /// Reports all rays of the block, and leaves the depths unset.
    #[inline(always)]
    fn report_chords<const CONE: bool, R: Record>(&mut self, block: &Pixels, record: &mut R) {
        let (mut lengths, mut entries, mut exits) = ([0.0; RUN], [0.0; RUN], [0.0; RUN]);
        for row in block.rows.clone() {
            for start in block.columns.clone().step_by(RUN) {
                let count = RUN.min((block.columns.end - start) as usize);
                let at = self.work.block.depths.entry_at(row, start);
                let ray = self.ray(row, start);
                let plane = self.work.block.depths.plane;
                let (first, second) = self.work.block.depths.planes.split_at_mut(plane);
                let (ins, outs) = (&mut first[at..at + count], &mut second[at..at + count]);
                // By bits, as the greatest of many doubles is found one after the other.
                let set = ins.iter().fold(0, |set, depth| set | (depth.to_bits() ^ UNSET.to_bits()));
                if set == 0 {
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

/// The lengths of rays in a row: to the last bit those of their segments.
#[inline(always)]
pub fn measure(grid: &RayGrid, row: i32, first: i32, lengths: &mut [f64]) {
    let source = match grid.upstream() {
        Upstream::Path(path) => return lengths.fill(path.length()),
        Upstream::Source(source) => source,
    };
    // Coordinate by coordinate as the grid has it, in the same order, for many rays at a time.
    let ([by_column, by_row], origin) = (grid.steps(), grid.origin());
    let of_row = f64::from(row) * by_row;
    for (i, length) in lengths.iter_mut().enumerate() {
        let column = f64::from(first + i as i32);
        let x = origin.x + column * by_column.x + of_row.x - source.x;
        let y = origin.y + column * by_column.y + of_row.y - source.y;
        let z = origin.z + column * by_column.z + of_row.z - source.z;
        *length = (x * x + y * y + z * z).sqrt();
    }
}
