//! What many errors amount to: counted one by one in any number of tallies, merged, and summed up.
//!
//! ```text
//!   errors ─► Tally ─┐             sums, the largest, and counts in bins 1/32 wide of their octave:
//!   errors ─► Tally ─┼─► Figures   ├┼┼┼┼┼┼┼┤├ ┼ ┼ ┼ ┼ ┤├   ┼   ┼   ┤   2⁻ᵏ … 2⁻ᵏ⁺¹ … 2⁻ᵏ⁺²
//!   errors ─► Tally ─┘
//! ```
//!
//! A tally holds some thousand counts at most, however many errors it has seen. Quantiles are upper edges of bins: never
//! too low, and too high by no more than 1/32 of themselves. Everything else is exact up to the rounding of sums, and the
//! sums are the same bits if tallies are merged in the same order.

use std::ops::AddAssign;

use serde::{Deserialize, Serialize};

/// Bits of the mantissa that tell bins apart: 2⁵ = 32 bins per octave.
const MANTISSA_BITS: u32 = 5;

/// How far a float's bits are shifted to give its bin: exponent and first bits of the mantissa stay. Positive floats are
/// ordered as their bits are.
const SHIFT: u32 = f64::MANTISSA_DIGITS - 1 - MANTISSA_BITS;

/// Two-sided 95 % of the normal distribution.
const Z_95: f64 = 1.959_963_984_540_054;

/// Counts of magnitudes in bins of equal relative width. Grows with the range of what it has seen.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Histogram {
    zeros: u64,
    /// The bin of `counts[0]`.
    first: u64,
    counts: Vec<u64>,
}

impl Histogram {
    fn add(&mut self, magnitude: f64) {
        if magnitude == 0.0 {
            self.zeros += 1;
        } else {
            *self.slot(magnitude.to_bits() >> SHIFT) += 1;
        }
    }

    fn slot(&mut self, bin: u64) -> &mut u64 {
        if self.counts.is_empty() {
            self.first = bin;
        }
        if bin < self.first {
            let missing = (self.first - bin) as usize;
            self.counts.splice(..0, std::iter::repeat_n(0, missing));
            self.first = bin;
        }
        let at = (bin - self.first) as usize;
        if at >= self.counts.len() {
            self.counts.resize(at + 1, 0);
        }
        &mut self.counts[at]
    }

    /// How many were exactly 0.
    pub fn zeros(&self) -> u64 {
        self.zeros
    }

    /// The bins that hold any, ascending: both edges, and how many; zeros are not among them.
    pub fn bins(&self) -> impl Iterator<Item = ([f64; 2], u64)> + '_ {
        let edge = |i: usize| f64::from_bits((self.first + i as u64) << SHIFT);
        let filled = self.counts.iter().enumerate().filter(|(_, count)| **count > 0);
        filled.map(move |(i, &count)| ([edge(i), edge(i + 1)], count))
    }

    /// The edges of the bin of the `rank`-th smallest, from 1.
    fn at_rank(&self, rank: u64) -> [f64; 2] {
        let mut seen = self.zeros;
        if rank <= seen {
            return [0.0; 2];
        }
        for (edges, count) in self.bins() {
            seen += count;
            if rank <= seen {
                return edges;
            }
        }
        [0.0; 2]
    }
}

impl AddAssign<&Self> for Histogram {
    fn add_assign(&mut self, other: &Self) {
        self.zeros += other.zeros;
        for (i, &count) in other.counts.iter().enumerate().filter(|(_, count)| **count > 0) {
            *self.slot(other.first + i as u64) += count;
        }
    }
}

/// Errors on the way to figures.
#[derive(Clone, Debug, PartialEq)]
pub struct Tally {
    tolerance: f64,
    count: u64,
    beyond: u64,
    sum: f64,
    sum_of_magnitudes: f64,
    sum_of_squares: f64,
    sum_of_references: f64,
    max: f64,
    histogram: Histogram,
}

impl Tally {
    /// No errors yet; those beyond `tolerance` will be counted.
    pub fn new(tolerance: f64) -> Self {
        Self {
            tolerance,
            count: 0,
            beyond: 0,
            sum: 0.0,
            sum_of_magnitudes: 0.0,
            sum_of_squares: 0.0,
            sum_of_references: 0.0,
            max: 0.0,
            histogram: Histogram::default(),
        }
    }

    /// Takes a signed error and the value it is an error of. What is not a number is taken for infinitely wrong.
    pub fn add(&mut self, error: f64, reference: f64) {
        let error = if error.is_nan() { f64::INFINITY } else { error };
        let magnitude = error.abs();
        self.count += 1;
        self.beyond += u64::from(magnitude > self.tolerance);
        self.sum += error;
        self.sum_of_magnitudes += magnitude;
        self.sum_of_squares += magnitude * magnitude;
        self.sum_of_references += reference;
        self.max = self.max.max(magnitude);
        self.histogram.add(magnitude);
    }

    /// How many there were.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The largest magnitude; 0 if there were none.
    pub fn max(&self) -> f64 {
        self.max
    }

    /// The counts by magnitude.
    pub fn histogram(&self) -> &Histogram {
        &self.histogram
    }

    /// Summed up. With `sampled`, the errors are a random sample of all that could be met, and the figures say within which
    /// bounds those of the whole lie.
    pub fn figures(&self, sampled: bool) -> Figures {
        let count = self.count.max(1) as f64;
        let quantile = |q: f64| {
            let rank = ((q * count).ceil() as u64).clamp(1, self.count.max(1));
            self.histogram.at_rank(rank)[1].min(self.max)
        };
        Figures {
            compared: self.count,
            mean_reference: self.sum_of_references / count,
            bias: self.sum / count,
            mean: self.sum_of_magnitudes / count,
            rms: (self.sum_of_squares / count).sqrt(),
            p50: quantile(0.5),
            p95: quantile(0.95),
            p99: quantile(0.99),
            p999: quantile(0.999),
            max: self.max,
            tolerance: self.tolerance,
            beyond_tolerance: self.beyond as f64 / count,
            confidence: (sampled && self.count > 0).then(|| self.confidence()),
        }
    }

    fn confidence(&self) -> Confidence {
        let n = self.count as f64;
        let mean = self.sum_of_magnitudes / n;
        let spread = (self.sum_of_squares / n - mean * mean).max(0.0).sqrt();
        let half = Z_95 * spread / n.sqrt();
        Confidence {
            level: 0.95,
            mean: [(mean - half).max(0.0), mean + half],
            p99: self.quantile_bounds(0.99),
            p999: self.quantile_bounds(0.999),
            beyond_tolerance: wilson(self.beyond as f64, n),
        }
    }

    /// Bounds of a quantile, whatever the distribution: the sample's values whose ranks are where the number of
    /// values below the quantile, which is binomial, lies with 95 %. No upper bound beyond the largest value seen.
    fn quantile_bounds(&self, q: f64) -> [Option<f64>; 2] {
        let n = self.count as f64;
        let (middle, half) = (q * n, Z_95 * (n * q * (1.0 - q)).sqrt());
        let edges = |rank: f64| (1.0..=n).contains(&rank).then(|| self.histogram.at_rank(rank as u64));
        let low = edges((middle - half).floor()).map(|edges| edges[0]);
        [low, edges((middle + half).ceil() + 1.0).map(|edges| edges[1].min(self.max))]
    }
}

impl AddAssign<&Self> for Tally {
    fn add_assign(&mut self, other: &Self) {
        self.count += other.count;
        self.beyond += other.beyond;
        self.sum += other.sum;
        self.sum_of_magnitudes += other.sum_of_magnitudes;
        self.sum_of_squares += other.sum_of_squares;
        self.sum_of_references += other.sum_of_references;
        self.max = self.max.max(other.max);
        self.histogram += &other.histogram;
    }
}

/// The score interval of a share, 95 % (Wilson 1927, doi:10.1080/01621459.1927.10502953).
fn wilson(hits: f64, n: f64) -> [f64; 2] {
    let (share, z2) = (hits / n, Z_95 * Z_95);
    let centre = share + z2 / (2.0 * n);
    let half = Z_95 * (share * (1.0 - share) / n + z2 / (4.0 * n * n)).sqrt();
    let scale = 1.0 + z2 / n;
    // At no hits and at nothing but hits the interval reaches the end, which rounding may miss.
    let low = if hits == 0.0 { 0.0 } else { (centre - half) / scale };
    let high = if hits == n { 1.0 } else { (centre + half) / scale };
    [low, high]
}

/// What errors amount to, in their own unit. All but `bias` are of magnitudes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// How many.
    pub compared: u64,
    /// The mean of the values they are errors of.
    pub mean_reference: f64,
    /// The signed mean.
    pub bias: f64,
    /// The mean.
    pub mean: f64,
    /// The root of the mean square.
    pub rms: f64,
    /// Half are no larger.
    pub p50: f64,
    /// 95 % are no larger.
    pub p95: f64,
    /// 99 % are no larger.
    pub p99: f64,
    /// 99.9 % are no larger.
    pub p999: f64,
    /// The largest.
    pub max: f64,
    /// The tolerance that the next is about.
    pub tolerance: f64,
    /// The share that is larger than the tolerance.
    pub beyond_tolerance: f64,
    /// Where the figures of all lines lie, if these are a random sample of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub confidence: Option<Confidence>,
}

/// Bounds for the whole of which a random sample was seen, errors taken as independent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Confidence {
    /// The probability with which bounds are meant to hold.
    pub level: f64,
    /// Of the mean magnitude: normal approximation.
    pub mean: [f64; 2],
    /// Of the 99 % quantile: order statistics; none where the sample is too small to tell.
    pub p99: [Option<f64>; 2],
    /// Of the 99.9 % quantile, likewise.
    pub p999: [Option<f64>; 2],
    /// Of the share beyond the tolerance: Wilson's score interval.
    pub beyond_tolerance: [f64; 2],
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    /// Errors over twenty decades, some of them 0.
    fn errors(seed: u64, count: usize) -> Vec<f64> {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        let mut error = || {
            let size = 10f64.powf(rng.random_range(-18.0..2.0));
            if rng.random_range(0..10) == 0 { 0.0 } else { size * rng.random_range(-1.0..1.0_f64).signum() }
        };
        (0..count).map(|_| error()).collect()
    }

    fn tally(errors: &[f64]) -> Tally {
        let mut tally = Tally::new(0.5);
        errors.iter().for_each(|&e| tally.add(e, 1.0));
        tally
    }

    #[test]
    fn quantiles_are_never_too_low_and_too_high_by_a_thirtysecond_at_most() {
        let errors = errors(1, 20_001);
        let figures = tally(&errors).figures(false);
        let mut sizes: Vec<f64> = errors.iter().map(|e| e.abs()).collect();
        sizes.sort_unstable_by(f64::total_cmp);
        for (q, found) in
            [(0.5, figures.p50), (0.95, figures.p95), (0.99, figures.p99), (0.999, figures.p999)]
        {
            let exact = sizes[(q * 20_001.0_f64).ceil() as usize - 1];
            assert!(exact <= found && found <= exact * (1.0 + 1.0 / 32.0), "{q}: {found}, not {exact}");
        }
        assert_eq!(figures.max, sizes[20_000]);
    }

    #[test]
    fn merged_tallies_count_as_one_of_all_errors() {
        let errors = errors(2, 5_000);
        let mut merged = Tally::new(0.5);
        errors.chunks(700).for_each(|part| merged += &tally(part));
        let (parts, whole) = (merged.figures(true), tally(&errors).figures(true));
        assert_eq!(merged.histogram(), tally(&errors).histogram());
        assert_eq!(
            (parts.p99, parts.max, parts.beyond_tolerance),
            (whole.p99, whole.max, whole.beyond_tolerance)
        );
        assert!((parts.mean - whole.mean).abs() <= 1e-12 * whole.mean);
        assert!((parts.bias - whole.bias).abs() <= 1e-12 * whole.mean);
    }

    #[test]
    fn bounds_from_samples_hold_the_truth_about_as_often_as_they_say() {
        // The magnitudes of a uniform error: mean 1/2, p99 0.99, share beyond 1/2 one half.
        let mut rng = rand_pcg::Pcg64::seed_from_u64(3);
        let mut held = [0; 3];
        for _ in 0..400 {
            let sample: Vec<f64> = (0..2_000).map(|_| rng.random_range(0.0..1.0)).collect();
            let bounds = tally(&sample).figures(true).confidence.expect("sampled");
            let within = |[low, high]: [f64; 2], truth: f64| usize::from(low <= truth && truth <= high);
            held[0] += within(bounds.mean, 0.5);
            held[1] += within(bounds.p99.map(|b| b.expect("large enough")), 0.99);
            held[2] += within(bounds.beyond_tolerance, 0.5);
        }
        // 400 trials at 95 %: standard deviation 4.4. Bins may widen the quantile's bounds.
        assert!(held.iter().all(|&h| h >= 362), "{held:?} of 400");
        assert_eq!(wilson(0.0, 50.0)[0], 0.0);
    }

    #[test]
    fn what_is_not_a_number_is_infinitely_wrong_and_nothing_is_no_error() {
        let figures = tally(&[1e-3, f64::NAN]).figures(false);
        assert_eq!((figures.max, figures.beyond_tolerance), (f64::INFINITY, 0.5));
        assert_eq!(Tally::new(0.5).figures(true).compared, 0);
        assert_eq!(tally(&[0.0, -0.0]).figures(false).max, 0.0);
    }
}
