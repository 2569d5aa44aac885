//! All crossings of a line with a closed surface, convex or not, watertight.
//!
//! Vertices are sheared so that the line becomes the third axis (Woop, Benthin & Wald 2013,
//! <https://jcgt.org/published/0002/01/05/>); each face then covers the origin of the plane or does not. A vertex's
//! place after the shear depends on the vertex and the line alone, and coverage is decided by exact signs with
//! ties broken alike for all faces, so that crossings always come in pairs: no line leaks through an edge.

use super::shear::{Shear, Sheared};
use crate::geometry::numeric::gamma;
use crate::geometry::predicates::cover;
use crate::geometry::{Bounds, ClosedMesh, Interval, Line};
use glam::DVec3;

/// Finds the parts of `line` inside `surface`, mm along `dir`, in order and disjoint; written to `parts`.
///
/// The body is closed: a line in a face's plane counts its length in the face. The parts are exact for
/// a surface each of whose vertices has moved by no more than γ₈ of its distance from the line's origin: a vertex is rounded
/// by itself, alike for all its faces, so neighbouring vertices may move apart, and no one shift of the line stands for all.
pub fn chords(surface: &ClosedMesh, line: &Line, parts: &mut Vec<Interval>) {
    parts.clear();
    let shear = Shear::new(line);
    let near_line = LineBoxTest::new(line);
    let mut crossings: Vec<(f64, i32)> = Vec::with_capacity(8);
    surface.tree().visit(
        |b| near_line.may_hit(b),
        |face| {
            let triangle = surface.mesh().triangle(face as usize).map(|v| shear.apply(v));
            match triangle_crossing(&triangle) {
                Crossing::None => {}
                Crossing::Through(t, winding) => crossings.push((t, winding)),
                Crossing::Along(along) => parts.push(along),
            }
        },
    );
    crossings.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut depth = 0;
    let mut start = 0.0;
    for (t, winding) in crossings {
        // A face wound counter-clockwise along the line looks along it: the line leaves.
        let before = depth;
        depth -= winding;
        if before == 0 && depth == 1 {
            start = t;
        } else if before == 1 && depth == 0 {
            parts.extend(Interval::new(start, t).filter(|p| p.length() > 0.0));
        }
    }
    merge(parts);
}

/// Joins parts that overlap or touch.
fn merge(parts: &mut Vec<Interval>) {
    if parts.len() < 2 {
        return;
    }
    parts.sort_unstable_by(|a, b| a.start().total_cmp(&b.start()));
    let mut merged = 0;
    for i in 1..parts.len() {
        if parts[i].start() <= parts[merged].end() {
            let end = parts[merged].end().max(parts[i].end());
            parts[merged] = Interval::new(parts[merged].start(), end).unwrap_or(parts[merged]);
        } else {
            merged += 1;
            parts[merged] = parts[i];
        }
    }
    parts.truncate(merged + 1);
}

enum Crossing {
    None,
    /// Passes through at this place; +1 leaving, −1 entering.
    Through(f64, i32),
    /// Lies in the face's plane and overlaps the face.
    Along(Interval),
}

fn triangle_crossing(corners: &[Sheared; 3]) -> Crossing {
    let [a, b, c] = corners.map(|v| v.across);
    // All three on one side of the line: the common case, decided by comparisons alone.
    for axis in 0..2 {
        let (p, q, r) = (a[axis], b[axis], c[axis]);
        if (p > 0.0 && q > 0.0 && r > 0.0) || (p < 0.0 && q < 0.0 && r < 0.0) {
            return Crossing::None;
        }
    }
    let winding = cover([a, b, c], [0.0, 0.0]);
    if winding == 0 {
        return overlap_of_edge_on_face(corners).map_or(Crossing::None, Crossing::Along);
    }
    let cross = |u: [f64; 2], v: [f64; 2]| (u[0] * v[1] - u[1] * v[0]).abs();
    let weights = [cross(b, c), cross(c, a), cross(a, b)];
    let total: f64 = weights.iter().sum();
    let along = corners.map(|v| v.along);
    let (low, high) = (along[0].min(along[1]).min(along[2]), along[0].max(along[1]).max(along[2]));
    let t = if total > 0.0 {
        (weights[0] * along[0] + weights[1] * along[1] + weights[2] * along[2]) / total
    } else {
        // Seen so nearly edge-on that the areas underflow: anywhere on the face is within rounding.
        0.5 * (low + high)
    };
    // Rounding may not put the crossing off the face.
    Crossing::Through(t.clamp(low, high), winding)
}

/// The overlap of the line with a face whose plane holds it. `None` if the plane does not, exactly.
fn overlap_of_edge_on_face(corners: &[Sheared; 3]) -> Option<Interval> {
    let [a, b, c] = corners.map(|v| v.across);
    let area = |u: [f64; 2], v: [f64; 2]| {
        let coord = |q: [f64; 2]| robust::Coord { x: q[0], y: q[1] };
        robust::orient2d(coord(u), coord(v), coord([0.0, 0.0]))
    };
    if area(a, b) != 0.0 || area(b, c) != 0.0 || area(c, a) != 0.0 {
        return None;
    }
    // The face is a triangle in the plane of the line: across by the larger coordinate, along by the other.
    let axis = usize::from(
        corners.iter().map(|v| v.across[1].abs()).fold(0.0, f64::max)
            > corners.iter().map(|v| v.across[0].abs()).fold(0.0, f64::max),
    );
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut add = |t: f64| (low, high) = (low.min(t), high.max(t));
    for i in 0..3 {
        let (p, q) = (corners[i], corners[(i + 1) % 3]);
        let (u, v) = (p.across[axis], q.across[axis]);
        if u == 0.0 {
            add(p.along);
        }
        if (u < 0.0 && v > 0.0) || (u > 0.0 && v < 0.0) {
            let t = (u * q.along - v * p.along) / (u - v);
            add(t.clamp(p.along.min(q.along), p.along.max(q.along)));
        }
    }
    Interval::new(low, high).filter(|part| part.length() > 0.0)
}

/// Whether a line may touch a box: separating axes, without division, so without NaN (Ericson, *Real-Time Collision
/// Detection*, §5.3.3).
struct LineBoxTest {
    origin: DVec3,
    dir: DVec3,
    dir_abs: DVec3,
}

/// The cross product and the extent each err by γ₅ of |m| + |h|; the shear of the vertices by γ₃ more.
const BOX_MARGIN: f64 = gamma(16);

impl LineBoxTest {
    fn new(line: &Line) -> Self {
        Self { origin: line.origin(), dir: line.dir(), dir_abs: line.dir().abs() }
    }

    fn may_hit(&self, b: &Bounds) -> bool {
        let half = 0.5 * (b.max - b.min);
        let centre = 0.5 * (b.max + b.min) - self.origin;
        let moment = centre.cross(self.dir).abs();
        let reach = DVec3::new(
            half.y * self.dir_abs.z + half.z * self.dir_abs.y,
            half.z * self.dir_abs.x + half.x * self.dir_abs.z,
            half.x * self.dir_abs.y + half.y * self.dir_abs.x,
        );
        let largest = b.min.abs().max(b.max.abs()) + self.origin.abs();
        let margin = BOX_MARGIN * (largest.x + largest.y + largest.z);
        moment.cmple(reach + margin).all()
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::super::clip::ConvexClipper;
    use super::*;
    use crate::geometry::primitives::{cube, icosphere, inside_out};
    use crate::geometry::{ConvexMesh, TriMesh, UnitDir};

    fn closed(mesh: TriMesh) -> ClosedMesh {
        ClosedMesh::new(mesh).expect("closed").0
    }

    fn line(from: DVec3, towards: DVec3) -> Line {
        Line::new(from, UnitDir::new(towards).expect("a direction")).expect("finite")
    }

    fn total(surface: &ClosedMesh, line: &Line) -> f64 {
        let mut parts = Vec::new();
        chords(surface, line, &mut parts);
        parts.iter().map(Interval::length).sum()
    }

    #[test]
    fn two_cubes_in_a_row_give_two_chords_in_order() {
        let mut pair = cube(2.0).map_vertices(|v| v + DVec3::X * 10.0);
        pair.append(&cube(2.0));
        let mut parts = Vec::new();
        chords(&closed(pair), &line(DVec3::new(-5.0, 0.2, 0.3), DVec3::X), &mut parts);
        let ends: Vec<_> = parts.iter().map(|p| (p.start(), p.end())).collect();
        assert_eq!(ends, [(4.0, 6.0), (14.0, 16.0)]);
    }

    #[test]
    fn a_hollow_ball_counts_its_wall_only() {
        let mut shell = cube(6.0);
        shell.append(&inside_out(cube(2.0)));
        assert_eq!(total(&closed(shell), &line(DVec3::new(0.1, 0.2, -9.0), DVec3::Z)), 4.0);
    }

    #[test]
    fn a_line_in_a_face_or_along_an_edge_counts() {
        let cube = closed(cube(2.0));
        for (y, z) in
            [(1.0, 0.2), (-1.0, 0.2), (0.3, 1.0), (0.3, -1.0), (1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]
        {
            for along in [DVec3::X, -DVec3::X] {
                assert_eq!(total(&cube, &line(DVec3::new(5.0, y, z), along)), 2.0, "{y} {z} {along}");
            }
        }
        assert_eq!(total(&cube, &line(DVec3::new(5.0, 1.0 + f64::EPSILON, 0.0), DVec3::X)), 0.0);
    }

    #[test]
    fn crossings_agree_with_clipping_also_when_aimed_at_vertices_and_edges() {
        let mesh = icosphere(3).map_vertices(|v| v * DVec3::new(100.0, 80.0, 60.0));
        let surface = closed(mesh.clone());
        let clipper = ConvexClipper::new(&ConvexMesh::new(surface.clone()).expect("convex"));
        let mut rng = rand_pcg::Pcg64::seed_from_u64(11);
        let mut worst: f64 = 0.0;
        for i in 0..20_000 {
            let [a, b, c] = mesh.triangle(i % mesh.faces.len());
            let (u, v): (f64, f64) = (rng.random(), rng.random());
            let target = [a, a + u * (b - a), a + 0.5 * u * (b - a) + 0.5 * v * (c - a)][i % 3];
            let source = DVec3::from([0; 3].map(|_| rng.random_range(-500.0..500.0)));
            let ray = line(source, target - source);
            let by_clipping = clipper.chord(&ray).map_or(0.0, |chord| chord.length());
            // Near the silhouette the chord moves by √(2·100 mm·shift) for a shift of 1e-13 mm.
            worst = worst.max((total(&surface, &ray) - by_clipping).abs());
        }
        assert!(worst < 1e-5, "{worst}");
    }

    #[test]
    fn no_line_leaks_through_a_ball() {
        let surface = closed(icosphere(4));
        for corner in &surface.mesh().vertices {
            let through = total(&surface, &line(DVec3::new(0.01, 0.02, 0.03), *corner));
            assert!(through > 1.9, "{corner}: {through}");
        }
    }
}
