//! Pictures of a world by ray tracing, exact or with RI-trees (Atalay & Mount, §2.4).
//!
//! ```text
//!   camera ─► ray ─► nearest object ─► shading: ambient, lights (shadow rays), highlight
//!              ▲      tree or traced    │
//!              └──── exit ray ◄─────────┘  mirrored · refracted · straight on, up to a limit
//! ```
//!
//! Trees are asked for what is smooth, by rays from the camera, or from its images in flat mirrors: the first hit of a line with
//! its normal, and the ray that leaves a mirror or a glass body. What lights see of an object with a tree is interpolated, too. All
//! of it is kept from view to view. Where trees do not answer, where a ray starts within an object's box, for objects without a
//! tree and after a turn at what is curved, rays are traced. Both ways look for what may be in view at a ray's pixel, or in a
//! light's direction, only, and at a sky whose noise is made once. Colours are floats to the end; a pixel depends on its rays
//! alone, so pictures are the same bits for any number of threads.

mod around;
mod cube;
mod in_view;
mod lazy;
mod light_map;
mod light_path;
mod picture;
mod seer;
mod silhouette;
mod sky_map;
#[cfg(test)]
mod tests;

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{PoisonError, RwLock, RwLockReadGuard};

use rayon::prelude::*;

use super::Control;
use super::project::tiles;
use crate::error::Result;
use crate::geometry::{Bounds, Real, Region};
use crate::ritree::{BuildCounts, Cache, Parameters};
use crate::scene::trace::{Camera, World};
use around::Around;
use in_view::InView;
use light_path::LightPath;
pub use picture::{Picture, Samples};
use seer::Seer;
pub(super) use silhouette::Silhouette;
use sky_map::SkyMap;

/// How trees of what rays meet are grown; the defaults are the paper's.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Trees {
    /// The thresholds and the depth.
    #[serde(flatten)]
    pub parameters: Parameters,
    /// The most that nodes and samples of all trees may hold, bytes.
    pub cache_bytes: usize,
    /// The share of the cache that pruning keeps.
    pub kept_share: f64,
}

impl Default for Trees {
    fn default() -> Self {
        Self { parameters: Parameters::default(), cache_bytes: 100_000_000, kept_share: 0.3 }
    }
}

/// How rays find objects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tracing {
    /// Every ray exactly.
    Exact,
    /// By one RI-tree per object that grows one.
    RiTree(Trees),
}

/// What rendering took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Work {
    /// Rays: from the camera, turned, and to lights.
    pub rays: u64,
    /// Questions to trees.
    pub queries: u64,
    /// Questions that trees answered.
    pub interpolated: u64,
    /// Objects with a tree that were traced all the same.
    pub traced: u64,
    /// Floating-point operations; 0 unless they were counted.
    pub operations: u64,
}

impl std::ops::AddAssign for Work {
    fn add_assign(&mut self, other: Self) {
        self.rays += other.rays;
        self.queries += other.queries;
        self.interpolated += other.interpolated;
        self.traced += other.traced;
        self.operations += other.operations;
    }
}

/// A world made ready to be rendered, with its trees. `R` is the number it computes in:
/// [`Counted`](crate::geometry::Counted) counts what it takes.
pub struct Renderer<'a, R: Real> {
    world: &'a World,
    sky: SkyMap<'a>,
    seers: RwLock<Vec<Seer<'a, R>>>,
    /// The boxes around the objects, and which of them lie where around each light.
    boxes: Vec<Bounds>,
    lights: Vec<Around>,
    /// The order in which rays are held against objects: quick ones first, which leave less of the ray to search.
    order: Vec<u32>,
    cache: Cache,
    kept_share: f64,
    clock: AtomicU32,
}

impl<'a, R: Real> Renderer<'a, R> {
    /// Makes a world ready.
    pub fn new(world: &'a World, tracing: Tracing) -> Self {
        let (parameters, settings) = match tracing {
            Tracing::Exact => (None, Trees::default()),
            Tracing::RiTree(settings) => (Some(settings.parameters), settings),
        };
        let seers = world.objects.iter().map(|object| Seer::new(object, world, parameters)).collect();
        let boxes: Vec<Bounds> = world.objects.iter().map(|object| object.surface.bounds()).collect();
        let mut order: Vec<u32> = (0..world.objects.len() as u32).collect();
        order.sort_by_key(|&index| !world.objects[index as usize].surface.has_closed_form());
        let lights = world.lights.iter().map(|light| Around::new(light.position, &boxes, &order)).collect();
        Self {
            world,
            sky: SkyMap::new(&world.sky),
            seers: RwLock::new(seers),
            boxes,
            lights,
            order,
            cache: Cache::new(settings.cache_bytes),
            kept_share: settings.kept_share,
            clock: AtomicU32::new(1),
        }
    }

    /// Renders one view of `columns` × `rows` pixels.
    ///
    /// # Errors
    /// [`Error::Interrupted`](crate::Error::Interrupted) within a tile's time of a request to stop.
    pub fn render(
        &self,
        camera: &Camera,
        size: (u32, u32),
        samples: &Samples,
        control: &Control,
    ) -> Result<Picture> {
        let in_view = InView::new(camera, size, &self.world.objects, &self.boxes, &self.order);
        let view = View { camera, size, samples, in_view };
        let tiles: Vec<(Region, Tile)> = tiles(size)
            .into_par_iter()
            .map(|region| {
                control.check()?;
                let (mut tile, operations) = R::count(|| self.tile(&view, &region));
                tile.work.operations = operations;
                self.prune_if_full();
                control.advance(region.pixels() as u64);
                Ok((region, tile))
            })
            .collect::<Result<_>>()?;
        Ok(Picture::of_tiles(size, tiles))
    }

    /// Bytes that the trees hold, and tables beside them: the cache's limit is that of the trees, tables do not grow. The sky's
    /// texture is not among them: tracing has it as well.
    pub fn tree_bytes(&self) -> usize {
        self.cache.used_bytes() + self.enter().iter().map(Seer::table_bytes).sum::<usize>()
    }

    /// What building the trees took.
    pub fn build_counts(&self) -> BuildCounts {
        self.enter().iter().map(Seer::build_counts).fold(BuildCounts::default(), |mut sum, counts| {
            sum += counts;
            sum
        })
    }

    fn enter(&self) -> RwLockReadGuard<'_, Vec<Seer<'a, R>>> {
        self.seers.read().unwrap_or_else(PoisonError::into_inner)
    }

    fn tile(&self, view: &View, region: &Region) -> Tile {
        let seers = self.enter();
        let now = self.clock.fetch_add(1, Ordering::Relaxed);
        seers.iter().for_each(|seer| seer.tick_to(now));
        let in_view = view.in_view.on(region);
        let mut light = LightPath::new(self, &seers, view.camera, &in_view);
        let mut rays = view.camera.rays(view.size);
        let mut tile = Tile::default();
        for (column, row) in region.places() {
            light.was_traced = false;
            let places = view.samples.of_pixel(column, row);
            let seen = places.map(|[x, y]| {
                let place = [f64::from(column) + x, f64::from(row) + y];
                light.seen(&rays.through(place), place)
            });
            let sum = seen.reduce(|sum, colour| sum + colour).unwrap_or_default();
            let mean = match view.samples.count() {
                1 => sum,
                count => sum * R::of(1.0 / f64::from(count)),
            };
            tile.colours.push(mean.get().as_vec3().to_array());
            tile.traced.push(light.was_traced);
        }
        tile.work = light.work;
        tile
    }

    /// Forgets the least recently used leaves if the cache was full.
    fn prune_if_full(&self) {
        let collect = |seers: &Vec<Seer<R>>, stamps: &mut Vec<_>| {
            seers.iter().for_each(|seer| seer.collect_stamps(stamps));
        };
        self.cache.prune_if_full(&self.seers, self.kept_share, collect, |seers, oldest| {
            seers.iter_mut().for_each(|seer| seer.prune(oldest, &self.cache));
        });
    }
}

/// What is rendered of a world.
struct View<'a> {
    camera: &'a Camera,
    size: (u32, u32),
    samples: &'a Samples,
    in_view: InView,
}

/// The pixels of one tile, row by row.
#[derive(Default)]
struct Tile {
    colours: Vec<[f32; 3]>,
    traced: Vec<bool>,
    work: Work,
}
