use glam::DVec3;

use super::*;
use crate::exact::Engine;
use crate::geometry::primitives::{cube, icosphere, prism};
use crate::geometry::{ClosedMesh, Interval, TriMesh};
use crate::modes::project::{Interpolation, TreeSettings};
use crate::ritree::Parameters;

/// Enough to tell a fault of a part in a thousand.
const SMALL: Size = Size { pixels: 32, lines: 4_000, directions: 2 };
const SEED: u64 = 20;

fn body(mesh: TriMesh) -> Body {
    Body::new(ClosedMesh::new(mesh).expect("closed").0)
}

fn ellipsoid() -> Body {
    body(icosphere(2).map_vertices(|v| v * DVec3::new(90.0, 60.0, 40.0) + DVec3::new(20.0, -300.0, 900.0)))
}

/// A cylinder with fans of triangles at its ends, a plate along the axes, and two bodies in one, askew.
fn bodies() -> Vec<(&'static str, Body)> {
    let mut pair = icosphere(1).map_vertices(|v| 30.0 * v + DVec3::new(100.0, 20.0, 1.0 / 3.0));
    pair.append(&cube(40.0).map_vertices(|v| glam::DMat3::from_rotation_x(0.5) * v));
    vec![
        ("ellipsoid", ellipsoid()),
        ("cylinder", body(prism(40).map_vertices(|v| v * DVec3::new(50.0, 30.0, 90.0) + 7.7))),
        ("plate", body(cube(1.0).map_vertices(|v| v * DVec3::new(200.0, 100.0, 0.1)))),
        ("pair", body(pair)),
    ]
}

fn failed(verdicts: &[Verdict]) -> Vec<&'static str> {
    verdicts.iter().filter(|v| v.outcome == Outcome::Failed).map(Verdict::oracle).collect()
}

#[test]
fn every_exact_engine_satisfies_every_oracle() {
    let engines = [Engine::Clip, Engine::Walk, Engine::Raster, Engine::Bvh];
    for method in [None].into_iter().chain(engines.map(Some)).map(Method::Exact) {
        let witness = MethodWitness::new(method);
        for (name, body) in bodies() {
            let verdicts = Oracles::new(&witness, SEED, SMALL).question(name, &body);
            assert_eq!(failed(&verdicts), [""; 0], "{method:?}\n{}", table(&verdicts));
            let apply = verdicts.iter().filter(|v| v.outcome == Outcome::Passed).count();
            assert!(apply >= 7, "{name}: {apply}");
        }
    }
}

#[test]
fn trees_keep_their_promise_in_the_mean_and_scale_to_the_last_bit() {
    let papers = Interpolation::Quadrilinear { parameters: Parameters::default() };
    for interpolation in [Interpolation::default(), papers] {
        let settings = TreeSettings { interpolation, ..TreeSettings::default() };
        let witness = MethodWitness::new(Method::RiTree(settings));
        let verdicts = Oracles::new(&witness, SEED, SMALL).question("ellipsoid", &ellipsoid());
        assert_eq!(failed(&verdicts), [""; 0], "{}", table(&verdicts));
    }
}

#[test]
fn a_scene_of_nested_organs_satisfies_every_oracle() {
    let scene = Scene::phantom("calibration").expect("a phantom");
    let verdicts =
        Oracles::run(&scene, Method::Exact(None), SEED, SMALL, &Control::none()).expect("verdicts");
    assert_eq!(failed(&verdicts), [""; 0], "{}", table(&verdicts));
    assert_eq!(verdicts.last().map(Verdict::oracle), Some("own lengths"));
    let record = serde_json::to_value(&verdicts).expect("a record");
    assert_eq!((&record[0]["oracle"], &record[0]["outcome"]), (&"reversal".into(), &"passed".into()));
}

/// A witness that is wrong on purpose.
struct Liar<F> {
    honest: MethodWitness,
    lie: F,
}

/// Changes the lengths of rays, given their number, ends and lengths.
impl<F: Fn(usize, [DVec3; 2], f64) -> f64 + Sync> Witness for Liar<F> {
    fn lengths(&self, body: &Body, rays: &Rays) -> Vec<f64> {
        let honest = self.honest.lengths(body, rays).into_iter().zip(rays.ends());
        honest.enumerate().map(|(i, (length, ends))| (self.lie)(i, ends, length)).collect()
    }

    fn parts(&self, body: &Body, rays: &Rays) -> Vec<(usize, Interval)> {
        let ends = rays.ends();
        let parts = self.honest.parts(body, rays).into_iter();
        let told = parts.filter_map(|(i, part)| {
            let length = (self.lie)(i, ends[i], part.length());
            Some((i, Interval::new(part.start(), part.start() + length)?))
        });
        told.collect()
    }
}

fn caught(lie: impl Fn(usize, [DVec3; 2], f64) -> f64 + Sync) -> Vec<&'static str> {
    let witness = Liar { honest: MethodWitness::new(Method::Exact(None)), lie };
    failed(
        &Oracles::new(&witness, SEED, Size { pixels: 48, lines: 20_000, ..SMALL })
            .question("ellipsoid", &ellipsoid()),
    )
}

#[test]
fn lengths_a_thousandth_too_long_are_caught_by_volumes_alone() {
    // All lengths scaled alike satisfy every identity; means over few lines are too coarse.
    assert_eq!(caught(|_, _, length| 1.001 * length), ["parallel volume", "cone-beam volume"]);
}

#[test]
fn a_thousandth_of_noise_is_caught_by_identities() {
    let noisy = |i: usize, ends: [DVec3; 2], length: f64| {
        let noise = (1e4 * (ends[0].x + ends[1].y) + i as f64).sin();
        length * (1.0 + 1e-3 * noise)
    };
    let caught = caught(noisy);
    for oracle in ["reversal", "rotation", "translation", "affine map", "scaling by powers of 2"] {
        assert!(caught.contains(&oracle), "{oracle} is not among {caught:?}");
    }
}

#[test]
fn one_ray_lost_in_a_thousand_is_caught_where_it_is_another_ray_when_asked_again() {
    let lossy = |_: usize, ends: [DVec3; 2], length: f64| {
        let lottery =
            ends[0].x.to_bits() ^ ends[0].y.to_bits().rotate_left(21) ^ ends[1].z.to_bits().rotate_left(42);
        if lottery.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 54 == 0 { 0.0 } else { length }
    };
    let caught = caught(lossy);
    for oracle in ["reversal", "rotation", "translation", "affine map"] {
        assert!(caught.contains(&oracle), "{oracle} is not among {caught:?}");
    }
}

#[test]
fn pixels_always_lost_are_caught_by_volumes() {
    let holes = caught(|i, _, length| if i % 500 == 250 { 0.0 } else { length });
    assert_eq!(holes, ["parallel volume", "cone-beam volume"]);
}

/// A witness that asks about the body with two axes swapped.
struct Swapped(MethodWitness);

impl Witness for Swapped {
    fn lengths(&self, body: &Body, rays: &Rays) -> Vec<f64> {
        let mut lengths = vec![0.0; rays.count()];
        self.parts(body, rays).into_iter().for_each(|(ray, part)| lengths[ray] += part.length());
        lengths
    }

    fn parts(&self, body: &Body, rays: &Rays) -> Vec<(usize, Interval)> {
        let middle = body.bounds().centre();
        let swap = |v: DVec3| middle + DVec3::new(v.y - middle.y, v.x - middle.x, v.z - middle.z);
        self.0.parts(body, &Rays::List(rays.ends().into_iter().map(|ends| ends.map(swap)).collect()))
    }
}

#[test]
fn swapped_axes_are_caught_where_the_map_takes_no_part_in_the_swap() {
    let witness = Swapped(MethodWitness::new(Method::Exact(None)));
    let caught = failed(&Oracles::new(&witness, SEED, SMALL).question("ellipsoid", &ellipsoid()));
    for oracle in ["rotation", "affine map"] {
        assert!(caught.contains(&oracle), "{oracle} is not among {caught:?}");
    }
}
