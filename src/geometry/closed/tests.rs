//! Closed surfaces: what is refused, what is mended, and what is found of them.

use super::*;
use crate::geometry::primitives::{block, cube, icosphere, inside_out};

#[test]
fn a_cube_is_closed_and_holds_its_volume() {
    let (mesh, notices) = ClosedMesh::new(cube(2.0)).expect("closed");
    assert!(notices.is_empty());
    assert_eq!((mesh.volume_mm3(), mesh.component_count(), mesh.genus()), (8.0, 1, 0));
    assert_eq!(mesh.side_of(DVec3::ZERO), Side::Inside);
    assert_eq!(mesh.side_of(DVec3::new(1.0, 0.2, 0.1)), Side::On);
    assert_eq!(mesh.distance_mm(DVec3::new(0.5, 0.0, 0.0)), 0.5);
}

#[test]
fn the_highest_vertex_is_that_of_all_and_nothing_reaches_above_it() {
    let mesh = icosphere(3).map_vertices(|v| v * DVec3::new(50.0, 30.0, 20.0));
    let (surface, _) = ClosedMesh::new(mesh).expect("closed");
    let from = DVec3::new(3.0, -4.0, 5.0);
    for i in 0..200 {
        let normal = DVec3::new(f64::from(i % 7) - 3.0, f64::from(i % 11) - 5.0, f64::from(i % 5) - 2.5);
        let heights = surface.mesh().vertices.iter().map(|v| normal.dot(*v - from));
        let highest = heights.fold(f64::NEG_INFINITY, f64::max);
        let found = surface.farthest_vertex(normal, from, f64::NEG_INFINITY).expect("a vertex");
        assert_eq!(found.0, highest);
        assert!(surface.farthest_vertex(normal, from, highest).is_none());
        for (above, reaches) in
            [(f64::NEG_INFINITY, true), (0.5 * highest, true), (highest.next_down(), true), (highest, false)]
        {
            assert_eq!(surface.reaches_above(normal, from, above), reaches, "{normal} {above}");
        }
    }
}

#[test]
fn an_inside_out_cube_is_turned_with_a_notice() {
    let (mesh, notices) = ClosedMesh::new(inside_out(cube(2.0))).expect("closed");
    assert_eq!(mesh.volume_mm3(), 8.0);
    assert_eq!(notices, [Notice::TurnedInsideOut { components: 1, of: 1 }]);
}

#[test]
fn a_single_turned_face_is_turned_back_with_a_notice() {
    let mut one_wrong = cube(2.0);
    one_wrong.faces[7].swap(0, 1);
    let (mesh, notices) = ClosedMesh::new(one_wrong).expect("closed");
    assert_eq!(mesh.volume_mm3(), 8.0);
    assert_eq!(notices, [Notice::TurnedFaces { turned: 1, of: 12 }]);
}

#[test]
fn a_missing_face_is_an_open_edge() {
    let mut open = cube(2.0);
    open.faces.pop();
    assert!(matches!(ClosedMesh::new(open), Err(MeshFault::Open { edges: 3, .. })));
}

#[test]
fn a_face_given_twice_is_not_manifold() {
    let mut doubled = cube(2.0);
    doubled.faces.push(doubled.faces[0]);
    assert!(matches!(ClosedMesh::new(doubled), Err(MeshFault::NotManifold { faces: 3, .. })));
}

#[test]
fn a_cavity_looks_inward_and_its_volume_is_taken_off() {
    let mut shell = cube(4.0);
    shell.append(&inside_out(cube(2.0)));
    let (mesh, notices) = ClosedMesh::new(shell.clone()).expect("closed");
    assert_eq!(notices, []);
    assert!((mesh.volume_mm3() - 56.0).abs() < 1e-12);
    assert_eq!(mesh.side_of(DVec3::ZERO), Side::Outside);

    let (mesh, notices) = ClosedMesh::new(inside_out(shell)).expect("closed");
    assert!((mesh.volume_mm3() - 56.0).abs() < 1e-12);
    assert_eq!(notices, [Notice::TurnedInsideOut { components: 2, of: 2 }]);
}

#[test]
fn a_solid_inside_a_solid_of_one_mesh_is_refused() {
    let mut nested = cube(4.0);
    nested.append(&cube(2.0));
    assert!(matches!(ClosedMesh::new(nested), Err(MeshFault::OverlappingComponents { .. })));
}

#[test]
fn a_component_against_the_wall_of_another_is_still_seen_to_lie_in_it() {
    let room = || block([0.0; 3], [4.0; 3]);
    let mut hollow = room();
    hollow.append(&inside_out(block([0.0, 1.0, 1.0], [2.0, 3.0, 3.0])));
    let (mesh, notices) = ClosedMesh::new(hollow).expect("closed");
    assert_eq!(notices, []);
    assert!((mesh.volume_mm3() - 56.0).abs() < 1e-12);

    let mut doubled = room();
    doubled.append(&block([0.0, 1.0, 1.0], [2.0, 3.0, 3.0]));
    let refused = MeshFault::OverlappingComponents { component: 2, of: 2 };
    assert_eq!(ClosedMesh::new(doubled).err(), Some(refused));
}

#[test]
fn a_solid_inside_a_solid_is_refused_also_if_both_are_inside_out() {
    let mut nested = cube(4.0);
    nested.append(&cube(2.0));
    let refused = MeshFault::OverlappingComponents { component: 2, of: 2 };
    assert_eq!(ClosedMesh::new(inside_out(nested)).err(), Some(refused));
}

#[test]
fn each_solid_is_turned_with_its_own_cavity_only() {
    let mut shell = cube(4.0);
    shell.append(&inside_out(cube(2.0)));
    let mut two = shell.clone();
    two.append(&inside_out(shell).map_vertices(|v| v + 10.0));
    let (mesh, notices) = ClosedMesh::new(two).expect("closed");
    assert!((mesh.volume_mm3() - 112.0).abs() < 1e-11);
    assert_eq!(notices, [Notice::TurnedInsideOut { components: 2, of: 4 }]);
    assert_eq!(mesh.first_faces().collect::<Vec<_>>(), [0, 12, 24, 36]);
}

#[test]
fn a_speck_beside_a_large_body_is_not_flat() {
    let mut mesh = cube(2000.0);
    mesh.append(&cube(0.05).map_vertices(|v| v + 3000.0));
    assert_eq!(ClosedMesh::new(mesh).expect("closed").0.component_count(), 2);
}

#[test]
fn nan_bad_index_and_flat_meshes_are_refused() {
    let mut nan = cube(2.0);
    nan.vertices[3].y = f64::NAN;
    assert_eq!(ClosedMesh::new(nan).err(), Some(MeshFault::NotFinite { vertex: 4 }));
    let mut bad = cube(2.0);
    bad.faces[2][1] = 99;
    assert_eq!(ClosedMesh::new(bad).err(), Some(MeshFault::IndexOutOfRange { face: 3, vertices: 8 }));
    let flat = icosphere(1).map_vertices(|v| DVec3::new(v.x, v.y, 0.0));
    assert!(matches!(ClosedMesh::new(flat), Err(MeshFault::Flat { .. })));
    assert_eq!(ClosedMesh::new(TriMesh::default()).err(), Some(MeshFault::Empty));
}
