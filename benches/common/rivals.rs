//! Public ray tracing crates at the same task. Neither has lengths: each gets the cheapest way to a convex body's chord
//! that it offers.

use std::time::Duration;

use chordfield::geometry::{ClosedMesh, Segment};
use glam::{DVec3, Vec3};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::Ray;
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use parry3d_f64::math::Vector;
use parry3d_f64::query::RayCast;
use parry3d_f64::shape::TriMesh;

use crate::rays::RaySet;
use crate::{Contestant, Tracer};

/// The preset whose trees are the fastest to trace, by 2 to 9 % before the next best.
pub const OBVHS_PRESET: BvhBuildParams = BvhBuildParams::very_slow_build();

/// obvhs: an eight-wide compressed hierarchy over triangles in f32 (Ylitie, Karras & Laine 2017,
/// doi:10.1145/3105762.3105773), four boxes at a time in SSE.
///
/// All hits are visited, without shortening the ray, and the chord is from the first to the last; two casts, one from either
/// end, take 8 to 40 % longer. Its triangles are those made ready for tracing, in the order of its leaves.
pub struct Obvhs {
    tree: CwBvh,
    triangles: Vec<RtTriangle>,
}

impl Obvhs {
    /// Builds with the best preset.
    pub fn new(surface: &ClosedMesh) -> Self {
        Self::with_preset(surface, OBVHS_PRESET)
    }

    /// Builds with any preset.
    pub fn with_preset(surface: &ClosedMesh, preset: BvhBuildParams) -> Self {
        let corner = |v: DVec3| v.as_vec3().to_array().into();
        let triangle = |[a, b, c]: [DVec3; 3]| Triangle { v0: corner(a), v1: corner(b), v2: corner(c) };
        let faces: Vec<_> = surface.mesh().triangles().map(triangle).collect();
        let tree = build_cwbvh_from_tris(&faces, preset, &mut Duration::default());
        let triangles =
            tree.primitive_indices.iter().map(|&i| RtTriangle::from(&faces[i as usize])).collect();
        Self { tree, triangles }
    }
}

fn ray_f32(start: DVec3, along: Vec3) -> Ray {
    Ray::new_inf(start.as_vec3().to_array().into(), along.normalize().to_array().into())
}

impl Obvhs {
    fn length(&self, ray: Ray) -> f64 {
        let (mut first, mut last) = (f32::INFINITY, f32::NEG_INFINITY);
        self.tree.ray_traverse_anyhit(ray, |ray, triangle| {
            let t = self.triangles[triangle].intersect(ray);
            if t < f32::INFINITY {
                (first, last) = (first.min(t), last.max(t));
            }
        });
        f64::from((last - first).max(0.0))
    }
}

impl Contestant for Obvhs {
    fn tracer<'a>(&'a self, rays: &'a RaySet) -> Option<Tracer<'a>> {
        let RaySet::Grid(grid) = rays else {
            return Some(Box::new(|region, lengths| {
                rays.each_of(region, |i, ray| {
                    let line = ray.line();
                    lengths[i] = self.length(ray_f32(line.origin(), line.dir().as_vec3()));
                });
            }));
        };
        // It need not pay for unit directions in f64.
        Some(Box::new(|region, lengths| {
            for (length, (column, row)) in lengths.iter_mut().zip(region.places()) {
                let target = grid.point(column, row);
                let start = grid.start_of(target);
                *length = self.length(ray_f32(start, (target - start).as_vec3()));
            }
        }))
    }
}

/// parry3d in f64: a binary hierarchy over triangles.
///
/// Its mesh gives the nearest hit only: one cast from the source finds the entry, one from the target back the exit, the
/// second only if the first hit. All faces whose boxes the ray meets, by its hierarchy's own iterator, take as long or up to
/// 12 % longer.
pub struct Parry {
    mesh: TriMesh,
}

impl Parry {
    /// Builds the mesh and its hierarchy.
    pub fn new(surface: &ClosedMesh) -> Self {
        let vertices = surface.mesh().vertices.iter().map(|v| Vector::from(v.to_array())).collect();
        let mesh = TriMesh::new(vertices, surface.mesh().faces.clone()).expect("a mesh with faces");
        Self { mesh }
    }

    fn length(&self, ray: &Segment) -> f64 {
        let cast = |from: DVec3, along: DVec3| {
            let ray = parry3d_f64::query::Ray::new(from.to_array().into(), along.to_array().into());
            self.mesh.cast_local_ray(&ray, f64::MAX, false)
        };
        let (line, length_mm) = (ray.line(), ray.length_mm());
        let Some(entry) = cast(line.origin(), line.dir()) else { return 0.0 };
        let before_target = cast(line.at(length_mm), -line.dir());
        before_target.map_or(0.0, |back| (length_mm - back - entry).max(0.0))
    }
}

impl Contestant for Parry {
    fn tracer<'a>(&'a self, rays: &'a RaySet) -> Option<Tracer<'a>> {
        Some(Box::new(|region, lengths| rays.each_of(region, |i, ray| lengths[i] = self.length(ray))))
    }
}
