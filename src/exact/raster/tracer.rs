//! A region, block by block: first what each face covers, then the crossings there.
//!
//! Two rounds, as a ray in the plane of one face must be known before any other face reports a crossing of it. And what
//! faces cover is then a list without gaps, gone through without a surprise at each face.

use std::ops::Range;

use super::RasterView;
use super::chords::measure;
use super::edge_on::{self, EdgeOn, is_edge_on, is_listed, pixels_along};
use super::face::Slope;
use super::patches::Patch;
use super::pixels::Pixels;
use super::projection::Place;
use super::rows::Covered;
use super::seen::Seen;
use super::stretches;
use super::workspace::{Face, Span, Workspace};
use crate::exact::record::{Record, Way};
use crate::geometry::Region;

/// A region is traced in blocks whose lists stay in the cache.
pub const BLOCK_COLUMNS: i32 = 128;
pub const BLOCK_ROWS: i32 = 64;

/// Crossings reported at a time.
pub const RUN: usize = 64;

/// Traces a region.
pub struct Tracer<'v, 'a> {
    pub view: &'v RasterView<'a>,
    pub seen: &'v Seen<'a>,
    asked: Pixels,
    pub work: Box<Workspace>,
}

/// A tracer at work.
struct Widely<'t, 'v, 'a, R> {
    tracer: &'t mut Tracer<'v, 'a>,
    record: &'t mut R,
}

impl<R: Record> pulp::WithSimd for Widely<'_, '_, '_, R> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) {
        self.tracer.trace_blocks(simd, self.record);
    }
}

/// A face that may cover pixels of a block.
pub struct SeenFace {
    /// In the patch that is looked at.
    pub face: usize,
    /// In the surface.
    pub number: u32,
    /// Between which depths are kept.
    limits: [f64; 2],
    /// Whether the pixels on it are listed if it is edge-on.
    is_known: bool,
}

/// A patch some of whose faces may cover pixels of a block.
pub struct SeenPatch<'p> {
    /// Of the faces, in the surface.
    pub numbers: &'p [u32],
    limits: [f64; 2],
    is_known: bool,
}

impl SeenPatch<'_> {
    #[inline(always)]
    pub fn face(&self, face: usize) -> SeenFace {
        SeenFace { face, number: self.numbers[face], limits: self.limits, is_known: self.is_known }
    }
}

/// A face of a block whose rows were found.
pub struct FaceRows {
    /// Its place among the block's faces.
    pub slot: u32,
    /// The pixels of the block that it may cover.
    pub pixels: Pixels,
    /// Whether rays leave through it where its long edge is on the left, and enter where it is on the right.
    pub is_right_out: bool,
}

/// How the rays of a block are traced.
#[derive(Clone, Copy, PartialEq, Eq)]
enum By {
    /// Any body: each crossing by itself.
    Crossings,
    /// A convex body of small faces seen from without: see `chords`.
    Chords,
    /// One of large faces: see `stretches`.
    Stretches,
}

impl<'v, 'a> Tracer<'v, 'a> {
    pub fn new(view: &'v RasterView<'a>, seen: &'v Seen<'a>, region: &Region) -> Self {
        // A grid of more than 2³⁰ columns or rows is not seen.
        let pixels = |range: &Range<u32>| range.start as i32..range.end as i32;
        let asked = Pixels { columns: pixels(&region.columns), rows: pixels(&region.rows) };
        Self { view, seen, asked, work: view.workspaces.take() }
    }

    /// Traces it all, with the widest instructions that the machine has. None of them changes a bit: every operation is
    /// rounded by itself.
    pub fn trace(mut self, record: &mut impl Record) {
        crate::dispatch::arch().dispatch(Widely { tracer: &mut self, record });
        self.view.workspaces.give_back(self.work);
    }

    #[inline(always)]
    fn trace_blocks<S: pulp::Simd, R: Record>(&mut self, simd: S, record: &mut R) {
        let is_simple = self.view.is_convex && !self.seen.source_is_inside && !R::ASKS_FACES;
        let by = match (is_simple, self.seen.is_fine) {
            (true, true) => By::Chords,
            (true, false) => By::Stretches,
            (false, _) => By::Crossings,
        };
        let block_columns = if by == By::Stretches { stretches::BLOCK_COLUMNS } else { BLOCK_COLUMNS };
        let common = self.asked.intersection(&self.seen.bounds);
        for top in common.rows.clone().step_by(BLOCK_ROWS as usize) {
            let rows = top..(top + BLOCK_ROWS).min(common.rows.end);
            let [near_rows, _] = &mut self.work.near;
            self.seen.list_near(
                &Pixels { columns: common.columns.clone(), rows: rows.clone() },
                None,
                near_rows,
            );
            for left in common.columns.clone().step_by(block_columns as usize) {
                let columns = left..(left + block_columns).min(common.columns.end);
                let block = Pixels { columns, rows: rows.clone() };
                let [near_rows, near] = &mut self.work.near;
                self.seen.list_near(&block, Some(near_rows), near);
                if near.is_empty() && !self.seen.source_is_inside {
                    continue;
                }
                match (by, self.seen.projection.is_cone()) {
                    (By::Chords, true) => self.trace_block_of_chords::<true, S, R>(simd, &block, record),
                    (By::Chords, false) => self.trace_block_of_chords::<false, S, R>(simd, &block, record),
                    (By::Stretches, true) => {
                        self.trace_block_of_stretches::<true, S, R>(simd, &block, record)
                    }
                    (By::Stretches, false) => {
                        self.trace_block_of_stretches::<false, S, R>(simd, &block, record)
                    }
                    (By::Crossings, true) => self.trace_block::<true, S>(simd, &block, record),
                    (By::Crossings, false) => self.trace_block::<false, S>(simd, &block, record),
                }
            }
        }
    }

    #[inline(always)]
    fn trace_block<const CONE: bool, S: pulp::Simd>(
        &mut self,
        simd: S,
        block: &Pixels,
        record: &mut impl Record,
    ) {
        self.cover::<CONE, S>(simd, block);
        if self.work.block.span_count > 0 {
            self.measure_rays(block);
        }
        if !self.work.block.edge_on.is_empty() {
            edge_on::sort(&mut self.work.block.edge_on);
            self.trace_edge_on(record);
        }
        if self.seen.source_is_inside {
            self.start_inside(block, record);
        }
        let mut t_mm = [0.0; RUN];
        for span in self.work.block.spans() {
            if self.work.block.edge_on.is_empty() {
                self.report::<CONE>(span, block, &mut t_mm, record);
            } else {
                self.report_but_edge_on::<CONE>(span, block, &mut t_mm, record);
            }
        }
    }

    /// Goes through the faces that may cover pixels of the block, and begins the list of rays to be traced by themselves.
    #[inline(always)]
    pub fn each_face<const CONE: bool>(
        &mut self,
        block: &Pixels,
        mut each: impl FnMut(&mut Self, &SeenFace),
    ) {
        self.each_patch::<CONE, false>(
            block,
            #[inline(always)]
            |tracer, patch| {
                // Not lent: a function that is called through a reference has to do without the wide instructions.
                tracer.each_face_of(
                    patch,
                    #[inline(always)]
                    |tracer, face| each(tracer, face),
                );
            },
        );
    }

    /// Goes through the patches that may cover pixels of the block once their faces were looked at, and begins the list of rays
    /// to be traced by themselves with those that lie in the faces of patches on a line of pixels. Small faces are told
    /// apart if asked.
    #[inline(always)]
    pub fn each_patch<const CONE: bool, const PART_SMALL: bool>(
        &mut self,
        block: &Pixels,
        mut each: impl FnMut(&mut Self, &SeenPatch),
    ) {
        self.work.block.edge_on.clear();
        let near = std::mem::take(&mut self.work.near[1]);
        let seen = self.seen;
        // Of the whole way, from the source to the pixel: shares from 0 to 1.
        let limits = if CONE { [1.0, f64::INFINITY] } else { [0.0, 1.0] };
        for &patch_number in &near {
            let patch = seen.patches.get(patch_number as usize);
            self.work.aspect.place_points(&patch, &seen.projection, seen.patches.are_places());
            let is_known = seen.sight(patch_number).is_on_a_line;
            if is_known {
                self.look_along(&patch, block);
            }
            self.work.aspect.look_at_faces::<PART_SMALL>(&patch, block, seen.care, limits);
            each(self, &SeenPatch { numbers: patch.numbers, limits, is_known });
        }
        self.work.near[1] = near;
    }

    /// Goes through the faces of the patch that is looked at.
    #[inline(always)]
    pub fn each_face_of(&mut self, patch: &SeenPatch, mut each: impl FnMut(&mut Self, &SeenFace)) {
        for i in 0..self.work.aspect.near_count() {
            let face = self.work.aspect.near(i);
            each(self, &patch.face(face));
        }
    }

    /// Lists the pixels on edge-on faces of the patch that is looked at.
    #[cold]
    #[inline(never)]
    fn look_along(&mut self, patch: &Patch, block: &Pixels) {
        for (corners, &number) in patch.corners.iter().zip(patch.numbers) {
            let places = corners.map(|corner| self.work.aspect.place_of_point(corner));
            if is_edge_on(places, self.seen.place_error) {
                pixels_along(places, number, self.seen.place_error, block, &mut self.work.block.edge_on);
            }
        }
    }

    /// Lists the faces and what they cover.
    #[inline(always)]
    pub fn cover<const CONE: bool, S: pulp::Simd>(&mut self, simd: S, block: &Pixels) {
        self.work.block.faces.clear();
        self.work.block.span_count = 0;
        self.each_face::<CONE>(
            block,
            #[inline(always)]
            |tracer, face| tracer.cover_by(simd, face, block),
        );
    }

    #[inline(always)]
    fn cover_by<S: pulp::Simd>(&mut self, simd: S, face: &SeenFace, block: &Pixels) {
        let FaceRows { slot, pixels, is_right_out } = self.find_rows(simd, face, block);
        let block_spans = &mut self.work.block;
        let needed = block_spans.span_count + pixels.rows.len();
        if block_spans.spans.len() < needed {
            block_spans.spans.resize(2 * needed, Span::default());
        }
        let mut count = block_spans.span_count;
        for (i, row) in pixels.rows.enumerate() {
            let Covered { start, count: covered, is_long_left } = self.work.rows.covered(i);
            // Written in any case: that is faster than to ask whether there is something to write.
            block_spans.spans[count] = Span {
                face: slot,
                row,
                start: (start - block.columns.start) as i16,
                end: (start - block.columns.start + covered) as i16,
                is_out: is_long_left == is_right_out,
            };
            count += usize::from(covered > 0);
        }
        block_spans.span_count = count;
    }

    /// Adds a face to the block's, and finds the pixels that it covers, row by row.
    #[inline(always)]
    pub fn find_rows<S: pulp::Simd>(&mut self, simd: S, face: &SeenFace, block: &Pixels) -> FaceRows {
        let slope = self.slope_of(face, block);
        let pixels = self.work.aspect.pixels(face.face).intersection(block);
        let corners = [0, 1, 2].map(|corner| self.work.aspect.corner(face.face, corner));
        let is_even = self.work.rows.find(simd, &corners, &pixels, self.seen.crossing_error);
        let is_right_out = is_even != self.seen.projection.is_mirrored();
        let slot = self.work.block.faces.len() as u32;
        self.work.block.faces.push(Face { slope, number: face.number });
        FaceRows { slot, pixels, is_right_out }
    }

    /// The slope of a face.
    #[inline(always)]
    pub fn slope_of(&mut self, face: &SeenFace, block: &Pixels) -> Slope {
        if self.work.aspect.is_sure(face.face) {
            self.work.aspect.slope(face.face)
        } else {
            self.look_closely(face, block)
        }
    }

    /// The slope of a face that needs care. Lists the pixels on it if it is edge-on, and those it covers if its depth there
    /// cannot be told.
    #[cold]
    #[inline(never)]
    fn look_closely(&mut self, face: &SeenFace, block: &Pixels) -> Slope {
        let place_error = self.seen.place_error;
        let places = [0, 1, 2].map(|corner| self.work.aspect.corner(face.face, corner));
        if !face.is_known && is_edge_on(places, place_error) {
            pixels_along(places, face.number, place_error, block, &mut self.work.block.edge_on);
        }
        let (slope, is_right) = Slope::careful(places, self.seen.care, face.limits);
        if !is_right {
            let pixels = self.work.aspect.pixels(face.face).intersection(block);
            self.list_covered(&places, face.number, &pixels);
        }
        slope
    }

    /// Lists those of some pixels that a face covers.
    #[cold]
    fn list_covered(&mut self, corners: &[Place; 3], face: u32, pixels: &Pixels) {
        self.work.rows.find_one_by_one(corners, pixels, self.seen.crossing_error);
        for (i, row) in pixels.rows.clone().enumerate() {
            let Covered { start, count, .. } = self.work.rows.covered(i);
            let pixel = |column| EdgeOn { row, column, face };
            self.work.block.edge_on.extend((start..start + count).map(pixel));
        }
    }

    /// The lengths of the block's rays.
    #[inline(always)]
    fn measure_rays(&mut self, block: &Pixels) {
        let (lengths, columns) = (&mut self.work.block.lengths, block.columns.len());
        lengths.resize(columns * block.rows.len(), 0.0);
        for (row, lengths) in block.rows.clone().zip(lengths.chunks_exact_mut(columns)) {
            measure(&self.view.grid, row, block.columns.start, lengths);
        }
    }

    /// Traces the rays that are to be traced by themselves.
    #[cold]
    pub fn trace_edge_on(&self, record: &mut impl Record) {
        for e in &self.work.block.edge_on {
            let pixel = [e.column as u32, e.row as u32];
            self.view.trace_ray(self.ray(e.row, e.column), pixel, record);
        }
    }

    /// Reports that all other rays start inside.
    #[cold]
    fn start_inside(&self, block: &Pixels, record: &mut impl Record) {
        for row in block.rows.clone() {
            for column in block.columns.clone().filter(|&c| !is_listed(&self.work.block.edge_on, row, c)) {
                record.crossing(self.ray(row, column), 0.0, 0, Way::In);
            }
        }
    }

    /// The ray's number in the region asked for.
    #[inline(always)]
    pub fn ray(&self, row: i32, column: i32) -> usize {
        (row - self.asked.rows.start) as usize * self.asked.columns.len()
            + (column - self.asked.columns.start) as usize
    }

    #[inline(always)]
    fn report<const CONE: bool>(
        &self,
        span: &Span,
        block: &Pixels,
        t_mm: &mut [f64; RUN],
        record: &mut impl Record,
    ) {
        let Face { slope, number } = &self.work.block.faces[span.face as usize];
        let (start, end) = (span.start as usize, span.end as usize);
        let of_row = slope.row(span.row);
        let first = (span.row - block.rows.start) as usize * block.columns.len();
        let lengths = &self.work.block.lengths[first + start..first + end];
        let column = block.columns.start + i32::from(span.start);
        let ray = self.ray(span.row, column);
        let way = if span.is_out { Way::Out } else { Way::In };
        let at = |column: i32, length: f64| {
            let depth = slope.depth(of_row, f64::from(column));
            if CONE { length / depth } else { length * depth }
        };
        if lengths.len() < 4 {
            for (i, &length) in lengths.iter().enumerate() {
                record.crossing(ray + i, at(column + i as i32, length), *number, way);
            }
            return;
        }
        for (i, lengths) in lengths.chunks(RUN).enumerate() {
            let column = column + (i * RUN) as i32;
            let t_mm = &mut t_mm[..lengths.len()];
            for (j, (t, &length)) in t_mm.iter_mut().zip(lengths).enumerate() {
                *t = at(column + j as i32, length);
            }
            record.run(ray + i * RUN, t_mm, *number, way);
        }
    }

    /// All but the rays in the list.
    #[cold]
    fn report_but_edge_on<const CONE: bool>(
        &self,
        span: &Span,
        block: &Pixels,
        t_mm: &mut [f64; RUN],
        record: &mut impl Record,
    ) {
        let mut rest = *span;
        for column in span.start..span.end {
            if is_listed(&self.work.block.edge_on, span.row, block.columns.start + i32::from(column)) {
                let part = Span { end: column, ..rest };
                self.report::<CONE>(&part, block, t_mm, record);
                rest.start = column + 1;
            }
        }
        self.report::<CONE>(&rest, block, t_mm, record);
    }
}
