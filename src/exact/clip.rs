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

use pulp::{Simd, WithSimd};

use super::{Record, Way};
use crate::geometry::{ConvexMesh, Interval, Line, Segment};

/// Planes handled side by side; the compiler turns the inner loops into wide instructions.
const LANES: usize = 4;

/// A convex body's face planes, laid out for clipping.
#[derive(Clone, Debug)]
pub struct ConvexClipper {
    blocks: Vec<PlaneBlock>,
    /// A face in each plane.
    faces: Vec<u32>,
}

/// `LANES` planes: a point and a normal each. Unused lanes have a zero normal and constrain nothing.
#[derive(Clone, Copy, Debug, Default)]
struct PlaneBlock {
    point: [[f64; LANES]; 3],
    normal: [[f64; LANES]; 3],
}

impl PlaneBlock {
    /// How high a lane's plane lies over the line's origin, mm, and how fast the line rises towards it: the line crosses it
    /// at the ratio.
    #[inline(always)]
    fn crossing(&self, lane: usize, o: [f64; 3], d: [f64; 3]) -> (f64, f64) {
        let (p, n) = (&self.point, &self.normal);
        let [nx, ny, nz] = [n[0][lane], n[1][lane], n[2][lane]];
        let height = nx * (p[0][lane] - o[0]) + ny * (p[1][lane] - o[1]) + nz * (p[2][lane] - o[2]);
        (height, nx * d[0] + ny * d[1] + nz * d[2])
    }
}

impl ConvexClipper {
    /// Lays out all planes of `body`.
    pub fn new(body: &ConvexMesh) -> Self {
        let planes = body.planes();
        let mut blocks = vec![PlaneBlock::default(); planes.len().div_ceil(LANES)];
        for (i, plane) in planes.iter().enumerate() {
            let (block, lane) = (&mut blocks[i / LANES], i % LANES);
            for axis in 0..3 {
                block.point[axis][lane] = plane.point[axis];
                block.normal[axis][lane] = plane.normal[axis];
            }
        }
        let mut faces = vec![0; planes.len()];
        for face in (0..body.surface().mesh().faces.len()).rev() {
            if let Some(plane) = body.plane_of(face) {
                faces[plane as usize] = face as u32;
            }
        }
        Self { blocks, faces }
    }

    /// How many planes there are.
    pub fn plane_count(&self) -> usize {
        self.faces.len()
    }

    /// Records where each segment, numbered from `first`, enters and leaves the body, mm from its source. The faces are
    /// those of the planes that decide; where planes meet on the ray, the first of them.
    pub fn trace_all<R: Record>(&self, first: usize, segments: &[Segment], record: &mut R) {
        crate::dispatch::arch().dispatch(Trace { clipper: self, first, segments, record });
    }

    /// As [`trace_all`](Self::trace_all), for one segment.
    pub fn trace(&self, ray: usize, segment: &Segment, record: &mut impl Record) {
        self.trace_all(ray, std::slice::from_ref(segment), record);
    }

    #[inline(always)]
    fn trace_one<R: Record>(&self, ray: usize, segment: &Segment, record: &mut R) {
        let Some(chord) = self.chord_here(segment.line()) else { return };
        let part = chord.intersection(&segment.reach()).filter(|part| part.length() > 0.0);
        if let Some(part) = part {
            let [entry, exit] =
                if R::ASKS_FACES { self.deciding_faces(segment.line(), chord) } else { [0; 2] };
            record.crossing(ray, part.start(), entry, Way::In);
            record.crossing(ray, part.end(), exit, Way::Out);
        }
    }

    /// The faces at both ends of the chord of `line`.
    fn deciding_faces(&self, line: &Line, chord: Interval) -> [u32; 2] {
        let (o, d) = (line.origin().to_array(), line.dir().to_array());
        let crosses_at = |plane: usize, t: f64, sign: f64| {
            let (crossing, slope) = self.blocks[plane / LANES].crossing(plane % LANES, o, d);
            slope * sign > 0.0 && crossing / slope == t
        };
        let face_at = |t: f64, sign: f64| {
            (0..self.plane_count())
                .find(|&plane| crosses_at(plane, t, sign))
                .map_or(0, |plane| self.faces[plane])
        };
        [face_at(chord.start(), -1.0), face_at(chord.end(), 1.0)]
    }

    /// The part of `line` in the body, mm along `dir`. `None` if it misses or only touches in a point.
    ///
    /// The body is closed: a line in a face's plane counts its length in the face. Each plane's crossing is
    /// `n·(v − o) / n·d` with a relative error of γ₈ of |v − o| / |n·d|, so the chord is exact for a line moved by no
    /// more than γ₈ of its distance to the body.
    pub fn chord(&self, line: &Line) -> Option<Interval> {
        crate::dispatch::arch().dispatch(Chord { clipper: self, line })
    }

    /// The same by the instructions that the caller has.
    #[inline(always)]
    fn chord_here(&self, line: &Line) -> Option<Interval> {
        let (o, d) = (line.origin().to_array(), line.dir().to_array());
        let mut enter = [f64::NEG_INFINITY; LANES];
        let mut leave = [f64::INFINITY; LANES];
        let mut misses = [false; LANES];
        for block in &self.blocks {
            for i in 0..LANES {
                let (height, slope) = block.crossing(i, o, d);
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

/// [`ConvexClipper::trace_all`], compiled for each set of wide instructions.
struct Trace<'a, R> {
    clipper: &'a ConvexClipper,
    first: usize,
    segments: &'a [Segment],
    record: &'a mut R,
}

impl<R: Record> WithSimd for Trace<'_, R> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for (i, segment) in self.segments.iter().enumerate() {
            self.clipper.trace_one(self.first + i, segment, self.record);
        }
    }
}

/// [`ConvexClipper::chord`], likewise.
struct Chord<'a> {
    clipper: &'a ConvexClipper,
    line: &'a Line,
}

impl WithSimd for Chord<'_> {
    type Output = Option<Interval>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Option<Interval> {
        self.clipper.chord_here(self.line)
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
    fn wide_instructions_give_the_bits_of_the_baseline() {
        let mesh = icosphere(3).map_vertices(|v| v * DVec3::new(100.0, 80.0, 60.0));
        let ball = clipper(mesh.clone());
        let source = DVec3::new(20.0, -500.0, 33.0);
        let towards = |target: DVec3| Segment::between(source, source + 2.0 * (target - source));
        let rays: Vec<_> = mesh
            .triangles()
            .flat_map(|[a, b, c]| [a, a.midpoint(b), (a + b + c) / 3.0])
            .filter_map(towards)
            .collect();
        let trace = |arch: pulp::Arch| {
            let mut lengths = vec![0.0; rays.len()];
            let record = &mut crate::exact::Lengths(&mut lengths);
            arch.dispatch(Trace { clipper: &ball, first: 0, segments: &rays, record });
            lengths.into_iter().map(f64::to_bits).collect::<Vec<_>>()
        };
        assert_eq!(trace(pulp::Arch::new()), trace(pulp::Arch::Scalar));
        for ray in &rays {
            assert_eq!(ball.chord(ray.line()), ball.chord_here(ray.line()));
        }
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
