//! Walks for the rays of an image that start at one point: many rows abreast, column by column.
//!
//! ```text
//!             b        A ray from the source o passes the edge a–b on the inner side if its direction does the plane through
//!            ╱ ╲       o, a and b: if d · (a − o) × (b − o) > 0. The planes of the face that the last ray of a row went
//!       ────╱ × ╲───▷  through are held: whether the next one does too is three products, for as many rows at a time as
//!          a─────c     the machine's instructions take. If it does not, a step to the next face makes two planes more.
//! ```
//!
//! What is held changes no bit: a face that is surely pierced is the one that a walk finds, and where is the same quotient.
//! All else is left to the walk proper ([`Walker::pass_from`]), which begins where these got.

use glam::DVec3;
use pulp::Simd;

use super::abreast::{ABREAST, OfRays};
use super::held::{Footing, HeldFaces, NONE, dir_of, dot, load, set, store, store_vector};
use super::sets::{UNIT, note};
use super::{Pass, Seeds, Unsure, Walker};
use crate::exact::Record;
use crate::geometry::numeric::gamma;
use crate::geometry::{Interval, RayGrid, Region, Segment};

/// No instructions handle more numbers side by side.
const LANES: usize = 8;

// Lanes are gone through in plain loops here, and lists of them written out: what is called once more, as by `array::map`, may
// have to do without the wide instructions.

/// The rays of a region of an image from one source.
pub(super) struct ConeRays<'t, R, F> {
    pub walker: &'t Walker,
    pub grid: &'t RayGrid,
    pub source: DVec3,
    pub region: &'t Region,
    pub record: &'t mut R,
    /// Traces rays in doubt.
    pub other: F,
}

impl<R: Record, F: FnMut(usize, &Segment, &mut R)> pulp::WithSimd for ConeRays<'_, R, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let mut rows = Rows::new(self.walker, self.source);
        for top in self.region.rows.clone().step_by(ABREAST) {
            rows.begin(self.grid, top, (self.region.rows.end - top).min(ABREAST as u32) as usize);
            for column in self.region.columns.clone() {
                rows.aim(simd, self.grid, column);
                rows.find_faces(simd);
                self.report(&mut rows, top, column);
            }
        }
    }
}

impl<R: Record, F: FnMut(usize, &Segment, &mut R)> ConeRays<'_, R, F> {
    /// Reports the rays of a column.
    #[inline(always)]
    fn report(&mut self, rows: &mut Rows, top: u32, column: u32) {
        let width = self.region.columns.len();
        let first =
            (top - self.region.rows.start) as usize * width + (column - self.region.columns.start) as usize;
        for j in 0..rows.count {
            if rows.passes_by[j] {
                continue;
            }
            let (ray, length_mm) = (first + j * width, rows.lengths[j]);
            let answer = match rows.pass(j) {
                None => rows.pass_from_there(j),
                pass => Ok(pass),
            };
            rows.has_missed[j] = !matches!(answer, Ok(Some(_)));
            match answer {
                Ok(Some(pass)) => note(self.record, ray, &pass, UNIT, length_mm),
                Ok(None) => {}
                Err(Unsure) => (self.other)(ray, &self.grid.segment(column, top + j as u32), self.record),
            }
        }
    }
}

/// Rows, each with its ray of the column that is looked at, and the faces that its last one went through.
struct Rows<'w> {
    walker: &'w Walker,
    source: DVec3,
    /// Products greater than this, over the direction's |x| + |y| + |z|, are right, mm².
    sure: f64,
    count: usize,
    /// What the rows add to a column's first point.
    offsets: [OfRays; 3],
    /// From the source to the pixels' points.
    dirs: [OfRays; 3],
    lengths: OfRays,
    /// |x| + |y| + |z| of the directions.
    sizes: OfRays,
    entries: HeldFaces,
    exits: HeldFaces,
    /// Where rays begin that come after a miss, once the row has come near the body: by planes through the source a walk around
    /// the outline would take more steps, and find no face to hold.
    seeds: [Option<Seeds>; ABREAST],
    /// Whether the last ray missed, or was in doubt: the next may pass by far enough to say so at once.
    has_missed: [bool; ABREAST],
    /// Whether this one does.
    passes_by: [bool; ABREAST],
}

impl<'w> Rows<'w> {
    #[inline(always)]
    fn new(walker: &'w Walker, source: DVec3) -> Self {
        // No vertex is seen farther off in the line's frame: see `LineView`. Its sides, times the longest component of the
        // direction, are these products, and in doubt below γ₆₄ of the square: the ends are then those of a walk to the
        // last bit. The products' own rounding, γ₈ of six times the square, is far less than the rest.
        let largest = 2.0 * ((source - walker.centre).abs().max_element() + walker.reach);
        Self {
            walker,
            source,
            sure: gamma(256) * largest * largest,
            count: 0,
            offsets: [NONE; 3],
            dirs: [NONE; 3],
            lengths: NONE,
            sizes: NONE,
            entries: HeldFaces::new(-1.0),
            exits: HeldFaces::new(1.0),
            seeds: [None; ABREAST],
            has_missed: [true; ABREAST],
            passes_by: [false; ABREAST],
        }
    }

    /// Begins `count` rows from `top` on.
    #[inline(always)]
    fn begin(&mut self, grid: &RayGrid, top: u32, count: usize) {
        self.count = count;
        let [_, by_row] = grid.steps();
        for j in 0..ABREAST {
            set(&mut self.offsets, j, (f64::from(top) + j as f64) * by_row);
        }
        self.seeds = [None; ABREAST];
        self.has_missed = [true; ABREAST];
    }

    /// Looks at the rays of a column: to the last bit as the grid has them.
    #[inline(always)]
    fn aim<S: Simd>(&mut self, simd: S, grid: &RayGrid, column: u32) {
        let [by_column, _] = grid.steps();
        let first = (grid.origin() + f64::from(column) * by_column).to_array();
        let source = self.source.to_array();
        for group in 0..self.count.next_multiple_of(LANES) / S::F64_LANES {
            let along = |axis: usize| {
                let point =
                    simd.add_f64s(simd.splat_f64s(first[axis]), load(simd, &self.offsets[axis], group));
                simd.sub_f64s(point, simd.splat_f64s(source[axis]))
            };
            let dir = [along(0), along(1), along(2)];
            let sum = simd.add_f64s(simd.abs_f64s(dir[0]), simd.abs_f64s(dir[1]));
            store(simd, &mut self.sizes, group, simd.add_f64s(sum, simd.abs_f64s(dir[2])));
            store(simd, &mut self.lengths, group, simd.sqrt_f64s(dot(simd, dir, dir)));
            store_vector(simd, &mut self.dirs, group, dir);
        }
        self.pass_by();
    }

    /// Finds out which rays surely miss.
    #[inline(always)]
    fn pass_by(&mut self) {
        if !self.has_missed[..self.count].contains(&true) {
            self.passes_by = [false; ABREAST];
            return;
        }
        let mut beyond = NONE;
        self.walker.seeds.beyond(self.source, &self.dirs, &mut beyond);
        for (j, passes_by) in self.passes_by.iter_mut().enumerate() {
            *passes_by = self.has_missed[j] & (beyond[j] > 0.0);
        }
    }

    /// Finds the faces that rays go through, and where.
    #[inline(always)]
    fn find_faces<S: Simd>(&mut self, simd: S) {
        for j in 0..self.count {
            if !self.passes_by[j] && self.seeds[j].is_none() {
                self.begin_row(j);
            }
        }
        let Self { walker, source, dirs, sizes, has_missed, count, sure, entries, exits, .. } = self;
        let groups = count.next_multiple_of(LANES) / S::F64_LANES;
        for held in [entries, exits] {
            held.look(simd, groups, dirs, sizes, *sure);
            let mut walking = [0; ABREAST];
            let mut left = 0;
            for (j, (margin, has_missed)) in held.margins.iter().zip(&*has_missed).take(*count).enumerate() {
                // Branches would not be foreseen.
                walking[left] = j as u8;
                left += usize::from((*margin <= 0.0) & !has_missed);
            }
            for &j in &walking[..left] {
                let j = j as usize % ABREAST;
                held.walk(walker, *source, j, dir_of(dirs, j), *sure * sizes[j]);
            }
            held.cross(simd, groups, dirs, sizes);
        }
    }

    /// Takes seeds from the table.
    #[inline(never)]
    fn begin_row(&mut self, j: usize) {
        self.seeds[j] = self.walker.seeds.near(self.source, dir_of(&self.dirs, j));
        self.passes_by[j] = self.seeds[j].is_none();
    }

    /// The way of a row's ray through the body, if both faces are surely pierced.
    #[inline(always)]
    fn pass(&self, j: usize) -> Option<Pass> {
        let (entries, exits) = (&self.entries, &self.exits);
        if !((entries.margins[j] > 0.0) & (exits.margins[j] > 0.0)) {
            return None;
        }
        let chord = Interval::new(entries.crossings[j], exits.crossings[j])?;
        Some(Pass { chord, entry_face: entries.half_edges[j] / 4, exit_face: exits.half_edges[j] / 4 })
    }

    /// The same by the walk proper, from the faces that were reached, or from the seeds after a miss; what it goes through then is
    /// held.
    #[cold]
    #[inline(never)]
    fn pass_from_there(&mut self, j: usize) -> Result<Option<Pass>, Unsure> {
        let reached = Seeds { entry: self.entries.half_edges[j] / 4, exit: self.exits.half_edges[j] / 4 };
        let mut seeds = self.seeds[j].filter(|_| self.has_missed[j]).unwrap_or(reached);
        let answer = self.walker.pass_from(self.source, dir_of(&self.dirs, j), &mut seeds);
        self.seeds[j] = Some(seeds);
        if let (true, Ok(Some(pass))) = (self.has_missed[j], &answer) {
            for (held, face) in [(&mut self.entries, pass.entry_face), (&mut self.exits, pass.exit_face)] {
                let footing = Footing::new(self.walker, self.source, face, held.sign);
                held.stand_on(self.walker, self.source, j, &footing);
            }
        }
        answer
    }
}
