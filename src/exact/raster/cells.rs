//! Faces sorted by where they are seen, for any region to find its own.
//!
//! ```text
//!   level 0: 8 pixels        level 1: 16 pixels      … each face once: in the finest level whose cells are no smaller
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
    /// No pixels, to be joined with others.
    pub const NONE: Self = Self {
        columns: Range { start: i32::MAX, end: i32::MIN },
        rows: Range { start: i32::MAX, end: i32::MIN },
    };

    pub fn is_empty(&self) -> bool {
        self.columns.is_empty() || self.rows.is_empty()
    }

    /// The least rectangle that holds both.
    pub fn union(&self, other: &Self) -> Self {
        let both = |a: &Range<i32>, b: &Range<i32>| a.start.min(b.start)..a.end.max(b.end);
        Self { columns: both(&self.columns, &other.columns), rows: both(&self.rows, &other.rows) }
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
    /// The pixels that a face may cover: cells are counted from their first corner.
    bounds: Pixels,
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
    /// Whether a face is in it.
    is_used: bool,
}

impl Level {
    /// All levels for some pixels, from the finest to one of a single cell; and how many cells they have.
    fn all(bounds: &Pixels) -> (Vec<Self>, usize) {
        let (columns, rows) = (bounds.columns.len() as i32, bounds.rows.len() as i32);
        let (mut levels, mut cells) = (Vec::new(), 0);
        loop {
            let side = FINEST << levels.len();
            let (across, down) = ((columns - 1) / side + 1, (rows - 1) / side + 1);
            levels.push(Self { first_cell: cells, across, down, is_used: false });
            cells += across as usize * down as usize;
            if across <= 1 && down <= 1 {
                return (levels, cells);
            }
        }
    }
}

/// Collects faces for their cells.
pub struct CellSorter {
    /// Faces, where their boxes of pixels start, and how large these are.
    pending: Vec<(CellFace, [i32; 2], i32)>,
    low: [i32; 2],
    high: [i32; 2],
}

impl CellSorter {
    /// For at most so many faces.
    pub fn new(faces: usize) -> Self {
        Self { pending: Vec::with_capacity(faces), low: [i32::MAX; 2], high: [i32::MIN; 2] }
    }

    /// Adds a face whose box of pixels, not empty, goes from here to before there.
    #[inline(always)]
    pub fn add(&mut self, face: CellFace, start: [i32; 2], end: [i32; 2]) {
        let size = (end[0] - start[0]).max(end[1] - start[1]);
        self.pending.push((face, start, size));
        self.low = [self.low[0].min(start[0]), self.low[1].min(start[1])];
        self.high = [self.high[0].max(end[0]), self.high[1].max(end[1])];
    }

    /// Sorts them by cell, and in the order they were added within a cell.
    pub fn sort(self) -> Cells {
        let Self { pending, low, high } = self;
        if pending.is_empty() {
            let bounds = Pixels { columns: 0..0, rows: 0..0 };
            return Cells { bounds, levels: Vec::new(), starts: Vec::new(), faces: Vec::new() };
        }
        let bounds = Pixels { columns: low[0]..high[0], rows: low[1]..high[1] };
        let (mut levels, cells) = Level::all(&bounds);
        let coarsest = levels.len() - 1;
        let cell_of = |&(_, [column, row], size): &(CellFace, [i32; 2], i32)| {
            // The number of bits beyond those of the finest cell.
            let level = ((32 - ((size - 1) >> FINEST_LOG2).leading_zeros()) as usize).min(coarsest);
            let shift = FINEST_LOG2 + level as u32;
            let Level { first_cell, across, .. } = levels[level];
            first_cell + (((row - low[1]) >> shift) * across + ((column - low[0]) >> shift)) as usize
        };
        // Counted one cell on, so that the sums become the starts.
        let mut starts = vec![0; cells + 1];
        pending.iter().for_each(|face| starts[cell_of(face) + 1] += 1);
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        let mut faces = vec![CellFace::default(); pending.len()];
        for face in &pending {
            let slot = &mut next[cell_of(face)];
            faces[*slot as usize] = face.0;
            *slot += 1;
        }
        for level in &mut levels {
            let last = level.first_cell + level.across as usize * level.down as usize;
            level.is_used = starts[last] > starts[level.first_cell];
        }
        Cells { bounds, levels, starts, faces }
    }
}

impl Cells {
    /// The faces that may be seen in a region, as runs of their list. The order of any two faces is the same for all
    /// regions.
    pub fn near(&self, region: &Pixels) -> impl Iterator<Item = &[CellFace]> {
        let common = self.bounds.intersection(region);
        let within = |range: &Range<i32>, start: i32| range.start - start..range.end - start;
        let region = Pixels {
            columns: within(&common.columns, self.bounds.columns.start),
            rows: within(&common.rows, self.bounds.rows.start),
        };
        // A region without pixels meets no faces.
        let levels = if region.is_empty() { &[] } else { &self.levels[..] };
        let used = levels.iter().enumerate().filter(|(_, level)| level.is_used);
        used.flat_map(move |(i, level)| {
            let side = FINEST << i;
            let cells = |range: &Range<i32>, count: i32| {
                (range.start / side - 1).max(0)..((range.end - 1) / side + 1).min(count)
            };
            let columns = cells(&region.columns, level.across);
            cells(&region.rows, level.down).map(move |row| {
                let cell = |column: i32| level.first_cell + (row * level.across + column) as usize;
                &self.faces
                    [self.starts[cell(columns.start)] as usize..self.starts[cell(columns.end)] as usize]
            })
        })
    }
}
