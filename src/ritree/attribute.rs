//! What a tree asks of whoever knows the objects.

use crate::geometry::{Real, Vec3};
use crate::linespace::{Cell, LinePoint, PlanePair};

/// How lines are interpolated between the corners of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scheme {
    /// By all 16, linearly in each of the four coordinates (§2.4).
    Quadrilinear,
    /// By the 5 of the simplex that holds the line, linearly: a third of the operations. What bends one way along one side and
    /// the other way along another is told worse, all else better.
    Simplicial,
}

/// How cells are sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampling {
    /// Cells are looked at on one of so many levels, counted from the greatest depth, and on the first of those
    /// [spared](Self::levels_spared); on all others they are split unseen. Four levels halve all sides of a cell.
    pub levels_per_look: u32,
    /// How many levels before the greatest depth cells end that hold a discontinuity, or all of whose corners miss: their lines
    /// are traced, and where few lines ask for a cell that is less than to sample it.
    pub levels_spared: u32,
    /// Whether the attribute remembers what it sampled last: no corners are then kept for cells that may never be looked at.
    pub remembers: bool,
    /// How lines are interpolated.
    pub scheme: Scheme,
    /// Whether lines are interpolated in a cell that holds a discontinuity, if they lie in a simplex whose corners fit together.
    /// Not for surfaces that may hide parts of their own.
    pub parts: bool,
    /// Whether [`are_joined`](Attribute::are_joined) proves what it says: lines are then interpolated in a simplex as well where
    /// the corners of a cell are all joined, but directions too far apart.
    pub tells_joined: bool,
}

impl Sampling {
    /// The paper's way (§2.3, §2.4).
    pub const PAPER: Self = Self {
        levels_per_look: 1,
        levels_spared: 0,
        remembers: false,
        scheme: Scheme::Quadrilinear,
        parts: false,
        tells_joined: false,
    };
}

/// A geometric attribute of lines near one object: what an RI-tree samples and interpolates.
///
/// The tree knows lines and cells, the attribute knows the object. Every method must be a pure function of its
/// arguments: the tree relies on it for answers that depend neither on the order of queries nor on what is cached.
pub trait Attribute: Sync {
    /// What a line's sample is: a length, a point and a normal, an exit ray.
    type Output: Clone + Send + Sync;

    /// The numbers that queries are computed in: f64, unless their operations are counted.
    type Real: Real;

    /// The exact output of a line.
    fn sample(&self, line: LinePoint) -> Self::Output;

    /// As much of the output as tells its [`outline_class`](Self::outline_class): corners are sampled so, since most lie where
    /// a discontinuity is cut out, and [finished](Self::finish) where their cell lies on one side.
    fn outline(&self, line: LinePoint) -> Self::Output {
        self.sample(line)
    }

    /// What is known of the class from the outline: where it differs, classes do.
    fn outline_class(&self, output: &Self::Output) -> u32 {
        self.class(output)
    }

    /// How cells are sampled.
    fn sampling(&self) -> Sampling {
        Sampling::PAPER
    }

    /// The outline within an output, where outlines have [distances](Self::distance) and [directions](Self::direction) of their
    /// own: corners are then finished for cells only that these leave whole.
    fn outline_within(&self, _output: &Self::Output) -> Option<Self::Output> {
        None
    }

    /// Whether a whole output's distances and directions are those of the [outline within](Self::outline_within).
    fn is_told_by_outline(&self, _output: &Self::Output) -> bool {
        false
    }

    /// Makes the outline of a line its sample, unless it is.
    fn finish(&self, _line: LinePoint, _output: &mut Self::Output) {}

    /// The output of a line that misses, for cells that are [certainly empty](Self::is_certainly_empty).
    fn miss(&self) -> Self::Output;

    /// The equivalence class of the patch that the sample met; outputs are interpolated within one class only. A miss
    /// is a class too. Attributes without discontinuities have one class.
    fn class(&self, output: &Self::Output) -> u32;

    /// The distance between two outputs of one class, in the unit of the distance threshold.
    fn distance(&self, a: &Self::Output, b: &Self::Output) -> f64;

    /// The output that the weighted outputs of one class make; weights sum to 1, but may be negative where five or
    /// more usable samples are extrapolated.
    fn interpolate(&self, parts: &[(Self::Real, &Self::Output)]) -> Self::Output;

    /// Whether lines of a cell with exactly two classes of outlines are [located](Self::locate), by the one intersection test of
    /// §2.5. If not, that test costs as much as tracing the line, which is then done instead.
    fn locates(&self) -> bool {
        false
    }

    /// The outline of a line that is asked for.
    fn locate(&self, line: LinePoint) -> Self::Output {
        self.outline(line)
    }

    /// The output of a line that was [located](Self::locate) and interpolated from samples of its class: what its outline
    /// knows, it knows better.
    fn told(&self, _outline: &Self::Output, interpolated: Self::Output) -> Self::Output {
        interpolated
    }

    /// Whether the outputs of two lines, which hit and are of one class, lie side by side on what is hit. Surfaces may hide parts of
    /// their own: one class is then no proof.
    fn are_joined(&self, _lines: [LinePoint; 2], _outputs: [&Self::Output; 2]) -> bool {
        true
    }

    /// Whether the class stands for lines that do not meet the object.
    fn is_miss(&self, class: u32) -> bool;

    /// The direction of an output, for the angular threshold. `None` for attributes without directions.
    fn direction(&self, _output: &Self::Output) -> Option<Vec3<Self::Real>> {
        None
    }

    /// What of the angular threshold directions may differ by: less than all of it where what is told turns farther than they do.
    fn angular_share(&self) -> f64 {
        1.0
    }

    /// Whether a line and its reverse have the same output, so that +X and −X can share a tree.
    fn is_symmetric(&self) -> bool {
        false
    }

    /// Whether no line of the cell meets the object, *proved*. Corners that all miss prove nothing: an object smaller than
    /// the cell may lie between them. `false` where in doubt.
    fn is_certainly_empty(&self, pair: PlanePair, cell: &Cell) -> bool;
}
