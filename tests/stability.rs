//! Lengths where they are hard to find: what rounding explains, and nothing else.

mod common;

use std::process::Command;

use chordfield::exact::rational::of_planes;
use chordfield::exact::{Body, Engine};
use chordfield::geometry::primitives::icosphere;
use chordfield::geometry::{ClosedMesh, ConvexMesh, Segment};
use chordfield::modes::Control;
use chordfield::modes::stability::{Case, ENGINES, Effort, Found, HARD_BODIES, rays, sweep, table};
use common::nested_balls;
use glam::DVec3;

/// Made in seconds, and left out of what is to be quick; the table in the documentation has it.
const LARGE: &str = "ball of 327 680 faces";

fn bodies(are_all: bool) -> Vec<(&'static str, Body)> {
    let hard = HARD_BODIES.iter().filter(|hard| are_all || hard.name != LARGE);
    hard.map(|hard| (hard.name, hard.body().expect("closed"))).collect()
}

/// Sweeps through all bodies, with so many rays in all at least.
fn swept(bodies: &[(&str, Body)], effort: Effort, at_least: u64) -> Vec<Found> {
    let aimed = rays(bodies.iter().map(|(_, body)| body), effort);
    assert!(aimed >= at_least, "{aimed}");
    let found = bodies.iter().map(|(name, body)| sweep(name, body, effort, &Control::none()));
    found.collect::<Result<Vec<_>, _>>().expect("not interrupted").concat()
}

fn assert_explained(found: &[Found]) {
    for Found { body, case, engine, figures } in found {
        assert_eq!(figures.lost, 0, "{engine:?} lost rays of {body}, {}: {figures:?}", case.name());
        assert_eq!(figures.beyond, 0, "{engine:?} is wrong in {body}, {}: {figures:?}", case.name());
    }
}

#[test]
fn a_million_rays_aimed_at_what_is_hard_are_neither_lost_nor_wrong_by_any_engine() {
    let effort = Effort { rays: 9_000, recomputed: 60, seed: 3 };
    let found = swept(&bodies(false), effort, 1_000_000);
    assert_explained(&found);
    for case in Case::ALL {
        for engine in ENGINES {
            let of_both = found.iter().filter(|found| found.case == case && found.engine == engine);
            let recomputed: u64 = of_both.map(|found| found.figures.recomputed).sum();
            assert!(recomputed > 300, "{recomputed} by {engine:?}, {}", case.name());
        }
    }
    // A length that rounding does not leave open is known to some 10⁻⁹ of the body's size at worst, far sources aside.
    for Found { body, case, engine, figures } in &found {
        assert!(
            *case == Case::SourceFar || figures.max_relative_error < 1e-2,
            "{engine:?}, {body}, {case:?}: {figures:?}"
        );
    }
}

#[test]
#[ignore = "a hundred million rays, ten minutes of a core"]
fn a_hundred_million_rays_aimed_at_what_is_hard_are_neither_lost_nor_wrong() {
    let bodies = bodies(true);
    let effort = Effort::aiming(100_000_000, bodies.iter().map(|(_, body)| body), 4);
    assert_explained(&swept(&bodies, effort, 100_000_000));
}

#[test]
fn so_many_rays_are_aimed_as_are_asked_for() {
    let bodies = bodies(false);
    let of_bodies = || bodies.iter().map(|(_, body)| body);
    for asked in [1, 10_000, 1_000_000, 100_000_000] {
        let effort = Effort::aiming(asked, of_bodies(), 1);
        let aimed = rays(of_bodies(), effort);
        // Eight rays at least of each case and body; and each step is a ray of each.
        assert!(aimed >= asked && aimed <= asked + 100 * 15 * 13, "{asked}: {aimed}");
        assert!(effort.rays == 1 || rays(of_bodies(), Effort { rays: effort.rays - 1, ..effort }) < asked);
    }
}

#[test]
fn bodies_nested_a_micrometre_apart_differ_by_what_lies_between_them() {
    let ball = |radius_mm: f64| {
        let mesh = icosphere(2).map_vertices(|v| radius_mm * v);
        ConvexMesh::new(ClosedMesh::new(mesh).expect("closed").0)
            .map_err(|refused| refused.1)
            .expect("convex")
    };
    let (outer, inner) = (ball(50.0), ball(49.999));
    let bodies = [&outer, &inner].map(|ball| Body::new(ball.surface().clone()));
    let mut parts = Vec::new();
    let (mut grazing, mut compared) = (0, 0);
    for vertex in inner.surface().mesh().vertices.iter().chain(&outer.surface().mesh().vertices) {
        for towards in
            [DVec3::new(3.0, 1.0, -2.0), DVec3::new(-1.0, 1.0, 1.0), vertex.any_orthogonal_vector()]
        {
            let away = 200.0 * towards.normalize();
            let ray = Segment::between(*vertex - away, *vertex + away).expect("a ray");
            for engine in [Engine::Clip, Engine::Walk, Engine::Bvh] {
                let [length_outside, length_inside] = [0, 1].map(|i| {
                    bodies[i].chords_by(engine, ray.line(), &mut parts);
                    parts.iter().map(|part| part.length()).sum::<f64>()
                });
                let exact = [&outer, &inner].map(|ball| of_planes(ball, ray.line()).length_mm());
                assert!(
                    length_inside <= length_outside + 1e-12,
                    "{engine:?}: {length_inside} in {length_outside}"
                );
                // Below a tenth of a millimetre a chord is so near the outline that rounding shows.
                if exact.iter().all(|&length| length > 0.1) {
                    let error = (length_outside - length_inside) - (exact[0] - exact[1]);
                    assert!(error.abs() < 1e-10, "{engine:?}: the shell is {error:e} mm off");
                    compared += 1;
                } else {
                    grazing += 1;
                }
            }
        }
    }
    assert!(compared > 1_000 && grazing > 100, "{compared} {grazing}");
}

#[test]
fn sweeps_are_the_same_for_one_two_and_eight_threads() {
    let body = HARD_BODIES[2].body().expect("closed");
    let effort = Effort { rays: 3_000, recomputed: 20, seed: 5 };
    let by = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| sweep("ball", &body, effort, &Control::none()).expect("not interrupted"))
    };
    let one = by(1);
    assert!(one == by(2) && one == by(8));
}

#[test]
fn the_documented_table_has_every_case_and_body_and_none_lost() {
    let documented = include_str!("../src/modes/stability/table.md");
    let rows: Vec<Vec<&str>> = documented
        .lines()
        .filter(|line| line.starts_with("| ") && line.contains('`'))
        .map(|line| line.split('|').map(str::trim).collect())
        .collect();
    let cases = Case::ALL.map(Case::name);
    for name in cases.into_iter().chain(HARD_BODIES.map(|hard| hard.name)) {
        assert!(rows.iter().any(|row| row[1] == name), "{name} is missing: make the table again");
    }
    assert!(rows.iter().all(|row| row[4] == "0"), "rays are lost");
    let totals = documented.lines().last().expect("the totals");
    assert!(totals.contains(" by `raster`") && totals.contains("Lost: 0. Disagree: 0."), "{totals}");
    // The same head as sweeps print today.
    assert!(table(&[]).lines().all(|line| documented.contains(line)));
}

#[test]
fn a_users_own_scene_is_stressed_by_a_command() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("balls.toml"), nested_balls(16)).expect("a scene");
    let audit = |more: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_chordfield"))
            .current_dir(folder.path())
            .args(["audit", "balls.toml", "--stress"])
            .args(more)
            .output()
            .expect("the program starts")
    };
    let run = audit(&["40", "--json", "--seed", "9"]);
    assert_eq!(run.status.code(), Some(0), "{}", String::from_utf8_lossy(&run.stderr));
    let found: serde_json::Value = serde_json::from_slice(&run.stdout).expect("only JSON");
    assert_eq!(found.as_array().map(Vec::len), Some(2 * Case::ALL.len() * ENGINES.len()));
    assert_eq!((&found[0]["body"], &found[0]["case"]), (&"outer".into(), &"vertices".into()));
    assert!(found[0]["rays"].as_u64().is_some_and(|rays| (30..=40).contains(&rays)));
    let table = audit(&["40"]);
    assert!(String::from_utf8_lossy(&table.stdout).contains("| through vertices | `clip` |"));
    assert_eq!(audit(&["40", "--rays", "5"]).status.code(), Some(2), "one thing at a time");
}
