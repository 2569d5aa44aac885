//! Line space: directed lines near a box as points (s, t, u, v) of four dimensions (Atalay & Mount, §2.1).
//!
//! ```text
//!      front plane           back plane        The box is mapped to the unit cube; the line's dominant direction
//!      ┌─────────┐           ┌─────────┐       (the longest component there, with its sign) names the plane pair.
//!   ───┼──●(s,t) │           │         │       Lines through a side face meet the planes outside the faces: with
//!      │    ╲────┼───────────┼─▶●(u,v) │       slopes of at most 1 between −1 and 2, which is what the root covers.
//!      └─────────┘           └─────────┘
//! ```

mod frame;
pub mod image;

use glam::DVec3;

use crate::geometry::{Bounds, Line, Ray, Real, UnitDir, Vec3};
pub use frame::{LineFrame, squared_span};

/// The least and greatest intercept of a line through the box.
pub const INTERCEPT_RANGE: (f64, f64) = (-1.0, 2.0);

/// How far beyond the range rounding may put a line's intercept, box units. An intercept errs by a few ε of the distance
/// between the line's origin and the box: less than this up to a million of the box's sides.
pub const INTERCEPT_MARGIN: f64 = 1e-9;

/// One of the six dominant directions: an axis and a sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PlanePair {
    axis: u8,
    reversed: bool,
}

impl PlanePair {
    /// +X, −X, +Y, −Y, +Z, −Z.
    pub const ALL: [Self; 6] = [
        Self { axis: 0, reversed: false },
        Self { axis: 0, reversed: true },
        Self { axis: 1, reversed: false },
        Self { axis: 1, reversed: true },
        Self { axis: 2, reversed: false },
        Self { axis: 2, reversed: true },
    ];

    /// Its place in [`ALL`](Self::ALL).
    pub fn index(self) -> usize {
        2 * usize::from(self.axis) + usize::from(self.reversed)
    }

    /// The dominant axis and the two across it, in cyclic order.
    pub fn axes(self) -> [usize; 3] {
        let k = usize::from(self.axis);
        [k, (k + 1) % 3, (k + 2) % 3]
    }

    /// The plane pair seen the other way.
    pub fn reverse(self) -> Self {
        Self { reversed: !self.reversed, ..self }
    }

    /// Whether lines run against the axis.
    pub fn is_reversed(self) -> bool {
        self.reversed
    }
}

/// A directed line as the intercepts `[s, t, u, v]` with the planes of one pair, box units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinePoint {
    /// The plane pair.
    pub pair: PlanePair,
    /// s and t on the front plane, u and v on the back plane.
    pub stuv: [f64; 4],
}

impl LinePoint {
    /// The same points walked the other way: front and back change places.
    pub fn reversed(self) -> Self {
        let [s, t, u, v] = self.stuv;
        Self { pair: self.pair.reverse(), stuv: [u, v, s, t] }
    }
}

/// The affine map between the world and the unit cube of one box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineSpace {
    min: DVec3,
    size: DVec3,
}

impl LineSpace {
    /// The line space of a box. `None` if the box is empty or flat.
    pub fn new(bounds: Bounds) -> Option<Self> {
        let size = bounds.size();
        (size.is_finite() && size.min_element() > 0.0).then_some(Self { min: bounds.min, size })
    }

    /// The box's least corner, mm.
    pub fn min(&self) -> DVec3 {
        self.min
    }

    /// The box's sides, mm.
    pub fn size(&self) -> DVec3 {
        self.size
    }

    /// The line as a point. Equal components go to the earlier axis, so the answer is the same every time.
    pub fn point_of(&self, line: &Line) -> LinePoint {
        let o = (line.origin() - self.min) / self.size;
        let d = line.dir() / self.size;
        let a = d.abs();
        let axis = if a.x >= a.y && a.x >= a.z { 0 } else { 1 + u8::from(a.z > a.y) };
        let pair = PlanePair { axis, reversed: d[usize::from(axis)] < 0.0 };
        let [k, i, j] = pair.axes();
        let (front, back) = if pair.reversed { (1.0, 0.0) } else { (0.0, 1.0) };
        let at = |plane: f64| {
            let lambda = (plane - o[k]) / d[k];
            [o[i] + lambda * d[i], o[j] + lambda * d[j]]
        };
        let ([s, t], [u, v]) = (at(front), at(back));
        LinePoint { pair, stuv: [s, t, u, v] }
    }

    /// The pair of a ray's dominant direction; as [`point_of`](Self::point_of) finds it.
    pub fn pair_of<R: Real>(&self, dir: Vec3<R>) -> PlanePair {
        let d = Vec3::new(dir.x / R::of(self.size.x), dir.y / R::of(self.size.y), dir.z / R::of(self.size.z));
        let a = [d.x.abs(), d.y.abs(), d.z.abs()];
        let axis = if a[0] >= a[1] && a[0] >= a[2] { 0 } else { 1 + u8::from(a[2] > a[1]) };
        PlanePair { axis, reversed: d.axis(usize::from(axis)).get() < 0.0 }
    }

    /// Where a ray's line meets the planes of a pair, whatever its own: s, t, u, v. Not finite if it runs along them.
    pub fn intercepts<R: Real>(&self, ray: &Ray<R>, pair: PlanePair) -> [R; 4] {
        let [k, i, j] = pair.axes();
        let along = |axis: usize| (ray.origin.axis(axis) - R::of(self.min[axis])) / R::of(self.size[axis]);
        let slope = |axis: usize| ray.dir.axis(axis) / R::of(self.size[axis]);
        let (o, d) = ([along(i), along(j)], [slope(i), slope(j)]);
        let (front, back) = if pair.reversed { (1.0, 0.0) } else { (0.0, 1.0) };
        let (height, over) = (along(k), R::of(1.0) / slope(k));
        let at = |plane: f64| (R::of(plane) - height) * over;
        let (first, second) = (at(front), at(back));
        [o[0] + first * d[0], o[1] + first * d[1], o[0] + second * d[0], o[1] + second * d[1]]
    }

    /// The line through the two intercepts, from the front plane on; its origin lies on the front plane.
    ///
    /// `None` only where a box is so small or so far off that the two planes round to one.
    pub fn line_of(&self, point: LinePoint) -> Option<Line> {
        let [k, i, j] = point.pair.axes();
        let (front, back) = if point.pair.reversed { (1.0, 0.0) } else { (0.0, 1.0) };
        let place = |plane: f64, across: [f64; 2]| {
            let mut p = DVec3::ZERO;
            p[k] = plane;
            p[i] = across[0];
            p[j] = across[1];
            p
        };
        let [s, t, u, v] = point.stuv;
        let (start, end) = (place(front, [s, t]), place(back, [u, v]));
        Line::new(self.min + self.size * start, UnitDir::new(self.size * (end - start))?)
    }
}

/// Whether the intercepts are those of a line that can pass through the box. Within
/// [`INTERCEPT_MARGIN`] of the range they are: a line through an edge of the box may be rounded there.
pub fn is_in_range(stuv: &[f64; 4]) -> bool {
    let (low, high) = INTERCEPT_RANGE;
    stuv.iter().all(|&x| low - INTERCEPT_MARGIN <= x && x <= high + INTERCEPT_MARGIN)
}

/// A box of line space: for each of s, t, u, v its least and greatest value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// The least s, t, u, v.
    pub low: [f64; 4],
    /// The greatest s, t, u, v.
    pub high: [f64; 4],
}

/// Directions across an axis in which a cell's lines are parted from a body: along the sides and the corners of what they fill.
pub(crate) const ACROSS: [[f64; 2]; 8] =
    [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];

impl Cell {
    /// All lines through the box.
    pub const ROOT: Self = Self { low: [INTERCEPT_RANGE.0; 4], high: [INTERCEPT_RANGE.1; 4] };

    /// The corner whose bit `a` says low (0) or high (1) on axis `a`.
    pub fn corner(&self, bits: usize) -> [f64; 4] {
        std::array::from_fn(|a| if bits >> a & 1 == 0 { self.low[a] } else { self.high[a] })
    }

    /// The middle.
    pub fn centre(&self) -> [f64; 4] {
        std::array::from_fn(|a| 0.5 * (self.low[a] + self.high[a]))
    }

    /// The point at fractions of each side, of which all 0 are the low corner and all ½ the middle.
    pub fn at(&self, fractions: [f64; 4]) -> [f64; 4] {
        let [low, high] = [self.low, self.high];
        std::array::from_fn(|a| (1.0 - fractions[a]) * low[a] + fractions[a] * high[a])
    }

    /// The longest side; the first of equal ones.
    pub fn longest_axis(&self) -> usize {
        let side = |a: usize| self.high[a] - self.low[a];
        (1..4).fold(0, |best, a| if side(a) > side(best) { a } else { best })
    }

    /// Planes to part the cell's lines from a body with. Between the planes of `pair`, the lines fill a shaft, the hull of
    /// the cell's two rectangles; eight planes touch it along its sides and its corners. Each is a normal n and a height h, box
    /// units, with n·x ≥ h at all points x of the shaft: where n·x < h at each point of a body, no line meets it.
    pub fn shaft_planes(&self, pair: PlanePair) -> impl Iterator<Item = (DVec3, f64)> {
        let ([k, i, j], cell) = (pair.axes(), *self);
        ACROSS.into_iter().map(move |[a, b]| {
            // The least value of a·x_i + b·x_j among the cell's lines: `front` on its plane, `back` on the other, linear in
            // between.
            let least = |w: f64, axis: usize| w * if w > 0.0 { cell.low[axis] } else { cell.high[axis] };
            let front = least(a, 0) + least(b, 1);
            let back = least(a, 2) + least(b, 3);
            let (at_0, at_1) = if pair.is_reversed() { (back, front) } else { (front, back) };
            let mut normal = DVec3::ZERO;
            (normal[i], normal[j], normal[k]) = (a, b, at_0 - at_1);
            (normal, at_0)
        })
    }

    /// The two halves across `axis`.
    pub fn halves(&self, axis: usize) -> [Self; 2] {
        let middle = 0.5 * (self.low[axis] + self.high[axis]);
        let (mut lower, mut upper) = (*self, *self);
        lower.high[axis] = middle;
        upper.low[axis] = middle;
        [lower, upper]
    }

    /// Where the point lies between low (0) and high (1) on each axis.
    pub fn fractions<R: Real>(&self, stuv: &[R; 4]) -> [R; 4] {
        std::array::from_fn(|a| (stuv[a] - R::of(self.low[a])) / (R::of(self.high[a]) - R::of(self.low[a])))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn space() -> LineSpace {
        let bounds = Bounds { min: DVec3::new(-10.0, 5.0, 100.0), max: DVec3::new(30.0, 15.0, 400.0) };
        LineSpace::new(bounds).expect("a box")
    }

    fn line(from: DVec3, towards: DVec3) -> Line {
        Line::new(from, UnitDir::new(towards).expect("a direction")).expect("finite")
    }

    #[test]
    fn the_dominant_direction_is_that_of_the_unit_cube() {
        // 3 mm of the 10 mm side outweigh 9 mm of the 40 mm side.
        let point = space().point_of(&line(DVec3::new(0.0, 0.0, 200.0), DVec3::new(9.0, 3.0, 0.0)));
        assert_eq!(point.pair, PlanePair::ALL[2]);
        let back = space().point_of(&line(DVec3::new(0.0, 0.0, 200.0), DVec3::new(0.0, 0.0, -1.0)));
        assert_eq!(back.pair, PlanePair::ALL[5]);
    }

    #[test]
    fn ties_go_to_the_earlier_axis() {
        let cube = LineSpace::new(Bounds { min: DVec3::ZERO, max: DVec3::ONE }).expect("a box");
        let pair = |d| cube.point_of(&line(DVec3::splat(0.5), d)).pair.index();
        assert_eq!(pair(DVec3::new(1.0, 1.0, 1.0)), 0);
        assert_eq!(pair(DVec3::new(-1.0, 1.0, -1.0)), 1);
        assert_eq!(pair(DVec3::new(0.5, -1.0, 1.0)), 3);
    }

    proptest! {
        #[test]
        fn a_line_through_the_box_is_in_range_and_comes_back(
            p in prop::array::uniform3(0.0f64..1.0),
            q in prop::array::uniform3(-1.0f64..1.0),
        ) {
            let space = space();
            let Some(dir) = UnitDir::new(space.size() * DVec3::from(q)) else { return Ok(()) };
            let through = space.min() + space.size() * DVec3::from(p);
            let line = Line::new(through - 700.0 * dir.get(), dir).expect("finite");
            let point = space.point_of(&line);
            prop_assert!(is_in_range(&point.stuv), "{:?}", point);
            let back = space.line_of(point).expect("a line");
            prop_assert!(back.dir().dot(line.dir()) > 1.0 - 1e-12);
            prop_assert!((through - back.origin()).cross(back.dir()).length() < 1e-9);
            let reversed = space.point_of(&line.reversed());
            prop_assert_eq!(reversed.pair, point.reversed().pair);
        }
    }

    #[test]
    fn a_line_through_an_edge_of_the_box_is_in_range_however_it_is_rounded() {
        // At slope 1 through the edge at the box's far end: s is −1 or 2, but for rounding.
        let (space, mut outside) = (space(), 0);
        for i in 0..2_000_u32 {
            let (y, dy) = if i % 2 == 0 { (0.0, 1.0) } else { (1.0, -1.0) };
            let dir =
                UnitDir::new(space.size() * DVec3::new(1.0, dy, f64::from(i) / 2e3)).expect("a direction");
            let at_edge = space.min() + space.size() * DVec3::new(1.0, y, 0.01);
            let point = space.point_of(&Line::new(at_edge - 700.0 * dir.get(), dir).expect("finite"));
            outside += u32::from(point.stuv.iter().any(|x| !(-1.0..=2.0).contains(x)));
            assert!(is_in_range(&point.stuv), "{point:?}");
        }
        assert!(outside > 0, "no line was rounded out of range");
    }

    #[test]
    fn halves_tile_the_cell_and_split_each_axis_in_turn() {
        let mut cell = Cell::ROOT;
        for depth in 0..12 {
            let axis = cell.longest_axis();
            assert_eq!(axis, depth % 4);
            let [lower, upper] = cell.halves(axis);
            assert_eq!((lower.high[axis], upper.high), (upper.low[axis], cell.high));
            cell = if depth % 3 == 0 { upper } else { lower };
        }
    }
}
