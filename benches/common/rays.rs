//! Sets of rays, and how they are shared out.

use chordfield::geometry::{RayGrid, Region, Segment};

/// Rays to trace, numbered as a region of points: a batch is a grid of one row.
pub enum RaySet {
    /// Those of an image.
    Grid(RayGrid),
    /// Any, in this order.
    Batch(Vec<Segment>),
}

impl RaySet {
    /// All of them.
    pub fn whole(&self) -> Region {
        match self {
            Self::Grid(grid) => grid.whole(),
            Self::Batch(rays) => Region { columns: 0..rays.len() as u32, rows: 0..1 },
        }
    }

    /// How many they are.
    pub fn count(&self) -> usize {
        self.whole().pixels()
    }

    /// All of them in about `count` parts that follow one another: bands of rows, or stretches of a batch.
    pub fn parts(&self, count: u32) -> Vec<Region> {
        let Region { columns, rows } = self.whole();
        let cut = |end: u32, i: u32| (u64::from(end) * u64::from(i) / u64::from(count)) as u32;
        (0..count)
            .map(|i| match self {
                Self::Grid(_) => {
                    Region { columns: columns.clone(), rows: cut(rows.end, i)..cut(rows.end, i + 1) }
                }
                Self::Batch(_) => {
                    Region { columns: cut(columns.end, i)..cut(columns.end, i + 1), rows: rows.clone() }
                }
            })
            .filter(|part| part.pixels() > 0)
            .collect()
    }

    /// All rays of an image in tiles of so many columns and rows, at most, row by row of them.
    pub fn tiles(grid: &RayGrid, [columns, rows]: [u32; 2]) -> Vec<Region> {
        let Region { columns: all_columns, rows: all_rows } = grid.whole();
        let part = |start: u32, size: u32, end: u32| start..(start + size).min(end);
        let lefts = || all_columns.clone().step_by(columns as usize);
        all_rows
            .clone()
            .step_by(rows as usize)
            .flat_map(|top| lefts().map(move |left| (left, top)))
            .map(|(left, top)| Region {
                columns: part(left, columns, all_columns.end),
                rows: part(top, rows, all_rows.end),
            })
            .collect()
    }

    /// Calls `trace` with each ray of a region and its place in the region's list.
    pub fn each_of(&self, region: &Region, mut trace: impl FnMut(usize, &Segment)) {
        match self {
            Self::Grid(grid) => {
                for (i, (column, row)) in region.places().enumerate() {
                    trace(i, &grid.segment(column, row));
                }
            }
            Self::Batch(rays) => {
                let of_region = &rays[region.columns.start as usize..region.columns.end as usize];
                of_region.iter().enumerate().for_each(|(i, ray)| trace(i, ray));
            }
        }
    }
}
