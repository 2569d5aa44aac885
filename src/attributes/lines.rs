//! What attributes of surfaces share: lines of one object's box, and the distance of two output rays.

use glam::DVec3;

use super::chord::LEAST_SEPARATION;
use crate::geometry::{Bounds, Ray, Real, Vec3, convex_hull};
use crate::linespace::{ACROSS, Cell, LinePoint, LineSpace, PlanePair};
use crate::surface::Surface;

/// A surface with the line space of a cube around it and the points of its hull.
///
/// Trees of surfaces know a line by where it meets the plane midway between the pair's two and by its slopes, each scaled to
/// the range of an intercept: a sheared view of the same four dimensions. A camera's rays differ much in place and little in
/// slope, so that they pass through a quarter of the cells that they need in intercepts of two planes, and the root holds
/// fewer lines that miss the cube.
#[derive(Clone, Debug)]
pub struct SurfaceLines<'a> {
    surface: &'a Surface,
    space: LineSpace,
    middle: DVec3,
    hull: Vec<DVec3>,
}

impl<'a> SurfaceLines<'a> {
    /// `None` if the surface has no extent.
    pub fn new(surface: &'a Surface) -> Option<Self> {
        let bounds = surface.bounds();
        // The cube of the longest side, with room for the rounding of depths, which are told in its unit: planes as near to
        // each other as a sheet is thick would tell directions no finer than 30° at the greatest depth.
        let half = DVec3::splat((0.5 + 1e-6) * bounds.size().max_element());
        let space = LineSpace::new(Bounds { min: bounds.centre() - half, max: bounds.centre() + half })?;
        let points = surface.hull_points();
        let hull = convex_hull(&points).map_or(points, |mesh| mesh.vertices);
        Some(Self { surface, space, middle: bounds.centre(), hull })
    }

    /// The surface.
    pub fn surface(&self) -> &'a Surface {
        self.surface
    }

    /// The line space of a cube around it.
    pub fn space(&self) -> &LineSpace {
        &self.space
    }

    /// The cube's side, in the scene's unit: what box units are of.
    pub fn side(&self) -> f64 {
        self.space.size().max_element()
    }

    /// A ray's line as its tree knows it.
    pub fn point<R: Real>(&self, ray: &Ray<R>) -> LinePoint {
        let pair = self.space.pair_of(ray.dir);
        let [k, i, j] = pair.axes();
        let side = R::of(1.0 / self.space.size()[k]);
        let over = R::of(1.0) / ray.dir.axis(k);
        let at = |axis: usize| (ray.origin.axis(axis) - R::of(self.middle[axis])) * side;
        let slope = [ray.dir.axis(i) * over, ray.dir.axis(j) * over];
        let depth = at(k);
        let off = [at(i) - depth * slope[0], at(j) - depth * slope[1]];
        let half = R::of(0.5);
        let stuv = [
            half + off[0] * R::of(OFFSET_SCALE),
            half + off[1] * R::of(OFFSET_SCALE),
            half + slope[0] * R::of(SLOPE_SCALE),
            half + slope[1] * R::of(SLOPE_SCALE),
        ];
        LinePoint { pair, stuv: stuv.map(R::get) }
    }

    /// A sample's line as a ray from its front plane, outside the object.
    pub fn ray<R: Real>(&self, line: LinePoint) -> Ray<R> {
        let [k, i, j] = line.pair.axes();
        let along = if line.pair.is_reversed() { -1.0 } else { 1.0 };
        let side = self.space.size()[k];
        let [x, y, p, q] = line.stuv.map(|c| R::of(c) - R::of(0.5));
        let (x, y) = (x * R::of(side / OFFSET_SCALE), y * R::of(side / OFFSET_SCALE));
        let (p, q) = (p * R::of(1.0 / SLOPE_SCALE), q * R::of(1.0 / SLOPE_SCALE));
        let back = R::of(-0.5 * along * side);
        let vector = |on_i: R, on_j: R, on_k: R| {
            let mut v = [on_k; 3];
            (v[i], v[j]) = (on_i, on_j);
            Vec3::new(v[0], v[1], v[2])
        };
        let origin = Vec3::of(self.middle) + vector(x + p * back, y + q * back, back);
        let dir = vector(p * R::of(along), q * R::of(along), R::of(along)).normalized();
        Ray { origin, dir }
    }

    /// How far along the dominant axis a place lies, box units.
    pub fn depth<R: Real>(&self, place: Vec3<R>, pair: PlanePair) -> R {
        let [k, ..] = pair.axes();
        (place.axis(k) - R::of(self.space.min()[k])) * R::of(1.0 / self.space.size()[k])
    }

    /// How far along a ray of the pair's direction that depth is reached.
    pub fn distance_to<R: Real>(&self, depth: R, ray: &Ray<R>, pair: PlanePair) -> R {
        let [k, ..] = pair.axes();
        (depth * R::of(self.space.size()[k]) + R::of(self.space.min()[k]) - ray.origin.axis(k))
            / ray.dir.axis(k)
    }

    /// The distance of two rays: that of their intercepts with the planes of the second one's pair (§2.3), box units.
    /// Infinite if the first runs along those planes or the other way.
    pub fn ray_distance<R: Real>(&self, a: &Ray<R>, b: &Ray<R>) -> f64 {
        let pair = self.space.pair_of(b.dir);
        let [k, ..] = pair.axes();
        if a.dir.axis(k).get() * b.dir.axis(k).get() <= 0.0 {
            return f64::INFINITY;
        }
        let (a, b) = (self.space.intercepts(a, pair), self.space.intercepts(b, pair));
        let squares = (0..4).map(|i| (a[i] - b[i]) * (a[i] - b[i]));
        squares.fold(R::of(0.0), |sum, x| sum + x).sqrt().get()
    }

    /// Whether no line of the cell meets the surface, proved: all of the hull lies on one side of what the lines reach,
    /// seen along one of eight directions across the axis.
    pub fn is_certainly_empty<R: Real>(&self, pair: PlanePair, cell: &Cell) -> bool {
        let [k, i, j] = pair.axes();
        let side = self.space.size()[k];
        let unit = |axis: usize, x: f64| (x - 0.5) / if axis < 2 { OFFSET_SCALE } else { SLOPE_SCALE };
        let low: [f64; 4] = std::array::from_fn(|a| unit(a, cell.low[a]));
        let high: [f64; 4] = std::array::from_fn(|a| unit(a, cell.high[a]));
        ACROSS.into_iter().any(|[a, b]| {
            let least = |w: f64, axis: usize| w * if w > 0.0 { low[axis] } else { high[axis] };
            let most = |w: f64, axis: usize| w * if w > 0.0 { high[axis] } else { low[axis] };
            let off = least(a, 0) + least(b, 1) - LEAST_SEPARATION;
            let (flattest, steepest) = (least(a, 2) + least(b, 3), most(a, 2) + most(b, 3));
            self.hull.iter().all(|&p| {
                let p = (Vec3::of(p) - Vec3::of(self.middle)) * R::of(1.0 / side);
                let across = R::of(a) * p.axis(i) + R::of(b) * p.axis(j);
                let depth = p.axis(k);
                // The least that a line has at that depth: by the least slope before the middle and the greatest behind.
                let slope = if depth.get() > 0.0 { flattest } else { steepest };
                across < R::of(off) + depth * R::of(slope)
            })
        })
    }
}

/// Lines through the cube meet the plane midway at most a side off its middle: that fills the range of intercepts.
const OFFSET_SCALE: f64 = 1.5;

/// Slopes are at most 1, and take half the range: what a camera's rays meet changes less with the slope than with the place.
const SLOPE_SCALE: f64 = 0.75;

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::surface::{Reach, Sphere};

    #[test]
    fn lines_come_back_from_their_points_and_cells_called_empty_hold_none_that_hits() {
        let surface = Surface::Sphere(Sphere::new(DVec3::new(30.0, -4.0, 7.0), 12.0).expect("a sphere"));
        let lines = SurfaceLines::new(&surface).expect("an extent");
        let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
        let (mut empty, mut hits) = (0, 0);
        for i in 0..3_000 {
            let pair = PlanePair::ALL[i % 6];
            let low: [f64; 4] = std::array::from_fn(|_| rng.random_range(-1.0..1.9));
            let cell = Cell { low, high: low.map(|x| x + rng.random_range(0.01..0.1)) };
            let is_empty = lines.is_certainly_empty::<f64>(pair, &cell);
            for _ in 0..20 {
                let stuv = std::array::from_fn(|a| rng.random_range(cell.low[a]..cell.high[a]));
                let ray = lines.ray::<f64>(LinePoint { pair, stuv });
                let is_hit = surface.hit(&ray, Reach::whole()).is_some();
                assert!(!(is_empty && is_hit), "{pair:?} {cell:?} {stuv:?}");
                hits += u32::from(is_hit);
                // Beyond slopes of 1 another pair's is the line.
                let back = lines.point(&ray);
                let is_same = (0..4).all(|a| (back.stuv[a] - stuv[a]).abs() < 1e-12);
                assert!(back.pair != pair || is_same, "{stuv:?} {back:?}");
            }
            empty += u32::from(is_empty);
        }
        assert!(empty > 500 && hits > 1_000, "{empty} {hits}");
    }
}
