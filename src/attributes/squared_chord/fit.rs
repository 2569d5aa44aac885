//! What becomes of a cell: a pure function of it.

use glam::DVec3;

use super::cubic::{Cubic, Design, FIT_LINES, Local, TEST_LINES};
use super::{ChordLeaf, ChordModel, SquaredChord, quartic};
use crate::exact::{Record, Way};
use crate::geometry::Segment;
use crate::linespace::{LineFrame, squared_span};
use crate::ritree::{Fit, Fitted, KeepableFit, Place, TreeShape};

/// The largest cells are of a level between these: 3/8 to 3/32 of the body's box wide. In larger ones, few lines hit in too
/// many cells.
const LEVELS: std::ops::Range<u32> = 3..6;

/// Where more than this share of lines would be traced in the smallest cells, all are, without a look.
const HOPELESS: f64 = 0.8;

/// A level's cells are the largest if those of the next would leave no more than this share of the hits less to be traced.
const WORTH_A_LEVEL: f64 = 0.02;

/// Cells are split no more than so many levels below the first: more of them would lie along edges and be traced all the same.
const MOST_SPLITS: u32 = 1;

/// A cell is split if that would spare this share of its hits to be traced.
const WORTH_SPLITTING: f64 = 0.15;

/// The largest error that samples show, times this, is taken for the bound of all.
const SAFETY: f64 = 1.75;

/// Of 64 lines and 35 coefficients, a fit takes in so much of the lines' own errors that those left are smaller than others' by
/// √(1 − 35/64).
const OF_FIT: f64 = 1.5;

/// What halving a cell divides the error of a cubic by: 2⁴ less what facets and outlines leave.
const GAIN_OF_SPLIT: f64 = 12.0;

/// A separation below this, in box units, is not believed: far more than rounding, even of a body a thousand times its size
/// from the origin.
const LEAST_SEPARATION: f64 = 1e-9;

impl<'a> SquaredChord<'a> {
    /// Looks at a few cells to find the noise of facets, and the largest cells that are worth a fit.
    pub(super) fn with_first_level(mut self) -> Self {
        /// Lines through the body, somewhat off its middle.
        const PROBES: [[f64; 4]; 3] =
            [[0.3, 0.4, 0.35, 0.6], [0.63, 0.52, 0.44, 0.71], [0.4, 0.7, 0.69, 0.46]];
        let look = |axis: usize, level: u32| {
            let parts = 0..4 * level;
            let root = Place::root(LineFrame::pair(axis));
            self.look_at(&parts.fold(root, |place, _| place.half(place.side_of::<f64>(&PROBES[axis]))))
        };
        let mut noise = f64::INFINITY;
        // F is spread evenly over lines through a ball, from 0 to about 1 there.
        let mut traced = |level: u32| -> f64 {
            let fits = (0..3).map(|axis| look(axis, level).and_then(|look| look.fit));
            let shares = fits.map(|fit| {
                let fit = fit?;
                noise = noise.min(fit.error);
                Some(fit.threshold.min(1.0))
            });
            shares.map(|share| share.unwrap_or(1.0)).sum::<f64>() / 3.0
        };
        let (mut level, mut here) = (LEVELS.start, traced(LEVELS.start));
        while level + 1 < LEVELS.end {
            let next = traced(level + 1);
            if here - next < WORTH_A_LEVEL && here < 0.5 {
                break;
            }
            (level, here) = (level + 1, next);
        }
        self.noise = if noise.is_finite() { noise } else { 0.0 };
        self.first_level = level;
        if here > HOPELESS {
            // Nothing would come of fits: one cell says so for all.
            (self.first_level, self.is_hopeless) = (0, true);
        }
        self
    }

    /// |d in mm| / |d|² of a line: from √F to its length.
    fn length_factor(&self, axis: usize, stuv: [f64; 4]) -> f64 {
        let [start, end] = self.frame.ends(axis, stuv);
        end.distance(start) / squared_span(&stuv)
    }

    /// Samples a cell and fits it. `None` if all lines miss.
    fn look_at(&self, place: &Place) -> Option<Look> {
        let design = Design::get();
        let mut samples = Samples::new(self, place);
        samples.take(&design.places[..FIT_LINES]);
        let is_complete = samples.hits.len() == FIT_LINES;
        if !is_complete {
            samples.take(&design.places[FIT_LINES..]);
        }
        samples.take(&design.tests);
        (!samples.hits.is_empty())
            .then(|| Look { fit: self.fit_of(place, &samples, is_complete), samples: samples.count as u64 })
    }

    fn fit_of(&self, place: &Place, samples: &Samples, is_complete: bool) -> Option<CellFit> {
        let design = Design::get();
        let of_fit = samples.hits.iter().filter(|hit| hit.line < samples.count - TEST_LINES);
        let of_fit: Vec<&Hit> = of_fit.take(FIT_LINES).collect();
        let cubic_of = |value: fn(&Hit) -> f64| -> Option<Cubic> {
            if is_complete {
                let values: Vec<f64> = of_fit.iter().map(|hit| value(hit)).collect();
                return Some(design.fit_complete(&values));
            }
            design.fit_some(&of_fit.iter().map(|hit| (hit.line, value(hit))).collect::<Vec<_>>())
        };
        let cubic = cubic_of(|hit| hit.f - hit.quartic)?;
        let local = |line: usize| samples.local(line);
        let last_of_fit = of_fit.last().map_or(0, |hit| hit.line);
        let of_hits = samples.hits.iter().map(|hit| {
            let off = (cubic.at(local(hit.line)) + hit.quartic - hit.f).abs();
            if hit.line <= last_of_fit { OF_FIT * off } else { off }
        });
        // A line that misses has no F; where the model has one, it is in error.
        let of_misses = samples.misses.iter().map(|miss| cubic.at(local(miss.line)) + miss.quartic);
        let error = of_hits.chain(of_misses).fold(0.0, f64::max);
        let axis = place.pair.axes()[0];
        let factor =
            (0..16).map(|bits| self.length_factor(axis, place.cell.corner(bits))).fold(0.0, f64::max);
        let threshold = |error: f64| (SAFETY * error * factor / (2.0 * self.tolerance_mm)).powi(2);
        let traced = |threshold: f64| {
            let below = samples.hits.iter().filter(|hit| hit.f < threshold).count();
            below as f64 / samples.hits.len() as f64
        };
        let after_split = threshold(error.min((error / GAIN_OF_SPLIT).max(self.noise)));
        let threshold = threshold(error);
        let gain_of_split = traced(threshold) - traced(after_split);
        let mut fit = CellFit { cubic, middle: None, error, threshold, gain_of_split };
        if self.wants_places {
            let middle = cubic_of(|hit| hit.middle)?;
            let known = samples.hits.iter().filter(|hit| hit.f >= threshold);
            let off = known.map(|hit| (middle.at(local(hit.line)) - hit.middle).abs()).fold(0.0, f64::max);
            if SAFETY * off * factor > self.tolerance_mm {
                // No chord is known whose place is not.
                (fit.threshold, fit.gain_of_split) = (f64::INFINITY, 1.0);
            }
            fit.middle = Some(Box::new(middle));
        }
        Some(fit)
    }

    /// Whether no line of the cell meets the body, proved: a plane of the cell's [shaft](crate::linespace::Cell::shaft_planes)
    /// has the body behind it.
    fn is_certainly_empty(&self, place: &Place) -> bool {
        let origin = self.frame.point_mm(DVec3::ZERO);
        place.cell.shaft_planes(place.pair).any(|(normal, least)| {
            let n = self.frame.normal_mm(normal);
            self.body.surface().farthest_vertex(n, origin, least - LEAST_SEPARATION).is_none()
        })
    }
}

impl Fit for SquaredChord<'_> {
    type Leaf = ChordLeaf;

    fn first_level(&self) -> u32 {
        self.first_level
    }

    fn fit(&self, place: &Place) -> Fitted<ChordLeaf> {
        if self.is_hopeless {
            return Fitted { samples: 0, leaf: Some(ChordLeaf::Traced) };
        }
        let all = (FIT_LINES + super::cubic::MORE_LINES + TEST_LINES) as u64;
        let Some(look) = self.look_at(place) else {
            let leaf = if self.is_certainly_empty(place) { ChordLeaf::Empty } else { ChordLeaf::Traced };
            return Fitted { samples: all, leaf: Some(leaf) };
        };
        let is_deepest = place.depth / 4 >= self.first_level + MOST_SPLITS;
        let leaf = match look.fit {
            // Few lines hit, and they are traced.
            None => Some(ChordLeaf::Traced),
            Some(fit) if fit.gain_of_split > WORTH_SPLITTING && !is_deepest => None,
            Some(fit) if !fit.threshold.is_finite() => Some(ChordLeaf::Traced),
            Some(fit) => Some(ChordLeaf::Model(ChordModel {
                centre: place.cell.centre(),
                scale: scale_of(place),
                cubic: fit.cubic,
                threshold: fit.threshold,
                middle: fit.middle,
            })),
        };
        Fitted { samples: look.samples, leaf }
    }

    fn bytes_beside(&self, leaf: &ChordLeaf) -> usize {
        match leaf {
            ChordLeaf::Model(ChordModel { middle: Some(_), .. }) => size_of::<Cubic>(),
            _ => 0,
        }
    }

    fn most_bytes_beside(&self) -> usize {
        if self.wants_places { size_of::<Cubic>() } else { 0 }
    }

    fn count(&self, leaf: &ChordLeaf, depth: usize, shape: &mut TreeShape) {
        let number: fn(&mut TreeShape) -> &mut u64 = match leaf {
            ChordLeaf::Empty => |shape| &mut shape.empty_leaves,
            ChordLeaf::Traced => |shape| &mut shape.traced_leaves,
            ChordLeaf::Model(_) => |shape| &mut shape.smooth_leaves,
        };
        shape.count_leaf(depth, number);
    }
}

impl KeepableFit for SquaredChord<'_> {
    fn is_sound(&self, leaf: &ChordLeaf, place: &Place) -> bool {
        let ChordLeaf::Model(model) = leaf else { return true };
        // Of places within the cell, powers and sums of such coefficients stay finite.
        let is_small = |x: &f64| x.abs() < 1e100;
        let ChordModel { centre, scale, cubic, threshold, middle } = model;
        *centre == place.cell.centre()
            && *scale == scale_of(place)
            && cubic.0.iter().all(is_small)
            && *threshold >= 0.0
            && is_small(threshold)
            && middle.is_some() == self.wants_places
            && middle.iter().flat_map(|middle| &middle.0).all(is_small)
    }
}

/// From intercepts about a cell's centre to its local coordinates.
fn scale_of(place: &Place) -> f64 {
    2.0 / (place.cell.high[0] - place.cell.low[0])
}

/// What samples of a cell say.
struct Look {
    /// `None` if too few lines hit.
    fit: Option<CellFit>,
    samples: u64,
}

struct CellFit {
    cubic: Cubic,
    middle: Option<Box<Cubic>>,
    /// The largest that samples show, of F.
    error: f64,
    threshold: f64,
    /// The share of hits that splitting would spare to be traced.
    gain_of_split: f64,
}

/// Exact chords of lines in a cell.
struct Samples<'f, 'a> {
    fitter: &'f SquaredChord<'a>,
    place: &'f Place,
    locals: Vec<&'static Local>,
    hits: Vec<Hit>,
    misses: Vec<Miss>,
    count: usize,
}

struct Hit {
    line: usize,
    f: f64,
    quartic: f64,
    /// |d|² times λ in the middle.
    middle: f64,
}

struct Miss {
    line: usize,
    quartic: f64,
}

/// Samples are lines from somewhat before the first plane to somewhat behind the second, so that the body is in between.
const OVERHANG: f64 = 0.01;

impl<'f, 'a> Samples<'f, 'a> {
    fn new(fitter: &'f SquaredChord<'a>, place: &'f Place) -> Self {
        Self {
            fitter,
            place,
            locals: Vec::with_capacity(160),
            hits: Vec::with_capacity(160),
            misses: Vec::new(),
            count: 0,
        }
    }

    fn local(&self, line: usize) -> &'static Local {
        self.locals[line]
    }

    fn take(&mut self, places: &'static [Local]) {
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
        let mut ends = Ends(vec![None; rays.len()]);
        self.fitter.body.trace(self.fitter.engine, 0, &rays, &mut ends);
        for ((place, ray), ends) in places.iter().zip(&rays).zip(&ends.0) {
            let (stuv, line) = (stuv(place), self.count);
            let quartic = quartic(&stuv);
            match ends {
                Some(ends) => {
                    let to_lambda = (1.0 + 2.0 * OVERHANG) / ray.length_mm();
                    let [a, b] = ends.map(|t| t * to_lambda - OVERHANG);
                    let span = squared_span(&stuv);
                    self.hits.push(Hit {
                        line,
                        f: (span * (b - a)).powi(2),
                        quartic,
                        middle: span * 0.5 * (a + b),
                    });
                }
                None => self.misses.push(Miss { line, quartic }),
            }
            self.locals.push(place);
            self.count += 1;
        }
    }
}

/// The first entry and the last exit of each ray, mm.
struct Ends(Vec<Option<[f64; 2]>>);

impl Record for Ends {
    const ASKS_FACES: bool = false;

    fn crossing(&mut self, ray: usize, t_mm: f64, _face: u32, _way: Way) {
        // A line along a face may leave and enter again within rounding; a convex body has one chord.
        self.0[ray] = Some(self.0[ray].map_or([t_mm; 2], |[a, b]| [t_mm.min(a), t_mm.max(b)]));
    }
}
