//! Rectangles of an image.

use std::ops::Range;

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

    /// Whether any pixel is in both.
    #[inline(always)]
    pub fn meets(&self, other: &Self) -> bool {
        let meet = |a: &Range<i32>, b: &Range<i32>| a.start < b.end && b.start < a.end;
        meet(&self.columns, &other.columns) && meet(&self.rows, &other.rows)
    }

    pub fn intersection(&self, other: &Self) -> Self {
        let common = |a: &Range<i32>, b: &Range<i32>| a.start.max(b.start)..a.end.min(b.end);
        Self { columns: common(&self.columns, &other.columns), rows: common(&self.rows, &other.rows) }
    }
}
