//! Faces sorted by where they are seen, for any region to find its own.
//!
//! ```text
//!   level 0: 16 pixels       level 1: 32 pixels      … each face once: in the finest level whose cells are no smaller
//!   ┌──┬──┬──┬──┐            ┌─────┬─────┐             than its box, in the cell of the box's first corner.
//!   │  │▟▙│  │  │            │    ▟███▙  │             So a region meets the faces of its own cells and
//!   ├──┼──┼──┼──┤            │   ▟█████▙ │             of those one up and one left of them.
//! ```

use std::ops::Range;

/// Side of the finest cells, pixels.
const FINEST: i32 = 8;
const FINEST_LOG2: u32 = FINEST.trailing_zeros();

/// A rectangle of pixels, each side from the first to before the last.
#[derive(Clone, Debug, PartialEq)]
pub struct Pixels {
    pub columns: Range<i32>,
    pub rows: Range<i32>,
}

impl Pixels {
    /// From the least to before the greatest of some columns and rows.
    pub fn between(places: impl Iterator<Item = [i32; 2]>) -> Self {
        let (mut low, mut high) = ([i32::MAX; 2], [i32::MIN; 2]);
        for [x, y] in places {
            low = [low[0].min(x), low[1].min(y)];
            high = [high[0].max(x), high[1].max(y)];
        }
        Self { columns: low[0]..high[0], rows: low[1]..high[1] }
    }

    /// Wider by so many pixels on every side.
    pub fn grown(&self, by: i32) -> Self {
        let grow = |r: &Range<i32>| r.start.saturating_sub(by)..r.end.saturating_add(by);
        Self { columns: grow(&self.columns), rows: grow(&self.rows) }
    }

    pub fn intersection(&self, other: &Self) -> Self {
        let common = |a: &Range<i32>, b: &Range<i32>| a.start.max(b.start)..a.end.min(b.end);
        Self { columns: common(&self.columns, &other.columns), rows: common(&self.rows, &other.rows) }
    }
}

/// A face as it is kept with its cell: what comes first is read in order, not looked up all over the mesh.
#[derive(Clone, Copy, Debug, Default)]
pub struct CellFace {
    /// In the surface.
    pub number: u32,
    pub corners: [u32; 3],
}

/// Faces, each in the cell of its box.
#[derive(Clone, Debug)]
pub struct Cells {
    levels: Vec<Level>,
    /// Where the faces of a cell begin in `faces`; one entry more than there are cells.
    starts: Vec<u32>,
    faces: Vec<CellFace>,
}

#[derive(Clone, Debug)]
struct Level {
    first_cell: usize,
    across: i32,
    down: i32,
    /// How many levels finer, and this one, have a face.
    is_used: bool,
}

/// Collects faces for their cells.
pub struct CellSorter {
    levels: Vec<Level>,
    counts: Vec<u32>,
    /// Faces and their cells.
    pending: Vec<(CellFace, u32)>,
    bounds: Pixels,
}

impl CellSorter {
    /// For some `faces` seen in `bounds`.
    pub fn new(bounds: Pixels, faces: usize) -> Self {
        let (columns, rows) = (bounds.columns.len() as i32, bounds.rows.len() as i32);
        let mut levels = Vec::new();
        let mut cells = 0;
        loop {
            let side = FINEST << levels.len();
            let (across, down) = ((columns - 1) / side + 1, (rows - 1) / side + 1);
            levels.push(Level { first_cell: cells, across, down, is_used: false });
            cells += across as usize * down as usize;
            if across == 1 && down == 1 {
                break;
            }
        }
        // Counted one cell on, so that the sums become the starts.
        Self { levels, counts: vec![0; cells + 1], pending: Vec::with_capacity(faces), bounds }
    }

    /// Adds a face whose box of pixels, within the bounds, starts here and is so large.
    #[inline(always)]
    pub fn add(&mut self, face: CellFace, [column, row]: [i32; 2], size: i32) {
        // The number of bits beyond those of the finest cell.
        let level = (32 - ((size - 1) >> FINEST_LOG2).leading_zeros()) as usize;
        let level = level.min(self.levels.len() - 1);
        let shift = FINEST_LOG2 + level as u32;
        let (column, row) = (column - self.bounds.columns.start, row - self.bounds.rows.start);
        let Level { first_cell, across, .. } = self.levels[level];
        let cell = first_cell + ((row >> shift) * across + (column >> shift)) as usize;
        self.counts[cell + 1] += 1;
        self.pending.push((face, cell as u32));
    }

    /// Sorts them by cell, and in the order they were added within a cell.
    pub fn sort(self) -> Cells {
        let Self { mut levels, counts: mut starts, pending, .. } = self;
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        for level in &mut levels {
            let last = level.first_cell + level.across as usize * level.down as usize;
            level.is_used = starts[last] > starts[level.first_cell];
        }
        let mut next = starts.clone();
        let mut faces = vec![CellFace::default(); pending.len()];
        for (face, cell) in pending {
            let slot = &mut next[cell as usize];
            faces[*slot as usize] = face;
            *slot += 1;
        }
        Cells { levels, starts, faces }
    }
}

impl Cells {
    /// The faces that may be seen in a region, given from the first corner of the bounds, as runs of their list. The order
    /// of any two faces is the same for all regions.
    pub fn near(&self, region: &Pixels) -> impl Iterator<Item = &[CellFace]> {
        let region = region.clone();
        let used = self.levels.iter().enumerate().filter(|(_, level)| level.is_used);
        used.flat_map(move |(i, level)| {
            let side = FINEST << i;
            let cells = |range: &Range<i32>, count: i32| {
                (range.start / side - 1).max(0)..((range.end - 1) / side + 1).min(count)
            };
            let columns = cells(&region.columns, level.across);
            cells(&region.rows, level.down).map(move |row| {
                let cell = |column: i32| level.first_cell + (row * level.across + column) as usize;
                let start = self.starts[cell(columns.start)] as usize;
                // A region beyond the last column meets no cells.
                let end = self.starts[cell(columns.end.max(columns.start))] as usize;
                &self.faces[start..end]
            })
        })
    }
}
