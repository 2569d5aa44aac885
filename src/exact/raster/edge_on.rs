//! Rays in the plane of a face: the face is seen as a line, and covers nothing, yet a closed body counts the length in it.
//!
//! Such rays are few, and are left to the engine that can tell ([`bvh`](crate::exact::bvh)). A pixel within rounding of a
//! face that is edge-on within rounding is one of them; no more is claimed, as the answer is exact either way. So are the
//! pixels of faces all but edge-on, whose depth f64 cannot tell ([`careful`](super::face::Slope::careful)).

use super::pixels::Pixels;
use super::projection::Place;

/// A pixel whose ray may lie in a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct EdgeOn {
    pub row: i32,
    pub column: i32,
    pub face: u32,
}

/// Whether moves of its corners by `place_error` may account for all of a face's area.
#[inline(always)]
pub fn is_edge_on([a, b, c]: [Place; 3], place_error: f64) -> bool {
    let (x1, y1, x2, y2) = (b.x - a.x, b.y - a.y, c.x - a.x, c.y - a.y);
    let extent = x1.abs().max(x2.abs()) + y1.abs().max(y2.abs());
    // Written so that NaN is edge-on.
    let has_area = (x1 * y2 - x2 * y1).abs() > THICKNESS * place_error * extent;
    !has_area
}

/// By how much the area x₁y₂ − x₂y₁ may change as corners move by δ, in δ times both extents: each difference by 2δ, so the
/// area by 4. Three times that leaves room for the rounding of the area itself.
pub const THICKNESS: f64 = 12.0;

/// How near to an edge-on face a pixel may be on it, in place errors: the face is no higher than 24 over the longer of its
/// extents, and so within as much of the line between its outermost corners along that.
pub const NEAR: f64 = 64.0;

/// Adds the pixels of `bounds` whose centres lie within rounding of an edge-on face.
#[cold]
pub fn pixels_along(
    corners: [Place; 3],
    face: u32,
    place_error: f64,
    bounds: &Pixels,
    found: &mut Vec<EdgeOn>,
) {
    let near = NEAR * place_error;
    let [low_x, high_x] = extremes(corners, |p| p.x);
    let [low_y, high_y] = extremes(corners, |p| p.y);
    let runs_along_rows = high_x.x - low_x.x >= high_y.y - low_y.y;
    // (along, across) of the ends, and of the bounds.
    let (low, high) = if runs_along_rows {
        ((low_x.x, low_x.y), (high_x.x, high_x.y))
    } else {
        ((low_y.y, low_y.x), (high_y.y, high_y.x))
    };
    let (of_along, of_across) =
        if runs_along_rows { (&bounds.columns, &bounds.rows) } else { (&bounds.rows, &bounds.columns) };
    let slope = if high.0 > low.0 { (high.1 - low.1) / (high.0 - low.0) } else { 0.0 };
    // Saturating casts: a face far off the grid meets no pixel.
    let first = ((low.0 - near).ceil() as i32).max(of_along.start);
    let last = ((high.0 + near).floor() as i32).min(of_along.end - 1);
    for along in first..=last {
        let place = low.1 + (f64::from(along) - low.0) * slope;
        let across = place.round();
        if (place - across).abs() <= near && of_across.contains(&(across as i32)) {
            let across = across as i32;
            let (row, column) = if runs_along_rows { (across, along) } else { (along, across) };
            found.push(EdgeOn { row, column, face });
        }
    }
}

fn extremes([a, b, c]: [Place; 3], key: impl Fn(Place) -> f64) -> [Place; 2] {
    let pick = |p: Place, q: Place, later: bool| if (key(p) <= key(q)) == later { q } else { p };
    [pick(pick(a, b, false), c, false), pick(pick(a, b, true), c, true)]
}

/// Sorts pixels for [`is_listed`], each once.
pub fn sort(pixels: &mut Vec<EdgeOn>) {
    pixels.sort_unstable();
    pixels.dedup_by_key(|e| (e.row, e.column));
}

/// Whether a pixel is in a sorted list.
pub fn is_listed(pixels: &[EdgeOn], row: i32, column: i32) -> bool {
    pixels.binary_search_by_key(&(row, column), |e| (e.row, e.column)).is_ok()
}
