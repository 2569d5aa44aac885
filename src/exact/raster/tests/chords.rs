//! One quotient a pixel, of small faces and of large ones, beside one for each crossing.

use super::*;

fn lengths_of_chords(surface: &ClosedMesh, grid: &RayGrid, region: &Region) -> Vec<f64> {
    let mut lengths = vec![0.0; region.pixels()];
    RasterView::new(surface, grid).as_convex().trace(region, &mut Lengths(&mut lengths));
    lengths
}

#[test]
fn one_quotient_a_pixel_is_what_single_rays_give_also_where_faces_cover_a_pixel_twice() {
    // A torus is not convex: all its pixels of two parts are covered twice, and go to the engine for single rays.
    // Of those, the first, the last and the coarser torus have large faces.
    let [coarse, fine] = [7, 20].map(|n| torus(60.0, 25.0, n));
    let bodies = [ellipsoid(1), ellipsoid(3), ellipsoid(5), coarse, fine, cube(90.0)];
    for (mesh, pitch) in bodies.into_iter().zip([1.3, 1.3, 2.9, 1.7, 2.3, 3.0]) {
        let surface = closed(mesh);
        for grid in [
            cone(DVec3::new(10.0, -20.0, -500.0), 300.0, pitch, 151),
            parallel(DVec3::new(30.0, 50.0, 700.0), 300.0, pitch, 151),
            // Vertices and edges on pixels.
            parallel(DVec3::Z * 900.0, 300.0, 3.0, 51),
        ] {
            let whole = grid.whole();
            let by_chords = lengths_of_chords(&surface, &grid, &whole);
            let hits = by_chords.iter().filter(|&&length| length > 1.0).count();
            assert!(hits > 300, "{hits}");
            for ((column, row), length) in whole.places().zip(&by_chords) {
                let alone = length_by_bvh(&surface, &grid.segment(column, row));
                assert!((length - alone).abs() < 1e-9, "({column}, {row}): {length}, not {alone}");
            }
        }
    }
}

#[test]
fn one_quotient_a_pixel_is_the_same_bits_in_any_region_and_with_the_ends() {
    for mesh in [ellipsoid(1), ellipsoid(2), ellipsoid(4), torus(60.0, 25.0, 7), torus(60.0, 25.0, 20)] {
        let surface = closed(mesh);
        for grid in [
            cone(DVec3::new(10.0, -20.0, -500.0), 300.0, 1.7, 131),
            parallel(DVec3::new(30.0, 50.0, 700.0), 300.0, 1.1, 131),
        ] {
            let whole = lengths_of_chords(&surface, &grid, &grid.whole());
            let (mut sums, mut spans) = (vec![0.0; whole.len()], Spans::default());
            let mut both = (Lengths(&mut sums), &mut spans);
            RasterView::new(&surface, &grid).as_convex().trace(&grid.whole(), &mut both);
            assert_eq!(sums, whole);
            let mut by_spans = vec![0.0; whole.len()];
            spans.drain(|ray, part| by_spans[ray] += part.length());
            assert!(by_spans.iter().zip(&whole).all(|(a, b)| (a - b).abs() < 1e-11));
            for (columns, rows) in [(0..131, 17..18), (40..41, 0..131), (3..70, 29..131), (65..67, 60..63)] {
                let region = Region { columns, rows };
                let expected: Vec<f64> =
                    region.places().map(|(column, row)| whole[(row * 131 + column) as usize]).collect();
                assert_eq!(lengths_of_chords(&surface, &grid, &region), expected);
            }
        }
    }
}

#[test]
fn blocks_of_large_faces_meet_without_a_seam() {
    let surface = closed(ellipsoid(2));
    let steps = [DVec3::X * 0.27, DVec3::Y * 3.1];
    let [across, down] = [-0.135 * 1299.0, -1.55 * 69.0];
    for upstream in [Upstream::Source(DVec3::new(10.0, -20.0, -500.0)), Upstream::Path(DVec3::Z * 700.0)] {
        let origin = DVec3::new(across, down, 300.0);
        let grid = RayGrid::new(upstream, origin, steps, [1300, 70]).expect("a grid");
        let whole = lengths_of_chords(&surface, &grid, &grid.whole());
        // One crossing after the other, by blocks of another width.
        for (one, other) in whole.iter().zip(lengths(&surface, &grid, &grid.whole())) {
            assert!((one - other).abs() < 1e-10, "{one}, not {other}");
        }
        let hits = whole.iter().filter(|&&length| length > 1.0).count();
        assert!(hits > 20_000 && hits < whole.len() - 20_000, "{hits}");
        for (columns, rows) in [(1..1299, 3..69), (500..530, 0..70), (1023..1025, 40..41)] {
            let region = Region { columns, rows };
            let expected: Vec<f64> =
                region.places().map(|(column, row)| whole[(row * 1300 + column) as usize]).collect();
            assert_eq!(lengths_of_chords(&surface, &grid, &region), expected);
        }
    }
}
