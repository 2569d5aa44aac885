//! Blocks of a convex body of large faces: each row is cut where the face of the entry changes, and where that of the exit does.
//! Between the cuts the depth is affine.
//!
//! ```text
//!   entries  ├───────┤├──────────────┤├─────────┤      A ray goes in once and out once, so that the spans of a row's entries
//!   exits    ├────────────┤├────────────┤├──────┤      are one after the other from its first pixel to its last, and so
//!                                                        are those of its exits. A pixel is written once.
//! ```
//!
//! Where rounding has folded the outline, spans of a row may overlap. That is seen before any of its pixels is written: they
//! are gone through one by one then, and those covered twice in one way are left to the engine for single rays.

use pulp::Simd;

use super::chords::measure;
use super::edge_on::{self, EdgeOn};
use super::face::Slope;
use super::pixels::Pixels;
use super::rows::{Covered, LANES, first_lanes};
use super::tracer::{FaceRows, SeenFace, Tracer};
use crate::exact::record::{Passes, Record};
use crate::geometry::{RayGrid, Upstream};

/// Columns of a block: as large faces reach over many, more than where lists are long.
pub const BLOCK_COLUMNS: i32 = 640;

const COLUMNS: usize = BLOCK_COLUMNS as usize;

/// A bit for each column at which a span may start or end.
const WORDS: usize = COLUMNS / 64 + 1;

type Bits = [u64; WORDS];

/// A number of each column, with room for lanes that reach beyond the last.
type OfColumns = [f64; COLUMNS + LANES];

/// What faces cover of a block, by row and way, and what is found of a row.
pub struct Stretches {
    rows: Vec<Row>,
    /// For each column at which a span starts, its face: of a row's entries, then of its exits. One more, for spans of no pixels.
    faces: Vec<u32>,
    /// Columns of the block.
    pitch: usize,
    /// Whether two spans of one row and way start, or end, at the same column.
    is_double: bool,
    /// Lengths, entries and exits, mm; before that, depths of entries and exits.
    found: [OfColumns; 3],
}

impl Default for Stretches {
    fn default() -> Self {
        Self {
            rows: Vec::new(),
            faces: Vec::new(),
            pitch: 0,
            is_double: false,
            found: [[0.0; COLUMNS + LANES]; 3],
        }
    }
}

/// A row of a block.
#[derive(Clone, Copy, Default)]
struct Row {
    /// Where spans start and where they end, of entries and of exits.
    starts: [Bits; 2],
    ends: [Bits; 2],
}

impl Row {
    /// Adds a span, if it has any pixels. Whether another starts, or ends, at the same column, in bits.
    #[inline(always)]
    fn add(&mut self, way: usize, start: usize, end: usize) -> u64 {
        let any = u64::from(start < end);
        let (starts, first) = (&mut self.starts[way][start / 64 % WORDS], any << (start % 64));
        let is_double = *starts & first;
        *starts |= first;
        let (ends, last) = (&mut self.ends[way][end / 64 % WORDS], any << (end % 64));
        let is_double = is_double | *ends & last;
        *ends |= last;
        is_double
    }

    /// The columns from the first that is covered to before the last, if all of them are covered once by an entry and once
    /// by an exit, and no others. That is so only if no two spans of one way start or end together: a column is then covered
    /// as often as more of them have started than ended, and that changes at those two alone.
    #[inline(always)]
    fn covered_once(&self) -> Option<[usize; 2]> {
        let (mut changes, mut count, mut differ) = ([0; WORDS], 0, 0);
        for (word, changes) in changes.iter_mut().enumerate() {
            let of_entries = self.starts[0][word] ^ self.ends[0][word];
            let of_exits = self.starts[1][word] ^ self.ends[1][word];
            *changes = of_entries;
            count += of_entries.count_ones();
            differ |= of_entries ^ of_exits;
        }
        let mut columns = columns_of(changes);
        match (count, differ, columns.next(), columns.next()) {
            (0, 0, ..) => Some([0; 2]),
            (2, 0, Some(first), Some(last)) => Some([first, last]),
            _ => None,
        }
    }
}

/// The columns whose bits are set.
#[inline(always)]
fn columns_of(bits: Bits) -> impl Iterator<Item = usize> {
    bits.into_iter().enumerate().flat_map(|(word, mut bits)| {
        std::iter::from_fn(move || {
            let bit = (bits != 0).then(|| bits.trailing_zeros() as usize)?;
            bits &= bits - 1;
            Some(64 * word + bit)
        })
    })
}

impl Stretches {
    /// Begins a block.
    fn begin(&mut self, block: &Pixels) {
        self.rows.clear();
        self.rows.resize(block.rows.len(), Row::default());
        self.pitch = block.columns.len();
        self.is_double = false;
        let needed = 2 * self.rows.len() * self.pitch + 1;
        self.faces.resize(needed.max(self.faces.len()), 0);
    }

    /// Adds the pixels of a row that a face covers, counted from the block's first. What it returns is as for a row.
    #[inline(always)]
    fn add(&mut self, face: u32, row: usize, way: usize, [start, end]: [usize; 2]) -> u64 {
        let is_double = self.rows[row].add(way, start, end);
        let at = (2 * row + way) * self.pitch + start;
        let none = self.faces.len() - 1;
        self.faces[if start < end { at } else { none }] = face;
        is_double
    }

    /// Whether any row is not covered once.
    fn is_folded(&self) -> bool {
        self.is_double || self.rows.iter().any(|row| row.covered_once().is_none())
    }
}

impl Tracer<'_, '_> {
    /// Traces a block of a convex body seen from without.
    #[inline(always)]
    pub fn trace_block_of_stretches<const CONE: bool, S: Simd, R: Record>(
        &mut self,
        simd: S,
        block: &Pixels,
        record: &mut R,
    ) {
        self.work.stretches.begin(block);
        self.work.block.faces.clear();
        self.each_face::<CONE>(
            block,
            #[inline(always)]
            |tracer, face| tracer.cover_stretches(simd, face, block),
        );
        let is_folded = self.work.stretches.is_folded();
        if is_folded {
            // Once more, as lists.
            self.cover::<CONE, S>(simd, block);
            self.list_covered_twice(block);
        }
        if !self.work.block.edge_on.is_empty() {
            edge_on::sort(&mut self.work.block.edge_on);
            self.trace_edge_on(record);
        }
        for (i, row) in block.rows.clone().enumerate() {
            let [first, last] = match self.work.stretches.rows[i].covered_once().filter(|_| !is_folded) {
                Some([first, last]) if first == last => continue,
                Some(columns) => {
                    self.measure_row::<CONE, S, R>(simd, block, i, columns);
                    columns
                }
                None => self.measure_one_by_one::<CONE>(block, row),
            };
            if !self.work.block.edge_on.is_empty() {
                self.forget_edge_on(block, row);
            }
            let [lengths_mm, entries, exits] =
                self.work.stretches.found.each_ref().map(|of| &of[first..last]);
            let ends_mm = if R::ASKS_ENDS { [entries, exits] } else { [&[][..]; 2] };
            record.passes(self.ray(row, block.columns.start + first as i32), &Passes { lengths_mm, ends_mm });
        }
    }

    /// Notes what a face covers.
    #[inline(always)]
    fn cover_stretches<S: Simd>(&mut self, simd: S, face: &SeenFace, block: &Pixels) {
        let FaceRows { slot, pixels, is_right_out } = self.find_rows(simd, face, block);
        let first = (pixels.rows.start - block.rows.start) as usize;
        let mut is_double = 0;
        for i in 0..pixels.rows.len() {
            let Covered { start, count, is_long_left } = self.work.rows.covered(i);
            let way = usize::from(is_long_left == is_right_out);
            let start = start - block.columns.start;
            let columns = [start, start + count.max(0)].map(|column| column as usize);
            is_double |= self.work.stretches.add(slot, first + i, way, columns);
        }
        self.work.stretches.is_double |= is_double != 0;
    }

    /// Finds the lengths of a row that is covered once, between these columns of the block: first both depths of its pixels, span
    /// by span, then what follows from them.
    #[inline(always)]
    fn measure_row<const CONE: bool, S: Simd, R: Record>(
        &mut self,
        simd: S,
        block: &Pixels,
        i: usize,
        [first, last]: [usize; 2],
    ) {
        let Stretches { rows, faces, pitch, found, .. } = &mut self.work.stretches;
        let row = block.rows.start + i as i32;
        let [lengths, entries, exits] = found;
        for (way, depths) in [&mut *entries, &mut *exits].into_iter().enumerate() {
            let faces = &faces[(2 * i + way) * *pitch..][..*pitch];
            let faces_seen = &self.work.block.faces;
            let mut spans = Spans { depths, row, first: block.columns.start };
            let mut from = first;
            for (word, &bits) in rows[i].starts[way].iter().enumerate().skip(first / 64) {
                // At the row's first column the first span starts, which ends where the next does.
                let mut bits = if word == first / 64 { bits & !(1 << (first % 64)) } else { bits };
                while bits != 0 {
                    let to = 64 * word + bits.trailing_zeros() as usize;
                    bits &= bits - 1;
                    spans.fill(simd, &faces_seen[faces[from] as usize].slope, [from, to]);
                    from = to;
                }
            }
            spans.fill(simd, &faces_seen[faces[from] as usize].slope, [from, last]);
        }
        let rays = RowOfRays::new(&self.view.grid, row);
        let first_column = simd.splat_f64s(f64::from(block.columns.start + first as i32));
        let mut columns = simd.add_f64s(first_column, first_lanes(simd));
        for at in (first..last).step_by(S::F64_LANES) {
            let (a, b) = (load(simd, entries, at), load(simd, exits, at));
            let of_rays = rays.lengths::<CONE, S>(simd, columns);
            let share = if CONE {
                simd.div_f64s(simd.sub_f64s(a, b), simd.mul_f64s(a, b))
            } else {
                simd.sub_f64s(b, a)
            };
            store(simd, lengths, at, simd.mul_f64s(of_rays, share));
            if R::ASKS_ENDS {
                store(simd, entries, at, place::<CONE, S>(simd, of_rays, a));
                store(simd, exits, at, place::<CONE, S>(simd, of_rays, b));
            }
            columns = simd.add_f64s(columns, simd.splat_f64s(S::F64_LANES as f64));
        }
    }

    /// The faces of a row's pixels, column by column: those of entries and those of exits.
    fn faces_one_by_one(&self, block: &Pixels, row: i32) -> Vec<[Vec<u32>; 2]> {
        let mut faces = vec![[vec![], vec![]]; block.columns.len()];
        for span in self.work.block.spans().iter().filter(|span| span.row == row) {
            for of_pixel in &mut faces[span.start as usize..span.end as usize] {
                of_pixel[usize::from(span.is_out)].push(span.face);
            }
        }
        faces
    }

    /// Lists the pixels that are covered twice in one way.
    #[cold]
    #[inline(never)]
    fn list_covered_twice(&mut self, block: &Pixels) {
        for row in block.rows.clone() {
            let faces = self.faces_one_by_one(block, row);
            let is_twice = |(_, [ins, outs]): &(i32, &[Vec<u32>; 2])| ins.len().max(outs.len()) > 1;
            let twice = block.columns.clone().zip(&faces).filter(is_twice);
            self.work.block.edge_on.extend(twice.map(|(column, _)| EdgeOn { row, column, face: 0 }));
        }
    }

    /// As [`measure_row`](Self::measure_row), of any row; pixels covered twice have no length.
    #[cold]
    #[inline(never)]
    fn measure_one_by_one<const CONE: bool>(&mut self, block: &Pixels, row: i32) -> [usize; 2] {
        let mut rays = vec![0.0; block.columns.len()];
        measure(&self.view.grid, row, block.columns.start, &mut rays);
        for (i, faces) in self.faces_one_by_one(block, row).iter().enumerate() {
            let column = f64::from(block.columns.start + i as i32);
            let depth = |face: u32| {
                let slope = &self.work.block.faces[face as usize].slope;
                slope.depth(slope.row(row), column)
            };
            let found = match (&faces[0][..], &faces[1][..]) {
                (&[face_in], &[face_out]) => {
                    let (length, a, b) = (rays[i], depth(face_in), depth(face_out));
                    if CONE {
                        [length * ((a - b) / (a * b)), length / a, length / b]
                    } else {
                        [length * (b - a), length * a, length * b]
                    }
                }
                _ => [0.0; 3],
            };
            self.work.stretches.found.iter_mut().zip(found).for_each(|(of, value)| of[i] = value);
        }
        [0, block.columns.len()]
    }

    /// Takes out of a row what is traced by itself.
    #[cold]
    #[inline(never)]
    fn forget_edge_on(&mut self, block: &Pixels, row: i32) {
        let found = &mut self.work.stretches.found;
        for e in self.work.block.edge_on.iter().filter(|e| e.row == row) {
            found.iter_mut().for_each(|of| of[(e.column - block.columns.start) as usize] = 0.0);
        }
    }
}

/// Depths of a row's pixels in one way.
struct Spans<'d> {
    depths: &'d mut OfColumns,
    row: i32,
    /// The block's first column.
    first: i32,
}

impl Spans<'_> {
    /// Between these columns of the block, rays go through one face. What is found beyond the end is written again by the next.
    #[inline(always)]
    fn fill<S: Simd>(&mut self, simd: S, slope: &Slope, [from, to]: [usize; 2]) {
        let of_row = slope.row(self.row);
        let first = simd.splat_f64s(f64::from(self.first + from as i32));
        let mut columns = simd.add_f64s(first, first_lanes(simd));
        for at in (from..to).step_by(S::F64_LANES) {
            store(simd, self.depths, at, slope.depths(simd, of_row, columns));
            columns = simd.add_f64s(columns, simd.splat_f64s(S::F64_LANES as f64));
        }
    }
}

#[inline(always)]
fn load<S: Simd>(_: S, of: &OfColumns, at: usize) -> S::f64s {
    S::as_simd_f64s(&of[at..at + S::F64_LANES]).0[0]
}

#[inline(always)]
fn store<S: Simd>(_: S, of: &mut OfColumns, at: usize, values: S::f64s) {
    S::as_mut_simd_f64s(&mut of[at..at + S::F64_LANES]).0[0] = values;
}

/// Places at these depths on rays of these lengths.
#[inline(always)]
fn place<const CONE: bool, S: Simd>(simd: S, lengths: S::f64s, depths: S::f64s) -> S::f64s {
    if CONE { simd.div_f64s(lengths, depths) } else { simd.mul_f64s(lengths, depths) }
}

/// The rays of a row.
struct RowOfRays {
    /// Of the grid's first pixel, what a column and what the row adds, and the source.
    coordinates: [[f64; 4]; 3],
    /// Of all rays, if they are parallel.
    length: f64,
}

impl RowOfRays {
    #[inline(always)]
    fn new(grid: &RayGrid, row: i32) -> Self {
        let ([by_column, by_row], origin) = (grid.steps(), grid.origin());
        let of_row = f64::from(row) * by_row;
        let (source, length) = match grid.upstream() {
            Upstream::Source(source) => (source, 0.0),
            Upstream::Path(path) => (glam::DVec3::ZERO, path.length()),
        };
        Self { coordinates: [0, 1, 2].map(|i| [origin[i], by_column[i], of_row[i], source[i]]), length }
    }

    /// To the last bit those of [`measure`].
    #[inline(always)]
    fn lengths<const CONE: bool, S: Simd>(&self, simd: S, columns: S::f64s) -> S::f64s {
        if !CONE {
            return simd.splat_f64s(self.length);
        }
        let [x, y, z] = &self.coordinates;
        let (x, y, z) = (square(simd, x, columns), square(simd, y, columns), square(simd, z, columns));
        simd.sqrt_f64s(simd.add_f64s(simd.add_f64s(x, y), z))
    }
}

/// The square of a coordinate of the way from the source to pixels of a row.
#[inline(always)]
fn square<S: Simd>(simd: S, [origin, by_column, of_row, source]: &[f64; 4], columns: S::f64s) -> S::f64s {
    let along = simd.mul_f64s(columns, simd.splat_f64s(*by_column));
    let along = simd.add_f64s(simd.splat_f64s(*origin), along);
    let way = simd.sub_f64s(simd.add_f64s(along, simd.splat_f64s(*of_row)), simd.splat_f64s(*source));
    simd.mul_f64s(way, way)
}
