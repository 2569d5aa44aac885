//! What becomes of a cell: a pure function of it.
//!
//! **Why values, and so many.** An exact chord also knows the gradient of F, by normals that turn over smooth edges: five equations
//! a line. By 24 lines with gradients in place of 64 without, and the same 24 tests, an image of 600² (an ellipsoid, tolerance
//! 0.5 mm) takes half the samples, and is no better off: what a cubic leaves out has larger gradients than values.
//!
//! | | 20 480 faces | 327 680 faces |
//! |---|--:|--:|
//! | samples, by values / with gradients | 6 192 / 4 848 | 6 192 / 3 036 |
//! | leaves | 50 / 67 | 50 / 50 |
//! | lines traced, % | 2.1 / 4.8 | 0.07 / 1.6 |
//! | mean error, mm | 0.0106 / 0.0130 | 0.0008 / 0.0034 |
//! | growth, ms | 3.7 / 5.8 | 4.2 / 5.2 |
//!
//! With 40 lines the error is still three times that by values on the finer one. Nor is much to be had from samples that neighbours
//! share: a view's cells meet others of its across 3.0 to 3.6 of their 8 sides, so that even if all lines to fit lay on sides, a
//! seventh of all samples would be spared, and walks for samples are a quarter of the time.

use super::cubic::{Cubic, Design, FIT_LINES, TEST_LINES};
use super::planes::{FewPlanes, MOST_PLANES};
use super::samples::{Hit, Samples};
use super::shaft::{Shaft, Sheets};
use super::{ChordLeaf, ChordModel, SquaredChord};
use crate::linespace::{LineFrame, squared_span};
use crate::ritree::{Fit, Fitted, KeepableFit, Place, TreeShape};

/// The largest cells are of a level between these: 3/8 to 3/32 of the body's box wide. In larger ones, few lines hit in too
/// many cells.
const LEVELS: std::ops::Range<u32> = 3..6;

/// Where more than this share of lines would be traced in the smallest cells, all are, without a look.
const HOPELESS: f64 = 0.8;

/// A level's cells are the largest if those of the next would leave no more than this share of the hits less to be traced.
const WORTH_A_LEVEL: f64 = 0.05;

/// Cells are split no more than so many levels below the first: more of them would lie along edges and be traced all the same.
const MOST_SPLITS: u32 = 1;

/// A cell is split if that would spare this share of its hits to be traced.
const WORTH_SPLITTING: f64 = 0.15;

/// The costs of an answer in planes clipped by: of a model, and of a line traced. A plane takes 1 ns of a run's pixel and 2 ns of
/// a line on its own; a walk takes 40 ns from pixel to pixel over the few faces of bodies that have cells of few planes, 60 to
/// 100 ns over more, and 200 ns elsewhere.
mod cost {
    pub const MODEL: f64 = 2.0;
    pub const TRACED: f64 = 30.0;
}

/// Cells of so few planes are not looked at any closer.
const FEW_PLANES: usize = 8;

/// Lines looked for that meet the body in a cell of few planes.
const LINES_OF_FEW: usize = 16;

/// Bodies of more planes have no cell of few but along creases, and are asked only there.
const PLANES_OF_COARSE: usize = 5_000;

/// Where lines miss, so many more are taken at a time, until as many hit as a fit takes.
const MORE_AT_A_TIME: usize = 32;

/// The largest error that samples show, times this, is taken for the bound of all.
const SAFETY: f64 = 1.75;

/// Of 64 lines and 35 coefficients, a fit takes in so much of the lines' own errors that those left are smaller than others' by
/// √(1 − 35/64).
const OF_FIT: f64 = 1.5;

/// What halving a cell divides the error of a cubic by: 2⁴ less what facets and outlines leave.
const GAIN_OF_SPLIT: f64 = 12.0;

/// Cells of bodies that are not convex are split down to this level where lines may cross the surface more or less often:
/// there, lines are traced along outlines and folds.
const DEEPEST_OF_GENERAL: u32 = 6;

impl<'a> SquaredChord<'a> {
    /// Looks at a few cells to find the noise of facets, and the largest cells that are worth a fit.
    pub(super) fn with_first_level(mut self) -> Self {
        /// Lines through the body, somewhat off its middle.
        const PROBES: [[f64; 4]; 3] =
            [[0.3, 0.4, 0.35, 0.6], [0.63, 0.52, 0.44, 0.71], [0.4, 0.7, 0.69, 0.46]];
        let place = |axis: usize, level: u32| {
            let parts = 0..4 * level;
            let root = Place::root(LineFrame::pair(axis));
            parts.fold(root, |place, _| place.half(place.side_of::<f64>(&PROBES[axis])))
        };
        let look = |axis: usize, level: u32| self.look_at(&place(axis, level));
        if !self.is_convex() {
            let fits = (0..3).filter_map(|axis| look(axis, DEEPEST_OF_GENERAL).ok()?.fit);
            self.noise = fits.map(|fit| fit.error).reduce(f64::min).unwrap_or(0.0);
            (self.first_level, self.deepest_level) = (LEVELS.start, DEEPEST_OF_GENERAL);
            return self;
        }
        let mut noise = f64::INFINITY;
        // F is spread evenly over lines through a ball, from 0 to about 1 there.
        let mut traced = |level: u32| -> f64 {
            let fits = (0..3).map(|axis| look(axis, level).ok().and_then(|look| look.fit));
            let shares = fits.enumerate().map(|(axis, fit)| {
                let clipped = self
                    .planes_of_coarse(&place(axis, level))
                    .map_or(1.0, |few| few.planes.len() as f64 / cost::TRACED);
                let Some(fit) = fit else { return clipped };
                noise = noise.min(fit.error);
                fit.threshold.min(clipped)
            });
            shares.sum::<f64>() / 3.0
        };
        let (mut level, mut here) = (LEVELS.start, traced(LEVELS.start));
        // No level gains more than there is to be traced.
        while level + 1 < LEVELS.end && here >= WORTH_A_LEVEL {
            let next = traced(level + 1);
            if here - next < WORTH_A_LEVEL && here < 0.5 {
                break;
            }
            (level, here) = (level + 1, next);
        }
        self.noise = if noise.is_finite() { noise } else { 0.0 };
        (self.first_level, self.deepest_level) = (level, level + MOST_SPLITS);
        if here > HOPELESS {
            // Nothing would come of fits: one cell says so for all.
            (self.first_level, self.is_hopeless) = (0, true);
        }
        self
    }

    fn shaft(&self, place: &Place) -> Shaft<'a> {
        Shaft::new(&self.frame, place, self.body.surface())
    }

    /// The planes that a cell's lines may meet, if they are few and the body has not so many that it is not worth a look.
    fn planes_of_coarse(&self, place: &Place) -> Option<FewPlanes> {
        let convex = self.body.convexity().ok()?;
        let is_coarse = convex.planes().len() <= PLANES_OF_COARSE;
        if is_coarse { self.few_planes(&self.shaft(place)) } else { None }
    }

    /// |d in mm| / |d|² of a line: from √F to its length.
    fn length_factor(&self, axis: usize, stuv: [f64; 4]) -> f64 {
        let [start, end] = self.frame.ends(axis, stuv);
        end.distance(start) / squared_span(&stuv)
    }

    /// Samples a cell and fits it.
    fn look_at(&self, place: &Place) -> Result<Look, Missed> {
        let design = Design::get();
        let mut samples = Samples::new(self, place);
        samples.take(&design.places[..FIT_LINES]);
        let is_complete = samples.hits.len() == FIT_LINES;
        let missed = |samples: &Samples, is_empty| Missed { samples: samples.count as u64, is_empty };
        if samples.hits.is_empty() && self.shaft(place).misses_all() {
            return Err(missed(&samples, true));
        }
        for more in design.places[FIT_LINES..].chunks(MORE_AT_A_TIME) {
            if samples.hits.len() < FIT_LINES {
                samples.take(more);
            }
        }
        samples.take(&design.tests);
        if samples.hits.is_empty() {
            return Err(missed(&samples, false));
        }
        Ok(Look { fit: self.fit_of(place, &samples, is_complete), samples: samples.count as u64 })
    }

    /// Whether all samples of a cell go through a body that is not convex equally often, as they do but for rounding; and
    /// once, if it is asked where.
    fn is_alike(&self, samples: &Samples) -> bool {
        let parts = samples.hits[0].parts;
        samples.misses.is_empty()
            && samples.hits.iter().all(|hit| hit.parts == parts)
            && (parts == 1 || !self.wants_places)
    }

    fn fit_of(&self, place: &Place, samples: &Samples, is_complete: bool) -> Option<CellFit> {
        if !self.is_convex() && !self.is_alike(samples) {
            return None;
        }
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
        let (traced, traced_after_split) = (traced(threshold), traced(after_split));
        let mut fit = CellFit { cubic, middle: None, error, threshold, traced, traced_after_split };
        if self.wants_places {
            let middle = cubic_of(|hit| hit.middle)?;
            let known = samples.hits.iter().filter(|hit| hit.f >= threshold);
            let off = known.map(|hit| (middle.at(local(hit.line)) - hit.middle).abs()).fold(0.0, f64::max);
            if SAFETY * off * factor > self.tolerance_mm {
                // No chord is known whose place is not.
                (fit.threshold, fit.traced, fit.traced_after_split) = (f64::INFINITY, 1.0, 0.0);
            }
            fit.middle = Some(Box::new(middle));
        }
        Some(fit)
    }

    /// What becomes of a cell of a body that is not convex: `None` if it is to be sampled.
    fn without_samples(&self, place: &Place) -> Option<Fitted<ChordLeaf>> {
        let leaf = match self.shaft(place).sheets() {
            Sheets::Constant => return None,
            Sheets::None => Some(ChordLeaf::Empty),
            Sheets::Unknown if place.depth / 4 < self.deepest_level => None,
            Sheets::Unknown => Some(ChordLeaf::Traced),
        };
        Some(Fitted { samples: 0, leaf })
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
        if !self.is_convex()
            && let Some(known) = self.without_samples(place)
        {
            return known;
        }
        let mut few = self.planes_of_coarse(place);
        if let Some(few) = few.as_mut().filter(|few| few.planes.len() <= FEW_PLANES) {
            let mut samples = Samples::new(self, place);
            if !few.is_met && !few.planes.is_empty() {
                samples.take(&Design::get().places[..LINES_OF_FEW]);
                few.is_met = !samples.hits.is_empty();
            }
            if few.is_met || few.planes.is_empty() {
                return Fitted { samples: samples.count as u64, leaf: Some(few.leaf()) };
            }
        }
        let look = match self.look_at(place) {
            Ok(look) => look,
            Err(Missed { samples, is_empty }) => {
                let leaf = match few {
                    _ if is_empty => ChordLeaf::Empty,
                    Some(few) if few.is_met || few.planes.is_empty() => few.leaf(),
                    _ => ChordLeaf::Traced,
                };
                return Fitted { samples, leaf: Some(leaf) };
            }
        };
        let (traced, after_split) =
            look.fit.as_ref().map_or((1.0, 1.0), |fit| (fit.traced, fit.traced_after_split));
        if few.is_none() && traced > WORTH_SPLITTING {
            few = self.few_planes(&self.shaft(place));
        }
        let by_planes = few.as_ref().map_or(f64::INFINITY, |few| few.planes.len() as f64);
        let by_model = |traced: f64| cost::MODEL + cost::TRACED * traced;
        // A split halves what a cell sees.
        let gain = by_planes.min(by_model(traced)) - (0.5 * by_planes).min(by_model(after_split));
        let is_deepest = place.depth / 4 >= self.deepest_level;
        let leaf = match (look.fit, few) {
            (Some(_), _) if gain > cost::TRACED * WORTH_SPLITTING && !is_deepest => None,
            // Some sample hit.
            (_, Some(few)) if by_planes < by_model(traced) => Some(few.leaf()),
            // Few lines hit, and they are traced.
            (None, _) => Some(ChordLeaf::Traced),
            (Some(fit), _) if !fit.threshold.is_finite() => Some(ChordLeaf::Traced),
            (Some(fit), _) => Some(ChordLeaf::Model(ChordModel {
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
            ChordLeaf::Planes(few) => size_of_val(&**few),
            _ => 0,
        }
    }

    fn most_bytes_beside(&self) -> usize {
        if self.wants_places { size_of::<Cubic>() } else { MOST_PLANES * size_of::<u32>() }
    }

    fn count(&self, leaf: &ChordLeaf, depth: usize, shape: &mut TreeShape) {
        let number: fn(&mut TreeShape) -> &mut u64 = match leaf {
            ChordLeaf::Empty => |shape| &mut shape.empty_leaves,
            ChordLeaf::Traced => |shape| &mut shape.traced_leaves,
            ChordLeaf::Planes(_) | ChordLeaf::Model(_) => |shape| &mut shape.smooth_leaves,
        };
        shape.count_leaf(depth, number);
    }
}

impl FewPlanes {
    fn leaf(&self) -> ChordLeaf {
        if self.planes.is_empty() {
            ChordLeaf::Empty
        } else {
            ChordLeaf::Planes(self.planes.as_slice().into())
        }
    }
}

/// All samples of a cell miss.
struct Missed {
    samples: u64,
    /// Whether all lines do, proved.
    is_empty: bool,
}

impl KeepableFit for SquaredChord<'_> {
    fn is_sound(&self, leaf: &ChordLeaf, place: &Place) -> bool {
        let model = match leaf {
            ChordLeaf::Empty | ChordLeaf::Traced => return true,
            ChordLeaf::Planes(few) => return self.are_planes(few),
            ChordLeaf::Model(model) => model,
        };
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
    /// The share of hits that are traced.
    traced: f64,
    /// The share that would be after a split.
    traced_after_split: f64,
}
