//! All crossings of an image's rays with a closed surface, face by face.
//!
//! ```text
//!   source ◁┈┈┈┈┈ vertices are seen at columns and rows ┈┈┈┈▷ image
//!
//!        ·   ·   ·   ·   ·        Each face covers the pixel centres within its outline; a centre on an edge or a
//!        ·  ╱▔▔▔╲    ·   ·        vertex is given to one of the faces there, by exact signs.
//!        · ╱ ●   ●╲  ·   ·        Where it is covered, the ray goes through: in or out, as the face is wound,
//!        ·▕▁▁●▁▁▁●▁▁╲▁·  ·        at a depth that is affine over the face.
//! ```
//!
//! A vertex is rounded once, for all its faces, and what they cover is exact for its rounded place: a closed surface is
//! seen as a closed complex of triangles, so that every ray goes in as often as out, whatever the pixels hit.
//!
//! Faces that lie together are seen as a patch (`patches`), or passed over as a whole. Crossings are reported one by one
//! (`crossings`), unless the body is convex and nobody asks for faces: a length is one quotient of a pixel's two depths then.
//! Where faces are small, those are kept by pixel (`chords`, `small`); where they are large, rows are cut where a face ends
//! (`stretches`).
//!
//! Scan conversion with the usual fill rule (Pineda 1988, doi:10.1145/54852.378457), made exact as Shewchuk's adaptive
//! predicates are: by a float where that can tell, by an exact sign where it cannot.

mod aspect;
mod chords;
mod crossings;
mod edge_on;
mod face;
mod near;
mod patches;
mod pixels;
mod projection;
mod rows;
mod seen;
mod small;
mod stretches;
mod tracer;
mod workspace;

use std::borrow::Cow;

pub use patches::Patches;
use pixels::Pixels;
use projection::{Projection, Sight};
use seen::Seen;
use tracer::Tracer;
use workspace::Workspaces;

use super::bvh;
use super::record::Record;
use super::round;
use crate::geometry::{Bounds, ClosedMesh, RayGrid, Region};

/// A closed surface made ready for the rays of one grid.
///
/// Crossings are exact for a surface whose vertices have moved by rounding: by γ₉₆ of the distance to the source, in pixels,
/// over the share of the way they are at (`projection::Projection::place_error`); and crossings by as much along the ray.
/// What a ray meets does not depend on the region that it is asked in, to the last bit, nor does the order of its
/// crossings.
#[derive(Clone, Debug)]
pub struct RasterView<'a> {
    surface: &'a ClosedMesh,
    grid: RayGrid,
    form: Form<'a>,
    is_convex: bool,
    workspaces: Workspaces,
}

#[derive(Clone, Debug)]
enum Form<'a> {
    /// No ray meets it.
    Unseen,
    /// So near to the source, or so large in the image, that rounding would be: each ray is traced by itself.
    RayByRay,
    Seen(Box<Seen<'a>>),
}

/// Nearer than this share of the way to the farthest point of a body, its nearest is cut off and faces are turned to
/// keep the digits of their depth. Any number will do.
const NEAR: f64 = 0.25;

impl<'a> RasterView<'a> {
    /// Makes `surface` ready for `grid`.
    pub fn new(surface: &'a ClosedMesh, grid: &RayGrid) -> Self {
        let form = Form::new(surface, grid, || Cow::Owned(Patches::new(surface)));
        Self { surface, grid: *grid, form, is_convex: false, workspaces: Workspaces::default() }
    }

    /// As [`new`](Self::new), with the surface's patches at hand.
    pub fn of_patches(surface: &'a ClosedMesh, patches: &'a Patches, grid: &RayGrid) -> Self {
        let form = Form::new(surface, grid, || Cow::Borrowed(patches));
        Self { surface, grid: *grid, form, is_convex: false, workspaces: Workspaces::default() }
    }

    /// The same for a surface that is convex but for rounding: its rays go in and out once, which is quicker
    /// where faces are small.
    /// Lengths may then differ in the last bits from those beside [`Pierced`](super::Pierced) faces.
    pub fn as_convex(self) -> Self {
        Self { is_convex: true, ..self }
    }

    /// Reports every crossing of every ray of `region`; rays are numbered in its order. Crossings are mm from the ray's source,
    /// and cut to the ray's way from there to the pixel.
    ///
    /// A source inside the body has no face: it is reported as an entry through face 0.
    pub fn trace(&self, region: &Region, record: &mut impl Record) {
        match &self.form {
            Form::Unseen => {}
            Form::RayByRay => {
                for (ray, (column, row)) in region.places().enumerate() {
                    self.trace_ray(ray, [column, row], record);
                }
            }
            Form::Seen(seen) => Tracer::new(self, seen, region).trace(record),
        }
    }

    /// Reports the crossings of a single ray by the engine for single rays.
    #[cold]
    fn trace_ray(&self, ray: usize, [column, row]: [u32; 2], record: &mut impl Record) {
        bvh::trace(self.surface, ray, &self.grid.segment(column, row), record);
    }
}

impl<'a> Form<'a> {
    fn new(surface: &ClosedMesh, grid: &RayGrid, patches: impl FnOnce() -> Cow<'a, Patches>) -> Self {
        let (columns, rows) = grid.size();
        if f64::from(columns.max(rows)) > round::LARGEST {
            return Self::RayByRay;
        }
        let window = Pixels { columns: 0..columns as i32, rows: 0..rows as i32 };
        let projection = Projection::new(grid);
        let sight = projection.sight(&surface.bounds());
        let [least, greatest] = sight.shares;
        if !least.is_finite() || !greatest.is_finite() {
            return Self::RayByRay;
        }
        let is_plain = !projection.is_cone() || least > NEAR * greatest;
        let is_out_of_reach = greatest < -SHARE_MARGIN || least > 1.0 + SHARE_MARGIN;
        if is_out_of_reach || is_plain && is_off(&sight, &window) {
            return Self::Unseen;
        }
        let seen = if is_plain {
            Seen::plain(surface, patches(), projection, &sight, &window)
        } else {
            Seen::cut(surface, grid, projection, &window)
        };
        seen.map_or(Self::RayByRay, |seen| Self::Seen(Box::new(seen)))
    }
}

/// How many pixels of `grid` lie in the rectangle in which a body of these bounds is seen: all, if it reaches behind the source.
pub fn pixels_around(bounds: &Bounds, grid: &RayGrid) -> u64 {
    let projection = Projection::new(grid);
    let sight = projection.sight(bounds);
    let (columns, rows) = grid.size();
    if projection.is_cone() && sight.shares[0] <= 0.0 {
        return u64::from(columns) * u64::from(rows);
    }
    let within = |[low, high]: [f64; 2], count: u32| {
        let end = f64::from(count);
        (high.ceil().clamp(0.0, end) - low.ceil().clamp(0.0, end)) as u64
    };
    within(sight.columns, columns) * within(sight.rows, rows)
}

/// How far before the source or behind the pixels a body surely has no part in any ray: far above any rounding.
const SHARE_MARGIN: f64 = 1e-6;

/// Whether a body with these extremes is seen off the window, with a pixel to spare for rounding.
fn is_off(sight: &Sight, window: &Pixels) -> bool {
    let apart = |[low, high]: [f64; 2], range: &std::ops::Range<i32>| {
        high < f64::from(range.start) - 1.0 || low > f64::from(range.end)
    };
    apart(sight.columns, &window.columns) || apart(sight.rows, &window.rows)
}

#[cfg(test)]
mod tests;
