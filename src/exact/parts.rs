//! The crossings of one line, put in order: which parts of it are in the body.
//!
//! ```text
//!   −1 ●━━━━━━● +1     −1 ●━━━━━━━━━━━━━━━● +1      depth 0 → 1 begins a part, 1 → 0 ends it
//!      ▓▓▓▓▓▓▓▓           ▓▓▓▓▓▓▓▓▓▓▓▓▓▓▓▓▓
//!               ├──────┤                            a face in whose plane the line lies is a part of its own;
//!      ▓▓▓▓▓▓▓▓▓▓▓▓▓▓▓▓▓  ▓▓▓▓▓▓▓▓▓▓▓▓▓▓▓▓▓         parts that touch are one
//! ```

use super::crossing::Crossing;
use super::record::{Record, Way};
use crate::geometry::Interval;

/// A part of the line in the body, and the faces at its ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Part {
    span: Interval,
    first_face: u32,
    last_face: u32,
}

/// Gathers the crossings of one line after another, then gives each line's parts.
#[derive(Clone, Debug, Default)]
pub(super) struct Parts {
    crossings: Vec<Through>,
    along: Vec<Part>,
}

/// A crossing through a face.
#[derive(Clone, Copy, Debug)]
struct Through {
    t: f64,
    winding: i32,
    face: u32,
}

impl Parts {
    /// Forgets the last line.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.crossings.clear();
        self.along.clear();
    }

    /// Whether the line meets nothing.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.crossings.is_empty() && self.along.is_empty()
    }

    /// Takes the line's crossing of `face`.
    #[inline(always)]
    pub fn add(&mut self, face: u32, crossing: Crossing) {
        match crossing {
            Crossing::None => {}
            Crossing::Through(t, winding) => self.crossings.push(Through { t, winding, face }),
            Crossing::Along(span) => self.along.push(Part { span, first_face: face, last_face: face }),
        }
    }

    /// Reports the crossings as they came to `record`, if the line lies in no face's plane; the whole line is meant, so that
    /// nothing need be cut. Otherwise as [`report`](Self::report).
    #[inline(always)]
    pub fn report_all(&mut self, ray: usize, record: &mut impl Record) {
        if !self.along.is_empty() {
            return self.report(ray, &Interval::EVERYTHING, record);
        }
        if let [a, b] = self.crossings[..] {
            // A line that grazes the body may have its two crossings swapped by rounding: it touches, no more.
            let (enter, leave) = if a.winding < 0 { (a, b) } else { (b, a) };
            if enter.t < leave.t {
                record.crossing(ray, enter.t, enter.face, Way::In);
                record.crossing(ray, leave.t, leave.face, Way::Out);
            }
            return;
        }
        for &Through { t, winding, face } in &self.crossings {
            record.crossing(ray, t, face, if winding < 0 { Way::In } else { Way::Out });
        }
    }

    /// Reports the parts within `reach` to `record`, in order: a part cut there ends there, and keeps its face.
    #[cold]
    pub fn report(&mut self, ray: usize, reach: &Interval, record: &mut impl Record) {
        for part in self.resolve() {
            if let Some(within) = part.span.intersection(reach).filter(|within| within.length() > 0.0) {
                record.crossing(ray, within.start(), part.first_face, Way::In);
                record.crossing(ray, within.end(), part.last_face, Way::Out);
            }
        }
    }

    /// The parts of the whole line, in order and disjoint.
    pub fn intervals(&mut self) -> impl Iterator<Item = Interval> + '_ {
        self.resolve().iter().map(|part| part.span)
    }

    fn resolve(&mut self) -> &[Part] {
        self.crossings.sort_unstable_by(|a, b| a.t.total_cmp(&b.t).then(a.winding.cmp(&b.winding)));
        let mut depth = 0;
        let mut begun = (0.0, 0);
        for &Through { t, winding, face } in &self.crossings {
            // A face wound counter-clockwise along the line looks along it: the line leaves.
            let before = depth;
            depth -= winding;
            if before == 0 && depth == 1 {
                begun = (t, face);
            } else if before == 1 && depth == 0 {
                let (start, first_face) = begun;
                let whole = Interval::new(start, t).filter(|span| span.length() > 0.0);
                self.along.extend(whole.map(|span| Part { span, first_face, last_face: face }));
            }
        }
        self.crossings.clear();
        merge(&mut self.along);
        &self.along
    }
}

/// Joins parts that overlap or touch.
fn merge(parts: &mut Vec<Part>) {
    if parts.len() < 2 {
        return;
    }
    parts.sort_unstable_by(|a, b| a.span.start().total_cmp(&b.span.start()));
    let mut merged = 0;
    for i in 1..parts.len() {
        let (last, next) = (parts[merged], parts[i]);
        if next.span.start() > last.span.end() {
            merged += 1;
            parts[merged] = next;
        } else if next.span.end() > last.span.end() {
            let span = Interval::new(last.span.start(), next.span.end()).unwrap_or(last.span);
            parts[merged] = Part { span, last_face: next.last_face, ..last };
        }
    }
    parts.truncate(merged + 1);
}
