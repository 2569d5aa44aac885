//! Which places a light reaches past one object, by a map of the object as the light sees it (§2.4, visibility).
//!
//! ```text
//!        light            A place is hidden if the light's ray meets the object nearer than the place. All such rays pass
//!          ☼              through one point, so that two coordinates tell them: a lattice of rays over the object's box
//!         ╱│╲             knows how far they go, and in a cell whose corners and middle fit together the rays between are
//!        ╱ │ ╲            interpolated. Inverse depths are: of a plane they are linear. Along outlines and folds the light's
//!       ╱ ▁▂▃ ╲           ray is traced, unless the rays around all meet the object on one side of the place.
//!      ────●────  place
//! ```
//!
//! Rays of the lattice are traced when they are asked for first. What is known of one is a function of the ray alone, so
//! answers are the same whichever thread asks first.

use std::sync::OnceLock;

use glam::{DVec2, DVec3};

use super::lazy::Lazy;
use crate::geometry::{Ray, Real, Vec3};
use crate::surface::{Reach, Surface};

/// Cells of the lattice along each side.
const SIDE: usize = 96;

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

/// Rays of a light through the points of a lattice across the axis to the object's middle.
struct Lattice {
    axis: DVec3,
    /// Across the axis, for columns and rows.
    across: [DVec3; 2],
    /// Where the object begins, in slopes to the axis, and cells per slope.
    low: DVec2,
    scale: DVec2,
    /// Made when the first place is asked for.
    table: OnceLock<Table>,
}

/// What is known of the lattice's rays and cells.
struct Table {
    /// Inverse depths at the (SIDE + 1)² corners, row by row, and at the SIDE² middles; 0 for a miss.
    corners: Vec<Lazy>,
    middles: Vec<Lazy>,
    /// Cells that no part of the surface covers are never met.
    may_be_met: Vec<bool>,
}

impl<'a> LightMap<'a> {
    /// Bytes that a map holds once it is used.
    pub const BYTES: usize = ((SIDE + 1) * (SIDE + 1) + SIDE * SIDE) * size_of::<Lazy>() + SIDE * SIDE;

    /// The map of a surface before a light. The object's own places are off by `threshold` box units at most.
    pub fn new(surface: &'a Surface, light: DVec3, threshold: f64) -> Self {
        let bounds = surface.bounds();
        let side = bounds.size().max_element();
        let slack = SLACK * side;
        let own_slack = (OWN_SLACK * threshold * side).max(slack);
        Self {
            surface,
            light,
            slack,
            own_slack,
            lattice: Lattice::new(&bounds.corners(), bounds.centre() - light),
        }
    }

    /// Whether the surface hides the light from a place of another one.
    pub fn hides<R: Real>(&self, place: Vec3<R>) -> bool {
        self.hides_by(place, self.slack)
    }

    /// Whether it hides the light from a place of its own, which faces the light at this cosine.
    pub fn hides_itself<R: Real>(&self, place: Vec3<R>, cosine: R) -> bool {
        self.hides_by(place, self.own_slack / cosine.get().max(LEAST_COSINE))
    }

    fn hides_by<R: Real>(&self, place: Vec3<R>, slack: f64) -> bool {
        let way = place - Vec3::of(self.light);
        let known = self.lattice.as_ref().and_then(|lattice| lattice.hides(way, slack, self));
        known.unwrap_or_else(|| self.is_met_before(way, slack))
    }

    /// Whether the light's ray meets the surface by more than the slack before a place that lies `way` from it.
    fn is_met_before<R: Real>(&self, way: Vec3<R>, slack: f64) -> bool {
        let far = way.length();
        let ray = Ray { origin: Vec3::of(self.light), dir: way * (R::of(1.0) / far) };
        self.surface.is_met(&ray, Reach { to: far - R::of(slack), ..Reach::whole() })
    }
}

impl Lattice {
    /// Over the rays to the corners of the object's box, seen along `axis`. `None` if one lies beside the light or behind it.
    fn new(corners: &[DVec3; 8], to_middle: DVec3) -> Option<Self> {
        let axis = to_middle.try_normalize()?;
        let first = axis.any_orthonormal_vector();
        let across = [first, axis.cross(first)];
        let middle = corners.iter().sum::<DVec3>() / 8.0;
        let slopes = corners.map(|corner| slope(axis, across, to_middle + (corner - middle)));
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for slope in slopes {
            (low, high) = (low.min(slope?), high.max(slope?));
        }
        let scale = SIDE as f64 / (high - low);
        scale.is_finite().then_some(Self { axis, across, low, scale, table: OnceLock::new() })
    }

    /// Whether a place that lies `way` from the light is hidden. `None` if that must be traced.
    fn hides<R: Real>(&self, way: Vec3<R>, slack: f64, map: &LightMap) -> Option<bool> {
        let depth = way.dot(Vec3::of(self.axis));
        if depth.get() <= 0.0 {
            // All of the object is on the other side.
            return Some(false);
        }
        let inverse = R::of(1.0) / depth;
        let at: [R; 2] = std::array::from_fn(|i| {
            (way.dot(Vec3::of(self.across[i])) * inverse - R::of(self.low[i])) * R::of(self.scale[i])
        });
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
        let corner = |bits: usize| {
            let (column, row) = (cell[0] + (bits & 1), cell[1] + (bits >> 1));
            let sample = &table.corners[row * (SIDE + 1) + column];
            R::of(sample.get(|| self.sample::<R>(map, [column as f64, row as f64])))
        };
        let corners: [R; 4] = std::array::from_fn(corner);
        let middle = table.middles[cell[1] * SIDE + cell[0]]
            .get(|| self.sample::<R>(map, cell.map(|x| x as f64 + 0.5)));
        // d(1/z) = −dz/z²: a length along the axis.
        let as_length = depth * depth;
        let before = |met: R| match met.get() {
            0.0 => f64::NEG_INFINITY,
            _ => ((met - inverse) * as_length).get(),
        };
        let by_agreement = || agreed(corners.map(before), before(R::of(middle)), slack);
        if corners.iter().any(|c| c.get() == 0.0) {
            return by_agreement();
        }
        let mean = (corners[0] + corners[1] + corners[2] + corners[3]) * R::of(0.25);
        if ((mean - R::of(middle)).abs() * as_length).get() > 0.5 * map.slack {
            return by_agreement();
        }
        let within: [R; 2] = std::array::from_fn(|i| at[i] - R::of(cell[i] as f64));
        let mix = |a: R, b: R, share: R| a + (b - a) * share;
        let met =
            mix(mix(corners[0], corners[1], within[0]), mix(corners[2], corners[3], within[0]), within[1]);
        let before = before(met);
        // Where the interpolated depth may be off by what decides, it does not.
        let is_doubtful = (before - slack).abs() < 0.5 * map.slack;
        (!is_doubtful).then_some(before > slack)
    }

    /// The inverse depth at which the light's ray through a point of the lattice first meets the surface; 0 if it does not.
    fn sample<R: Real>(&self, map: &LightMap, at: [f64; 2]) -> f64 {
        let slopes = self.low + DVec2::from(at) / self.scale;
        let dir = Vec3::<R>::of(self.axis)
            + Vec3::of(self.across[0]) * R::of(slopes.x)
            + Vec3::of(self.across[1]) * R::of(slopes.y);
        let over = R::of(1.0) / dir.length();
        let ray = Ray { origin: Vec3::of(map.light), dir: dir * over };
        map.surface.hit(&ray, Reach::whole()).map_or(0.0, |hit| (R::of(1.0) / (hit.t * over)).get())
    }

    /// Nothing is known, but for the cells that no box around a part of the surface covers.
    fn table(&self, map: &LightMap) -> Table {
        let mut may_be_met = vec![false; SIDE * SIDE];
        for part in map.surface.parts() {
            let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
            for corner in part.corners() {
                let at = slope(self.axis, self.across, corner - map.light);
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
        Table { corners: Lazy::many((SIDE + 1) * (SIDE + 1)), middles: Lazy::many(SIDE * SIDE), may_be_met }
    }
}

/// What the rays around one say together, where they are not interpolated: whether all meet the surface before the place, or
/// none does, by more than the slack. A ray that misses meets it infinitely far behind.
fn agreed(corners: [f64; 4], middle: f64, slack: f64) -> Option<bool> {
    // Where all miss something small may lie between.
    let is_met = corners.into_iter().chain([middle]).any(|before| before > f64::NEG_INFINITY);
    let all = |is_so: fn(f64, f64) -> bool| is_so(middle, slack) && corners.iter().all(|&b| is_so(b, slack));
    if all(|before, slack| before > 2.0 * slack) {
        return Some(true);
    }
    (is_met && all(|before, slack| before < -slack)).then_some(false)
}

/// The slopes to the axis of the way to a place. `None` unless it lies before the light.
fn slope(axis: DVec3, across: [DVec3; 2], way: DVec3) -> Option<DVec2> {
    let depth = way.dot(axis);
    (depth > 0.0).then(|| DVec2::new(way.dot(across[0]), way.dot(across[1])) / depth)
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
                assert_eq!(map.hides(Vec3::<f64>::of(place)), map.hides(Vec3::<f64>::of(place)));
                let told = lattice.hides(Vec3::<f64>::of(way), map.slack, &map);
                places += 1;
                hidden += u32::from(truth);
                known += u32::from(told.is_some());
                wrong += u32::from(told.is_some_and(|told| told != truth));
            }
        }
        // Rays between those of the lattice may graze what they do not.
        assert!(hidden > places / 10 && known > places / 2, "{hidden}, {known} of {places}");
        assert!(wrong * 200 < known, "{wrong} of {known} known");
    }

    #[test]
    fn behind_the_light_and_beside_the_object_nothing_is_hidden() {
        let world = open("random-volumes", Recipe { seed: 2, count: 1 }).expect("a world");
        let surface = &world.objects[0].surface;
        let light = surface.bounds().centre() + DVec3::new(0.0, 0.0, 900.0);
        let map = LightMap::new(surface, light, 0.05);
        let hides = |off: DVec3| map.hides(Vec3::<f64>::of(surface.bounds().centre() + off));
        assert!(hides(DVec3::new(0.0, 0.0, -300.0)));
        assert!(!hides(DVec3::new(0.0, 0.0, 300.0)) && !hides(DVec3::new(0.0, 0.0, 1200.0)));
        assert!(!hides(DVec3::new(400.0, 0.0, -300.0)));
        // So near that no plane shows all of the object, every ray is traced.
        let near = LightMap::new(surface, surface.bounds().centre(), 0.05);
        assert!(near.lattice.is_none() && near.hides(Vec3::<f64>::of(light)));
    }
}
