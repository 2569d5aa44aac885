use std::collections::HashMap;

use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;

/// Every edge of the mesh twice, in opposite directions; Euler's formula for a sphere.
fn assert_closed_sphere(mesh: &TriMesh) {
    let mut edges: HashMap<(u32, u32), usize> = HashMap::new();
    for f in &mesh.faces {
        for i in 0..3 {
            *edges.entry((f[i], f[(i + 1) % 3])).or_default() += 1;
        }
    }
    for (&(a, b), &count) in &edges {
        assert_eq!(count, 1, "edge {a}–{b} is walked {count} times in one direction");
        assert!(edges.contains_key(&(b, a)), "edge {a}–{b} has one face");
    }
    let (v, e, f) = (mesh.vertices.len(), edges.len() / 2, mesh.faces.len());
    assert_eq!(v + f, e + 2, "V {v} − E {e} + F {f} is not 2");
}

/// No vertex strictly beyond any face, by exact signs; no face without a normal.
fn assert_exactly_convex(mesh: &TriMesh) {
    for [a, b, c] in mesh.triangles() {
        assert!((b - a).cross(c - a).length() > 0.0, "a face at {a} has no area");
        for &v in &mesh.vertices {
            let sign = orient3d(coordinates(a), coordinates(b), coordinates(c), coordinates(v));
            assert!(sign >= 0.0, "{v} is beyond the face at {a}");
        }
    }
}

/// How far the worst of the points sticks out, mm.
fn worst_outside(mesh: &TriMesh, points: &[DVec3]) -> f64 {
    mesh.triangles()
        .map(|[a, b, c]| {
            let n = (b - a).cross(c - a).normalize();
            points.iter().map(|&p| n.dot(p - a)).fold(f64::NEG_INFINITY, f64::max)
        })
        .fold(f64::NEG_INFINITY, f64::max)
}

fn assert_is_hull_of(mesh: &TriMesh, points: &[DVec3]) {
    assert_is_hull_within(mesh, points, HULL_TOLERANCE);
}

fn assert_is_hull_within(mesh: &TriMesh, points: &[DVec3], tolerance: f64) {
    assert_closed_sphere(mesh);
    assert_exactly_convex(mesh);
    assert!(mesh.signed_volume() > 0.0);
    let bounds = Bounds::of(points.iter().copied());
    let rounding = 8.0 * f64::EPSILON * bounds.min.abs().max(bounds.max.abs()).max_element();
    // A dropped point may be near several faces at once: a few tolerances.
    let allowed = 8.0 * tolerance * bounds.diagonal() + rounding;
    assert!(worst_outside(mesh, points) <= allowed, "{} mm outside", worst_outside(mesh, points));
}

fn cube_grid(steps: u32) -> Vec<DVec3> {
    let mut points = Vec::new();
    for i in 0..=steps {
        for j in 0..=steps {
            for k in 0..=steps {
                points.push(DVec3::new(f64::from(i), f64::from(j), f64::from(k)) / f64::from(steps));
            }
        }
    }
    points
}

fn sphere_points(count: usize, seed: u64) -> Vec<DVec3> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut coordinate = || rng.random_range(-1.0..1.0);
    std::iter::repeat_with(|| DVec3::new(coordinate(), coordinate(), coordinate()))
        .filter(|p| (0.1..1.0).contains(&p.length()))
        .map(|p| 100.0 * p.normalize())
        .take(count)
        .collect()
}

#[test]
fn a_grid_with_coplanar_collinear_and_duplicate_points_becomes_a_cube_of_twelve_faces() {
    let mut points = cube_grid(5);
    points.extend(cube_grid(5));
    points.reverse();
    let hull = convex_hull(&points).expect("a cube");
    assert_eq!((hull.vertices.len(), hull.faces.len()), (8, 12));
    assert!((hull.signed_volume() - 1.0).abs() < 1e-15);
    assert_is_hull_of(&hull, &points);
}

#[test]
fn a_grid_turned_by_rounding_keeps_no_needles() {
    for k in 0..40 {
        let turn = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.1 + 0.37 * f64::from(k), 0.7, 1.3);
        let points: Vec<DVec3> = cube_grid(6).into_iter().map(|p| turn * (173.0 * p) + 31.7).collect();
        let hull = convex_hull(&points).expect("a cube");
        assert_is_hull_of(&hull, &points);
        // A point within a side may stay as a corner if rounding puts it outermost; one on an edge may not.
        assert!(corners_on_their_longest_edge(&hull.vertices, &hull.faces, 1e-3).is_empty(), "turn {k}");
        assert!((hull.signed_volume() / 173f64.powi(3) - 1.0).abs() < 1e-12);
    }
}

#[test]
fn all_points_of_a_sphere_are_corners() {
    let points = sphere_points(700, 11);
    let hull = convex_hull(&points).expect("a hull");
    assert_eq!((hull.vertices.len(), hull.faces.len()), (700, 2 * 700 - 4));
    assert_eq!(hull.vertices, points, "corners keep their order");
    assert_is_hull_of(&hull, &points);
}

#[test]
fn needles_plates_and_far_away_bodies_have_hulls() {
    let scales = [DVec3::new(1.0, 1.0, 1e5), DVec3::new(1e5, 1e5, 1.0), DVec3::new(1e-3, 30.0, 100.0)];
    for (i, scale) in scales.into_iter().enumerate() {
        for far in [0.0, 1e6] {
            let points: Vec<DVec3> =
                sphere_points(300, i as u64).into_iter().map(|p| p * scale + far).collect();
            assert_is_hull_of(&convex_hull(&points).expect("a hull"), &points);
        }
    }
}

#[test]
fn points_without_volume_are_refused() {
    assert_eq!(convex_hull(&[DVec3::ZERO; 3]), Err(HullError::TooFew(3)));
    assert_eq!(convex_hull(&[DVec3::ONE; 9]), Err(HullError::Flat));
    let line: Vec<DVec3> = (0..9).map(|i| DVec3::splat(f64::from(i))).collect();
    assert_eq!(convex_hull(&line), Err(HullError::Flat));
    let tilted =
        |i: i32, j: i32| DVec3::new(f64::from(i), f64::from(j), 0.3 * f64::from(i) + 0.1 * f64::from(j));
    let plane: Vec<DVec3> = (0..25).map(|k| tilted(k % 5, k / 5)).collect();
    assert_eq!(convex_hull(&plane), Err(HullError::Flat));
    let mut points = sphere_points(9, 1);
    points[4].y = f64::NAN;
    assert_eq!(convex_hull(&points), Err(HullError::NotFinite(4)));
}

proptest! {
    #[test]
    fn random_points_lie_in_their_hull(
        raw in prop::collection::vec((-50.0..50.0f64, -50.0..50.0f64, -50.0..50.0f64), 4..120),
        coarse in 0.0..1.0f64,
        noise_exponent in -16.0..-7.0f64,
    ) {
        // Half of the cases sit on a coarse lattice, full of coplanar, collinear and equal points.
        let snap = |x: f64| if coarse < 0.5 { (x / 20.0).round() * 20.0 } else { x };
        let points: Vec<DVec3> = raw.iter().map(|&(x, y, z)| DVec3::new(snap(x), snap(y), snap(z))).collect();
        // The same, shaken by as much as rounding, the tolerance, or more.
        let noise = 10f64.powf(noise_exponent);
        let shaken: Vec<DVec3> =
            points.iter().zip(&raw).map(|(p, &(x, y, z))| p + noise * DVec3::new(z, x, y)).collect();
        if let Ok(hull) = convex_hull(&shaken) {
            assert_is_hull_within(&hull, &shaken, NEEDLE_RATIO);
        }
        if let Ok(hull) = convex_hull(&points) {
            assert_is_hull_of(&hull, &points);
        }
    }
}
