//! Nodes: cells that are still to be looked at, split, or final.

use std::mem::size_of;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

use super::RiTree;
use super::attribute::Attribute;
use super::cache::Cache;
use super::cell::{Corners, Kind, Place, Verdict};
use super::stats::TreeShape;

/// A cell of the tree. A node that holds neither leaf nor halves nor corners was pruned, or never looked at.
pub struct Node<T> {
    halves: OnceLock<Box<[Node<T>; 2]>>,
    leaf: OnceLock<Box<Leaf<T>>>,
    /// Corners sampled when the parent was split, kept until the node is expanded. The lock is for expanding only.
    corners: Mutex<Option<Box<Corners<T>>>>,
}

impl<T> Default for Node<T> {
    fn default() -> Self {
        Self { halves: OnceLock::new(), leaf: OnceLock::new(), corners: Mutex::new(None) }
    }
}

/// A final cell.
pub struct Leaf<T> {
    corners: Corners<T>,
    kind: Kind,
    stamp: AtomicU32,
}

impl<T> Leaf<T> {
    pub fn new(kind: Kind, corners: Corners<T>, stamp: u32) -> Self {
        Self { corners, kind, stamp: AtomicU32::new(stamp) }
    }

    pub fn kind(&self) -> Kind {
        self.kind
    }

    pub fn corners(&self) -> &Corners<T> {
        &self.corners
    }

    /// Marks the leaf as used at `time`. Written only when it changes, so that threads do not fight for the line.
    pub fn touch(&self, time: u32) {
        if self.stamp.load(Ordering::Relaxed) != time {
            self.stamp.store(time, Ordering::Relaxed);
        }
    }
}

/// The bytes of `n` nodes.
pub fn bytes<T>(n: usize) -> usize {
    n * size_of::<Node<T>>()
}

impl<T: Clone + Send + Sync> Node<T> {
    pub fn leaf(&self) -> Option<&Leaf<T>> {
        self.leaf.get().map(|leaf| &**leaf)
    }

    pub fn halves(&self) -> Option<&[Self; 2]> {
        self.halves.get().map(|halves| &**halves)
    }

    /// Splits a node that is known to be, without a look. The cache is to have room for the halves.
    pub fn split_unseen(&self) -> &[Self; 2] {
        self.halves.get_or_init(Box::default)
    }

    /// Makes a node final by a leaf that is known. The cache is to have room for it.
    pub fn finish(&self, leaf: Leaf<T>) {
        let _ = self.leaf.set(Box::new(leaf));
    }

    fn lock(&self) -> MutexGuard<'_, Option<Box<Corners<T>>>> {
        // A panic while expanding leaves the corners taken: they are sampled again.
        self.corners.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Gives the node its leaf or its halves, as its cell says. If the cache has no room, the node stays as it is and its
    /// corners are the error (or `None` if it has none).
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
        if self.leaf.get().is_some() || self.halves.get().is_some() {
            return Ok(());
        }
        let held = if guard.is_some() { size_of::<Corners<T>>() } else { 0 };
        // Room for the larger outcome is taken first; what is not needed is given back.
        let largest = (bytes::<T>(2) + 2 * size_of::<Corners<T>>()).max(size_of::<Leaf<T>>());
        if !cache.reserve(largest) {
            return Err(guard.clone());
        }
        let mut corners = guard.take().unwrap_or_else(|| Box::new(tree.sample_corners(place)));
        let kept = match tree.verdict(place, &mut corners) {
            Verdict::Final(kind) => {
                let now = tree.clock.load(Ordering::Relaxed);
                let _ = self.leaf.set(Box::new(Leaf::new(kind, *corners, now)));
                size_of::<Leaf<T>>()
            }
            Verdict::Split => {
                let halves = tree
                    .split(place, &corners)
                    .map(|corners| Self { corners: Mutex::new(Some(Box::new(corners))), ..Self::default() });
                let _ = self.halves.set(Box::new(halves));
                bytes::<T>(2) + 2 * size_of::<Corners<T>>()
            }
        };
        tree.counters.expanded();
        cache.release(largest - kept + held);
        Ok(())
    }

    /// See [`RiTree::collect_stamps`]; returns the newest stamp. A pair of halves lives as long as the newest leaf below.
    pub fn collect_stamps(&self, stamps: &mut Vec<(u32, usize)>) -> Option<u32> {
        if let Some(leaf) = self.leaf() {
            let stamp = leaf.stamp.load(Ordering::Relaxed);
            stamps.push((stamp, size_of::<Leaf<T>>()));
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
        if let Some(leaf) = self.leaf.get() {
            if leaf.stamp.load(Ordering::Relaxed) >= oldest_kept {
                return true;
            }
            self.leaf.take();
            cache.release(size_of::<Leaf<T>>());
            return false;
        }
        let Some(halves) = self.halves.get_mut() else { return false };
        let mut is_needed = false;
        for half in halves.iter_mut() {
            is_needed |= half.prune(oldest_kept, cache);
        }
        if !is_needed {
            self.halves.take();
            cache.release(bytes::<T>(2));
        }
        is_needed
    }

    pub fn add_to(&self, depth: usize, shape: &mut TreeShape) {
        shape.nodes += 1;
        if let Some(leaf) = self.leaf() {
            shape.add_leaf(depth, leaf.kind());
        }
        self.halves().into_iter().flatten().for_each(|half| half.add_to(depth + 1, shape));
    }

    /// See [`RiTree::check_invariants`]; returns the bytes below and in this node, without the node itself.
    pub fn check<A>(&self, place: &Place, tree: &RiTree<A>) -> usize
    where
        A: Attribute<Output = T>,
        T: PartialEq + std::fmt::Debug,
    {
        let mut sampled = place.sample(&tree.attribute);
        let verdict = place.verdict(&tree.attribute, &mut sampled, &tree.parameters, || ());
        // Corners are finished as the cells need that they came through.
        let finished = |corners: &Corners<T>| {
            let mut corners = corners.clone();
            place.finish(&tree.attribute, &mut corners);
            corners
        };
        if let Some(leaf) = self.leaf() {
            assert!(
                self.halves().is_none() && self.lock().is_none(),
                "a final leaf holds only its own corners"
            );
            assert_eq!(
                finished(&leaf.corners),
                finished(&sampled),
                "stored corners are their lines' samples"
            );
            assert_eq!(Verdict::Final(leaf.kind), verdict, "a final leaf is final");
            return size_of::<Leaf<T>>();
        }
        if let Some(halves) = self.halves() {
            assert!(self.lock().is_none(), "a split node keeps no corners");
            assert_eq!(verdict, Verdict::Split, "only cells that must are split");
            let inside = |side: usize| halves[side].check(&place.half(side), tree);
            return bytes::<T>(2) + inside(0) + inside(1);
        }
        self.lock().as_ref().map_or(0, |corners| {
            assert_eq!(finished(corners), finished(&sampled), "waiting corners are their lines' samples");
            size_of::<Corners<T>>()
        })
    }
}
