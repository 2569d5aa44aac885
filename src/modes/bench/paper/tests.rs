use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use super::*;

fn settings(inputs: &[Input]) -> PaperSettings {
    PaperSettings {
        inputs: inputs.to_vec(),
        patience: Patience { rounds: 2, seconds: 5.0 },
        quick: true,
        scale: 0.01,
    }
}

#[test]
fn a_sweep_has_errors_memory_and_times_at_each_value_and_no_operations_where_they_are_not_counted() {
    let report = paper(&settings(&[Input::Adult]), &Control::none()).expect("a report");
    assert!(report.complete && report.sweeps.len() == 1);
    for sweep in &report.sweeps {
        assert!(sweep.exact.time.is_some_and(|t| t.seconds > 0.0 && t.rounds == 2), "{sweep:?}");
        assert_eq!((sweep.size, sweep.rows.len()), ([6, 6], 2));
        for row in &sweep.rows {
            assert!(row.error >= 0.0 && row.nodes > 0.0 && row.samples > row.nodes, "{row:?}");
            assert!(row.cpu_speed_up.is_some_and(|s| s.median > 0.0) && row.memory_mb > 0.0);
            assert_eq!((row.flop_speed_up, row.published), (None, None));
        }
    }
    assert!(report.sweeps[0].verdict.as_ref().is_some_and(|v| v.claims.len() == 2));
    assert_eq!(report.sweeps[0].beside_the_paper, None);
}

#[test]
fn an_interruption_leaves_the_rows_that_were_counted() {
    let (cancel, turns) = (AtomicBool::new(false), AtomicU64::new(0));
    let progress = |n| {
        // The exact run and the first two of trees.
        if turns.fetch_add(n, Ordering::Relaxed) + n == 3 {
            cancel.store(true, Ordering::Relaxed);
        }
    };
    let report =
        paper(&settings(&[Input::BezierSurface]), &Control::new(&cancel, &progress)).expect("what there is");
    assert!(!report.complete);
    assert_eq!(report.sweeps.iter().map(|s| s.rows.len()).collect::<Vec<_>>(), [2]);
    assert!(report.sweeps[0].rows.iter().all(|row| row.time.is_none() && row.flop_speed_up.is_some()));
    assert!(report.sweeps[0].rows.iter().all(|row| row.published.is_some()));
    assert_eq!(report.sweeps[0].exact.time, None);
}

#[test]
fn the_papers_own_figures_go_the_way_that_is_looked_for() {
    for plan in PLANS.iter().filter(|plan| plan.input != Input::Adult && plan.dial != Dial::CacheSize) {
        let mut sweep = Sweep::of(plan, [1, 1]);
        for setting in plan.settings(false) {
            let Some(paper) = Published::find(plan.input, &setting.1.parameters) else { continue };
            let found = row(plan, setting, &Outcome::default(), &Outcome::default());
            sweep.rows.push(Row {
                flop_speed_up: Some(paper.flop_speed_up),
                error: paper.error,
                memory_mb: paper.memory_mb.unwrap_or(f64::NAN),
                ..found
            });
        }
        sweep.judge();
        let beside = sweep.beside_the_paper.as_ref().expect("figures");
        assert!(beside.contains(&format!("FLOP speed-up in {0} of {0}", sweep.rows.len())), "{beside}");
        let verdict = sweep.verdict.expect("figures");
        assert!(verdict.reproduced, "{:?} {:?}: {}", plan.input, plan.dial, verdict.sentence);
    }
}

#[test]
fn settings_that_do_not_serve_are_refused() {
    let good = settings(&[Input::Tomatoes]);
    assert!(good.check().is_ok());
    for scale in [0.0, -1.0, f64::NAN, 5.0] {
        assert!(PaperSettings { scale, ..good.clone() }.check().is_err());
    }
    let hasty = Patience { rounds: 1, seconds: 1.0 };
    assert!(PaperSettings { patience: hasty, ..good }.check().is_err());
}
