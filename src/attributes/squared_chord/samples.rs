//! Exact chords of lines in a cell, to fit it to and to test the fit on.

use super::cubic::Local;
use super::{SquaredChord, quartic};
use crate::exact::{Record, Way};
use crate::geometry::Segment;
use crate::linespace::squared_span;
use crate::ritree::Place;

/// Exact chords of lines in a cell.
pub(super) struct Samples<'f, 'a> {
    fitter: &'f SquaredChord<'a>,
    place: &'f Place,
    locals: Vec<&'static Local>,
    pub hits: Vec<Hit>,
    pub misses: Vec<Miss>,
    /// Lines taken.
    pub count: usize,
}

/// A line that meets the body.
pub(super) struct Hit {
    pub line: usize,
    pub f: f64,
    pub quartic: f64,
    /// |d|² times λ in the middle of its first entry and its last exit.
    pub middle: f64,
    /// How often it leaves the body.
    pub parts: u32,
}

/// A line that does not.
pub(super) struct Miss {
    pub line: usize,
    pub quartic: f64,
}

/// Samples are lines from somewhat before the first plane to somewhat behind the second, so that the body is in between.
const OVERHANG: f64 = 0.01;

impl<'f, 'a> Samples<'f, 'a> {
    pub fn new(fitter: &'f SquaredChord<'a>, place: &'f Place) -> Self {
        Self {
            fitter,
            place,
            locals: Vec::with_capacity(160),
            hits: Vec::with_capacity(160),
            misses: Vec::new(),
            count: 0,
        }
    }

    /// A line's place in the cell.
    pub fn local(&self, line: usize) -> &'static Local {
        self.locals[line]
    }

    /// Takes the lines at some places of the cell.
    pub fn take(&mut self, places: &'static [Local]) {
        let axis = self.place.pair.axes()[0];
        let (centre, half) =
            (self.place.cell.centre(), 0.5 * (self.place.cell.high[0] - self.place.cell.low[0]));
        let stuv = |place: &Local| -> [f64; 4] { std::array::from_fn(|a| centre[a] + half * place[a]) };
        let mut rays = Vec::with_capacity(places.len());
        for place in places {
            let [start, end] = self.fitter.frame.ends(axis, stuv(place));
            let way = end - start;
            let ray = Segment::along(start - OVERHANG * way, (1.0 + 2.0 * OVERHANG) * way);
            rays.push(ray.expect("the planes of a frame are finite and apart"));
        }
        let mut ways = Ways(vec![None; rays.len()]);
        self.fitter.body.trace(self.fitter.engine, 0, &rays, &mut ways);
        for ((place, ray), way) in places.iter().zip(&rays).zip(&ways.0) {
            let (stuv, line) = (stuv(place), self.count);
            let quartic = quartic(&stuv);
            match way {
                Some(way) => {
                    let to_lambda = (1.0 + 2.0 * OVERHANG) / ray.length_mm();
                    let [a, b] = way.ends.map(|t| t * to_lambda - OVERHANG);
                    // A line along a face may leave and enter again within rounding; a convex body has one chord.
                    let share = if self.fitter.is_convex() { b - a } else { way.length * to_lambda };
                    let span = squared_span(&stuv);
                    self.hits.push(Hit {
                        line,
                        f: (span * share).powi(2),
                        quartic,
                        middle: span * 0.5 * (a + b),
                        parts: way.parts,
                    });
                }
                None => self.misses.push(Miss { line, quartic }),
            }
            self.locals.push(place);
            self.count += 1;
        }
    }
}

/// A ray's way through the body.
#[derive(Clone, Copy)]
struct Through {
    /// The first entry and the last exit, mm.
    ends: [f64; 2],
    /// What of it lies in the body, mm.
    length: f64,
    /// How often it leaves.
    parts: u32,
}

/// The ways of rays that meet the body.
struct Ways(Vec<Option<Through>>);

impl Record for Ways {
    const ASKS_FACES: bool = false;

    fn crossing(&mut self, ray: usize, t_mm: f64, _face: u32, way: Way) {
        let through = self.0[ray].get_or_insert(Through { ends: [t_mm; 2], length: 0.0, parts: 0 });
        let [a, b] = through.ends;
        through.ends = [t_mm.min(a), t_mm.max(b)];
        match way {
            Way::In => through.length -= t_mm,
            Way::Out => {
                through.length += t_mm;
                through.parts += 1;
            }
        }
    }
}
