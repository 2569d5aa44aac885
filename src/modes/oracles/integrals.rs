//! Many answers that add up to a number known of the body: its volume, its surface.
//!
//! ```text
//!    parallel rays:  Σ L dA = V          a point source:  Σ (t_out³ − t_in³)/3 dΩ = V        random lines:  E[L] = 4V/S
//!      │ │ │ │                              ╱│╲                                                ╲ │  ╱
//!      ▼ ▼ ▼ ▼                             ╱ ▼ ╲                                              ──╲┼─╱──
//! ```
//!
//! Volumes come with the standard error of 64 lattices moved at random: 4.5 of them are exceeded by chance once in 30 000
//! times, by Student's t. Means over random lines are held to 4.5 standard errors known beforehand.

use std::f64::consts::PI;

use super::beams::{Lattice, cone, isotropic, parallel};
use super::verdict::{Claim, Verdict};
use super::{Oracles, Rays};
use crate::exact::Body;
use crate::geometry::Interval;
use crate::geometry::numeric::gamma;

const PARALLEL: Claim = Claim {
    oracle: "parallel volume",
    claim: "Lengths of parallel rays times the area of each add up to the volume, from every side.",
    source: "Cavalieri and Fubini",
};
const CONE: Claim = Claim {
    oracle: "cone-beam volume",
    claim: "(t_out³ − t_in³)/3 times the solid angle of each ray of a point source add up to the volume.",
    source: "the volume element t² dt dΩ",
};
const MEAN_CHORD: Claim = Claim {
    oracle: "mean chord",
    claim: "The mean chord of uniform isotropic lines that meet a convex body is 4V/S.",
    source: "Cauchy and Crofton; Santaló 1976, Integral Geometry and Geometric Probability",
};
const FOURTH_POWER: Claim = Claim {
    oracle: "chord to the fourth",
    claim: "The mean fourth power of the chord of uniform isotropic lines that meet a convex body is 12V²/(πS).",
    source: "Crofton and Hadwiger; Santaló 1976, Integral Geometry and Geometric Probability",
};

/// Lattices for one mean.
const LATTICES: usize = 64;
/// How many standard errors a mean may be off.
const STANDARD_ERRORS: f64 = 4.5;
/// What rounding may do to a sum of lengths and to the volume of the mesh, over the volume: some thousand roundings in each
/// chain of sums, of distances up to a thousand times the chord. Far below any standard error.
const ROUNDING: f64 = 1e3 * gamma(1024);

/// The verdicts of all integrals.
pub(super) fn all(oracles: &Oracles, subject: &str, body: &Body) -> Vec<Verdict> {
    let mut verdicts = vec![parallel_volume(oracles, subject, body), cone_volume(oracles, subject, body)];
    verdicts.extend(crofton(oracles, subject, body));
    verdicts
}

fn parallel_volume(oracles: &Oracles, subject: &str, body: &Body) -> Verdict {
    let mut random = oracles.random(subject, PARALLEL.oracle);
    let directions: Vec<_> = (0..oracles.size.directions).map(|_| random.direction()).collect();
    let both_ways = directions.into_iter().flat_map(|along| [along, -along]);
    let mut worst = Deviation::NONE;
    for along in both_ways {
        let (lattices, sets) = lattices(|| parallel(body, along, oracles.size.pixels, &mut random));
        let lengths = oracles.witness.lengths_of_each(body, &sets);
        let sums = lattices.iter().zip(&lengths).map(|(lattice, lengths)| {
            let met = lengths.iter().filter(|l| **l != 0.0).count();
            let (total, rays) = (lengths.iter().sum::<f64>(), lengths.len() as f64);
            [total * lattice.cell_mm2, met as f64 * lattice.cell_mm2, rays]
        });
        worst = worst.or(Deviation::of(oracles, body, sums));
    }
    worst.verdict(PARALLEL, subject)
}

fn cone_volume(oracles: &Oracles, subject: &str, body: &Body) -> Verdict {
    let mut random = oracles.random(subject, CONE.oracle);
    let mut worst = Deviation::NONE;
    for _ in 0..oracles.size.directions {
        let along = random.direction();
        let (lattices, sets) = lattices(|| cone(body, along, oracles.size.pixels, &mut random));
        let parts = oracles.witness.parts_of_each(body, &sets);
        let sums = lattices.iter().zip(&parts).map(|(lattice, parts)| cone_sum(lattice, parts));
        worst = worst.or(Deviation::of(oracles, body, sums));
    }
    worst.verdict(CONE, subject)
}

/// The lattices of one mean, and their rays.
fn lattices(one: impl FnMut() -> Option<Lattice>) -> (Vec<Lattice>, Vec<Rays>) {
    let lattices: Vec<Lattice> = std::iter::repeat_with(one).take(LATTICES).flatten().collect();
    let sets = lattices.iter().map(|lattice| lattice.rays.clone()).collect();
    (lattices, sets)
}

/// Volume, volume per mm of length, and rays.
fn cone_sum(lattice: &Lattice, parts: &[(usize, Interval)]) -> [f64; 3] {
    // A pixel of area a, whose ray is ρ long and h deep, is seen under a h / ρ³ (to be integrated, not to be exact).
    let paths: Vec<f64> = lattice.rays.segments().iter().map(|ray| ray.length_mm()).collect();
    let mut sums = [0.0, 0.0, paths.len() as f64];
    for &(ray, part) in parts {
        let (near, far) = (part.start(), part.end());
        let solid_angle = lattice.cell_mm2 * lattice.depth_mm / paths[ray].powi(3);
        // (far³ − near³) / 3 without cancellation.
        sums[0] += part.length() * (far * far + far * near + near * near) / 3.0 * solid_angle;
        sums[1] += far * far * solid_angle;
    }
    sums
}

/// How far a mean is from the volume, over the volume.
#[derive(Clone, Copy)]
struct Deviation {
    off: f64,
    bound: f64,
    rays: usize,
}

impl Deviation {
    const NONE: Self = Self { off: 0.0, bound: f64::MIN_POSITIVE, rays: 0 };

    /// Of the volumes that lattices give; with each, by how much it changes per mm that all its lengths are off, and its rays.
    fn of(oracles: &Oracles, body: &Body, sums: impl Iterator<Item = [f64; 3]>) -> Self {
        let sums: Vec<_> = sums.collect();
        let volume = body.surface().volume_mm3();
        let (mean, standard_error) = mean_and_error(sums.iter().map(|[sum, ..]| *sum / volume));
        let per_mm = sums.iter().map(|[_, per_mm, _]| per_mm).sum::<f64>() / sums.len() as f64;
        let promised = oracles.witness.promised_error_mm(body) * per_mm / volume;
        Self {
            off: (mean - 1.0).abs(),
            bound: STANDARD_ERRORS * standard_error + promised + ROUNDING,
            rays: sums.iter().map(|[.., rays]| *rays as usize).sum(),
        }
    }

    /// The one nearer to its bound or farther beyond, with the rays of both.
    fn or(self, other: Self) -> Self {
        let rays = self.rays + other.rays;
        let other_is_worse = other.off.is_nan() || other.off / other.bound >= self.off / self.bound;
        Self { rays, ..if other_is_worse { other } else { self } }
    }

    fn verdict(self, claim: Claim, subject: &str) -> Verdict {
        Verdict::new(claim, subject, self.rays, (self.off, self.bound), "of the volume")
    }
}

fn mean_and_error(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let count = values.clone().count().max(2) as f64;
    let mean = values.clone().sum::<f64>() / count;
    let variance = values.map(|x| (x - mean) * (x - mean)).sum::<f64>() / (count - 1.0);
    (mean, (variance / count).sqrt())
}

fn crofton(oracles: &Oracles, subject: &str, body: &Body) -> [Verdict; 2] {
    let refuse = |why| [MEAN_CHORD, FOURTH_POWER].map(|claim| Verdict::does_not_apply(claim, subject, why));
    if body.convexity().is_err() {
        return refuse("it is not convex");
    }
    if !oracles.witness.takes_lists(body) {
        return refuse("the method casts images only");
    }
    let (rays, _) = isotropic(body, oracles.size.lines, &mut oracles.random(subject, MEAN_CHORD.oracle));
    let lengths = oracles.witness.lengths(body, &rays);
    let (volume, surface) = (body.surface().volume_mm3(), body.surface().mesh().area());
    let promised = oracles.witness.promised_error_mm(body);
    let longest = body.bounds().diagonal();
    // A length that is off by e changes its fourth power by 4 L³ e at most, L the longer of the two.
    let fourth = 4.0 * (longest + promised).powi(3) * promised;
    let powers: Vec<f64> = lengths.iter().map(|l| l.powi(4)).collect();
    let expected = [4.0 * volume / surface, 12.0 * volume * volume / (PI * surface)];
    [
        of_lines(MEAN_CHORD, subject, &lengths, expected[0], longest, promised),
        of_lines(FOURTH_POWER, subject, &powers, expected[1], longest.powi(4), fourth),
    ]
}

/// The mean of `values`, 0 to `largest`, over the lines that hit, held to `expected`.
///
/// The standard error is taken from what is known, not from the sample, which of a thin plate seldom has the few long
/// chords that make the mean: the variance of values up to M with mean μ is at most μ(M − μ) (Bhatia & Davis 2000,
/// doi:10.1080/00029890.2000.12005203). Values that rare are not normal: Bernstein's inequality adds M x / 3n to √(2x) = 4.5
/// standard errors.
fn of_lines(
    claim: Claim,
    subject: &str,
    values: &[f64],
    expected: f64,
    largest: f64,
    promised: f64,
) -> Verdict {
    let hits = values.iter().filter(|v| **v != 0.0).count().max(1) as f64;
    let mean = values.iter().sum::<f64>() / hits;
    let standard_error = (expected * (largest - expected) / hits).sqrt();
    let of_rare = largest * STANDARD_ERRORS * STANDARD_ERRORS / (6.0 * hits);
    let bound = (STANDARD_ERRORS * standard_error + of_rare + promised) / expected + ROUNDING;
    let off = (mean / expected - 1.0).abs();
    Verdict::new(claim, subject, values.len(), (off, bound), "of the expected mean")
}
