//! One object as rays see it: traced, or asked of its tree.

use glam::DVec3;

use crate::attributes::exit_ray::ExitRay;
use crate::attributes::lines::SurfaceLines;
use crate::attributes::surface::{FirstHit, Lights, Seen, vector};
use crate::geometry::{Bounds, Ray, Real, Vec3};
use crate::linespace::{LinePoint, is_in_range};
use crate::ritree::{Answer, BuildCounts, Cache, Parameters, Reason, RiTree};
use crate::scene::trace::{Material, Object, World};
use crate::surface::optics::{Optics, follow};
use crate::surface::{Hit, Reach, Surface};

/// A place where an object is seen.
#[derive(Clone, Copy, Debug)]
pub struct Sight<R> {
    /// How far along the ray.
    pub t: R,
    /// Where.
    pub place: Vec3<R>,
    /// The unit normal, on the side of the ray.
    pub normal: Vec3<R>,
    /// What else is known of it.
    pub known: Known<R>,
}

/// What is known of a sight beside its place and normal.
#[derive(Clone, Copy, Debug)]
pub enum Known<R> {
    /// The hit; shadows and the way on are found when they are asked for.
    Traced(Hit<R>),
    /// The tree has told it all.
    Told {
        /// Lights that the object itself hides from there, a bit each.
        hidden: u8,
        /// How the ray goes on that the object turns, and after how many turns. `None` if it does not.
        turned: Option<(Ray<R>, u32)>,
    },
}

/// The lights of a world before one surface.
#[derive(Clone, Debug)]
pub struct OwnShadow<'a> {
    surface: &'a Surface,
    lights: Vec<DVec3>,
}

impl Lights for OwnShadow<'_> {
    fn hidden<R: Real>(&self, ray: &Ray<R>, hit: &Hit<R>) -> u8 {
        let place = hit.place(ray);
        let is_hidden = |light: &DVec3| {
            let way = Vec3::of(*light) - place;
            let far = way.length();
            let dir = way * (R::of(1.0) / far);
            let cosine = dir.dot(hit.normal).get();
            // Lit from behind it is dark by its normal.
            let faces = (cosine > 0.0) == hit.enters;
            let from = R::of(2.0 * hit.error / cosine.abs().max(f64::MIN_POSITIVE));
            let reach = Reach { from, to: far, ..Reach::whole() };
            faces && self.surface.is_met(&Ray { origin: place, dir }, reach)
        };
        self.lights.iter().enumerate().fold(0, |bits, (i, light)| bits | u8::from(is_hidden(light)) << i)
    }
}

/// The tree of an object, by what it does to rays.
enum Tree<'a, R: Real> {
    Seen(RiTree<FirstHit<'a, OwnShadow<'a>, R>>),
    Through(RiTree<ExitRay<'a, OwnShadow<'a>, R>>),
}

/// An object made ready for rays.
pub struct Seer<'a, R: Real> {
    /// The object.
    pub object: &'a Object,
    /// The box around it.
    pub bounds: Bounds,
    own_shadow: OwnShadow<'a>,
    optics: Option<Optics>,
    limit: u32,
    tree: Option<Tree<'a, R>>,
}

impl<'a, R: Real> Seer<'a, R> {
    /// An object of a world. `parameters` are those of its tree; `None` for none.
    pub fn new(object: &'a Object, world: &World, parameters: Option<Parameters>) -> Self {
        // Convex surfaces hide no place of theirs that faces the light.
        let lights =
            if object.is_convex { Vec::new() } else { world.lights.iter().map(|l| l.position).collect() };
        let own_shadow = OwnShadow { surface: &object.surface, lights };
        let (optics, limit) = (object.material.optics(), world.most_inner_turns);
        let grow = |parameters| {
            let lines = SurfaceLines::new(&object.surface)?;
            Some(match optics {
                None => Tree::Seen(RiTree::new(FirstHit::new(lines, own_shadow.clone()), parameters)),
                Some(optics) => {
                    let exits = ExitRay::new(lines, own_shadow.clone(), optics, limit);
                    Tree::Through(RiTree::new(exits, parameters))
                }
            })
        };
        let tree = parameters.filter(|_| object.grows).and_then(grow);
        let bounds = object.surface.bounds();
        Self { object, bounds, own_shadow, optics, limit, tree }
    }

    /// Its material.
    pub fn material(&self) -> &Material {
        &self.object.material
    }

    /// Whether it has a tree.
    pub fn has_tree(&self) -> bool {
        self.tree.is_some()
    }

    /// The nearest sight of the object by tracing.
    pub fn trace(&self, ray: &Ray<R>, reach: Reach<R>) -> Option<Sight<R>> {
        let hit = self.object.surface.hit(ray, reach)?;
        let normal = if hit.enters { hit.normal } else { -hit.normal };
        Some(Sight { t: hit.t, place: hit.place(ray), normal, known: Known::Traced(hit) })
    }

    /// Whether the object is met within reach.
    pub fn is_met(&self, ray: &Ray<R>, reach: Reach<R>) -> bool {
        self.object.surface.is_met(ray, reach)
    }

    /// The same by its tree, for a ray whose origin lies before the object's box. `Err` says why it is to be traced.
    pub fn ask(&self, ray: &Ray<R>, cache: &Cache) -> Result<Option<Sight<R>>, Reason> {
        match &self.tree {
            None => Err(Reason::Guard),
            Some(Tree::Seen(tree)) => {
                let lines = tree.attribute().lines();
                let point = lines.point(ray);
                let seen = answer(tree.query(point, cache))?;
                Ok(seen.and_then(|seen| sight(lines, ray, point, &seen, |_| None)))
            }
            Some(Tree::Through(tree)) => {
                let exits = tree.attribute();
                let point = exits.lines().point(ray);
                let through = answer(tree.query(point, cache))?;
                Ok(through.and_then(|through| {
                    let turned =
                        |place| exits.exit_of(&through, ray, place).map(|exit| (exit, through.turns()));
                    sight(exits.lines(), ray, point, &through.seen, turned)
                }))
            }
        }
    }

    /// How a ray goes on from a sight. `None` if it does not.
    pub fn turned(&self, ray: &Ray<R>, sight: &Sight<R>) -> Option<(Ray<R>, u32)> {
        match sight.known {
            Known::Told { turned, .. } => turned,
            Known::Traced(hit) => {
                let path = follow(&self.object.surface, ray, hit, self.optics?, self.limit);
                path.exit.map(|exit| (exit, path.turns))
            }
        }
    }

    /// The lights that the object itself hides from a sight, a bit each.
    pub fn hidden(&self, ray: &Ray<R>, sight: &Sight<R>) -> u8 {
        match sight.known {
            Known::Told { hidden, .. } => hidden,
            Known::Traced(hit) => self.own_shadow.hidden(ray, &hit),
        }
    }

    /// Lets time pass, forgets and reports, see [`RiTree`].
    pub fn tick_to(&self, time: u32) {
        match &self.tree {
            Some(Tree::Seen(tree)) => tree.tick_to(time),
            Some(Tree::Through(tree)) => tree.tick_to(time),
            None => {}
        }
    }

    /// See [`RiTree::collect_stamps`].
    pub fn collect_stamps(&self, stamps: &mut Vec<(u32, usize)>) {
        match &self.tree {
            Some(Tree::Seen(tree)) => tree.collect_stamps(stamps),
            Some(Tree::Through(tree)) => tree.collect_stamps(stamps),
            None => {}
        }
    }

    /// See [`RiTree::prune`].
    pub fn prune(&mut self, oldest: u32, cache: &Cache) {
        match &mut self.tree {
            Some(Tree::Seen(tree)) => tree.prune(oldest, cache),
            Some(Tree::Through(tree)) => tree.prune(oldest, cache),
            None => {}
        }
    }

    /// See [`RiTree::build_counts`].
    pub fn build_counts(&self) -> BuildCounts {
        match &self.tree {
            Some(Tree::Seen(tree)) => tree.build_counts(),
            Some(Tree::Through(tree)) => tree.build_counts(),
            None => BuildCounts::default(),
        }
    }
}

/// What a tree says: an output, `None` for a line that passes the box by, or why to trace.
fn answer<T>(answer: Option<Answer<T>>) -> Result<Option<T>, Reason> {
    match answer {
        None => Ok(None),
        Some(Answer::Interpolated(output)) => Ok(Some(output)),
        Some(Answer::Trace(reason)) => Err(reason),
    }
}

fn sight<R: Real>(
    lines: &SurfaceLines,
    ray: &Ray<R>,
    point: LinePoint,
    seen: &Seen,
    turned: impl FnOnce(Vec3<R>) -> Option<(Ray<R>, u32)>,
) -> Option<Sight<R>> {
    if *seen == Seen::MISS || !is_in_range(&point.stuv) {
        return None;
    }
    let t = lines.distance_to(R::of(seen.depth.into()), ray, point.pair);
    let place = ray.at(t);
    let normal = vector(seen.normal);
    let normal = if seen.enters() { normal } else { -normal };
    Some(Sight { t, place, normal, known: Known::Told { hidden: seen.hidden(), turned: turned(place) } })
}
