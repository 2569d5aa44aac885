//! Axis-aligned boxes.

use glam::DVec3;

use super::Line;

/// An axis-aligned box, mm; empty until it is given a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// The least corner.
    pub min: DVec3,
    /// The greatest corner.
    pub max: DVec3,
}

impl Bounds {
    /// The box of nothing: any union with it is the other box.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// The smallest box around all points.
    pub fn of(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::with)
    }

    /// The smallest box around this one and `point`.
    pub fn with(self, point: DVec3) -> Self {
        Self { min: self.min.min(point), max: self.max.max(point) }
    }

    /// The smallest box around both.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Grown by `margin` mm on every side.
    pub fn grown(self, margin: f64) -> Self {
        Self { min: self.min - margin, max: self.max + margin }
    }

    /// Side lengths, mm.
    pub fn size(&self) -> DVec3 {
        self.max - self.min
    }

    /// The centre.
    pub fn centre(&self) -> DVec3 {
        0.5 * (self.min + self.max)
    }

    /// The length of the box's diagonal, mm.
    pub fn diagonal(&self) -> f64 {
        self.size().length()
    }

    /// Whether `line` passes the ball around the box, so that it may meet the box. A millionth more than the radius is far
    /// above rounding.
    pub fn ball_meets(&self, line: &Line) -> bool {
        let to_centre = self.centre() - line.origin();
        let reach = 0.5 * self.diagonal() * (1.0 + 1e-6);
        to_centre.cross(line.dir()).length_squared() <= reach * reach
    }

    /// The eight corners.
    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| {
            let pick = |bit: usize, low: f64, high: f64| if i >> bit & 1 == 0 { low } else { high };
            DVec3::new(
                pick(0, self.min.x, self.max.x),
                pick(1, self.min.y, self.max.y),
                pick(2, self.min.z, self.max.z),
            )
        })
    }

    /// Whether the boxes share a point.
    pub fn touches(&self, other: &Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// Whether `point` is in the box.
    pub fn contains(&self, point: DVec3) -> bool {
        self.min.cmple(point).all() && point.cmple(self.max).all()
    }

    /// The box's surface area, mm²; 0 if empty.
    pub fn area(&self) -> f64 {
        let s = self.size().max(DVec3::ZERO);
        2.0 * (s.x * s.y + s.y * s.z + s.z * s.x)
    }
}
