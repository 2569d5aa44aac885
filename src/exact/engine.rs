//! Which engine serves when.

use super::raster::RasterView;
use super::{Body, Record};
use crate::geometry::{RayGrid, Region};

/// An exact engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Engine {
    /// Half-space clipping: [`clip`](super::clip).
    Clip,
    /// Walks from face to face: [`walk`](super::walk).
    Walk,
    /// Faces cast on the pixels: [`raster`](super::raster).
    Raster,
    /// A hierarchy of boxes: [`bvh`](super::bvh).
    Bvh,
}

/// Planes that are clipped in the time of a walk or of one descent of a box hierarchy: measured, 2.3 ns a plane, against 170
/// to 200 ns for a walk between random rays over bodies of 80 and 320 faces, and some 300 ns for a descent.
pub(super) const FEW_PLANES: usize = 100;

/// Costs of one thread, in nanoseconds, by which engines are chosen for an image: measured (`cargo bench --bench table` in `benches`), on ellipsoids of a
/// thousand to a third of a million faces. Only their ratios matter.
mod cost {
    /// To project a face and to find the pixels it covers.
    pub const RASTER_FACE: f64 = 70.0;
    /// To add its crossings to them, for each pixel of the image.
    pub const RASTER_PIXEL: f64 = 5.0;
    /// A walk from the neighbouring pixel: half of that over a thousand faces, twice over a third of a million.
    pub const WALK_PIXEL: f64 = 100.0;
    /// A descent of the hierarchy.
    pub const BVH_PIXEL: f64 = 400.0;
}

impl Engine {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Clip => "clip",
            Self::Walk => "walk",
            Self::Raster => "raster",
            Self::Bvh => "bvh",
        }
    }

    /// Whether the engine can find chords in `body`. Clipping and walking need a convex one.
    pub fn serves(self, body: &Body) -> bool {
        match self {
            Self::Clip | Self::Walk => body.convexity().is_ok(),
            Self::Raster | Self::Bvh => true,
        }
    }
}

impl Body {
    /// The quickest engine for an image of so many pixels: the raster, unless the image is small for the number of faces.
    pub fn engine_for_image(&self, pixels: u64) -> Engine {
        self.cheapest_for_image(pixels).0
    }

    /// As [`engine_for_image`](Self::engine_for_image), with what the engine is estimated to cost, nanoseconds of one thread.
    pub fn cheapest_for_image(&self, pixels: u64) -> (Engine, f64) {
        let (pixels, faces) = (pixels as f64, self.surface().mesh().faces.len() as f64);
        let raster = faces * cost::RASTER_FACE + pixels * cost::RASTER_PIXEL;
        let (other, cost) = match self.convexity() {
            Ok(_) => (Engine::Walk, pixels * cost::WALK_PIXEL),
            Err(_) => (Engine::Bvh, pixels * cost::BVH_PIXEL),
        };
        if cost < raster { (other, cost) } else { (Engine::Raster, raster) }
    }

    /// The quickest engine for rays in no order.
    pub fn engine_for_rays(&self) -> Engine {
        match self.convexity() {
            Ok(convex) if convex.planes().len() <= FEW_PLANES => Engine::Clip,
            Ok(_) => Engine::Walk,
            Err(_) => Engine::Bvh,
        }
    }

    /// The body made ready for the rays of a grid: by `engine`, or by the quickest if `None` or if that one does not
    /// [serve](Engine::serves).
    pub fn view(&self, grid: &RayGrid, engine: Option<Engine>) -> BodyView<'_> {
        let (columns, rows) = grid.size();
        let quickest = || self.engine_for_image(u64::from(columns) * u64::from(rows));
        let engine = engine.filter(|engine| engine.serves(self)).unwrap_or_else(quickest);
        let raster = (engine == Engine::Raster).then(|| match self.convexity() {
            Ok(_) => RasterView::of_convex(self.surface(), grid),
            Err(_) => RasterView::new(self.surface(), grid),
        });
        BodyView { body: self, grid: *grid, engine, raster }
    }
}

/// A body made ready for the rays of an image.
#[derive(Clone, Debug)]
pub struct BodyView<'a> {
    body: &'a Body,
    grid: RayGrid,
    engine: Engine,
    /// Of the raster only.
    raster: Option<RasterView<'a>>,
}

impl BodyView<'_> {
    /// The engine in use.
    pub fn engine(&self) -> Engine {
        self.engine
    }

    /// Records where each ray of `region`, numbered row by row, enters and leaves the body. What a ray gets does not depend
    /// on the region it is asked in.
    pub fn trace<R: Record>(&self, region: &Region, record: &mut R) {
        if let Some(raster) = &self.raster {
            return raster.trace(region, record);
        }
        match self.body.walker().filter(|_| self.engine == Engine::Walk) {
            Some(walker) => self.body.trace_grid_by_walk(walker, &self.grid, region, record),
            None => {
                let rays: Vec<_> = region.places().map(|(c, r)| self.grid.segment(c, r)).collect();
                self.body.trace(self.engine, 0, &rays, record);
            }
        }
    }
}
