//! What a cell's samples decide: whether it is final, and what its lines get (§2.3). Pure functions of the cell.

use super::Parameters;
use super::attribute::{Attribute, Scheme};
use super::cell::{Kind, Place, Reason};
use super::discontinuity::{Classes, spread_exceeds};
use super::interpolant::{Corners, DIAGONAL, Samples, halfway, quadrilinear};
use crate::geometry::Real;
use crate::linespace::LinePoint;

/// What is to be done with a cell.
#[derive(Clone, Debug, PartialEq)]
pub enum Look<T> {
    /// Its halves are to be looked at. With its corners, if all of them were sampled.
    Split(Option<Box<Corners<T>>>),
    /// It answers its lines itself.
    Final(Kind<Box<Samples<T>>>),
}

/// As [`Look`], of a cell whose corners are at hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verdict {
    Split,
    Final(Kind),
}

/// What the corners of a cell of one class say of the lines between.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Smoothness<T> {
    /// They may be interpolated. With the middle's sample, if that helps.
    Smooth(Option<T>),
    /// Halves may be smooth.
    Rough,
    /// Directions differ by more than the threshold, in a cell that has no halves.
    Wide,
}

impl Place {
    /// What is to be done with the cell, whose corners may be known; `sampled` is told of how many lines are sampled.
    pub fn look<A: Attribute>(
        &self,
        attribute: &A,
        parameters: &Parameters,
        known: Option<Box<Corners<A::Output>>>,
        sampled: impl Fn(u64),
    ) -> Look<A::Output> {
        if !self.is_looked_at(attribute, parameters) {
            return Look::Split(None);
        }
        let corners = match known {
            Some(corners) => *corners,
            // The ends of the diagonal are sampled again with the other corners: it takes an attribute that remembers them.
            None if attribute.sampling().remembers => {
                if let Some(look) = self.told_by_diagonal(attribute, parameters, &sampled) {
                    return look;
                }
                sampled(16 - DIAGONAL.len() as u64);
                self.sample(attribute)
            }
            None => {
                sampled(16);
                self.sample(attribute)
            }
        };
        let mut samples = Samples { corners, middle: None };
        match self.verdict(attribute, &mut samples, parameters, sampled) {
            Verdict::Split => Look::Split(Some(Box::new(samples.corners))),
            Verdict::Final(kind) => Look::Final(kind.map(|()| Box::new(samples))),
        }
    }

    /// What the ends of the cell's diagonal and its middle tell: the same as all of its samples. `None` if it takes the others.
    fn told_by_diagonal<A: Attribute>(
        &self,
        attribute: &A,
        parameters: &Parameters,
        sampled: impl Fn(u64),
    ) -> Option<Look<A::Output>> {
        let split = Some(Look::Split(None));
        let mut ends = DIAGONAL.map(|bits| attribute.outline(self.corner(bits)));
        sampled(DIAGONAL.len() as u64);
        let [from, to] = ends.each_ref().map(|end| attribute.outline_class(end));
        let both_miss = from == to && attribute.is_miss(from);
        if both_miss && attribute.is_certainly_empty(self.pair, &self.cell) {
            return Some(Look::Final(Kind::Empty));
        }
        if self.ends_discontinuities(attribute, parameters)
            || attribute.sampling().scheme != Scheme::Simplicial
        {
            return None;
        }
        if both_miss || from != to {
            return split;
        }
        // Where all corners are looked at, the middle is asked for again, and counted then.
        let mut middles = 0;
        if let [Some(from), Some(to)] = ends.each_ref().map(|end| attribute.outline_within(end)) {
            middles = 1;
            let middle = attribute.outline(self.middle());
            if !is_near(attribute, halfway(attribute, [&from, &to]), &middle, parameters) {
                sampled(middles);
                return split;
            }
        }
        DIAGONAL.iter().zip(&mut ends).for_each(|(bits, end)| attribute.finish(self.corner(*bits), end));
        let [from, to] = &ends;
        if attribute.class(from) != attribute.class(to) {
            sampled(middles);
            return split;
        }
        if attribute.is_told_by_outline(from) {
            return None;
        }
        let middle = attribute.sample(self.middle());
        if is_near(attribute, halfway(attribute, [from, to]), &middle, parameters) {
            return None;
        }
        sampled(1);
        split
    }

    /// What is to be done with the cell, and §2.5 for its kind. Its corners are finished if that tells it.
    fn verdict<A: Attribute>(
        &self,
        attribute: &A,
        samples: &mut Samples<A::Output>,
        parameters: &Parameters,
        sampled: impl Fn(u64),
    ) -> Verdict {
        let Samples { corners, middle } = samples;
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
        let judged = |smoothness, corners: &mut Corners<_>, kept: &mut Option<Box<_>>| match smoothness {
            Smoothness::Smooth(_) if !self.are_joined(attribute, corners, 0..16) => {
                parted(Reason::Silhouette, corners)
            }
            Smoothness::Smooth(middle) => {
                *kept = middle.map(Box::new);
                Verdict::Final(Kind::Smooth(()))
            }
            Smoothness::Rough => Verdict::Split,
            Smoothness::Wide => Verdict::Final(self.parted(attribute, corners, Reason::Angle, parameters)),
        };
        let mut by_outlines = None;
        if attribute.outline_within(&corners[0]).is_some() {
            let outlines =
                corners.each_ref().map(|c| attribute.outline_within(c).unwrap_or_else(|| c.clone()));
            let smoothness = self.smoothness(attribute, &outlines, parameters, |line| {
                sampled(1);
                attribute.outline(line)
            });
            if !matches!(smoothness, Smoothness::Smooth(_)) {
                return judged(smoothness, corners, middle);
            }
            by_outlines = Some(smoothness);
        }
        self.finish(attribute, corners);
        if let Some(why) = Classes::of(corners, |c| attribute.class(c)).reason() {
            return parted(why, corners);
        }
        let smoothness =
            by_outlines.filter(|_| attribute.is_told_by_outline(&corners[0])).unwrap_or_else(|| {
                self.smoothness(attribute, corners, parameters, |line| {
                    sampled(1);
                    attribute.sample(line)
                })
            });
        judged(smoothness, corners, middle)
    }

    /// How a cell of one class is by how near to each other its corners are, and by the midpoint test.
    fn smoothness<A: Attribute>(
        &self,
        attribute: &A,
        corners: &Corners<A::Output>,
        parameters: &Parameters,
        exact: impl Fn(LinePoint) -> A::Output,
    ) -> Smoothness<A::Output> {
        let is_wide = spread_exceeds(attribute, corners.iter(), parameters.angular_threshold_deg);
        match (is_wide, self.is_deepest(parameters)) {
            (true, true) => return Smoothness::Wide,
            // Smaller cells hold directions nearer to each other.
            (true, false) => return Smoothness::Rough,
            (false, true) => return Smoothness::Smooth(None),
            (false, false) => {}
        }
        let middle = exact(self.middle());
        let told = match attribute.sampling().scheme {
            Scheme::Quadrilinear => quadrilinear(attribute, corners, [A::Real::of(0.5); 4]),
            Scheme::Simplicial => halfway(attribute, DIAGONAL.map(|bits| &corners[bits])),
        };
        match (is_near(attribute, told, &middle, parameters), attribute.sampling().scheme) {
            (false, _) => Smoothness::Rough,
            (true, Scheme::Quadrilinear) => Smoothness::Smooth(None),
            (true, Scheme::Simplicial) => Smoothness::Smooth(Some(middle)),
        }
    }
}

/// The midpoint test: whether what is told of a cell's middle is near to its sample, and of its class.
fn is_near<A: Attribute>(
    attribute: &A,
    told: A::Output,
    middle: &A::Output,
    parameters: &Parameters,
) -> bool {
    let left = match attribute.sampling().scheme {
        Scheme::Quadrilinear => 1.0,
        Scheme::Simplicial => LEFT_BY_MIDDLE,
    };
    attribute.class(middle) == attribute.class(&told)
        && left * attribute.distance(&told, middle) <= parameters.distance_threshold
}

/// What is left of the greatest error within a cell where simplices are [interpolated through its
/// middle](super::interpolant::Samples), as a share of the error that there would be in the middle. Of an output that bends
/// alike in all directions errors are an eighth of the squared lengths of the edges: the diagonal's, which is halved, is 4 in sides
/// of the cell, the longest others' are 3.
const LEFT_BY_MIDDLE: f64 = 0.75;
