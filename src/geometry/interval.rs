//! Stretches of a line, as parameter intervals in millimetres.

/// A closed stretch `start ≤ t ≤ end` of a line, mm. Either end may be infinite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    start: f64,
    end: f64,
}

impl Interval {
    /// The whole line.
    pub const EVERYTHING: Self = Self { start: f64::NEG_INFINITY, end: f64::INFINITY };

    /// From 0 to 1.
    pub const UNIT: Self = Self { start: 0.0, end: 1.0 };

    /// The interval, or `None` if `start > end` or an end is NaN.
    #[inline]
    pub fn new(start: f64, end: f64) -> Option<Self> {
        (start <= end).then_some(Self { start, end })
    }

    /// Where the stretch begins, mm.
    #[inline]
    pub fn start(&self) -> f64 {
        self.start
    }

    /// Where the stretch ends, mm.
    #[inline]
    pub fn end(&self) -> f64 {
        self.end
    }

    /// How long it is, mm.
    #[inline]
    pub fn length(&self) -> f64 {
        self.end - self.start
    }

    /// The common part, or `None` if there is none.
    #[inline]
    pub fn intersection(&self, other: &Self) -> Option<Self> {
        Self::new(self.start.max(other.start), self.end.min(other.end))
    }
}
