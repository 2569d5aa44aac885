//! A region, block by block: first what each face covers, then the crossings there.
//!
//! Two rounds, as a ray in the plane of one face must be known before any other face reports a crossing of it. And what
//! faces cover is then a list without gaps, gone through without a surprise at each face.

use std::ops::Range;

use super::RasterView;
use super::aspect::Aspect;
use super::chords::{Depths, measure};
use super::edge_on::{self, EdgeOn, is_edge_on, is_listed, pixels_along};
use super::face::{Edge, Slope, order};
use super::patches::Patch;
use super::pixels::Pixels;
use super::projection::Place;
use super::seen::Seen;
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
    pub block: Block,
    aspect: Aspect,
    /// Patches near a row of blocks, and near a block.
    near: [Vec<u32>; 2],
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

/// What is known of a block. Empty between blocks.
#[derive(Default)]
pub struct Block {
    /// Of the rays, mm.
    lengths: Vec<f64>,
    faces: Vec<Face>,
    /// The first `span_count` are in use.
    spans: Vec<Span>,
    span_count: usize,
    /// Rays to be traced by themselves.
    pub edge_on: Vec<EdgeOn>,
    pub depths: Depths,
}

/// A face that may cover pixels of a block.
pub struct SeenFace {
    /// In the surface.
    pub number: u32,
    pub places: [Place; 3],
    /// From the least ceiling of its corners' columns to the greatest.
    pub columns: Range<i32>,
    /// Ceilings of the corners' rows.
    pub rows: [i32; 3],
    /// The least, the middle and the greatest of them.
    pub first_row: i32,
    pub turn: i32,
    pub last_row: i32,
    /// The rows that are in the block.
    pub within: Range<i32>,
    /// Whether the pixels on it are listed if it is edge-on.
    is_known: bool,
}

/// A face whose spans are listed.
struct Face {
    slope: Slope,
    number: u32,
}

/// The pixels of a row that a face covers, each end reckoned in the block's columns.
#[derive(Clone, Copy, Default)]
struct Span {
    face: u32,
    row: i32,
    start: i16,
    end: i16,
    is_out: bool,
}

impl<'v, 'a> Tracer<'v, 'a> {
    pub fn new(view: &'v RasterView<'a>, seen: &'v Seen<'a>, region: &Region) -> Self {
        // A grid of more than 2³⁰ columns or rows is not seen.
        let pixels = |range: &Range<u32>| range.start as i32..range.end as i32;
        let asked = Pixels { columns: pixels(&region.columns), rows: pixels(&region.rows) };
        Self {
            view,
            seen,
            asked,
            block: Block::default(),
            aspect: Aspect::default(),
            near: Default::default(),
        }
    }

    /// Traces it all, with the widest instructions that the machine has. None of them changes a bit: every operation is
    /// rounded by itself.
    pub fn trace(&mut self, record: &mut impl Record) {
        crate::dispatch::arch().dispatch(Widely { tracer: self, record });
    }

    #[inline(always)]
    fn trace_blocks<S: pulp::Simd, R: Record>(&mut self, simd: S, record: &mut R) {
        let is_by_chords = self.view.is_convex && !self.seen.source_is_inside && !R::ASKS_FACES;
        let common = self.asked.intersection(&self.seen.bounds);
        for top in common.rows.clone().step_by(BLOCK_ROWS as usize) {
            let rows = top..(top + BLOCK_ROWS).min(common.rows.end);
            let [near_rows, _] = &mut self.near;
            self.seen.list_near(
                &Pixels { columns: common.columns.clone(), rows: rows.clone() },
                None,
                near_rows,
            );
            for left in common.columns.clone().step_by(BLOCK_COLUMNS as usize) {
                let columns = left..(left + BLOCK_COLUMNS).min(common.columns.end);
                let block = Pixels { columns, rows: rows.clone() };
                let [near_rows, near] = &mut self.near;
                self.seen.list_near(&block, Some(near_rows), near);
                match (is_by_chords, self.seen.projection.is_cone()) {
                    (true, true) => self.trace_block_of_chords::<true, S, R>(simd, &block, record),
                    (true, false) => self.trace_block_of_chords::<false, S, R>(simd, &block, record),
                    (false, true) => self.trace_block::<true>(&block, record),
                    (false, false) => self.trace_block::<false>(&block, record),
                }
            }
        }
    }

    #[inline(always)]
    fn trace_block<const CONE: bool>(&mut self, block: &Pixels, record: &mut impl Record) {
        self.block.faces.clear();
        self.block.span_count = 0;
        self.cover::<CONE>(block);
        if self.block.span_count > 0 {
            self.measure_rays(block);
        }
        if !self.block.edge_on.is_empty() {
            edge_on::sort(&mut self.block.edge_on);
            self.trace_edge_on(record);
        }
        if self.seen.source_is_inside {
            self.start_inside(block, record);
        }
        let mut t_mm = [0.0; RUN];
        for span in &self.block.spans[..self.block.span_count] {
            if self.block.edge_on.is_empty() {
                self.report::<CONE>(span, block, &mut t_mm, record);
            } else {
                self.report_but_edge_on::<CONE>(span, block, &mut t_mm, record);
            }
        }
    }

    /// Goes through the faces that may cover pixels of the block, and begins the list of rays to be traced by themselves with
    /// those that lie in the faces of patches on a line of pixels.
    #[inline(always)]
    pub fn each_face(&mut self, block: &Pixels, mut each: impl FnMut(&mut Self, &SeenFace)) {
        self.block.edge_on.clear();
        let near = std::mem::take(&mut self.near[1]);
        let seen = self.seen;
        for &patch_number in &near {
            let patch = seen.patches.get(patch_number as usize);
            self.aspect.look_at(&patch, &seen.projection, seen.patches.are_places());
            let is_on_a_line = seen.sight(patch_number).is_on_a_line;
            if is_on_a_line {
                self.look_along(&patch, block);
            }
            for (corners, &number) in patch.corners.iter().zip(patch.numbers) {
                let ceilings = corners.map(|corner| self.aspect.ceilings(corner));
                let columns = ceilings.map(|[column, _]| column);
                let rows = ceilings.map(|[_, row]| row);
                let ([left, _, right], [first_row, turn, last_row]) = (sorted(columns), sorted(rows));
                let within = first_row.max(block.rows.start)..last_row.min(block.rows.end);
                if within.is_empty() || left >= block.columns.end || right <= block.columns.start {
                    continue;
                }
                let places = corners.map(|corner| self.aspect.place(corner));
                let face = SeenFace {
                    number,
                    places,
                    columns: left..right,
                    rows,
                    first_row,
                    turn,
                    last_row,
                    within,
                    is_known: is_on_a_line,
                };
                each(self, &face);
            }
        }
        self.near[1] = near;
    }

    /// Lists the pixels on edge-on faces of the patch that is looked at.
    #[cold]
    #[inline(never)]
    fn look_along(&mut self, patch: &Patch, block: &Pixels) {
        for (corners, &number) in patch.corners.iter().zip(patch.numbers) {
            let places = corners.map(|corner| self.aspect.place(corner));
            if is_edge_on(places, self.seen.place_error) {
                pixels_along(places, number, self.seen.place_error, block, &mut self.block.edge_on);
            }
        }
    }

    /// Lists the faces and what they cover.
    #[inline(always)]
    fn cover<const CONE: bool>(&mut self, block: &Pixels) {
        self.each_face(block, |tracer, face| tracer.cover_by::<CONE>(face, block));
    }

    #[inline(always)]
    fn cover_by<const CONE: bool>(&mut self, face: &SeenFace, block: &Pixels) {
        let seen = self.seen;
        let (start, end) = (face.within.start, face.within.end);
        let (rows, turn) = (face.rows, face.turn);
        let [a, b, c] = face.places.each_ref();
        let (order, is_even) = order(rows);
        let [low, mid, high] = order.map(|i| &face.places[i]);
        let (long, below, above) = (Edge::new(low, high), Edge::new(low, mid), Edge::new(mid, high));
        let is_right_out = is_even != seen.projection.is_mirrored();
        let slot = self.block.faces.len() as u32;
        let block_spans = &mut self.block;
        let needed = block_spans.span_count + (end - start) as usize;
        if block_spans.spans.len() < needed {
            block_spans.spans.resize(2 * needed, Span::default());
        }
        let mut count = block_spans.span_count;
        for row in start..end {
            let by_long = long.first_right(row, seen.crossing_error);
            let short = if row < turn { below } else { above };
            let by_short = short.first_right(row, seen.crossing_error);
            let start = by_long.min(by_short).max(block.columns.start);
            let end = by_long.max(by_short).min(block.columns.end);
            // Written in any case: that is faster than to ask whether there is something to write.
            block_spans.spans[count] = Span {
                face: slot,
                row,
                start: (start - block.columns.start) as i16,
                end: (end - block.columns.start) as i16,
                is_out: (by_long < by_short) == is_right_out,
            };
            count += usize::from(start < end);
        }
        block_spans.span_count = count;
        // Of the whole way, from the source to the pixel: shares from 0 to 1.
        let limits = if CONE { [1.0, f64::INFINITY] } else { [0.0, 1.0] };
        let (mut slope, is_sure) = Slope::new([a, b, c], seen.care, limits);
        if !is_sure {
            slope = self.look_closely(face, limits, block);
        }
        self.block.faces.push(Face { slope, number: face.number });
    }

    /// The slope of a face that needs care. Lists the pixels on it if it is edge-on, and those it covers if its depth there
    /// cannot be told.
    #[cold]
    #[inline(never)]
    pub fn look_closely(&mut self, face: &SeenFace, limits: [f64; 2], block: &Pixels) -> Slope {
        let place_error = self.seen.place_error;
        if !face.is_known && is_edge_on(face.places, place_error) {
            pixels_along(face.places, face.number, place_error, block, &mut self.block.edge_on);
        }
        let (slope, is_right) = Slope::careful(face.places, self.seen.care, limits);
        if !is_right {
            self.list_covered(face, block);
        }
        slope
    }

    /// Lists the pixels that a face covers.
    #[cold]
    fn list_covered(&mut self, face: &SeenFace, block: &Pixels) {
        let [low, mid, high] = order(face.rows).0.map(|i| &face.places[i]);
        let (long, below, above) = (Edge::new(low, high), Edge::new(low, mid), Edge::new(mid, high));
        for row in face.within.clone() {
            let short = if row < face.turn { below } else { above };
            let ends = [long, short].map(|edge| edge.first_right(row, self.seen.crossing_error));
            let start = ends[0].min(ends[1]).max(block.columns.start);
            let end = ends[0].max(ends[1]).min(block.columns.end);
            let pixel = |column| EdgeOn { row, column, face: face.number };
            self.block.edge_on.extend((start..end).map(pixel));
        }
    }

    /// The lengths of the block's rays.
    #[inline(always)]
    fn measure_rays(&mut self, block: &Pixels) {
        let (lengths, columns) = (&mut self.block.lengths, block.columns.len());
        lengths.resize(columns * block.rows.len(), 0.0);
        for (row, lengths) in block.rows.clone().zip(lengths.chunks_exact_mut(columns)) {
            measure(&self.view.grid, row, block.columns.start, lengths);
        }
    }

    /// Traces the rays that are to be traced by themselves.
    #[cold]
    pub fn trace_edge_on(&self, record: &mut impl Record) {
        for e in &self.block.edge_on {
            let pixel = [e.column as u32, e.row as u32];
            self.view.trace_ray(self.ray(e.row, e.column), pixel, record);
        }
    }

    /// Reports that all other rays start inside.
    #[cold]
    fn start_inside(&self, block: &Pixels, record: &mut impl Record) {
        for row in block.rows.clone() {
            for column in block.columns.clone().filter(|&c| !is_listed(&self.block.edge_on, row, c)) {
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
        let Face { slope, number } = &self.block.faces[span.face as usize];
        let (start, end) = (span.start as usize, span.end as usize);
        let of_row = slope.row(span.row);
        let first = (span.row - block.rows.start) as usize * block.columns.len();
        let lengths = &self.block.lengths[first + start..first + end];
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
            if is_listed(&self.block.edge_on, span.row, block.columns.start + i32::from(column)) {
                let part = Span { end: column, ..rest };
                self.report::<CONE>(&part, block, t_mm, record);
                rest.start = column + 1;
            }
        }
        self.report::<CONE>(&rest, block, t_mm, record);
    }
}

/// Three numbers from the least to the greatest.
#[inline(always)]
pub fn sorted([a, b, c]: [i32; 3]) -> [i32; 3] {
    let (low, high) = (a.min(b), a.max(b));
    [low.min(c), low.max(high.min(c)), high.max(c)]
}
