//! Which organs are put in trees, if the method is to choose: those for which a small model of costs says that a tree is the
//! quicker for what the study asks.
//!
//! The exact side is the engines' own estimate, see [`Body::cheapest_for_image`]; that of a tree is
//!
//! | for each | is paid for |
//! |---|---|
//! | face | the walker's tables, by which leaves are sampled |
//! | view | making the body ready, and what leaves it is the first to ask for: ever fewer |
//! | pixel | evaluating leaves, and tracing what they do not know |
//!
//! Only ratios of costs matter. `chordfield bench choice` measures how far the choices are from the best.

use serde::Serialize;

use super::{DEFAULT_TOLERANCE_MM, Interpolation, TreeSettings};
use crate::exact::{Body, Engine};

/// What a study asks of its organs: views of so many pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Demand {
    /// Views.
    pub views: u64,
    /// Pixels of all views.
    pub pixels: u64,
}

/// What an organ is estimated to take, which decides how it is found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// The quickest exact engine.
    pub engine: Engine,
    /// By that engine, seconds.
    pub exact_s: f64,
    /// By a tree, grown from nothing, seconds.
    pub tree_s: f64,
}

/// Nanoseconds, in the measure of the engines' estimates: from times of `project` on ellipsoids of 20 048 and 200 432 faces at
/// a tolerance of half a millimetre, one view of 600 × 600 and eight of 2048 × 2048, cold and warm.
mod cost {
    /// To make the walker's tables, for each face of a body that the processor's cache holds.
    pub const FACE: f64 = 170.0;
    /// The same for larger bodies.
    pub const FAR_FACE: f64 = 525.0;
    /// From so many faces on.
    pub const FAR: f64 = 50_000.0;
    /// To grow what the first view asks.
    pub const GROWTH: f64 = 1.5e6;
    /// To make the body ready for a view.
    pub const VIEW: f64 = 0.6e6;
    /// To evaluate leaves, for each pixel of a view.
    pub const PIXEL: f64 = 4.1;
    /// To trace one that leaves do not know.
    pub const TRACED_PIXEL: f64 = 100.0;
}

/// Of a view's pixels, so many meet the body.
const MET: f64 = 0.4;

/// Facets of a body of F faces and radius r are off a smooth surface by some r/F; leaves that are to be within a tolerance of
/// them do not know the lines whose chord is shorter than this times r/F over the tolerance, in longest chords.
const FACETS: f64 = 20.0;

/// A tree is chosen if its estimate, times this, is less than the exact one: organs may have creases, which it does not know of.
const DOUBT: f64 = 1.1;

impl Estimate {
    /// For an organ in a study.
    pub fn of(body: &Body, trees: &TreeSettings, demand: Demand) -> Self {
        let views = demand.views.max(1);
        let (engine, exact_ns) = body.cheapest_for_image(demand.pixels / views);
        let exact_s = 1e-9 * exact_ns * demand.views as f64;
        let tree_s = match trees.interpolation {
            Interpolation::SquaredChord { tolerance_mm } => 1e-9 * tree_ns(body, tolerance_mm, demand),
            // The paper's trees are never the quicker.
            Interpolation::Quadrilinear { .. } => f64::INFINITY,
        };
        Self { engine, exact_s, tree_s }
    }

    /// Whether the tree is the quicker.
    pub fn prefers_tree(&self) -> bool {
        DOUBT * self.tree_s < self.exact_s
    }
}

fn tree_ns(body: &Body, tolerance_mm: f64, demand: Demand) -> f64 {
    let faces = body.surface().mesh().faces.len() as f64;
    let radius = body.bounds().size().element_sum() / 6.0;
    // Lines are spread evenly over squared chords.
    let traced = (FACETS * radius / (faces * tolerance_mm)).powi(2).min(1.0);
    // Twice as fine an error takes cells 2^¼ as wide, of which a view meets the square of that more; later views meet many of
    // the first one's.
    let leaves = (demand.views as f64).sqrt() * (DEFAULT_TOLERANCE_MM / tolerance_mm).sqrt();
    let face = if faces < cost::FAR { cost::FACE } else { cost::FAR_FACE };
    faces * face
        + leaves * cost::GROWTH
        + demand.views as f64 * cost::VIEW
        + demand.pixels as f64 * (cost::PIXEL + MET * traced * cost::TRACED_PIXEL)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::ClosedMesh;
    use crate::geometry::primitives::icosphere;

    #[test]
    fn trees_are_for_many_faces_many_pixels_and_tolerances_that_facets_allow() {
        let body = |subdivisions| {
            let mesh = icosphere(subdivisions).map_vertices(|v| v * glam::DVec3::new(98.0, 78.0, 58.0));
            Body::new(ClosedMesh::new(mesh).expect("closed").0)
        };
        let [few, many] = [body(2), body(5)];
        let prefers = |body: &Body, tolerance_mm: f64, views: u64| {
            let interpolation = Interpolation::SquaredChord { tolerance_mm };
            let trees = TreeSettings { interpolation, ..TreeSettings::default() };
            Estimate::of(body, &trees, Demand { views, pixels: views * 600 * 600 }).prefers_tree()
        };
        assert!(prefers(&many, 0.5, 64), "measured: 139 ms in place of 198");
        assert!(!prefers(&many, 0.5, 1), "measured: 7 ms in place of 3.2");
        assert!(!prefers(&many, 0.02, 64), "its facets are rougher than that");
        assert!(!prefers(&few, 0.5, 64) && !prefers(&few, 0.5, 0));
    }
}
