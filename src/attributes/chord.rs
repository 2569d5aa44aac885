//! The chord: how many millimetres of a line lie in a body.

use glam::DVec3;

use crate::exact::Body;
use crate::geometry::Interval;
use crate::linespace::{Cell, LinePoint, LineSpace, PlanePair};
use crate::ritree::Attribute;

/// The length of a line's intersection with one body.
///
/// Samples are exact chords, kept as f32: their rounding, 6e-8 of the length, is far below any useful threshold. The
/// distance of two chords is measured in half the longest side of the body's box, the unit of the distance threshold.
pub struct ChordLength<'a> {
    body: &'a Body,
    space: LineSpace,
    unit_mm: f64,
}

/// A separation below this is not believed: heights over the planes that bound a cell's shaft are sums of six products
/// of box units up to 3, so they err by less than γ₁₆ · 18 < 1e-13.
const LEAST_SEPARATION: f64 = 1e-12;

impl<'a> ChordLength<'a> {
    /// The chords of `body`. `None` if its box is flat, which no body's is.
    pub fn new(body: &'a Body) -> Option<Self> {
        let space = LineSpace::new(body.bounds())?;
        Some(Self { body, space, unit_mm: 0.5 * body.bounds().size().max_element() })
    }

    /// The line space of the body's box.
    pub fn space(&self) -> &LineSpace {
        &self.space
    }
}

/// The classes of patches: a body's surface, and nothing.
const HIT: u32 = 1;
const MISS: u32 = 0;

impl Attribute for ChordLength<'_> {
    /// The chord, mm; `None` if the line misses.
    type Output = Option<f32>;

    fn sample(&self, line: LinePoint) -> Option<f32> {
        let mut parts = Vec::new();
        self.body.chords(&self.space.line_of(line)?, &mut parts);
        (!parts.is_empty()).then(|| parts.iter().map(Interval::length).sum::<f64>() as f32)
    }

    fn class(&self, output: &Option<f32>) -> u32 {
        if output.is_some() { HIT } else { MISS }
    }

    fn is_miss(&self, class: u32) -> bool {
        class == MISS
    }

    fn distance(&self, a: &Option<f32>, b: &Option<f32>) -> f64 {
        (f64::from(a.unwrap_or(0.0)) - f64::from(b.unwrap_or(0.0))).abs() / self.unit_mm
    }

    fn interpolate(&self, parts: &[(f64, &Option<f32>)]) -> Option<f32> {
        Some(parts.iter().map(|(w, length)| w * f64::from(length.unwrap_or(0.0))).sum::<f64>() as f32)
    }

    fn is_symmetric(&self) -> bool {
        true
    }

    /// A cell's lines, between the planes, fill a shaft: the hull of its two rectangles. The shaft and the body are apart
    /// if a plane parts them; planes are tried that touch the shaft along its sides and its corners, eight in all,
    /// each against the body's farthest vertex.
    fn is_certainly_empty(&self, pair: PlanePair, cell: &Cell) -> bool {
        let [k, i, j] = pair.axes();
        let (min, size) = (self.space.min(), self.space.size());
        let directions = [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)];
        directions.iter().any(|&(a, b)| {
            let (a, b) = (f64::from(a), f64::from(b));
            // The least value of a·x_i + b·x_j among the cell's lines: `front` on its plane, `back` on the other,
            // linear in between.
            let least = |w: f64, axis: usize| w * if w > 0.0 { cell.low[axis] } else { cell.high[axis] };
            let front = least(a, 0) + least(b, 1);
            let back = least(a, 2) + least(b, 3);
            let (at_0, at_1) = if pair.is_reversed() { (back, front) } else { (front, back) };
            // The body lies below if a·x_i + b·x_j − (at_0 + (at_1 − at_0)·x_k) < 0 at each of its points.
            let mut n = DVec3::ZERO;
            n[i] = a;
            n[j] = b;
            n[k] = at_0 - at_1;
            let n = n / size;
            self.body.surface().support_mm(n) - n.dot(min) - at_0 < -LEAST_SEPARATION
        })
    }
}
