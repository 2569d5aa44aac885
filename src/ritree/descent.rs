//! One line after another down a tree.
//!
//! Lines asked one after another mostly lie in one cell, or in cells near each other. So whoever asks remembers the last one's way
//! down: its final cell often answers the next line as well, and if not, a cell little higher leads to the one that does. Where
//! the cache had no room, the cells below are remembered whole, a few kilobytes, so that what those of neighbouring lines have
//! in common is not computed for each. Answers are those of the cells, whatever is remembered.

use std::sync::atomic::Ordering;

use super::attribute::Attribute;
use super::cell::Place;
use super::interpolant::Corners;
use super::look::Look;
use super::node::{Leaf, Node};
use super::{Answer, Cache, Reason, RiTree};
use crate::linespace::{LinePoint, is_in_range};

/// Asks a tree for one line after another, by one thread.
pub struct Descent<'t, A: Attribute> {
    tree: &'t RiTree<A>,
    /// The last way down the tree, from a root.
    path: Vec<(Place, &'t Node<A::Output>)>,
    /// Cells of the last way down that the cache had no room for, from the highest to a final one.
    trail: Vec<Step<A::Output>>,
}

/// A cell that is kept nowhere else.
struct Step<T> {
    place: Place,
    look: Look<T>,
    /// Its corners, if they were those of a half of the cell above.
    corners: Option<Corners<T>>,
    /// The corners of the other half, which cost nothing more.
    beside: Option<Corners<T>>,
}

impl<'t, A: Attribute> Descent<'t, A> {
    pub(super) fn new(tree: &'t RiTree<A>) -> Self {
        Self { tree, path: Vec::new(), trail: Vec::new() }
    }

    /// The tree.
    pub fn tree(&self) -> &'t RiTree<A> {
        self.tree
    }

    /// As [`RiTree::query`].
    #[inline]
    pub fn query(&mut self, line: LinePoint, cache: &Cache) -> Option<Answer<A::Output>> {
        self.query_with_depth(line, cache).map(|(answer, _)| answer)
    }

    /// As [`RiTree::query_with_depth`].
    pub fn query_with_depth(&mut self, line: LinePoint, cache: &Cache) -> Option<(Answer<A::Output>, u32)> {
        let tree = self.tree;
        let line =
            if tree.attribute.is_symmetric() && line.pair.is_reversed() { line.reversed() } else { line };
        if !line.stuv.iter().all(|x| x.is_finite()) {
            // Overflow on the way to box units says nothing about the line.
            return Some((Answer::Trace(Reason::Guard), 0));
        }
        if !is_in_range(&line.stuv) {
            return None;
        }
        while self.path.pop_if(|(place, _)| !place.holds(&line)).is_some() {}
        if self.path.last().is_none_or(|(_, node)| node.leaf().is_none())
            && self.trail.first().is_some_and(|step| step.place.holds(&line))
        {
            return Some(self.answer_along_trail(&line));
        }
        let (mut place, mut node) = match self.path.last() {
            Some(&lowest) => lowest,
            None => {
                let place = Place::root(line.pair);
                let Some(root) = tree.root(line.pair, cache) else {
                    return Some(self.answer_without_keeping(place, None, &line));
                };
                self.path.push((place, root));
                (place, root)
            }
        };
        loop {
            if let Some(leaf) = node.leaf() {
                return Some(self.answer_by(place, leaf, &line));
            }
            let side = place.side_of::<A::Real>(&line.stuv);
            let Some(halves) = node.halves() else {
                match node.expand(&place, tree, cache) {
                    Ok(()) => continue,
                    Err(corners) => return Some(self.answer_without_keeping(place, corners, &line)),
                }
            };
            (place, node) = (place.half(side), &halves[side]);
            self.path.push((place, node));
        }
    }

    fn answer_by(&self, place: Place, leaf: &Leaf<A::Output>, line: &LinePoint) -> (Answer<A::Output>, u32) {
        leaf.touch(self.tree.clock.load(Ordering::Relaxed));
        (self.tree.answer(&place, leaf.kind(), line.stuv), place.depth)
    }

    /// The same answer, computed below a cell that the cache has no room to expand.
    fn answer_without_keeping(
        &mut self,
        start: Place,
        corners: Option<Box<Corners<A::Output>>>,
        line: &LinePoint,
    ) -> (Answer<A::Output>, u32) {
        self.trail.clear();
        self.push(start, corners, None);
        self.answer_along_trail(line)
    }

    /// Of a line in the trail's highest cell.
    fn answer_along_trail(&mut self, line: &LinePoint) -> (Answer<A::Output>, u32) {
        let mut at = self.trail.iter().rposition(|step| step.place.holds(line)).unwrap_or(0);
        loop {
            let Step { place, look, .. } = &self.trail[at];
            if let Look::Final(kind) = look {
                let kind = kind.as_ref().map(|samples| &**samples);
                return (self.tree.answer(place, kind, line.stuv), place.depth);
            }
            let side = place.side_of::<A::Real>(&line.stuv);
            self.turn_to(at, side);
            at += 1;
        }
    }

    /// Makes a half of the cell at `at` the last step.
    fn turn_to(&mut self, at: usize, side: usize) {
        let next = if self.trail.len() > at + 1 { Some(self.trail.swap_remove(at + 1)) } else { None };
        self.trail.truncate(at + 1);
        let Step { place, look, .. } = &self.trail[at];
        let half = place.half(side);
        match (next, look) {
            // The way led to the other half, whose corners are there.
            (Some(Step { corners: Some(corners), beside: Some(wanted), .. }), _) => {
                self.push(half, Some(Box::new(wanted)), Some(corners));
                return;
            }
            (_, Look::Split(Some(corners))) if !self.tree.attribute.sampling().remembers => {
                let [lower, upper] = self.tree.split(place, corners);
                let (wanted, other) = if side == 0 { (lower, upper) } else { (upper, lower) };
                self.push(half, Some(Box::new(wanted)), Some(other));
            }
            _ => self.push(half, None, None),
        }
        self.tree.counters.transient();
    }

    /// Makes a cell the last step, with its corners if they are known.
    fn push(
        &mut self,
        place: Place,
        corners: Option<Box<Corners<A::Output>>>,
        beside: Option<Corners<A::Output>>,
    ) {
        let kept = beside.as_ref().and_then(|_| corners.as_deref().cloned());
        let look = self.tree.look(&place, corners);
        self.trail.push(Step { place, look, corners: kept, beside });
    }
}
