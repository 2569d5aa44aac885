//! Blocks of any body: first what each face covers, then the crossings there, each by itself.
//!
//! Two rounds, as a ray in the plane of one face must be known before any other face reports a crossing of it. And what
//! faces cover is then a list without gaps, gone through without a surprise at each face.

use pulp::Simd;

use super::chords::measure;
use super::edge_on::{self, is_listed};
use super::pixels::Pixels;
use super::rows::Covered;
use super::tracer::{FaceRows, RUN, SeenFace, Tracer};
use super::workspace::{Face, Span};
use crate::exact::record::{Record, Way};

impl Tracer<'_, '_> {
    /// Traces a block of any body, with the source within or without.
    #[inline(always)]
    pub fn trace_block_of_crossings<const CONE: bool, S: Simd>(
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

    /// Lists the faces and what they cover.
    #[inline(always)]
    pub fn cover<const CONE: bool, S: Simd>(&mut self, simd: S, block: &Pixels) {
        self.work.block.faces.clear();
        self.work.block.span_count = 0;
        self.each_face::<CONE>(
            block,
            #[inline(always)]
            |tracer, face| tracer.cover_by(simd, face, block),
        );
    }

    #[inline(always)]
    fn cover_by<S: Simd>(&mut self, simd: S, face: &SeenFace, block: &Pixels) {
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

    /// The lengths of the block's rays.
    #[inline(always)]
    fn measure_rays(&mut self, block: &Pixels) {
        let (lengths, columns) = (&mut self.work.block.lengths, block.columns.len());
        lengths.resize(columns * block.rows.len(), 0.0);
        for (row, lengths) in block.rows.clone().zip(lengths.chunks_exact_mut(columns)) {
            measure(&self.view.grid, row, block.columns.start, lengths);
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
