//! Time, as trees under one cache tell it.

use glam::DVec3;

use super::*;
use crate::geometry::primitives::icosphere;
use crate::geometry::{ClosedMesh, Line, UnitDir};

#[test]
fn trees_share_one_clock_so_that_the_one_asked_last_is_the_newest() {
    let ball = || Body::new(ClosedMesh::new(icosphere(2)).expect("closed").0);
    let (often, once) = (ball(), ball());
    let parameters = Parameters::default();
    let interpolation = Interpolation::Quadrilinear { parameters };
    let settings = TreeSettings { interpolation, ..TreeSettings::default() };
    let forest = Forest::new(vec![&often, &once], settings, false);
    let line = Line::new(DVec3::ZERO, UnitDir::new(DVec3::new(1.0, 0.2, 0.1)).expect("a direction"));
    let line = line.expect("finite");
    let newest = |organ: usize| {
        let grove = forest.enter();
        let Some(OrganTree::Quadrilinear(tree)) = grove.tree(organ) else { panic!("no tree") };
        let _ = tree.query(tree.attribute().space().point_of(&line), &forest.cache);
        let mut stamps = Vec::new();
        tree.collect_stamps(&mut stamps);
        stamps.iter().map(|s| s.0).max().expect("leaves")
    };
    let old = (0..50).map(|_| newest(0)).max().expect("asked");
    assert!(newest(1) > old);
}

#[test]
fn when_the_shared_clock_wraps_around_pruning_errs_and_no_answer_does() {
    let ball = Body::new(ClosedMesh::new(icosphere(3).map_vertices(|v| 50.0 * v)).expect("closed").0);
    let quadrilinear = Interpolation::Quadrilinear { parameters: Parameters::default() };
    for interpolation in [quadrilinear, Interpolation::SquaredChord { tolerance_mm: 1.0 }] {
        let lengths = |start: u32, cache_bytes: usize| {
            let settings = TreeSettings { interpolation, cache_bytes, ..TreeSettings::default() };
            let forest = Forest::new(vec![&ball], settings, false);
            forest.clock.store(start, Ordering::Relaxed);
            let mut lengths = Vec::new();
            for i in 0..60 {
                let (y, z) = (f64::from(i % 10) * 5.0 - 22.0, f64::from(i / 10) * 8.0 - 20.0);
                let ray = Segment::between(DVec3::new(-200.0, y, z), DVec3::new(200.0, z, y)).expect("a ray");
                let grove = forest.enter();
                let tree = &mut grove.tree(0).expect("a tree").descent();
                lengths.push(grove.length_mm(tree, &ray).map(f64::to_bits));
                drop(grove);
                forest.prune_if_full();
            }
            forest.check_invariants();
            lengths
        };
        let expected = lengths(1, 100_000_000);
        for cache_bytes in [100_000_000, 60_000] {
            assert!(lengths(u32::MAX - 30, cache_bytes) == expected, "{interpolation:?}, {cache_bytes}");
        }
    }
}
