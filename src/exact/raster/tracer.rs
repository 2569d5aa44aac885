//! A region, block by block, and the faces that may cover a block's pixels.
//!
//! ```text
//!   region ──▶ blocks ──▶ patches near one ──▶ their faces ─┬─▶ crossings   any body: each crossing by itself
//!                                                   │       ├─▶ chords      a convex one of small faces
//!                                                   ▼       └─▶ stretches   a convex one of large faces
//!                       rays in the plane of a face: each traced by itself
//! ```

use std::ops::Range;

use super::RasterView;
use super::edge_on::{EdgeOn, is_edge_on, pixels_along};
use super::face::Slope;
use super::patches::Patch;
use super::pixels::Pixels;
use super::projection::Place;
use super::rows::Covered;
use super::seen::Seen;
use super::stretches;
use super::workspace::{Face, Workspace};
use crate::exact::record::Record;
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
    /// Any body: see `crossings`.
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
                    (By::Crossings, true) => self.trace_block_of_crossings::<true, S>(simd, &block, record),
                    (By::Crossings, false) => self.trace_block_of_crossings::<false, S>(simd, &block, record),
                }
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

    /// Traces the rays that are to be traced by themselves.
    #[cold]
    pub fn trace_edge_on(&self, record: &mut impl Record) {
        for e in &self.work.block.edge_on {
            let pixel = [e.column as u32, e.row as u32];
            self.view.trace_ray(self.ray(e.row, e.column), pixel, record);
        }
    }

    /// The ray's number in the region asked for.
    #[inline(always)]
    pub fn ray(&self, row: i32, column: i32) -> usize {
        (row - self.asked.rows.start) as usize * self.asked.columns.len()
            + (column - self.asked.columns.start) as usize
    }
}
