//! The convex hull of points, as a mesh that is convex exactly, not only to rounding.
//!
//! ```text
//!            p                 a point beyond some face is joined to the *horizon*, the closed
//!          ⟋ ⋮ ⟍               walk of edges between the faces it sees and the faces it does not;
//!        h───⋯───h             the faces it sees go. Sight is an exact sign (`orient3d`), so the
//!       ╱  seen   ╲            walk is always one cycle and the result always closed and convex.
//!      h───────────h
//! ```

use std::collections::{BTreeSet, HashMap};

use glam::DVec3;
use robust::{Coord, Coord3D, orient2d, orient3d};

use super::{Bounds, TriMesh};

/// How far beyond a face a point must be to become a corner, as a fraction of the bounding box's diagonal.
///
/// A coordinate of a rotated or moved point carries a rounding error of a few 2⁻⁵³ ≈ 1.1e-16 of its size, so points
/// that are meant to be coplanar or collinear miss by some 1e-15 of the extent. 1e-11 is four orders above that and,
/// for a body 2 m tall, 2e-8 mm: far below any tessellation. Without it such points become faces so thin that
/// their normals are noise.
pub const HULL_TOLERANCE: f64 = 1e-11;

/// The least height of a face, as a fraction of its longest edge; a corner that makes a lower one is left out.
///
/// Rounding tilts the normal of a face by some 2⁻⁵³ over this ratio. At √2⁻⁵³ ≈ 1e-8 the tilt and what leaving the corner
/// out takes off the hull are alike, and both are as small as they can be: 1e-6 mm for a body of 100 mm. Points of
/// a tessellation are many orders above it; points that were meant to be collinear, and miss by more than rounding, are not.
const NEEDLE_RATIO: f64 = 1e-8;

/// Why points have no hull.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum HullError {
    /// A coordinate is NaN or infinite.
    #[error("point {0} is not finite")]
    NotFinite(usize),
    /// No volume can be spanned.
    #[error("{0} points span no volume; at least 4 are needed")]
    TooFew(usize),
    /// All points lie in one plane, on one line or in one place, within [`HULL_TOLERANCE`].
    #[error("all points lie in one plane")]
    Flat,
}

/// The convex hull of `points`, mm: closed, 2-manifold, every edge shared by two faces, faces counter-clockwise seen
/// from outside, only the corners kept, in the order in which they were given.
///
/// The mesh is convex exactly: no vertex is beyond the plane of any face, by the exact sign of the determinant.
/// A given point may stick out of it by at most about [`HULL_TOLERANCE`] of the extent, or 1e-8 of an edge that it lies
/// on. The result depends on the points and their order only. Typically `n log n`.
///
/// Errors if a coordinate is not finite, or if the points span no volume.
///
/// Quickhull: Barber, Dobkin, Huhdanpaa 1996, doi:10.1145/235815.235821. Exact signs: Shewchuk 1997,
/// doi:10.1007/PL00009321.
pub fn convex_hull(points: &[DVec3]) -> Result<TriMesh, HullError> {
    if let Some(bad) = points.iter().position(|p| !p.is_finite()) {
        return Err(HullError::NotFinite(bad));
    }
    if points.len() < 4 {
        return Err(HullError::TooFew(points.len()));
    }
    let tolerance_mm = HULL_TOLERANCE * Bounds::of(points.iter().copied()).diagonal();
    let mut candidates: Vec<u32> = (0..points.len() as u32).collect();
    loop {
        let faces = Quickhull::new(points, tolerance_mm).run(&candidates)?;
        let redundant = corners_on_their_longest_edge(points, &faces, tolerance_mm);
        if redundant.is_empty() {
            return Ok(compact(points, &faces));
        }
        // Each round drops at least one candidate, so this ends.
        candidates.retain(|v| redundant.binary_search(v).is_err());
    }
}

/// The hull under construction.
struct Quickhull<'a> {
    points: &'a [DVec3],
    tolerance_mm: f64,
    faces: Vec<Face>,
    /// Scratch: for each vertex, the new face whose horizon edge starts there.
    face_starting_at: Vec<u32>,
}

/// A face: its corners, the faces across its edges (`across[i]` shares corners `i` and `i + 1`), and its outside set.
struct Face {
    corners: [u32; 3],
    across: [u32; 3],
    normal: DVec3,
    alive: bool,
    /// Points beyond this face by more than the tolerance, each in the set of one face only.
    outside: Vec<u32>,
}

/// An edge of the horizon: from `start` to `end` counter-clockwise seen from the point, `beyond` the face that stays.
#[derive(Clone, Copy)]
struct HorizonEdge {
    start: u32,
    end: u32,
    beyond: u32,
}

impl<'a> Quickhull<'a> {
    fn new(points: &'a [DVec3], tolerance_mm: f64) -> Self {
        Self { points, tolerance_mm, faces: Vec::new(), face_starting_at: vec![u32::MAX; points.len()] }
    }

    /// The faces of the hull of `candidates`.
    fn run(mut self, candidates: &[u32]) -> Result<Vec<[u32; 3]>, HullError> {
        self.start_from_a_tetrahedron(candidates)?;
        let mut next = 0;
        while next < self.faces.len() {
            if self.faces[next].alive && !self.faces[next].outside.is_empty() {
                self.add_farthest_of(next);
            }
            next += 1;
        }
        Ok(self.faces.iter().filter(|f| f.alive).map(|f| f.corners).collect())
    }

    fn start_from_a_tetrahedron(&mut self, candidates: &[u32]) -> Result<(), HullError> {
        let [a, b, c, d] = self.spread_corners(candidates)?;
        // `orient3d` is positive when the last point is below the plane, that is when the first three are
        // counter-clockwise seen from the other side.
        let [b, c] = if self.sees(&[a, b, c], d) { [c, b] } else { [b, c] };
        self.faces = vec![
            self.face([a, b, c], [3, 1, 2]),
            self.face([b, d, c], [3, 2, 0]),
            self.face([c, d, a], [1, 3, 0]),
            self.face([a, d, b], [2, 1, 0]),
        ];
        let rest = candidates.iter().copied().filter(|p| ![a, b, c, d].contains(p));
        self.share_out(rest, 0);
        Ok(())
    }

    /// Four candidates that span a volume: far apart, then far from the line, then far from the plane.
    fn spread_corners(&self, candidates: &[u32]) -> Result<[u32; 4], HullError> {
        if candidates.len() < 4 {
            return Err(HullError::Flat);
        }
        let farthest = |measure: &dyn Fn(DVec3) -> f64| {
            let mut best = (candidates[0], measure(self.at(candidates[0])));
            for &candidate in &candidates[1..] {
                let value = measure(self.at(candidate));
                if value > best.1 {
                    best = (candidate, value);
                }
            }
            best
        };
        let extremes = [DVec3::X, DVec3::Y, DVec3::Z]
            .map(|axis| (farthest(&|p| -p.dot(axis)).0, farthest(&|p| p.dot(axis)).0));
        let (a, b) = extremes
            .into_iter()
            .max_by(|l, r| self.distance(l.0, l.1).total_cmp(&self.distance(r.0, r.1)))
            .ok_or(HullError::Flat)?;
        let origin = self.at(a);
        let along = (self.at(b) - origin).normalize_or_zero();
        let (c, from_line) = farthest(&|p| (p - origin).cross(along).length());
        let normal = along.cross(self.at(c) - origin).normalize_or_zero();
        let (d, from_plane) = farthest(&|p| (p - origin).dot(normal).abs());
        if from_line <= self.tolerance_mm
            || from_plane <= self.tolerance_mm
            || self.orientation(&[a, b, c], d) == 0.0
        {
            return Err(HullError::Flat);
        }
        Ok([a, b, c, d])
    }

    /// Makes the farthest outside point of a face a corner of the hull.
    fn add_farthest_of(&mut self, face: usize) {
        let Some(apex) = self.farthest_outside(face) else { return };
        let (seen, horizon) = self.faces_seen_from(apex, face as u32);
        let first_new = self.faces.len();
        self.raise_cone(apex, &horizon);
        let mut orphans = Vec::new();
        for f in seen {
            self.faces[f as usize].alive = false;
            orphans.append(&mut self.faces[f as usize].outside);
        }
        self.share_out(orphans.into_iter().filter(|&p| p != apex), first_new);
    }

    fn farthest_outside(&self, face: usize) -> Option<u32> {
        let f = &self.faces[face];
        let mut best: Option<(u32, f64)> = None;
        for &p in &f.outside {
            let height = self.height(f, p);
            if best.is_none_or(|(_, h)| height > h) {
                best = Some((p, height));
            }
        }
        best.map(|(p, _)| p)
    }

    /// The faces `apex` sees, grown from `first`, and the edges around them.
    ///
    /// A face whose plane holds the apex stays, as if the apex were a trifle nearer to the hull, and a flat side grows
    /// by a triangle. If the apex is on the line of a horizon edge, that triangle would have zero area: then
    /// all faces whose planes hold the apex go too, the flat side is triangulated anew from the apex, and every
    /// horizon edge borders a face strictly below the apex, so none is on a line with it.
    fn faces_seen_from(&self, apex: u32, first: u32) -> (Vec<u32>, Vec<HorizonEdge>) {
        let (seen, horizon) = self.grow_seen(apex, first, |orientation| orientation < 0.0);
        if horizon.iter().any(|edge| self.collinear(edge.start, edge.end, apex)) {
            return self.grow_seen(apex, first, |orientation| orientation <= 0.0);
        }
        (seen, horizon)
    }

    fn grow_seen(&self, apex: u32, first: u32, sees: impl Fn(f64) -> bool) -> (Vec<u32>, Vec<HorizonEdge>) {
        let mut seen = vec![first];
        let mut is_seen = HashMap::from([(first, true)]);
        let mut horizon = Vec::new();
        let mut next = 0;
        while next < seen.len() {
            let Face { corners, across, .. } = self.faces[seen[next] as usize];
            for i in 0..3 {
                let neighbour = across[i];
                let known = is_seen.get(&neighbour).copied();
                let visible = known
                    .unwrap_or_else(|| sees(self.orientation(&self.faces[neighbour as usize].corners, apex)));
                is_seen.insert(neighbour, visible);
                if !visible {
                    let (start, end) = (corners[i], corners[(i + 1) % 3]);
                    horizon.push(HorizonEdge { start, end, beyond: neighbour });
                } else if known.is_none() {
                    seen.push(neighbour);
                }
            }
            next += 1;
        }
        (seen, horizon)
    }

    /// Whether three points are on one line; exact: their shadows on the three coordinate planes are.
    fn collinear(&self, a: u32, b: u32, c: u32) -> bool {
        let points = [a, b, c].map(|v| self.at(v));
        [[0, 1], [1, 2], [2, 0]].into_iter().all(|[i, j]| {
            let [a, b, c] = points.map(|p| Coord { x: p[i], y: p[j] });
            orient2d(a, b, c) == 0.0
        })
    }

    /// Joins the apex to every edge of the horizon, in the walk's order.
    fn raise_cone(&mut self, apex: u32, horizon: &[HorizonEdge]) {
        let first_new = self.faces.len() as u32;
        for (i, edge) in horizon.iter().enumerate() {
            self.face_starting_at[edge.start as usize] = first_new + i as u32;
        }
        for (i, edge) in horizon.iter().enumerate() {
            let me = first_new + i as u32;
            let after = self.face_starting_at[edge.end as usize];
            // Edge 2 (apex → start) is filled in by the face before this one.
            let new = self.face([edge.start, edge.end, apex], [edge.beyond, after, u32::MAX]);
            self.faces.push(new);
            let beyond = &mut self.faces[edge.beyond as usize];
            for j in 0..3 {
                if beyond.corners[j] == edge.end && beyond.corners[(j + 1) % 3] == edge.start {
                    beyond.across[j] = me;
                }
            }
        }
        for me in first_new..self.faces.len() as u32 {
            let after = self.faces[me as usize].across[1];
            self.faces[after as usize].across[2] = me;
        }
    }

    /// Puts each point in the outside set of the face from `first_face` on that it is farthest beyond, if any.
    ///
    /// Only new faces need asking: a point that saw a removed face and still sees an old one also sees the new face
    /// on the horizon between them, whose normal lies between the two.
    fn share_out(&mut self, points: impl Iterator<Item = u32>, first_face: usize) {
        for p in points {
            let mut best = (usize::MAX, self.tolerance_mm);
            for (i, face) in self.faces.iter().enumerate().skip(first_face) {
                let height = self.height(face, p);
                if height > best.1 {
                    best = (i, height);
                }
            }
            if best.0 != usize::MAX && self.sees(&self.faces[best.0].corners, p) {
                self.faces[best.0].outside.push(p);
            }
        }
    }

    fn face(&self, corners: [u32; 3], across: [u32; 3]) -> Face {
        let [a, b, c] = corners.map(|v| self.at(v));
        let normal = (b - a).cross(c - a).normalize_or_zero();
        Face { corners, across, normal, alive: true, outside: Vec::new() }
    }

    fn at(&self, v: u32) -> DVec3 {
        self.points[v as usize]
    }

    fn distance(&self, a: u32, b: u32) -> f64 {
        self.at(a).distance(self.at(b))
    }

    /// How far a point is beyond a face's plane, mm, rounded.
    fn height(&self, face: &Face, point: u32) -> f64 {
        face.normal.dot(self.at(point) - self.at(face.corners[0]))
    }

    /// Whether a point is strictly beyond a face's plane; exact.
    fn sees(&self, corners: &[u32; 3], point: u32) -> bool {
        self.orientation(corners, point) < 0.0
    }

    /// Negative if the point is beyond the face's plane, 0 if in it, positive if below; the sign is exact.
    fn orientation(&self, corners: &[u32; 3], point: u32) -> f64 {
        let [a, b, c] = corners.map(|v| coordinates(self.at(v)));
        orient3d(a, b, c, coordinates(self.at(point)))
    }
}

fn coordinates(p: DVec3) -> Coord3D<f64> {
    Coord3D { x: p.x, y: p.y, z: p.z }
}

/// Corners that lie nearly on the longest edge of one of their faces: exactly convex, but a needle.
/// Sorted. At most one of a face's corners is named, because each is redundant only while the others stay.
fn corners_on_their_longest_edge(points: &[DVec3], faces: &[[u32; 3]], tolerance_mm: f64) -> Vec<u32> {
    let mut redundant = BTreeSet::new();
    for face in faces {
        let [a, b, c] = face.map(|v| points[v as usize]);
        let opposite = [(c - b).length(), (a - c).length(), (b - a).length()];
        let longest = (0..3).fold(0, |best, i| if opposite[i] > opposite[best] { i } else { best });
        let height = (b - a).cross(c - a).length() / opposite[longest];
        let is_needle = height.is_nan() || height <= tolerance_mm.max(NEEDLE_RATIO * opposite[longest]);
        if is_needle && face.iter().all(|v| !redundant.contains(v)) {
            redundant.insert(face[longest]);
        }
    }
    redundant.into_iter().collect()
}

/// The mesh over the vertices that faces use.
fn compact(points: &[DVec3], faces: &[[u32; 3]]) -> TriMesh {
    let mut used: Vec<u32> = faces.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    let mut renumbered = vec![0; points.len()];
    for (new, &old) in used.iter().enumerate() {
        renumbered[old as usize] = new as u32;
    }
    TriMesh {
        vertices: used.iter().map(|&v| points[v as usize]).collect(),
        faces: faces.iter().map(|f| f.map(|v| renumbered[v as usize])).collect(),
    }
}

#[cfg(test)]
mod tests;
