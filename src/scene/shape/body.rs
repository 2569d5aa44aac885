//! Convex bodies as equations: membership and chords in closed form.
//!
//! A body is a union of pieces with no common interior; a piece is where one quadratic inequality and a few
//! linear ones hold. The union is convex, so the chord of a line is the hull of its chords in the pieces.

use glam::DVec3;

use super::Cut;
use crate::geometry::{Interval, Line};

/// A quadratic inequality over local coordinates, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Quadric {
    /// `|(p − centre) / half_axes|² ≤ 1`.
    Ellipsoid { centre: DVec3, half_axes: DVec3 },
    /// An ellipse that shrinks linearly with z: `|(p_xy − c(z)) / half_axes| ≤ w(z)`, `w ≥ 0`, with
    /// `c(z) = centre + lean · (z − z0)` and `w(z) = 1 + growth · (z − z0)`. A cylinder has growth 0.
    Cone { z0: f64, centre: [f64; 2], lean: [f64; 2], half_axes: [f64; 2], growth: f64 },
}

impl Quadric {
    /// Whether `p` satisfies the inequality.
    pub fn contains(&self, p: DVec3) -> bool {
        match *self {
            Self::Ellipsoid { centre, half_axes } => ((p - centre) / half_axes).length_squared() <= 1.0,
            Self::Cone { z0, centre, lean, half_axes, growth } => {
                let dz = p.z - z0;
                let u = (p.x - centre[0] - lean[0] * dz) / half_axes[0];
                let v = (p.y - centre[1] - lean[1] * dz) / half_axes[1];
                let w = 1.0 + growth * dz;
                w >= 0.0 && u * u + v * v <= w * w
            }
        }
    }

    /// The part of a line that satisfies the inequality, mm along it.
    pub fn chord(&self, line: &Line) -> Option<Interval> {
        let (o, d) = (line.origin(), line.dir());
        match *self {
            Self::Ellipsoid { centre, half_axes } => {
                let (o, d) = ((o - centre) / half_axes, d / half_axes);
                // Measured from the point nearest to the centre, so that a distant origin costs no digits.
                let a = d.length_squared();
                let nearest = -o.dot(d) / a;
                let c = (o + nearest * d).length_squared() - 1.0;
                let half = (c <= 0.0).then(|| (-c / a).sqrt())?;
                Interval::new(nearest - half, nearest + half)
            }
            Self::Cone { z0, centre, lean, half_axes, growth } => {
                let dz = o.z - z0;
                let at = DVec3::new(
                    (o.x - centre[0] - lean[0] * dz) / half_axes[0],
                    (o.y - centre[1] - lean[1] * dz) / half_axes[1],
                    1.0 + growth * dz,
                );
                let by = DVec3::new(
                    (d.x - lean[0] * d.z) / half_axes[0],
                    (d.y - lean[1] * d.z) / half_axes[1],
                    growth * d.z,
                );
                in_upper_nappe(at, by)
            }
        }
    }
}

/// Where `u² + v² ≤ w²`, `w ≥ 0` along `(u, v, w) = at + t · by`.
fn in_upper_nappe(at: DVec3, by: DVec3) -> Option<Interval> {
    let a = by.x * by.x + by.y * by.y - by.z * by.z;
    let b = at.x * by.x + at.y * by.y - at.z * by.z;
    let c = at.x * at.x + at.y * at.y - at.z * at.z;
    let scale = by.length_squared();
    // A line along the cone's mantle: rounding decides the sign of `a`, the inequality is linear.
    if a.abs() <= 4.0 * f64::EPSILON * scale {
        let level = 4.0 * f64::EPSILON * (at.length_squared() * scale).sqrt();
        return match (b.abs() <= level, b > 0.0) {
            (true, _) => (c <= 0.0).then_some(Interval::EVERYTHING),
            (false, true) => Interval::new(f64::NEG_INFINITY, -0.5 * c / b),
            (false, false) => Interval::new(-0.5 * c / b, f64::INFINITY),
        };
    }
    // Measured from the vertex of the parabola, as for the ellipsoid.
    let middle = -b / a;
    let m = at + middle * by;
    let reduced = (m.x * m.x + m.y * m.y - m.z * m.z) / a;
    let half = (-reduced).max(0.0).sqrt();
    let (mut low, mut high) = (middle - half, middle + half);
    // Nearly along the mantle the vertex is far away and the nearer root a small difference of large numbers: take
    // it from the product of the roots instead.
    if a.abs() < 1e-3 * scale {
        let far = if middle > 0.0 { high } else { low };
        *(if middle > 0.0 { &mut low } else { &mut high }) = c / (a * far);
    }
    if a > 0.0 {
        (reduced <= 0.0 && m.z >= 0.0).then(|| Interval::new(low, high))?
    } else if by.z > 0.0 {
        // Steeper than the mantle: inside both nappes, one from each root on.
        Interval::new(high, f64::INFINITY)
    } else {
        Interval::new(f64::NEG_INFINITY, low)
    }
}

/// One quadratic inequality, if any, and linear ones.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Piece {
    pub quadric: Option<Quadric>,
    pub half_spaces: Vec<Cut>,
}

impl Piece {
    fn contains(&self, p: DVec3) -> bool {
        self.quadric.is_none_or(|q| q.contains(p)) && self.half_spaces.iter().all(|h| h.height(p) <= 0.0)
    }

    /// The chord, leaving out the half-spaces of `ignored`: for lines that lie in them, where rounding would decide.
    fn chord(&self, line: &Line, ignored: &[Cut]) -> Option<Interval> {
        let quadric = match self.quadric {
            Some(q) => q.chord(line)?,
            None => Interval::EVERYTHING,
        };
        let kept = self.half_spaces.iter().filter(|h| !ignored.contains(h));
        kept.map(|h| h.chord(line)).try_fold(quadric, |sofar, part| sofar.intersection(&part?))
    }
}

/// A convex union of pieces, local coordinates.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Body {
    pub pieces: Vec<Piece>,
    /// The half-spaces among the pieces' own whose planes carry flat faces of the body.
    pub flat_sides: Vec<Cut>,
}

impl Body {
    pub fn contains(&self, p: DVec3) -> bool {
        self.pieces.iter().any(|piece| piece.contains(p))
    }

    /// The line's part in the body, mm along it; may be of length 0. `ignored`: see [`Piece::chord`].
    pub fn chord(&self, line: &Line, ignored: &[Cut]) -> Option<Interval> {
        self.pieces
            .iter()
            .filter_map(|piece| piece.chord(line, ignored))
            .reduce(|a, b| Interval::new(a.start().min(b.start()), a.end().max(b.end())).unwrap_or(a))
    }
}
