//! Whether a point lies inside a closed surface, by exact signs.

use std::cmp::Ordering;

use glam::DVec3;

use super::TriMesh;
use super::boxtree::BoxTree;
use super::predicates::{cover, side_of_plane, squared_distance};

/// Where a point lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Strictly inside.
    Inside,
    /// On the surface.
    On,
    /// Strictly outside.
    Outside,
}

/// On which side of an outward-looking surface `point` lies.
pub fn side_of_surface(mesh: &TriMesh, tree: &BoxTree, point: DVec3) -> Side {
    match winding_around(mesh, tree, point) {
        None => Side::On,
        Some(turns) if turns > 0 => Side::Inside,
        Some(_) => Side::Outside,
    }
}

/// How often the surface winds around `point`: 1 inside an outward-looking surface, −1 inside an inward-looking one, 0
/// outside. `None` on the surface.
pub fn winding_around(mesh: &TriMesh, tree: &BoxTree, point: DVec3) -> Option<i32> {
    let (mut turns, mut on_surface) = (0, false);
    crossings_ahead(mesh, tree, point, |_, crossing| match crossing {
        Some(winding) => turns += winding,
        None => on_surface = true,
    });
    (!on_surface).then_some(turns)
}

/// Calls `found` for the faces that the ray from `point` along +x passes, with +1 where it leaves an outward-looking
/// surface and −1 where it enters, and with `None` for faces that hold the point.
///
/// Seen along x, a face covers the point or does not (ties broken by an infinitesimal move, consistently for all
/// faces), and whether it lies ahead is the sign of one determinant: no rounding enters.
pub fn crossings_ahead(
    mesh: &TriMesh,
    tree: &BoxTree,
    point: DVec3,
    mut found: impl FnMut(u32, Option<i32>),
) {
    tree.visit(
        |b| {
            let (low, high) = (b.min.cmple(point), b.max.cmpge(point));
            b.max.x >= point.x && low.y && low.z && high.y && high.z
        },
        |face| {
            let triangle = mesh.triangle(face as usize);
            let winding = cover(triangle.map(|v| [v.y, v.z]), [point.y, point.z]);
            let side = side_of_plane(triangle, point);
            if side == Ordering::Equal {
                if winding != 0 || squared_distance(point, triangle) == 0.0 {
                    found(face, None);
                }
            } else if winding != 0 {
                // Wound counter-clockwise in (y, z) the normal looks along +x: the face is ahead if the point is below.
                let is_ahead = (side == Ordering::Less) == (winding > 0);
                if is_ahead {
                    found(face, Some(winding));
                }
            }
        },
    );
}
