//! Shapes that are the model's best and worst cases.

use glam::{DMat3, DVec3};

use crate::exact::Body;
use crate::geometry::primitives::{cube, icosphere, inside_out, prism, torus};
use crate::geometry::{ClosedMesh, TriMesh, convex_hull};

pub fn body(mesh: TriMesh) -> Body {
    let body = general(mesh);
    assert!(body.convexity().is_ok(), "{}", body.convexity().expect_err("not convex"));
    body
}

pub fn general(mesh: TriMesh) -> Body {
    Body::new(ClosedMesh::new(mesh).expect("closed").0)
}

pub fn together(a: TriMesh, b: TriMesh) -> TriMesh {
    let first = a.vertices.len() as u32;
    let faces = b.faces.iter().map(|face| face.map(|v| v + first));
    TriMesh {
        faces: a.faces.iter().copied().chain(faces).collect(),
        vertices: [a.vertices, b.vertices].concat(),
    }
}

/// Bodies that are not convex: one line's chords may be several, and a neighbour's one more.
pub fn general_shapes() -> Vec<(&'static str, Body)> {
    let ball = |subdivisions, radius: f64, middle: DVec3| {
        icosphere(subdivisions).map_vertices(|v| radius * v + middle)
    };
    // Far thinner than a cell, between the ball and the end of its box.
    let sliver = cube(1.0).map_vertices(|v| turn() * (v * DVec3::new(30.0, 20.0, 0.02)) + DVec3::X * 75.0);
    let hair = icosphere(1).map_vertices(|v| turn() * (v * DVec3::new(60.0, 0.05, 0.05)) + DVec3::Y * 85.0);
    vec![
        ("torus", general(torus(60.0, 25.0, 60).map_vertices(|v| turn() * v))),
        ("pair", general(together(ball(3, 50.0, DVec3::ZERO), ball(3, 30.0, DVec3::new(70.0, 60.0, 0.0))))),
        ("hollow", general(together(ball(3, 60.0, DVec3::ZERO), inside_out(ball(3, 40.0, DVec3::X * 5.0))))),
        ("sliver", general(together(ball(3, 50.0, DVec3::ZERO), sliver))),
        ("hair", general(together(ball(3, 50.0, DVec3::ZERO), hair))),
    ]
}

pub fn turn() -> DMat3 {
    DMat3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7)
}

pub fn ellipsoid(subdivisions: u32) -> Body {
    body(
        icosphere(subdivisions)
            .map_vertices(|v| turn() * (v * DVec3::new(100.0, 80.0, 60.0)) + DVec3::new(7.0, -300.0, 1e3)),
    )
}

/// The hull of a smooth body that no ellipsoid is like: of the fourth power.
pub fn superellipsoid() -> Body {
    let points: Vec<DVec3> = icosphere(4)
        .vertices
        .iter()
        .map(|v| turn() * (*v / v.abs().powf(4.0).element_sum().powf(0.25) * DVec3::new(90.0, 50.0, 70.0)))
        .collect();
    body(convex_hull(&points).expect("a hull"))
}

/// An ellipsoid cut flat on one side.
pub fn cut_ellipsoid() -> Body {
    let points: Vec<DVec3> = icosphere(4)
        .vertices
        .iter()
        .map(|v| turn() * (v.with_z(v.z.min(0.3)) * DVec3::new(100.0, 80.0, 60.0)))
        .collect();
    body(convex_hull(&points).expect("a hull"))
}

pub fn shapes() -> Vec<(&'static str, Body)> {
    vec![
        ("ellipsoid", ellipsoid(4)),
        ("superellipsoid", superellipsoid()),
        ("cut ellipsoid", cut_ellipsoid()),
        ("cylinder", body(prism(64).map_vertices(|v| v * DVec3::new(40.0, 40.0, 90.0)))),
        ("box", body(cube(1.0).map_vertices(|v| turn() * (v * DVec3::new(100.0, 60.0, 30.0))))),
        ("needle", body(icosphere(3).map_vertices(|v| turn() * (v * DVec3::new(100.0, 0.1, 0.1))))),
        ("plate", body(cube(1.0).map_vertices(|v| turn() * (v * DVec3::new(100.0, 100.0, 0.01))))),
    ]
}
