//! Half-space clipping of a line against a convex body: the reference all else is judged by.
//!
//! ```text
//!            leaving planes (n·d > 0): end at the least t
//!      ───▶──┤███████████├──▶
//!   entering planes (n·d < 0): start at the greatest t
//! ```
//!
//! There are no edge tests, hence no cracks: a ray through a vertex or along an edge is as good as any other.
//! Cyrus & Beck 1978, doi:10.1016/0097-8493(78)90021-3.

use crate::geometry::{Bounds, ConvexMesh, Interval, Line, Plane, Segment};

/// Planes handled side by side; the compiler turns the inner loops into wide instructions.
const LANES: usize = 4;

/// A convex body's face planes, laid out for clipping.
#[derive(Clone, Debug)]
pub struct ConvexClipper {
    blocks: Vec<PlaneBlock>,
}

/// `LANES` planes: a point and a normal each. Unused lanes have a zero normal and constrain nothing.
#[derive(Clone, Copy, Debug, Default)]
struct PlaneBlock {
    point: [[f64; LANES]; 3],
    normal: [[f64; LANES]; 3],
}

impl ConvexClipper {
    /// Lays out all planes of `body`.
    pub fn new(body: &ConvexMesh) -> Self {
        Self::of_planes(body.planes().iter())
    }

    fn of_planes<'a>(planes: impl Iterator<Item = &'a Plane>) -> Self {
        let mut blocks: Vec<PlaneBlock> = Vec::new();
        for (i, plane) in planes.enumerate() {
            let lane = i % LANES;
            if lane == 0 {
                blocks.push(PlaneBlock::default());
            }
            let Some(block) = blocks.last_mut() else { continue };
            for axis in 0..3 {
                block.point[axis][lane] = plane.point[axis];
                block.normal[axis][lane] = plane.normal[axis];
            }
        }
        Self { blocks }
    }

    /// The part of `line` in the body, mm along `dir`. `None` if it misses or only touches in a point.
    ///
    /// The body is closed: a line in a face's plane counts its length in the face. Each plane's crossing is
    /// `n·(v − o) / n·d` with a relative error of γ₈ of |v − o| / |n·d|, so the chord is exact for a line moved by no
    /// more than γ₈ of its distance to the body.
    pub fn chord(&self, line: &Line) -> Option<Interval> {
        let (o, d) = (line.origin().to_array(), line.dir().to_array());
        let mut enter = [f64::NEG_INFINITY; LANES];
        let mut leave = [f64::INFINITY; LANES];
        let mut misses = [false; LANES];
        for block in &self.blocks {
            let (p, n) = (&block.point, &block.normal);
            for i in 0..LANES {
                let slope = n[0][i] * d[0] + n[1][i] * d[1] + n[2][i] * d[2];
                let height =
                    n[0][i] * (p[0][i] - o[0]) + n[1][i] * (p[1][i] - o[1]) + n[2][i] * (p[2][i] - o[2]);
                let t = height / slope;
                let entering = if slope < 0.0 { t } else { f64::NEG_INFINITY };
                let leaving = if slope > 0.0 { t } else { f64::INFINITY };
                enter[i] = if entering > enter[i] { entering } else { enter[i] };
                leave[i] = if leaving < leave[i] { leaving } else { leave[i] };
                misses[i] |= slope == 0.0 && height < 0.0;
            }
        }
        let start = enter.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let end = leave.into_iter().fold(f64::INFINITY, f64::min);
        if misses.contains(&true) || start >= end {
            return None;
        }
        Interval::new(start, end)
    }
}

/// A convex body narrowed to the planes that matter within a region, for many segments in that region.
///
/// Let F be the region (convex) and Q the intersection of the half-spaces of those faces that touch F. Q holds the
/// body, so a segment that misses Q misses the body. And if the body meets F at all, the two are one within F: were
/// a point p of Q ∩ F not in the body, the path within F from the body to p would leave the body through a face that
/// touches F, and p would lie beyond that face's plane, hence not in Q. Whether the body meets F is proved by the
/// first segment that all planes say hits; until then every hit is asked of all planes. If no face touches F, it
/// lies wholly inside or wholly outside, and one segment tells for all.
///
/// So the chord is that of [`ConvexClipper::chord`] up to its error bound: a plane left out can only have been
/// decisive within rounding.
#[derive(Clone, Debug)]
pub struct NarrowedClipper<'a> {
    all: &'a ConvexClipper,
    /// `None` if narrowing saves nothing.
    near: Option<ConvexClipper>,
    body_in_region: Known,
}

/// Whether a body meets a region.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Known {
    NotYet,
    Meets,
    Misses,
}

impl<'a> NarrowedClipper<'a> {
    /// Narrows `all`, the clipper of `body`, to a convex region. `may_touch` must be true for every box that shares
    /// a point with the region.
    pub fn new(body: &ConvexMesh, all: &'a ConvexClipper, may_touch: impl Fn(&Bounds) -> bool) -> Self {
        let mut planes = Vec::new();
        let mesh = body.surface().mesh();
        body.surface().tree().visit(&may_touch, |face| {
            if may_touch(&Bounds::of(mesh.triangle(face as usize))) {
                planes.extend(body.plane_of(face as usize));
            }
        });
        planes.sort_unstable();
        planes.dedup();
        let all_planes = body.planes();
        let near = (2 * planes.len() < all_planes.len())
            .then(|| ConvexClipper::of_planes(planes.iter().map(|&p| &all_planes[p as usize])));
        Self { all, near, body_in_region: Known::NotYet }
    }

    /// The part of `segment`, which must lie in the region, in the body; mm from its source.
    pub fn chord(&mut self, segment: &Segment) -> Option<Interval> {
        let reach = segment.reach();
        let chord_by = |clipper: &ConvexClipper| clipper.chord(segment.line())?.intersection(&reach);
        let Some(near) = &self.near else { return chord_by(self.all) };
        if self.body_in_region == Known::Misses {
            return None;
        }
        let chord = chord_by(near)?;
        if self.body_in_region == Known::Meets {
            return Some(chord);
        }
        let chord = chord_by(self.all);
        if chord.is_some() {
            self.body_in_region = Known::Meets;
        } else if near.blocks.is_empty() {
            self.body_in_region = Known::Misses;
        }
        chord
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::geometry::primitives::{cube, icosphere};
    use crate::geometry::{ClosedMesh, TriMesh, UnitDir};

    fn clipper(mesh: TriMesh) -> ConvexClipper {
        ConvexClipper::new(&ConvexMesh::new(ClosedMesh::new(mesh).expect("closed").0).expect("convex"))
    }

    fn line(from: DVec3, towards: DVec3) -> Line {
        Line::new(from, UnitDir::new(towards).expect("a direction")).expect("finite")
    }

    #[test]
    fn a_cube_is_as_long_as_its_side_and_its_diagonals() {
        let cube = clipper(cube(2.0));
        let length = |from, towards| cube.chord(&line(from, towards)).map(|c| c.length());
        assert_eq!(length(DVec3::new(-9.0, 0.3, 0.4), DVec3::X), Some(2.0));
        let diagonal = length(DVec3::splat(-7.0), DVec3::ONE).expect("a hit");
        assert!((diagonal - 12f64.sqrt()).abs() < 1e-14);
        assert_eq!(length(DVec3::new(-9.0, 1.1, 0.0), DVec3::X), None);
    }

    #[test]
    fn the_body_is_closed_a_line_in_a_face_or_along_an_edge_counts() {
        let cube = clipper(cube(2.0));
        let length = |y, z| cube.chord(&line(DVec3::new(5.0, y, z), -DVec3::X)).map(|c| c.length());
        assert_eq!(length(1.0, 0.2), Some(2.0));
        assert_eq!(length(1.0, -1.0), Some(2.0));
        assert_eq!(length(1.0 + f64::EPSILON, 0.2), None);
    }

    #[test]
    fn a_source_inside_sees_both_ways() {
        let chord = clipper(cube(2.0)).chord(&line(DVec3::new(0.5, 0.0, 0.0), DVec3::X)).expect("a hit");
        assert_eq!((chord.start(), chord.end()), (-1.5, 0.5));
    }

    #[test]
    fn rays_aimed_at_every_vertex_and_edge_of_a_ball_are_not_lost() {
        let mesh = icosphere(3).map_vertices(|v| v * DVec3::new(100.0, 80.0, 60.0));
        let ball = clipper(mesh.clone());
        let source = DVec3::new(20.0, -500.0, 33.0);
        for face in mesh.triangles() {
            for target in [face[0], face[0].midpoint(face[1])] {
                // From within, a ray cannot miss; from outside it may graze the silhouette.
                let inside = ball.chord(&line(DVec3::new(1.0, 2.0, 3.0), target)).expect("from inside");
                assert!(inside.start() < 0.0 && inside.end() > 0.0);
                let ahead = line(source, target - source);
                let facing =
                    (target / DVec3::new(1e4, 6.4e3, 3.6e3)).normalize().dot(ahead.dir()).abs() > 0.1;
                assert!(!facing || ball.chord(&ahead).is_some(), "{target}");
            }
        }
    }
}
