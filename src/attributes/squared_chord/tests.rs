//! The contract, over shapes that are the model's best and worst cases; and the laws of trees.

mod hard;
mod shapes;

use glam::{DMat3, DVec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::exact::Lengths;
use crate::geometry::primitives::{cube, prism};
use crate::geometry::{RayGrid, Region, Segment, Upstream};
use crate::ritree::{Cache, FittedTree, oldest_to_keep};
use shapes::{body, cut_ellipsoid, ellipsoid, general_shapes, shapes, superellipsoid, turn};

/// Lines through two points of a somewhat larger ellipsoid of inertia: as many hit a needle as a ball.
fn lines_near(body: &Body, seed: u64, count: usize) -> Vec<Line> {
    let (middle, to_ball) = body.ball_frame();
    let from_ball = to_ball.inverse();
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut point = || middle + from_ball * (1.1 * DVec3::from([0; 3].map(|_| rng.random_range(-1.0..1.0))));
    let across = |(a, b): (DVec3, DVec3)| Segment::between(a + 3.0 * (a - b), b).map(|s| *s.line());
    (0..count).filter_map(|_| across((point(), point()))).collect()
}

fn exact_mm(body: &Body, line: &Line) -> f64 {
    let mut parts = Vec::new();
    body.chords_by(Engine::Clip, line, &mut parts);
    parts.iter().map(Interval::length).sum()
}

/// Lengths that a tree knows, with the exact ones.
fn known_lengths(
    body: &Body,
    tree: &FittedTree<SquaredChord>,
    cache: &Cache,
    lines: &[Line],
) -> Vec<[f64; 2]> {
    let mut known = Vec::new();
    SquaredChord::ask_all(tree, lines.iter().enumerate(), cache, |_, line, asked| {
        let of_leaf = |(leaf, pair, stuv): Asked| tree.fit().known(leaf, line, pair, stuv);
        let length = match asked.map_or(Known::Miss, of_leaf) {
            Known::Miss => 0.0,
            Known::Length(length) => length,
            Known::Nothing => return,
        };
        known.push([length, exact_mm(body, line)]);
    });
    known
}

#[test]
fn of_a_thousand_lengths_999_are_within_the_tolerance_and_none_beyond_five_times_it() {
    for (name, body) in shapes().into_iter().chain(general_shapes()) {
        let unit_mm = 0.5 * body.bounds().size().max_element();
        for share in [0.05, 0.005] {
            let tolerance_mm = share * unit_mm;
            let tree = FittedTree::new(SquaredChord::new(&body, tolerance_mm, false).expect("convex"));
            let cache = Cache::new(1 << 30);
            let lines = lines_near(&body, 1, 4_000);
            let known = known_lengths(&body, &tree, &cache, &lines);
            let beyond =
                |factor: f64| known.iter().filter(|[a, b]| (a - b).abs() > factor * tolerance_mm).count();
            assert!(beyond(1.0) * 1000 <= lines.len(), "{name}, {tolerance_mm} mm: {} beyond", beyond(1.0));
            assert_eq!(beyond(5.0), 0, "{name}, {tolerance_mm} mm");
        }
    }
}

#[test]
fn smooth_bodies_are_mostly_known() {
    for (name, body, least) in [("ellipsoid", ellipsoid(4), 0.85), ("superellipsoid", superellipsoid(), 0.5)]
    {
        let tree = FittedTree::new(SquaredChord::new(&body, 1.0, false).expect("convex"));
        let lines = lines_near(&body, 2, 4_000);
        let hits = lines.iter().filter(|line| exact_mm(&body, line) > 0.0).count();
        let known = known_lengths(&body, &tree, &Cache::new(1 << 30), &lines);
        let known_hits = known.iter().filter(|[_, exact]| *exact > 0.0).count();
        assert!(known_hits as f64 > least * hits as f64, "{name}: {known_hits} of {hits} are known");
    }
}

#[test]
fn lines_that_see_few_faces_are_clipped_exactly() {
    let of_box = body(cube(1.0).map_vertices(|v| turn() * (v * DVec3::new(100.0, 60.0, 30.0))));
    let of_prism = body(prism(64).map_vertices(|v| v * DVec3::new(40.0, 40.0, 90.0)));
    for (body, least) in [(of_box, 0.98), (of_prism, 0.9)] {
        let tree = FittedTree::new(SquaredChord::new(&body, 1e-3, true).expect("convex"));
        let lines = lines_near(&body, 9, 2_000);
        let known = known_lengths(&body, &tree, &Cache::new(1 << 30), &lines);
        assert!(known.len() as f64 >= least * lines.len() as f64, "{} of {}", known.len(), lines.len());
        for [length, exact] in known {
            assert!((length - exact).abs() < 1e-9, "{length}, not {exact}");
        }
    }
}

#[test]
fn what_is_not_convex_is_known_where_no_outline_is_near() {
    for (name, body) in general_shapes() {
        let tree = FittedTree::new(SquaredChord::new(&body, 2.0, false).expect("a frame"));
        let lines = lines_near(&body, 6, 4_000);
        let hits = lines.iter().filter(|line| exact_mm(&body, line) > 0.0).count();
        let known = known_lengths(&body, &tree, &Cache::new(1 << 30), &lines);
        let known_hits = known.iter().filter(|[_, exact]| *exact > 0.0).count();
        assert!(3 * known_hits > hits, "{name}: {known_hits} of {hits} are known");
    }
}

#[test]
fn thin_parts_of_a_body_are_never_left_out() {
    // Lines aimed at the sliver and the hair, through the ball or past it: each length has all parts, or is traced.
    for (name, body) in general_shapes().into_iter().skip(3) {
        let tree = FittedTree::new(SquaredChord::new(&body, 0.5, false).expect("a frame"));
        let cache = Cache::new(1 << 30);
        let surface = body.surface().mesh();
        let thin: Vec<_> = surface.faces.iter().filter(|face| face[0] >= 642).collect();
        let mut rng = Pcg64::seed_from_u64(8);
        let mut lines = Vec::new();
        for _ in 0..2_000 {
            let [a, b, c] = thin[rng.random_range(0..thin.len())].map(|v| surface.vertices[v as usize]);
            let target = a.lerp(b, rng.random_range(0.0..0.5)).lerp(c, rng.random_range(0.0..0.5));
            let from = 50.0 * DVec3::from([0; 3].map(|_| rng.random_range(-1.0..1.0)));
            lines.extend(Segment::between(from + 9.0 * (from - target), target).map(|s| *s.line()));
        }
        let known = known_lengths(&body, &tree, &cache, &lines);
        assert!(known.len() < lines.len(), "{name}");
        for [length, exact] in known {
            assert!((length - exact).abs() < 2.5, "{name}: {length} for {exact}");
        }
    }
}

#[test]
fn a_body_is_never_lost() {
    for (name, body) in shapes().into_iter().chain(general_shapes()) {
        let tree = FittedTree::new(SquaredChord::new(&body, 0.5, false).expect("convex"));
        let known = known_lengths(&body, &tree, &Cache::new(1 << 30), &lines_near(&body, 3, 4_000));
        let lost = known.iter().filter(|[length, exact]| *length == 0.0 && *exact > 0.0).count();
        assert_eq!(lost, 0, "{name}");
    }
}

#[test]
fn chords_lie_where_they_are() {
    let body = ellipsoid(4);
    let tree = FittedTree::new(SquaredChord::new(&body, 1.0, true).expect("convex"));
    let cache = Cache::new(1 << 30);
    let mut compared = 0;
    for line in lines_near(&body, 4, 2_000) {
        let Some((pair, stuv)) = tree.fit().place_of(&line) else { continue };
        let near = tree.ask(pair, &stuv, &cache, |leaf, _| tree.fit().chord(leaf, &line, pair, &stuv));
        if let (Some(Some(near)), Some(exact)) = (near, body.clipper().expect("convex").chord(&line)) {
            assert!((near.start() - exact.start()).abs() < 2.0, "{near:?}, not {exact:?}");
            assert!((near.end() - exact.end()).abs() < 2.0, "{near:?}, not {exact:?}");
            compared += 1;
        }
    }
    assert!(compared > 600, "{compared}");
}

/// A cone askew, and parallel rays, to a body about a centre.
fn grids(size: u32, centre: DVec3) -> [RayGrid; 2] {
    let frame = DMat3::from_rotation_x(0.4) * DMat3::from_rotation_y(0.9);
    let step = 300.0 / f64::from(size);
    let steps = [frame * DVec3::X * step, frame * DVec3::Y * step];
    let corner = centre + frame * DVec3::new(-150.0, -150.0, 200.0);
    let source = centre + frame * DVec3::new(30.0, 20.0, -500.0);
    let path = frame * DVec3::new(10.0, -20.0, 500.0);
    let grid = |upstream| RayGrid::new(upstream, corner, steps, [size, size]).expect("a grid");
    [grid(Upstream::Source(source)), grid(Upstream::Path(path))]
}

#[test]
fn runs_find_what_single_rays_find() {
    runs_are_single_rays(&superellipsoid(), 2_000);
    runs_are_single_rays(&general_shapes().swap_remove(0).1, 1_000);
    runs_are_single_rays(&shapes().swap_remove(3).1, 1_500);
}

fn runs_are_single_rays(body: &Body, least: usize) {
    let tree = FittedTree::new(SquaredChord::new(body, 0.3, true).expect("a frame"));
    let cache = Cache::new(1 << 30);
    for grid in grids(150, DVec3::ZERO) {
        let image = ImageChords::new(tree.fit(), &grid).expect("between source and pixels");
        let region = grid.whole();
        let (mut lengths, mut middles, mut open) =
            (vec![0.0; region.pixels()], vec![0.0; region.pixels()], Vec::new());
        let mut found = ImageLengths { lengths: &mut lengths, middles: Some(&mut middles), open: &mut open };
        image.find(&tree, &region, &cache, &mut found);
        let mut is_open = vec![false; region.pixels()];
        open.iter().for_each(|run| is_open[places_of(&region, run).1].fill(true));
        let (mut compared, mut misses, mut differ) = (0, 0, 0);
        for (i, (column, row)) in region.places().enumerate() {
            let line = *grid.segment(column, row).line();
            let Some((pair, stuv)) = tree.fit().place_of(&line) else {
                assert_eq!(lengths[i], 0.0);
                continue;
            };
            let ask = |leaf: &ChordLeaf, _| {
                (tree.fit().known(leaf, &line, pair, &stuv), tree.fit().middle_mm(leaf, &line, pair, &stuv))
            };
            match tree.ask(pair, &stuv, &cache, ask) {
                (Known::Length(length), Some(middle)) if !is_open[i] => {
                    assert!(
                        (length - lengths[i]).abs() < 1e-9,
                        "{column} {row}: {length}, not {}",
                        lengths[i]
                    );
                    assert!(
                        (middle - middles[i]).abs() < 1e-9,
                        "{column} {row}: {middle}, not {}",
                        middles[i]
                    );
                    compared += 1;
                }
                // Beyond the outline, a run knows more; thresholds of runs are those of a block's largest path.
                _ if !is_open[i] => {
                    assert_eq!((lengths[i], exact_mm(body, &line)), (0.0, 0.0));
                    misses += 1;
                }
                (Known::Nothing, _) => {}
                // A single line may pass a ball around the body by.
                (Known::Miss, _) => assert_eq!(exact_mm(body, &line), 0.0),
                _ => differ += 1,
            }
        }
        assert!(compared > least && misses > 100 && differ < compared / 3, "{compared} {misses} {differ}");
    }
}

#[test]
fn what_a_pixel_gets_depends_neither_on_its_region_nor_on_the_cache() {
    for body in [cut_ellipsoid(), general_shapes().swap_remove(0).1] {
        pixels_keep_their_bits(&body);
    }
}

fn pixels_keep_their_bits(body: &Body) {
    let [grid, _] = grids(150, DVec3::ZERO);
    let length_bits = |tree: &FittedTree<SquaredChord>, cache: &Cache, region: &Region| {
        let image = ImageChords::new(tree.fit(), &grid).expect("between source and pixels");
        let mut lengths = vec![0.0; region.pixels()];
        image.trace(tree, region, cache, &mut lengths, &mut Vec::new());
        region.places().zip(lengths.into_iter().map(f64::to_bits)).collect::<Vec<_>>()
    };
    let new = || FittedTree::new(SquaredChord::new(body, 0.5, false).expect("a frame"));
    let whole: std::collections::HashMap<_, _> =
        length_bits(&new(), &Cache::new(1 << 30), &grid.whole()).into_iter().collect();
    let regions = [(100..150, 0..40), (3..70, 60..150), (64..128, 64..128), (17..18, 30..110)];
    for limit in [0, 2_000, 30_000, 1 << 30] {
        let (mut tree, cache) = (new(), Cache::new(limit));
        for (columns, rows) in regions.clone() {
            for (place, bits) in length_bits(&tree, &cache, &Region { columns, rows }) {
                assert_eq!(bits, whole[&place], "{place:?} with {limit} bytes");
            }
            assert!(cache.used_bytes() <= limit);
            assert_eq!(tree.check_invariants(), cache.used_bytes());
            if cache.is_full() {
                let mut stamps = Vec::new();
                tree.collect_stamps(&mut stamps);
                tree.prune(oldest_to_keep(stamps, limit * 3 / 10), &cache);
                cache.relieved();
                assert!(cache.used_bytes() <= limit * 3 / 10);
            }
            tree.tick_to(u32::try_from(limit).unwrap_or(0) + rows_so_far(&tree));
        }
    }
}

/// Any number that grows.
fn rows_so_far(tree: &FittedTree<SquaredChord>) -> u32 {
    tree.build_counts().samples_taken as u32
}

#[test]
fn single_lines_and_threads_get_the_same_bits() {
    let body = ellipsoid(3);
    let lines = lines_near(&body, 5, 2_000);
    let new = || FittedTree::new(SquaredChord::new(&body, 0.5, false).expect("convex"));
    let bits = |tree: &FittedTree<SquaredChord>, cache: &Cache, line: &Line| {
        let (pair, stuv) = tree.fit().place_of(line)?;
        match tree.ask(pair, &stuv, cache, |leaf, _| tree.fit().known(leaf, line, pair, &stuv)) {
            Known::Length(length) => Some(length.to_bits()),
            _ => None,
        }
    };
    let (alone, roomy) = (new(), Cache::new(1 << 30));
    let expected: Vec<_> = lines.iter().map(|line| bits(&alone, &roomy, line)).collect();
    let (tree, cache) = (new(), Cache::new(40_000));
    std::thread::scope(|scope| {
        for thread in 0..4 {
            let (tree, cache, lines, expected) = (&tree, &cache, &lines, &expected);
            scope.spawn(move || {
                for i in (0..lines.len()).step_by(5).map(|i| (i * 7 + thread * 501) % lines.len()) {
                    assert_eq!(bits(tree, cache, &lines[i]), expected[i]);
                }
            });
        }
    });
    assert_eq!(tree.check_invariants(), cache.used_bytes());
    // Many at a time, from a tree that is kept and from one that cannot be.
    for (tree, cache) in [(&alone, &roomy), (&new(), &Cache::new(0))] {
        let mut found = vec![None; lines.len()];
        SquaredChord::ask_all(tree, lines.iter().enumerate(), cache, |i, line, asked| {
            if let Some((leaf, pair, stuv)) = asked
                && let Known::Length(length) = tree.fit().known(leaf, line, pair, stuv)
            {
                found[i] = Some(length.to_bits());
            }
        });
        assert_eq!(found, expected);
    }
}

#[test]
fn pixels_beyond_the_outline_miss_and_few_within_do() {
    for (name, body) in shapes().into_iter().chain(general_shapes()) {
        for grid in grids(200, body.bounds().centre()) {
            let rows = outline::rows_within(body.surface(), body.walker(), &grid)
                .expect("between source and pixels");
            let mut lengths = vec![0.0; grid.whole().pixels()];
            body.view(&grid, None).trace(&grid.whole(), &mut Lengths(&mut lengths));
            let (mut within, mut hits) = (0, 0);
            for (i, (column, row)) in grid.whole().places().enumerate() {
                let is_within = rows[row as usize].contains(&column);
                assert!(is_within || lengths[i] == 0.0, "{name}: {column} {row} is hit");
                within += usize::from(is_within);
                hits += usize::from(lengths[i] > 0.0);
            }
            // A polygon of given directions is wide about a needle askew.
            let is_convex = body.convexity().is_ok();
            assert!(
                !is_convex || within <= hits + hits / 10 + 2500,
                "{name}: {within} pixels for {hits} hits"
            );
        }
    }
}
