//! The frame in which a line is the third axis: vertices are sheared along it, not turned, so that each is rounded by
//! itself (Woop, Benthin & Wald 2013, <https://jcgt.org/published/0002/01/05/>).
//!
//! ```text
//!      y │   · v            y │ · v      across = (p.x − sx·p.z, p.y − sy·p.z)
//!        │  ╱               (0,0)        along  =  p.z / d.z
//!      o ●───── z   ───▶      ●── x      with p = v − o, sx = d.x/d.z, sy = d.y/d.z, and z the axis along which the
//!         ╲ line             (the line)  direction is longest: |sx|, |sy| ≤ 1
//! ```

use glam::DVec3;

use crate::geometry::Line;
use crate::geometry::numeric::settled;

/// A vertex in the line's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sheared {
    /// See [`Across::place`].
    pub across: [f64; 2],
    /// See [`Shear::along`].
    pub along: f64,
}

/// What is across a line in its frame. Counter-clockwise seen against the line stays counter-clockwise.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Across {
    origin: DVec3,
    /// What x, y and z of a place add to its coordinates across: 1 for the axis that becomes the coordinate, less the
    /// slope for the axis along the line, else 0.
    rows: [[f64; 2]; 3],
}

impl Across {
    /// For the line from `origin` along `dir`, which may have any length but 0.
    #[inline(always)]
    pub fn of(origin: DVec3, dir: DVec3) -> Self {
        Self::by_axes(origin, dir, axes_of(dir))
    }

    #[inline(always)]
    fn by_axes(origin: DVec3, dir: DVec3, [first, second, z]: [usize; 3]) -> Self {
        let d = dir.to_array();
        // Origin, slopes and vertices are multiples of 2⁻²⁵², so coordinates across of 2⁻⁵⁰⁴ and their products of 2⁻¹⁰⁰⁸:
        // nothing underflows, and the exact signs are exact.
        let [to_first, to_second] = [first, second].map(|axis| settled(-d[axis] / d[z]));
        // Chosen, not stored by index: what is stored piecemeal is slow to load whole.
        let part = |axis: usize, own: usize, slope: f64| {
            if axis == own {
                1.0
            } else if axis == z {
                slope
            } else {
                0.0
            }
        };
        let row = |axis: usize| [part(axis, first, to_first), part(axis, second, to_second)];
        Self { origin: DVec3::from(origin.to_array().map(settled)), rows: [row(0), row(1), row(2)] }
    }

    /// Where `vertex` lies across the line, which is at (0, 0): a function of the vertex and the line alone, whichever face
    /// asks.
    ///
    /// Each coordinate is the sum of two products, one with 1, and errs by γ₂ of the one and γ₄ of the other (difference,
    /// slope, product, sum): γ₄ of twice the largest coordinate of v − o. The products with 0 are exact.
    #[inline(always)]
    pub fn place(&self, vertex: DVec3) -> [f64; 2] {
        let p = vertex - self.origin;
        let [x, y, z] = self.rows;
        [(p.x * x[0] + p.y * y[0]) + p.z * z[0], (p.x * x[1] + p.y * y[1]) + p.z * z[1]]
    }
}

/// The axes that become the first, second and third.
#[inline(always)]
fn axes_of(dir: DVec3) -> [usize; 3] {
    let (d, a) = (dir.to_array(), dir.abs());
    let z = if a.x >= a.y.max(a.z) { 0 } else { 1 + usize::from(a.z > a.y) };
    let (x, y) = ((z + 1) % 3, (z + 2) % 3);
    // A mirrored frame would turn all windings round.
    if d[z] < 0.0 { [y, x, z] } else { [x, y, z] }
}

/// A line's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shear {
    across: Across,
    axes: [usize; 3],
    /// What x, y and z of a place add to the place along.
    along: DVec3,
}

impl Shear {
    /// The frame of `line`; places along are in its direction's length.
    #[inline(always)]
    pub fn new(line: &Line) -> Self {
        let dir = line.dir();
        let axes = axes_of(dir);
        let z = axes[2];
        let inverse = 1.0 / dir.to_array()[z];
        let along = |axis: usize| if axis == z { inverse } else { 0.0 };
        Self {
            across: Across::by_axes(line.origin(), dir, axes),
            axes,
            along: DVec3::new(along(0), along(1), along(2)),
        }
    }

    /// See [`Across::place`].
    #[inline(always)]
    pub fn across(&self, vertex: DVec3) -> [f64; 2] {
        self.across.place(vertex)
    }

    /// Where `vertex` lies along the line, in the direction's length; errs by γ₃ of itself.
    #[inline(always)]
    pub fn along(&self, vertex: DVec3) -> f64 {
        (vertex - self.across.origin).dot(self.along)
    }

    /// `vertex` in this frame.
    #[inline(always)]
    pub fn apply(&self, vertex: DVec3) -> Sheared {
        Sheared { across: self.across(vertex), along: self.along(vertex) }
    }

    /// The axes that become the first, second and third.
    #[inline(always)]
    pub fn axes(&self) -> [usize; 3] {
        self.axes
    }

    /// By how much the first and second coordinate of the line grow with the third.
    #[inline(always)]
    pub fn slopes(&self) -> [f64; 2] {
        self.across.rows[self.axes[2]].map(|x| -x)
    }
}
