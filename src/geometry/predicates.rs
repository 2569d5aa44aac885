//! Exact signs (Shewchuk 1997, doi:10.1007/PL00009321) and what follows from them.

use std::cmp::Ordering;

use glam::DVec3;
use robust::{Coord, Coord3D};

/// On which side of the plane through `a`, `b`, `c` the point `p` lies: `Greater` on the side its counter-clockwise
/// normal points to, `Equal` exactly in the plane. Exact, not rounded.
pub fn side_of_plane([a, b, c]: [DVec3; 3], p: DVec3) -> Ordering {
    let coord = |v: DVec3| Coord3D { x: v.x, y: v.y, z: v.z };
    // Shewchuk's sign is positive below the plane. It is exact as long as products of three coordinate differences
    // neither overflow nor underflow: for anything between 1e-80 and 1e+80 mm.
    let below = robust::orient3d(coord(a), coord(b), coord(c), coord(p));
    0.0.partial_cmp(&below).unwrap_or(Ordering::Equal)
}

/// On which side of the directed line from `u` to `v` the plane point `p`, moved by an infinitesimal (ε, ε²), lies: +1 to
/// the left, −1 to the right, 0 only if `u` and `v` are one point. Exact, and the negative of the side of `v` to `u`.
///
/// The infinitesimal move (simulation of simplicity, Edelsbrunner & Mücke 1990, doi:10.1145/77635.77639) decides ties alike
/// for all who ask.
pub fn side_of_edge(u: [f64; 2], v: [f64; 2], p: [f64; 2]) -> i32 {
    let coord = |q: [f64; 2]| Coord { x: q[0], y: q[1] };
    let area = robust::orient2d(coord(u), coord(v), coord(p));
    if area != 0.0 {
        return if area > 0.0 { 1 } else { -1 };
    }
    side_of_edge_on_tie(&u, &v)
}

/// As [`side_of_edge`], of a point that lies on the line: the infinitesimal move decides. In any exact arithmetic.
pub(crate) fn side_of_edge_on_tie<T: PartialOrd>(u: &[T; 2], v: &[T; 2]) -> i32 {
    // d/dε of the area under p + (ε, ε²): first −(v.y − u.y), then v.x − u.x.
    match (u[1].partial_cmp(&v[1]), v[0].partial_cmp(&u[0])) {
        (Some(Ordering::Greater), _) => 1,
        (Some(Ordering::Less), _) => -1,
        (_, Some(Ordering::Greater)) => 1,
        (_, Some(Ordering::Less)) => -1,
        _ => 0,
    }
}

/// Whether the plane point `p`, moved as in [`side_of_edge`], lies in the triangle, and if so how it is wound: +1
/// counter-clockwise, −1 clockwise, 0 outside (or the triangle has no area).
///
/// So every point belongs to exactly one of the triangles that share an edge or a vertex: nothing is counted twice or
/// lost.
pub fn cover([a, b, c]: [[f64; 2]; 3], p: [f64; 2]) -> i32 {
    let (first, second, third) = (side_of_edge(a, b, p), side_of_edge(b, c, p), side_of_edge(c, a, p));
    if first == second && second == third { first } else { 0 }
}

/// How two triangles meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Meeting {
    /// They share no point, or share one only where an exact sign is zero and no interiors can meet.
    Apart,
    /// Some sign was exactly zero: they may touch, be coplanar or share corners. Their insides do not cross.
    Degenerate,
    /// Their insides cross: an edge of one passes through the other, or through its outline.
    Cross {
        /// Whether the edge is the first triangle's.
        edge_of_first: bool,
        /// Which edge: from this corner to the next.
        edge: usize,
        /// About where, in f64: a place to show, not to compute with.
        place: DVec3,
    },
}

/// How the triangles `s` and `t` meet, by exact signs.
pub fn meeting(s: [DVec3; 3], t: [DVec3; 3]) -> Meeting {
    use Ordering::{Equal, Greater, Less};
    let s_sides = s.map(|p| side_of_plane(t, p));
    let t_sides = t.map(|p| side_of_plane(s, p));
    let all = |sides: [Ordering; 3], side| sides.iter().all(|&x| x == side);
    if [s_sides, t_sides].iter().any(|&sides| all(sides, Greater) || all(sides, Less)) {
        return Meeting::Apart;
    }
    let mut degenerate = s_sides.contains(&Equal) || t_sides.contains(&Equal);
    let mut on_outline = None;
    for (edge_of_first, edges, sides, face) in [(true, s, s_sides, t), (false, t, t_sides, s)] {
        for i in 0..3 {
            let j = (i + 1) % 3;
            if sides[i] == sides[j] || sides[i] == Equal || sides[j] == Equal {
                continue;
            }
            let around = [0, 1, 2].map(|k| side_of_plane([edges[i], edges[j], face[k]], face[(k + 1) % 3]));
            if around.contains(&Equal) {
                degenerate = true;
                on_outline = on_outline.or(Some((edge_of_first, i)));
            } else if all(around, around[0]) {
                let place = crossing_place(edges[i], edges[j], face);
                return Meeting::Cross { edge_of_first, edge: i, place };
            }
        }
    }
    match on_outline {
        Some((edge_of_first, i)) if insides_cross((s, s_sides), (t, t_sides)) => {
            let (edges, face) = if edge_of_first { (s, t) } else { (t, s) };
            let place = crossing_place(edges[i], edges[(i + 1) % 3], face);
            Meeting::Cross { edge_of_first, edge: i, place }
        }
        _ if degenerate => Meeting::Degenerate,
        _ => Meeting::Apart,
    }
}

/// Whether the planes of two triangles cut each other's inside in segments that overlap, be it from outline to outline. Each
/// triangle comes with its corners' sides of the other's plane.
///
/// The segments lie in one line; their ends are compared by exact signs (Guigue & Devillers 2003,
/// doi:10.1080/10867651.2003.10487580), strictly: what shares an end alone does not cross.
fn insides_cross(
    (s, s_sides): ([DVec3; 3], [Ordering; 3]),
    (t, t_sides): ([DVec3; 3], [Ordering; 3]),
) -> bool {
    let (Some(first), Some(second)) = (apex(s_sides), apex(t_sides)) else { return false };
    let [p1, mut q1, mut r1] = [0, 1, 2].map(|i| s[(first + i) % 3]);
    let [p2, mut q2, mut r2] = [0, 1, 2].map(|i| t[(second + i) % 3]);
    // Each apex on the side that the other's normal points to.
    if s_sides[first] == Ordering::Less {
        (q2, r2) = (r2, q2);
    }
    if t_sides[second] == Ordering::Less {
        (q1, r1) = (r1, q1);
    }
    side_of_plane([q1, p2, p1], q2) == Ordering::Less && side_of_plane([p1, p2, r1], r2) == Ordering::Less
}

/// The corner alone on its side of a plane that passes through the triangle's inside. `None` if it does not.
fn apex(sides: [Ordering; 3]) -> Option<usize> {
    use Ordering::{Greater, Less};
    let passes = sides.contains(&Greater) && sides.contains(&Less);
    (0..3).find(|&i| {
        passes && sides[i].is_ne() && sides[(i + 1) % 3] != sides[i] && sides[(i + 2) % 3] != sides[i]
    })
}

fn crossing_place(p: DVec3, q: DVec3, [a, b, c]: [DVec3; 3]) -> DVec3 {
    let n = (b - a).cross(c - a);
    let (dp, dq) = (n.dot(p - a), n.dot(q - a));
    if dp == dq { p.midpoint(q) } else { p.lerp(q, (dp / (dp - dq)).clamp(0.0, 1.0)) }
}

/// The squared distance from `p` to the triangle, mm², in f64 (Ericson, *Real-Time Collision Detection*, §5.1.5).
pub fn squared_distance(p: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let n = ab.cross(ac);
    let nn = n.length_squared();
    if nn > 0.0 {
        let v = ap.cross(ac).dot(n) / nn;
        let w = ab.cross(ap).dot(n) / nn;
        if v >= 0.0 && w >= 0.0 && v + w <= 1.0 {
            return ap.dot(n).powi(2) / nn;
        }
    }
    let to_edge = |u: DVec3, v: DVec3| {
        let d = v - u;
        let length = d.length_squared();
        let t = if length > 0.0 { ((p - u).dot(d) / length).clamp(0.0, 1.0) } else { 0.0 };
        (u + t * d - p).length_squared()
    };
    to_edge(a, b).min(to_edge(b, c)).min(to_edge(c, a))
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLOOR: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y];

    #[test]
    fn the_normal_points_to_the_greater_side() {
        assert_eq!(side_of_plane(FLOOR, DVec3::Z), Ordering::Greater);
        assert_eq!(side_of_plane(FLOOR, -DVec3::Z * 1e-60), Ordering::Less);
        assert_eq!(side_of_plane(FLOOR, DVec3::new(7.0, -3.0, 0.0)), Ordering::Equal);
    }

    #[test]
    fn a_shared_edge_and_a_shared_vertex_are_covered_once() {
        // A square in four triangles around its centre.
        let (o, corners) = ([0.0, 0.0], [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]]);
        let count =
            |p: [f64; 2]| (0..4).map(|i| cover([o, corners[i], corners[(i + 1) % 4]], p)).sum::<i32>();
        for p in [o, [0.5, 0.5], [-0.5, 0.5], [0.25, -0.25], [-0.5, -0.5]] {
            assert_eq!(count(p), 1, "{p:?}");
        }
        // On the outline, half of the edges belong to the square.
        assert_eq!(count([-1.0, 0.0]) + count([1.0, 0.0]), 1);
        assert_eq!(count([2.0, 0.0]), 0);
    }

    #[test]
    fn triangles_cross_touch_or_stay_apart() {
        let wall =
            |x: f64, z: f64| [DVec3::new(x, 0.2, z), DVec3::new(x, 0.3, z), DVec3::new(x, 0.2, z + 1.0)];
        assert!(matches!(meeting(FLOOR, wall(0.3, -0.5)), Meeting::Cross { .. }));
        assert_eq!(meeting(FLOOR, wall(0.3, 0.5)), Meeting::Apart);
        assert_eq!(meeting(FLOOR, wall(0.3, 0.0)), Meeting::Degenerate);
        assert_eq!(meeting(FLOOR, wall(2.0, -0.5)), Meeting::Apart);
    }

    #[test]
    fn triangles_whose_insides_cross_from_outline_to_outline_do_cross() {
        // In a plane of its own through the floor's middle line x = y: all that is between is how far it reaches.
        let across = |from: f64, to: f64| {
            let at = |t: f64, z: f64| DVec3::new(t, t, z);
            [at(from, 0.0), at(to, 1.0), at(to, -1.0)]
        };
        let crosses = |t: [DVec3; 3]| {
            let turn = |[a, b, c]: [DVec3; 3]| [[a, b, c], [b, c, a], [c, a, b], [a, c, b]];
            let all = turn(FLOOR).into_iter().flat_map(|s| turn(t).map(|t| [(s, t), (t, s)]).concat());
            let found: Vec<bool> = all.map(|(s, t)| matches!(meeting(s, t), Meeting::Cross { .. })).collect();
            assert!(found.iter().all(|&crosses| crosses == found[0]), "{t:?}: {found:?}");
            found[0]
        };
        // From the floor's corner, from beyond it, and from within it to the long edge or past it.
        assert!(crosses(across(0.0, 0.5)) && crosses(across(-1.0, 0.5)) && crosses(across(0.0, 2.0)));
        assert!(crosses(across(0.25, 0.5)) && crosses(across(-1.0, 1.0)));
        // Up to the corner, or from the long edge on.
        assert!(!crosses(across(-1.0, 0.0)) && !crosses(across(0.5, 2.0)) && !crosses(across(0.75, 2.0)));
        // A wall on the floor, and one that shares an edge with it.
        assert!(!crosses([DVec3::new(0.1, 0.1, 0.0), DVec3::new(0.4, 0.4, 0.0), DVec3::new(0.2, 0.2, 1.0)]));
        assert!(!crosses([DVec3::ZERO, DVec3::X, DVec3::Z]));
    }

    #[test]
    fn distance_is_to_the_nearest_part() {
        let d = |x, y, z| squared_distance(DVec3::new(x, y, z), FLOOR);
        assert_eq!(d(0.2, 0.2, 2.0), 4.0);
        assert_eq!(d(-3.0, 0.0, 4.0), 25.0);
        assert_eq!(d(0.5, -2.0, 0.0), 4.0);
    }
}
