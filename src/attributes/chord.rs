//! The chord: how many millimetres of a line lie in a body.

use crate::exact::Body;
use crate::geometry::{Interval, Line};
use crate::linespace::{Cell, LinePoint, LineSpace, PlanePair};
use crate::ritree::{Attribute, Keepable};

/// A chord, as samples hold it. f32: its rounding, 6e-8 of the value, is far below any useful threshold.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
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
pub(super) const LEAST_SEPARATION: f64 = 1e-12;

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
    type Real = f64;

    fn sample(&self, point: LinePoint) -> Option<Chord> {
        let line = self.space.line_of(point)?;
        let chord = self.body.whole_chord(&line)?;
        let (start, end) = (chord.start(), chord.end());
        let [k, ..] = point.pair.axes();
        let lowest = if line.dir()[k] > 0.0 { start } else { end };
        let entry = (line.at(lowest)[k] - self.space.min()[k]) / self.space.size()[k];
        Some(Chord { length_mm: (end - start) as f32, entry: entry as f32 })
    }

    fn class(&self, output: &Self::Output) -> u32 {
        if output.is_some() { HIT } else { MISS }
    }

    fn miss(&self) -> Self::Output {
        None
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

    /// See [`Cell::shaft_planes`]: the body may not reach above one of them.
    fn is_certainly_empty(&self, pair: PlanePair, cell: &Cell) -> bool {
        let (min, size) = (self.space.min(), self.space.size());
        cell.shaft_planes(pair).any(|(normal, least)| {
            !self.body.surface().reaches_above(normal / size, min, least - LEAST_SEPARATION)
        })
    }
}

impl Keepable for ChordLength<'_> {
    fn is_sound(&self, output: &Self::Output) -> bool {
        // Sixteen of the largest would still be added up.
        let is_small = |x: f32| x.abs() < 1e30;
        output
            .is_none_or(|chord| chord.length_mm >= 0.0 && is_small(chord.length_mm) && is_small(chord.entry))
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::exact::Engine;
    use crate::geometry::primitives::{cube, icosphere};
    use crate::geometry::{ClosedMesh, TriMesh, UnitDir};
    use crate::ritree::{Answer, Cache, Parameters, Reason, RiTree};

    fn body(mesh: TriMesh) -> Body {
        Body::new(ClosedMesh::new(mesh).expect("closed").0)
    }

    fn ellipsoid() -> Body {
        body(icosphere(3).map_vertices(|v| v * DVec3::new(100.0, 80.0, 60.0) + DVec3::new(7.0, -300.0, 1e3)))
    }

    fn lines_near(body: &Body, seed: u64, count: usize) -> impl Iterator<Item = Line> {
        let bounds = body.bounds();
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        let mut point = move || bounds.min + bounds.size() * DVec3::from([0; 3].map(|_| rng.random::<f64>()));
        (0..count).filter_map(move |_| {
            let (a, b) = (point(), point());
            Line::new(a, UnitDir::new(b - a)?)
        })
    }

    fn exact(body: &Body, line: &Line) -> Option<Interval> {
        let mut parts = Vec::new();
        body.chords_by(Engine::Clip, line, &mut parts);
        parts.first().copied()
    }

    #[test]
    fn interpolated_chords_are_near_the_exact_ones_and_begin_where_they_do() {
        let body = ellipsoid();
        let chords = ChordLength::new(&body).expect("convex");
        let parameters = Parameters { distance_threshold: 0.01, ..Parameters::default() };
        let (tree, cache) = (RiTree::new(chords, parameters), Cache::new(1 << 30));
        let (mut compared, mut sum) = (0, 0.0);
        for line in lines_near(&body, 1, 2_000) {
            let point = tree.attribute().space().point_of(&line);
            let answer = tree.query(point, &cache).expect("in range");
            match (answer, exact(&body, &line)) {
                (Answer::Interpolated(Some(chord)), Some(exact)) => {
                    let near = tree.attribute().stretch(chord, &line, point).expect("a stretch");
                    // The test at a cell's centre bounds no other line; 15 thresholds were never seen exceeded.
                    assert!((near.length() - exact.length()).abs() < 15.0, "{near:?}, not {exact:?}");
                    assert!((near.start() - exact.start()).abs() < 15.0, "{near:?}, not {exact:?}");
                    sum += (near.length() - exact.length()).abs();
                    compared += 1;
                }
                (Answer::Interpolated(None), None) | (Answer::Trace(_), _) => {}
                (answer, exact) => panic!("{answer:?} for {exact:?}"),
            }
        }
        assert!(
            compared > 500 && sum / f64::from(compared) < 1.0,
            "{compared} compared, mean {}",
            sum / f64::from(compared)
        );
        tree.check_invariants();
    }

    /// How far interpolated lengths are from exact ones, in thresholds, of lines with chords of half the longest at least:
    /// those are away from the outline.
    fn errors_in_thresholds(body: &Body, threshold: f64, lines: impl Iterator<Item = Line>) -> Vec<f64> {
        let chords = ChordLength::new(body).expect("convex");
        let parameters = Parameters { distance_threshold: threshold, ..Parameters::default() };
        let (tree, cache) = (RiTree::new(chords, parameters), Cache::new(1 << 30));
        let error = |line: Line| {
            let exact = exact(body, &line).filter(|chord| chord.length() > 60.0)?;
            let point = tree.attribute().space().point_of(&line);
            match tree.query(point, &cache)? {
                Answer::Interpolated(Some(chord)) => {
                    let off = (f64::from(chord.length_mm) - exact.length()).abs();
                    Some(off / (threshold * tree.attribute().unit_mm))
                }
                Answer::Interpolated(None) => panic!("{line:?} misses, but for {} mm", exact.length()),
                Answer::Trace(_) => None,
            }
        };
        let errors = lines.filter_map(error).collect();
        tree.check_invariants();
        errors
    }

    #[test]
    fn away_from_the_outline_lengths_agree_with_exact_ones_within_the_threshold() {
        let body = ellipsoid();
        for threshold in [0.1, 0.03, 0.01] {
            let mut errors = errors_in_thresholds(&body, threshold, lines_near(&body, 5, 3_000));
            errors.sort_unstable_by(f64::total_cmp);
            let within = errors.partition_point(|error| *error <= 1.0);
            assert!(errors.len() > 500, "{threshold}: {}", errors.len());
            // The test is at a cell's centre: a few lines beside it are farther off.
            assert!(
                within as f64 > 0.97 * errors.len() as f64 && errors[errors.len() - 1] < 3.0,
                "{threshold}: {within} of {}, the worst {}",
                errors.len(),
                errors[errors.len() - 1]
            );
        }
    }

    #[test]
    fn where_the_dominant_axis_changes_both_trees_agree_with_the_exact_chord() {
        let body = ellipsoid();
        let (size, centre) = (body.bounds().size(), body.bounds().centre());
        let mut pairs = std::collections::BTreeSet::new();
        let mut ties = Vec::new();
        let space = LineSpace::new(body.bounds()).expect("a box");
        for i in 0..600_u32 {
            // Equal in box units but for the sign, or a unit in the last place apart.
            let (first, sign) = (i as usize % 3, if i % 2 == 0 { 1.0 } else { -1.0 });
            let mut towards = DVec3::splat(1.0);
            towards[(first + 2) % 3] = f64::from(i % 19) / 10.0 - 0.9;
            towards[first] = sign * [1.0, 1.0_f64.next_up(), 1.0_f64.next_down()][i as usize / 6 % 3];
            let aside = DVec3::new(f64::from(i % 7) - 3.0, f64::from(i % 11) - 5.0, f64::from(i % 5) - 2.0);
            let line = Line::new(centre + 4.0 * aside, UnitDir::new(size * towards).expect("a direction"));
            let line = line.expect("finite");
            pairs.insert(space.point_of(&line).pair.index());
            ties.push(line);
        }
        assert_eq!(pairs.len(), 6, "{pairs:?}");
        let errors = errors_in_thresholds(&body, 0.03, ties.into_iter());
        let worst = errors.iter().copied().fold(0.0, f64::max);
        assert!(errors.len() > 300 && worst < 3.0, "{} lines, the worst {worst}", errors.len());
    }

    #[test]
    fn a_body_is_never_lost_however_thin_or_small_its_cells() {
        // A plate 1/10 000 of its width thick, oblique to all axes: lines through it, most cells of which have no
        // corner that meets it.
        let tilt = glam::DMat3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7);
        let plate = body(cube(1.0).map_vertices(|v| tilt * (v * DVec3::new(100.0, 100.0, 0.01))));
        let needle = body(cube(1.0).map_vertices(|v| tilt * (v * DVec3::new(100.0, 0.01, 0.01))));
        for body in [plate, needle] {
            for max_depth in [0, 8, 20] {
                let chords = ChordLength::new(&body).expect("convex");
                let parameters = Parameters { max_depth, ..Parameters::default() };
                let (tree, cache) = (RiTree::new(chords, parameters), Cache::new(1 << 30));
                let mut rng = rand_pcg::Pcg64::seed_from_u64(2);
                for _ in 0..300 {
                    let inside = tilt
                        * (DVec3::from([0; 3].map(|_| rng.random_range(-0.49..0.49))) * body_size(&body));
                    let dir = UnitDir::new(DVec3::from([0; 3].map(|_| rng.random_range(-1.0..1.0))))
                        .expect("a direction");
                    let line = Line::new(inside, dir).expect("finite");
                    if exact(&body, &line).is_none() {
                        continue;
                    }
                    let answer = tree.query(tree.attribute().space().point_of(&line), &cache);
                    assert_ne!(answer, Some(Answer::Interpolated(None)), "lost at depth {max_depth}");
                    assert_ne!(answer, None, "lost out of range");
                }
                assert_eq!(tree.check_invariants(), cache.used_bytes());
            }
        }
    }

    /// Points of either test body lie within this box before the tilt.
    fn body_size(body: &Body) -> DVec3 {
        let is_needle = body.surface().volume_mm3() < 1.0;
        DVec3::new(100.0, if is_needle { 0.01 } else { 100.0 }, 0.01)
    }

    #[test]
    fn empty_cells_are_proved_and_cells_with_the_body_are_not() {
        let body = ellipsoid();
        let chords = ChordLength::new(&body).expect("convex");
        let pair = PlanePair::ALL[3];
        let around = |c: [f64; 4], r: f64| Cell { low: c.map(|x| x - r), high: c.map(|x| x + r) };
        assert!(chords.is_certainly_empty(pair, &around([-0.5, 0.5, -0.5, 0.5], 0.2)));
        assert!(
            chords.is_certainly_empty(pair, &around([1.1, 1.1, 1.1, 1.1], 0.02)),
            "past a corner, obliquely"
        );
        assert!(!chords.is_certainly_empty(pair, &around([0.5; 4], 0.01)));
        for line in lines_near(&body, 3, 3_000) {
            let point = chords.space().point_of(&line);
            if exact(&body, &line).is_some() {
                let cell = around(point.stuv, 1e-6);
                assert!(!chords.is_certainly_empty(point.pair, &cell), "{point:?} meets the body");
            }
        }
    }

    #[test]
    fn both_directions_of_a_line_share_one_tree_and_one_chord() {
        let body = ellipsoid();
        let chords = ChordLength::new(&body).expect("convex");
        let (tree, cache) = (RiTree::new(chords, Parameters::default()), Cache::new(1 << 30));
        for line in lines_near(&body, 4, 300) {
            let ask = |line: &Line| {
                let point = tree.attribute().space().point_of(line);
                tree.query(point, &cache).map(|answer| match answer {
                    Answer::Interpolated(chord) => {
                        chord.and_then(|c| tree.attribute().stretch(c, line, point))
                    }
                    Answer::Trace(Reason::Silhouette | Reason::Guard) => None,
                    Answer::Trace(reason) => panic!("{reason:?}"),
                })
            };
            if let (Some(Some(there)), Some(Some(back))) = (ask(&line), ask(&line.reversed())) {
                assert!((there.length() - back.length()).abs() < 1e-3);
                assert!((there.start() + back.end()).abs() < 1e-3, "{there:?} {back:?}");
            }
        }
        assert!(tree.build_counts().samples_taken > 0);
        tree.check_invariants();
    }
}
