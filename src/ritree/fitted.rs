//! A tree of cells that are fitted as a whole: no samples at corners, but a model for all lines of a cell.
//!
//! ```text
//!   level 0   one cell of a plane pair ──┬─ 16 parts, halved across s, t, u and v ─┬─ … unseen down to the first level
//!                                        └─ …                                      └─ there, and below where it must be:
//!                                                                                     a fit, final or to be split
//! ```
//!
//! The law is the tree's of the paper: what becomes of a cell is a function of the cell, so that no answer depends on the order
//! of queries, on threads, or on what the cache still holds.

mod kept;
mod upkeep;

use std::mem::size_of;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};

use super::cache::Cache;
use super::cell::Place;
use super::stats::{BuildCounters, TreeShape};
use crate::linespace::PlanePair;
use crate::linespace::image::{PlaneForms, Runs};
pub use kept::KeepableFit;

/// Fits cells. Every method must be a pure function of its arguments.
pub trait Fit: Sync {
    /// What answers the lines of a final cell.
    type Leaf: Send + Sync;

    /// Cells above this level are split without a look. A cell of level n is 3/2ⁿ wide.
    fn first_level(&self) -> u32;

    /// Fits a cell of the first level or of one below.
    fn fit(&self, place: &Place) -> Fitted<Self::Leaf>;

    /// The bytes that a leaf holds, besides itself.
    fn bytes_beside(&self, leaf: &Self::Leaf) -> usize;

    /// The most that any leaf may hold besides itself.
    fn most_bytes_beside(&self) -> usize;

    /// Counts a leaf in the shape of its tree.
    fn count(&self, leaf: &Self::Leaf, depth: usize, shape: &mut TreeShape);
}

/// What a fit says of a cell.
pub struct Fitted<L> {
    /// The lines sampled.
    pub samples: u64,
    /// The leaf. `None` if the cell is to be split.
    pub leaf: Option<L>,
}

/// A cell: unknown, split or final.
struct Node<L> {
    state: OnceLock<State<L>>,
}

enum State<L> {
    Split(Box<[Node<L>; 16]>),
    Final(Box<Stamped<L>>),
}

struct Stamped<L> {
    leaf: L,
    stamp: AtomicU32,
}

impl<L> Default for Node<L> {
    fn default() -> Self {
        Self { state: OnceLock::new() }
    }
}

/// Intercepts are numbered in steps of 3/2²⁴.
const STEP_BITS: u32 = 24;

/// A point of line space in whole steps, from whose bits a descent reads its way.
fn steps_of(stuv: &[f64; 4]) -> [u32; 4] {
    const SCALE: f64 = (1_u32 << STEP_BITS) as f64 / 3.0;
    // The cast keeps to the range; a line on the rim of the root's cell belongs to its last part.
    stuv.map(|x| (((x + 1.0) * SCALE) as u32).min((1 << STEP_BITS) - 1))
}

/// Which of a cell's 16 parts holds the point, at the level of the cell.
fn part_of(steps: &[u32; 4], level: u32) -> usize {
    let bit = STEP_BITS - 1 - level;
    (0..4).map(|a| ((steps[a] >> bit & 1) as usize) << a).sum()
}

impl Place {
    /// One of the 16 parts that halving across each axis makes; bit `a` says low or high on axis `a`.
    fn part(&self, bits: usize) -> Self {
        (0..4).fold(*self, |place, axis| place.half(bits >> axis & 1))
    }

    fn level(&self) -> u32 {
        self.depth / 4
    }
}

/// The fitted tree of one object: a tree for each axis, as lines and their reverse share a fit.
pub struct FittedTree<F: Fit> {
    fit: F,
    roots: [Node<F::Leaf>; 3],
    clock: AtomicU32,
    counters: BuildCounters,
}

impl<F: Fit> FittedTree<F> {
    /// A tree that has seen no line yet.
    pub fn new(fit: F) -> Self {
        Self { fit, roots: Default::default(), clock: AtomicU32::new(1), counters: BuildCounters::default() }
    }

    /// What fits the cells.
    pub fn fit(&self) -> &F {
        &self.fit
    }

    /// Asks the leaf of the cell that holds a line.
    #[inline]
    pub fn ask<R>(
        &self,
        pair: PlanePair,
        stuv: &[f64; 4],
        cache: &Cache,
        ask: impl FnOnce(&F::Leaf, u32) -> R,
    ) -> R {
        let steps = steps_of(stuv);
        let mut node = &self.roots[pair.index() / 2];
        let mut level = 0;
        loop {
            match node.state.get() {
                Some(State::Split(parts)) => {
                    node = &parts[part_of(&steps, level)];
                    level += 1;
                }
                Some(State::Final(stamped)) => {
                    self.touch(stamped);
                    return ask(&stamped.leaf, 4 * level);
                }
                None => {
                    let place = (0..level).fold(Place::root(pair), |place, l| place.part(part_of(&steps, l)));
                    if !self.expand(node, &place, cache) {
                        return self.ask_without_keeping(place, &steps, ask);
                    }
                }
            }
        }
    }

    /// As [`ask`](Self::ask), for some lines at a time: level by level, so that their ways to memory overlap.
    pub fn ask_all(
        &self,
        lines: &[(PlanePair, [f64; 4])],
        cache: &Cache,
        mut ask: impl FnMut(usize, &F::Leaf),
    ) {
        let steps: Vec<_> = lines.iter().map(|(_, stuv)| steps_of(stuv)).collect();
        let mut nodes: Vec<_> = lines.iter().map(|(pair, _)| &self.roots[pair.index() / 2]).collect();
        for level in 0..STEP_BITS {
            let mut is_split = false;
            for (node, steps) in nodes.iter_mut().zip(&steps) {
                if let Some(State::Split(parts)) = node.state.get() {
                    *node = &parts[part_of(steps, level)];
                    is_split = true;
                }
            }
            if !is_split {
                break;
            }
        }
        for node in &nodes {
            if let Some(State::Final(stamped)) = node.state.get() {
                // Read now, while none waits for it.
                std::hint::black_box(stamped.stamp.load(Ordering::Relaxed));
            }
        }
        for (i, ((pair, stuv), node)) in lines.iter().zip(nodes).enumerate() {
            match node.state.get() {
                Some(State::Final(stamped)) => {
                    self.touch(stamped);
                    ask(i, &stamped.leaf);
                }
                _ => self.ask(*pair, stuv, cache, |leaf, _| ask(i, leaf)),
            }
        }
    }

    /// The same answer, by fits that are not kept.
    fn ask_without_keeping<R>(
        &self,
        mut place: Place,
        steps: &[u32; 4],
        ask: impl FnOnce(&F::Leaf, u32) -> R,
    ) -> R {
        loop {
            if let Some(leaf) = self.leaf_of(&place) {
                return ask(&leaf, place.depth);
            }
            self.counters.transient();
            place = place.part(part_of(steps, place.level()));
        }
    }

    /// Visits the leaves of the cells that pixels of an image lie in, each with its pixels.
    pub fn visit(
        &self,
        pair: PlanePair,
        forms: &PlaneForms,
        pixels: &Runs,
        cache: &Cache,
        visit: &mut dyn FnMut(&F::Leaf, &Runs),
    ) {
        self.visit_node(Some(&self.roots[pair.index() / 2]), &Place::root(pair), forms, pixels, cache, visit);
    }

    /// `node` is `None` where nothing is kept.
    fn visit_node(
        &self,
        node: Option<&Node<F::Leaf>>,
        place: &Place,
        forms: &PlaneForms,
        pixels: &Runs,
        cache: &Cache,
        visit: &mut dyn FnMut(&F::Leaf, &Runs),
    ) {
        let node = node.filter(|node| node.state.get().is_some() || self.expand(node, place, cache));
        let parts = match node.and_then(|node| node.state.get()) {
            Some(State::Final(stamped)) => {
                self.touch(stamped);
                return visit(&stamped.leaf, pixels);
            }
            Some(State::Split(parts)) => Some(parts),
            None => match self.leaf_of(place) {
                Some(leaf) => return visit(&leaf, pixels),
                None => {
                    self.counters.transient();
                    None
                }
            },
        };
        self.visit_parts(
            &mut |bits, pixels| {
                let node = parts.map(|parts| &parts[bits]);
                self.visit_node(node, &place.part(bits), forms, pixels, cache, visit);
            },
            place,
            forms,
            pixels,
            0,
            0,
        );
    }

    /// Parts the pixels by the part of the cell that they lie in, axis by axis.
    fn visit_parts(
        &self,
        visit: &mut dyn FnMut(usize, &Runs),
        place: &Place,
        forms: &PlaneForms,
        pixels: &Runs,
        axis: usize,
        bits: usize,
    ) {
        if axis == 4 {
            return visit(bits, pixels);
        }
        let middle = 0.5 * (place.cell.low[axis] + place.cell.high[axis]);
        pixels.cut(&forms.numerators[axis].plus(-middle, forms.denominator), |is_high, pixels| {
            self.visit_parts(visit, place, forms, pixels, axis + 1, bits | usize::from(is_high) << axis);
        });
    }

    fn touch(&self, stamped: &Stamped<F::Leaf>) {
        // Written only when it changes, so that threads do not fight for the line.
        let now = self.clock.load(Ordering::Relaxed);
        if stamped.stamp.load(Ordering::Relaxed) != now {
            stamped.stamp.store(now, Ordering::Relaxed);
        }
    }

    /// The leaf of a cell. `None` if it is to be split.
    fn leaf_of(&self, place: &Place) -> Option<F::Leaf> {
        if place.level() < self.fit.first_level() {
            return None;
        }
        let fitted = self.fit.fit(place);
        self.counters.sampled(fitted.samples, 0);
        fitted.leaf
    }

    /// Makes a node final or splits it; whether the cache had room.
    #[cold]
    fn expand(&self, node: &Node<F::Leaf>, place: &Place, cache: &Cache) -> bool {
        // Room for the larger outcome is taken first; what is not needed is given back.
        let largest = Self::parts_bytes().max(self.most_leaf_bytes());
        if !cache.reserve(largest) {
            return false;
        }
        let mut kept = 0;
        node.state.get_or_init(|| {
            self.counters.expanded();
            match self.leaf_of(place) {
                Some(leaf) => {
                    kept = self.leaf_bytes(&leaf);
                    let stamp = AtomicU32::new(self.clock.load(Ordering::Relaxed));
                    State::Final(Box::new(Stamped { leaf, stamp }))
                }
                None => {
                    kept = Self::parts_bytes();
                    State::Split(Box::default())
                }
            }
        });
        cache.release(largest - kept);
        true
    }

    fn parts_bytes() -> usize {
        16 * size_of::<Node<F::Leaf>>()
    }

    fn leaf_bytes(&self, leaf: &F::Leaf) -> usize {
        size_of::<Stamped<F::Leaf>>() + self.fit.bytes_beside(leaf)
    }

    fn most_leaf_bytes(&self) -> usize {
        size_of::<Stamped<F::Leaf>>() + self.fit.most_bytes_beside()
    }
}
