//! Which pixels a face is given: one face each, whatever lies on an edge or a vertex.

use super::*;

#[test]
fn pixels_on_vertices_and_edges_are_given_to_one_face() {
    const SEED: u64 = 41;
    let mut rng = rand_pcg::Pcg64::seed_from_u64(SEED);
    for _ in 0..20 {
        // On a lattice as wide as the pixels: faces without area, vertices in one place and edges through pixels abound.
        let size = rng.random_range(3.0..20.0);
        let lattice = icosphere(2).map_vertices(|v| (size * v).round());
        let surface = closed(lattice);
        let winding = |grid: &RayGrid| {
            let mut pierced = Pierced::default();
            RasterView::new(&surface, grid).trace(&grid.whole(), &mut pierced);
            let mut windings = vec![0; grid.whole().pixels()];
            for pierce in pierced.0 {
                windings[pierce.ray as usize] += if pierce.way == Way::In { 1 } else { -1 };
            }
            windings
        };
        let along = [DVec3::Z * 64.0, DVec3::new(1.0, 2.0, 64.0), DVec3::new(-32.0, 0.0, 64.0)];
        for path in along {
            let grid = parallel(path, 32.0, 1.0, 65);
            assert!(winding(&grid).iter().all(|&w| w == 0), "{size} {path}");
        }
        let grid = cone(DVec3::new(0.0, 1.0, -64.0), 64.0, 2.0, 65);
        assert!(winding(&grid).iter().all(|&w| w == 0), "{size}");
    }
}

/// Whether the ray of a pixel may lie in a face that is edge-on.
fn is_in_a_face(surface: &ClosedMesh, grid: &RayGrid, place_error: f64, [column, row]: [i32; 2]) -> bool {
    let projection = Projection::new(grid);
    let pixel = Pixels { columns: column..column + 1, rows: row..row + 1 };
    let mut found = Vec::new();
    for face in 0..surface.mesh().faces.len() {
        let places = surface.mesh().triangle(face).map(|v| projection.place(projection.homogeneous(v)));
        if edge_on::is_edge_on(places, place_error) {
            edge_on::pixels_along(places, face as u32, place_error, &pixel, &mut found);
        }
    }
    !found.is_empty()
}

#[test]
fn coverage_is_that_of_the_exact_predicate() {
    use crate::geometry::predicates::cover;
    const SEED: u64 = 42;
    let mut rng = rand_pcg::Pcg64::seed_from_u64(SEED);
    let (mut compared, mut left) = (0, 0);
    // A tetrahedron's faces are triangles in any place; quarters of a pixel make ties.
    for _ in 0..300 {
        let mut corner = || DVec3::from([0; 3].map(|_| f64::from(rng.random_range(-40..40)) / 4.0));
        let vertices = [corner(), corner(), corner(), corner()].to_vec();
        let faces = vec![[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]];
        let Ok((surface, _)) = ClosedMesh::new(TriMesh { vertices, faces }) else { continue };
        let grid = parallel(DVec3::Z * 64.0, 32.0, 1.0, 25);
        let view = RasterView::new(&surface, &grid);
        let Form::Seen(seen) = &view.form else { panic!("in sight") };
        let mut pierced = Pierced::default();
        view.trace(&grid.whole(), &mut pierced);
        // Their pixels are left to the engine for single rays.
        let is_all_but_edge_on = |face: usize| {
            let place = |v: DVec3| seen.projection.place(seen.projection.homogeneous(v));
            let [a, b, c] = surface.mesh().triangle(face).map(place);
            let limits = [0.0, 1.0];
            !face::Slope::new([&a, &b, &c], seen.care, limits).1
                && !face::Slope::careful([a, b, c], seen.care, limits).1
        };
        let all_but_edge_on = [0, 1, 2, 3].map(is_all_but_edge_on);
        for (ray, (column, row)) in grid.whole().places().enumerate() {
            if is_in_a_face(&surface, &grid, seen.place_error, [column as i32, row as i32]) {
                continue;
            }
            let mut found: Vec<_> =
                pierced.0.iter().filter(|p| p.ray == ray as u32).map(|p| (p.face, p.way)).collect();
            found.sort_unstable();
            let pixel = [f64::from(column) - 12.0, f64::from(row) - 12.0];
            let expected: Vec<_> = (0..4)
                .filter_map(|f| {
                    let winding = cover(surface.mesh().triangle(f).map(|v| [v.x, v.y]), pixel);
                    let way = if winding > 0 { Way::Out } else { Way::In };
                    (winding != 0).then_some((f as u32, way))
                })
                .collect();
            if expected.iter().any(|(face, _)| all_but_edge_on[*face as usize]) {
                left += expected.len();
                continue;
            }
            compared += expected.len();
            assert_eq!(found, expected, "({column}, {row})");
        }
    }
    assert!(compared > 1_000 && left < compared / 50, "{compared} compared, {left} left out");
}
