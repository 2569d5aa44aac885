use glam::DMat3;
use rand::{RngExt, SeedableRng};

use super::*;
use crate::exact::judge::length_in_parallel_body;
use crate::exact::{Lengths, Pierced, Record, Way};
use crate::geometry::primitives::{cube, icosphere, prism};
use crate::geometry::{ClosedMesh, RayGrid, Region, Segment, TriMesh, UnitDir, Upstream, convex_hull};

fn convex(mesh: TriMesh) -> ConvexMesh {
    ConvexMesh::new(ClosedMesh::new(mesh).expect("closed").0).map_err(|refused| refused.1).expect("convex")
}

fn turn() -> DMat3 {
    DMat3::from_rotation_x(0.3) * DMat3::from_rotation_z(0.7)
}

fn ellipsoid(subdivisions: u32) -> ConvexMesh {
    convex(icosphere(subdivisions).map_vertices(|v| turn() * (v * DVec3::new(100.0, 80.0, 60.0))))
}

/// Bodies of all shapes: round, flat-faced, plates and needles, turned and along the axes, far from the origin.
fn bodies() -> Vec<(&'static str, ConvexMesh)> {
    let corner = TriMesh {
        vertices: [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].map(|v| 50.0 * v).to_vec(),
        faces: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
    };
    // Turning leaves the fans of a prism's ends not quite plane; a hull is convex all the same.
    let hull = |mesh: TriMesh| convex_hull(&mesh.vertices).expect("a hull");
    let shaped = |mesh: TriMesh, by: DVec3| mesh.map_vertices(|v| turn() * (v * by));
    vec![
        ("ellipsoid", ellipsoid(3)),
        ("ball along the axes", convex(icosphere(2).map_vertices(|v| 70.0 * v))),
        ("cube along the axes", convex(cube(100.0))),
        ("tetrahedron at a corner", convex(corner)),
        ("cylinder along z", convex(prism(60).map_vertices(|v| v * DVec3::new(50.0, 50.0, 90.0)))),
        ("turned cylinder", convex(hull(shaped(prism(300), DVec3::new(50.0, 30.0, 90.0))))),
        ("plate", convex(shaped(cube(1.0), DVec3::new(100.0, 100.0, 0.01)))),
        ("needle", convex(shaped(icosphere(2), DVec3::new(100.0, 0.01, 0.02)))),
        ("far ball", convex(icosphere(3).map_vertices(|v| 60.0 * v + DVec3::new(3e5, -1e6, 7e4)))),
    ]
}

/// A point about the body, and a target that is a vertex, on an edge, within a face, or anywhere in the box.
fn aimed(body: &ConvexMesh, rng: &mut rand_pcg::Pcg64, i: usize) -> Option<Segment> {
    let (mesh, bounds) = (body.surface().mesh(), body.bounds());
    let [a, b, c] = mesh.triangle(rng.random_range(0..mesh.faces.len()));
    let (u, v): (f64, f64) = (rng.random(), rng.random());
    let mut anywhere = || bounds.min + bounds.size() * DVec3::from([0; 3].map(|_| rng.random::<f64>()));
    let target = [a, a + u * (b - a), a + 0.5 * u * (b - a) + 0.5 * v * (c - a), anywhere()][i % 4];
    let out = UnitDir::new(DVec3::from([0; 3].map(|_| rng.random_range(-1.0..1.0))))?;
    // Now and then within the plane of a face, or along an axis.
    let out = match i % 16 {
        13 => UnitDir::new(b - target)?.get(),
        14 => DVec3::AXES[i / 16 % 3],
        15 => UnitDir::new(0.3 * (b - a) + 0.7 * (c - b))?.get(),
        _ => out.get(),
    };
    let reach = 5.0 * bounds.diagonal();
    Segment::between(target + reach * out, target - reach * out)
}

/// How far the engine's surface may be from the body's, mm: see the docs of `pass_from` and of `OUTLINE_FACTOR`. The
/// hundredfold at vertices is not needed here.
fn shift_mm(body: &ConvexMesh, ray: &Segment) -> f64 {
    let far = (ray.line().origin() - body.bounds().centre()).length() + body.bounds().diagonal();
    8.0 * gamma(8) * far + gamma(8) * body.bounds().max.abs().max_element() + 2.0 * body.reflex_depth_mm()
}

fn assert_bracketed(body: &ConvexMesh, ray: &Segment, length: f64, name: &str) {
    let shift = shift_mm(body, ray);
    let [least, most] = [-shift, shift].map(|s| length_in_parallel_body(body, ray, s));
    let rounding = gamma(8) * ray.length_mm();
    assert!(
        (least - rounding..=most + rounding).contains(&length),
        "{name}: {least} ≤ {length} ≤ {most}, {ray:?}"
    );
}

fn length_by(answer: Result<Option<Pass>, Unsure>, ray: &Segment) -> Option<f64> {
    let chord = answer.ok()?.and_then(|pass| pass.chord.intersection(&ray.reach()));
    Some(chord.map_or(0.0, |chord| chord.length()))
}

fn walk_aimed_rays(body: &ConvexMesh, name: &str, rays: usize, seed: u64) -> (usize, usize) {
    let walker = Walker::new(body);
    let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
    let (mut hits, mut unsure) = (0, 0);
    for i in 0..rays {
        let Some(ray) = aimed(body, &mut rng, i) else { continue };
        match length_by(walker.pass(ray.line()), &ray) {
            Some(length) => {
                assert_bracketed(body, &ray, length, name);
                hits += usize::from(length > 0.0);
            }
            None => unsure += 1,
        }
    }
    (hits, unsure)
}

#[test]
fn walks_agree_with_clipping_also_when_aimed_at_vertices_edges_and_along_faces() {
    for (seed, (name, body)) in bodies().iter().enumerate() {
        let rays = 40_000_000 / (body.planes().len() + 2_000);
        let (hits, unsure) = walk_aimed_rays(body, name, rays, seed as u64);
        assert!(hits > rays / 3, "{name}: {hits} hits of {rays}");
        // Three quarters are aimed, and of a box most vertices and half of the edges are on the outline.
        assert!(unsure < rays / 2, "{name}: {unsure} unsure of {rays}");
    }
}

#[test]
#[ignore = "ten million rays, a minute"]
fn ten_million_aimed_rays_lose_none() {
    let (_, unsure) = walk_aimed_rays(&ellipsoid(3), "ellipsoid", 10_000_000, 99);
    assert!(unsure < 1_000_000, "{unsure} unsure");
}

#[test]
fn where_a_walk_begins_does_not_matter_to_the_last_bit() {
    for subdivisions in [1, 3] {
        walks_from_anywhere_agree(&ellipsoid(subdivisions));
    }
}

fn walks_from_anywhere_agree(body: &ConvexMesh) {
    let walker = Walker::new(body);
    let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
    for i in 0..5_000 {
        let Some(ray) = aimed(body, &mut rng, i) else { continue };
        let line = ray.line();
        let Ok(expected) = walker.pass(line) else { continue };
        let faces = body.surface().mesh().faces.len() as u32;
        for _ in 0..4 {
            let mut seeds = Seeds { entry: rng.random_range(0..faces), exit: rng.random_range(0..faces) };
            // From afar the walk may end in doubt, but never with another answer.
            if let Ok(answer) = walker.pass_from(line.origin(), line.dir(), &mut seeds) {
                assert_eq!(answer, expected, "{ray:?}");
            }
        }
    }
}

#[test]
fn doubt_is_rare_for_rays_that_are_not_aimed() {
    for (name, body) in bodies() {
        let walker = Walker::new(&body);
        let mut rng = rand_pcg::Pcg64::seed_from_u64(6);
        let mut unsure = 0;
        for _ in 0..20_000 {
            let Some(ray) = aimed(&body, &mut rng, 3) else { continue };
            unsure += usize::from(walker.pass(ray.line()).is_err());
        }
        assert!(unsure <= 20, "{name}: {unsure} of 20 000");
    }
}

fn image() -> RayGrid {
    let steps = [DVec3::new(3.1, 0.4, 0.0), DVec3::new(0.0, 0.2, 2.3)];
    let origin = DVec3::new(-10.0, 400.0, 5.0) - 40.0 * (steps[0] + steps[1]);
    RayGrid::new(Upstream::Source(DVec3::new(20.0, -500.0, 10.0)), origin, steps, [90, 80]).expect("a grid")
}

#[test]
fn the_rays_of_an_image_are_the_same_bits_in_any_region() {
    // Of few faces, and of so many that rows are walked abreast.
    for subdivisions in [3, 6] {
        image_is_the_same_bits_in_any_region(&ellipsoid(subdivisions));
    }
}

fn image_is_the_same_bits_in_any_region(body: &ConvexMesh) {
    let (walker, grid) = (Walker::new(body), image());
    let trace = |region: &Region| {
        let mut lengths = vec![0.0; region.pixels()];
        let doubt = |ray: usize, _: &Segment, record: &mut Lengths| record.crossing(ray, 0.125, 0, Way::Out);
        walker.trace_grid(&grid, region, &mut Lengths(&mut lengths), doubt);
        lengths
    };
    let whole = trace(&grid.whole());
    assert!(whole.iter().filter(|l| **l > 0.0).count() > 2_000);
    for (columns, rows) in [(7..50, 3..80), (40..41, 0..80), (0..90, 33..34), (60..61, 20..21)] {
        let region = Region { columns, rows };
        let expected: Vec<f64> = region.places().map(|(c, r)| whole[(r * 90 + c) as usize]).collect();
        assert_eq!(trace(&region), expected);
    }
}

#[test]
fn faces_held_for_many_rays_give_the_bits_of_walks() {
    for (name, body) in bodies() {
        let walker = Walker::new(&body);
        let bounds = body.bounds();
        let (centre, size) = (bounds.centre(), bounds.diagonal());
        let steps = [DVec3::new(0.011, 0.0013, 0.0), DVec3::new(0.0, 0.0007, 0.0083)].map(|step| size * step);
        let origin = centre + size * DVec3::new(0.2, 3.0, 0.1) - 60.0 * (steps[0] + steps[1]);
        let trace = |grid: &RayGrid, region: &Region| {
            let mut lengths = vec![0.0; region.pixels()];
            let doubt = |ray: usize, _: &Segment, r: &mut Lengths| r.crossing(ray, 0.125, 0, Way::Out);
            walker.trace_grid(grid, region, &mut Lengths(&mut lengths), doubt);
            lengths
        };
        // Far off, and within the body or about there.
        for (away, is_far) in [(DVec3::new(0.3, 4.0, 0.2), true), (DVec3::new(0.001, 0.002, 0.0), false)] {
            let source = Upstream::Source(centre - size * away);
            let grid = RayGrid::new(source, origin, steps, [120; 2]).expect("a grid");
            // On their own, rays find no face held.
            let alone =
                |(column, row)| trace(&grid, &Region { columns: column..column + 1, rows: row..row + 1 })[0];
            let expected: Vec<f64> = grid.whole().places().map(alone).collect();
            assert!(!is_far || expected.iter().any(|&length| length > 0.0), "{name}");
            assert_eq!(trace(&grid, &grid.whole()), expected, "{name}");
        }
    }
}

#[test]
fn images_and_batches_agree_and_name_the_faces_gone_through() {
    for subdivisions in [2, 6] {
        image_and_batch_agree(&ellipsoid(subdivisions));
    }
}

fn image_and_batch_agree(body: &ConvexMesh) {
    let (walker, grid) = (Walker::new(body), image());
    let rays: Vec<Segment> = grid.whole().places().map(|(c, r)| grid.segment(c, r)).collect();
    let (mut by_grid, mut by_batch) = (Pierced::default(), Pierced::default());
    let mut doubts = 0;
    walker.trace_grid(&grid, &grid.whole(), &mut by_grid, |_, _, _| doubts += 1);
    walker.trace_batch(0, &rays, &mut by_batch, |_, _, _| doubts += 1);
    assert!(doubts < 8, "{doubts}");
    by_grid.0.sort_by_key(|pierce| pierce.ray);
    assert!(by_grid.0.len() > 4_000);
    assert_eq!(by_grid.0.len(), by_batch.0.len());
    for (one, other) in by_grid.0.iter().zip(&by_batch.0) {
        assert_eq!((one.ray, one.face, one.way), (other.ray, other.face, other.way));
        assert!((one.t_mm - other.t_mm).abs() < 1e-9, "{one:?} {other:?}");
        let [a, b, c] = body.surface().mesh().triangle(one.face as usize);
        let normal = (b - a).cross(c - a).normalize();
        let place = rays[one.ray as usize].line().at(one.t_mm);
        assert!(normal.dot(place - a).abs() < 1e-9);
        assert_eq!(one.way == Way::In, normal.dot(rays[one.ray as usize].line().dir()) < 0.0);
    }
}

#[test]
fn a_source_and_a_target_within_the_body_cut_the_chord() {
    let walker = Walker::new(&convex(cube(2.0)));
    let mut lengths = [0.0; 3];
    let rays = [(0.5, 9.0), (-9.0, 0.25), (0.5, 0.75)].map(|(from, to)| {
        Segment::between(DVec3::new(from, 0.1, 0.2), DVec3::new(to, 0.1, 0.2)).expect("a path")
    });
    walker.trace_batch(0, &rays, &mut Lengths(&mut lengths), |ray, _, _| panic!("ray {ray} in doubt"));
    assert_eq!(lengths, [0.5, 1.25, 0.25]);
}
