//! What a tree of fitted cells holds: counted, forgotten, and held against its law.

use std::mem::size_of;
use std::sync::atomic::Ordering;

use super::{Fit, FittedTree, Node, Stamped, State};
use crate::linespace::PlanePair;
use crate::ritree::cache::Cache;
use crate::ritree::cell::Place;
use crate::ritree::stats::{BuildCounts, TreeShape};

impl<F: Fit> FittedTree<F> {
    /// As [`RiTree::tick_to`](crate::ritree::RiTree::tick_to).
    pub fn tick_to(&self, time: u32) {
        self.clock.fetch_max(time, Ordering::Relaxed);
    }

    /// Adds to `stamps` the time stamp and the bytes of all that [`prune`](Self::prune) may keep.
    pub fn collect_stamps(&self, stamps: &mut Vec<(u32, usize)>) {
        self.roots.iter().for_each(|root| {
            self.collect_stamps_of(root, stamps);
        });
    }

    /// Parts of a cell live as long as the newest leaf among them.
    fn collect_stamps_of(&self, node: &Node<F::Leaf>, stamps: &mut Vec<(u32, usize)>) -> Option<u32> {
        match node.state.get()? {
            State::Final(stamped) => {
                let stamp = stamped.stamp.load(Ordering::Relaxed);
                stamps.push((stamp, self.leaf_bytes(&stamped.leaf)));
                Some(stamp)
            }
            State::Split(parts) => {
                let newest = parts.iter().filter_map(|part| self.collect_stamps_of(part, stamps)).max();
                stamps.extend(newest.map(|stamp| (stamp, Self::parts_bytes())));
                newest
            }
        }
    }

    /// Forgets all leaves with time stamps before `oldest_kept`, and all cells only they needed. Answers do not change.
    pub fn prune(&mut self, oldest_kept: u32, cache: &Cache) {
        let Self { fit, roots, .. } = self;
        for root in roots {
            root.prune(oldest_kept, &mut |leaf| {
                let bytes = match leaf {
                    Some(leaf) => size_of::<Stamped<F::Leaf>>() + fit.bytes_beside(leaf),
                    None => Self::parts_bytes(),
                };
                cache.release(bytes);
            });
        }
        self.counters.pruned();
    }

    /// What building took.
    pub fn build_counts(&self) -> BuildCounts {
        self.counters.get()
    }

    /// How many cells and leaves there are, and how deep.
    pub fn shape(&self) -> TreeShape {
        let mut shape = TreeShape::default();
        self.roots.iter().for_each(|root| self.add_shape_of(root, 0, &mut shape));
        shape
    }

    fn add_shape_of(&self, node: &Node<F::Leaf>, depth: usize, shape: &mut TreeShape) {
        let Some(state) = node.state.get() else { return };
        shape.nodes += 1;
        match state {
            State::Final(stamped) => self.fit.count(&stamped.leaf, depth, shape),
            State::Split(parts) => parts.iter().for_each(|part| self.add_shape_of(part, depth + 4, shape)),
        }
    }

    /// Walks the whole tree and checks that what it stores is what the cells say, and that the bytes add up. Returns the
    /// bytes. For tests: it fits every cell anew.
    ///
    /// # Panics
    /// If something is not so.
    pub fn check_invariants(&self) -> usize
    where
        F::Leaf: PartialEq + std::fmt::Debug,
    {
        (0..3).map(|axis| self.check(&self.roots[axis], &Place::root(PlanePair::ALL[2 * axis]))).sum()
    }

    fn check(&self, node: &Node<F::Leaf>, place: &Place) -> usize
    where
        F::Leaf: PartialEq + std::fmt::Debug,
    {
        let Some(state) = node.state.get() else { return 0 };
        let anew = self.leaf_of(place);
        match state {
            State::Final(stamped) => {
                assert_eq!(anew.as_ref(), Some(&stamped.leaf), "a leaf is its cell's fit");
                self.leaf_bytes(&stamped.leaf)
            }
            State::Split(parts) => {
                assert_eq!(anew, None, "only cells that must are split");
                let of_part = |bits: usize| self.check(&parts[bits], &place.part(bits));
                Self::parts_bytes() + (0..16).map(of_part).sum::<usize>()
            }
        }
    }
}

impl<L> Node<L> {
    /// Forgets old leaves below; calls `forget` with each, and with `None` for each cell's parts. Whether anything is left.
    fn prune(&mut self, oldest_kept: u32, forget: &mut impl FnMut(Option<&L>)) -> bool {
        let is_needed = match self.state.get_mut() {
            None => return false,
            Some(State::Final(stamped)) => {
                let is_new = *stamped.stamp.get_mut() >= oldest_kept;
                if !is_new {
                    forget(Some(&stamped.leaf));
                }
                is_new
            }
            Some(State::Split(parts)) => {
                let mut is_needed = false;
                for part in parts.iter_mut() {
                    is_needed |= part.prune(oldest_kept, forget);
                }
                if !is_needed {
                    forget(None);
                }
                is_needed
            }
        };
        if !is_needed {
            self.state.take();
        }
        is_needed
    }
}
