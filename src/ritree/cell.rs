//! Cells of line space, and the kinds of final ones.

use super::Parameters;
use super::attribute::Attribute;
use super::interpolant::Corners;
use crate::geometry::Real;
use crate::linespace::{Cell, LinePoint, PlanePair};

/// Where cells are final whatever the parameters say: 3/2³⁰ wide, still many times the rounding of an intercept. Much
/// deeper, halving a cell would give the cell again, without end.
const DEEPEST: u32 = 120;

/// How a final cell answers its lines, with the samples that it needs to. The order of these, and of the reasons, is part of
/// the format of [kept](super::kept) trees.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Kind<C = ()> {
    /// No line meets the object, proved.
    Empty,
    /// By interpolation.
    Smooth(C),
    /// A discontinuity between outlines of two classes cuts it: a line that no [simplex](super::interpolant::Simplex) of one
    /// class holds is located, and interpolated from the samples on its side if they suffice.
    TwoClasses(C),
    /// By tracing.
    Traced(Reason),
    /// Its corners do not fit together, but those of a simplex may: lines that none of one class holds are traced, and why.
    Parted(C, Reason),
}

impl<C> Kind<C> {
    /// The same kind with other samples.
    pub fn map<D>(self, map: impl FnOnce(C) -> D) -> Kind<D> {
        match self {
            Self::Empty => Kind::Empty,
            Self::Smooth(samples) => Kind::Smooth(map(samples)),
            Self::TwoClasses(samples) => Kind::TwoClasses(map(samples)),
            Self::Traced(reason) => Kind::Traced(reason),
            Self::Parted(samples, reason) => Kind::Parted(map(samples), reason),
        }
    }

    /// The kind alone.
    pub fn bare(&self) -> Kind {
        self.as_ref().map(|_| ())
    }

    /// The samples, if they are needed.
    pub fn samples(&self) -> Option<&C> {
        match self {
            Self::Smooth(samples) | Self::TwoClasses(samples) | Self::Parted(samples, _) => Some(samples),
            Self::Empty | Self::Traced(_) => None,
        }
    }

    /// The same kind with its samples where they are.
    pub fn as_ref(&self) -> Kind<&C> {
        match self {
            Self::Empty => Kind::Empty,
            Self::Smooth(samples) => Kind::Smooth(samples),
            Self::TwoClasses(samples) => Kind::TwoClasses(samples),
            Self::Traced(reason) => Kind::Traced(*reason),
            Self::Parted(samples, reason) => Kind::Parted(samples, *reason),
        }
    }
}

/// Why a line is traced instead of interpolated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Reason {
    /// Its cell lies across the object's outline, or another single discontinuity.
    Silhouette,
    /// Its cell holds more than two classes.
    Classes,
    /// Output directions of its cell differ by more than the angular threshold.
    Angle,
    /// All corners miss, and nothing proves that the lines between do.
    Guard,
    /// The cell's model may be off by more than the tolerance there.
    Tolerance,
}

/// A cell of one plane pair, as deep in the tree as it is small.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// The plane pair.
    pub pair: PlanePair,
    /// The cell.
    pub cell: Cell,
    /// How often the root's cell was halved.
    pub depth: u32,
}

impl Place {
    /// All lines of a plane pair.
    pub fn root(pair: PlanePair) -> Self {
        Self { pair, cell: Cell::ROOT, depth: 0 }
    }

    /// The axis that the cell is split across: the longest, which in a cube of halved cells is each in turn.
    pub fn axis(&self) -> usize {
        self.depth as usize % 4
    }

    /// Which half holds the point: 0 or 1.
    #[inline]
    pub fn side_of<R: Real>(&self, stuv: &[f64; 4]) -> usize {
        let axis = self.axis();
        let middle = R::of(0.5) * (R::of(self.cell.low[axis]) + R::of(self.cell.high[axis]));
        usize::from(stuv[axis] >= middle.get())
    }

    /// One half: 0 or 1.
    #[inline]
    pub fn half(&self, side: usize) -> Self {
        Self { cell: self.cell.halves(self.axis())[side], depth: self.depth + 1, ..*self }
    }

    /// Whether a descent for the line comes through this cell: cells hold their lower border, and those on the rim of the range
    /// what is rounded beyond it.
    #[inline]
    pub fn holds(&self, line: &LinePoint) -> bool {
        let (Cell { low, high }, rim) = (&self.cell, Cell::ROOT);
        let is_above = |a: usize| line.stuv[a] >= low[a] || low[a] == rim.low[a];
        let is_below = |a: usize| line.stuv[a] < high[a] || high[a] == rim.high[a];
        self.pair == line.pair && (0..4).all(|a| is_above(a) && is_below(a))
    }

    pub(super) fn line(&self, stuv: [f64; 4]) -> LinePoint {
        LinePoint { pair: self.pair, stuv }
    }

    /// The line of a corner, by its bits.
    pub(super) fn corner(&self, bits: usize) -> LinePoint {
        self.line(self.cell.corner(bits))
    }

    /// The line in the middle.
    pub(super) fn middle(&self) -> LinePoint {
        self.line(self.cell.at([0.5; 4]))
    }

    /// The outlines of all 16 corners.
    pub fn sample<A: Attribute>(&self, attribute: &A) -> Corners<A::Output> {
        std::array::from_fn(|bits| attribute.outline(self.corner(bits)))
    }

    /// The corners' whole samples.
    pub fn finish<A: Attribute>(&self, attribute: &A, corners: &mut Corners<A::Output>) {
        for (bits, corner) in corners.iter_mut().enumerate() {
            attribute.finish(self.corner(bits), corner);
        }
    }

    /// The corners of the two halves: 8 of each are the cell's own, 8 new ones are sampled and shared.
    pub fn split<A: Attribute>(
        &self,
        attribute: &A,
        corners: &Corners<A::Output>,
    ) -> [Corners<A::Output>; 2] {
        let axis = self.axis();
        let lower = self.half(0).cell;
        let is_high = |bits: usize| bits >> axis & 1 == 1;
        // The lower half's high side lies on the cut.
        let cut: [Option<A::Output>; 16] = std::array::from_fn(|bits| {
            is_high(bits).then(|| attribute.outline(self.line(lower.corner(bits))))
        });
        let on_cut = |bits: usize| cut[bits | 1 << axis].clone();
        let pick = |own: bool, bits: usize| match on_cut(bits) {
            Some(sample) if !own => sample,
            _ => corners[bits].clone(),
        };
        [
            std::array::from_fn(|bits| pick(!is_high(bits), bits)),
            std::array::from_fn(|bits| pick(is_high(bits), bits)),
        ]
    }

    /// Whether the cell is final whatever its samples say.
    pub fn is_deepest(&self, parameters: &Parameters) -> bool {
        self.depth >= parameters.max_depth.min(DEEPEST)
    }

    /// Whether it is final if it holds a discontinuity, or all of its corners miss.
    pub(super) fn ends_discontinuities<A: Attribute>(&self, attribute: &A, parameters: &Parameters) -> bool {
        let spared = attribute.sampling().levels_spared;
        self.depth.saturating_add(spared) >= parameters.max_depth || self.is_deepest(parameters)
    }

    /// Whether its samples are looked at. If not, it is split unseen.
    pub fn is_looked_at<A: Attribute>(&self, attribute: &A, parameters: &Parameters) -> bool {
        let above = parameters.max_depth.min(DEEPEST).saturating_sub(self.depth);
        let sampling = attribute.sampling();
        above.is_multiple_of(sampling.levels_per_look) || above == sampling.levels_spared
    }
}
