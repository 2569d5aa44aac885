//! Pieces of patches, each so flat that Newton's method is certain to find its one root or that there is none.
//!
//! For a ray o + t·d and a piece with middle c and tangents a, b there, solving o + t·d = S(u, v) is finding the root
//! of the plane system f = Y·(S − o), where Y is the inverse of the projection of (a, b) along d. Its rows have lengths
//! |b|/|det| and |a|/|det| at most, det = d·(a × b). On the whole piece
//!
//! ```text
//!   ‖I − Y·J‖∞ ≤ κ = max(|a|, |b|) · (sup|S_u − a| + sup|S_v − b|) / |det|
//! ```
//!
//! With κ < 1, f is injective: one root or none. Newton's method then contracts by 2κ/(1 − κ) wherever it starts, and
//! near the end by half the second derivatives' bound (Kantorovich). Both bounds come from the control net, once per
//! piece; a ray pays one division for its κ. A piece that a ray sees too obliquely is cut in two, again and again, for that ray.

use glam::DVec3;

use super::patch::BezierPatch;
use crate::geometry::numeric::gamma;
use crate::geometry::{Bounds, Ray, Real, Vec3};

/// The largest κ that is believed: Newton's method then contracts by at least 2κ/(1 − κ) = ½.
const LARGEST_KAPPA: f64 = 0.2;

/// Pieces made ready are flat enough for rays at this cosine to their normal; others have them cut. At 0.3 there would be half as
/// many, ready in half the time, and rays would take a twentieth longer.
const READY_COSINE: f64 = 0.2;

/// Cuts on the way to a piece that is made ready. Near the pole of a patch that shrinks to a point no number is enough.
const MOST_CUTS: u32 = 12;

/// Parameters that rounding moves by more than this share of a piece are not sought: the ray sees the piece edge-on. On
/// a fold, roots are so found if the ray is nearer to the surface's inside by some 50 times its rounding.
const LARGEST_TOLERANCE: f64 = 0.1;

/// Halvings from 1 to below the best [accuracy](super::Reach::accuracy): with a contraction of ½ no iteration goes on longer.
const MOST_STEPS: u32 = 41;

/// Bounds of rounding take so many operations in a row: the evaluation of a point (22) and the three products after it.
const OPERATIONS: u32 = 40;

/// A part of a patch with its bounds.
#[derive(Clone, Debug)]
pub struct Piece {
    /// The patch's index.
    pub patch: u32,
    /// Around the part, grown by rounding.
    pub bounds: Bounds,
    low: [f64; 2],
    size: [f64; 2],
    centre: DVec3,
    a: DVec3,
    b: DVec3,
    normal: DVec3,
    longest: f64,
    /// max(|a|, |b|) · (sup|S_u − a| + sup|S_v − b|).
    slack: f64,
    /// Half of sup(|S_uu| + 2|S_uv| + |S_vv|), times max(|a|, |b|).
    bend: f64,
    /// The whole net's coordinates are at most this.
    magnitude: f64,
}

/// A root of a ray on a piece.
#[derive(Clone, Copy, Debug)]
pub struct Root<R> {
    pub t: R,
    /// S_u × S_v, not normalized.
    pub normal: Vec3<R>,
    pub error: f64,
}

impl Piece {
    /// The piece of patch `index` over a rectangle of its parameters.
    pub fn new(patch: &BezierPatch, index: u32, low: [f64; 2], size: [f64; 2]) -> Self {
        let part = patch.part([low[0], low[0] + size[0]], [low[1], low[1] + size[1]]);
        let jet = part.jet(0.5, 0.5);
        let (a, b) = (jet.along_u.get(), jet.along_v.get());
        let [along_u, along_v] = part.tangent_spread(a, b);
        let longest = a.length().max(b.length());
        let bounds = part.bounds();
        let magnitude = patch.net().iter().flatten().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        Self {
            patch: index,
            bounds: bounds.grown(gamma(OPERATIONS) * magnitude),
            low,
            size,
            centre: jet.point.get(),
            a,
            b,
            normal: a.cross(b),
            longest,
            slack: longest * (along_u + along_v),
            bend: 0.5 * part.bend() * longest,
            magnitude,
        }
    }

    /// The pieces of a whole patch, cut until rays not too oblique are certain of their roots.
    pub fn of_patch(patch: &BezierPatch, index: u32) -> Vec<Self> {
        let mut ready = Vec::new();
        let mut pending = vec![(Self::new(patch, index, [0.0; 2], [1.0; 2]), 0)];
        while let Some((piece, cuts)) = pending.pop() {
            if cuts == MOST_CUTS || piece.slack <= LARGEST_KAPPA * READY_COSINE * piece.normal.length() {
                ready.push(piece);
            } else {
                pending.extend(piece.halves(patch, piece.longer()).map(|half| (half, cuts + 1)));
            }
        }
        ready
    }

    /// The parameter along which the piece is longer: cut there, pieces at a pole stay few.
    fn longer(&self) -> usize {
        usize::from(self.b.length() > self.a.length())
    }

    fn halves(&self, patch: &BezierPatch, across: usize) -> [Self; 2] {
        let mut size = self.size;
        size[across] *= 0.5;
        let mut upper = self.low;
        upper[across] += size[across];
        [Self::new(patch, self.patch, self.low, size), Self::new(patch, self.patch, upper, size)]
    }

    /// Calls `found` for each root of the ray on the piece, its edges included, to an `accuracy` as a share of it. A ray that `is_leaving` starts on the piece; that
    /// root is left out where it is certain to be the only one. A ray that only touches the piece, nearer
    /// to it than rounding can tell, does not cross it.
    pub fn roots<R: Real>(
        &self,
        patch: &BezierPatch,
        ray: &Ray<R>,
        reach: f64,
        is_leaving: bool,
        accuracy: f64,
        found: &mut impl FnMut(Root<R>),
    ) {
        // c = d × (o − centre): the ray's moment about the middle.
        let moment = ray.dir.cross(ray.origin - Vec3::of(self.centre));
        let det = ray.dir.dot(Vec3::of(self.normal));
        let steepness = det.abs();
        let kappa = R::of(self.slack) / steepness;
        // What rounding moves a parameter by: intercepts err by γ of the distances they are made of.
        let tolerance =
            2.0 * self.longest * gamma(OPERATIONS) * (reach + self.magnitude) / steepness.get() + accuracy;
        if kappa.get() <= LARGEST_KAPPA && tolerance <= LARGEST_TOLERANCE {
            if is_leaving {
                return;
            }
            let over = R::of(1.0) / det;
            let start = [Vec3::of(self.b).dot(moment) * over, -(Vec3::of(self.a).dot(moment) * over)];
            // A root in the piece is nearer to the linear root than κ times half the piece.
            let half = R::of(0.5 + tolerance) + kappa * R::of(0.5 + tolerance);
            if start[0].abs() > half || start[1].abs() > half {
                return;
            }
            if let Some(root) = self.newton(patch, ray, start, kappa, steepness, [tolerance, accuracy]) {
                found(root);
            }
            return;
        }
        self.cut(patch, ray, reach, accuracy, found);
    }

    /// The root, by Newton's method on the piece, clamped to it; clamping to a convex set that holds the root moves no
    /// step away from it. `None` if the method comes to rest on the border with the root outside.
    fn newton<R: Real>(
        &self,
        patch: &BezierPatch,
        ray: &Ray<R>,
        start: [R; 2],
        kappa: R,
        steepness: R,
        [tolerance, accuracy]: [f64; 2],
    ) -> Option<Root<R>> {
        let limit = 0.5 + tolerance;
        let clamp = |x: R| x.max(R::of(-limit)).min(R::of(limit));
        // ‖error after a step‖ ≤ quadratic · ‖error before it‖².
        let kept = R::of(1.0) - kappa;
        let quadratic = R::of(self.bend) / (steepness * kept);
        // The error before a step is at most the step over 1 − q, q ≤ ½.
        let enough = |step: R| (quadratic * (R::of(4.0) * step * step)).get() <= accuracy;
        let mut x = start.map(clamp);
        for _ in 0..MOST_STEPS {
            let u = R::of(self.low[0]) + R::of(self.size[0]) * (x[0] + R::of(0.5));
            let v = R::of(self.low[1]) + R::of(self.size[1]) * (x[1] + R::of(0.5));
            let jet = patch.jet(u, v);
            let moment = ray.dir.cross(ray.origin - jet.point);
            let normal = jet.along_u.cross(jet.along_v);
            let over = R::of(1.0) / ray.dir.dot(normal);
            // Steps in the patch's parameters, and in the piece's.
            let du = jet.along_v.dot(moment) * over;
            let dv = -(jet.along_u.dot(moment) * over);
            let step = [du * R::of(1.0 / self.size[0]), dv * R::of(1.0 / self.size[1])];
            let next = [x[0] + step[0], x[1] + step[1]];
            let is_inside = next.iter().all(|&c| clamp(c) == c);
            let longest = step[0].abs().max(step[1].abs());
            // Below the tolerance, rounding is all that is left of a step.
            if is_inside && (enough(longest) || longest.get() <= tolerance) {
                let place = jet.point + jet.along_u * du + jet.along_v * dv;
                let error = (tolerance * self.longest).max(gamma(OPERATIONS) * self.magnitude);
                return Some(Root { t: ray.dir.dot(place - ray.origin), normal, error });
            }
            let clamped = next.map(clamp);
            let moved = (clamped[0] - x[0]).abs().max((clamped[1] - x[1]).abs());
            if !is_inside && moved.get() <= tolerance {
                return None;
            }
            x = clamped;
        }
        None
    }

    /// The roots on the two halves, if the ray's line comes near.
    fn cut<R: Real>(
        &self,
        patch: &BezierPatch,
        ray: &Ray<R>,
        reach: f64,
        accuracy: f64,
        found: &mut impl FnMut(Root<R>),
    ) {
        let rounding = gamma(OPERATIONS) * (reach + self.magnitude);
        // The ray misses the ball around the piece.
        let radius = 0.5 * self.bounds.diagonal() + rounding;
        let across = ray.dir.cross(ray.origin - Vec3::of(self.bounds.centre()));
        if across.dot(across).get() > radius * radius {
            return;
        }
        if self.is_beside(ray, rounding) {
            return;
        }
        let thickness = self.slack / self.longest.max(f64::MIN_POSITIVE);
        if thickness <= rounding {
            // Flat as far as rounding can tell: what is seen edge-on is not crossed; a pole is, once it is a point.
            let normal = self.steady_normal(patch);
            if ray.dir.get().dot(normal).abs() <= EDGE_ON_COSINE {
                return;
            }
            if self.longest <= 4.0 * rounding {
                let t = ray.dir.dot(Vec3::of(self.centre) - ray.origin);
                // The ray is as near to the pieces beside it.
                found(Root { t, normal: Vec3::of(normal), error: 4.0 * radius });
                return;
            }
        }
        self.halves(patch, self.longer())
            .iter()
            .for_each(|half| half.roots(patch, ray, reach, false, accuracy, found));
    }

    /// Whether a plane along the ray parts its line from the piece: across d and a, or d and b. On the piece S is no farther
    /// from the parallelogram of its tangents than half the tangents' spread.
    fn is_beside<R: Real>(&self, ray: &Ray<R>, rounding: f64) -> bool {
        let off = ray.origin - Vec3::of(self.centre);
        let spread = self.slack / self.longest.max(f64::MIN_POSITIVE);
        let parts = |along: DVec3, other: DVec3| {
            let across = ray.dir.cross(Vec3::of(along));
            let half = R::of(0.5) * across.dot(Vec3::of(other)).abs();
            let room = half + R::of(0.5 * spread + rounding) * across.length();
            off.dot(across).abs() > room
        };
        parts(self.a, self.b) || parts(self.b, self.a)
    }

    /// The unit normal at the middle; where the tangents vanish, a little way towards the patch's middle.
    fn steady_normal(&self, patch: &BezierPatch) -> DVec3 {
        let middle = [0, 1].map(|a| self.low[a] + 0.5 * self.size[a]);
        // A thousandth of the patch: its normal turns by no more than that share of its bend.
        let towards = middle.map(|x| x + 1e-3 * (0.5 - x));
        let jet = patch.jet(towards[0], towards[1]);
        jet.along_u.cross(jet.along_v).normalized().get()
    }
}

/// Below this cosine a piece that is flat as far as rounding can tell counts as seen edge-on.
const EDGE_ON_COSINE: f64 = 1e-3;
