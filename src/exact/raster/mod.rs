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
//! Where a convex body's faces are small, only the two depths of a pixel are kept, and its length is one quotient
//! (`chords`).
//!
//! Scan conversion with the usual fill rule (Pineda 1988, doi:10.1145/54852.378457), made exact as Shewchuk's adaptive
//! predicates are: by a float where that can tell, by an exact sign where it cannot.

mod cells;
mod chords;
mod edge_on;
mod face;
mod near;
mod projection;
mod round;
mod tracer;

use std::borrow::Cow;

use glam::DVec3;
use rayon::prelude::*;

use cells::{CellFace, CellSorter, Cells, Pixels};
use edge_on::{EdgeOn, is_edge_on, pixels_along};
use face::Care;
use near::Cut;
use projection::{Place, Projection, Sight};
use tracer::Tracer;

use super::bvh;
use super::record::Record;
use crate::geometry::numeric::gamma;
use crate::geometry::{ClosedMesh, RayGrid, Region, Upstream};

/// A closed surface made ready for the rays of one grid.
///
/// Crossings are exact for a surface whose vertices have moved by rounding: by γ₉₆ of the distance to the source, in pixels,
/// over the share of the way they are at (`projection::Projection::place_error`).
/// What a ray meets does not depend on the region that it is asked in, to the last bit, nor does the order of its
/// crossings.
#[derive(Clone, Debug)]
pub struct RasterView<'a> {
    surface: &'a ClosedMesh,
    grid: RayGrid,
    form: Form,
    is_convex: bool,
}

#[derive(Clone, Debug)]
enum Form {
    /// No ray meets it.
    Unseen,
    /// So near to the source, or so large in the image, that rounding would be: each ray is traced by itself.
    RayByRay,
    Seen(Box<Seen>),
}

/// A surface in the image.
#[derive(Clone, Debug)]
struct Seen {
    projection: Projection,
    places: Vec<Place>,
    /// The pixels that a face may cover.
    bounds: Pixels,
    /// Of each job's faces, in their order.
    cells: Vec<Cells>,
    /// The pixels on edge-on faces, in order. `None` if they are to be found in passing.
    edge_on: Option<Vec<EdgeOn>>,
    source_is_inside: bool,
    /// Whether faces cover few pixels each, and the source is not inside: see `chords`.
    is_fine: bool,
    crossing_error: f64,
    place_error: f64,
    care: Care,
}

/// Nearer than this share of the way to the farthest point of a body, its nearest is cut off and faces are turned to
/// keep the digits of their depth. Any number will do.
const NEAR: f64 = 0.25;

/// Fewer are projected sooner than another thread would have begun.
const VERTICES_PER_JOB: usize = 4096;

/// Faces sorted by one thread at a time: those of a job are looked up together, and their list stays in the cache.
const FACES_PER_JOB: usize = 4096;

/// Blocks look into the cells of each job, so there are no more.
const MOST_JOBS: usize = 32;

/// Places that err by more than this, in pixels, are not used. They usually err by 1e-11.
const LARGEST_PLACE_ERROR: f64 = 1e-4;

impl<'a> RasterView<'a> {
    /// Projects `surface` onto `grid` and sorts its faces by where they are seen.
    pub fn new(surface: &'a ClosedMesh, grid: &RayGrid) -> Self {
        let form = Form::new(surface, grid);
        Self { surface, grid: *grid, form, is_convex: false }
    }

    /// As [`new`](Self::new), for a surface that is convex but for rounding: its rays go in and out once, which is quicker
    /// where faces are small. Lengths may then differ in the last bits from those beside [`Pierced`](super::Pierced) faces.
    pub fn of_convex(surface: &'a ClosedMesh, grid: &RayGrid) -> Self {
        Self { is_convex: true, ..Self::new(surface, grid) }
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

impl Form {
    fn new(surface: &ClosedMesh, grid: &RayGrid) -> Self {
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
            Seen::plain(surface, projection, &sight, &window)
        } else {
            Seen::cut(surface, grid, projection, &window)
        };
        seen.map_or(Self::RayByRay, |seen| Self::Seen(Box::new(seen)))
    }
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

impl Seen {
    /// A surface all of whose points have a place.
    fn plain(surface: &ClosedMesh, projection: Projection, sight: &Sight, window: &Pixels) -> Option<Self> {
        let extent = [sight.columns, sight.rows].as_flattened().iter().fold(0.0, |e: f64, x| e.max(x.abs()));
        let place = |&vertex: &DVec3| projection.place(projection.homogeneous(vertex));
        let vertices = &surface.mesh().vertices;
        let places = vertices.par_iter().with_min_len(VERTICES_PER_JOB).map(place).collect();
        let error = projection.place_error(&surface.bounds(), sight.shares[0], 1.0 + extent);
        // A crossing may not be off by more than one part in as many of its depth.
        let depth = if projection.is_cone() {
            1.0 / sight.shares[1]
        } else {
            sight.shares[0].abs().max(sight.shares[1].abs())
        };
        let shape = Shape { corners: Cow::Borrowed(&surface.mesh().faces), numbers: None, places };
        Self::new(projection, shape, Errors { place: error, extent: 1.0 + extent, depth }, false, window)
    }

    fn cut(surface: &ClosedMesh, grid: &RayGrid, projection: Projection, window: &Pixels) -> Option<Self> {
        let Upstream::Source(source) = grid.upstream() else { return None };
        let Cut { places, corners, numbers, source_is_inside, share } =
            Cut::new(surface, grid, &projection, source)?;
        let used = || corners.iter().flatten().map(|&v| places[v as usize]);
        let extent = used().fold(1.0, |e: f64, p| e.max(p.x.abs()).max(p.y.abs()));
        let depth = used().fold(f64::INFINITY, |least, p| least.min(p.depth));
        let error = projection.place_error(&surface.bounds(), share, extent);
        let shape = Shape { corners: Cow::Owned(corners), numbers: Some(numbers), places };
        Self::new(projection, shape, Errors { place: error, extent, depth }, source_is_inside, window)
    }

    fn new(
        projection: Projection,
        shape: Shape,
        errors: Errors,
        source_is_inside: bool,
        window: &Pixels,
    ) -> Option<Self> {
        // Written so that NaN is not sound.
        let is_sound = errors.place < LARGEST_PLACE_ERROR && errors.extent < round::LARGEST;
        if !is_sound {
            return None;
        }
        let Shape { corners, numbers, places } = shape;
        let ceiling = |p: &Place| [round::ceil(p.x), round::ceil(p.y)];
        let ceilings: Vec<[i32; 2]> = places.par_iter().with_min_len(VERTICES_PER_JOB).map(ceiling).collect();
        let on_a_line = |x: f64| round::nearest(x).1.abs() <= 2.0 * edge_on::NEAR * errors.place;
        // A face that lies on a pixel has it in its box, unless a corner lies on a line of pixels; then all faces are looked
        // at, and not only those that may cover pixels when they are traced.
        let is_on_a_line = |p: &Place| on_a_line(p.x) || on_a_line(p.y);
        let look_closely = places.par_iter().with_min_len(VERTICES_PER_JOB).any(is_on_a_line);
        let per_job = (corners.len() / MOST_JOBS).max(FACES_PER_JOB);
        let sort = |(job, faces): (usize, &[[u32; 3]])| {
            let number = |i: usize| {
                let i = job * per_job + i;
                numbers.as_ref().map_or(i as u32, |n| n[i])
            };
            let mut sorted = SortedFaces::new(faces, number, &ceilings, window);
            if look_closely {
                for (i, face) in faces.iter().enumerate() {
                    let triangle = face.map(|v| places[v as usize]);
                    if is_edge_on(triangle, errors.place) {
                        pixels_along(triangle, number(i), errors.place, window, &mut sorted.edge_on);
                    }
                }
            }
            sorted
        };
        let sorted: Vec<SortedFaces> = corners.par_chunks(per_job).enumerate().map(sort).collect();
        let around = sorted.iter().fold(Pixels::NONE, |all, part| all.union(&part.around));
        // A pixel on the outline may lie on an edge-on face.
        let bounds = if source_is_inside { window.clone() } else { around.grown(1).intersection(window) };
        let mut edge_on: Vec<EdgeOn> = sorted.iter().flat_map(|part| &part.edge_on).copied().collect();
        edge_on::sort(&mut edge_on);
        let pixels = bounds.columns.len() * bounds.rows.len();
        Some(Self {
            is_fine: !source_is_inside && pixels <= chords::MOST_PIXELS * corners.len(),
            projection,
            places,
            bounds,
            cells: sorted.into_iter().map(|part| part.cells).collect(),
            edge_on: look_closely.then_some(edge_on),
            source_is_inside,
            // A difference, a slope of three roundings, a product and a sum: γ₅ of twice the extent, and γ₁ of it.
            crossing_error: gamma(12) * errors.extent,
            place_error: errors.place,
            care: Care::new(errors.place, errors.depth),
        })
    }
}

/// Some of a surface's faces, sorted by where they are seen.
struct SortedFaces {
    cells: Cells,
    /// Pixels on edge-on faces, in no order.
    edge_on: Vec<EdgeOn>,
    /// All columns and rows that corners are seen in, also off the window.
    around: Pixels,
}

impl SortedFaces {
    fn new(
        faces: &[[u32; 3]],
        number: impl Fn(usize) -> u32,
        ceilings: &[[i32; 2]],
        window: &Pixels,
    ) -> Self {
        let mut sorter = CellSorter::new(faces.len());
        let mut around = Pixels::NONE;
        for (i, face) in faces.iter().enumerate() {
            let [a, b, c] = face.map(|v| ceilings[v as usize]);
            let low = [a[0].min(b[0]).min(c[0]), a[1].min(b[1]).min(c[1])];
            let high = [a[0].max(b[0]).max(c[0]), a[1].max(b[1]).max(c[1])];
            around = around.union(&Pixels { columns: low[0]..high[0], rows: low[1]..high[1] });
            let start = [low[0].max(window.columns.start), low[1].max(window.rows.start)];
            let end = [high[0].min(window.columns.end), high[1].min(window.rows.end)];
            if start[0] < end[0] && start[1] < end[1] {
                sorter.add(CellFace { number: number(i), corners: *face }, start, end);
            }
        }
        Self { cells: sorter.sort(), edge_on: Vec::new(), around }
    }
}

/// A surface as it is seen.
struct Shape<'a> {
    corners: Cow<'a, [[u32; 3]]>,
    /// The faces' numbers in the surface, if they are not those of `corners`.
    numbers: Option<Vec<u32>>,
    places: Vec<Place>,
}

struct Errors {
    place: f64,
    extent: f64,
    depth: f64,
}

#[cfg(test)]
mod tests;
