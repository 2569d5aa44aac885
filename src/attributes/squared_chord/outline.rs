//! The pixels at which a body may be seen: those within a polygon around its outline.
//!
//! Each side of the polygon is a plane through the source that no vertex is beyond; found in a few steps (Dinkelbach 1967,
//! doi:10.1287/mnsc.13.7.492), each to the vertex that is farthest beyond the last: by climbing over a surface that is strictly
//! convex, by a search of all boxes elsewhere.

use std::ops::Range;

use glam::DVec3;

use crate::exact::walk::Walker;
use crate::geometry::{ClosedMesh, RayGrid, Upstream};

/// Sides of the polygon. A regular one of 24 sides is 0.6 % larger than the ellipse in it, one of 96 sides 0.04 %.
const SIDES: usize = 24;

/// Sides that are found by climbing, which is quick.
const CLIMBED_SIDES: usize = 96;

/// Climbs for a side; each but the first few is in vain.
const CLIMBS: usize = 8;

/// Vertices that are looked up before any is searched for.
const GUESSES: usize = 3;

/// Sides may lie so far out, pixels; no closer search is made.
const SLACK_PIXELS: f64 = 0.25;

/// More than rounding can put a vertex off its place, pixels.
const ROUNDING_PIXELS: f64 = 1e-6;

/// A climb may end some roundings of heights below the highest vertex, once for each edge between the two: far less than this.
const CLIMBING_PIXELS: f64 = 0.02;

/// Where points are seen: column and row are `(p − from)·column / (p − from)·depth` and so on.
struct Sight {
    from: DVec3,
    column: DVec3,
    row: DVec3,
    /// 1 at the pixels, 0 at the source of a cone.
    depth: DVec3,
    /// Added to the depth.
    constant_depth: f64,
}

impl Sight {
    fn new(grid: &RayGrid) -> Self {
        let [a, b] = grid.steps();
        match grid.upstream() {
            Upstream::Source(source) => {
                let path = grid.origin() - source;
                let scale = 1.0 / a.dot(b.cross(path));
                let [column, row, depth] = [b.cross(path), path.cross(a), a.cross(b)].map(|v| scale * v);
                Self { from: source, column, row, depth, constant_depth: 0.0 }
            }
            Upstream::Path(path) => {
                let scale = 1.0 / a.dot(b.cross(path));
                let [column, row] = [b.cross(path), path.cross(a)].map(|v| scale * v);
                Self { from: grid.origin(), column, row, depth: DVec3::ZERO, constant_depth: 1.0 }
            }
        }
    }

    /// How far along a direction of the image a point is seen, pixels.
    fn place(&self, point: DVec3, along: DVec3) -> f64 {
        let v = point - self.from;
        v.dot(along) / (v.dot(self.depth) + self.constant_depth)
    }

    /// How far along a direction of the image any vertex is seen, pixels, to within rounding. `None` if climbing does not tell.
    fn climb(&self, walker: &Walker, along: DVec3, least_depth: f64) -> Option<f64> {
        let mut most = f64::NEG_INFINITY;
        let mut normal = along;
        for _ in 0..CLIMBS {
            let vertex = walker.highest_vertex(normal)?;
            let at = self.place(vertex, along);
            if at <= most {
                // No vertex is above the side through the last.
                let above = normal.dot(vertex - self.from) - most * self.constant_depth;
                return Some(most + above.max(0.0) / least_depth + CLIMBING_PIXELS);
            }
            most = at;
            normal = along - most * self.depth;
        }
        None
    }

    /// As [`climb`](Self::climb), over any surface, to within some slack. `touching` is a vertex to begin with.
    fn search(
        &self,
        surface: &ClosedMesh,
        walker: Option<&Walker>,
        along: DVec3,
        least_depth: f64,
        touching: &mut DVec3,
    ) -> f64 {
        let slack = SLACK_PIXELS * least_depth;
        let mut most = self.place(*touching, along);
        for walker in walker.iter().flat_map(|walker| [walker; GUESSES]) {
            most = most.max(self.place(walker.vertex_towards(along - most * self.depth), along));
        }
        loop {
            let normal = along - most * self.depth;
            let base = most * self.constant_depth;
            let (bound, vertex) = surface.height_bound(normal, self.from, base, slack);
            match vertex.filter(|_| bound - base > 2.0 * slack) {
                Some(vertex) => {
                    *touching = vertex;
                    most = self.place(vertex, along).max(most);
                }
                None => return most + (bound - base) / least_depth + ROUNDING_PIXELS,
            }
        }
    }
}

/// The shares of the way from start to end, of all points of the surface's box.
fn shares(surface: &ClosedMesh, grid: &RayGrid) -> [f64; 2] {
    let [a, b] = grid.steps();
    let normal = a.cross(b);
    let (from, path) = match grid.upstream() {
        Upstream::Source(source) => (source, grid.origin() - source),
        Upstream::Path(path) => (grid.origin() - path, path),
    };
    let bounds = surface.bounds();
    let scale = 1.0 / normal.dot(path);
    let (middle, half) =
        ((bounds.centre() - from).dot(normal) * scale, 0.5 * bounds.size().dot((scale * normal).abs()));
    [middle - half, middle + half]
}

/// The pixels of each row that the body inside a surface may be seen at; all others miss, proved. `None` if the body
/// does not lie wholly between where rays start and where they end.
pub fn rows_within(surface: &ClosedMesh, walker: Option<&Walker>, grid: &RayGrid) -> Option<Vec<Range<u32>>> {
    let [nearest, farthest] = shares(surface, grid);
    // Written so that NaN is not within.
    let is_within = nearest > 1e-9 && farthest < 1.0;
    if !is_within {
        return None;
    }
    let sight = Sight::new(grid);
    let least_depth = if sight.constant_depth > 0.0 { 1.0 } else { nearest };
    let (columns, rows) = grid.size();
    let mut lows = vec![0.0_f64; rows as usize];
    let mut highs = vec![f64::from(columns - 1); rows as usize];
    let mut touching = surface.bounds().centre();
    let climber = walker.filter(|walker| walker.highest_vertex(sight.column).is_some());
    let sides = if climber.is_some() { CLIMBED_SIDES } else { SIDES };
    for side in 0..sides {
        let (sin, cos) = (std::f64::consts::TAU * side as f64 / sides as f64).sin_cos();
        let along = cos * sight.column + sin * sight.row;
        let most = match climber.and_then(|walker| sight.climb(walker, along, least_depth)) {
            Some(most) => most,
            None => sight.search(surface, walker, along, least_depth, &mut touching),
        };
        // Columns at which a row meets the side: those beyond miss.
        let (per_row, at_row_0) = (-sin / cos, most / cos);
        let at = |row: usize| at_row_0 + per_row * row as f64;
        if cos > 1e-9 {
            highs.iter_mut().enumerate().for_each(|(row, high)| *high = high.min(at(row)));
        } else if cos < -1e-9 {
            lows.iter_mut().enumerate().for_each(|(row, low)| *low = low.max(at(row)));
        } else {
            let is_beyond = |row: usize| sin * row as f64 > most;
            highs
                .iter_mut()
                .enumerate()
                .filter(|(row, _)| is_beyond(*row))
                .for_each(|(_, high)| *high = -1.0);
        }
    }
    let runs = lows.iter().zip(&highs);
    Some(runs.map(|(low, high)| low.ceil() as u32..(high.floor() + 1.0).max(low.ceil()) as u32).collect())
}
