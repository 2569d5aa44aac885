//! The pixels at which a body may be seen: those within a polygon around its outline.
//!
//! Each side of the polygon is a plane through the source that no vertex is beyond; found in a few steps (Dinkelbach 1967,
//! doi:10.1287/mnsc.13.7.492), each to the vertex that is farthest beyond the last.

use std::ops::Range;

use glam::DVec3;

use crate::exact::walk::Walker;
use crate::geometry::{ClosedMesh, RayGrid, Upstream};

/// Sides of the polygon. A regular one of 24 sides is 0.6 % larger than the ellipse in it.
const SIDES: usize = 24;

/// Vertices that are looked up before any is searched for.
const GUESSES: usize = 3;

/// Sides may lie so far out, pixels; no closer search is made.
const SLACK_PIXELS: f64 = 0.25;

/// More than rounding can put a vertex off its place, pixels.
const ROUNDING_PIXELS: f64 = 1e-6;

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
    for side in 0..SIDES {
        let (sin, cos) = (std::f64::consts::TAU * side as f64 / SIDES as f64).sin_cos();
        let along = cos * sight.column + sin * sight.row;
        let slack = SLACK_PIXELS * least_depth;
        let mut most = sight.place(touching, along);
        for walker in walker.iter().flat_map(|walker| [walker; GUESSES]) {
            most = most.max(sight.place(walker.vertex_towards(along - most * sight.depth), along));
        }
        loop {
            let normal = along - most * sight.depth;
            let base = most * sight.constant_depth;
            let (bound, vertex) = surface.height_bound(normal, sight.from, base, slack);
            match vertex.filter(|_| bound - base > 2.0 * slack) {
                Some(vertex) => {
                    touching = vertex;
                    most = sight.place(vertex, along).max(most);
                }
                None => {
                    most += (bound - base) / least_depth + ROUNDING_PIXELS;
                    break;
                }
            }
        }
        for row in 0..rows {
            let at = (most - sin * f64::from(row)) / cos;
            let i = row as usize;
            if cos > 1e-9 {
                highs[i] = highs[i].min(at);
            } else if cos < -1e-9 {
                lows[i] = lows[i].max(at);
            } else if sin * f64::from(row) > most {
                highs[i] = -1.0;
            }
        }
    }
    let runs = lows.iter().zip(&highs);
    Some(runs.map(|(low, high)| low.ceil() as u32..(high.floor() + 1.0).max(low.ceil()) as u32).collect())
}
