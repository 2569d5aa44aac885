//! The same question asked in another way: reversed, or with body and rays moved alike.
//!
//! ```text
//!        ┌────┐                        an affine map keeps lines, insides, and ratios along a line:
//!   o────┼──▶─┼───t         o ╲        chord over path is the same before and after
//!        └────┘      map      ╱╲╲ ▶
//!                            ╱  ╱╲
//!                            ╲ ╱  t
//! ```

use glam::{DAffine3, DMat3, DVec3};

use super::beams::{cone, isotropic, parallel};
use super::bounds::{Answers, Differences, mapping_error_mm, reach_mm};
use super::verdict::{Claim, Verdict};
use super::{Oracles, Rays};
use crate::exact::Body;
use crate::geometry::ClosedMesh;

const REVERSAL: Claim = Claim {
    oracle: "reversal",
    claim: "A path has the same length in a body from either end.",
    source: "symmetry of distance",
};
const ROTATION: Claim = Claim {
    oracle: "rotation",
    claim: "Turning body and rays alike changes no length.",
    source: "Euclidean invariance",
};
const TRANSLATION: Claim = Claim {
    oracle: "translation",
    claim: "Moving body and rays alike changes no length.",
    source: "Euclidean invariance",
};
const SCALING: Claim = Claim {
    oracle: "scaling by powers of 2",
    claim: "Scaling body and rays by a power of two scales lengths by it, to the last bit.",
    source: "binary floating point: IEEE 754",
};
const AFFINE: Claim = Claim {
    oracle: "affine map",
    claim: "An affine map of body and rays keeps the ratio of each length to its path.",
    source: "affine invariance of ratios on a line",
};

/// Powers of two to scale by.
const POWERS: [i32; 2] = [9, -7];

/// The verdicts of all identities.
pub(super) fn all(oracles: &Oracles, subject: &str, body: &Body) -> Vec<Verdict> {
    let rays = rays(oracles, subject, body);
    let answers: Vec<_> = rays.iter().map(|rays| Answers::of(oracles.witness, body, rays, 0.0)).collect();
    let asked: Vec<_> = rays.iter().zip(&answers).collect();
    let size = body.bounds().diagonal();
    let mut random = oracles.random(subject, "maps");
    let turn = DMat3::from_axis_angle(random.direction(), 1.0 + random.unit());
    // Singular values from 0.6 to 1.6: pixels stay no more oblique than bounds allow for.
    let stretch = turn * DMat3::from_diagonal(DVec3::new(1.6, 1.0, 0.6)) * turn.transpose();
    let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.4, 1.0, 0.0), DVec3::new(-0.2, 0.3, 1.0));
    let away = size * (random.direction() + random.direction());
    vec![
        reversal(oracles, subject, body, &asked),
        mapped(oracles, ROTATION, subject, body, &asked, DAffine3::from_mat3(turn)),
        mapped(oracles, TRANSLATION, subject, body, &asked, DAffine3::from_translation(away)),
        mapped(
            oracles,
            AFFINE,
            subject,
            body,
            &asked,
            DAffine3::from_mat3_translation(stretch * shear, away),
        ),
        scaling(oracles, subject, body, &asked),
    ]
}

/// Rays of all kinds that the witness takes: a parallel image, one of a point source, random lines.
fn rays(oracles: &Oracles, subject: &str, body: &Body) -> Vec<Rays> {
    let mut random = oracles.random(subject, "rays of identities");
    let pixels = oracles.size.pixels;
    let mut direction = || random.direction();
    let (one, other) = (direction(), direction());
    let images = [parallel(body, one, pixels, &mut random), cone(body, other, pixels, &mut random)];
    let mut rays: Vec<Rays> = images.into_iter().flatten().map(|lattice| lattice.rays).collect();
    if oracles.witness.takes_lists(body) {
        rays.push(isotropic(body, oracles.size.lines, &mut random).0);
    }
    rays
}

type Asked<'a> = [(&'a Rays, &'a Answers)];

fn reversal(oracles: &Oracles, subject: &str, body: &Body, asked: &Asked) -> Verdict {
    let mut differences = Differences::default();
    for (rays, there) in asked {
        let reversed = rays.reversed();
        if matches!(reversed, Rays::List(_)) && !oracles.witness.takes_lists(body) {
            continue;
        }
        compare(there, &Answers::of(oracles.witness, body, &reversed, 0.0), &mut differences);
    }
    verdict(REVERSAL, subject, &differences)
}

fn mapped(
    oracles: &Oracles,
    claim: Claim,
    subject: &str,
    body: &Body,
    asked: &Asked,
    map: DAffine3,
) -> Verdict {
    let Some(image) = image_of(body, &map) else {
        return Verdict::does_not_apply(claim, subject, "the mapped surface is no body");
    };
    let mut differences = Differences::default();
    for (rays, before) in asked {
        let reach = rays.ends().into_iter().flatten().map(DVec3::length).fold(reach_mm(body), f64::max);
        let moved = mapping_error_mm(&map, reach);
        compare(before, &Answers::of(oracles.witness, &image, &rays.mapped(&map), moved), &mut differences);
    }
    verdict(claim, subject, &differences)
}

/// Adds how the shares of the paths differ, in mm of the first.
fn compare(one: &Answers, other: &Answers, differences: &mut Differences) {
    for i in 0..one.lengths.len().max(other.lengths.len()) {
        // A ray without an answer, or one too many, is no number, and within no bound.
        let of = |values: &[f64]| values.get(i).copied().unwrap_or(f64::NAN);
        let ratio = of(&one.paths) / of(&other.paths);
        let (a, b) = (of(&one.lengths), ratio * of(&other.lengths));
        let rounding = of(&one.rounding) + ratio * of(&other.rounding);
        let met = a != 0.0 || b != 0.0;
        differences.add((a - b).abs(), rounding, one.promised + ratio * other.promised, met);
    }
}

fn verdict(claim: Claim, subject: &str, differences: &Differences) -> Verdict {
    let (judged, unit) = differences.judged();
    Verdict::new(claim, subject, differences.rays(), judged, unit)
}

/// How many lengths are not the scaled ones, bit by bit.
fn scaling(oracles: &Oracles, subject: &str, body: &Body, asked: &Asked) -> Verdict {
    let (mut rays_asked, mut differ) = (0, 0);
    for factor in POWERS.map(|power| 2f64.powi(power)) {
        let map = DAffine3::from_scale(DVec3::splat(factor));
        let Some(image) = image_of(body, &map) else {
            return Verdict::does_not_apply(SCALING, subject, "the scaled surface is no body");
        };
        for (rays, before) in asked {
            let after = oracles.witness.lengths_at_scale(factor, &image, &rays.mapped(&map));
            rays_asked += after.len();
            differ += before.lengths.len().abs_diff(after.len());
            differ += before
                .lengths
                .iter()
                .zip(&after)
                .filter(|(a, b)| (*a * factor).to_bits() != b.to_bits())
                .count();
        }
    }
    Verdict::new(SCALING, subject, rays_asked, (differ as f64, 0.0), "lengths that differ")
}

/// The body moved by a map that turns no surface inside out. What rounded its vertices before is stretched, and what rounds
/// them now is added, so that a convex body stays one.
pub(super) fn image_of(body: &Body, map: &DAffine3) -> Option<Body> {
    let surface = body.surface();
    let stretch = map.matrix3.to_cols_array().into_iter().map(|x| x * x).sum::<f64>().sqrt();
    let grid_mm = stretch * surface.rounding_tolerance_mm() + mapping_error_mm(map, reach_mm(body));
    let moved = surface.mesh().clone().map_vertices(|v| map.transform_point3(v));
    Some(Body::new(ClosedMesh::new(moved).ok()?.0.with_written_grid_mm(grid_mm)))
}
