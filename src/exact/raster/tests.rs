//! Images judged ray by ray: by clipping between two parallel bodies, and by the engine for single rays.

use glam::{DMat3, DVec3};
use rand::{RngExt, SeedableRng};

use super::projection::Projection;
use super::*;
use crate::exact::{Lengths, Pierced, Spans, Way};
use crate::geometry::numeric::gamma;
use crate::geometry::primitives::{block, cube, icosphere, inside_out, prism};
use crate::geometry::{ConvexMesh, Interval, Segment, TriMesh, Upstream};

mod chords;
mod coverage;

fn closed(mesh: TriMesh) -> ClosedMesh {
    ClosedMesh::new(mesh).expect("closed").0
}

fn turned() -> DMat3 {
    DMat3::from_rotation_z(0.4) * DMat3::from_rotation_x(0.7) * DMat3::from_rotation_y(0.3)
}

fn ellipsoid(subdivisions: u32) -> TriMesh {
    icosphere(subdivisions).map_vertices(|v| turned() * (v * DVec3::new(100.0, 80.0, 60.0)))
}

/// A square grid of pixels `pitch` mm apart in the plane z = `z`, centred on the z axis.
fn grid(upstream: Upstream, z: f64, pitch: f64, pixels: u32) -> RayGrid {
    let half = 0.5 * pitch * f64::from(pixels - 1);
    let origin = DVec3::new(-half, -half, z);
    RayGrid::new(upstream, origin, [DVec3::X * pitch, DVec3::Y * pitch], [pixels; 2]).expect("a grid")
}

fn cone(source: DVec3, z: f64, pitch: f64, pixels: u32) -> RayGrid {
    grid(Upstream::Source(source), z, pitch, pixels)
}

fn parallel(path: DVec3, z: f64, pitch: f64, pixels: u32) -> RayGrid {
    grid(Upstream::Path(path), z, pitch, pixels)
}

fn lengths(surface: &ClosedMesh, grid: &RayGrid, region: &Region) -> Vec<f64> {
    let mut lengths = vec![0.0; region.pixels()];
    RasterView::new(surface, grid).trace(region, &mut Lengths(&mut lengths));
    lengths
}

fn length_by_bvh(surface: &ClosedMesh, ray: &Segment) -> f64 {
    let mut parts = Vec::new();
    bvh::chords(surface, ray.line(), &mut parts);
    parts.iter().filter_map(|p| p.intersection(&ray.reach())).map(|p| p.length()).sum()
}

/// The greatest difference to the engine for single rays, mm; every ray must go in as often as out.
fn worst_against_bvh(surface: &ClosedMesh, grid: &RayGrid) -> f64 {
    let whole = grid.whole();
    let lengths = lengths(surface, grid, &whole);
    let mut pierced = Pierced::default();
    RasterView::new(surface, grid).trace(&whole, &mut pierced);
    let mut windings = vec![0; lengths.len()];
    for pierce in &pierced.0 {
        assert!((0.0..=grid_length(grid, &whole, pierce.ray)).contains(&pierce.t_mm), "{pierce:?}");
        windings[pierce.ray as usize] += if pierce.way == Way::In { 1 } else { -1 };
    }
    let leak = windings.iter().position(|&w| w != 0);
    assert_eq!(leak, None, "a ray goes in more often than out, or less");
    let differences = whole
        .places()
        .zip(&lengths)
        .map(|((column, row), length)| (length - length_by_bvh(surface, &grid.segment(column, row))).abs());
    differences.fold(0.0, f64::max)
}

fn grid_length(grid: &RayGrid, region: &Region, ray: u32) -> f64 {
    let (column, row) = region.places().nth(ray as usize).expect("a ray of the region");
    grid.segment(column, row).length_mm()
}

/// The chord of a convex body all of whose planes are moved outwards by `shift_mm`, within the ray.
fn chord_of_parallel_body(body: &ConvexMesh, ray: &Segment, shift_mm: f64) -> f64 {
    let (o, d) = (ray.line().origin(), ray.line().dir());
    let (mut start, mut end) = (0.0, ray.length_mm());
    for plane in body.planes() {
        let (height, slope) = (plane.normal.dot(plane.point - o) + shift_mm, plane.normal.dot(d));
        match slope {
            _ if slope > 0.0 => end = f64::min(end, height / slope),
            _ if slope < 0.0 => start = f64::max(start, height / slope),
            _ if height < 0.0 => return 0.0,
            _ => {}
        }
    }
    Interval::new(start, end).map_or(0.0, |chord| chord.length())
}

/// Asserts that all lengths are those of a body whose surface has moved by no more than the documented error.
fn assert_bracketed(mesh: TriMesh, grid: &RayGrid) {
    let body = ConvexMesh::new(closed(mesh)).map_err(|refused| refused.1).expect("convex");
    let projection = Projection::new(grid);
    let sight = projection.sight(&body.bounds());
    let extent = [sight.columns, sight.rows].as_flattened().iter().fold(1.0, |e: f64, x| e.max(x.abs()));
    let error = projection.place_error(&body.bounds(), sight.shares[0], extent);
    let shift_mm = error * grid.steps().iter().map(|s| s.length()).fold(0.0, f64::max);
    assert!(shift_mm < 1e-9, "a bound that says nothing: {shift_mm}");
    let mut hits = 0;
    let lengths = lengths(body.surface(), grid, &grid.whole());
    for ((column, row), &length) in grid.whole().places().zip(&lengths) {
        let ray = grid.segment(column, row);
        let [least, most] = [-shift_mm, shift_mm].map(|s| chord_of_parallel_body(&body, &ray, s));
        let rounding = 4.0 * f64::EPSILON * ray.length_mm();
        assert!(
            (least - rounding..=most + rounding).contains(&length),
            "({column}, {row}): {least} ≤ {length} ≤ {most}"
        );
        hits += usize::from(length > 0.0);
    }
    assert!(hits > lengths.len() / 4, "the body fills the image");
}

#[test]
fn lengths_of_a_convex_body_lie_between_those_of_the_bodies_about_it() {
    for subdivisions in [2, 3] {
        let mesh = ellipsoid(subdivisions);
        assert_bracketed(mesh.clone(), &cone(DVec3::new(10.0, -20.0, -500.0), 300.0, 3.1, 101));
        assert_bracketed(mesh.clone(), &cone(DVec3::new(130.0, -20.0, -300.0), 150.0, 2.9, 101));
        assert_bracketed(mesh, &parallel(DVec3::new(30.0, 50.0, 700.0), 300.0, 2.3, 101));
    }
}

#[test]
fn needles_and_plates_are_as_exact() {
    let plate = icosphere(2).map_vertices(|v| turned() * (v * DVec3::new(150.0, 150.0, 1e-4)));
    // Its ends are fans of triangles up to some thousand times longer than wide.
    let fans = prism(500).map_vertices(|v| v * DVec3::new(110.0, 120.0, 1.0));
    for mesh in [plate, fans] {
        assert_bracketed(mesh.clone(), &cone(DVec3::new(10.0, -20.0, -500.0), 300.0, 3.1, 101));
        assert_bracketed(mesh, &parallel(DVec3::new(30.0, 50.0, 700.0), 300.0, 2.3, 101));
    }
}

/// A wedge whose front is seen at right angles and whose roof is seen all but edge-on: its depth is the difference of huge
/// products there, which may put the entry before the front.
#[test]
fn chords_under_faces_all_but_edge_on_begin_where_the_body_does() {
    for height in [1e-6, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12] {
        let mut mesh = block([-40.0, -30.0, -20.0], [40.0, 30.0, 20.0]);
        for vertex in mesh.vertices.iter_mut().filter(|v| v.y > 0.0 && v.z < 0.0) {
            vertex.y -= height;
        }
        let body = closed(mesh.map_vertices(|v| DMat3::from_rotation_z(0.4) * v));
        let convex = ConvexMesh::new(body).map_err(|refused| refused.1).expect("convex");
        for i in 0..200 {
            let off = 30.0 - height * f64::from(i) / 100.0;
            let pixel = DMat3::from_rotation_z(0.4) * DVec3::new(17.3 - 0.31 * f64::from(i % 7), off, 300.0);
            let steps = [DVec3::X, DVec3::Y];
            let source = pixel - 800.0 * DVec3::Z;
            for upstream in [Upstream::Source(source), Upstream::Path(800.0 * DVec3::Z)] {
                let grid = RayGrid::new(upstream, pixel, steps, [1, 1]).expect("a grid");
                let ray = grid.segment(0, 0);
                let length = lengths(convex.surface(), &grid, &grid.whole())[0];
                let shift = gamma(192) * 1100.0;
                let [least, most] = [-shift, shift].map(|s| chord_of_parallel_body(&convex, &ray, s));
                assert!(
                    least - shift <= length && length <= most + shift,
                    "{height:e}, {i}: {least} ≤ {length} ≤ {most}"
                );
            }
        }
    }
}

#[test]
fn a_mirrored_or_oblique_grid_sees_the_same_body() {
    let source = Upstream::Source(DVec3::new(10.0, -20.0, -500.0));
    let origin = DVec3::new(150.0, -150.0, 280.0);
    let oblique = [DVec3::new(-3.0, 0.2, 0.5), DVec3::new(0.4, 3.1, 0.3)];
    let grid = RayGrid::new(source, origin, oblique, [101, 97]).expect("a grid");
    assert_bracketed(ellipsoid(3), &grid);
}

#[test]
fn bodies_that_are_not_convex_agree_with_the_engine_for_single_rays() {
    let mut hollow = ellipsoid(3);
    hollow.append(&inside_out(ellipsoid(2).map_vertices(|v| 0.7 * v)));
    let mut pair = ellipsoid(2).map_vertices(|v| 0.5 * v + 55.0);
    pair.append(&ellipsoid(3).map_vertices(|v| 0.4 * v - 40.0));
    for mesh in [hollow, pair, torus(60.0, 25.0, 40)] {
        let surface = closed(mesh);
        for grid in [
            cone(DVec3::new(10.0, -20.0, -500.0), 300.0, 3.1, 101),
            parallel(DVec3::new(30.0, 50.0, 700.0), 300.0, 2.3, 101),
        ] {
            // An edge-on face is gone through in 1e-13 mm / the sine of its angle to the ray.
            let worst = worst_against_bvh(&surface, &grid);
            assert!(worst < 1e-9, "{worst}");
        }
    }
}

/// A torus of `n` × `n` quads about the z axis.
fn torus(radius: f64, tube: f64, n: u32) -> TriMesh {
    let angle = |i: u32| std::f64::consts::TAU * f64::from(i) / f64::from(n);
    let vertex = |i: u32, j: u32| {
        let ((s, c), (t, d)) = (angle(i).sin_cos(), angle(j).sin_cos());
        turned() * DVec3::new((radius + tube * d) * c, (radius + tube * d) * s, tube * t)
    };
    let vertices = (0..n * n).map(|k| vertex(k / n, k % n)).collect();
    let at = |i: u32, j: u32| i % n * n + j % n;
    let quad = |i, j| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
    let quads = (0..n * n).map(|k| quad(k / n, k % n));
    TriMesh { vertices, faces: quads.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect() }
}

#[test]
fn rays_in_the_faces_and_along_the_edges_of_a_cube_count() {
    let surface = closed(cube(20.0));
    // 41 pixels a millimetre apart: the outline at ±10 lies on pixels 10 and 30.
    let axis = parallel(DVec3::Z * 100.0, 50.0, 1.0, 41);
    let image = lengths(&surface, &axis, &axis.whole());
    for (i, (column, row)) in axis.whole().places().enumerate() {
        let is_in = |k: u32| (10..=30).contains(&k);
        let expected = if is_in(column) && is_in(row) { 20.0 } else { 0.0 };
        assert!((image[i] - expected).abs() < 1e-13, "({column}, {row}): {}", image[i]);
    }
    // A source in the plane of a face, and on the line of an edge; pitches that no binary fraction holds.
    for x in [10.0, -10.0, 3.0] {
        for pitch in [1.0, 0.7, 10.0 / 3.0] {
            let worst = worst_against_bvh(&surface, &cone(DVec3::new(x, 10.0, -100.0), 50.0, pitch, 41));
            assert!(worst < 1e-11, "{x} {pitch}: {worst}");
        }
    }
    for pitch in [0.1, 0.7, 10.0 / 7.0] {
        let worst = worst_against_bvh(&surface, &parallel(DVec3::Z * 100.0, 50.0, pitch, 61));
        assert!(worst < 1e-11, "{pitch}: {worst}");
    }
}

#[test]
fn a_source_or_a_target_inside_cuts_the_chord() {
    let mut hollow = ellipsoid(3);
    hollow.append(&inside_out(ellipsoid(2).map_vertices(|v| 0.5 * v)));
    let hollow = closed(hollow);
    let solid = closed(ellipsoid(3));
    let boxed = closed(block([-50.0, -60.0, -70.0], [40.0, 30.0, 80.0]));
    for surface in [&hollow, &solid, &boxed] {
        let inside = DVec3::new(4.0, -3.0, 2.0);
        for source in [inside, turned() * DVec3::new(0.0, 0.0, 55.0), DVec3::new(39.9, 0.0, 0.0)] {
            let worst = worst_against_bvh(surface, &cone(source, 300.0, 7.0, 61));
            assert!(worst < 1e-9, "{source}: {worst}");
            // All around: pixels are as near as the walls.
            let worst = worst_against_bvh(surface, &cone(source, source.z + 20.0, 9.0, 61));
            assert!(worst < 1e-9, "{source}: {worst}");
        }
        let worst = worst_against_bvh(surface, &cone(DVec3::new(0.0, 0.0, -500.0), 3.0, 3.0, 61));
        assert!(worst < 1e-9, "{worst}");
        for path in [DVec3::Z * 30.0, DVec3::new(30.0, 3.0, 90.0)] {
            let worst = worst_against_bvh(surface, &parallel(path, 20.0, 3.0, 61));
            assert!(worst < 1e-9, "{path}: {worst}");
        }
    }
}

#[test]
fn a_source_beside_the_body_sees_what_is_ahead() {
    let surface = closed(ellipsoid(3));
    for source in [DVec3::new(130.0, 0.0, 0.0), DVec3::new(0.0, 90.0, 60.0), DVec3::new(0.0, -101.0, 101.0)] {
        for pitch in [2.0, 30.0] {
            let worst = worst_against_bvh(&surface, &cone(source, 200.0, pitch, 61));
            assert!(worst < 1e-9, "{source} {pitch}: {worst}");
        }
    }
}

#[test]
fn a_source_on_the_surface_or_next_to_it_is_no_trouble() {
    let surface = closed(block([-50.0; 3], [50.0; 3]));
    for x in [50.0, 50.0 + 1e-12, 50.0 - 1e-12, 50.0 - 1e-6, 50.0 + 1e-6, 50.0 - 1e-3] {
        let worst = worst_against_bvh(&surface, &cone(DVec3::new(x, 1.0, 2.0), 200.0, 9.1, 41));
        assert!(worst < 1e-9, "{x}: {worst}");
    }
}

#[test]
fn a_body_behind_the_source_beyond_the_pixels_or_off_the_image_is_unseen() {
    let ball = icosphere(1);
    let grid = cone(DVec3::new(0.0, 0.0, -100.0), 100.0, 1.0, 41);
    for place in [DVec3::Z * -200.0, DVec3::Z * 300.0, DVec3::X * 80.0, DVec3::Y * -80.0] {
        let surface = closed(ball.clone().map_vertices(|v| v + place));
        assert!(matches!(RasterView::new(&surface, &grid).form, Form::Unseen), "{place}");
        assert!(lengths(&surface, &grid, &grid.whole()).iter().all(|&l| l == 0.0));
    }
}

#[test]
fn any_tiling_gives_the_same_bits() {
    let mut hollow = ellipsoid(4);
    hollow.append(&inside_out(ellipsoid(2).map_vertices(|v| 0.7 * v)));
    let surface = closed(hollow);
    for grid in [
        cone(DVec3::new(10.0, -20.0, -500.0), 300.0, 0.77, 401),
        cone(DVec3::new(10.0, -20.0, 10.0), 300.0, 2.0, 301),
        parallel(DVec3::new(30.0, 50.0, 700.0), 300.0, 0.5, 401),
    ] {
        let view = RasterView::new(&surface, &grid);
        let (columns, rows) = grid.size();
        let mut whole = vec![0.0; grid.whole().pixels()];
        view.trace(&grid.whole(), &mut Lengths(&mut whole));
        for side in [1, 32, 64, 97] {
            // One-pixel tiles of a part will do.
            let last = if side == 1 { 40 } else { rows };
            for top in (0..last).step_by(side) {
                for left in (0..columns).step_by(side) {
                    let region = Region {
                        columns: left..columns.min(left + side as u32),
                        rows: top..rows.min(top + side as u32),
                    };
                    let mut tile = vec![0.0; region.pixels()];
                    view.trace(&region, &mut Lengths(&mut tile));
                    for ((column, row), length) in region.places().zip(tile) {
                        let of_whole = whole[(row * columns + column) as usize];
                        assert_eq!(length.to_bits(), of_whole.to_bits(), "{side}: ({column}, {row})");
                    }
                }
            }
        }
    }
}

#[test]
fn spans_and_lengths_are_of_the_same_crossings() {
    let surface = closed(torus(60.0, 25.0, 20));
    let grid = cone(DVec3::new(10.0, -20.0, -500.0), 300.0, 3.1, 101);
    let whole = grid.whole();
    let mut spans = Spans::default();
    RasterView::new(&surface, &grid).trace(&whole, &mut spans);
    let mut by_spans = vec![0.0; whole.pixels()];
    spans.drain(|ray, part| by_spans[ray] += part.length());
    for (a, b) in by_spans.iter().zip(lengths(&surface, &grid, &whole)) {
        assert!((a - b).abs() < 1e-12);
    }
}
