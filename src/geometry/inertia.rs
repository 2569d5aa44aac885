//! The ellipsoid of inertia of a body, and the frame in which it is a ball.

use glam::{DMat3, DVec3};
use nalgebra::{Matrix3, Vector3};

use super::Bounds;

/// The centroid of the volume inside closed triangles, mm, and the map from mm about it to a frame in which the volume's second
/// moments are those of the unit ball. A body too flat for that is scaled by its box alone.
pub fn ball_of_inertia(triangles: impl Iterator<Item = [DVec3; 3]>, bounds: Bounds) -> (DVec3, DMat3) {
    let centre = bounds.centre();
    let (mut volume, mut first, mut second) = (0.0, DVec3::ZERO, Matrix3::<f64>::zeros());
    let outer = |v: DVec3| {
        let v = Vector3::from(v.to_array());
        v * v.transpose()
    };
    for triangle in triangles {
        // The tetrahedron from the box's centre.
        let [a, b, c] = triangle.map(|v| v - centre);
        let part = a.dot(b.cross(c)) / 6.0;
        volume += part;
        first += part * (a + b + c);
        second += (outer(a) + outer(b) + outer(c) + outer(a + b + c)) * part;
    }
    let middle = first / (4.0 * volume);
    // The second moments of a ball of radius 1 over its volume are 1/5.
    let spread = (second / (20.0 * volume) - outer(middle)) * 5.0;
    let to_ball = spread
        .cholesky()
        .and_then(|root| root.l().try_inverse())
        .map(|m| DMat3::from_cols_array(&std::array::from_fn(|i| m[(i % 3, i / 3)])));
    let by_box = || DMat3::from_diagonal(DVec3::splat(2.0 / bounds.size().max_element()));
    (centre + middle, to_ball.filter(|m| m.is_finite()).unwrap_or_else(by_box))
}

#[cfg(test)]
mod tests {
    use super::super::primitives::icosphere;
    use super::*;

    #[test]
    fn an_ellipsoid_becomes_a_ball_and_a_flat_body_is_scaled_by_its_box() {
        let axes = DVec3::new(100.0, 80.0, 6.0);
        let mesh = icosphere(4).map_vertices(|v| axes * v + DVec3::new(7.0, -300.0, 1e3));
        let (middle, to_ball) = ball_of_inertia(mesh.triangles(), Bounds::of(mesh.vertices.iter().copied()));
        assert!((middle - DVec3::new(7.0, -300.0, 1e3)).length() < 1e-6, "{middle}");
        for vertex in &mesh.vertices {
            // A polyhedron within the ellipsoid: its ball is a little smaller.
            let radius = (to_ball * (*vertex - middle)).length();
            assert!((1.0..1.01).contains(&radius), "{radius}");
        }
        let flat = mesh.map_vertices(|v| DVec3::new(v.x, v.y, 0.0));
        let (_, to_ball) = ball_of_inertia(flat.triangles(), Bounds::of(flat.vertices.iter().copied()));
        assert!((to_ball.x_axis.x - 0.01).abs() < 1e-4 && to_ball.y_axis.x == 0.0, "{to_ball}");
    }
}
