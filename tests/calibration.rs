//! The calibration phantom against its closed forms.

mod common;

use chordfield::exact::Body;
use chordfield::geometry::{Interval, Line, UnitDir};
use chordfield::scene::Scene;
use chordfield::scene::organ::{Organ, Origin};
use chordfield::scene::shape::Shape;
use glam::DVec3;
use rand::{RngExt, SeedableRng};

fn shape(organ: &Organ) -> &Shape {
    match &organ.origin {
        Origin::Shapes(shapes) if shapes.len() == 1 => &shapes[0],
        other => panic!("{} is not one shape but {other:?}", organ.name),
    }
}

fn length(body: &Body, line: &Line) -> f64 {
    let mut parts = Vec::new();
    body.chords(line, &mut parts);
    parts.iter().map(Interval::length).sum()
}

/// Lines through two random points of the organ's box, grown a little so that some miss.
fn lines_near(organ: &Organ, seed: u64, count: usize) -> impl Iterator<Item = Line> {
    let bounds = organ.body.bounds().grown(2.0);
    let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
    let mut point = move || bounds.min + bounds.size() * DVec3::from([0; 3].map(|_| rng.random::<f64>()));
    (0..count).filter_map(move |_| {
        let (a, b) = (point(), point());
        Line::new(a, UnitDir::new(b - a)?)
    })
}

#[test]
fn chords_of_flat_bodies_are_those_of_their_closed_forms() {
    let scene = Scene::phantom("calibration").expect("the phantom");
    let flat: Vec<&Organ> =
        scene.organs.iter().filter(|o| shape(o).tessellation_depth_mm() == Ok(0.0)).collect();
    assert!(flat.len() >= 2, "a box and a tetrahedron at least");
    for organ in flat {
        let size = organ.body.bounds().diagonal();
        let mut worst: f64 = 0.0;
        for line in lines_near(organ, 1, 20_000) {
            let exact = shape(organ).chord(&line).map_or(0.0, |c| c.length());
            worst = worst.max((length(&organ.body, &line) - exact).abs());
        }
        assert!(worst < 1e-9 * size, "{}: off by {worst} mm, size {size} mm", organ.name);
    }
}

/// A mesh inscribed to a depth δ has chords between those of the body and of the body shrunk by δ. So the chord is
/// never longer (up to 1e-9 of the size), and its ends move by at most δ / cos of the angle at which the line meets
/// the surface; here lines that graze are left out by asking for |n·d| ≥ 1/4 at both ends.
#[test]
fn chords_of_curved_bodies_are_within_the_tessellation_error_of_their_closed_forms() {
    let scene = Scene::phantom("calibration").expect("the phantom");
    let curved: Vec<&Organ> =
        scene.organs.iter().filter(|o| shape(o).tessellation_depth_mm() != Ok(0.0)).collect();
    assert!(curved.len() >= 2, "a sphere and a cylinder at least");
    for organ in curved {
        let size = organ.body.bounds().diagonal();
        let depth = shape(organ).tessellation_depth_mm().expect("a depth");
        assert!(depth < 0.002 * size, "{}: the mesh lies {depth} mm deep", organ.name);
        let mut compared = 0;
        for line in lines_near(organ, 2, 20_000) {
            let Some(exact) = shape(organ).chord(&line) else {
                assert_eq!(
                    length(&organ.body, &line),
                    0.0,
                    "{}: an inscribed mesh is hit only with its body",
                    organ.name
                );
                continue;
            };
            let shorter = exact.length() - length(&organ.body, &line);
            assert!(shorter > -1e-9 * size, "{}: {} mm too long", organ.name, -shorter);
            if meets_steeply(shape(organ), &line, exact, depth) {
                compared += 1;
                assert!(shorter <= 2.0 * 4.0 * depth + 1e-9 * size, "{}: {shorter} mm too short", organ.name);
            }
        }
        assert!(compared > 2_000, "{}: only {compared} lines were steep", organ.name);
    }
}

/// Whether at both ends of the chord a step of 4δ along the line leaves the surface by δ: the point that far in has
/// a ball of radius δ around it within the body.
fn meets_steeply(shape: &Shape, line: &Line, chord: Interval, depth: f64) -> bool {
    let step = 4.0 * depth;
    let has_ball = |t: f64| {
        (0..26).map(|i| i + i / 13).all(|i| {
            let corner = DVec3::new(f64::from(i % 3 - 1), f64::from(i / 3 % 3 - 1), f64::from(i / 9 - 1));
            shape.contains(line.at(t) + depth * corner.normalize_or_zero())
        })
    };
    chord.length() > 2.0 * step && has_ball(chord.start() + step) && has_ball(chord.end() - step)
}

#[test]
fn volumes_of_flat_bodies_are_exact_and_of_curved_ones_nearly() {
    let scene = Scene::phantom("calibration").expect("the phantom");
    for organ in &scene.organs {
        let (mesh, exact) = (organ.body.surface().volume_mm3(), shape(organ).volume_mm3());
        let depth = shape(organ).tessellation_depth_mm().expect("a depth");
        // A shell of the tessellation's depth all over the surface is the most that can be missing.
        let shell = depth * organ.body.surface().mesh().area();
        assert!(
            mesh <= exact * (1.0 + 1e-9) && mesh >= exact * (1.0 - 1e-9) - shell,
            "{}: {mesh}, {exact}",
            organ.name
        );
    }
}
