//! All engines on the same rays, through features.

use glam::DVec3;
use rand::{RngExt, SeedableRng};

use super::judge::length_in_parallel_body;
use super::{Body, Engine, Lengths};
use crate::geometry::primitives::{cube, icosphere, inside_out};
use crate::geometry::{ClosedMesh, ConvexMesh, RayGrid, Segment, TriMesh, Upstream, convex_hull};

const ENGINES: [Engine; 4] = [Engine::Clip, Engine::Walk, Engine::Raster, Engine::Bvh];

/// Half the side of the lattice that bodies have their vertices on.
const REACH: i32 = 4;

/// Far more than γ₈ of the distances here, far less than any feature.
const SHIFT_MM: f64 = 1e-11;

fn lengths(body: &Body, grid: &RayGrid, engine: Engine) -> Vec<f64> {
    let mut lengths = vec![0.0; grid.whole().pixels()];
    let view = body.view(grid, Some(engine));
    assert_eq!(view.engine(), engine);
    view.trace(&grid.whole(), &mut Lengths(&mut lengths));
    lengths
}

/// The hull of points of a lattice. `None` if they lie in a plane.
fn lattice_body(rng: &mut rand_pcg::Pcg64) -> Option<Body> {
    let count = rng.random_range(4..14);
    let points: Vec<DVec3> = (0..count)
        .map(|_| DVec3::from([0; 3].map(|_| f64::from(rng.random_range(-REACH..=REACH)))))
        .collect();
    let body = Body::new(ClosedMesh::new(convex_hull(&points).ok()?).ok()?.0);
    body.convexity().is_ok().then_some(body)
}

/// Rays through points of the lattice: those of a plane in a cone, whole rows of them in a parallel beam.
fn lattice_rays(rng: &mut rand_pcg::Pcg64) -> RayGrid {
    let [x, y, z] = match rng.random_range(0..3) {
        0 => [DVec3::X, DVec3::Y, DVec3::Z],
        1 => [DVec3::Y, DVec3::Z, DVec3::X],
        _ => [DVec3::Z, -DVec3::X, -DVec3::Y],
    };
    let corner = -f64::from(REACH) * (x + y);
    let depth = f64::from(rng.random_range(-REACH..=REACH));
    let through = corner + depth * z;
    let mut across = |reach: i32| {
        let [a, b] = [0; 2].map(|_| f64::from(rng.random_range(-reach..=reach)));
        a * x + b * y
    };
    let (upstream, origin, scale) = if depth > 0.0 {
        // From a point of the lattice outside the body, on to a plane behind it.
        let source = across(REACH) - 16.0 * z;
        let scale = 2.0;
        (Upstream::Source(source), source + scale * (through - source), scale)
    } else {
        let path = 24.0 * (z + across(1));
        (Upstream::Path(path), through + 0.5 * path, 1.0)
    };
    let side = 2 * REACH as u32 + 1;
    RayGrid::new(upstream, origin, [x, y].map(|step| scale * step), [side, side]).expect("a grid")
}

/// Holds each engine's length of each ray between those of the bodies parallel to the body. Returns rays traced, and those
/// that surely hit.
fn trace_lattices(rays: usize, seed: u64) -> (usize, usize) {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
    let (mut traced, mut hits) = (0, 0);
    while traced < rays {
        let Some(body) = lattice_body(&mut rng) else { continue };
        let convex: &ConvexMesh = body.convexity().expect("convex");
        let grid = lattice_rays(&mut rng);
        let bounds: Vec<[f64; 2]> = grid
            .whole()
            .places()
            .map(|(column, row)| {
                let ray = grid.segment(column, row);
                [-SHIFT_MM, SHIFT_MM].map(|shift| length_in_parallel_body(convex, &ray, shift))
            })
            .collect();
        for engine in ENGINES {
            for (ray, (length, [least, most])) in
                lengths(&body, &grid, engine).iter().zip(&bounds).enumerate()
            {
                assert!(
                    least - SHIFT_MM <= *length && *length <= most + SHIFT_MM,
                    "{engine:?}: {length}, not from {least} to {most}: ray {ray} of {grid:?} through {:?}",
                    body.surface().mesh()
                );
            }
        }
        traced += bounds.len();
        hits += bounds.iter().filter(|[least, _]| *least > 0.0).count();
    }
    (traced, hits)
}

#[test]
fn no_engine_loses_a_ray_through_vertices_edges_or_faces_of_lattice_bodies() {
    let (rays, hits) = trace_lattices(100_000, 1);
    assert!(4 * hits > rays, "{hits} of {rays} hit");
}

#[test]
#[ignore = "ten million rays, ten seconds"]
fn ten_million_rays_through_lattice_points_lose_none_in_any_engine() {
    let (rays, hits) = trace_lattices(10_000_000, 2);
    assert!(4 * hits > rays, "{hits} of {rays} hit");
}

fn hollow_ball(subdivisions: u32) -> Body {
    let mut mesh: TriMesh = icosphere(subdivisions).map_vertices(|v| 30.0 * v);
    mesh.append(&inside_out(cube(20.0)));
    Body::new(ClosedMesh::new(mesh).expect("closed").0)
}

#[test]
fn raster_and_hierarchy_find_the_same_image_of_a_body_that_is_not_convex() {
    let body = hollow_ball(3);
    assert!(body.convexity().is_err() && !Engine::Walk.serves(&body));
    let steps = [DVec3::new(0.9, 0.1, 0.0), DVec3::new(0.0, 0.1, 0.8)];
    let origin = DVec3::new(3.0, 60.0, 1.0) - 50.0 * (steps[0] + steps[1]);
    for upstream in
        [Upstream::Source(DVec3::new(5.0, -200.0, 9.0)), Upstream::Path(DVec3::new(3.0, 300.0, 2.0))]
    {
        let grid = RayGrid::new(upstream, origin, steps, [100, 100]).expect("a grid");
        let [raster, bvh] = [Engine::Raster, Engine::Bvh].map(|engine| lengths(&body, &grid, engine));
        let hits = bvh.iter().filter(|length| **length > 0.0).count();
        assert!(hits > 2_000, "{hits} hits");
        for (a, b) in raster.iter().zip(&bvh) {
            assert!((a - b).abs() < 1e-9, "{a} and {b}");
        }
    }
}

#[test]
fn an_engine_that_does_not_serve_gives_way_to_one_that_does() {
    let body = hollow_ball(1);
    let grid = RayGrid::new(Upstream::Path(100.0 * DVec3::Z), 50.0 * DVec3::Z, [DVec3::X, DVec3::Y], [4, 4])
        .expect("a grid");
    for engine in [Engine::Clip, Engine::Walk] {
        assert!(body.view(&grid, Some(engine)).engine().serves(&body));
    }
}

#[test]
fn what_a_ray_gets_in_a_batch_depends_on_the_body_not_on_the_batch() {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(11);
    let mut point = || DVec3::from([0; 3].map(|_| rng.random_range(-1.0..1.0)));
    let towards = |(a, b): (DVec3, DVec3)| Segment::between(300.0 * a.normalize(), 40.0 * b);
    let rays: Vec<Segment> = (0..2_000).filter_map(|_| towards((point(), point()))).collect();
    // Of 20, 80 and 320 planes.
    let chosen =
        [(0, [Engine::Clip, Engine::Clip]), (1, [Engine::Clip, Engine::Walk]), (2, [Engine::Walk; 2])];
    for (subdivisions, engines) in chosen {
        let mesh = icosphere(subdivisions).map_vertices(|v| DVec3::new(60.0, 50.0, 40.0) * v);
        let body = Body::new(ClosedMesh::new(mesh).expect("closed").0);
        assert_eq!([body.engine_for_line(), body.engine_for_rays()], engines);
        let in_batches_of = |count: usize| {
            let mut lengths = vec![0.0; rays.len()];
            for (i, batch) in rays.chunks(count).enumerate() {
                body.trace(engines[1], i * count, batch, &mut Lengths(&mut lengths));
            }
            lengths
        };
        let at_once = in_batches_of(rays.len());
        assert!(at_once.iter().filter(|length| **length > 0.0).count() > 1_000);
        assert!([1, 7, 33].into_iter().all(|count| in_batches_of(count) == at_once));
    }
}

#[test]
fn a_ray_that_lies_in_a_face_but_for_rounding_is_no_longer_than_the_face() {
    // The ray's direction is no f64: it lies in the roof's plane but for the last digits, from the ridge to the eaves.
    // How much of that counts is rounding's to say, but no more than all.
    let points = [
        [1, -2, 3],
        [-2, 4, 2],
        [-2, -4, 2],
        [-1, -4, 2],
        [3, 2, 1],
        [-3, 3, 0],
        [3, 4, 0],
        [-4, 2, -3],
        [-2, 0, -2],
    ];
    let hull = convex_hull(&points.map(|p| DVec3::from(p.map(f64::from)))).expect("a hull");
    let body = Body::new(ClosedMesh::new(hull).expect("closed").0);
    let grid = RayGrid::new(
        Upstream::Source(DVec3::new(1.0, 16.0, 3.0)),
        DVec3::new(-5.0, -20.0, 1.0),
        [2.0 * DVec3::Z, -2.0 * DVec3::X],
        [1, 1],
    )
    .expect("a grid");
    for engine in ENGINES {
        let length = lengths(&body, &grid, engine)[0];
        assert!(length < 0.25 * 334f64.sqrt() + 1e-12, "{engine:?}: {length}");
    }
}
