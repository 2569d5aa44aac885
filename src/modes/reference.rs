//! How far the reference itself is from the truth: lengths in f64 against the same in rationals.
//!
//! ```text
//!   engine ──── rounding ────▶ planes as stored ──── rounding of normals ────▶ triangles between the vertices
//!          ◀─────────────────────────── both ──────────────────────────────▶
//! ```

use rayon::prelude::*;
use serde::Serialize;

use crate::exact::rational::{RationalChord, Rounding, of_planes, of_triangles};
use crate::exact::{Body, Engine, Lengths};
use crate::geometry::Segment;

/// Errors of lengths in f64 against exact ones, over rays that one of the two says meet the body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct RoundingFigures {
    /// How many rays.
    pub compared: u64,
    /// Rays that one of the two says meet the body, and the other that they miss it.
    pub met_by_one: u64,
    /// The mean of the error, mm: its bias.
    pub bias_mm: f64,
    /// The mean of its size, mm.
    pub mean_mm: f64,
    /// The largest, mm.
    pub max_mm: f64,
    /// The mean of its size in units in the last place of the length.
    pub mean_ulps: f64,
    /// The largest.
    pub max_ulps: f64,
    /// The mean of its size in units in the last place of the distance from the source to the chord's far end.
    pub mean_ulps_of_distance: f64,
    /// The largest.
    pub max_ulps_of_distance: f64,
    /// The ray of the largest error in mm: its number among those given.
    pub worst_ray: Option<usize>,
}

/// What is known of one body's reference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ReferenceFigures {
    /// The engine against the planes as they are stored: what clipping computes. `None` if the body is not convex.
    pub against_planes: Option<RoundingFigures>,
    /// The engine against the triangles between the vertices: what the surface is.
    pub against_triangles: RoundingFigures,
    /// The planes as stored against the triangles, both exact: what the rounding of normals does. `None` if the body is not
    /// convex.
    pub planes_against_triangles: Option<RoundingFigures>,
}

impl ReferenceFigures {
    /// Recomputes the rays' lengths in `body`, as `engine` finds them, in rationals. The same for any number of threads.
    pub fn measure(body: &Body, engine: Engine, rays: &[Segment]) -> Self {
        let mut lengths = vec![0.0; rays.len()];
        body.trace(engine, 0, rays, &mut Lengths(&mut lengths));
        let judged: Vec<Judged> =
            rays.par_iter().zip(&lengths).map(|(ray, length)| Judged::new(body, ray, *length)).collect();
        let figures = |of: fn(&Judged) -> Option<Comparison>| {
            RoundingFigures::of(judged.iter().filter_map(of).enumerate())
        };
        let of_convex = |figures: RoundingFigures| body.convexity().is_ok().then_some(figures);
        Self {
            against_planes: of_convex(figures(|ray| ray.against_planes)),
            against_triangles: figures(|ray| Some(ray.against_triangles)),
            planes_against_triangles: of_convex(figures(|ray| ray.planes_against_triangles)),
        }
    }
}

/// A length and the exact one.
#[derive(Clone, Copy, Debug)]
struct Comparison {
    length_mm: f64,
    exact_mm: f64,
    rounding: Rounding,
}

impl Comparison {
    fn new(length_mm: f64, exact: &RationalChord) -> Self {
        Self { length_mm, exact_mm: exact.length_mm(), rounding: exact.rounding_of(length_mm) }
    }
}

/// All comparisons of a ray.
struct Judged {
    against_planes: Option<Comparison>,
    against_triangles: Comparison,
    planes_against_triangles: Option<Comparison>,
}

impl Judged {
    fn new(body: &Body, ray: &Segment, length_mm: f64) -> Self {
        let triangles = of_triangles(body.surface(), ray.line()).within(&ray.reach());
        let planes = body.convexity().ok().map(|body| of_planes(body, ray.line()).within(&ray.reach()));
        Self {
            against_planes: planes.as_ref().map(|planes| Comparison::new(length_mm, planes)),
            against_triangles: Comparison::new(length_mm, &triangles),
            // Rounded once to f64: half a unit in the last place is no matter here.
            planes_against_triangles: planes.map(|planes| Comparison::new(planes.length_mm(), &triangles)),
        }
    }
}

impl RoundingFigures {
    fn of(rays: impl Iterator<Item = (usize, Comparison)>) -> Self {
        let mut figures = Self::default();
        let (mut with_chord, mut max_mm) = (0_u64, -1.0);
        for (ray, Comparison { length_mm, exact_mm, rounding }) in rays {
            if length_mm == 0.0 && exact_mm == 0.0 {
                continue;
            }
            let error_mm = rounding.error_mm;
            figures.compared += 1;
            figures.met_by_one += u64::from((length_mm == 0.0) != (exact_mm == 0.0));
            figures.bias_mm += error_mm;
            figures.mean_mm += error_mm.abs();
            if error_mm.abs() > max_mm {
                max_mm = error_mm.abs();
                figures.worst_ray = Some(ray);
            }
            if let (Some(of_length), Some(of_distance)) = (rounding.ulps_of_length, rounding.ulps_of_distance)
            {
                with_chord += 1;
                figures.mean_ulps += of_length;
                figures.max_ulps = figures.max_ulps.max(of_length);
                figures.mean_ulps_of_distance += of_distance;
                figures.max_ulps_of_distance = figures.max_ulps_of_distance.max(of_distance);
            }
        }
        let (compared, with_chord) = (figures.compared.max(1) as f64, with_chord.max(1) as f64);
        figures.max_mm = f64::max(max_mm, 0.0);
        figures.bias_mm /= compared;
        figures.mean_mm /= compared;
        figures.mean_ulps /= with_chord;
        figures.mean_ulps_of_distance /= with_chord;
        figures
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::geometry::primitives::{cube, icosphere};
    use crate::geometry::{ClosedMesh, TriMesh};

    fn body(mesh: TriMesh) -> Body {
        Body::new(ClosedMesh::new(mesh).expect("closed").0)
    }

    fn rays_through(body: &Body, seed: u64, rays: usize) -> Vec<Segment> {
        let bounds = body.bounds();
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        let mut point = || {
            bounds.centre() + 0.3 * bounds.size() * DVec3::from([0; 3].map(|_| rng.random_range(-1.0..1.0)))
        };
        let across = |(a, b): (DVec3, DVec3)| Segment::between(a + 5.0 * (a - b), b + 5.0 * (b - a));
        (0..rays).filter_map(|_| across((point(), point()))).collect()
    }

    #[test]
    fn the_reference_errs_by_rounding_in_both_senses_and_normals_by_less() {
        let ball = body(icosphere(3).map_vertices(|v| DVec3::new(90.0, 70.0, 50.0) * v + 300.0));
        let rays = rays_through(&ball, 1, 500);
        for engine in [Engine::Clip, Engine::Walk, Engine::Bvh] {
            let figures = ReferenceFigures::measure(&ball, engine, &rays);
            let [planes, triangles, normals] = [
                figures.against_planes.expect("convex"),
                figures.against_triangles,
                figures.planes_against_triangles.expect("convex"),
            ];
            for figures in [planes, triangles, normals] {
                assert_eq!((figures.compared, figures.met_by_one), (500, 0));
                assert!(figures.max_mm < 1e-11 && figures.max_mm > 0.0, "{engine:?} {figures:?}");
                assert!(figures.mean_ulps_of_distance < 10.0, "{engine:?} {figures:?}");
            }
        }
    }

    #[test]
    fn a_body_that_is_not_convex_has_its_triangles_only() {
        let mut pair = cube(20.0);
        pair.append(&cube(10.0).map_vertices(|v| v + DVec3::new(31.0, 3.0, 1.0 / 3.0)));
        let pair = body(pair);
        let figures = ReferenceFigures::measure(&pair, Engine::Bvh, &rays_through(&pair, 2, 200));
        assert!(figures.against_planes.is_none() && figures.planes_against_triangles.is_none());
        assert!(figures.against_triangles.compared > 50 && figures.against_triangles.met_by_one == 0);
        assert!(figures.against_triangles.max_mm < 1e-11, "{figures:?}");
    }
}
