//! The rays of an image: from one source, or all parallel, to the points of a plane grid.
//!
//! ```text
//!              ┌──┬──┬──┐ row step ↓      pixel (c, r) = origin + c · column step + r · row step
//!   source ──◁─┼──┼──┼──┤                 its ray: from the source (cone), or from the pixel − path (parallel)
//!              └──┴──┴──┘ column step →
//! ```

use std::ops::Range;

use glam::DVec3;

use super::{Segment, UnitDir};

/// Where the rays of a grid start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Upstream {
    /// All at one point, mm.
    Source(DVec3),
    /// Each this much before its pixel, mm: all rays are this vector.
    Path(DVec3),
}

/// Rays to the points of a plane grid. Every point has a ray: the constructor proves it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayGrid {
    upstream: Upstream,
    origin: DVec3,
    column_step: DVec3,
    row_step: DVec3,
    columns: u32,
    rows: u32,
}

impl RayGrid {
    /// The rays to `origin + c · column_step + r · row_step`, mm. `None` if there are none, if the steps span no plane, if
    /// rays run within that plane, or if a ray is not finite.
    pub fn new(
        upstream: Upstream,
        origin: DVec3,
        [column_step, row_step]: [DVec3; 2],
        [columns, rows]: [u32; 2],
    ) -> Option<Self> {
        let grid = Self { upstream, origin, column_step, row_step, columns, rows };
        let path = match upstream {
            Upstream::Source(source) => origin - source,
            Upstream::Path(path) => path,
        };
        let depth = column_step.cross(row_step).dot(path);
        let last = grid.point(columns.checked_sub(1)?, rows.checked_sub(1)?);
        let is_sound = depth.is_finite() && depth != 0.0 && last.is_finite();
        (is_sound && UnitDir::new(path).is_some()).then_some(grid)
    }

    /// Columns and rows.
    pub fn size(&self) -> (u32, u32) {
        (self.columns, self.rows)
    }

    /// Where the rays start.
    pub fn upstream(&self) -> Upstream {
        self.upstream
    }

    /// Point (0, 0), mm.
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// From a point to the next of its row, and to the next of its column, mm.
    pub fn steps(&self) -> [DVec3; 2] {
        [self.column_step, self.row_step]
    }

    /// The point of a column and a row, mm.
    #[inline]
    pub fn point(&self, column: u32, row: u32) -> DVec3 {
        self.origin + f64::from(column) * self.column_step + f64::from(row) * self.row_step
    }

    /// Where the ray to `target` starts, mm.
    #[inline]
    pub fn start_of(&self, target: DVec3) -> DVec3 {
        match self.upstream {
            Upstream::Source(source) => source,
            Upstream::Path(path) => target - path,
        }
    }

    /// The ray to the point of a column and a row. Points off the grid have one as well, while finite.
    #[inline]
    pub fn segment(&self, column: u32, row: u32) -> Segment {
        let target = self.point(column, row);
        Segment::between(self.start_of(target), target)
            .expect("the constructor keeps every point finite and off its source")
    }

    /// All of it as a region.
    pub fn whole(&self) -> Region {
        Region { columns: 0..self.columns, rows: 0..self.rows }
    }
}

/// A rectangle of a grid's points.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Region {
    /// Columns, from the first to before the last.
    pub columns: Range<u32>,
    /// Rows, from the first to before the last.
    pub rows: Range<u32>,
}

impl Region {
    /// How many points it holds.
    pub fn pixels(&self) -> usize {
        self.columns.len() * self.rows.len()
    }

    /// Column and row of each point, row by row: the order of all lists of a region.
    pub fn places(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        self.rows.clone().flat_map(|row| self.columns.clone().map(move |column| (column, row)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_without_points_or_in_the_plane_of_its_source_is_none() {
        let steps = [DVec3::X, DVec3::Y];
        let grid = |upstream, steps, size| RayGrid::new(upstream, DVec3::ZERO, steps, size);
        let above = Upstream::Source(DVec3::new(5.0, 5.0, -9.0));
        assert!(grid(above, steps, [3, 2]).is_some());
        assert!(grid(above, steps, [0, 2]).is_none());
        assert!(grid(above, [DVec3::X, 2.0 * DVec3::X], [3, 2]).is_none());
        assert!(grid(Upstream::Source(DVec3::X), steps, [3, 2]).is_none());
        assert!(grid(Upstream::Path(DVec3::NAN), steps, [3, 2]).is_none());
    }

    #[test]
    fn places_run_row_by_row() {
        let region = Region { columns: 4..6, rows: 1..3 };
        assert_eq!(region.places().collect::<Vec<_>>(), [(4, 1), (5, 1), (4, 2), (5, 2)]);
        assert_eq!(region.pixels(), 4);
    }
}
