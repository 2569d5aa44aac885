//! One object as rays see it: traced, or asked of its tree.

use glam::DVec3;

use super::light_map::LightMap;
use crate::attributes::exit_ray::{self, ExitRay};
use crate::attributes::lines::{ByDirection, SurfaceLines};
use crate::attributes::memo::Memo;
use crate::attributes::surface::{FirstHit, Seen, vector};
use crate::geometry::{Bounds, Ray, Real, Vec3};
use crate::linespace::{LinePoint, is_in_range};
use crate::ritree::{Answer, BuildCounts, Cache, Descent, Parameters, Reason, RiTree};
use crate::scene::trace::{Material, Object, World};
use crate::surface::optics::{Optics, follow};
use crate::surface::{Hit, Reach, Surface, steady_gap};

/// Highlights below this share of their light are not seen: a third of the least step of eight bits, in the dark.
const LEAST_HIGHLIGHT: f64 = 1e-4;

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
    /// The hit; the way on is found when it is asked for.
    Traced(Hit<R>),
    /// The tree has told how the ray goes on that the object turns, and after how many turns. `None` if it does not.
    Told(Option<(Ray<R>, u32)>),
}

/// The tree of an object, by what it does to rays.
enum Tree<'a, R: Real> {
    Seen(RiTree<FirstHit<'a, R>>),
    Through(RiTree<ExitRay<'a, R>>),
}

/// Asks an object's tree for one ray after another.
pub struct Asker<'t, 'a, R: Real> {
    way: Way<'t, 'a, R>,
    /// Where the camera is, [off](SurfaceLines::off) the tree's middle.
    eye: Vec3<R>,
}

enum Way<'t, 'a, R: Real> {
    /// There is no tree.
    None,
    /// Of an object that turns no rays.
    Seen(Descent<'t, FirstHit<'a, R>>),
    /// Of one that does.
    Through(Descent<'t, ExitRay<'a, R>>),
}

/// An object made ready for rays.
pub struct Seer<'a, R: Real> {
    /// The object.
    pub object: &'a Object,
    /// The box around it.
    pub bounds: Bounds,
    /// Where it hides each light, for objects with a tree.
    shadows: Vec<LightMap<'a>>,
    lights: Vec<DVec3>,
    /// What it shows of the ambient light.
    pub ambient: DVec3,
    /// What it scatters of each light that it faces.
    pub scattered: Vec<DVec3>,
    /// The cosine to a light's mirrored ray above which a highlight is seen.
    pub highlight_from: f64,
    optics: Option<Optics>,
    limit: u32,
    tree: Option<Tree<'a, R>>,
}

impl<'a, R: Real> Seer<'a, R> {
    /// An object of a world. `parameters` are those of its tree; `None` for none.
    pub fn new(object: &'a Object, world: &World, parameters: Option<Parameters>) -> Self {
        let lights: Vec<DVec3> = world.lights.iter().map(|light| light.position).collect();
        let (optics, limit) = (object.material.optics(), world.most_inner_turns);
        let grow = |parameters| {
            let by_direction = match optics {
                Some(Optics::Glass { .. }) => ByDirection::Much,
                Some(Optics::Mirror) | None => ByDirection::Little,
            };
            let lines = SurfaceLines::new(&object.surface, object.is_convex, by_direction)?;
            Some(match optics {
                None => Tree::Seen(RiTree::new(FirstHit::new(lines), parameters)),
                Some(optics) => {
                    let exits = ExitRay::new(lines, optics, limit, world.sky.radius);
                    Tree::Through(RiTree::new(exits, parameters))
                }
            })
        };
        let tree = parameters.filter(|_| object.grows).and_then(grow);
        let threshold = parameters.map_or(0.0, |p| p.distance_threshold);
        let map = |&light: &DVec3| LightMap::new(&object.surface, light, threshold);
        let shadows = if tree.is_some() { lights.iter().map(map).collect() } else { Vec::new() };
        let bounds = object.surface.bounds();
        let Material { colour, ambient, diffuse, shininess, .. } = object.material;
        Self {
            object,
            bounds,
            shadows,
            lights,
            ambient: ambient * colour * world.ambient,
            scattered: world.lights.iter().map(|light| diffuse * colour * light.colour).collect(),
            highlight_from: LEAST_HIGHLIGHT.powf(1.0 / shininess),
            optics,
            limit,
            tree,
        }
    }

    /// Its material.
    pub fn material(&self) -> &Material {
        &self.object.material
    }

    /// Whether it mirrors rays at planes only.
    pub fn is_flat(&self) -> bool {
        matches!(self.object.surface, Surface::Disc(_) | Surface::Block(_))
            && self.optics == Some(Optics::Mirror)
    }

    /// Whether its hits take few operations.
    pub fn has_closed_form(&self) -> bool {
        self.object.surface.has_closed_form()
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

    /// Whether it hides a light of the world from a place of another object that lies `way` from the light, by its map. `None` if it
    /// has none.
    pub fn hides_by_map(&self, light: usize, way: Vec3<R>) -> Option<bool> {
        self.shadows.get(light).map(|map| map.hides(way))
    }

    /// Whether a ray meets it anywhere within `far`.
    pub fn is_met(&self, ray: &Ray<R>, far: R) -> bool {
        self.object.surface.is_met(ray, Reach { to: far, ..Reach::whole() })
    }

    /// Whether it hides a light from a place of its own, seen along `ray`, which lies `way` from the light and faces it at this cosine.
    pub fn hides_itself(
        &self,
        light: usize,
        way: Vec3<R>,
        ray: &Ray<R>,
        sight: &Sight<R>,
        cosine: R,
    ) -> bool {
        // Convex surfaces hide no place of theirs that faces the light.
        if self.object.is_convex {
            return false;
        }
        match (self.shadows.get(light), sight.known) {
            (Some(map), _) => map.hides_itself(way, cosine),
            (None, Known::Traced(hit)) => self.is_met_again(ray, &hit, self.lights[light]),
            (None, Known::Told(_)) => false,
        }
    }

    /// Whether the way from a hit to a light meets the surface again.
    fn is_met_again(&self, ray: &Ray<R>, hit: &Hit<R>, light: DVec3) -> bool {
        let place = hit.place(ray);
        let way = Vec3::of(light) - place;
        let far = way.length();
        let dir = way * (R::of(1.0) / far);
        let from = R::of(steady_gap(hit.error, dir.dot(hit.normal).get()));
        self.object
            .surface
            .is_met(&Ray { origin: place, dir }, Reach { from, to: far, left: hit.part, ..Reach::whole() })
    }

    /// To ask the tree by rays whose origins lie before the object's box, many of which come from a camera's `eye`.
    pub fn asker(&self, eye: DVec3) -> Asker<'_, 'a, R> {
        let eye = Vec3::of(eye);
        match &self.tree {
            None => Asker { way: Way::None, eye },
            Some(Tree::Seen(tree)) => {
                Asker { eye: tree.attribute().lines().off(eye), way: Way::Seen(tree.descent()) }
            }
            Some(Tree::Through(tree)) => {
                Asker { eye: tree.attribute().lines().off(eye), way: Way::Through(tree.descent()) }
            }
        }
    }

    /// How a ray goes on from a sight. `None` if it does not.
    pub fn turned(&self, ray: &Ray<R>, sight: &Sight<R>) -> Option<(Ray<R>, u32)> {
        match sight.known {
            Known::Told(turned) => turned,
            Known::Traced(hit) => {
                let path = follow(&self.object.surface, ray, hit, self.optics?, self.limit);
                path.exit.map(|exit| (exit, path.turns))
            }
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

    /// Bytes of tables that do not grow: of samples that may be asked for again, and of what lights see.
    pub fn table_bytes(&self) -> usize {
        let memo = match &self.tree {
            Some(Tree::Seen(_)) => Memo::<Seen>::BYTES,
            Some(Tree::Through(_)) => Memo::<exit_ray::Known<R>>::BYTES,
            None => 0,
        };
        memo + self.shadows.len() * LightMap::BYTES
    }
}

impl<R: Real> Asker<'_, '_, R> {
    /// The first sight of the object along a ray; its line may be one through the eye. `Err` says why it is to be traced.
    pub fn ask(
        &mut self,
        ray: &Ray<R>,
        is_from_eye: bool,
        cache: &Cache,
    ) -> Result<Option<Sight<R>>, Reason> {
        let eye = is_from_eye.then_some(self.eye);
        let point_of = |lines: &SurfaceLines| match eye {
            Some(eye) => lines.point_from(eye, ray.dir),
            None => lines.point(ray),
        };
        match &mut self.way {
            Way::None => Err(Reason::Guard),
            Way::Seen(descent) => {
                let lines = descent.tree().attribute().lines();
                let point = point_of(lines);
                let seen = answer(descent.query(point, cache))?;
                Ok(seen.and_then(|seen| sight(lines, ray, point, &seen, |_, _| None)))
            }
            Way::Through(descent) => {
                let exits = descent.tree().attribute();
                let point = point_of(exits.lines());
                let through = answer(descent.query(point, cache))?;
                Ok(through.and_then(|through| {
                    let turned = |place, normal| {
                        exits.exit_of(&through, ray, place, normal).map(|exit| (exit, through.turns()))
                    };
                    sight(exits.lines(), ray, point, &through.seen, turned)
                }))
            }
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
    turned: impl FnOnce(Vec3<R>, Vec3<R>) -> Option<(Ray<R>, u32)>,
) -> Option<Sight<R>> {
    if *seen == Seen::MISS || !is_in_range(&point.stuv) {
        return None;
    }
    let t = lines.distance_to(R::of(seen.depth.into()), ray, point.pair);
    let place = ray.at(t);
    // As f32 tells it, it is not of unit length, nor would be what is mirrored at it.
    let normal = vector(seen.normal).normalized();
    let normal = if seen.enters() { normal } else { -normal };
    Some(Sight { t, place, normal, known: Known::Told(turned(place, normal)) })
}
