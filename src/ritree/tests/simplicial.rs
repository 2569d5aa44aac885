//! Trees that are looked at on some levels only and interpolate in simplices.

use glam::DVec3;

use super::*;
use crate::attributes::exit_ray::ExitRay;
use crate::attributes::lines::{ByDirection, SurfaceLines};
use crate::attributes::smooth_chord::SmoothChords;
use crate::attributes::surface::FirstHit;
use crate::surface::optics::Optics;
use crate::surface::{Shell, Sphere, Surface, lattice_patches};

const SIMPLICIAL: Sampling = Sampling { scheme: Scheme::Simplicial, parts: true, ..Sampling::PAPER };

#[test]
fn beside_a_discontinuity_lines_are_interpolated_that_a_simplex_of_one_class_holds() {
    let answers = |sampling| {
        let tree = RiTree::new(Test { sampling, ..step(false) }, settings(0.01, 8));
        let (cache, mut interpolated) = (roomy(), 0);
        for point in points(6, 3_000) {
            match tree.query(point, &cache) {
                Some(Answer::Interpolated(sample)) => {
                    let error = sample.value - tree.attribute().exact(point.stuv);
                    assert!(error.abs() < 1e-9, "{point:?}: {error}, bled over the step");
                    interpolated += 1;
                }
                Some(Answer::Trace(Reason::Silhouette)) => {}
                other => panic!("{other:?}"),
            }
        }
        tree.check_invariants();
        interpolated
    };
    let (cells, simplices) = (answers(Sampling::PAPER), answers(SIMPLICIAL));
    assert!(simplices > cells + 500, "{simplices}, without simplices {cells}");
}

#[test]
fn directions_too_far_apart_in_a_cell_may_be_near_in_a_simplex() {
    // Turned by 24° over the cell's side, but by twice that from corner to corner.
    let turning = |sampling| Test { sampling, turns: 0.28, ..Test::smooth(|[s, t, ..]| s + t) };
    let answer = |sampling, at| {
        let tree = RiTree::new(turning(sampling), settings(0.01, 4));
        let answer = tree.query(LinePoint { pair: PlanePair::ALL[0], stuv: at }, &roomy());
        tree.check_invariants();
        answer
    };
    // Along the diagonal from (s, t) = (1, 0) to (0, 1) directions are the same.
    let at = [0.8, -0.7, 0.3, 0.3];
    // Where no discontinuity is, that holds for surfaces that may hide parts of their own, too.
    let joined = Sampling { parts: false, tells_joined: true, ..SIMPLICIAL };
    for sampling in [SIMPLICIAL, joined] {
        let between = interpolated(answer(sampling, at));
        assert!((between - 0.1).abs() < 1e-12, "{between}");
    }
    // Not where nobody knows whether corners are joined.
    for sampling in [Sampling { parts: false, ..SIMPLICIAL }, Sampling::PAPER] {
        assert_eq!(answer(sampling, at), Some(Answer::Trace(Reason::Angle)));
    }
}

#[test]
fn simplices_go_through_the_middle_that_was_tested() {
    // Bent alike in all directions: a cell's middle is off by as much as the square of its side, and lines by 3/4 of that at most.
    let square = |x: [f64; 4]| x.iter().map(|x| x * x).sum();
    let sampling = Sampling { levels_per_look: 4, remembers: true, ..SIMPLICIAL };
    let tree = |threshold| RiTree::new(Test { sampling, ..Test::smooth(square) }, settings(threshold, 12));
    for (depth, side) in [(0, 3.0), (8, 0.75)] {
        let worst = 0.75 * side * side;
        let (tree, cache) = (tree(worst + 1e-9), roomy());
        let mut greatest = 0.0_f64;
        for point in points(8, 4_000) {
            let (answer, at) = tree.query_with_depth(point, &cache).expect("in range");
            let error = interpolated(Some(answer)) - square(point.stuv);
            assert!(at == depth && (-1e-9..=worst + 1e-9).contains(&error), "{point:?}: {error} at {at}");
            greatest = greatest.max(error);
        }
        assert!(greatest > 0.7 * worst, "{greatest} of {worst}");
        // The middle of a cell of that depth.
        let middle = LinePoint { pair: PlanePair::ALL[0], stuv: [-1.0 + 0.5 * side; 4] };
        let told = interpolated(tree.query(middle, &cache));
        assert!((told - square(middle.stuv)).abs() < 1e-12, "{told}");
        tree.check_invariants();
    }
}

/// Holds what cells on the way to lines say, asked by the diagonal first, against what all of their corners say. Returns how many
/// cells were looked at, and of how many the diagonal told it.
fn looked_at<A: Attribute<Output: PartialEq + std::fmt::Debug>>(
    attribute: &A,
    parameters: &Parameters,
    lines: &[LinePoint],
) -> (u64, u64) {
    let (mut seen, mut sooner) = (0, 0);
    for line in lines {
        let mut place = Place::root(line.pair);
        loop {
            let sampled = AtomicU64::new(0);
            let count = |lines| {
                sampled.fetch_add(lines, Ordering::Relaxed);
            };
            let look = place.look(attribute, parameters, None, count);
            // Corners that are known are all looked at.
            let known = Box::new(place.sample(attribute));
            let of_all = place.look(attribute, parameters, Some(known), |_| ());
            let is_same = match (&look, &of_all) {
                (Look::Split(_), Look::Split(_)) => true,
                (look, of_all) => look == of_all,
            };
            assert!(is_same, "{place:?}: {look:?}, by all corners {of_all:?}");
            if place.is_looked_at(attribute, parameters) {
                seen += 1;
                sooner += u64::from(sampled.into_inner() < 16);
            }
            if matches!(look, Look::Final(_)) {
                break;
            }
            place = place.half(place.side_of::<f64>(&line.stuv));
        }
    }
    (seen, sooner)
}

#[test]
fn a_diagonal_says_no_more_than_all_corners() {
    let sampling = Sampling { levels_per_look: 4, levels_spared: 2, remembers: true, ..SIMPLICIAL };
    let empty = |[s, t, ..]: [f64; 4]| if s + t > 3.5 { 1 } else { MISS };
    let smooth = Test::smooth(|[s, t, u, v]| (s + 2.0 * t).sin() + u * v * v);
    let small = Test { class: empty, ..Test::smooth(|_| 1.0) };
    let turning = Test { turns: 0.28, ..Test::smooth(|[s, t, ..]| s + t) };
    let told = [smooth, small, turning, step(true), step(false)]
        .map(|attribute| looked_at(&Test { sampling, ..attribute }, &settings(0.05, 11), &points(9, 300)));
    let [seen, sooner] = told.into_iter().fold([0; 2], |sum, told| [sum[0] + told.0, sum[1] + told.1]);
    assert!(told.iter().all(|told| told.0 >= 300) && sooner > seen / 4, "{sooner} of {seen}: {told:?}");
}

#[test]
fn a_diagonal_says_no_more_of_mirrors_and_glass() {
    let sheet = lattice_patches(&sheet_lattice()).into_iter().map(|patch| (patch, 1)).collect();
    let sheet = Surface::Shell(Shell::new(sheet).expect("patches"));
    let ball = Surface::Sphere(Sphere::new(DVec3::splat(3.0), 2.0).expect("a sphere"));
    let (parameters, glass) = (settings(0.05, 24), Optics::Glass { index: 1.4 });
    for (surface, is_convex) in [(&sheet, false), (&ball, true)] {
        let lines = |by_direction| SurfaceLines::new(surface, is_convex, by_direction).expect("an extent");
        // Lines that meet the middle of the box, at most of its places.
        let mut asked = points(10, 60);
        asked.iter_mut().for_each(|line| line.stuv = line.stuv.map(|x| 0.5 + 0.2 * (x - 0.5)));
        let told = [
            looked_at(&FirstHit::<f64>::new(lines(ByDirection::Little)), &parameters, &asked),
            looked_at(
                &ExitRay::<f64>::new(lines(ByDirection::Little), Optics::Mirror, 8, 50.0),
                &parameters,
                &asked,
            ),
            looked_at(&ExitRay::<f64>::new(lines(ByDirection::Much), glass, 8, 50.0), &parameters, &asked),
        ];
        assert!(told.iter().all(|&(seen, sooner)| seen > 100 && sooner > seen / 4), "{told:?}");
    }
    let chords = SmoothChords::<f64>::new(&ball).expect("an extent");
    let (seen, sooner) = looked_at(&chords, &parameters, &points(11, 60));
    assert!(seen > 60 && sooner > 0, "{sooner} of {seen}");
}

fn sheet_lattice() -> Vec<Vec<DVec3>> {
    let wave = |i: i32, j: i32| 0.3 * f64::from(i * i - 2 * j).sin();
    (0..6).map(|i| (0..6).map(|j| DVec3::new(f64::from(i), f64::from(j), wave(i, j))).collect()).collect()
}

#[test]
fn cells_that_are_not_looked_at_are_split_unseen() {
    let sampling = Sampling { levels_per_look: 4, levels_spared: 2, remembers: true, ..SIMPLICIAL };
    for attribute in [Test::smooth(|[s, t, u, v]| (s + 2.0 * t).sin() + u * v * v), step(true)] {
        let tree =
            |cache| (RiTree::new(Test { sampling, ..attribute }, settings(0.05, 11)), Cache::new(cache));
        let trees = [1 << 30, 30_000, 0].map(tree);
        for point in points(7, 2_000) {
            let [roomy, small, none] = trees.each_ref().map(|(tree, cache)| tree.query(point, cache));
            assert!(roomy == small && roomy == none, "{point:?}");
        }
        let by_depth = trees[0].0.shape().leaves_by_depth;
        let is_looked_at = |depth: usize| depth == 9 || (11 - depth).is_multiple_of(4);
        let is_right = |(depth, n): (usize, &u64)| *n == 0 || is_looked_at(depth);
        assert!(by_depth.iter().enumerate().all(is_right), "{by_depth:?}");
        assert!(by_depth[7] > 0 && by_depth.len() > 8, "{by_depth:?}");
        trees.iter().for_each(|(tree, _)| assert!(tree.check_invariants() <= 1 << 30));
    }
}
