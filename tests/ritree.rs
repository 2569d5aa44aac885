//! Projections by RI-trees: the laws of the tree, seen from outside.

mod common;

use chordfield::linespace::{Cell, LinePoint, PlanePair};
use chordfield::modes::Control;
use chordfield::modes::project::{Found, Interpolation, Method, Projection, Projector, TreeSettings, Wanted};
use chordfield::ritree::{Attribute, Cache, Parameters, RiTree, oldest_to_keep};
use chordfield::scene::Scene;
use common::{nested_balls, scene};

const LENGTHS: Wanted = Wanted { lengths: true, attenuation: true, colour: true };

fn cone_scene(pixels: u32) -> Scene {
    // The second view is one of the first's lines walked the other way.
    let text = nested_balls(pixels).replace("kind = \"parallel\"", "gantry_deg = [20, 200]\ncouch_deg = 15");
    scene(&text).expect("a scene")
}

fn settings(cache_bytes: usize) -> TreeSettings {
    let parameters = Parameters { distance_threshold: 0.02, max_depth: 20, ..Parameters::default() };
    let interpolation = Interpolation::Quadrilinear { parameters };
    TreeSettings { interpolation, cache_bytes, ..TreeSettings::default() }
}

fn projector(scene: &Scene, settings: TreeSettings) -> Projector<'_> {
    Projector::new(scene, LENGTHS, None, Method::RiTree(settings)).expect("a projector")
}

fn view(projector: &Projector, scene: &Scene, index: usize) -> Projection {
    let view = &scene.beam.views().expect("views")[index];
    projector.project(view, index as u64, &Control::none()).expect("a projection")
}

fn bits(projection: &Projection) -> Vec<u32> {
    let mut all: Vec<f32> = projection.own_length_mm(0);
    all.extend(projection.own_length_mm(1));
    all.extend(projection.line_integral());
    all.extend(projection.colour().concat());
    all.into_iter().map(f32::to_bits).collect()
}

#[test]
fn images_are_the_same_bits_for_any_threads_order_and_cache_cold_or_warm() {
    let squared = |cache_bytes| TreeSettings { cache_bytes, ..TreeSettings::default() };
    let scene = cone_scene(100);
    assert_the_same_bits(&scene, settings);
    assert_the_same_bits(&scene, squared);
}

fn assert_the_same_bits(scene: &Scene, settings: impl Fn(usize) -> TreeSettings + Sync) {
    let reference = projector(scene, settings(100_000_000));
    let expected = [0, 1].map(|i| bits(&view(&reference, scene, i)));
    assert_eq!(
        [1, 0].map(|i| bits(&view(&reference, scene, i))),
        [expected[1].clone(), expected[0].clone()],
        "warm"
    );
    for (threads, cache_bytes) in [(1, 100_000_000), (2, 200_000), (8, 200_000), (2, 0), (8, 20_000)] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let projector = projector(scene, settings(cache_bytes));
            for i in [1, 0] {
                assert_eq!(
                    bits(&view(&projector, scene, i)),
                    expected[i],
                    "{threads} threads, {cache_bytes} bytes"
                );
            }
            projector.check_invariants();
            assert!(projector.forest().expect("trees").tree_bytes <= cache_bytes);
        });
    }
}

#[test]
fn the_error_falls_with_the_threshold_and_tracing_with_the_depth() {
    let scene = cone_scene(200);
    let views = scene.beam.views().expect("views");
    let run = |distance_threshold: f64, max_depth: u32| {
        let parameters = Parameters { distance_threshold, max_depth, ..Parameters::default() };
        let projector = projector(
            &scene,
            TreeSettings {
                interpolation: Interpolation::Quadrilinear { parameters },
                ..TreeSettings::default()
            },
        );
        let projection = view(&projector, &scene, 0);
        assert_eq!(projector.spot_check(&[], 1, 3), None, "no views, nothing to compare");
        let error = projector.spot_check(&views[..1], 20_000, 3).expect("trees").mean;
        let traced = projection.found().iter().filter(|&&found| found == Found::Traced).count();
        (error, traced)
    };
    let errors = [0.25, 0.05, 0.01].map(|threshold| run(threshold, 24).0);
    assert!(errors[0] > errors[1] && errors[1] > errors[2] && errors[2] < 0.5, "{errors:?}");
    let traced = [16, 20, 24, 28].map(|depth| run(0.05, depth).1);
    assert!(traced.windows(2).all(|w| w[1] < w[0]), "{traced:?}");
}

#[test]
fn every_ray_is_accounted_for_and_trees_grow_only_where_rays_go() {
    let scene = cone_scene(100);
    let projector = projector(&scene, settings(100_000_000));
    let projection = view(&projector, &scene, 0);
    let (counts, queries) = (projection.counts(), projection.queries());
    assert_eq!(
        counts.organ_rays,
        counts.organ_rays_exact
            + counts.organ_rays_interpolated
            + counts.organ_rays_skipped_by_bounds
            + counts.organ_rays_skipped_unneeded
    );
    assert_eq!(queries.interpolated, counts.organ_rays_interpolated);
    assert_eq!(
        queries.queries,
        queries.interpolated
            + queries.traced_silhouette
            + queries.traced_classes
            + queries.traced_angle
            + queries.traced_guard
    );
    assert!(queries.interpolated > 4 * queries.traced_silhouette, "{queries:?}");
    let forest = projector.forest().expect("trees");
    assert_eq!(forest.trees, 2);
    assert_eq!(
        forest.shape.leaves_by_depth.iter().sum::<u64>(),
        forest.shape.smooth_leaves + forest.shape.empty_leaves + forest.shape.traced_leaves
    );
    // The opposite view walks the same lines backwards: a symmetric attribute needs no new sample for most.
    let _ = view(&projector, &scene, 1);
    let after = projector.forest().expect("trees").build.samples_taken;
    assert!(after < 2 * forest.build.samples_taken);

    // Bodies with few planes are clipped.
    let without = TreeSettings { least_planes: 10_000, ..settings(100_000_000) };
    let projector = self::projector(&scene, without);
    let projection = view(&projector, &scene, 0);
    assert_eq!((projection.queries().queries, projector.forest().expect("a forest").trees), (0, 0));
    let exact = Projector::new(&scene, LENGTHS, None, Method::Exact(None)).expect("a projector");
    assert_eq!(bits(&projection), bits(&view(&exact, &scene, 0)), "all traced is exact");
}

#[test]
fn a_source_inside_the_box_is_traced() {
    let text = nested_balls(32).replace(
        "kind = \"parallel\"",
        "source_mm = [0, 0, 0]\ndetector_centre_mm = [0, 300, 0]\ncolumn_direction = [1, 0, 0]\nrow_direction = [0, 0, -1]",
    );
    let scene = scene(&text).expect("a scene");
    let near = view(&projector(&scene, settings(100_000_000)), &scene, 0);
    let exact = Projector::new(&scene, LENGTHS, None, Method::Exact(None)).expect("a projector");
    assert_eq!(near.own_length_mm(0), view(&exact, &scene, 0).own_length_mm(0));
    assert!(near.queries().traced_source_or_target_inside > 0);
}

#[test]
fn trees_of_any_tolerance_depth_and_cache_stay_whole_and_keep_their_answers() {
    let scene = cone_scene(24);
    let exact = Projector::new(&scene, LENGTHS, None, Method::Exact(None)).expect("a projector");
    let exact = view(&exact, &scene, 0).own_length_mm(1);
    for (distance_threshold, max_depth) in
        [(0.0, 12), (f64::MIN_POSITIVE, 20), (f64::MAX, 28), (0.02, 0), (0.02, 60)]
    {
        let parameters = Parameters { distance_threshold, max_depth, ..Parameters::default() };
        let interpolation = Interpolation::Quadrilinear { parameters };
        let lengths = lengths_whatever_the_cache(&scene, interpolation);
        // Whatever is traced is exact; whatever is interpolated is a length.
        assert!(lengths.iter().all(|length| (0.0..=40.5).contains(length)), "{distance_threshold}");
        if max_depth == 0 {
            assert_eq!(lengths, exact, "a root cell holds lines that hit and lines that miss");
        }
    }
}

/// Lengths in the first view, which trees find alike, and stay whole, under caches of any size.
fn lengths_whatever_the_cache(scene: &Scene, interpolation: Interpolation) -> Vec<f32> {
    let mut first = None;
    for cache_bytes in [100_000_000, 100_000, 1_000, 0] {
        let settings = TreeSettings { interpolation, cache_bytes, ..TreeSettings::default() };
        let projector = projector(scene, settings);
        let views = [0, 1].map(|i| bits(&view(&projector, scene, i)));
        projector.check_invariants();
        let expected = first.get_or_insert_with(|| views.clone());
        assert!(*expected == views, "{interpolation:?}, {cache_bytes} bytes");
    }
    let settings = TreeSettings { interpolation, ..TreeSettings::default() };
    view(&projector(scene, settings), scene, 0).own_length_mm(1).to_vec()
}

#[test]
fn trees_of_squared_chords_of_any_tolerance_and_cache_stay_whole_and_keep_their_answers() {
    let scene = cone_scene(24);
    let exact = Projector::new(&scene, LENGTHS, None, Method::Exact(None)).expect("a projector");
    let exact = view(&exact, &scene, 0).own_length_mm(1);
    for tolerance_mm in [0.0, f64::MIN_POSITIVE, 0.3, f64::MAX, f64::INFINITY] {
        let interpolation = Interpolation::SquaredChord { tolerance_mm };
        let lengths = lengths_whatever_the_cache(&scene, interpolation);
        assert!(lengths.iter().all(|length| (0.0..=40.5).contains(length)), "{tolerance_mm} mm: {lengths:?}");
        if tolerance_mm < 1e-9 {
            assert_eq!(lengths, exact, "nothing is known so well");
        }
    }
}

/// An attribute whose cells always split.
struct Rough;

impl Attribute for Rough {
    type Output = f64;
    type Real = f64;

    fn sample(&self, line: LinePoint) -> f64 {
        line.stuv.iter().map(|x| (1e3 * x).fract()).sum()
    }

    fn class(&self, _: &f64) -> u32 {
        1
    }

    fn miss(&self) -> f64 {
        0.0
    }

    fn is_miss(&self, _: u32) -> bool {
        false
    }

    fn distance(&self, _: &f64, _: &f64) -> f64 {
        1.0
    }

    fn interpolate(&self, parts: &[(f64, &f64)]) -> f64 {
        parts.iter().map(|(weight, value)| weight * *value).sum()
    }

    fn is_certainly_empty(&self, _: PlanePair, _: &Cell) -> bool {
        false
    }
}

#[test]
fn a_million_cells_are_grown_checked_and_forgotten() {
    let (mut tree, cache) = (
        RiTree::new(Rough, Parameters { distance_threshold: 0.5, max_depth: 18, ..Parameters::default() }),
        Cache::new(usize::MAX),
    );
    let mut state = 1_u64;
    let mut unit = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    for i in 0..800_000 {
        let stuv = [0; 4].map(|_| 3.0 * unit() - 1.0);
        let _ = tree.query(LinePoint { pair: PlanePair::ALL[i % 6], stuv }, &cache);
    }
    let cells: u64 = tree.shape().leaves_by_depth.iter().sum::<u64>();
    assert!(2 * cells > 1_000_000, "{cells} leaves and as many nodes");
    assert_eq!(tree.check_invariants(), cache.used_bytes());
    tree.prune(u32::MAX, &cache);
    assert_eq!((tree.check_invariants(), cache.used_bytes()), (0, 0));
}

#[test]
fn at_the_end_of_time_trees_are_pruned_without_judgement_and_answer_alike() {
    let (mut tree, cache) = (
        RiTree::new(Rough, Parameters { distance_threshold: 0.5, max_depth: 9, ..Parameters::default() }),
        Cache::new(1 << 20),
    );
    let point = |i: u32| LinePoint { pair: PlanePair::ALL[0], stuv: [0.1, 0.2, 0.3, f64::from(i) / 100.0] };
    let ask = |tree: &RiTree<Rough>| (0..100).map(|i| tree.query(point(i), &cache)).collect::<Vec<_>>();
    let before = ask(&tree);
    tree.tick_to(u32::MAX);
    tree.tick();
    assert_eq!(ask(&tree), before);
    let mut stamps = Vec::new();
    tree.collect_stamps(&mut stamps);
    assert!(stamps.iter().all(|stamp| stamp.0 == u32::MAX), "time stands still");
    tree.prune(oldest_to_keep(stamps, 0), &cache);
    assert_eq!(ask(&tree), before);
    assert_eq!(tree.check_invariants(), cache.used_bytes());
}

#[test]
fn squared_chords_keep_to_their_tolerance() {
    let scene = cone_scene(200);
    let views = scene.beam.views().expect("views");
    // The balls have so few faces that little is known to within half a millimetre, and nothing to within a hundredth.
    for (tolerance_mm, is_mostly_known) in [(4.0, true), (2.0, true), (0.5, false), (0.01, false)] {
        let interpolation = Interpolation::SquaredChord { tolerance_mm };
        let projector = projector(&scene, TreeSettings { interpolation, ..TreeSettings::default() });
        let projection = view(&projector, &scene, 0);
        let found = projection.found();
        let count = |kind| found.iter().filter(|&&found| found == kind).count();
        assert!(
            !is_mostly_known || count(Found::Interpolated) > 3 * count(Found::Traced),
            "{tolerance_mm} mm"
        );
        let errors = projector.spot_check(&views, 20_000, 3).expect("trees");
        assert!(!is_mostly_known || errors.compared > 2_000, "{errors:?}");
        let is_kept = errors.p999 <= tolerance_mm && errors.max <= 5.0 * tolerance_mm;
        assert!(errors.compared == 0 || is_kept, "{errors:?}");
    }
}
