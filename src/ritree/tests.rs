//! The tree against attributes whose answers are known in closed form.

mod keeping;
mod simplicial;

use std::sync::atomic::AtomicU64;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::geometry::Vec3;
use crate::linespace::Cell;

/// An attribute given by functions of (s, t, u, v): a value, and a class.
struct Test {
    value: fn([f64; 4]) -> f64,
    class: fn([f64; 4]) -> u32,
    can_locate: bool,
    turns: f64,
    sampling: Sampling,
}

#[derive(Clone, Debug, PartialEq)]
struct Sample {
    value: f64,
    class: u32,
}

const MISS: u32 = 0;

impl Test {
    fn smooth(value: fn([f64; 4]) -> f64) -> Self {
        Self { value, class: |_| 1, can_locate: true, turns: 0.0, sampling: Sampling::PAPER }
    }

    fn exact(&self, stuv: [f64; 4]) -> f64 {
        (self.value)(stuv)
    }
}

impl Attribute for Test {
    type Output = Sample;
    type Real = f64;

    fn sampling(&self) -> Sampling {
        self.sampling
    }

    fn sample(&self, line: LinePoint) -> Sample {
        Sample { value: (self.value)(line.stuv), class: (self.class)(line.stuv) }
    }

    fn class(&self, output: &Sample) -> u32 {
        output.class
    }

    fn distance(&self, a: &Sample, b: &Sample) -> f64 {
        (a.value - b.value).abs()
    }

    fn interpolate(&self, parts: &[(f64, &Sample)]) -> Sample {
        Sample { value: parts.iter().map(|(w, s)| w * s.value).sum(), class: parts[0].1.class }
    }

    fn locates(&self) -> bool {
        self.can_locate
    }

    fn miss(&self) -> Sample {
        Sample { value: 0.0, class: MISS }
    }

    fn is_miss(&self, class: u32) -> bool {
        class == MISS
    }

    fn direction(&self, output: &Sample) -> Option<Vec3<f64>> {
        let angle = self.turns * output.value;
        (self.turns > 0.0).then(|| Vec3::new(angle.cos(), angle.sin(), 0.0))
    }

    fn is_certainly_empty(&self, _: PlanePair, _: &Cell) -> bool {
        false
    }
}

fn points(seed: u64, count: usize) -> Vec<LinePoint> {
    let mut rng = Pcg64::seed_from_u64(seed);
    (0..count)
        .map(|i| LinePoint { pair: PlanePair::ALL[i % 6], stuv: [0; 4].map(|_| rng.random_range(-1.0..2.0)) })
        .collect()
}

fn roomy() -> Cache {
    Cache::new(1 << 30)
}

fn settings(distance_threshold: f64, max_depth: u32) -> Parameters {
    Parameters { distance_threshold, angular_threshold_deg: 30.0, max_depth }
}

fn ask_all(tree: &RiTree<Test>, cache: &Cache, points: &[LinePoint]) {
    for &point in points {
        let _ = tree.query(point, cache);
    }
}

fn interpolated(answer: Option<Answer<Sample>>) -> f64 {
    match answer {
        Some(Answer::Interpolated(sample)) => sample.value,
        other => panic!("not interpolated: {other:?}"),
    }
}

#[test]
fn functions_linear_in_each_of_s_t_u_v_are_reproduced() {
    let tree = RiTree::new(
        Test::smooth(|[s, t, u, v]| 3.0 - s + 2.0 * t + 0.5 * u - 4.0 * v + s * t * u * v),
        settings(1e-9, 28),
    );
    let cache = roomy();
    for point in points(1, 2_000) {
        let error = interpolated(tree.query(point, &cache)) - tree.attribute().exact(point.stuv);
        assert!(error.abs() < 1e-12, "{error}");
    }
    assert_eq!(tree.shape().smooth_leaves, 6, "a root each suffices");
    tree.check_invariants();
}

#[test]
fn samples_at_the_corners_of_cells_are_exact() {
    let tree = RiTree::new(Test::smooth(|[s, t, u, v]| (s + 2.0 * t).sin() + u * v * v), settings(-1.0, 12));
    let cache = roomy();
    for i in 0..4_096_usize {
        // No error is below zero, so all cells are 3/8 wide.
        let stuv = [0, 1, 2, 3].map(|a| -1.0 + 0.375 * ((i >> (3 * a)) & 7) as f64);
        let point = LinePoint { pair: PlanePair::ALL[0], stuv };
        let error = interpolated(tree.query(point, &cache)) - tree.attribute().exact(stuv);
        assert!(error.abs() < 1e-12, "{stuv:?}: {error}");
    }
    tree.check_invariants();
}

/// A [`Test`] that counts what it is asked for.
struct Asked(Test, AtomicU64);

impl Attribute for Asked {
    type Output = Sample;
    type Real = f64;

    fn sample(&self, line: LinePoint) -> Sample {
        self.1.fetch_add(1, Ordering::Relaxed);
        self.0.sample(line)
    }

    fn class(&self, output: &Sample) -> u32 {
        self.0.class(output)
    }

    fn distance(&self, a: &Sample, b: &Sample) -> f64 {
        self.0.distance(a, b)
    }

    fn interpolate(&self, parts: &[(f64, &Sample)]) -> Sample {
        self.0.interpolate(parts)
    }

    fn miss(&self) -> Sample {
        Sample { value: 0.0, class: MISS }
    }

    fn is_miss(&self, class: u32) -> bool {
        self.0.is_miss(class)
    }

    fn is_certainly_empty(&self, _: PlanePair, _: &Cell) -> bool {
        false
    }
}

#[test]
fn samples_taken_are_those_that_the_attribute_was_asked_for() {
    let smooth = || Test::smooth(|[s, t, u, v]| (s + 2.0 * t).sin() + u * v * v);
    for attribute in [smooth(), step(false)] {
        for cache in [roomy(), Cache::new(20_000), Cache::new(0)] {
            let asked = Asked(Test { ..attribute }, AtomicU64::new(0));
            let tree = RiTree::new(asked, settings(0.05, 12));
            for point in points(3, 300) {
                let _ = tree.query(point, &cache);
            }
            let asked = tree.attribute().1.load(Ordering::Relaxed);
            assert_eq!(tree.build_counts().samples_taken, asked);
            assert!(asked > 1_000, "{asked}");
        }
    }
}

#[test]
fn a_smaller_threshold_gives_a_smaller_error_and_a_larger_tree() {
    let figures = [0.3, 0.1, 0.03, 0.01].map(|threshold| {
        let tree = RiTree::new(
            Test::smooth(|[s, t, u, v]| (s - u).powi(2) + (t - v).powi(2) + s * v),
            settings(threshold, 28),
        );
        let cache = roomy();
        let errors = points(2, 3_000).into_iter().map(|point| {
            (interpolated(tree.query(point, &cache)) - tree.attribute().exact(point.stuv)).abs()
        });
        let worst = errors.fold(0.0, f64::max);
        tree.check_invariants();
        (worst, cache.used_bytes())
    });
    assert!(figures.windows(2).all(|w| w[1].0 < w[0].0 && w[1].1 > w[0].1), "{figures:?}");
}

#[test]
fn beyond_the_deepest_level_no_cell_is_split() {
    let tree = RiTree::new(Test::smooth(|[s, ..]| s.powi(3)), settings(0.0, 9));
    let cache = roomy();
    ask_all(&tree, &cache, &points(3, 500));
    assert_eq!(tree.shape().leaves_by_depth.len(), 10);
    tree.check_invariants();
}

/// A step across the oblique hyperplane s + t + u + v = 1.7.
fn step(can_locate: bool) -> Test {
    Test {
        class: |[s, t, u, v]| if s + t + u + v > 1.7 { 2 } else { 1 },
        can_locate,
        ..Test::smooth(|[s, t, u, v]| if s + t + u + v > 1.7 { 10.0 + s - v } else { t + u })
    }
}

#[test]
fn nothing_is_interpolated_across_a_discontinuity() {
    let tree = RiTree::new(step(true), settings(0.01, 12));
    let cache = roomy();
    let (mut near, mut traced) = (0, 0);
    for point in points(4, 5_000) {
        match tree.query(point, &cache) {
            Some(Answer::Interpolated(sample)) => {
                let error = sample.value - tree.attribute().exact(point.stuv);
                assert!(error.abs() < 1e-9, "{point:?}: {error}, bled over the step");
                near += 1;
            }
            Some(Answer::Trace(Reason::Silhouette)) => traced += 1,
            other => panic!("{other:?}"),
        }
    }
    assert!(near > 10 * traced && traced > 0, "{near} interpolated, {traced} traced");
    tree.check_invariants();
}

#[test]
fn lines_of_a_mixed_cell_are_traced_if_their_side_cannot_be_told_cheaply() {
    let traced = |can_locate: bool| {
        let tree = RiTree::new(step(can_locate), settings(0.01, 8));
        let cache = roomy();
        let answers = points(5, 3_000).into_iter().map(|point| tree.query(point, &cache));
        let traced = answers.filter(|a| matches!(a, Some(Answer::Trace(_)))).count();
        tree.check_invariants();
        traced
    };
    assert!(traced(false) > 2 * traced(true));
}

#[test]
fn more_than_two_classes_and_directions_too_far_apart_are_traced() {
    let three = Test {
        class: |[s, t, ..]| if s > 0.55 { 1 } else { 2 + u32::from(t > 0.55) },
        ..Test::smooth(|_| 1.0)
    };
    let tree = RiTree::new(three, settings(0.01, 4));
    let cache = roomy();
    let at = |s, t| LinePoint { pair: PlanePair::ALL[0], stuv: [s, t, 0.3, 0.3] };
    assert_eq!(tree.query(at(0.6, 0.6), &cache), Some(Answer::Trace(Reason::Classes)));
    tree.check_invariants();

    let turning = |turns| Test { turns, ..Test::smooth(|[s, ..]| s) };
    let answer = |turns| RiTree::new(turning(turns), settings(0.01, 4)).query(at(0.3, 0.3), &roomy());
    assert!(matches!(answer(0.1), Some(Answer::Interpolated(_))));
    assert_eq!(answer(0.5), Some(Answer::Trace(Reason::Angle)));
}

#[test]
fn corners_that_all_miss_prove_nothing() {
    // A needle of hits that no corner of a shallow tree meets.
    let needle =
        Test { class: |[s, ..]| u32::from((s - 0.123_456_789).abs() < 1e-9), ..Test::smooth(|_| 1.0) };
    let tree = RiTree::new(needle, settings(0.01, 16));
    let on_the_needle = LinePoint { pair: PlanePair::ALL[0], stuv: [0.123_456_789, 0.2, 0.3, 0.4] };
    assert_eq!(tree.query(on_the_needle, &roomy()), Some(Answer::Trace(Reason::Guard)));
    tree.check_invariants();
}

#[test]
fn lines_out_of_range_are_not_the_trees() {
    let tree = RiTree::new(Test::smooth(|_| 1.0), Parameters::default());
    let beside = LinePoint { pair: PlanePair::ALL[0], stuv: [0.5, 2.1, 0.5, 0.5] };
    assert_eq!(tree.query(beside, &roomy()), None);
}

#[test]
fn lines_on_the_rim_of_the_range_but_for_rounding_are_the_trees() {
    let tree = RiTree::new(Test::smooth(|[s, ..]| s), Parameters::default());
    for (s, rounded) in [(2.0, 2.0_f64.next_up()), (-1.0, (-1.0_f64).next_down())] {
        let point = LinePoint { pair: PlanePair::ALL[0], stuv: [rounded, 0.5, 0.5, 0.5] };
        assert!((interpolated(tree.query(point, &roomy())) - s).abs() < 1e-12);
    }
    tree.check_invariants();
}

#[test]
fn a_line_whose_intercepts_overflow_is_traced_not_missed() {
    let tree = RiTree::new(Test::smooth(|_| 1.0), Parameters::default());
    for bad in [f64::NAN, f64::INFINITY] {
        let point = LinePoint { pair: PlanePair::ALL[0], stuv: [0.5, bad, 0.5, 0.5] };
        assert_eq!(tree.query(point, &roomy()), Some(Answer::Trace(Reason::Guard)));
    }
}

#[test]
fn splitting_ends_where_f64_does() {
    let rim = LinePoint { pair: PlanePair::ALL[0], stuv: [0.7, 0.5, 0.3, 0.2] };
    for cache in [roomy(), Cache::new(0)] {
        let tree = RiTree::new(step(false), settings(f64::NAN, u32::MAX));
        assert_eq!(tree.query(rim, &cache), Some(Answer::Trace(Reason::Silhouette)));
        let smooth = LinePoint { stuv: [0.1; 4], ..rim };
        assert!((interpolated(tree.query(smooth, &cache)) - 0.2).abs() < 1e-9);
        tree.check_invariants();
    }
}
