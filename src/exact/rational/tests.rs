use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::planes::{clip, deciding};
use super::*;
use crate::exact::judge::length_in_parallel_body;
use crate::exact::{Body, Engine};
use crate::geometry::numeric::gamma;
use crate::geometry::primitives::{block, cube, icosphere, inside_out};
use crate::geometry::{ClosedMesh, ConvexMesh, Segment, TriMesh, UnitDir};

fn closed(mesh: TriMesh) -> ClosedMesh {
    ClosedMesh::new(mesh).expect("closed").0
}

fn convex(mesh: TriMesh) -> ConvexMesh {
    ConvexMesh::new(closed(mesh)).map_err(|refused| refused.1).expect("convex")
}

fn ellipsoid() -> TriMesh {
    icosphere(2).map_vertices(|v| v * DVec3::new(100.0, 80.0, 60.0) + DVec3::new(7.0, -30.0, 1e3))
}

fn line(from: DVec3, towards: DVec3) -> Line {
    Line::new(from, UnitDir::new(towards).expect("a direction")).expect("finite")
}

/// Segments aimed at vertices, at edges, within a face's plane, and anywhere in the box.
fn aimed(surface: &ClosedMesh, seed: u64, rays: usize) -> Vec<Segment> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let (mesh, bounds) = (surface.mesh(), surface.bounds());
    (0..rays)
        .filter_map(|i| {
            let [a, b, c] = mesh.triangle(rng.random_range(0..mesh.faces.len()));
            let u: f64 = rng.random();
            let mut unit = || DVec3::from([0; 3].map(|_| rng.random::<f64>()));
            let target = [a, a + u * (b - a), a.midpoint(b), bounds.min + bounds.size() * unit()][i % 4];
            let out = if i % 7 == 0 { 0.3 * (b - a) + 0.7 * (c - b) } else { unit() - 0.5 };
            let out = 3.0 * bounds.diagonal() * UnitDir::new(out)?.get();
            Segment::between(target + out, target - out)
        })
        .collect()
}

#[test]
fn a_cube_is_as_long_as_its_side_without_rounding() {
    let cube = convex(cube(2.0));
    let two = Quotient::of(2.0);
    for (y, z, length) in
        [(0.3, 0.4, &two), (1.0, 0.2, &two), (1.0, -1.0, &two), (1.0 + f64::EPSILON, 0.2, &Quotient::of(0.0))]
    {
        for from in [-5.0, 5.0] {
            let ray = line(DVec3::new(from, y, z), DVec3::X * -from);
            assert_eq!(of_planes(&cube, &ray).length(), *length, "{y} {z}");
            assert_eq!(of_triangles(cube.surface(), &ray).length(), *length, "{y} {z}");
        }
    }
}

#[test]
fn a_cavity_parts_the_chord_and_a_reach_cuts_it() {
    let mut shell = block([0.0; 3], [8.0; 3]);
    shell.append(&inside_out(block([2.0; 3], [5.0; 3])));
    let ray = line(DVec3::new(-1.0, 3.0, 3.5), DVec3::X);
    let chord = of_triangles(&closed(shell), &ray);
    let parts = |chord: &RationalChord| chord.ends_mm().flatten().collect::<Vec<_>>();
    assert_eq!(parts(&chord), [1.0, 3.0, 6.0, 9.0]);
    let reach = Interval::new(0.0, 7.5).expect("ordered");
    assert_eq!(parts(&chord.clone().within(&reach)), [1.0, 3.0, 6.0, 7.5]);
    assert_eq!(chord.within(&Interval::new(3.0, 6.0).expect("ordered")).length_mm(), 0.0);
}

#[test]
fn the_sieve_drops_no_plane_that_decides() {
    let mut dropped = 0;
    for mesh in [ellipsoid(), cube(3.0), ellipsoid().map_vertices(|v| v * DVec3::new(1.0, 1e-6, 1.0))] {
        let body = convex(mesh);
        let all: Vec<_> = body.planes().iter().collect();
        for ray in aimed(body.surface(), 1, 60) {
            let expected = clip(&all, ray.line());
            assert_eq!(of_planes(&body, ray.line()), expected, "{ray:?}");
            dropped += all.len() - deciding(body.planes(), ray.line()).map_or(0, |few| few.len());
        }
    }
    assert!(dropped > 30_000, "{dropped}");
}

#[test]
fn the_two_surfaces_differ_by_the_rounding_of_the_normals() {
    let body = convex(ellipsoid());
    let mut differ = 0;
    for ray in aimed(body.surface(), 2, 200) {
        let triangles = of_triangles(body.surface(), ray.line()).within(&ray.reach()).length_mm();
        let planes = of_planes(&body, ray.line()).within(&ray.reach()).length_mm();
        // Each normal's components are rounded, some γ₈ in all, over the body's size.
        let shift_mm = gamma(8) * body.bounds().diagonal() + body.reflex_depth_mm();
        let [least, most] = [-shift_mm, shift_mm].map(|s| length_in_parallel_body(&body, &ray, s));
        let rounding_mm = gamma(8) * ray.length_mm();
        assert!((least - rounding_mm..=most + rounding_mm).contains(&triangles), "{ray:?}");
        differ += usize::from(triangles != planes);
    }
    assert!(differ > 50, "{differ}");
}

#[test]
fn clipping_and_the_hierarchy_err_by_a_few_units_of_the_distance() {
    let body = Body::new(closed(ellipsoid()));
    let convex = body.convexity().expect("convex");
    let mut parts = Vec::new();
    let mut rng = Pcg64::seed_from_u64(3);
    for _ in 0..300 {
        let mut unit = || DVec3::from([0; 3].map(|_| rng.random_range(-1.0..1.0)));
        let (near, out) = (unit(), unit());
        let target = body.bounds().centre() + 20.0 * near;
        let ray = line(target + 900.0 * out.normalize(), -out);
        for (engine, chord) in
            [(Engine::Clip, of_planes(convex, &ray)), (Engine::Bvh, of_triangles(body.surface(), &ray))]
        {
            body.chords_by(engine, &ray, &mut parts);
            let length = parts.iter().map(Interval::length).sum();
            let rounding = chord.rounding_of(length);
            // Near the middle faces are seen steeply enough: eight roundings over the cosine at each end.
            assert!(rounding.ulps_of_distance.expect("a hit") < 64.0, "{engine:?}: {rounding:?}");
        }
    }
}

#[test]
fn lines_along_the_edges_of_a_box_are_whole_in_both_surfaces() {
    let body = convex(block([1.0, 2.0, 3.0], [5.0, 8.0, 4.5]));
    let corners = body.bounds().corners();
    let edges = corners.iter().flat_map(|a| corners.iter().map(move |b| (*a, *b)));
    for (a, b) in edges.filter(|(a, b)| (*b - *a).to_array().iter().filter(|x| **x == 0.0).count() == 2) {
        let ray = line(a, b - a);
        let (planes, triangles) = (of_planes(&body, &ray), of_triangles(body.surface(), &ray));
        assert_eq!(planes, triangles, "{a} {b}");
        assert_eq!(planes.length_mm(), (b - a).length());
    }
}

#[test]
fn an_error_is_told_in_units_in_the_last_place() {
    let cube = convex(cube(2.0));
    let chord = of_planes(&cube, &line(DVec3::new(-9.0, 0.3, 0.4), DVec3::X));
    let rounding = chord.rounding_of(2.0 + 6.0 * f64::EPSILON);
    assert_eq!(rounding.error_mm, 6.0 * f64::EPSILON);
    assert_eq!(rounding.ulps_of_length, Some(3.0));
    assert_eq!(rounding.ulps_of_distance, Some(0.75), "the far end is at 10");
    let missed = RationalChord::default().rounding_of(0.5);
    assert_eq!((missed.error_mm, missed.ulps_of_length, missed.ulps_of_distance), (0.5, None, None));
}
