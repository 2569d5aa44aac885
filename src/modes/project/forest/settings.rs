//! How trees are grown: what is interpolated, how well, in how much memory, and of which bodies.

use serde::Serialize;

use super::Demand;
use crate::ritree::Parameters;

/// How lengths between samples are found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "interpolation", rename_all = "kebab-case")]
pub enum Interpolation {
    /// The paper's: each cell's 16 corners, by its thresholds.
    Quadrilinear {
        /// The thresholds and the depth.
        parameters: Parameters,
    },
    /// A cubic of the squared chord in each cell, to within a tolerance.
    SquaredChord {
        /// Of 1000 lengths, 999 are within this of the exact one, mm; what is left is no farther than five times it.
        tolerance_mm: f64,
    },
}

/// How far lengths may be off if nobody says, mm: somewhat more than the facets of an organ of twenty thousand faces are, so
/// that cells are as large as they can be.
pub const DEFAULT_TOLERANCE_MM: f64 = 0.5;

impl Default for Interpolation {
    fn default() -> Self {
        Self::SquaredChord { tolerance_mm: DEFAULT_TOLERANCE_MM }
    }
}

/// How RI-trees are grown.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TreeSettings {
    /// What is interpolated, and how well.
    #[serde(flatten)]
    pub interpolation: Interpolation,
    /// The most that nodes and samples of all trees may hold, bytes.
    pub cache_bytes: usize,
    /// The share of the cache that pruning keeps.
    pub kept_share: f64,
    /// Bodies with fewer face planes than this are clipped: that is cheaper than a query. Asked one beside the other, warm, a
    /// quadrilinear query is as dear as clipping some 40 planes (70 while the tree is built, 150 or more of rays in no order).
    pub least_planes: usize,
    /// Whether bodies that are not convex have trees of squared chords. In images, where the raster is quicker than trees that
    /// leave their outlines to be traced, that pays for bodies of many more faces than pixels only.
    pub general_bodies: bool,
    /// What the study asks, if only those bodies are to be put in trees for which that is the [quicker](super::Estimate).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub demand: Option<Demand>,
}

impl Default for TreeSettings {
    fn default() -> Self {
        Self {
            interpolation: Interpolation::default(),
            cache_bytes: 100_000_000,
            kept_share: 0.3,
            least_planes: 48,
            general_bodies: true,
            demand: None,
        }
    }
}
