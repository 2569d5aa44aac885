//! What a tree is made of and what it took to build.

use std::sync::atomic::{AtomicU64, Ordering};

use serde::Serialize;

use super::cell::Kind;

/// Counters of a tree's cold path; queries that only read never touch them.
#[derive(Debug, Default)]
pub struct BuildCounters {
    samples_taken: AtomicU64,
    samples_reused: AtomicU64,
    nodes_expanded: AtomicU64,
    transient_splits: AtomicU64,
    prunes: AtomicU64,
}

impl BuildCounters {
    pub fn sampled(&self, taken: u64, reused: u64) {
        self.samples_taken.fetch_add(taken, Ordering::Relaxed);
        self.samples_reused.fetch_add(reused, Ordering::Relaxed);
    }

    pub fn expanded(&self) {
        self.nodes_expanded.fetch_add(1, Ordering::Relaxed);
    }

    pub fn transient(&self) {
        self.transient_splits.fetch_add(1, Ordering::Relaxed);
    }

    pub fn pruned(&self) {
        self.prunes.fetch_add(1, Ordering::Relaxed);
    }

    pub fn get(&self) -> BuildCounts {
        BuildCounts {
            samples_taken: self.samples_taken.load(Ordering::Relaxed),
            samples_reused: self.samples_reused.load(Ordering::Relaxed),
            nodes_expanded: self.nodes_expanded.load(Ordering::Relaxed),
            transient_splits: self.transient_splits.load(Ordering::Relaxed),
            prunes: self.prunes.load(Ordering::Relaxed),
        }
    }
}

/// What building took so far. With a cache that is too small the numbers depend on the order of queries; answers do not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct BuildCounts {
    /// Lines sampled exactly: corners, and middles of midpoint tests.
    pub samples_taken: u64,
    /// Corners of halves taken over from the cell or from each other.
    pub samples_reused: u64,
    /// Nodes made final or split.
    pub nodes_expanded: u64,
    /// Cells split on the way to an answer and not kept, because the cache had no room.
    pub transient_splits: u64,
    /// Times that old leaves were forgotten.
    pub prunes: u64,
}

impl BuildCounts {
    /// Cells that were looked at, whether they could be kept or not. Where the cache is too small, the same ones again and again.
    pub fn cells(&self) -> u64 {
        self.nodes_expanded + self.transient_splits
    }
}

impl std::ops::AddAssign for BuildCounts {
    fn add_assign(&mut self, other: Self) {
        self.samples_taken += other.samples_taken;
        self.samples_reused += other.samples_reused;
        self.nodes_expanded += other.nodes_expanded;
        self.transient_splits += other.transient_splits;
        self.prunes += other.prunes;
    }
}

/// What a tree is made of.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct TreeShape {
    /// Nodes, split ones and leaves.
    pub nodes: u64,
    /// Final leaves that interpolate.
    pub smooth_leaves: u64,
    /// Final leaves proved to miss.
    pub empty_leaves: u64,
    /// Final leaves whose lines may have to be traced.
    pub traced_leaves: u64,
    /// Final leaves by depth.
    pub leaves_by_depth: Vec<u64>,
}

impl TreeShape {
    pub(super) fn add_leaf(&mut self, depth: usize, kind: Kind) {
        self.count_leaf(
            depth,
            match kind {
                Kind::Smooth(()) => |shape| &mut shape.smooth_leaves,
                Kind::Empty => |shape| &mut shape.empty_leaves,
                Kind::TwoClasses(()) | Kind::Traced(_) | Kind::Parted(..) => |shape| &mut shape.traced_leaves,
            },
        );
    }

    /// Counts a leaf of some depth in one of the numbers.
    pub fn count_leaf(&mut self, depth: usize, number: fn(&mut Self) -> &mut u64) {
        *number(self) += 1;
        if self.leaves_by_depth.len() <= depth {
            self.leaves_by_depth.resize(depth + 1, 0);
        }
        self.leaves_by_depth[depth] += 1;
    }

    /// Adds another tree's.
    pub fn add(&mut self, other: &Self) {
        self.nodes += other.nodes;
        self.smooth_leaves += other.smooth_leaves;
        self.empty_leaves += other.empty_leaves;
        self.traced_leaves += other.traced_leaves;
        let depths = self.leaves_by_depth.len().max(other.leaves_by_depth.len());
        self.leaves_by_depth.resize(depths, 0);
        self.leaves_by_depth.iter_mut().zip(&other.leaves_by_depth).for_each(|(a, b)| *a += b);
    }
}
