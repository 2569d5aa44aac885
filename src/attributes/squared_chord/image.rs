//! The chords of an image's rays, leaf by leaf instead of ray by ray.
//!
//! ```text
//!   block of 64 × 64 pixels ─► pixels in the body's outline ─► parted by dominant axis, then by the tree's cells
//!                                                                      │ runs of pixels of one leaf
//!                                                                      ▼
//!      the leaf's cubic in (s, t, u, v), on the image ─► a cubic in column and row ─► in each row a cubic in the column
//! ```
//!
//! With w = the path of a ray along the dominant axis, in the frame, all four intercepts are X(c, r) / w(c, r). So G = w³ F is a
//! polynomial of degree 3 in column and row, and with the squared lengths W of the path in mm and B in the frame,
//! L² = G · W / (w B²). Per pixel: three products and sums, a root, and what all leaves of a row share.

mod factors;

use std::ops::Range;
use std::sync::OnceLock;

use nalgebra::SMatrix;
use pulp::{Simd, WithSimd};

use self::factors::{FillFactors, RowFactors, cubic_at};
use super::outline::rows_within;
use super::planes::ClipRuns;
use super::{ChordLeaf, SquaredChord};
use crate::exact::{BodyView, Engine, Lengths};
use crate::geometry::{RayGrid, Region};
use crate::linespace::LineFrame;
use crate::linespace::image::{ImageLines, MOST_ROWS, PixelForm, PlaneForms, Runs};
use crate::ritree::{Cache, FittedTree};

/// Columns and rows of a block. Blocks lie on multiples of it, so that what a pixel gets does not depend on the region
/// that it is asked in.
pub(super) const BLOCK: u32 = MOST_ROWS as u32;

/// A body made ready for the rays of an image, to be found by its tree.
pub struct ImageChords<'a> {
    lines: ImageLines,
    /// The pixels of each row that the body may be seen at.
    rows: Vec<Range<u32>>,
    exact: BodyView<'a>,
}

/// A run of pixels of a row.
pub type Run = (u32, Range<u32>);

/// Where the chords of a region's rays are written to, row by row.
pub struct ImageLengths<'e> {
    /// Lengths, mm.
    pub lengths: &'e mut [f64],
    /// Where along their rays the middles lie, mm from where the ray starts. `None` if that is not wanted.
    pub middles: Option<&'e mut [f64]>,
    /// The runs of pixels that are to be traced.
    pub open: &'e mut Vec<Run>,
}

impl<'a> ImageChords<'a> {
    /// Makes the body of `fitter` ready for `grid`'s rays. `None` if it does not lie wholly between where rays start and where
    /// they end.
    pub fn new(fitter: &SquaredChord<'a>, grid: &RayGrid) -> Option<Self> {
        let rows = rows_within(fitter.body.surface(), fitter.body.walker(), grid)?;
        let lines = ImageLines::new(&fitter.frame, grid);
        let engine = if fitter.is_convex() { Engine::Walk } else { Engine::Bvh };
        let exact = fitter.body.view(grid, Some(engine));
        Some(Self { lines, rows, exact })
    }

    /// The body's exact engine for what the tree does not know.
    pub fn exact(&self) -> &BodyView<'a> {
        &self.exact
    }

    /// Writes the length of each ray of `region` that `tree` knows, over what is there, and 0 for the others. What a pixel gets
    /// does not depend on the region it is asked in.
    pub fn find(
        &self,
        tree: &FittedTree<SquaredChord<'a>>,
        region: &Region,
        cache: &Cache,
        found: &mut ImageLengths,
    ) {
        for top in aligned(&region.rows) {
            for left in aligned(&region.columns) {
                let block = Region {
                    columns: left.max(region.columns.start)..(left + BLOCK).min(region.columns.end),
                    rows: top.max(region.rows.start)..(top + BLOCK).min(region.rows.end),
                };
                self.find_in_block(tree, [left, top], &block, region, cache, found);
            }
        }
    }

    /// As [`find`](Self::find), with the lengths of the others traced.
    pub fn trace(
        &self,
        tree: &FittedTree<SquaredChord<'a>>,
        region: &Region,
        cache: &Cache,
        lengths: &mut [f64],
        traced: &mut Vec<Run>,
    ) {
        let first = traced.len();
        self.find(tree, region, cache, &mut ImageLengths { lengths, middles: None, open: traced });
        for run in &traced[first..] {
            let (run, at) = places_of(region, run);
            self.exact.trace(&run, &mut Lengths(&mut lengths[at]));
        }
    }

    fn find_in_block(
        &self,
        tree: &FittedTree<SquaredChord<'a>>,
        origin: [u32; 2],
        block: &Region,
        region: &Region,
        cache: &Cache,
        found: &mut ImageLengths,
    ) {
        let pixels = Runs::of_rows(block, |row| self.rows[row as usize].clone());
        clear_around(&pixels, block, region, found.lengths);
        if pixels.is_empty() {
            return;
        }
        let arch = crate::dispatch::arch();
        let mut factors = RowFactors::new();
        self.lines.by_dominant_axis(&pixels, |axis, sign, pixels| {
            let forms = self.lines.forms(axis, sign);
            let fill = FillFactors {
                factors: &mut factors,
                lines: &self.lines,
                denominator: forms.denominator,
                origin,
                pixels,
            };
            arch.dispatch(fill);
            tree.visit(LineFrame::pair(axis), &forms, pixels, cache, &mut |leaf, pixels| match leaf {
                ChordLeaf::Empty => clear(pixels, region, found.lengths),
                ChordLeaf::Planes(few) => arch.dispatch(ClipRuns {
                    planes: &tree.fit().plane_forms(few, &self.lines, axis),
                    path_mm: self.lines.path_mm(),
                    pixels,
                    region,
                    lengths: found.lengths,
                    middles: found.middles.as_deref_mut(),
                }),
                ChordLeaf::Traced => {
                    clear(pixels, region, found.lengths);
                    found.open.extend(pixels.iter());
                }
                ChordLeaf::Model(model) => {
                    let first_open = found.open.len();
                    arch.dispatch(Evaluate {
                        on_image: OnImage::new(|stuv| model.at(stuv), model.threshold, &forms, origin),
                        factors: &factors,
                        origin,
                        pixels,
                        region,
                        lengths: found.lengths,
                        open: found.open,
                    });
                    for run in &found.open[first_open..] {
                        found.lengths[places_of(region, run).1].fill(0.0);
                    }
                    if let (Some(middles), Some(middle)) = (&mut found.middles, &model.middle) {
                        let middle = |stuv: &[f64; 4]| middle.at(&model.local(stuv));
                        let on_image = OnImage::new(middle, 0.0, &forms, origin);
                        self.find_middles(
                            &on_image,
                            axis,
                            &forms.denominator,
                            origin,
                            pixels,
                            region,
                            middles,
                        );
                    }
                }
            });
        });
    }

    /// With the squared path B in the frame, λ = G / (w B) in the middle of a chord; and the ray is there when it has come from
    /// its start's coordinate along the axis to λ.
    #[expect(clippy::too_many_arguments, reason = "all of a block's, once")]
    fn find_middles(
        &self,
        on_image: &OnImage,
        axis: usize,
        denominator: &PixelForm,
        [left, top]: [u32; 2],
        pixels: &Runs,
        region: &Region,
        middles: &mut [f64],
    ) {
        let squared = |path: &[PixelForm; 3], c: f64, r: f64| -> f64 {
            path.iter().map(|form| form.at(c, r).powi(2)).sum()
        };
        for (row, columns) in pixels.iter() {
            let r = f64::from(row);
            let [g0, g1, g2, g3] = on_image.of_row(f64::from(row - top) * STEP);
            let at = places_of(region, &(row, columns.clone())).1;
            for (middle, column) in middles[at].iter_mut().zip(columns) {
                let (c, x) = (f64::from(column), f64::from(column - left) * STEP);
                let g = ((g3 * x + g2) * x + g1) * x + g0;
                let lambda = g / (denominator.at(c, r) * squared(self.lines.path(), c, r));
                let share = (lambda - self.lines.start()[axis].at(c, r)) / self.lines.path()[axis].at(c, r);
                *middle = share * squared(self.lines.path_mm(), c, r).sqrt();
            }
        }
    }
}

/// From a column or row to the next, in blocks.
const STEP: f64 = 1.0 / BLOCK as f64;

/// A run as a region, and where its pixels are in the lists of `region`.
pub fn places_of(region: &Region, (row, columns): &Run) -> (Region, Range<usize>) {
    let at = place_in(region, *row, columns);
    (Region { columns: columns.clone(), rows: *row..row + 1 }, at)
}

/// Where the blocks of a range start.
fn aligned(range: &Range<u32>) -> impl Iterator<Item = u32> + use<> {
    (range.start / BLOCK * BLOCK..range.end).step_by(BLOCK as usize)
}

pub(super) fn place_in(region: &Region, row: u32, columns: &Range<u32>) -> Range<usize> {
    let start = (row - region.rows.start) as usize * region.columns.len()
        + (columns.start - region.columns.start) as usize;
    start..start + columns.len()
}

/// Writes 0 for some pixels.
fn clear(pixels: &Runs, region: &Region, lengths: &mut [f64]) {
    for (row, columns) in pixels.iter() {
        lengths[place_in(region, row, &columns)].fill(0.0);
    }
}

/// Writes 0 for all pixels of a block but some, so that each pixel is written to once.
fn clear_around(pixels: &Runs, block: &Region, region: &Region, lengths: &mut [f64]) {
    for row in block.rows.clone() {
        let kept = pixels.of_row(row);
        for columns in [block.columns.start..kept.start, kept.end..block.columns.end] {
            lengths[place_in(region, row, &columns)].fill(0.0);
        }
    }
}

/// A leaf's G on a block of an image: a cubic in column and row, counted from the block's corner in blocks.
struct OnImage {
    /// Of 1, x, x², x³, y, xy, x²y, y², xy², y³.
    coefficients: [f64; 10],
    /// Of F.
    threshold: f64,
    /// w.
    denominator: PixelForm,
    left: f64,
    side: f64,
}

/// The ten powers of a cubic in two variables.
const POWERS: [(i32, i32); 10] =
    [(0, 0), (1, 0), (2, 0), (3, 0), (0, 1), (1, 1), (2, 1), (0, 2), (1, 2), (0, 3)];

/// Where a cubic in two variables is known by its values: i + j ≤ 3, in thirds of a block.
const LATTICE: [(u32, u32); 10] =
    [(0, 0), (1, 0), (2, 0), (3, 0), (0, 1), (1, 1), (2, 1), (0, 2), (1, 2), (0, 3)];

/// From the values on the lattice to coefficients.
fn from_lattice() -> &'static [[f64; 10]; 10] {
    static INVERSE: OnceLock<[[f64; 10]; 10]> = OnceLock::new();
    INVERSE.get_or_init(|| {
        let power = |row: usize, column: usize| {
            let ((i, j), (a, b)) = (LATTICE[row], POWERS[column]);
            (f64::from(i) / 3.0).powi(a) * (f64::from(j) / 3.0).powi(b)
        };
        let inverse = SMatrix::<f64, 10, 10>::from_fn(power).try_inverse().unwrap_or_default();
        std::array::from_fn(|row| std::array::from_fn(|column| inverse[(row, column)]))
    })
}

impl OnImage {
    fn new(
        model: impl Fn(&[f64; 4]) -> f64,
        threshold: f64,
        forms: &PlaneForms,
        [left, top]: [u32; 2],
    ) -> Self {
        let (left, top, side) = (f64::from(left), f64::from(top), f64::from(BLOCK));
        let values = LATTICE.map(|(i, j)| {
            let (c, r) = (left + side * f64::from(i) / 3.0, top + side * f64::from(j) / 3.0);
            let w = forms.denominator.at(c, r);
            let inverse = 1.0 / w;
            w * w * w * model(&forms.numerators.each_ref().map(|form| form.at(c, r) * inverse))
        });
        let coefficients =
            from_lattice().each_ref().map(|row| row.iter().zip(&values).map(|(a, b)| a * b).sum());
        Self { coefficients, threshold, denominator: forms.denominator, left, side }
    }

    /// G below this may be below the leaf's threshold in a row: w is affine, and largest at one of the ends.
    #[inline(always)]
    fn threshold_of(&self, row: u32) -> f64 {
        let w = |c: f64| self.denominator.at(c, f64::from(row));
        self.threshold * w(self.left).max(w(self.left + self.side)).powi(3)
    }

    /// The coefficients of a row's cubic in x.
    #[inline(always)]
    fn of_row(&self, y: f64) -> [f64; 4] {
        let c = &self.coefficients;
        [((c[9] * y + c[7]) * y + c[4]) * y + c[0], (c[8] * y + c[5]) * y + c[1], c[6] * y + c[2], c[3]]
    }
}

/// Evaluates a leaf on its runs.
struct Evaluate<'e> {
    on_image: OnImage,
    factors: &'e RowFactors,
    origin: [u32; 2],
    pixels: &'e Runs,
    region: &'e Region,
    lengths: &'e mut [f64],
    open: &'e mut Vec<Run>,
}

impl WithSimd for Evaluate<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let [left, top] = self.origin;
        for (row, columns) in self.pixels.iter() {
            let cubic = self.on_image.of_row(f64::from(row - top) * STEP);
            let threshold = self.on_image.threshold_of(row);
            let row_of_block = (row - top) as usize;
            let first = (columns.start - left) as i32;
            let x_of = |i: usize| f64::from(first + i as i32) * STEP;
            let lengths = &mut self.lengths[place_in(self.region, row, &columns)];
            let mut doubtful = 0;
            // Written so that NaN is traced.
            let mut length_of = |g: f64, factor: f64| {
                let is_known = g >= threshold;
                doubtful += u64::from(!is_known);
                (g * factor).sqrt()
            };
            if self.factors.are_cubic {
                let factor = &self.factors.cubics[row_of_block];
                for (i, length) in lengths.iter_mut().enumerate() {
                    let x = x_of(i);
                    *length = length_of(cubic_at(&cubic, x), cubic_at(factor, x));
                }
            } else {
                let factors = &self.factors.of_rows[row_of_block][first as usize..];
                for (i, (length, factor)) in lengths.iter_mut().zip(factors).enumerate() {
                    *length = length_of(cubic_at(&cubic, x_of(i)), *factor);
                }
            }
            if doubtful > 0 {
                let mut start = None;
                for i in 0..=columns.len() {
                    let is_known = i == columns.len() || cubic_at(&cubic, x_of(i)) >= threshold;
                    match (start, is_known) {
                        (None, false) => start = Some(i),
                        (Some(from), true) => {
                            let at = |i: usize| columns.start + i as u32;
                            self.open.push((row, at(from)..at(i)));
                            start = None;
                        }
                        _ => {}
                    }
                }
            }
        }
    }
}
