//! Bodies beside, around or behind a cone's source: what the rays cannot see is cut off.
//!
//! ```text
//!        ╲      body       ╱            All before the plane is cut off. It lies so close to the source that no pixel's
//!         ╲   ┌───────────╱──           ray meets the surface before it: the cut is the same for all rays,
//!   ───────╲──┼──────────╱──── plane    wholly inside the body if the source is, wholly outside if not.
//!           ╲ └─────────╱───
//!            ╲ source  ╱                The edges of the cut are seen off the grid.
//! ```

use glam::DVec3;

use super::projection::{Place, Projection};
use crate::geometry::{ClosedMesh, RayGrid, Side};

/// Of the way to the surface nearest to the source, the part that the plane may take off a ray's way: half, as the distance
/// and the lengths of the rays are rounded.
const PART_CUT: f64 = 0.5;

/// The surface as seen from a source with the plane's shares cut off.
pub struct Cut {
    pub places: Vec<Place>,
    /// The corners of the faces left, each face's deepest first.
    pub corners: Vec<[u32; 3]>,
    /// The faces' numbers in the surface.
    pub numbers: Vec<u32>,
    pub source_is_inside: bool,
    /// The plane's share.
    pub share: f64,
}

impl Cut {
    /// Cuts `surface` near the `source` of a grid. `None` if the source lies on it.
    pub fn new(surface: &ClosedMesh, grid: &RayGrid, projection: &Projection, source: DVec3) -> Option<Self> {
        let source_is_inside = match surface.side_of(source) {
            Side::Inside => true,
            Side::Outside => false,
            Side::On => return None,
        };
        let (columns, rows) = grid.size();
        let corners = [(0, 0), (columns - 1, 0), (0, rows - 1), (columns - 1, rows - 1)];
        let longest = corners.iter().map(|&(c, r)| (grid.point(c, r) - source).length()).fold(0.0, f64::max);
        let share = PART_CUT * surface.distance_mm(source) / longest;
        let mut cut = Self {
            places: Vec::new(),
            corners: Vec::with_capacity(surface.mesh().faces.len()),
            numbers: Vec::with_capacity(surface.mesh().faces.len()),
            source_is_inside,
            share,
        };
        let vertices: Vec<DVec3> =
            surface.mesh().vertices.iter().map(|&v| projection.homogeneous(v)).collect();
        // The places of vertices that no face keeps are not asked for.
        cut.places.extend(vertices.iter().map(|&v| projection.place(v)));
        for (number, &face) in surface.mesh().faces.iter().enumerate() {
            cut.add(number as u32, face, &vertices, projection);
        }
        (share > 0.0).then_some(cut)
    }

    /// Adds what is left of a face: nothing, a triangle or two.
    fn add(&mut self, number: u32, face: [u32; 3], vertices: &[DVec3], projection: &Projection) {
        let is_kept = face.map(|v| vertices[v as usize].z >= self.share);
        if is_kept == [true; 3] {
            return self.push(number, face);
        }
        let mut left: Vec<u32> = Vec::with_capacity(4);
        for i in 0..3 {
            let j = (i + 1) % 3;
            if is_kept[i] {
                left.push(face[i]);
            }
            if is_kept[i] != is_kept[j] {
                // From the end that is kept, so that both faces of the edge cut it in the same place to the last bit.
                let (kept, lost) = if is_kept[i] { (face[i], face[j]) } else { (face[j], face[i]) };
                let (p, q) = (vertices[kept as usize], vertices[lost as usize]);
                let mut place = p.lerp(q, (p.z - self.share) / (p.z - q.z));
                place.z = self.share;
                left.push(self.places.len() as u32);
                self.places.push(projection.place(place));
            }
        }
        for i in 2..left.len() {
            self.push(number, [left[0], left[i - 1], left[i]]);
        }
    }

    /// Depths are reckoned from a face's first corner. From the deepest on, where they are least, no digits are lost.
    fn push(&mut self, number: u32, face: [u32; 3]) {
        let [a, b, c] = face.map(|v| self.places[v as usize].depth);
        let turns = if a <= b && a <= c { 0 } else { 1 + usize::from(c < b) };
        let mut face = face;
        face.rotate_left(turns);
        self.corners.push(face);
        self.numbers.push(number);
    }
}
