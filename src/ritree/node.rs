//! Nodes: cells that are still to be looked at, split, or final.

use std::mem::size_of;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

use super::RiTree;
use super::attribute::Attribute;
use super::cache::Cache;
use super::cell::{Kind, Place};
use super::interpolant::{Corners, Samples};
use super::look::Look;
use super::stats::TreeShape;

/// A cell of the tree. A node that holds neither leaf nor halves nor corners was pruned, or never looked at.
pub struct Node<T> {
    below: OnceLock<Below<T>>,
    /// Corners sampled when the parent was split, kept until the node is expanded. The lock is for expanding only.
    corners: Mutex<Option<Box<Corners<T>>>>,
}

/// What a cell that was looked at has become.
enum Below<T> {
    Halves(Box<[Node<T>; 2]>),
    Leaf(Leaf<T>),
}

impl<T> Default for Node<T> {
    fn default() -> Self {
        Self { below: OnceLock::new(), corners: Mutex::new(None) }
    }
}

/// A final cell, with samples where it answers by them.
pub struct Leaf<T> {
    kind: Kind<Box<Samples<T>>>,
    stamp: AtomicU32,
}

impl<T> Leaf<T> {
    pub fn new(kind: Kind<Box<Samples<T>>>, stamp: u32) -> Self {
        Self { kind, stamp: AtomicU32::new(stamp) }
    }

    pub fn kind(&self) -> Kind<&Samples<T>> {
        self.kind.as_ref().map(|samples| &**samples)
    }

    /// Bytes beside its node.
    fn bytes(&self) -> usize {
        leaf_bytes(&self.kind)
    }

    /// Marks the leaf as used at `time`. Written only when it changes, so that threads do not fight for the line.
    pub fn touch(&self, time: u32) {
        if self.stamp.load(Ordering::Relaxed) != time {
            self.stamp.store(time, Ordering::Relaxed);
        }
    }
}

/// The bytes of a leaf beside its node.
pub fn leaf_bytes<T>(kind: &Kind<Box<Samples<T>>>) -> usize {
    let of_middle = |samples: &Samples<T>| samples.middle.as_ref().map_or(0, |_| size_of::<T>());
    kind.samples().map_or(0, |samples| size_of::<Samples<T>>() + of_middle(samples))
}

/// The most that a leaf may hold.
const fn most_leaf_bytes<T>() -> usize {
    size_of::<Samples<T>>() + size_of::<T>()
}

/// The bytes of `n` nodes.
pub fn bytes<T>(n: usize) -> usize {
    n * size_of::<Node<T>>()
}

impl<T> Below<T> {
    /// Bytes beside the node whose it is.
    fn bytes(&self) -> usize {
        match self {
            Self::Halves(_) => bytes::<T>(2),
            Self::Leaf(leaf) => leaf.bytes(),
        }
    }
}

impl<T: Clone + Send + Sync> Node<T> {
    pub fn leaf(&self) -> Option<&Leaf<T>> {
        match self.below.get() {
            Some(Below::Leaf(leaf)) => Some(leaf),
            _ => None,
        }
    }

    pub fn halves(&self) -> Option<&[Self; 2]> {
        match self.below.get() {
            Some(Below::Halves(halves)) => Some(halves),
            _ => None,
        }
    }

    /// Splits a node that is known to be, without a look. The cache is to have room for the halves.
    pub fn split_unseen(&self) -> Option<&[Self; 2]> {
        self.below.get_or_init(|| Below::Halves(Box::default()));
        self.halves()
    }

    /// Makes a node final by a leaf that is known. The cache is to have room for it.
    pub fn finish(&self, leaf: Leaf<T>) {
        let _ = self.below.set(Below::Leaf(leaf));
    }

    fn lock(&self) -> MutexGuard<'_, Option<Box<Corners<T>>>> {
        // A panic while expanding leaves the corners taken: they are sampled again.
        self.corners.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Gives the node its leaf or its halves, as its cell says. If the cache has no room, the node stays as it is and its corners
    /// are the error (or `None` if it has none).
    pub fn expand<A>(
        &self,
        place: &Place,
        tree: &RiTree<A>,
        cache: &Cache,
    ) -> Result<(), Option<Box<Corners<T>>>>
    where
        A: Attribute<Output = T>,
    {
        let mut guard = self.lock();
        if self.below.get().is_some() {
            return Ok(());
        }
        let of_corners = size_of::<Corners<T>>();
        let held = if guard.is_some() { of_corners } else { 0 };
        // Corners of halves wait, unless they are sampled again sooner than kept.
        let waiting = if tree.attribute.sampling().remembers { 0 } else { 2 * of_corners };
        // Room for the larger outcome is taken first; what is not needed is given back.
        let room = most_leaf_bytes::<T>().max(bytes::<T>(2) + waiting);
        if !cache.reserve(room) {
            return Err(guard.clone());
        }
        let (below, kept) = match tree.look(place, guard.take()) {
            Look::Final(kind) => {
                let leaf = Leaf::new(kind, tree.clock.load(Ordering::Relaxed));
                let kept = leaf.bytes();
                (Below::Leaf(leaf), kept)
            }
            Look::Split(Some(corners)) if waiting > 0 => {
                let half = |corners| Self { corners: Mutex::new(Some(Box::new(corners))), ..Self::default() };
                let halves = tree.split(place, &corners).map(half);
                (Below::Halves(Box::new(halves)), bytes::<T>(2) + waiting)
            }
            Look::Split(_) => (Below::Halves(Box::default()), bytes::<T>(2)),
        };
        let _ = self.below.set(below);
        tree.counters.expanded();
        cache.release(room - kept + held);
        Ok(())
    }

    /// See [`RiTree::collect_stamps`]; returns the newest stamp. A pair of halves lives as long as the newest leaf below.
    pub fn collect_stamps(&self, stamps: &mut Vec<(u32, usize)>) -> Option<u32> {
        if let Some(leaf) = self.leaf() {
            let stamp = leaf.stamp.load(Ordering::Relaxed);
            stamps.push((stamp, leaf.bytes()));
            return Some(stamp);
        }
        let newest = self.halves()?.iter().filter_map(|half| half.collect_stamps(stamps)).max();
        stamps.extend(newest.map(|stamp| (stamp, bytes::<T>(2))));
        newest
    }

    /// Forgets old leaves and corners that wait; whether anything is left.
    pub fn prune(&mut self, oldest_kept: u32, cache: &Cache) -> bool {
        if self.corners.get_mut().unwrap_or_else(PoisonError::into_inner).take().is_some() {
            cache.release(size_of::<Corners<T>>());
        }
        let is_needed = match self.below.get_mut() {
            None => false,
            Some(Below::Leaf(leaf)) => *leaf.stamp.get_mut() >= oldest_kept,
            Some(Below::Halves(halves)) => {
                let [lower, upper] = halves.each_mut().map(|half| half.prune(oldest_kept, cache));
                lower | upper
            }
        };
        if !is_needed && let Some(below) = self.below.take() {
            cache.release(below.bytes());
        }
        is_needed
    }

    pub fn add_to(&self, depth: usize, shape: &mut TreeShape) {
        shape.nodes += 1;
        if let Some(leaf) = self.leaf() {
            shape.add_leaf(depth, leaf.kind().bare());
        }
        self.halves().into_iter().flatten().for_each(|half| half.add_to(depth + 1, shape));
    }

    /// See [`RiTree::check_invariants`]; returns the bytes below and in this node, without the node itself.
    pub fn check<A>(&self, place: &Place, tree: &RiTree<A>) -> usize
    where
        A: Attribute<Output = T>,
        T: PartialEq + std::fmt::Debug,
    {
        let anew = place.look(&tree.attribute, &tree.parameters, None, |_| ());
        if let Some(leaf) = self.leaf() {
            assert!(self.lock().is_none(), "a final leaf holds only its own corners");
            assert_eq!(
                Look::Final(leaf.kind.clone()),
                anew,
                "a final leaf is final, and stored samples are their lines'"
            );
            return leaf.bytes();
        }
        if let Some(halves) = self.halves() {
            assert!(self.lock().is_none(), "a split node keeps no corners");
            assert!(matches!(anew, Look::Split(_)), "only cells that must are split");
            let inside = |side: usize| halves[side].check(&place.half(side), tree);
            return bytes::<T>(2) + inside(0) + inside(1);
        }
        self.lock().as_ref().map_or(0, |corners| {
            // Which of them are finished depends on the cells that they came through.
            let finished = |mut corners: Corners<T>| {
                place.finish(&tree.attribute, &mut corners);
                corners
            };
            let sampled = place.sample(&tree.attribute);
            assert_eq!(
                finished((**corners).clone()),
                finished(sampled),
                "waiting corners are their lines' samples"
            );
            size_of::<Corners<T>>()
        })
    }
}
