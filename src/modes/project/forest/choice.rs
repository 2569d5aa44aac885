//! Which organs are put in trees, if the method is to choose: those for which a small model of costs says that a tree is the
//! quicker for what the study asks.
//!
//! The exact side is the engines' own estimate, see [`Body::image_cost`], tables included; that of a tree is
//!
//! | for each | is paid for |
//! |---|---|
//! | face | the walker's tables, by which leaves are sampled |
//! | view | making the body ready, and what leaves it is the first to ask for: ever fewer |
//! | pixel | evaluating leaves, and tracing what they do not know |
//!
//! Only ratios of costs matter. `chordfield bench choice` measures how far the choices are from the best.

use serde::Serialize;

use super::{Interpolation, TreeSettings};
use crate::exact::{Body, Engine, ImageCost};
use crate::geometry::RayGrid;
use crate::scene::View;

/// What a study asks of its organs: so many views like one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Demand {
    /// Views.
    pub views: u64,
    /// Pixels of all views.
    pub pixels: u64,
    /// The rays of the view that stands for all. `None` if there are no views.
    #[serde(skip)]
    pub grid: Option<RayGrid>,
}

impl Demand {
    /// That of a study of these views, of which the first stands for all.
    pub fn of(views: &[View]) -> Self {
        Self {
            views: views.len() as u64,
            pixels: views.iter().map(View::pixels).sum(),
            grid: views.first().map(|view| *view.rays()),
        }
    }
}

/// What an organ is estimated to take, which decides how it is found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// The quickest exact engine.
    pub engine: Engine,
    /// By that engine, seconds of one thread.
    pub exact_s: f64,
    /// By a tree, grown from nothing, seconds of one thread.
    pub tree_s: f64,
}

/// Nanoseconds of one thread, fitted to `bench choice`: ellipsoids of 1 280 to 327 680 faces, 256² to 2048² pixels, 1 to 64 views.
mod cost {
    /// To grow what the first view asks.
    pub const GROWTH: f64 = 1.5e6;
    /// To make the body ready for a view.
    pub const VIEW: f64 = 0.2e6;
    /// To evaluate leaves, for each pixel of the body's rectangle.
    pub const PIXEL: f64 = 1.5;
}

/// Of the pixels of its rectangle, a round body meets so many.
const MET: f64 = std::f64::consts::FRAC_PI_4;

/// Facets of a body of F faces and radius r are off a smooth surface by some r/F; leaves that are to be within a tolerance of
/// them do not know the lines whose chord is shorter than this times r/F over the tolerance, in longest chords.
const FACETS: f64 = 20.0;

/// So many times the leaves are grown, besides, where facets leave all lines unknown.
const SPLIT_IN_VAIN: f64 = 8.0;

/// A tree is chosen if its estimate, times this, is less than the exact one: organs may have creases, which it does not know of.
/// Fitted with the costs: of 216 studies of ellipsoids one choice takes 1.39 times the best one's time and all others at most 1.27
/// times; likewise from a tenth less doubt to a tenth more.
const DOUBT: f64 = 1.6;

impl Estimate {
    /// For an organ in a study.
    pub fn of(body: &Body, trees: &TreeSettings, demand: Demand) -> Self {
        let Some(grid) = &demand.grid else {
            // Single rays, of which no tree is known to make up for its growth.
            return Self { engine: body.engine_for_rays(), exact_s: 0.0, tree_s: f64::INFINITY };
        };
        let image = body.image_cost(grid, demand.views as f64);
        let tree_s = match trees.interpolation {
            Interpolation::SquaredChord { tolerance_mm } => {
                1e-9 * tree_ns(body, &image, tolerance_mm, demand.views as f64)
            }
            // The paper's trees are never the quicker.
            Interpolation::Quadrilinear { .. } => f64::INFINITY,
        };
        Self { engine: image.engine, exact_s: 1e-9 * image.ns, tree_s }
    }

    /// Whether the tree is the quicker.
    pub fn prefers_tree(&self) -> bool {
        DOUBT * self.tree_s < self.exact_s
    }
}

fn tree_ns(body: &Body, image: &ImageCost, tolerance_mm: f64, views: f64) -> f64 {
    let faces = body.surface().mesh().faces.len() as f64;
    let radius = body.bounds().size().element_sum() / 6.0;
    // Lines are spread evenly over squared chords.
    let traced = (FACETS * radius / (faces * tolerance_mm)).powi(2).min(1.0);
    // Later views meet many leaves of the first one's; what facets leave unknown is split in vain.
    let leaves = views.sqrt() * (1.0 + SPLIT_IN_VAIN * traced);
    let of_view = cost::VIEW + image.pixels * (cost::PIXEL + MET * traced * image.walked_pixel_ns);
    image.walker_ns + leaves * cost::GROWTH + views * of_view
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::primitives::icosphere;
    use crate::geometry::{ClosedMesh, Upstream};
    use crate::scene::Scene;

    #[test]
    fn trees_are_for_many_faces_many_views_and_tolerances_that_facets_allow() {
        let body = |subdivisions| {
            let mesh = icosphere(subdivisions).map_vertices(|v| v * glam::DVec3::new(98.0, 78.0, 58.0));
            Body::new(ClosedMesh::new(mesh).expect("closed").0)
        };
        let [few, many] = [body(2), body(6)];
        let views = Scene::phantom("calibration").expect("a scene").beam.views().expect("views");
        let prefers = |body: &Body, tolerance_mm: f64, count: u64| {
            let interpolation = Interpolation::SquaredChord { tolerance_mm };
            let trees = TreeSettings { interpolation, ..TreeSettings::default() };
            let demand = Demand { views: count, ..Demand::of(&views) };
            Estimate::of(body, &trees, demand).prefers_tree()
        };
        assert!(prefers(&many, 0.5, 64));
        assert!(!prefers(&many, 0.5, 1), "the walker's tables take longer than the view");
        assert!(!prefers(&many, 0.02, 64), "its facets are rougher than that");
        assert!(!prefers(&few, 0.5, 64), "so are these");
        let none = Estimate::of(&many, &TreeSettings::default(), Demand::default());
        assert!(!none.prefers_tree(), "nothing is asked");
    }

    #[test]
    fn tables_are_made_only_for_views_enough_to_pay_for_them() {
        let mesh = icosphere(6).map_vertices(|v| 80.0 * v);
        let body = Body::new(ClosedMesh::new(mesh).expect("closed").0);
        let steps = [4.0 * glam::DVec3::X, 4.0 * glam::DVec3::Y];
        let source = Upstream::Source(glam::DVec3::new(0.0, 0.0, -1000.0));
        let corner = glam::DVec3::new(-128.0, -128.0, 500.0);
        let grid = RayGrid::new(source, corner, steps, [64, 64]).expect("rays");
        let engine = |views: u64| {
            let demand = Demand { views, pixels: 64 * 64 * views, grid: Some(grid) };
            Estimate::of(&body, &TreeSettings::default(), demand).engine
        };
        assert_eq!((engine(1), engine(1000)), (Engine::Raster, Engine::Walk));
        assert_eq!(body.engine_for_image(&grid), engine(1000), "who does not know takes them to be there");
    }
}
