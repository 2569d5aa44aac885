//! Bodies that are parts of each other: what the lengths in one say of those in the other.

use glam::{DAffine3, DVec3};

use super::beams::{Random, cone, isotropic, parallel};
use super::bounds::{Answers, Differences};
use super::identities::image_of;
use super::verdict::{Claim, Verdict};
use super::{Oracles, Rays};
use crate::exact::Body;
use crate::geometry::{ClosedMesh, HULL_TOLERANCE, Interval, convex_hull};
use crate::modes::project::sweep::own_stretches;
use crate::scene::{Organ, Scene};

const ADDITIVITY: Claim = Claim {
    oracle: "split body",
    claim: "The lengths in the two parts of a body cut by a plane add up to the length in the whole.",
    source: "additivity of length",
};
const INCLUSION: Claim = Claim {
    oracle: "inclusion",
    claim: "No length in a body is longer than in a body around it.",
    source: "monotonicity of length",
};
const OWN_LENGTHS: Claim = Claim {
    oracle: "own lengths",
    claim: "Own lengths of all organs and the way outside, found from entry to exit, add up to the path.",
    source: "additivity of length over nested bodies",
};

/// The cut body's hull may leave out points that stick out of it by this share of an edge: see [`convex_hull`].
const HULL_EDGE_SHARE: f64 = 1e-8;
/// How much smaller the inner body is.
const INNER: f64 = 0.9;
/// What the sweep of stretches takes for rounding, over the distance from the source: see `sweep`.
const SWEEP_SHARE: f64 = 1e-9;

/// The verdicts on a body's own parts.
pub(super) fn all(oracles: &Oracles, subject: &str, body: &Body) -> [Verdict; 2] {
    if body.convexity().is_err() {
        return [ADDITIVITY, INCLUSION]
            .map(|claim| Verdict::does_not_apply(claim, subject, "it is not convex"));
    }
    [split(oracles, subject, body), inner_copy(oracles, subject, body)]
}

/// A view of the body, and random lines.
fn rays(oracles: &Oracles, subject: &str, oracle: &str, body: &Body) -> Vec<Rays> {
    let mut random = oracles.random(subject, oracle);
    let along = random.direction();
    let image = parallel(body, along, oracles.size.pixels, &mut random);
    let mut rays: Vec<Rays> = image.into_iter().map(|lattice| lattice.rays).collect();
    if oracles.witness.takes_lists(body) {
        rays.push(isotropic(body, oracles.size.lines, &mut random).0);
    }
    rays
}

fn split(oracles: &Oracles, subject: &str, body: &Body) -> Verdict {
    let Some(parts) = cut_in_two(body, &mut oracles.random(subject, "cut")) else {
        return Verdict::does_not_apply(ADDITIVITY, subject, "a part has no volume");
    };
    let moved = (HULL_EDGE_SHARE + HULL_TOLERANCE) * body.bounds().diagonal();
    let mut differences = Differences::default();
    for rays in rays(oracles, subject, ADDITIVITY.oracle, body) {
        let [whole, one, other] =
            [body, &parts[0], &parts[1]].map(|body| Answers::of(oracles.witness, body, &rays, moved));
        for i in 0..rays.count() {
            let sum = |of: fn(&Answers) -> &[f64]| of(&one)[i] + of(&other)[i];
            let (length, lengths) = (whole.lengths[i], sum(|a| &a.lengths));
            let rounding = whole.rounding[i] + sum(|a| &a.rounding);
            let promised = whole.promised + one.promised + other.promised;
            differences.add((length - lengths).abs(), rounding, promised, length != 0.0 || lengths != 0.0);
        }
    }
    verdict(ADDITIVITY, subject, &differences)
}

/// The parts of a convex body on either side of a random plane through its middle.
fn cut_in_two(body: &Body, random: &mut Random) -> Option<[Body; 2]> {
    let mesh = body.surface().mesh();
    let (middle, normal) = (middle_of(body), random.direction());
    let height = |v: DVec3| normal.dot(v - middle);
    let edges = mesh.triangles().flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]]);
    // Each edge has two faces, which run along it in opposite ways.
    let rising = edges.filter(|[a, b]| height(*a) < 0.0 && height(*b) > 0.0);
    let cut: Vec<DVec3> = rising.map(|[a, b]| a.lerp(b, height(a) / (height(a) - height(b)))).collect();
    let part = |side: f64| {
        let kept = mesh.vertices.iter().copied().filter(|v| side * height(*v) >= 0.0);
        let hull = convex_hull(&kept.chain(cut.iter().copied()).collect::<Vec<_>>()).ok()?;
        Some(Body::new(ClosedMesh::new(hull).ok()?.0))
    };
    Some([part(1.0)?, part(-1.0)?])
}

/// A point within a convex body: the mean of its vertices.
fn middle_of(body: &Body) -> DVec3 {
    let vertices = &body.surface().mesh().vertices;
    vertices.iter().sum::<DVec3>() / vertices.len() as f64
}

fn inner_copy(oracles: &Oracles, subject: &str, body: &Body) -> Verdict {
    let middle = middle_of(body);
    let shrink = DAffine3::from_translation(middle)
        * DAffine3::from_scale(DVec3::splat(INNER))
        * DAffine3::from_translation(-middle);
    match image_of(body, &shrink) {
        Some(inner) => inclusion(oracles, subject, &inner, body),
        None => Verdict::does_not_apply(INCLUSION, subject, "the smaller surface is no body"),
    }
}

/// Of an organ within another.
pub(super) fn nesting(oracles: &Oracles, organ: &Organ, parent: &Organ) -> Verdict {
    let subject = format!("{} in {}", organ.name, parent.name);
    inclusion(oracles, &subject, &organ.body, &parent.body)
}

fn inclusion(oracles: &Oracles, subject: &str, inner: &Body, outer: &Body) -> Verdict {
    let mut differences = Differences::default();
    for rays in rays(oracles, subject, INCLUSION.oracle, outer) {
        let [less, more] = [inner, outer].map(|body| Answers::of(oracles.witness, body, &rays, 0.0));
        for i in 0..rays.count() {
            let excess = less.lengths[i] - more.lengths[i];
            // Not `max`, which would take a NaN for none.
            let excess = if excess <= 0.0 { 0.0 } else { excess };
            let rounding = less.rounding[i] + more.rounding[i];
            differences.add(excess, rounding, less.promised + more.promised, less.lengths[i] != 0.0);
        }
    }
    verdict(INCLUSION, subject, &differences)
}

fn verdict(claim: Claim, subject: &str, differences: &Differences) -> Verdict {
    let (judged, unit) = differences.judged();
    Verdict::new(claim, subject, differences.rays(), judged, unit)
}

/// Of the whole scene: each ray's own lengths, by subtraction, against its stretches, by sweeping along it.
pub(super) fn own_lengths(oracles: &Oracles, scene: &Scene) -> Option<Verdict> {
    let mut random = oracles.random(&scene.name, OWN_LENGTHS.oracle);
    let whole = scene
        .organs
        .iter()
        .max_by(|a, b| a.body.bounds().diagonal().total_cmp(&b.body.bounds().diagonal()))?;
    let along = random.direction();
    let rays = cone(&whole.body, along, oracles.size.pixels, &mut random)?.rays;
    let answers: Vec<Answers> =
        scene.organs.iter().map(|organ| Answers::of(oracles.witness, &organ.body, &rays, 0.0)).collect();
    let mut chords: Vec<Vec<(usize, Interval)>> = vec![Vec::new(); rays.count()];
    for (organ, it) in scene.organs.iter().enumerate() {
        let parts = oracles.witness.parts(&it.body, &rays);
        parts.into_iter().for_each(|(ray, part)| chords[ray].push((organ, part)));
    }
    let promised = answers.iter().map(|answers| answers.promised).sum();
    let (mut differences, mut stops, mut stretches) = (Differences::default(), Vec::new(), Vec::new());
    for (ray, chords) in chords.iter().enumerate() {
        own_stretches(chords, |organ| scene.organs[organ].depth, &mut stops, &mut stretches);
        let path = answers[0].paths[ray];
        let outside = path - stretches.iter().map(|s| s.exit_mm - s.entry_mm).sum::<f64>();
        let own: f64 = scene
            .organs
            .iter()
            .enumerate()
            .map(|(i, organ)| {
                let within: f64 = organ.children.iter().map(|&child| answers[child].lengths[ray]).sum();
                answers[i].lengths[ray] - within
            })
            .sum();
        let rounding = answers.iter().map(|answers| answers.rounding[ray]).sum::<f64>();
        let left_out = 2.0 * chords.len() as f64 * SWEEP_SHARE * path;
        differences.add((own + outside - path).abs(), rounding + left_out, promised, !chords.is_empty());
    }
    Some(verdict(OWN_LENGTHS, &scene.name, &differences))
}
