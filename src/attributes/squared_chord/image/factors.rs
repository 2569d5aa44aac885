//! What all leaves of a row of a block share: W / (w B²), which turns G into the squared length.

use std::sync::OnceLock;

use nalgebra::SMatrix;
use pulp::{Simd, WithSimd};

use super::BLOCK;
use crate::linespace::image::{ImageLines, MOST_ROWS, PixelForm, Runs};

/// W / (w B²) of each pixel of a block.
pub(super) struct RowFactors {
    /// Whether a row's factors are a cubic of the column.
    pub(super) are_cubic: bool,
    /// Its coefficients, if so; the column counts from the block's first in blocks.
    pub(super) cubics: [[f64; 4]; MOST_ROWS],
    /// If not, one for each column.
    pub(super) of_rows: Vec<[f64; BLOCK as usize]>,
}

/// How far a row's cubic may be off its factors, as a share of them: a length of 200 mm is then off by a hundred-thousandth of a
/// millimetre. Where pixels lie so far apart that it is farther off, each has a factor of its own.
const OFF_CUBIC: f64 = 1e-7;

/// Where a row's cubic is known by its values: Chebyshev's places, where it strays least in between.
fn chebyshev() -> &'static ([f64; 4], [[f64; 4]; 4]) {
    static PLACES: OnceLock<([f64; 4], [[f64; 4]; 4])> = OnceLock::new();
    PLACES.get_or_init(|| {
        let places: [f64; 4] =
            std::array::from_fn(|i| 0.5 - 0.5 * (std::f64::consts::PI * (i as f64 + 0.5) / 4.0).cos());
        let powers = SMatrix::<f64, 4, 4>::from_fn(|row, power| places[row].powi(power as i32));
        let inverse = powers.try_inverse().unwrap_or_default();
        (places, std::array::from_fn(|row| std::array::from_fn(|column| inverse[(row, column)])))
    })
}

/// The value of a cubic, by its coefficients from the constant one on.
#[inline(always)]
pub(super) fn cubic_at([c0, c1, c2, c3]: &[f64; 4], x: f64) -> f64 {
    ((c3 * x + c2) * x + c1) * x + c0
}

impl RowFactors {
    pub(super) fn new() -> Self {
        Self {
            are_cubic: false,
            cubics: [[0.0; 4]; MOST_ROWS],
            of_rows: vec![[0.0; BLOCK as usize]; MOST_ROWS],
        }
    }
}

/// Finds the factors of a block's pixels.
pub(super) struct FillFactors<'e> {
    pub(super) factors: &'e mut RowFactors,
    pub(super) lines: &'e ImageLines,
    pub(super) denominator: PixelForm,
    pub(super) origin: [u32; 2],
    pub(super) pixels: &'e Runs,
}

impl WithSimd for FillFactors<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let [left, top] = self.origin;
        let (places, from_values) = chebyshev();
        let cubic_of = |row: &RowFactor| -> [f64; 4] {
            let values = places.map(|x| row.at(x * f64::from(BLOCK)));
            from_values
                .each_ref()
                .map(|row| row[0] * values[0] + row[1] * values[1] + row[2] * values[2] + row[3] * values[3])
        };
        // Rows of the block, whatever part of it is asked for.
        self.factors.are_cubic = [top, top + BLOCK / 2, top + BLOCK].iter().all(|&row| {
            let row = RowFactor::new(self.lines, self.denominator, left, row);
            let cubic = cubic_of(&row);
            [0.0, 0.5, 1.0].iter().all(|&x| {
                let exact = row.at(x * f64::from(BLOCK));
                // Written so that NaN is off.
                (cubic_at(&cubic, x) - exact).abs() <= OFF_CUBIC * exact
            })
        });
        for (row, columns) in self.pixels.iter() {
            let factor = RowFactor::new(self.lines, self.denominator, left, row);
            let row = (row - top) as usize;
            if self.factors.are_cubic {
                self.factors.cubics[row] = cubic_of(&factor);
            } else {
                let first = (columns.start - left) as usize;
                let of_row = &mut self.factors.of_rows[row][first..first + columns.len()];
                for (i, value) in of_row.iter_mut().enumerate() {
                    *value = factor.at((first as i32 + i as i32) as f64);
                }
            }
        }
    }
}

/// W / (w B²) in a row, of the column counted from a block's first.
struct RowFactor {
    squared_mm: [f64; 3],
    squared: [f64; 3],
    denominator: [f64; 2],
}

impl RowFactor {
    #[inline(always)]
    fn new(lines: &ImageLines, denominator: PixelForm, left: u32, row: u32) -> Self {
        let (left, r) = (f64::from(left), f64::from(row));
        // The squares are quadratic in the column.
        let square = |path: &[PixelForm; 3]| {
            let [x, y, z] = path.each_ref().map(|form| [form.at(left, r), form.per_column()]);
            let product = |i: usize, j: usize| x[i] * x[j] + y[i] * y[j] + z[i] * z[j];
            [product(0, 0), 2.0 * product(0, 1), product(1, 1)]
        };
        Self {
            squared_mm: square(lines.path_mm()),
            squared: square(lines.path()),
            denominator: [denominator.at(left, r), denominator.per_column()],
        }
    }

    #[inline(always)]
    fn at(&self, c: f64) -> f64 {
        let Self { squared_mm: [w0, w1, w2], squared: [b0, b1, b2], denominator: [d0, d1] } = self;
        let b = (b2 * c + b1) * c + b0;
        ((w2 * c + w1) * c + w0) / ((d1 * c + d0) * (b * b))
    }
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};

    use super::*;
    use crate::geometry::{RayGrid, Upstream};
    use crate::linespace::LineFrame;

    #[test]
    fn a_row_has_a_cubic_only_where_its_factors_are_one() {
        let to_ball = DMat3::from_rotation_y(0.4) * DMat3::from_diagonal(DVec3::new(0.01, 0.02, 0.03));
        let frame = LineFrame::new(DVec3::ZERO, to_ball, DVec3::splat(-1.0), DVec3::ONE).expect("not flat");
        for (step_mm, are_cubic) in [(0.5, true), (20.0, false)] {
            let corner = DVec3::new(-32.0 * step_mm, -32.0 * step_mm, 500.0);
            let source = DVec3::new(0.0, 0.0, -1000.0);
            let steps = [step_mm * DVec3::X, step_mm * DVec3::Y];
            let grid = RayGrid::new(Upstream::Source(source), corner, steps, [BLOCK, BLOCK]).expect("rays");
            let lines = ImageLines::new(&frame, &grid);
            let whole = grid.whole();
            let pixels = Runs::of_rows(&whole, |_| whole.columns.clone());
            let mut factors = RowFactors::new();
            let denominator = lines.forms(2, 1.0).denominator;
            let fill = FillFactors {
                factors: &mut factors,
                lines: &lines,
                denominator,
                origin: [0, 0],
                pixels: &pixels,
            };
            crate::dispatch::arch().dispatch(fill);
            assert_eq!(factors.are_cubic, are_cubic, "{step_mm} mm");
            for (column, row) in whole.places() {
                let (c, r) = (f64::from(column), f64::from(row));
                let squared =
                    |path: &[PixelForm; 3]| path.iter().map(|form| form.at(c, r).powi(2)).sum::<f64>();
                let exact = squared(lines.path_mm()) / (denominator.at(c, r) * squared(lines.path()).powi(2));
                let x = c / f64::from(BLOCK);
                let (row, column) = (row as usize, column as usize);
                let factor =
                    if are_cubic { cubic_at(&factors.cubics[row], x) } else { factors.of_rows[row][column] };
                assert!((factor - exact).abs() <= 1.1 * OFF_CUBIC * exact, "{factor}, not {exact}");
            }
        }
    }
}
