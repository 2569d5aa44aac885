//! A region, block by block: first what each face covers, then the crossings there.
//!
//! Two rounds, as a ray in the plane of one face must be known before any other face reports a crossing of it. And what
//! faces cover is then a list without gaps, gone through without a surprise at each face.

use std::ops::Range;

use super::cells::{CellFace, Pixels};
use super::edge_on::{self, EdgeOn, is_edge_on, is_listed, pixels_along};
use super::face::{Edge, Slope, order};
use super::{RasterView, Seen, round};
use crate::exact::record::{Record, Way};
use crate::geometry::{Region, Upstream};

/// A region is traced in blocks whose lists stay in the cache.
const BLOCK_COLUMNS: i32 = 128;
const BLOCK_ROWS: i32 = 64;

/// Crossings reported at a time.
const RUN: usize = 64;

/// Traces a region.
pub struct Tracer<'v, 'a> {
    view: &'v RasterView<'a>,
    seen: &'v Seen,
    asked: Pixels,
    block: Block,
}

/// A tracer at work.
struct Widely<'t, 'v, 'a, R> {
    tracer: &'t mut Tracer<'v, 'a>,
    record: &'t mut R,
}

impl<R: Record> pulp::WithSimd for Widely<'_, '_, '_, R> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        self.tracer.trace_blocks(self.record);
    }
}

/// What is known of a block. Empty between blocks.
#[derive(Default)]
struct Block {
    /// Of the rays, mm.
    lengths: Vec<f64>,
    faces: Vec<Face>,
    /// The first `span_count` are in use.
    spans: Vec<Span>,
    span_count: usize,
    edge_on: Vec<EdgeOn>,
}

/// A face that may cover pixels.
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
    pub fn new(view: &'v RasterView<'a>, seen: &'v Seen, region: &Region) -> Self {
        // A grid of more than 2³⁰ columns or rows is not seen.
        let pixels = |range: &Range<u32>| range.start as i32..range.end as i32;
        let asked = Pixels { columns: pixels(&region.columns), rows: pixels(&region.rows) };
        Self { view, seen, asked, block: Block::default() }
    }

    /// Traces it all, with the widest instructions that the machine has. None of them changes a bit: every operation is
    /// rounded by itself.
    pub fn trace(&mut self, record: &mut impl Record) {
        pulp::Arch::new().dispatch(Widely { tracer: self, record });
    }

    #[inline(always)]
    fn trace_blocks(&mut self, record: &mut impl Record) {
        let common = self.asked.intersection(&self.seen.bounds);
        for top in common.rows.clone().step_by(BLOCK_ROWS as usize) {
            for left in common.columns.clone().step_by(BLOCK_COLUMNS as usize) {
                let block = Pixels {
                    columns: left..(left + BLOCK_COLUMNS).min(common.columns.end),
                    rows: top..(top + BLOCK_ROWS).min(common.rows.end),
                };
                if self.seen.projection.is_cone() {
                    self.trace_block::<true>(&block, record);
                } else {
                    self.trace_block::<false>(&block, record);
                }
            }
        }
    }

    #[inline(always)]
    fn trace_block<const CONE: bool>(&mut self, block: &Pixels, record: &mut impl Record) {
        self.block.faces.clear();
        self.block.span_count = 0;
        self.block.edge_on.clear();
        self.block.edge_on.extend(
            edge_on::in_rows(self.seen.edge_on.as_deref().unwrap_or_default(), &block.rows)
                .iter()
                .filter(|e| block.columns.contains(&e.column)),
        );
        self.cover::<CONE>(block);
        if self.block.span_count > 0 {
            self.measure_rays(block);
        }
        if !self.block.edge_on.is_empty() {
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

    /// Lists the faces and what they cover.
    #[inline(always)]
    fn cover<const CONE: bool>(&mut self, block: &Pixels) {
        let seen = self.seen;
        let first = &seen.bounds;
        let within = |range: &Range<i32>, start: i32| range.start - start..range.end - start;
        let region = Pixels {
            columns: within(&block.columns, first.columns.start),
            rows: within(&block.rows, first.rows.start),
        };
        for faces in seen.cells.near(&region) {
            for face in faces {
                self.cover_by::<CONE>(face, block);
            }
        }
    }

    #[inline(always)]
    fn cover_by<const CONE: bool>(&mut self, face: &CellFace, block: &Pixels) {
        let seen = self.seen;
        let [a, b, c] = face.corners.map(|v| v as usize);
        let (a, b, c) = (&seen.places[a], &seen.places[b], &seen.places[c]);
        let columns = [round::ceil(a.x), round::ceil(b.x), round::ceil(c.x)];
        let rows = [round::ceil(a.y), round::ceil(b.y), round::ceil(c.y)];
        let [first_row, turn, last_row] = sorted(rows);
        let (start, end) = (first_row.max(block.rows.start), last_row.min(block.rows.end));
        let [left, _, right] = sorted(columns);
        if start >= end || left >= block.columns.end || right <= block.columns.start {
            return;
        }
        let (order, is_even) = order(rows);
        let [low, mid, high] = order.map(|i| &seen.places[face.corners[i] as usize]);
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
        let (slope, is_sure) = Slope::new([a, b, c], seen.care, limits);
        self.block.faces.push(Face { slope, number: face.number });
        if !is_sure {
            self.look_closely(face, limits, block);
        }
    }

    /// Corrects the slope of the last face, which needs care, and lists the pixels on it if it is edge-on.
    #[cold]
    #[inline(never)]
    fn look_closely(&mut self, face: &CellFace, limits: [f64; 2], block: &Pixels) {
        let seen = self.seen;
        let places = face.corners.map(|v| seen.places[v as usize]);
        if seen.edge_on.is_none() && is_edge_on(places, seen.place_error) {
            pixels_along(places, face.number, seen.place_error, block, &mut self.block.edge_on);
        }
        if let Some(last) = self.block.faces.last_mut() {
            last.slope = Slope::careful(places, limits);
        }
    }

    /// The lengths of the block's rays: to the last bit those of their segments.
    #[inline(always)]
    fn measure_rays(&mut self, block: &Pixels) {
        let lengths = &mut self.block.lengths;
        let columns = block.columns.len();
        let grid = &self.view.grid;
        match grid.upstream() {
            Upstream::Path(path) => {
                lengths.clear();
                lengths.resize(columns * block.rows.len(), path.length());
            }
            Upstream::Source(source) => {
                lengths.resize(columns * block.rows.len(), 0.0);
                for (row, lengths) in block.rows.clone().zip(lengths.chunks_exact_mut(columns)) {
                    for (i, length) in lengths.iter_mut().enumerate() {
                        let column = block.columns.start + i as i32;
                        *length = (grid.point(column as u32, row as u32) - source).length();
                    }
                }
            }
        }
    }

    /// Traces the rays that may lie in a face.
    #[cold]
    fn trace_edge_on(&mut self, record: &mut impl Record) {
        edge_on::sort(&mut self.block.edge_on);
        for e in &self.block.edge_on {
            let pixel = [e.column as u32, e.row as u32];
            self.view.trace_ray(self.ray(e.row, e.column), pixel, e.face, record);
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
    fn ray(&self, row: i32, column: i32) -> usize {
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
fn sorted([a, b, c]: [i32; 3]) -> [i32; 3] {
    let (low, high) = (a.min(b), a.max(b));
    [low.min(c), low.max(high.min(c)), high.max(c)]
}
