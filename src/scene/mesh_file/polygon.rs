//! Polygons become triangles.
//!
//! ```text
//! d ── c      a fan from a: abc, acd           d ── c     no fan from a (the notch folds it):
//! │  ╱ │      (wherever it does not fold)       ╲ e │     ears are cut off one by one
//! a ── b                                        a ── b
//! ```

use glam::DVec3;

/// A triangle whose area, along the polygon's normal, is below this share of the polygon's counts as flat;
/// coordinates rounded to nine digits stay below it. Only the choice between ways to split depends on it.
const FLAT_SHARE: f64 = 1e-9;

/// Corners up to which ears are looked for: the search takes up to the third power of their number.
const MOST_CORNERS_CUT: usize = 64;

/// A polygon as triangles.
pub(super) struct Split {
    /// Corners of the triangles, as positions in the polygon.
    pub triangles: Vec<[usize; 3]>,
    /// Whether triangles overlap, because the polygon crosses itself or is too large to look for a better split.
    pub overlaps: bool,
}

/// Splits a polygon, given by its corners in order, into `n − 2` triangles with the same edges around.
///
/// Polygons that are convex, or nearly, become the fan from their first corner. Others are cut ear by ear
/// (Meisters 1975), seen along their normal; a hole that a bridge joins to the outline is kept open. If
/// that is not possible, the triangles are the fan, and overlap.
pub(super) fn split(points: &[DVec3]) -> Split {
    let outline = Outline::new(points);
    if outline.fan_stands() {
        return Split { triangles: fan(points.len()), overlaps: false };
    }
    let ears = (points.len() <= MOST_CORNERS_CUT).then(|| outline.cut_ears()).flatten();
    Split { overlaps: ears.is_none(), triangles: ears.unwrap_or_else(|| fan(points.len())) }
}

fn fan(corners: usize) -> Vec<[usize; 3]> {
    (1..corners - 1).map(|i| [0, i, i + 1]).collect()
}

struct Outline<'a> {
    points: &'a [DVec3],
    /// The sum of the fan's cross products: twice the area, along the normal (Newell).
    area: DVec3,
}

impl<'a> Outline<'a> {
    fn new(points: &'a [DVec3]) -> Self {
        // Corners are taken from the first, so that a polygon far from the origin loses no digits.
        let area = fan(points.len())
            .into_iter()
            .map(|[a, b, c]| (points[b] - points[a]).cross(points[c] - points[a]))
            .sum();
        Self { points, area }
    }

    /// The area of a triangle along the polygon's normal, as a share of the polygon's; negative if it is turned
    /// over, NaN if the polygon has no area.
    fn share(&self, [a, b, c]: [usize; 3]) -> f64 {
        let [a, b, c] = [a, b, c].map(|i| self.points[i]);
        (b - a).cross(c - a).dot(self.area) / self.area.length_squared()
    }

    fn fan_stands(&self) -> bool {
        self.points.len() == 3 || fan(self.points.len()).into_iter().all(|t| self.share(t) > FLAT_SHARE)
    }

    /// The ears in the order of their cutting. `None` if no ear is left before the polygon is used up.
    fn cut_ears(&self) -> Option<Vec<[usize; 3]>> {
        let mut left: Vec<usize> = (0..self.points.len()).collect();
        let mut ears = Vec::with_capacity(left.len() - 2);
        while left.len() > 3 {
            let n = left.len();
            let ear_at = |i: usize| [left[(i + n - 1) % n], left[i], left[(i + 1) % n]];
            let tip = (0..n)
                .filter(|&i| self.is_ear(ear_at(i), &left))
                .max_by(|&i, &j| self.roundness(ear_at(i)).total_cmp(&self.roundness(ear_at(j))))?;
            ears.push(ear_at(tip));
            left.remove(tip);
        }
        let last = [left[0], left[1], left[2]];
        ears.push(last);
        (self.share(last) > -FLAT_SHARE).then_some(ears)
    }

    /// Whether a corner with its neighbours can be cut off: not turned over, and no other corner in it. A
    /// corner at the same place as one of the three does not count: a bridge to a hole repeats its ends.
    fn is_ear(&self, ear: [usize; 3], left: &[usize]) -> bool {
        let [a, b, c] = ear;
        let is_inside = |p: usize| {
            let apart = ear.iter().all(|&corner| self.points[corner] != self.points[p]);
            apart && [[a, b, p], [b, c, p], [c, a, p]].iter().all(|&t| self.share(t) >= -FLAT_SHARE)
        };
        self.share(ear) > FLAT_SHARE && !left.iter().any(|&p| is_inside(p))
    }

    /// Area over the square of the perimeter: cutting round ears first leaves no slivers for the end.
    fn roundness(&self, ear: [usize; 3]) -> f64 {
        let [a, b, c] = ear.map(|i| self.points[i]);
        let perimeter = a.distance(b) + b.distance(c) + c.distance(a);
        self.share(ear) / (perimeter * perimeter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Corners on a slanted plane far from the origin, from coordinates in that plane.
    fn slanted(corners: &[[f64; 2]]) -> Vec<DVec3> {
        let (along, across) = (DVec3::new(2.0, 3.0, 6.0) / 7.0, DVec3::new(6.0, 2.0, -3.0) / 7.0);
        corners.iter().map(|[x, y]| 1000.0 * DVec3::ONE + *x * along + *y * across).collect()
    }

    /// The sum of the triangles' areas: more than the polygon's if any overlap or leave it.
    fn summed_area(points: &[DVec3], split: &Split) -> f64 {
        let area = |t: &[usize; 3]| {
            let [a, b, c] = t.map(|i| points[i]);
            0.5 * (b - a).cross(c - a).length()
        };
        split.triangles.iter().map(area).sum()
    }

    /// Each outline edge is once an edge of a triangle, each other edge twice, in opposite directions.
    fn assert_edges_match(corners: usize, split: &Split) {
        let mut edges = std::collections::HashMap::new();
        for [a, b, c] in &split.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *edges.entry((*from, *to)).or_insert(0) += 1;
            }
        }
        for (&(from, to), &count) in &edges {
            let is_outline = to == (from + 1) % corners;
            assert_eq!((count, edges.contains_key(&(to, from))), (1, !is_outline), "{from}–{to}");
        }
        assert_eq!(edges.len(), 3 * (corners - 2));
    }

    fn check(corners: &[[f64; 2]], area: f64) {
        let points = slanted(corners);
        let split = split(&points);
        assert!(!split.overlaps);
        assert_edges_match(points.len(), &split);
        let summed = summed_area(&points, &split);
        assert!((summed - area).abs() < 1e-9, "{summed} instead of {area}");
    }

    #[test]
    fn convex_and_notched_polygons_keep_their_area_and_edges() {
        check(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], 1.0);
        let l = [[2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0], [0.0, 0.0]];
        check(&l, 3.0);
        let u =
            [[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [2.0, 2.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        check(&u, 5.0);
    }

    #[test]
    fn corners_on_a_straight_side_make_no_flat_triangles() {
        let side = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [3.0, 1.0], [0.0, 1.0]];
        check(&side, 3.0);
        let points = slanted(&side);
        for triangle in split(&points).triangles {
            let [a, b, c] = triangle.map(|i| points[i]);
            assert!((b - a).cross(c - a).length() > 0.1, "{triangle:?}");
        }
    }

    #[test]
    fn a_hole_joined_by_a_bridge_stays_open() {
        let ring = [
            [0.0, 0.0],
            [3.0, 0.0],
            [3.0, 3.0],
            [0.0, 3.0],
            [0.0, 0.0],
            [1.0, 1.0],
            [1.0, 2.0],
            [2.0, 2.0],
            [2.0, 1.0],
            [1.0, 1.0],
        ];
        check(&ring, 8.0);
    }

    #[test]
    fn a_polygon_that_crosses_itself_says_so() {
        let bow = slanted(&[[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 3.0]]);
        let split = split(&bow);
        assert_eq!((split.overlaps, split.triangles.len()), (true, 2));
        let flat = slanted(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]);
        assert!(super::split(&flat).overlaps);
    }
}
