//! Which engine serves when.

use super::raster::{self, RasterView};
use super::{Body, Record};
use crate::geometry::{RayGrid, Region, Upstream};

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

/// Planes that are clipped in the time of what else finds the chord of one line, a walk or a descent of a box hierarchy: measured,
/// 20 ns and 2.2 a plane, against 175 to 185 ns for a walk over round bodies of 60 to 160 faces, 245 to 285 over boxes, capsules
/// and cones with rounded edges, and 190 to 300 for a descent.
pub(super) const FEW_PLANES: usize = 90;

/// The same for rays in a batch, whose walks go abreast: measured, 75 to 95 ns over round bodies of 40 to 160 faces, 165 to 195 over
/// the others. A round body's rays are as quickly clipped at 38 planes, the others' at 80; at this many, clipping takes 1.4 and
/// 0.7 of the time of a walk.
const FEW_PLANES_IN_BATCH: usize = 50;

/// Costs of one thread, in nanoseconds, by which engines are chosen for an image: measured (`cargo bench --bench table -- choice`
/// in `benches`), on bodies of eighty to a third of a million faces. Only their ratios matter.
mod cost {
    use super::Engine;

    /// To look at a face.
    const RASTER_FACE: f64 = 11.0;
    /// To find what it covers, by as many rows as a square of its pixels has.
    const RASTER_ROW: f64 = 34.0;
    /// To find lengths from that, for each pixel of the body's rectangle.
    const RASTER_PIXEL: f64 = 2.2;

    /// To see so many faces in so many pixels.
    pub fn raster(faces: f64, pixels: f64) -> f64 {
        RASTER_FACE * faces + RASTER_ROW * (faces * pixels).sqrt() + RASTER_PIXEL * pixels
    }

    /// To walk for so many pixels, one row after the other or from no one point, each from its neighbour, which is many faces
    /// away if pixels are few; then from a table.
    pub fn walk(faces: f64, pixels: f64) -> f64 {
        let from_pixel_to_pixel = 80.0 * (faces * pixels).sqrt();
        (40.0 + 3.0 * faces.sqrt().sqrt()) * pixels + from_pixel_to_pixel.min(110.0 * pixels)
    }

    /// The same from one point, many rows abreast.
    pub fn walk_of_cone(faces: f64, pixels: f64) -> f64 {
        let from_pixel_to_pixel = 60.0 * (faces * pixels).sqrt();
        (2.0 + 1.6 * faces.sqrt().sqrt()) * pixels + from_pixel_to_pixel.min(115.0 * pixels)
    }

    /// To descend the hierarchy for each pixel.
    pub fn bvh(faces: f64, pixels: f64) -> f64 {
        (190.0 + 18.0 * faces.sqrt().sqrt()) * pixels
    }

    /// To make ready, for each face, what the engine needs of a body: patches, the walker's tables, the hierarchy.
    pub fn ready(engine: Engine, faces: f64) -> f64 {
        let of_face = match engine {
            Engine::Clip => 0.0,
            Engine::Raster => 45.0,
            Engine::Walk => 300.0,
            Engine::Bvh => 350.0,
        };
        of_face * faces
    }
}

/// What images of a body are estimated to cost, nanoseconds of one thread. Only ratios matter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageCost {
    /// The quickest engine.
    pub engine: Engine,
    /// All of the images by that engine, and what it makes ready.
    pub ns: f64,
    /// Pixels of the rectangle that the body is seen in.
    pub pixels: f64,
    /// One of them by a walk along its row.
    pub walked_pixel_ns: f64,
    /// To make the walker's tables.
    pub walker_ns: f64,
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
    /// The quickest engine for an image once each has made ready what it needs: the raster, unless the body is seen in few pixels
    /// for the number of its faces.
    pub fn engine_for_image(&self, grid: &RayGrid) -> Engine {
        self.image_cost(grid, f64::INFINITY).engine
    }

    /// What so many images like one are estimated to cost by the quickest engine, with what it makes ready for them.
    pub fn image_cost(&self, grid: &RayGrid, images: f64) -> ImageCost {
        let pixels = raster::pixels_around(&self.bounds(), grid) as f64;
        let faces = self.surface().mesh().faces.len() as f64;
        let walk = cost::walk(faces, pixels);
        let other = match (self.convexity(), grid.upstream()) {
            (Ok(_), Upstream::Source(_)) => (Engine::Walk, cost::walk_of_cone(faces, pixels)),
            (Ok(_), Upstream::Path(_)) => (Engine::Walk, walk),
            (Err(_), _) => (Engine::Bvh, cost::bvh(faces, pixels)),
        };
        // For each image, so that there may be any number of them.
        let with_ready = |(engine, ns): (Engine, f64)| (engine, ns + cost::ready(engine, faces) / images);
        let raster = with_ready((Engine::Raster, cost::raster(faces, pixels)));
        let other = with_ready(other);
        let (engine, ns) = if other.1 < raster.1 { other } else { raster };
        let walker_ns = cost::ready(Engine::Walk, faces);
        ImageCost { engine, ns: ns * images, pixels, walked_pixel_ns: walk / pixels.max(1.0), walker_ns }
    }

    /// The quickest engine for a line on its own.
    pub fn engine_for_line(&self) -> Engine {
        self.engine_beyond(FEW_PLANES)
    }

    /// The quickest engine for a batch of rays in no order. How many they are does not matter: what a ray gets must not depend
    /// on its batch.
    pub fn engine_for_rays(&self) -> Engine {
        self.engine_beyond(FEW_PLANES_IN_BATCH)
    }

    /// The quickest engine where so many planes are sooner clipped than walked over.
    fn engine_beyond(&self, few_planes: usize) -> Engine {
        match self.convexity() {
            Ok(convex) if convex.planes().len() <= few_planes => Engine::Clip,
            Ok(_) => Engine::Walk,
            Err(_) => Engine::Bvh,
        }
    }

    /// The body made ready for the rays of a grid: by `engine`, or by the quickest if `None` or if that one does not
    /// [serve](Engine::serves).
    pub fn view(&self, grid: &RayGrid, engine: Option<Engine>) -> BodyView<'_> {
        let quickest = || self.engine_for_image(grid);
        let engine = engine.filter(|engine| engine.serves(self)).unwrap_or_else(quickest);
        let raster = (engine == Engine::Raster).then(|| {
            let view = RasterView::of_patches(self.surface(), self.patches(), grid);
            if self.convexity().is_ok() { view.as_convex() } else { view }
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
