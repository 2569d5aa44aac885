//! Walks for the rays of an image that start at one point: many rows abreast, column by column.
//!
//! ```text
//!             b        A ray from the source o passes the edge a–b on the inner side if its direction does the plane through
//!            ╱ ╲       o, a and b: if d · (a − o) × (b − o) > 0. The planes of the face that the last ray of a row went
//!       ────╱ × ╲───▷  through are held: whether the next one does too is three products, for as many rows at a time as
//!          a─────c     the machine's instructions take. If it does not, a step to the next face makes two planes more.
//! ```
//!
//! What is held changes no bit: a face that is surely pierced is the one that a walk finds, and where is the same quotient.
//! All else is left to the walk proper ([`Walker::pass_from`]), which begins where these got.

use glam::DVec3;
use pulp::Simd;

use super::abreast::{ABREAST, MOST_STEPS, ROUND};
use super::sets::{UNIT, note};
use super::{Face, Pass, STEEP, Seeds, Unsure, Walker};
use crate::exact::Record;
use crate::geometry::numeric::gamma;
use crate::geometry::{Interval, RayGrid, Region, Segment};

/// A number of each row.
pub(super) type OfRows = [f64; ABREAST];

const NONE: OfRows = [0.0; ABREAST];

/// No instructions handle more numbers side by side.
const LANES: usize = 8;

/// The rays of a region of an image from one source.
pub(super) struct ConeRays<'t, R, F> {
    pub walker: &'t Walker,
    pub grid: &'t RayGrid,
    pub source: DVec3,
    pub region: &'t Region,
    pub record: &'t mut R,
    /// Traces rays in doubt.
    pub other: F,
}

impl<R: Record, F: FnMut(usize, &Segment, &mut R)> pulp::WithSimd for ConeRays<'_, R, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let mut rows = Rows::new(self.walker, self.source);
        for top in self.region.rows.clone().step_by(ABREAST) {
            rows.begin(self.grid, top, (self.region.rows.end - top).min(ABREAST as u32) as usize);
            for column in self.region.columns.clone() {
                rows.aim(simd, self.grid, column);
                rows.find_faces(simd);
                self.report(&mut rows, top, column);
            }
        }
    }
}

impl<R: Record, F: FnMut(usize, &Segment, &mut R)> ConeRays<'_, R, F> {
    /// Reports the rays of a column.
    #[inline(always)]
    fn report(&mut self, rows: &mut Rows, top: u32, column: u32) {
        let width = self.region.columns.len();
        let first =
            (top - self.region.rows.start) as usize * width + (column - self.region.columns.start) as usize;
        for j in (0..rows.count).filter(|&j| !rows.passes_by[j]) {
            let (ray, length_mm) = (first + j * width, rows.lengths[j]);
            if let Some(pass) = rows.pass(j) {
                rows.has_missed[j] = false;
                note(self.record, ray, &pass, UNIT, length_mm);
                continue;
            }
            let answer = rows.pass_from_there(j);
            rows.has_missed[j] = answer == Ok(None);
            match answer {
                Ok(Some(pass)) => note(self.record, ray, &pass, UNIT, length_mm),
                Ok(None) => {}
                Err(Unsure) => (self.other)(ray, &self.grid.segment(column, top + j as u32), self.record),
            }
        }
    }
}

/// Rows, each with its ray of the column that is looked at, and the faces that its last one went through.
struct Rows<'w> {
    walker: &'w Walker,
    source: DVec3,
    /// Products greater than this, over the direction's |x| + |y| + |z|, are right, mm².
    sure: f64,
    count: usize,
    /// What the rows add to a column's first point.
    offsets: [OfRows; 3],
    /// From the source to the pixels' points.
    dirs: [OfRows; 3],
    lengths: OfRows,
    /// |x| + |y| + |z| of the directions.
    sizes: OfRows,
    entries: HeldFaces,
    exits: HeldFaces,
    /// Whether the row's rays have faces to begin with.
    has_faces: [bool; ABREAST],
    /// Whether the last ray missed: the next may pass by far enough to say so at once.
    has_missed: [bool; ABREAST],
    /// Whether this one does.
    passes_by: [bool; ABREAST],
}

impl<'w> Rows<'w> {
    #[inline(always)]
    fn new(walker: &'w Walker, source: DVec3) -> Self {
        // No vertex is seen farther off in the line's frame: see `LineView`. Its sides, times the longest component of the
        // direction, are these products, and in doubt below γ₆₄ of the square: the ends are then those of a walk to the
        // last bit. The products' own rounding, γ₈ of six times the square, is far less than the rest.
        let largest = 2.0 * ((source - walker.centre).abs().max_element() + walker.reach);
        Self {
            walker,
            source,
            sure: gamma(256) * largest * largest,
            count: 0,
            offsets: [NONE; 3],
            dirs: [NONE; 3],
            lengths: NONE,
            sizes: NONE,
            entries: HeldFaces::new(-1.0),
            exits: HeldFaces::new(1.0),
            has_faces: [false; ABREAST],
            has_missed: [true; ABREAST],
            passes_by: [false; ABREAST],
        }
    }

    /// Begins `count` rows from `top` on.
    #[inline(always)]
    fn begin(&mut self, grid: &RayGrid, top: u32, count: usize) {
        self.count = count;
        let [_, by_row] = grid.steps();
        for j in 0..ABREAST {
            let offset = (f64::from(top) + j as f64) * by_row;
            self.offsets.iter_mut().zip(offset.to_array()).for_each(|(of, x)| of[j] = x);
        }
        self.has_faces = [false; ABREAST];
        self.has_missed = [true; ABREAST];
    }

    /// Looks at the rays of a column: to the last bit as the grid has them.
    #[inline(always)]
    fn aim<S: Simd>(&mut self, simd: S, grid: &RayGrid, column: u32) {
        let [by_column, _] = grid.steps();
        let first = (grid.origin() + f64::from(column) * by_column).to_array();
        let source = self.source.to_array();
        for group in 0..self.count.next_multiple_of(LANES) / S::F64_LANES {
            let dir = [0, 1, 2].map(|axis| {
                let point =
                    simd.add_f64s(simd.splat_f64s(first[axis]), load(simd, &self.offsets[axis], group));
                simd.sub_f64s(point, simd.splat_f64s(source[axis]))
            });
            let [x, y, z] = dir.map(|x| simd.abs_f64s(x));
            store(simd, &mut self.sizes, group, simd.add_f64s(simd.add_f64s(x, y), z));
            store(simd, &mut self.lengths, group, simd.sqrt_f64s(dot(simd, dir, dir)));
            self.dirs.iter_mut().zip(dir).for_each(|(of, x)| store(simd, of, group, x));
        }
        self.pass_by();
    }

    /// Finds out which rays surely miss.
    #[inline(always)]
    fn pass_by(&mut self) {
        if !self.has_missed[..self.count].contains(&true) {
            self.passes_by = [false; ABREAST];
            return;
        }
        let mut beyond = NONE;
        self.walker.seeds.beyond(self.source, &self.dirs, &mut beyond);
        for (j, passes_by) in self.passes_by.iter_mut().enumerate() {
            *passes_by = self.has_missed[j] & (beyond[j] > 0.0);
        }
    }

    /// Finds the faces that rays go through, and where.
    #[inline(always)]
    fn find_faces<S: Simd>(&mut self, simd: S) {
        for j in 0..self.count {
            if !self.passes_by[j] && !self.has_faces[j] {
                self.begin_row(j);
            }
        }
        let Self { walker, source, dirs, sizes, passes_by, count, sure, entries, exits, .. } = self;
        let groups = count.next_multiple_of(LANES) / S::F64_LANES;
        for held in [entries, exits] {
            held.look(simd, groups, dirs, sizes, *sure);
            let mut walking = [0; ABREAST];
            let mut left = 0;
            for j in 0..*count {
                // Branches would not be foreseen.
                walking[left] = j as u8;
                left += usize::from((held.margins[j] <= 0.0) & !passes_by[j]);
            }
            for &j in &walking[..left] {
                let j = j as usize % ABREAST;
                held.walk(walker, *source, j, dir_of(dirs, j), *sure * sizes[j]);
            }
            held.cross(simd, groups, dirs, sizes);
        }
    }

    /// Stands on faces by the table.
    #[inline(never)]
    fn begin_row(&mut self, j: usize) {
        match self.walker.seeds.near(self.source, dir_of(&self.dirs, j)) {
            None => self.passes_by[j] = true,
            Some(Seeds { entry, exit }) => {
                self.has_faces[j] = true;
                for (held, face) in [(&mut self.entries, entry), (&mut self.exits, exit)] {
                    let footing = Footing::new(self.walker, self.source, face, held.sign);
                    held.stand_on(self.walker, self.source, j, &footing);
                }
            }
        }
    }

    /// The way of a row's ray through the body, if both faces are surely pierced.
    #[inline(always)]
    fn pass(&self, j: usize) -> Option<Pass> {
        let (entries, exits) = (&self.entries, &self.exits);
        if !((entries.margins[j] > 0.0) & (exits.margins[j] > 0.0)) {
            return None;
        }
        let chord = Interval::new(entries.crossings[j], exits.crossings[j])?;
        Some(Pass { chord, entry_face: entries.half_edges[j] / 4, exit_face: exits.half_edges[j] / 4 })
    }

    /// The same by the walk proper, from the faces that were reached.
    #[cold]
    #[inline(never)]
    fn pass_from_there(&self, j: usize) -> Result<Option<Pass>, Unsure> {
        let mut seeds = Seeds { entry: self.entries.half_edges[j] / 4, exit: self.exits.half_edges[j] / 4 };
        self.walker.pass_from(self.source, dir_of(&self.dirs, j), &mut seeds)
    }
}

/// The faces that rays go through in one way, one of each row.
struct HeldFaces {
    /// −1 if rays enter through them, 1 if they leave.
    sign: f64,
    /// 4 · face + the edge that planes are counted from.
    half_edges: [u32; ABREAST],
    /// Normals, inward, of the planes through the source and each edge, by edge and axis.
    sides: [[OfRows; 3]; 3],
    normals: [OfRows; 3],
    /// Of the faces' planes over the source, mm.
    heights: OfRows,
    /// Those of the rays' directions with the normals of the sides.
    products: [OfRows; 3],
    /// Positive where the face is surely pierced, and not seen nearly edge-on.
    margins: OfRows,
    /// Where rays go through the faces' planes, in the unit of their directions.
    crossings: OfRows,
}

impl HeldFaces {
    fn new(sign: f64) -> Self {
        Self {
            sign,
            half_edges: [0; ABREAST],
            sides: [[NONE; 3]; 3],
            normals: [NONE; 3],
            heights: NONE,
            products: [NONE; 3],
            margins: NONE,
            crossings: NONE,
        }
    }

    /// Finds out which faces are pierced.
    #[inline(always)]
    fn look<S: Simd>(&mut self, simd: S, groups: usize, dirs: &[OfRows; 3], sizes: &OfRows, sure: f64) {
        for group in 0..groups {
            let dir = load_vector(simd, dirs, group);
            let [first, second, third] =
                self.sides.each_ref().map(|side| dot(simd, load_vector(simd, side, group), dir));
            let least = simd.min_f64s(simd.min_f64s(first, second), third);
            let doubt = simd.mul_f64s(simd.splat_f64s(sure), load(simd, sizes, group));
            store(simd, &mut self.margins, group, simd.sub_f64s(least, doubt));
            let products = self.products.iter_mut().zip([first, second, third]);
            products.for_each(|(of, product)| store(simd, of, group, product));
        }
    }

    /// Finds out where.
    #[inline(always)]
    fn cross<S: Simd>(&mut self, simd: S, groups: usize, dirs: &[OfRows; 3], sizes: &OfRows) {
        for group in 0..groups {
            let slope = dot(simd, load_vector(simd, &self.normals, group), load_vector(simd, dirs, group));
            let crossing = simd.div_f64s(load(simd, &self.heights, group), slope);
            store(simd, &mut self.crossings, group, crossing);
            let steep = simd.mul_f64s(simd.splat_f64s(STEEP), load(simd, sizes, group));
            let over = simd.sub_f64s(simd.mul_f64s(slope, simd.splat_f64s(self.sign)), steep);
            let margin = simd.min_f64s(load(simd, &self.margins, group), over);
            store(simd, &mut self.margins, group, margin);
        }
    }

    /// Walks to the face that a row's ray surely pierces; at the outline, and where that is in doubt, it stays where it is.
    #[inline(always)]
    fn walk(&mut self, walker: &Walker, source: DVec3, j: usize, dir: DVec3, sure: f64) {
        let mut at = Footing {
            half_edge: self.half_edges[j],
            corners: corners_from(walker, source, self.half_edges[j]),
            sides: self.sides.each_ref().map(|side| dir_of(side, j)),
        };
        let mut products = self.products.each_ref().map(|of| of[j]);
        for _ in 0..MOST_STEPS {
            let edge = least_of(products);
            if products[edge] > -sure {
                break;
            }
            let next = at.beyond(walker, source, edge, self.sign);
            products = next.sides.map(|side| side.dot(dir));
            let is_on = products[0] + products[1] + products[2] > 0.0;
            if !is_on {
                break;
            }
            at = next;
        }
        self.stand_on(walker, source, j, &at);
        self.margins[j] = products[least_of(products)] - sure;
    }

    /// Holds the face for a row.
    #[inline(always)]
    fn stand_on(&mut self, walker: &Walker, source: DVec3, j: usize, at: &Footing) {
        let Face { corners, normal, .. } = walker.faces[at.half_edge as usize / 4];
        self.half_edges[j] = at.half_edge;
        for (of_side, side) in self.sides.iter_mut().zip(at.sides) {
            of_side.iter_mut().zip(side.to_array()).for_each(|(of, x)| of[j] = x);
        }
        self.normals.iter_mut().zip(normal.to_array()).for_each(|(of, x)| of[j] = x);
        self.heights[j] = normal.dot(walker.vertices[corners[0] as usize] - source);
    }
}

/// A face that a walk has come to.
#[derive(Clone, Copy)]
struct Footing {
    /// 4 · face + the edge that corners and sides are counted from.
    half_edge: u32,
    /// From the source, mm.
    corners: [DVec3; 3],
    /// As of [`HeldFaces`].
    sides: [DVec3; 3],
}

impl Footing {
    fn new(walker: &Walker, source: DVec3, face: u32, sign: f64) -> Self {
        let corners = corners_from(walker, source, 4 * face);
        let [a, b, c] = corners;
        let sides = [a.cross(b), b.cross(c), c.cross(a)].map(|side| sign * side);
        Self { half_edge: 4 * face, corners, sides }
    }

    /// The face beyond an edge, counted from that.
    #[inline(always)]
    fn beyond(&self, walker: &Walker, source: DVec3, edge: usize, sign: f64) -> Self {
        let Face { twins, apexes, .. } = &walker.faces[self.half_edge as usize / 4];
        let edge_of_face = ROUND[(self.half_edge as usize % 4 + edge).min(4)];
        let apex = walker.vertices[apexes[edge_of_face] as usize] - source;
        let (a, b) = (self.corners[ROUND[edge + 1]], self.corners[edge]);
        Self {
            half_edge: twins[edge_of_face],
            corners: [a, b, apex],
            sides: [-self.sides[edge], sign * b.cross(apex), sign * apex.cross(a)],
        }
    }
}

/// The corners of a face from the source, mm, counted from an edge.
#[inline(always)]
fn corners_from(walker: &Walker, source: DVec3, half_edge: u32) -> [DVec3; 3] {
    let corners = walker.faces[half_edge as usize / 4].corners;
    let first = half_edge as usize % 4;
    [0, 1, 2].map(|i| walker.vertices[corners[ROUND[(first + i).min(4)]] as usize] - source)
}

/// Which of three is the least.
#[inline(always)]
fn least_of([s0, s1, s2]: [f64; 3]) -> usize {
    if s0 <= s1 && s0 <= s2 { 0 } else { 1 + usize::from(s2 < s1) }
}

/// The vector of a row.
#[inline(always)]
fn dir_of(vectors: &[OfRows; 3], j: usize) -> DVec3 {
    DVec3::new(vectors[0][j], vectors[1][j], vectors[2][j])
}

#[inline(always)]
fn load<S: Simd>(_: S, of_rows: &OfRows, group: usize) -> S::f64s {
    S::as_simd_f64s(of_rows).0[group]
}

#[inline(always)]
fn load_vector<S: Simd>(simd: S, vectors: &[OfRows; 3], group: usize) -> [S::f64s; 3] {
    vectors.each_ref().map(|of_rows| load(simd, of_rows, group))
}

#[inline(always)]
fn store<S: Simd>(_: S, of_rows: &mut OfRows, group: usize, values: S::f64s) {
    S::as_mut_simd_f64s(of_rows).0[group] = values;
}

/// The products of vectors, summed as those of one are.
#[inline(always)]
fn dot<S: Simd>(simd: S, [ax, ay, az]: [S::f64s; 3], [bx, by, bz]: [S::f64s; 3]) -> S::f64s {
    let of_two = simd.add_f64s(simd.mul_f64s(ax, bx), simd.mul_f64s(ay, by));
    simd.add_f64s(of_two, simd.mul_f64s(az, bz))
}
