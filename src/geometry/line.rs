//! Directed lines and segments, in millimetres.

use glam::DVec3;

use super::Interval;

/// A direction of unit length, finite by construction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitDir(DVec3);

impl UnitDir {
    /// The direction of `v`. `None` if `v` is zero or has a component that is not finite.
    ///
    /// Components of any magnitude are accepted, denormal ones included: the vector is scaled by its largest
    /// component before its length is taken, so neither overflow nor underflow can lose a direction.
    pub fn new(v: DVec3) -> Option<Self> {
        let largest = v.abs().max_element();
        if !v.is_finite() || largest == 0.0 {
            return None;
        }
        // Dividing (not multiplying by a reciprocal) keeps denormal magnitudes from overflowing.
        let scaled = v / largest;
        Some(Self(scaled / scaled.length()))
    }

    /// The vector; its length is 1 within two units in the last place.
    pub fn get(self) -> DVec3 {
        self.0
    }

    /// The opposite direction.
    pub fn reversed(self) -> Self {
        Self(-self.0)
    }
}

/// A directed line: all points `origin + t · dir`, `t` in millimetres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    origin: DVec3,
    dir: UnitDir,
}

impl Line {
    /// The line through `origin` along `dir`. `None` if the origin is not finite.
    pub fn new(origin: DVec3, dir: UnitDir) -> Option<Self> {
        origin.is_finite().then_some(Self { origin, dir })
    }

    /// The point at `t = 0`, mm.
    #[inline]
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// The direction as a vector of unit length.
    #[inline]
    pub fn dir(&self) -> DVec3 {
        self.dir.0
    }

    /// The point at `t` mm from the origin.
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + t * self.dir.0
    }

    /// The same points, walked the other way.
    pub fn reversed(&self) -> Self {
        Self { origin: self.origin, dir: self.dir.reversed() }
    }
}

/// The straight path from a source to a target: the part `0 ≤ t ≤ length` of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    line: Line,
    length_mm: f64,
}

impl Segment {
    /// The path from `source` to `target`, mm. `None` if they coincide or are not finite.
    pub fn between(source: DVec3, target: DVec3) -> Option<Self> {
        Self::along(source, target - source)
    }

    /// The path from `source` to `source + path`, mm; the same bits as [`between`](Self::between) gives for a target that
    /// is `path` away. `None` if the path is zero or something is not finite.
    pub fn along(source: DVec3, path: DVec3) -> Option<Self> {
        let line = Line::new(source, UnitDir::new(path)?)?;
        let length_mm = path.length();
        (length_mm.is_finite() && length_mm > 0.0).then_some(Self { line, length_mm })
    }

    /// The supporting line; its origin is the source.
    #[inline]
    pub fn line(&self) -> &Line {
        &self.line
    }

    /// The part of the line that is the path: from 0 to its length, mm.
    #[inline]
    pub fn reach(&self) -> Interval {
        // The constructor keeps the length positive and finite.
        Interval::new(0.0, self.length_mm).unwrap_or(Interval::EVERYTHING)
    }

    /// The distance from source to target, mm.
    pub fn length_mm(&self) -> f64 {
        self.length_mm
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn denormal_and_huge_vectors_have_directions() {
        for scale in [f64::MIN_POSITIVE / 4.0, 1e-300, 1.0, 1e300] {
            let dir = UnitDir::new(DVec3::new(scale, 0.0, -scale)).expect("a direction").get();
            assert!((dir.length() - 1.0).abs() <= 4.0 * f64::EPSILON, "{scale}: {dir}");
            assert_eq!(dir.x, -dir.z);
        }
    }

    #[test]
    fn zero_and_non_finite_vectors_have_none() {
        for v in [DVec3::ZERO, DVec3::new(f64::NAN, 1.0, 0.0), DVec3::new(f64::INFINITY, 1.0, 0.0)] {
            assert_eq!(UnitDir::new(v), None);
        }
        let dir = UnitDir::new(DVec3::X).expect("a direction");
        assert_eq!(Line::new(DVec3::new(0.0, f64::NAN, 0.0), dir), None);
        assert_eq!(Segment::between(DVec3::ONE, DVec3::ONE), None);
    }
}
