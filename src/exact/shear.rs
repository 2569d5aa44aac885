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

/// A vertex in the line's frame: two coordinates across, and the place along the line in mm.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sheared {
    /// Where the line is (0, 0), mm.
    pub across: [f64; 2],
    /// The parameter of the line, mm from its origin.
    pub along: f64,
}

/// A line's frame. Counter-clockwise seen against the line stays counter-clockwise.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shear {
    origin: DVec3,
    axes: [usize; 3],
    slopes: [f64; 2],
    scale: f64,
}

impl Shear {
    /// The frame of `line`.
    #[inline(always)]
    pub fn new(line: &Line) -> Self {
        let d = line.dir();
        let z =
            if d.x.abs() >= d.y.abs().max(d.z.abs()) { 0 } else { 1 + usize::from(d.z.abs() > d.y.abs()) };
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        if d[z] < 0.0 {
            // A mirrored frame would turn all windings round.
            std::mem::swap(&mut x, &mut y);
        }
        Self { origin: line.origin(), axes: [x, y, z], slopes: [d[x] / d[z], d[y] / d[z]], scale: 1.0 / d[z] }
    }

    /// The axes that become the first, second and third.
    #[inline(always)]
    pub fn axes(&self) -> [usize; 3] {
        self.axes
    }

    /// By how much the first and second coordinate of the line grow with the third.
    #[inline(always)]
    pub fn slopes(&self) -> [f64; 2] {
        self.slopes
    }

    /// `vertex` in this frame: a function of the vertex and the line alone, whichever face asks.
    ///
    /// Across errs by γ₂ of |p.x| and γ₄ of |sx·p.z| (difference, slope, product, sum), along by γ₃ of |p.z / d.z|.
    #[inline(always)]
    pub fn apply(&self, vertex: DVec3) -> Sheared {
        let p = (vertex - self.origin).to_array();
        let [x, y, z] = self.axes;
        Sheared {
            across: [p[x] - self.slopes[0] * p[z], p[y] - self.slopes[1] * p[z]],
            along: p[z] * self.scale,
        }
    }
}
