//! Lines in a body's own frame, in f32, and how far rounding may have moved them there.
//!
//! ```text
//!            ╭───────╮ |q| ≤ 1        q = (p − centre) · scale, a power of two
//!   o ──────●┼───────┼──▶             the origin is moved along the line to ● near the centre: where the line meets
//!            ╰───────╯                the body, no coordinate and no parameter is larger than 1
//! ```
//!
//! Boxes and triangles are sifted in f32, eight at a time. A sieve may let through too much, but nothing that
//! the exact test would count may be held back: whatever the rounding of the body, of the line, of the sieve and of the
//! exact test itself can amount to is summed up in one length, the *margin*, on either side of the line.

use glam::DVec3;

use super::super::shear::Shear;
use crate::geometry::numeric::gamma;
use crate::geometry::{ClosedMesh, Line};

/// The frame of a body: its centre at the origin, its farthest vertex within 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    centre: DVec3,
    scale: f64,
    /// The distance of the farthest vertex, in this frame.
    radius: f64,
}

/// Half a unit in the last place of a f32 between 1 and 2.
const ROUNDOFF: f64 = f32::EPSILON as f64 / 2.0;

/// What f32 can amount to, in units of `ROUNDOFF`. No coordinate in the frame is larger than 1 (of the line's point:
/// 1 + margin), no difference of two larger than 2, no such difference sheared larger than 4.
///
/// A triangle's corner, in each coordinate across the line: the corner and its share by the slope, ½ + ½; the line's
/// point alike, 1 + 1; the slope, ½ of a difference of 2, 1; the two differences, 2 + 2; the product, 1; the last
/// difference, 2: together 11. A box's side: the line's point, 1; the direction, over a parameter of 1, 1; difference,
/// reciprocal and product, which amount to moving the side by γ₃ of its distance from the line's point, 3 · 2 and a
/// little: together less than 9.
const F32_ROUNDOFFS: f64 = 16.0;

/// What f64 can amount to, as a share of the distance of the line's origin: the exact test rounds a vertex by γ₆ at most;
/// vertex and origin come into the frame by γ₁ each, and the step along the line to the centre is γ₂ of both its terms.
const F64_SHARE: f64 = gamma(16);

/// Directions are kept off zero by this much, so that nothing is divided by it. Over a parameter of 1 it is nothing to the margin.
const LEAST_SLOPE: f32 = 1.0 / (1u64 << 40) as f32;

/// Where a f64 keeps its exponent.
const EXPONENT_BITS: u64 = 0x7ff << 52;

/// Beyond this margin, which is that of a line whose origin is some 10¹¹ bodies away, nothing is sifted: so that the line's
/// point is never farther from the centre than 1 and a thousandth …
const LARGEST_MARGIN: f32 = 1.0 / 1024.0;
/// … and with this one no box and no triangle is held back.
const EVERYTHING: f32 = 16.0;

/// A line in a body's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalLine {
    /// A point of the line, moved by the margin so that each side of a box it enters by comes sooner …
    pub before: [f32; 3],
    /// … and each side it leaves by later.
    pub behind: [f32; 3],
    /// The reciprocals of the direction's components.
    pub inverse: [f32; 3],
    /// Which of them are negative.
    pub backwards: [bool; 3],
    /// A point of the line.
    pub origin: [f32; 3],
    /// The axes and slopes of the line's shear.
    pub axes: [usize; 3],
    pub slopes: [f32; 2],
    pub margin: f32,
    /// Between which parameters, mm, the line may meet the body.
    pub reach_mm: [f64; 2],
}

impl Frame {
    /// The frame of a surface.
    pub fn of(surface: &ClosedMesh) -> Self {
        let centre = surface.bounds().centre();
        let vertices = surface.mesh().vertices.iter();
        let farthest = vertices.map(|&v| (v - centre).length_squared()).fold(0.0, f64::max).sqrt();
        // The exponent alone: scaling by a power of two rounds nothing.
        let scale = 0.5 / f64::from_bits(farthest.to_bits() & EXPONENT_BITS);
        let scale = if scale.is_normal() { scale } else { 1.0 };
        Self { centre, scale, radius: farthest * scale }
    }

    /// A point in the frame.
    pub fn place(&self, point: DVec3) -> DVec3 {
        (point - self.centre) * self.scale
    }

    /// `line` in the frame, sheared as by `shear`. `None` if it passes the body by.
    #[inline(always)]
    pub fn line(&self, line: &Line, shear: &Shear) -> Option<LocalLine> {
        let dir = line.dir();
        let origin = self.place(line.origin());
        let to_centre = -origin.dot(dir);
        let nearest = origin + to_centre * dir;
        let distance = origin.x.abs() + origin.y.abs() + origin.z.abs();
        let margin = F32_ROUNDOFFS * ROUNDOFF + F64_SHARE * (distance + 1.0);
        let reach = self.radius + margin;
        if nearest.length_squared() > reach * reach {
            return None;
        }
        let reach_mm = [to_centre - reach, to_centre + reach].map(|t| t / self.scale);
        Some(LocalLine::new(nearest, dir, margin as f32, shear, reach_mm))
    }
}

impl LocalLine {
    #[inline(always)]
    fn new(point: DVec3, dir: DVec3, margin: f32, shear: &Shear, reach_mm: [f64; 2]) -> Self {
        // Also where the origin is so far that its place in the frame is no number.
        let (point, margin) =
            if margin < LARGEST_MARGIN { (point, margin) } else { (DVec3::ZERO, EVERYTHING) };
        let (point, dir) = (point.to_array(), dir.to_array());
        let slope = dir.map(|d| {
            let d = d as f32;
            if d.abs() < LEAST_SLOPE { LEAST_SLOPE.copysign(d) } else { d }
        });
        let ahead = slope.map(|d| f64::from(margin.copysign(d)));
        Self {
            before: std::array::from_fn(|i| (point[i] + ahead[i]) as f32),
            behind: std::array::from_fn(|i| (point[i] - ahead[i]) as f32),
            inverse: slope.map(|d| 1.0 / d),
            backwards: slope.map(|d| d < 0.0),
            origin: point.map(|x| x as f32),
            axes: shear.axes(),
            slopes: shear.slopes().map(|s| s as f32),
            margin,
            reach_mm,
        }
    }
}
