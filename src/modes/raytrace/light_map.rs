//! Which places a light reaches past one object, by a map of the object as the light sees it (§2.4, visibility).
//!
//! ```text
//!        light            A place is hidden if the light's ray meets the object nearer than the place. All such rays pass
//!          ☼              through one point, so that two coordinates tell them: a lattice of rays over the object's box
//!         ╱│╲             knows how deep they go. Where a block of 2 × 2 cells lies flat enough, its inner points say that
//!        ╱ │ ╲            the rays between may be interpolated: first in wide cells, which smooth surfaces fill with few
//!       ╱ ▁▂▃ ╲           rays, then in narrow ones. Along outlines and folds the light's ray is traced, unless the rays
//!      ────●────  place   around all meet the object on one side of the place.
//! ```
//!
//! Rays of the lattice are traced when they are asked for first. What is known of one is a function of the ray alone, so
//! answers are the same whichever thread asks first.

use std::sync::OnceLock;

use glam::{DVec2, DVec3};

use super::lazy::Lazy;
use crate::geometry::{Bounds, Ray, Real, Vec3};
use crate::surface::{Reach, Surface};

/// Cells of the lattice along each side.
const SIDE: usize = 96;

/// Cells along the blocks that are held to be flat, the wide ones first. What is thinner than half a wide block, a fiftieth
/// of the object's width, may slip between its points where another part of the object lies behind it.
const BLOCKS: [usize; 2] = [4, 2];

/// The parts of the surface that are told apart to know which cells are never met, at most.
const MOST_PARTS: usize = 4096;

/// A block is flat if its inner points are off by no more than the slack. Between the points of its cells, of half the
/// width, depths then are off by a quarter of that where the surface is smooth, and by half of it at a crease: this share is
/// left aside around what decides.
const ROOM: f64 = 0.5;

/// A place of another object is not hidden by what lies before it by less than this share of the object's longest side.
const SLACK: f64 = 0.01;

/// Nor is a place of the object itself by what lies before it by less than this share of how far its tree may put it off.
const OWN_SLACK: f64 = 0.2;

/// A place that is off across the surface is off along a light by as much over the cosine between them; but places that
/// the light grazes have little of it.
const LEAST_COSINE: f64 = 0.1;

/// An object before one light.
pub struct LightMap<'a> {
    surface: &'a Surface,
    light: DVec3,
    /// See [`SLACK`] and [`OWN_SLACK`], as lengths.
    slack: f64,
    own_slack: f64,
    /// `None` if the object is so near to the light that no plane shows all of it.
    lattice: Option<Lattice>,
}

/// Rays of a light through the points of a lattice across an axis of the world.
struct Lattice {
    /// The axis along which depths are, and whether they grow towards its lower end. Columns and rows run along the two
    /// that follow it.
    axis: usize,
    is_downward: bool,
    /// How deep the ray to the object's middle goes, by its length.
    cosine: f64,
    /// Where the object begins, in slopes to the axis, and cells per slope.
    low: DVec2,
    scale: DVec2,
    /// Made when the first place is asked for.
    table: OnceLock<Table>,
}

/// What is known of the lattice's rays and cells.
struct Table {
    /// Depths at the (SIDE + 1)² points, row by row; infinite for a miss.
    points: Vec<Lazy>,
    /// Whether the blocks of each width are flat: 1 or 0.
    flat: [Vec<Lazy>; BLOCKS.len()],
    /// Cells that no part of the surface covers are never met.
    may_be_met: Vec<bool>,
}

/// A lattice with its table, to ask for points.
struct Points<'l, 'a> {
    lattice: &'l Lattice,
    table: &'l Table,
    map: &'l LightMap<'a>,
}

impl<'a> LightMap<'a> {
    /// Bytes that a map holds once it is used.
    pub const BYTES: usize = {
        let (wide, narrow) = (SIDE / BLOCKS[0], SIDE / BLOCKS[1]);
        ((SIDE + 1) * (SIDE + 1) + wide * wide + narrow * narrow) * size_of::<Lazy>() + SIDE * SIDE
    };

    /// The map of a surface before a light. The object's own places are off by `threshold` box units at most.
    pub fn new(surface: &'a Surface, light: DVec3, threshold: f64) -> Self {
        let bounds = surface.bounds();
        let side = bounds.size().max_element();
        let slack = SLACK * side;
        let own_slack = (OWN_SLACK * threshold * side).max(slack);
        Self { surface, light, slack, own_slack, lattice: Lattice::new(&bounds, light) }
    }

    /// Whether the surface hides the light from a place of another one that lies `way` from it.
    pub fn hides<R: Real>(&self, way: Vec3<R>) -> bool {
        self.hides_by(way, R::of(self.slack))
    }

    /// Whether it hides the light from a place of its own, which faces the light at this cosine.
    pub fn hides_itself<R: Real>(&self, way: Vec3<R>, cosine: R) -> bool {
        self.hides_by(way, R::of(self.own_slack) / cosine.max(R::of(LEAST_COSINE)))
    }

    fn hides_by<R: Real>(&self, way: Vec3<R>, slack: R) -> bool {
        let known = self.lattice.as_ref().and_then(|lattice| lattice.hides(way, slack, self));
        known.unwrap_or_else(|| self.is_met_before(way, slack))
    }

    /// Whether the light's ray meets the surface by more than the slack before a place that lies `way` from it.
    fn is_met_before<R: Real>(&self, way: Vec3<R>, slack: R) -> bool {
        let far = way.length();
        let ray = Ray { origin: Vec3::of(self.light), dir: way * (R::of(1.0) / far) };
        self.surface.is_met(&ray, Reach { to: far - slack, ..Reach::whole() })
    }
}

impl Lattice {
    /// Over the rays to the corners of the object's box. `None` if one lies beside the light or behind it, whatever the axis.
    fn new(bounds: &Bounds, light: DVec3) -> Option<Self> {
        let to_middle = bounds.centre() - light;
        // Along which the box begins farthest from the light.
        let axis = (to_middle.abs() - 0.5 * bounds.size()).max_position();
        let is_downward = to_middle[axis] < 0.0;
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for corner in bounds.corners() {
            let slope = slope(axis, is_downward, corner - light)?;
            (low, high) = (low.min(slope), high.max(slope));
        }
        let scale = SIDE as f64 / (high - low);
        let cosine = to_middle[axis].abs() / to_middle.length();
        let lattice = Self { axis, is_downward, cosine, low, scale, table: OnceLock::new() };
        scale.is_finite().then_some(lattice)
    }

    /// Whether a place that lies `way` from the light is hidden. `None` if that must be traced.
    fn hides<R: Real>(&self, way: Vec3<R>, slack: R, map: &LightMap) -> Option<bool> {
        let [depth, column, row] = [0, 1, 2].map(|i| way.axis((self.axis + i) % 3));
        let depth = if self.is_downward { -depth } else { depth };
        if depth.get() <= 0.0 {
            // All of the object is on the other side.
            return Some(false);
        }
        let inverse = R::of(1.0) / depth;
        let at = |i: usize, across: R| (across * inverse - R::of(self.low[i])) * R::of(self.scale[i]);
        let at = [at(0, column), at(1, row)];
        // Beyond the object's box by more than rounding.
        let is_outside = |x: &R| x.get() < -1e-9 || x.get() > SIDE as f64 + 1e-9;
        if at.iter().any(is_outside) {
            return Some(false);
        }
        let cell = at.map(|x| (x.get().max(0.0) as usize).min(SIDE - 1));
        let table = self.table.get_or_init(|| self.table(map));
        if !table.may_be_met[cell[1] * SIDE + cell[0]] {
            return Some(false);
        }
        let points = Points { lattice: self, table, map };
        let slack = slack * R::of(self.cosine);
        match points.flat_width::<R>(cell) {
            Some(width) => points.interpolated(at, cell.map(|x| x / width * width), width, depth - slack),
            None => agreed(points.corners(cell, 1), depth, slack),
        }
    }

    /// The depth at which the light's ray through a point of the lattice first meets the surface; infinite if it does not.
    fn sample<R: Real>(&self, map: &LightMap, at: [f64; 2]) -> f64 {
        let slopes = self.low + DVec2::from(at) / self.scale;
        let mut way = DVec3::splat(if self.is_downward { -1.0 } else { 1.0 });
        way[(self.axis + 1) % 3] = slopes.x;
        way[(self.axis + 2) % 3] = slopes.y;
        let way = Vec3::<R>::of(way);
        let over = R::of(1.0) / way.length();
        let ray = Ray { origin: Vec3::of(map.light), dir: way * over };
        map.surface.hit(&ray, Reach::whole().in_f32()).map_or(f64::INFINITY, |hit| (hit.t * over).get())
    }

    /// Nothing is known, but for the cells that no box around a part of the surface covers.
    fn table(&self, map: &LightMap) -> Table {
        let mut may_be_met = vec![false; SIDE * SIDE];
        for part in map.surface.parts(MOST_PARTS) {
            let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
            for corner in part.corners() {
                let at = slope(self.axis, self.is_downward, corner - map.light);
                // A box beside the light may be anywhere.
                let at = at.map_or([DVec2::NEG_INFINITY, DVec2::INFINITY], |at| [at, at]);
                (low, high) = (low.min(at[0]), high.max(at[1]));
            }
            // With room for rounding.
            let cell = |slope: DVec2, room: f64| {
                ((slope - self.low) * self.scale + room).clamp(DVec2::ZERO, DVec2::splat(SIDE as f64 - 1.0))
            };
            let (low, high) = (cell(low, -1e-6), cell(high, 1e-6));
            for row in low.y as usize..=high.y as usize {
                may_be_met[row * SIDE + low.x as usize..=row * SIDE + high.x as usize].fill(true);
            }
        }
        let flat = BLOCKS.map(|block| Lazy::many((SIDE / block) * (SIDE / block)));
        Table { points: Lazy::many((SIDE + 1) * (SIDE + 1)), flat, may_be_met }
    }
}

impl Points<'_, '_> {
    /// How deep the ray through a point goes.
    #[inline]
    fn depth<R: Real>(&self, column: usize, row: usize) -> R {
        let sample = || self.lattice.sample::<R>(self.map, [column as f64, row as f64]);
        R::of(self.table.points[row * (SIDE + 1) + column].get(sample))
    }

    /// At the corners of a cell of a width, two columns of two rows.
    #[inline]
    fn corners<R: Real>(&self, low: [usize; 2], width: usize) -> [R; 4] {
        std::array::from_fn(|bits| self.depth(low[0] + (bits & 1) * width, low[1] + (bits >> 1) * width))
    }

    /// Whether the surface is met before a depth, between the corners of a cell of a width that may be interpolated. `None`
    /// if that is too near to tell.
    fn interpolated<R: Real>(&self, at: [R; 2], low: [usize; 2], width: usize, limit: R) -> Option<bool> {
        let corners: [R; 4] = self.corners(low, width);
        let room = R::of(ROOM * self.lattice.cosine * self.map.slack);
        let (near, far) = span(&corners);
        if limit + room < near {
            return Some(false);
        }
        if limit - room > far {
            return Some(true);
        }
        let within = |i: usize| (at[i] - R::of(low[i] as f64)) * R::of(1.0 / width as f64);
        let (x, y) = (within(0), within(1));
        let mix = |a: R, b: R, share: R| a + (b - a) * share;
        let before = limit - mix(mix(corners[0], corners[1], x), mix(corners[2], corners[3], x), y);
        (before.abs() >= room).then_some(before.get() > 0.0)
    }

    /// The width of the widest cells that may be interpolated where a narrow one lies. `None` if no block there is flat.
    fn flat_width<R: Real>(&self, cell: [usize; 2]) -> Option<usize> {
        let is_flat = |&(block, flat): &(usize, &Vec<Lazy>)| {
            let [column, row] = cell.map(|x| x / block);
            let made = || f64::from(self.is_flat::<R>([column * block, row * block], block / 2));
            flat[row * (SIDE / block) + column].get(made) > 0.0
        };
        BLOCKS.into_iter().zip(&self.table.flat).find(is_flat).map(|(block, _)| block / 2)
    }

    /// Whether the inner points of a block of 2 × 2 cells of a width lie where its outer corners say. Those are asked first,
    /// and the middle next: one that does not fit is enough.
    fn is_flat<R: Real>(&self, low: [usize; 2], width: usize) -> bool {
        let corners: [R; 4] = self.corners(low, 2 * width);
        if span(&corners).1.get() == f64::INFINITY {
            return false;
        }
        let [a, b, c, d] = corners;
        let mean = |a: R, b: R| (a + b) * R::of(0.5);
        let (lower, upper) = (mean(a, b), mean(c, d));
        let tolerance = self.lattice.cosine * self.map.slack;
        let fits = |column: usize, row: usize, said: R| {
            let met: R = self.depth(low[0] + column * width, low[1] + row * width);
            (met - said).abs().get() <= tolerance
        };
        fits(1, 1, mean(lower, upper))
            && fits(1, 0, lower)
            && fits(1, 2, upper)
            && fits(0, 1, mean(a, c))
            && fits(2, 1, mean(b, d))
    }
}

/// The least and the greatest of four depths.
fn span<R: Real>(corners: &[R; 4]) -> (R, R) {
    let [a, b, c, d] = *corners;
    (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)))
}

/// What the rays around one say together, where they are not interpolated: whether all meet the surface before the place, or
/// none does, by more than the slack. A ray that misses meets it infinitely deep.
fn agreed<R: Real>(corners: [R; 4], depth: R, slack: R) -> Option<bool> {
    let (near, far) = span(&corners);
    if depth - slack - slack > far {
        return Some(true);
    }
    // Where all miss something small may lie between.
    (near.get() < f64::INFINITY && depth + slack < near).then_some(false)
}

/// The slopes to an axis of the way to a place, along the two that follow it. `None` unless it lies before the light.
fn slope(axis: usize, is_downward: bool, way: DVec3) -> Option<DVec2> {
    let depth = if is_downward { -way[axis] } else { way[axis] };
    (depth > 0.0).then(|| DVec2::new(way[(axis + 1) % 3], way[(axis + 2) % 3]) / depth)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::scene::trace::{Recipe, open};

    #[test]
    fn maps_say_of_places_what_tracing_them_says() {
        let recipe = Recipe { seed: 2, count: 3 };
        let worlds = ["tomatoes", "random-volumes"].map(|name| open(name, recipe).expect("a world"));
        let mut rng = rand_pcg::Pcg64::seed_from_u64(11);
        let (mut places, mut hidden, mut known, mut wrong) = (0, 0, 0, 0);
        for (world, object) in worlds.iter().flat_map(|w| w.objects.iter().map(move |o| (w, o))) {
            let map = LightMap::new(&object.surface, world.lights[0].position, 0.05);
            let Some(lattice) = &map.lattice else { continue };
            let bounds = object.surface.bounds().grown(20.0);
            for _ in 0..400 {
                let within = DVec3::from([(); 3].map(|()| rng.random_range(0.0..1.0)));
                let place = bounds.min + within * bounds.size();
                let way = place - map.light;
                let truth = map.is_met_before(Vec3::<f64>::of(way), map.slack);
                let told = lattice.hides(Vec3::<f64>::of(way), map.slack, &map);
                assert_eq!(map.hides(Vec3::<f64>::of(way)), told.unwrap_or(truth));
                places += 1;
                hidden += u32::from(truth);
                known += u32::from(told.is_some());
                wrong += u32::from(told.is_some_and(|told| told != truth));
            }
        }
        // Rays between those of the lattice may graze what they do not.
        assert!(hidden > places / 10 && known > places / 2, "{hidden}, {known} of {places}");
        assert!(wrong * 1000 < known, "{wrong} of {known} known");
    }

    #[test]
    fn behind_the_light_and_beside_the_object_nothing_is_hidden() {
        let world = open("random-volumes", Recipe { seed: 2, count: 1 }).expect("a world");
        let surface = &world.objects[0].surface;
        let light = surface.bounds().centre() + DVec3::new(0.0, 0.0, 900.0);
        let map = LightMap::new(surface, light, 0.05);
        let hides = |off: DVec3| map.hides(Vec3::<f64>::of(surface.bounds().centre() + off - light));
        assert!(hides(DVec3::new(0.0, 0.0, -300.0)));
        assert!(!hides(DVec3::new(0.0, 0.0, 300.0)) && !hides(DVec3::new(0.0, 0.0, 1200.0)));
        assert!(!hides(DVec3::new(400.0, 0.0, -300.0)));
        // So near that no plane shows all of the object, every ray is traced.
        let near = LightMap::new(surface, surface.bounds().centre(), 0.05);
        assert!(near.lattice.is_none() && near.hides(Vec3::<f64>::of(light - surface.bounds().centre())));
    }
}
