//! Where in a picture an object may be seen: a rectangle around its box, and in that the cells that boxes around its parts reach.

use std::sync::Arc;

use crate::geometry::{Bounds, Region};
use crate::scene::trace::{Camera, Footprint};
use crate::surface::Surface;

/// Pixels along a cell, at the least.
const LEAST_CELL: usize = 4;

/// Cells along a side of the picture, at most: larger pictures have larger cells.
const MOST_CELLS: usize = 512;

/// The parts of an object that are told apart, at most.
const MOST_PARTS: usize = 1024;

/// Where an object may be seen in a picture.
#[derive(Clone, Debug)]
pub struct Silhouette {
    whole: Footprint,
    /// Objects whose hits take many operations have their parts told apart.
    mask: Option<Arc<Mask>>,
}

#[derive(Debug)]
struct Mask {
    /// Pixels along a cell.
    cell: usize,
    /// The first cell along columns and rows, and how many there are.
    first: [usize; 2],
    count: [usize; 2],
    /// Whether there is something to be seen, row by row.
    is_reached: Vec<bool>,
}

impl Silhouette {
    /// Of what may be anywhere.
    pub const ANYWHERE: Self = Self { whole: Footprint::ANYWHERE, mask: None };

    /// Of a surface in a box on a picture of some columns and rows. `None` if it is not seen.
    pub fn new(surface: &Surface, bounds: &Bounds, camera: &Camera, size: (u32, u32)) -> Option<Self> {
        let whole = camera.footprint(size, bounds)?;
        let silhouette = Self { whole, mask: None };
        let has_mask = !surface.has_closed_form() && silhouette.is_bounded();
        let mask = if has_mask { Some(Arc::new(Mask::new(surface, whole, camera, size)?)) } else { None };
        Some(Self { mask, ..silhouette })
    }

    /// Whether all of the object lies before the camera, so that the silhouette says where.
    pub fn is_bounded(&self) -> bool {
        self.whole != Footprint::ANYWHERE
    }

    /// Whether the object may be seen at a place of the picture.
    #[inline]
    pub fn holds(&self, place: [f64; 2]) -> bool {
        self.whole.holds(place) && self.mask.as_ref().is_none_or(|mask| mask.holds(place))
    }

    /// Whether it may be seen in a tile.
    pub fn reaches(&self, tile: &Region) -> bool {
        self.whole.reaches(tile)
    }
}

impl Mask {
    /// Of the part of a picture that the whole surface reaches. `None` if that is none.
    fn new(surface: &Surface, whole: Footprint, camera: &Camera, size: (u32, u32)) -> Option<Self> {
        let cell = LEAST_CELL.max((size.0.max(size.1) as usize).div_ceil(MOST_CELLS));
        let [columns, rows] = whole.cells(size, cell)?;
        let mut mask = Self {
            cell,
            first: [columns.start, rows.start],
            count: [columns.len(), rows.len()],
            is_reached: vec![false; columns.len() * rows.len()],
        };
        let footprints =
            surface.parts(MOST_PARTS).into_iter().filter_map(|part| camera.footprint(size, &part));
        for [reached_columns, reached_rows] in footprints.filter_map(|part| part.cells(size, cell)) {
            let within = |i: usize, cell: usize| {
                cell.clamp(mask.first[i], mask.first[i] + mask.count[i] - 1) - mask.first[i]
            };
            let reached = within(0, reached_columns.start)..=within(0, reached_columns.end - 1);
            for row in within(1, reached_rows.start)..=within(1, reached_rows.end - 1) {
                let first = row * mask.count[0];
                mask.is_reached[first + reached.start()..=first + reached.end()].fill(true);
            }
        }
        Some(mask)
    }

    /// At a place that the whole surface may be seen at.
    #[inline]
    fn holds(&self, place: [f64; 2]) -> bool {
        let cell = |i: usize| (place[i] as usize / self.cell).max(self.first[i]) - self.first[i];
        let [column, row] = [0, 1].map(|i| cell(i).min(self.count[i] - 1));
        self.is_reached[row * self.count[0] + column]
    }
}
