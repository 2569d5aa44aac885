//! Cubic polynomials of a line's place in a cell, and their fit to samples.

use std::sync::OnceLock;

/// The coefficients of a cubic in four variables: 1 constant, 4 linear, 10 quadratic and 20 cubic ones.
pub const TERMS: usize = 35;

/// How many of them a quadratic has.
pub const QUADRATIC_TERMS: usize = 15;

/// A line's place in a cell: from −1 to 1 on each axis.
pub type Local = [f64; 4];

/// A cubic polynomial, by degree; within a degree x₀ᵃx₁ᵇx₂ᶜx₃ᵈ with the larger powers of the earlier variables first.
#[derive(Clone, Debug, PartialEq)]
pub struct Cubic(pub [f64; TERMS]);

/// As it is kept: serde knows no array as long as all of it.
type Rows = [[f64; 7]; 5];

impl serde::Serialize for Cubic {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let rows: Rows = std::array::from_fn(|row| std::array::from_fn(|i| self.0[7 * row + i]));
        rows.serialize(serializer)
    }
}

impl<'de> serde::Deserialize<'de> for Cubic {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let rows = Rows::deserialize(deserializer)?;
        Ok(Self(std::array::from_fn(|term| rows[term / 7][term % 7])))
    }
}

impl Cubic {
    /// Its value.
    #[inline(always)]
    pub fn at(&self, x: &Local) -> f64 {
        let c = &self.0;
        let (mut quadratic, mut cubic) = (5, QUADRATIC_TERMS);
        let mut sum = c[0];
        for i in 0..4 {
            let mut of_i = c[1 + i];
            for j in i..4 {
                let mut of_ij = c[quadratic];
                quadratic += 1;
                for &x in &x[j..] {
                    of_ij += c[cubic] * x;
                    cubic += 1;
                }
                of_i += of_ij * x[j];
            }
            sum += of_i * x[i];
        }
        sum
    }
}

/// The terms of a cubic at a place.
pub fn terms(x: &Local) -> [f64; TERMS] {
    let mut terms = [1.0; TERMS];
    let (mut quadratic, mut cubic) = (5, QUADRATIC_TERMS);
    for i in 0..4 {
        terms[1 + i] = x[i];
        for j in i..4 {
            terms[quadratic] = x[i] * x[j];
            for x in &x[j..] {
                terms[cubic] = terms[quadratic] * x;
                cubic += 1;
            }
            quadratic += 1;
        }
    }
    terms
}

/// Lines that a complete cell is fitted to.
pub const FIT_LINES: usize = 64;
/// More of them, for a cell that some lines miss in.
pub const MORE_LINES: usize = 64;
/// Lines that a fit is tested on.
pub const TEST_LINES: usize = 24;

/// Where a cell is sampled, and how complete cells are fitted.
pub struct Design {
    /// Places for fits, then more of them.
    pub places: [Local; FIT_LINES + MORE_LINES],
    /// Places for tests: all over the cell, and half of its corners.
    pub tests: [Local; TEST_LINES],
    /// The terms at `places`.
    pub terms: [[f64; TERMS]; FIT_LINES + MORE_LINES],
    /// The coefficients of the best cubic are the sum over the samples of these times the sample's value.
    solution: [[f64; TERMS]; FIT_LINES],
}

/// The generalized golden ratio of four dimensions, x⁵ = x + 1: its powers make a sequence that fills a cube evenly
/// (Roberts 2018, <https://extremelearning.com.au/unreasonable-effectiveness-of-quasirandom-sequences/>).
const GOLDEN: f64 = 1.167_303_978_261_418_7;

fn evenly(n: usize) -> Local {
    std::array::from_fn(|axis| {
        let u = (0.5 + n as f64 * GOLDEN.powi(-(axis as i32 + 1))).fract();
        2.0 * u - 1.0
    })
}

impl Design {
    /// The one design, made when first used.
    pub fn get() -> &'static Self {
        static DESIGN: OnceLock<Design> = OnceLock::new();
        DESIGN.get_or_init(|| {
            // Denser towards the sides, where a fit is least certain.
            let places = std::array::from_fn(|n| evenly(n).map(|x| (std::f64::consts::FRAC_PI_2 * x).sin()));
            let terms = places.map(|place| terms(&place));
            let corner = |n: usize| -> Local {
                let bits = [0, 3, 5, 6, 9, 10, 12, 15][n];
                std::array::from_fn(|axis| if bits >> axis & 1 == 0 { -1.0 } else { 1.0 })
            };
            let all_over = TEST_LINES - 8;
            let tests = std::array::from_fn(|n| {
                if n < all_over { evenly(FIT_LINES + MORE_LINES + n) } else { corner(n - all_over) }
            });
            let all = Normal::of(terms[..FIT_LINES].iter().map(|row| (row, 0.0)));
            let solution = std::array::from_fn(|n| all.solve(&terms[n], TERMS, 0.0).unwrap_or([0.0; TERMS]));
            Self { places, tests, terms, solution }
        })
    }

    /// The cubic that fits best to values at the first [`FIT_LINES`] places.
    pub fn fit_complete(&self, values: &[f64]) -> Cubic {
        let mut sum = [0.0; TERMS];
        for (column, &value) in self.solution.iter().zip(values) {
            for (sum, weight) in sum.iter_mut().zip(column) {
                *sum += weight * value;
            }
        }
        Cubic(sum)
    }

    /// The cubic, or the quadratic if there are too few values for one, that fits best to values at some of the places.
    /// `None` if they are too few for that, or lie so that they do not define one.
    pub fn fit_some(&self, values: &[(usize, f64)]) -> Option<Cubic> {
        let count = match values.len() {
            n if n >= TERMS + TERMS / 3 => TERMS,
            n if n >= QUADRATIC_TERMS + QUADRATIC_TERMS / 3 => QUADRATIC_TERMS,
            _ => return None,
        };
        let normal = Normal::of(values.iter().map(|&(place, value)| (&self.terms[place], value)));
        Some(Cubic(normal.solve(&normal.right, count, RIDGE)?))
    }
}

/// The normal equations of a least-squares fit.
struct Normal {
    /// The lower triangle; what is above it is not kept right.
    matrix: [[f64; PADDED]; TERMS],
    right: [f64; TERMS],
}

/// Rows are as long as whole wide registers.
const PADDED: usize = 36;

impl Normal {
    fn of<'t>(rows: impl Iterator<Item = (&'t [f64; TERMS], f64)>) -> Self {
        crate::dispatch::arch().dispatch(Gather(rows))
    }

    /// Solves the equations of the first `count` terms for a right side. `None` if they do not define a solution.
    fn solve(&self, right: &[f64; TERMS], count: usize, ridge: f64) -> Option<[f64; TERMS]> {
        let ridge = ridge * self.matrix[0][0];
        // Cholesky's, row by row.
        let mut root = [[0.0; PADDED]; TERMS];
        let mut solution = [0.0; TERMS];
        for i in 0..count {
            let mut rest = self.matrix[i];
            rest[i] += ridge;
            for j in 0..i {
                let sum: f64 = root[i][..j].iter().zip(&root[j][..j]).map(|(a, b)| a * b).sum();
                root[i][j] = (rest[j] - sum) * root[j][j];
            }
            let sum: f64 = root[i][..i].iter().map(|a| a * a).sum();
            let pivot = rest[i] - sum;
            if pivot.is_nan() || pivot <= 0.0 {
                return None;
            }
            // The diagonal is kept as its reciprocal.
            root[i][i] = 1.0 / pivot.sqrt();
            let sum: f64 = root[i][..i].iter().zip(&solution).map(|(a, b)| a * b).sum();
            solution[i] = (right[i] - sum) * root[i][i];
        }
        for i in (0..count).rev() {
            solution[i] *= root[i][i];
            for j in 0..i {
                solution[j] -= root[i][j] * solution[i];
            }
        }
        Some(solution)
    }
}

/// Sums the products of rows.
struct Gather<I>(I);

impl<'t, I: Iterator<Item = (&'t [f64; TERMS], f64)>> pulp::WithSimd for Gather<I> {
    type Output = Normal;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Normal {
        let mut normal = Normal { matrix: [[0.0; PADDED]; TERMS], right: [0.0; TERMS] };
        for (terms, value) in self.0 {
            let mut row = [0.0; PADDED];
            row[..TERMS].copy_from_slice(terms);
            for i in 0..TERMS {
                let factor = row[i];
                normal.right[i] += factor * value;
                // To the end of the register that the diagonal lies in.
                let end = (i / 4 + 1) * 4;
                for (sum, term) in normal.matrix[i][..end].iter_mut().zip(&row[..end]) {
                    *sum += factor * term;
                }
            }
        }
        normal
    }
}

/// What holds a fit where samples do not, as a share of their number: it moves a coefficient that they do determine by less
/// than the models err.
const RIDGE: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubics_are_reproduced_by_full_and_by_partial_fits() {
        let cubic = Cubic(std::array::from_fn(|term| (1.0 + term as f64 * 7.7).sin()));
        let design = Design::get();
        let values: Vec<f64> = design.places.iter().map(|place| cubic.at(place)).collect();
        for (i, &value) in values.iter().enumerate() {
            let of_terms: f64 = design.terms[i].iter().zip(&cubic.0).map(|(t, c)| t * c).sum();
            assert!((of_terms - value).abs() < 1e-13);
        }
        let full = design.fit_complete(&values[..FIT_LINES]);
        let half: Vec<_> = values
            .iter()
            .copied()
            .enumerate()
            .filter(|&(i, _)| design.places[i][0] + design.places[i][2] > -0.3)
            .collect();
        assert!(half.len() < values.len() - 20);
        let partial = design.fit_some(&half).expect("enough");
        for place in &design.tests {
            assert!((full.at(place) - cubic.at(place)).abs() < 1e-12);
            assert!((partial.at(place) - cubic.at(place)).abs() < 1e-5);
        }
        assert!(design.fit_some(&half[..19]).is_none());
    }

    #[test]
    fn the_places_of_samples_hold_a_fit_everywhere() {
        // The largest factor by which an error of samples may show up between them.
        let design = Design::get();
        let factor = |x: &Local| -> f64 {
            let at = terms(x);
            let weight =
                |column: &[f64; TERMS]| column.iter().zip(&at).map(|(c, t)| c * t).sum::<f64>().abs();
            design.solution.iter().map(weight).sum()
        };
        let worst = design.tests.iter().map(factor).fold(0.0, f64::max);
        let mean = design.tests[..16].iter().map(factor).sum::<f64>() / 16.0;
        assert!(worst < 20.0 && mean < 5.0, "{worst} {mean}");
    }
}
