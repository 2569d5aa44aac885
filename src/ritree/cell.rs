//! What a cell's samples decide: whether it is final, and what its lines get. Pure functions of the cell.

use super::Parameters;
use super::attribute::Attribute;
use crate::geometry::Real;
use crate::linespace::{Cell, LinePoint, PlanePair};

/// The outputs at the 16 corner lines of a cell, by the corner's bits (s, t, u, v from the lowest).
pub type Corners<T> = [T; 16];

/// The fewest samples that define a linear interpolant in 4-space (§2.5).
const LINEAR_SAMPLES: usize = 5;

/// Where cells are final whatever the parameters say: 3/2³⁰ wide, still many times the rounding of an intercept. Much
/// deeper, halving a cell would give the cell again, without end.
const DEEPEST: u32 = 120;

/// What is to be done with a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Its halves are to be looked at.
    Split,
    /// It answers its lines itself.
    Final(Kind),
}

/// How a final cell answers its lines, with the corners that it needs to. The order of these, and of the reasons, is part of
/// the format of [kept](super::kept) trees.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Kind<C = ()> {
    /// No line meets the object, proved.
    Empty,
    /// Quadrilinear interpolation of the 16 corners.
    Smooth(C),
    /// Two classes: the line's own class is found, and its samples interpolated if they suffice.
    TwoClasses(C),
    /// By tracing.
    Traced(Reason),
}

impl<C> Kind<C> {
    /// The same kind with other corners.
    pub fn map<D>(self, map: impl FnOnce(C) -> D) -> Kind<D> {
        match self {
            Self::Empty => Kind::Empty,
            Self::Smooth(corners) => Kind::Smooth(map(corners)),
            Self::TwoClasses(corners) => Kind::TwoClasses(map(corners)),
            Self::Traced(reason) => Kind::Traced(reason),
        }
    }

    /// The kind alone.
    pub fn bare(&self) -> Kind {
        self.as_ref().map(|_| ())
    }

    /// The corners, if they are needed.
    pub fn corners(&self) -> Option<&C> {
        match self {
            Self::Smooth(corners) | Self::TwoClasses(corners) => Some(corners),
            Self::Empty | Self::Traced(_) => None,
        }
    }

    /// The same kind with its corners where they are.
    pub fn as_ref(&self) -> Kind<&C> {
        match self {
            Self::Empty => Kind::Empty,
            Self::Smooth(corners) => Kind::Smooth(corners),
            Self::TwoClasses(corners) => Kind::TwoClasses(corners),
            Self::Traced(reason) => Kind::Traced(*reason),
        }
    }
}

/// Why a line is traced instead of interpolated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Reason {
    /// Its cell lies across the object's outline, or another single discontinuity.
    Silhouette,
    /// Its cell holds more than two classes.
    Classes,
    /// Output directions of its cell differ by more than the angular threshold.
    Angle,
    /// All corners miss, and nothing proves that the lines between do.
    Guard,
    /// The cell's model may be off by more than the tolerance there.
    Tolerance,
}

/// A cell of one plane pair, as deep in the tree as it is small.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// The plane pair.
    pub pair: PlanePair,
    /// The cell.
    pub cell: Cell,
    /// How often the root's cell was halved.
    pub depth: u32,
}

impl Place {
    /// All lines of a plane pair.
    pub fn root(pair: PlanePair) -> Self {
        Self { pair, cell: Cell::ROOT, depth: 0 }
    }

    /// The axis that the cell is split across: the longest, which in a cube of halved cells is each in turn.
    pub fn axis(&self) -> usize {
        self.depth as usize % 4
    }

    /// Which half holds the point: 0 or 1.
    #[inline]
    pub fn side_of<R: Real>(&self, stuv: &[f64; 4]) -> usize {
        let axis = self.axis();
        let middle = R::of(0.5) * (R::of(self.cell.low[axis]) + R::of(self.cell.high[axis]));
        usize::from(stuv[axis] >= middle.get())
    }

    /// One half: 0 or 1.
    #[inline]
    pub fn half(&self, side: usize) -> Self {
        Self { cell: self.cell.halves(self.axis())[side], depth: self.depth + 1, ..*self }
    }

    /// Whether a descent for the line comes through this cell: cells hold their lower border, and those on the rim of the range
    /// what is rounded beyond it.
    #[inline]
    pub fn holds(&self, line: &LinePoint) -> bool {
        let (Cell { low, high }, rim) = (&self.cell, Cell::ROOT);
        let is_above = |a: usize| line.stuv[a] >= low[a] || low[a] == rim.low[a];
        let is_below = |a: usize| line.stuv[a] < high[a] || high[a] == rim.high[a];
        self.pair == line.pair && (0..4).all(|a| is_above(a) && is_below(a))
    }

    fn line(&self, stuv: [f64; 4]) -> LinePoint {
        LinePoint { pair: self.pair, stuv }
    }

    /// The outlines of all 16 corners.
    pub fn sample<A: Attribute>(&self, attribute: &A) -> Corners<A::Output> {
        std::array::from_fn(|bits| attribute.outline(self.line(self.cell.corner(bits))))
    }

    /// The corners' whole samples.
    pub fn finish<A: Attribute>(&self, attribute: &A, corners: &mut Corners<A::Output>) {
        for (bits, corner) in corners.iter_mut().enumerate() {
            attribute.finish(self.line(self.cell.corner(bits)), corner);
        }
    }

    /// The corners of the two halves: 8 of each are the cell's own, 8 new ones are sampled and shared.
    pub fn split<A: Attribute>(
        &self,
        attribute: &A,
        corners: &Corners<A::Output>,
    ) -> [Corners<A::Output>; 2] {
        let axis = self.axis();
        let lower = self.half(0).cell;
        let is_high = |bits: usize| bits >> axis & 1 == 1;
        // The lower half's high side lies on the cut.
        let cut: [Option<A::Output>; 16] = std::array::from_fn(|bits| {
            is_high(bits).then(|| attribute.outline(self.line(lower.corner(bits))))
        });
        let on_cut = |bits: usize| cut[bits | 1 << axis].clone();
        let pick = |own: bool, bits: usize| match on_cut(bits) {
            Some(sample) if !own => sample,
            _ => corners[bits].clone(),
        };
        [
            std::array::from_fn(|bits| pick(!is_high(bits), bits)),
            std::array::from_fn(|bits| pick(is_high(bits), bits)),
        ]
    }

    /// Whether the cell is final whatever its samples say.
    pub fn is_deepest(&self, parameters: &Parameters) -> bool {
        self.depth >= parameters.max_depth.min(DEEPEST)
    }

    /// What is to be done with the cell (§2.3, and §2.5 for its kind). Its corners are finished if that tells it;
    /// `middle_sampled` is told of each sample of a midpoint test.
    pub fn verdict<A: Attribute>(
        &self,
        attribute: &A,
        corners: &mut Corners<A::Output>,
        parameters: &Parameters,
        middle_sampled: impl Fn(),
    ) -> Verdict {
        let is_deepest = self.depth.saturating_add(attribute.levels_spared()) >= parameters.max_depth
            || self.is_deepest(parameters);
        match classes(corners, |c| attribute.outline_class(c)) {
            Classes::One => {}
            // No interpolant crosses a discontinuity; smaller cells leave fewer lines on it.
            _ if !is_deepest => return Verdict::Split,
            Classes::Two(both) => {
                let kind = self.parted(attribute, corners, both, parameters.angular_threshold_deg);
                return Verdict::Final(kind);
            }
            Classes::More => return Verdict::Final(Kind::Traced(Reason::Classes)),
        }
        if attribute.is_miss(attribute.outline_class(&corners[0])) {
            return if attribute.is_certainly_empty(self.pair, &self.cell) {
                Verdict::Final(Kind::Empty)
            } else if is_deepest {
                Verdict::Final(Kind::Traced(Reason::Guard))
            } else {
                Verdict::Split
            };
        }
        if attribute.outline_within(&corners[0]).is_some() {
            let outlines =
                corners.each_ref().map(|c| attribute.outline_within(c).unwrap_or_else(|| c.clone()));
            let by_outlines = self.smoothness(attribute, &outlines, parameters, |line| {
                middle_sampled();
                attribute.outline(line)
            });
            if by_outlines != Verdict::Final(Kind::Smooth(())) {
                return by_outlines;
            }
        }
        self.finish(attribute, corners);
        match classes(corners, |c| attribute.class(c)) {
            Classes::One => {}
            _ if !is_deepest => return Verdict::Split,
            // To tell a line's class it would have to be followed to its end.
            Classes::Two(_) => return Verdict::Final(Kind::Traced(Reason::Silhouette)),
            Classes::More => return Verdict::Final(Kind::Traced(Reason::Classes)),
        }
        if attribute.is_told_by_outline(&corners[0]) {
            return Verdict::Final(Kind::Smooth(()));
        }
        self.smoothness(attribute, corners, parameters, |line| {
            middle_sampled();
            attribute.sample(line)
        })
    }

    /// What is to be done with a cell of one class by how near to each other its corners are, and by the midpoint test:
    /// interpolated against exact at the cell's centre.
    fn smoothness<A: Attribute>(
        &self,
        attribute: &A,
        corners: &Corners<A::Output>,
        parameters: &Parameters,
        exact: impl Fn(LinePoint) -> A::Output,
    ) -> Verdict {
        // Smaller cells hold directions nearer to each other.
        let is_wide = spread_exceeds(attribute, corners.iter(), parameters.angular_threshold_deg);
        if self.is_deepest(parameters) {
            return Verdict::Final(if is_wide { Kind::Traced(Reason::Angle) } else { Kind::Smooth(()) });
        }
        if is_wide {
            return Verdict::Split;
        }
        let class = attribute.class(&corners[0]);
        let is_near = |at: [f64; 4]| {
            let exact = exact(self.line(self.cell.at(at)));
            let near = || quadrilinear(attribute, corners, at.map(A::Real::of));
            attribute.class(&exact) == class
                && attribute.distance(&near(), &exact) <= parameters.distance_threshold
        };
        let is_smooth = is_near([0.5; 4]) && attribute.second_look().is_none_or(is_near);
        if is_smooth { Verdict::Final(Kind::Smooth(())) } else { Verdict::Split }
    }

    /// How a final cell of two classes of outlines answers: its lines are located and interpolated if on one side of the
    /// discontinuity, misses apart, there are samples that suffice (§2.5).
    fn parted<A: Attribute>(
        &self,
        attribute: &A,
        corners: &mut Corners<A::Output>,
        both: [u32; 2],
        threshold_deg: f64,
    ) -> Kind {
        let hit = || both.into_iter().filter(|&class| !attribute.is_miss(class));
        let is_defined = |side: &[usize]| linear_weights(side, [A::Real::of(0.5); 4]).is_some();
        if !hit().any(|class| is_defined(&side(attribute, corners, class))) {
            return Kind::Traced(Reason::Silhouette);
        }
        self.finish(attribute, corners);
        let mut why = None;
        for class in hit() {
            match usable(attribute, corners, class, threshold_deg) {
                Ok(side) if is_defined(&side) => return Kind::TwoClasses(()),
                Ok(_) => {}
                Err(reason) => why = Some(reason),
            }
        }
        Kind::Traced(why.unwrap_or(Reason::Silhouette))
    }

    /// The output of a line of a cell of two classes, interpolated from samples of its own, or why it is traced.
    pub fn of_own_class<A: Attribute>(
        &self,
        attribute: &A,
        corners: &Corners<A::Output>,
        stuv: [f64; 4],
        threshold_deg: f64,
    ) -> Result<A::Output, Reason> {
        let outline = attribute.locate(self.line(stuv)).ok_or(Reason::Silhouette)?;
        let class = attribute.outline_class(&outline);
        if attribute.is_miss(class) {
            return Ok(outline);
        }
        let side = usable(attribute, corners, class, threshold_deg)?;
        let fractions = self.cell.fractions(&stuv.map(A::Real::of));
        let weights = linear_weights(&side, fractions).ok_or(Reason::Silhouette)?;
        let part = |(&bits, weight)| (weight, &corners[bits]);
        let parts: Vec<_> = side.iter().zip(weights).map(part).collect();
        Ok(attribute.told(&outline, attribute.interpolate(&parts)))
    }
}

/// The classes of a cell's corners.
enum Classes {
    One,
    Two([u32; 2]),
    More,
}

fn classes<T>(corners: &Corners<T>, class_of: impl Fn(&T) -> u32) -> Classes {
    let first = class_of(&corners[0]);
    let Some(other) = corners.iter().map(&class_of).find(|&c| c != first) else { return Classes::One };
    let is_third = |c: u32| c != first && c != other;
    if corners.iter().map(class_of).any(is_third) { Classes::More } else { Classes::Two([first, other]) }
}

/// The corners on one side of a discontinuity: those whose outlines are of a class.
fn side<A: Attribute>(attribute: &A, corners: &Corners<A::Output>, class: u32) -> Vec<usize> {
    (0..16).filter(|&bits| attribute.outline_class(&corners[bits]) == class).collect()
}

/// The corners on one side, if they are of one class in all and their directions within the threshold, or why not.
fn usable<A: Attribute>(
    attribute: &A,
    corners: &Corners<A::Output>,
    class: u32,
    threshold_deg: f64,
) -> Result<Vec<usize>, Reason> {
    let side = side(attribute, corners, class);
    let whole = |bits: usize| attribute.class(&corners[bits]);
    if side.iter().any(|&bits| whole(bits) != whole(side[0])) {
        return Err(Reason::Classes);
    }
    if spread_exceeds(attribute, side.iter().map(|&bits| &corners[bits]), threshold_deg) {
        return Err(Reason::Angle);
    }
    Ok(side)
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
fn linear_weights<R: Real>(usable: &[usize], fractions: [R; 4]) -> Option<Vec<R>> {
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

/// Whether two of the outputs' directions differ by more than the threshold.
fn spread_exceeds<'a, A: Attribute>(
    attribute: &A,
    outputs: impl Iterator<Item = &'a A::Output>,
    threshold_deg: f64,
) -> bool
where
    A::Output: 'a,
{
    let directions: Vec<_> = outputs.filter_map(|o| attribute.direction(o)).collect();
    let threshold = (attribute.angular_share() * threshold_deg).to_radians();
    let cosine = |angle: f64| A::Real::of(angle.cos());
    // All within half of it of one of them are within it of each other.
    let near = cosine(0.5 * threshold);
    if directions.iter().all(|a| a.dot(directions[0]) >= near) {
        return false;
    }
    let least = cosine(threshold);
    directions.iter().enumerate().any(|(i, a)| directions[..i].iter().any(|b| a.dot(*b) < least))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Counted;

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
