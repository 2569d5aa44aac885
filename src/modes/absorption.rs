//! The paper's second application: random volumes that are looked through without refraction (§3, Fig. 12).
//!
//! For every ray the lengths in all bodies, traced or by one RI-tree per body, and the grey that a pixel shows of them.
//! Bodies are as smooth as they were made: their tessellations are an ordinary scene's, see [`project`](super::project).
//! Generic over the number, so that both ways' operations can be counted.

use rayon::prelude::*;

use crate::attributes::smooth_chord::{SmoothChords, chord};
use crate::error::{Error, Result};
use crate::geometry::{Bounds, Ray, Real, Region, Vec3};
use crate::modes::Control;
use crate::modes::project::tiles;
use crate::modes::raytrace::{Picture, Silhouette, Tracing, Work};
use crate::ritree::{Answer, BuildCounts, Cache, Descent, RiTree};
use crate::scene::trace::{Camera, Object, World};
use crate::surface::{Slabs, Surface};

/// What is left of the light on the way through half a body's longest side: its opacity is one half (§3.7).
const LET_THROUGH: f64 = 0.5;

/// A world made ready to be looked through.
pub struct Bodies<'a, R: Real> {
    bodies: Vec<Body<'a, R>>,
    cache: Cache,
}

struct Body<'a, R: Real> {
    surface: &'a Surface,
    bounds: Bounds,
    /// Half its longest side.
    unit: f64,
    tree: Option<RiTree<SmoothChords<'a, R>>>,
}

/// What is seen of one view.
#[derive(Clone, Debug, Default)]
pub struct Lengths {
    /// For every pixel, row by row, the length in each body, in half its longest side: the unit of the distance threshold.
    pub lengths: Vec<f32>,
    /// The grey of each pixel, 1 where nothing is in the way.
    pub greys: Vec<f32>,
    /// Whether a body with a tree was traced for the pixel.
    pub traced: Vec<bool>,
    /// What it took.
    pub work: Work,
}

impl Lengths {
    /// The greys as a picture of so many columns and rows.
    pub fn picture(&self, size: (u32, u32)) -> Picture {
        Picture::of_greys(size, &self.greys, self.traced.clone(), self.work)
    }

    /// The mean difference of lengths over all rays that meet the body in either. 0 if none does.
    pub fn mean_difference(&self, other: &Self) -> f64 {
        let pairs = || self.lengths.iter().zip(&other.lengths).filter(|(a, b)| **a > 0.0 || **b > 0.0);
        let sum: f64 = pairs().map(|(a, b)| f64::from((a - b).abs())).sum();
        sum / (pairs().count().max(1)) as f64
    }
}

impl<'a, R: Real> Bodies<'a, R> {
    /// Makes a world ready. Trees that outgrow the cache are not pruned: what does not fit is computed and forgotten.
    ///
    /// # Errors
    /// A body that is not closed and convex: lines may meet it in several stretches, or in none.
    pub fn new(world: &'a World, tracing: Tracing) -> Result<Self> {
        let is_body = |object: &Object| object.is_convex && !matches!(object.surface, Surface::Disc(_));
        if let Some(object) = world.objects.iter().find(|object| !is_body(object)) {
            return Err(Error::input(
                format!("object `{}` of {}", object.name, world.name),
                "is not known to be a closed convex body, so its lengths are not told by two hits",
                "leave it out, or give a mesh of it to `chordfield project`",
            ));
        }
        let (parameters, cache_bytes) = match tracing {
            Tracing::Exact => (None, 0),
            Tracing::RiTree(trees) => (Some(trees.parameters), trees.cache_bytes),
        };
        let body = |surface: &'a Surface| {
            let bounds = surface.bounds();
            let tree =
                parameters.and_then(|p| SmoothChords::new(surface).map(|chords| RiTree::new(chords, p)));
            Body { surface, bounds, unit: 0.5 * bounds.size().max_element(), tree }
        };
        let bodies = world.objects.iter().map(|object| body(&object.surface)).collect();
        Ok(Self { bodies, cache: Cache::new(cache_bytes) })
    }

    /// Looks through all bodies along the rays of one view.
    ///
    /// # Errors
    /// [`Error::Interrupted`] within a tile's time of a request to stop.
    pub fn lengths(&self, camera: &Camera, size: (u32, u32), control: &Control) -> Result<Lengths> {
        let silhouette = |body: &Body<R>| Silhouette::new(body.surface, &body.bounds, camera, size);
        let silhouettes: Vec<_> = self.bodies.iter().map(silhouette).collect();
        let tiles: Vec<(Region, Lengths)> = tiles(size)
            .into_par_iter()
            .map(|region| {
                control.check()?;
                let (mut tile, operations) = R::count(|| self.tile(camera, size, &silhouettes, &region));
                tile.work.operations = operations;
                control.advance(region.pixels() as u64);
                Ok((region, tile))
            })
            .collect::<Result<_>>()?;
        let (pixels, bodies) = (size.0 as usize * size.1 as usize, self.bodies.len());
        let mut all = Lengths {
            lengths: vec![0.0; bodies * pixels],
            greys: vec![1.0; pixels],
            traced: vec![false; pixels],
            work: Work::default(),
        };
        for (region, tile) in tiles {
            for (i, (column, row)) in region.places().enumerate() {
                let at = row as usize * size.0 as usize + column as usize;
                (all.greys[at], all.traced[at]) = (tile.greys[i], tile.traced[i]);
                all.lengths[bodies * at..][..bodies].copy_from_slice(&tile.lengths[bodies * i..][..bodies]);
            }
            all.work += tile.work;
        }
        Ok(all)
    }

    fn tile(
        &self,
        camera: &Camera,
        size: (u32, u32),
        silhouettes: &[Option<Silhouette>],
        region: &Region,
    ) -> Lengths {
        let mut tile = Lengths::default();
        let mut askers: Vec<_> = self.bodies.iter().map(|body| body.asker(camera)).collect();
        let mut rays = camera.rays::<R>(size);
        for (column, row) in region.places() {
            let place = [f64::from(column) + 0.5, f64::from(row) + 0.5];
            let ray = rays.through(place);
            let mut light = R::of(1.0);
            let traced_before = tile.work.traced;
            tile.work.rays += 1;
            for ((body, asker), silhouette) in self.bodies.iter().zip(&mut askers).zip(silhouettes) {
                // A body beside the camera may lie behind the ray.
                let is_before = |silhouette: &Silhouette| silhouette.is_bounded() || body.is_before(&ray);
                if !silhouette.as_ref().is_some_and(|s| s.holds(place) && is_before(s)) {
                    tile.lengths.push(0.0);
                    continue;
                }
                let length =
                    body.length(&ray, asker.as_mut(), &self.cache, &mut tile.work) * R::of(1.0 / body.unit);
                if length.get() > 0.0 {
                    // The ray may be at its second body: greys multiply, in whatever order.
                    light = light * R::of(LET_THROUGH).powf(length.get());
                }
                tile.lengths.push(length.get() as f32);
            }
            tile.greys.push(light.get() as f32);
            tile.traced.push(tile.work.traced > traced_before);
        }
        tile
    }

    /// Bytes that the trees hold, tables beside the cache included.
    pub fn tree_bytes(&self) -> usize {
        let trees = self.bodies.iter().filter(|body| body.tree.is_some()).count();
        self.cache.used_bytes() + trees * SmoothChords::<R>::TABLE_BYTES
    }

    /// What building the trees took.
    pub fn build_counts(&self) -> BuildCounts {
        let mut sum = BuildCounts::default();
        self.bodies.iter().filter_map(|body| body.tree.as_ref()).for_each(|tree| sum += tree.build_counts());
        sum
    }
}

/// Asks a body's tree for rays from one camera.
struct Asker<'t, 'a, R: Real> {
    descent: Descent<'t, SmoothChords<'a, R>>,
    /// Where the camera is, off the tree's middle.
    eye: Vec3<R>,
}

impl<'a, R: Real> Body<'a, R> {
    fn asker(&self, camera: &Camera) -> Option<Asker<'_, 'a, R>> {
        let tree = self.tree.as_ref()?;
        Some(Asker { descent: tree.descent(), eye: tree.attribute().lines().off(Vec3::of(camera.eye())) })
    }

    /// Whether a ray meets its box ahead.
    fn is_before(&self, ray: &Ray<R>) -> bool {
        Slabs::new(ray).stretch(&self.bounds).is_some_and(|(_, far)| far.get() > 0.0)
    }

    /// The length in the body of a ray of unit direction from a camera outside of its box, mm.
    fn length(
        &self,
        ray: &Ray<R>,
        asker: Option<&mut Asker<'_, '_, R>>,
        cache: &Cache,
        work: &mut Work,
    ) -> R {
        if let Some(Asker { descent, eye }) = asker {
            work.queries += 1;
            let line = descent.tree().attribute().lines().point_from(*eye, ray.dir);
            let known = match descent.query(line, cache) {
                None => Some(None),
                Some(Answer::Interpolated(known)) => Some(known),
                Some(Answer::Trace(_)) => None,
            };
            if let Some(known) = known {
                work.interpolated += 1;
                return known.map_or(R::of(0.0), |chord| chord.length());
            }
            work.traced += 1;
        }
        chord(self.surface, ray).unwrap_or(R::of(0.0))
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::geometry::Counted;
    use crate::modes::raytrace::Trees;
    use crate::ritree::Parameters;
    use crate::scene::trace::{Recipe, open, random_volumes};

    const SIZE: (u32, u32) = (30, 20);

    fn seen<R: Real>(world: &World, tracing: Tracing) -> Lengths {
        let bodies = Bodies::<R>::new(world, tracing).expect("bodies");
        bodies.lengths(&world.cameras[0], SIZE, &Control::none()).expect("done")
    }

    #[test]
    fn lengths_by_trees_are_near_and_counting_changes_none() {
        let world = random_volumes(Recipe { seed: 3, count: 4 }).expect("a world");
        let trees = |distance_threshold| {
            // Whatever the angle: cells that are traced have no error.
            let angular_threshold_deg = 180.0;
            let parameters = Parameters { distance_threshold, angular_threshold_deg, max_depth: 22 };
            Tracing::RiTree(Trees { parameters, ..Trees::default() })
        };
        let exact = seen::<f64>(&world, Tracing::Exact);
        assert!(exact.greys.iter().any(|g| *g < 0.7) && exact.greys.contains(&1.0));
        let errors =
            [0.01, 0.25].map(|threshold| exact.mean_difference(&seen::<f64>(&world, trees(threshold))));
        assert!(0.0 < errors[0] && errors[0] < errors[1] && errors[1] < 0.2, "{errors:?}");
        for tracing in [Tracing::Exact, trees(0.25)] {
            let (plain, counted) = (seen::<f64>(&world, tracing), seen::<Counted>(&world, tracing));
            assert!(plain.lengths == counted.lengths && plain.greys == counted.greys);
            assert!(counted.work.operations > 10_000 && plain.work.operations == 0);
            let work = plain.work;
            assert_eq!(work.queries, work.interpolated + work.traced);
            assert_eq!(plain.traced.iter().any(|t| *t), work.traced > 0);
        }
        // From among the bodies, some of which lie beside the camera and behind it.
        let eye = DVec3::new(0.0, 0.0, 0.0);
        let among = Camera::new(eye, DVec3::X, DVec3::Z, 90.0).expect("a camera");
        let is_outside = |object: &Object| !object.surface.bounds().contains(eye);
        let world = World { objects: world.objects.into_iter().filter(is_outside).collect(), ..world };
        assert!(world.objects.len() > 1, "bodies to look at");
        let [exact, near] = [Tracing::Exact, trees(0.01)].map(|tracing| {
            let bodies = Bodies::<f64>::new(&world, tracing).expect("bodies");
            bodies.lengths(&among, SIZE, &Control::none()).expect("done")
        });
        let wrong =
            exact.lengths.iter().zip(&near.lengths).filter(|(exact, near)| **exact == 0.0 && **near > 0.5);
        assert_eq!(wrong.count(), 0, "what lies behind is not looked through");
        assert!(exact.lengths.iter().any(|length| *length > 0.5));
        let bowl = open("tomatoes", Recipe { seed: 1, count: 1 }).expect("a world");
        let refused = Bodies::<f64>::new(&bowl, Tracing::Exact).err().expect("a table is no body");
        assert!(refused.to_string().contains("table"), "{refused}");
    }
}
