//! The chord: how many millimetres of a line lie in a body.

use glam::DVec3;

use crate::exact::Body;
use crate::geometry::{Interval, Line};
use crate::linespace::{Cell, LinePoint, LineSpace, PlanePair};
use crate::ritree::Attribute;

/// A chord, as samples hold it. f32: its rounding, 6e-8 of the value, is far below any useful threshold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chord {
    /// Its length, mm.
    pub length_mm: f32,
    /// Where it begins on the way from the plane at 0 to the plane at 1 of the dominant axis, box units.
    pub entry: f32,
}

/// The chord of a line in one convex body.
///
/// Samples are exact. The distance of two chords is that of their lengths, in half the longest side of the body's box:
/// the unit of the distance threshold.
pub struct ChordLength<'a> {
    body: &'a Body,
    space: LineSpace,
    unit_mm: f64,
}

/// A separation below this is not believed: heights over the planes that bound a cell's shaft are sums of six products
/// of box units up to 3, so they err by less than γ₁₆ · 18 < 1e-13.
const LEAST_SEPARATION: f64 = 1e-12;

impl<'a> ChordLength<'a> {
    /// The chords of `body`. `None` if it is not convex (a line may then have several chords) or its box is flat.
    pub fn new(body: &'a Body) -> Option<Self> {
        body.convexity().ok()?;
        let space = LineSpace::new(body.bounds())?;
        Some(Self { body, space, unit_mm: 0.5 * body.bounds().size().max_element() })
    }

    /// The line space of the body's box.
    pub fn space(&self) -> &LineSpace {
        &self.space
    }

    /// A chord as a stretch of the line it was found for, mm from the line's origin. `None` if it has no length.
    pub fn stretch(&self, chord: Chord, line: &Line, point: LinePoint) -> Option<Interval> {
        let [k, ..] = point.pair.axes();
        // Box coordinate k along the line: o + t·d.
        let (o, d) = (
            (line.origin()[k] - self.space.min()[k]) / self.space.size()[k],
            line.dir()[k] / self.space.size()[k],
        );
        let length = f64::from(chord.length_mm);
        let entry = (f64::from(chord.entry) - o) / d;
        // Against the axis, the chord is walked from its other end.
        let start = if d > 0.0 { entry } else { entry - length };
        Interval::new(start, start + length).filter(|part| part.length() > 0.0)
    }
}

/// The classes of patches: a body's surface, and nothing.
const HIT: u32 = 1;
const MISS: u32 = 0;

impl Attribute for ChordLength<'_> {
    /// `None` if the line misses.
    type Output = Option<Chord>;

    fn sample(&self, point: LinePoint) -> Option<Chord> {
        let mut parts = Vec::new();
        let line = self.space.line_of(point)?;
        self.body.chords(&line, &mut parts);
        let chord = parts.first()?;
        let [k, ..] = point.pair.axes();
        let first = if line.dir()[k] > 0.0 { chord.start() } else { chord.end() };
        let entry = (line.at(first)[k] - self.space.min()[k]) / self.space.size()[k];
        Some(Chord { length_mm: chord.length() as f32, entry: entry as f32 })
    }

    fn class(&self, output: &Self::Output) -> u32 {
        if output.is_some() { HIT } else { MISS }
    }

    fn is_miss(&self, class: u32) -> bool {
        class == MISS
    }

    fn distance(&self, a: &Self::Output, b: &Self::Output) -> f64 {
        let length = |chord: &Self::Output| chord.map_or(0.0, |c| f64::from(c.length_mm));
        (length(a) - length(b)).abs() / self.unit_mm
    }

    fn interpolate(&self, parts: &[(f64, &Self::Output)]) -> Self::Output {
        let (mut length, mut entry) = (0.0, 0.0);
        for (weight, chord) in parts.iter().filter_map(|(w, chord)| chord.map(|c| (w, c))) {
            length += weight * f64::from(chord.length_mm);
            entry += weight * f64::from(chord.entry);
        }
        Some(Chord { length_mm: length as f32, entry: entry as f32 })
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
            let highest = self.body.surface().farthest_vertex(n, min, f64::NEG_INFINITY);
            highest.is_some_and(|(height, _)| height - at_0 < -LEAST_SEPARATION)
        })
    }
}
