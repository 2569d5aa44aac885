//! What rounding may make of a length, and what it may not.

use glam::DVec3;

use crate::exact::judge::length_in_parallel_body;
use crate::exact::rational::{RationalChord, of_triangles};
use crate::exact::{Body, Engine};
use crate::geometry::numeric::{gamma, unit_normal};
use crate::geometry::{ConvexMesh, Interval, Segment};

/// How far rounding moves planes or vertices by an engine's promise, over their distance from the source; twice that, as the
/// judge's own planes are rounded too.
fn promised(engine: Engine) -> f64 {
    match engine {
        Engine::Clip | Engine::Walk | Engine::Bvh => gamma(16),
        // Of an image of one pixel that the ray meets at a right angle.
        Engine::Raster => gamma(2 * 96),
    }
}

/// How far the surface that an engine's length is exact for may be from the body's, mm.
fn shift_mm(body: &Body, engine: Engine, ray: &Segment) -> f64 {
    let bounds = body.bounds();
    let corners = bounds.corners().into_iter();
    let distance = corners.map(|c| (c - ray.line().origin()).length()).fold(ray.length_mm(), f64::max);
    // Clipping knows planes, whose normals are rounded, and the others vertices, which stand out of planes by so much.
    let between = body.convexity().map_or(0.0, |convex| convex.reflex_depth_mm());
    promised(engine) * distance + gamma(8) * bounds.diagonal() + between
}

/// What lengths of some rays rounding explains.
pub(super) struct Explained<'a> {
    body: &'a Body,
    rays: &'a [Segment],
    /// By the engines for single rays, whose promises are one; of convex bodies only.
    in_parallel_bodies: Vec<[f64; 2]>,
}

impl<'a> Explained<'a> {
    pub fn new(body: &'a Body, rays: &'a [Segment]) -> Self {
        let of_ray = |ray: &Segment| {
            let convex = body.convexity().ok()?;
            Some(between_parallel_bodies(convex, ray, shift_mm(body, Engine::Bvh, ray)))
        };
        Self { body, rays, in_parallel_bodies: rays.iter().filter_map(of_ray).collect() }
    }

    /// The least and the greatest length of a ray by an engine that rounding explains, mm. `exact` is the one without rounding,
    /// found if not given.
    pub fn by_rounding(&self, engine: Engine, ray: usize, exact: Option<&RationalChord>) -> [f64; 2] {
        let (body, at) = (self.body, &self.rays[ray]);
        let shift = shift_mm(body, engine, at);
        match body.convexity() {
            Ok(convex) if engine == Engine::Raster => between_parallel_bodies(convex, at, shift),
            Ok(_) => self.in_parallel_bodies[ray],
            Err(_) => {
                let exact_mm = exact.map_or_else(|| exact_length(body, at), RationalChord::length_mm);
                let open = near_surface_mm(body, at, shift) + 2.0 * shift;
                [exact_mm - open, exact_mm + open]
            }
        }
    }
}

fn between_parallel_bodies(convex: &ConvexMesh, ray: &Segment, shift: f64) -> [f64; 2] {
    let [least, most] = [-shift, shift].map(|s| length_in_parallel_body(convex, ray, s));
    [least - shift, most + shift]
}

fn exact_length(body: &Body, ray: &Segment) -> f64 {
    of_triangles(body.surface(), ray.line()).within(&ray.reach()).length_mm()
}

/// How much of a ray is no farther than `shift` from a body's surface, mm: what a surface that moves by so much may win or lose.
/// A little more near the corners of faces, which are taken to be as sharp when they are moved.
fn near_surface_mm(body: &Body, ray: &Segment, shift: f64) -> f64 {
    let mut near: Vec<Interval> =
        body.surface().mesh().triangles().filter_map(|face| near_face(face, ray, shift)).collect();
    near.sort_by(|a, b| a.start().total_cmp(&b.start()));
    let (mut total, mut end) = (0.0, f64::NEG_INFINITY);
    for part in near {
        total += (part.end() - part.start().max(end)).max(0.0);
        end = end.max(part.end());
    }
    total
}

/// The part of a ray in a face's prism: between planes beside it and beyond its edges, all `shift` off.
fn near_face(face: [DVec3; 3], ray: &Segment, shift: f64) -> Option<Interval> {
    let normal = unit_normal(face)?;
    let (o, d) = (ray.line().origin(), ray.line().dir());
    let outward = |i: usize| (face[(i + 1) % 3] - face[i]).cross(normal).normalize_or_zero();
    let sides =
        [(face[0], normal), (face[0], -normal)].into_iter().chain((0..3).map(|i| (face[i], outward(i))));
    sides.into_iter().try_fold(ray.reach(), |part, (point, outward)| {
        let (height, slope) = (outward.dot(point - o) + shift, outward.dot(d));
        let within = match slope {
            _ if slope > 0.0 => Interval::new(f64::NEG_INFINITY, height / slope),
            _ if slope < 0.0 => Interval::new(height / slope, f64::INFINITY),
            _ if height < 0.0 => None,
            _ => Some(Interval::EVERYTHING),
        };
        part.intersection(&within?)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::ClosedMesh;
    use crate::geometry::primitives::{cube, icosphere, inside_out};
    use crate::modes::stability::ENGINES;

    fn explained(body: &Body, engine: Engine, ray: &Segment) -> [f64; 2] {
        Explained::new(body, std::slice::from_ref(ray)).by_rounding(engine, 0, None)
    }

    #[test]
    fn a_steep_rays_length_is_known_to_a_few_units_of_the_distance() {
        let ball = icosphere(3).map_vertices(|v| 50.0 * v);
        let mut hollow = ball.clone();
        hollow.append(&inside_out(cube(20.0)));
        for mesh in [ball, hollow] {
            let body = Body::new(ClosedMesh::new(mesh).expect("closed").0);
            let ray =
                Segment::between(DVec3::new(-300.0, 3.0, 4.0), DVec3::new(300.0, 1.0, 5.0)).expect("a ray");
            let mut parts = Vec::new();
            body.chords_of_segment(&ray, &mut parts);
            let length: f64 = parts.iter().map(|part| part.length()).sum();
            for engine in ENGINES {
                let [least, most] = explained(&body, engine, &ray);
                assert!(least <= length && length <= most, "{engine:?}: {length}, from {least} to {most}");
                assert!(most - least < 1e-9, "{engine:?} would be allowed {}", most - least);
            }
        }
    }

    #[test]
    fn a_tangent_may_be_hit_or_missed_within_rounding_only() {
        let mut pair = cube(20.0);
        pair.append(&cube(2.0).map_vertices(|v| v + 50.0));
        for mesh in [cube(20.0), pair] {
            let body = Body::new(ClosedMesh::new(mesh).expect("closed").0);
            let along_the_top =
                |z: f64| Segment::between(DVec3::new(-90.0, 3.0, z), DVec3::new(90.0, 3.0, z));
            let may_be = |z: f64, length: f64| {
                let [least, most] = explained(&body, Engine::Bvh, &along_the_top(z).expect("a ray"));
                least <= length && length <= most
            };
            assert!(may_be(10.0, 0.0) && may_be(10.0, 20.0) && !may_be(10.0, 90.1));
            assert!(!may_be(10.0 - 1e-9, 0.0) && !may_be(10.0 + 1e-9, 20.0));
        }
    }
}
