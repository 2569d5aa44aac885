//! What a cell's samples decide: whether it is final, and what its lines get. Pure functions of the cell.

use super::Parameters;
use super::attribute::Attribute;
use super::discontinuity::{Classes, spread_exceeds};
use super::interpolant::{Corners, interpolated};
use crate::geometry::Real;
use crate::linespace::{Cell, LinePoint, PlanePair};

/// Where cells are final whatever the parameters say: 3/2³⁰ wide, still many times the rounding of an intercept. Much
/// deeper, halving a cell would give the cell again, without end.
const DEEPEST: u32 = 120;

/// What is to be done with a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Its halves are to be looked at.
    Split,
    /// It answers its lines itself.
    Final(Kind),
}

/// How a final cell answers its lines, with the corners that it needs to. The order of these, and of the reasons, is part of
/// the format of [kept](super::kept) trees.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Kind<C = ()> {
    /// No line meets the object, proved.
    Empty,
    /// By interpolation of its corners.
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
    /// The same kind with other corners.
    pub fn map<D>(self, map: impl FnOnce(C) -> D) -> Kind<D> {
        match self {
            Self::Empty => Kind::Empty,
            Self::Smooth(corners) => Kind::Smooth(map(corners)),
            Self::TwoClasses(corners) => Kind::TwoClasses(map(corners)),
            Self::Traced(reason) => Kind::Traced(reason),
            Self::Parted(corners, reason) => Kind::Parted(map(corners), reason),
        }
    }

    /// The kind alone.
    pub fn bare(&self) -> Kind {
        self.as_ref().map(|_| ())
    }

    /// The corners, if they are needed.
    pub fn corners(&self) -> Option<&C> {
        match self {
            Self::Smooth(corners) | Self::TwoClasses(corners) | Self::Parted(corners, _) => Some(corners),
            Self::Empty | Self::Traced(_) => None,
        }
    }

    /// The same kind with its corners where they are.
    pub fn as_ref(&self) -> Kind<&C> {
        match self {
            Self::Empty => Kind::Empty,
            Self::Smooth(corners) => Kind::Smooth(corners),
            Self::TwoClasses(corners) => Kind::TwoClasses(corners),
            Self::Traced(reason) => Kind::Traced(*reason),
            Self::Parted(corners, reason) => Kind::Parted(corners, *reason),
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

    /// The outlines of all 16 corners.
    pub fn sample<A: Attribute>(&self, attribute: &A) -> Corners<A::Output> {
        std::array::from_fn(|bits| attribute.outline(self.line(self.cell.corner(bits))))
    }

    /// The corners' whole samples.
    pub fn finish<A: Attribute>(&self, attribute: &A, corners: &mut Corners<A::Output>) {
        for (bits, corner) in corners.iter_mut().enumerate() {
            attribute.finish(self.line(self.cell.corner(bits)), corner);
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
    fn ends_discontinuities<A: Attribute>(&self, attribute: &A, parameters: &Parameters) -> bool {
        let spared = attribute.sampling().levels_spared;
        self.depth.saturating_add(spared) >= parameters.max_depth || self.is_deepest(parameters)
    }

    /// Whether its samples are looked at. If not, it is split unseen.
    pub fn is_looked_at<A: Attribute>(&self, attribute: &A, parameters: &Parameters) -> bool {
        let above = parameters.max_depth.min(DEEPEST).saturating_sub(self.depth);
        let sampling = attribute.sampling();
        above.is_multiple_of(sampling.levels_per_look) || above == sampling.levels_spared
    }

    /// Its corners and what is to be done with it, computed anew: what others made of it is held against that.
    pub fn anew<A: Attribute>(
        &self,
        attribute: &A,
        parameters: &Parameters,
    ) -> (Corners<A::Output>, Verdict) {
        let mut corners = self.sample(attribute);
        let verdict = match self.is_looked_at(attribute, parameters) {
            true => self.verdict(attribute, &mut corners, parameters, || ()),
            false => Verdict::Split,
        };
        (corners, verdict)
    }

    /// What is to be done with the cell (§2.3, and §2.5 for its kind). Its corners are finished if that tells it;
    /// `middle_sampled` is told of each sample of a midpoint test.
    pub fn verdict<A: Attribute>(
        &self,
        attribute: &A,
        corners: &mut Corners<A::Output>,
        parameters: &Parameters,
        middle_sampled: impl Fn(),
    ) -> Verdict {
        let ends_discontinuities = self.ends_discontinuities(attribute, parameters);
        // No interpolant crosses a discontinuity; smaller cells leave fewer lines on it.
        let parted = |why, corners: &mut _| match ends_discontinuities {
            true => Verdict::Final(self.parted(attribute, corners, why, parameters)),
            false => Verdict::Split,
        };
        if let Some(why) = Classes::of(corners, |c| attribute.outline_class(c)).reason() {
            return parted(why, corners);
        }
        if attribute.is_miss(attribute.outline_class(&corners[0])) {
            return if attribute.is_certainly_empty(self.pair, &self.cell) {
                Verdict::Final(Kind::Empty)
            } else if ends_discontinuities {
                Verdict::Final(Kind::Traced(Reason::Guard))
            } else {
                Verdict::Split
            };
        }
        if attribute.outline_within(&corners[0]).is_some() {
            let outlines =
                corners.each_ref().map(|c| attribute.outline_within(c).unwrap_or_else(|| c.clone()));
            let by_outlines = self.smoothness(attribute, &outlines, parameters, |line| {
                middle_sampled();
                attribute.outline(line)
            });
            if by_outlines != Smoothness::Smooth {
                return self.judged(by_outlines, attribute, corners, parameters);
            }
        }
        self.finish(attribute, corners);
        if let Some(why) = Classes::of(corners, |c| attribute.class(c)).reason() {
            return parted(why, corners);
        }
        if attribute.is_told_by_outline(&corners[0]) {
            return Verdict::Final(Kind::Smooth(()));
        }
        let smoothness = self.smoothness(attribute, corners, parameters, |line| {
            middle_sampled();
            attribute.sample(line)
        });
        self.judged(smoothness, attribute, corners, parameters)
    }

    fn judged<A: Attribute>(
        &self,
        smoothness: Smoothness,
        attribute: &A,
        corners: &mut Corners<A::Output>,
        parameters: &Parameters,
    ) -> Verdict {
        match smoothness {
            Smoothness::Smooth => Verdict::Final(Kind::Smooth(())),
            Smoothness::Rough => Verdict::Split,
            Smoothness::Wide => Verdict::Final(self.parted(attribute, corners, Reason::Angle, parameters)),
        }
    }

    /// How a cell of one class is by how near to each other its corners are, and by the midpoint test: interpolated against exact
    /// at the cell's centre.
    fn smoothness<A: Attribute>(
        &self,
        attribute: &A,
        corners: &Corners<A::Output>,
        parameters: &Parameters,
        exact: impl Fn(LinePoint) -> A::Output,
    ) -> Smoothness {
        let is_wide = spread_exceeds(attribute, corners.iter(), parameters.angular_threshold_deg);
        match (is_wide, self.is_deepest(parameters)) {
            (true, true) => return Smoothness::Wide,
            // Smaller cells hold directions nearer to each other.
            (true, false) => return Smoothness::Rough,
            (false, true) => return Smoothness::Smooth,
            (false, false) => {}
        }
        let middle = exact(self.line(self.cell.at([0.5; 4])));
        let near = || interpolated(attribute, corners, [A::Real::of(0.5); 4]);
        let is_near = attribute.class(&middle) == attribute.class(&corners[0])
            && attribute.distance(&near(), &middle) <= parameters.distance_threshold;
        if is_near { Smoothness::Smooth } else { Smoothness::Rough }
    }
}

/// What the corners of a cell of one class say of the lines between.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Smoothness {
    Smooth,
    /// Halves may be smooth.
    Rough,
    /// Directions differ by more than the threshold, in a cell that has no halves.
    Wide,
}
