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
