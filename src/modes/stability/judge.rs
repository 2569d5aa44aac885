//! What rounding may make of a length, and what it may not.

use glam::DVec3;

use crate::exact::judge::length_in_parallel_body;
use crate::exact::rational::of_triangles;
use crate::exact::{Body, Engine};
use crate::geometry::Segment;
use crate::geometry::numeric::gamma;

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

/// The least and the greatest length that rounding explains, mm. `exact_mm` is the one without any.
pub(super) fn explained(body: &Body, engine: Engine, ray: &Segment, exact_mm: Option<f64>) -> [f64; 2] {
    let shift = shift_mm(body, engine, ray);
    match body.convexity() {
        Ok(convex) => {
            let [least, most] = [-shift, shift].map(|s| length_in_parallel_body(convex, ray, s));
            [least - shift, most + shift]
        }
        Err(_) => explained_by_moved_rays(body, ray, shift, exact_mm.unwrap_or_else(|| exact(body, ray))),
    }
}

fn exact(body: &Body, ray: &Segment) -> f64 {
    of_triangles(body.surface(), ray.line()).within(&ray.reach()).length_mm()
}

/// No body is parallel to one that is not convex: the lengths of rays near by stand for it, without rounding. Their spread is
/// taken thrice, for ends of several parts move each by itself.
fn explained_by_moved_rays(body: &Body, ray: &Segment, shift: f64, exact_mm: f64) -> [f64; 2] {
    let [source, target] = [0.0, ray.length_mm()].map(|t| ray.line().at(t));
    let (u, v) = ray.line().dir().any_orthonormal_pair();
    let moves = [u, -u, v, -v].map(|to| 2.0 * shift * to);
    let pairs = moves.iter().flat_map(|a| moves.iter().map(move |b| (source + *a, target + *b)));
    let moved = pairs.filter_map(|(from, to)| Segment::between(from, to));
    let [least, most] = moved.fold([exact_mm; 2], |[least, most], ray| {
        let length = exact(body, &ray);
        [f64::min(least, length), f64::max(most, length)]
    });
    [exact_mm - 3.0 * (exact_mm - least) - 2.0 * shift, exact_mm + 3.0 * (most - exact_mm) + 2.0 * shift]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::ClosedMesh;
    use crate::geometry::primitives::{cube, icosphere, inside_out};

    const ENGINES: [Engine; 4] = [Engine::Clip, Engine::Walk, Engine::Raster, Engine::Bvh];

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
                let [least, most] = explained(&body, engine, &ray, None);
                assert!(least <= length && length <= most, "{engine:?}: {length}, from {least} to {most}");
                assert!(most - least < 1e-10, "{engine:?} would be allowed {}", most - least);
            }
        }
    }

    #[test]
    fn a_tangent_may_be_hit_or_missed_within_rounding_only() {
        let body = Body::new(ClosedMesh::new(cube(20.0)).expect("closed").0);
        let along_the_top = |z: f64| Segment::between(DVec3::new(-90.0, 3.0, z), DVec3::new(90.0, 3.0, z));
        let may_be = |z: f64, length: f64| {
            let [least, most] = explained(&body, Engine::Bvh, &along_the_top(z).expect("a ray"), None);
            least <= length && length <= most
        };
        assert!(may_be(10.0, 0.0) && may_be(10.0, 20.0) && !may_be(10.0, 20.1));
        assert!(!may_be(10.0 - 1e-9, 0.0) && !may_be(10.0 + 1e-9, 20.0));
    }
}
