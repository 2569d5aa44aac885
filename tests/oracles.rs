//! Phantoms before the oracles: nothing that a length must satisfy is broken, whatever finds it.

use chordfield::exact::Engine;
use chordfield::modes::Control;
use chordfield::modes::oracles::{Oracles, Outcome, Size, table};
use chordfield::modes::project::{Method, TreeSettings};
use chordfield::scene::Scene;

const SEED: u64 = 7;

fn assert_satisfied(phantom: &str, method: Method, size: Size) {
    let scene = Scene::phantom(phantom).expect("the phantom");
    let verdicts = Oracles::run(&scene, method, SEED, size, &Control::none()).expect("verdicts");
    assert!(verdicts.len() > 10 * scene.organs.len());
    assert!(
        verdicts.iter().all(|v| v.outcome != Outcome::Failed),
        "{phantom}, {method:?}:\n{}",
        table(&verdicts)
    );
}

#[test]
fn the_adult_and_its_skeleton_satisfy_every_oracle() {
    let few = Size { pixels: 24, lines: 1_000, directions: 1 };
    for phantom in ["adult", "adult-skeleton"] {
        assert_satisfied(phantom, Method::Exact(None), few);
    }
}

#[test]
#[ignore = "a million rays for each organ and method, minutes"]
fn all_phantoms_satisfy_every_oracle_by_every_method() {
    let engines = [Engine::Clip, Engine::Walk, Engine::Raster, Engine::Bvh].map(|e| Method::Exact(Some(e)));
    for phantom in ["adult", "adult-skeleton", "head", "calibration"] {
        for method in engines.into_iter().chain([Method::RiTree(TreeSettings::default())]) {
            assert_satisfied(phantom, method, Size::of(method));
        }
    }
}
