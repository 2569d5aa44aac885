//! Whether the components of one surface share volume.
//!
//! ```text
//! ┌────┬───┬────┐   two boxes with flush faces: no face passes strictly through another, yet the middle belongs to
//! │  a │a∩b│ b  │   both. Chords are those of the union, but the volume would count it twice.
//! └────┴───┴────┘
//! ```
//!
//! Each component is held on its own, looking outward, against every other whose box it touches. Apart or one wholly
//! within the other is what solids and cavities may be; and a solid lies in an even number of others, a cavity in an odd.

use std::ops::ControlFlow;

use rayon::prelude::*;

use super::boxtree::BoxTree;
use super::relation::{Relation, relation};
use super::{ClosedMesh, MeshFault, TriMesh};

/// Proves that no volume of `surface` is counted twice by its components. Contact within rounding is no overlap.
///
/// # Errors
/// [`MeshFault::CrossingComponents`] for the first pair that share a part of themselves,
/// [`MeshFault::OverlappingComponents`] for a solid within a solid or a cavity within nothing.
pub fn check_components(surface: &ClosedMesh) -> Result<(), MeshFault> {
    let of = surface.component_count();
    if of < 2 {
        return Ok(());
    }
    let parts = component_meshes(surface);
    let is_solid: Vec<bool> = parts.iter().map(|part| part.signed_volume() > 0.0).collect();
    let bodies: Vec<ClosedMesh> = parts
        .into_iter()
        .map(|part| ClosedMesh::new(part).map(|(body, _)| body.with_rounding_of(surface)))
        .collect::<Result<_, _>>()?;
    let pairs = touching_boxes(&bodies);
    let relations: Vec<Relation> = pairs.par_iter().map(|&(i, j)| relation(&bodies[i], &bodies[j])).collect();

    let mut solids_less_cavities_around = vec![0i64; of];
    for (&(i, j), relation) in pairs.iter().zip(relations) {
        let weight = |outer: usize| if is_solid[outer] { 1 } else { -1 };
        match relation {
            Relation::Disjoint => {}
            Relation::Inside => solids_less_cavities_around[i] += weight(j),
            Relation::Around => solids_less_cavities_around[j] += weight(i),
            Relation::Crossing { place, depth_mm } => {
                return Err(MeshFault::CrossingComponents {
                    components: [i + 1, j + 1],
                    of,
                    place,
                    depth_mm,
                });
            }
        }
    }
    let is_misplaced = |&c: &usize| solids_less_cavities_around[c] != i64::from(!is_solid[c]);
    match (0..of).find(is_misplaced) {
        Some(inner) => Err(MeshFault::OverlappingComponents { component: inner + 1, of }),
        None => Ok(()),
    }
}

/// Each component as a mesh of its own, wound as in the surface.
fn component_meshes(surface: &ClosedMesh) -> Vec<TriMesh> {
    let mesh = surface.mesh();
    let mut faces: Vec<Vec<usize>> = vec![Vec::new(); surface.component_count()];
    for (face, &component) in surface.component_of_face().iter().enumerate() {
        faces[component as usize].push(face);
    }
    // One table serves all components, so that many specks beside a large body cost their own size only. A vertex may
    // be a corner of several components, so an entry holds for the component it names.
    let mut new_index: Vec<(usize, u32)> = vec![(usize::MAX, 0); mesh.vertices.len()];
    faces
        .iter()
        .enumerate()
        .map(|(component, faces)| {
            let mut part = TriMesh::default();
            for &face in faces {
                part.faces.push(mesh.faces[face].map(|v| {
                    let entry = &mut new_index[v as usize];
                    if entry.0 != component {
                        *entry = (component, part.vertices.len() as u32);
                        part.vertices.push(mesh.vertices[v as usize]);
                    }
                    entry.1
                }));
            }
            part
        })
        .collect()
}

/// The pairs of bodies whose boxes touch, each once, in order.
fn touching_boxes(bodies: &[ClosedMesh]) -> Vec<(usize, usize)> {
    let tree = BoxTree::build(&bodies.iter().map(ClosedMesh::bounds).collect::<Vec<_>>());
    let mut pairs = Vec::new();
    let _ = tree.overlapping_pairs(&tree, |i, j| {
        let (i, j) = (i as usize, j as usize);
        if i < j && bodies[i].bounds().touches(&bodies[j].bounds()) {
            pairs.push((i, j));
        }
        ControlFlow::<()>::Continue(())
    });
    pairs.sort_unstable();
    pairs
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::primitives::{block, cube, icosphere, inside_out};
    use super::*;

    fn checked(parts: impl IntoIterator<Item = TriMesh>) -> Result<(), MeshFault> {
        let mut mesh = TriMesh::default();
        parts.into_iter().for_each(|part| mesh.append(&part));
        ClosedMesh::new(mesh).and_then(|(surface, _)| check_components(&surface))
    }

    #[test]
    fn boxes_that_share_volume_with_flush_faces_are_refused_with_the_place() {
        let overlapping = [block([0.0; 3], [4.0, 2.0, 2.0]), block([3.0, 0.0, 0.0], [7.0, 2.0, 2.0])];
        let Err(MeshFault::CrossingComponents { components, of, place, depth_mm }) = checked(overlapping)
        else {
            panic!("the middle would count twice")
        };
        assert_eq!((components, of), ([1, 2], 2));
        assert!(place.cmpge(DVec3::new(3.0, 0.0, 0.0)).all() && place.cmple(DVec3::new(4.0, 2.0, 2.0)).all());
        assert!(depth_mm > 0.1 && depth_mm <= 1.0, "{depth_mm}");
    }

    #[test]
    fn a_box_given_twice_is_refused() {
        assert!(checked([cube(2.0), cube(2.0)]).is_err());
    }

    #[test]
    fn a_box_in_a_box_all_of_whose_corners_and_centres_are_flush_is_refused() {
        // An octahedron with its corners on the cube's faces: in it, touching.
        let octahedron = TriMesh {
            vertices: [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|a| [a, -a]).collect(),
            faces: vec![
                [0, 2, 4],
                [2, 1, 4],
                [1, 3, 4],
                [3, 0, 4],
                [2, 0, 5],
                [1, 2, 5],
                [3, 1, 5],
                [0, 3, 5],
            ],
        };
        assert!(checked([cube(2.0), octahedron.clone()]).is_err());
        assert_eq!(checked([cube(2.0), inside_out(octahedron)]), Ok(()));
    }

    #[test]
    fn cavities_that_share_volume_are_refused() {
        let room = || block([0.0; 3], [9.0, 4.0, 4.0]);
        let hole = |x0: f64, x1: f64| inside_out(block([x0, 1.0, 1.0], [x1, 3.0, 3.0]));
        assert_eq!(checked([room(), hole(1.0, 4.0), hole(5.0, 8.0)]), Ok(()));
        let refused = checked([room(), hole(1.0, 5.0), hole(4.0, 8.0)]);
        assert!(
            matches!(refused, Err(MeshFault::CrossingComponents { components: [2, 3], .. })),
            "{refused:?}"
        );
    }

    #[test]
    fn boxes_face_to_face_hollow_balls_and_balls_in_them_are_accepted() {
        let stacked = [block([0.0; 3], [2.0; 3]), block([2.0, 0.0, 0.0], [4.0, 2.0, 2.0])];
        assert_eq!(checked(stacked), Ok(()));
        let ball = |radius: f64| icosphere(2).map_vertices(|v| radius * v);
        assert_eq!(checked([ball(10.0), inside_out(ball(8.0)), ball(5.0), inside_out(ball(3.0))]), Ok(()));
    }

    #[test]
    fn components_that_share_a_corner_are_parted_rightly() {
        // Two cubes that meet in one vertex of the mesh.
        let mut pair = cube(2.0);
        pair.append(&cube(2.0).map_vertices(|v| v + 2.0));
        let shared = pair.vertices.iter().position(|&v| v == DVec3::ONE).expect("a corner") as u32;
        let twin = pair.vertices.iter().rposition(|&v| v == DVec3::ONE).expect("a corner") as u32;
        assert_ne!(shared, twin);
        pair.faces.as_flattened_mut().iter_mut().filter(|v| **v == twin).for_each(|v| *v = shared);
        let (surface, _) = ClosedMesh::new(pair).expect("closed");
        assert_eq!(
            component_meshes(&surface).iter().map(|part| part.vertices.len()).collect::<Vec<_>>(),
            [8, 8]
        );
        assert_eq!(check_components(&surface), Ok(()));
    }
}
