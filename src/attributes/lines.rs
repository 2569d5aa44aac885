//! What attributes of surfaces share: lines of one object's box, and the distance of two output rays.

use glam::{DVec2, DVec3};

use super::chord::LEAST_SEPARATION;
use super::surface::{Seen, vector};
use crate::geometry::{Bounds, Ray, Real, Vec3, convex_hull};
use crate::linespace::{ACROSS, Cell, LinePoint, LineSpace, PlanePair};
use crate::ritree::{Sampling, Scheme};
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
    is_convex: bool,
    space: LineSpace,
    middle: DVec3,
    /// For lines along each axis, what slopes are scaled by, see [`SLOPE_SCALE`].
    slope_scales: [f64; 3],
    /// The rims of the hull for lines along each axis, seen along each of [`ACROSS`].
    rims: [[Rim; 8]; 3],
}

/// How much of what is known of a line changes with its direction, where it meets the same place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ByDirection {
    /// Little: normals are those of places.
    Little,
    /// Much: rays that are refracted leave by it.
    Much,
}

/// What of a hull is farthest across, at any depth: (depth, across) from the middle, box units. Lines that run beyond all of
/// these run beyond the hull.
type Rim = Vec<DVec2>;

impl<'a> SurfaceLines<'a> {
    /// For outputs that change with the place that a line meets, and with its direction as `by_direction` says. Convex surfaces
    /// have no part that hides another. `None` if the surface has no extent.
    pub fn new(surface: &'a Surface, is_convex: bool, by_direction: ByDirection) -> Option<Self> {
        let bounds = surface.bounds();
        // The cube of the longest side, with room for the rounding of depths, which are told in its unit: planes as near to
        // each other as a sheet is thick would tell directions no finer than 30° at the greatest depth.
        let half = DVec3::splat((0.5 + 1e-6) * bounds.size().max_element());
        let space = LineSpace::new(Bounds { min: bounds.centre() - half, max: bounds.centre() + half })?;
        let middle = bounds.centre();
        let points = surface.hull_points();
        let hull = convex_hull(&points).map_or(points, |mesh| mesh.vertices);
        let side = bounds.size().max_element();
        let slope_scales = match by_direction {
            ByDirection::Little => (bounds.size() / side).max(DVec3::splat(LEAST_FLATNESS)) * SLOPE_SCALE,
            ByDirection::Much => DVec3::splat(2.0 * SLOPE_SCALE),
        };
        let rims = [0, 1, 2].map(|k| {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let of = |p: &DVec3| (*p - middle) / space.size()[k];
            ACROSS.map(|[a, b]| {
                rim(hull.iter().map(of).map(|p| DVec2::new(p[k], a * p[i] + b * p[j])).collect())
            })
        });
        Some(Self { surface, is_convex, space, middle, slope_scales: slope_scales.to_array(), rims })
    }

    /// The surface.
    pub fn surface(&self) -> &'a Surface {
        self.surface
    }

    /// How cells of its lines are sampled.
    pub(super) fn sampling(&self) -> Sampling {
        Sampling {
            levels_per_look: 4,
            levels_spared: 0,
            remembers: true,
            scheme: Scheme::Simplicial,
            // Beside a fold, lines between five that hit may pass the surface by.
            parts: self.is_convex,
            tells_joined: self.tells_joined(),
        }
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
        self.point_from(self.off(ray.origin), ray.dir)
    }

    /// A place from the cube's middle, box units.
    pub fn off<R: Real>(&self, place: Vec3<R>) -> Vec3<R> {
        (place - Vec3::of(self.middle)) * R::of(1.0 / self.side())
    }

    /// The line through a place that lies [`off`](Self::off) the middle.
    pub fn point_from<R: Real>(&self, off: Vec3<R>, dir: Vec3<R>) -> LinePoint {
        let pair = self.space.pair_of(dir);
        let [k, i, j] = pair.axes();
        let over = R::of(1.0) / dir.axis(k);
        let slope = [dir.axis(i) * over, dir.axis(j) * over];
        let depth = off.axis(k);
        let off = [off.axis(i) - depth * slope[0], off.axis(j) - depth * slope[1]];
        let half = R::of(0.5);
        let stuv = [
            half + off[0] * R::of(OFFSET_SCALE),
            half + off[1] * R::of(OFFSET_SCALE),
            half + slope[0] * R::of(self.slope_scales[k]),
            half + slope[1] * R::of(self.slope_scales[k]),
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
        let over = R::of(1.0 / self.slope_scales[k]);
        let (p, q) = (p * over, q * over);
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

    /// Whether the places where two lines of one pair hit, told by their depths and unit normals, lie side by side on the
    /// surface and not on two parts of it, one behind the other: the way between them runs across the normals' mean. Of places on a
    /// sphere it does exactly. The normals of meshes are not those of their faces, and say nothing of it.
    pub(super) fn are_joined<R: Real>(&self, lines: [LinePoint; 2], seen: [&Seen; 2]) -> bool {
        if self.is_convex || !self.tells_joined() {
            return true;
        }
        let [a, b] = [0, 1].map(|i| self.place_of::<R>(&lines[i], seen[i].depth));
        let [k, i, j] = lines[0].pair.axes();
        let [m, n] = seen.map(|seen| vector::<R>(seen.normal));
        let mean = m + n;
        let mean = Vec3::new(mean.axis(i), mean.axis(j), mean.axis(k));
        let way = b - a;
        let along = way.dot(mean);
        let room = R::of(JOINED_SINE * JOINED_SINE) * way.dot(way) + R::of(DEPTH_NOISE * DEPTH_NOISE);
        along * along <= room * mean.dot(mean)
    }

    fn tells_joined(&self) -> bool {
        self.is_convex || !matches!(self.surface, Surface::Mesh(_))
    }

    /// Where a line is at a depth, from the middle: across the axis and along it, box units.
    fn place_of<R: Real>(&self, line: &LinePoint, depth: f32) -> Vec3<R> {
        let [k, ..] = line.pair.axes();
        let [x, y, p, q] = line.stuv.map(|c| R::of(c - 0.5));
        let depth = R::of(f64::from(depth) - 0.5);
        let (in_box, over) = (R::of(1.0 / OFFSET_SCALE), depth * R::of(1.0 / self.slope_scales[k]));
        Vec3::new(x * in_box + p * over, y * in_box + q * over, depth)
    }

    /// Whether no line of the cell meets the surface, proved: all of the hull lies on one side of what the lines reach,
    /// seen along one of eight directions across the axis.
    pub fn is_certainly_empty<R: Real>(&self, pair: PlanePair, cell: &Cell) -> bool {
        let [k, ..] = pair.axes();
        let unit =
            |axis: usize, x: f64| (x - 0.5) / if axis < 2 { OFFSET_SCALE } else { self.slope_scales[k] };
        let low: [f64; 4] = std::array::from_fn(|a| unit(a, cell.low[a]));
        let high: [f64; 4] = std::array::from_fn(|a| unit(a, cell.high[a]));
        ACROSS.into_iter().zip(&self.rims[k]).any(|([a, b], rim)| {
            let least = |w: f64, axis: usize| w * if w > 0.0 { low[axis] } else { high[axis] };
            let most = |w: f64, axis: usize| w * if w > 0.0 { high[axis] } else { low[axis] };
            let off = least(a, 0) + least(b, 1) - LEAST_SEPARATION;
            let (flattest, steepest) = (least(a, 2) + least(b, 3), most(a, 2) + most(b, 3));
            rim.iter().all(|p| {
                // The least that a line has at that depth: by the least slope before the middle and the greatest behind.
                let slope = if p.x > 0.0 { flattest } else { steepest };
                R::of(p.y) < R::of(off) + R::of(p.x) * R::of(slope)
            })
        })
    }
}

/// Lines through the cube meet the plane midway at most a side off its middle: that fills the range of intercepts.
const OFFSET_SCALE: f64 = 1.5;

/// Slopes are at most 1, and take half the range: what a camera's rays meet changes less with the slope than with the place.
/// Of a body that is flat along the lines' axis they take as much less as it is thin: it is met near the middle, where lines of
/// any slope are in their places. Where outputs change much with the direction they take all of it.
const SLOPE_SCALE: f64 = 0.75;

/// Places of one class are [side by side](SurfaceLines::are_joined) if the way between them is no steeper on the mean of the surface
/// than by this sine.
const JOINED_SINE: f64 = 0.05;

/// What the way may be off the surface by all the same, box units: samples know depths as f32.
const DEPTH_NOISE: f64 = 4.0 * f32::EPSILON as f64;

/// No body counts as thinner than this share of its longest side: normals and exit rays may depend on the slope alone.
const LEAST_FLATNESS: f64 = 1.0 / 4.0;

/// The upper hull of (depth, across): the bound that lines are held against is the lesser of two linear ones, so that what
/// holds at the hull's corners holds below it. Monotone chain, Andrew 1979, doi:10.1016/0020-0190(79)90072-3.
fn rim(mut points: Vec<DVec2>) -> Rim {
    points.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let mut rim: Rim = Vec::new();
    for point in points {
        // What lies below the line by rounding alone is kept: a point too many does no harm.
        let is_below = |rim: &Rim| {
            let &[.., a, b] = &rim[..] else { return false };
            (b - a).perp_dot(point - a) > RIM_ROUNDING
        };
        while is_below(&rim) {
            rim.pop();
        }
        rim.push(point);
    }
    rim
}

/// Areas of triangles in box units that are certainly not rounding.
const RIM_ROUNDING: f64 = 1e-12;

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::surface::{BezierPatch, Reach, Shell, Sphere};

    #[test]
    fn places_on_one_part_are_joined_and_those_on_two_are_not() {
        let flat = |x: [f64; 2], z: f64| {
            let row = |x| vec![DVec3::new(x, -10.0, z), DVec3::new(x, 10.0, z)];
            (BezierPatch::elevated(&[row(x[0]), row(x[1])]).expect("a net"), 1)
        };
        let steps = Shell::new(vec![flat([-10.0, 0.0], 0.0), flat([0.0, 10.0], 2.0)]).expect("patches");
        let ball = Sphere::new(DVec3::new(30.0, -4.0, 7.0), 12.0).expect("a sphere");
        let mut rng = rand_pcg::Pcg64::seed_from_u64(6);
        for surface in [Surface::Shell(steps), Surface::Sphere(ball)] {
            let lines = SurfaceLines::new(&surface, false, ByDirection::Little).expect("an extent");
            let (mut same, mut apart) = (0, 0);
            for i in 0..4_000 {
                let pair = PlanePair::ALL[i % 6];
                let near = |x: f64, by: f64, rng: &mut rand_pcg::Pcg64| x + rng.random_range(-by..by);
                let one: [f64; 4] = std::array::from_fn(|_| near(0.5, 0.7, &mut rng));
                let other = one.map(|x| near(x, 0.1, &mut rng));
                let seen = [one, other].map(|stuv| {
                    let line = LinePoint { pair, stuv };
                    let (seen, hit) = Seen::along::<f64>(&lines, line);
                    (line, seen, hit.map(|hit| hit.place(&lines.ray(line))))
                });
                let [(a, of_a, Some(at_a)), (b, of_b, Some(at_b))] = seen else { continue };
                if of_a.class == of_b.class {
                    let is_one_part = (at_a.z - at_b.z).abs() < 1e-9 || matches!(surface, Surface::Sphere(_));
                    let are_joined = lines.are_joined::<f64>([a, b], [&of_a, &of_b]);
                    assert_eq!(are_joined, is_one_part, "{at_a:?} {at_b:?}");
                    *(if is_one_part { &mut same } else { &mut apart }) += 1;
                }
            }
            assert!(same > 300 && (apart > 20 || matches!(surface, Surface::Sphere(_))), "{same} {apart}");
        }
    }

    #[test]
    fn lines_come_back_from_their_points_and_cells_called_empty_hold_none_that_hits() {
        let surface = Surface::Sphere(Sphere::new(DVec3::new(30.0, -4.0, 7.0), 12.0).expect("a sphere"));
        let lines = SurfaceLines::new(&surface, true, ByDirection::Little).expect("an extent");
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
