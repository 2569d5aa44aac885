//! Whether a line may touch a box, in f64: how lines search a [`BoxTree`](crate::geometry::BoxTree).

use glam::DVec3;

use crate::geometry::numeric::gamma;
use crate::geometry::{Bounds, Line};

/// Whether a line may touch a box: separating axes, without division, so without NaN (Ericson, *Real-Time Collision
/// Detection*, §5.3.3).
pub(super) struct LineBoxTest {
    origin: DVec3,
    dir: DVec3,
    dir_abs: DVec3,
}

/// The cross product and the extent each err by γ₅ of |m| + |h|; the shear of the vertices by γ₃ more.
const BOX_MARGIN: f64 = gamma(16);

impl LineBoxTest {
    /// Of `line`.
    pub fn new(line: &Line) -> Self {
        Self { origin: line.origin(), dir: line.dir(), dir_abs: line.dir().abs() }
    }

    /// Whether the line, or the exact test's rounding of it, may touch `b`.
    pub fn may_hit(&self, b: &Bounds) -> bool {
        let half = 0.5 * (b.max - b.min);
        let centre = 0.5 * (b.max + b.min) - self.origin;
        let moment = centre.cross(self.dir).abs();
        let reach = DVec3::new(
            half.y * self.dir_abs.z + half.z * self.dir_abs.y,
            half.z * self.dir_abs.x + half.x * self.dir_abs.z,
            half.x * self.dir_abs.y + half.y * self.dir_abs.x,
        );
        let largest = b.min.abs().max(b.max.abs()) + self.origin.abs();
        let margin = BOX_MARGIN * (largest.x + largest.y + largest.z);
        moment.cmple(reach + margin).all()
    }
}
