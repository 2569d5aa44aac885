//! How far rounding alone may take two answers to one question apart.
//!
//! An exact engine's answer is the chord of a surface that rounding has moved, in places, by no more than a shift s. A face
//! moved by s along its normal n moves the crossing of a ray d by s / |n·d|: so a length is off by at most s · K, where K is the
//! sum of 1/|n·d| over the faces that the ray pierces. At an edge two planes compete: the entry is the later of the two
//! crossings, and moves by no more than the one that moves more, so K of the two answers together bound their difference.
//!
//! Not so at the outline, where one answer may be a hit and the other a miss. A ray comes within s of the outline with chance
//! s times its length over the shadow's area, some 10⁻¹², so that an oracle takes it for a fault.

use glam::{DAffine3, DVec3};

use super::{Rays, Witness};
use crate::exact::{Body, Engine, Pierced};
use crate::geometry::numeric::gamma;

/// Roundings of the engines' places over the distance from the source: γ₈ by `clip`, `walk` and `bvh`; γ₉₆ times the
/// obliquity of pixels by `raster`, which maps of the oracles make 4 at most.
const ENGINE: f64 = gamma(8 + 96 * 4);

/// Roundings of rays' ends and of vertices over their distance from the origin: a map takes three products, three sums and three
/// roundings of its own numbers; a grid's point two products and two sums, a ray's source one more; twice as a target is
/// the sum of a source and a path.
const PLACING: f64 = gamma(32);

/// The answers to one question: lengths, and what rounding may make of each.
pub(super) struct Answers {
    pub lengths: Vec<f64>,
    /// Of each ray, mm.
    pub rounding: Vec<f64>,
    /// From source to target, mm.
    pub paths: Vec<f64>,
    /// What the witness promises in the mean, mm; 0 of exact ones.
    pub promised: f64,
}

impl Answers {
    /// Asks `witness`. `moved_mm` is how much farther the surface or the rays may be off than they are rounded here.
    pub fn of(witness: &dyn Witness, body: &Body, rays: &Rays, moved_mm: f64) -> Self {
        let segments = rays.segments();
        let mut pierced = Pierced::default();
        body.trace(Engine::Bvh, 0, &segments, &mut pierced);
        let mut steepness = vec![0.0; segments.len()];
        for pierce in &pierced.0 {
            let [a, b, c] = body.surface().mesh().triangle(pierce.face as usize);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let ray = pierce.ray as usize;
            steepness[ray] += 1.0 / normal.dot(segments[ray].line().dir()).abs();
        }
        let shift = shift_mm(body, rays) + moved_mm;
        Self {
            lengths: witness.lengths(body, rays),
            rounding: steepness.into_iter().map(|k| shift * k).collect(),
            paths: segments.iter().map(|ray| ray.length_mm()).collect(),
            promised: witness.promised_error_mm(body),
        }
    }
}

/// How far the engine's surface may be from the body's along a ray, mm.
fn shift_mm(body: &Body, rays: &Rays) -> f64 {
    let bounds = body.bounds();
    let ends = rays.ends();
    let middle = bounds.centre();
    let distance =
        ends.iter().map(|[from, _]| (*from - middle).length()).fold(0.0, f64::max) + bounds.diagonal();
    let reach = ends
        .iter()
        .flatten()
        .map(|end| end.length())
        .fold(bounds.max.abs().max(bounds.min.abs()).length(), f64::max);
    let reflex = body.convexity().map_or(0.0, |convex| convex.reflex_depth_mm());
    ENGINE * distance + PLACING * reach + reflex
}

/// How far rounding moves what `map` maps, mm, for points no farther from the origin than `reach_mm`.
pub(super) fn mapping_error_mm(map: &DAffine3, reach_mm: f64) -> f64 {
    let largest = map.matrix3.to_cols_array().into_iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    PLACING * (3.0 * largest * reach_mm + map.translation.length())
}

/// The farthest corner of a body's box from the origin, mm.
pub(super) fn reach_mm(body: &Body) -> f64 {
    body.bounds().corners().into_iter().map(DVec3::length).fold(0.0, f64::max)
}

/// Collects differences of two answers and what they may be.
#[derive(Default)]
pub(super) struct Differences {
    rays: usize,
    met: usize,
    sum: f64,
    promised: f64,
    /// Difference and bound of the ray that strains its bound most.
    worst: (f64, f64),
}

impl Differences {
    /// A ray's difference, what rounding may make of it, and what was promised of it in the mean. `met` if it meets anything.
    pub fn add(&mut self, difference: f64, rounding: f64, promised: f64, met: bool) {
        self.rays += 1;
        self.promised = self.promised.max(promised);
        if !met {
            return;
        }
        self.met += 1;
        self.sum += difference;
        let strains_more = difference * self.worst.1 > self.worst.0 * rounding || self.met == 1;
        if strains_more || difference.is_nan() {
            self.worst = (difference, rounding);
        }
    }

    /// How many there are.
    pub fn rays(&self) -> usize {
        self.rays
    }

    /// What was measured and what it may be: of the worst ray, or in the mean of lengths that are interpolated.
    pub fn judged(&self) -> ((f64, f64), &'static str) {
        if self.promised > 0.0 {
            ((self.sum / self.met.max(1) as f64, self.promised), "mm, mean of |difference|")
        } else {
            (self.worst, "mm, of the worst ray")
        }
    }
}
