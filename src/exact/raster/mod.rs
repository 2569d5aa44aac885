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
//! Scan conversion with the usual fill rule (Pineda 1988, doi:10.1145/54852.378457), made exact as Shewchuk's adaptive
//! predicates are: by a float where that can tell, by an exact sign where it cannot.

mod cells;
mod edge_on;
mod face;
mod near;
mod projection;
mod round;

use std::borrow::Cow;

use cells::{CellSorter, Cells, Pixels};
use edge_on::{EdgeOn, is_edge_on, pixels_along};
use face::{Care, Edge, Slope, order};
use near::Cut;
use projection::{Place, Projection, Sight};

use super::bvh;
use super::record::{Record, Way};
use crate::geometry::numeric::gamma;
use crate::geometry::{ClosedMesh, RayGrid, Region, Upstream};

/// A closed surface made ready for the rays of one grid.
///
/// Crossings are exact for a surface whose vertices have moved by rounding: see [`place_error`](Projection::place_error).
/// What a ray meets does not depend on the region that it is asked in, to the last bit, nor does the order of its
/// crossings.
#[derive(Clone, Debug)]
pub struct RasterView<'a> {
    surface: &'a ClosedMesh,
    grid: RayGrid,
    form: Form<'a>,
}

#[derive(Clone, Debug)]
enum Form<'a> {
    /// No ray meets it.
    Unseen,
    /// So near to the source, or so large in the image, that rounding would be: each ray is traced by itself.
    RayByRay,
    Seen(Seen<'a>),
}

/// A surface in the image.
#[derive(Clone, Debug)]
struct Seen<'a> {
    projection: Projection,
    places: Vec<Place>,
    /// The ceilings of the places.
    ceilings: Vec<[i32; 2]>,
    corners: Cow<'a, [[u32; 3]]>,
    /// The faces' numbers in the surface, if they are not those of `corners`.
    numbers: Option<Vec<u32>>,
    /// The pixels that a face may cover.
    bounds: Pixels,
    cells: Cells,
    edge_on: Vec<EdgeOn>,
    source_is_inside: bool,
    crossing_error: f64,
    care: Care,
}

/// Nearer than this share of the way to the farthest point of a body, its nearest is cut off and faces are turned to
/// keep the digits of their depth. Any number will do.
const NEAR: f64 = 0.25;

/// Places that err by more than this, in pixels, are not used. They usually err by 1e-11.
const LARGEST_PLACE_ERROR: f64 = 1e-4;

impl<'a> RasterView<'a> {
    /// Projects `surface` onto `grid` and sorts its faces by where they are seen.
    pub fn new(surface: &'a ClosedMesh, grid: &RayGrid) -> Self {
        let form = Form::new(surface, grid);
        Self { surface, grid: *grid, form }
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
                    self.trace_ray(ray, [column, row], 0, record);
                }
            }
            Form::Seen(seen) => self.trace_faces(seen, region, record),
        }
    }

    /// Reports the crossings of a single ray by the engine for single rays.
    #[cold]
    fn trace_ray(&self, ray: usize, [column, row]: [u32; 2], face: u32, record: &mut impl Record) {
        let segment = self.grid.segment(column, row);
        let mut parts = Vec::new();
        bvh::chords(self.surface, segment.line(), &mut parts);
        for part in parts.iter().filter_map(|part| part.intersection(&segment.reach())) {
            record.crossing(ray, part.start(), face, Way::In);
            record.crossing(ray, part.end(), face, Way::Out);
        }
    }

    fn trace_faces(&self, seen: &Seen, region: &Region, record: &mut impl Record) {
        let asked = Pixels {
            columns: region.columns.start as i32..region.columns.end as i32,
            rows: region.rows.start as i32..region.rows.end as i32,
        };
        let mut tracer = Tracer { view: self, seen, asked: &asked, lengths: Vec::new() };
        let common = asked.intersection(&seen.bounds);
        for top in common.rows.clone().step_by(BLOCK_ROWS as usize) {
            for left in common.columns.clone().step_by(BLOCK_COLUMNS as usize) {
                let block = Pixels {
                    columns: left..(left + BLOCK_COLUMNS).min(common.columns.end),
                    rows: top..(top + BLOCK_ROWS).min(common.rows.end),
                };
                tracer.trace_block(&block, record);
            }
        }
    }
}

/// A region is traced in blocks whose lengths and sums stay in the cache.
const BLOCK_COLUMNS: i32 = 256;
const BLOCK_ROWS: i32 = 64;

impl<'a> Form<'a> {
    fn new(surface: &'a ClosedMesh, grid: &RayGrid) -> Self {
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
        seen.map_or(Self::RayByRay, Self::Seen)
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

impl<'a> Seen<'a> {
    /// A surface all of whose points have a place.
    fn plain(
        surface: &'a ClosedMesh,
        projection: Projection,
        sight: &Sight,
        window: &Pixels,
    ) -> Option<Self> {
        let extent = [sight.columns, sight.rows].as_flattened().iter().fold(0.0, |e: f64, x| e.max(x.abs()));
        let places =
            surface.mesh().vertices.iter().map(|&v| projection.place(projection.homogeneous(v))).collect();
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

    fn cut(surface: &'a ClosedMesh, grid: &RayGrid, projection: Projection, window: &Pixels) -> Option<Self> {
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
        shape: Shape<'a>,
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
        let ceilings: Vec<[i32; 2]> = places.iter().map(|p| [round::ceil(p.x), round::ceil(p.y)]).collect();
        let on_a_line = |x: f64| round::nearest(x).1.abs() <= 64.0 * errors.place;
        // A face without a pixel in its box meets none unless a corner lies on a line of pixels.
        let look_closely = places.iter().any(|p| on_a_line(p.x) || on_a_line(p.y));
        let mut bounds = Pixels { columns: i32::MAX..i32::MIN, rows: i32::MAX..i32::MIN };
        if source_is_inside {
            bounds = window.clone();
        } else {
            let mut add = |v: u32| {
                let [x, y] = ceilings[v as usize];
                bounds.columns = bounds.columns.start.min(x)..bounds.columns.end.max(x);
                bounds.rows = bounds.rows.start.min(y)..bounds.rows.end.max(y);
            };
            match numbers {
                // Every vertex of a closed surface has a face.
                None => (0..ceilings.len() as u32).for_each(&mut add),
                Some(_) => corners.iter().flatten().for_each(|&v| add(v)),
            }
            // A pixel on the outline may lie on an edge-on face.
            bounds = bounds.grown(1).intersection(window);
        }
        let mut edge_on = Vec::new();
        let mut sorter = CellSorter::new(bounds.clone(), corners.len());
        for (i, face) in corners.iter().enumerate() {
            let [a, b, c] = face.map(|v| ceilings[v as usize]);
            let low = [a[0].min(b[0]).min(c[0]), a[1].min(b[1]).min(c[1])];
            let high = [a[0].max(b[0]).max(c[0]), a[1].max(b[1]).max(c[1])];
            let start = [low[0].max(bounds.columns.start), low[1].max(bounds.rows.start)];
            let end = [high[0].min(bounds.columns.end), high[1].min(bounds.rows.end)];
            let is_empty = start[0] >= end[0] || start[1] >= end[1];
            if is_empty && !look_closely {
                continue;
            }
            let triangle = face.map(|v| places[v as usize]);
            if is_edge_on(triangle, errors.place) {
                let number = numbers.as_ref().map_or(i as u32, |n| n[i]);
                pixels_along(triangle, number, errors.place, window, &mut edge_on);
            }
            if !is_empty {
                sorter.add(i as u32, start, (end[0] - start[0]).max(end[1] - start[1]));
            }
        }
        edge_on.sort_unstable();
        edge_on.dedup_by_key(|e| (e.row, e.column));
        Some(Self {
            projection,
            places,
            ceilings,
            corners,
            numbers,
            bounds,
            cells: sorter.sort(),
            edge_on,
            source_is_inside,
            // A difference, a slope of three roundings, a product and a sum: γ₅ of twice the extent, and γ₁ of it.
            crossing_error: gamma(12) * errors.extent,
            care: Care { per_pixel: gamma(12) / errors.place, per_depth: 1.0 / errors.depth },
        })
    }
}

struct Shape<'a> {
    corners: Cow<'a, [[u32; 3]]>,
    numbers: Option<Vec<u32>>,
    places: Vec<Place>,
}

struct Errors {
    place: f64,
    extent: f64,
    depth: f64,
}

/// Traces the blocks of a region.
struct Tracer<'v, 'a> {
    view: &'v RasterView<'a>,
    seen: &'v Seen<'a>,
    asked: &'v Pixels,
    /// Of the rays of a block, mm.
    lengths: Vec<f64>,
}

/// Crossings reported at a time.
const RUN: usize = 64;

impl Tracer<'_, '_> {
    fn trace_block(&mut self, block: &Pixels, record: &mut impl Record) {
        self.measure_rays(block);
        let edge_on = self.edge_on_rays(block, record);
        if self.seen.source_is_inside {
            for row in block.rows.clone() {
                for column in block.columns.clone().filter(|&c| !is_listed(edge_on, row, c)) {
                    record.crossing(self.ray(row, column), 0.0, 0, Way::In);
                }
            }
        }
        let first = &self.seen.bounds;
        let (left, top) = (first.columns.start, first.rows.start);
        let region = Pixels {
            columns: block.columns.start - left..block.columns.end - left,
            rows: block.rows.start - top..block.rows.end - top,
        };
        let seen = self.seen;
        for faces in seen.cells.near(&region) {
            for &face in faces {
                if seen.projection.is_cone() {
                    self.trace_face::<true>(face, block, edge_on, record);
                } else {
                    self.trace_face::<false>(face, block, edge_on, record);
                }
            }
        }
    }

    /// The ray's number in the region asked for.
    #[inline(always)]
    fn ray(&self, row: i32, column: i32) -> usize {
        (row - self.asked.rows.start) as usize * self.asked.columns.len()
            + (column - self.asked.columns.start) as usize
    }

    fn measure_rays(&mut self, block: &Pixels) {
        self.lengths.clear();
        let grid = &self.view.grid;
        match grid.upstream() {
            Upstream::Path(path) => {
                self.lengths.resize(block.columns.len() * block.rows.len(), path.length());
            }
            Upstream::Source(source) => {
                for row in block.rows.clone() {
                    let length = |column: i32| (grid.point(column as u32, row as u32) - source).length();
                    self.lengths.extend(block.columns.clone().map(length));
                }
            }
        }
    }

    /// Traces the rays that may lie in a face, and lists them.
    fn edge_on_rays(&self, block: &Pixels, record: &mut impl Record) -> &[EdgeOn] {
        let all = &self.seen.edge_on;
        if all.is_empty() {
            return all;
        }
        let start = all.partition_point(|e| e.row < block.rows.start);
        let end = all.partition_point(|e| e.row < block.rows.end);
        let list = &all[start..end];
        for e in list.iter().filter(|e| block.columns.contains(&e.column)) {
            let ray = self.ray(e.row, e.column);
            self.view.trace_ray(ray, [e.column as u32, e.row as u32], e.face, record);
        }
        list
    }

    #[inline(always)]
    fn trace_face<const CONE: bool>(
        &self,
        face: u32,
        block: &Pixels,
        edge_on: &[EdgeOn],
        record: &mut impl Record,
    ) {
        let seen = self.seen;
        let corners = seen.corners[face as usize];
        let ceilings = corners.map(|v| seen.ceilings[v as usize]);
        let (order, is_even) = order(ceilings.map(|c| c[1]));
        let [low, mid, high] = order.map(|i| ceilings[i]);
        let rows = low[1].max(block.rows.start)..high[1].min(block.rows.end);
        let left = low[0].min(mid[0]).min(high[0]);
        let right = low[0].max(mid[0]).max(high[0]);
        if rows.is_empty() || left >= block.columns.end || right <= block.columns.start {
            return;
        }
        let places = corners.map(|v| seen.places[v as usize]);
        let [p, q, r] = order.map(|i| places[i]);
        let long = Edge::new(p, r);
        // Of the whole way, from the source to the pixel: shares from 0 to 1.
        let limits = if CONE { [1.0, f64::INFINITY] } else { [0.0, 1.0] };
        let slope = Slope::new(places, seen.care, limits);
        let number = seen.numbers.as_ref().map_or(face, |n| n[face as usize]);
        let is_right_out = is_even != seen.projection.is_mirrored();
        let turn = mid[1].clamp(rows.start, rows.end);
        for (short, rows) in [(Edge::new(p, q), rows.start..turn), (Edge::new(q, r), turn..rows.end)] {
            for row in rows {
                let by_long = long.first_right(row, seen.crossing_error);
                let by_short = short.first_right(row, seen.crossing_error);
                let columns = by_long.min(by_short).max(block.columns.start)
                    ..by_long.max(by_short).min(block.columns.end);
                if columns.is_empty() {
                    continue;
                }
                let way = if (by_long < by_short) == is_right_out { Way::Out } else { Way::In };
                let mut run = Run { tracer: self, block, slope: &slope, row, face: number, way };
                if edge_on.is_empty() {
                    run.report::<CONE>(columns, record);
                } else {
                    run.report_but::<CONE>(edge_on, columns, record);
                }
            }
        }
    }
}

/// Whether a pixel is in the list.
fn is_listed(edge_on: &[EdgeOn], row: i32, column: i32) -> bool {
    edge_on.binary_search_by_key(&(row, column), |e| (e.row, e.column)).is_ok()
}

/// Pixels of a row that a face covers.
struct Run<'t, 'v, 'a> {
    tracer: &'t Tracer<'v, 'a>,
    block: &'t Pixels,
    slope: &'t Slope,
    row: i32,
    face: u32,
    way: Way,
}

impl Run<'_, '_, '_> {
    #[inline(always)]
    fn report<const CONE: bool>(&mut self, columns: std::ops::Range<i32>, record: &mut impl Record) {
        let of_row = self.slope.row(self.row);
        let first = (self.row - self.block.rows.start) as usize * self.block.columns.len()
            + (columns.start - self.block.columns.start) as usize;
        let lengths = &self.tracer.lengths[first..first + columns.len()];
        let ray = self.tracer.ray(self.row, columns.start);
        let at = |column: i32, length: f64| {
            let depth = self.slope.depth(of_row, f64::from(column));
            if CONE { length / depth } else { length * depth }
        };
        if lengths.len() < 4 {
            for (i, &length) in lengths.iter().enumerate() {
                record.crossing(ray + i, at(columns.start + i as i32, length), self.face, self.way);
            }
            return;
        }
        let mut t_mm = [0.0; RUN];
        for (i, lengths) in lengths.chunks(RUN).enumerate() {
            let start = columns.start + (i * RUN) as i32;
            let t_mm = &mut t_mm[..lengths.len()];
            for (j, (t, &length)) in t_mm.iter_mut().zip(lengths).enumerate() {
                *t = at(start + j as i32, length);
            }
            record.run(ray + i * RUN, t_mm, self.face, self.way);
        }
    }

    /// All but the rays in the list.
    #[cold]
    fn report_but<const CONE: bool>(
        &mut self,
        edge_on: &[EdgeOn],
        columns: std::ops::Range<i32>,
        record: &mut impl Record,
    ) {
        let mut start = columns.start;
        let row = self.row;
        for column in columns.clone().filter(|&c| is_listed(edge_on, row, c)) {
            if start < column {
                self.report::<CONE>(start..column, record);
            }
            start = column + 1;
        }
        if start < columns.end {
            self.report::<CONE>(start..columns.end, record);
        }
    }
}

#[cfg(test)]
mod tests;
