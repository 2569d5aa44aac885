//! What became of the rays that asked trees.

use serde::Serialize;

use crate::ritree::Reason;

/// What became of the rays that asked trees.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct QueryCounts {
    /// Queries of trees.
    pub queries: u64,
    /// Answered by interpolation, or by the proof that the cell is empty or that the line passes the box by.
    pub interpolated: u64,
    /// Traced: the cell lies across the body's outline.
    pub traced_silhouette: u64,
    /// Traced: more than two classes.
    pub traced_classes: u64,
    /// Traced: directions too far apart.
    pub traced_angle: u64,
    /// Traced: all corners miss, but the cell is not proved empty.
    pub traced_guard: u64,
    /// Not asked: the source or the target lies within the organ's box, so the whole line's chord does not serve.
    pub traced_source_or_target_inside: u64,
    /// Traced: the model of the squared chord may be off by more than the tolerance, as along the body's outline.
    pub traced_tolerance: u64,
    /// Not asked: the body has no tree, as it is not convex, or has so few faces that clipping is cheaper.
    pub traced_without_tree: u64,
}

impl std::ops::AddAssign for QueryCounts {
    fn add_assign(&mut self, other: Self) {
        self.queries += other.queries;
        self.interpolated += other.interpolated;
        self.traced_silhouette += other.traced_silhouette;
        self.traced_classes += other.traced_classes;
        self.traced_angle += other.traced_angle;
        self.traced_guard += other.traced_guard;
        self.traced_tolerance += other.traced_tolerance;
        self.traced_source_or_target_inside += other.traced_source_or_target_inside;
        self.traced_without_tree += other.traced_without_tree;
    }
}

impl QueryCounts {
    pub(in crate::modes::project) fn trace(&mut self, reason: Reason) {
        match reason {
            Reason::Silhouette => self.traced_silhouette += 1,
            Reason::Classes => self.traced_classes += 1,
            Reason::Angle => self.traced_angle += 1,
            Reason::Guard => self.traced_guard += 1,
            Reason::Tolerance => self.traced_tolerance += 1,
        }
    }
}
