//! What a tree keeps, forgets and finds again changes no answer.

use super::*;

fn bits(answer: Option<Answer<Sample>>) -> Option<Result<u64, Reason>> {
    answer.map(|a| match a {
        Answer::Interpolated(sample) => Ok(sample.value.to_bits()),
        Answer::Trace(reason) => Err(reason),
    })
}

#[test]
fn answers_are_the_same_bits_in_any_order_with_any_cache_pruned_or_not() {
    let grow = || RiTree::new(step(true), settings(0.01, 14));
    let all = points(6, 3_000);
    let (tree, cache) = (grow(), roomy());
    let expected: Vec<_> = all.iter().map(|&point| bits(tree.query(point, &cache))).collect();

    for limit in [0, 300, 20_000, 200_000] {
        let (mut tree, cache) = (grow(), Cache::new(limit));
        let mut order: Vec<usize> = (0..all.len()).rev().collect();
        let middle = order.len() / 2;
        order.rotate_left(middle);
        for (count, &i) in order.iter().enumerate() {
            let mut descent = tree.descent();
            // With what is remembered of another line, and of this one.
            for i in [i, (i + 1) % all.len(), i, i] {
                assert_eq!(bits(descent.query(all[i], &cache)), expected[i], "{limit} bytes, line {i}");
            }
            assert!(cache.used_bytes() <= limit);
            if count % 100 == 0 {
                tree.tick();
            }
            if cache.is_full() && count % 50 == 0 {
                let mut stamps = Vec::new();
                tree.collect_stamps(&mut stamps);
                tree.prune(oldest_to_keep(stamps, limit * 3 / 10), &cache);
                cache.relieved();
                assert!(cache.used_bytes() <= limit * 3 / 10, "{} of {limit} kept", cache.used_bytes());
            }
        }
        assert_eq!(tree.check_invariants(), cache.used_bytes(), "{limit}");
    }
}

#[test]
fn a_cache_of_any_size_from_zero_keeps_its_promise_and_changes_no_answer() {
    let grow = || RiTree::new(step(true), settings(0.01, 9));
    let all = points(10, 12);
    let (tree, cache) = (grow(), roomy());
    let expected: Vec<_> = all.iter().map(|&point| bits(tree.query(point, &cache))).collect();
    let whole = cache.used_bytes();
    // Every border of what fits and what does not is a multiple of 8 bytes.
    for limit in (0..=whole + 8).step_by(8) {
        let (mut tree, cache) = (grow(), Cache::new(limit));
        let mut descent = tree.descent();
        for (&point, expected) in all.iter().zip(&expected) {
            assert_eq!(bits(descent.query(point, &cache)), *expected, "{limit} bytes");
        }
        // Room for the larger outcome of a look at a cell is asked for first: some may be refused where all would just fit.
        let is_as_said = cache.used_bytes() <= limit && (cache.is_full() || limit >= whole);
        assert!(is_as_said, "{limit} of {whole} bytes");
        assert_eq!(tree.check_invariants(), cache.used_bytes(), "{limit}");
        tree.prune(u32::MAX, &cache);
        assert_eq!((tree.check_invariants(), cache.used_bytes()), (0, 0), "{limit}");
    }
}

#[test]
fn threads_share_a_tree_and_get_the_same_bits() {
    let all = points(7, 4_000);
    let (alone, cache) = (RiTree::new(step(true), settings(0.01, 14)), roomy());
    let expected: Vec<_> = all.iter().map(|&point| bits(alone.query(point, &cache))).collect();

    let (tree, cache) = (RiTree::new(step(true), settings(0.01, 14)), Cache::new(400_000));
    std::thread::scope(|scope| {
        for thread in 0..8 {
            let (tree, cache, all, expected) = (&tree, &cache, &all, &expected);
            scope.spawn(move || {
                for i in (0..all.len()).map(|i| (i * 7 + thread * 501) % all.len()) {
                    assert_eq!(bits(tree.query(all[i], cache)), expected[i]);
                }
            });
        }
    });
    assert_eq!(tree.check_invariants(), cache.used_bytes());
}

/// Lines along a straight way through line space, in steps far smaller than cells.
fn on_a_way() -> impl Iterator<Item = LinePoint> {
    let at = |i: u32| [0.1, 2.0 - f64::from(i) * 3e-3, -1.0 + f64::from(i) * 3e-3, 0.4];
    (0..=1_000).map(move |i| LinePoint { pair: PlanePair::ALL[2], stuv: at(i) })
}

#[test]
fn lines_near_each_other_get_their_own_answers_from_one_descent() {
    let grow = || RiTree::new(step(true), settings(0.01, 14));
    let (alone, plenty) = (grow(), roomy());
    for cache in [roomy(), Cache::new(10_000), Cache::new(0)] {
        let tree = grow();
        let mut descent = tree.descent();
        for line in on_a_way().chain(on_a_way().map(|line| LinePoint { pair: PlanePair::ALL[4], ..line })) {
            assert_eq!(bits(descent.query(line, &cache)), bits(alone.query(line, &plenty)), "{line:?}");
        }
        tree.check_invariants();
    }
}

#[test]
fn lines_near_each_other_share_the_way_down_that_is_not_kept() {
    let samples = |ask: &mut dyn FnMut(&mut Descent<Test>, LinePoint, &Cache)| {
        let (tree, cache) = (RiTree::new(step(true), settings(0.01, 20)), Cache::new(0));
        let mut descent = tree.descent();
        on_a_way().for_each(|line| ask(&mut descent, line, &cache));
        tree.build_counts().samples_taken
    };
    let alone = samples(&mut |descent, line, cache| assert!(descent.tree().query(line, cache).is_some()));
    let together = samples(&mut |descent, line, cache| assert!(descent.query(line, cache).is_some()));
    assert!(together < alone / 3 && together > 100, "{together} samples in place of {alone}");
}

#[test]
fn pruning_keeps_what_was_used_last() {
    let (mut tree, cache) = (RiTree::new(step(true), settings(0.01, 14)), roomy());
    let (old, new) = (points(8, 200), points(9, 20));
    ask_all(&tree, &cache, &old);
    tree.tick();
    ask_all(&tree, &cache, &new);
    let mut stamps = Vec::new();
    tree.collect_stamps(&mut stamps);
    let newest = stamps.iter().map(|s| s.0).max().expect("leaves");
    tree.prune(newest, &cache);
    let leaves = |tree: &RiTree<Test>| tree.shape().leaves_by_depth.iter().sum::<u64>();
    assert!(leaves(&tree) <= 20);
    let before = tree.build_counts().nodes_expanded;
    ask_all(&tree, &cache, &new);
    assert_eq!(tree.build_counts().nodes_expanded, before, "what was used last is still there");
    tree.check_invariants();
}
