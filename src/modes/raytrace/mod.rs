//! Pictures of a world by ray tracing, exact or with RI-trees (Atalay & Mount, §2.4).
//!
//! ```text
//!   camera ─► ray ─► nearest object ─► shading: ambient, lights (shadow rays), highlight
//!              ▲      tree or traced    │
//!              └──── exit ray ◄─────────┘  mirrored · refracted · straight on, up to a limit
//! ```
//!
//! Trees are asked for what is smooth, by rays from the camera on: the first hit of a line with its normal, and the ray that
//! leaves a mirror or a glass body. What lights see of an object with a tree is interpolated, too. All of it is kept from view
//! to view. Where trees do not answer, where a ray starts within an object's box, for objects without a tree and after a turn,
//! rays are traced. Flat mirrors are no exception: trees for what they show save an eighth of the operations of a picture full of
//! it, but tear outlines. Both ways look for objects in a ray's direction only, and at a sky whose noise is made once. Colours
//! are floats to the end; a pixel depends on its rays alone, so pictures are the same bits for any number of threads.

mod around;
mod cube;
mod lazy;
mod light_map;
mod picture;
mod seer;
mod sky_map;
#[cfg(test)]
mod tests;

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{PoisonError, RwLock, RwLockReadGuard};

use rayon::prelude::*;

use super::Control;
use super::project::tiles;
use crate::error::Result;
use crate::geometry::{Bounds, Ray, Real, Region, Vec3};
use crate::ritree::{BuildCounts, Cache, Parameters};
use crate::scene::trace::{Camera, World};
use crate::surface::optics::{reflectance, reflected};
use crate::surface::{Reach, Slabs};
use around::Around;
pub use picture::{Picture, Samples};
use seer::{Asker, Seer, Sight};
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
        let lights = world.lights.iter().map(|light| Around::new(light.position, &boxes)).collect();
        Self {
            world,
            sky: SkyMap::new(&world.sky),
            seers: RwLock::new(seers),
            boxes,
            lights,
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
        let view = View { camera, size, samples, around: Around::new(camera.eye(), &self.boxes) };
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
        let mut light = LightPath {
            world: self.world,
            sky: &self.sky,
            eye: &view.around,
            lights: &self.lights,
            seers: &seers,
            askers: seers.iter().map(Seer::asker).collect(),
            cache: &self.cache,
            work: Work::default(),
            was_traced: false,
            is_from_camera: true,
        };
        let mut tile = Tile::default();
        for (column, row) in region.places() {
            light.was_traced = false;
            let places = view.samples.of_pixel(column, row);
            let sum = places.fold(Vec3::default(), |sum, [x, y]| {
                let ray = view.camera.ray(view.size, f64::from(column) + x, f64::from(row) + y);
                sum + light.radiance(&ray, R::of(1.0), None, 0, true)
            });
            let mean = sum * R::of(1.0 / f64::from(view.samples.count()));
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
    /// Which objects lie where around the camera.
    around: Around,
}

/// The pixels of one tile, row by row.
#[derive(Default)]
struct Tile {
    colours: Vec<[f32; 3]>,
    traced: Vec<bool>,
    work: Work,
}

/// Light on its way back to the camera, for the rays of one tile.
struct LightPath<'t, 'a, R: Real> {
    world: &'t World,
    sky: &'t SkyMap<'a>,
    /// Which objects lie where around the camera, and around each light.
    eye: &'t Around,
    lights: &'t [Around],
    seers: &'t [Seer<'a, R>],
    askers: Vec<Asker<'t, 'a, R>>,
    cache: &'t Cache,
    work: Work,
    /// Whether an object with a tree was traced.
    was_traced: bool,
    /// Whether the ray runs as it left the camera: neighbours ask the same cells. Turned rays scatter over line space, and
    /// the cells that a few of them would share cost more than tracing them.
    is_from_camera: bool,
}

/// Light that would change a pixel by less than this, a quarter of the least step of eight bits, is not followed.
const LEAST_SHARE: f64 = 1e-3;

impl<R: Real> LightPath<'_, '_, R> {
    /// The light that comes along a ray; it makes up `share` of a pixel's. The object that the ray has `left` is not met
    /// again: mirrors and glass bodies let rays go only when they leave for good, and what a clear sheet has of itself
    /// behind it is not seen through it.
    fn radiance(
        &mut self,
        ray: &Ray<R>,
        share: R,
        left: Option<usize>,
        turns: u32,
        is_straight: bool,
    ) -> Vec3<R> {
        self.work.rays += 1;
        self.is_from_camera = is_straight;
        let Some((object, sight)) = self.nearest(ray, left) else { return self.sky.seen(ray) };
        let seer = &self.seers[object];
        let material = seer.material();
        let mut light = self.shade(object, ray, &sight);
        if turns >= self.world.most_turns {
            return light;
        }
        let is_worth = |part: R| (share * part).get() > LEAST_SHARE;
        let clear = R::of(material.clear);
        if is_worth(clear) {
            let on = Ray { origin: sight.place, dir: ray.dir };
            light = light + self.radiance(&on, share * clear, Some(object), turns + 1, is_straight) * clear;
        }
        if let Some(glass) = material.glass
            && material.mirror > 0.0
            && seer.object.is_convex
        {
            // What a glass body mirrors outside, by Fresnel's share; inside, it is given up.
            let part =
                reflectance(-ray.dir.dot(sight.normal), R::of(1.0 / glass.index)) * R::of(material.mirror);
            if is_worth(part) {
                let dir = reflected(ray.dir, sight.normal);
                let on = Ray { origin: sight.place, dir };
                light = light + self.radiance(&on, share * part, Some(object), turns + 1, false) * part;
            }
        }
        if let Some((on, inner_turns)) = seer.turned(ray, &sight) {
            let part = R::of(material.share(inner_turns));
            if is_worth(part) {
                light = light + self.radiance(&on, share * part, Some(object), turns + 1, false) * part;
            }
        }
        light
    }

    /// The nearest object along a ray.
    fn nearest(&mut self, ray: &Ray<R>, left: Option<usize>) -> Option<(usize, Sight<R>)> {
        let mut best: Option<(usize, Sight<R>)> = None;
        let in_view = self.is_from_camera.then(|| self.eye.towards(ray.dir));
        if in_view.is_some_and(<[u16]>::is_empty) {
            return None;
        }
        let slabs = Slabs::new(ray);
        for n in 0..in_view.map_or(self.seers.len(), <[u16]>::len) {
            let index = in_view.map_or(n, |objects| objects[n].into());
            if Some(index) == left {
                continue;
            }
            let to = best.as_ref().map_or(R::of(f64::INFINITY), |(_, sight)| sight.t);
            if let Some(sight) = self.sight(index, ray, &slabs, to) {
                best = Some((index, sight));
            }
        }
        best
    }

    /// One object along a ray, not beyond `to`.
    fn sight(&mut self, index: usize, ray: &Ray<R>, slabs: &Slabs<R>, to: R) -> Option<Sight<R>> {
        let seer = &self.seers[index];
        let (near, far) = slabs.stretch(&seer.bounds)?;
        if near > to || far.get() <= 0.0 {
            return None;
        }
        if seer.has_tree() {
            // The tree knows the first hit of the whole line: it serves where that lies ahead.
            if self.is_from_camera && near.get() > 0.0 {
                self.work.queries += 1;
                if let Ok(answer) = self.askers[index].ask(ray, self.cache) {
                    self.work.interpolated += 1;
                    return answer.filter(|sight| sight.t <= to);
                }
            }
            self.work.traced += 1;
            self.was_traced = true;
        }
        seer.trace(ray, Reach { to, ..Reach::whole() })
    }

    /// What a place shows of the lights and of the sky's light.
    fn shade(&mut self, object: usize, ray: &Ray<R>, sight: &Sight<R>) -> Vec3<R> {
        let world = self.world;
        let material = self.seers[object].material();
        let colour = Vec3::of(material.colour);
        let mut light = colour.scaled(Vec3::of(world.ambient)) * R::of(material.ambient);
        if material.is_dark() {
            return light;
        }
        for (light_index, lamp) in world.lights.iter().enumerate() {
            let way = Vec3::of(lamp.position) - sight.place;
            let far = way.length();
            let dir = way * (R::of(1.0) / far);
            let cosine = dir.dot(sight.normal);
            if cosine.get() <= 0.0 || self.seers[object].hides_itself(light_index, ray, sight, cosine) {
                continue;
            }
            let reaching = self.visibility(object, light_index, &Ray { origin: sight.place, dir }, far);
            if reaching.get() <= 0.0 {
                continue;
            }
            let lamp = Vec3::of(lamp.colour) * reaching;
            light = light + colour.scaled(lamp) * (cosine * R::of(material.diffuse));
            if material.specular > 0.0 {
                let mirrored = reflected(ray.dir, sight.normal);
                let towards = mirrored.dot(dir).max(R::of(0.0));
                if towards.get() > self.seers[object].highlight_from {
                    light = light + lamp * (towards.powf(material.shininess) * R::of(material.specular));
                }
            }
        }
        light
    }

    /// The share of a light that reaches a place of an object through all others.
    fn visibility(&mut self, object: usize, light: usize, ray: &Ray<R>, far: R) -> R {
        self.work.rays += 1;
        let mut share = R::of(1.0);
        let on_the_way = self.lights[light].towards(-ray.dir);
        if on_the_way.iter().all(|&index| usize::from(index) == object) {
            return share;
        }
        let slabs = Slabs::new(ray);
        for index in on_the_way.iter().map(|&index| usize::from(index)).filter(|&i| i != object) {
            let seer = &self.seers[index];
            let is_near = || slabs.entry(&seer.bounds, R::of(0.0), far).is_some();
            if share.get() > 0.0 && is_near() && seer.hides(light, ray, far) {
                share = share * R::of(seer.material().translucence());
            }
        }
        share
    }
}
