//! What the samples at a cell's corners make for the lines between: quadrilinear interpolation, linear interpolation within a
//! simplex, and the linear function that fits the corners on one side of a discontinuity best.

use super::attribute::{Attribute, Scheme};
use crate::geometry::Real;

/// The outputs at the 16 corner lines of a cell, by the corner's bits (s, t, u, v from the lowest).
pub type Corners<T> = [T; 16];

/// The corners at the ends of the diagonal along which simplices lie.
pub const DIAGONAL: [usize; 2] = [0, 15];

/// What a final cell answers by.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Samples<T> {
    /// The corners.
    pub corners: Corners<T>,
    /// The middle, where it was tested and simplices are interpolated: it halves the diagonal that all of them share.
    pub middle: Option<Box<T>>,
}

impl<T> Samples<T> {
    /// All of them.
    pub fn all(&self) -> impl Iterator<Item = &T> {
        self.corners.iter().chain(self.middle.as_deref())
    }
}

/// The fewest samples that define a linear interpolant in 4-space (§2.5).
const LINEAR_SAMPLES: usize = 5;

/// The output at fractions of a cell of one class.
pub fn interpolated<A: Attribute>(
    attribute: &A,
    samples: &Samples<A::Output>,
    fractions: [A::Real; 4],
) -> A::Output {
    let corners = &samples.corners;
    match (attribute.sampling().scheme, &samples.middle) {
        (Scheme::Quadrilinear, _) => quadrilinear(attribute, corners, fractions),
        (Scheme::Simplicial, None) => Simplex::around(fractions, 0).interpolated(attribute, corners),
        (Scheme::Simplicial, Some(middle)) => {
            Simplex::around(fractions, 0).interpolated_through(attribute, corners, middle)
        }
    }
}

/// The output halfway between two.
pub fn halfway<A: Attribute>(attribute: &A, ends: [&A::Output; 2]) -> A::Output {
    attribute.interpolate(&ends.map(|end| (A::Real::of(0.5), end)))
}

/// How many of a cell's diagonals are different ones.
const DIAGONALS: usize = 8;

/// Five corners of a cell around a line, and their weights in the linear function through them.
///
/// A diagonal of the cell and the order of a line's fractions along it tell one of 24 simplices, which fill the cell. On the side
/// that two cells share their simplices are the same, so that what is interpolated is continuous. H. W. Kuhn, Some combinatorial
/// lemmas in topology, IBM Journal of Research and Development 4(5), 1960, doi:10.1147/rd.45.0518.
#[derive(Clone, Copy, Debug)]
pub struct Simplex<R> {
    corners: [usize; 5],
    weights: [R; 5],
}

impl<R: Real> Simplex<R> {
    /// The simplex around the line at these fractions along the diagonal that begins at corner `from`.
    pub fn around(fractions: [R; 4], from: usize) -> Self {
        let along: [R; 4] = std::array::from_fn(|a| match from >> a & 1 {
            0 => fractions[a],
            _ => R::of(1.0) - fractions[a],
        });
        let mut axes = [0, 1, 2, 3];
        axes.sort_unstable_by(|&a, &b| along[b].get().total_cmp(&along[a].get()));
        // From one end of the diagonal to the other, along the axes with the largest fractions first.
        let mut at = from;
        let corners = std::array::from_fn(|i| {
            if i > 0 {
                at ^= 1 << axes[i - 1];
            }
            at
        });
        let [first, second, third, last] = axes.map(|a| along[a]);
        let weights = [R::of(1.0) - first, first - second, second - third, third - last, last];
        Self { corners, weights }
    }

    /// All that hold the line, one along each diagonal.
    pub fn all_around(fractions: [R; 4]) -> impl Iterator<Item = Self> {
        (0..DIAGONALS).map(move |from| Self::around(fractions, from))
    }

    /// Its corners.
    pub fn corners(&self) -> [usize; 5] {
        self.corners
    }

    /// The output at the line.
    pub fn interpolated<A: Attribute<Real = R>>(
        &self,
        attribute: &A,
        corners: &Corners<A::Output>,
    ) -> A::Output {
        attribute.interpolate(&self.parts(corners))
    }

    /// The output at the line, where that in the middle of the cell is known: of the diagonal's two ends, the one on the far side of
    /// the middle gives way to it. The largest errors are those along the diagonal: of an output that
    /// bends alike in all directions a quarter of the largest goes, and three tenths of the mean.
    fn interpolated_through<A: Attribute<Real = R>>(
        &self,
        attribute: &A,
        corners: &Corners<A::Output>,
        middle: &A::Output,
    ) -> A::Output {
        let mut parts = self.parts(corners);
        let (near, far) = if parts[0].0 < parts[4].0 { (4, 0) } else { (0, 4) };
        let less = parts[far].0;
        parts[near].0 = parts[near].0 - less;
        parts[far] = (less + less, middle);
        // The middle may be known in outline only; the first is a corner, which is known whole.
        parts.swap(1, far);
        attribute.interpolate(&parts)
    }

    fn parts<'c, T>(&self, corners: &'c Corners<T>) -> [(R, &'c T); 5] {
        std::array::from_fn(|i| (self.weights[i], &corners[self.corners[i]]))
    }
}

/// Whether a cell has a simplex whose corners are all of one class. `None` is of no class.
pub fn has_simplex(class_of: impl Fn(usize) -> Option<u32>) -> bool {
    fn leads(from: usize, to: usize, is_of_it: &impl Fn(usize) -> bool) -> bool {
        let steps = (0..4).map(|axis| 1 << axis).filter(|step| (from ^ to) & step != 0);
        from == to || steps.map(|step| from ^ step).any(|next| is_of_it(next) && leads(next, to, is_of_it))
    }
    (0..DIAGONALS).any(|from| {
        let class = class_of(from);
        class.is_some() && leads(from, 15 - from, &|bits| class_of(bits) == class)
    })
}

/// Quadrilinear interpolation at fractions of the cell: bilinear in (u, v) within each directional group, the four
/// corners that share (s, t), then bilinear in (s, t) (§2.4). As weights the two steps are one product.
pub fn quadrilinear<A: Attribute>(
    attribute: &A,
    corners: &Corners<A::Output>,
    fractions: [A::Real; 4],
) -> A::Output {
    let of_side = fractions.map(|f| [A::Real::of(1.0) - f, f]);
    let pairs = |a: usize| -> [A::Real; 4] {
        std::array::from_fn(|bits| of_side[a][bits & 1] * of_side[a + 1][bits >> 1])
    };
    let (of_group, within) = (pairs(0), pairs(2));
    let weight = |bits: usize| of_group[bits & 3] * within[bits >> 2];
    let parts: [(A::Real, &A::Output); 16] = std::array::from_fn(|bits| (weight(bits), &corners[bits]));
    attribute.interpolate(&parts)
}

/// The weights of the corners `usable` in the linear function that fits them best, at `fractions`. `None` if they do not
/// define one: fewer than five, or all in one hyperplane.
pub fn linear_weights<R: Real>(usable: &[usize], fractions: [R; 4]) -> Option<Vec<R>> {
    if usable.len() < LINEAR_SAMPLES {
        return None;
    }
    // A corner's row of the linear system: 1, then its four coordinates.
    let has = |bits: usize, column: usize| column == 0 || bits >> (column - 1) & 1 == 1;
    let both = |i: usize, j: usize| usable.iter().filter(|&&bits| has(bits, i) && has(bits, j)).count();
    let normal = std::array::from_fn(|i| std::array::from_fn(|j| R::of(both(i, j) as f64)));
    let [s, t, u, v] = fractions;
    let at = solve_by_cholesky(normal, [R::of(1.0), s, t, u, v])?;
    let weight = |&bits: &usize| (1..5).filter(|&a| has(bits, a)).fold(at[0], |sum, a| sum + at[a]);
    Some(usable.iter().map(weight).collect())
}

/// The x of Ax = b. `None` if A, symmetric and of small whole numbers, is singular: it has a pivot that is zero up to rounding.
fn solve_by_cholesky<R: Real, const N: usize>(a: [[R; N]; N], b: [R; N]) -> Option<[R; N]> {
    let mut l = [[R::default(); N]; N];
    let mut y = b;
    for i in 0..N {
        for j in 0..=i {
            let rest = (0..j).fold(a[i][j], |rest, k| rest - l[i][k] * l[j][k]);
            l[i][j] = if i == j { rest.sqrt() } else { rest / l[j][j] };
        }
        let pivot = l[i][i].get();
        // The root of what is negative by rounding is not a number.
        if pivot.is_nan() || pivot <= 1e-6 {
            return None;
        }
        y[i] = (0..i).fold(b[i], |rest, k| rest - l[i][k] * y[k]) / l[i][i];
    }
    for i in (0..N).rev() {
        y[i] = (i + 1..N).fold(y[i], |rest, k| rest - l[k][i] * y[k]) / l[i][i];
    }
    Some(y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Counted;

    #[test]
    fn simplices_hold_their_lines_and_reproduce_linear_functions() {
        let value = |at: [f64; 4]| 3.0 - at[0] + 2.0 * at[1] + 0.5 * at[2] - 4.0 * at[3];
        let corner = |bits: usize| std::array::from_fn(|a| (bits >> a & 1) as f64);
        let mut seen = std::collections::BTreeSet::new();
        for i in 0..10_000_usize {
            let fractions = [0, 1, 2, 3].map(|a| (i / 10_usize.pow(a) % 10) as f64 / 9.0);
            for simplex in Simplex::all_around(fractions) {
                assert!(simplex.weights.iter().all(|w| *w >= 0.0), "{fractions:?} {simplex:?}");
                let parts = || simplex.corners.iter().zip(simplex.weights);
                assert!((parts().map(|(_, w)| w).sum::<f64>() - 1.0).abs() < 1e-12);
                let sum: f64 = parts().map(|(&bits, w)| w * value(corner(bits))).sum();
                assert!((sum - value(fractions)).abs() < 1e-9, "{fractions:?} {simplex:?}");
                let mut set = simplex.corners;
                set.sort_unstable();
                seen.insert(set);
            }
        }
        assert_eq!(seen.len(), DIAGONALS * 24);
        // What is found without a line is what lines find.
        for usable in 0..1_u32 << 16 {
            let is_usable = |bits: usize| usable >> bits & 1 == 1;
            let of_one = has_simplex(|bits| is_usable(bits).then_some(1));
            assert_eq!(of_one, seen.iter().any(|set| set.iter().all(|&bits| is_usable(bits))));
        }
    }

    #[test]
    fn simplices_of_cells_side_by_side_agree_on_the_side() {
        for axis in 0..4 {
            let mut on_side = [0.3, 0.8, 0.1, 0.55];
            let ends = [1.0, 0.0].map(|end| {
                on_side[axis] = end;
                let simplex = Simplex::around(on_side, 0);
                let parts = simplex.corners.iter().zip(simplex.weights).filter(|(_, w)| *w != 0.0);
                parts.map(|(bits, w)| (bits & !(1 << axis), w)).collect::<Vec<_>>()
            });
            assert_eq!(ends[0], ends[1], "{axis}");
        }
    }

    const FRACTIONS: [f64; 4] = [0.2, 0.9, 0.35, 0.6];

    #[test]
    fn linear_functions_come_back_from_any_corners_that_define_them() {
        let value = |f: [f64; 4]| 3.0 - f[0] + 2.0 * f[1] + 0.5 * f[2] - 4.0 * f[3];
        let mut defined = 0;
        for set in 0..1_usize << 16 {
            let usable: Vec<usize> = (0..16).filter(|bits| set >> bits & 1 == 1).collect();
            let Some(weights) = linear_weights(&usable, FRACTIONS) else { continue };
            defined += 1;
            let corner = |bits: usize| std::array::from_fn(|a| (bits >> a & 1) as f64);
            let sum: f64 = usable.iter().zip(&weights).map(|(&bits, w)| w * value(corner(bits))).sum();
            assert!((sum - value(FRACTIONS)).abs() < 1e-9, "{usable:?}: {sum}");
        }
        // All sets but those of fewer than five corners, or all in one hyperplane.
        assert!((60_000..65_536 - 2_517).contains(&defined), "{defined}");
        assert_eq!(linear_weights(&[0, 1, 2, 3, 4, 5, 6, 7], FRACTIONS), None, "all in one");
    }

    #[test]
    fn finding_weights_is_counted() {
        let (weights, operations) =
            Counted::count(|| linear_weights(&[0, 1, 2, 4, 8], FRACTIONS.map(Counted::of)));
        assert!(weights.is_some());
        // Cholesky's n³/3 + n²/2 + n/6, n²/2 for each of two triangles, products and differences apart, and the weights.
        assert!((100..200).contains(&operations), "{operations}");
    }
}
