//! The rays of an image in line space, where each row of pixels is a straight line.
//!
//! ```text
//!   A ray's intercepts are ratios of forms that are affine in column and row:       (s, t, u, v) = X(c, r) / w(c, r)
//!   with one denominator. What bounds a cell is a line in the image, and what         s ≥ a  ⇔  X_s − a·w ≥ 0
//!   lies in a cell a convex polygon: in each row, one run of pixels.
//! ```

use glam::DVec3;

use super::LineFrame;
use crate::geometry::{RayGrid, Region, Upstream};

/// An affine form of column and row: `at_origin + column · c + row · r`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelForm {
    at_origin: f64,
    column: f64,
    row: f64,
}

impl PixelForm {
    /// Its value at a place of the image, pixels.
    #[inline(always)]
    pub fn at(&self, column: f64, row: f64) -> f64 {
        self.at_origin + self.row * row + self.column * column
    }

    /// What it grows by from column to column.
    pub fn per_column(&self) -> f64 {
        self.column
    }

    /// `self + factor · other`.
    #[inline]
    pub fn plus(self, factor: f64, other: Self) -> Self {
        Self {
            at_origin: self.at_origin + factor * other.at_origin,
            column: self.column + factor * other.column,
            row: self.row + factor * other.row,
        }
    }

    /// `self + value`, the same for all pixels.
    pub fn plus_constant(self, value: f64) -> Self {
        Self { at_origin: self.at_origin + value, ..self }
    }

    fn scaled(self, factor: f64) -> Self {
        Self::default().plus(factor, self)
    }
}

/// The rays of an image as they are seen in a body's frame.
#[derive(Clone, Copy, Debug)]
pub struct ImageLines {
    /// From a ray's start to its end, in the frame, component by component.
    path: [PixelForm; 3],
    /// As `path`, in the world, mm.
    path_mm: [PixelForm; 3],
    /// Where rays start, in the frame.
    start: [PixelForm; 3],
}

/// Intercepts of an image's rays with the planes of one pair, as ratios.
#[derive(Clone, Copy, Debug)]
pub struct PlaneForms {
    /// Of s, t, u, v.
    pub numerators: [PixelForm; 4],
    /// Their common denominator, positive where the pair's axis is dominant.
    pub denominator: PixelForm,
}

impl ImageLines {
    /// The rays of `grid` in a frame.
    pub fn new(frame: &LineFrame, grid: &RayGrid) -> Self {
        let [columns, rows] = grid.steps();
        let form = |origin: DVec3, column: DVec3, row: DVec3| {
            [0, 1, 2].map(|a| PixelForm { at_origin: origin[a], column: column[a], row: row[a] })
        };
        let (of_columns, of_rows) = (frame.vector(columns), frame.vector(rows));
        match grid.upstream() {
            Upstream::Source(source) => {
                let path = grid.origin() - source;
                Self {
                    path: form(frame.vector(path), of_columns, of_rows),
                    path_mm: form(path, columns, rows),
                    start: form(frame.point(source), DVec3::ZERO, DVec3::ZERO),
                }
            }
            Upstream::Path(path) => Self {
                path: form(frame.vector(path), DVec3::ZERO, DVec3::ZERO),
                path_mm: form(path, DVec3::ZERO, DVec3::ZERO),
                start: form(frame.point(grid.origin() - path), of_columns, of_rows),
            },
        }
    }

    /// From a ray's start to its end, in the frame.
    pub fn path(&self) -> &[PixelForm; 3] {
        &self.path
    }

    /// From a ray's start to its end, mm.
    pub fn path_mm(&self) -> &[PixelForm; 3] {
        &self.path_mm
    }

    /// Where rays start, in the frame.
    pub fn start(&self) -> &[PixelForm; 3] {
        &self.start
    }

    /// The intercepts with the planes of the pair of `axis`, of rays that run along it (`sign` 1) or against it (−1).
    pub fn forms(&self, axis: usize, sign: f64) -> PlaneForms {
        let [k, i, j] = [axis, (axis + 1) % 3, (axis + 2) % 3];
        // At x_k = h the ray has x_i = o_i + (h − o_k)·d_i/d_k. Of o and d, one is the same for all rays, so that the
        // products are affine again.
        let across = |i: usize, plane: f64| {
            let (o, d) = (&self.start, &self.path);
            let is_cone = o[i].column == 0.0 && o[i].row == 0.0 && o[k].column == 0.0 && o[k].row == 0.0;
            if is_cone {
                d[k].scaled(o[i].at_origin).plus(plane - o[k].at_origin, d[i])
            } else {
                let to_plane = PixelForm { at_origin: plane, ..PixelForm::default() }.plus(-1.0, o[k]);
                o[i].scaled(d[k].at_origin).plus(d[i].at_origin, to_plane)
            }
        };
        let numerators = [across(i, 0.0), across(j, 0.0), across(i, 1.0), across(j, 1.0)];
        PlaneForms {
            numerators: numerators.map(|form| form.scaled(sign)),
            denominator: self.path[k].scaled(sign),
        }
    }

    /// Parts pixels by the axis along which their rays are dominant, and by its sign.
    pub fn by_dominant_axis(&self, pixels: &Runs, mut visit: impl FnMut(usize, f64, &Runs)) {
        let [x, y, z] = self.path;
        let parts = |pixels: &Runs, a: PixelForm, b: PixelForm, visit: &mut dyn FnMut(bool, f64, &Runs)| {
            // Where a ≥ |b|, a is dominant and positive, and so on around.
            pixels.cut(&a.plus(-1.0, b), |a_is_more, pixels| {
                pixels.cut(&a.plus(1.0, b), |sum_is_positive, pixels| match (a_is_more, sum_is_positive) {
                    (true, true) => visit(true, 1.0, pixels),
                    (false, false) => visit(true, -1.0, pixels),
                    (false, true) => visit(false, 1.0, pixels),
                    (true, false) => visit(false, -1.0, pixels),
                });
            });
        };
        parts(pixels, x, y, &mut |x_beats_y, sign, pixels| {
            let (form, axis) = if x_beats_y { (x, 0) } else { (y, 1) };
            pixels.cut(&form.scaled(sign).plus(-1.0, z), |beats_plus_z, pixels| {
                pixels.cut(&form.scaled(sign).plus(1.0, z), |beats_minus_z, pixels| {
                    match (beats_plus_z, beats_minus_z) {
                        (true, true) => visit(axis, sign, pixels),
                        (false, _) => visit(2, 1.0, pixels),
                        (true, false) => visit(2, -1.0, pixels),
                    }
                });
            });
        });
    }
}

/// The most rows that [`Runs`] hold.
pub const MOST_ROWS: usize = 64;

/// A set of pixels with one run in each row of a block.
#[derive(Clone, Debug)]
pub struct Runs {
    first_row: u32,
    rows: usize,
    starts: [i32; MOST_ROWS],
    ends: [i32; MOST_ROWS],
    /// Of the rectangle around all pixels: the first and the last column, then the first and the last row that has pixels.
    bounds: Option<[i32; 4]>,
}

impl Runs {
    /// The part of a region of at most [`MOST_ROWS`] rows that `run` keeps of each row.
    pub fn of_rows(region: &Region, run: impl Fn(u32) -> std::ops::Range<u32>) -> Self {
        let rows = region.rows.len().min(MOST_ROWS);
        let mut runs = Self {
            first_row: region.rows.start,
            rows,
            starts: [0; MOST_ROWS],
            ends: [0; MOST_ROWS],
            bounds: None,
        };
        for (i, row) in region.rows.clone().take(rows).enumerate() {
            let kept = run(row);
            let start = kept.start.clamp(region.columns.start, region.columns.end);
            runs.starts[i] = start as i32;
            runs.ends[i] = kept.end.clamp(start, region.columns.end) as i32;
        }
        runs.bounded()
    }

    /// Whether there are no pixels.
    pub fn is_empty(&self) -> bool {
        self.bounds.is_none()
    }

    /// The run of pixels of one of the region's rows.
    pub fn of_row(&self, row: u32) -> std::ops::Range<u32> {
        let i = (row - self.first_row) as usize;
        self.starts[i] as u32..self.ends[i] as u32
    }

    /// Each row's run of pixels that is not empty.
    pub fn iter(&self) -> impl Iterator<Item = (u32, std::ops::Range<u32>)> + '_ {
        let ends = self.starts.iter().zip(&self.ends).take(self.rows).enumerate();
        ends.filter(|(_, (start, end))| start < end)
            .map(|(i, (start, end))| (self.first_row + i as u32, *start as u32..*end as u32))
    }

    /// The same, with its rectangle found anew.
    fn bounded(mut self) -> Self {
        let (mut left, mut right, mut top, mut bottom) = (i32::MAX, i32::MIN, i32::MAX, i32::MIN);
        for (i, (&start, &end)) in (0..).zip(self.starts.iter().zip(&self.ends).take(self.rows)) {
            let is_empty = start >= end;
            left = left.min(if is_empty { i32::MAX } else { start });
            right = right.max(if is_empty { i32::MIN } else { end - 1 });
            top = top.min(if is_empty { i32::MAX } else { i });
            bottom = bottom.max(if is_empty { i32::MIN } else { i });
        }
        self.bounds = (left <= right).then_some([left, right, top, bottom]);
        self
    }

    /// Parts the pixels by whether `form` is at least 0 there, and visits the parts that are not empty: first those below.
    pub fn cut(&self, form: &PixelForm, mut visit: impl FnMut(bool, &Self)) {
        let Some([left, right, top, bottom]) = self.bounds else { return };
        let row = |i: i32| f64::from(self.first_row) + f64::from(i);
        let corners = [(left, top), (right, top), (left, bottom), (right, bottom)]
            .map(|(c, r)| form.at(f64::from(c), row(r)));
        if corners.iter().all(|&x| x >= 0.0) {
            return visit(true, self);
        }
        if corners.iter().all(|&x| x < 0.0) {
            return visit(false, self);
        }
        let (mut below, mut above) = (self.clone(), self.clone());
        if form.column == 0.0 {
            for i in 0..self.rows {
                let is_above = form.at(0.0, row(i as i32)) >= 0.0;
                let emptied = if is_above { &mut below } else { &mut above };
                emptied.ends[i] = emptied.starts[i];
            }
        } else {
            let inverse = -1.0 / form.column;
            let rises = form.column > 0.0;
            for i in 0..self.rows {
                let row = f64::from(self.first_row) + i as f64;
                let crossing = (form.at_origin + form.row * row) * inverse;
                // A cast keeps within the range of integers.
                let at =
                    if rises { crossing.ceil() as i32 } else { (crossing.floor() as i32).saturating_add(1) };
                let at = at.clamp(self.starts[i], self.ends[i].max(self.starts[i]));
                let (first, second) = if rises { (&mut below, &mut above) } else { (&mut above, &mut below) };
                first.ends[i] = at;
                second.starts[i] = at;
            }
        }
        for (side, part) in [(false, below.bounded()), (true, above.bounded())] {
            if !part.is_empty() {
                visit(side, &part);
            }
        }
    }
}
