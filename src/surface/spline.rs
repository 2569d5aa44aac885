//! Uniform cubic B-splines as Bezier curves and patches: joined with continuous second derivatives.

use glam::DVec3;

use super::patch::BezierPatch;

/// The cubic Bezier curves of the uniform B-spline over `points`: one for each four in a row, n − 3 in all. Neighbours
/// share their end, tangent and curvature vectors; a convex polygon makes a convex curve.
pub fn spline_curves(points: &[DVec3]) -> Vec<[DVec3; 4]> {
    points.windows(4).map(|w| bezier_of([w[0], w[1], w[2], w[3]])).collect()
}

/// The patches of the uniform bicubic B-spline surface over a lattice of points, row by row: (rows − 3)·(columns − 3),
/// joined with C². Rows run along u.
pub fn lattice_patches(lattice: &[Vec<DVec3>]) -> Vec<BezierPatch> {
    let across: Vec<Vec<[DVec3; 4]>> = lattice.iter().map(|row| spline_curves(row)).collect();
    let patch = |rows: &[Vec<[DVec3; 4]>], column: usize| {
        let along: [[DVec3; 4]; 4] =
            std::array::from_fn(|j| bezier_of(std::array::from_fn(|i| rows[i][column][j])));
        BezierPatch::new(std::array::from_fn(|i| std::array::from_fn(|j| along[j][i])))
    };
    across
        .windows(4)
        .flat_map(|rows| {
            let columns = rows.iter().map(Vec::len).min().unwrap_or(0);
            (0..columns).map(move |column| patch(rows, column))
        })
        .collect()
}

/// One segment of the spline (Böhm 1981, doi:10.1016/0010-4485(81)90087-1).
fn bezier_of([a, b, c, d]: [DVec3; 4]) -> [DVec3; 4] {
    [(a + 4.0 * b + c) / 6.0, (2.0 * b + c) / 3.0, (b + 2.0 * c) / 3.0, (b + 4.0 * c + d) / 6.0]
}
