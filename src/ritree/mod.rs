//! The ray interpolant tree of Atalay & Mount (§2): attributes of lines, sampled where they are asked for and
//! interpolated in between.
//!
//! ```text
//!   query (s,t,u,v) ─► descend ─► final leaf? ── yes ─► interpolate its 16 corners, or say why to trace
//!                                  │ no
//!                                  ▼
//!                       corners + midpoint decide: final, or split across the longest side
//!                       (8 corners kept, 8 new ones sampled, shared by both halves)
//! ```
//!
//! That is the paper's way. An [attribute](Attribute::sampling) may have cells looked at on every fourth level only, and lines
//! interpolated in the simplex that holds them: then the ends and the middle of a cell's diagonal mostly say that it is to be split.
//!
//! **The law:** what becomes of a cell is a pure function of the cell. So the answer to a line depends neither on the
//! order of queries, nor on threads, nor on what the cache still holds; where the cache has no room, the cells on the
//! way are computed, used and forgotten, but for what whoever asks remembers from one line to the next ([`Descent`]).
//!
//! Threads share a tree without locks on the way down: a node's halves and its final samples are written once. Only
//! the expansion of a node takes that node's lock.

pub mod attribute;
mod cache;
mod cell;
mod descent;
mod discontinuity;
mod fitted;
mod interpolant;
pub mod kept;
mod look;
mod node;
mod stats;
#[cfg(test)]
mod tests;

use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};

pub use attribute::{Attribute, Sampling, Scheme};
pub use cache::{Cache, oldest_to_keep};
pub use cell::{Place, Reason};
pub use descent::Descent;
pub use fitted::{Fit, Fitted, FittedTree, KeepableFit};
pub use kept::{Keepable, Loaded, Unreadable};
pub use stats::{BuildCounts, TreeShape};

use crate::geometry::Real;
use crate::linespace::{LinePoint, PlanePair};
use cell::Kind;
use interpolant::{Corners, Samples, interpolated};
use look::Look;
use node::Node;
use stats::BuildCounters;

/// The tree's settings; the defaults are the paper's.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Parameters {
    /// A cell splits if it is interpolated worse than this, in the attribute's own distance: in its middle, or where simplices go
    /// through the middle three quarters of how far they would be off there.
    pub distance_threshold: f64,
    /// Directions farther apart than this are not interpolated, degrees.
    pub angular_threshold_deg: f64,
    /// The depth at which cells are final whatever their middle says. More than 120 is as 120: cells are then as small
    /// as f64 can tell apart.
    pub max_depth: u32,
}

impl Default for Parameters {
    fn default() -> Self {
        Self { distance_threshold: 0.05, angular_threshold_deg: 30.0, max_depth: 28 }
    }
}

/// The answer to one line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer<T> {
    /// Interpolated, or proved to miss.
    Interpolated(T),
    /// The line is to be traced.
    Trace(Reason),
}

/// The RI-tree of one object: six kd-trees over line space, grown on demand.
pub struct RiTree<A: Attribute> {
    attribute: A,
    parameters: Parameters,
    roots: [OnceLock<Box<Node<A::Output>>>; 6],
    clock: AtomicU32,
    counters: BuildCounters,
}

impl<A: Attribute> RiTree<A> {
    /// A tree that has seen no line yet.
    pub fn new(attribute: A, parameters: Parameters) -> Self {
        Self {
            attribute,
            parameters,
            roots: Default::default(),
            clock: AtomicU32::new(1),
            counters: BuildCounters::default(),
        }
    }

    /// The attribute.
    pub fn attribute(&self) -> &A {
        &self.attribute
    }

    /// The attribute of a line near the object. `None` if the line cannot meet the object's box.
    ///
    /// Cells on the way that do not exist yet are made and kept while `cache` has room.
    pub fn query(&self, line: LinePoint, cache: &Cache) -> Option<Answer<A::Output>> {
        self.query_with_depth(line, cache).map(|(answer, _)| answer)
    }

    /// As [`query`](Self::query), with the depth of the final cell that answers: a function of the line alone, too.
    pub fn query_with_depth(&self, line: LinePoint, cache: &Cache) -> Option<(Answer<A::Output>, u32)> {
        self.descent().query_with_depth(line, cache)
    }

    /// To ask for many lines, one near the other if it can be: the same answers, sooner.
    pub fn descent(&self) -> Descent<'_, A> {
        Descent::new(self)
    }

    /// The root of a plane pair's tree, made if need be. `None` if the cache has no room for it.
    fn root(&self, pair: PlanePair, cache: &Cache) -> Option<&Node<A::Output>> {
        let root = &self.roots[pair.index()];
        if root.get().is_none() {
            let bytes = node::bytes::<A::Output>(1);
            if !cache.reserve(bytes) {
                return None;
            }
            if root.set(Box::default()).is_err() {
                // Another thread was first.
                cache.release(bytes);
            }
        }
        root.get().map(|node| &**node)
    }

    fn answer(&self, place: &Place, kind: Kind<&Samples<A::Output>>, stuv: [f64; 4]) -> Answer<A::Output> {
        let by_simplex = |samples: &Samples<_>| {
            place.of_simplex(&self.attribute, &samples.corners, stuv, &self.parameters)
        };
        match kind {
            Kind::Empty => Answer::Interpolated(self.attribute.miss()),
            Kind::Smooth(samples) => {
                let fractions = place.cell.fractions(&stuv.map(A::Real::of));
                Answer::Interpolated(interpolated(&self.attribute, samples, fractions))
            }
            Kind::TwoClasses(samples) => {
                let by_class =
                    || place.of_own_class(&self.attribute, &samples.corners, stuv, &self.parameters);
                let told = if self.attribute.sampling().parts { by_simplex(samples) } else { None };
                told.map_or_else(by_class, Ok).map_or_else(Answer::Trace, Answer::Interpolated)
            }
            Kind::Traced(reason) => Answer::Trace(reason),
            Kind::Parted(samples, reason) => {
                by_simplex(samples).map_or(Answer::Trace(reason), Answer::Interpolated)
            }
        }
    }

    fn split(&self, place: &Place, corners: &Corners<A::Output>) -> [Corners<A::Output>; 2] {
        self.counters.sampled(8, 24);
        place.split(&self.attribute, corners)
    }

    /// See [`Place::look`].
    fn look(&self, place: &Place, known: Option<Box<Corners<A::Output>>>) -> Look<A::Output> {
        place.look(&self.attribute, &self.parameters, known, |lines| self.counters.sampled(lines, 0))
    }

    /// Lets time pass for the least-recently-used rule; call it now and then, such as once per tile of rays.
    pub fn tick(&self) {
        // At the end of time, stamps stay at the last one and pruning keeps all of them; answers do not change.
        let _ = self.clock.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |t| t.checked_add(1));
    }

    /// As [`tick`](Self::tick), by the clock that trees under one cache share: a tree's own would make those seldom asked
    /// look old. Time does not run back.
    pub fn tick_to(&self, time: u32) {
        self.clock.fetch_max(time, Ordering::Relaxed);
    }

    /// Adds to `stamps` the time stamp and the bytes of each final leaf, and of each group of nodes that leads to one: all
    /// that [`prune`](Self::prune) may keep.
    pub fn collect_stamps(&self, stamps: &mut Vec<(u32, usize)>) {
        for root in self.nodes() {
            let newest = root.collect_stamps(stamps);
            stamps.extend(newest.map(|stamp| (stamp, node::bytes::<A::Output>(1))));
        }
    }

    /// Forgets all leaves with time stamps before `oldest_kept`, and all cells only they needed. Answers do not change:
    /// what is asked for again is built again.
    pub fn prune(&mut self, oldest_kept: u32, cache: &Cache) {
        for root in &mut self.roots {
            if let Some(node) = root.get_mut()
                && !node.prune(oldest_kept, cache)
            {
                root.take();
                cache.release(node::bytes::<A::Output>(1));
            }
        }
        self.counters.pruned();
    }

    /// What building took.
    pub fn build_counts(&self) -> BuildCounts {
        self.counters.get()
    }

    /// How many nodes and leaves there are, and how deep.
    pub fn shape(&self) -> TreeShape {
        let mut shape = TreeShape::default();
        self.nodes().for_each(|root| root.add_to(0, &mut shape));
        shape
    }

    fn nodes(&self) -> impl Iterator<Item = &Node<A::Output>> {
        self.roots.iter().filter_map(|root| root.get().map(|node| &**node))
    }

    /// Walks the whole tree and checks that what it stores is what the cells say: each corner is its line's sample,
    /// halves tile their cell and share the samples on the cut, final leaves are final and others are not, and the
    /// bytes add up. Returns the bytes. For tests: it samples every corner anew.
    ///
    /// # Panics
    /// If something is not so.
    pub fn check_invariants(&self) -> usize
    where
        A::Output: PartialEq + std::fmt::Debug,
    {
        let pairs = PlanePair::ALL.iter().zip(&self.roots);
        pairs
            .filter_map(|(&pair, root)| root.get().map(|node| (pair, node)))
            .map(|(pair, node)| node::bytes::<A::Output>(1) + node.check(&Place::root(pair), self))
            .sum()
    }
}
